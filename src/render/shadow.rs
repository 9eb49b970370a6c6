//! The lamp as an eye: what it sees is lit, and everything behind that lies in shadow.

use super::eye::{Eye, FrustumWindow};
use super::scene::{Lamp, RenderScene, ShadowRegion};
use typodont_core::frame::Vec3;

/// Width and height of the shadow map, texels.
pub(super) const MAP_SIZE: u32 = 1024;

/// Minimum distance of a lamp from the region, mm. A nearer lamp casts no shadows.
const MIN_DISTANCE: f32 = 1.0;

/// The eye in a lamp's place, whose picture covers the region; `None` if the lamp is off, or within the region.
pub(super) fn lamp_eye(lamp: &Lamp, region: ShadowRegion) -> Option<Eye> {
    let to_region = region.centre - lamp.position;
    let distance = to_region.length();
    if lamp.strength == 0.0 || distance < region.radius + MIN_DISTANCE {
        return None;
    }
    let forward = to_region / distance;
    let aside = if forward.y.abs() < 0.9 { Vec3::Y } else { Vec3::X };
    let right = forward.cross(aside).normalize();
    // The tangent of the cone around the ball.
    let half = region.radius / (distance * distance - region.radius * region.radius).sqrt();
    Some(Eye {
        position: lamp.position,
        right,
        up: right.cross(forward),
        forward,
        window: FrustumWindow { left: -half, right: half, bottom: -half, top: half },
        near: distance - region.radius,
        far: distance + region.radius,
    })
}

/// The eye of the chair lamp, if the scene has shadows.
pub(super) fn chair_eye(scene: &RenderScene) -> Option<Eye> {
    lamp_eye(&scene.lights.chair, scene.shadows?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lamp_sees_the_whole_region() {
        // Aim: nothing of the ball lies beside the map, before its first or behind its last depth.
        let region = ShadowRegion { centre: Vec3::new(3.0, -4.0, 5.0), radius: 20.0 };
        for position in [Vec3::new(-350.0, 480.0, 420.0), Vec3::new(3.0, 200.0, 5.0), Vec3::new(40.0, -4.0, 5.0)] {
            let eye = lamp_eye(&Lamp { position, ..Lamp::chair() }, region).unwrap();
            for i in 0..200 {
                let height = 1.0 - 2.0 * (i as f32 + 0.5) / 200.0;
                let (sin, cos) = (2.4 * i as f32).sin_cos();
                let ring = (1.0 - height * height).sqrt();
                let ([x, y], z) =
                    eye.project(region.centre + region.radius * Vec3::new(ring * cos, height, ring * sin));
                assert!([x, y].iter().all(|v| (-1e-4..1.0001).contains(v)), "{position}: {x} {y}");
                assert!(z > eye.near - 1e-3 && z < eye.far + 1e-3, "{position}: {z}");
            }
        }
        assert_eq!(lamp_eye(&Lamp { position: region.centre, ..Lamp::chair() }, region), None);
        assert_eq!(lamp_eye(&Lamp::OFF, region), None);
    }
}
