//! Lower bounds of the distances to colliders, kept from tick to tick, so that what is far costs one comparison.
//!
//! Takes points, and the distances that were computed at other points. Gives the certainty that a collider is out of
//! reach: colliders never move, so a distance can shrink only as fast as the point moves. Never changes a result:
//! whatever may be in reach is computed exactly. Never allocates after construction.

use super::body::{Body, CHUNK};
use super::collision_scene::{Collider, CollisionScene, ROUNDING};
use crate::frame::{Pose, Quat, Vec3};

/// Last computed distance of each collider; tooth space, mm.
#[derive(Clone, Debug)]
pub(super) struct ColliderBounds {
    known: Vec<KnownDistance>,
    /// Indices of the colliders that may be within `candidates_reach` mm of a point.
    candidates: Vec<usize>,
    candidates_at: Vec3,
    candidates_reach: f32,
    /// The greatest of all colliders.
    steepness: f32,
}

/// Distance beyond reach within which a collider is a candidate, mm: at 100 mm/s, candidates are found anew 50 times a second.
const CANDIDATE_MARGIN: f32 = 2.0;

#[derive(Clone, Copy, Debug)]
struct KnownDistance {
    at: Vec3,
    /// Signed distance of that point, or less.
    distance: f32,
}

impl ColliderBounds {
    pub fn new(scene: &CollisionScene) -> ColliderBounds {
        let unknown = KnownDistance { at: Vec3::ZERO, distance: f32::NEG_INFINITY };
        ColliderBounds {
            known: vec![unknown; scene.colliders.len()],
            candidates: Vec::with_capacity(scene.colliders.len()),
            candidates_at: Vec3::ZERO,
            candidates_reach: f32::NEG_INFINITY,
            steepness: scene.colliders.iter().map(Collider::steepness).fold(1.0, f32::max),
        }
    }

    /// Number of colliders that may be within `reach` mm of a point; [`ColliderBounds::candidate`] names them. Mostly one
    /// comparison: the same ones stay candidates until the point has moved some way.
    pub fn count_candidates(&mut self, scene: &CollisionScene, point: Vec3, reach: f32) -> usize {
        let moved = self.steepness * self.candidates_at.distance(point);
        if self.candidates_reach - moved > reach + ROUNDING {
            return self.candidates.len();
        }
        (self.candidates_at, self.candidates_reach) = (point, reach + CANDIDATE_MARGIN);
        self.candidates.clear();
        for (index, collider) in scene.colliders.iter().enumerate() {
            if !self.is_beyond((index, collider), point, self.candidates_reach) {
                self.candidates.push(index);
            }
        }
        self.candidates.len()
    }

    /// Index of a candidate, from 0 to their number, in the order of the scene.
    pub fn candidate(&self, place: usize) -> usize {
        self.candidates[place]
    }

    /// Returns true if a point is certain to be farther than `reach` mm from a collider, without a look at it.
    pub fn is_far(&self, (index, collider): (usize, &Collider), point: Vec3, reach: f32) -> bool {
        self.known
            .get(index)
            .is_some_and(|known| known.distance - collider.steepness() * known.at.distance(point) > reach + ROUNDING)
    }

    /// Keeps the distance of a point, or a lower bound of it.
    pub fn keep(&mut self, index: usize, at: Vec3, distance: f32) {
        if let Some(known) = self.known.get_mut(index) {
            *known = KnownDistance { at, distance };
        }
    }

    /// Returns true if a point is farther than `reach` mm from a collider.
    pub fn is_beyond(&mut self, (index, collider): (usize, &Collider), point: Vec3, reach: f32) -> bool {
        if self.is_far((index, collider), point, reach) {
            return true;
        }
        let distance = collider.distance(point);
        self.keep(index, point, distance);
        distance > reach
    }

