//! Signed distances of points from a tooth's surface, its dentine and its pulp.
//!
//! A tooth is mostly a stack of cross-sections with a height map on top. Values that depend on z alone are therefore
//! computed once per height ([`SdfLevel`]), values that depend on x and y alone once per column ([`SdfColumn`]), and a
//! point combines both.

use crate::blend::{mix, smooth_intersection, smooth_union};
use crate::form;
use crate::form::{Sizes, ToothForm};
use crate::loft::{Loft, LoftSection};
use crate::occlusal_surface::{HeightSample, OcclusalSurface};
use crate::pulp::{Pulp, PulpSection};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;

/// A tooth in mm, tooth space.
pub(super) struct ToothSdf {
    sizes: Sizes,
    body: Loft,
    roots: Vec<Loft>,
    occlusal: OcclusalSurface,
    edge: f32,
    enamel: form::Enamel,
    /// Depth of the deepest fissure, mm.
    fissure: f32,
    /// Minimum thickness of enamel, mm: a grid cannot represent a thinner edge.
    thinnest: f32,
    pulp: Pulp,
    bounds: Aabb,
}

/// Values that depend on the height alone.
pub(super) struct SdfLevel<'a> {
    z: f32,
    body: LoftSection,
    roots: Vec<LoftSection>,
    pulp: PulpSection<'a>,
}

/// Values that depend on x and y alone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SdfColumn {
    ground: HeightSample,
    /// Cosine of the inclination of the occlusal surface, which converts a height above the surface to a distance from
    /// it.
    upright: f32,
    /// Height of the cervical line in this direction from the tooth's axis, mm.
    neckline: f32,
}

/// Signed distances of a point from the tooth and its dentine, mm: negative inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceDistances {
    pub(super) tooth: f32,
    /// Distance from the part of the tooth that is not enamel.
    pub(super) dentine: f32,
}

/// Rounding of the dentine under the crown's edge, mm.
const DENTINE_EDGE: f32 = 1.1;

/// Rounding of the rim of a worn facet, mm.
const FACET_ROUNDING: f32 = 0.15;

/// Share of a fissure's depth by which the underlying dentine is also lowered.
const FOLLOWS: f32 = 0.6;

impl SdfLevel<'_> {
    /// Returns the signed distance from the side of the crown or the trunk, mm, without an upper end.
    pub(super) fn side(&self, place: [f32; 2]) -> f32 {
        self.body.side(place)
    }

    /// Returns the signed distance from the pulp, mm.
    pub(super) fn pulp(&self, place: [f32; 2]) -> f32 {
        self.pulp.distance(place)
    }
}

impl ToothSdf {
    /// Prepares a form; `thinnest` is the minimum thickness of enamel, mm.
    pub(super) fn new(form: &ToothForm, thinnest: f32) -> ToothSdf {
        let ToothForm {
            sizes,
            body,
            roots,
            occlusal: relief,
            enamel,
            pulp: _,
            side_metric: sides,
            is_mirrored: _,
            age_effects: aged,
        } = form;
        let crown = |p| crown_mm(sizes, p);
        let neck = |p| neck_mm(sizes, p);
        let lofts: Vec<Loft> = roots.iter().map(|root| Loft::new(root, *sides, neck)).collect();
        let body = Loft::new(body, *sides, crown);
        let tips: Vec<[f32; 3]> = relief.cusps.iter().map(|cusp| crown(cusp.tip)).collect();
        ToothSdf {
            sizes: *sizes,
            occlusal: OcclusalSurface::new(relief, *aged, crown),
            edge: relief.edge,
            enamel: *enamel,
            fissure: relief.fissures.iter().map(|f| f.depth).fold(0.0, f32::max),
            thinnest,
            pulp: Pulp::new(form, if lofts.is_empty() { std::slice::from_ref(&body) } else { &lofts }, neck, &tips),
            body,
            roots: lofts,
            bounds: bounds(form),
        }
    }

