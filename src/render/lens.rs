//! Depth of field: what is nearer or farther than the focus is blurred, as by the lens of a camera.
//!
//! Takes a lens and an eye. Gives, in pixels, the circle into which a point at a depth is spread, and the places around a pixel from
//! which it gathers light. Both twins of the pass use them.

use super::eye::{Eye, FrustumWindow};
use super::scene::Lens;
use std::f32::consts::TAU;

#[cfg(feature = "gpu")]
pub const SOURCE: &str = include_str!("../../shaders/lens_pass.wgsl");

/// Places from which a pixel gathers light, besides its own: its neighbours, and rings of places around them. Their numbers are even, so
/// that what is blurred is not moved.
const NEIGHBOURS: usize = 8;
const PLACES: usize = 14;
const RINGS: usize = 5;
pub const TAPS: usize = NEIGHBOURS + (RINGS - 1) * PLACES;

/// Square of the radius of a pixel's own disc, pixels: its area is that of the pixel.
const OWN: f32 = std::f32::consts::FRAC_1_PI;

/// Smallest radius of a circle, pixels: a pixel's own.
pub const SMALLEST: f32 = 0.5;

/// Radius of a circle, pixels, from which on a place before the focus is blurred.
pub const BEFORE: f32 = 1.0;

/// Largest radius, as a share of the picture's height: the places around a pixel are too far apart for wider circles.
const LARGEST: f32 = 0.012;

/// A lens as one eye sees through it. Radii are counted in heights of a pixel: stereo may squeeze pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct LensView {
    /// Depth in focus, mm.
    pub focus: f32,
    /// Radius of the circle of a point infinitely far away, pixels, multiplied by the depth in focus.
    pub scale: f32,
    /// Largest radius of a circle, pixels.
    pub largest: f32,
    pub taps: [Tap; TAPS],
}

/// A place beside a pixel, for its part of a ring around it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tap {
    /// Right and down, pixels.
    pub steps: [i32; 2],
    /// Squares of the ring's inner and outer radius.
    pub ring: [f32; 2],
}

/// Weight of a pixel's own light in a circle of a radius, pixels.
pub fn own_weight(radius: f32) -> f32 {
    (OWN / (radius * radius)).min(1.0)
}

/// Weight of a place in a circle of a radius, pixels, around the pixel: the part of its ring that the circle covers. Together with the
/// pixel's own it is 1.
pub fn tap_weight(number: usize, tap: &Tap, radius: f32) -> f32 {
    let [inner, outer] = tap.ring;
    let places = if number < NEIGHBOURS { NEIGHBOURS } else { PLACES };
    ((radius * radius).clamp(inner, outer) - inner) / (places as f32 * radius * radius)
}

impl LensView {
    /// The lens before an eye, in a picture of a size in pixels. All is sharp if its focus is not before the eye.
    pub fn new(lens: &Lens, eye: &Eye, [width, height]: [u32; 2]) -> LensView {
        let depth = (lens.focus - eye.position).dot(eye.forward);
        let (focus, aperture) = if depth > eye.near { (depth, lens.aperture) } else { (eye.near, 0.0) };
        let FrustumWindow { left, right, bottom, top } = eye.window;
        let per_tangent = height as f32 / (top - bottom);
        // Stereo squeezes pictures to half their width or height.
        let squeeze = width as f32 / (right - left) / per_tangent;
        let largest = (LARGEST * height as f32).max(SMALLEST);
        LensView { focus, scale: 0.5 * aperture * per_tangent, largest, taps: taps(largest, squeeze) }
    }

    /// Radius of the circle into which a point at a depth is spread, pixels.
    pub fn circle(&self, depth: f32) -> f32 {
        (self.scale * (1.0 / depth - 1.0 / self.focus).abs()).clamp(SMALLEST, self.largest)
    }

    /// Returns true if a point at a depth is so far before the focus that it spreads over what is behind it.
    pub fn is_blurred_before(&self, depth: f32) -> bool {
        self.scale * (1.0 / depth - 1.0 / self.focus) > BEFORE
    }
}

