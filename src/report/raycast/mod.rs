//! Pictures of a volume: its surface from any side, and cuts through it.
//!
//! Takes a volume, a camera and the surface's finish by closure. Gives pixels; the same ones however many threads help. Never knows a
//! tissue's name, and never writes a file or a letter.

mod camera;
mod light;
mod pixel_buffer;
mod ray;
mod slice;

pub use camera::{ImagePlane, OrthographicCamera, ViewSide};
pub use pixel_buffer::PixelBuffer;
pub use slice::{contour, slice};

use ray::RayMarcher;
use typodont_core::frame::Vec3;
use typodont_core::parallel::{available_threads, par_rows};
use typodont_core::volume::{Label, Volume};
use typodont_render::{Appearance, SeenPlace};

/// Samples along each side of a pixel where the picture has an edge; elsewhere one does.
const SUPERSAMPLES: u32 = 3;

/// Gloss of surfaces that show something other than a tooth: low, so that the colours of a legend are recognised.
const FAINT_GLOSS: f32 = 0.1;

/// The surface as a camera sees it, without colour: one rendering serves several colourings.
#[derive(Clone, Debug)]
pub struct GBuffer {
    camera: OrthographicCamera,
    width: u32,
    height: u32,
    /// One per pixel.
    hits: Vec<Option<Hit>>,
    /// Pixels on an edge, ascending, with all their samples.
    edges: Vec<(usize, Vec<Option<Hit>>)>,
}

/// Point at which a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hit {
    /// In tooth space, mm.
    point: Vec3,
    /// Unit, outward, in tooth space.
    normal: Vec3,
    /// From the camera's plane, mm.
    depth: f32,
    /// Share of the light that it returns: less in hollows and at the outline.
    open: f32,
}

/// The iso-surface, lit, in the colours of its voxels; `colour` is asked for voxels on the surface.
pub fn render_iso(
    volume: &Volume,
    plane: &ImagePlane,
    colour: impl Fn(Label, usize) -> [f32; 3] + Sync,
) -> PixelBuffer {
    render(volume, plane).paint_voxels(volume, colour)
}

/// Finds the surface.
pub fn render(volume: &Volume, plane: &ImagePlane) -> GBuffer {
    render_with(volume, plane, None, available_threads())
}

/// The same, faster, for a volume that has only lost matter since an earlier rendering on this image plane.
pub fn render_after_removal(volume: &Volume, plane: &ImagePlane, earlier: &GBuffer) -> GBuffer {
    render_with(volume, plane, Some(earlier), available_threads())
}

fn render_with(volume: &Volume, plane: &ImagePlane, earlier: Option<&GBuffer>, threads: usize) -> GBuffer {
    let ImagePlane { camera, width, height } = *plane;
    let marcher = RayMarcher::new(volume, camera);
    let mut hits = vec![None; (width * height) as usize];
    par_rows(&mut hits, width, threads, |y, row| {
        for (x, hit) in row.iter_mut().enumerate() {
            let point = plane.unproject(x as f32 + 0.5, y as f32 + 0.5);
            *hit = match earlier.map(|view| view.hits[y as usize * width as usize + x]) {
                None => marcher.cast(point),
                Some(None) => None,
                Some(Some(before)) => marcher.cast_beyond(point, before.depth),
            };
        }
    });
    let depths: Vec<Option<f32>> = hits.iter().map(|h| h.as_ref().map(|h| h.depth)).collect();
    let occlusion =
        light::ambient_occlusion(&depths, width as usize, camera.half_height * 2.0 / height as f32, threads);
    let shaded = |hit: Hit, pixel: usize| Hit { open: light::openness(&camera, hit.normal, occlusion[pixel]), ..hit };
    let mut edges: Vec<(usize, Vec<Option<Hit>>)> =
        edge_pixels(&hits, width as usize, plane.pixel_mm()).into_iter().map(|pixel| (pixel, Vec::new())).collect();
    par_rows(&mut edges, 64, threads, |_, some| {
        for (pixel, samples) in some {
            let (x, y) = (*pixel as u32 % width, *pixel as u32 / width);
            let at = |i: u32, n: u32| i as f32 + (n as f32 + 0.5) / SUPERSAMPLES as f32;
            for n in 0..SUPERSAMPLES * SUPERSAMPLES {
                let hit = marcher.cast(plane.unproject(at(x, n % SUPERSAMPLES), at(y, n / SUPERSAMPLES)));
                samples.push(hit.map(|h| shaded(h, *pixel)));
            }
        }
    });
    for (pixel, hit) in hits.iter_mut().enumerate() {
        *hit = hit.map(|h| shaded(h, pixel));
    }
    GBuffer { camera, width, height, hits, edges }
}

