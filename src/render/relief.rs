//! Fine relief of surfaces: stippled gingiva, the ridges of enamel, the marks of burs on a tooth, and what is rough by itself, such as
//! decay and calculus. It tilts their normals, and moves nothing. And hairline cracks in enamel that nobody cut.
//!
//! Takes a seed and a place of the surface's own space, mm. Gives the gradient of a height, and a colour. Twin of `relief.wgsl`.

use super::eye::Eye;
use super::scene::{Appearance, Rgb};
use typodont_core::frame::{Vec3, smooth_step};

#[cfg(feature = "gpu")]
pub const SOURCE: &str = include_str!("../../shaders/relief.wgsl");

/// Width of a dimple of stippled gingiva, and by how much it is lower or higher than the mean, mm. Dimples are half a millimetre to a
/// millimetre apart; their depth is chosen by eye.
const STIPPLE_WIDTH: f32 = 0.55;
const STIPPLE_DEPTH: f32 = 0.03;

/// Width of the dimples of a second lattice that are as steep, mm: of two together, no row is seen.
const STIPPLE_FINE_WIDTH: f32 = 0.4;

/// Columns of the rotation of the first lattice of dimples, and rows of that of the second: no row of dimples lies along the arch.
const STIPPLE_TURN: [Vec3; 3] = [Vec3::new(0.36, -0.8, 0.48), Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.8, 0.0, 0.6)];

/// Width of the marks of a bur across the tooth's axis and along it, and by how much they are lower or higher than the mean, mm: wider than they are, so that they are seen at the
/// magnification of a lesson, and faint.
const MARK_WIDTH: Vec3 = Vec3::new(0.38, 0.38, 0.17);
const MARK_DEPTH: f32 = 0.007;

/// Rise of the marks across the tooth's axis, mm per mm: a hand does not hold a bur upright.
const MARK_SLOPE: [f32; 2] = [0.35, -0.22];

/// Gloss of tissue that is smooth, and of tissue with all of the marks of a bur.
const SMOOTH: f32 = 0.19;
pub const GROUND_GLOSS: f32 = 0.13;

/// Width of the ridges of enamel that nobody cut (perikymata) across the tooth's axis and along it, and by how much they are lower or
/// higher than the mean, mm. Real ones are 0.03 to 0.15 mm apart and about a micrometre high; these are seen at a lesson's magnification.
const RIDGE_WIDTH: Vec3 = Vec3::new(1.1, 1.1, 0.13);
const RIDGE_DEPTH: f32 = 0.0013;

/// Gloss of such enamel under a film of saliva: what has it has ridges and cracks. And the difference from it at which there are none.
pub const ENAMEL_GLOSS: f32 = 0.2;
const ENAMEL_GLOSS_RANGE: f32 = 0.01;

/// Width of a hairline crack of enamel, mm: real ones are finer, and these are seen at a lesson's magnification. And the distance between
/// two sheets in which cracks lie, mm.
const CRACK_WIDTH: f32 = 0.04;
const CRACK_SPREAD: f32 = 4.3;

/// Normals of the sheets of both kinds, across the tooth's axis: cracks run from the edge of a crown toward its neck.
const CRACK_ACROSS: [Vec3; 2] = [Vec3::new(0.94, 0.34, 0.0), Vec3::new(-0.42, 0.91, 0.0)];

/// Number of seeds that have their sheets at places of their own, and the share of the distance between sheets by which the next seed's
/// are shifted.
const CRACK_SHIFTS: u16 = 512;
const GOLDEN_SHARE: f32 = 0.618034;

/// Width and height of a sheet's bends, mm.
const CRACK_BEND: [f32; 2] = [2.3, 0.35];

/// Distances from the middle of a crack, as shares of its width, between which it fades.
const CRACK_EDGE: [f32; 2] = [0.15, 0.5];

/// Width of a crack in pixels up to which it is drawn wider than it is, and paler, so that it is a line and no row of dots; and pixels, mm,
/// from which on it is left out.
const CRACK_PIXELS: f32 = 1.5;
const CRACK_GONE: [f32; 2] = [0.1, 0.2];

/// Size of the parts of enamel that have cracks of one kind, mm; the noise from which on they begin, and at which they are whole.
const CRACKED_PART: f32 = 3.7;
const CRACKED_FROM: [f32; 2] = [0.15, 0.35];

