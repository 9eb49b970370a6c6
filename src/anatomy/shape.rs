//! A form turned into distances: how far any point is from the tooth's surface, its dentine and its pulp.
//!
//! A tooth is mostly a stack of outlines with a map of heights on top. So what depends on z alone is worked out once per
//! level ([`Slice`]), what depends on x and y alone once per column ([`Column`]), and a point only brings them together.

use super::blend::{common, joined, mix};
use super::form::{self, Form, Sizes};
use super::pulp::{Pulp, PulpSection};
use super::relief::{Ground, Relief};
use super::section::{Limb, Section};
use crate::frame::Vec3;

/// A tooth in mm, tooth space.
pub(super) struct Shape {
    sizes: Sizes,
    body: Limb,
    roots: Vec<Limb>,
    relief: Relief,
    edge: f32,
    enamel: form::Enamel,
    /// Depth of the deepest fissure.
    fissure: f32,
    /// Thinnest enamel there is: a grid cannot hold a finer edge.
    thinnest: f32,
    pulp: Pulp,
    low: Vec3,
    high: Vec3,
}

/// What depends on the height alone.
pub(super) struct Slice<'a> {
    z: f32,
    body: Section,
    roots: Vec<Section>,
    pulp: PulpSection<'a>,
}

/// What depends on x and y alone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Column {
    ground: Ground,
    /// Cosine of the ground's tilt: makes a height above ground a distance from it.
    upright: f32,
    /// Height of the neckline that belongs to this direction from the tooth's axis.
    neckline: f32,
}

/// Signed distances of a point from the tooth and its dentine, mm: negative inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depths {
    pub(super) tooth: f32,
    /// To the part of the tooth that is not enamel.
    pub(super) dentine: f32,
}

/// Rounding of the dentine under the crown's edge, mm.
const DENTINE_EDGE: f32 = 1.1;

/// Rounding of the rim of a worn facet, mm.
const FACET: f32 = 0.15;

/// Share of a fissure's depth by which the dentine under it sinks too.
const FOLLOWS: f32 = 0.6;

impl Slice<'_> {
    /// Signed distance to the crown's side or the trunk's, as if nothing ended it above, mm.
    pub(super) fn side(&self, place: [f32; 2]) -> f32 {
        self.body.side(place)
    }

    /// Signed distance to the pulp, mm.
    pub(super) fn pulp(&self, place: [f32; 2]) -> f32 {
        self.pulp.distance(place)
    }
}

impl Shape {
    /// `thinnest` is the thinnest enamel to make, mm.
    pub(super) fn new(form: &Form, thinnest: f32) -> Shape {
        let Form { sizes, body, roots, relief, enamel, pulp: _, sides, is_mirrored: _, aged } = form;
        let crown = |p| crown_mm(sizes, p);
        let neck = |p| neck_mm(sizes, p);
        let limbs: Vec<Limb> = roots.iter().map(|root| Limb::new(root, *sides, neck)).collect();
        let body = Limb::new(body, *sides, crown);
        let tips: Vec<[f32; 3]> = relief.cusps.iter().map(|cusp| crown(cusp.tip)).collect();
        let [low, high] = bounds(form);
        Shape {
            sizes: *sizes,
            relief: Relief::new(relief, *aged, crown),
            edge: relief.edge,
            enamel: *enamel,
            fissure: relief.fissures.iter().map(|f| f.depth).fold(0.0, f32::max),
            thinnest,
            pulp: Pulp::new(form, if limbs.is_empty() { std::slice::from_ref(&body) } else { &limbs }, neck, &tips),
            body,
            roots: limbs,
            low,
            high,
        }
    }

