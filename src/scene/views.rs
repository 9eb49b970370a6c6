//! Standard views: of each side of the tooth, of each quadrant, of the whole mouth.

use super::jaw::Mouth;
use typodont_core::frame::Vec3;
use typodont_exercise::scenario::Workpiece;
use typodont_render::{Lens, Orbit, Quadrant, ShadowRegion};

/// A side of the tooth, looked at squarely.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToothSide {
    Occlusal,
    Buccal,
    Lingual,
    Mesial,
    Distal,
}

impl ToothSide {
    pub const ALL: [ToothSide; 5] =
        [ToothSide::Occlusal, ToothSide::Buccal, ToothSide::Lingual, ToothSide::Mesial, ToothSide::Distal];

    /// From the tooth toward the eye, tooth space; `distal` is that way in it.
    fn toward_eye(self, distal: Vec3) -> Vec3 {
        match self {
            ToothSide::Occlusal => Vec3::Z,
            ToothSide::Buccal => Vec3::X,
            ToothSide::Lingual => Vec3::NEG_X,
            ToothSide::Mesial => -distal,
            ToothSide::Distal => distal,
        }
    }
}

/// Size of the picture relative to the crown.
const CROWN_ROOM: f32 = 1.25;

/// Half of what a quadrant, and a mouth, fills of a picture, mm.
const QUADRANT_REACH: f32 = 26.0;
const MOUTH_REACH: f32 = 40.0;

/// From the middle of an arch to the middle of its second premolars, arch space: aside and back, mm.
const QUADRANT_MIDDLE: [f32; 2] = [18.0, 20.0];

/// The crowns of the teeth worked on, from one side.
///
/// From above, the user's side of the tooth is at the picture's lower edge.
pub fn tooth_view(workpiece: &Workpiece, side: ToothSide) -> Orbit {
    let crowns = workpiece.crown_bounds();
    let middle = workpiece.world_from_tooth * crowns.centre();
    let distal = workpiece.distal();
    let radius = 0.5 * CROWN_ROOM * crowns.size().max_element();
    orbit_toward(middle, radius, workpiece.world_from_tooth.rotate(side.toward_eye(distal)))
}

/// The usual view at work: from the user's side and from above, the teeth worked on with a neighbour on each side.
pub fn work_view(workpiece: &Workpiece) -> Orbit {
    /// Of what stands beside the crowns, mm.
    const BESIDE: f32 = 6.0;
    let crowns = workpiece.crown_bounds();
    let middle = workpiece.world_from_tooth * crowns.centre();
    let radius = 0.5 * crowns.size().max_element() + BESIDE;
    Orbit { azimuth: 0.25, elevation: 0.75, ..Orbit::around(middle, radius) }
}

/// Region in which the lamp casts shadows: around the teeth worked on, wider as the eye is farther away.
pub fn shadow_region(workpiece: &Workpiece, orbit: &Orbit) -> ShadowRegion {
    /// Radius around a single tooth, mm: two teeth on each side, and the head of a handpiece.
    const AROUND: f32 = 32.0;
    let crowns = workpiece.crown_bounds();
    let farther = (orbit.distance / work_view(workpiece).distance).clamp(1.0, 3.0);
    let radius = (AROUND * farther).max(crowns.half_size().length() + 10.0);
    ShadowRegion { centre: workpiece.world_from_tooth * crowns.centre(), radius }
}

/// Lens of a camera through which a view is seen: what is as deep as its middle is sharp.
pub fn camera_lens(orbit: &Orbit) -> Lens {
    /// Diameter of a lens of 100 mm at f/16, and its distance from teeth, mm. The view magnifies by moving the eye closer; the lens
    /// shrinks with the distance, so that the blur is that of a camera which magnifies as much from where it is.
    const DIAMETER: f32 = 100.0 / 16.0;
    const DISTANCE: f32 = 300.0;
    Lens { focus: orbit.middle, aperture: DIAMETER * orbit.distance / DISTANCE }
}

impl Mouth {
    /// A quadrant from in front and from the other side of the mouth, between the open jaws. `open` as for
    /// [`Mouth::solids`].
    pub fn quadrant_view(&self, quadrant: Quadrant, open: f32) -> Orbit {
        let (world_from_arch, side) = self.arch_of(quadrant, open);
        let [aside, back] = QUADRANT_MIDDLE;
        let middle = world_from_arch * Vec3::new(side * aside, back, -3.0);
        orbit_toward(middle, QUADRANT_REACH, world_from_arch.rotate(Vec3::new(-0.50 * side, -0.75, 0.55)))
    }

    /// Both jaws from in front.
    pub fn front_view(&self, open: f32) -> Orbit {
        let near = self.world_from_arch();
        let height = 0.5 * open.clamp(0.0, 35.0);
        orbit_toward(near * Vec3::new(0.0, 12.0, height), MOUTH_REACH, near.rotate(Vec3::new(0.0, -1.0, 0.12)))
    }

    /// The jaw with the carved tooth from straight over its chewing surfaces.
    pub fn arch_view(&self) -> Orbit {
        let near = self.world_from_arch();
        let front = near.rotate(Vec3::NEG_Y);
        // Straight down the picture's up is the way that `turn` looks: the incisors are at its lower edge.
        let orbit = orbit_toward(near * Vec3::new(0.0, 25.0, -4.0), MOUTH_REACH, near.rotate(Vec3::Z));
        Orbit { azimuth: libm::atan2f(front.x, front.z), ..orbit }
    }
}

/// Looks at a ball whole from a direction in world space, which need not be a unit.
fn orbit_toward(middle: Vec3, radius: f32, to_eye: Vec3) -> Orbit {
    let to_eye = to_eye.normalize_or(Vec3::Z);
    let level = libm::hypotf(to_eye.x, to_eye.z);
    let azimuth = if level < 1e-3 { 0.0 } else { libm::atan2f(to_eye.x, to_eye.z) };
    let start = Orbit { azimuth, elevation: 0.0, ..Orbit::around(middle, radius) };
    start.rotated(0.0, libm::atan2f(to_eye.y, level))
}
