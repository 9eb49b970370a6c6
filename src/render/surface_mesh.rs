//! Meshes as the surface pass takes them.

use super::scene::{Finish, Palette, Solid};
use super::twin;
use super::vertex::Vertex;
use crate::mesh::Mesh;
use crate::volume::Volume;

/// A solid's corners: its own tints and full gloss, which its finish is multiplied with later.
pub fn of_solid(solid: &Solid) -> Vec<Vertex> {
    let mesh = &solid.mesh;
    let corners = mesh.positions.iter().zip(&mesh.normals).enumerate();
    let tint = |i: usize| solid.tints.get(i).copied().unwrap_or([1.0; 3]);
    corners.map(|(i, (&p, &n))| Vertex::new(p, n, Finish { colour: tint(i), gloss: 1.0 })).collect()
}

/// The corners of a tooth's surface, or of a part of it, in the colours of the matter there.
pub fn of_tooth(volume: &Volume, palette: &Palette, mesh: &Mesh) -> Vec<Vertex> {
    let finish = |p| twin::finish(volume, palette, volume.grid().from_tooth(p));
    mesh.positions.iter().zip(&mesh.normals).map(|(&p, &n)| Vertex::new(p, n, finish(p))).collect()
}
