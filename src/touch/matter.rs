//! Everything that can be touched: the voxel tooth, and plain shapes around it that are never carved.

use super::field::Field;
use super::obstacle::{Meeting, Obstacle};
use crate::frame::{Pose, Vec3};
use crate::volume::{Label, Volume};
use std::sync::Arc;

/// The touchable world, in tooth space.
#[derive(Clone, Debug)]
pub struct Matter {
    pub volume: Volume,
    /// Gum, neighbours and the like.
    pub around: Vec<Shape>,
}

/// More than a distance of some metres loses by rounding, mm: what is farther than a reach by this is surely out of it.
const ROUNDING: f32 = 1e-2;

/// A tip rests on soft matter that its centre is nearer to than this, mm: a probe's radius and some more.
const SINKS_WITHIN: f32 = 0.5;

/// A solid described by a formula, or by its surface.
#[derive(Clone, Debug)]
pub struct Shape {
    pub label: Label,
    pub tooth_from_shape: Pose,
    pub form: Form,
}

/// What a [`Shape`] looks like about its own origin; lengths in mm.
#[derive(Clone, Debug)]
pub enum Form {
    Ball {
        radius: f32,
    },
    /// A box with rounded edges; `half` includes the rounding.
    RoundBox {
        half: Vec3,
        rounding: f32,
    },
    /// Along z, from -`half_length` to +`half_length` between the centres of its round ends.
    Capsule {
        half_length: f32,
        radius: f32,
    },
    /// Whatever a closed mesh encloses.
    Mesh(Arc<Obstacle>),
    /// Known by its distance at the points of a grid.
    Field(Arc<Field>),
}

impl Shape {
    /// Signed distance in mm (negative inside) of a point of tooth space from the shape's surface.
    pub fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let p = self.tooth_from_shape.inverse() * point_in_tooth;
        match &self.form {
            &Form::Ball { radius } => p.length() - radius,
            &Form::RoundBox { half, rounding } => {
                let q = p.abs() - (half - rounding);
                q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - rounding
            }
            &Form::Capsule { half_length, radius } => {
                (p - Vec3::Z * p.z.clamp(-half_length, half_length)).length() - radius
            }
            Form::Mesh(obstacle) => obstacle.distance(p),
            Form::Field(field) => field.distance(p),
        }
    }

    /// Distance as [`Shape::distance`], and the outward unit normal there.
    pub fn distance_and_normal(&self, point_in_tooth: Vec3) -> (f32, Vec3) {
        if let Form::Mesh(obstacle) = &self.form {
            let Meeting { distance, normal } = obstacle.nearest(self.tooth_from_shape.inverse() * point_in_tooth);
            return (distance, self.tooth_from_shape.turn(normal));
        }
        /// Small against every shape we model, large against f32 rounding at 100 mm.
        const STEP: f32 = 0.01;
        // Over a sample's width, or the slope would step from cell to cell.
        let step = if let Form::Field(field) = &self.form { 0.5 * field.spacing() } else { STEP };
        let along =
            |axis: Vec3| self.distance(point_in_tooth + axis * step) - self.distance(point_in_tooth - axis * step);
        let slope = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
        (self.distance(point_in_tooth), slope.try_normalize().unwrap_or(Vec3::Z))
    }

    /// Signed distance and outward normal of every place where a ball about a point may meet the shape: at most one for a
    /// convex form, for a mesh all up to a distance. What is farther than `within` may be left out.
    pub(super) fn meet(&self, point_in_tooth: Vec3, within: f32, mut each: impl FnMut(f32, Vec3)) {
        match &self.form {
            // Its normal costs six distances more: only what is within reach is asked for it.
            Form::Ball { .. } | Form::RoundBox { .. } | Form::Capsule { .. } | Form::Field(_) => {
                if self.distance(point_in_tooth) > within + ROUNDING {
                    return;
                }
                let (distance, normal) = self.distance_and_normal(point_in_tooth);
                each(distance, normal);
            }
            Form::Mesh(obstacle) => {
                let point = self.tooth_from_shape.inverse() * point_in_tooth;
                obstacle.meet(point, within, |m| each(m.distance, self.tooth_from_shape.turn(m.normal)));
            }
        }
    }
}

