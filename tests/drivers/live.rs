//! A live session on a wire: what the servo did is what a replay does, even when the cable was pulled in the middle.

use crate::rig::{Misbehaviour, Rig, SharedHand};
use crate::simulated::Simulated;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use typodont::content::Library;
use typodont::device::{Link, Spec};
use typodont::diagnostic::Source;
use typodont::frame::Vec3;
use typodont::record::{EndFile, HeadFile, Recorder, Recording, ServoFile, Watch, replay};
use typodont::scenario::{self, Forms, Scenario, Workpiece};
use typodont::session::{self, Heard, Input, Live, Session};
use typodont::sim::{Assist, Role, Second, Simulation};

fn grinding() -> Arc<Scenario> {
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let source = Source::new("5-grinding.json", text);
    Arc::new(scenario::resolve(source, &Library::shipped(), Forms::Made).unwrap())
}

/// The grinding exercise, about to be recorded live under a name.
struct Begun {
    workpiece: Workpiece,
    file: PathBuf,
    recorder: Recorder,
    session: Session,
    simulation: Simulation,
}

fn begun(name: &str, spec: &Spec) -> Begun {
    let scenario = grinding();
    let workpiece = Workpiece::make(&scenario, 4).unwrap();
    let head = HeadFile { live: true, ..HeadFile::of(&scenario, spec, 4) };
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.mcap"));
    let recorder = Recorder::create(&file, &head, &scenario, &workpiece).unwrap();
    let simulation = Simulation::new(session::setup(&scenario, &workpiece, spec.clone()));
    Begun { file, recorder, session: Session::new(scenario, &workpiece), simulation, workpiece }
}

#[test]
fn a_live_session_holds_when_turned_again() {
    crate::peace::in_real_time(|| {
        // Aim: a recording of a person's session is a proof like a script's. Method: the grinding exercise on a simulated wire,
        // an instrument taken, the cable pulled while cutting, plugged in again, said to be done; then verified.
        let mut rig = Simulated::new();
        let hand = rig.hand();
        hand.reach(Vec3::Y * 8.0);
        let device = rig.open().unwrap();
        let Begun { workpiece, file, mut recorder, mut session, simulation } = begun("live", device.spec());
        let (mut live, _) = Live::begin(&mut session, simulation, device, None, &mut recorder).unwrap();
        // Above the decay, then onto it.
        let decay = workpiece.world_from_tooth * workpiece.lesions[0].centre;
        let start = Instant::now();
        let (mut cut, mut gone, mut was_pulled, mut done) = (0, 0, false, false);
        let mut back_at = None;
        while !session.are_stages_over() {
            assert!(start.elapsed() < Duration::from_secs(60), "cut {cut}, gone {gone}");
            let heard = live.listen(&mut session, &mut recorder).unwrap();
            gone += heard.iter().filter(|h| matches!(h, Heard::Gone(_))).count();
            cut += usize::from(live.screen().is_some_and(|s| s.cutting));
            let seconds = start.elapsed().as_secs_f32();
            let height = if back_at.is_some_and(|at: Instant| at.elapsed() < Duration::from_secs(1)) {
                6.0
            } else {
                (6.0 - 3.0 * seconds).max(-1.5)
            };
            hand.reach(decay + Vec3::Y * height);
            if cut > 50 && !was_pulled {
                let heard = live.say(&Input::Take { instrument: 1 }, &mut session, &mut recorder).unwrap();
                assert!(!heard.is_empty());
                rig.misbehave(Misbehaviour::Unplug);
                was_pulled = true;
            }
            if live.is_waiting() {
                rig.recover();
                assert!(live.go_on::<Recorder>(rig.open().unwrap()).unwrap());
                back_at = Some(Instant::now());
            }
            if cut > 400 && gone == 1 && !done {
                done = true;
                live.say(&Input::Confirm, &mut session, &mut recorder).unwrap();
            }
            std::thread::sleep(Duration::from_millis(3));
        }
        let kept = live.end::<Recorder>().unwrap();
        let servo = ServoFile::of_live(&kept);
        recorder.finish(&EndFile { reason: "complete".into(), servo: servo.clone() }).unwrap();
        println!("{servo:?}");
        assert_eq!((servo.interruptions, servo.dropped), (1, 0));
        let recording = Recording::read(&file).unwrap();
        assert!(recording.head.live);
        let mut removed = 0;
        let again = replay(&recording, recording.workpiece().unwrap(), Watch::Everything, |_, step, _, _| {
            removed += step.removed;
        });
        assert_eq!(again.difference, None, "{}", again.difference.as_ref().unwrap());
        assert!(removed > 100, "{removed} voxels fell");
        assert!(!again.outcome.aborted);
    })
}

