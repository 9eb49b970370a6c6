//! Parts of a mesh that lie close together, so that those out of sight are not drawn: without a graphics processor,
//! most of the time of a frame would go to the far side of the mouth.

use super::eye::Eye;
use core::ops::Range;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::mesh::Mesh;

/// Number of triangles in a part.
const TRIANGLES_PER_PART: usize = 512;

/// Number of cells along each axis of the grid that orders the triangles, as a power of two.
const GRID_BITS: u32 = 6;

/// Triangles of a mesh in an order in which neighbours follow each other, cut into parts.
pub struct MeshParts {
    /// Indices into the mesh's positions.
    pub triangles: Vec<[u32; 3]>,
    parts: Vec<MeshPart>,
}

/// A run of triangles, and the ball around them in the mesh's own space, mm.
struct MeshPart {
    triangles: Range<u32>,
    middle: Vec3,
    radius: f32,
}

/// Parts of a mesh that an eye may see.
#[derive(Debug, Default, PartialEq)]
pub struct VisibleParts {
    /// Triangles, in order; adjoining parts are one run.
    pub runs: Vec<Range<u32>>,
    /// Mean distance of the parts from the eye, mm; 0 if there are none.
    pub distance: f32,
}

impl MeshParts {
    pub fn new(mesh: &Mesh) -> MeshParts {
        let Aabb { low, high } = Aabb::around(mesh.positions.iter().copied());
        let scale = Vec3::splat((1 << GRID_BITS) as f32 - 1.0) / (high - low).max(Vec3::splat(1e-6));
        let corners = |triangle: [u32; 3]| triangle.map(|i| mesh.positions[i as usize]);
        let order = |triangle: &[u32; 3]| {
            let [a, b, c] = corners(*triangle);
            let cell = ((a + b + c) / 3.0 - low) * scale;
            morton_code([cell.x as u32, cell.y as u32, cell.z as u32])
        };
        let mut triangles = mesh.triangles.clone();
        triangles.sort_by_cached_key(order);
        let mut first = 0;
        let parts = triangles
            .chunks(TRIANGLES_PER_PART)
            .map(|part| {
                let bounds = Aabb::around(part.iter().flat_map(|triangle| corners(*triangle)));
                let range = first..first + part.len() as u32;
                first = range.end;
                MeshPart { triangles: range, middle: bounds.centre(), radius: bounds.half_size().length() }
            })
            .collect();
        MeshParts { triangles, parts }
    }

    pub fn visible(&self, eye: &Eye, world_from_solid: Pose) -> VisibleParts {
        let mut runs: Vec<Range<u32>> = Vec::new();
        let (mut distances, mut count) = (0.0, 0.0f32);
        for part in &self.parts {
            let middle = world_from_solid * part.middle;
            if !eye.may_see(middle, part.radius) {
                continue;
            }
            distances += eye.position.distance(middle);
            count += 1.0;
            match runs.last_mut() {
                Some(run) if run.end == part.triangles.start => run.end = part.triangles.end,
                _ => runs.push(part.triangles.clone()),
            }
        }
        VisibleParts { runs, distance: distances / count.max(1.0) }
    }
}

/// Place of a cell on a curve that fills space: its coordinates' bits in turn.
fn morton_code(cell: [u32; 3]) -> u32 {
    let bit = |axis: usize, level: u32| ((cell[axis] >> level) & 1) << (3 * level + axis as u32);
    (0..GRID_BITS).flat_map(|level| (0..3).map(move |axis| (axis, level))).map(|(axis, level)| bit(axis, level)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::camera::Orbit;
    use super::*;

    /// A plane sheet of 200 × 200 squares of 1 mm, around the origin.
    fn sheet() -> Mesh {
        let at = |i: u32| Vec3::new((i % 201) as f32 - 100.0, 0.0, (i / 201) as f32 - 100.0);
        let squares = (0..200u32).flat_map(|z| (0..200u32).map(move |x| z * 201 + x));
        Mesh {
            positions: (0..201 * 201).map(at).collect(),
            normals: vec![Vec3::Y; 201 * 201],
            triangles: squares.flat_map(|i| [[i, i + 201, i + 1], [i + 1, i + 201, i + 202]]).collect(),
        }
    }

    #[test]
    fn all_that_is_in_sight_is_drawn_and_little_else() {
        let mesh = sheet();
        let parts = MeshParts::new(&mesh);
        let mut sorted = [parts.triangles.clone(), mesh.triangles.clone()];
        sorted.iter_mut().for_each(|triangles| triangles.sort());
        assert!(sorted[0] == sorted[1], "every triangle is kept");
        let eye = Orbit::around(Vec3::new(30.0, 0.0, -20.0), 9.0).viewpoint().eye(1.0);
        let VisibleParts { runs, distance } = parts.visible(&eye, Pose::IDENTITY);
        let to_middle = eye.position.distance(Vec3::new(30.0, 0.0, -20.0));
        assert!(
            (0.5..2.0).contains(&(distance / to_middle)),
            "{distance} mm, where the view's middle is {to_middle} mm away"
        );
        let is_drawn = |i: usize| runs.iter().any(|run| run.contains(&(i as u32)));
        let mut drawn = 0;
        for (i, triangle) in parts.triangles.iter().enumerate() {
            drawn += usize::from(is_drawn(i));
            let in_sight = triangle.iter().any(|&corner| {
                let ([x, y], depth) = eye.project(mesh.positions[corner as usize]);
                depth > eye.near && (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)
            });
            assert!(is_drawn(i) || !in_sight, "triangle {i}");
        }
        assert!(drawn < mesh.triangles.len() / 3, "{drawn} of {} triangles", mesh.triangles.len());
        assert_eq!(MeshParts::new(&Mesh::default()).visible(&eye, Pose::IDENTITY), VisibleParts::default());
    }
}
