//! Measurements of pictures: of a tooth alone in a small window, and of a whole exercise on a large stereo screen.

use super::percentiles::{Percentiles, time_up_to};
use super::volumes;
use serde::Serialize;
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::volume::Volume;
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_render::{
    Appearance, Changes, Lamp, Lights, MeshInstance, OffscreenRenderer, Orbit, Particle, RenderMode, RenderScene,
    ShadowRegion, Stereo, StereoLayout, TransferFunction, VolumeInstance,
};
use typodont_scene::{self as scene, Mouth};

/// Time to render an image of 780×690 pixels, in each display mode, ms.
#[derive(Serialize)]
pub struct FrameTimings {
    /// Renderer: the name of a graphics adapter, or `cpu`.
    pub adapter: String,
    pub surface: Percentiles,
    /// The surface with smoothed edges.
    pub surface_smooth: Percentiles,
    /// The surface with the maximum amount of dust and water.
    pub surface_specks: Percentiles,
    pub iso: Percentiles,
    pub volume: Percentiles,
}

/// Time to render both eyes' images of a whole exercise, of 3840×2160 pixels each, with smoothed edges, in each display
/// mode, ms.
#[derive(Serialize)]
pub struct StereoTimings {
    /// Renderer: the name of a graphics adapter, or `cpu`.
    pub adapter: String,
    pub surface: Percentiles,
    /// With shadows of the lamp.
    pub surface_shadows: Percentiles,
    pub iso: Percentiles,
    /// With shadows of the lamp.
    pub iso_shadows: Percentiles,
    pub volume: Percentiles,
}

/// Size of the small window, pixels: that of the thesis this program began with.
const WINDOW: [u32; 2] = [780, 690];

/// Size of the large screen, pixels.
const SCREEN: [u32; 2] = [3840, 2160];

/// Each eye's image has all pixels of the screen; then every second row of each is shown. The distance of the eyes, mm, suits
/// a mouth that is larger than life.
const BOTH_EYES: Stereo = Stereo { layout: StereoLayout::Rows, eye_distance: 10.0 };

/// Maximum number of images that are measured.
const WINDOW_IMAGES: usize = 9;
const SCREEN_IMAGES: usize = 180;

/// Camera step between two images, rad: 40°, so that nine images make one turn around the tooth.
const STEP_AROUND: f32 = 0.698;

/// Measures images of a tooth alone.
pub fn measure_tooth(tooth: &Volume) -> Result<FrameTimings, String> {
    let (mut painter, _) = OffscreenRenderer::gpu_or_cpu();
    let palette = volumes::palette()?;
    let function = Arc::new(TransferFunction::tissue(&palette));
    let grid = tooth.grid();
    let bounds = grid.extent_of(&tooth.bounding_box().unwrap_or_default());
    let upright = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) };
    let middle = upright * bounds.centre();
    let orbit = Orbit::around(middle, bounds.half_size().length());
    let (grains, drops) = (particle_ball(middle, 2000, 1.0), particle_ball(middle, 800, 0.3));
    let mut times = |mode: RenderMode, is_antialiased: bool, [grains, drops]: [&[Particle]; 2]| {
        let mut turn = TurningView { painter: &mut painter, orbit, stereo: None, size: WINDOW };
        turn.time(WINDOW_IMAGES, |changes, _| RenderScene {
            tooth: Some(VolumeInstance {
                volume: tooth,
                changes,
                world_from_tooth: upright,
                palette: &palette,
                unworked_tooth: None,
                mode: mode.clone(),
            }),
            is_antialiased,
            opaque_particles: grains,
            translucent_particles: drops,
            ..RenderScene::empty()
        })
    };
    let surface = times(RenderMode::Surface, false, [&[]; 2])?;
    let iso = times(RenderMode::Iso, false, [&[]; 2])?;
    let volume = times(RenderMode::Volume(function), false, [&[]; 2])?;
    let surface_smooth = times(RenderMode::Surface, true, [&[]; 2])?;
    let surface_specks = times(RenderMode::Surface, false, [&grains, &drops])?;
    let adapter = painter.adapter().to_string();
    Ok(FrameTimings { adapter, surface, surface_smooth, surface_specks, iso, volume })
}

