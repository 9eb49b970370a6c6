//! The inside of the open mouth behind the teeth, as it is seen from in front: the cheeks from the lips on, the throat, and the tongue at
//! rest.
//!
//! Takes the arch spaces of both jaws in world space, mm. Forms and colours are estimates from photographs of open mouths; none of it
//! is touched.

use super::lips::{Lips, orientation_of_mouth};
use std::f32::consts::PI;
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3, smooth_step};
use typodont_core::mesh::Mesh;
use typodont_exercise::catalog::catmull_rom;
use typodont_render::{Appearance, MeshInstance, Rgb, VertexTint};

/// Outline of the cheeks and the throat in plan, from behind the corner of the mouth to the midline: the distance from the midline and behind
/// the incisors' edges, mm, and how bright it is.
const WALL: [[f32; 3]; 12] = [
    [43.0, 15.0, 0.85],
    [40.5, 18.0, 0.92],
    [38.0, 22.0, 1.00],
    [37.3, 28.0, 1.00],
    [37.0, 34.0, 0.95],
    [36.0, 46.0, 0.80],
    [33.0, 56.0, 0.62],
    [28.0, 61.0, 0.56],
    [22.0, 63.2, 0.62],
    [16.0, 64.6, 0.74],
    [8.0, 65.6, 0.84],
    [0.0, 66.0, 0.86],
];

/// Reach of the teeth of average arches aside and back, mm: those of wider and longer ones move the wall.
const AVERAGE_TEETH: [f32; 2] = [32.0, 50.0];

/// Half the height of the wall at the lips and at the throat, mm, and by how much the soft palate arches forward to the hard one.
const HALF_HEIGHTS: [f32; 2] = [46.0, 30.0];
const LEAN: f32 = 40.0;

/// By how much the cheek bulges between the rows of teeth, and half the height of the bulge; by how much it turns in toward the gums,
/// and the heights over the middle between which it does, mm.
const BULGE: [f32; 2] = [4.0, 9.0];
const TURNS_IN: f32 = 5.0;
const TURNING: [f32; 2] = [16.0, 36.0];

/// Height at which the soft palate ends, as a share of half the wall's height; half the width of the uvula, mm, and how much lower it
/// reaches.
const PALATE_ENDS: f32 = 0.12;
const UVULA: [f32; 2] = [3.4, 0.34];

/// The arch under which the throat opens: half its width, mm, the height of its middle and half its height, as shares of half the
/// wall's; the depth of the throat behind it, mm, and how bright that is.
const ARCH: [f32; 3] = [17.0, -0.55, 0.70];
const THROAT_DEPTH: f32 = 12.0;
const THROAT_LIGHT: f32 = 0.22;

/// Rows of the wall from below upward.
const WALL_ROWS: usize = 64;

/// The pouch of the cheek between the wall and the inside of the lips: how far around the lips it reaches from the corner of the mouth,
/// radians, the ways in which its curve leaves the wall and comes to the lips (aside and ahead, mm), and its columns.
const LIPS_TURN: f32 = 1.05;
const POUCH: [[f32; 2]; 2] = [[8.0, 9.0], [10.0, -4.0]];
const LIP_STEPS: usize = 10;

/// Greatest distance between two columns of the wall, mm.
const WALL_STEP: f32 = 1.0;

/// Outline of the tongue from its tip backward: the distance behind the incisors' edges, half its width and the height of its back
/// over the occlusal plane of the lower jaw, mm.
const TONGUE: [[f32; 3]; 8] = [
    [9.0, 0.3, -9.0],
    [9.7, 5.0, -6.8],
    [12.0, 8.0, -4.6],
    [18.0, 11.5, -2.4],
    [28.0, 15.5, 0.2],
    [40.0, 18.5, 3.2],
    [52.0, 20.5, 5.5],
    [70.0, 20.5, 3.0],
];

/// Height of the tongue's edges below its back, as a share of half its width, and the lowest that is drawn, mm.
const TONGUE_ROUND: f32 = 0.72;
const TONGUE_LOWEST: f32 = -17.0;

/// Greatest distance between two columns of the tongue, mm, and the places across it.
const TONGUE_STEP: f32 = 1.5;
const TONGUE_ROWS: usize = 33;

