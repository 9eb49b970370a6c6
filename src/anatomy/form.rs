//! A tooth's form as data: what a builder needs to know to grow it in any size.
//!
//! Lengths in the tables are shares of the tooth's [`Sizes`], so that one form serves a whole family of teeth; what does
//! not grow with the tooth (fissures, roundings, tissue thickness) is in mm and says so. Axes as in tooth space: x lingual
//! (−) to buccal (+), y mesial (−) to distal (+), z apical (−) to occlusal (+) with 0 at the neck.
//!
//! A share of 1 along x or y is half the crown's width above the neck and half the neck's width at and below it. A share
//! of 1 along z is the crown's length above the neck and the root's below.
//!
//! Forms are written so that x, y and z are a right-handed space, as buccal, distal and occlusal are in the lower left and the
//! upper right of a mouth. Their twins on the other side are grown as mirror images: [`Form::is_mirrored`].

use super::age::Aged;

/// One row of a table of tooth sizes, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Neck to the highest cusp.
    pub crown: f32,
    /// Neck to the lowest apex.
    pub root: f32,
    /// Mesiodistal width of the crown and at the neck.
    pub mesiodistal: [f32; 2],
    /// Buccolingual width of the crown and at the neck.
    pub buccolingual: [f32; 2],
    /// How far the neckline rises toward the cusps mesially and distally.
    pub neckline_rise: [f32; 2],
}

/// Everything that makes a tooth this tooth.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    pub sizes: Sizes,
    /// Crown and root trunk; of a tooth with one root, all of it.
    pub body: Limb,
    /// Where the trunk divides, what it divides into.
    pub roots: &'static [Limb],
    pub relief: Relief,
    pub enamel: Enamel,
    pub pulp: Pulp,
    pub sides: Sides,
    /// Grown as its mirror image: y then runs from distal (−) to mesial (+), so that the space stays right-handed.
    pub is_mirrored: bool,
    /// What years have made of it; `None`: unworn, as written.
    pub aged: Option<Aged>,
}

/// How the distance to a limb's side is taken. Where the side lies is the same in both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// Along the ray from the middle of the level: too long at a slant, so that enamel gets thin on flat sides. The first
    /// tooth was made so, and stays the same to the last bit.
    AlongRays,
    /// Along the side's normal.
    AlongNormals,
}

/// A part stacked from outlines along z.
#[derive(Clone, Copy, Debug)]
pub struct Limb {
    /// At least two, at different heights.
    pub outlines: &'static [Outline],
    /// Furrows along its sides.
    pub furrows: &'static [Furrow],
    /// Rounding of its lower end, mm.
    pub round: f32,
}

/// The outline of a limb at one height.
#[derive(Clone, Copy, Debug)]
pub struct Outline {
    pub z: f32,
    /// Lingual and buccal side.
    pub x: [f32; 2],
    /// Mesial and distal side.
    pub y: [f32; 2],
    /// 0 is an ellipse, 1 a rectangle.
    pub square: f32,
    /// How much wider than the mean the distal end and the buccal side are; negative: narrower.
    pub taper: [f32; 2],
    /// How far the distal end is shifted buccally and the mesial end lingually, share of the half width along x.
    pub skew: f32,
}

/// A furrow along a limb's side: places of its bottom line.
pub type Furrow = &'static [FurrowPlace];

/// One place of a [`Furrow`].
#[derive(Clone, Copy, Debug)]
pub struct FurrowPlace {
    /// x, y, z
    pub at: [f32; 3],
    /// mm
    pub depth: f32,
    /// Half its width, mm.
    pub width: f32,
}

/// The chewing surface as heights above the neck.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    pub cusps: &'static [Cusp],
    /// Crests that bound the chewing surface: cusp ridges and marginal ridges. Through the tips, or the edge of an incisor.
    pub crests: &'static [Crest],
    pub fissures: &'static [Fissure],
    /// Height of the deepest ground between ridges, before fissures.
    pub floor: f32,
    /// Fall of the flanks of crests and of triangular ridges, mm per mm.
    pub flanks: [f32; 2],
    /// Rounding of the edge where the chewing surface meets the sides, mm.
    pub edge: f32,
}

