//! A limb cut at one height: how far a point of that level is from its side.

use super::blend::{bump, common};
use super::form::{self, Sides};
use super::track::Track;

/// A limb in mm.
pub(super) struct Limb {
    /// Centre x, y; half widths x, y; squareness; taper x, y; skew.
    outlines: Track<8>,
    /// Bottom line x, y; depth; half width.
    furrows: Vec<Track<4>>,
    round: f32,
    sides: Sides,
    lined: Option<Lined>,
}

/// What secondary dentine has left of a limb of the pulp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lined {
    /// Of its widths.
    pub(super) width: f32,
    /// Of its height above the neck.
    pub(super) height: f32,
    /// How much its floor has risen, mm.
    pub(super) floor: f32,
}

/// No pulp gets narrower than so, half its width in mm: thinner threads no file finds, nor a grid holds together.
pub(super) const THREAD: f32 = 0.13;

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
    pub(super) fn new(limb: &form::Limb, sides: Sides, mm: impl Fn([f32; 3]) -> [f32; 3]) -> Limb {
        let outline = |o: &form::Outline| {
            let [low, high] = [0, 1].map(|side| mm([o.x[side], o.y[side], o.z]));
            let [cx, cy] = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
            let [ax, ay] = [0, 1].map(|axis| 0.5 * (high[axis] - low[axis]));
            (low[2], [cx, cy, ax, ay, o.square, o.taper[0], o.taper[1], o.skew])
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
            sides,
            lined: None,
        }
    }

    /// The same, lined with secondary dentine.
    pub(super) fn lined(self, lined: Option<Lined>) -> Limb {
        Limb { lined, ..self }
    }

    pub(super) fn lowest(&self) -> f32 {
        let start = self.outlines.start();
        self.lined.map_or(start, |lined| start + lined.floor)
    }

    pub(super) fn highest(&self) -> f32 {
        let end = self.outlines.end();
        self.lined.map_or(end, |lined| if end > 0.0 { end * lined.height } else { end })
    }

    pub(super) fn cut(&self, z: f32) -> Section {
        let written = match self.lined {
            Some(lined) if z > 0.0 => z / lined.height,
            _ => z,
        };
        let [cx, cy, ax, ay, square, taper_x, taper_y, skew] = self.outlines.at(written);
        let narrowed = |half: f32| self.lined.map_or(half, |lined| (half * lined.width).max(half.min(THREAD)));
        let [ax, ay] = [ax, ay].map(narrowed);
        let notch = |track: &Track<4>| {
            let [x, y, depth, width] = track.at(z);
            let beside = z < track.start() || z > track.end() || depth <= 0.0;
            (!beside).then_some(Notch { at: [x, y], depth, width })
        };
        // What has become lower is not rounded away.
        let upright = 0.35 * (self.highest() - self.lowest());
        let rounds =
            [self.round, UPPER_ROUND].map(|round| if self.lined.is_some() { round.min(upright) } else { round });
        Section {
            centre: [cx, cy],
            half: [ax, ay],
            square,
            taper: [taper_x, taper_y],
            skew,
            notches: self.furrows.iter().filter_map(notch).collect(),
            below: self.lowest() - z,
            above: z - self.highest(),
            rounds,
            sides: self.sides,
        }
    }
}

/// One level of a limb.
pub(super) struct Section {
    centre: [f32; 2],
    half: [f32; 2],
    square: f32,
    taper: [f32; 2],
    skew: f32,
    notches: Vec<Notch>,
    /// Signed distances to the limb's ends.
    below: f32,
    above: f32,
    /// Roundings of its lower and its upper end.
    rounds: [f32; 2],
    sides: Sides,
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
    pub(super) fn distance(&self, place: [f32; 2]) -> f32 {
        self.ended(self.side(place) + self.notched(place))
    }

    /// Signed distance to the limb of a place so far from its side, furrows and all.
    pub(super) fn ended(&self, side: f32) -> f32 {
        common(common(side, self.below, self.rounds[0]), self.above, self.rounds[1])
    }

    /// Distance to the outline, as if the limb had no ends and no furrows.
    ///
    /// The outline is a squircle (Fernández-Guasti): closed form, so that no platform's power function is asked.
    pub(super) fn side(&self, [x, y]: [f32; 2]) -> f32 {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let [ax, ay] = self.half;
        let along = |d: f32, half: f32| (d / half).clamp(-TAPER_REACH, TAPER_REACH);
        let [wide_x, wide_y] = [ax * (1.0 + self.taper[0] * along(dy, ay)), ay * (1.0 + self.taper[1] * along(dx, ax))];
        let u = (dx - self.skew * ax * along(dy, ay)) / wide_x;
        let v = dy / wide_y;
        let (uu, vv) = (u * u, v * v);
        let sum = uu + vv;
        let root = (sum * sum - 4.0 * self.square * uu * vv).max(0.0).sqrt();
        let norm_squared = 0.5 * (sum + root);
        if norm_squared < 1e-6 {
            return -ax.min(ay);
        }
        if self.sides == Sides::AlongRays {
            return (dx * dx + dy * dy).sqrt() * (1.0 - 1.0 / norm_squared.sqrt());
        }
        let norm = norm_squared.sqrt();
        // The norm's rise along x and y; how taper and skew change it is small, but for the skew's slant.
        let share = |other: f32| if root > 1e-6 { 0.5 * (1.0 + (sum - 2.0 * self.square * other) / root) } else { 0.5 };
        let (rise_u, rise_v) = (share(vv) * u / (norm * wide_x), share(uu) * v / (norm * wide_y));
        let rise_v = rise_v - rise_u * self.skew * ax / ay;
        let distance = (norm - 1.0) / (rise_u * rise_u + rise_v * rise_v).sqrt().max(1e-3);
        // Near the middle line of a flat outline the normal points along it; the nearest side is beside it.
        let most = ax.min(ay) * (1.0 - norm_squared).max(0.0).sqrt();
        if norm < 1.0 { distance.max(-most) } else { distance }
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
