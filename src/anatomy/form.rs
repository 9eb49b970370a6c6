//! A tooth's form as data from which a tooth of any size can be generated.
//!
//! Lengths in the tables are shares of the tooth's [`Sizes`], so that one form serves a whole family of teeth. Lengths
//! that do not scale with the tooth (fissures, roundings, tissue thickness) are in mm and documented as such. Axes are
//! those of tooth space: x lingual (−) to buccal (+), y mesial (−) to distal (+), z apical (−) to occlusal (+) with 0
//! at the neck.
//!
//! A share of 1 along x or y is half the crown's width above the neck and half the neck's width at and below it. A
//! share of 1 along z is the crown's length above the neck and the root's below.
//!
//! In the forms, x, y and z are a right-handed space, as buccal, distal and occlusal are in the lower left and the
//! upper right quadrant. The contralateral teeth are generated as mirror images: [`ToothForm::is_mirrored`].

use crate::age::AgeEffects;

/// Sizes of a tooth, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Length of the crown, from the neck to the highest cusp.
    pub crown: f32,
    /// Length of the root, from the neck to the lowest apex.
    pub root: f32,
    /// Mesiodistal width of the crown and at the neck.
    pub mesiodistal: [f32; 2],
    /// Buccolingual width of the crown and at the neck.
    pub buccolingual: [f32; 2],
    /// Curvature of the cervical line: its rise toward the cusps, mesially and distally.
    pub neckline_rise: [f32; 2],
}

/// Complete form of one tooth.
#[derive(Clone, Copy, Debug)]
pub struct ToothForm {
    pub sizes: Sizes,
    /// Crown and root trunk; the whole tooth if it has one root.
    pub body: LoftForm,
    /// Roots into which the trunk divides; empty for a tooth with one root.
    pub roots: &'static [LoftForm],
    pub occlusal: OcclusalForm,
    pub enamel: Enamel,
    pub pulp: PulpForm,
    pub side_metric: SideMetric,
    /// True to generate the mirror image: y then runs from distal (−) to mesial (+), so that the space remains
    /// right-handed.
    pub is_mirrored: bool,
    /// Effects of age; `None` for the unworn tooth of the form.
    pub age_effects: Option<AgeEffects>,
}

/// Metric for the distance from the side of a limb (crown, trunk or root). The position of the side is the same for
/// both metrics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SideMetric {
    /// Along the ray from the centre of the section. This distance is too long where the side is oblique to the ray, so
    /// that enamel becomes thin on flat sides. It is kept for the first tooth of the program, which must stay identical
    /// to the last bit.
    AlongRays,
    /// Along the side's normal.
    AlongNormals,
}

/// A limb formed by cross-sections stacked along z.
#[derive(Clone, Copy, Debug)]
pub struct LoftForm {
    /// Cross-sections: at least two, at different heights.
    pub sections: &'static [CrossSection],
    /// Furrows along the sides.
    pub furrows: &'static [Furrow],
    /// Rounding of the lower end, mm.
    pub rounding: f32,
}

/// The outline of a limb at one height.
#[derive(Clone, Copy, Debug)]
pub struct CrossSection {
    pub z: f32,
    /// Positions of the lingual and the buccal side.
    pub x: [f32; 2],
    /// Positions of the mesial and the distal side.
    pub y: [f32; 2],
    /// Squareness: 0 for an ellipse, 1 for a rectangle.
    pub squareness: f32,
    /// Relative excess of the width at the distal end and at the buccal side over the mean; negative for a narrower
    /// one.
    pub taper: [f32; 2],
    /// Shift of the distal end toward buccal and of the mesial end toward lingual, as a share of the half-width along
    /// x.
    pub skew: f32,
}

/// A furrow along a limb's side, as points of its bottom line.
pub type Furrow = &'static [FurrowPlace];

/// One point of a [`Furrow`].
#[derive(Clone, Copy, Debug)]
pub struct FurrowPlace {
    /// Position: x, y, z.
    pub at: [f32; 3],
    /// Depth, mm.
    pub depth: f32,
    /// Half-width, mm.
    pub width: f32,
}

/// The occlusal surface as heights above the neck.
#[derive(Clone, Copy, Debug)]
pub struct OcclusalForm {
    pub cusps: &'static [Cusp],
    /// Crests that bound the occlusal surface: cusp ridges and marginal ridges through the tips, or the edge of an
    /// incisor.
    pub crests: &'static [Crest],
    pub fissures: &'static [FissureForm],
    /// Height of the lowest surface between ridges, without fissures.
    pub floor: f32,
    /// Slopes of the flanks of crests and of triangular ridges, mm per mm.
    pub flanks: [f32; 2],
    /// Rounding of the edge between the occlusal surface and the sides, mm.
    pub edge: f32,
}

