//! Limbs of a tooth (crown, trunk, root, pulp chamber), their cross-sections, and distances of points from their sides.

use crate::blend::{bump, smooth_intersection};
use crate::form;
use crate::form::SideMetric;
use crate::monotone_spline::MonotoneSpline;

/// A limb in mm.
pub(super) struct Loft {
    /// Centre x, y; half-widths x, y; squareness; taper x, y; skew.
    sections: MonotoneSpline<8>,
    /// Bottom line x, y; depth; half-width.
    furrows: Vec<MonotoneSpline<4>>,
    rounding: f32,
    side_metric: SideMetric,
    secondary_dentine: Option<SecondaryDentine>,
}

/// Remaining part of a limb of the pulp after deposition of secondary dentine.
#[derive(Clone, Copy, Debug)]
pub(super) struct SecondaryDentine {
    /// Remaining share of the widths.
    pub(super) width: f32,
    /// Remaining share of the height above the neck.
    pub(super) height: f32,
    /// Rise of the floor, mm.
    pub(super) floor: f32,
}

/// Minimum half-width of a pulp, mm: a narrower canal could not be found with a file, and would not be continuous on a
/// voxel grid.
pub(super) const MIN_PULP_HALF_WIDTH: f32 = 0.13;

/// Maximum lateral distance at which a taper is applied, in half-widths; beyond it the outline would be inverted.
const TAPER_REACH: f32 = 1.3;

/// Rounding of a limb's upper end, mm. The end lies inside another limb and only needs to be smooth.
const UPPER_ROUND: f32 = 0.5;

/// Maximum radius of the fillet between limbs, mm: at the roof of a furcation.
const MAX_FILLET: f32 = 0.9;

/// Inset of a root at its beginning, mm, and the length over which it emerges from the trunk, mm.
const ROOT_INSET: f32 = 0.6;
const ROOT_EMERGENCE: f32 = 2.2;

/// Increase of the fillet's radius with the square of the distance down a root, mm per mm².
const FILLET_GROWTH: f32 = 0.12;

impl Loft {
    /// Makes a limb; `mm` converts shares x, y, z to mm.
    pub(super) fn new(limb: &form::LoftForm, side_metric: SideMetric, mm: impl Fn([f32; 3]) -> [f32; 3]) -> Loft {
        let outline = |o: &form::CrossSection| {
            let [low, high] = [0, 1].map(|side| mm([o.x[side], o.y[side], o.z]));
            let [cx, cy] = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
            let [ax, ay] = [0, 1].map(|axis| 0.5 * (high[axis] - low[axis]));
            (low[2], [cx, cy, ax, ay, o.squareness, o.taper[0], o.taper[1], o.skew])
        };
        let furrow = |furrow: &form::Furrow| {
            MonotoneSpline::new(furrow.iter().map(|place| {
                let [x, y, z] = mm(place.at);
                (z, [x, y, place.depth, place.width])
            }))
        };
        Loft {
            sections: MonotoneSpline::new(limb.sections.iter().map(outline)),
            furrows: limb.furrows.iter().map(furrow).collect(),
            rounding: limb.rounding,
            side_metric,
            secondary_dentine: None,
        }
    }

    /// Returns the limb lined with secondary dentine.
    pub(super) fn with_secondary_dentine(self, lined: Option<SecondaryDentine>) -> Loft {
        Loft { secondary_dentine: lined, ..self }
    }

    pub(super) fn lowest(&self) -> f32 {
        let start = self.sections.start();
        self.secondary_dentine.map_or(start, |lined| start + lined.floor)
    }

    pub(super) fn highest(&self) -> f32 {
        let end = self.sections.end();
        self.secondary_dentine.map_or(end, |lined| if end > 0.0 { end * lined.height } else { end })
    }

    pub(super) fn at_height(&self, z: f32) -> LoftSection {
        let written = match self.secondary_dentine {
            Some(lined) if z > 0.0 => z / lined.height,
            _ => z,
        };
        let [cx, cy, ax, ay, square, taper_x, taper_y, skew] = self.sections.at(written);
        let narrowed = |half: f32| {
            self.secondary_dentine.map_or(half, |lined| (half * lined.width).max(half.min(MIN_PULP_HALF_WIDTH)))
        };
        let [ax, ay] = [ax, ay].map(narrowed);
        let notch = |track: &MonotoneSpline<4>| {
            let [x, y, depth, width] = track.at(z);
            let beside = z < track.start() || z > track.end() || depth <= 0.0;
            (!beside).then_some(Notch { at: [x, y], depth, width })
        };
        // The rounding is limited, so that a limb of reduced height does not disappear.
        let upright = 0.35 * (self.highest() - self.lowest());
        let rounds = [self.rounding, UPPER_ROUND]
            .map(|round| if self.secondary_dentine.is_some() { round.min(upright) } else { round });
        LoftSection {
            centre: [cx, cy],
            half: [ax, ay],
            squareness: square,
            taper: [taper_x, taper_y],
            skew,
            notches: self.furrows.iter().filter_map(notch).collect(),
            below: self.lowest() - z,
            above: z - self.highest(),
            rounds,
            side_metric: self.side_metric,
        }
    }
}

