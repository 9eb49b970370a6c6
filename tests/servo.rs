//! The servo keeps its beat, accounts for every beat it missed, travels light, and lets go when it is late.

mod counting;
#[path = "drivers/peace.rs"]
mod peace;
#[path = "phantom/mod.rs"]
mod phantom;
#[path = "drivers/rig.rs"]
mod rig;
#[path = "drivers/simulated.rs"]
mod simulated;
#[path = "drivers/staged.rs"]
mod staged;

use phantom::{HARD, SOFT};
use rig::{Rig, SharedHand};
use simulated::Simulated;
use staged::Staged;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use typodont::device::{Device, Gone, Output, Reading, Spec};
use typodont::frame::Vec3;
use typodont::sim::{Beats, Command, Ended, Letter, Order, Servo, Setup, Simulation, Turn};
use typodont::touch::{Coefficient, Instrument, WorkingEnd};

/// A hand without a wire, for beats that the servo keeps itself.
struct InHand {
    hand: SharedHand,
    spec: Spec,
}

impl InHand {
    fn new(hand: &SharedHand) -> InHand {
        InHand { hand: hand.clone(), spec: Spec::phantom_omni() }
    }
}

impl Device for InHand {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        Ok(self.hand.turn(*output))
    }
}

/// A half space below y = 0: hard on the left, soft on the right; a bur and an explorer on the tray.
fn world() -> Setup {
    let tissue = |p: Vec3| if p.x < 0.0 { HARD } else { SOFT };
    let volume = phantom::volume([80, 80, 80], 0.2, |p| (p.y, tissue(p)));
    let bur = WorkingEnd::Ball { radius: 0.7 };
    let explorer = Instrument::new(WorkingEnd::Point, false);
    let setup = phantom::setup(volume, bur.clone(), true);
    Setup {
        instruments: vec![Instrument::new(bur.clone(), true), explorer],
        device: Spec::phantom_omni(),
        ramp: 200,
        ..setup
    }
}

/// How long a servo turned, ms: it cannot be asked itself, but it was no less than the one and no more than the other.
type Turned = std::ops::RangeInclusive<f64>;

/// Turns for a while; `at_ms` moves the hand and gives orders once a millisecond. Returns every tick that was told.
fn turn_for(
    device: impl Device + Send + 'static,
    duration: Duration,
    mut at_ms: impl FnMut(u64, &mut Servo),
) -> (Vec<Turn>, Ended, Turned) {
    let before = Instant::now();
    let mut servo = Servo::start(Simulation::new(world()), Box::new(device), None, Beats::default()).unwrap();
    while servo.next_letter().is_none() {
        assert!(before.elapsed() < Duration::from_secs(20), "the servo says nothing");
    }
    let start = Instant::now();
    let (mut turns, mut edits) = (Vec::new(), Vec::new());
    let mut fetch = |servo: &mut Servo| {
        while let Some(letter) = servo.next_letter() {
            if let Letter::Turned(turn) = letter {
                edits.clear();
                servo.take_edits(&turn, &mut edits);
                assert_eq!(edits.len(), turn.edits);
                turns.push(turn);
            }
        }
    };
    let mut told = 0;
    while start.elapsed() < duration {
        let now = start.elapsed().as_millis() as u64;
        (told..now).for_each(|ms| at_ms(ms, &mut servo));
        told = now.max(told);
        fetch(&mut servo);
        std::thread::sleep(Duration::from_millis(1));
    }
    let least = start.elapsed();
    servo.order(Order::Pause);
    std::thread::sleep(Duration::from_millis(20));
    fetch(&mut servo);
    let ended = servo.stop().unwrap();
    (turns, ended, least.as_secs_f64() * 1e3..=before.elapsed().as_secs_f64() * 1e3)
}

/// Where the hand goes: leans on the left, wanders to the right and back once in four seconds; lifts every two seconds, so
/// that a hand that was let go in the wall feels it again.
fn wander(hand: &SharedHand, ms: u64) {
    let phase = (ms % 4000) as f32 / 4000.0;
    let x = 3.0 - 12.0 * (phase - 0.5).abs();
    let y = if ms % 2000 < 250 { 3.0 } else { -0.9 };
    hand.reach(Vec3::new(x, y, 0.0));
}

