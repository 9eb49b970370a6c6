//! Profile of a bur: half of its axial section.
//!
//! Takes lengths in mm. Gives signed distances, nearest points and volumes of the body of revolution, exact to
//! rounding. In the half plane of a section `r` is the distance from the axis and `z` the coordinate along it, from
//! the tip toward the hand.

use crate::frame::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// Closed body of revolution. The profile runs from the axis at the tip to the axis at the top; its pieces follow
/// each other in z, so that there is one radius at every height.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    pieces: Vec<ProfilePiece>,
    side: Option<StraightSide>,
}

/// Point in the half plane of a section, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    pub r: f32,
    pub z: f32,
}

/// Point of a profile nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestProfilePoint {
    /// Signed distance, mm; negative inside.
    pub distance: f32,
    pub point: ProfilePoint,
    /// Unit normal, outward.
    pub normal: ProfilePoint,
}

/// Longest straight piece of a side, by the heights at which it is the nearest piece to all points inside and to those up to
/// [`SIDE_MARGIN`] outside: there the distance is linear in r and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StraightSide {
    /// Lowest and highest z, mm.
    pub z: [f32; 2],
    /// The z of the outward normal: 0 for a cylinder.
    pub sine: f32,
}

/// Distance from the profile up to which a [`StraightSide`] is nearest, mm: more than the widest surface band.
const SIDE_MARGIN: f32 = 0.5;

impl StraightSide {
    fn of(pieces: &[ProfilePiece]) -> Option<StraightSide> {
        let height = |piece: &ProfilePiece| piece.to().z - piece.from().z;
        let lines = pieces.iter().filter(|p| matches!(p, ProfilePiece::Line { .. }));
        let side = lines.max_by(|a, b| height(a).total_cmp(&height(b)))?;
        let (from, to) = (side.from(), side.to());
        let (tip, top) = (pieces.first()?.from().z, pieces.last()?.to().z);
        let radius = greatest_radius(pieces);
        let sine = (from.r - to.r) / side.length();
        // What is deep inside may be nearer to an end; what is far outside is projected up or down a leaning side.
        let aside = (radius + SIDE_MARGIN) * sine.abs();
        let low = from.z.max(tip + radius) + aside;
        let high = to.z.min(top - radius) - aside;
        (low < high).then_some(StraightSide { z: [low, high], sine })
    }
}

/// Greatest distance from the axis, mm.
fn greatest_radius(pieces: &[ProfilePiece]) -> f32 {
    pieces.iter().map(|p| p.from().r.max(p.to().r)).fold(0.0, f32::max)
}

/// Sample point of a profile.
#[derive(Clone, Copy, Debug)]
pub(super) struct ProfileSample {
    pub point: ProfilePoint,
    /// Unit normal, outward.
    pub normal: ProfilePoint,
    /// Length of the stretch around the sample, mm.
    pub spacing: f32,
}

/// Piece of a profile, with z never decreasing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ProfilePiece {
    Line {
        from: ProfilePoint,
        to: ProfilePoint,
    },
    /// Circular arc, convex outward.
    Arc {
        from: ProfilePoint,
        to: ProfilePoint,
        centre: ProfilePoint,
        radius: f32,
    },
}

/// Rounding of edges that are nominally sharp, mm. New carbide edges are finer; this is the radius of a worn edge,
/// and enough for a well-defined normal. 0.03–0.08 feels alike.
pub const EDGE_RADIUS: f32 = 0.05;

impl Profile {
    /// Ball with its lowest point at `z`.
    pub fn ball(radius: f32, z: f32) -> Profile {
        let mut outline = ProfileBuilder::at(ProfilePoint { r: 0.0, z });
        outline.arc(ProfilePoint { r: 0.0, z: z + radius }, radius, ProfilePoint { r: radius, z: z + radius });
        outline.arc(ProfilePoint { r: 0.0, z: z + radius }, radius, ProfilePoint { r: 0.0, z: z + 2.0 * radius });
        outline.build()
    }

