//! Lips of the open mouth and the skin around them, which fades into the dark: from far off they tell where one is. Retractors hold
//! their corners aside.

use super::instrument::{STEEL, wire};
use glam::Mat3;
use std::f32::consts::TAU;
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_exercise::catalog::catmull_rom;
use typodont_render::{Appearance, MeshInstance, Rgb, VertexTint, Viewpoint};

/// Half the width of the opening, its corners held aside, mm.
const HALF_WIDTH: f32 = 37.0;

/// Distance by which the opening reaches beyond the incisors' edges of each jaw, mm: their whole crowns are seen.
const BEYOND_EDGES: f32 = 12.0;

/// Distance of the lips in front of the incisors' edges, mm.
const IN_FRONT: f32 = 8.0;

/// Radius of the face about the vertical, mm.
const FACE_RADIUS: f32 = 75.0;

/// Parts around the opening: six for each of the finest furrows.
const PARTS: usize = 432;

/// Exponents of the opening's outline along x and y, both 2 for an ellipse: it is even above and below, and pointed toward the corners
/// of the mouth.
const ROUNDNESS: [f32; 2] = [2.3, 1.45];

/// Height of the tubercle in the middle of the upper lip, and half its width, mm.
const TUBERCLE: f32 = 1.6;
const TUBERCLE_WIDTH: f32 = 6.0;

/// Outline of a section through lip and skin, from the inside of the lip outward: the distance beyond the opening's edge and the way
/// forward, mm, how much of it is lip rather than skin, and how bright it is.
const SECTION: [[f32; 4]; 21] = [
    [4.0, -9.0, 1.0, 0.55],
    [1.2, -6.5, 1.0, 0.68],
    [-0.2, -4.0, 1.0, 0.84],
    [-0.3, -2.0, 1.0, 0.95],
    [0.2, -0.4, 1.0, 1.0],
    [1.2, 0.8, 1.0, 1.0],
    [2.6, 1.5, 1.0, 1.0],
    [4.0, 1.5, 1.0, 0.98],
    [5.2, 1.1, 0.92, 0.97],
    [6.0, 0.9, 0.55, 0.98],
    [6.8, 0.9, 0.2, 1.0],
    [8.2, 0.7, 0.05, 0.98],
    [10.5, 0.2, 0.0, 0.93],
    [14.0, -0.6, 0.0, 0.85],
    [19.0, -1.6, 0.0, 0.72],
    [26.0, -2.8, 0.0, 0.54],
    [35.0, -4.4, 0.0, 0.36],
    [46.0, -6.5, 0.0, 0.2],
    [60.0, -10.0, 0.0, 0.08],
    [78.0, -16.0, 0.0, 0.0],
    [150.0, -40.0, 0.0, 0.0],
];

/// The row of the section at which the lip ends.
const LIP_ENDS: usize = 10;

/// Depth of the deepest furrow across the lips, mm, and the light that it loses.
const FURROW_DEPTH: f32 = 0.35;
const FURROW_SHADE: f32 = 0.11;

const LIP: Rgb = [0.68, 0.38, 0.36];
const SKIN: Rgb = [0.74, 0.58, 0.49];

/// Colour of the dark around the mouth, as it is drawn behind everything.
const DARK: Rgb = [0.10, 0.055, 0.05];

/// Gloss of dry lips and skin.
const GLOSS: f32 = 0.11;

/// Lips in world space.
#[derive(Clone, Debug)]
pub struct Lips {
    solid: MeshInstance,
    /// Half the height of the opening, mm; about the middle of the solid's own space.
    half_height: f32,
}

impl Lips {
    /// Around the edges of the incisors of the lower and the upper jaw, world space, mm; `front`: unit vector out of the mouth.
    pub fn around([lower, upper]: [Vec3; 2], front: Vec3) -> Lips {
        let orientation = orientation_of_mouth([lower, upper], front);
        let half_height = 0.5 * (upper - lower).dot(orientation * Vec3::Y).abs() + BEYOND_EDGES;
        // Before the edge that is farther in front.
        let ahead = lower.dot(front).max(upper.dot(front)) + IN_FRONT;
        let middle = lower.midpoint(upper);
        let middle = middle + front * (ahead - middle.dot(front));
        let (mesh, tints) = lip_mesh(half_height);
        let tints = tints.into_iter().map(VertexTint::smooth).collect();
        let appearance = Appearance { colour: [1.0; 3], gloss: GLOSS };
        let plain = MeshInstance::plain(Arc::new(mesh), Pose { position: middle, orientation }, appearance);
        let solid = MeshInstance { vertex_tints: Arc::new(tints), casts_shadow: false, ..plain };
        Lips { solid, half_height }
    }

