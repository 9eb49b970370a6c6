//! A live session on a wire: what the servo did is what a replay does, even when the cable was pulled in the middle.

use crate::haply::Haply;
use crate::rig::{Misbehaviour, Rig, SharedHand};
use crate::simulated::Simulated;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use typodont_core::device::DeviceSpec;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Simulation, Step};
use typodont_devices::HandLink;
use typodont_devices::servo::{SecondHandLink, SecondHandRole, SecondHandServo};
use typodont_exercise::record::{Recorder, Recording, RecordingEndFile, RecordingHeadFile, ReplayCheck, replay};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece};
use typodont_exercise::session::{Input, Session};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_lesson::live::{LiveEvent, LiveSession};

fn grinding() -> Arc<Scenario> {
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let source = SourceText::new("5-grinding.json", text);
    Arc::new(scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap())
}

/// The grinding exercise, about to be recorded live under a name.
struct Begun {
    workpiece: Workpiece,
    file: PathBuf,
    recorder: Recorder,
    session: Session,
    simulation: Simulation,
}

fn begun(name: &str, spec: &DeviceSpec) -> Begun {
    let scenario = grinding();
    let workpiece = Workpiece::make(&scenario, 4).unwrap();
    let head = RecordingHeadFile { live: true, ..RecordingHeadFile::of(&scenario, spec, 4) };
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.mcap"));
    let recorder = Recorder::create(&file, &head, &scenario, &workpiece).unwrap();
    let simulation = Simulation::new(typodont_exercise::session::setup(&scenario, &workpiece, spec.clone()));
    Begun { file, recorder, session: Session::new(scenario, &workpiece), simulation, workpiece }
}

#[test]
fn a_live_session_holds_when_turned_again() {
    crate::support::peace::in_real_time(|| {
        // Aim: a recording of a person's session is a proof like a script's. Method: the grinding exercise on a simulated wire,
        // an instrument taken, the cable pulled while cutting, plugged in again, said to be done; then verified.
        let mut rig = Simulated::new();
        let hand = rig.hand();
        hand.reach(Vec3::Y * 8.0);
        let device = rig.open().unwrap();
        let Begun { workpiece, file, mut recorder, mut session, simulation } = begun("live", device.spec());
        let (mut live, _) = LiveSession::begin(&mut session, simulation, device, None, &mut recorder).unwrap();
        // Above the decay, then onto it.
        let decay = workpiece.world_from_tooth * workpiece.lesions[0].centre;
        let start = Instant::now();
        let (mut cut, mut gone, mut was_pulled, mut done) = (0, 0, false, false);
        let mut back_at = None;
        while !session.are_stages_over() {
            assert!(start.elapsed() < Duration::from_secs(60), "cut {cut}, gone {gone}");
            let heard = live.poll(&mut session, &mut recorder).unwrap();
            gone += heard.iter().filter(|h| matches!(h, LiveEvent::DeviceLost(_))).count();
            cut += usize::from(live.latest_step().is_some_and(|s| s.cutting));
            let seconds = start.elapsed().as_secs_f32();
            let height = if back_at.is_some_and(|at: Instant| at.elapsed() < Duration::from_secs(1)) {
                6.0
            } else {
                (6.0 - 3.0 * seconds).max(-1.5)
            };
            hand.reach(decay + Vec3::Y * height);
            if cut > 50 && !was_pulled {
                let heard = live.submit(&Input::Take { instrument: 1 }, &mut session, &mut recorder).unwrap();
                assert!(!heard.is_empty());
                rig.misbehave(Misbehaviour::Unplug);
                was_pulled = true;
            }
            if live.is_suspended() {
                rig.recover();
                assert!(live.resume_with::<Recorder>(rig.open().unwrap()).unwrap());
                back_at = Some(Instant::now());
            }
            if cut > 400 && gone == 1 && !done {
                done = true;
                live.submit(&Input::Confirm, &mut session, &mut recorder).unwrap();
            }
            std::thread::sleep(Duration::from_millis(3));
        }
        let kept = live.end::<Recorder>().unwrap();
        let servo = kept.servo_file();
        recorder.finish(&RecordingEndFile { reason: "complete".into(), servo: servo.clone() }).unwrap();
        println!("{servo:?}");
        assert_eq!((servo.interruptions, servo.dropped), (1, 0));
        let recording = Recording::read(&file).unwrap();
        assert!(recording.head.live);
        let mut removed = 0;
        let again = replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |_, step, _, _| {
            removed += step.removed;
        });
        assert_eq!(again.difference, None, "{}", again.difference.as_ref().unwrap());
        assert!(removed > 100, "{removed} voxels fell");
        assert!(!again.outcome.aborted);
    })
}