    /// Frustum with rounded edges: flat-ended cylinder, taper and inverted cone. Tip at z = 0.
    ///
    /// `low` and `high` are the radii at the tip and at the top, where the edges would be if they were sharp; `edges`
    /// are the radii of the roundings.
    pub fn frustum(low: f32, high: f32, length: f32, edges: [f32; 2]) -> Profile {
        // Angle by which the side leans outward on its way up.
        let lean = libm::atan2f(high - low, length);
        let (sin, cos) = (libm::sinf(lean), libm::cosf(lean));
        // The centres of the roundings are equally far from the side and from the flat end.
        let fillet_setback = |edge: f32, turn: f32| edge * libm::tanf(0.5 * turn);
        let below = ProfilePoint { r: low - fillet_setback(edges[0], FRAC_PI_2 - lean), z: edges[0] };
        let above = ProfilePoint { r: high - fillet_setback(edges[1], FRAC_PI_2 + lean), z: length - edges[1] };
        let out = |centre: ProfilePoint, edge: f32| ProfilePoint { r: centre.r + edge * cos, z: centre.z - edge * sin };
        let mut outline = ProfileBuilder::at(ProfilePoint { r: 0.0, z: 0.0 });
        outline.line(ProfilePoint { r: below.r, z: 0.0 });
        outline.arc(below, edges[0], out(below, edges[0]));
        outline.line(out(above, edges[1]));
        outline.arc(above, edges[1], ProfilePoint { r: above.r, z: length });
        outline.line(ProfilePoint { r: 0.0, z: length });
        outline.build()
    }

    /// Frustum with a spherical tip that merges tangentially into the side: cylinder and taper with a round end, and
    /// the pear, which is a ball with a neck behind it. Tip at z = 0.
    pub fn round_ended(ball: f32, high: f32, length: f32) -> Profile {
        // The side is the tangent to the ball from (high, length), with the centre of the ball at height `ball`.
        let (dr, dz) = (high, length - ball);
        let far = (dr * dr + dz * dz).sqrt();
        // Angle between the axis and the line to that point, and between that line and the radius to the point of
        // tangency.
        let aside = libm::atan2f(dr, dz);
        let touch = aside + libm::acosf((ball / far).clamp(-1.0, 1.0));
        let at = ProfilePoint { r: ball * libm::sinf(touch), z: ball + ball * libm::cosf(touch) };
        let centre = ProfilePoint { r: 0.0, z: ball };
        let mut outline = ProfileBuilder::at(ProfilePoint { r: 0.0, z: 0.0 });
        outline.arc(centre, ball, at);
        outline.wall_to_top(at, ProfilePoint { r: high, z: length });
        outline.build()
    }

    /// Two arcs with centres beyond the axis: slender at the tip, widest in the middle, slender again at the top. Tip
    /// at z = 0.
    pub fn flame(radius: f32, length: f32, tip: f32) -> Profile {
        // The flank is an arc through (radius, middle) with its centre beyond the axis, tangential to the ball of the
        // tip: its radius R solves (R − radius)² + (middle − tip)² = (R − tip)².
        let middle = 0.5 * length;
        let drop = middle - tip;
        let flank = (drop * drop + radius * radius - tip * tip) / (2.0 * (radius - tip));
        let centre = ProfilePoint { r: radius - flank, z: middle };
        let share = flank / (flank - tip);
        // Point of tangency of flank and tip: on the line through both centres, beyond that of the tip.
        let touch = ProfilePoint { r: centre.r - centre.r * share, z: centre.z - drop * share };
        let top = ProfilePoint { r: touch.r, z: length - touch.z };
        let mut outline = ProfileBuilder::at(ProfilePoint { r: 0.0, z: 0.0 });
        outline.arc(ProfilePoint { r: 0.0, z: tip }, tip, touch);
        outline.arc(centre, flank, ProfilePoint { r: radius, z: middle });
        outline.arc(centre, flank, top);
        outline.arc(ProfilePoint { r: 0.0, z: length - tip }, tip, ProfilePoint { r: 0.0, z: length });
        outline.build()
    }

    /// Cone that merges into a cylinder: the neck and shank above a working end.
    pub fn shank(neck: ProfilePoint, begin: ProfilePoint, top: f32) -> Profile {
        let mut outline = ProfileBuilder::at(ProfilePoint { r: 0.0, z: neck.z });
        outline.line(neck);
        outline.line(begin);
        outline.line(ProfilePoint { r: begin.r, z: top });
        outline.line(ProfilePoint { r: 0.0, z: top });
        outline.build()
    }

    /// Heights of the tip and of the top, mm.
    pub fn span(&self) -> [f32; 2] {
        let ends = |pieces: &[ProfilePiece]| Some([pieces.first()?.from().z, pieces.last()?.to().z]);
        ends(&self.pieces).unwrap_or_default()
    }

