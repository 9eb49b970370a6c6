//! Lessons in the window with an arm, which sends its pose by the protocol of `content/devices/stream.md`.

use crate::harness::{self, Window};
use crate::support::bundle::{complained, typodont};
use crate::support::folder::folder;
use crate::support::window_driver::WindowDriver;
use std::net::UdpSocket;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use typodont_app::AppOptions;
use typodont_core::frame::{Quat, Vec3};
use typodont_render::Orbit;

/// Views that the menu offers for a tooth in a mouth.
const VIEWS: [&str; 12] = [
    "Working area",
    "Occlusal",
    "Buccal",
    "Lingual",
    "Mesial",
    "Distal",
    "Frontal",
    "Dental arch",
    "1 upper right",
    "2 upper left",
    "3 lower left",
    "4 lower right",
];

/// Distance from the tooth at which the arm is moved, mm: nothing is touched there.
const FAR: f32 = 60.0;

/// Largest movement of the arm within a millisecond, mm: a quick hand.
const SPEED: f32 = 0.2;

/// State of an arm: where its hand is and is wanted, mm, and its buttons, a bit each.
#[derive(Clone, Copy)]
struct ArmState {
    position: Vec3,
    goal: Vec3,
    buttons: u32,
    is_plugged_in: bool,
}

/// An arm, faked: a thread that sends its pose about a thousand times a second until it is dropped.
struct Arm {
    address: String,
    state: Arc<Mutex<ArmState>>,
    sending: Option<JoinHandle<()>>,
}

impl Arm {
    fn plug_in(position: Vec3) -> Arm {
        // A port that nobody had a moment ago.
        let address = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let state = Arc::new(Mutex::new(ArmState { position, goal: position, buttons: 0, is_plugged_in: true }));
        let (to, shared) = (address.clone(), state.clone());
        let sending = Some(thread::spawn(move || send(&to, &shared)));
        Arm { address, state, sending }
    }

    /// Moves the hand by `by`, mm, while the window runs.
    fn move_by(&self, by: Vec3, desk: &mut Window) {
        self.state.lock().unwrap().goal += by;
        let is_there = || {
            let state = self.state.lock().unwrap();
            state.position == state.goal
        };
        while !is_there() {
            desk.proceed();
        }
    }

    fn press_buttons(&self, buttons: u32) {
        self.state.lock().unwrap().buttons = buttons;
    }

    fn position(&self) -> Vec3 {
        self.state.lock().unwrap().position
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        self.state.lock().unwrap().is_plugged_in = false;
        let _ = self.sending.take().unwrap().join();
    }
}

fn send(to: &str, state: &Mutex<ArmState>) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let start = Instant::now();
    loop {
        let ArmState { position: Vec3 { x, y, z }, buttons, is_plugged_in, .. } = {
            let mut state = state.lock().unwrap();
            state.position = state.position.move_towards(state.goal, SPEED);
            *state
        };
        if !is_plugged_in {
            return;
        }
        let t_s = start.elapsed().as_secs_f64();
        let text = format!(r#"{{"t_s": {t_s}, "position_mm": [{x}, {y}, {z}], "buttons": {buttons}}}"#);
        // While nobody listens the system may refuse; the next pose comes anyway.
        let _ = socket.send_to(text.as_bytes(), to);
        thread::sleep(Duration::from_millis(1));
    }
}

/// Waits until the tip is at a place, mm.
fn until_tip_at(desk: &mut Window, place: Vec3) {
    desk.until("tip", |tip| vector(tip).distance(place) < 0.05);
}

fn vector(line: &str) -> Vec3 {
    let numbers: Vec<f32> = line.split(' ').map(|number| number.parse().unwrap()).collect();
    Vec3::from_slice(&numbers)
}

fn tip(desk: &Window) -> Vec3 {
    vector(&desk.latest("tip").unwrap())
}

/// Orientation of the picture in the world.
fn world_from_view(desk: &Window) -> Quat {
    let line = desk.latest("view").unwrap();
    let (azimuth, elevation) = line.split_once(' ').unwrap();
    let [azimuth, elevation] = [azimuth, elevation].map(|angle| angle.parse().unwrap());
    Orbit { azimuth, elevation, ..Orbit::around(Vec3::ZERO, 1.0) }.world_from_view()
}

/// Opens the grinding exercise with an arm, and moves it so that the clock runs.
fn begun(place: &Path, arm: &Arm) -> Option<Window> {
    let options = AppOptions {
        exercise: Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json")),
        seed: Some(1),
        begins_at_once: true,
        device: Some(format!("stream:{}", arm.address)),
        ..harness::options(place)
    };
    let mut desk = Window::open(place, options)?;
    desk.until("clock", |clock| clock == "stopped");
    desk.until("tooth", |tooth| tooth == "drawn");
    arm.move_by(Vec3::X * 10.0, &mut desk);
    desk.until("clock", |clock| clock == "running");
    Some(desk)
}

/// Ends the exercise, and checks that its recording is replayed to the same bits.
fn verify(place: &Path, desk: &mut Window) {
    desk.press("ctrl+Return", "asked", "finish");
    desk.press("Return", "screen", "results");
    let bundle = place.join(desk.until("bundle", |_| true));
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
}