    /// Retractors of wire that hold the corners of the mouth aside.
    pub fn retractors(&self) -> MeshInstance {
        /// One retractor's upper half: from its handle over the lip and behind its corner, the lips' own space, mm.
        const HALF: [[f32; 3]; 9] = [
            [84.0, 1.6, -36.0],
            [72.0, 2.2, -26.0],
            [60.0, 3.5, -17.0],
            [46.0, 8.5, -9.0],
            [38.0, 14.0, -5.0],
            [32.5, 16.0, -2.0],
            [29.5, 15.5, -7.0],
            [30.5, 12.5, -13.0],
            [34.0, 6.0, -17.0],
        ];
        const CORNER: [f32; 3] = [35.0, 0.0, -18.0];
        /// Radius of the wire, and the greatest distance between two of its rings, mm.
        const WIRE: f32 = 1.3;
        const FINENESS: f32 = 0.8;
        let lower = HALF.into_iter().rev().map(|[x, y, z]| [x, -y, z]);
        let knots: Vec<[f32; 3]> = HALF.into_iter().chain([CORNER]).chain(lower).collect();
        let wire_on = |side: f32| {
            let knots: Vec<Vec3> = knots.iter().map(|[x, y, z]| Vec3::new(side * x, *y, *z)).collect();
            wire(&catmull_rom(&knots, FINENESS), WIRE)
        };
        let mut mesh = wire_on(1.0);
        mesh.append(wire_on(-1.0));
        let plain = MeshInstance::plain(Arc::new(mesh), self.solid.world_from_solid, STEEL);
        MeshInstance { casts_shadow: false, ..plain }
    }

    /// End of the lips' inside in a direction from the middle of the opening, radians from +x toward +y: its place in world space, and
    /// its colour.
    pub(super) fn inner_edge(&self, turn: f32) -> (Vec3, Rgb) {
        let (place, colour) = section_at(turn, self.half_height).next().unwrap_or_default();
        (self.solid.world_from_solid * place, colour)
    }

    /// The lips, unless they would stand between an eye and what it looks at.
    pub fn seen_from(&self, viewpoint: &Viewpoint) -> Option<MeshInstance> {
        /// Share of the opening through which an eye looks past the lips.
        const CLEAR: f32 = 0.8;
        let own_from_world = self.solid.world_from_solid.inverse();
        let [eye, focus] = [viewpoint.position, viewpoint.focus].map(|place| own_from_world * place);
        if eye.z <= 0.0 || focus.z >= 0.0 {
            return None;
        }
        let through = eye.lerp(focus, eye.z / (eye.z - focus.z));
        let share = libm::hypotf(through.x / HALF_WIDTH, through.y / self.half_height);
        (share < CLEAR).then(|| self.solid.clone())
    }
}

/// Orientation of the open mouth: y from the lower to the upper incisors' edges, z forward. `front`: unit vector out of the mouth.
pub(super) fn orientation_of_mouth([lower, upper]: [Vec3; 2], front: Vec3) -> Quat {
    let up = (upper - lower).reject_from_normalized(front).normalize_or(Vec3::Y);
    Quat::from_mat3(&Mat3::from_cols(up.cross(front), up, front)).normalize()
}

/// A ring of sections around an oval opening in the plane z = 0, which looks toward +z, and its colours.
fn lip_mesh(half_height: f32) -> (Mesh, Vec<Rgb>) {
    let (mut positions, mut colours) = (Vec::new(), Vec::new());
    for part in 0..PARTS {
        for (place, colour) in section_at(TAU * part as f32 / PARTS as f32, half_height) {
            positions.push(place);
            colours.push(colour);
        }
    }
    let rows = SECTION.len();
    let corner = |part: usize, row: usize| ((part % PARTS) * rows + row) as u32;
    let mut triangles = Vec::new();
    for (part, row) in (0..PARTS).flat_map(|part| (0..rows - 1).map(move |row| (part, row))) {
        let [a, b, c, d] = [corner(part, row), corner(part, row + 1), corner(part + 1, row), corner(part + 1, row + 1)];
        triangles.extend([[a, b, c], [c, b, d]]);
    }
    let mut mesh = Mesh { positions, normals: Vec::new(), triangles };
    mesh.compute_normals();
    (mesh, colours)
}