#[test]
fn ten_thousand_ticks_with_everything_in_them_allocate_nothing() {
    crate::peace::in_real_time(|| {
        // Aim: the servo's thread travels light. Method: from its 300th beat on every allocation and release of that thread is
        // counted, through contact, cutting, a change of tool, of stiffness and of the bur, and a pause.
        let mut rig = Simulated::new();
        let hand = rig.hand();
        let device = rig.open().unwrap();
        let watch = |beat: u64| match beat {
            300 => counting::watch(true),
            10_300 => counting::watch(false),
            _ => {}
        };
        let device = Staged { device, beats: 0, at_beat: watch };
        hand.reach(Vec3::Y * 3.0);
        let before = counting::allocations();
        let (turns, ended, _) = turn_for(device, Duration::from_secs(16), |ms, servo| {
            wander(&hand, ms);
            let command = |servo: &mut Servo, command| assert!(servo.order(Order::Command(command)));
            match ms {
                6000 => command(servo, Command::Take { instrument: 1 }),
                6200 => hand.reach(Vec3::Y * 4.0),
                8000 => command(servo, Command::Take { instrument: 0 }),
                8500 => command(servo, Command::Set { label: SOFT, coefficient: Coefficient::Stiffness, value: 0.2 }),
                9000 => command(servo, Command::RunBur { running: false }),
                9300 => command(servo, Command::RunBur { running: true }),
                _ => {}
            }
            if (6000..6300).contains(&ms) || (8000..8300).contains(&ms) {
                hand.reach(Vec3::Y * 4.0);
            }
        });
        let allocated = counting::allocations() - before;
        let touched = turns.iter().filter(|t| t.step.touch.is_some()).count();
        let cut = turns.iter().filter(|t| t.step.cutting).count();
        let tools: std::collections::BTreeSet<_> = turns.iter().map(|t| t.step.instrument).collect();
        println!("{} ticks, {touched} touching, {cut} cutting, tools {tools:?}: {allocated} allocations", turns.len());
        assert!(turns.len() > 10_000, "{}: is the machine that busy?", turns.len());
        assert!(touched > 1000 && cut > 300 && tools.len() == 2, "{touched} {cut} {tools:?}");
        assert_eq!(allocated, 0);
        assert_eq!(ended.beats.dropped, 0);
    })
}

#[test]
fn every_beat_that_is_missed_is_counted() {
    crate::peace::in_real_time(|| {
        // Aim: ticks and missed beats together are the time that passed. Method: three stalls of 5, 15 and 40 ms in contact.
        let hand = SharedHand::at_rest(0.0);
        let stall = |beat: u64| {
            let ms = match beat {
                1000 => 5,
                1500 => 15,
                2000 => 40,
                _ => 0,
            };
            std::thread::sleep(Duration::from_millis(ms));
        };
        hand.reach(Vec3::Y * 3.0);
        let device = Staged { device: InHand::new(&hand), beats: 0, at_beat: stall };
        let (turns, ended, elapsed) = turn_for(device, Duration::from_secs(3), |ms, servo| {
            if ms == 0 {
                // Or it would cut the wall away.
                assert!(servo.order(Order::Command(Command::RunBur { running: false })));
            }
            hand.reach(Vec3::new(-2.0, if ms < 300 { 3.0 } else { -0.8 }, 0.0));
        });
        let beats = ended.beats.summary();
        let accounted = (turns.len() as u64 + beats.missed) as f64;
        println!("{elapsed:?} ms: {} ticks, {beats:?}", turns.len());
        // A servo may begin a little after it says so.
        assert!(elapsed.contains(&(accounted + 12.0)) || elapsed.contains(&accounted), "{accounted} of {elapsed:?}");
        assert!(beats.missed >= 5 + 15 + 40 - 6, "{beats:?}");
        // The two longer stalls let the hand go; each such tick is one that no reading was trusted in.
        let absent = turns.iter().filter(|t| !t.reading.pose.is_sound()).count() as u64;
        assert!(beats.let_go >= 2, "{beats:?}");
        assert!(absent >= beats.let_go, "{absent} {beats:?}");
        // Nothing is felt of a tick that is not trusted, and from there on the force comes back softly.
        let (ramp, most) = (world().ramp as usize, Spec::phantom_omni().max_force);
        for (place, _) in turns.iter().enumerate().filter(|(_, t)| !t.reading.pose.is_sound()) {
            for (after, turn) in turns[place..].iter().take(ramp).enumerate() {
                let share = after as f32 / ramp as f32;
                assert!(
                    turn.step.force.length() <= share * most,
                    "{} N {after} ms after it was let go",
                    turn.step.force
                );
            }
        }
        // The last tick is the pause.
        assert_ne!(turns[turns.len() - 100].step.force, Vec3::ZERO, "the wall is felt again");
    })
}

#[test]
fn a_busy_machine_lets_go_rather_than_holds() {
    crate::peace::in_real_time(|| {
        // Aim: with every core taken the hand is never pushed by a force that is old, and what came late is counted. Method:
        // four busy threads; the wire's end of the relay says how old the forces were that it passed on.
        let mut rig = Simulated::new();
        let hand = rig.hand();
        let device = rig.open().unwrap();
        let most = device.spec().max_force;
        let stop = std::sync::Arc::new(AtomicBool::new(false));
        let busy: Vec<_> = (0..4)
            .map(|_| {
                let stop = stop.clone();
                std::thread::spawn(move || while !stop.load(Ordering::Relaxed) {})
            })
            .collect();
        hand.reach(Vec3::Y * 3.0);
        let (turns, ended, elapsed) = turn_for(device, Duration::from_secs(8), |ms, _| wander(&hand, ms));
        stop.store(true, Ordering::Relaxed);
        busy.into_iter().for_each(|thread| thread.join().unwrap());
        let beats = ended.beats.summary();
        println!("{} ticks in {elapsed:?} ms with {}: {beats:?}", turns.len(), ended.priority);
        assert!(!turns.is_empty());
        assert!(hand.most_felt() <= most * 1.001);
        assert!(turns.iter().all(|t| t.step.force.is_finite() && t.step.force.length() <= most * 1.001));
        let is_late = beats.late_max > Duration::from_millis(12);
        let was_let_go = beats.let_go > 0 || turns.iter().any(|t| !t.reading.pose.is_sound());
        assert!(!is_late || was_let_go, "late by {:?} and never let go", beats.late_max);
        assert_eq!(beats.dropped, 0);
    })
}
