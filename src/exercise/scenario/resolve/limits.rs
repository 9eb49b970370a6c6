//! Limits of force and speed, with complaints about those that cannot hold.

use super::file::{LimitPlaceFile, LimitResponseFile, LimitsFile, NearLimitFile, ScenarioFile, ZoneRole};
use super::{ResolveMode, Resolver};
use crate::catalog::TissueRole;
use crate::scenario::{ContactLimit, LimitPlace, LimitedQuantity, Zone};
use typodont_core::touch::CuttingLaw;
use typodont_formats::diagnostic::did_you_mean;

impl Resolver<'_> {
    /// Returns the limits, those near a zone or a tissue first: they say most about what is wrong.
    pub(super) fn limits(&mut self, written: &ScenarioFile, zones: &[Zone], law: CuttingLaw) -> Vec<ContactLimit> {
        let &LimitsFile { warning_force_n, cry_force_n, warning_speed_mm_s, cry_speed_mm_s, ref near } =
            &written.limits;
        let mut limits: Vec<ContactLimit> = Vec::new();
        for (index, limit) in near.iter().enumerate() {
            limits.extend(self.near_limits(limit, zones, &format!("/limits/near/{index}")));
        }
        let anywhere =
            |quantity, most, warns| ContactLimit { place: LimitPlace::Anywhere, quantity, most, warns, cries: !warns };
        limits.push(anywhere(LimitedQuantity::Force, warning_force_n, true));
        limits.push(anywhere(LimitedQuantity::Force, cry_force_n, false));
        limits.extend(warning_speed_mm_s.map(|most| anywhere(LimitedQuantity::Speed, most, true)));
        limits.extend(cry_speed_mm_s.map(|most| anywhere(LimitedQuantity::Speed, most, false)));
        self.find_forces_too_low_to_cut(written, law);
        limits
    }

    fn near_limits(&mut self, written: &NearLimitFile, zones: &[Zone], path: &str) -> Vec<ContactLimit> {
        let place = match &written.place {
            LimitPlaceFile::Tissue(name) => LimitPlace::Tissue(self.label(name, &format!("{path}/place/tissue"))),
            LimitPlaceFile::Zone(id) => match zones.iter().position(|zone| zone.id == *id) {
                Some(zone) => LimitPlace::Zone(zone),
                None => {
                    let help = did_you_mean(id, zones.iter().map(|zone| zone.id.as_str()));
                    let path = format!("{path}/place/zone");
                    self.complain(&path, "unknown-zone", format!("there is no zone \"{id}\""), help);
                    return Vec::new();
                }
            },
        };
        if written.force_n.is_none() && written.speed_mm_s.is_none() {
            let help = "add \"force_n\" or \"speed_mm_s\", or remove the entry";
            self.complain(path, "no-limit", "the entry limits neither the force nor the speed", help);
        }
        let warns = matches!(written.response, LimitResponseFile::Warning | LimitResponseFile::Both);
        let cries = matches!(written.response, LimitResponseFile::Cry | LimitResponseFile::Both);
        let limit = |quantity, most| ContactLimit { place, quantity, most, warns, cries };
        let force = written.force_n.map(|most| limit(LimitedQuantity::Force, most));
        let speed = written.speed_mm_s.map(|most| limit(LimitedQuantity::Speed, most));
        force.into_iter().chain(speed).collect()
    }

    /// Complains about limits of the force with which nothing that the exercise asks to remove can be cut: whoever works
    /// would be warned all the time. Under the rate law any force cuts.
    fn find_forces_too_low_to_cut(&mut self, written: &ScenarioFile, law: CuttingLaw) {
        if self.mode == ResolveMode::FromRecording {
            return;
        }
        let is_cut = written.stages.iter().any(|stage| stage.cutting) && law == CuttingLaw::Threshold;
        let Some(needed) = self.least_cutting_force(written).filter(|_| is_cut) else { return };
        let limits = &written.limits;
        let near = limits.near.iter().enumerate().filter(|(_, limit)| !self.is_never_cut(written, &limit.place));
        let near = near.filter_map(|(index, limit)| Some((format!("/limits/near/{index}/force_n"), limit.force_n?)));
        // The usual values are not judged: an exercise without limits stays valid.
        let anywhere = [
            ("warning_force_n", limits.warning_force_n, ContactLimit::WARNING_FORCE),
            ("cry_force_n", limits.cry_force_n, ContactLimit::CRY_FORCE),
        ];
        let anywhere = anywhere.into_iter().filter(|(_, most, default)| most != default);
        let anywhere = anywhere.map(|(key, most, _)| (format!("/limits/{key}"), most));
        let too_low: Vec<_> = near.chain(anywhere).filter(|(_, most)| *most < needed).collect();
        for (path, most) in too_low {
            let message = format!("the limit of {most} N is below the {needed} N that cutting needs");
            self.complain(&path, "limit-below-cutting", message, format!("write at least {needed}"));
        }
    }

    /// Returns the least force that cuts any of the decay, or any tissue if there is no decay, N.
    fn least_cutting_force(&self, written: &ScenarioFile) -> Option<f32> {
        let teeth = super::written_teeth(&written.scene);
        let decay: Vec<&str> = teeth
            .iter()
            .flat_map(|tooth| &tooth.decay)
            .flat_map(|d| std::iter::once(&d.tissue).chain(d.rim.iter().map(|rim| &rim.tissue)))
            .map(String::as_str)
            .collect();
        let sound = |role| matches!(role, TissueRole::Sound);
        let all = self.tissues.entries().iter();
        let cut = all.filter(|e| if decay.is_empty() { sound(e.role) } else { decay.contains(&e.name.as_str()) });
        cut.filter_map(|entry| entry.cut_force_n).reduce(f32::min)
    }

    /// True for a place in which nothing is to be cut, such as the pulp, gingiva or a zone to be preserved: its limit may be
    /// as low as its author wants.
    fn is_never_cut(&self, written: &ScenarioFile, place: &LimitPlaceFile) -> bool {
        let is_spared = |role| matches!(role, TissueRole::Vulnerable | TissueRole::Soft | TissueRole::Neighbour);
        match place {
            LimitPlaceFile::Zone(id) => {
                written.zones.iter().any(|zone| zone.id == *id && zone.role == ZoneRole::NeverRemove)
            }
            LimitPlaceFile::Tissue(name) => {
                let entry = self.tissues.by_name(name);
                entry.is_none_or(|entry| entry.cut_force_n.is_none() || is_spared(entry.role))
            }
        }
    }
}
