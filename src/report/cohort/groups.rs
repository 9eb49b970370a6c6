//! Sessions that may be compared with each other.

use super::Cohort;
use crate::display_format;
use crate::language::Message;
use crate::session_file::SessionFile;

/// Steps of the voxel size in which sizes are told apart, mm.
const VOXEL_STEP_MM: f64 = 1e-4;

/// Letters of a tooth's digest that are shown where two teeth have the same number.
const DIGEST_SHOWN: usize = 6;

/// Conditions that must agree for the results of two sessions to be compared: another tooth, voxel size or scorer version
/// gives the same work other numbers. What a session does not say is a value of its own.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ComparableGroup {
    pub scenario: String,
    pub tooth_fdi: Option<u8>,
    pub tooth_sha256: Option<String>,
    /// In steps of [`VOXEL_STEP_MM`].
    voxel_steps: Option<[u32; 3]>,
    /// 0 for values entered by hand.
    pub scorer_version: u32,
}

impl ComparableGroup {
    pub fn of(session: &SessionFile) -> ComparableGroup {
        // The digest is that of the voxels, so that it is another one for every voxel size.
        ComparableGroup {
            scenario: session.scenario.id.clone(),
            tooth_fdi: session.tooth_fdi,
            tooth_sha256: session.tooth_sha256.clone(),
            voxel_steps: session.voxel_mm.map(voxel_steps),
            scorer_version: session.scorer_version,
        }
    }

    /// True for a session under these conditions.
    pub fn contains(&self, session: &SessionFile) -> bool {
        ComparableGroup::of(session) == *self
    }

    /// Size of a voxel, mm.
    pub fn voxel_mm(&self) -> Option<[f64; 3]> {
        self.voxel_steps.map(|steps| steps.map(|step| f64::from(step) * VOXEL_STEP_MM))
    }

    /// The conditions in words, such as "tooth 36, voxels of 0.1 mm, scorer version 2". The beginning of the tooth's digest
    /// is added if it is needed to tell teeth of `all` apart.
    pub(super) fn description(&self, all: &[ComparableGroup]) -> Message {
        let unknown = || Message::text("cohort.group_unknown", &[]);
        let is_ambiguous = all.iter().any(|other| {
            (other.tooth_fdi, other.voxel_steps) == (self.tooth_fdi, self.voxel_steps)
                && other.tooth_sha256 != self.tooth_sha256
        });
        let number = self.tooth_fdi.map_or_else(unknown, |fdi| Message::plain(fdi.to_string()));
        let tooth = match self.tooth_sha256.as_ref().filter(|_| is_ambiguous) {
            None => number,
            Some(digest) => {
                let digest: String = digest.chars().take(DIGEST_SHOWN).collect();
                Message::text("cohort.group_model", &[("tooth", number), ("model", Message::plain(digest))])
            }
        };
        let voxel = match self.voxel_mm() {
            None => unknown(),
            Some([x, y, z]) if x == y && y == z => Message::plain(format!("{} mm", display_format::plain_number(x))),
            Some(sizes) => Message::plain(format!("{} mm", sizes.map(display_format::plain_number).join(" × "))),
        };
        let scorer = match self.scorer_version {
            0 => unknown(),
            version => Message::plain(version.to_string()),
        };
        Message::text("cohort.group_conditions", &[("tooth", tooth), ("voxel", voxel), ("scorer", scorer)])
    }
}

fn voxel_steps(voxel_mm: [f64; 3]) -> [u32; 3] {
    voxel_mm.map(|mm| (mm / VOXEL_STEP_MM).round() as u32)
}

impl Cohort {
    /// Groups of an exercise's sessions, that with the most sessions first.
    pub(super) fn groups_of(&self, scenario: &str) -> Vec<ComparableGroup> {
        let mut counts: std::collections::BTreeMap<ComparableGroup, usize> = std::collections::BTreeMap::new();
        for (_, session) in self.sessions.iter().filter(|(_, s)| s.scenario.id == scenario) {
            *counts.entry(ComparableGroup::of(session)).or_insert(0) += 1;
        }
        let mut groups: Vec<(ComparableGroup, usize)> = counts.into_iter().collect();
        groups.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        groups.into_iter().map(|(group, _)| group).collect()
    }

    /// Indices of the sessions of a group.
    pub(super) fn sessions_of(&self, group: &ComparableGroup) -> Vec<usize> {
        let is_member = |index: &usize| group.contains(&self.sessions[*index].1);
        (0..self.sessions.len()).filter(is_member).collect()
    }
}