/// A live session, and the hand at its device.
struct HeldSession {
    hand: SharedHand,
    live: LiveSession,
    session: Session,
    recorder: Recorder,
}

impl HeldSession {
    /// Moves the hand evenly to a place, mm, within a time, s.
    fn go(&mut self, to: Vec3, seconds: f32) {
        let (from, start) = (self.hand.goal(), Instant::now());
        let mut share = 0.0;
        while share < 1.0 {
            share = (start.elapsed().as_secs_f32() / seconds).min(1.0);
            self.hand.reach(from.lerp(to, share));
            self.live.poll(&mut self.session, &mut self.recorder).unwrap();
            std::thread::sleep(Duration::from_millis(3));
        }
    }

    /// Lowers the hand until the tooth is pressed with 0.4 N; returns the last step.
    fn press(&mut self) -> Step {
        let start = Instant::now();
        while self.latest_step().force.length() < 0.4 {
            self.go(self.hand.goal() - Vec3::Y * 0.1, 0.05);
            assert!(start.elapsed() < Duration::from_secs(20), "{:?}", self.latest_step());
        }
        self.latest_step()
    }

    fn submit(&mut self, input: &Input) {
        self.live.submit(input, &mut self.session, &mut self.recorder).unwrap();
    }

    fn latest_step(&self) -> Step {
        *self.live.latest_step().unwrap()
    }
}

#[test]
fn the_clutch_moves_an_arm_by_100_mm_without_a_step_of_its_force() {
    crate::support::peace::in_real_time(|| {
        // Aim: the clutch is not felt at an arm, and a recording with it is a proof. Method: the tooth is pressed with an arm
        // that speaks its service's protocol; the clutch is pressed, the hand moves by 100 mm, and the clutch is released: no
        // tick of that changes the force by more than 0.05 N. Then the hand presses the same place from where it is.
        const FORCE_STEP_MAX: f32 = 0.05;
        let mut rig = Haply::plug_in("values");
        let hand = rig.hand();
        hand.reach(Vec3::Y * 8.0);
        let device = rig.open().unwrap();
        let Begun { workpiece, file, mut recorder, mut session, simulation } = begun("clutch", device.spec());
        // On enamel beside the decay.
        let beside = workpiece.world_from_tooth * workpiece.lesions[0].centre + Vec3::X * 2.5;
        let (live, _) = LiveSession::begin(&mut session, simulation, device, None, &mut recorder).unwrap();
        let mut held = HeldSession { hand: hand.clone(), live, session, recorder };
        // The explorer, which cuts nothing.
        held.submit(&Input::Take { instrument: 2 });
        held.go(beside + Vec3::Y * 8.0, 1.0);
        let pressed = held.press();
        held.submit(&Input::PressClutch(true));
        let from = hand.position();
        held.go(hand.goal() + Vec3::new(60.0, 0.0, 80.0), 1.5);
        held.go(hand.goal(), 0.5);
        let free = held.latest_step();
        assert!(hand.position().distance(from) > 99.0 && free.force == Vec3::ZERO, "{free:?}");
        assert!(free.tip.distance(pressed.tip) < 0.2, "the tip went from {} to {}", pressed.tip, free.tip);
        held.submit(&Input::PressClutch(false));
        held.go(hand.position(), 0.5);
        let over = held.latest_step().tick;
        held.go(hand.goal() + Vec3::Y * 2.0, 0.7);
        let again = held.press();
        assert!(again.tip.distance(pressed.tip) < 1.0, "{again:?}");
        held.submit(&Input::Confirm);
        let HeldSession { live, recorder, .. } = held;
        let servo = live.end::<Recorder>().unwrap().servo_file();
        recorder.finish(&RecordingEndFile { reason: "complete".into(), servo }).unwrap();
        let recording = Recording::read(&file).unwrap();
        let replayed = replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |_, _, _, _| {});
        assert_eq!(replayed.difference, None, "{}", replayed.difference.as_ref().unwrap());
        let is_press = |command: &Option<Command>| *command == Some(Command::PressClutch { is_pressed: true });
        let press = recording.commands.iter().find(|(_, command)| is_press(command)).unwrap().0;
        let under_clutch = &recording.ticks[press.0 as usize - 1..over.0 as usize];
        let steps = under_clutch.windows(2).map(|pair| pair[0].force.distance(pair[1].force));
        let worst = steps.fold(0.0, f32::max);
        println!("{} ticks under the clutch; the largest step is {worst} N", under_clutch.len());
        assert!(under_clutch[0].force.length() > 0.2 && worst < FORCE_STEP_MAX, "{worst} N");
    })
}

