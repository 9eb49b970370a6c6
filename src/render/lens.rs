//! Depth of field: what is nearer or farther than the focus is blurred, as by the lenses of loupes.
//!
//! Takes a lens and an eye. Gives, in pixels, the circle into which a point at a depth is spread, and the places around a pixel from
//! which it gathers light. Both twins of the pass use them.

use super::eye::Eye;
use super::scene::Lens;

#[cfg(feature = "gpu")]
pub const SOURCE: &str = include_str!("../../shaders/lens_pass.wgsl");

/// Places from which a pixel gathers light, besides its own.
pub const TAPS: usize = 64;

/// Smallest radius of a circle, pixels: a pixel's own.
pub const SMALLEST: f32 = 0.5;

/// Largest radius, as a share of the picture's height: the places around a pixel are too far apart for wider circles.
const LARGEST: f32 = 0.012;

/// Exponent of the places' distances: from 0.5, where they are evenly spread, to 1, where most of them are near.
const SPREAD: f32 = 0.75;

/// Angle from one place to the next, radians: the golden angle.
const TURN: f32 = 2.399_963_2;

/// A lens as one eye sees through it.
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

/// A place beside a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tap {
    /// Right and down, pixels.
    pub steps: [i32; 2],
    /// Length of the steps.
    pub distance: f32,
    /// Area of the picture that the place stands for, square pixels over π.
    pub area: f32,
}

impl LensView {
    /// The lens before an eye, in a picture of a height in pixels. All is sharp if its focus is not before the eye.
    pub fn new(lens: &Lens, eye: &Eye, height: u32) -> LensView {
        let depth = (lens.focus - eye.position).dot(eye.forward);
        let (focus, aperture) = if depth > eye.near { (depth, lens.aperture) } else { (eye.near, 0.0) };
        let per_tangent = height as f32 / (eye.window.top - eye.window.bottom);
        let largest = (LARGEST * height as f32).max(SMALLEST);
        LensView { focus, scale: 0.5 * aperture * per_tangent, largest, taps: taps(largest + 0.5) }
    }

    /// Radius of the circle into which a point at a depth is spread, pixels.
    pub fn circle(&self, depth: f32) -> f32 {
        (self.scale * (1.0 / depth - 1.0 / self.focus).abs()).clamp(SMALLEST, self.largest)
    }
}

/// Places up to a radius in pixels, each for its part of the disc: a spiral.
fn taps(radius: f32) -> [Tap; TAPS] {
    std::array::from_fn(|i| {
        let share = (i as f32 + 0.5) / TAPS as f32;
        let (distance, turn) = (radius * libm::powf(share, SPREAD), TURN * i as f32);
        let steps = [libm::cosf(turn), libm::sinf(turn)].map(|way| (distance * way).round() as i32);
        let area = 2.0 * SPREAD * radius * radius * libm::powf(share, 2.0 * SPREAD - 1.0) / TAPS as f32;
        Tap { steps, distance: libm::hypotf(steps[0] as f32, steps[1] as f32), area }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Viewpoint;
    use typodont_core::frame::Vec3;

    #[test]
    fn circles_are_those_of_a_thin_lens() {
        // Aim: the size of the blur, by the rays from both rims of the lens through the focus. Method: at a depth z, rays from the rims
        // through a point at z meet the plane in focus in places A |z - f| / z apart.
        let viewpoint = Viewpoint::look_at(Vec3::ZERO, Vec3::NEG_Z * 200.0, Vec3::Y);
        let lens = Lens { focus: Vec3::NEG_Z * 200.0, aperture: 2.0 };
        let view = LensView::new(&lens, &viewpoint.eye(1.5), 3000);
        let per_mm = 3000.0 / (2.0 * 200.0 * libm::tanf(0.5 * viewpoint.field_of_view));
        for z in [150.0f32, 190.0, 220.0, 260.0] {
            let expected = 0.5 * 2.0 * (z - 200.0).abs() / z * per_mm;
            let radius = view.circle(z);
            assert!(
                (radius - expected.clamp(SMALLEST, view.largest)).abs() < 1e-3 * expected,
                "{z} mm: {radius}, not {expected}"
            );
        }
        assert_eq!(view.circle(200.0), SMALLEST);
        let behind = Lens { focus: Vec3::Z, ..lens };
        assert_eq!(LensView::new(&behind, &viewpoint.eye(1.5), 3000).circle(500.0), SMALLEST);
    }

    #[test]
    fn places_stand_for_the_whole_disc() {
        // Aim: circles of any size are covered evenly, so that what is blurred is neither brighter nor darker.
        let (radius, taps) = (14.0f32, taps(14.0));
        let total: f32 = taps.iter().map(|tap| tap.area).sum();
        assert!((total / (radius * radius) - 1.0).abs() < 0.01, "{total}");
        for part in [0.35f32, 0.5, 0.75] {
            let within: f32 = taps.iter().filter(|tap| tap.distance < part * radius).map(|tap| tap.area).sum();
            let share = within / (part * radius).powi(2);
            assert!((0.8..1.2).contains(&share), "{part}: {share}");
        }
        let middle = |axis: usize| taps.iter().map(|tap| tap.area * tap.steps[axis] as f32).sum::<f32>() / total;
        assert!(middle(0).hypot(middle(1)) < 0.4, "{}, {}", middle(0), middle(1));
        assert!(taps.iter().all(|tap| tap.distance < radius + 2.0));
    }
}
