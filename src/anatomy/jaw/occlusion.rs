//! The two jaws against each other: closed, and with the mouth open.
//!
//! Takes the arches of both jaws. Gives poses between their arch spaces, mm.

use super::{DentalArch, Jaw};
use typodont_core::frame::{Pose, Quat, Vec3};

/// Opening of the mouth during treatment, degrees: some 40 mm between the incisors.
pub const WORKING_OPENING_DEG: f32 = 26.0;

/// Widest opening of the mouth, degrees.
const OPENING_MAX_DEG: f32 = 35.0;

/// Position of the condyles' axis relative to the edges of the lower incisors, back and up, mm: the height of Bonwill's
/// triangle of four inches, raised by Balkwill's angle of 26° over the occlusal plane.
const CONDYLES: [f32; 2] = [79.0, 38.5];

/// Overlap of upper and lower edges and cusps when the jaws are closed, mm.
const OVERBITE: f32 = 2.0;

/// Distance by which the upper first molar's centre lies behind the lower one's, mm, so that its mesiobuccal cusp meets
/// the lower one's buccal groove (Angle's class I).
const MOLAR_RELATION: f32 = 0.9;

/// Width of a cusp, mm: distance by which the lower jaw is placed backward in Angle's class II and forward in class
/// III.
pub const CUSP_WIDTH: f32 = 4.5;

/// The opposite jaw beside the one that is worked on.
#[derive(Clone, Copy, Debug)]
pub struct Occlusion {
    /// The jaw that is worked on, which stays where it is.
    near: Jaw,
    /// The opposite jaw's arch space in the near one's when the jaws are closed.
    near_from_opposite: Pose,
}

impl Occlusion {
    /// `ahead`: the lower jaw's distance in front of its place in Angle's class I, mm.
    pub fn new(near: &DentalArch, opposite: &DentalArch, ahead: f32) -> Occlusion {
        let is_upper = near.jaw() == Jaw::Upper;
        let (upper, lower) = if is_upper { (near, opposite) } else { (opposite, near) };
        // Of the side without a fitted tooth.
        let first_molar = |arch: &DentalArch| arch.seat(-arch.fitted_side(), 5).map_or(0.0, |seat| seat.top.y);
        let forward = first_molar(lower) + MOLAR_RELATION + ahead - first_molar(upper);
        // Turned about y by half a turn: left becomes right and up becomes down.
        let orientation = Quat::from_rotation_y(std::f32::consts::PI);
        let lower_from_upper = Pose { position: Vec3::new(0.0, forward, -OVERBITE), orientation };
        let near_from_opposite = if is_upper { lower_from_upper.inverse() } else { lower_from_upper };
        Occlusion { near: near.jaw(), near_from_opposite }
    }

    /// The opposite jaw's arch space in the near one's, the mouth open by an angle about the condyles' axis, degrees: 0 to 35.
    pub fn near_from_opposite(&self, open_deg: f32) -> Pose {
        self.opening_pose(open_deg.clamp(0.0, OPENING_MAX_DEG)) * self.near_from_opposite
    }

    /// Rotation of the opposite jaw about the condyles' axis, in the near jaw's arch space.
    fn opening_pose(&self, degrees: f32) -> Pose {
        let [back, up] = CONDYLES;
        let axis = match self.near {
            Jaw::Lower => Vec3::new(0.0, back, up),
            Jaw::Upper => self.near_from_opposite * Vec3::new(0.0, back, up),
        };
        // About x, which points to one side: the other jaw's front, at −y from the axis, goes to +z.
        let orientation = Quat::from_rotation_x(-degrees.to_radians());
        Pose { position: axis - orientation * axis, orientation }
    }
}
