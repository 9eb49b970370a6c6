//! Requirements on every driver, whatever its device.

use crate::rig::{Misbehaviour, Rig, SharedHand};
use crate::support::phantom::{self, HARD, SOFT};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceState, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::sim::{Setup, Simulation};
use typodont_core::touch::WorkingEnd;
use typodont_core::volume::Label;
use typodont_devices::servo::{Servo, ServoEvent, ServoExit, TimingStats};

type Held = Box<dyn Device + Send>;

/// Long enough for a loaded machine; a driver that works needs a fraction of it.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs the whole suite on one fake.
pub fn check(rig: &mut dyn Rig) {
    poses_and_buttons_arrive(rig);
    if rig.abilities().force {
        forces_arrive(rig);
        a_stalled_program_lets_go(rig);
        contact_is_stable(rig);
    }
    for &how in rig.abilities().misbehaviours {
        trouble_lets_go_and_passes(rig, how);
    }
}

/// Aim: the driver's readings are where the hand is, in world space. Method: the hand reaches along each axis, turns its
/// handle, presses a button.
fn poses_and_buttons_arrive(rig: &mut dyn Rig) {
    let (mut device, hand) = (ready(rig), rig.hand());
    let abilities = rig.abilities();
    for goal in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis * 8.0, axis * -8.0]) {
        let before = valid_reading(&mut device, rig.name()).pose.position;
        hand.reach(goal);
        let there = || hand.position().distance(goal) < 0.5;
        hold(&mut device, Wrench::ZERO, Duration::from_millis(600), there);
        let told = valid_reading(&mut device, rig.name()).pose.position;
        if abilities.is_rate {
            let moved = (told - before).normalize_or_zero();
            assert!(moved.dot(goal.normalize()) > 0.9, "{}: pushed to {goal}, moved {moved}", rig.name());
        } else {
            let off = told.distance(hand.position());
            assert!(off < 2.0 * abilities.resolution + 0.1, "{}: hand {}, told {told}", rig.name(), hand.position());
        }
    }
    hand.reach(Vec3::ZERO);
    for orientation in [
        UPRIGHT,
        Quat::from_rotation_x(0.5) * UPRIGHT,
        Quat::from_rotation_y(0.6) * Quat::from_rotation_z(-0.3) * UPRIGHT,
    ] {
        hand.turn_to(orientation);
        hold(&mut device, Wrench::ZERO, Duration::from_millis(300), || true);
        let told = valid_reading(&mut device, rig.name()).pose.orientation;
        let expected = if abilities.orientation { orientation } else { UPRIGHT };
        let off = told.angle_between(expected).to_degrees();
        if !abilities.is_rate {
            assert!(off < 1.0, "{}: handle {expected}, told {told}: {off}°", rig.name());
        }
    }
    for buttons in [1, 0].into_iter().filter(|_| abilities.buttons) {
        hand.press_buttons(buttons);
        let start = Instant::now();
        while exchange(&mut device, Wrench::ZERO).buttons & 1 != buttons {
            assert!(start.elapsed() < PATIENCE, "{}: button 0 is {buttons}, and nobody told", rig.name());
        }
    }
}

/// Aim: the hand feels what the driver is told, in newtons along the right axis, and never more than the device can.
fn forces_arrive(rig: &mut dyn Rig) {
    let (mut device, hand) = (ready(rig), rig.hand());
    for force in [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z].map(|axis| axis * 0.6) {
        let told = Wrench { force, ..Wrench::ZERO };
        // Servos warm up and services check a first command: what counts is what is felt after a while.
        let felt = force * rig.force_share();
        let arrived = || (hand.felt().force - felt).length() < 0.05 * felt.length();
        hold_until(&mut device, told, arrived, || format!("{}: told {force}, felt {}", rig.name(), hand.felt().force));
    }
    if rig.abilities().torque {
        for torque in [Vec3::X, Vec3::Y, -Vec3::Z].map(|axis| axis * 0.5 * device.spec().max_torque) {
            let told = Wrench { torque, ..Wrench::ZERO };
            let felt = torque * rig.force_share();
            let arrived = || (hand.felt().torque - felt).length() < 0.05 * felt.length();
            let what = || format!("{}: told {torque}, felt {}", rig.name(), hand.felt().torque);
            hold_until(&mut device, told, arrived, what);
        }
    }
    let most = device.spec().max_force;
    for wild in [Vec3::new(0.0, 1000.0, 0.0), Vec3::splat(f32::NAN), Vec3::splat(f32::INFINITY)] {
        hand.most_felt();
        hold(&mut device, Wrench { force: wild, ..Wrench::ZERO }, Duration::from_millis(50), || true);
        let felt = hand.most_felt();
        assert!(felt <= most * 1.01, "{}: felt {felt} N of a device of {most} N when told {wild}", rig.name());
    }
}