    pub(super) fn at_height(&self, z: f32) -> SdfLevel<'_> {
        let roots: Vec<LoftSection> = self.roots.iter().map(|root| root.at_height(z)).collect();
        let body = self.body.at_height(z);
        let pulp = self.pulp.at_height(z, if roots.is_empty() { std::slice::from_ref(&body) } else { &roots });
        SdfLevel { z, body, pulp, roots }
    }

    pub(super) fn ground(&self, place: [f32; 2]) -> HeightSample {
        self.occlusal.at(place)
    }

    /// Returns the values of a column; `slope` is the slope of the occlusal surface (without fissures) along x and y,
    /// mm per mm.
    pub(super) fn column(&self, [x, y]: [f32; 2], ground: HeightSample, slope: [f32; 2]) -> SdfColumn {
        let upright = 1.0 / (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let rise = self.sizes.neckline_rise[usize::from(y > 0.0)];
        // Similar to cos² around the tooth: maximum in the middle of the mesial and the distal side, 0 on the buccal
        // and lingual sides.
        let neckline = rise * y * y / (x * x + y * y + 0.01);
        SdfColumn { ground, upright, neckline }
    }

    pub(super) fn at(&self, slice: &SdfLevel, column: &SdfColumn, place: [f32; 2]) -> SurfaceDistances {
        let side = slice.body.side(place);
        let notched = slice.body.furrow_depth(place);
        let above = (slice.z - column.ground.height + column.ground.fissure_depth) * column.upright;
        let above = match column.ground.worn_to {
            Some(left) => smooth_intersection(above, slice.z - left, FACET_ROUNDING),
            None => above,
        };
        let body = smooth_intersection(slice.body.capped(side + notched), above, self.edge);
        let tooth = slice.roots.iter().fold(body, |tooth, root| {
            let distance = root.distance(place) + root.inset();
            smooth_union(tooth, distance, root.fillet())
        });
        SurfaceDistances { tooth, dentine: self.dentine(slice, column, side + self.enamel.follows * notched) }
    }

    /// Returns the signed distance from the dentine surface under the enamel; below the cervical line there is no
    /// enamel at any distance from the axis.
    fn dentine(&self, slice: &SdfLevel, column: &SdfColumn, side: f32) -> f32 {
        let over_neck = slice.z - column.neckline;
        let under_side = side + self.side_thickness(over_neck);
        let ground = column.ground.height - FOLLOWS * column.ground.fissure_depth;
        let under_top = (slice.z - ground) * column.upright + self.top_thickness(column.ground.height);
        smooth_intersection(under_side, under_top, DENTINE_EDGE).min(over_neck)
    }

    /// Returns the thickness of the enamel on the sides, mm, which increases from the cervical line, steeply at first,
    /// to the full thickness.
    fn side_thickness(&self, over_neck: f32) -> f32 {
        let short = 1.0 - (over_neck / (self.enamel.full_at * self.sizes.crown)).clamp(0.0, 1.0);
        (self.enamel.side * (1.0 - short * short)).max(self.thinnest)
    }

    /// Returns the thickness of the enamel on the occlusal surface, mm, by its height between fissure and cusp, plus
    /// the part of the fissure's depth that is taken from the enamel alone.
    fn top_thickness(&self, height: f32) -> f32 {
        let floor = self.occlusal.floor();
        let share = ((height - floor) / (self.sizes.crown - floor)).clamp(0.0, 1.0);
        mix(self.enamel.fissure + (1.0 - FOLLOWS) * self.fissure, self.enamel.cusp, share * share)
    }

    /// Returns a box around the tooth, mm.
    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }
}

/// Converts shares to mm: of the crown above the neck, of the neck and the root below.
fn crown_mm(sizes: &Sizes, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match z > 0.0 {
        true => [x * 0.5 * sizes.buccolingual[0], y * 0.5 * sizes.mesiodistal[0], z * sizes.crown],
        false => neck_mm(sizes, [x, y, z]),
    }
}

/// Converts shares of the neck's widths at any height to mm.
fn neck_mm(sizes: &Sizes, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let length = if z > 0.0 { sizes.crown } else { sizes.root };
    [x * 0.5 * sizes.buccolingual[1], y * 0.5 * sizes.mesiodistal[1], z * length]
}

fn bounds(form: &ToothForm) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    let mut hold = |limb: &form::LoftForm, mm: &dyn Fn([f32; 3]) -> [f32; 3]| {
        for outline in limb.sections {
            let widest = outline.taper.map(|t| 1.0 + t.abs());
            for side in [0, 1] {
                let corner = mm([outline.x[side] * widest[0], outline.y[side] * widest[1], outline.z]);
                bounds = bounds.with(Vec3::from(corner));
            }
        }
    };
    hold(&form.body, &|p| crown_mm(&form.sizes, p));
    form.roots.iter().for_each(|root| hold(root, &|p| neck_mm(&form.sizes, p)));
    bounds.high.z = bounds.high.z.min(form.sizes.crown);
    bounds
}