/// Cosines between a sheet's and the surface's normal: from the first on the crack fades, and at the second it has faded. A sheet that
/// lies along the surface would be a stain.
const CRACK_FLAT: [f32; 2] = [0.6, 0.85];

/// The same for the tooth's axis and the surface's normal: on slopes toward the fissures cracks would look like hairs.
const CRACK_TOP: [f32; 2] = [0.4, 0.65];

/// Share of the colour that a crack leaves.
const CRACK_TINT: Rgb = [0.91, 0.88, 0.84];

/// Cosine between the normal and the way to the eye at which cracks are too narrow to be seen: normals are turned to the eye up to there
/// (`turned_to_eye`).
const CRACK_EDGE_ON: f32 = 0.4;

/// Size of a pixel, as a share of the relief's width, up to which relief is drawn whole, and from which on not at all.
const FADE: [f32; 2] = [0.3, 0.8];

/// Relief as one picture shows it: nothing that is finer than its pixels.
#[derive(Clone, Copy, Debug)]
pub struct Relief {
    /// World space, mm.
    eye: Vec3,
    /// Width of a pixel at a distance of 1 mm, mm.
    pixel: f32,
    noise: ReliefNoise,
}

impl Relief {
    /// Relief of a seed as an eye sees it in a picture of a width in pixels.
    pub fn seen_by(eye: &Eye, width: u32, seed: u16) -> Relief {
        let pixel = (eye.window.right - eye.window.left) / width as f32;
        Relief { eye: eye.position, pixel, noise: ReliefNoise::new(seed) }
    }

    /// Unit normal at a point of stippled gingiva. `own`: the point in the mesh's own space; `to_world` rotates from there;
    /// `share`: how much of the stippling it has, 0 to 1.
    pub fn stippled(&self, point: Vec3, normal: Vec3, own: Vec3, share: f32, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        let share = share * resolved(self.pixel_at(point), STIPPLE_FINE_WIDTH);
        if share <= 0.0 {
            return normal;
        }
        let [x, y, z] = STIPPLE_TURN;
        let turned = |v: Vec3| x * v.x + y * v.y + z * v.z;
        let turned_back = |v: Vec3| Vec3::new(v.dot(x), v.dot(y), v.dot(z));
        let (_, coarse) = self.noise.at(turned(own) / STIPPLE_WIDTH);
        let (_, fine) = self.noise.at(turned_back(own) / STIPPLE_FINE_WIDTH);
        let gradient = (turned_back(coarse) + turned(fine)) * (STIPPLE_DEPTH / STIPPLE_WIDTH);
        tilted(normal, to_world(gradient) * share)
    }

    /// Unit normal at a point of a tooth whose surface has a gloss: the duller, the rougher. `own`: the point in millimetres along
    /// the axes of the volume.
    pub fn of_tooth(&self, point: Vec3, normal: Vec3, own: Vec3, gloss: f32, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        marked(normal, tooth_gradient(self.noise, own, gloss, self.pixel_at(point)), to_world)
    }

    /// Unit normal at a point of another tooth's enamel. `own`: the point in the mesh's own space.
    pub fn of_enamel(&self, point: Vec3, normal: Vec3, own: Vec3, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
        self.of_tooth(point, normal, own, ENAMEL_GLOSS, to_world)
    }

    /// Appearance of a tooth's surface at a point with a unit normal, with the cracks of its enamel. `own`: the point in millimetres along
    /// the axes of the volume, or in the mesh's own space; `to_own` rotates to there.
    pub fn cracked(
        &self,
        point: Vec3,
        normal: Vec3,
        appearance: Appearance,
        own: Vec3,
        to_own: impl Fn(Vec3) -> Vec3,
    ) -> Appearance {
        let eye_cosine = normal.dot((self.eye - point).normalize_or_zero());
        cracked(self.noise, appearance, own, to_own(normal), covered(self.pixel_at(point), eye_cosine))
    }

    /// Width of a pixel at a point, mm.
    fn pixel_at(&self, point: Vec3) -> f32 {
        (point - self.eye).length() * self.pixel
    }
}

/// A place of a tooth's surface in a picture.
#[derive(Clone, Copy, Debug)]
pub struct SeenPlace {
    /// In millimetres along the axes of the volume, along which the normal lies, too.
    pub place: Vec3,
    pub normal: Vec3,
    /// Width of a pixel, mm, and the cosine between the normal and the way to the eye.
    pub pixel: f32,
    pub eye_cosine: f32,
}