/// Aim: when the program stalls while it pushes, the hand is free within a moment. Method: push, then say nothing more.
fn a_stalled_program_lets_go(rig: &mut dyn Rig) {
    let (mut device, hand) = (ready(rig), rig.hand());
    let told = Wrench { force: Vec3::Y * 0.6, ..Wrench::ZERO };
    let pushed = || hand.felt().force.length() > 0.5 * rig.force_share();
    hold_until(&mut device, told, pushed, || format!("{}: no force arrives", rig.name()));
    eventually(|| hand.felt().force.length() < 1e-3, || format!("{}: the force stays on", rig.name()));
}

/// Aim: enamel held for five seconds, ten with `TYPODONT_LONG`, neither buzzes nor lets the bur in. Method: the servo turns a
/// world with a wall under the hand; the hand leans on it; its speed and its place are watched.
fn contact_is_stable(rig: &mut dyn Rig) {
    let hand = rig.hand();
    let device = ready_above(rig);
    let mut servo =
        Servo::start(Simulation::new(wall(&device, HARD, false)), device, None, TimingStats::default()).unwrap();
    press(&mut servo, &hand, -1.0, |_| hand.felt().force.y > 0.1, || format!("{}: no wall is felt", rig.name()));
    let mut heights = Vec::new();
    let mut speeds = Vec::new();
    let start = Instant::now();
    let mut heard = Heard::default();
    let held = Duration::from_secs(if std::env::var_os("TYPODONT_LONG").is_some() { 10 } else { 5 });
    while start.elapsed() < held {
        heard.letters(&mut servo);
        if start.elapsed() > Duration::from_secs(2) {
            heights.push(hand.position().y);
            speeds.push(hand.velocity().length());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let felt = hand.felt().force;
    let ended = servo.stop().unwrap();
    let speed = (speeds.iter().map(|v| v * v).sum::<f32>() / speeds.len() as f32).sqrt();
    let swing = heights.iter().fold(f32::MIN, |a, h| a.max(*h)) - heights.iter().fold(f32::MAX, |a, h| a.min(*h));
    println!(
        "{}: contact rms {speed:.3} mm/s, swing {swing:.4} mm, felt {felt}, {:?}",
        rig.name(),
        ended.timing.summary()
    );
    assert!(ended.device_error.is_none(), "{}: {:?} while leaning on a wall", rig.name(), ended.device_error);
    // A machine under load may let go and come back, which moves the hand once; a buzz never stops.
    if ended.timing.late_releases == 0 && heard.states <= 1 {
        assert!(speed < 5.0, "{}: rms {speed} mm/s against a wall", rig.name());
        assert!(swing < 0.3, "{}: swings {swing} mm against a wall", rig.name());
        assert!(felt.y > 0.1, "{}: the wall gave way: {felt}", rig.name());
    }
    assert_eq!(ended.timing.dropped_events, 0);
}

/// Aim: whatever happens in the middle of a cut, the hand is let go, somebody is told, and the session can go on.
fn trouble_lets_go_and_passes(rig: &mut dyn Rig, how: Misbehaviour) {
    let hand = rig.hand();
    let has_force = rig.abilities().force;
    let device = ready_above(rig);
    let setup = wall(&device, SOFT, true);
    let mut servo = Servo::start(Simulation::new(setup), device, None, TimingStats::default()).unwrap();
    let cutting = |heard: &Heard| heard.cut > 0 || rig.abilities().is_rate;
    let mut heard = press(&mut servo, &hand, -0.8, cutting, || format!("{}: never cuts", rig.name()));
    let states_before = heard.states;
    rig.misbehave(how);
    let start = Instant::now();
    let mut quiet = Instant::now();
    // Free is: no force for a fifth of a second.
    while quiet.elapsed() < Duration::from_millis(200) {
        heard.letters(&mut servo);
        if has_force && hand.felt().force.length() > 1e-3 {
            quiet = Instant::now();
        }
        assert!(start.elapsed() < PATIENCE, "{}: {how:?}: still pushes with {}", rig.name(), hand.felt().force);
        std::thread::sleep(Duration::from_millis(1));
    }
    let told = |heard: &Heard, servo: &Servo| servo.has_ended() || heard.states > states_before;
    while !told(&heard, &servo) {
        heard.letters(&mut servo);
        assert!(start.elapsed() < PATIENCE, "{}: {how:?}: nobody was told", rig.name());
        std::thread::sleep(Duration::from_millis(1));
    }
    let message = heard.last.map(|state| state.to_string()).unwrap_or_default();
    lean(&hand, 3.0);
    // A device that only cools or slows down comes back by itself; one that is gone is opened again, as a session does.
    let ServoExit { simulation, device, timing: beats, device_error: gone, .. } = servo.stop().unwrap();
    let said = gone.map_or(message, |gone| gone.to_string());
    assert!(said.len() > 15, "{}: {how:?}: says only \"{said}\"", rig.name());
    println!("{}: {how:?}: {said}", rig.name());
    rig.recover();
    let device = match gone {
        Some(_) => {
            drop(device);
            ready_above(rig)
        }
        None => device,
    };
    let turned = simulation.tick();
    let mut servo = Servo::start(simulation, device, None, beats).unwrap();
    let above = |heard: &Heard| heard.ticks > 50;
    listen_for(&mut servo, PATIENCE, above, || format!("{}: {how:?}: does not go on", rig.name()));
    if has_force {
        let pushed = |_: &Heard| hand.felt().force.length() > 0.05 * rig.force_share();
        press(&mut servo, &hand, -1.5, pushed, || format!("{}: {how:?}: no force after it", rig.name()));
    }
    lean(&hand, 3.0);
    let ended = servo.stop().unwrap();
    assert!(ended.simulation.tick() > turned, "{}: {how:?}: the session stands still", rig.name());
}

/// A world for a device: a half space of one tissue below y = 0, a round bur of 1.4 mm in the hand.
fn wall(device: &Held, tissue: Label, cuts: bool) -> Setup {
    let volume = phantom::volume([64, 64, 64], 0.25, |p| (p.y, tissue));
    let device = device.spec().clone();
    Setup { device, ramp: 100, ..phantom::setup(volume, WorkingEnd::Ball { radius: 0.7 }, cuts) }
}

/// Moves the hand's goal to a height within a quarter of a second, as a person would.
fn lean(hand: &SharedHand, height: f32) {
    let from = hand.goal();
    for i in 1..=50 {
        hand.reach(from.lerp(Vec3::Y * height, i as f32 / 50.0));
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Opens the fake and waits until it is ready.
fn ready(rig: &mut dyn Rig) -> Held {
    let start = Instant::now();
    let mut device = loop {
        match rig.open() {
            Ok(device) => break device,
            Err(why) if start.elapsed() > PATIENCE => panic!("{}: {why}", rig.name()),
            Err(_) => std::thread::sleep(Duration::from_millis(100)),
        }
    };
    loop {
        let reading = device.exchange(&Wrench::ZERO).unwrap_or_else(|gone| panic!("{}: {gone}", rig.name()));
        if device.state() == DeviceState::Ready && reading.pose.is_valid() {
            return device;
        }
        assert!(start.elapsed() < PATIENCE, "{}: {}", rig.name(), device.state());
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Ready, and the hand above the wall.
fn ready_above(rig: &mut dyn Rig) -> Held {
    let hand = rig.hand();
    let mut device = ready(rig);
    hand.turn_to(UPRIGHT);
    hand.reach(Vec3::Y * 3.0);
    let there = || hand.position().distance(Vec3::Y * 3.0) < 0.5;
    hold(&mut device, Wrench::ZERO, Duration::from_millis(600), there);
    device
}

/// One beat from the test's own thread.
fn exchange(device: &mut Held, told: Wrench) -> Reading {
    std::thread::sleep(Duration::from_millis(1));
    device.exchange(&told).unwrap_or_else(|gone| panic!("{gone}"))
}

/// The next reading that is one: on a busy machine an answer may miss its beat, and the driver says that it has none.
fn valid_reading(device: &mut Held, name: &str) -> Reading {
    let start = Instant::now();
    loop {
        let reading = exchange(device, Wrench::ZERO);
        if reading.pose.is_valid() {
            return reading;
        }
        assert!(start.elapsed() < PATIENCE, "{name}: no valid reading");
    }
}

/// Tells the same for a while, and on until something holds.
fn hold(device: &mut Held, told: Wrench, least: Duration, until: impl Fn() -> bool) {
    let start = Instant::now();
    while start.elapsed() < least || !until() && start.elapsed() < PATIENCE {
        exchange(device, told);
    }
}

fn hold_until(device: &mut Held, told: Wrench, until: impl Fn() -> bool, what: impl Fn() -> String) {
    let start = Instant::now();
    while !until() {
        exchange(device, told);
        assert!(start.elapsed() < PATIENCE, "{}", what());
    }
}

fn eventually(holds: impl Fn() -> bool, what: impl Fn() -> String) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{}", what());
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Contents of the servo's events so far.
#[derive(Default)]
struct Heard {
    ticks: u64,
    /// Ticks in which tissue was cut.
    cut: u64,
    states: u32,
    last: Option<DeviceState>,
    edits: Vec<typodont_core::volume::Edit>,
}

impl Heard {
    fn letters(&mut self, servo: &mut Servo) {
        while let Some(letter) = servo.next_event() {
            match letter {
                ServoEvent::Ticked(turn) => {
                    self.ticks += 1;
                    self.cut += u64::from(turn.step.cutting);
                    self.edits.clear();
                    servo.take_edits(&turn, &mut self.edits);
                }
                ServoEvent::DeviceState(state) => {
                    self.states += 1;
                    self.last = Some(state);
                }
                ServoEvent::Started(_) | ServoEvent::Commanded(..) | ServoEvent::AwaitingMovement(_) => {}
            }
        }
    }
}

/// Presses down to a height until `enough` holds. If the force was switched off meanwhile, as on a computer under load,
/// and the hand sank deep into the wall, it feels nothing until it has left the wall: it then lifts off and presses
/// again, as a person would.
fn press(
    servo: &mut Servo,
    hand: &SharedHand,
    height: f32,
    enough: impl Fn(&Heard) -> bool,
    what: impl Fn() -> String,
) -> Heard {
    let mut heard = Heard::default();
    let start = Instant::now();
    loop {
        lean(hand, height);
        let leaning = Instant::now();
        while leaning.elapsed() < Duration::from_secs(2) {
            heard.letters(servo);
            if enough(&heard) {
                return heard;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(
            start.elapsed() < PATIENCE,
            "{}: {} ticks heard, the hand at {}, felt {}, last {:?}, ended {}",
            what(),
            heard.ticks,
            hand.position(),
            hand.felt().force,
            heard.last,
            servo.has_ended()
        );
        lean(hand, 3.0);
    }
}

fn listen_for(
    servo: &mut Servo,
    patience: Duration,
    enough: impl Fn(&Heard) -> bool,
    what: impl Fn() -> String,
) -> Heard {
    let mut heard = Heard::default();
    let start = Instant::now();
    while !enough(&heard) {
        heard.letters(servo);
        assert!(start.elapsed() < patience, "{}", what());
        std::thread::sleep(Duration::from_millis(1));
    }
    heard
}
