//! A limb cut at one height: how far a point of that level is from its side.

use super::blend::{bump, common};
use super::form;
use super::track::Track;

/// A limb in mm.
pub(super) struct Limb {
    /// Centre x, y; half widths x, y; squareness; taper x, y.
    outlines: Track<7>,
    /// Bottom line x, y; depth; half width.
    furrows: Vec<Track<4>>,
    round: f32,
}

/// How far sideways a taper is followed, in half widths: beyond, an outline would turn inside out.
const TAPER_REACH: f32 = 1.3;

/// Rounding of a limb's upper end, mm: hidden inside another limb, so only its being smooth matters.
const UPPER_ROUND: f32 = 0.5;

/// Widest fillet between limbs, mm: the roof of a furcation.
const FURCATION: f32 = 0.9;

/// How much thinner a root begins, mm, and over which length it comes out of the trunk, mm.
const SUNK: f32 = 0.6;
const EMERGES: f32 = 2.2;

/// How the fillet widens with the square of the way down a root, mm per mm².
const FILLET_GROWTH: f32 = 0.12;

impl Limb {
    /// `mm` turns shares x, y, z into mm.
    pub(super) fn new(limb: &form::Limb, mm: impl Fn([f32; 3]) -> [f32; 3]) -> Limb {
        let outline = |o: &form::Outline| {
            let [low, high] = [0, 1].map(|side| mm([o.x[side], o.y[side], o.z]));
            let [cx, cy] = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
            let [ax, ay] = [0, 1].map(|axis| 0.5 * (high[axis] - low[axis]));
            (low[2], [cx, cy, ax, ay, o.square, o.taper[0], o.taper[1]])
        };
        let furrow = |furrow: &form::Furrow| {
            Track::new(furrow.iter().map(|place| {
                let [x, y, z] = mm(place.at);
                (z, [x, y, place.depth, place.width])
            }))
        };
        Limb {
            outlines: Track::new(limb.outlines.iter().map(outline)),
            furrows: limb.furrows.iter().map(furrow).collect(),
            round: limb.round,
        }
    }

    pub(super) fn lowest(&self) -> f32 {
        self.outlines.start()
    }

    pub(super) fn highest(&self) -> f32 {
        self.outlines.end()
    }

    pub(super) fn cut(&self, z: f32) -> Section {
        let [cx, cy, ax, ay, square, taper_x, taper_y] = self.outlines.at(z);
        let notch = |track: &Track<4>| {
            let [x, y, depth, width] = track.at(z);
            let beside = z < track.start() || z > track.end() || depth <= 0.0;
            (!beside).then_some(Notch { at: [x, y], depth, width })
        };
        Section {
            centre: [cx, cy],
            half: [ax, ay],
            square,
            taper: [taper_x, taper_y],
            notches: self.furrows.iter().filter_map(notch).collect(),
            below: self.lowest() - z,
            above: z - self.highest(),
            round: self.round,
        }
    }
}

/// One level of a limb.
pub(super) struct Section {
    centre: [f32; 2],
    half: [f32; 2],
    square: f32,
    taper: [f32; 2],
    notches: Vec<Notch>,
    /// Signed distances to the limb's ends.
    below: f32,
    above: f32,
    round: f32,
}

/// A furrow cut at one height.
struct Notch {
    at: [f32; 2],
    depth: f32,
    width: f32,
}

impl Section {
    /// The place that lies at a share of the half widths from the middle.
    pub(super) fn place(&self, share: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|axis| self.centre[axis] + share[axis] * self.half[axis])
    }

    /// Signed distance to the limb.
    pub(super) fn distance(&self, [x, y]: [f32; 2]) -> f32 {
        let side = self.side([x, y]) + self.notched([x, y]);
        common(common(side, self.below, self.round), self.above, UPPER_ROUND)
    }

    /// Distance to the outline along the ray from its middle, as if the limb had no ends and no furrows.
    ///
    /// The outline is a squircle (Fernández-Guasti): closed form, so that no platform's power function is asked.
    pub(super) fn side(&self, [x, y]: [f32; 2]) -> f32 {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let [ax, ay] = self.half;
        let along = |d: f32, half: f32| (d / half).clamp(-TAPER_REACH, TAPER_REACH);
        let u = dx / (ax * (1.0 + self.taper[0] * along(dy, ay)));
        let v = dy / (ay * (1.0 + self.taper[1] * along(dx, ax)));
        let (uu, vv) = (u * u, v * v);
        let sum = uu + vv;
        let norm_squared = 0.5 * (sum + (sum * sum - 4.0 * self.square * uu * vv).max(0.0).sqrt());
        if norm_squared < 1e-6 {
            return -ax.min(ay);
        }
        (dx * dx + dy * dy).sqrt() * (1.0 - 1.0 / norm_squared.sqrt())
    }

    /// What the furrows take away here, mm.
    pub(super) fn notched(&self, [x, y]: [f32; 2]) -> f32 {
        let depth = |notch: &Notch| {
            let (dx, dy) = (x - notch.at[0], y - notch.at[1]);
            notch.depth * bump((dx * dx + dy * dy).sqrt(), notch.width)
        };
        self.notches.iter().map(depth).fold(0.0, f32::max)
    }

    /// How much thinner this limb is where it comes out of another one, mm: it does so without a step.
    pub(super) fn sunk(&self) -> f32 {
        let short = (1.0 + self.above / EMERGES).clamp(0.0, 1.0);
        SUNK * short * short
    }

    /// Radius of the fillet between this limb and the one it comes out of, mm.
    ///
    /// None where it comes out, for two sides that nearly coincide would bulge.
    pub(super) fn fillet(&self) -> f32 {
        let way_down = (-self.above).max(0.0);
        (FILLET_GROWTH * way_down * way_down).clamp(1e-3, FURCATION)
    }
}