/// A cusp: its tip, and the triangular ridge from the tip down to the centre of the tooth.
#[derive(Clone, Copy, Debug)]
pub struct Cusp {
    /// Position of the tip: x, y, z.
    pub tip: [f32; 3],
    /// End of the triangular ridge: x, y, z.
    pub foot: [f32; 3],
    /// Height of the pulp horn above the roof of the chamber, mm.
    pub horn: f32,
}

/// A crest through points x, y, z, horizontal and smooth at its highest and lowest points.
pub type Crest = &'static [[f32; 3]];

/// A fissure in the occlusal surface.
#[derive(Clone, Copy, Debug)]
pub struct FissureForm {
    /// Points: x, y, and share of the depth.
    pub line: &'static [[f32; 3]],
    /// Depth, mm.
    pub depth: f32,
    /// Half-width, mm.
    pub width: f32,
}

/// Thickness of the enamel, mm.
#[derive(Clone, Copy, Debug)]
pub struct Enamel {
    /// Under cusp tips.
    pub cusp: f32,
    /// Under the bottom of the main fissure.
    pub fissure: f32,
    /// On the sides, at full thickness.
    pub side: f32,
    /// Height at which the thickness on the sides is full, as a share of the crown.
    pub full_at: f32,
    /// Share of a side furrow's depth that the dentine surface follows: 0 for smooth dentine, 1 for a furrow of equal depth.
    pub follows: f32,
}

/// The pulp. Its cross-sections are shares of the neck's widths at every height.
#[derive(Clone, Copy, Debug)]
pub struct PulpForm {
    pub chamber: LoftForm,
    /// Position at which horns leave the chamber, as a share of the distance from the tooth's axis to the cusp in x and
    /// y.
    pub horn_spread: f32,
    pub canals: &'static [CanalForm],
}

/// A canal that follows a root.
#[derive(Clone, Copy, Debug)]
pub struct CanalForm {
    /// Index of the root in the form; the body if the tooth has one root.
    pub root: usize,
    /// Position in the root's cross-section, as shares of its half-widths.
    pub at: [f32; 2],
    /// Half-widths at the orifice in x and y, mm.
    pub orifice: [f32; 2],
    /// Radius at the apical end, mm.
    pub end: f32,
    /// Thickness of dentine between the end of the canal and the root's apex, mm.
    pub closed: f32,
}

/// Returns a row of a table of cross-sections.
pub(super) const fn section(z: f32, x: [f32; 2], y: [f32; 2], square: f32, taper: [f32; 2]) -> CrossSection {
    CrossSection { z, x, y, squareness: square, taper, skew: 0.0 }
}

/// Returns a cross-section with its mesial and distal ends shifted against each other.
pub(super) const fn skewed(z: f32, x: [f32; 2], y: [f32; 2], square: f32, taper: [f32; 2], skew: f32) -> CrossSection {
    CrossSection { z, x, y, squareness: square, taper, skew }
}

/// Returns a point of a furrow.
pub(super) const fn place(at: [f32; 3], depth: f32, width: f32) -> FurrowPlace {
    FurrowPlace { at, depth, width }
}

pub(super) const fn groove(line: &'static [[f32; 3]], depth: f32, width: f32) -> FissureForm {
    FissureForm { line, depth, width }
}

/// Returns a shallow groove beside a triangular ridge.
pub(super) const fn beside_ridge(line: &'static [[f32; 3]]) -> FissureForm {
    FissureForm { line, depth: 0.16, width: 0.34 }
}

/// Returns a pulp that consists of one limb: chamber and canal of a tooth with one root.
pub(super) const fn single_root_pulp(chamber: &'static [CrossSection]) -> PulpForm {
    PulpForm { chamber: LoftForm { sections: chamber, furrows: &[], rounding: 0.12 }, horn_spread: 0.5, canals: &[] }
}

/// Returns sizes in the order of Wheeler's table: lengths of crown and root; widths of crown and neck, mesiodistal and
/// buccolingual; mesial and distal curvature of the cervical line.
pub(super) const fn sizes(
    length: [f32; 2],
    mesiodistal: [f32; 2],
    buccolingual: [f32; 2],
    neckline_rise: [f32; 2],
) -> Sizes {
    Sizes { crown: length[0], root: length[1], mesiodistal, buccolingual, neckline_rise }
}
