//! Everything the instrument can touch: the voxel volume, and colliders around it that are never cut.

use super::active_set::Constraint;
use super::closed_mesh::{ClosedMesh, MeshContact};
use super::sdf_grid::SdfGrid;
use crate::frame::{Pose, Vec3};
use crate::volume::{Label, Volume};
use std::sync::Arc;

/// Volume and colliders, in tooth space.
#[derive(Clone, Debug)]
pub struct CollisionScene {
    pub volume: Volume,
    /// Gum, neighbouring teeth and similar objects.
    pub colliders: Vec<Collider>,
}

/// Margin for rounding errors of distances of some metres, mm: whatever is farther than a search distance by this
/// much is out of reach.
pub(super) const ROUNDING: f32 = 1e-2;

/// Distance of a working end from a compliant collider below which it rests on it, mm: more than a probe's radius.
const SOFT_CONTACT_DISTANCE: f32 = 0.5;

/// Solid described by a formula, a mesh, a distance grid or voxels.
#[derive(Clone, Debug)]
pub struct Collider {
    pub label: Label,
    pub tooth_from_collider: Pose,
    pub geometry: ColliderGeometry,
}

/// Geometry of a [`Collider`] in its own coordinates; lengths in mm.
#[derive(Clone, Debug)]
pub enum ColliderGeometry {
    Ball {
        radius: f32,
    },
    /// A box with rounded edges; `half` includes the rounding.
    RoundBox {
        half: Vec3,
        rounding: f32,
    },
    /// Axis along z, from -`half_length` to +`half_length` between the centres of its round ends.
    Capsule {
        half_length: f32,
        radius: f32,
    },
    /// Interior of a closed mesh.
    Mesh(Arc<ClosedMesh>),
    /// Signed distances sampled on a grid.
    Sdf(Arc<SdfGrid>),
    /// Voxels, such as another tooth: felt as the volume that is worked on, each tissue with its own material.
    Voxels(Arc<Volume>),
}

/// Greatest change of a voxel collider's distance per millimetre of motion: its density ramps are a little uneven.
const VOXEL_STEEPNESS: f32 = 1.1;

