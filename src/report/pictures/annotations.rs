//! Labels on a picture: anatomical directions and a scale bar.

use super::PAPER;
use crate::raycast::{ImagePlane, PixelBuffer};
use typodont_core::frame::Vec3;

const INK: [f32; 3] = [0.35, 0.37, 0.40];

/// Width of strokes and height of letters, pixels.
const STROKE: f32 = 1.5;
const LETTER: f32 = 11.0;

/// Paper left around strokes that cross the tooth, pixels.
const HALO: f32 = 2.5;

/// Space to the picture's edge, pixels.
const MARGIN: f32 = 10.0;

/// Lays a picture on white and adds directions and a scale bar. `distal` is the distal direction in tooth space; without
/// it there are no letters, for a tooth whose sides are not known and for several teeth with sides of their own.
pub fn annotate(picture: &PixelBuffer, plane: &ImagePlane, distal: Option<Vec3>) -> PixelBuffer {
    let mut paper = PixelBuffer::filled(picture.width, picture.height, PAPER);
    paper.composite(picture);
    if let Some(distal) = distal {
        draw_directions(&mut paper, plane, distal);
    }
    draw_scale_bar(&mut paper, plane);
    paper
}

/// A letter at each edge: buccal, lingual, mesial, distal, occlusal, apical.
fn draw_directions(picture: &mut PixelBuffer, plane: &ImagePlane, distal: Vec3) {
    let letter = |direction: Vec3| {
        let names = [(Vec3::X, "B"), (Vec3::NEG_X, "L"), (-distal, "M"), (distal, "D"), (Vec3::Z, "O")];
        names.into_iter().find(|(axis, _)| axis.dot(direction) > 0.9).map_or("A", |(_, name)| name)
    };
    let (right, up) = (plane.camera.right, plane.camera.up);
    let (width, height) = (picture.width as f32, picture.height as f32);
    let middle = [0.5 * width, 0.5 * (height - LETTER)];
    for (text, x, y) in [
        (letter(up), middle[0], MARGIN),
        (letter(-up), middle[0], height - MARGIN - LETTER),
        (letter(-right), MARGIN, middle[1]),
        (letter(right), width - MARGIN - text_width(letter(right)), middle[1]),
    ] {
        draw_text(picture, text, x, y);
    }
}

/// A line as long as 1, 2 or 5 mm in the lower left corner, with its length.
fn draw_scale_bar(picture: &mut PixelBuffer, plane: &ImagePlane) {
    let max_length = 0.24 * picture.width as f32 * plane.pixel_mm();
    let (length, text) = match max_length {
        5.0.. => (5.0, "5 mm"),
        2.0.. => (2.0, "2 mm"),
        _ => (1.0, "1 mm"),
    };
    let (x, y) = (MARGIN, picture.height as f32 - MARGIN);
    let end = x + length / plane.pixel_mm();
    let bar = [vec![[x, y - 4.0], [x, y], [end, y], [end, y - 4.0]]];
    draw_strokes(picture, &bar);
    draw_text(picture, text, 0.5 * (x + end - text_width(text)), y - 7.0 - LETTER);
}

fn draw_text(picture: &mut PixelBuffer, text: &str, mut x: f32, y: f32) {
    let scale = LETTER / 6.0;
    for letter in text.chars() {
        let lines: Vec<Vec<[f32; 2]>> = glyph(letter)
            .iter()
            .map(|line| line.iter().map(|[u, v]| [x + u * scale, y + v * scale]).collect())
            .collect();
        draw_strokes(picture, &lines);
        x += advance(letter) * scale;
    }
}

fn text_width(text: &str) -> f32 {
    text.chars().map(advance).sum::<f32>() * LETTER / 6.0
}

fn advance(letter: char) -> f32 {
    let widest = glyph(letter).iter().copied().flatten().map(|p| p[0]).fold(0.6, f32::max);
    widest + 1.7
}