    /// Greatest distance of the profile from the axis, mm.
    pub fn radius(&self) -> f32 {
        greatest_radius(&self.pieces)
    }

    /// Distance of the profile from the axis at a height, mm; 0 above and below the profile.
    pub fn radius_at(&self, z: f32) -> f32 {
        let there = self.pieces.iter().filter(|p| p.from().z <= z && z <= p.to().z);
        there.map(|p| p.radius_at(z)).fold(0.0, f32::max)
    }

    /// Signed distance from the body, mm; negative inside.
    pub fn distance(&self, at: ProfilePoint) -> f32 {
        self.nearest(at).distance
    }

    /// Returns the nearest point of the profile.
    pub fn nearest(&self, at: ProfilePoint) -> NearestProfilePoint {
        let (on, normal) = self.closest(at);
        let far = on.distance_squared(at).sqrt();
        NearestProfilePoint { distance: if at.r < self.radius_at(at.z) { -far } else { far }, point: on, normal }
    }

    /// Returns the nearest point and the outward normal there, without the distance.
    pub(super) fn closest(&self, at: ProfilePoint) -> (ProfilePoint, ProfilePoint) {
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
        (on, piece.map_or(ProfilePoint { r: 1.0, z: 0.0 }, |p| p.normal(on)))
    }

    /// Volume of the body, mm³, by Simpson's rule over every piece.
    pub fn volume_mm3(&self) -> f64 {
        const STEPS: usize = 200;
        let area = |piece: &ProfilePiece, z: f32| f64::from(PI) * f64::from(piece.radius_at(z)).powi(2);
        let slab = |piece: &ProfilePiece| {
            let (low, high) = (piece.from().z, piece.to().z);
            let at = |i: usize| area(piece, low + (high - low) * i as f32 / STEPS as f32);
            let weight = |i: usize| if i % 2 == 1 { 4.0 } else { 2.0 };
            let inner: f64 = (1..STEPS).map(|i| weight(i) * at(i)).sum();
            f64::from(high - low) / STEPS as f64 / 3.0 * (at(0) + inner + at(STEPS))
        };
        self.pieces.iter().filter(|p| p.to().z > p.from().z).map(slab).sum()
    }

    /// Straight part of the side, if there is one.
    pub(super) fn straight_side(&self) -> Option<StraightSide> {
        self.side
    }

    /// Returns the profile as a polyline from the tip to the top, of which no point is farther than `sag` mm from it.
    pub fn outline(&self, sag: f32) -> Vec<ProfilePoint> {
        let first = self.pieces.first().map(ProfilePiece::from);
        let steps = |piece: &ProfilePiece| match *piece {
            ProfilePiece::Line { .. } => 1,
            // The chord of an angle a is radius · (1 − cos(a/2)) ≈ radius · a²/8 from its arc.
            ProfilePiece::Arc { radius, .. } => {
                (piece.sweep_angle() / (8.0 * sag / radius).sqrt()).ceil().max(1.0) as usize
            }
        };
        let along = |piece: &'_ ProfilePiece| {
            let (piece, count) = (*piece, steps(piece));
            (1..=count).map(move |i| piece.at(i as f32 / count as f32))
        };
        first.into_iter().chain(self.pieces.iter().flat_map(along)).collect()
    }

    /// Samples the profile at a spacing of about `apart` mm.
    pub(super) fn samples(&self, apart: f32) -> Vec<ProfileSample> {
        let mut all = Vec::new();
        for piece in &self.pieces {
            let count = (piece.length() / piece.sample_spacing(apart)).ceil().max(1.0) as usize;
            let spacing = piece.length() / count as f32;
            all.extend((0..count).map(|i| {
                let on = piece.at((i as f32 + 0.5) / count as f32);
                ProfileSample { point: on, normal: piece.normal(on), spacing }
            }));
        }
        all
    }
}

/// Builder of a profile, piece by piece.
struct ProfileBuilder {
    at: ProfilePoint,
    pieces: Vec<ProfilePiece>,
}

impl ProfileBuilder {
    fn at(at: ProfilePoint) -> ProfileBuilder {
        ProfileBuilder { at, pieces: Vec::new() }
    }

    fn line(&mut self, to: ProfilePoint) {
        if to.distance_squared(self.at) > 1e-12 {
            self.pieces.push(ProfilePiece::Line { from: self.at, to });
            self.at = to;
        }
    }

