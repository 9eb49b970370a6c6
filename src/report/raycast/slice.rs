//! A cut through a volume, flat and crisp.

use crate::raycast::{ImagePlane, PixelBuffer, add, for_each_solid_neighbour};
use typodont_core::frame::Vec3;
use typodont_core::parallel::{available_threads, par_rows};
use typodont_core::volume::{ISO, Label, Volume};

/// Samples along each side of a pixel at the border of two colours.
const SUPERSAMPLES: u32 = 3;

/// The volume cut across the camera's view at the depth of a point; solid matter in the colour of its voxels, the rest
/// transparent. Borders between colours run where they weigh alike, so that no voxel shows as a square.
pub fn slice(
    volume: &Volume,
    plane: &ImagePlane,
    through_in_tooth: Vec3,
    colour: impl Fn(Label, usize) -> [f32; 3] + Sync,
) -> PixelBuffer {
    let section = SectionPlane::new(volume, plane, through_in_tooth);
    let ImagePlane { width, height, .. } = *plane;
    let mut middles: Vec<Option<[f32; 3]>> = vec![None; (width * height) as usize];
    par_rows(&mut middles, width, available_threads(), |y, row| {
        for (x, middle) in row.iter_mut().enumerate() {
            *middle = section.colour_at(x as f32 + 0.5, y as f32 + 0.5, &colour);
        }
    });
    let paint = |colour: Option<[f32; 3]>| colour.map_or([0.0; 4], |[r, g, b]| [r, g, b, 1.0]);
    let mut picture = PixelBuffer::transparent(width, height);
    par_rows(&mut picture.pixels, width, available_threads(), |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let x = x as u32;
            *pixel = match is_border(&middles, [width, height], [x, y]) {
                false => paint(middles[(y * width + x) as usize]),
                true => {
                    let at = |i: u32, n: u32| i as f32 + (n as f32 + 0.5) / SUPERSAMPLES as f32;
                    let sample =
                        |n: u32| paint(section.colour_at(at(x, n % SUPERSAMPLES), at(y, n / SUPERSAMPLES), &colour));
                    let sum = (0..SUPERSAMPLES * SUPERSAMPLES).map(sample).fold([0.0; 4], add);
                    sum.map(|v| v / (SUPERSAMPLES * SUPERSAMPLES) as f32)
                }
            };
        }
    });
    picture
}

/// The line where the cut meets the surface, `width` pixels wide.
pub fn contour(
    volume: &Volume,
    plane: &ImagePlane,
    through_in_tooth: Vec3,
    colour: [f32; 3],
    width: f32,
) -> PixelBuffer {
    let section = SectionPlane::new(volume, plane, through_in_tooth);
    let mut picture = PixelBuffer::transparent(plane.width, plane.height);
    par_rows(&mut picture.pixels, plane.width, available_threads(), |y, row| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let share =
                (0.5 * width + 0.5 - section.pixels_from_surface(x as f32 + 0.5, y as f32 + 0.5)).clamp(0.0, 1.0);
            *pixel = [colour[0] * share, colour[1] * share, colour[2] * share, share];
        }
    });
    picture
}

/// True when a neighbour of the pixel, across a side or a corner, has another colour.
fn is_border(middles: &[Option<[f32; 3]>], [width, height]: [u32; 2], [x, y]: [u32; 2]) -> bool {
    let own = middles[(y * width + x) as usize];
    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
    rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x))
        .any(|i| middles[i as usize] != own)
}

struct SectionPlane<'a> {
    volume: &'a Volume,
    plane: &'a ImagePlane,
    /// From the camera's plane to the cut.
    offset: Vec3,
}

impl<'a> SectionPlane<'a> {
    fn new(volume: &'a Volume, plane: &'a ImagePlane, through_in_tooth: Vec3) -> SectionPlane<'a> {
        let back = plane.camera.back();
        SectionPlane { volume, plane, offset: back * (through_in_tooth - plane.camera.middle).dot(back) }
    }

    /// The colour that weighs most among the voxels around a place; `None` in empty space.
    fn colour_at(&self, x: f32, y: f32, colour: &impl Fn(Label, usize) -> [f32; 3]) -> Option<[f32; 3]> {
        let grid = self.volume.grid();
        let at = grid.from_tooth(self.plane.unproject(x, y) + self.offset);
        if self.volume.density_in_grid(at) < ISO {
            return None;
        }
        let mut found: [([f32; 3], f32); 27] = [([0.0; 3], 0.0); 27];
        let mut count = 0;
        for_each_solid_neighbour(self.volume, at, |label, index, share| {
            let own = colour(label, index);
            let place = found[..count].iter().position(|(c, _)| *c == own).unwrap_or(count);
            count = count.max(place + 1);
            found[place] = (own, found[place].1 + share);
        });
        let heaviest = found[..count].iter().reduce(|best, next| if next.1 > best.1 { next } else { best })?;
        (heaviest.1 > 0.0).then_some(heaviest.0)
    }

    /// Pixels to the line of the surface within the cut; many where it is far.
    fn pixels_from_surface(&self, x: f32, y: f32) -> f32 {
        let point = self.plane.unproject(x, y) + self.offset;
        let density = self.volume.density_at(point);
        if !(0.02..=0.98).contains(&density) {
            return f32::INFINITY;
        }
        let (density, gradient) = self.volume.density_and_gradient_at(point);
        let back = self.plane.camera.back();
        let rise = (gradient - back * gradient.dot(back)).length();
        if rise > 1e-3 { (density - ISO).abs() / rise / self.plane.pixel_mm() } else { f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raycast::phantom;
    use crate::raycast::{OrthographicCamera, ViewSide};
    use typodont_core::volume::Grid;

    #[test]
    fn a_cut_shows_each_labels_colour_where_it_lies() {
        // A ball of radius 3 whose half at x > 0 is another tissue: seen from the mesial side, the right half.
        let grid = Grid::centred([80, 80, 80], Vec3::splat(0.1));
        let volume =
            Volume::from_distance(grid, 0.15, |p| (p.length() - 3.0, if p.x > 0.0 { Label(2) } else { Label(1) }));
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(ViewSide::Mesial, &volume, 1.0),
            width: 100,
            height: 100,
        };
        let colour = |label: Label, _: usize| if label == Label(2) { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let picture = slice(&volume, &shot, Vec3::new(9.0, 1.0, 9.0), colour);
        let at = |x: u32, y: u32| picture.pixels[(y * 100 + x) as usize];
        assert_eq!(at(60, 50), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(at(40, 50), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(at(2, 2), [0.0; 4]);
        let area = picture.pixels.iter().map(|p| p[3]).sum::<f32>() * shot.pixel_mm() * shot.pixel_mm();
        let expected = std::f32::consts::PI * 8.0;
        assert!((area / expected - 1.0).abs() < 0.01, "{area} mm² of {expected}");
    }

    #[test]
    fn an_outline_is_as_wide_as_asked() {
        let volume = phantom::ball([80, 80, 80], Vec3::splat(0.1), 3.0);
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(ViewSide::Occlusal, &volume, 1.0),
            width: 200,
            height: 200,
        };
        let line = contour(&volume, &shot, Vec3::ZERO, [0.0; 3], 2.0);
        let covered: f32 = line.pixels.iter().map(|p| p[3]).sum();
        let expected = std::f32::consts::TAU * 3.0 / shot.pixel_mm() * 2.0;
        assert!((covered / expected - 1.0).abs() < 0.05, "{covered} pixels of {expected}");
    }
}