/// Depth of the furrow along the tongue's middle and half its width, mm.
const FURROW: [f32; 2] = [1.1, 2.2];

const MUCOSA: Rgb = [0.76, 0.39, 0.37];
const TONGUE_SIDE: Rgb = [0.76, 0.42, 0.41];
/// The papillae of its back are pale.
const TONGUE_BACK: Rgb = [0.80, 0.52, 0.50];

/// Gloss of the tongue, whose papillae make it matt, and of what lies in the dark behind it.
const GLOSS: f32 = 0.11;
const WALL_GLOSS: f32 = 0.08;

/// Solids behind the teeth, world space.
#[derive(Clone, Debug)]
pub struct OralCavity {
    wall: MeshInstance,
    tongue: MeshInstance,
}

impl OralCavity {
    /// `lips`: around both jaws. `front`: unit vector out of the mouth. `teeth`: their reach aside and back in both jaws, arch space, mm.
    pub fn between(
        world_from_lower: Pose,
        world_from_upper: Pose,
        lips: &Lips,
        front: Vec3,
        teeth: [f32; 2],
    ) -> OralCavity {
        let [lower, upper] = [world_from_lower, world_from_upper].map(|arch| arch.position);
        let middle = Pose { position: lower.midpoint(upper), orientation: orientation_of_mouth([lower, upper], front) };
        let middle_from_world = middle.inverse();
        let at_lips = |turn: f32| {
            let (place, colour) = lips.inner_edge(turn);
            (middle_from_world * place, colour)
        };
        OralCavity {
            wall: solid(wall_mesh(teeth, &at_lips), middle, WALL_GLOSS),
            tongue: solid(tongue_mesh(), world_from_lower, GLOSS),
        }
    }

    /// All of it, or without the tongue.
    pub fn solids(&self, has_tongue: bool) -> impl Iterator<Item = MeshInstance> {
        std::iter::once(self.wall.clone()).chain(has_tongue.then(|| self.tongue.clone()))
    }
}

fn solid((mesh, tints): (Mesh, Vec<VertexTint>), world_from_solid: Pose, gloss: f32) -> MeshInstance {
    let plain = MeshInstance::plain(Arc::new(mesh), world_from_solid, Appearance { colour: [1.0; 3], gloss });
    MeshInstance { vertex_tints: Arc::new(tints), casts_shadow: false, ..plain }
}

/// Cheeks and throat as a curtain around the jaws, from the left corner of the mouth to the right one: x aside, y up, z out of the
/// mouth. `at_lips`: place and colour of the lips' inner edge in a direction from the middle of the opening, radians from +x toward +y.
fn wall_mesh(teeth: [f32; 2], at_lips: &dyn Fn(f32) -> (Vec3, Rgb)) -> (Mesh, Vec<VertexTint>) {
    let [wider, longer] = [0, 1].map(|i| (teeth[i] - AVERAGE_TEETH[i]).max(0.0));
    let outline = WALL.map(|[aside, behind, light]| {
        // Neither the corners of the mouth nor the throat are wider.
        let beside = smooth_step((behind - 12.0) / 10.0) * smooth_step(aside / 30.0);
        Vec3::new(aside + wider * beside, behind + longer * smooth_step((behind - 30.0) / 20.0), light)
    });
    let half = catmull_rom(&outline, WALL_STEP);
    let left = half.iter().map(|place| place.with_x(-place.x));
    let outline: Vec<Vec3> = left.chain(half.iter().rev().skip(1).copied()).collect();
    let heights = (0..=WALL_ROWS).map(|row| 2.0 * row as f32 / WALL_ROWS as f32 - 1.0);
    let to_lips = |on_outline: Vec3, share: f32, height: f32| {
        let (from, from_colour) = wall_corner(on_outline, height);
        let turn = LIPS_TURN * height;
        let (to, to_colour) = at_lips(if from.x > 0.0 { turn } else { PI - turn });
        // A cubic curve that goes on as the wall does and comes to the lips from aside.
        let rest = 1.0 - share;
        let [wall_way, lips_way] = POUCH.map(|[aside, ahead]| Vec3::new(aside * from.x.signum(), 0.0, ahead));
        let place = from.lerp(to, share * share * (3.0 - 2.0 * share))
            + wall_way * (share * rest * rest)
            + lips_way * (share * share * rest);
        let mix = |a: f32, b: f32| a + (b - a) * smooth_step(share);
        (place, std::array::from_fn(|c| mix(from_colour[c], to_colour[c])))
    };
    let (right, left) = (half[0], half[0].with_x(-half[0].x));
    let shares = (1..=LIP_STEPS).map(|step| step as f32 / LIP_STEPS as f32);
    let mut corners: Vec<(Vec3, Rgb)> = Vec::new();
    for share in shares.clone().rev() {
        corners.extend(heights.clone().map(|height| to_lips(left, share, height)));
    }
    for &on_outline in &outline {
        corners.extend(heights.clone().map(|height| wall_corner(on_outline, height)));
    }
    for share in shares {
        corners.extend(heights.clone().map(|height| to_lips(right, share, height)));
    }
    let tints = corners.iter().map(|(_, colour)| VertexTint::smooth(*colour)).collect();
    let positions = corners.into_iter().map(|(place, _)| place).collect();
    (sheet(positions, outline.len() + 2 * LIP_STEPS, WALL_ROWS + 1), tints)
}

