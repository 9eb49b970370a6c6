//! Registration of an arm's hand with the picture: through a half-mirror, the instrument is seen where the hand holds it.
//!
//! Takes where the hand was when its tip touched four crosses of the picture. Gives the rotation, the scale and the shift
//! that bring the hand there. Never sends them, and never reads a clock.

use serde::{Deserialize, Serialize};
use typodont_core::frame::{Mat3, Quat, Vec3};
use typodont_core::sim::HandFrame;
use typodont_render::Orbit;

/// The crosses in the order in which they are touched: places to the right of and above the middle of the view, as shares
/// of its height.
pub const CROSSES: [[f32; 2]; 4] = [[-0.35, 0.35], [0.35, 0.35], [0.35, -0.35], [-0.35, -0.35]];

/// Minimum height of a view, mm: an arm that has moved less has not touched the crosses of a screen.
const LEAST_HEIGHT: f32 = 40.0;

/// Maximum root mean square distance of the touched points from the crosses, as a share of the distance of two crosses.
const MOST_ERROR: f32 = 0.08;

/// The frame in which a hand is registered: the device's own, in which it is free.
pub const REGISTERING_FRAME: HandFrame = HandFrame { middle: Some(Vec3::ZERO), is_free: true, ..HandFrame::DEVICE };

/// Place of the view in the space of a device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandRegistration {
    /// Rotation of the view's right, up and outward axes into the space of the device.
    device_from_view_xyzw: [f32; 4],
    /// Middle of the view in the space of the device, mm.
    middle_mm: [f32; 3],
    /// Height of the view, mm.
    pub height_mm: f32,
    /// Root mean square distance of the touched points from the crosses, mm.
    pub error_mm: f32,
}

/// Why touched points are no registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RegistrationRefusal {
    /// The points lie too close together: that is the height that the view would have, mm.
    TooSmall(f32),
    /// The points do not form the crosses' square: their root mean square distance from it, mm.
    DoesNotFit(f32),
    /// The picture would show its back to the hand: the crosses were seen in a mirror whose window is not flipped.
    Mirrored,
}

impl HandRegistration {
    /// The registration by which the crosses come closest to the points that the hand touched, in the space of the device,
    /// mm, in the least squares sense.
    ///
    /// The rotation is the orthogonal factor of the covariance of both squares' points (polar decomposition; as in N. J.
    /// Higham, *Functions of Matrices*, 2008, chapter 8), of which only the two columns of the picture's plane are not zero.
    ///
    /// # Errors
    ///
    /// [`RegistrationRefusal`] if the points cannot be those of the crosses.
    pub fn of_points(points: [Vec3; 4]) -> Result<HandRegistration, RegistrationRefusal> {
        let middle = points.iter().sum::<Vec3>() / points.len() as f32;
        let along =
            |axis: usize| points.iter().zip(CROSSES).map(|(point, cross)| (*point - middle) * cross[axis]).sum();
        let (right, up): (Vec3, Vec3) = (along(0), along(1));
        let (rr, ru, uu) = (right.length_squared(), right.dot(up), up.length_squared());
        let area = (rr * uu - ru * ru).max(0.0).sqrt();
        let spread = (rr + uu + 2.0 * area).sqrt();
        // The sum of the singular values, by the square sum of the crosses, is the scale.
        let squares: f32 = CROSSES.iter().map(|[x, y]| x * x + y * y).sum();
        let height = spread / squares;
        if !(height >= LEAST_HEIGHT && area > 1e-3 * spread * spread) {
            return Err(RegistrationRefusal::TooSmall(height));
        }
        let unit = |main: Vec3, own: f32, other: Vec3| (main * (own + area) - other * ru) / (area * spread);
        let (right, up) = (unit(right, uu, up), unit(up, rr, right));
        let square =
            |(point, [x, y]): (&Vec3, [f32; 2])| point.distance_squared(middle + (right * x + up * y) * height);
        let error = (points.iter().zip(CROSSES).map(square).sum::<f32>() / points.len() as f32).sqrt();
        if error > MOST_ERROR * height * (CROSSES[1][0] - CROSSES[0][0]) {
            return Err(RegistrationRefusal::DoesNotFit(error));
        }
        // Devices have +z toward the user, and so does a picture, whichever way it is inclined.
        let out = right.cross(up);
        if out.z <= 0.0 {
            return Err(RegistrationRefusal::Mirrored);
        }
        let axes = Mat3::from_cols(right, up, out);
        Ok(HandRegistration {
            device_from_view_xyzw: Quat::from_mat3(&axes).normalize().to_array(),
            middle_mm: middle.to_array(),
            height_mm: height,
            error_mm: error,
        })
    }

    /// The frame by which the tip is in the picture where the hand is seen, in the plane through the middle of the orbit; in
    /// the middle of the picture only, if that would need a scale that a hand cannot have.
    pub fn frame(&self, orbit: &Orbit) -> HandFrame {
        let orientation = orbit.world_from_view() * Quat::from_array(self.device_from_view_xyzw).conjugate();
        let scale = (orbit.height_at_middle() / self.height_mm).clamp(HandFrame::LEAST_SCALE, HandFrame::SCALES[1]);
        let middle = orbit.middle - orientation * Vec3::from_array(self.middle_mm) * scale;
        HandFrame { orientation, scale, middle: Some(middle), is_free: false }
    }

