//! The carved tooth as a volume, for the passes that look into it. Twin of `tooth.wgsl`.

use super::texture_reads::{Texture, TextureReads};
use super::{CachedVolume, CpuView};
use crate::ambient_occlusion::OcclusionVolume;
use crate::bounds_of_matter;
use crate::empty_space;
use crate::empty_space::{BrickEntry, EmptySpaceMap};
use crate::scene::{Appearance, Rgb, VolumeInstance};
use crate::surface_colours::SurfaceColours;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{BRICK, Volume};

/// Share of a voxel that surely leads across a border between bricks, however numbers are rounded.
const NUDGE: f32 = 0.004;

pub struct VolumeSampler<'a> {
    pub volume: &'a Volume,
    pub world_from_tooth: Pose,
    empty_space: &'a EmptySpaceMap,
    occlusion: &'a OcclusionVolume,
    colours: &'a SurfaceColours,
    pub reads: &'a TextureReads,
    low: Vec3,
    high: Vec3,
}

/// A ray in voxel steps: `start + along * z` lies at depth z mm.
#[derive(Clone, Copy)]
pub struct Ray {
    pub start: Vec3,
    pub along: Vec3,
    /// Depth, mm, in which the ray crosses one voxel along each axis.
    per_voxel: Vec3,
}

impl Ray {
    pub fn at(&self, z: f32) -> Vec3 {
        self.start + self.along * z
    }
}

impl<'a> VolumeSampler<'a> {
    pub fn new(tooth: &VolumeInstance, cached: &'a CachedVolume) -> VolumeSampler<'a> {
        let CachedVolume { drawn, empty_space, occlusion, colours, reads, .. } = cached;
        let (volume, world_from_tooth) = (&drawn.volume, tooth.world_from_tooth);
        let Aabb { low, high } = bounds_of_matter(volume);
        VolumeSampler { volume, world_from_tooth, empty_space, occlusion, colours, reads, low, high }
    }

    /// The ray through a pixel, with its way in world space.
    pub fn ray(&self, view: &CpuView, x: f32, y: f32) -> (Ray, Vec3) {
        let direction = view.ray(x, y);
        let tooth_from_world = self.world_from_tooth.inverse();
        let grid = self.volume.grid();
        let start = grid.from_tooth(tooth_from_world * view.eye.position);
        let along = tooth_from_world.rotate(direction) / grid.spacing;
        (Ray { start, along, per_voxel: along.abs().max(Vec3::splat(1e-9)).recip() }, direction)
    }

    pub fn density(&self, at: Vec3) -> f32 {
        self.reads.count(Texture::Density, 1);
        self.volume.density_in_grid(at)
    }

    /// Depths, mm, at which the ray enters and leaves the box of matter.
    pub fn span(&self, ray: &Ray) -> [f32; 2] {
        let (mut first, mut last) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let pace = if ray.along[axis].abs() < 1e-9 { 1e-9 } else { ray.along[axis] };
            let (a, b) = ((self.low[axis] - ray.start[axis]) / pace, (self.high[axis] - ray.start[axis]) / pace);
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        [first, last]
    }

    /// The entry of the brick around a place on a ray, and how far on the ray leaves the cube of bricks in which there is no
    /// other.
    pub fn leap(&self, ray: &Ray, at: Vec3) -> (BrickEntry, f32) {
        self.reads.count(Texture::EmptySpace, 1);
        let dims = self.empty_space.dims();
        // The conversion rounds down, and to 0 before the grid.
        let brick: [u32; 3] = std::array::from_fn(|a| (((at[a] / BRICK as f32) as i32).max(0) as u32).min(dims[a] - 1));
        let entry = self.empty_space.entries()[((brick[2] * dims[1] + brick[1]) * dims[0] + brick[0]) as usize];
        let reach = f32::from(empty_space::distance(entry).max(1));
        let mut exit = f32::INFINITY;
        for axis in 0..3 {
            // The first brick goes on where the grid has ended.
            let first = brick[axis] as f32 + 1.0 - reach;
            let low = if first <= 0.0 { -1.0 } else { first } * BRICK as f32;
            let high = (brick[axis] as f32 + reach) * BRICK as f32;
            let room = if ray.along[axis] > 0.0 { high - at[axis] } else { at[axis] - low };
            exit = exit.min((room.max(0.0) + NUDGE) * ray.per_voxel[axis]);
        }
        (entry, exit)
    }

    /// Gradient of the density, per mm in world space.
    pub fn gradient(&self, at: Vec3) -> Vec3 {
        let corners = [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
        let rise: Vec3 = corners.map(|corner| corner * self.density(at + corner)).into_iter().sum();
        self.world_from_tooth.rotate(rise * 0.25 / self.volume.grid().spacing)
    }

    /// Outward unit normal in world space; where density does not change, `otherwise`.
    pub fn normal(&self, at: Vec3, otherwise: Vec3) -> Vec3 {
        let downhill = -self.gradient(at);
        if downhill.length() > 1e-6 { downhill.normalize() } else { otherwise.normalize() }
    }

    /// Share of light that reaches a surface with this normal in world space.
    pub fn openness(&self, at: Vec3, normal: Vec3) -> f32 {
        let outward = self.world_from_tooth.inverse().rotate(normal) / self.volume.grid().spacing;
        self.reads.count(Texture::Occlusion, 1);
        self.occlusion.openness(at, outward)
    }

    /// Shaded colour of the surface at a place, which is a point of world space.
    pub fn shade(&self, view: &CpuView, at: Vec3, point: Vec3, normal: Vec3) -> Rgb {
        let plain = self.appearance(at);
        let open = self.openness(at, normal);
        let Some(relief) = view.relief else { return view.shade(plain, open, point, normal) };
        let own = at * self.volume.grid().spacing;
        let marked = relief.of_tooth(point, normal, own, plain.gloss, |v| self.world_from_tooth.rotate(v));
        let to_own = |v| self.world_from_tooth.inverse().rotate(v);
        view.shade(relief.cracked(point, normal, plain, own, to_own), open, point, marked)
    }

    /// Colour and gloss of the surface at a place.
    pub fn appearance(&self, at: Vec3) -> Appearance {
        self.reads.count(Texture::Colour, 1);
        self.colours.at(at)
    }
}