/// Places and colours of the section in a direction from the middle of the opening, radians from +x toward +y; from the inside outward.
fn section_at(turn: f32, half_height: f32) -> impl Iterator<Item = (Vec3, Rgb)> {
    let (cos, sin) = (libm::cosf(turn), libm::sinf(turn));
    let radius = outline_radius([cos, sin]);
    let edge = Vec3::new(HALF_WIDTH * cos * radius, half_height * sin * radius, 0.0);
    let upper = libm::fmaxf(sin, 0.0);
    let edge = edge - Vec3::Y * TUBERCLE * upper * hill(edge.x, 0.0, TUBERCLE_WIDTH);
    // Outward, as the outline of an ellipse runs.
    let out = Vec3::new(cos / HALF_WIDTH, sin / half_height, 0.0).normalize_or(Vec3::X);
    let width = lip_share(edge.x, sin);
    let furrow = furrow_at(turn);
    let [lip_width, ..] = SECTION[LIP_ENDS];
    SECTION.into_iter().enumerate().map(move |(row, [beyond, forward, lip, light])| {
        let narrowed = if row <= LIP_ENDS { beyond * width } else { beyond - lip_width * (1.0 - width) };
        let place = edge + out * narrowed;
        let light = light * (1.0 - FURROW_SHADE * lip * furrow);
        let colour = |i: usize| DARK[i] + light * (SKIN[i] + lip * (LIP[i] - SKIN[i]) - DARK[i]);
        // The cheeks lie back from the lips' middle.
        let face = forward * width.sqrt() - place.x * place.x / (2.0 * FACE_RADIUS);
        let z = face - FURROW_DEPTH * lip * furrow + (1.0 - lip) * relief_of_skin(place, beyond, sin);
        (place.with_z(z), [colour(0), colour(1), colour(2)])
    })
}

/// Radius of the opening's outline in a direction, as a share of its half-widths.
fn outline_radius(direction: [f32; 2]) -> f32 {
    let [along_x, along_y] = direction.map(libm::fabsf);
    let [x, y] = ROUNDNESS;
    let is_within = |radius: f32| libm::powf(radius * along_x, x) + libm::powf(radius * along_y, y) < 1.0;
    let (mut low, mut high) = (0.5, 1.5);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if is_within(middle) { low = middle } else { high = middle }
    }
    low
}

/// Depth of the furrows across the lips in a direction from the middle of the opening, radians: 0 on the ridges between them to 1, some
/// close together and some apart.
fn furrow_at(turn: f32) -> f32 {
    let bent = turn + 0.035 * libm::sinf(9.0 * turn) + 0.02 * libm::sinf(23.0 * turn + 2.0);
    let wave = |count: f32, phase: f32| 0.5 + 0.5 * libm::sinf(count * bent + phase);
    let deep = 0.4 + 0.6 * wave(11.0, 0.7);
    deep * (0.6 * libm::powf(wave(47.0, 0.0), 3.0) + 0.4 * libm::powf(wave(71.0, 1.0), 2.0))
}

/// A hill of height 1 at a place and its mirror image, of a width; mm.
fn hill(x: f32, at: f32, width: f32) -> f32 {
    libm::expf(-libm::powf((libm::fabsf(x) - at) / width, 2.0))
}

/// Height of the skin over the face's even surface, mm: the two columns of the philtrum above the upper lip, and the fold between the
/// lower lip and the chin. `beyond`: way along the section, as in [`SECTION`]; `up`: above 0 for the upper lip.
fn relief_of_skin(place: Vec3, beyond: f32, up: f32) -> f32 {
    const COLUMNS: f32 = 1.1;
    const COLUMN_AT: f32 = 5.0;
    const COLUMN_WIDTH: f32 = 3.0;
    const COLUMN_MIDDLE: f32 = 13.0;
    const COLUMN_LENGTH: f32 = 8.0;
    const FOLD: f32 = 2.6;
    const FOLD_AT: f32 = 15.0;
    const FOLD_WIDTH: f32 = 5.0;
    const FOLD_LENGTH: f32 = 22.0;
    if up > 0.0 {
        let length = hill(beyond, COLUMN_MIDDLE, COLUMN_LENGTH);
        return up * length * COLUMNS * hill(place.x, COLUMN_AT, COLUMN_WIDTH);
    }
    up * FOLD * hill(beyond, FOLD_AT, FOLD_WIDTH) * hill(place.x, 0.0, FOLD_LENGTH)
}

