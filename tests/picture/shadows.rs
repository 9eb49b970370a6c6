//! Shadows of the lamp against analytic ones.

use crate::scenes::{ball, block};
use typodont_core::frame::{Pose, Vec3};
use typodont_render::*;

const MATT: Appearance = Appearance { colour: [0.7; 3], gloss: 0.0 };
const BALL: Vec3 = Vec3::new(0.0, 6.0, 0.0);
const BALL_RADIUS: f32 = 3.0;
const SIZE: [u32; 2] = [500, 500];

/// A ball over a plate whose top is y = 0, lit by nothing but a lamp.
fn ball_over_plate(lamp_radius: f32, has_shadows: bool) -> RenderScene<'static> {
    let chair = Lamp {
        position: Vec3::new(60.0, 280.0, 90.0),
        strength: 0.9,
        colour: [1.0; 3],
        wrap: 0.0,
        radius: lamp_radius,
    };
    RenderScene {
        solids: vec![
            MeshInstance::plain(ball(BALL_RADIUS), Pose::at(BALL), MATT),
            MeshInstance::plain(block(Vec3::new(12.0, 1.0, 12.0)), Pose::at(Vec3::new(0.0, -1.0, 0.0)), MATT),
        ],
        lights: Lights { ambient: 0.0, chair, head: Lamp::OFF },
        shadows: has_shadows.then_some(ShadowRegion { centre: Vec3::new(0.0, 3.0, 0.0), radius: 22.0 }),
        ..RenderScene::empty()
    }
}

/// Share of the lamp's disc that a point sees past the ball.
fn visible_share(lamp: &Lamp, point: Vec3) -> f32 {
    let toward = (lamp.position - BALL).normalize();
    let right = toward.cross(Vec3::Z).normalize();
    let up = right.cross(toward);
    let is_seen = |i: u32| {
        let (sin, cos) = (2.399_963 * i as f32).sin_cos();
        let out = lamp.radius * ((i as f32 + 0.5) / 600.0).sqrt();
        let way = (lamp.position + right * (out * cos) + up * (out * sin) - point).normalize();
        let nearest = point + way * (BALL - point).dot(way);
        nearest.distance(BALL) > BALL_RADIUS
    };
    (0..600).filter(|i| is_seen(*i)).count() as f32 / 600.0
}

#[test]
fn the_shadow_of_a_ball_is_the_analytic_one() {
    // Aim: a shadow lies where optics puts it, and its edge is as soft as the lamp is large. Method: the plate's picture with
    // and without shadows gives the share of the lamp that each point sees; compare with rays to 600 places of the lamp.
    for lamp_radius in [0.5, 15.0, 40.0] {
        let viewpoint = Viewpoint::look_at(Vec3::new(1.0, 60.0, 50.0), Vec3::ZERO, Vec3::Y);
        let mut painter = OffscreenRenderer::cpu();
        let [dark, bright] =
            [true, false].map(|s| painter.draw(&ball_over_plate(lamp_radius, s), &viewpoint, None, SIZE).unwrap());
        let lamp = ball_over_plate(lamp_radius, true).lights.chair;
        let eye = viewpoint.eye(1.0);
        let (mut sum, mut count, mut far, mut shaded) = (0.0, 0, 0, 0);
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let way = eye.ray((x as f32 + 0.5) / SIZE[0] as f32, (y as f32 + 0.5) / SIZE[1] as f32);
            let point = eye.position - way * (eye.position.y / way.y);
            let nearest = eye.position + way * ((BALL - eye.position).dot(way) / way.length_squared());
            if point.x.abs().max(point.z.abs()) > 11.0 || nearest.distance(BALL) < BALL_RADIUS + 0.1 {
                continue;
            }
            let value = |picture: &RgbaImage| f32::from(picture.pixel(x, y)[1]).powi(2);
            let share = value(&dark) / value(&bright);
            let wanted = visible_share(&lamp, point);
            let error = (share - wanted).abs();
            shaded += u32::from(wanted < 0.5);
            sum += error;
            count += 1;
            far += u32::from(error > 0.25);
        }
        let (mean, far) = (sum / count as f32, far as f32 / count as f32);
        println!(
            "lamp of {lamp_radius} mm: {shaded} of {count} pixels in shadow, mean error {mean:.4}, {far:.4} far off"
        );
        assert!(shaded > 1500, "{lamp_radius}: {shaded} pixels in shadow");
        assert!(mean < 0.01 && far < 0.005, "{lamp_radius}: mean error {mean}, {far} by more than a quarter");
    }
}

#[test]
fn nothing_shades_itself() {
    // Aim: no spots on lit surfaces. Method: a plate alone, seen by the lamp at several angles, is as without shadows.
    for height in [40.0, 120.0, 300.0] {
        let scene = |has_shadows| {
            let mut scene = ball_over_plate(40.0, has_shadows);
            scene.solids.remove(0);
            scene.lights.chair.position = Vec3::new(200.0, height, 60.0);
            scene
        };
        let viewpoint = Viewpoint::look_at(Vec3::new(0.0, 50.0, 20.0), Vec3::ZERO, Vec3::Y);
        let mut painter = OffscreenRenderer::cpu();
        let [with, without] = [true, false].map(|s| painter.draw(&scene(s), &viewpoint, None, SIZE).unwrap());
        assert!(with.rgba == without.rgba, "lamp {height} mm above the plate");
    }
}
