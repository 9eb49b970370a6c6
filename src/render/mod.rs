//! The picture: a tooth as it is carved, in a scene of solids, for one eye or two.
//!
//! Takes a plain [`Scene`] and a [`Viewpoint`]. Gives pixels: [`Renderer`] draws into a window's target, [`Painter`] makes a
//! picture without a window, on an adapter or by the processor ([`twin`]), with the same formulas. Never knows a scenario, a
//! simulation, a tissue's name or a clock.
//!
//! In a window, each frame:
//!
//! ```no_run
//! # use typodont::frame::{Pose, Vec3};
//! # use typodont::render::*;
//! # use typodont::volume::Volume;
//! # fn frame(renderer: &mut Renderer, volume: &mut Volume, palette: &Palette, target: Target) -> Result<(), Error> {
//! // Once: `Renderer::new(&device, &queue, format)`, and `Watch::over(&device)` to hear when the device is lost.
//! let changed = volume.take_dirty();
//! let scene = Scene {
//!     tooth: Some(Tooth {
//!         volume,
//!         changes: Changes::Bricks(&changed),
//!         world_from_tooth: Pose::IDENTITY,
//!         palette,
//!         shown: Shown::Iso,
//!     }),
//!     ..Scene::empty()
//! };
//! let orbit = Orbit::around(Vec3::ZERO, 15.0);
//! renderer.draw(&scene, &orbit.viewpoint(), None, target)?;
//! # Ok(())
//! # }
//! ```

mod brick_surfaces;
mod camera;
mod coarse;
mod empty;
mod eye;
mod gpu;
mod hollow;
mod iso_pass;
mod mirror;
mod mirror_pass;
mod painter;
mod passes;
mod picture;
mod renderer;
mod resources;
mod scene;
mod smooth_pass;
mod speck_pass;
mod stereo;
mod stereo_pass;
mod surface_mesh;
mod surface_pass;
mod tooth;
pub mod transfer;
mod vertex;
mod view;
mod volume_pass;
pub mod twin;

pub use camera::{Orbit, Quadrant, Viewpoint};
pub use eye::{Eye, Window};
pub use gpu::{Error, Gpu, Watch};
pub use mirror::Mirror;
pub use painter::{GpuPainter, Painter};
pub use picture::Image;
pub use renderer::{Renderer, Target};
pub use scene::{Background, Changes, Finish, Lamp, Lights, Palette, Rgb, Scene, Shown, Solid, Speck, Tooth};
pub use stereo::{Layout, Stereo};
pub use tooth::Uploads;
pub use transfer::{Table, TransferFunction};

use crate::frame::Vec3;
use crate::volume::{BRICK, Volume};

/// A shader as adapters get it, and the structs that it shares with the program: name and size in bytes.
pub struct Shader {
    pub name: &'static str,
    pub source: String,
    pub structs: Vec<(&'static str, usize)>,
}

/// Every shader there is.
pub fn shaders() -> Vec<Shader> {
    let shared = [
        ("Lamp", size_of::<view::gpu::Lamp>()),
        ("View", size_of::<view::gpu::View>()),
        ("Tooth", size_of::<tooth::gpu::Tooth>()),
    ];
    let shader = |name, own: &str, structs: &[(&'static str, usize)]| Shader {
        name,
        source: passes::source(own),
        structs: [&shared, structs].concat(),
    };
    vec![
        shader("surface_pass", surface_pass::SOURCE, &[("Solid", size_of::<surface_pass::gpu::Solid>())]),
        shader("iso_pass", iso_pass::SOURCE, &[]),
        shader("volume_pass", volume_pass::SOURCE, &[]),
        shader("speck_pass", speck_pass::SOURCE, &[("Speck", size_of::<speck_pass::gpu::Speck>())]),
        shader("smooth_pass", smooth_pass::SOURCE, &[]),
        shader("mirror_pass", mirror_pass::SOURCE, &[("Mirror", size_of::<mirror_pass::gpu::Mirror>())]),
        Shader {
            name: "stereo_pass",
            source: stereo_pass::SOURCE.to_string(),
            structs: vec![("Pair", size_of::<stereo_pass::gpu::Pair>())],
        },
    ]
}

/// The box that rays are followed in, in voxel steps: whole bricks around all matter. A ray so meets a brick at the same
/// place, and its steps fall alike, whatever was cut elsewhere.
fn matter_box(volume: &Volume) -> [Vec3; 2] {
    let Some([low, high]) = volume.tight_box() else { return [Vec3::ZERO, Vec3::ZERO] };
    let first = low.map(|v| v.saturating_sub(1) / BRICK * BRICK);
    // Interpolation spreads matter at the border one step beyond the grid.
    let low = first.map(|v| if v == 0 { -1.0 } else { v as f32 });
    let last = std::array::from_fn(|a| ((high[a] / BRICK + 1) * BRICK).min(volume.grid().dims[a]) as f32);
    [Vec3::from(low), Vec3::from(last)]
}

/// Length of a step of blending, mm: a voxel's least spacing, so that none is passed over.
fn blending_step(volume: &Volume) -> f32 {
    volume.grid().spacing.min_element()
}

/// Complains about pictures that cannot be made.
fn sound(
    scene: &Scene,
    viewpoint: &Viewpoint,
    stereo: Option<Stereo>,
    [width, height]: [u32; 2],
    limit: u32,
) -> Result<(), Error> {
    let impossible = |why: String| Err(Error::Impossible { why });
    if width == 0 || height == 0 || width > limit || height > limit {
        return impossible(format!("a picture of {width}x{height} pixels; 1 to {limit} are possible each way"));
    }
    if !viewpoint.is_sound() {
        return impossible(format!("the viewpoint has numbers that make no picture: {viewpoint:?}"));
    }
    if let Some(Stereo { eye_distance, .. }) = stereo.filter(|s| !(0.0..=80.0).contains(&s.eye_distance)) {
        return impossible(format!("eyes {eye_distance} mm apart; 0 to 80 are possible"));
    }
    if scene.tooth.as_ref().is_some_and(|tooth| !tooth.world_from_tooth.is_sound()) {
        return impossible("the tooth's pose has numbers that are none".into());
    }
    if scene.mirror.is_some_and(|mirror| !mirror.is_sound()) {
        return impossible(format!("the mirror has numbers that make no picture: {:?}", scene.mirror));
    }
    if let Some(speck) = scene.grains.iter().chain(scene.drops).find(|speck| !speck.is_sound()) {
        return impossible(format!("a speck has numbers that make no picture: {speck:?}"));
    }
    match scene.solids.iter().position(|solid| !solid.world_from_solid.is_sound()) {
        Some(place) => impossible(format!("the pose of solid {place} has numbers that are none")),
        None => Ok(()),
    }
}