/// A letter as lines, six units high, y down.
fn glyph(letter: char) -> &'static [&'static [[f32; 2]]] {
    match letter {
        'A' => &[&[[0.0, 6.0], [2.2, 0.0], [4.4, 6.0]], &[[0.8, 4.0], [3.6, 4.0]]],
        'B' => &[&[
            [0.0, 3.0],
            [2.6, 3.0],
            [3.4, 2.3],
            [3.4, 0.7],
            [2.6, 0.0],
            [0.0, 0.0],
            [0.0, 6.0],
            [2.8, 6.0],
            [3.8, 5.2],
            [3.8, 3.8],
            [2.8, 3.0],
        ]],
        'D' => &[&[[0.0, 0.0], [2.2, 0.0], [3.9, 1.7], [3.9, 4.3], [2.2, 6.0], [0.0, 6.0], [0.0, 0.0]]],
        'L' => &[&[[0.0, 0.0], [0.0, 6.0], [3.4, 6.0]]],
        'M' => &[&[[0.0, 6.0], [0.0, 0.0], [2.4, 4.0], [4.8, 0.0], [4.8, 6.0]]],
        'O' => &[&[
            [1.6, 0.0],
            [3.0, 0.0],
            [4.4, 1.6],
            [4.4, 4.4],
            [3.0, 6.0],
            [1.6, 6.0],
            [0.2, 4.4],
            [0.2, 1.6],
            [1.6, 0.0],
        ]],
        '1' => &[&[[0.4, 1.3], [2.0, 0.0], [2.0, 6.0]]],
        '2' => &[&[[0.0, 1.4], [1.0, 0.1], [2.6, 0.1], [3.6, 1.2], [3.4, 2.5], [0.0, 6.0], [3.8, 6.0]]],
        '5' => &[&[
            [3.3, 0.0],
            [0.4, 0.0],
            [0.2, 2.6],
            [2.2, 2.3],
            [3.6, 3.3],
            [3.6, 4.8],
            [2.3, 6.0],
            [1.0, 6.0],
            [0.0, 5.2],
        ]],
        'm' => &[
            &[[0.0, 6.0], [0.0, 2.0]],
            &[[0.0, 2.9], [0.9, 2.0], [1.8, 2.0], [2.4, 2.8], [2.4, 6.0]],
            &[[2.4, 2.9], [3.3, 2.0], [4.2, 2.0], [4.8, 2.8], [4.8, 6.0]],
        ],
        _ => &[],
    }
}

/// Draws lines through points, given in pixels.
fn draw_strokes(picture: &mut PixelBuffer, lines: &[Vec<[f32; 2]>]) {
    let ends = |axis: usize| lines.iter().flatten().map(move |p| p[axis]);
    let span = |axis: usize| {
        let (low, high) = (ends(axis).fold(f32::INFINITY, f32::min), ends(axis).fold(0.0, f32::max));
        (low - HALO - STROKE).floor() as i64..=(high + HALO + STROKE).ceil() as i64
    };
    for y in span(1) {
        for x in span(0) {
            let point = [x as f32 + 0.5, y as f32 + 0.5];
            let segments = lines.iter().flat_map(|line| line.windows(2));
            let off = segments.map(|leg| distance(point, leg[0], leg[1])).fold(f32::INFINITY, f32::min);
            picture.blend_pixel(x, y, PAPER, 0.7 * (0.5 * STROKE + HALO - off).clamp(0.0, 1.0));
            picture.blend_pixel(x, y, INK, (0.5 * STROKE + 0.5 - off).clamp(0.0, 1.0));
        }
    }
}

/// From a point to the line between two others.
fn distance([x, y]: [f32; 2], [ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    let (dx, dy) = (bx - ax, by - ay);
    let along = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-9)).clamp(0.0, 1.0);
    let (ox, oy) = (x - ax - along * dx, y - ay - along * dy);
    (ox * ox + oy * oy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raycast::{OrthographicCamera, ViewSide};
    use typodont_core::aabb::Aabb;

    #[test]
    fn the_scale_bar_is_as_long_as_it_says() {
        // Aim: 24 mm of view on 480 pixels: 5 mm are 100 pixels. Method: the ink in the bar's row.
        let camera = OrthographicCamera {
            half_height: 12.0,
            ..OrthographicCamera::framing_box(ViewSide::Buccal, &Aabb::new(Vec3::ZERO, Vec3::ONE), 1.0)
        };
        let shot = ImagePlane { camera, width: 480, height: 480 };
        let mut picture = PixelBuffer::filled(480, 480, PAPER);
        draw_scale_bar(&mut picture, &shot);
        let row = &picture.pixels[470 * 480..][..480];
        let inked: Vec<usize> = (0..480).filter(|&x| row[x][0] < 0.8).collect();
        let length = inked[inked.len() - 1] - inked[0];
        assert!((99..=102).contains(&length), "{length}");
    }
}
