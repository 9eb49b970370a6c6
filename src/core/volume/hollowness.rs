//! Form of a surface around a place: hollow as a fissure, flat, or bulging as a cusp.
//!
//! Takes the share of matter at any place, mm. Gives a number without a unit.

use crate::frame::Vec3;

/// Distance from a place at which matter is looked for, mm.
const AROUND: f32 = 0.9;

/// Share of matter around a flat place, and above it until a groove is as deep as can be.
const FLAT: f32 = 0.53;
const DEEPER: f32 = 0.17;

/// Share of matter up to which a place bulges – less than on the sides of a crown – and below it until it is a tip.
const BULGING: f32 = 0.40;
const SHARPER: f32 = 0.15;

/// Directions in which matter is looked for: along the axes, and to the corners of a cube.
const WAYS: [[f32; 3]; 14] = {
    const S: f32 = 0.577;
    [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
        [S, S, S],
        [S, S, -S],
        [S, -S, S],
        [S, -S, -S],
        [-S, S, S],
        [-S, S, -S],
        [-S, -S, S],
        [-S, -S, -S],
    ]
};

/// Form of a surface around a place of it, by the matter there: 1 deep in a groove, 0 where it is flat, −1 at a tip or an edge.
/// `matter_at`: the share of matter at a place, 0 to 1.
pub fn hollowness(place: Vec3, matter_at: impl Fn(Vec3) -> f32) -> f32 {
    let matter: f32 = WAYS.iter().map(|way| matter_at(place + Vec3::from(*way) * AROUND)).sum();
    let share = matter / WAYS.len() as f32;
    let groove = ((share - FLAT) / DEEPER).clamp(0.0, 1.0);
    groove - ((BULGING - share) / SHARPER).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grooves_are_hollow_and_edges_bulge() {
        // Aim: what is flat, or as wide as a crown, is neither. Method: a plane, a sphere as wide as a crown, a right-angled groove and a right-angled edge along each axis, whose density falls
        // over a millimetre.
        let share = |distance: f32| (0.5 - distance).clamp(0.0, 1.0);
        for axis in Vec3::AXES {
            let aside = Vec3::new(axis.y, axis.z, axis.x);
            let of = |height: &dyn Fn(f32) -> f32| {
                hollowness(Vec3::ZERO, |p| share((p.dot(axis) - height(p.dot(aside).abs())) * 0.7))
            };
            assert_eq!(of(&|_| 0.0), 0.0);
            assert!(of(&|x| x) > 0.5, "{}", of(&|x| x));
            assert!(of(&|x| -x) < -0.5, "{}", of(&|x| -x));
            let crown = hollowness(axis * 4.5, |p| share(p.length() - 4.5));
            assert!(crown.abs() < 0.1, "{crown}");
        }
    }
}