/// Pixels whose neighbours see something else: nothing, a surface turned elsewhere, or one that is not its continuation.
fn edge_pixels(hits: &[Option<Hit>], width: usize, pixel: f32) -> Vec<usize> {
    /// Cosine between normals: 25°.
    const TURNED: f32 = 0.906;
    /// Distance of a neighbour from the plane through a hit, in pixels.
    const OFF: f32 = 0.8;
    let differ = |a: &Option<Hit>, b: &Option<Hit>| match (a, b) {
        (Some(a), Some(b)) => {
            let step = b.point - a.point;
            let off = a.normal.dot(step).abs().max(b.normal.dot(step).abs());
            a.normal.dot(b.normal) < TURNED || off > OFF * pixel
        }
        (a, b) => a.is_some() != b.is_some(),
    };
    let is_edge = |i: usize| {
        let x = i % width;
        let aside = [(x > 0).then(|| i - 1), (x + 1 < width).then_some(i + 1)];
        let above = [i.checked_sub(width), (i + width < hits.len()).then_some(i + width)];
        aside.into_iter().chain(above).flatten().any(|n| differ(&hits[i], &hits[n]))
    };
    (0..hits.len()).filter(|&i| is_edge(i)).collect()
}

impl GBuffer {
    /// The surface that was seen, lit; `finish` is asked for points of the surface in tooth space. Nothing stays transparent.
    pub fn paint(&self, finish: impl Fn(Vec3) -> Appearance + Sync) -> PixelBuffer {
        self.paint_with_relief(|seen| (finish(seen.place), seen.normal))
    }

    /// The same with fine relief: `look` is asked for a place in tooth space, and answers with how it looks and with the normal that the
    /// relief has there.
    pub fn paint_with_relief(&self, look: impl Fn(SeenPlace) -> (Appearance, Vec3) + Sync) -> PixelBuffer {
        self.paint_with(look, available_threads())
    }

    /// The same in the colours of voxels.
    pub fn paint_voxels(&self, volume: &Volume, colour: impl Fn(Label, usize) -> [f32; 3] + Sync) -> PixelBuffer {
        self.paint(|point| Appearance { colour: surface_colour(volume, point, &colour), gloss: FAINT_GLOSS })
    }

    fn paint_with(&self, look: impl Fn(SeenPlace) -> (Appearance, Vec3) + Sync, threads: usize) -> PixelBuffer {
        let lamps = light::lamps();
        let pixel = 2.0 * self.camera.half_height / self.height as f32;
        let mut picture = PixelBuffer::transparent(self.width, self.height);
        let shade = |hit: &Option<Hit>| match hit {
            Some(hit) => {
                let eye_cosine = hit.normal.dot(self.camera.back());
                let (finish, normal) = look(SeenPlace { place: hit.point, normal: hit.normal, pixel, eye_cosine });
                light::lit_colour(&lamps, &self.camera, finish, &Hit { normal, ..*hit })
            }
            None => [0.0; 4],
        };
        par_rows(&mut picture.pixels, self.width, threads, |y, row| {
            let first = (y * self.width) as usize;
            for (pixel, hit) in row.iter_mut().zip(&self.hits[first..]) {
                *pixel = shade(hit);
            }
            let edges = [first, first + row.len()].map(|pixel| self.edges.partition_point(|(at, _)| *at < pixel));
            for (at, samples) in &self.edges[edges[0]..edges[1]] {
                let sum = samples.iter().map(&shade).fold([0.0; 4], |sum: [f32; 4], s| add(sum, s));
                row[at - first] = sum.map(|v| v / samples.len() as f32);
            }
        });
        picture
    }
}

