//! The mouse without a window: what a window would do, done by the test.

use typodont::device::mouse::Mouse;
use typodont::device::{Beat, Device, Output, State, UPRIGHT, driver};
use typodont::frame::{Quat, Vec3};

/// Half a second of beats.
fn settle(device: &mut impl Device) -> Vec3 {
    let told = Output { force: Vec3::new(0.0, 0.5, 0.0), ..Output::NONE };
    (0..500).map(|_| device.exchange(&told).unwrap().pose.position).last().unwrap()
}

#[test]
fn the_hand_follows_the_pointer() {
    crate::peace::in_real_time(|| {
        // Aim: right is right, down is down, the wheel goes into the screen, in millimetres. Method: each alone.
        let (mouse, mut device) = Mouse::new();
        assert_eq!((device.beat(), device.state()), (Beat::Ours, State::Ready));
        mouse.moved(50.0, 0.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, 0.0, 0.0)) < 0.01);
        mouse.clone().moved(0.0, 30.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, -3.0, 0.0)) < 0.01);
        mouse.wheel(4.0, Quat::IDENTITY);
        assert!(settle(&mut device).distance(Vec3::new(5.0, -3.0, -2.0)) < 0.01);
        mouse.button(0, true);
        mouse.button(2, true);
        mouse.button(40, true);
        assert_eq!(device.exchange(&Output::NONE).unwrap().buttons, 0b101);
        mouse.button(0, false);
        let reading = device.exchange(&Output::NONE).unwrap();
        assert_eq!((reading.buttons, reading.pose.orientation), (0b100, UPRIGHT));
    })
}

#[test]
fn the_hand_moves_as_the_picture_lies() {
    // Aim: right on the screen is the hand's right however the view is turned. Method: a picture looked at from the world's
    // +x, whose right is the world's -z and whose depth is -x.
    let (mouse, mut device) = Mouse::new();
    let from_the_side = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    mouse.moved(50.0, 30.0, from_the_side);
    assert!(settle(&mut device).distance(Vec3::new(0.0, -3.0, -5.0)) < 0.01);
    mouse.wheel(4.0, from_the_side);
    assert!(settle(&mut device).distance(Vec3::new(-2.0, -3.0, -5.0)) < 0.01);
}

#[test]
fn a_mouse_that_lets_go_presses_nothing() {
    let (mouse, mut device) = Mouse::new();
    mouse.moved(100.0, 0.0, Quat::IDENTITY);
    mouse.button(1, true);
    settle(&mut device);
    mouse.rest_at(Vec3::new(4.0, 1.0, -2.0));
    assert!(settle(&mut device).distance(Vec3::new(4.0, 1.0, -2.0)) < 0.01);
    assert_eq!(device.exchange(&Output::NONE).unwrap().buttons, 0);
}

#[test]
fn a_pointer_that_jumps_is_followed_as_a_hand_moves() {
    // Aim: steps of the pointer are no blows. Method: a jump across the screen; no beat moves the hand further than a hand
    // can, and the pointer comes back from the border at once.
    let (mouse, mut device) = Mouse::new();
    mouse.moved(1e6, f32::NAN, Quat::IDENTITY);
    let mut last = Vec3::ZERO;
    for _ in 0..1000 {
        let now = device.exchange(&Output::NONE).unwrap().pose.position;
        assert!(now.distance(last) <= 0.2501, "{last} to {now}");
        last = now;
    }
    assert!((last.x - device.spec().workspace_half.x).abs() < 0.01, "{last}");
    mouse.moved(-100.0, 0.0, Quat::IDENTITY);
    assert!((settle(&mut device).x - (device.spec().workspace_half.x - 10.0)).abs() < 0.01);
}

#[test]
fn the_spring_is_kept_for_the_window() {
    let (mouse, mut device) = Mouse::new();
    assert_eq!(mouse.spring(), None);
    mouse.moved(50.0, 0.0, Quat::IDENTITY);
    let hand = settle(&mut device);
    assert_eq!(mouse.spring(), Some((hand, Vec3::new(0.0, 0.5, 0.0))));
}

#[test]
fn a_mouse_is_always_there_but_needs_a_window() {
    crate::peace::in_real_time(|| {
        let mouse = driver("mouse").expect("it is a driver");
        assert_eq!(mouse.find().unwrap().len(), 1);
        let trouble = mouse.open(None).err().expect("no window here");
        assert!(trouble.to_string().contains("desktop program"), "{trouble}");
    })
}
