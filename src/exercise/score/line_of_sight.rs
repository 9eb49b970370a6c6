//! Visibility of voxels from the trainee's eye, directly or in a mirror.
//!
//! Opaque are the solid voxels of the tooth as it is at the time, and the colliders around it. Instruments are
//! transparent: the bur hides each voxel that it removes, and whoever works sees it again when the bur moves on.

use crate::scenario::Workpiece;
use crate::session::{MirrorFace, TraineeView};
use typodont_core::frame::Vec3;
use typodont_core::touch::Collider;
use typodont_core::volume::{Edit, Grid};

/// Length of a line of sight next to the voxel on which nothing hides it, mm: without it, the steps of a surface of voxels
/// hide each other, and so does the thin overhang of tissue that the belly of a round bur leaves for a moment. In
/// millimetres, so that large voxels give the same share as small ones.
const SKIN: f32 = 0.5;

/// Distance from the voxel beyond which no collider hides it, mm: more than the length of an arch.
const COLLIDER_REACH: f32 = 150.0;

/// Least step along a line of sight past a collider, mm.
const COLLIDER_STEP: f32 = 0.02;

/// Everything that can hide a voxel, in tooth space, kept up to date by edits.
pub struct LineOfSight {
    grid: Grid,
    /// True for each voxel that is solid now.
    solid: Vec<bool>,
    colliders: Vec<Collider>,
}

impl LineOfSight {
    pub fn of(workpiece: &Workpiece) -> LineOfSight {
        LineOfSight {
            grid: *workpiece.volume.grid(),
            solid: workpiece.volume.densities().iter().map(|density| density.is_solid()).collect(),
            colliders: workpiece.surroundings.clone(),
        }
    }

    pub fn apply_edits(&mut self, edits: &[Edit]) {
        for edit in edits {
            self.solid[edit.index as usize] = edit.after.density.is_solid();
        }
    }

    /// Returns true if the centre of a voxel is in the picture and no matter stands before it, or if the mirror shows
    /// it so. `view` is in tooth space.
    pub fn is_visible(&self, view: &TraineeView, voxel: usize) -> bool {
        let place = self.grid.centre(self.grid.cell(voxel));
        let is_seen_directly = view.contains(place)
            && view.mirror.is_none_or(|face| crossing(&face, place, view.eye).is_none())
            && self.is_free(place, view.eye, SKIN);
        is_seen_directly || view.mirror.is_some_and(|face| self.is_visible_in(&face, view, place))
    }

    /// Returns true if the eye sees a point in a mirror: along the line from the point to the mirror image of the eye as
    /// far as the face, and on to the eye itself.
    fn is_visible_in(&self, face: &MirrorFace, view: &TraineeView, place: Vec3) -> bool {
        let height = |point: Vec3| (point - face.centre).dot(face.normal);
        if height(view.eye) <= 0.0 || height(place) <= 0.0 {
            return false;
        }
        let image = view.eye - face.normal * (2.0 * height(view.eye));
        let Some(on_face) = crossing(face, place, image) else { return false };
        view.contains(on_face) && self.is_free(place, on_face, SKIN) && self.is_free(view.eye, on_face, 0.0)
    }

    /// Returns true if no matter lies on the line from `skin` mm after `from` to `to`.
    fn is_free(&self, from: Vec3, to: Vec3, skin: f32) -> bool {
        let length = from.distance(to);
        if length <= skin {
            return true;
        }
        let along = (to - from) / length;
        let start = from + along * skin;
        !self.meets_voxel(start, to) && !self.meets_collider(start, along, length - skin)
    }

    /// Returns true if a line goes through a solid voxel: each voxel on its way is looked up, in order (Amanatides and
    /// Woo 1987).
    fn meets_voxel(&self, from: Vec3, to: Vec3) -> bool {
        // In voxels, with whole numbers at the faces between them.
        let start = self.grid.from_tooth(from) + 0.5;
        let way = self.grid.from_tooth(to) + 0.5 - start;
        let Some([enters, leaves]) = self.shares_within_grid(start, way) else { return false };
        let entry = start + way * enters;
        let mut cell = [0; 3];
        let mut next = [f32::INFINITY; 3];
        for axis in 0..3 {
            let last = self.grid.dims[axis].saturating_sub(1);
            cell[axis] = (entry[axis].max(0.0) as u32).min(last);
            let face = cell[axis] as f32 + if way[axis] > 0.0 { 1.0 } else { 0.0 };
            if way[axis] != 0.0 {
                next[axis] = (face - start[axis]) / way[axis];
            }
        }
        loop {
            if self.solid[self.grid.index(cell)] {
                return true;
            }
            let axis = if next[0] <= next[1].min(next[2]) { 0 } else { 1 + usize::from(next[2] < next[1]) };
            if next[axis] >= leaves {
                return false;
            }
            let beyond = if way[axis] > 0.0 { cell[axis].checked_add(1) } else { cell[axis].checked_sub(1) };
            match beyond.filter(|at| *at < self.grid.dims[axis]) {
                Some(at) => cell[axis] = at,
                None => return false,
            }
            next[axis] += (1.0 / way[axis]).abs();
        }
    }