fn add(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// The colour of the surface at a point of tooth space: that of the solid voxels around it, each as much as it is near.
pub fn surface_colour(volume: &Volume, point_in_tooth: Vec3, colour: impl Fn(Label, usize) -> [f32; 3]) -> [f32; 3] {
    let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
    for_each_solid_neighbour(volume, volume.grid().from_tooth(point_in_tooth), |label, index, share| {
        sum += Vec3::from(colour(label, index)) * share;
        weight += share;
    });
    if weight > 0.0 { (sum / weight).to_array() } else { [0.5; 3] }
}

/// Calls `visit` with the label, index and share of each solid voxel around a place given in voxel steps.
///
/// Shares are those of a quadratic B-spline over 3³ voxels: smooth enough that borders of tissues do not show stairs.
fn for_each_solid_neighbour(volume: &Volume, at: Vec3, mut visit: impl FnMut(Label, usize, f32)) {
    let dims = volume.grid().dims;
    let nearest = (at + 0.5).floor();
    let off = at - nearest;
    let shares = [0, 1, 2].map(|a| {
        let (below, above) = (0.5 - off[a], 0.5 + off[a]);
        [0.5 * below * below, 0.75 - off[a] * off[a], 0.5 * above * above]
    });
    let inside = |a: usize, n: usize| {
        let v = nearest[a] + n as f32 - 1.0;
        (v >= 0.0 && v < dims[a] as f32).then_some(v as u32)
    };
    for (k, z) in (0..3).filter_map(|k| Some((k, inside(2, k)?))) {
        for (j, y) in (0..3).filter_map(|j| Some((j, inside(1, j)?))) {
            for (i, x) in (0..3).filter_map(|i| Some((i, inside(0, i)?))) {
                let index = volume.grid().index([x, y, z]);
                let label = volume.tissue(index);
                if label != Label::AIR {
                    visit(label, index, shares[0][i] * shares[1][j] * shares[2][k]);
                }
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod phantom {
    //! Known shapes for tests.
    use typodont_core::frame::Vec3;
    use typodont_core::volume::{Grid, Label, Volume};

    pub fn ball(dims: [u32; 3], spacing: Vec3, radius: f32) -> Volume {
        let grid = Grid::centred(dims, spacing);
        let band = 2.0 * spacing.max_element();
        Volume::from_distance(grid, band, |p| (p.length() - radius, Label(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raycast::phantom;
    use typodont_render::tooth_in_relief;

    #[test]
    fn a_balls_silhouette_has_the_area_of_a_disc() {
        let volume = phantom::ball([70, 60, 80], Vec3::new(0.1, 0.12, 0.1), 3.0);
        for side in ViewSide::ALL {
            let shot =
                ImagePlane { camera: OrthographicCamera::framing_volume(side, &volume, 1.0), width: 120, height: 120 };
            let picture = render_iso(&volume, &shot, |_, _| [0.5; 3]);
            let covered: f32 = picture.pixels.iter().map(|p| p[3]).sum();
            let area = covered * shot.pixel_mm() * shot.pixel_mm();
            let expected = std::f32::consts::PI * 9.0;
            assert!((area / expected - 1.0).abs() < 0.01, "{side:?}: {area} mm² of {expected}");
        }
    }

    #[test]
    fn one_thread_and_three_draw_the_same_picture() {
        let volume = phantom::ball([40, 40, 40], Vec3::splat(0.1), 1.2);
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(ViewSide::Buccal, &volume, 1.5),
            width: 97,
            height: 61,
        };
        let look = |seen: SeenPlace| {
            tooth_in_relief(1, Appearance { colour: [0.5 + 0.4 * seen.place.x, 0.4, 0.2], gloss: 0.2 }, seen)
        };
        let picture = |threads| render_with(&volume, &shot, None, threads).paint_with(look, threads);
        assert_eq!(picture(1), picture(3));
    }

    #[test]
    fn looking_again_after_a_cut_is_as_good_as_looking_anew() {
        let mut volume = phantom::ball([60, 60, 60], Vec3::splat(0.1), 2.5);
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(ViewSide::Occlusal, &volume, 1.0),
            width: 80,
            height: 80,
        };
        let before = render(&volume, &shot);
        let grid = *volume.grid();
        for (index, cell) in grid.cells().enumerate() {
            if grid.centre(cell).distance(Vec3::new(0.5, 0.3, 2.5)) < 1.2 {
                volume.set(index, typodont_core::volume::Voxel::AIR);
            }
        }
        let (anew, again) = (render(&volume, &shot), render_after_removal(&volume, &shot, &before));
        assert_ne!(before.hits, anew.hits);
        for (a, b) in anew.hits.iter().zip(&again.hits) {
            let depth = |hit: &Option<Hit>| hit.map_or(f32::INFINITY, |h| h.depth);
            assert!(depth(a) == depth(b) || (depth(a) - depth(b)).abs() < 0.03, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_side_that_faces_the_light_is_brighter_and_keeps_its_hue() {
        let volume = phantom::ball([60, 60, 60], Vec3::splat(0.1), 2.5);
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(ViewSide::Occlusal, &volume, 1.0),
            width: 90,
            height: 90,
        };
        let picture = render_iso(&volume, &shot, |_, _| [0.8, 0.3, 0.1]);
        let at = |x: u32, y: u32| picture.pixels[(y * 90 + x) as usize];
        let (bright, dark) = (at(32, 32), at(68, 68));
        assert!(bright[0] > dark[0] && dark[3] == 1.0);
        for [red, green, blue, _] in [bright, dark] {
            assert!(red > 1.5 * green && green > blue);
        }
    }
}
