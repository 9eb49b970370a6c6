//! Fine relief of surfaces: stippled gingiva, the ridges of enamel, the marks of burs on a tooth, and what is rough by itself, such as
//! decay and calculus. It tilts their normals, and moves nothing.
//!
//! Takes a place of the surface's own space, mm. Gives the gradient of a height. Twin of `relief.wgsl`.

use super::eye::Eye;
use typodont_core::frame::{Vec3, smooth_step};

#[cfg(feature = "gpu")]
pub const SOURCE: &str = include_str!("../../shaders/relief.wgsl");

/// Width of a dimple of stippled gingiva, and by how much it is lower or higher than the mean, mm. Dimples are half a millimetre to a
/// millimetre apart; their depth is chosen by eye.
const STIPPLE_WIDTH: f32 = 0.55;
const STIPPLE_DEPTH: f32 = 0.04;

/// Columns of the rotation of the lattice of dimples: no row of them lies along the arch.
const STIPPLE_TURN: [Vec3; 3] = [Vec3::new(0.36, -0.8, 0.48), Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.8, 0.0, 0.6)];

/// Width of the marks of a bur across the tooth's axis and along it, and by how much they are lower or higher than the mean, mm: wider than they are, so that they are seen at the
/// magnification of a lesson, and faint.
const MARK_WIDTH: Vec3 = Vec3::new(0.38, 0.38, 0.17);
const MARK_DEPTH: f32 = 0.007;

/// Rise of the marks across the tooth's axis, mm per mm: a hand does not hold a bur upright.
const MARK_SLOPE: [f32; 2] = [0.35, -0.22];

/// Gloss of tissue that is smooth, and of tissue with all of the marks.
const SMOOTH: f32 = 0.19;
pub(super) const GROUND: f32 = 0.13;

/// Width of the ridges of enamel that nobody cut (perikymata) across the tooth's axis and along it, and by how much they are lower or
/// higher than the mean, mm. Real ones are 0.03 to 0.15 mm apart and about a micrometre high; these are seen at a lesson's magnification.
const RIDGE_WIDTH: Vec3 = Vec3::new(1.1, 1.1, 0.13);
const RIDGE_DEPTH: f32 = 0.0013;

/// Gloss of such enamel under a film of saliva: what has it has ridges. And the difference from it at which there are none.
pub const ENAMEL_GLOSS: f32 = 0.2;
const ENAMEL_GLOSS_RANGE: f32 = 0.01;

/// Size of a pixel, as a share of the relief's width, up to which relief is drawn whole, and from which on not at all.
const FADE: [f32; 2] = [0.3, 0.8];

/// Relief as one picture shows it: nothing that is finer than its pixels.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    /// World space, mm.
    eye: Vec3,
    /// Width of a pixel at a distance of 1 mm, mm.
    pixel: f32,
}

impl Relief {
    /// Relief as an eye sees it in a picture of a width in pixels.
    pub fn seen_by(eye: &Eye, width: u32) -> Relief {
        Relief { eye: eye.position, pixel: (eye.window.right - eye.window.left) / width as f32 }
    }

    /// Unit normal at a point of stippled gingiva. `own`: the point in the mesh's own space; `to_world` rotates from there;
    /// `share`: how much of the stippling it has, 0 to 1.
    pub fn stippled(&self, point: Vec3, normal: Vec3, own: Vec3, share: f32, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        if share <= 0.0 {
            return normal;
        }
        let [x, y, z] = STIPPLE_TURN;
        let turned = noise_gradient((x * own.x + y * own.y + z * own.z) / STIPPLE_WIDTH);
        let gradient = Vec3::new(turned.dot(x), turned.dot(y), turned.dot(z)) * (STIPPLE_DEPTH / STIPPLE_WIDTH);
        tilted(normal, to_world(gradient) * (share * resolved(self.pixel_at(point), STIPPLE_WIDTH)))
    }

    /// Unit normal at a point of a tooth whose surface has a gloss: the duller, the rougher. `own`: the point in millimetres along
    /// the axes of the volume.
    pub fn of_tooth(&self, point: Vec3, normal: Vec3, own: Vec3, gloss: f32, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        match tooth_gradient(own, gloss, self.pixel_at(point)) {
            Vec3::ZERO => normal,
            gradient => tilted(normal, to_world(gradient)),
        }
    }

    /// Unit normal at a point of another tooth's enamel. `own`: the point in the mesh's own space.
    pub fn of_enamel(&self, point: Vec3, normal: Vec3, own: Vec3, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        self.of_tooth(point, normal, own, ENAMEL_GLOSS, to_world)
    }