impl Matter {
    /// How deep an end sinks into what it touches, mm, and out of it; `None` where that holds any force.
    pub fn sinking(&self, touched: Label, tip: Vec3, force: f32) -> Option<(f32, Vec3)> {
        // What has no field is asked for no distance: of a mesh it is dear.
        let (shape, yields) = self.around.iter().find_map(|shape| match &shape.form {
            Form::Field(field) if shape.label == touched && shape.distance(tip) < SINKS_WITHIN => {
                Some((shape, field.yields))
            }
            _ => None,
        })?;
        let depth = yields.depth(force);
        (depth > 0.0).then(|| (depth, shape.distance_and_normal(tip).1))
    }

    /// A radius in mm around a point of tooth space that surely holds no matter; 0 where matter may be near.
    ///
    /// The bound is coarse and costs one look-up: it is the test that keeps empty space cheap.
    pub fn clear_radius(&self, point_in_tooth: Vec3) -> f32 {
        let around = self.around.iter().map(|s| s.distance(point_in_tooth)).fold(f32::INFINITY, f32::min);
        self.clear_of_volume(point_in_tooth).min(around).max(0.0)
    }

    /// The same for the volume alone.
    pub(super) fn clear_of_volume(&self, point_in_tooth: Vec3) -> f32 {
        let grid = self.volume.grid();
        let [low, high] = grid.extent();
        let nearest_inside = point_in_tooth.clamp(low, high);
        let outside_squared = nearest_inside.distance_squared(point_in_tooth);
        if outside_squared > 0.0 {
            // Interpolation reaches one voxel beyond the last centre.
            return (outside_squared.sqrt() - grid.spacing.max_element()).max(0.0);
        }
        match grid.nearest(point_in_tooth) {
            Some(cell) => {
                // One step less: the point may be half a voxel off the cell's centre, the surface half a cell nearer.
                let steps = self.volume.bricks().clear_steps(cell).saturating_sub(1);
                steps as f32 * grid.spacing.min_element()
            }
            None => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    #[test]
    fn shapes_know_their_distances() {
        let at = Pose::at(Vec3::new(1.0, 0.0, 0.0));
        let shape = |form| Shape { label: Label(1), tooth_from_shape: at, form };
        let check = |form, p: Vec3, expected: f32| {
            let shape = shape(form);
            let (distance, normal) = shape.distance_and_normal(p);
            assert!((distance - expected).abs() < 1e-4, "{shape:?} at {p}: {distance}");
            assert!((normal.length() - 1.0).abs() < 1e-4);
        };
        check(Form::Ball { radius: 2.0 }, Vec3::new(6.0, 0.0, 0.0), 3.0);
        check(Form::RoundBox { half: Vec3::new(1.0, 2.0, 3.0), rounding: 0.5 }, Vec3::new(4.0, 0.0, 0.0), 2.0);
        check(Form::RoundBox { half: Vec3::ONE, rounding: 0.2 }, Vec3::new(1.0, 0.0, 0.1), -0.9);
        check(Form::Capsule { half_length: 4.0, radius: 1.0 }, Vec3::new(1.0, 0.0, 7.0), 2.0);
    }

    #[test]
    fn what_is_within_reach_is_met_and_what_is_far_is_not_asked() {
        let shape = Shape { label: Label(1), tooth_from_shape: Pose::IDENTITY, form: Form::Ball { radius: 2.0 } };
        for (height, is_met) in [(1.9, true), (2.05, true), (2.099, true), (2.2, false)] {
            let place = Vec3::Z * height;
            let mut met = None;
            shape.meet(place, 0.1, |distance, normal| met = Some((distance, normal)));
            assert_eq!(met, is_met.then(|| shape.distance_and_normal(place)), "{height}");
        }
    }

    #[test]
    fn a_clear_radius_holds_no_matter() {
        let volume = phantom::ball([120, 120, 120], Vec3::splat(0.1), 2.0);
        let matter = Matter { volume, around: Vec::new() };
        let mut useful = 0;
        for i in 0..400 {
            let t = i as f32;
            let p = Vec3::new((t * 0.7).sin() * 9.0, (t * 1.3).cos() * 9.0, (t * 0.31).sin() * 9.0);
            let clear = matter.clear_radius(p);
            // The ball's density reaches one band beyond its surface.
            assert!(clear <= (p.length() - 2.2).max(0.0) + 1e-4, "{p}: {clear}");
            useful += usize::from(clear > 0.5);
        }
        assert!(useful > 100);
    }
}
