//! The servo keeps its period, counts every missed period, never allocates, and switches the force off when it is late.

use crate::counting;
use crate::rig;
use crate::simulated;
use crate::staged;
use crate::support::phantom;

use phantom::{HARD, SOFT};
use rig::{Rig, SharedHand};
use simulated::Simulated;
use staged::Staged;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Setup, Simulation};
use typodont_core::touch::{Coefficient, Instrument, WorkingEnd};
use typodont_devices::servo::{Servo, ServoCommand, ServoEvent, ServoExit, TickReport, TimingStats};

/// A hand without a wire, for beats that the servo keeps itself.
struct InHand {
    hand: SharedHand,
    spec: DeviceSpec,
}

impl InHand {
    fn new(hand: &SharedHand) -> InHand {
        InHand { hand: hand.clone(), spec: DeviceSpec::phantom_omni() }
    }
}

impl Device for InHand {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
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
        device: DeviceSpec::phantom_omni(),
        ramp: 200,
        ..setup
    }
}

/// Lower and upper bound of the running time of a servo, ms; the exact time cannot be measured from outside.
type Turned = std::ops::RangeInclusive<f64>;

/// Runs a servo for a time; `at_ms` moves the hand and sends commands once per millisecond. Returns all ticks reported.
fn turn_for(
    device: impl Device + Send + 'static,
    duration: Duration,
    mut at_ms: impl FnMut(u64, &mut Servo),
) -> (Vec<TickReport>, ServoExit, Turned) {
    let before = Instant::now();
    let mut servo = Servo::start(Simulation::new(world()), Box::new(device), None, TimingStats::default()).unwrap();
    while servo.next_event().is_none() {
        assert!(before.elapsed() < Duration::from_secs(20), "the servo says nothing");
    }
    let start = Instant::now();
    let (mut turns, mut edits) = (Vec::new(), Vec::new());
    let mut fetch = |servo: &mut Servo| {
        while let Some(letter) = servo.next_event() {
            if let ServoEvent::Ticked(turn) = letter {
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
    servo.send(ServoCommand::Pause);
    std::thread::sleep(Duration::from_millis(20));
    fetch(&mut servo);
    let ended = servo.stop().unwrap();
    (turns, ended, least.as_secs_f64() * 1e3..=before.elapsed().as_secs_f64() * 1e3)
}

/// Path of the hand: it presses on the left wall, and moves to the right and back once in four seconds; it lifts every
/// two seconds, so that a device whose force was switched off inside the wall renders it again.
fn wander(hand: &SharedHand, ms: u64) {
    let phase = (ms % 4000) as f32 / 4000.0;
    let x = 3.0 - 12.0 * (phase - 0.5).abs();
    let y = if ms % 2000 < 250 { 3.0 } else { -0.9 };
    hand.reach(Vec3::new(x, y, 0.0));
}

#[test]
fn a_servo_without_a_thread_makes_up_for_a_tenth_of_a_second_and_counts_the_rest() {
    // Aim: in a page, which has no threads, the same ticks run as natively, and none is lost in silence. Method: poll late
    // by a little and by a lot; every reading is stepped again by hand; ticks run and ticks missed are the time that passed.
    let hand = SharedHand::at_rest(0.0);
    let before = Instant::now();
    let simulation = Simulation::new(world());
    let mut servo = Servo::start_inline(simulation, Box::new(Unfelt::new(&hand)), None, TimingStats::default());
    let mut ticks: Vec<TickReport> = Vec::new();
    let mut edits = Vec::new();
    let mut run_after = |servo: &mut Servo, wait: u64, to: Vec3| {
        hand.reach(to);
        std::thread::sleep(Duration::from_millis(wait));
        servo.advance();
        let count = ticks.len();
        while let Some(event) = servo.next_event() {
            if let ServoEvent::Ticked(tick) = event {
                servo.take_edits(&tick, &mut edits);
                ticks.push(tick);
            }
        }
        ticks.len() - count
    };
    assert!(run_after(&mut servo, 20, Vec3::new(3.0, 2.0, 0.0)) >= 20);
    assert_eq!(run_after(&mut servo, 400, Vec3::new(3.0, -1.5, 0.0)), 100, "no more than a tenth of a second");
    assert!(run_after(&mut servo, 30, Vec3::new(3.0, -1.5, 0.0)) >= 30);
    servo.send(ServoCommand::Pause);
    run_after(&mut servo, 5, Vec3::new(3.0, -1.5, 0.0));
    assert_eq!(run_after(&mut servo, 5, Vec3::new(3.0, -1.5, 0.0)), 0, "a pause");
    let elapsed = before.elapsed().as_millis() as u64;
    let ended = servo.stop().unwrap();
    let due = ended.timing.late.count() + ended.timing.missed;
    assert!(ended.timing.missed >= 300 && due <= elapsed && due + 5 >= 460, "{due} of {elapsed} ms");
    assert_eq!((ended.timing.late_releases, ended.timing.dropped_events), (0, 0));
    let mut again = Simulation::new(world());
    for tick in &ticks {
        assert_eq!(again.step(&tick.reading), tick.step);
    }
    assert!(ticks.iter().any(|tick| tick.step.touch.is_some()), "the bur touched nothing");
    assert_eq!(edits.len(), ticks.iter().map(|tick| tick.edits).sum::<usize>());
}

#[test]
fn a_servo_without_a_thread_releases_a_hand_that_feels_its_force_when_it_is_late() {
    // Aim: where a page was held up, no old force is rendered, and the hand is not led through what it has passed meanwhile.
    // Method: a hand that leans on the wall; nobody asks the servo for a while.
    let hand = SharedHand::at_rest(0.0);
    let device = Box::new(InHand::new(&hand));
    let mut servo = Servo::start_inline(Simulation::new(world()), device, None, TimingStats::default());
    let mut edits = Vec::new();
    let mut advance = |servo: &mut Servo, wait: Duration| {
        std::thread::sleep(wait);
        servo.advance();
        let mut steps = Vec::new();
        while let Some(event) = servo.next_event() {
            if let ServoEvent::Ticked(tick) = event {
                servo.take_edits(&tick, &mut edits);
                steps.push(tick);
            }
        }
        steps
    };
    let mut is_felt = false;
    for ms in 0..2000 {
        hand.reach(Vec3::new(-3.0, if ms < 200 { 2.0 } else { -0.9 }, 0.0));
        let steps = advance(&mut servo, Duration::from_millis(1));
        is_felt = steps.last().map_or(is_felt, |tick| tick.step.wrench().force.y > 0.1);
    }
    assert!(is_felt, "nothing is felt: {}", hand.position());
    let steps = advance(&mut servo, Duration::from_millis(60));
    assert_eq!(steps.len(), 10, "what was missed longer ago is not made up for");
    assert!(!steps[0].reading.pose.is_valid(), "{:?}", steps[0].reading);
    let most = steps.iter().map(|tick| tick.step.wrench().force.length()).fold(0.0, f32::max);
    assert!(most < 0.05, "{most} N");
    let ended = servo.stop().unwrap();
    assert!(ended.timing.late_releases >= 1 && ended.timing.missed >= 40, "{:?}", ended.timing.summary());
    assert_eq!(hand.felt(), Wrench::ZERO);
}

/// A hand like [`InHand`] that feels nothing, as that of a mouse; it is lost after a number of exchanges.
struct Unfelt {
    device: InHand,
    exchanges: u32,
}

impl Unfelt {
    fn new(hand: &SharedHand) -> Unfelt {
        Unfelt { device: InHand::new(hand), exchanges: u32::MAX }
    }
}

impl Device for Unfelt {
    fn spec(&self) -> &DeviceSpec {
        &self.device.spec
    }

    fn renders_force(&self) -> bool {
        false
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.exchanges = self.exchanges.checked_sub(1).ok_or(DeviceError::Ended)?;
        self.device.exchange(output)
    }
}

#[test]
fn a_servo_whose_force_nobody_feels_runs_its_ticks_several_at_once() {
    // Aim: a lesson with a mouse spares the processor and accounts for every tick. Method: run a servo for a second; half of
    // the ticks come more than a millisecond late, because they wait for others; the readings are stepped again by hand.
    let hand = SharedHand::at_rest(0.0);
    let (ticks, ended, elapsed) = turn_for(Unfelt::new(&hand), Duration::from_secs(1), |ms, _| wander(&hand, 4 * ms));
    let due = (ended.timing.late.count() + ended.timing.missed) as f64;
    assert!(due + 5.0 >= *elapsed.start() && due <= *elapsed.end(), "{due} ticks in {elapsed:?} ms");
    assert!(ended.timing.late.percentile(0.5) >= Duration::from_millis(1), "{:?}", ended.timing.late.percentile(0.5));
    assert_eq!((ended.timing.late_releases, ended.timing.dropped_events), (0, 0));
    let mut again = Simulation::new(world());
    assert!(ticks.iter().all(|tick| again.step(&tick.reading) == tick.step));
    assert!(ticks.iter().any(|tick| tick.step.touch.is_some()), "the bur touched nothing");
}

#[test]
fn ticks_several_at_once_wait_for_the_hand_and_end_with_the_device() {
    // Aim: a mouse is waited for and lost as an arm is. Method: nothing moves until 500 ms have passed; the device ends after
    // 650 exchanges.
    let hand = SharedHand::at_rest(10.0);
    let device = Unfelt { exchanges: 650, ..Unfelt::new(&hand) };
    let (ticks, ended, _) = turn_for(device, Duration::from_millis(1200), |ms, servo| match ms {
        0 => assert!(servo.send(ServoCommand::AwaitMovement)),
        500 => hand.reach(Vec3::new(0.0, 20.0, 0.0)),
        _ => {}
    });
    assert!((1..=500).contains(&ticks.len()), "{} ticks", ticks.len());
    assert!(ticks.windows(2).all(|pair| pair[1].step.tick == pair[0].step.tick.next()), "ticks follow one another");
    assert!(matches!(ended.device_error, Some(DeviceError::Ended)), "{:?}", ended.device_error);
}

#[test]
fn a_waiting_simulation_starts_with_the_first_movement_of_the_hand() {
    // Aim: no time passes while the trainee reads. Method: the hand trembles by less than a movement, then moves; only
    // the first tick, by which the instrument is seen, comes before. A second wait ends by request.
    let rig = Simulated::new();
    let hand = rig.hand();
    hand.reach(Vec3::new(0.0, 10.0, 0.0));
    for _ in 0..3000 {
        hand.turn(Wrench::ZERO);
    }
    let (turns, _, _) = turn_for(InHand::new(&hand), Duration::from_millis(1500), |ms, servo| match ms {
        0 => assert!(servo.send(ServoCommand::AwaitMovement)),
        1..700 => hand.reach(Vec3::new(0.0, 10.0 + (ms % 2) as f32, 0.0)),
        700 => hand.reach(Vec3::new(0.0, 16.0, 0.0)),
        1000 => assert!(servo.send(ServoCommand::AwaitMovement)),
        1200 => assert!(servo.send(ServoCommand::StopAwaiting)),
        _ => {}
    });
    let still = turns.iter().filter(|turn| turn.reading.pose.position.y < 12.0).count();
    let run = turns.len() - still;
    assert!((1..=60).contains(&still), "{still} ticks before the hand moved");
    assert!((300..=700).contains(&run), "{run} ticks in about 300 and 300 ms, with a wait of 200 ms between them");
    assert!(turns.windows(2).all(|pair| pair[1].step.tick == pair[0].step.tick.next()), "ticks follow one another");
}

#[test]
fn ten_thousand_ticks_with_everything_in_them_allocate_nothing() {
    crate::support::peace::in_real_time(|| {
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
            let command = |servo: &mut Servo, command| assert!(servo.send(ServoCommand::Command(command)));
            match ms {
                6000 => command(servo, Command::SelectInstrument { instrument: 1 }),
                6200 => hand.reach(Vec3::Y * 4.0),
                8000 => command(servo, Command::SelectInstrument { instrument: 0 }),
                8500 => command(
                    servo,
                    Command::SetCoefficient { label: SOFT, coefficient: Coefficient::Stiffness, value: 0.2 },
                ),
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
        assert_eq!(ended.timing.dropped_events, 0);
    })
}

#[test]
fn every_beat_that_is_missed_is_counted() {
    crate::support::peace::in_real_time(|| {
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
                assert!(servo.send(ServoCommand::Command(Command::RunBur { running: false })));
            }
            hand.reach(Vec3::new(-2.0, if ms < 300 { 3.0 } else { -0.8 }, 0.0));
        });
        let beats = ended.timing.summary();
        let accounted = (turns.len() as u64 + beats.missed) as f64;
        println!("{elapsed:?} ms: {} ticks, {beats:?}", turns.len());
        // A servo may begin a little after it says so.
        assert!(elapsed.contains(&(accounted + 12.0)) || elapsed.contains(&accounted), "{accounted} of {elapsed:?}");
        assert!(beats.missed >= 5 + 15 + 40 - 6, "{beats:?}");
        // The two longer stalls let the hand go; each such tick is one that no reading was trusted in.
        let absent = turns.iter().filter(|t| !t.reading.pose.is_valid()).count() as u64;
        assert!(beats.late_releases >= 2, "{beats:?}");
        assert!(absent >= beats.late_releases, "{absent} {beats:?}");
        // Nothing is felt of a tick that is not trusted, and from there on the force comes back softly.
        let (ramp, most) = (world().ramp as usize, DeviceSpec::phantom_omni().max_force);
        for (place, _) in turns.iter().enumerate().filter(|(_, t)| !t.reading.pose.is_valid()) {
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
    crate::support::peace::in_real_time(|| {
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
        let beats = ended.timing.summary();
        println!("{} ticks in {elapsed:?} ms with {}: {beats:?}", turns.len(), ended.priority);
        assert!(!turns.is_empty());
        assert!(hand.most_felt() <= most * 1.001);
        assert!(turns.iter().all(|t| t.step.force.is_finite() && t.step.force.length() <= most * 1.001));
        let is_late = beats.late_max > Duration::from_millis(12);
        let was_let_go = beats.late_releases > 0 || turns.iter().any(|t| !t.reading.pose.is_valid());
        assert!(!is_late || was_let_go, "late by {:?} and never let go", beats.late_max);
        assert_eq!(beats.dropped_events, 0);
    })
}