/// Width of the lip as a share of the section's: narrow toward the corners, above with two peaks beside the middle. `x`: mm beside
/// the middle; `up`: above 0 for the upper lip.
fn lip_share(x: f32, up: f32) -> f32 {
    /// Distance of the peaks of the upper lip from the middle, and their width, mm.
    const PEAK: f32 = 7.0;
    const PEAK_WIDTH: f32 = 5.0;
    let corner = 1.0 - libm::powf(libm::fabsf(x) / HALF_WIDTH, 2.2).min(1.0);
    let middle = if up > 0.0 { 0.85 + 0.3 * hill(x, PEAK, PEAK_WIDTH) } else { 1.35 };
    // Never less than a line.
    libm::hypotf(middle * corner, 0.12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lips_have_corners_and_the_upper_one_a_dip() {
        // Aim: a mouth, not a ring. Method: sections of an opening 60 mm high, at its corner, above and below.
        let row = |turn: f32, row: usize| section_at(turn, 30.0).nth(row).unwrap().0;
        let edge = |turn: f32| row(turn, 4);
        let quarter = 0.25 * TAU;
        let width = |turn: f32| edge(turn).truncate().distance(row(turn, LIP_ENDS).truncate());
        assert!(width(0.0) < 0.2 * width(quarter), "{} mm at the corner, {} above", width(0.0), width(quarter));
        assert!(width(-quarter) > 1.3 * width(quarter), "the lower lip is the fuller one");
        let beside = edge(quarter - 0.22);
        assert!(edge(quarter).y < beside.y - 0.3, "the upper lip dips between {beside} and its twin");
        // Twice as far in from the corner, the opening is more than twice as high: pointed, and not round.
        let heights = [0.1, 0.2].map(|turn| edge(turn).y / (edge(0.0).x - edge(turn).x));
        assert!(heights[0] < 3.0 * heights[1], "{heights:?}");
        // The fold lies behind the lip and the chin.
        let [lip, fold, chin] = [8, 13, 16].map(|n| row(-quarter, n).z - SECTION[n][1]);
        assert!(fold < lip - 1.0 && fold < chin - 1.0, "{lip}, {fold} and {chin} mm");
    }

    #[test]
    fn lips_stand_around_the_teeth_and_never_before_them() {
        // Aim: seen from the front, away where they would hide the work. Method: incisors 40 mm apart; eyes in front, above, beside and
        // within the mouth; the surface looks forward.
        let lips = Lips::around([Vec3::ZERO, Vec3::new(0.0, 40.0, -4.0)], Vec3::Z);
        let looks = |eye: Vec3, focus: Vec3| lips.seen_from(&Viewpoint::look_at(eye, focus, Vec3::Y)).is_some();
        let middle = Vec3::new(0.0, 20.0, -20.0);
        assert!(looks(Vec3::new(0.0, 20.0, 200.0), middle), "from the front");
        assert!(looks(Vec3::new(30.0, 40.0, 150.0), middle), "a little from aside");
        assert!(!looks(Vec3::new(0.0, 150.0, 30.0), middle), "from above, past the upper lip");
        assert!(!looks(Vec3::new(120.0, 20.0, 10.0), middle), "through the cheek");
        assert!(!looks(Vec3::new(0.0, 20.0, 2.0), middle), "from within");
        let wire = lips.retractors().mesh;
        let [behind, before] = [f32::min, f32::max].map(|of| wire.positions.iter().map(|p| p.z).reduce(of).unwrap());
        assert!(behind < -15.0 && before > -2.0, "retractors go around the lip: {behind} to {before} mm");
        assert!(wire.positions.iter().all(|p| p.x.abs() > 27.0), "and stay beside the teeth");
        let mesh = &lips.solid.mesh;
        let forward = mesh.normals.iter().filter(|normal| normal.z > 0.0).count();
        assert!(forward * 10 > 7 * mesh.normals.len(), "{forward} of {} look forward", mesh.normals.len());
        let nearest = mesh.positions.iter().map(|p| libm::hypotf(p.x, p.y)).fold(f32::INFINITY, f32::min);
        assert!(nearest > 30.0, "{nearest} mm");
    }
}
