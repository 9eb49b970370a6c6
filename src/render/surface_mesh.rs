//! Vertices of meshes for the surface pass.

use super::scene::{Appearance, MeshInstance};
use super::vertex::Vertex;
use typodont_core::mesh::Mesh;

/// Returns the vertices of a mesh instance: its vertex colours and full gloss, which are later multiplied with its
/// appearance.
pub fn instance_vertices(solid: &MeshInstance) -> Vec<Vertex> {
    let mesh = &solid.mesh;
    let corners = mesh.positions.iter().zip(&mesh.normals).enumerate();
    let tint = |i: usize| solid.vertex_colours.get(i).copied().unwrap_or([1.0; 3]);
    corners.map(|(i, (&p, &n))| Vertex::new(p, n, Appearance { colour: tint(i), gloss: 1.0 })).collect()
}

/// Returns the vertices of a tooth's surface, or of a part of it; the pass looks up its colours for each pixel.
pub fn tooth_vertices(mesh: &Mesh) -> Vec<Vertex> {
    let white = Appearance { colour: [1.0; 3], gloss: 1.0 };
    mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| Vertex::new(p, n, white)).collect()
}
