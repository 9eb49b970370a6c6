//! Indexed triangles, as every surface in the program is handed about.
//!
//! Takes and gives millimetres. Counter-clockwise triangles face outward. Never knows what it is a surface of.

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

    /// Enclosed volume in mm³, positive for a closed surface facing outward (divergence theorem).
    pub fn volume_mm3(&self) -> f64 {
        let at = |i: u32| self.positions[i as usize].as_dvec3();
        self.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
    }
}
