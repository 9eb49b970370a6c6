//! The carved tooth where the adapter can see it: textures that follow the volume brick by brick.

use super::empty::Empty;
use super::hollow::Hollow;
use super::scene::{Changes, Palette, Shown, Tooth};
use super::transfer::TransferFunction;
use super::{blending_step, matter_box, resources};
use crate::frame::{Pose, Vec3};
use crate::volume::{BRICK, Volume};
use std::sync::Arc;

/// In step with `tooth.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Tooth {
        pub world_from_voxel: [[f32; 4]; 4],
        pub voxel_from_world: [[f32; 4]; 4],
        pub world_from_tooth: [[f32; 4]; 4],
        pub dims: [f32; 4],
        pub low: [f32; 4],
        pub high: [f32; 4],
        pub spacing: [f32; 4],
        pub palette: [[f32; 4]; 256],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/tooth.wgsl");

/// What was brought to the adapter for one picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploads {
    /// True when the whole volume was.
    pub whole: bool,
    /// Bricks of voxels, if not.
    pub bricks: usize,
    /// Bricks whose triangles were made anew, if not.
    pub surfaces: usize,
    /// Voxels joined along each axis because this adapter's textures are too small for the volume: 1 when all are shown, 0
    /// without a volume. Above 1 whoever looks should be told that the picture is coarser than the tooth.
    pub joined: u32,
}

/// Textures of one volume.
pub struct ToothTextures {
    dims: [u32; 3],
    /// The box of all matter when the volume was taken, in voxel steps. Carving only empties it.
    matter: [Vec3; 2],
    empty_map: Empty,
    hollow_map: Hollow,
    function: Option<Arc<TransferFunction>>,
    uniform: wgpu::Buffer,
    voxels: wgpu::Texture,
    empty: wgpu::Texture,
    hollow: wgpu::Texture,
    transfer: wgpu::Texture,
    pub group: wgpu::BindGroup,
}

impl ToothTextures {
    /// How the group's bindings lie.
    pub fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
        let float = wgpu::TextureSampleType::Float { filterable: true };
        let volume = |sample| resources::texture(sample, wgpu::TextureViewDimension::D3);
        resources::layout(
            device,
            "tooth",
            &[
                resources::uniform(),
                volume(float),
                wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                volume(wgpu::TextureSampleType::Uint),
                volume(float),
                resources::texture(
                    wgpu::TextureSampleType::Float { filterable: false },
                    wgpu::TextureViewDimension::D2,
                ),
            ],
        )
    }

    /// Takes a volume whole; it must fit the adapter's textures.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        tooth: &Tooth,
    ) -> ToothTextures {
        let volume = tooth.volume;
        let dims = volume.grid().dims;
        let empty_map = Empty::of(volume, &tooth.shown);
        let hollow_map = Hollow::of(volume);
        use wgpu::TextureFormat as Format;
        let space = |label, dims, format| resources::volume_texture(device, label, dims, format);
        let voxels = space("voxels", dims, Format::Rg8Unorm);
        let empty = space("empty", empty_map.dims(), Format::R8Uint);
        let hollow = space("hollow", hollow_map.dims(), Format::R8Unorm);
        let transfer = resources::table_texture(device, "transfer", [256, 256], Format::Rgba8Unorm);
        let uniform = resources::uniform_buffer(device, "tooth", size_of::<gpu::Tooth>());
        let between = resources::sampler(device);
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let views = [view(&voxels), view(&empty), view(&hollow), view(&transfer)];
        let group = resources::group(
            device,
            layout,
            [
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(&views[0]),
                wgpu::BindingResource::Sampler(&between),
                wgpu::BindingResource::TextureView(&views[1]),
                wgpu::BindingResource::TextureView(&views[2]),
                wgpu::BindingResource::TextureView(&views[3]),
            ],
        );
        let matter = matter_box(volume);
        let function = None;
        let made = ToothTextures {
            dims,
            matter,
            empty_map,
            hollow_map,
            function,
            uniform,
            voxels,
            empty,
            hollow,
            transfer,
            group,
        };
        resources::write_box(queue, &made.voxels, [0; 3], dims, &interleaved(volume, [0; 3], dims));
        resources::write_box(queue, &made.empty, [0; 3], made.empty_map.dims(), made.empty_map.entries());
        resources::write_box(queue, &made.hollow, [0; 3], made.hollow_map.dims(), made.hollow_map.mean());
        made
    }

    /// True when these textures can follow a volume's changes.
    pub fn fits(&self, tooth: &Tooth) -> bool {
        self.dims == tooth.volume.grid().dims && tooth.changes != Changes::Anew
    }

    /// Takes over changed bricks and the way the tooth is shown; gives the number of bricks brought over.
    pub fn follow(&mut self, queue: &wgpu::Queue, tooth: &Tooth) -> usize {
        let Changes::Bricks(changed) = tooth.changes else { return 0 };
        for &brick in changed {
            let corner = tooth.volume.bricks().corner(brick);
            let size = std::array::from_fn(|a| BRICK.min(self.dims[a] - corner[a]));
            resources::write_box(queue, &self.voxels, corner, size, &interleaved(tooth.volume, corner, size));
        }
        if !changed.is_empty() {
            self.matter = grown(self.matter, tooth.volume, changed);
        }
        let differing = self.empty_map.update(tooth.volume, changed);
        if self.empty_map.show(&tooth.shown) {
            resources::write_box(queue, &self.empty, [0; 3], self.empty_map.dims(), self.empty_map.entries());
        } else {
            for brick in differing {
                let place = tooth.volume.bricks().corner(brick).map(|c| c / BRICK);
                resources::write_box(queue, &self.empty, place, [1; 3], &self.empty_map.entries()[brick..=brick]);
            }
        }
        for cube in self.hollow_map.update(tooth.volume, changed) {
            let place = self.hollow_map.cube(cube);
            resources::write_box(queue, &self.hollow, place, [1; 3], &self.hollow_map.mean()[cube..=cube]);
        }
        changed.len()
    }

    /// Where the tooth is and how it looks in this picture.
    pub fn pose(&mut self, queue: &wgpu::Queue, tooth: &Tooth) {
        let mut light = 0.0;
        if let Shown::Volume(function) = &tooth.shown {
            light = function.light;
            let is_known = self.function.as_ref().is_some_and(|known| **known == **function);
            if !is_known {
                let tables = function.stepped(blending_step(tooth.volume));
                let rows: Vec<u8> = tables.iter().flatten().flatten().copied().collect();
                resources::write_table(queue, &self.transfer, [256, 256], &rows);
                self.function = Some(function.clone());
            }
        }
        let grid = tooth.volume.grid();
        let edge = self.hollow_map.edge() as f32;
        let [low, high] = self.matter;
        let uniform = gpu::Tooth {
            world_from_voxel: resources::columns(tooth.world_from_tooth, grid.spacing, grid.origin),
            voxel_from_world: voxel_from_world(tooth),
            world_from_tooth: resources::columns(tooth.world_from_tooth, Vec3::ONE, Vec3::ZERO),
            dims: Vec3::from(grid.dims.map(|n| n as f32)).extend(edge).to_array(),
            low: low.extend(blending_step(tooth.volume)).to_array(),
            high: high.extend(light).to_array(),
            spacing: grid.spacing.extend(0.0).to_array(),
            palette: colours(tooth.palette),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }
}