    /// Returns true if a ball around a point is guaranteed to be free of matter: if its radius is less than
    /// [`CollisionScene::clear_radius`].
    pub fn is_clear(&mut self, scene: &CollisionScene, point: Vec3, radius: f32) -> bool {
        radius < scene.clear_radius_of_volume(point)
            && (0..self.count_candidates(scene, point, radius)).all(|place| {
                let index = self.candidates[place];
                self.is_beyond((index, &scene.colliders[index]), point, radius)
            })
    }
}

/// Surface points of a body that need no comparison with a collider yet, because they are farther from it than the
/// body can have moved since.
#[derive(Clone, Debug)]
pub(super) struct ColliderProximity {
    /// For each collider and each surface point, the accumulated motion at which it may be in reach, mm.
    next_check: Vec<f64>,
    /// For each collider and each chunk of points, the same for all points of the chunk.
    chunk_next_check: Vec<f64>,
    /// Upper bound of the motion of any point since the last [`ColliderProximity::forget`], mm.
    motion: f64,
    last_pose: Option<Pose>,
    /// Number of surface points of the body.
    points: usize,
}

impl ColliderProximity {
    pub fn with_capacity(colliders: usize, points: usize) -> ColliderProximity {
        ColliderProximity {
            next_check: Vec::with_capacity(colliders * points),
            chunk_next_check: Vec::with_capacity(colliders * points.div_ceil(CHUNK)),
            motion: 0.0,
            last_pose: None,
            points: 0,
        }
    }

    /// Discards everything, after a change of the instrument.
    pub fn forget(&mut self) {
        self.last_pose = None;
    }

    /// Adds the motion of a body since its last pose.
    pub fn move_to(&mut self, scene: &CollisionScene, body: &Body, tooth_from_handle: Pose) {
        let points = body.surface_points().len();
        match self.last_pose {
            Some(last) if self.points == points => {
                self.motion += f64::from(max_displacement(body, &last, &tooth_from_handle));
            }
            _ => {
                let colliders = scene.colliders.len();
                self.next_check.clear();
                self.next_check.resize(colliders * points, 0.0);
                self.chunk_next_check.clear();
                self.chunk_next_check.resize(colliders * points.div_ceil(CHUNK), 0.0);
                (self.motion, self.points) = (0.0, points);
            }
        }
        self.last_pose = Some(tooth_from_handle);
    }

    /// Visits the index of every surface point within `reach` mm of a collider, in order.
    pub fn for_each_near(
        &mut self,
        (index, collider): (usize, &Collider),
        body: &Body,
        reach: f32,
        mut visit: impl FnMut(usize),
    ) {
        let Some(tooth_from_handle) = self.last_pose else { return };
        let (motion, steepness) = (self.motion, collider.steepness());
        // Motion after which a point at a distance may be in reach.
        let due_after = |distance: f32| motion + f64::from((distance - reach - ROUNDING) / steepness);
        let chunks = body.chunks().len();
        let next_checks = &mut self.next_check[index * self.points..(index + 1) * self.points];
        let chunk_next_checks = &mut self.chunk_next_check[index * chunks..(index + 1) * chunks];
        for (chunk, chunk_next) in body.chunks().iter().zip(chunk_next_checks) {
            if *chunk_next > motion {
                continue;
            }
            *chunk_next = due_after(collider.distance(tooth_from_handle * chunk.centre) - steepness * chunk.radius);
            if *chunk_next > motion {
                continue;
            }
            for point in chunk.points.clone() {
                if next_checks[point] > motion {
                    continue;
                }
                let distance = collider.distance(tooth_from_handle * body.surface_points()[point].position);
                next_checks[point] = due_after(distance);
                if distance < reach {
                    visit(point);
                }
            }
            *chunk_next = next_checks[chunk.points.clone()].iter().copied().fold(f64::INFINITY, f64::min);
        }
    }
}

