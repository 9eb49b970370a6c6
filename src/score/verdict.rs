//! A verdict on every voxel.

use super::crop::Crop;
use super::restoration::Restoration;
use super::shape::Shape;
use crate::record::Replay;
use crate::scenario::Scenario;
use crate::scenario::file::ZoneRole;
use crate::volume::{Label, distance};

/// What a voxel says about the work. The numbers are those of `performance.seg.nrrd`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Verdict {
    /// Nothing was there.
    Outside = 0,
    /// Sound tissue, left alone.
    KeptSound = 1,
    /// Decay or target, taken away.
    RightlyRemoved = 2,
    /// Sound tissue taken away where that does no harm.
    WithinLeeway = 3,
    /// Sound tissue taken away beyond that.
    Overcut = 4,
    /// Decay or target that is still there.
    Left = 5,
    /// Pulp or another vulnerable structure, removed or laid open; or a zone that must never be touched.
    VulnerableTouched = 6,
    /// Everything else that is still there.
    Kept = 7,
    /// A filling, within the tooth's original contour.
    Restored = 8,
    /// A filling, outside that contour.
    Overfilled = 9,
    /// Part of the cavity that was to be filled and is open.
    Underfilled = 10,
    /// Part of the cavity that a filling encloses and does not fill.
    Void = 11,
}

impl Verdict {
    /// All that can be seen, in the order of legends.
    pub const SEEN: [Verdict; 7] = [
        Verdict::RightlyRemoved,
        Verdict::Left,
        Verdict::WithinLeeway,
        Verdict::Overcut,
        Verdict::VulnerableTouched,
        Verdict::KeptSound,
        Verdict::Kept,
    ];

    /// What is seen besides where a cavity was to be filled.
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
            Verdict::KeptSound => "Sound, kept",
            Verdict::RightlyRemoved => "Rightly removed",
            Verdict::WithinLeeway => "Sound, removed within leeway",
            Verdict::Overcut => "Sound, removed beyond leeway",
            Verdict::Left => "Left behind",
            Verdict::VulnerableTouched => "Vulnerable, touched",
            Verdict::Kept => "Other, kept",
            Verdict::Restored => "Filled to the contour",
            Verdict::Overfilled => "Overfilled",
            Verdict::Underfilled => "Underfilled",
            Verdict::Void => "Void in the filling",
        }
    }

    /// A letter or sign that stands for the colour where colours cannot be told apart.
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

    /// Red, green, blue in 0–1. After Okabe & Ito (2008): told apart by people with any colour vision; the brightness
    /// differs as well, so that a grey print still can be read.
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

/// One verdict per voxel of the workpiece.
pub fn of(scenario: &Scenario, replay: &Replay, shape: &Shape, restoration: Option<&Restoration>) -> Vec<Verdict> {
    let initial = &replay.workpiece.volume;
    let is_harmless = harmless(scenario, shape);
    let is_forbidden = |voxel: usize| {
        let mut zones = scenario.zones.iter().zip(&shape.zones);
        zones.any(|(z, mask)| z.role == ZoneRole::NeverRemove && mask.contains(voxel))
    };
    // What must stay whole around the preparation has no leeway.
    let is_container = |voxel: usize| {
        let mut zones = scenario.zones.iter().zip(&shape.zones);
        zones.any(|(z, mask)| z.role == ZoneRole::Container && mask.contains(voxel))
    };
    let verdict = |voxel: usize| {
        if initial.tissue(voxel) == Label::AIR {
            return restoration.map_or(Verdict::Outside, |r| of_air(replay, r, voxel));
        }
        let sets = shape.sets[voxel];
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

/// What came of a place that was air at the start.
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

/// Where removing sound tissue does no harm: in leeway zones, and within the leeway of what was to be removed.
fn harmless<'a>(scenario: &'a Scenario, shape: &'a Shape) -> impl Fn(usize) -> bool + 'a {
    let margin = (scenario.measures.leeway / shape.grid.spacing.min_element()).ceil() as u32 + 1;
    let indices = (0..shape.grid.len()).filter(|&i| shape.sets[i].wanted());
    let near = Crop::around(&shape.grid, margin, indices).map(|crop| {
        let distances = distance::to_set(&crop.grid, |i| shape.sets[crop.whole_index(i)].wanted());
        (crop, distances)
    });
    move |voxel| {
        let in_zone =
            scenario.zones.iter().zip(&shape.zones).any(|(z, mask)| z.role == ZoneRole::Leeway && mask.contains(voxel));
        let is_near = near.as_ref().is_some_and(|(crop, distances)| {
            crop.index_of(voxel).is_some_and(|i| distances[i] <= scenario.measures.leeway)
        });
        in_zone || is_near
    }
}
