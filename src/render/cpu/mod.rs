//! CPU twins of all passes, with the same names and formulas.
//!
//! Takes a scene and an eye. Gives the picture that the shaders give, for machines without a graphics adapter and for
//! tests that compare both. Never reads a clock, a file or an adapter.

mod iso_pass;
mod volume_sampler;
mod mirror_pass;
mod raster;
mod fxaa_pass;
mod lens_pass;
mod particle_pass;
mod shadow_pass;
mod stereo_pass;
mod surface_pass;
mod texture_reads;
mod volume_pass;

pub use stereo_pass::stereo_pass;

use super::drawn_volume::DrawnVolume;
use super::eye::Eye;
use super::lens::LensView;
use super::mirror::{self, PlaneMirror};
use super::relief::Relief;
use super::scene::{Appearance, Background, Changes, Lights, RenderMode, RenderScene, Rgb, VolumeInstance};
use super::shading::LitPoint;
use super::surface_colours::SurfaceColours;
use super::{ambient_occlusion::OcclusionVolume, empty_space::EmptySpaceMap};
use shadow_pass::LampDepths;
use std::sync::{Arc, OnceLock};
use surface_pass::SurfaceTriangles;
use texture_reads::TextureReads;
use typodont_core::frame::Vec3;
use typodont_core::image::RgbaImage;
use typodont_core::parallel::{available_threads, par_rows};
use volume_sampler::VolumeSampler;

/// CPU renderer, with the data that it keeps between pictures of the same volume.
#[derive(Default)]
pub struct CpuRenderer {
    cached: Option<CachedVolume>,
    reads: Arc<TextureReads>,
}

struct CachedVolume {
    drawn: DrawnVolume,
    empty_space: EmptySpaceMap,
    occlusion: OcclusionVolume,
    colours: SurfaceColours,
    /// Computed when they are drawn for the first time.
    surface: OnceLock<SurfaceTriangles>,
    reads: Arc<TextureReads>,
}

impl CachedVolume {
    fn new(tooth: &VolumeInstance, reads: &Arc<TextureReads>) -> CachedVolume {
        let drawn = DrawnVolume::new(tooth.volume, 1);
        let volume = &drawn.volume;
        CachedVolume {
            empty_space: EmptySpaceMap::new(volume, &tooth.mode),
            occlusion: OcclusionVolume::new(volume),
            colours: SurfaceColours::new(&VolumeInstance { volume, ..tooth.clone() }),
            surface: OnceLock::new(),
            reads: reads.clone(),
            drawn,
        }
    }

    fn surface(&self, tooth: &VolumeInstance) -> &SurfaceTriangles {
        self.surface.get_or_init(|| SurfaceTriangles::extract(tooth.volume, &self.drawn.volume))
    }

    fn update(&mut self, tooth: &VolumeInstance, changed: &[usize]) {
        // Triangles lie on the volume itself, also where smoothing hides a change.
        if !changed.is_empty() {
            self.surface = OnceLock::new();
        }
        let changed = &self.drawn.update(tooth.volume, changed)[..];
        let tooth = &VolumeInstance { volume: &self.drawn.volume, ..tooth.clone() };
        let VolumeInstance { volume, mode, palette, .. } = tooth;
        self.empty_space.set_mode(mode);
        self.empty_space.update(volume, changed);
        self.occlusion.update(volume, changed);
        if self.colours.has_palette(palette) {
            self.colours.update(tooth, changed);
        } else {
            self.colours = SurfaceColours::new(tooth);
        }
    }
}

impl CpuRenderer {
    /// Applies the changes of the scene's tooth. Must be called once before the scene is drawn, for any number of eyes.
    pub fn prepare(&mut self, scene: &RenderScene) {
        let Some(tooth) = &scene.tooth else { return };
        match (&mut self.cached, tooth.changes) {
            (Some(known), Changes::Bricks(changed)) if known.drawn.matches(tooth.volume, 1) => {
                known.update(tooth, changed);
            }
            _ => self.cached = Some(CachedVolume::new(tooth, &self.reads)),
        }
    }

    /// The scene through one eye.
    pub fn draw(&self, scene: &RenderScene, eye: &Eye, [width, height]: [u32; 2]) -> RgbaImage {
        let shadows = LampDepths::draw(scene, self.cached.as_ref(), &self.reads).map(Arc::new);
        let mirrored = scene.mirror.as_ref().and_then(|mirror| Some((mirror, mirror.reflected_eye(eye)?)));
        let reflected = mirrored.map(|(mirror, image)| {
            let size = [mirror::PICTURE_SIZE; 2];
            let seen = self.draw_scene(&mirror.with_reflected_light(scene), None, &shadows, &image, size);
            (mirror, seen.to_image())
        });
        let sharp = self.draw_scene(
            scene,
            reflected.as_ref().map(|(mirror, seen)| (*mirror, seen)),
            &shadows,
            eye,
            [width, height],
        );
        let drawn = match scene.drawn_lens() {
            Some(lens) => lens_pass::lens_pass(&sharp, eye, &LensView::new(lens, eye, [width, height]), &self.reads),
            None => sharp.to_image(),
        };
        if scene.is_antialiased { fxaa_pass::fxaa_pass(&drawn, &self.reads) } else { drawn }
    }