#[test]
fn an_instructor_leads_the_trainee_and_feels_them() {
    crate::peace::in_real_time(|| {
        // Aim: two hands on two devices, here and over the network: the second follows the first, leads it while its button is
        // held, and what it did is in the recording. Method: two simulated wires, a link of each kind.
        let network = || {
            let (here, address) = Link::listen("127.0.0.1:0", "a word of theirs").unwrap();
            (here, Link::connect(address, "a word of theirs").unwrap())
        };
        for (kind, (here, there)) in [("in one process", Link::pair()), ("over the network", network())] {
            let (mut first, mut second) = (Simulated::new(), Simulated::new());
            let (trainee, instructor) = (first.hand(), second.hand());
            trainee.reach(Vec3::Y * 8.0);
            instructor.let_loose();
            let device = first.open().unwrap();
            let Begun { file, mut recorder, mut session, simulation, .. } = begun("led", device.spec());
            let end = Second::new(here, device.spec().max_damping, Role::Instructor);
            let (mut live, _) = Live::begin(&mut session, simulation, device, Some(end), &mut recorder).unwrap();
            let assist = Assist::start(second.open().unwrap(), there).unwrap();
            let mut turn_until = |holds: &mut dyn FnMut() -> bool, what: &str| {
                let start = Instant::now();
                while !holds() {
                    live.listen(&mut session, &mut recorder).unwrap();
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
            live.say(&Input::Confirm, &mut session, &mut recorder).unwrap();
            let kept = live.end::<Recorder>().unwrap();
            recorder.finish(&EndFile { reason: "complete".into(), servo: ServoFile::of_live(&kept) }).unwrap();
            let recording = Recording::read(&file).unwrap();
            let mut most = 0.0f32;
            let again = replay(&recording, recording.workpiece().unwrap(), Watch::Everything, |haptic, step, _, _| {
                most = most.max(step.lead.length());
                assert_eq!(haptic.lead, step.lead);
            });
            assert_eq!(again.difference, None, "{kind}");
            let scored = typodont::score::score(&recording, Watch::Nothing).unwrap();
            assert!(scored.led_ticks[0] > 100, "{kind}: led for {:?} ticks", scored.led_ticks);
            println!("{kind}: led with up to {most} N");
            assert!((0.1..=1.5001).contains(&most), "{kind}: led with {most} N");
        }
    })
}

#[test]
fn an_assistants_suction_rests_on_the_tooth_and_leaves_the_trainee_alone() {
    crate::peace::in_real_time(|| {
        // Aim: a second hand with the suction moves freely, feels the tooth, and neither pushes the first hand nor enters the
        // recording. Method: two simulated wires; the second hand goes aside, then down onto the crown.
        let (mut first, mut second) = (Simulated::new(), Simulated::new());
        let (trainee, assistant) = (first.hand(), second.hand());
        trainee.reach(Vec3::Y * 12.0);
        assistant.reach(Vec3::new(9.0, 12.0, 0.0));
        let device = first.open().unwrap();
        let Begun { workpiece, file, mut recorder, mut session, simulation } = begun("assisted", device.spec());
        let (here, there) = Link::pair();
        let end = Second::new(here, device.spec().max_damping, Role::Suction);
        let (mut live, _) = Live::begin(&mut session, simulation, device, Some(end), &mut recorder).unwrap();
        let _assist = Assist::start(second.open().unwrap(), there).unwrap();
        let mut turn_until = |holds: &mut dyn FnMut() -> bool, what: &str| {
            let start = Instant::now();
            while !holds() {
                live.listen(&mut session, &mut recorder).unwrap();
                assert!(start.elapsed() < Duration::from_secs(20), "{what}");
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        let place = Vec3::new(2.0, 12.0, 1.0);
        assistant.reach(place);
        turn_until(&mut || assistant.position().distance(place) < 0.3, "the second hand is held back in the air");
        let crown = workpiece.world_from_tooth * workpiece.lesions[0].centre;
        assistant.reach(crown + Vec3::Y * 12.0);
        turn_until(
            &mut || assistant.position().distance(crown + Vec3::Y * 12.0) < 0.5,
            "it does not come over the tooth",
        );
        assistant.reach(crown - Vec3::Y * 6.0);
        turn_until(&mut || assistant.felt().force.y > 0.1, "the tooth is not felt");
        assert_eq!(trainee.felt().force, Vec3::ZERO);
        live.say(&Input::Confirm, &mut session, &mut recorder).unwrap();
        let kept = live.end::<Recorder>().unwrap();
        recorder.finish(&EndFile { reason: "complete".into(), servo: ServoFile::of_live(&kept) }).unwrap();
        let recording = Recording::read(&file).unwrap();
        let again = replay(&recording, recording.workpiece().unwrap(), Watch::Everything, |_, step, _, _| {
            assert_eq!((step.lead, step.removed), (Vec3::ZERO, 0));
        });
        assert_eq!(again.difference, None);
    });
}
