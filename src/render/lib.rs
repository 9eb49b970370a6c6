//! Renders the carved tooth and its surroundings, in mono or stereo.
//!
//! Takes a plain [`RenderScene`] and a [`Viewpoint`]. Gives pixels: [`Renderer`] draws into the target of a window, and
//! [`OffscreenRenderer`] returns images without a window, from a GPU or from the CPU ([`cpu`]) with the same formulas.
//! Never knows a scenario, a simulation, the name of a tissue or a clock.
//!
//! An image without a window:
//!
//! ```
//! use typodont_core::frame::Vec3;
//! use typodont_render::{OffscreenRenderer, Orbit, RenderScene};
//!
//! let viewpoint = Orbit::around(Vec3::ZERO, 15.0).viewpoint();
//! let image = OffscreenRenderer::cpu().draw(&RenderScene::empty(), &viewpoint, None, [64, 48])?;
//! assert_eq!((image.width, image.height), (64, 48));
//! # Ok::<(), typodont_render::RenderError>(())
//! ```
//!
//! In a window, each frame (feature `gpu`):
//!
//! ```no_run
//! # #[cfg(feature = "gpu")]
//! # mod window {
//! # use typodont_core::frame::{Pose, Vec3};
//! # use typodont_core::volume::Volume;
//! # use typodont_render::*;
//! # fn frame(
//! #     renderer: &mut Renderer,
//! #     volume: &mut Volume,
//! #     palette: &LabelPalette,
//! #     target: RenderTarget,
//! # ) -> Result<(), RenderError> {
//! // Once: `Renderer::new(&device, &queue, format)`, and `DeviceErrorListener::attach(&device)` to detect device loss.
//! let changed = volume.take_dirty();
//! let scene = RenderScene {
//!     tooth: Some(VolumeInstance {
//!         volume,
//!         changes: Changes::Bricks(&changed),
//!         world_from_tooth: Pose::IDENTITY,
//!         palette,
//!         unworked_tooth: None,
//!         mode: RenderMode::Iso,
//!     }),
//!     ..RenderScene::empty()
//! };
//! let orbit = Orbit::around(Vec3::ZERO, 15.0);
//! renderer.draw(&scene, &orbit.viewpoint(), None, target)?;
//! # Ok(())
//! # }
//! # }
//! ```

#[cfg(feature = "gpu")]
mod brick_surfaces;
mod camera;
mod drawn_volume;
mod empty_space;
mod enamel_colours;
mod error;
mod eye;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "gpu")]
mod gpu_offscreen;
mod ambient_occlusion;
#[cfg(feature = "gpu")]
mod iso_pass;
mod lens;
#[cfg(feature = "gpu")]
mod lens_pass;
#[cfg(feature = "gpu")]
mod mesh_parts;
mod mirror;
#[cfg(feature = "gpu")]
mod mirror_pass;
mod offscreen;
mod relief;
#[cfg(feature = "gpu")]
mod passes;
#[cfg(feature = "gpu")]
mod renderer;
#[cfg(feature = "gpu")]
mod resources;
mod scene;
mod shading;
#[cfg(feature = "gpu")]
mod fxaa_pass;
#[cfg(feature = "gpu")]
mod particle_pass;
mod shadow;
#[cfg(feature = "gpu")]
mod shadow_pass;
mod stereo;
#[cfg(feature = "gpu")]
mod stereo_pass;
mod surface_mesh;
mod surface_colours;
#[cfg(feature = "gpu")]
mod surface_pass;
#[cfg(feature = "gpu")]
mod tooth;
pub mod transfer_function;
mod unworked_tooth;
mod vertex;
#[cfg(feature = "gpu")]
mod view;
#[cfg(feature = "gpu")]
mod volume_pass;
pub mod cpu;

pub use camera::{Orbit, Quadrant, Viewpoint};
pub use error::RenderError;
pub use eye::{Eye, FrustumWindow};
#[cfg(feature = "gpu")]
pub use gpu::{DeviceErrorListener, Gpu};
#[cfg(feature = "gpu")]
pub use gpu_offscreen::GpuOffscreenRenderer;
pub use mirror::PlaneMirror;
pub use offscreen::OffscreenRenderer;
pub use relief::{ENAMEL_GLOSS, GROUND_GLOSS, SeenPlace, tooth_in_relief};
#[cfg(feature = "gpu")]
pub use renderer::{RenderTarget, Renderer};
pub use scene::{
    Appearance, Background, Changes, LabelPalette, Lamp, Lens, Lights, MeshInstance, Particle, RenderMode, RenderScene,
    Rgb, ShadowRegion, VertexTint, VolumeInstance,
};
pub use shading::LitPoint;
pub use stereo::{Stereo, StereoLayout};
pub use surface_colours::SurfaceColours;
#[cfg(feature = "gpu")]
pub use tooth::Uploads;
pub use transfer_function::{TransferFunction, TransferTable};
pub use typodont_core::image::RgbaImage;
pub use unworked_tooth::UnworkedTooth;

use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{BRICK, CellBox, Volume};

