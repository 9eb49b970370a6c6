//! Triangles with light per pixel. Twin of `surface_pass.wgsl`.

use super::raster::{self, ShadedVertex};
use super::volume_sampler::VolumeSampler;
use super::{CpuView, Framebuffer};
use crate::scene::{Appearance, MeshInstance, Rgb, VolumeInstance};
use crate::surface_mesh;
use crate::vertex::Vertex;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Volume, surface};

pub fn solid(solid: &MeshInstance, view: &CpuView, framebuffer: &mut Framebuffer) {
    let vertices = surface_mesh::instance_vertices(solid);
    let own = solid.appearance;
    triangles(&vertices, &solid.mesh.triangles, solid.world_from_solid, view, framebuffer, |seen| {
        let SurfacePoint { own: place, normal, finish, stippling, point } = seen;
        let colour = std::array::from_fn(|c| finish.colour[c] * own.colour[c]);
        let to_world = |v| solid.world_from_solid.rotate(v);
        let plain = Appearance { colour, gloss: finish.gloss * own.gloss };
        let (appearance, normal) = match view.relief {
            None => (plain, normal),
            Some(relief) if solid.is_enamel => {
                let to_own = |v| solid.world_from_solid.inverse().rotate(v);
                let appearance = relief.cracked(point, normal, plain, place, to_own);
                (appearance, relief.of_enamel(point, normal, place, to_world))
            }
            Some(relief) => (plain, relief.stippled(point, normal, place, stippling, to_world)),
        };
        view.shade(appearance, 1.0, point, normal)
    });
}

/// The depths of a solid alone, for shadows.
pub fn solid_depths(solid: &MeshInstance, view: &CpuView, framebuffer: &mut Framebuffer) {
    let vertices = surface_mesh::instance_vertices(solid);
    triangles(&vertices, &solid.mesh.triangles, solid.world_from_solid, view, framebuffer, |_| [0.0; 3]);
}

/// The depths of the tooth alone, for shadows.
pub fn tooth_depths(
    SurfaceTriangles { vertices, triangles: corners }: &SurfaceTriangles,
    tooth: &VolumeInstance,
    view: &CpuView,
    framebuffer: &mut Framebuffer,
) {
    triangles(vertices, corners, tooth.world_from_tooth, view, framebuffer, |_| [0.0; 3]);
}

/// Surface of the tooth, in tooth space.
pub struct SurfaceTriangles {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl SurfaceTriangles {
    /// From the volume as it is, and smoothed.
    pub fn extract(volume: &Volume, smoothed: &Volume) -> SurfaceTriangles {
        let mesh = surface::extract_sharp(volume, smoothed);
        SurfaceTriangles { vertices: surface_mesh::tooth_vertices(&mesh), triangles: mesh.triangles }
    }
}

pub fn tooth(surface: &SurfaceTriangles, sampler: &VolumeSampler, view: &CpuView, framebuffer: &mut Framebuffer) {
    let grid = sampler.volume.grid();
    triangles(
        &surface.vertices,
        &surface.triangles,
        sampler.world_from_tooth,
        view,
        framebuffer,
        |SurfacePoint { own, normal, point, .. }| {
            let at = grid.from_tooth(own);
            sampler.shade(view, at, point, turned_to_eye(normal, (view.eye.position - point).normalize()))
        },
    );
}

/// Cosine between the normal of a tooth's surface and the way to the eye below which the normal is turned to the eye.
const EDGE_ON: f32 = 0.4;

/// Unit normal of a place that an eye sees. At the sharp rim of a cut, the gradient of voxels may turn away from the eye, which would
/// show as dark teeth along the rim.
fn turned_to_eye(normal: Vec3, to_eye: Vec3) -> Vec3 {
    (normal + to_eye * (EDGE_ON - normal.dot(to_eye)).max(0.0)).normalize()
}

/// A place on a triangle.
struct SurfacePoint {
    /// In the solid's own space.
    own: Vec3,
    /// Unit, world space.
    normal: Vec3,
    finish: Appearance,
    stippling: f32,
    /// World space.
    point: Vec3,
}

/// Draws triangles.
fn triangles(
    vertices: &[Vertex],
    triangles: &[[u32; 3]],
    world_from_solid: Pose,
    view: &CpuView,
    framebuffer: &mut Framebuffer,
    shade: impl Fn(SurfacePoint) -> Rgb + Sync,
) {
    let clip_from_world = view.eye.clip_from_world();
    let corner = |vertex: &Vertex| {
        let own = vertex.position();
        let point = world_from_solid * own;
        let normal = world_from_solid.rotate(vertex.normal());
        let [r, g, b] = vertex.colour();
        let clip = std::array::from_fn(|row| {
            let [x, y, z, w] = clip_from_world.map(|column| column[row]);
            x * point.x + y * point.y + z * point.z + w
        });
        let vary = [own.x, own.y, own.z, normal.x, normal.y, normal.z, r, g, b, vertex.gloss(), vertex.stippling()];
        ShadedVertex { clip, varying: vary }
    };
    let corners: Vec<ShadedVertex> = vertices.iter().map(corner).collect();
    raster::draw(&corners, triangles, framebuffer, |[x, y, z, nx, ny, nz, r, g, b, gloss, stippling]| {
        let own = Vec3::new(x, y, z);
        let normal = Vec3::new(nx, ny, nz).normalize_or_zero();
        let finish = Appearance { colour: [r, g, b], gloss };
        shade(SurfacePoint { own, normal, finish, stippling, point: world_from_solid * own })
    });
}
