//! Textures of the carved tooth, which are updated brick by brick.

use super::ambient_occlusion::OcclusionVolume;
use super::empty_space::EmptySpaceMap;
use super::scene::{Changes, RenderMode, VolumeInstance};
use super::surface_colours::SurfaceColours;
use super::transfer_function::TransferFunction;
use super::{bounds_of_matter, integration_step, resources};
use std::sync::Arc;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{BRICK, Volume};

/// Structs of `tooth.wgsl`; keep in step.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct ToothUniform {
        pub world_from_voxel: [[f32; 4]; 4],
        pub voxel_from_world: [[f32; 4]; 4],
        pub world_from_tooth: [[f32; 4]; 4],
        pub dims: [f32; 4],
        pub low: [f32; 4],
        pub high: [f32; 4],
        pub spacing: [f32; 4],
        pub cells: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/tooth.wgsl");

/// Data uploaded to the GPU for one image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploads {
    /// True when the whole volume was uploaded.
    pub is_full_volume: bool,
    /// Number of bricks of voxels that were uploaded otherwise.
    pub bricks: usize,
    /// Number of bricks whose triangles were rebuilt otherwise.
    pub surfaces: usize,
    /// Number of voxels averaged along each axis because this GPU's textures are too small for the volume: 1 at full
    /// resolution, 0 without a volume. Above 1 the user should be told that the image is coarser than the tooth.
    pub downsampling: u32,
}

/// Textures of one volume.
pub struct ToothTextures {
    dims: [u32; 3],
    /// Box around all matter at the time of the upload, in voxel coordinates. Carving only empties it.
    bounds: Aabb,
    empty_space: EmptySpaceMap,
    occlusion: OcclusionVolume,
    colours: SurfaceColours,
    function: Option<Arc<TransferFunction>>,
    uniform: wgpu::Buffer,
    voxels: wgpu::Texture,
    empty_texture: wgpu::Texture,
    occlusion_texture: wgpu::Texture,
    colour_texture: wgpu::Texture,
    transfer_texture: wgpu::Texture,
    pub group: wgpu::BindGroup,
}