#[test]
fn an_instructor_leads_the_trainee_and_feels_them() {
    crate::support::peace::in_real_time(|| {
        // Aim: two hands on two devices, here and over the network: the second follows the first, leads it while its button is
        // held, and what it did is in the recording. Method: two simulated wires, a link of each kind.
        let network = || {
            let (here, address) = HandLink::listen("127.0.0.1:0", "a word of theirs").unwrap();
            (here, HandLink::connect(address, "a word of theirs").unwrap())
        };
        for (kind, (here, there)) in [("in one process", HandLink::pair()), ("over the network", network())] {
            let (mut first, mut second) = (Simulated::new(), Simulated::new());
            let (trainee, instructor) = (first.hand(), second.hand());
            trainee.reach(Vec3::Y * 8.0);
            instructor.let_loose();
            let device = first.open().unwrap();
            let Begun { file, mut recorder, mut session, simulation, .. } = begun("led", device.spec());
            let end = SecondHandLink::new(here, device.spec().max_damping, SecondHandRole::Instructor);
            let (mut live, _) = LiveSession::begin(&mut session, simulation, device, Some(end), &mut recorder).unwrap();
            let assist = SecondHandServo::start(second.open().unwrap(), there).unwrap();
            let mut turn_until = |holds: &mut dyn FnMut() -> bool, what: &str| {
                let start = Instant::now();
                while !holds() {
                    live.poll(&mut session, &mut recorder).unwrap();
                    assert!(start.elapsed() < Duration::from_secs(20), "{kind}: {what}");
                    std::thread::sleep(Duration::from_millis(2));
                }
            };
            trainee.reach(Vec3::new(6.0, 9.0, 0.0));
            let near = |a: &SharedHand, b: &SharedHand| a.position().distance(b.position()) < 1.0;
            turn_until(
                &mut || near(&instructor, &trainee) && trainee.position().x > 5.0,
                "the second hand does not follow",
            );
            assert_eq!(trainee.felt().force, Vec3::ZERO, "{kind}: nobody leads yet");
            // The trainee holds loosely; the instructor takes the lead.
            trainee.let_loose();
            instructor.hold_tight();
            instructor.press_buttons(1);
            instructor.reach(Vec3::new(-6.0, 10.0, 2.0));
            let mut led = || near(&instructor, &trainee) && trainee.position().x < -4.0;
            turn_until(&mut led, "the first hand is not led");
            instructor.press_buttons(0);
            turn_until(&mut || trainee.felt().force == Vec3::ZERO, "the lead does not end");
            drop(assist);
            live.submit(&Input::Confirm, &mut session, &mut recorder).unwrap();
            let kept = live.end::<Recorder>().unwrap();
            recorder.finish(&RecordingEndFile { reason: "complete".into(), servo: kept.servo_file() }).unwrap();
            let recording = Recording::read(&file).unwrap();
            let mut most = 0.0f32;
            let again = replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |haptic, step, _, _| {
                most = most.max(step.coupling_force.length());
                assert_eq!(haptic.lead, step.coupling_force);
            });
            assert_eq!(again.difference, None, "{kind}");
            let scored = typodont_exercise::score::score(&recording, ReplayCheck::Skip).unwrap();
            assert!(scored.led_ticks[0] > 100, "{kind}: led for {:?} ticks", scored.led_ticks);
            println!("{kind}: led with up to {most} N");
            assert!((0.1..=1.5001).contains(&most), "{kind}: led with {most} N");
        }
    })
}

/// A lesson with an assistant's hand, both on simulated wires; the trainee's is above the tooth, the assistant's aside.
struct AssistedLesson {
    live: LiveSession,
    session: Session,
    recorder: Recorder,
    file: PathBuf,
    workpiece: Workpiece,
    trainee: SharedHand,
    assistant: SharedHand,
    _assist: SecondHandServo,
}

impl AssistedLesson {
    fn begin(name: &str, role: SecondHandRole) -> AssistedLesson {
        let (mut first, mut second) = (Simulated::new(), Simulated::new());
        let (trainee, assistant) = (first.hand(), second.hand());
        trainee.reach(Vec3::Y * 12.0);
        assistant.reach(Vec3::new(9.0, 12.0, 0.0));
        let device = first.open().unwrap();
        let Begun { workpiece, file, mut recorder, mut session, simulation } = begun(name, device.spec());
        let (here, there) = HandLink::pair();
        let end = SecondHandLink::new(here, device.spec().max_damping, role);
        let (live, _) = LiveSession::begin(&mut session, simulation, device, Some(end), &mut recorder).unwrap();
        let _assist = SecondHandServo::start(second.open().unwrap(), there).unwrap();
        AssistedLesson { live, session, recorder, file, workpiece, trainee, assistant, _assist }
    }

