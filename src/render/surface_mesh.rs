//! Vertices of meshes for the surface pass.

use super::scene::{MeshInstance, VertexTint};
use super::vertex::Vertex;
use typodont_core::mesh::Mesh;

/// Returns the vertices of a mesh instance: its tints and full gloss, which are later multiplied with its appearance.
pub fn instance_vertices(solid: &MeshInstance) -> Vec<Vertex> {
    let mesh = &solid.mesh;
    let corners = mesh.positions.iter().zip(&mesh.normals).enumerate();
    let tint = |i: usize| solid.vertex_tints.get(i).copied().unwrap_or(VertexTint::NONE);
    corners.map(|(i, (&p, &n))| Vertex::new(p, n, tint(i))).collect()
}

/// Returns the vertices of a tooth's surface, or of a part of it; the pass looks up its colours for each pixel.
pub fn tooth_vertices(mesh: &Mesh) -> Vec<Vertex> {
    mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| Vertex::new(p, n, VertexTint::NONE)).collect()
}