    pub(super) fn cut(&self, z: f32) -> Slice<'_> {
        let roots: Vec<Section> = self.roots.iter().map(|root| root.cut(z)).collect();
        let body = self.body.cut(z);
        let pulp = self.pulp.cut(z, if roots.is_empty() { std::slice::from_ref(&body) } else { &roots });
        Slice { z, body, pulp, roots }
    }

    pub(super) fn ground(&self, place: [f32; 2]) -> Ground {
        self.relief.at(place)
    }

    /// `slope` is how the ground (without fissures) rises along x and y, mm per mm.
    pub(super) fn column(&self, [x, y]: [f32; 2], ground: Ground, slope: [f32; 2]) -> Column {
        let upright = 1.0 / (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let rise = self.sizes.neckline_rise[usize::from(y > 0.0)];
        // Like cos² around the tooth: full at the middle of the mesial and the distal side, nothing buccally and lingually.
        let neckline = rise * y * y / (x * x + y * y + 0.01);
        Column { ground, upright, neckline }
    }

    pub(super) fn at(&self, slice: &Slice, column: &Column, place: [f32; 2]) -> Depths {
        let side = slice.body.side(place);
        let notched = slice.body.notched(place);
        let above = (slice.z - column.ground.height + column.ground.carved) * column.upright;
        let above = match column.ground.worn {
            Some(left) => common(above, slice.z - left, FACET),
            None => above,
        };
        let body = common(slice.body.ended(side + notched), above, self.edge);
        let tooth = slice.roots.iter().fold(body, |tooth, root| {
            let distance = root.distance(place) + root.sunk();
            joined(tooth, distance, root.fillet())
        });
        Depths { tooth, dentine: self.dentine(slice, column, side + self.enamel.follows * notched) }
    }

    /// Distance to the surface under the enamel; below the neckline there is none, however far out.
    fn dentine(&self, slice: &Slice, column: &Column, side: f32) -> f32 {
        let over_neck = slice.z - column.neckline;
        let under_side = side + self.side_thickness(over_neck);
        let ground = column.ground.height - FOLLOWS * column.ground.carved;
        let under_top = (slice.z - ground) * column.upright + self.top_thickness(column.ground.height);
        common(under_side, under_top, DENTINE_EDGE).min(over_neck)
    }

    /// Grows from an edge at the neckline, steeply at first, to the full thickness.
    fn side_thickness(&self, over_neck: f32) -> f32 {
        let short = 1.0 - (over_neck / (self.enamel.full_at * self.sizes.crown)).clamp(0.0, 1.0);
        (self.enamel.side * (1.0 - short * short)).max(self.thinnest)
    }

    /// Between fissure and cusp as the height is; what the fissure takes from the enamel alone comes on top.
    fn top_thickness(&self, height: f32) -> f32 {
        let floor = self.relief.floor();
        let share = ((height - floor) / (self.sizes.crown - floor)).clamp(0.0, 1.0);
        mix(self.enamel.fissure + (1.0 - FOLLOWS) * self.fissure, self.enamel.cusp, share * share)
    }

    /// A box around the tooth.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        [self.low, self.high]
    }
}

/// Shares of the crown above the neck and of the neck and the root below, in mm.
fn crown_mm(sizes: &Sizes, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match z > 0.0 {
        true => [x * 0.5 * sizes.buccolingual[0], y * 0.5 * sizes.mesiodistal[0], z * sizes.crown],
        false => neck_mm(sizes, [x, y, z]),
    }
}

/// Shares of the neck's widths at any height, in mm.
fn neck_mm(sizes: &Sizes, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let length = if z > 0.0 { sizes.crown } else { sizes.root };
    [x * 0.5 * sizes.buccolingual[1], y * 0.5 * sizes.mesiodistal[1], z * length]
}

fn bounds(form: &Form) -> [Vec3; 2] {
    let (mut low, mut high) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
    let mut hold = |limb: &form::Limb, mm: &dyn Fn([f32; 3]) -> [f32; 3]| {
        for outline in limb.outlines {
            let widest = outline.taper.map(|t| 1.0 + t.abs());
            for side in [0, 1] {
                let corner = mm([outline.x[side] * widest[0], outline.y[side] * widest[1], outline.z]);
                low = low.min(Vec3::from(corner));
                high = high.max(Vec3::from(corner));
            }
        }
    };
    hold(&form.body, &|p| crown_mm(&form.sizes, p));
    form.roots.iter().for_each(|root| hold(root, &|p| neck_mm(&form.sizes, p)));
    high.z = high.z.min(form.sizes.crown);
    [low, high]
}
