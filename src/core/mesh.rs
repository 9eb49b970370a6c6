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

    /// Enclosed volume in mm³, positive for a closed surface facing outward (divergence theorem).
    pub fn volume_mm3(&self) -> f64 {
        let at = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
    }
}
