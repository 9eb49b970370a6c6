//! The limits of an exercise while it is performed.
//!
//! Takes the ticks of a session, live or replayed. Gives the exceedances of each limit, equal in both. Never influences a
//! measure.

use super::contact_motion::{ContactMotion, ContactTick};
use super::removal_comparison::ProximityField;
use crate::scenario::{ContactLimit, LimitPlace, LimitedQuantity, Scenario, Workpiece};
use typodont_core::sim::Step;
use typodont_core::tick::Tick;
use typodont_core::volume::Label;

/// Time without a value above a limit after which the next one is an exceedance of its own, ticks: a warning that is
/// shown for less than half a second cannot be read, and a cry lasts about as long.
pub const EXCEEDANCE_GAP_TICKS: u64 = 600;

/// A period in which a limit was exceeded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exceedance {
    /// Index into [`Scenario::limits`].
    pub limit: usize,
    /// First and last tick above the limit.
    pub span: [Tick; 2],
    /// Greatest value, N or mm/s.
    pub peak: f32,
}

/// Compares every tick with the limits of an exercise.
#[derive(Clone, Debug)]
pub struct LimitMonitor {
    limits: Vec<ContactLimit>,
    /// Surroundings of each place that a limit names.
    fields: Vec<(LimitPlace, ProximityField)>,
    motion: ContactMotion,
    /// All exceedances, in the order in which they began.
    exceedances: Vec<Exceedance>,
    /// Index of the last exceedance of each limit.
    last: Vec<Option<usize>>,
}

impl LimitMonitor {
    pub fn new(scenario: &Scenario, workpiece: &Workpiece) -> LimitMonitor {
        let initial = &workpiece.volume;
        let within = scenario.measures.pulp_proximity;
        let mut fields: Vec<(LimitPlace, ProximityField)> = Vec::new();
        for place in scenario.limits.iter().map(|limit| limit.place) {
            let field = match place {
                _ if fields.iter().any(|(known, _)| *known == place) => continue,
                LimitPlace::Anywhere => continue,
                LimitPlace::Zone(zone) => ProximityField::around_zone(&scenario.zones[zone], scenario, initial, within),
                LimitPlace::Tissue(label) => ProximityField::around_tissue(label, initial, within),
            };
            fields.push((place, field));
        }
        LimitMonitor {
            limits: scenario.limits.clone(),
            fields,
            motion: ContactMotion::new(workpiece.world_from_tooth),
            exceedances: Vec::new(),
            last: vec![None; scenario.limits.len()],
        }
    }

    pub fn observe(&mut self, step: &Step) {
        let seen = self.motion.observe(step.tick, step);
        for index in 0..self.limits.len() {
            if let Some(value) = self.value_above(index, &seen) {
                self.note(index, step.tick, value);
            }
        }
    }

    /// Returns all exceedances in the order in which they began.
    pub fn exceedances(&self) -> &[Exceedance] {
        &self.exceedances
    }

    /// Returns the exceedance of which a warning is shown at a tick: of the first limit that warns and was exceeded less
    /// than [`EXCEEDANCE_GAP_TICKS`] ago. Others do not interrupt it: a warning that flickers cannot be read.
    pub fn warning(&self, now: Tick) -> Option<Exceedance> {
        let mut latest = self.latest(|limit| limit.warns);
        latest.find(|e| now.0.saturating_sub(e.span[1].0) < EXCEEDANCE_GAP_TICKS)
    }

    /// Returns the greatest excess over a limit that causes cries, as a share of that limit, if one was exceeded after a
    /// tick.
    pub fn painful_excess(&self, after: Tick) -> Option<f32> {
        let recent = self.latest(|limit| limit.cries).filter(|e| e.span[1] > after);
        recent.map(|e| e.peak / self.limits[e.limit].most - 1.0).reduce(f32::max)
    }

    /// Returns the latest exceedance of each limit of a kind, in the order of the limits.
    fn latest(&self, is_asked: impl Fn(&ContactLimit) -> bool) -> impl Iterator<Item = Exceedance> {
        let asked = self.last.iter().zip(&self.limits).filter(move |(_, limit)| is_asked(limit));
        asked.filter_map(|(last, _)| last.map(|index| self.exceedances[index]))
    }

    /// Returns the value of a limit's quantity at a tick if it is above the limit.
    fn value_above(&self, index: usize, seen: &ContactTick) -> Option<f32> {
        let limit = &self.limits[index];
        let (value, tissue) = match limit.quantity {
            LimitedQuantity::Force => seen.contact.map(|contact| (contact.force, contact.tissue))?,
            LimitedQuantity::Speed => {
                let span = seen.span?;
                (span.speed as f32, span.contact?.tissue)
            }
        };
        (value > limit.most && self.is_at_place(index, seen, tissue)).then_some(value)
    }

    fn is_at_place(&self, index: usize, seen: &ContactTick, touched: Label) -> bool {
        let place = self.limits[index].place;
        let field = self.fields.iter().find(|(known, _)| *known == place);
        let is_touched = place == LimitPlace::Tissue(touched);
        field.is_none_or(|(_, field)| is_touched || field.is_near(seen.place))
    }

    fn note(&mut self, limit: usize, tick: Tick, value: f32) {
        if let Some(known) = self.last[limit].map(|index| &mut self.exceedances[index])
            && tick.0 - known.span[1].0 < EXCEEDANCE_GAP_TICKS
        {
            known.span[1] = tick;
            known.peak = known.peak.max(value);
            return;
        }
        self.last[limit] = Some(self.exceedances.len());
        self.exceedances.push(Exceedance { limit, span: [tick, tick], peak: value });
    }
}
