//! A verdict on every voxel.

use super::removal_comparison::RemovalComparison;
use super::restoration::Restoration;
use crate::record::Replay;
use crate::scenario::Scenario;
use crate::scenario::file::ZoneRole;
use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{Label, distance};

/// Verdict on a voxel. The numbers are those of `performance.seg.nrrd`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Verdict {
    /// Air at the start and at the end.
    Outside = 0,
    /// Sound tissue, preserved.
    KeptSound = 1,
    /// Decay or target, removed.
    RightlyRemoved = 2,
    /// Sound tissue removed within the leeway.
    WithinLeeway = 3,
    /// Sound tissue removed beyond the leeway.
    Overcut = 4,
    /// Decay or target, not removed.
    Left = 5,
    /// Pulp or another vulnerable structure, removed or exposed; or removed tissue, other than decay, of a zone
    /// that must never be removed.
    VulnerableTouched = 6,
    /// Any other tissue, preserved.
    Kept = 7,
    /// Filling within the tooth's original contour.
    Restored = 8,
    /// Filling outside the original contour.
    Overfilled = 9,
    /// Part of the cavity that is open but should be filled.
    Underfilled = 10,
    /// Part of the cavity that is enclosed by a filling but not filled.
    Void = 11,
}

impl Verdict {
    /// Verdicts that are displayed, in the order of legends.
    pub const VISIBLE: [Verdict; 7] = [
        Verdict::RightlyRemoved,
        Verdict::Left,
        Verdict::WithinLeeway,
        Verdict::Overcut,
        Verdict::VulnerableTouched,
        Verdict::KeptSound,
        Verdict::Kept,
    ];

    /// Additional verdicts that are displayed if a cavity was to be filled.
    pub const OF_FILLINGS: [Verdict; 4] = [Verdict::Restored, Verdict::Overfilled, Verdict::Underfilled, Verdict::Void];

    pub fn id(self) -> &'static str {
        match self {
            Verdict::Outside => "outside",
            Verdict::KeptSound => "kept_sound",
            Verdict::RightlyRemoved => "rightly_removed",
            Verdict::WithinLeeway => "within_leeway",
            Verdict::Overcut => "overcut",
            Verdict::Left => "left",
            Verdict::VulnerableTouched => "vulnerable_touched",
            Verdict::Kept => "kept",
            Verdict::Restored => "restored",
            Verdict::Overfilled => "overfilled",
            Verdict::Underfilled => "underfilled",
            Verdict::Void => "void",
        }
    }

    pub fn title(self) -> &'static str {
        match self {
            Verdict::Outside => "Outside",
            Verdict::KeptSound => "Sound, preserved",
            Verdict::RightlyRemoved => "Correctly removed",
            Verdict::WithinLeeway => "Sound, removed within the leeway",
            Verdict::Overcut => "Sound, removed beyond the leeway",
            Verdict::Left => "Should have been removed, remaining",
            Verdict::VulnerableTouched => "Protected tissue, removed or exposed",
            Verdict::Kept => "Other, preserved",
            Verdict::Restored => "Restoration within the original contour",
            Verdict::Overfilled => "Overfilled",
            Verdict::Underfilled => "Underfilled",
            Verdict::Void => "Void in the restoration",
        }
    }

    /// Returns a letter or sign that represents the colour if colours cannot be distinguished.
    pub fn sign(self) -> &'static str {
        match self {
            Verdict::Outside => " ",
            Verdict::KeptSound => "S",
            Verdict::RightlyRemoved => "✓",
            Verdict::WithinLeeway => "~",
            Verdict::Overcut => "✗",
            Verdict::Left => "L",
            Verdict::VulnerableTouched => "!",
            Verdict::Kept => "·",
            Verdict::Restored => "✓",
            Verdict::Overfilled => "+",
            Verdict::Underfilled => "−",
            Verdict::Void => "○",
        }
    }

    /// Returns red, green and blue, 0 to 1. After Okabe & Ito (2008): the colours can be distinguished with any kind of
    /// colour vision. Their brightness differs too, so that a greyscale print remains readable.
    pub fn color(self) -> [f32; 3] {
        let [r, g, b] = match self {
            Verdict::Outside => [0, 0, 0],
            Verdict::KeptSound => [238, 232, 216],
            Verdict::RightlyRemoved => [86, 180, 233],
            Verdict::WithinLeeway => [240, 228, 66],
            Verdict::Overcut => [213, 94, 0],
            Verdict::Left => [94, 60, 40],
            Verdict::VulnerableTouched => [170, 20, 110],
            Verdict::Kept => [190, 190, 190],
            Verdict::Restored => [86, 180, 233],
            Verdict::Overfilled => [213, 94, 0],
            Verdict::Underfilled => [94, 60, 40],
            Verdict::Void => [170, 20, 110],
        };
        [r, g, b].map(|c: u8| f32::from(c) / 255.0)
    }
}