/// A limb at one height.
pub(super) struct LoftSection {
    centre: [f32; 2],
    half: [f32; 2],
    squareness: f32,
    taper: [f32; 2],
    skew: f32,
    notches: Vec<Notch>,
    /// Signed distances from the limb's ends, mm.
    below: f32,
    above: f32,
    /// Roundings of the lower and the upper end, mm.
    rounds: [f32; 2],
    side_metric: SideMetric,
}

/// A furrow at one height.
struct Notch {
    at: [f32; 2],
    depth: f32,
    width: f32,
}

impl LoftSection {
    /// Returns the point at a share of the half-widths from the centre.
    pub(super) fn place(&self, share: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|axis| self.centre[axis] + share[axis] * self.half[axis])
    }

    /// Returns the signed distance from the limb, mm.
    pub(super) fn distance(&self, place: [f32; 2]) -> f32 {
        self.capped(self.side(place) + self.furrow_depth(place))
    }

    /// Returns the signed distance from the limb of a point at the distance `side` from its side, furrows included.
    pub(super) fn capped(&self, side: f32) -> f32 {
        smooth_intersection(smooth_intersection(side, self.below, self.rounds[0]), self.above, self.rounds[1])
    }

    /// Returns the signed distance from the outline, mm, without the limb's ends and furrows.
    ///
    /// The outline is a squircle (Fernández-Guasti), which has a closed form and does not depend on a platform's power
    /// function.
    pub(super) fn side(&self, [x, y]: [f32; 2]) -> f32 {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let [ax, ay] = self.half;
        let along = |d: f32, half: f32| (d / half).clamp(-TAPER_REACH, TAPER_REACH);
        let [wide_x, wide_y] = [ax * (1.0 + self.taper[0] * along(dy, ay)), ay * (1.0 + self.taper[1] * along(dx, ax))];
        let u = (dx - self.skew * ax * along(dy, ay)) / wide_x;
        let v = dy / wide_y;
        let (uu, vv) = (u * u, v * v);
        let sum = uu + vv;
        let root = (sum * sum - 4.0 * self.squareness * uu * vv).max(0.0).sqrt();
        let norm_squared = 0.5 * (sum + root);
        if norm_squared < 1e-6 {
            return -ax.min(ay);
        }
        if self.side_metric == SideMetric::AlongRays {
            return (dx * dx + dy * dy).sqrt() * (1.0 - 1.0 / norm_squared.sqrt());
        }
        let norm = norm_squared.sqrt();
        // The gradient of the norm along x and y; the effect of taper and skew on it is small, except for the slant of
        // the skew.
        let share =
            |other: f32| if root > 1e-6 { 0.5 * (1.0 + (sum - 2.0 * self.squareness * other) / root) } else { 0.5 };
        let (rise_u, rise_v) = (share(vv) * u / (norm * wide_x), share(uu) * v / (norm * wide_y));
        let rise_v = rise_v - rise_u * self.skew * ax / ay;
        let distance = (norm - 1.0) / (rise_u * rise_u + rise_v * rise_v).sqrt().max(1e-3);
        // Near the centre line of a flat outline the normal points along the line, but the nearest side is lateral.
        let most = ax.min(ay) * (1.0 - norm_squared).max(0.0).sqrt();
        if norm < 1.0 { distance.max(-most) } else { distance }
    }

    /// Returns the depth of the furrows at a point, mm.
    pub(super) fn furrow_depth(&self, [x, y]: [f32; 2]) -> f32 {
        let depth = |notch: &Notch| {
            let (dx, dy) = (x - notch.at[0], y - notch.at[1]);
            notch.depth * bump((dx * dx + dy * dy).sqrt(), notch.width)
        };
        self.notches.iter().map(depth).fold(0.0, f32::max)
    }

    /// Returns the inset with which this limb emerges from another one without a step, mm.
    pub(super) fn inset(&self) -> f32 {
        let short = (1.0 + self.above / ROOT_EMERGENCE).clamp(0.0, 1.0);
        ROOT_INSET * short * short
    }

    /// Returns the radius of the fillet between this limb and the one from which it emerges, mm.
    ///
    /// It is nearly 0 at the point of emergence, since two sides that nearly coincide would bulge.
    pub(super) fn fillet(&self) -> f32 {
        let way_down = (-self.above).max(0.0);
        (FILLET_GROWTH * way_down * way_down).clamp(1e-3, MAX_FILLET)
    }
}