    /// Width of a pixel at a point, mm.
    fn pixel_at(&self, point: Vec3) -> f32 {
        (point - self.eye).length() * self.pixel
    }
}

/// Unit normal of a tooth's surface with a gloss, with its relief in a picture whose pixels are so wide, mm; all in one space.
pub fn tooth_normal(normal: Vec3, place: Vec3, gloss: f32, pixel: f32) -> Vec3 {
    match tooth_gradient(place, gloss, pixel) {
        Vec3::ZERO => normal,
        gradient => tilted(normal, gradient),
    }
}

/// Gradient of the height of a tooth's surface at a place: zero where it is smooth or pixels are too wide.
fn tooth_gradient(place: Vec3, gloss: f32, pixel: f32) -> Vec3 {
    let marks = ((SMOOTH - gloss) / (SMOOTH - GROUND)).clamp(0.0, 1.0);
    let ridges = 1.0 - ((gloss - ENAMEL_GLOSS).abs() / ENAMEL_GLOSS_RANGE).clamp(0.0, 1.0);
    let (width, slope, depth) = match marks > 0.0 {
        true => (MARK_WIDTH, MARK_SLOPE, MARK_DEPTH * marks),
        false => (RIDGE_WIDTH, [0.0; 2], RIDGE_DEPTH * ridges),
    };
    let depth = depth * resolved(pixel, width.z);
    if depth <= 0.0 {
        return Vec3::ZERO;
    }
    let inclined = place.with_z(place.z + slope[0] * place.x + slope[1] * place.y);
    let gradient = noise_gradient(inclined / width) / width;
    (gradient + gradient.z * Vec3::new(slope[0], slope[1], 0.0)) * depth
}

/// Share of a relief of a width, mm, that a picture whose pixels are so wide, mm, shows.
fn resolved(pixel: f32, width: f32) -> f32 {
    1.0 - smooth_step((pixel / width - FADE[0]) / (FADE[1] - FADE[0]))
}

/// Unit normal of a surface with a relief, given the gradient of its height.
fn tilted(normal: Vec3, gradient: Vec3) -> Vec3 {
    (normal - gradient + normal * gradient.dot(normal)).normalize_or(normal)
}

/// Random value of a lattice point, −1 to 1 (the finalizer of MurmurHash3).
fn lattice_value(x: u32, y: u32, z: u32) -> f32 {
    let mut hash = x ^ y ^ z;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85EB_CA6B);
    hash = (hash ^ hash >> 13).wrapping_mul(0xC2B2_AE35);
    (hash >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
}