/// Returns one verdict per voxel of the workpiece.
pub fn of(
    scenario: &Scenario,
    replay: &Replay,
    shape: &RemovalComparison,
    restoration: Option<&Restoration>,
) -> Vec<Verdict> {
    let initial = &replay.workpiece.volume;
    let is_harmless = harmless(scenario, shape);
    let is_forbidden = |voxel: usize| {
        let mut zones = scenario.zones.iter().zip(&shape.zones);
        zones.any(|(z, mask)| z.role == ZoneRole::NeverRemove && mask.counted.contains(voxel))
    };
    // Walls and floor that must remain intact have no leeway.
    let is_container = |voxel: usize| {
        let mut zones = scenario.zones.iter().zip(&shape.zones);
        zones.any(|(z, mask)| z.role == ZoneRole::Container && mask.counted.contains(voxel))
    };
    let verdict = |voxel: usize| {
        if initial.tissue(voxel) == Label::AIR {
            return restoration.map_or(Verdict::Outside, |r| of_air(replay, r, voxel));
        }
        let sets = shape.flags[voxel];
        match (sets.removed(), sets.wanted()) {
            (true, _) if is_forbidden(voxel) => Verdict::VulnerableTouched,
            _ if shape.is_exposed(voxel) => Verdict::VulnerableTouched,
            (true, true) => Verdict::RightlyRemoved,
            (true, false) if is_container(voxel) => Verdict::Overcut,
            (true, false) if is_harmless(voxel) => Verdict::WithinLeeway,
            (true, false) => Verdict::Overcut,
            (false, true) => Verdict::Left,
            (false, false) if sets.sound() => Verdict::KeptSound,
            (false, false) => Verdict::Kept,
        }
    };
    (0..initial.grid().len()).map(verdict).collect()
}

/// Returns the verdict on a voxel that was air at the start.
fn of_air(replay: &Replay, restoration: &Restoration, voxel: usize) -> Verdict {
    let was_tooth = replay.workpiece.is_in_cavity(voxel);
    match (was_tooth, replay.volume.tissue(voxel) != Label::AIR) {
        (true, true) => Verdict::Restored,
        (false, true) => Verdict::Overfilled,
        (true, false) if restoration.voids.contains(voxel) => Verdict::Void,
        (true, false) => Verdict::Underfilled,
        (false, false) => Verdict::Outside,
    }
}

/// Returns a test for voxels at which sound tissue may be removed without penalty: in leeway zones, and within the
/// leeway of tissue to be removed.
fn harmless<'a>(scenario: &'a Scenario, shape: &'a RemovalComparison) -> impl Fn(usize) -> bool + 'a {
    let margin = (scenario.measures.leeway / shape.grid.spacing.min_element()).ceil() as u32 + 1;
    let indices = (0..shape.grid.len()).filter(|&i| shape.flags[i].wanted());
    let near = SubGrid::around(&shape.grid, margin, indices).map(|crop| {
        let distances = distance::to_set(&crop.grid, |i| shape.flags[crop.whole_index(i)].wanted());
        (crop, distances)
    });
    move |voxel| {
        let in_zone = scenario
            .zones
            .iter()
            .zip(&shape.zones)
            .any(|(z, mask)| z.role == ZoneRole::Leeway && mask.counted.contains(voxel));
        let is_near = near.as_ref().is_some_and(|(crop, distances)| {
            crop.index_of(voxel).is_some_and(|i| distances[i] <= scenario.measures.leeway)
        });
        in_zone || is_near
    }
}
