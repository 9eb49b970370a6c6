//! The outline of a bur: half of its section, turned about its axis.
//!
//! Takes lengths in mm. Gives signed distances, nearest places and volumes of the body of revolution, exact to rounding.
//! In the half plane of a section `r` is the distance from the axis and `z` runs along it, from the tip toward the hand.

use crate::frame::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// A closed body of revolution. Its outline climbs from the axis at the tip to the axis at the top; the pieces follow each
/// other in z, so that every height has one radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    pieces: Vec<Piece>,
}

/// A place in the half plane of a section, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub r: f32,
    pub z: f32,
}

/// What an outline has nearest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Signed, mm, negative inside.
    pub distance: f32,
    pub on: Place,
    /// Unit, outward.
    pub normal: Place,
}

/// A place on an outline that stands for a stretch of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    pub on: Place,
    /// Unit, outward.
    pub normal: Place,
    /// Length of the stretch, mm.
    pub spacing: f32,
}

/// One stretch of an outline, climbing from one place to another.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Piece {
    Line {
        from: Place,
        to: Place,
    },
    /// Bulging outward.
    Arc {
        from: Place,
        to: Place,
        centre: Place,
        radius: f32,
    },
}

/// Rounding of edges that a maker calls sharp, mm. Carbide edges are finer when new; this is what wear leaves, and what a
/// normal can turn on. 0.03–0.08 feels alike.
pub const EDGE: f32 = 0.05;

impl Profile {
    /// A ball with its lowest point at `z`.
    pub fn ball(radius: f32, z: f32) -> Profile {
        let mut outline = Outline::at(Place { r: 0.0, z });
        outline.arc(Place { r: 0.0, z: z + radius }, radius, Place { r: radius, z: z + radius });
        outline.arc(Place { r: 0.0, z: z + radius }, radius, Place { r: 0.0, z: z + 2.0 * radius });
        outline.closed()
    }

    /// A frustum with both edges rounded: flat-ended cylinder, taper and inverted cone. Tip at z = 0.
    ///
    /// `low` and `high` are the radii at the tip and at the top, where the edges would be if they were sharp.
    pub fn frustum(low: f32, high: f32, length: f32, edges: [f32; 2]) -> Profile {
        // The wall leans outward by this angle on its way up.
        let lean = libm::atan2f(high - low, length);
        let (sin, cos) = (libm::sinf(lean), libm::cosf(lean));
        // Centres of the roundings: as far from the wall as from the flat end.
        let tucked = |edge: f32, turn: f32| edge * libm::tanf(0.5 * turn);
        let below = Place { r: low - tucked(edges[0], FRAC_PI_2 - lean), z: edges[0] };
        let above = Place { r: high - tucked(edges[1], FRAC_PI_2 + lean), z: length - edges[1] };
        let out = |centre: Place, edge: f32| Place { r: centre.r + edge * cos, z: centre.z - edge * sin };
        let mut outline = Outline::at(Place { r: 0.0, z: 0.0 });
        outline.line(Place { r: below.r, z: 0.0 });
        outline.arc(below, edges[0], out(below, edges[0]));
        outline.line(out(above, edges[1]));
        outline.arc(above, edges[1], Place { r: above.r, z: length });
        outline.line(Place { r: 0.0, z: length });
        outline.closed()
    }

    /// A frustum whose tip is a part of a ball that the wall runs into without an edge: cylinder and taper with a round end,
    /// and the pear, which is a ball with a neck behind it. Tip at z = 0.
    pub fn round_ended(ball: f32, high: f32, length: f32) -> Profile {
        // The wall touches the ball and passes through (high, length): with the ball's centre at height `ball`, the
        // tangent from that point.
        let (dr, dz) = (high, length - ball);
        let far = (dr * dr + dz * dz).sqrt();
        // Angle between the axis and the way to the point, and between that way and the radius to the place of touch.
        let aside = libm::atan2f(dr, dz);
        let touch = aside + libm::acosf((ball / far).clamp(-1.0, 1.0));
        let at = Place { r: ball * libm::sinf(touch), z: ball + ball * libm::cosf(touch) };
        let centre = Place { r: 0.0, z: ball };
        let mut outline = Outline::at(Place { r: 0.0, z: 0.0 });
        outline.arc(centre, ball, at);
        outline.top(at, Place { r: high, z: length });
        outline.closed()
    }

