//! Indexed triangle mesh, the common surface representation of the program.
//!
//! Takes and gives millimetres. Counter-clockwise triangles face outward. Never knows what object it is the surface
//! of.

use crate::frame::Vec3;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// mm
    pub positions: Vec<Vec3>,
    /// Unit outward normals, one per position.
    pub normals: Vec<Vec3>,
    /// Indices into `positions`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Appends another mesh.
    pub fn append(&mut self, other: Mesh) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| first + i)));
    }

    /// Sets the normals: outward, weighted by the areas of the triangles around each position.
    pub fn compute_normals(&mut self) {
        self.normals = vec![Vec3::ZERO; self.positions.len()];
        for &triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            triangle.iter().for_each(|&i| self.normals[i as usize] += (b - a).cross(c - a));
        }
        self.normals.iter_mut().for_each(|n| *n = n.normalize_or(Vec3::Z));
    }

    /// Replaces each normal by the mean over the corners around it, `passes` times, so that a surface whose triangles
    /// are larger than a pixel shows no facets and no creases.
    pub fn smooth_normals(&mut self, passes: usize) {
        for _ in 0..passes {
            let mut sums = self.normals.clone();
            for triangle in &self.triangles {
                let [a, b, c] = triangle.map(|i| self.normals[i as usize]);
                for (&i, others) in triangle.iter().zip([b + c, c + a, a + b]) {
                    // Each edge belongs to two triangles.
                    sums[i as usize] += 0.5 * others;
                }
            }
            self.normals = sums.into_iter().map(|sum| sum.normalize_or(Vec3::Z)).collect();
        }
    }

    /// Enclosed volume in mm³, positive for a closed surface facing outward (divergence theorem).
    pub fn volume_mm3(&self) -> f64 {
        let at = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
    }
}
