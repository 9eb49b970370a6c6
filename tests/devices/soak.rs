//! The live servo with every fake, for long: nothing allocated, no letter missed, no force too great, every beat accounted
//! for. `TYPODONT_SOAK_S` sets how long each fake is soaked; 600 is the ten minutes that a release is given.

use crate::counting;
use crate::rig::Rig;
use crate::staged::Staged;
use crate::support::phantom::{self, HARD, SOFT};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::Wrench;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Setup, Simulation};
use typodont_core::touch::{Instrument, WorkingEnd};
use typodont_devices::servo::{Servo, ServoCommand, ServoEvent, TimingStats};

/// Beats before anything is counted: threads and devices settle.
const SETTLED: u64 = 500;

/// Soaks one fake: the hand leans on hard and soft matter in turn, cuts, lifts, changes tools.
pub fn soak(rig: &mut dyn Rig) {
    let seconds = std::env::var("TYPODONT_SOAK_S").ok().and_then(|s| s.parse().ok()).unwrap_or(6);
    let hand = rig.hand();
    hand.reach(Vec3::Y * 3.0);
    let mut device = rig.open().unwrap();
    let start = Instant::now();
    while device.exchange(&Wrench::ZERO).is_ok_and(|r| !r.pose.is_valid()) || !device.state().is_ready() {
        assert!(start.elapsed() < Duration::from_secs(20), "{}: {}", rig.name(), device.state());
        std::thread::sleep(Duration::from_millis(1));
    }
    let spec = device.spec().clone();
    let volume = phantom::volume([80, 80, 80], 0.2, |p| (p.y, if p.x < 0.0 { HARD } else { SOFT }));
    let bur = WorkingEnd::Ball { radius: 0.7 };
    let instruments = vec![Instrument::new(bur.clone(), true), Instrument::new(WorkingEnd::Point, false)];
    let setup = Setup { instruments, device: spec.clone(), ramp: 200, ..phantom::setup(volume, bur, true) };
    let before = counting::allocations();
    let is_over = Arc::new(AtomicBool::new(false));
    let over = is_over.clone();
    let watch = move |beat: u64| {
        if beat >= SETTLED {
            counting::watch(!over.load(Ordering::Relaxed));
        }
    };
    let device = Staged { device, beats: 0, at_beat: watch };
    let mut servo = Servo::start(Simulation::new(setup), Box::new(device), None, TimingStats::default()).unwrap();
    let (mut turned, mut forces, mut next, mut edits) = (0u64, 0.0f32, 0, Vec::new());
    let start = Instant::now();
    hand.most_felt();
    while start.elapsed() < Duration::from_secs(seconds) {
        let ms = start.elapsed().as_millis() as u64;
        let phase = (ms % 4000) as f32 / 4000.0;
        let lift = if ms % 8000 < 500 { 3.0 } else { -0.6 };
        hand.reach(Vec3::new(3.0 - 12.0 * (phase - 0.5).abs(), lift, 0.0));
        if ms / 8000 >= next {
            next += 1;
            servo.send(ServoCommand::Command(Command::SelectInstrument { instrument: (next % 2) as usize }));
        }
        while let Some(letter) = servo.next_event() {
            if let ServoEvent::Ticked(turn) = letter {
                assert_eq!(turn.step.tick.0, turned, "{}: a letter is missing", rig.name());
                turned += 1;
                forces = forces.max(turn.step.force.length());
                edits.clear();
                servo.take_edits(&turn, &mut edits);
                assert_eq!(edits.len(), turn.edits);
            }
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let elapsed = start.elapsed().as_secs_f64() * 1e3;
    // A thread that ends gives back what it was made of: that is not counted.
    is_over.store(true, Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(50));
    let ended = servo.stop().unwrap();
    let beats = ended.timing.summary();
    let allocated = counting::allocations() - before;
    let felt = hand.most_felt();
    println!("{}: {elapsed:.0} ms, {turned} ticks, {allocated} allocations, felt {felt} N; {beats:?}", rig.name());
    assert!(ended.device_error.is_none(), "{}: {:?}", rig.name(), ended.device_error);
    assert_eq!(allocated, 0, "{}", rig.name());
    assert_eq!(beats.dropped_events, 0, "{}", rig.name());
    assert!(forces <= spec.max_force * 1.001 && felt <= spec.max_force * 1.01, "{}: {forces} {felt}", rig.name());
    assert!(turned > 0);
}