    /// Two arcs about far centres: slender at the tip, widest in the middle, slender again at the top. Tip at z = 0.
    pub fn flame(radius: f32, length: f32, tip: f32) -> Profile {
        // The flank is an arc through (radius, middle) about a centre beyond the axis, running into the tip's ball without
        // an edge: its radius R solves (R − radius)² + (middle − tip)² = (R − tip)².
        let middle = 0.5 * length;
        let drop = middle - tip;
        let flank = (drop * drop + radius * radius - tip * tip) / (2.0 * (radius - tip));
        let centre = Place { r: radius - flank, z: middle };
        let share = flank / (flank - tip);
        // Where flank and tip touch: on the line through both centres, beyond the tip's.
        let touch = Place { r: centre.r - centre.r * share, z: centre.z - drop * share };
        let top = Place { r: touch.r, z: length - touch.z };
        let mut outline = Outline::at(Place { r: 0.0, z: 0.0 });
        outline.arc(Place { r: 0.0, z: tip }, tip, touch);
        outline.arc(centre, flank, Place { r: radius, z: middle });
        outline.arc(centre, flank, top);
        outline.arc(Place { r: 0.0, z: length - tip }, tip, Place { r: 0.0, z: length });
        outline.closed()
    }

    /// A cone that goes over into a cylinder: the neck and shank above a working end.
    pub fn shank(neck: Place, begin: Place, top: f32) -> Profile {
        let mut outline = Outline::at(Place { r: 0.0, z: neck.z });
        outline.line(neck);
        outline.line(begin);
        outline.line(Place { r: begin.r, z: top });
        outline.line(Place { r: 0.0, z: top });
        outline.closed()
    }

    /// Heights of the tip and of the top.
    pub fn span(&self) -> [f32; 2] {
        let ends = |pieces: &[Piece]| Some([pieces.first()?.from().z, pieces.last()?.to().z]);
        ends(&self.pieces).unwrap_or_default()
    }

    /// Greatest distance of the outline from the axis.
    pub fn radius(&self) -> f32 {
        self.pieces.iter().map(|p| p.from().r.max(p.to().r)).fold(0.0, f32::max)
    }

    /// Distance of the outline from the axis at a height; 0 above and below.
    pub fn radius_at(&self, z: f32) -> f32 {
        let there = self.pieces.iter().filter(|p| p.from().z <= z && z <= p.to().z);
        there.map(|p| p.radius_at(z)).fold(0.0, f32::max)
    }

    /// Signed distance, mm, negative inside.
    pub fn distance(&self, at: Place) -> f32 {
        self.nearest(at).distance
    }

    /// The place of the outline nearest to a place.
    pub fn nearest(&self, at: Place) -> Nearest {
        let (on, normal) = self.onto(at);
        let far = on.distance_squared(at).sqrt();
        Nearest { distance: if at.r < self.radius_at(at.z) { -far } else { far }, on, normal }
    }

    /// The same without the distance: the place and the outward normal there.
    pub(super) fn onto(&self, at: Place) -> (Place, Place) {
        let mut least = f32::INFINITY;
        let mut found = (at, None);
        for piece in &self.pieces {
            let on = piece.nearest(at);
            let squared = on.distance_squared(at);
            if squared < least {
                (least, found) = (squared, (on, Some(piece)));
            }
        }
        let (on, piece) = found;
        (on, piece.map_or(Place { r: 1.0, z: 0.0 }, |p| p.normal(on)))
    }

    /// Volume of the body, mm³: Simpson's rule over every piece.
    pub fn volume_mm3(&self) -> f64 {
        const STEPS: usize = 200;
        let area = |piece: &Piece, z: f32| f64::from(PI) * f64::from(piece.radius_at(z)).powi(2);
        let slab = |piece: &Piece| {
            let (low, high) = (piece.from().z, piece.to().z);
            let at = |i: usize| area(piece, low + (high - low) * i as f32 / STEPS as f32);
            let weight = |i: usize| if i % 2 == 1 { 4.0 } else { 2.0 };
            let inner: f64 = (1..STEPS).map(|i| weight(i) * at(i)).sum();
            f64::from(high - low) / STEPS as f64 / 3.0 * (at(0) + inner + at(STEPS))
        };
        self.pieces.iter().filter(|p| p.to().z > p.from().z).map(slab).sum()
    }