/// Appearance and unit normal of a tooth's surface with the relief of a seed.
pub fn tooth_in_relief(seed: u16, appearance: Appearance, seen: SeenPlace) -> (Appearance, Vec3) {
    let SeenPlace { place, normal, pixel, eye_cosine } = seen;
    let noise = ReliefNoise::new(seed);
    let gradient = tooth_gradient(noise, place, appearance.gloss, pixel);
    (cracked(noise, appearance, place, normal, covered(pixel, eye_cosine)), marked(normal, gradient, |v| v))
}

/// Unit normal of a surface with a relief whose gradient is zero where there is none.
fn marked(normal: Vec3, gradient: Vec3, to_world: impl Fn(Vec3) -> Vec3) -> Vec3 {
    match gradient {
        Vec3::ZERO => normal,
        gradient => tilted(normal, to_world(gradient)),
    }
}

/// Width of a surface that a pixel covers, mm, where the eye sees it from aside.
fn covered(pixel: f32, eye_cosine: f32) -> f32 {
    pixel / ((eye_cosine - CRACK_EDGE_ON) / (1.0 - CRACK_EDGE_ON)).max(0.01)
}

/// Share of a surface with a gloss that is enamel which nobody cut.
fn uncut_share(gloss: f32) -> f32 {
    1.0 - ((gloss - ENAMEL_GLOSS).abs() / ENAMEL_GLOSS_RANGE).clamp(0.0, 1.0)
}

/// Appearance of a tooth's surface with the hairline cracks of its enamel, which lie in bent sheets along the tooth's axis.
fn cracked(noise: ReliefNoise, appearance: Appearance, place: Vec3, normal: Vec3, pixel: f32) -> Appearance {
    let ramp = |[from, to]: [f32; 2], value: f32| smooth_step((value - from) / (to - from));
    let uncut = uncut_share(appearance.gloss) * (1.0 - ramp(CRACK_GONE, pixel));
    if uncut <= 0.0 {
        return appearance;
    }
    let width = CRACK_WIDTH.max(CRACK_PIXELS * pixel);
    let (part, _) = noise.at(Vec3::new(place.z, place.x, place.y) / CRACKED_PART);
    let across = CRACK_ACROSS[usize::from(part < 0.0)];
    let (bend, _) = noise.at(Vec3::new(place.y, place.z, place.x) / CRACK_BEND[0]);
    let sheets = (place.dot(across) + CRACK_BEND[1] * bend) / CRACK_SPREAD + noise.shift;
    let away = CRACK_SPREAD * (sheets - sheets.floor() - 0.5).abs();
    // Cracks end in a point.
    let whole = ramp(CRACKED_FROM, part.abs());
    let line = 1.0 - ramp(CRACK_EDGE, away / (width * whole.max(0.01)));
    let seen = uncut * CRACK_WIDTH / width;
    let steep = 1.0 - ramp(CRACK_FLAT, normal.dot(across).abs());
    let share = seen * line * whole * steep * (1.0 - ramp(CRACK_TOP, normal.z));
    let colour = std::array::from_fn(|c| appearance.colour[c] * (1.0 + share * (CRACK_TINT[c] - 1.0)));
    Appearance { colour, ..appearance }
}

