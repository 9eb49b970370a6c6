//! The path of a probe or an explorer down a root, and the detection of calculus along it.

use crate::scenario::file::SiteFile;
use crate::scenario::{Periodontium, ProbingSite};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Label, Volume};

/// A path down into the sulcus and up again; tooth space, mm.
#[derive(Clone, Debug)]
pub(super) struct SulcusPath {
    /// Point outside the height of contour of the crown, at the height of the entry.
    pub beside: Vec3,
    /// Point above the gingival margin.
    pub entry: Vec3,
    /// Points along the root without its calculus, from the entry to the root's end.
    pub down: Vec<Vec3>,
    /// The same points in reverse, clear of the root.
    pub up: Vec<Vec3>,
}

impl SulcusPath {
    /// Returns the path at a site; `None` if there is no tooth surface at the entry's height.
    ///
    /// `off` is the distance of the downward path from the root, mm; a negative one leans into the root. `lowest` is
    /// the height of the tooth's lowest point, tooth space, mm.
    pub fn at(
        site: ProbingSite,
        gum: &Periodontium,
        volume: &Volume,
        deposits: &[Label],
        lowest: f32,
        off: f32,
    ) -> Option<SulcusPath> {
        /// Height difference between neighbouring points of the path, mm.
        const STEP: f32 = 0.25;
        /// Height of the entry above the gingival margin, mm.
        const OVER: f32 = 0.7;
        /// Clearance beside the crown, mm.
        const CLEAR: f32 = 0.7;
        /// Minimum distance of the entry from the tooth, mm, even if the hand leans into the root further down.
        const FREE: f32 = 0.42;
        let (azimuth, out) = (site.azimuth(), gum.outward(site.azimuth()));
        let margin = gum.margin(azimuth);
        let surface = |z: f32| tooth_surface(volume, deposits, gum.middle().with_z(z), out);
        let above = margin + OVER;
        let entry = surface(above)? + out * off.max(FREE);
        let heights = (1..).map(|i| above - STEP * i as f32).take_while(|z| *z > lowest + 1.0);
        let root: Vec<Vec3> = heights.map_while(surface).collect();
        let down = root.iter().map(|p| *p + out * off).collect();
        let up = root.iter().rev().map(|p| *p + out * FREE).collect();
        let bulge = (0..40).filter_map(|i| surface(above + 0.25 * i as f32)).map(|p| (p - gum.middle()).dot(out));
        let beside = gum.middle().with_z(above) + out * (bulge.fold(0.0, f32::max) + CLEAR);
        Some(SulcusPath { beside, entry, down, up })
    }
}

/// Converts a list of sites; all six without a list.
pub(super) fn sites(written: Option<&[SiteFile]>) -> Vec<ProbingSite> {
    written
        .map_or_else(|| ProbingSite::ALL.to_vec(), |sites| sites.iter().map(|site| ProbingSite::from(*site)).collect())
}

/// Returns the outermost surface point of the tooth, without its deposits, on a horizontal ray from its axis; tooth
/// space, mm.
fn tooth_surface(volume: &Volume, deposits: &[Label], middle: Vec3, out: Vec3) -> Option<Vec3> {
    const BEYOND: f32 = 9.0;
    let grid = volume.grid();
    let step = 0.5 * grid.spacing.min_element();
    let at = |i: u32| middle + out * (BEYOND - i as f32 * step);
    let is_tooth = |p: &Vec3| {
        let label = grid.nearest(*p).map_or(Label::AIR, |cell| volume.tissue(grid.index(cell)));
        label != Label::AIR && !deposits.contains(&label)
    };
    (0..(BEYOND / step) as u32).map(at).find(is_tooth)
}

/// Returns the height of the highest bump along a trail, mm: the distance of the tip from the tooth's axis minus the
/// mean of the distances a little higher and a little lower.
///
/// A root tapers and curves gently, whereas calculus rises within a millimetre.
pub(super) fn bump(trail: &[[f32; 2]]) -> f32 {
    /// Height of a bin over which distances are averaged, mm.
    const BIN: f32 = 0.1;
    /// Offset of the bins above and below with which a bin is compared, bins.
    const APART: usize = 11;
    let top = trail.iter().map(|p| p[0]).fold(f32::NEG_INFINITY, f32::max);
    let mut bins: Vec<(f32, u32)> = Vec::new();
    for [height, off] in trail {
        let bin = ((top - height) / BIN) as usize;
        if bin >= bins.len() {
            bins.resize(bin + 1, (0.0, 0));
        }
        bins[bin].0 += off;
        bins[bin].1 += 1;
    }
    let line: Vec<f32> = bins.iter().filter(|(_, count)| *count > 0).map(|(sum, count)| sum / *count as f32).collect();
    let lifted = |i: usize| line[i] - 0.5 * (line[i - APART] + line[i + APART]);
    (APART..line.len().saturating_sub(APART)).map(lifted).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deposit_lifts_the_tip_and_a_tapering_root_does_not() {
        let root = |bump: f32| -> Vec<[f32; 2]> {
            let at = |i: i32| {
                let z = -(i as f32) * 0.01;
                let off = 4.0 + 0.2 * z - 0.02 * z * z;
                [z, off + bump * (1.0 - ((z + 3.0) / 0.9).powi(2)).max(0.0)]
            };
            (0..600).map(at).collect()
        };
        assert!(bump(&root(0.0)) < 0.05, "{}", bump(&root(0.0)));
        assert!(bump(&root(0.4)) > 0.3, "{}", bump(&root(0.4)));
    }
}
