//! Triangles with light per pixel. Twin of `surface_pass.wgsl`.

use super::matter::Matter;
use super::raster::{self, Corner};
use super::{Canvas, Sight};
use crate::frame::{Pose, Vec3};
use crate::render::scene::{Finish, Solid};
use crate::render::surface_mesh;
use crate::render::vertex::Vertex;
use crate::volume::surface;

pub fn solid(solid: &Solid, sight: &Sight, canvas: &mut Canvas) {
    let vertices = surface_mesh::of_solid(solid);
    let own = solid.finish;
    triangles(&vertices, &solid.mesh.triangles, solid.world_from_solid, sight, canvas, |_, normal, finish, point| {
        let colour = std::array::from_fn(|c| finish.colour[c] * own.colour[c]);
        sight.lit(Finish { colour, gloss: finish.gloss * own.gloss }, 1.0, point, normal)
    });
}

pub fn tooth(matter: &Matter, sight: &Sight, canvas: &mut Canvas) {
    let mesh = surface::extract(matter.volume);
    let vertices = surface_mesh::of_tooth(matter.volume, matter.palette, &mesh);
    let grid = matter.volume.grid();
    triangles(&vertices, &mesh.triangles, matter.world_from_tooth, sight, canvas, |own, normal, finish, point| {
        let open = matter.openness(grid.from_tooth(own), normal);
        sight.lit(finish, open, point, normal)
    });
}

/// Draws triangles; `shade` is given the place in the solid's space, the unit normal, the finish and the place in the world.
fn triangles(
    vertices: &[Vertex],
    triangles: &[[u32; 3]],
    world_from_solid: Pose,
    sight: &Sight,
    canvas: &mut Canvas,
    shade: impl Fn(Vec3, Vec3, Finish, Vec3) -> [f32; 3] + Sync,
) {
    let clip_from_world = sight.eye.clip_from_world();
    let corner = |vertex: &Vertex| {
        let own = vertex.position();
        let point = world_from_solid * own;
        let normal = world_from_solid.turn(vertex.normal());
        let [r, g, b] = vertex.colour();
        let clip = std::array::from_fn(|row| {
            let [x, y, z, w] = clip_from_world.map(|column| column[row]);
            x * point.x + y * point.y + z * point.z + w
        });
        let vary = [own.x, own.y, own.z, normal.x, normal.y, normal.z, r, g, b, vertex.gloss()];
        Corner { clip, vary }
    };
    let corners: Vec<Corner> = vertices.iter().map(corner).collect();
    raster::draw(&corners, triangles, canvas, |[x, y, z, nx, ny, nz, r, g, b, gloss]| {
        let own = Vec3::new(x, y, z);
        let normal = Vec3::new(nx, ny, nz).normalize_or_zero();
        shade(own, normal, Finish { colour: [r, g, b], gloss }, world_from_solid * own)
    });
}
