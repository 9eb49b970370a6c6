//! The mouse without a window: what a window would do, done by the test.

use typodont_core::device::{Device, DeviceState, Pacing, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::driver_by_name;
use typodont_devices::mouse::{HandTarget, Mouse};

/// Half a second of ticks with a force on the hand.
fn settle(device: &mut impl Device) -> Vec3 {
    (0..500).map(|_| device.exchange(&Wrench::ZERO).unwrap().pose.position).last().unwrap()
}

fn target(place: Vec3, max_force: f32) -> HandTarget {
    HandTarget { place, max_force, yaw: 0.0, lean: [0.0; 2] }
}

/// Stiffness of the wall, N/mm: that of a tooth at a PHANTOM Omni.
const STIFFNESS: f32 = 1.0;

/// Ticks of a hand above a rigid floor at height 0; returns its lowest position and greatest force, after each tick.
fn press_on_floor(device: &mut impl Device, ticks: usize) -> Vec<(Vec3, f32)> {
    let mut output = Wrench::ZERO;
    let tick = |_| {
        let hand = device.exchange(&output).unwrap().pose.position;
        let force = STIFFNESS * (-hand.y).max(0.0);
        output = Wrench { force: Vec3::Y * force, ..Wrench::ZERO };
        (hand, force)
    };
    (0..ticks).map(tick).collect()
}

#[test]
fn the_free_hand_goes_to_its_target() {
    let (mouse, mut device) = Mouse::new();
    assert_eq!((device.pacing(), device.state()), (Pacing::Host, DeviceState::Ready));
    mouse.aim(target(Vec3::new(5.0, -3.0, -2.0), 1.0));
    assert!(settle(&mut device).distance(Vec3::new(5.0, -3.0, -2.0)) < 0.01);
    mouse.set_button(0, true);
    mouse.set_button(2, true);
    mouse.set_button(40, true);
    assert_eq!(device.exchange(&Wrench::ZERO).unwrap().buttons, 0b101);
    mouse.set_button(0, false);
    let reading = device.exchange(&Wrench::ZERO).unwrap();
    assert_eq!(reading.buttons, 0b100);
    assert!(reading.pose.orientation.angle_between(UPRIGHT) < 1e-3);
}

#[test]
fn the_force_of_a_press_rises_slowly_to_its_maximum_and_stays_there() {
    // Aim: whoever holds the button presses like a light hand. Method: a rigid floor, a target far below it.
    for max_force in [0.12, 0.5, 1.2, 3.0] {
        let (mouse, mut device) = Mouse::new();
        mouse.aim(target(Vec3::Y * 0.1, max_force));
        settle(&mut device);
        mouse.aim(target(Vec3::Y * -12.0, max_force));
        let forces: Vec<f32> = press_on_floor(&mut device, 2000).into_iter().map(|(_, force)| force).collect();
        let greatest = forces.iter().copied().fold(0.0, f32::max);
        assert!((forces[1999] / max_force - 1.0).abs() < 0.05, "{max_force}: {}", forces[1999]);
        assert!(greatest < max_force + 0.5, "{max_force}: the first contact presses with {greatest} N");
        let rise = forces.windows(2).skip(100).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
        assert!(rise < 0.02, "{max_force}: the force changes by {rise} N in a tick");
    }
}

#[test]
fn a_hand_slides_along_a_surface_with_little_force() {
    // Aim: the hand follows the pointer over a surface. Method: the target moves 5 mm aside below a floor.
    let (mouse, mut device) = Mouse::new();
    mouse.aim(target(Vec3::Y * -0.3, 0.12));
    press_on_floor(&mut device, 500);
    mouse.aim(target(Vec3::new(5.0, -0.3, 0.0), 0.12));
    let path = press_on_floor(&mut device, 500);
    assert!((path[499].0.x - 5.0).abs() < 0.05, "{}", path[499].0);
    assert!(path.iter().all(|(_, force)| *force < 0.2));
}

#[test]
fn the_hand_gives_way_to_a_larger_force_than_its_own() {
    let (mouse, mut device) = Mouse::new();
    mouse.aim(target(Vec3::Y * -4.0, 3.0));
    let pressed = press_on_floor(&mut device, 2000)[1999].1;
    mouse.aim(target(Vec3::Y * -4.0, 0.5));
    let eased = press_on_floor(&mut device, 500)[499].1;
    assert!(pressed > 2.8 && (eased - 0.5).abs() < 0.1, "{pressed} N, then {eased} N");
}

#[test]
fn a_released_mouse_presses_nothing() {
    let (mouse, mut device) = Mouse::new();
    mouse.aim(target(Vec3::X * 10.0, 1.0));
    mouse.set_button(1, true);
    settle(&mut device);
    mouse.release_at(Vec3::new(4.0, 1.0, -2.0));
    assert!(settle(&mut device).distance(Vec3::new(4.0, 1.0, -2.0)) < 0.01);
    assert_eq!(device.exchange(&Wrench::ZERO).unwrap().buttons, 0);
}

#[test]
fn a_target_that_jumps_is_approached_as_a_hand_moves() {
    // Aim: steps of the pointer do not become impacts. Method: a jump beyond the workspace and targets that are not numbers;
    // no tick moves the hand further than a hand can.
    let (mouse, mut device) = Mouse::new();
    mouse.aim(target(Vec3::X * 1e6, 1.0));
    mouse.aim(target(Vec3::new(0.0, f32::NAN, 0.0), 1.0));
    mouse.aim(target(Vec3::ZERO, f32::INFINITY));
    let mut last = Vec3::ZERO;
    for _ in 0..1000 {
        let now = device.exchange(&Wrench::ZERO).unwrap().pose.position;
        assert!(now.distance(last) <= 0.2501, "{last} to {now}");
        last = now;
    }
    assert!((last.x - device.spec().workspace_half.x).abs() < 0.01, "{last}");
}

#[test]
fn the_handle_turns_with_the_view() {
    let (mouse, mut device) = Mouse::new();
    mouse.aim(HandTarget { place: Vec3::ZERO, max_force: 1.0, yaw: 1.5, lean: [0.0; 2] });
    let mut before = UPRIGHT;
    for _ in 0..3000 {
        let now = device.exchange(&Wrench::ZERO).unwrap().pose.orientation;
        assert!(before.angle_between(now) < 0.02, "it turns gradually");
        before = now;
    }
    assert!(before.angle_between(Quat::from_rotation_y(1.5) * UPRIGHT) < 0.01);
}

#[test]
fn the_handle_leans_where_it_is_told_and_no_further_than_a_hand_can_hold_it() {
    // Aim: the shaft points to where the window says. Method: leans within and beyond the limit, with the view turned; the shaft's
    // direction has the components that were given, and points upward.
    for (lean, expected) in [([0.3, -0.4], [0.3, -0.4]), ([3.0, 4.0], [0.54, 0.72])] {
        let (mouse, mut device) = Mouse::new();
        mouse.aim(HandTarget { place: Vec3::ZERO, max_force: 1.0, yaw: 0.7, lean });
        let mut pose = device.exchange(&Wrench::ZERO).unwrap().pose;
        for _ in 0..3000 {
            pose = device.exchange(&Wrench::ZERO).unwrap().pose;
        }
        let shaft = pose.orientation * Vec3::Z;
        assert!((shaft.x - expected[0]).abs() < 0.01 && (shaft.z - expected[1]).abs() < 0.01, "{shaft}");
        assert!(shaft.y > 0.4);
    }
    let (mouse, _) = Mouse::new();
    mouse.aim(HandTarget { place: Vec3::X, max_force: 1.0, yaw: 0.0, lean: [f32::NAN, 0.0] });
    assert_eq!(mouse.state().hand.place, Vec3::ZERO, "an invalid lean is no target");
}

#[test]
fn a_mouse_is_always_there_but_needs_a_window() {
    crate::support::peace::in_real_time(|| {
        let mouse = driver_by_name("mouse").expect("it is a driver");
        assert_eq!(mouse.discover().unwrap().len(), 1);
        let trouble = mouse.open(None).err().expect("no window here");
        assert!(trouble.to_string().contains("desktop program"), "{trouble}");
    })
}