    /// Shares of a line at which it enters and leaves the grid; `None` if it misses the grid.
    fn shares_within_grid(&self, start: Vec3, way: Vec3) -> Option<[f32; 2]> {
        let (mut enters, mut leaves) = (0.0f32, 1.0f32);
        for axis in 0..3 {
            let end = self.grid.dims[axis] as f32;
            if way[axis] == 0.0 {
                if !(0.0..end).contains(&start[axis]) {
                    return None;
                }
                continue;
            }
            let (low, high) = (-start[axis] / way[axis], (end - start[axis]) / way[axis]);
            enters = enters.max(low.min(high));
            leaves = leaves.min(low.max(high));
        }
        (enters < leaves).then_some([enters, leaves])
    }

    /// Returns true if a line meets a collider: each step is as long as the nearest collider permits.
    fn meets_collider(&self, from: Vec3, along: Vec3, length: f32) -> bool {
        let length = length.min(COLLIDER_REACH);
        let mut way = 0.0;
        while way < length && !self.colliders.is_empty() {
            let place = from + along * way;
            let mut free = f32::INFINITY;
            for collider in &self.colliders {
                let distance = collider.distance(place);
                if distance <= 0.0 {
                    return true;
                }
                free = free.min(distance / collider.steepness());
            }
            way += free.max(COLLIDER_STEP);
        }
        false
    }
}

/// Point at which a line goes through the disc of a mirror; `None` if it goes past.
fn crossing(face: &MirrorFace, from: Vec3, to: Vec3) -> Option<Vec3> {
    let (before, after) = ((from - face.centre).dot(face.normal), (to - face.centre).dot(face.normal));
    if (before > 0.0) == (after > 0.0) {
        return None;
    }
    let place = from + (to - from) * (before / (before - after));
    (place.distance_squared(face.centre) <= face.radius * face.radius).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Pose;
    use typodont_core::touch::ColliderGeometry;
    use typodont_core::volume::Label;

    /// A slab of 20 × 20 × 20 voxels of 0.1 mm, with a shaft from above to the voxel [10, 10, 8].
    fn slab() -> LineOfSight {
        let grid = Grid::centred([20, 20, 20], Vec3::splat(0.1));
        let is_shaft = |[x, y, z]: [u32; 3]| (9..=11).contains(&x) && (9..=11).contains(&y) && z >= 8;
        let solid = grid.cells().map(|cell| !is_shaft(cell)).collect();
        LineOfSight { grid, solid, colliders: Vec::new() }
    }

    fn view_from(eye: Vec3) -> TraineeView {
        let up = if eye.z.abs() > eye.y.abs() { Vec3::Y } else { Vec3::Z };
        TraineeView { eye, focus: Vec3::ZERO, up, half_extent: [0.25, 0.25], mirror: None }
    }

    #[test]
    fn the_floor_of_a_shaft_is_seen_from_above_and_from_nowhere_else() {
        let sight = slab();
        let floor = sight.grid.index([10, 10, 8]);
        for (eye, is_seen) in [
            (Vec3::Z * 60.0, true),
            (Vec3::new(5.0, 0.0, 60.0), true),
            (Vec3::X * 60.0, false),
            (Vec3::Z * -60.0, false),
        ] {
            assert_eq!(sight.is_visible(&view_from(eye), floor), is_seen, "{eye}");
        }
        let beside = TraineeView { focus: Vec3::X * 60.0, ..view_from(Vec3::Z * 60.0) };
        assert!(!sight.is_visible(&beside, floor), "beyond the edge of the picture");
    }

    #[test]
    fn a_mirror_above_shows_the_floor_to_an_eye_beside() {
        let sight = slab();
        let floor = sight.grid.index([10, 10, 8]);
        let normal = Vec3::new(1.0, 0.0, -1.0).normalize();
        let face = MirrorFace { centre: Vec3::Z * 20.0, normal, radius: 10.0 };
        // The line from the floor upward is turned by the face at 45° to run along +x at a height of 20 mm.
        let view = TraineeView { mirror: Some(face), focus: face.centre, ..view_from(Vec3::new(60.0, 0.0, 20.0)) };
        assert!(sight.is_visible(&view, floor));
        assert!(!sight.is_visible(&TraineeView { mirror: None, ..view }, floor));
        let turned = MirrorFace { normal: -normal, ..face };
        assert!(!sight.is_visible(&TraineeView { mirror: Some(turned), ..view }, floor), "its back reflects nothing");
        let above = TraineeView { mirror: Some(face), ..view_from(Vec3::Z * 60.0) };
        assert!(!sight.is_visible(&above, floor), "the mirror itself is opaque");
    }

    #[test]
    fn a_collider_hides_what_lies_behind_it() {
        let mut sight = slab();
        let floor = sight.grid.index([10, 10, 8]);
        let ball = Collider {
            label: Label(9),
            tooth_from_collider: Pose::at(Vec3::Z * 20.0),
            geometry: ColliderGeometry::Ball { radius: 2.0 },
        };
        sight.colliders.push(ball);
        assert!(!sight.is_visible(&view_from(Vec3::Z * 60.0), floor));
        assert!(sight.is_visible(&view_from(Vec3::Z * 10.0), floor), "the ball is behind the eye");
    }
}