fn colours(palette: &Palette) -> [[f32; 4]; 256] {
    palette.0.map(|finish| [finish.colour[0], finish.colour[1], finish.colour[2], finish.gloss])
}

fn voxel_from_world(tooth: &Tooth) -> [[f32; 4]; 4] {
    let grid = tooth.volume.grid();
    let Pose { position, orientation } = tooth.world_from_tooth.inverse();
    let column = |axis: Vec3| (orientation * axis / grid.spacing).extend(0.0).to_array();
    let last = ((position - grid.origin) / grid.spacing).extend(1.0).to_array();
    [column(Vec3::X), column(Vec3::Y), column(Vec3::Z), last]
}

/// The box of matter, made larger where a changed brick lies outside: a restoration may be put there.
fn grown([low, high]: [Vec3; 2], volume: &Volume, changed: &[usize]) -> [Vec3; 2] {
    let occupied = changed
        .iter()
        .map(|&b| volume.bricks().corner(b))
        .filter(|c| volume.bricks().is_occupied(c.map(|v| v / BRICK)));
    occupied.fold([low, high], |[low, high], corner| {
        let first = Vec3::from(corner.map(|v| v as f32));
        let last =
            Vec3::from(std::array::from_fn::<f32, 3, _>(|a| (corner[a] + BRICK).min(volume.grid().dims[a]) as f32));
        [low.min(first - 1.0), high.max(last)]
    })
}

/// Density and label of each voxel of a box, x fastest.
fn interleaved(volume: &Volume, corner: [u32; 3], size: [u32; 3]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(2 * size.iter().map(|&n| n as usize).product::<usize>());
    for z in corner[2]..corner[2] + size[2] {
        for y in corner[1]..corner[1] + size[1] {
            let first = volume.grid().index([corner[0], y, z]);
            let row = first..first + size[0] as usize;
            let pairs = volume.densities()[row.clone()].iter().zip(&volume.labels()[row]);
            bytes.extend(pairs.flat_map(|(density, label)| [density.bits(), label.0]));
        }
    }
    bytes
}