#[test]
fn a_movement_to_the_right_is_to_the_right_in_each_of_the_twelve_views() {
    // Aim: the arm fits the picture, whichever view was chosen. Method: each view from the menu; the arm moves by 8 mm to the
    // right, up and toward the user, and the tip moves as far in the picture, that way and no other; the recording holds.
    const BY: f32 = 8.0;
    let place = folder("arm_views");
    let arm = Arm::plug_in(Vec3::Z * FAR);
    let Some(mut desk) = begun(&place, &arm) else { return };
    for view in VIEWS {
        desk.choose_from("View", view);
        let world_from_view = world_from_view(&desk);
        until_tip_at(&mut desk, world_from_view * arm.position());
        for along in [Vec3::X, Vec3::Y, Vec3::Z] {
            let before = tip(&desk);
            arm.move_by(along * BY, &mut desk);
            until_tip_at(&mut desk, world_from_view * arm.position());
            let in_picture = world_from_view.conjugate() * (tip(&desk) - before);
            assert!(in_picture.distance(along * BY) < 0.1, "{view}: {in_picture} in the picture, {along} of the hand");
        }
        arm.move_by(Vec3::splat(-BY), &mut desk);
    }
    verify(&place, &mut desk);
}

#[test]
fn the_clutch_moves_the_arm_alone_and_two_presses_recentre_it() {
    // Aim: key O and the second button of the arm are the clutch. Method: the arm moves by 40 mm with each of them pressed,
    // and the tip stays; two short presses of the key bring the tip to where the arm is, in the frame of the view.
    let place = folder("arm_clutch");
    harness::keep_settings(&place, r#"{ "language": "en", "hand_scale": 0.5 }"#);
    let arm = Arm::plug_in(Vec3::Z * 2.0 * FAR);
    let Some(mut desk) = begun(&place, &arm) else { return };
    let world_from_device = world_from_view(&desk);
    let in_world = |in_device: Vec3| world_from_device * in_device * 0.5;
    let wait = |desk: &mut Window| desk.wait(Duration::from_millis(500));
    until_tip_at(&mut desk, in_world(arm.position()));
    // It is near, and may still move on.
    wait(&mut desk);
    let start = tip(&desk);
    desk.set_key("O", true);
    desk.until("clutch", |clutch| clutch == "pressed");
    wait(&mut desk);
    arm.move_by(Vec3::Y * 40.0, &mut desk);
    wait(&mut desk);
    assert!(tip(&desk).distance(start) < 0.02, "{} with the key pressed", tip(&desk));
    desk.set_key("O", false);
    desk.until("clutch", |clutch| clutch == "free");
    arm.press_buttons(0b10);
    wait(&mut desk);
    arm.move_by(Vec3::X * 40.0, &mut desk);
    wait(&mut desk);
    assert!(tip(&desk).distance(start) < 0.02, "{} with the button pressed", tip(&desk));
    arm.press_buttons(0);
    wait(&mut desk);
    arm.move_by(Vec3::X * 10.0, &mut desk);
    until_tip_at(&mut desk, start + in_world(Vec3::X * 10.0));
    desk.press_twice("O");
    until_tip_at(&mut desk, in_world(arm.position()));
    assert_eq!(desk.latest("clutch").as_deref(), Some("free"));
    verify(&place, &mut desk);
}

#[test]
fn an_arm_behind_a_half_mirror_is_where_it_is_seen() {
    // Aim: once the four crosses have been touched, the instrument is drawn where the hand is, in any view. Method: a picture 300 mm high that is inclined by 40 degrees and turned by 20 in the arm's space; the hand goes
    // to the crosses in it, then to places of it; before, a registration that is cancelled. The recording holds.
    const HEIGHT: f32 = 300.0;
    let device_from_picture = Quat::from_rotation_y(0.35) * Quat::from_rotation_x(-0.7);
    let middle = Vec3::new(15.0, -20.0, 40.0);
    let hand_at = |x: f32, y: f32| middle + device_from_picture * Vec3::new(x, y, 0.0) * HEIGHT;
    let place = folder("arm_half_mirror");
    let arm = Arm::plug_in(Vec3::Z * FAR);
    let Some(mut desk) = begun(&place, &arm) else { return };
    desk.click_button("Register hand with picture …");
    desk.until("cross", |cross| cross == "1 ready");
    desk.press("Escape", "cross", "none");
    let world_from_device = world_from_view(&desk);
    until_tip_at(&mut desk, world_from_device * arm.position());
    desk.click_button("Register hand with picture …");
    for (number, [x, y]) in [(1, [-0.35, 0.35]), (2, [0.35, 0.35]), (3, [0.35, -0.35]), (4, [-0.35, -0.35])] {
        let ready = format!("{number} ready");
        desk.until("cross", |cross| cross == ready);
        arm.move_by(hand_at(x, y) - arm.position(), &mut desk);
        desk.wait(Duration::from_millis(200));
        if number == 2 {
            desk.picture("arm-registration");
        }
        desk.send_key("Space");
    }
    desk.until("cross", |cross| cross == "none");
    for view in ["Working area", "Occlusal", "Frontal"] {
        desk.choose_from("View", view);
        let world_from_view = world_from_view(&desk);
        for [x, y] in [[0.3, 0.4], [-0.4, 0.2]] {
            arm.move_by(hand_at(x, y) - arm.position(), &mut desk);
            // From the middle of the picture to the right and upward, by the picture's height at the tooth.
            desk.wait(Duration::from_millis(1200));
            let seen = vector(&desk.latest("seen").unwrap());
            // The hand, since matter may be in the way of the tip.
            let hand = vector(&desk.latest("hand").unwrap());
            let drawn = world_from_view.conjugate() * (hand - seen);
            let high = desk.latest("high").unwrap().parse::<f32>().unwrap();
            let expected = Vec3::new(x, y, 0.0) * high;
            assert!(drawn.distance(expected) < 0.15, "{view}: {drawn} instead of {expected}");
        }
    }
    desk.picture("arm-half-mirror");
    verify(&place, &mut desk);
}