impl ToothTextures {
    /// Returns the layout of the bind group.
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
                volume(float),
            ],
        )
    }

    /// Uploads a whole volume, which must fit the GPU's textures.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        tooth: &VolumeInstance,
    ) -> ToothTextures {
        let volume = tooth.volume;
        let dims = volume.grid().dims;
        let empty_space = EmptySpaceMap::new(volume, &tooth.mode);
        let occlusion = OcclusionVolume::new(volume);
        let colours = SurfaceColours::new(tooth);
        use wgpu::TextureFormat as Format;
        let space = |label, dims, format| resources::volume_texture(device, label, dims, format);
        let voxels = space("voxels", dims, Format::Rg8Unorm);
        let empty_texture = space("empty", empty_space.dims(), Format::Rg8Uint);
        let occlusion_texture = space("occlusion", occlusion.dims(), Format::R8Unorm);
        let colour_texture = space("colours", colours.dims(), Format::Rgba8Unorm);
        let transfer_texture = resources::table_texture(device, "transfer", [256, 256], Format::Rgba8Unorm);
        let uniform = resources::uniform_buffer(device, "tooth", size_of::<gpu::ToothUniform>());
        let linear_sampler = resources::sampler(device);
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let textures = [&voxels, &empty_texture, &occlusion_texture, &transfer_texture, &colour_texture];
        let views = textures.map(view);
        let group = resources::group(
            device,
            layout,
            [
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(&views[0]),
                wgpu::BindingResource::Sampler(&linear_sampler),
                wgpu::BindingResource::TextureView(&views[1]),
                wgpu::BindingResource::TextureView(&views[2]),
                wgpu::BindingResource::TextureView(&views[3]),
                wgpu::BindingResource::TextureView(&views[4]),
            ],
        );
        let bounds = bounds_of_matter(volume);
        let function = None;
        let textures = ToothTextures {
            dims,
            bounds,
            empty_space,
            occlusion,
            colours,
            function,
            uniform,
            voxels,
            empty_texture,
            occlusion_texture,
            colour_texture,
            transfer_texture,
            group,
        };
        textures.upload(queue, volume);
        textures
    }

    /// Uploads all voxels and everything that is derived from them.
    fn upload(&self, queue: &wgpu::Queue, volume: &Volume) {
        resources::write_box(queue, &self.voxels, [0; 3], self.dims, &interleaved(volume, [0; 3], self.dims));
        self.upload_empty_space(queue);
        resources::write_box(queue, &self.occlusion_texture, [0; 3], self.occlusion.dims(), self.occlusion.means());
        self.upload_colours(queue);
    }

    fn upload_colours(&self, queue: &wgpu::Queue) {
        let texels = self.colours.texels().as_flattened();
        resources::write_box(queue, &self.colour_texture, [0; 3], self.colours.dims(), texels);
    }

    fn upload_empty_space(&self, queue: &wgpu::Queue) {
        let entries = self.empty_space.entries().as_flattened();
        resources::write_box(queue, &self.empty_texture, [0; 3], self.empty_space.dims(), entries);
    }

    /// True when these textures can be updated with a volume's changes.
    pub fn fits(&self, tooth: &VolumeInstance) -> bool {
        self.dims == tooth.volume.grid().dims && tooth.changes != Changes::All
    }

    /// Uploads changed bricks and applies the render mode. Returns the number of uploaded bricks.
    pub fn update(&mut self, queue: &wgpu::Queue, tooth: &VolumeInstance) -> usize {
        let Changes::Bricks(changed) = tooth.changes else { return 0 };
        for &brick in changed {
            let corner = tooth.volume.bricks().corner(brick);
            let size = std::array::from_fn(|a| BRICK.min(self.dims[a] - corner[a]));
            resources::write_box(queue, &self.voxels, corner, size, &interleaved(tooth.volume, corner, size));
        }
        if !changed.is_empty() {
            self.bounds = extended_bounds(self.bounds, tooth.volume, changed);
        }
        let differing = self.empty_space.update(tooth.volume, changed);
        if self.empty_space.set_mode(&tooth.mode) {
            self.upload_empty_space(queue);
        } else {
            for brick in differing {
                let place = tooth.volume.bricks().corner(brick).map(|c| c / BRICK);
                let entry = &self.empty_space.entries()[brick];
                resources::write_box(queue, &self.empty_texture, place, [1; 3], entry);
            }
        }
        for cube in self.occlusion.update(tooth.volume, changed) {
            let place = self.occlusion.cube_at(cube);
            resources::write_box(queue, &self.occlusion_texture, place, [1; 3], &self.occlusion.means()[cube..=cube]);
        }
        self.update_colours(queue, tooth, changed);
        changed.len()
    }

    fn update_colours(&mut self, queue: &wgpu::Queue, tooth: &VolumeInstance, changed: &[usize]) {
        if !self.colours.has_palette(tooth.palette) {
            self.colours = SurfaceColours::new(tooth);
            return self.upload_colours(queue);
        }
        for brick in self.colours.update(tooth, changed) {
            let (first, size) = self.colours.block(tooth.volume, brick);
            let texels = self.colours.texels_of((first, size));
            resources::write_box(queue, &self.colour_texture, first, size, &texels);
        }
    }

    /// Writes the pose and the appearance of the tooth for this image.
    pub fn write_uniform(&mut self, queue: &wgpu::Queue, tooth: &VolumeInstance) {
        let (mut light, mut is_radiograph) = (0.0, 0.0);
        if let RenderMode::Volume(function) = &tooth.mode {
            light = function.shading;
            is_radiograph = if function.is_radiograph { 1.0 } else { 0.0 };
            let is_known = self.function.as_ref().is_some_and(|known| **known == **function);
            if !is_known {
                let tables = function.per_step(integration_step(tooth.volume));
                let rows: Vec<u8> = tables.iter().flatten().flatten().copied().collect();
                resources::write_table(queue, &self.transfer_texture, [256, 256], &rows);
                self.function = Some(function.clone());
            }
        }
        let grid = tooth.volume.grid();
        let edge = self.occlusion.cube_voxels() as f32;
        let Aabb { low, high } = self.bounds;
        let uniform = gpu::ToothUniform {
            world_from_voxel: resources::columns(tooth.world_from_tooth, grid.spacing, grid.origin),
            voxel_from_world: voxel_from_world(tooth),
            world_from_tooth: resources::columns(tooth.world_from_tooth, Vec3::ONE, Vec3::ZERO),
            dims: Vec3::from(grid.dims.map(|n| n as f32)).extend(edge).to_array(),
            low: low.extend(integration_step(tooth.volume)).to_array(),
            high: high.extend(light).to_array(),
            spacing: grid.spacing.extend(is_radiograph).to_array(),
            cells: [self.colours.cell_voxels() as f32, 0.0, 0.0, 0.0],
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }
}

fn voxel_from_world(tooth: &VolumeInstance) -> [[f32; 4]; 4] {
    let grid = tooth.volume.grid();
    let Pose { position, orientation } = tooth.world_from_tooth.inverse();
    let column = |axis: Vec3| (orientation * axis / grid.spacing).extend(0.0).to_array();
    let last = ((position - grid.origin) / grid.spacing).extend(1.0).to_array();
    [column(Vec3::X), column(Vec3::Y), column(Vec3::Z), last]
}

/// Returns the box of matter, extended by changed bricks with matter outside it: a restoration may be placed there.
fn extended_bounds(bounds: Aabb, volume: &Volume, changed: &[usize]) -> Aabb {
    let occupied = changed
        .iter()
        .map(|&b| volume.bricks().corner(b))
        .filter(|c| volume.bricks().is_occupied(c.map(|v| v / BRICK)));
    occupied.fold(bounds, |bounds, corner| {
        let first = Vec3::from(corner.map(|v| v as f32));
        let last =
            Vec3::from(std::array::from_fn::<f32, 3, _>(|a| (corner[a] + BRICK).min(volume.grid().dims[a]) as f32));
        bounds.union(Aabb::new(first - 1.0, last))
    })
}

/// Returns density and label of each voxel of a box, x fastest.
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