/// Measures images of an exercise in its mouth.
pub fn measure_exercise(scenario: &Scenario, workpiece: &Workpiece) -> Result<StereoTimings, String> {
    let (mut painter, _) = OffscreenRenderer::gpu_or_cpu();
    let palette = scene::tissue_palette(&scenario.tissues, true);
    let unworked_tooth = scene::unworked_tooth(workpiece, &scenario.tissues);
    let function = Arc::new(TransferFunction::tissue(&palette));
    let solids: Vec<MeshInstance> = match Mouth::around(workpiece, &scenario.tissues) {
        Some(mouth) => mouth.solids(scene::WORKING_OPENING_DEG),
        None => scene::surrounding_solids(workpiece, &scenario.tissues),
    };
    let orbit = scene::work_view(workpiece);
    let mut times = |mode: RenderMode, shadows: Option<ShadowRegion>| {
        let mut turn = TurningView { painter: &mut painter, orbit, stereo: Some(BOTH_EYES), size: SCREEN };
        turn.time(SCREEN_IMAGES, |changes, eye| RenderScene {
            tooth: Some(VolumeInstance {
                volume: &workpiece.volume,
                changes,
                world_from_tooth: workpiece.world_from_tooth,
                palette: &palette,
                unworked_tooth: Some(&unworked_tooth),
                mode: mode.clone(),
            }),
            solids: solids.clone(),
            lights: Lights { chair: Lamp::chair_toward(eye, orbit.middle), head: Lamp::head(eye), ..Lights::default() },
            shadows,
            relief_seed: shadows.map(|_| scene::relief_seed(scenario)),
            is_antialiased: true,
            ..RenderScene::empty()
        })
    };
    let shadows = Some(scene::shadow_region(workpiece, &orbit));
    let surface = times(RenderMode::Surface, None)?;
    let surface_shadows = times(RenderMode::Surface, shadows)?;
    let iso = times(RenderMode::Iso, None)?;
    let iso_shadows = times(RenderMode::Iso, shadows)?;
    let volume = times(RenderMode::Volume(function), None)?;
    Ok(StereoTimings { adapter: painter.adapter().to_string(), surface, surface_shadows, iso, iso_shadows, volume })
}

/// Images of a scene whose camera turns around its middle.
struct TurningView<'a> {
    painter: &'a mut OffscreenRenderer,
    orbit: Orbit,
    stereo: Option<Stereo>,
    size: [u32; 2],
}

impl TurningView<'_> {
    /// Measures up to `count` images, ms each, of the scene for changes of its volume and a position of the camera (world
    /// space, mm).
    fn time<'s>(
        &mut self,
        count: usize,
        scene: impl Fn(Changes<'static>, Vec3) -> RenderScene<'s>,
    ) -> Result<Percentiles, String> {
        let mut view = self.orbit;
        let mut failed = None;
        // Shaders are compiled with the first image; the times of the following ones are those a trainee experiences.
        let mut changes = Changes::All;
        let mut image = || {
            let viewpoint = view.viewpoint();
            let drawn = self.painter.draw_only(&scene(changes, viewpoint.position), &viewpoint, self.stereo, self.size);
            failed = drawn.err().or(failed.take());
            changes = Changes::Bricks(&[]);
            view = view.rotated(STEP_AROUND, 0.0);
        };
        image();
        let times = time_up_to(count, 1e3, image);
        failed.map_or(Ok(times), |error| Err(error.to_string()))
    }
}

/// Particles of 0.1 mm, spread evenly over a ball of 9 mm by a Fibonacci lattice, the farthest first.
fn particle_ball(middle: Vec3, count: usize, opacity: f32) -> Vec<Particle> {
    let finish = Appearance { colour: [0.9; 3], gloss: 0.1 };
    let speck = |i: usize| {
        let height = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
        let (ring, angle) = ((1.0 - height * height).max(0.0).sqrt(), 2.399_963 * i as f32);
        let place = middle + 9.0 * Vec3::new(ring * libm::cosf(angle), ring * libm::sinf(angle), -height);
        Particle { position: place, radius: 0.1, facing: None, appearance: finish, opacity }
    };
    (0..count).map(speck).collect()
}