/// Gradient of random values on a lattice of whole numbers, interpolated between them.
fn noise_gradient(at: Vec3) -> Vec3 {
    let base = at.floor();
    let part = at - base;
    let share = part * part * (3.0 - 2.0 * part);
    let rise = 6.0 * part * (1.0 - part);
    let factors = [0x9E37_79B1, 0x85EB_CA77, 0xC2B2_AE3D];
    let [x, y, z]: [[u32; 2]; 3] = std::array::from_fn(|a| {
        let corner = base[a] as i32 as u32;
        [corner, corner.wrapping_add(1)].map(|corner| corner.wrapping_mul(factors[a]))
    });
    let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let value = |i: usize, j: usize, k: usize| lattice_value(x[i], y[j], z[k]);
    let row = |j: usize, k: usize| [value(0, j, k), value(1, j, k)];
    let rows = [row(0, 0), row(1, 0), row(0, 1), row(1, 1)];
    let [a, b, c, d] = rows.map(|[first, last]| last - first);
    let along_x = mix(mix(a, b, share.y), mix(c, d, share.y), share.z);
    let [a, b, c, d] = rows.map(|[first, last]| mix(first, last, share.x));
    let along_y = mix(b - a, d - c, share.z);
    let along_z = mix(c, d, share.y) - mix(a, b, share.y);
    rise * Vec3::new(along_x, along_y, along_z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise itself, by a line integral of its gradient from the next lattice point.
    fn noise(at: Vec3) -> f32 {
        const STEPS: usize = 2000;
        let base = at.floor();
        let way = (at - base) / STEPS as f32;
        (0..STEPS).map(|i| noise_gradient(base + way * (i as f32 + 0.5)).dot(way)).sum()
    }

    #[test]
    fn the_gradient_is_that_of_one_height() {
        // Aim: relief is that of a surface, not arbitrary tilts. Method: the gradient summed along a way gives the same height by
        // whichever way: straight, or along the edges of the cell, on which it is known.
        for n in 0..50 {
            let at = Vec3::new(0.37 * n as f32 - 9.0, 0.73 * n as f32 - 20.0, 0.211 * n as f32 - 5.0);
            let mut sum = 0.0;
            let mut place = at.floor();
            for axis in 0..3 {
                let mut step = Vec3::ZERO;
                step[axis] = (at[axis] - place[axis]) / 2000.0;
                for _ in 0..2000 {
                    sum += noise_gradient(place + step * 0.5).dot(step);
                    place += step;
                }
            }
            assert!((sum - noise(at)).abs() < 2e-3, "{at}: {sum} and {}", noise(at));
        }
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_has_the_same_constants() {
        for line in [
            format!("STIPPLE_WIDTH: f32 = {STIPPLE_WIDTH:?};"),
            format!("STIPPLE_DEPTH: f32 = {STIPPLE_DEPTH:?};"),
            format!(
                "STIPPLE_TURN: mat3x3f = mat3x3f({});",
                STIPPLE_TURN.map(|v| format!("vec3f({:?}, {:?}, {:?})", v.x, v.y, v.z)).join(", ")
            ),
            format!("MARK_WIDTH: vec3f = vec3f({:?}, {:?}, {:?});", MARK_WIDTH.x, MARK_WIDTH.y, MARK_WIDTH.z),
            format!("MARK_DEPTH: f32 = {MARK_DEPTH:?};"),
            format!("MARK_SLOPE: vec2f = vec2f({:?}, {:?});", MARK_SLOPE[0], MARK_SLOPE[1]),
            format!("SMOOTH: f32 = {SMOOTH:?};"),
            format!("GROUND: f32 = {GROUND:?};"),
            format!("RIDGE_WIDTH: vec3f = vec3f({:?}, {:?}, {:?});", RIDGE_WIDTH.x, RIDGE_WIDTH.y, RIDGE_WIDTH.z),
            format!("RIDGE_DEPTH: f32 = {RIDGE_DEPTH:?};"),
            format!("ENAMEL_GLOSS: f32 = {ENAMEL_GLOSS:?};"),
            format!("ENAMEL_GLOSS_RANGE: f32 = {ENAMEL_GLOSS_RANGE:?};"),
            format!("FADE: vec2f = vec2f({:?}, {:?});", FADE[0], FADE[1]),
        ] {
            assert!(SOURCE.contains(&line), "{line}");
        }
    }

    #[test]
    fn relief_tilts_a_little_and_fades_before_it_is_finer_than_pixels() {
        // Aim: no surface turns away from the eye, on average it stays as it is, and far off nothing flickers. Method: normals of
        // 4 000 places near and far.
        let eye = |distance: f32| Relief { eye: Vec3::Z * distance, pixel: 0.001 };
        let (mut mean, mut most_tilted) = (Vec3::ZERO, 1.0_f32);
        for n in 0..4000 {
            let own = Vec3::new(0.171 * n as f32, 0.0937 * (n % 331) as f32, 0.0411 * (n % 97) as f32);
            let near = [
                eye(20.0).stippled(Vec3::ZERO, Vec3::Z, own, 1.0, |v| v),
                eye(20.0).of_tooth(Vec3::ZERO, Vec3::Z, own, 0.1, |v| v),
            ];
            // The ridges of a crown's side lie across the tooth's axis.
            let enamel = eye(20.0).of_enamel(Vec3::ZERO, Vec3::X, own, |v| v);
            assert!(enamel.is_normalized() && enamel.x > 0.99, "{enamel}");
            most_tilted = most_tilted.min(enamel.x);
            for normal in near {
                assert!(normal.is_normalized() && normal.z > 0.85, "{normal}");
                mean += normal / 8000.0;
            }
            assert_eq!(eye(20.0).of_tooth(Vec3::ZERO, Vec3::Z, own, 0.3, |v| v), Vec3::Z, "what shines is smooth");
            assert_eq!(eye(2000.0).stippled(Vec3::ZERO, Vec3::Z, own, 1.0, |v| v), Vec3::Z);
            assert_eq!(eye(2000.0).of_tooth(Vec3::ZERO, Vec3::Z, own, 0.1, |v| v), Vec3::Z);
            assert_eq!(eye(2000.0).of_enamel(Vec3::ZERO, Vec3::Z, own, |v| v), Vec3::Z);
        }
        assert!(most_tilted < 0.9999, "{most_tilted}");
        assert!(mean.truncate().length() < 0.01 && mean.z < 0.999, "{mean}");
    }
}