/// Upper bound of the distance that any surface point of a body moves between two poses, mm.
fn max_displacement(body: &Body, from: &Pose, to: &Pose) -> f32 {
    let (middle, radius) = body.bounding_sphere();
    // A turn by θ moves a point by 2 sin θ/2, and the difference of the quaternions is 2 sin θ/4. Unlike the angle, it
    // does not vanish in rounding when the turn is slow.
    let [a, b] = [from.orientation, to.orientation].map(quaternion_components);
    let apart = (a - b).length().min((a + b).length());
    from.position.distance(to.position) + 2.0 * apart * (middle.length() + radius)
}

fn quaternion_components(rotation: Quat) -> glam::Vec4 {
    glam::Vec4::new(rotation.x, rotation.y, rotation.z, rotation.w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::touch::{ClosedMesh, ColliderGeometry, Compliance, EDGE_RADIUS, Profile, SdfGrid, Shank};
    use crate::volume::{Grid, Label, phantom, surface};
    use std::sync::Arc;

    fn random_source() -> impl FnMut() -> f32 {
        let mut state = 11u32;
        move || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        }
    }

    /// A ball, a box, a mesh and a sampled shape that is steeper than a distance.
    fn scene() -> CollisionScene {
        let mesh = surface::extract(&phantom::ball([40; 3], Vec3::splat(0.2), 2.5));
        let mesh = Mesh { normals: Vec::new(), ..mesh };
        let grid = Grid::centred([31; 3], Vec3::splat(0.2));
        let steep = SdfGrid::from_fn(grid, Compliance::default(), |p| 1.7 * (p.length() - 2.0));
        let forms = [
            ColliderGeometry::Ball { radius: 2.0 },
            ColliderGeometry::RoundBox { half: Vec3::new(1.0, 2.0, 3.0), rounding: 0.5 },
            ColliderGeometry::Mesh(Arc::new(ClosedMesh::new(&mesh).unwrap())),
            ColliderGeometry::Sdf(Arc::new(steep)),
        ];
        let colliders = forms.into_iter().zip([-9.0, -3.0, 3.0, 9.0]).map(|(geometry, x)| Collider {
            label: Label(9),
            tooth_from_collider: Pose { position: Vec3::X * x, orientation: Quat::from_rotation_y(0.4) },
            geometry,
        });
        CollisionScene { volume: phantom::ball([20; 3], Vec3::splat(0.05), 0.2), colliders: colliders.collect() }
    }

    #[test]
    fn bounds_answer_as_the_distances_do() {
        // Aim: no answer differs from the one without bounds. Method: walks of small and large steps past colliders
        // of all kinds.
        let scene = scene();
        let mut bounds = ColliderBounds::new(&scene);
        let mut random = random_source();
        let mut point = Vec3::new(0.0, 6.0, 0.0);
        let (mut clear, mut skipped) = (0, 0);
        for i in 0..40_000 {
            let length = if i % 50 == 0 { 4.0 } else { 0.2 };
            point = (point + Vec3::new(random(), random(), random()) * length)
                .clamp(Vec3::new(-12.0, -3.5, -3.5), Vec3::new(12.0, 3.5, 3.5));
            let radius = random().abs() * 2.0;
            skipped += scene.colliders.iter().enumerate().filter(|c| bounds.is_far(*c, point, radius)).count();
            let is_clear = bounds.is_clear(&scene, point, radius);
            assert_eq!(is_clear, radius < scene.clear_radius(point), "{point} {radius}");
            clear += usize::from(is_clear);
        }
        assert!((4_000..36_000).contains(&clear) && skipped > 80_000, "{clear} clear, {skipped} skipped");
    }

    #[test]
    fn what_is_far_costs_nothing() {
        // Aim: the cost of a tick follows what is near, not how much there is. Method: a path of 6 s over the middle of a row of 27 balls,
        // 10 mm apart; candidates are counted, and how often they are found anew.
        let ball = Arc::new(phantom::ball([40; 3], Vec3::splat(0.2), 2.5));
        let collider = |i: usize| Collider {
            label: Label(9),
            tooth_from_collider: Pose::at(Vec3::X * (10.0 * i as f32 - 130.0)),
            geometry: ColliderGeometry::Voxels(ball.clone()),
        };
        let colliders = (0..27).map(collider).collect();
        let scene = CollisionScene { volume: phantom::ball([20; 3], Vec3::splat(0.05), 0.2), colliders };
        let mut bounds = ColliderBounds::new(&scene);
        let (mut candidates, mut searches) = (0, 0);
        for tick in 0..6000 {
            let turn = tick as f32 * 0.001 * 20.0 / 3.0;
            let point = Vec3::new(3.0 * libm::cosf(turn), 3.0 * libm::sinf(turn), 3.0);
            let before = bounds.candidates_at;
            candidates += bounds.count_candidates(&scene, point, 0.5);
            searches += usize::from(bounds.candidates_at != before);
        }
        assert!(candidates <= 6000 && searches < 80, "{candidates} candidates in 6000 ticks, {searches} searches");
    }

    #[test]
    fn what_is_clear_of_voxels_holds_none() {
        // Aim: distances of voxels are only lower bounds, and stay so from point to point. Method: walks past a ball of voxels.
        let ball = ColliderGeometry::Voxels(Arc::new(phantom::ball([40; 3], Vec3::splat(0.2), 2.5)));
        let tooth_from_collider = Pose { position: Vec3::X * 2.0, orientation: Quat::from_rotation_y(0.4) };
        let colliders = vec![Collider { label: Label(9), tooth_from_collider, geometry: ball }];
        let scene = CollisionScene { volume: phantom::ball([20; 3], Vec3::splat(0.05), 0.2), colliders };
        let mut bounds = ColliderBounds::new(&scene);
        let mut random = random_source();
        let mut point = Vec3::new(0.0, 6.0, 0.0);
        let mut clear = 0;
        for i in 0..40_000 {
            let length = if i % 50 == 0 { 4.0 } else { 0.2 };
            point =
                (point + Vec3::new(random(), random(), random()) * length).clamp(Vec3::splat(-7.0), Vec3::splat(7.0));
            let radius = random().abs() * 2.0;
            let free = point.distance(tooth_from_collider.position) - 2.5;
            if bounds.is_clear(&scene, point, radius) {
                clear += 1;
                assert!(free > radius - 0.02, "{point}: {radius} mm called clear of {free} mm");
            }
        }
        assert!(clear > 8_000, "{clear}");
    }

    #[test]
    fn every_point_in_reach_is_visited_and_few_are_asked() {
        // Aim: the points visited are those in reach, in order, on a walk that turns slowly and fast.
        let scene = scene();
        let profile = Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]);
        let body = Body::revolved(profile, Some(Shank::friction_grip(1.0, 4.0)));
        let points = body.surface_points();
        let mut proximity = ColliderProximity::with_capacity(scene.colliders.len(), points.len());
        let mut random = random_source();
        let mut pose = Pose::at(Vec3::new(-9.0, 0.0, 3.0));
        let (mut near, reach) = (0, 0.12);
        for tick in 0..3_000 {
            let (length, turn) = if tick % 100 == 0 { (1.0, 0.5) } else { (0.05, 0.002) };
            pose.position += Vec3::new(random() + 0.03, random(), random()) * length;
            pose.position = pose.position.clamp(Vec3::new(-12.0, -3.0, -3.0), Vec3::new(12.0, 3.0, 3.0));
            pose.orientation = (pose.orientation * Quat::from_rotation_x(turn * random())).normalize();
            proximity.move_to(&scene, &body, pose);
            for (index, collider) in scene.colliders.iter().enumerate() {
                let mut found = Vec::new();
                proximity.for_each_near((index, collider), &body, reach, |point| found.push(point));
                let expected: Vec<usize> =
                    (0..points.len()).filter(|&i| collider.distance(pose * points[i].position) < reach).collect();
                assert_eq!(found, expected, "tick {tick}, collider {index}");
                near += found.len();
            }
        }
        assert!(near > 10_000, "{near}");
    }
}