/// Place and colour of the wall over a place of its outline, at a height from −1 below to 1 above.
fn wall_corner(Vec3 { x, y: behind, z: light }: Vec3, height: f32) -> (Vec3, Rgb) {
    let back = smooth_step((behind - 30.0) / 35.0);
    let y = height * (HALF_HEIGHTS[0] + (HALF_HEIGHTS[1] - HALF_HEIGHTS[0]) * back);
    // The throat opens under an arch, in whose middle the uvula hangs.
    let [half_width, middle, arch_height] = ARCH;
    let from_middle = libm::hypotf(x / half_width, (height - middle) / arch_height);
    let beside_uvula =
        1.0 - libm::expf(-(x / UVULA[0]) * (x / UVULA[0])) * smooth_step((height - PALATE_ENDS + UVULA[1]) / 0.14);
    let throat = back * beside_uvula * (1.0 - smooth_step((from_middle - 0.8) / 0.3));
    // The soft palate arches between the molars: upright where it hangs, level where it meets the hard palate.
    let soft = back * (1.0 - smooth_step((x.abs() - 10.0) / 22.0));
    let up_palate = ((height - PALATE_ENDS) / (1.0 - PALATE_ENDS)).clamp(0.0, 1.0);
    let forward = LEAN * soft * (1.0 - (1.0 - up_palate * up_palate).sqrt()) - THROAT_DEPTH * throat;
    let cheek = smooth_step((behind - 16.0) / 8.0) * (1.0 - smooth_step((behind - 34.0) / 26.0));
    let turn = cheek * smooth_step((y.abs() - TURNING[0]) / (TURNING[1] - TURNING[0]));
    let inward = BULGE[0] * cheek * libm::expf(-(y / BULGE[1]) * (y / BULGE[1])) + TURNS_IN * turn;
    let place = Vec3::new(x - x.signum() * inward, y, forward - behind);
    // The fold toward the gums is in the shade.
    let shade = (1.0 - 0.3 * turn) * (1.0 - 0.1 * soft * smooth_step(up_palate / 0.9));
    let light = (light + (THROAT_LIGHT - light) * throat) * shade;
    let tint = mucosa_tint(place);
    (place, std::array::from_fn(|c| MUCOSA[c] * tint[c] * light))
}

/// The tongue in the lower jaw's arch space.
fn tongue_mesh() -> (Mesh, Vec<VertexTint>) {
    let outline = catmull_rom(&TONGUE.map(Vec3::from), TONGUE_STEP);
    let (mut positions, mut tints) = (Vec::new(), Vec::new());
    for &Vec3 { x: y, y: half_width, z: top } in &outline {
        for row in 0..TONGUE_ROWS {
            // From one lower edge over the back to the other; the back is flatter than a circle.
            let turn = PI * (row as f32 / (TONGUE_ROWS - 1) as f32 - 0.5) * 1.25;
            let (sin, cos) = (libm::sinf(turn), libm::cosf(turn));
            let x = -half_width * libm::copysignf(libm::powf(sin.abs(), 0.85), sin);
            let drop = TONGUE_ROUND * half_width * (1.0 - libm::copysignf(libm::powf(cos.abs(), 0.7), cos));
            let [depth, width] = FURROW;
            let behind_tip = smooth_step((y - 11.0) / 14.0) * (1.0 - 0.8 * smooth_step((y - 34.0) / 16.0));
            let furrow = depth * behind_tip * libm::expf(-(x / width) * (x / width));
            positions.push(Vec3::new(x, y, (top - drop - furrow).max(TONGUE_LOWEST)));
            let coat = smooth_step((cos - 0.25) / 0.6) * smooth_step((y - 10.0) / 10.0);
            let dark = 1.0 - 0.45 * smooth_step((y - 34.0) / 36.0);
            let colour = std::array::from_fn(|c| (TONGUE_SIDE[c] + (TONGUE_BACK[c] - TONGUE_SIDE[c]) * coat) * dark);
            tints.push(VertexTint { colour, stippling: 0.9 * coat });
        }
    }
    (sheet(positions, outline.len(), TONGUE_ROWS), tints)
}