/// Gradient of the height of a tooth's surface at a place: zero where it is smooth or pixels are too wide.
fn tooth_gradient(noise: ReliefNoise, place: Vec3, gloss: f32, pixel: f32) -> Vec3 {
    let marks = ((SMOOTH - gloss) / (SMOOTH - GROUND_GLOSS)).clamp(0.0, 1.0);
    let ridges = uncut_share(gloss);
    let (width, slope, depth) = match marks > 0.0 {
        true => (MARK_WIDTH, MARK_SLOPE, MARK_DEPTH * marks),
        false => (RIDGE_WIDTH, [0.0; 2], RIDGE_DEPTH * ridges),
    };
    let depth = depth * resolved(pixel, width.z);
    if depth <= 0.0 {
        return Vec3::ZERO;
    }
    let inclined = place.with_z(place.z + slope[0] * place.x + slope[1] * place.y);
    let gradient = noise.at(inclined / width).1 / width;
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

/// Random values of a seed on a lattice of whole numbers, interpolated between them.
#[derive(Clone, Copy, Debug)]
struct ReliefNoise {
    seed: u32,
    /// Shift of the sheets of cracks, as a share of the distance between them.
    shift: f32,
}

impl ReliefNoise {
    fn new(seed: u16) -> ReliefNoise {
        ReliefNoise {
            seed: u32::from(seed).wrapping_mul(0x27D4_EB2F),
            shift: f32::from(seed % CRACK_SHIFTS) * GOLDEN_SHARE,
        }
    }

    /// Value of a lattice point, −1 to 1 (the finalizer of MurmurHash3).
    fn lattice_value(self, x: u32, y: u32, z: u32) -> f32 {
        let mut hash = x ^ y ^ z ^ self.seed;
        hash = (hash ^ hash >> 16).wrapping_mul(0x85EB_CA6B);
        hash = (hash ^ hash >> 13).wrapping_mul(0xC2B2_AE35);
        (hash >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
    }

    /// Value at a place, and its gradient.
    fn at(self, at: Vec3) -> (f32, Vec3) {
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
        let value = |i: usize, j: usize, k: usize| self.lattice_value(x[i], y[j], z[k]);
        let row = |j: usize, k: usize| [value(0, j, k), value(1, j, k)];
        let rows = [row(0, 0), row(1, 0), row(0, 1), row(1, 1)];
        let [a, b, c, d] = rows.map(|[first, last]| last - first);
        let along_x = mix(mix(a, b, share.y), mix(c, d, share.y), share.z);
        let [a, b, c, d] = rows.map(|[first, last]| mix(first, last, share.x));
        let along_y = mix(b - a, d - c, share.z);
        let [near, far] = [mix(a, b, share.y), mix(c, d, share.y)];
        (mix(near, far, share.z), rise * Vec3::new(along_x, along_y, far - near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: u16 = 7;

    #[test]
    fn the_gradient_is_that_of_one_height() {
        // Aim: relief is that of a surface, not arbitrary tilts. Method: the gradient summed along the edges of a cell gives the
        // difference of the values at both ends.
        let noise = ReliefNoise::new(SEED);
        for n in 0..50 {
            let at = Vec3::new(0.37 * n as f32 - 9.0, 0.73 * n as f32 - 20.0, 0.211 * n as f32 - 5.0);
            let mut sum = noise.at(at.floor()).0;
            let mut place = at.floor();
            for axis in 0..3 {
                let mut step = Vec3::ZERO;
                step[axis] = (at[axis] - place[axis]) / 2000.0;
                for _ in 0..2000 {
                    sum += noise.at(place + step * 0.5).1.dot(step);
                    place += step;
                }
            }
            assert!((sum - noise.at(at).0).abs() < 2e-3, "{at}: {sum} and {}", noise.at(at).0);
        }
    }

    #[test]
    fn enamel_has_a_few_hairline_cracks_of_its_seed() {
        // Aim: cracks are fine, few and other ones for another seed, and are not where enamel was cut or pixels are too wide. Method:
        // the darkened share of 10 mm by 8 mm of a crown's side.
        let enamel = Appearance { colour: [0.9; 3], gloss: ENAMEL_GLOSS };
        let lines = |seed: u16, appearance: Appearance, pixel: f32| -> Vec<bool> {
            let places = (0..500).flat_map(|y| (0..400).map(move |z| Vec3::new(5.0, 0.02 * y as f32, 0.02 * z as f32)));
            let seen = |place| SeenPlace { place, normal: Vec3::X, pixel, eye_cosine: 1.0 };
            let colour = |place| tooth_in_relief(seed, appearance, seen(place)).0.colour;
            places.map(|place| colour(place)[2] < 0.99 * appearance.colour[2]).collect()
        };
        let share = |lines: &[bool]| lines.iter().filter(|is_crack| **is_crack).count() as f32 / lines.len() as f32;
        let all: Vec<Vec<bool>> = (0..20).map(|seed| lines(seed, enamel, 0.01)).collect();
        let shares: Vec<f32> = all.iter().map(|lines| share(lines)).collect();
        let mean = shares.iter().sum::<f32>() / shares.len() as f32;
        assert!((0.001..0.02).contains(&mean), "{shares:?}");
        assert!(shares.iter().all(|share| *share < 0.04), "{shares:?}");
        assert!(all.iter().skip(1).all(|lines| *lines != all[0]), "each seed has its own");
        assert_eq!(share(&lines(1, Appearance { gloss: GROUND_GLOSS, ..enamel }, 0.01)), 0.0, "none where it was cut");
        assert_eq!(share(&lines(1, enamel, CRACK_GONE[1])), 0.0, "none that are too fine");
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_has_the_same_constants() {
        for line in [
            format!("STIPPLE_WIDTH: f32 = {STIPPLE_WIDTH:?};"),
            format!("STIPPLE_DEPTH: f32 = {STIPPLE_DEPTH:?};"),
            format!("STIPPLE_FINE_WIDTH: f32 = {STIPPLE_FINE_WIDTH:?};"),
            format!(
                "STIPPLE_TURN: mat3x3f = mat3x3f({});",
                STIPPLE_TURN.map(|v| format!("vec3f({:?}, {:?}, {:?})", v.x, v.y, v.z)).join(", ")
            ),
            format!("MARK_WIDTH: vec3f = vec3f({:?}, {:?}, {:?});", MARK_WIDTH.x, MARK_WIDTH.y, MARK_WIDTH.z),
            format!("MARK_DEPTH: f32 = {MARK_DEPTH:?};"),
            format!("MARK_SLOPE: vec2f = vec2f({:?}, {:?});", MARK_SLOPE[0], MARK_SLOPE[1]),
            format!("SMOOTH: f32 = {SMOOTH:?};"),
            format!("GROUND: f32 = {GROUND_GLOSS:?};"),
            format!("RIDGE_WIDTH: vec3f = vec3f({:?}, {:?}, {:?});", RIDGE_WIDTH.x, RIDGE_WIDTH.y, RIDGE_WIDTH.z),
            format!("RIDGE_DEPTH: f32 = {RIDGE_DEPTH:?};"),
            format!("ENAMEL_GLOSS: f32 = {ENAMEL_GLOSS:?};"),
            format!("ENAMEL_GLOSS_RANGE: f32 = {ENAMEL_GLOSS_RANGE:?};"),
            format!("CRACK_WIDTH: f32 = {CRACK_WIDTH:?};"),
            format!("CRACK_SPREAD: f32 = {CRACK_SPREAD:?};"),
            format!(
                "CRACK_ACROSS: mat2x3f = mat2x3f({});",
                CRACK_ACROSS.map(|v| format!("vec3f({:?}, {:?}, {:?})", v.x, v.y, v.z)).join(", ")
            ),
            format!("CRACK_SHIFTS: u32 = {CRACK_SHIFTS}u;"),
            format!("GOLDEN_SHARE: f32 = {GOLDEN_SHARE:?};"),
            format!("CRACK_BEND: vec2f = vec2f({:?}, {:?});", CRACK_BEND[0], CRACK_BEND[1]),
            format!("CRACK_EDGE: vec2f = vec2f({:?}, {:?});", CRACK_EDGE[0], CRACK_EDGE[1]),
            format!("CRACK_PIXELS: f32 = {CRACK_PIXELS:?};"),
            format!("CRACK_GONE: vec2f = vec2f({:?}, {:?});", CRACK_GONE[0], CRACK_GONE[1]),
            format!("CRACK_TOP: vec2f = vec2f({:?}, {:?});", CRACK_TOP[0], CRACK_TOP[1]),
            format!("CRACK_EDGE_ON: f32 = {CRACK_EDGE_ON:?};"),
            format!("CRACK_FLAT: vec2f = vec2f({:?}, {:?});", CRACK_FLAT[0], CRACK_FLAT[1]),
            format!("CRACKED_PART: f32 = {CRACKED_PART:?};"),
            format!("CRACKED_FROM: vec2f = vec2f({:?}, {:?});", CRACKED_FROM[0], CRACKED_FROM[1]),
            format!("CRACK_TINT: vec3f = vec3f({:?}, {:?}, {:?});", CRACK_TINT[0], CRACK_TINT[1], CRACK_TINT[2]),
            format!("FADE: vec2f = vec2f({:?}, {:?});", FADE[0], FADE[1]),
        ] {
            assert!(SOURCE.contains(&line), "{line}");
        }
    }

    #[test]
    fn relief_tilts_a_little_and_fades_before_it_is_finer_than_pixels() {
        // Aim: no surface turns away from the eye, on average it stays as it is, and far off nothing flickers. Method: normals of
        // 4 000 places near and far.
        let eye = |distance: f32| Relief { eye: Vec3::Z * distance, pixel: 0.001, noise: ReliefNoise::new(SEED) };
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