impl Collider {
    /// Signed distance in mm (negative inside) of a point in tooth space from the collider's surface. Of voxels, it is accurate
    /// within their half band, and beyond it nearer to zero than the true distance.
    pub fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let p = self.tooth_from_collider.inverse() * point_in_tooth;
        match &self.geometry {
            &ColliderGeometry::Ball { radius } => p.length() - radius,
            &ColliderGeometry::RoundBox { half, rounding } => {
                let q = p.abs() - (half - rounding);
                q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - rounding
            }
            &ColliderGeometry::Capsule { half_length, radius } => {
                (p - Vec3::Z * p.z.clamp(-half_length, half_length)).length() - radius
            }
            ColliderGeometry::Mesh(obstacle) => obstacle.distance(p),
            ColliderGeometry::Sdf(field) => field.distance(p),
            ColliderGeometry::Voxels(volume) => volume.distance_bound(p),
        }
    }

    /// Greatest change of the distance per millimetre of motion: 1, unless samples describe a steeper shape.
    pub fn steepness(&self) -> f32 {
        match &self.geometry {
            ColliderGeometry::Sdf(field) => field.steepness(),
            ColliderGeometry::Voxels(_) => VOXEL_STEEPNESS,
            _ => 1.0,
        }
    }

    /// Returns the distance, as [`Collider::distance`] does, and the outward unit normal.
    pub fn distance_and_normal(&self, point_in_tooth: Vec3) -> (f32, Vec3) {
        if let ColliderGeometry::Mesh(obstacle) = &self.geometry {
            let MeshContact { distance, normal } =
                obstacle.nearest_contact(self.tooth_from_collider.inverse() * point_in_tooth);
            return (distance, self.tooth_from_collider.rotate(normal));
        }
        if let ColliderGeometry::Voxels(volume) = &self.geometry {
            let point = self.tooth_from_collider.inverse() * point_in_tooth;
            let outward = -volume.density_and_gradient_at(point).1;
            let normal = self.tooth_from_collider.rotate(outward.normalize_or(Vec3::Z));
            return (volume.distance_bound(point), normal);
        }
        /// Small compared with every collider, large compared with f32 rounding at 100 mm.
        const STEP: f32 = 0.01;
        // Half a sample's width, because the gradient would otherwise jump from cell to cell.
        let step = if let ColliderGeometry::Sdf(field) = &self.geometry { 0.5 * field.spacing() } else { STEP };
        let along =
            |axis: Vec3| self.distance(point_in_tooth + axis * step) - self.distance(point_in_tooth - axis * step);
        let gradient = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
        (self.distance(point_in_tooth), gradient.try_normalize().unwrap_or(Vec3::Z))
    }

    /// Visits the signed distance and outward normal of every contact of a ball around a point: at most one for a
    /// formula, a distance grid or voxels, all local minima for a mesh. Contacts farther than `within` mm may be left out.
    ///
    /// Returns the signed distance of the point, or a lower bound of it.
    pub(super) fn for_each_contact(&self, point_in_tooth: Vec3, within: f32, mut visit: impl FnMut(f32, Vec3)) -> f32 {
        match &self.geometry {
            // The normal costs six more distances, so it is computed only within reach.
            ColliderGeometry::Ball { .. }
            | ColliderGeometry::RoundBox { .. }
            | ColliderGeometry::Capsule { .. }
            | ColliderGeometry::Sdf(_)
            | ColliderGeometry::Voxels(_) => {
                let distance = self.distance(point_in_tooth);
                if distance <= within + ROUNDING {
                    let (distance, normal) = self.distance_and_normal(point_in_tooth);
                    visit(distance, normal);
                }
                distance
            }
            ColliderGeometry::Mesh(obstacle) => {
                let point = self.tooth_from_collider.inverse() * point_in_tooth;
                obstacle
                    .for_each_contact(point, within, |m| visit(m.distance, self.tooth_from_collider.rotate(m.normal)))
            }
        }
    }
}

impl CollisionScene {
    /// Depth, mm, to which the tip sinks into a compliant collider under a force, N, and the outward normal there;
    /// `None` if the tip does not sink in. `tip`: its place and the radius of the working end, mm.
    pub fn penetration(&self, touched: Label, (tip, radius): (Vec3, f32), force: f32) -> Option<(f32, Vec3)> {
        let within = radius + SOFT_CONTACT_DISTANCE;
        // Distances are computed only for distance grids: those to a mesh are expensive.
        let (collider, compliance) = self.colliders.iter().find_map(|shape| match &shape.geometry {
            ColliderGeometry::Sdf(field) if shape.label == touched && shape.distance(tip) < within => {
                Some((shape, field.compliance))
            }
            _ => None,
        })?;
        let depth = compliance.depth(force);
        (depth > 0.0).then(|| (depth, collider.distance_and_normal(tip).1))
    }

    /// Radius, mm, around a point in tooth space that is guaranteed to be free of matter; 0 where matter may be near.
    ///
    /// The bound is coarse and costs one look-up in the volume; it keeps queries in empty space cheap.
    pub fn clear_radius(&self, point_in_tooth: Vec3) -> f32 {
        let clear_of_colliders =
            self.colliders.iter().map(|s| s.distance(point_in_tooth)).fold(f32::INFINITY, f32::min);
        self.clear_radius_of_volume(point_in_tooth).min(clear_of_colliders).max(0.0)
    }

    /// The same for the volume alone.
    pub(super) fn clear_radius_of_volume(&self, point_in_tooth: Vec3) -> f32 {
        self.volume.clear_radius(point_in_tooth)
    }
}