    fn arc(&mut self, centre: ProfilePoint, radius: f32, to: ProfilePoint) {
        if to.distance_squared(self.at) > 1e-12 {
            self.pieces.push(ProfilePiece::Arc { from: self.at, to, centre, radius });
            self.at = to;
        }
    }

    /// Adds a straight side up to a flat top with a rounded edge; `sharp` is the corner without rounding.
    fn wall_to_top(&mut self, from: ProfilePoint, sharp: ProfilePoint) {
        let (dr, dz) = (sharp.r - from.r, sharp.z - from.z);
        let length = (dr * dr + dz * dz).sqrt();
        let (sin, cos) = (dr / length, dz / length);
        let lean = libm::atan2f(dr, dz);
        let edge = EDGE_RADIUS.min(0.4 * sharp.r);
        let centre = ProfilePoint { r: sharp.r - edge * libm::tanf(0.5 * (FRAC_PI_2 + lean)), z: sharp.z - edge };
        self.line(ProfilePoint { r: centre.r + edge * cos, z: centre.z - edge * sin });
        self.arc(centre, edge, ProfilePoint { r: centre.r, z: sharp.z });
        self.line(ProfilePoint { r: 0.0, z: sharp.z });
    }

    fn build(self) -> Profile {
        Profile { side: StraightSide::of(&self.pieces), pieces: self.pieces }
    }
}

impl ProfilePoint {
    fn distance_squared(self, other: ProfilePoint) -> f32 {
        (self.r - other.r) * (self.r - other.r) + (self.z - other.z) * (self.z - other.z)
    }

    /// Projects a point in handle space onto the half plane through it and the axis.
    pub fn of(point_in_handle: Vec3) -> ProfilePoint {
        let Vec3 { x, y, z } = point_in_handle;
        ProfilePoint { r: (x * x + y * y).sqrt(), z }
    }

    /// Lifts the point or direction into handle space, in the half plane of `point_in_handle`.
    pub fn lift_beside(self, point_in_handle: Vec3) -> Vec3 {
        let r = ProfilePoint::of(point_in_handle).r;
        let outward = if r > 1e-9 { point_in_handle.with_z(0.0) / r } else { Vec3::X };
        outward * self.r + Vec3::Z * self.z
    }
}

impl ProfilePiece {
    fn from(&self) -> ProfilePoint {
        match *self {
            ProfilePiece::Line { from, .. } | ProfilePiece::Arc { from, .. } => from,
        }
    }

    fn to(&self) -> ProfilePoint {
        match *self {
            ProfilePiece::Line { to, .. } | ProfilePiece::Arc { to, .. } => to,
        }
    }

    fn nearest(&self, at: ProfilePoint) -> ProfilePoint {
        match *self {
            ProfilePiece::Line { from, to } => {
                let (dr, dz) = (to.r - from.r, to.z - from.z);
                let along = ((at.r - from.r) * dr + (at.z - from.z) * dz) / (dr * dr + dz * dz);
                let t = along.clamp(0.0, 1.0);
                ProfilePoint { r: from.r + dr * t, z: from.z + dz * t }
            }
            ProfilePiece::Arc { from, to, centre, radius } => {
                let (r, z) = (at.r - centre.r, at.z - centre.z);
                let far = (r * r + z * z).sqrt();
                if far > 1e-9 && r >= -1e-9 {
                    let on = ProfilePoint { r: centre.r + r * radius / far, z: centre.z + z * radius / far };
                    if from.z <= on.z && on.z <= to.z {
                        return on;
                    }
                }
                if at.distance_squared(from) <= at.distance_squared(to) { from } else { to }
            }
        }
    }

    fn normal(&self, on: ProfilePoint) -> ProfilePoint {
        let (r, z) = match *self {
            // The path runs outward along a flat tip, up a side and inward along a flat top: outward is to the right.
            ProfilePiece::Line { from, to } => (to.z - from.z, from.r - to.r),
            ProfilePiece::Arc { centre, .. } => (on.r - centre.r, on.z - centre.z),
        };
        let length = (r * r + z * z).sqrt().max(1e-12);
        ProfilePoint { r: r / length, z: z / length }
    }

    fn radius_at(&self, z: f32) -> f32 {
        match *self {
            ProfilePiece::Line { from, to } => {
                let climb = to.z - from.z;
                if climb.abs() < 1e-9 { from.r.max(to.r) } else { from.r + (to.r - from.r) * (z - from.z) / climb }
            }
            ProfilePiece::Arc { centre, radius, .. } => {
                let up = z - centre.z;
                centre.r + (radius * radius - up * up).max(0.0).sqrt()
            }
        }
    }

