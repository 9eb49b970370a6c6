//! The way of a probe or an explorer down a root, and what an explorer tells of it.

use crate::frame::Vec3;
use crate::scenario::file::SiteFile;
use crate::scenario::{Periodontium, Site};
use crate::volume::{Label, Volume};

/// One way down into the sulcus; tooth space, mm.
#[derive(Clone, Debug)]
pub(super) struct Sounding {
    /// Outside the crown's bulge, as high as the entry.
    pub beside: Vec3,
    /// Over the margin.
    pub entry: Vec3,
    /// Along the root as one knows it of a tooth without calculus, from the entry to its end.
    pub down: Vec<Vec3>,
    /// The same way back, clear of the root.
    pub up: Vec<Vec3>,
}

impl Sounding {
    /// `off`: how far off the root, mm; negative leans into it.
    pub fn at(
        site: Site,
        gum: &Periodontium,
        volume: &Volume,
        deposits: &[Label],
        lowest: f32,
        off: f32,
    ) -> Option<Sounding> {
        /// Between two places of the way, and over the margin, mm.
        const STEP: f32 = 0.25;
        const OVER: f32 = 0.7;
        /// A free way beside the crown, mm.
        const CLEAR: f32 = 0.7;
        /// An entry is free of the tooth, however the hand leans later.
        const FREE: f32 = 0.42;
        let (turn, out) = (site.turn(), gum.outward(site.turn()));
        let margin = gum.margin(turn);
        let surface = |z: f32| sound_surface(volume, deposits, gum.middle().with_z(z), out);
        let above = margin + OVER;
        let entry = surface(above)? + out * off.max(FREE);
        let heights = (1..).map(|i| above - STEP * i as f32).take_while(|z| *z > lowest + 1.0);
        let root: Vec<Vec3> = heights.map_while(surface).collect();
        let down = root.iter().map(|p| *p + out * off).collect();
        let up = root.iter().rev().map(|p| *p + out * FREE).collect();
        let bulge = (0..40).filter_map(|i| surface(above + 0.25 * i as f32)).map(|p| (p - gum.middle()).dot(out));
        let beside = gum.middle().with_z(above) + out * (bulge.fold(0.0, f32::max) + CLEAR);
        Some(Sounding { beside, entry, down, up })
    }
}

/// The sites that are meant, all without a list.
pub(super) fn sites(written: Option<&[SiteFile]>) -> Vec<Site> {
    written.map_or_else(|| Site::ALL.to_vec(), |sites| sites.iter().map(|site| Site::from(*site)).collect())
}

/// The outermost surface of the tooth itself on a level ray from its middle.
fn sound_surface(volume: &Volume, deposits: &[Label], middle: Vec3, out: Vec3) -> Option<Vec3> {
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

/// How far the tip was lifted over a bump on its way down, mm: its distance from the middle against the mean a little higher and
/// a little lower. A root tapers and curves gently; calculus stands up within a millimetre.
pub(super) fn bump(trail: &[[f32; 2]]) -> f32 {
    /// Heights are told apart so finely, mm, and compared so far apart.
    const BIN: f32 = 0.1;
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
