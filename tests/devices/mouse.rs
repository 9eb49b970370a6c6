//! The mouse without a window: what a window would do, done by the test.

use typodont_core::device::{Device, DeviceState, Pacing, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::driver_by_name;
use typodont_devices::mouse::Mouse;

/// Half a second of beats.
fn settle(device: &mut impl Device) -> Vec3 {
    let told = Wrench { force: Vec3::new(0.0, 0.5, 0.0), ..Wrench::ZERO };
    (0..500).map(|_| device.exchange(&told).unwrap().pose.position).last().unwrap()
}

#[test]
fn the_hand_follows_the_pointer() {
    crate::support::peace::in_real_time(|| {
        // Aim: right is right, down is down, the wheel goes into the screen, in millimetres. Method: each alone.
        let (mouse, mut device) = Mouse::new();
        assert_eq!((device.pacing(), device.state()), (Pacing::Host, DeviceState::Ready));
        mouse.move_by_pixels(50.0, 0.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, 0.0, 0.0)) < 0.01);
        mouse.clone().move_by_pixels(0.0, 30.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, -3.0, 0.0)) < 0.01);
        mouse.move_by_wheel(4.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, -3.0, -2.0)) < 0.01);
        mouse.set_button(0, true);
        mouse.set_button(2, true);
        mouse.set_button(40, true);
        assert_eq!(device.exchange(&Wrench::ZERO).unwrap().buttons, 0b101);
        mouse.set_button(0, false);
        let reading = device.exchange(&Wrench::ZERO).unwrap();
        assert_eq!((reading.buttons, reading.pose.orientation), (0b100, UPRIGHT));
    })
}

#[test]
fn the_hand_moves_as_the_picture_lies() {
    // Aim: right on the screen is the hand's right however the view is turned. Method: a picture looked at from the world's
    // +x, whose right is the world's -z and whose depth is -x.
    let (mouse, mut device) = Mouse::new();
    let from_the_side = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    mouse.move_by_pixels(50.0, 30.0, from_the_side);
    assert!(settle(&mut device).distance(Vec3::new(0.0, -3.0, -5.0)) < 0.01);
    mouse.move_by_wheel(4.0, from_the_side);
    assert!(settle(&mut device).distance(Vec3::new(-2.0, -3.0, -5.0)) < 0.01);
}

#[test]
fn a_mouse_that_lets_go_presses_nothing() {
    let (mouse, mut device) = Mouse::new();
    mouse.move_by_pixels(100.0, 0.0, Quat::IDENTITY);
    mouse.set_button(1, true);
    settle(&mut device);
    mouse.release_at(Vec3::new(4.0, 1.0, -2.0));
    assert!(settle(&mut device).distance(Vec3::new(4.0, 1.0, -2.0)) < 0.01);
    assert_eq!(device.exchange(&Wrench::ZERO).unwrap().buttons, 0);
}

#[test]
fn a_pointer_that_jumps_is_followed_as_a_hand_moves() {
    // Aim: steps of the pointer are no blows. Method: a jump across the screen; no beat moves the hand further than a hand
    // can, and the pointer comes back from the border at once.
    let (mouse, mut device) = Mouse::new();
    mouse.move_by_pixels(1e6, f32::NAN, Quat::IDENTITY);
    let mut last = Vec3::ZERO;
    for _ in 0..1000 {
        let now = device.exchange(&Wrench::ZERO).unwrap().pose.position;
        assert!(now.distance(last) <= 0.2501, "{last} to {now}");
        last = now;
    }
    assert!((last.x - device.spec().workspace_half.x).abs() < 0.01, "{last}");
    mouse.move_by_pixels(-100.0, 0.0, Quat::IDENTITY);
    assert!((settle(&mut device).x - (device.spec().workspace_half.x - 10.0)).abs() < 0.01);
}

#[test]
fn the_spring_is_kept_for_the_window() {
    let (mouse, mut device) = Mouse::new();
    assert_eq!(mouse.hand_and_force(), None);
    mouse.move_by_pixels(50.0, 0.0, Quat::IDENTITY);
    let hand = settle(&mut device);
    assert_eq!(mouse.hand_and_force(), Some((hand, Vec3::new(0.0, 0.5, 0.0))));
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