    /// Places along the outline for a shell.
    pub(super) fn stations(&self, apart: f32) -> Vec<Station> {
        let mut all = Vec::new();
        for piece in &self.pieces {
            let count = (piece.length() / piece.apart(apart)).ceil().max(1.0) as usize;
            let spacing = piece.length() / count as f32;
            all.extend((0..count).map(|i| {
                let on = piece.at((i as f32 + 0.5) / count as f32);
                Station { on, normal: piece.normal(on), spacing }
            }));
        }
        all
    }
}

/// An outline being drawn.
struct Outline {
    at: Place,
    pieces: Vec<Piece>,
}

impl Outline {
    fn at(at: Place) -> Outline {
        Outline { at, pieces: Vec::new() }
    }

    fn line(&mut self, to: Place) {
        if to.distance_squared(self.at) > 1e-12 {
            self.pieces.push(Piece::Line { from: self.at, to });
            self.at = to;
        }
    }

    fn arc(&mut self, centre: Place, radius: f32, to: Place) {
        if to.distance_squared(self.at) > 1e-12 {
            self.pieces.push(Piece::Arc { from: self.at, to, centre, radius });
            self.at = to;
        }
    }

    /// A wall up to a top with a rounded edge.
    fn top(&mut self, from: Place, sharp: Place) {
        let (dr, dz) = (sharp.r - from.r, sharp.z - from.z);
        let length = (dr * dr + dz * dz).sqrt();
        let (sin, cos) = (dr / length, dz / length);
        let lean = libm::atan2f(dr, dz);
        let edge = EDGE.min(0.4 * sharp.r);
        let centre = Place { r: sharp.r - edge * libm::tanf(0.5 * (FRAC_PI_2 + lean)), z: sharp.z - edge };
        self.line(Place { r: centre.r + edge * cos, z: centre.z - edge * sin });
        self.arc(centre, edge, Place { r: centre.r, z: sharp.z });
        self.line(Place { r: 0.0, z: sharp.z });
    }

    fn closed(self) -> Profile {
        Profile { pieces: self.pieces }
    }
}

impl Place {
    fn distance_squared(self, other: Place) -> f32 {
        (self.r - other.r) * (self.r - other.r) + (self.z - other.z) * (self.z - other.z)
    }

    /// Where a point of handle space lies in the half plane through it and the axis.
    pub fn of(point_in_handle: Vec3) -> Place {
        let Vec3 { x, y, z } = point_in_handle;
        Place { r: (x * x + y * y).sqrt(), z }
    }

    /// The place or direction in handle space, in the half plane that a point lies in.
    pub fn beside(self, point_in_handle: Vec3) -> Vec3 {
        let r = Place::of(point_in_handle).r;
        let outward = if r > 1e-9 { point_in_handle.with_z(0.0) / r } else { Vec3::X };
        outward * self.r + Vec3::Z * self.z
    }
}

impl Piece {
    fn from(&self) -> Place {
        match *self {
            Piece::Line { from, .. } | Piece::Arc { from, .. } => from,
        }
    }

    fn to(&self) -> Place {
        match *self {
            Piece::Line { to, .. } | Piece::Arc { to, .. } => to,
        }
    }

    fn nearest(&self, at: Place) -> Place {
        match *self {
            Piece::Line { from, to } => {
                let (dr, dz) = (to.r - from.r, to.z - from.z);
                let along = ((at.r - from.r) * dr + (at.z - from.z) * dz) / (dr * dr + dz * dz);
                let t = along.clamp(0.0, 1.0);
                Place { r: from.r + dr * t, z: from.z + dz * t }
            }
            Piece::Arc { from, to, centre, radius } => {
                let (r, z) = (at.r - centre.r, at.z - centre.z);
                let far = (r * r + z * z).sqrt();
                if far > 1e-9 && r >= -1e-9 {
                    let on = Place { r: centre.r + r * radius / far, z: centre.z + z * radius / far };
                    if from.z <= on.z && on.z <= to.z {
                        return on;
                    }
                }
                if at.distance_squared(from) <= at.distance_squared(to) { from } else { to }
            }
        }
    }

    fn normal(&self, on: Place) -> Place {
        let (r, z) = match *self {
            // Climbing outward along a flat tip, straight up a wall, inward along a flat top: outward is to the right.
            Piece::Line { from, to } => (to.z - from.z, from.r - to.r),
            Piece::Arc { centre, .. } => (on.r - centre.r, on.z - centre.z),
        };
        let length = (r * r + z * z).sqrt().max(1e-12);
        Place { r: r / length, z: z / length }
    }