/// Tint of mucosa at a place, mm: a little redder here and paler there, over some millimetres.
pub(super) fn mucosa_tint(place: Vec3) -> Rgb {
    let wave = |steps: Vec3, phase: f32| libm::sinf(place.dot(steps) + phase);
    let bent = place + 2.0 * Vec3::new(wave(Vec3::new(0.2, 0.5, 0.3), 0.0), wave(Vec3::new(0.6, 0.1, -0.4), 1.0), 0.0);
    let wave = |steps: Vec3, phase: f32| libm::sinf(bent.dot(steps) + phase);
    let coarse = wave(Vec3::new(0.31, 0.47, 0.19), 0.4) * wave(Vec3::new(-0.23, 0.29, 0.41), 1.7);
    let fine = wave(Vec3::new(0.9, -0.7, 1.1), 0.0) * wave(Vec3::new(-0.6, 1.0, 0.8), 2.2);
    let pale = 0.06 * coarse + 0.03 * fine;
    [0.96 + 0.5 * pale, 0.93 + 1.4 * pale, 0.93 + 1.3 * pale]
}

/// Columns of places as a sheet. Its normals point along the cross product of the way to the next column and that to the next row.
fn sheet(positions: Vec<Vec3>, columns: usize, rows: usize) -> Mesh {
    let corner = |column: usize, row: usize| (column * rows + row) as u32;
    let cells = (0..columns - 1).flat_map(|column| (0..rows - 1).map(move |row| (column, row)));
    let triangles = cells
        .flat_map(|(column, row)| {
            let [a, b] = [corner(column, row), corner(column + 1, row)];
            // Both halves of the wall alike.
            if column < columns / 2 { [[a, b, b + 1], [a, b + 1, a + 1]] } else { [[a, b, a + 1], [a + 1, b, b + 1]] }
        })
        .collect();
    let mut mesh = Mesh { positions, normals: Vec::new(), triangles };
    mesh.compute_normals();
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_anatomy::jaw::{ArchPlan, DentalArch, Jaw, Occlusion, WORKING_OPENING_DEG};

    #[test]
    fn cheeks_stand_beside_the_teeth_and_the_tongue_lies_between_them() {
        // Aim: neither is in the way of a tooth, however wide the arch is, and both are lit from where they are seen. Method: both jaws
        // open as during treatment, of average form and of the widest with third molars. In each slice of 3 mm behind the
        // incisors, the cheeks are farther aside than any crown, and the tongue less far than the lower ones; and the way they face.
        for (count, width) in [(7, None), (8, Some(62.0))] {
            let plan = ArchPlan { width, ..ArchPlan::default() };
            let arches = [Jaw::Lower, Jaw::Upper].map(|jaw| DentalArch::new(jaw, count, None, &plan));
            let crowns = arches.each_ref().map(|arch| arch.crowns(&|_, _, _| false).mesh.positions);
            let reach = |of: &dyn Fn(&Vec3) -> f32| crowns.iter().flatten().map(of).fold(0.0, f32::max);
            let teeth = [reach(&|p| p.x.abs()), reach(&|p| p.y)];
            let lower_from_upper = Occlusion::new(&arches[0], &arches[1], 0.0).near_from_opposite(WORKING_OPENING_DEG);
            let poses = [Pose::IDENTITY, lower_from_upper];
            let front = poses.map(|arch| arch.rotate(Vec3::NEG_Y)).iter().sum::<Vec3>().normalize();
            let lips = Lips::around(poses.map(|arch| arch.position), front);
            let cavity = OralCavity::between(poses[0], poses[1], &lips, front, teeth);
            assert_eq!(cavity.solids(false).count(), 1);
            let [wall, tongue] = [true, false].map(|is_wall| cavity.solids(true).nth(usize::from(!is_wall)).unwrap());
            let aside = |places: &mut dyn Iterator<Item = Vec3>, slice: f32, of: fn(f32, f32) -> f32| {
                places.filter(|p| (p.z + slice).abs() < 1.5).map(|p| p.x.abs()).reduce(of)
            };
            // In the wall's own space, which looks out of the mouth.
            let from_lower = wall.world_from_solid.inverse();
            for slice in (15..60).step_by(3).map(|slice| slice as f32) {
                // The cheek, not the palate between the teeth.
                let cheeks = &mut wall.mesh.positions.iter().copied().filter(|p| p.x.abs() > 28.0 && p.y.abs() < 12.0);
                let beside = aside(cheeks, slice, f32::min);
                for (places, arch) in crowns.iter().zip(poses) {
                    let own = &mut places.iter().map(|p| from_lower * (arch * *p));
                    if let (Some(wall), Some(crown)) = (beside, aside(own, slice, f32::max)) {
                        assert!(wall > crown, "{slice} mm behind: cheek at {wall}, crown at {crown} mm");
                    }
                }
                let own = &mut crowns[0].iter().filter(|p| p.z > -6.0).map(|p| Vec3::new(p.x, 0.0, -p.y));
                let inner = aside(own, slice, f32::min).filter(|_| slice < 50.0);
                let tongue =
                    aside(&mut tongue.mesh.positions.iter().map(|p| Vec3::new(p.x, 0.0, -p.y)), slice, f32::max);
                if let (Some(crown), Some(tongue)) = (inner, tongue) {
                    assert!(tongue < crown, "{slice} mm behind: tongue at {tongue}, crown at {crown} mm");
                }
            }
            // Both sides end at the lips, wherever an eye stands.
            for turn in [-0.9, -0.3, 0.0, 0.5, 1.0].map(|turn: f32| turn * LIPS_TURN) {
                for edge in [turn, PI - turn].map(|turn| from_lower * lips.inner_edge(turn).0) {
                    let nearest = wall.mesh.positions.iter().map(|p| p.distance(edge)).fold(f32::INFINITY, f32::min);
                    assert!(nearest < 0.7, "{nearest} mm of gap between the cheek and the lips at {edge}");
                }
            }
            // Under its arch the throat is deeper than beside it and over it, beside the uvula.
            let depth = |x: f32, y: f32| {
                let aside = |p: &&Vec3| (p.x.abs() - x).hypot(p.y - y);
                let near = wall.mesh.positions.iter().filter(|p| p.z < -40.0);
                near.min_by(|a, b| aside(a).total_cmp(&aside(b))).map_or(0.0, |p| -p.z)
            };
            let throat = depth(8.0, -10.0);
            for (name, beside) in
                [("wall", depth(24.0, -10.0)), ("palate", depth(8.0, 12.0)), ("uvula", depth(0.0, -4.0))]
            {
                assert!(throat > beside + 5.0, "{name} at {beside}, throat at {throat} mm");
            }
            let facing = |solid: &MeshInstance, toward: &dyn Fn(Vec3) -> Vec3| {
                let mesh = &solid.mesh;
                let turned = |(place, normal): (&Vec3, &Vec3)| {
                    solid.world_from_solid.rotate(*normal).dot(toward(solid.world_from_solid * *place)) > 0.0
                };
                let count = mesh.positions.iter().zip(&mesh.normals).filter(|corner| turned(*corner)).count();
                count as f32 / mesh.positions.len() as f32
            };
            let into_mouth = |place: Vec3| Vec3::new(0.0, 20.0, place.z) - place;
            assert!(facing(&wall, &into_mouth) > 0.9, "{}", facing(&wall, &into_mouth));
            let outward = |place: Vec3| place - Vec3::new(0.0, place.y, -14.0);
            assert!(facing(&tongue, &outward) > 0.9, "{}", facing(&tongue, &outward));
        }
    }
}