/// A cusp: its tip and the triangular ridge that runs down from it to the middle of the tooth.
#[derive(Clone, Copy, Debug)]
pub struct Cusp {
    /// x, y, z
    pub tip: [f32; 3],
    /// Where its triangular ridge ends: x, y, z.
    pub foot: [f32; 3],
    /// Height of its pulp horn above the chamber's roof, mm.
    pub horn: f32,
}

/// A crest through points x, y, z, level and smooth at its highest and lowest ones.
pub type Crest = &'static [[f32; 3]];

/// A fissure in the chewing surface.
#[derive(Clone, Copy, Debug)]
pub struct Fissure {
    /// x, y and share of the depth.
    pub line: &'static [[f32; 3]],
    /// mm
    pub depth: f32,
    /// Half its width, mm.
    pub width: f32,
}

/// Thickness of the enamel, mm.
#[derive(Clone, Copy, Debug)]
pub struct Enamel {
    /// Under cusp tips.
    pub cusp: f32,
    /// Under the bottom of the main fissure.
    pub fissure: f32,
    /// On the sides, where it is full.
    pub side: f32,
    /// Height at which it is full on the sides, share of the crown.
    pub full_at: f32,
    /// Share of the depth of furrows in the crown's sides by which the dentine under them sinks too.
    pub follows: f32,
}

/// The pulp. Its outlines are shares of the neck's widths at every height.
#[derive(Clone, Copy, Debug)]
pub struct Pulp {
    pub chamber: Limb,
    /// Where horns leave the chamber: share of the way from the tooth's axis to the cusp in x and y.
    pub horn_spread: f32,
    pub canals: &'static [Canal],
}

/// A canal that follows a root.
#[derive(Clone, Copy, Debug)]
pub struct Canal {
    /// Which of the form's roots; of a tooth with one root, its body.
    pub root: usize,
    /// Where in the root's cross-section: shares of its half widths.
    pub at: [f32; 2],
    /// Half widths at the orifice in x and y, mm.
    pub orifice: [f32; 2],
    /// Radius at its end, mm.
    pub end: f32,
    /// Dentine left between its end and the root's tip, mm.
    pub closed: f32,
}

/// A row of a table of outlines.
pub(super) const fn outline(z: f32, x: [f32; 2], y: [f32; 2], square: f32, taper: [f32; 2]) -> Outline {
    Outline { z, x, y, square, taper, skew: 0.0 }
}

/// The same, its ends shifted against each other.
pub(super) const fn skewed(z: f32, x: [f32; 2], y: [f32; 2], square: f32, taper: [f32; 2], skew: f32) -> Outline {
    Outline { z, x, y, square, taper, skew }
}

/// A row of a furrow's table.
pub(super) const fn place(at: [f32; 3], depth: f32, width: f32) -> FurrowPlace {
    FurrowPlace { at, depth, width }
}

pub(super) const fn groove(line: &'static [[f32; 3]], depth: f32, width: f32) -> Fissure {
    Fissure { line, depth, width }
}

/// A shallow groove beside a triangular ridge.
pub(super) const fn beside_ridge(line: &'static [[f32; 3]]) -> Fissure {
    Fissure { line, depth: 0.16, width: 0.34 }
}

/// A pulp that is all one limb: chamber and canal of a tooth with one root.
pub(super) const fn single(chamber: &'static [Outline]) -> Pulp {
    Pulp { chamber: Limb { outlines: chamber, furrows: &[], round: 0.12 }, horn_spread: 0.5, canals: &[] }
}

/// Sizes as Wheeler's table prints them: lengths of crown and root; widths of crown and neck, mesiodistal and buccolingual;
/// the neckline's rise mesially and distally.
pub(super) const fn sizes(
    length: [f32; 2],
    mesiodistal: [f32; 2],
    buccolingual: [f32; 2],
    neckline_rise: [f32; 2],
) -> Sizes {
    Sizes { crown: length[0], root: length[1], mesiodistal, buccolingual, neckline_rise }
}