    fn radius_at(&self, z: f32) -> f32 {
        match *self {
            Piece::Line { from, to } => {
                let climb = to.z - from.z;
                if climb.abs() < 1e-9 { from.r.max(to.r) } else { from.r + (to.r - from.r) * (z - from.z) / climb }
            }
            Piece::Arc { centre, radius, .. } => {
                let up = z - centre.z;
                centre.r + (radius * radius - up * up).max(0.0).sqrt()
            }
        }
    }

    fn length(&self) -> f32 {
        match *self {
            Piece::Line { from, to } => from.distance_squared(to).sqrt(),
            Piece::Arc { radius, .. } => radius * self.turn(),
        }
    }

    /// Angle of an arc between its ends.
    fn turn(&self) -> f32 {
        let Piece::Arc { from, to, centre, .. } = *self else { return 0.0 };
        let angle = |p: Place| libm::atan2f(p.z - centre.z, p.r - centre.r);
        angle(to) - angle(from)
    }

    /// Distance between stations: on a tight arc three or more, so that a normal never turns by more than 30° between them.
    fn apart(&self, apart: f32) -> f32 {
        match *self {
            Piece::Line { .. } => apart,
            Piece::Arc { radius, .. } => apart.min(radius * PI / 6.0),
        }
    }

    /// The place at a share of the length.
    fn at(&self, share: f32) -> Place {
        match *self {
            Piece::Line { from, to } => {
                Place { r: from.r + (to.r - from.r) * share, z: from.z + (to.z - from.z) * share }
            }
            Piece::Arc { from, centre, radius, .. } => {
                let begin = libm::atan2f(from.z - centre.z, from.r - centre.r);
                let angle = begin + self.turn() * share;
                Place { r: centre.r + radius * libm::cosf(angle), z: centre.z + radius * libm::sinf(angle) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [Profile; 6] {
        [
            Profile::ball(0.7, -0.7),
            Profile::frustum(0.5, 0.5, 4.0, [EDGE; 2]),
            Profile::frustum(0.5, 0.38, 0.9, [EDGE; 2]),
            Profile::round_ended(0.3, 0.5, 4.0),
            Profile::round_ended(0.4, 0.3, 1.8),
            Profile::flame(0.6, 5.0, 0.1),
        ]
    }

    #[test]
    fn distances_are_those_to_the_nearest_place_of_the_outline() {
        // Aim: exact within 2 µm. Method: thousands of places on the outline, found from the radius at every height and on
        // flat ends, and the nearest of them.
        for profile in shapes() {
            let [low, high] = profile.span();
            let on: Vec<Place> = profile.stations(0.002).iter().map(|s| s.on).collect();
            for i in 0..400 {
                let turn = i as f32 * 0.61;
                let at = Place { r: 0.55 * (1.0 + turn.sin()), z: low - 0.3 + (high - low + 0.6) * i as f32 / 400.0 };
                let slow = on.iter().map(|p| p.distance_squared(at)).fold(f32::INFINITY, f32::min).sqrt();
                let near = profile.nearest(at);
                assert!((near.distance.abs() - slow).abs() < 2e-3 * (1.0 + slow), "{profile:?} at {at:?}");
                assert_eq!(near.distance < 0.0, at.r < profile.radius_at(at.z), "{profile:?} at {at:?}");
                // Straight along the normal one gets back to the place.
                let back = Place {
                    r: near.on.r + near.normal.r * near.distance,
                    z: near.on.z + near.normal.z * near.distance,
                };
                assert!(
                    near.distance.abs() < 1e-3 || back.distance_squared(at).sqrt() < 2e-2 || near.on.r < 1e-3,
                    "{profile:?}: {back:?} {at:?}"
                );
            }
        }
    }

    #[test]
    fn volumes_are_those_of_the_formulas() {
        let ball = Profile::ball(0.7, 0.0).volume_mm3();
        assert!((ball - 4.0 / 3.0 * std::f64::consts::PI * 0.343).abs() < 1e-3, "{ball}");
        let cylinder = Profile::frustum(0.5, 0.5, 4.0, [1e-3; 2]).volume_mm3();
        assert!((cylinder - std::f64::consts::PI).abs() < 1e-2, "{cylinder}");
    }
}