    /// Draws the whole scene through one eye; a mirror shows the picture that is passed with it.
    fn draw_scene(
        &self,
        scene: &RenderScene,
        mirror: Option<(&PlaneMirror, &RgbaImage)>,
        shadows: &Option<Arc<LampDepths>>,
        eye: &Eye,
        [width, height]: [u32; 2],
    ) -> Framebuffer {
        let relief = scene.relief_seed.map(|seed| Relief::seen_by(eye, width, seed));
        let view = CpuView { eye: *eye, lights: scene.lights, width, height, shadows: shadows.clone(), relief };
        let mut framebuffer = Framebuffer::with_background(&scene.background, width, height);
        for solid in &scene.solids {
            surface_pass::solid(solid, &view, &mut framebuffer);
        }
        particle_pass::opaque(scene.opaque_particles, &view, &mut framebuffer);
        if let Some((mirror, reflected)) = mirror {
            mirror_pass::mirror_pass(mirror, reflected, &view, &mut framebuffer);
        }
        if let (Some(tooth), Some(known)) = (&scene.tooth, &self.cached) {
            let sampler = VolumeSampler::new(tooth, known);
            match &tooth.mode {
                RenderMode::Surface => {
                    surface_pass::tooth(known.surface(tooth), &sampler, &view, &mut framebuffer);
                }
                RenderMode::Iso => iso_pass::iso_pass(&sampler, &view, &mut framebuffer),
                RenderMode::Volume(function) => volume_pass::volume_pass(&sampler, function, &view, &mut framebuffer),
            }
        }
        particle_pass::translucent(scene.translucent_particles, &view, &mut framebuffer);
        framebuffer
    }
}

/// One eye, the lamps, the picture's size in pixels, and what the chair lamp sees.
struct CpuView {
    eye: Eye,
    lights: Lights,
    width: u32,
    height: u32,
    shadows: Option<Arc<LampDepths>>,
    relief: Option<Relief>,
}

impl CpuView {
    /// Ray through a pixel, per mm of depth; world space.
    fn ray(&self, x: f32, y: f32) -> Vec3 {
        self.eye.ray(x / self.width as f32, y / self.height as f32)
    }

    /// Shaded colour of a surface at a point of world space with a unit normal; `open` is the share of light that
    /// reaches it.
    fn shade(&self, finish: Appearance, open: f32, point: Vec3, normal: Vec3) -> Rgb {
        let to_eye = (self.eye.position - point).normalize_or_zero();
        self.lights.shade(finish, LitPoint { point, normal, to_eye, open }, || {
            self.shadows.as_ref().map_or(1.0, |map| map.lamp_share(point, normal))
        })
    }
}

/// Colours with the depth buffer's values.
struct Framebuffer {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
}

#[derive(Clone, Copy)]
struct Pixel {
    colour: Rgb,
    depth: f32,
}

/// Noise of one step of a screen's brightness, against bands where a colour changes slowly (Roberts's R2 sequence, 2018).
fn dither(x: u32, y: u32) -> f32 {
    (((x as f32 + 0.5) * 0.754_877_7 + (y as f32 + 0.5) * 0.569_840_3).fract() - 0.5) / 255.0
}

impl Framebuffer {
    fn with_background(background: &Background, width: u32, height: u32) -> Framebuffer {
        let mut pixels = vec![Pixel { colour: background.middle, depth: 1.0 }; (width * height) as usize];
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let across = 2.0 * ((i as u32 % width) as f32 + 0.5) / width as f32 - 1.0;
            let down = 2.0 * ((i as u32 / width) as f32 + 0.5) / height as f32 - 1.0;
            let share = 0.5 * (across * across + down * down);
            let noise =
                if background.middle == background.edge { 0.0 } else { dither(i as u32 % width, i as u32 / width) };
            pixel.colour = std::array::from_fn(|c| {
                background.middle[c] + (background.edge[c] - background.middle[c]) * share + noise
            });
        }
        Framebuffer { width, height, pixels }
    }

    /// Asks for each pixel, given its middle (x right, y down).
    fn for_each_pixel(&mut self, paint: impl Fn(f32, f32, &mut Pixel) + Sync) {
        par_rows(&mut self.pixels, self.width, available_threads(), |y, row| {
            for (x, pixel) in row.iter_mut().enumerate() {
                paint(x as f32 + 0.5, y as f32 + 0.5, pixel);
            }
        });
    }

    fn to_image(&self) -> RgbaImage {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let rgba = self.pixels.iter().flat_map(|p| {
            let [r, g, b] = p.colour.map(byte);
            [r, g, b, u8::MAX]
        });
        RgbaImage { width: self.width, height: self.height, rgba: rgba.collect() }
    }
}
