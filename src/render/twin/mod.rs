//! Every pass once more, on the processor: the same names, the same formulas.
//!
//! Takes a scene and an eye. Gives the picture that the shaders give, where no adapter can run them and where a test asks
//! whether they do. Never looks at a clock, a file or an adapter.

mod iso_pass;
mod light;
mod matter;
mod mirror_pass;
mod raster;
mod smooth_pass;
mod speck_pass;
mod stereo_pass;
mod surface_pass;
mod volume_pass;

pub use matter::finish;
pub use stereo_pass::stereo_pass;

use super::eye::Eye;
use super::mirror::{self, Mirror};
use super::picture::Image;
use super::scene::{Background, Changes, Lights, Rgb, Scene, Shown, Tooth};
use super::{empty::Empty, hollow::Hollow};
use crate::volume::rows::{in_rows, processors};
use matter::Matter;

/// What the twin keeps between pictures of the same volume.
#[derive(Default)]
pub struct Twin {
    known: Option<Known>,
}

struct Known {
    dims: [u32; 3],
    empty: Empty,
    hollow: Hollow,
}

impl Twin {
    /// Takes over what changed in the scene's tooth. To be called once before the scene is drawn, for any number of eyes.
    pub fn prepare(&mut self, scene: &Scene) {
        let Some(tooth) = &scene.tooth else { return };
        let Tooth { volume, changes, shown, .. } = tooth;
        let dims = volume.grid().dims;
        match (&mut self.known, changes) {
            (Some(known), Changes::Bricks(changed)) if known.dims == dims => {
                known.empty.show(shown);
                known.empty.update(volume, changed);
                known.hollow.update(volume, changed);
            }
            _ => {
                self.known = Some(Known { dims, empty: Empty::of(volume, shown), hollow: Hollow::of(volume) });
            }
        }
    }

    /// The scene through one eye.
    pub fn draw(&self, scene: &Scene, eye: &Eye, [width, height]: [u32; 2]) -> Image {
        let seen = scene.mirror.as_ref().and_then(|mirror| Some((mirror, mirror.image_of(eye)?)));
        let reflected =
            seen.map(|(mirror, image)| (mirror, self.world(&mirror.lit(scene), None, &image, [mirror::PIXELS; 2])));
        let drawn = self.world(scene, reflected.as_ref().map(|(mirror, seen)| (*mirror, seen)), eye, [width, height]);
        if scene.is_smooth { smooth_pass::smooth_pass(&drawn) } else { drawn }
    }

    /// Everything through one eye; the mirror with what it shows.
    fn world(&self, scene: &Scene, mirror: Option<(&Mirror, &Image)>, eye: &Eye, [width, height]: [u32; 2]) -> Image {
        let sight = Sight { eye: *eye, lights: scene.lights, width, height };
        let mut canvas = Canvas::behind(&scene.background, width, height);
        for solid in &scene.solids {
            surface_pass::solid(solid, &sight, &mut canvas);
        }
        speck_pass::grains(scene.grains, &sight, &mut canvas);
        if let Some((mirror, reflected)) = mirror {
            mirror_pass::mirror_pass(mirror, reflected, &sight, &mut canvas);
        }
        if let (Some(tooth), Some(known)) = (&scene.tooth, &self.known) {
            let matter = Matter::new(tooth, &known.empty, &known.hollow);
            match &tooth.shown {
                Shown::Surface => surface_pass::tooth(&matter, &sight, &mut canvas),
                Shown::Iso => iso_pass::iso_pass(&matter, &sight, &mut canvas),
                Shown::Volume(function) => volume_pass::volume_pass(&matter, function, &sight, &mut canvas),
            }
        }
        speck_pass::drops(scene.drops, &sight, &mut canvas);
        canvas.image()
    }
}

/// One eye, the lamps, and the picture's size in pixels.
struct Sight {
    eye: Eye,
    lights: Lights,
    width: u32,
    height: u32,
}

/// Colours with the depth buffer's values.
struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
}

#[derive(Clone, Copy)]
struct Pixel {
    colour: Rgb,
    depth: f32,
}

impl Canvas {
    fn behind(background: &Background, width: u32, height: u32) -> Canvas {
        let mut pixels = vec![Pixel { colour: background.top, depth: 1.0 }; (width * height) as usize];
        for (y, row) in pixels.chunks_mut(width as usize).enumerate() {
            let share = (y as f32 + 0.5) / height as f32;
            let colour =
                std::array::from_fn(|c| background.top[c] + (background.bottom[c] - background.top[c]) * share);
            row.fill(Pixel { colour, depth: 1.0 });
        }
        Canvas { width, height, pixels }
    }

    /// Asks for each pixel, given its middle (x right, y down).
    fn each(&mut self, paint: impl Fn(f32, f32, &mut Pixel) + Sync) {
        in_rows(&mut self.pixels, self.width, processors(), |y, row| {
            for (x, pixel) in row.iter_mut().enumerate() {
                paint(x as f32 + 0.5, y as f32 + 0.5, pixel);
            }
        });
    }

    fn image(&self) -> Image {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let rgba = self.pixels.iter().flat_map(|p| {
            let [r, g, b] = p.colour.map(byte);
            [r, g, b, u8::MAX]
        });
        Image { width: self.width, height: self.height, rgba: rgba.collect() }
    }
}