    fn length(&self) -> f32 {
        match *self {
            ProfilePiece::Line { from, to } => from.distance_squared(to).sqrt(),
            ProfilePiece::Arc { radius, .. } => radius * self.sweep_angle(),
        }
    }

    /// Angle subtended by an arc.
    fn sweep_angle(&self) -> f32 {
        let ProfilePiece::Arc { from, to, centre, .. } = *self else { return 0.0 };
        let angle = |p: ProfilePoint| libm::atan2f(p.z - centre.z, p.r - centre.r);
        angle(to) - angle(from)
    }

    /// Spacing of samples, mm: on a tight arc at least three, so that the normal never changes by more than 30°
    /// between them.
    fn sample_spacing(&self, apart: f32) -> f32 {
        match *self {
            ProfilePiece::Line { .. } => apart,
            ProfilePiece::Arc { radius, .. } => apart.min(radius * PI / 6.0),
        }
    }

    /// Returns the point at a fraction of the length.
    fn at(&self, share: f32) -> ProfilePoint {
        match *self {
            ProfilePiece::Line { from, to } => {
                ProfilePoint { r: from.r + (to.r - from.r) * share, z: from.z + (to.z - from.z) * share }
            }
            ProfilePiece::Arc { from, centre, radius, .. } => {
                let begin = libm::atan2f(from.z - centre.z, from.r - centre.r);
                let angle = begin + self.sweep_angle() * share;
                ProfilePoint { r: centre.r + radius * libm::cosf(angle), z: centre.z + radius * libm::sinf(angle) }
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
            Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]),
            Profile::frustum(0.5, 0.38, 0.9, [EDGE_RADIUS; 2]),
            Profile::round_ended(0.3, 0.5, 4.0),
            Profile::round_ended(0.4, 0.3, 1.8),
            Profile::flame(0.6, 5.0, 0.1),
        ]
    }

    #[test]
    fn distances_are_those_to_the_nearest_place_of_the_outline() {
        // Aim: exact within 2 µm. Method: compare with the nearest of thousands of sample points; check the sign
        // against the radius at the same height.
        for profile in shapes() {
            let [low, high] = profile.span();
            let on: Vec<ProfilePoint> = profile.samples(0.002).iter().map(|s| s.point).collect();
            for i in 0..400 {
                let turn = i as f32 * 0.61;
                let at =
                    ProfilePoint { r: 0.55 * (1.0 + turn.sin()), z: low - 0.3 + (high - low + 0.6) * i as f32 / 400.0 };
                let slow = on.iter().map(|p| p.distance_squared(at)).fold(f32::INFINITY, f32::min).sqrt();
                let near = profile.nearest(at);
                assert!((near.distance.abs() - slow).abs() < 2e-3 * (1.0 + slow), "{profile:?} at {at:?}");
                assert_eq!(near.distance < 0.0, at.r < profile.radius_at(at.z), "{profile:?} at {at:?}");
                // Moving back along the normal leads to the query point.
                let back = ProfilePoint {
                    r: near.point.r + near.normal.r * near.distance,
                    z: near.point.z + near.normal.z * near.distance,
                };
                assert!(
                    near.distance.abs() < 1e-3 || back.distance_squared(at).sqrt() < 2e-2 || near.point.r < 1e-3,
                    "{profile:?}: {back:?} {at:?}"
                );
            }
        }
    }

    #[test]
    fn an_outline_is_as_near_to_its_profile_as_it_promises() {
        // Aim: pictures show the shape that is felt. Method: the middle of every chord, and both ends of the whole.
        for profile in shapes() {
            let [low, high] = profile.span();
            let outline = profile.outline(0.005);
            for pair in outline.windows(2) {
                let middle = ProfilePoint { r: 0.5 * (pair[0].r + pair[1].r), z: 0.5 * (pair[0].z + pair[1].z) };
                let off = profile.nearest(middle).distance.abs();
                assert!(off < 0.0055, "{profile:?}: {off} at {middle:?}");
            }
            let (first, last) = (outline[0], outline[outline.len() - 1]);
            assert!(first.r < 1e-4 && last.r < 1e-4 && (first.z - low).abs() < 1e-4 && (last.z - high).abs() < 1e-4);
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
