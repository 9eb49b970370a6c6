//! Colours of tissues, and of surfaces by the verdict on the work done there.

use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{Label, distance};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::score::{Scored, Verdict};

/// The colours of the tissue table, ready to look up.
pub struct TissueColours([[f32; 3]; 256]);

impl TissueColours {
    pub fn of(tissues: &TissueTable) -> TissueColours {
        let colour = |l: usize| tissues.by_label(Label(l as u8)).map_or([0.5; 3], |e| e.rgb());
        TissueColours(std::array::from_fn(colour))
    }

    pub fn tissue(&self, label: Label) -> [f32; 3] {
        self.0[usize::from(label.0)]
    }

    /// Colour of unchanged matter: its verdict's colour with a little of its tissue's, so that the work stands out.
    pub fn muted(&self, label: Label, verdict: Verdict) -> [f32; 3] {
        const TOUCH: f32 = 0.35;
        lerp_colour(verdict.color(), self.tissue(label), TOUCH)
    }
}

/// Colours of the remaining surface: each place shows the verdict on the matter that was removed from it.
pub struct VerdictColours<'a> {
    scored: &'a Scored,
    /// Around the removed voxels: for each voxel the distance, mm, to the nearest removed one, and that voxel's index.
    removed_surroundings: Option<(SubGrid, Vec<f32>, Vec<u32>)>,
    /// Largest distance, mm, at which a wall takes the colour of the removed matter that it bounded.
    max_distance: f32,
}

/// Value of `max_distance` in voxel widths. It must reach a wall voxel that touches a removed voxel only at a corner.
const REACH_VOXELS: f32 = 2.4;

/// The last part of the reach, over which the colour fades, so that a cavity's rim shows no stairs.
const FADE_SHARE: f32 = 0.5;

impl<'a> VerdictColours<'a> {
    pub fn of(scored: &'a Scored) -> VerdictColours<'a> {
        let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
        let grid = before.grid();
        // Missing parts of a filling show on the walls around them, as removed matter does.
        let is_missing = |v: usize| matches!(scored.verdicts[v], Verdict::Underfilled | Verdict::Void);
        let is_removed = |v: usize| before.tissue(v) != Label::AIR && after.tissue(v) == Label::AIR || is_missing(v);
        let crop = SubGrid::around(grid, 3, (0..grid.len()).filter(|&v| is_removed(v)));
        let removed_surroundings = crop.map(|crop| {
            let (distances, nearest) = distance::to_nearest(&crop.grid, |i| is_removed(crop.whole_index(i)));
            (crop, distances, nearest)
        });
        VerdictColours { scored, removed_surroundings, max_distance: REACH_VOXELS * grid.spacing.max_element() }
    }

    /// Colour of a solid voxel on the surface. `unchanged` is its colour if no work was done there.
    pub fn colour_at(&self, voxel: usize, unchanged: [f32; 3]) -> [f32; 3] {
        match self.scored.verdicts[voxel] {
            own @ (Verdict::Left | Verdict::VulnerableTouched | Verdict::Restored | Verdict::Overfilled) => own.color(),
            _ => self
                .nearest_verdict(voxel)
                .map_or(unchanged, |(verdict, share)| lerp_colour(unchanged, verdict.color(), share)),
        }
    }

    /// Verdict on the removed matter nearest to a voxel, and the share (0 to 1) of its colour that shows there.
    fn nearest_verdict(&self, voxel: usize) -> Option<(Verdict, f32)> {
        let (crop, distances, nearest) = self.removed_surroundings.as_ref()?;
        let place = crop.index_of(voxel).filter(|&i| distances[i] < self.max_distance)?;
        let share = ((self.max_distance - distances[place]) / (FADE_SHARE * self.max_distance)).min(1.0);
        Some((self.scored.verdicts[crop.whole_index(nearest[place] as usize)], share))
    }
}

pub fn lerp_colour(from: [f32; 3], to: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}

/// A screen's colour as linear light (IEC 61966-2-1).
pub fn srgb_to_linear(colour: [f32; 3]) -> [f32; 3] {
    colour.map(|c| if c <= 0.04045 { c / 12.92 } else { libm::powf((c + 0.055) / 1.055, 2.4) })
}
