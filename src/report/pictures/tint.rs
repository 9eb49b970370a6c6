//! Colours of tissues, and of surfaces by what was done there.

use crate::content::TissueTable;
use crate::score::{Crop, Scored, Verdict};
use crate::volume::{Label, distance};

/// The colours of the tissue table, ready to look up.
pub struct Palette([[f32; 3]; 256]);

impl Palette {
    pub fn of(tissues: &TissueTable) -> Palette {
        let colour = |l: usize| tissues.by_label(Label(l as u8)).map_or([0.5; 3], |e| e.rgb());
        Palette(std::array::from_fn(colour))
    }

    pub fn tissue(&self, label: Label) -> [f32; 3] {
        self.0[usize::from(label.0)]
    }

    /// What was kept steps back behind what was done: its verdict's colour, with a touch of its tissue's.
    pub fn quiet(&self, label: Label, verdict: Verdict) -> [f32; 3] {
        const TOUCH: f32 = 0.35;
        mixed(verdict.color(), self.tissue(label), TOUCH)
    }
}

/// Which verdict a place on the remaining surface shows: that of what was taken away from it.
pub struct Tint<'a> {
    scored: &'a Scored,
    /// Around what was taken away: its distance, mm, and where it was.
    near: Option<(Crop, Vec<f32>, Vec<u32>)>,
    /// How far a wall takes the colour of what it bounded, mm.
    reach: f32,
}

/// The same in voxels: a wall's own voxels touch removed ones, if only at a corner.
const REACH: f32 = 2.4;

/// The last part of the reach, over which the colour fades, so that a cavity's rim shows no stairs.
const FADE: f32 = 0.5;

impl<'a> Tint<'a> {
    pub fn of(scored: &'a Scored) -> Tint<'a> {
        let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
        let grid = before.grid();
        // What is missing of a filling shows on the walls around it, as what was taken away does.
        let is_missing = |v: usize| matches!(scored.verdicts[v], Verdict::Underfilled | Verdict::Void);
        let is_removed = |v: usize| before.tissue(v) != Label::AIR && after.tissue(v) == Label::AIR || is_missing(v);
        let crop = Crop::around(grid, 3, (0..grid.len()).filter(|&v| is_removed(v)));
        let near = crop.map(|crop| {
            let (distances, nearest) = distance::to_nearest(&crop.grid, |i| is_removed(crop.whole_index(i)));
            (crop, distances, nearest)
        });
        Tint { scored, near, reach: REACH * grid.spacing.max_element() }
    }

    /// The colour of a solid voxel on the surface, where `kept` is that of a place where nothing was done.
    pub fn colour(&self, voxel: usize, kept: [f32; 3]) -> [f32; 3] {
        match self.scored.verdicts[voxel] {
            own @ (Verdict::Left | Verdict::VulnerableTouched | Verdict::Restored | Verdict::Overfilled) => own.color(),
            _ => self.bounded(voxel).map_or(kept, |(verdict, share)| mixed(kept, verdict.color(), share)),
        }
    }

    /// The verdict on what was taken away beside a voxel, and how much of it shows there.
    fn bounded(&self, voxel: usize) -> Option<(Verdict, f32)> {
        let (crop, distances, nearest) = self.near.as_ref()?;
        let place = crop.index_of(voxel).filter(|&i| distances[i] < self.reach)?;
        let share = ((self.reach - distances[place]) / (FADE * self.reach)).min(1.0);
        Some((self.scored.verdicts[crop.whole_index(nearest[place] as usize)], share))
    }
}

pub fn mixed(from: [f32; 3], to: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}

/// A screen's colour as linear light (IEC 61966-2-1).
pub fn linear(colour: [f32; 3]) -> [f32; 3] {
    colour.map(|c| if c <= 0.04045 { c / 12.92 } else { libm::powf((c + 0.055) / 1.055, 2.4) })
}