    fn turn_until(&mut self, mut holds: impl FnMut(&LiveSession) -> bool, what: &str) {
        let start = Instant::now();
        while !holds(&self.live) {
            self.live.poll(&mut self.session, &mut self.recorder).unwrap();
            assert!(start.elapsed() < Duration::from_secs(20), "{what}: {:?}", self.live.assistant());
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

#[test]
fn an_assistants_syringe_is_seen_where_it_is_and_sprays_while_its_button_is_held() {
    crate::support::peace::in_real_time(|| {
        // Aim: the trainee's window knows the tool of the second hand. Method: two simulated wires; a second hand in free space,
        // its button held and let go; then it goes onto the tooth, and the tool stays outside.
        let mut lesson = AssistedLesson::begin("irrigated", SecondHandRole::Irrigation);
        let assistant = lesson.assistant.clone();
        let place = Vec3::new(2.0, 12.0, 1.0);
        assistant.reach(place);
        let is_pressed_there = |live: &LiveSession| {
            let tool = live.assistant();
            let there = tool.filter(|tool| tool.role == SecondHandRole::Irrigation && tool.tip.distance(place) < 0.5);
            there.map(|tool| tool.is_pressed)
        };
        lesson.turn_until(|live| is_pressed_there(live) == Some(false), "the syringe is not seen");
        assistant.press_buttons(1);
        lesson.turn_until(|live| is_pressed_there(live) == Some(true), "it does not spray");
        assistant.press_buttons(0);
        lesson.turn_until(|live| is_pressed_there(live) == Some(false), "it does not stop");
        let crown = lesson.workpiece.world_from_tooth * lesson.workpiece.lesions[0].centre;
        assistant.reach(crown + Vec3::Y * 12.0);
        lesson.turn_until(
            |live| live.assistant().is_some_and(|tool| tool.tip.distance(crown + Vec3::Y * 12.0) < 0.5),
            "it does not come over the tooth",
        );
        assistant.reach(crown - Vec3::Y * 6.0);
        lesson.turn_until(|_| assistant.felt().force.y > 0.1, "the tooth is not felt");
        let tip = lesson.live.assistant().unwrap().tip;
        assert!(tip.y > crown.y, "the nozzle is inside the tooth: {tip}, {crown}");
        lesson.live.end::<Recorder>().unwrap();
    });
}

#[test]
fn an_assistants_suction_rests_on_the_tooth_and_leaves_the_trainee_alone() {
    crate::support::peace::in_real_time(|| {
        // Aim: a second hand with the suction moves freely, feels the tooth, and neither pushes the first hand nor enters the
        // recording. Method: two simulated wires; the second hand goes aside, then down onto the crown.
        let mut lesson = AssistedLesson::begin("assisted", SecondHandRole::Suction);
        let assistant = lesson.assistant.clone();
        let place = Vec3::new(2.0, 12.0, 1.0);
        assistant.reach(place);
        lesson.turn_until(|_| assistant.position().distance(place) < 0.3, "the second hand is held back in the air");
        let crown = lesson.workpiece.world_from_tooth * lesson.workpiece.lesions[0].centre;
        assistant.reach(crown + Vec3::Y * 12.0);
        lesson.turn_until(
            |_| assistant.position().distance(crown + Vec3::Y * 12.0) < 0.5,
            "it does not come over the tooth",
        );
        assistant.reach(crown - Vec3::Y * 6.0);
        lesson.turn_until(|_| assistant.felt().force.y > 0.1, "the tooth is not felt");
        let AssistedLesson { mut live, mut session, mut recorder, file, trainee, .. } = lesson;
        assert_eq!(trainee.felt().force, Vec3::ZERO);
        live.submit(&Input::Confirm, &mut session, &mut recorder).unwrap();
        let kept = live.end::<Recorder>().unwrap();
        recorder.finish(&RecordingEndFile { reason: "complete".into(), servo: kept.servo_file() }).unwrap();
        let recording = Recording::read(&file).unwrap();
        let again = replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |_, step, _, _| {
            assert_eq!((step.coupling_force, step.removed), (Vec3::ZERO, 0));
        });
        assert_eq!(again.difference, None);
    });
}
