//! A step never allocates: not in free space, not in contact, not while cutting, not while the hand is placed anew, not when
//! a reading is bad.

use crate::support::phantom;

use phantom::*;
use typodont_core::device::Reading;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::{Command, HandFrame, Simulation};
use typodont_core::touch::{
    AnchorMode, Body, Coefficient, Collider, ColliderGeometry, EDGE_RADIUS, Fixture, ForceRow, ForceSpace, ForceTable,
    Guidance, Instrument, Polyline, Profile, Shank, WorkingEnd,
};
use typodont_core::volume::Label;

#[test]
fn a_step_never_allocates() {
    let block = volume([120, 90, 90], 0.1, |p| (p.z, if p.x > 0.0 { SOFT } else { HARD }));
    let mut setup = setup(block, WorkingEnd::Ball { radius: 0.7 }, true);
    setup.instruments.push(Instrument::new(WorkingEnd::Point, false));
    setup.instruments.push(Instrument::new(WorkingEnd::Ball { radius: 1.15 }, true));
    let form = ColliderGeometry::RoundBox { half: Vec3::splat(2.0), rounding: 0.5 };
    setup.scene.colliders = vec![Collider {
        label: Label(9),
        tooth_from_collider: typodont_core::frame::Pose::at(Vec3::Y * 7.0),
        geometry: form,
    }];
    let path = std::sync::Arc::new(Polyline::through((0..2000).map(|i| {
        let turn = i as f32 * 0.01;
        Vec3::new(3.0 * turn.cos(), 3.0 * turn.sin(), 0.01 * turn)
    })));
    let tube =
        Fixture { path, anchor_mode: AnchorMode::Tube, radius: 0.2, stiffness: 0.2, damping: 0.001, max_force: 1.0 };
    let follow = Fixture { anchor_mode: AnchorMode::Follow { look_ahead: 2.0, speed: Some(5.0) }, ..tube.clone() };
    let rows = (0..100).map(|i| ForceRow { time: f64::from(i) * 0.01, force: Vec3::X * (i as f32 * 0.01) }).collect();
    let forces = ForceTable { rows, repeat: true, scale: 1.0, space: ForceSpace::Tooth };
    setup.guidances = vec![Guidance::Path(tube), Guidance::Path(follow), Guidance::Forces(forces)];
    let frame = HandFrame { orientation: Quat::from_rotation_y(1.0), scale: 2.0, ..HandFrame::DEVICE };
    let mut sim = Simulation::new(setup);
    let mut cut = 0;
    let mut touched = 0;
    let mut led = 0;
    let counted = allocation_counter::measure(|| {
        for tick in 0..20_000u32 {
            match tick {
                2_000 => sim.apply(&Command::SetGuidance { guidance: Some(0) }),
                6_000 => sim.apply(&Command::SetGuidance { guidance: Some(1) }),
                10_000 => sim.apply(&Command::SetGuidance { guidance: Some(2) }),
                18_000 => sim.apply(&Command::SetGuidance { guidance: None }),
                18_500 => sim.apply(&Command::PlaceHand { frame }),
                19_200 | 19_500 => sim.apply(&Command::PressClutch { is_pressed: tick == 19_200 }),
                8_000 => sim.apply(&Command::SelectInstrument { instrument: 1 }),
                12_000 => sim.apply(&Command::SelectInstrument { instrument: 2 }),
                15_000 => {
                    sim.apply(&Command::SetCoefficient { label: SOFT, coefficient: Coefficient::Stiffness, value: 0.4 })
                }
                _ => {}
            }
            let turn = tick as f32 * 0.002;
            let depth = 3.5 * libm::sinf(tick as f32 * 0.0016);
            let mut hand = Vec3::new(3.0 * libm::cosf(turn), 3.0 * libm::sinf(turn * 0.7), -depth);
            if tick % 4_999 == 0 {
                hand.x = f32::NAN;
            }
            let step = sim.step(&Reading::at(hand));
            cut += u32::from(step.cutting);
            touched += u32::from(step.touch.is_some());
            led += u32::from(step.guidance != Vec3::ZERO);
        }
    });
    assert!(cut > 500 && touched > 2_000, "the course must do what is measured: {cut} cut, {touched} touched");
    assert!(led > 10_000, "led in {led} ticks");
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

#[test]
fn a_step_with_a_shell_never_allocates() {
    // Aim: the same for an instrument of any shape: turned in contact, cutting, on its shank, taken and put away.
    let block = volume([120, 90, 90], 0.1, |p| (p.z, if p.x > 0.0 { SOFT } else { HARD }));
    let mut setup = setup(block, WorkingEnd::Ball { radius: 0.7 }, true);
    let bur =
        |profile: Profile| Instrument::with_body(Body::revolved(profile, Some(Shank::friction_grip(1.0, 4.0))), true);
    setup.instruments.push(bur(Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2])));
    setup.instruments.push(bur(Profile::flame(0.6, 4.0, 0.1)));
    let form = ColliderGeometry::RoundBox { half: Vec3::splat(2.0), rounding: 0.5 };
    setup.scene.colliders = vec![Collider {
        label: Label(9),
        tooth_from_collider: typodont_core::frame::Pose::at(Vec3::Y * 7.0),
        geometry: form,
    }];
    setup.device.max_torque = 200.0;
    let mut sim = Simulation::new(setup);
    let (mut cut, mut touched, mut turned) = (0, 0, 0);
    let counted = allocation_counter::measure(|| {
        for tick in 0..16_000u32 {
            match tick {
                1_000 => sim.apply(&Command::SelectInstrument { instrument: 1 }),
                9_000 => sim.apply(&Command::SelectInstrument { instrument: 2 }),
                13_000 => sim.apply(&Command::SelectInstrument { instrument: 0 }),
                _ => {}
            }
            let sway = tick as f32 * 0.002;
            let depth = 3.5 * libm::sinf(tick as f32 * 0.0016);
            let position = Vec3::new(3.0 * libm::cosf(sway), 3.0 * libm::sinf(sway * 0.7), -depth);
            let orientation = Quat::from_rotation_x(1.5 * libm::sinf(sway * 0.3));
            let step = sim.step(&Reading { pose: Pose { position, orientation }, buttons: 0 });
            cut += u32::from(step.cutting);
            touched += u32::from(step.touch.is_some());
            turned += u32::from(step.torque != Vec3::ZERO);
        }
    });
    assert!(cut > 500 && touched > 2_000 && turned > 1_000, "{cut} cut, {touched} touched, {turned} turned");
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