/// The space of a collider, in which its contacts are found.
#[derive(Clone, Copy)]
pub(super) struct OwnSpace {
    tooth_from_collider: Pose,
    pub collider_from_tooth: Pose,
}

impl OwnSpace {
    pub fn of(collider: &Collider) -> OwnSpace {
        let tooth_from_collider = collider.tooth_from_collider;
        OwnSpace { tooth_from_collider, collider_from_tooth: tooth_from_collider.inverse() }
    }

    /// A constraint of this space in tooth space, where the tip is at `tip`.
    pub fn to_tooth(self, constraint: Constraint, tip: Vec3) -> Constraint {
        let clearance = constraint.normal.dot(self.collider_from_tooth * tip) - constraint.offset;
        let normal = self.tooth_from_collider.rotate(constraint.normal);
        let point = self.tooth_from_collider * constraint.point;
        Constraint { normal, point, offset: normal.dot(tip) - clearance, ..constraint }
    }

    /// Contact point and normal of a constraint of tooth space in this space; its offset stays.
    pub fn of_tooth(self, constraint: Constraint) -> Constraint {
        let point = self.collider_from_tooth * constraint.point;
        Constraint { point, normal: self.collider_from_tooth.rotate(constraint.normal), ..constraint }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    #[test]
    fn shapes_know_their_distances() {
        let at = Pose::at(Vec3::new(1.0, 0.0, 0.0));
        let shape = |form| Collider { label: Label(1), tooth_from_collider: at, geometry: form };
        let check = |form, p: Vec3, expected: f32| {
            let shape = shape(form);
            let (distance, normal) = shape.distance_and_normal(p);
            assert!((distance - expected).abs() < 1e-4, "{shape:?} at {p}: {distance}");
            assert!((normal.length() - 1.0).abs() < 1e-4);
        };
        check(ColliderGeometry::Ball { radius: 2.0 }, Vec3::new(6.0, 0.0, 0.0), 3.0);
        check(
            ColliderGeometry::RoundBox { half: Vec3::new(1.0, 2.0, 3.0), rounding: 0.5 },
            Vec3::new(4.0, 0.0, 0.0),
            2.0,
        );
        check(ColliderGeometry::RoundBox { half: Vec3::ONE, rounding: 0.2 }, Vec3::new(1.0, 0.0, 0.1), -0.9);
        check(ColliderGeometry::Capsule { half_length: 4.0, radius: 1.0 }, Vec3::new(1.0, 0.0, 7.0), 2.0);
    }

    #[test]
    fn what_is_within_reach_is_met_and_what_is_far_is_not_asked() {
        let shape = Collider {
            label: Label(1),
            tooth_from_collider: Pose::IDENTITY,
            geometry: ColliderGeometry::Ball { radius: 2.0 },
        };
        for (height, is_met) in [(1.9, true), (2.05, true), (2.099, true), (2.2, false)] {
            let place = Vec3::Z * height;
            let mut met = None;
            shape.for_each_contact(place, 0.1, |distance, normal| met = Some((distance, normal)));
            assert_eq!(met, is_met.then(|| shape.distance_and_normal(place)), "{height}");
        }
    }

    #[test]
    fn a_clear_radius_holds_no_matter() {
        let volume = phantom::ball([120, 120, 120], Vec3::splat(0.1), 2.0);
        let matter = CollisionScene { volume, colliders: Vec::new() };
        let mut useful = 0;
        for i in 0..400 {
            let t = i as f32;
            let p = Vec3::new((t * 0.7).sin() * 9.0, (t * 1.3).cos() * 9.0, (t * 0.31).sin() * 9.0);
            let clear = matter.clear_radius(p);
            // The ball's density reaches one half band beyond its surface.
            assert!(clear <= (p.length() - 2.2).max(0.0) + 1e-4, "{p}: {clear}");
            useful += usize::from(clear > 0.5);
        }
        assert!(useful > 100);
    }
}