    /// True for values that can have been measured.
    pub fn is_valid(&self) -> bool {
        /// Farthest point of a screen and greatest height, mm.
        const FAR: f32 = 2000.0;
        let numbers = [self.height_mm, self.error_mm];
        let is_rotation = (Quat::from_array(self.device_from_view_xyzw).length() - 1.0).abs() < 1e-3;
        is_rotation && numbers.iter().chain(&self.middle_mm).all(|n| n.abs() < FAR) && self.height_mm >= LEAST_HEIGHT
    }
}

/// A registration while it is made.
#[derive(Clone, Debug, Default)]
pub struct RegistrationDraft {
    /// Positions of the hand at the crosses so far, in the space of the device, mm.
    touched: Vec<Vec3>,
    /// Why the last four points were refused.
    pub refused: Option<RegistrationRefusal>,
}

impl RegistrationDraft {
    /// Index of the cross that is to be touched.
    pub fn next_cross(&self) -> usize {
        self.touched.len()
    }

    /// Takes over where the hand is, in [`REGISTERING_FRAME`], while it touches the next cross. Returns the registration
    /// after the last one; if that is refused, it begins again.
    pub fn touch(&mut self, hand: Vec3) -> Option<HandRegistration> {
        self.touched.push(hand);
        let points = <[Vec3; 4]>::try_from(self.touched.as_slice()).ok()?;
        self.touched.clear();
        match HandRegistration::of_points(points) {
            Ok(registration) => Some(registration),
            Err(why) => {
                self.refused = Some(why);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The crosses of a view that stands in the space of a device.
    fn crosses(device_from_view: Quat, middle: Vec3, height: f32) -> [Vec3; 4] {
        CROSSES.map(|[x, y]| middle + device_from_view * Vec3::new(x, y, 0.0) * height)
    }

    #[test]
    fn a_point_of_the_picture_is_where_the_hand_sees_it() {
        // Aim: whichever way the screen stands to the arm. Method: a view 260 mm high, inclined and turned; the hand at a
        // point of it is at the point of the world that is drawn there.
        let (height, middle) = (260.0, Vec3::new(12.0, -35.0, 60.0));
        for angles in [[0.0, 0.0, 0.0], [-0.8, 0.3, 0.1], [0.4, -1.2, 1.0]] {
            let device_from_view =
                Quat::from_rotation_y(angles[1]) * Quat::from_rotation_x(angles[0]) * Quat::from_rotation_z(angles[2]);
            let registration = HandRegistration::of_points(crosses(device_from_view, middle, height)).unwrap();
            assert!(registration.error_mm < 1e-3 && (registration.height_mm - height).abs() < 1e-2, "{registration:?}");
            assert!(registration.is_valid());
            let orbit = Orbit::around(Vec3::new(1.0, 2.0, 3.0), 9.0).rotated(0.7, -0.2).zoomed(1.7);
            let frame = registration.frame(&orbit);
            assert!(frame.is_valid());
            let high = orbit.height_at_middle();
            for [x, y] in [[0.0, 0.0], [0.4, 0.1], [-0.2, -0.45]] {
                let hand = middle + device_from_view * Vec3::new(x, y, 0.0) * height;
                let tip = frame.middle.unwrap() + frame.orientation * hand * frame.scale;
                let eye = orbit.viewpoint().eye(1.0);
                let drawn = orbit.middle + (eye.right * x + eye.up * y) * high;
                assert!(tip.distance(drawn) < 2e-3, "{angles:?}, {x} {y}: {tip} and {drawn}");
            }
        }
    }

    #[test]
    fn an_unsteady_hand_is_averaged_and_a_wrong_one_is_refused() {
        // Aim: a millimetre of tremor is no error; crosses in the wrong order, a hand that stays and one that misses are.
        let right = crosses(Quat::from_rotation_x(0.5), Vec3::X, 250.0);
        let tremor = [Vec3::X, -Vec3::Y, Vec3::Z, -Vec3::X];
        let shaken: Vec<Vec3> = right.iter().zip(tremor).map(|(point, by)| point + by).collect();
        let registration = HandRegistration::of_points(shaken.try_into().unwrap()).unwrap();
        assert!(registration.error_mm > 0.3 && registration.error_mm < 1.0, "{registration:?}");
        assert!((registration.height_mm - 250.0).abs() < 2.0);
        let [a, b, c, d] = right;
        let is_misfit = |points| matches!(HandRegistration::of_points(points), Err(RegistrationRefusal::DoesNotFit(_)));
        assert!(is_misfit([a, b, c, d + Vec3::Y * 90.0]));
        assert!(HandRegistration::of_points([a, c, b, d]).is_err());
        assert_eq!(HandRegistration::of_points([b, a, d, c]), Err(RegistrationRefusal::Mirrored));
        assert_eq!(HandRegistration::of_points([a; 4]), Err(RegistrationRefusal::TooSmall(0.0)));
        let mut draft = RegistrationDraft::default();
        assert!([a, a, a, a].iter().all(|point| draft.touch(*point).is_none()));
        assert!(draft.refused.is_some() && draft.next_cross() == 0);
        let made = right.iter().map(|point| draft.touch(*point)).collect::<Vec<_>>();
        assert!(made[..3].iter().all(Option::is_none) && made[3].is_some());
    }
}