/// Places for circles up to a radius, pixels. `squeeze`: number of pixels side by side that are as wide as one is high.
fn taps(largest: f32, squeeze: f32) -> [Tap; TAPS] {
    /// Radii of the two inner rings, pixels.
    const INNER: [f32; 2] = [1.2, 2.2];
    let outermost = (0.9 * largest).max(INNER[1] + 1.0);
    // Outward each ring is as much wider than the one before.
    let radius = |ring: usize| match ring {
        0 => INNER[0],
        _ => INNER[1] * libm::powf(outermost / INNER[1], (ring as f32 - 1.0) / (RINGS as f32 - 2.0)),
    };
    let end = |ring: usize| match ring + 1 == RINGS {
        true => largest.max(radius(ring)) + 0.5,
        false => 0.5 * (radius(ring) + radius(ring + 1)),
    };
    std::array::from_fn(|i| {
        let (ring, place, places) = match i.checked_sub(NEIGHBOURS) {
            None => (0, i, NEIGHBOURS),
            Some(i) => (1 + i / PLACES, i % PLACES, PLACES),
        };
        // Every other ring is turned by half a place.
        let turn = TAU * (place as f32 + 0.5 * (ring % 2) as f32) / places as f32;
        let steps = [squeeze * libm::cosf(turn), libm::sinf(turn)].map(|way| (radius(ring) * way).round() as i32);
        let inner = if ring == 0 { OWN } else { end(ring - 1) * end(ring - 1) };
        Tap { steps, ring: [inner, end(ring) * end(ring)] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Viewpoint;
    use typodont_core::frame::Vec3;

    fn straight_ahead() -> (Viewpoint, Lens) {
        let focus = Vec3::NEG_Z * 200.0;
        (Viewpoint::look_at(Vec3::ZERO, focus, Vec3::Y), Lens { focus, aperture: 2.0 })
    }

    #[test]
    fn circles_are_those_of_a_thin_lens() {
        // Aim: the size of the blur, by the rays from both rims of the lens through the focus. Method: at a depth z, rays from the rims
        // through a point at z meet the plane in focus in places A |z - f| / z apart.
        let (viewpoint, lens) = straight_ahead();
        let view = LensView::new(&lens, &viewpoint.eye(1.5), [4500, 3000]);
        let per_mm = 3000.0 / (2.0 * 200.0 * libm::tanf(0.5 * viewpoint.field_of_view));
        for z in [150.0f32, 190.0, 220.0, 260.0] {
            let expected = 0.5 * 2.0 * (z - 200.0).abs() / z * per_mm;
            let radius = view.circle(z);
            assert!((radius - expected.clamp(SMALLEST, view.largest)).abs() < 1e-3 * expected, "{z} mm: {radius}");
        }
        assert_eq!(view.circle(200.0), SMALLEST);
        let behind = Lens { focus: Vec3::Z, ..lens };
        assert_eq!(LensView::new(&behind, &viewpoint.eye(1.5), [4500, 3000]).circle(500.0), SMALLEST);
    }

    #[test]
    fn circles_of_all_sizes_stay_where_they_are_and_keep_their_light() {
        // Aim: what is blurred is neither moved nor brighter or darker. Method: the places within circles, in pictures from that of a
        // shelf to both eyes' of 4K, weighed as the pass weighs them.
        for height in [300, 500, 800, 1080, 1440, 2160, 2880] {
            let largest = LARGEST * height as f32;
            let taps = taps(largest, 1.0);
            assert!(taps.iter().all(|tap| tap.steps != [0, 0]), "{height}");
            for radius in [0.75f32, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 20.0, 30.0] {
                let radius = radius.min(largest);
                let (mut total, mut middle) = (own_weight(radius), [0.0; 2]);
                for (i, tap) in taps.iter().enumerate() {
                    let weight = tap_weight(i, tap, radius);
                    total += weight;
                    middle = [0, 1].map(|a| middle[a] + weight * tap.steps[a] as f32);
                }
                let off = middle.map(|sum| sum / total);
                assert!(off.iter().all(|v| v.abs() < 0.02), "{height}, {radius}: moved by {off:?}");
                assert!((total - 1.0).abs() < 1e-4, "{height}, {radius}: {total}");
            }
        }
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_has_the_same_constants() {
        for line in [
            format!("TAPS: i32 = {TAPS};"),
            format!("NEIGHBOURS: i32 = {NEIGHBOURS};"),
            format!("PLACES: f32 = {PLACES}.0;"),
            format!("OWN: f32 = {OWN:?};"),
            format!("SMALLEST: f32 = {SMALLEST:?};"),
            format!("BEFORE: f32 = {BEFORE:?};"),
        ] {
            assert!(SOURCE.contains(&line), "{line}");
        }
    }

    #[test]
    fn squeezed_pictures_have_round_circles_once_they_are_stretched() {
        let (viewpoint, lens) = straight_ahead();
        let eye = viewpoint.eye(1.6);
        let [whole, narrow, flat] = [[1280, 800], [640, 800], [1280, 400]].map(|size| LensView::new(&lens, &eye, size));
        let reach = |view: &LensView, axis: usize| view.taps.iter().map(|tap| tap.steps[axis]).max().unwrap() as f32;
        for (view, axis) in [(&narrow, 0), (&flat, 1)] {
            let ratio = reach(&whole, axis) / reach(view, axis);
            assert!((1.6..2.4).contains(&ratio), "axis {axis}: {ratio}");
            assert!((reach(&whole, 1 - axis) - reach(view, 1 - axis)).abs() <= 1.0);
        }
        assert!((whole.circle(150.0) / flat.circle(150.0) - 2.0).abs() < 0.01);
    }
}