/// The WGSL source of a shader, and the structs that it shares with Rust: name in WGSL and size in bytes.
#[cfg(feature = "gpu")]
pub struct Shader {
    pub name: &'static str,
    pub source: String,
    pub structs: Vec<(&'static str, usize)>,
}

/// Returns all shaders.
#[cfg(feature = "gpu")]
pub fn shaders() -> Vec<Shader> {
    let shared = [
        ("Lamp", size_of::<view::gpu::LampUniform>()),
        ("Shadow", size_of::<view::gpu::ShadowUniform>()),
        ("View", size_of::<view::gpu::ViewUniform>()),
        ("Tooth", size_of::<tooth::gpu::ToothUniform>()),
    ];
    let shader = |name, own: &str, structs: &[(&'static str, usize)]| Shader {
        name,
        source: passes::full_source(own),
        structs: [&shared, structs].concat(),
    };
    vec![
        shader("surface_pass", surface_pass::SOURCE, &[("Solid", size_of::<surface_pass::gpu::SolidUniform>())]),
        shader("iso_pass", iso_pass::SOURCE, &[]),
        shader("volume_pass", volume_pass::SOURCE, &[]),
        shader("particle_pass", particle_pass::SOURCE, &[("Speck", size_of::<particle_pass::gpu::ParticleInstance>())]),
        shader("fxaa_pass", fxaa_pass::SOURCE, &[]),
        shader("lens_pass", lens::SOURCE, &[("Lens", size_of::<lens_pass::gpu::LensUniform>())]),
        shader("mirror_pass", mirror_pass::SOURCE, &[("Mirror", size_of::<mirror_pass::gpu::MirrorUniform>())]),
        Shader {
            name: "stereo_pass",
            source: stereo_pass::SOURCE.to_string(),
            structs: vec![("Pair", size_of::<stereo_pass::gpu::StereoUniform>())],
        },
    ]
}

/// Returns the box in which rays are traced, in voxel coordinates: whole bricks around all matter. Because the box is
/// aligned to bricks, a ray enters a brick at the same point and takes the same steps whatever was cut elsewhere.
fn bounds_of_matter(volume: &Volume) -> Aabb {
    let Some(CellBox { low, high }) = volume.bounding_box() else { return Aabb::default() };
    let first = low.map(|v| v.saturating_sub(1) / BRICK * BRICK);
    // Interpolation extends matter at the border by one voxel beyond the grid.
    let low = first.map(|v| if v == 0 { -1.0 } else { v as f32 });
    let last = std::array::from_fn(|a| ((high[a] / BRICK + 1) * BRICK).min(volume.grid().dims[a]) as f32);
    Aabb::new(Vec3::from(low), Vec3::from(last))
}

/// Returns the integration step of direct volume rendering, mm: the smallest voxel spacing, so that no voxel is
/// skipped.
fn integration_step(volume: &Volume) -> f32 {
    volume.grid().spacing.min_element()
}

/// Returns [`RenderError::Impossible`] if no image can be rendered; `limit` is the maximum width and height, pixels.
fn validate(
    scene: &RenderScene,
    viewpoint: &Viewpoint,
    stereo: Option<Stereo>,
    [width, height]: [u32; 2],
    limit: u32,
) -> Result<(), RenderError> {
    let impossible = |why: String| Err(RenderError::Impossible { why });
    if width == 0 || height == 0 || width > limit || height > limit {
        return impossible(format!("image size {width}x{height} is out of range: 1 to {limit} pixels each way"));
    }
    if !viewpoint.is_valid() {
        return impossible(format!("invalid viewpoint: {viewpoint:?}"));
    }
    if let Some(Stereo { eye_distance, .. }) = stereo.filter(|s| !(-80.0..=80.0).contains(&s.eye_distance)) {
        return impossible(format!("eye distance {eye_distance} mm is out of range: -80 to 80 mm"));
    }
    if scene.tooth.as_ref().is_some_and(|tooth| !tooth.world_from_tooth.is_valid()) {
        return impossible("invalid pose of the tooth".into());
    }
    if scene.shadows.is_some_and(|region| !region.is_valid()) {
        return impossible(format!("invalid region of shadows: {:?}", scene.shadows));
    }
    if scene.lens.is_some_and(|lens| !lens.is_valid()) {
        return impossible(format!("invalid lens: {:?}", scene.lens));
    }
    if scene.mirror.is_some_and(|mirror| !mirror.is_valid()) {
        return impossible(format!("invalid mirror: {:?}", scene.mirror));
    }
    if let Some(particle) =
        scene.opaque_particles.iter().chain(scene.translucent_particles).find(|particle| !particle.is_valid())
    {
        return impossible(format!("invalid particle: {particle:?}"));
    }
    match scene.solids.iter().position(|solid| !solid.world_from_solid.is_valid()) {
        Some(index) => impossible(format!("invalid pose of mesh instance {index}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod phantom {
    //! Test volumes.
    use typodont_core::frame::Vec3;
    use typodont_core::volume::{Grid, Label, Volume};

    pub fn ball(dims: [u32; 3], spacing: Vec3, radius: f32) -> Volume {
        let grid = Grid::centred(dims, spacing);
        let band = 2.0 * spacing.max_element();
        Volume::from_distance(grid, band, |p| (p.length() - radius, Label(1)))
    }
}
