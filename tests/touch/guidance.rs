//! Guidance for the hand: forces as they were measured, springs to a path, and never a jolt or energy out of nothing.

use crate::support::bundle;
use crate::support::folder;
use crate::support::phantom;

use bundle::*;
use folder::folder;
use phantom::*;
use std::fs;
use std::path::{Path as File, PathBuf};
use std::sync::Arc;
use typodont_core::device::{DeviceSpec, HandModel, Reading, SimulatedHand, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::{Command, Setup, Simulation};
use typodont_core::touch::{AnchorMode, Fixture, ForceRow, ForceSpace, ForceTable, Guidance, Polyline, WorkingEnd};
use typodont_exercise::record::{Recorder, Recording, RecordingEndFile, RecordingHeadFile, ServoStatsFile};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Workpiece};
use typodont_exercise::session::{Operator, OperatorFile, Session};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

/// Ticks after which guidance is wholly in effect.
const EASED: u64 = 500;

/// A world of air in which a guidance leads from the first tick on.
fn led(guidance: Guidance, world_from_tooth: Pose, device: DeviceSpec) -> Simulation {
    let far = volume([8, 8, 8], 0.5, |p| (p.distance(Vec3::splat(100.0)), HARD));
    let air = setup(far, WorkingEnd::Point, false);
    let mut sim = Simulation::new(Setup { guidances: vec![guidance], world_from_tooth, device, ..air });
    sim.apply(&Command::SetGuidance { guidance: Some(0) });
    sim
}

fn tube(points: impl IntoIterator<Item = Vec3>) -> Fixture {
    let path = Arc::new(Polyline::through(points));
    Fixture { path, anchor_mode: AnchorMode::Tube, radius: 0.5, stiffness: 0.2, damping: 0.001, max_force: 1.0 }
}

/// Drawn to the path itself, from its beginning to its end.
fn follow(points: impl IntoIterator<Item = Vec3>) -> Fixture {
    Fixture { anchor_mode: AnchorMode::Follow { look_ahead: 2.0, speed: None }, radius: 0.0, ..tube(points) }
}

fn somewhere() -> Pose {
    Pose { position: Vec3::new(3.0, -2.0, 7.0), orientation: Quat::from_xyzw(0.5, 0.5, -0.5, 0.5) }
}

#[test]
fn what_was_felt_is_felt_again() {
    // Aim: the force of every tick is the table's, between its rows in proportion, in the space it was measured in.
    // Method: a table with rows 0.4 s apart, at a third of its strength, in a tooth that is turned in the world.
    let rows: Vec<ForceRow> = (0..6u8)
        .map(|i| ForceRow { time: 2.0 + 0.4 * f64::from(i), force: Vec3::new(f32::from(i), -1.5, 3.0 - f32::from(i)) })
        .collect();
    for space in [ForceSpace::World, ForceSpace::Tooth] {
        let forces = ForceTable { rows: rows.clone().into(), repeat: false, scale: 1.0 / 3.0, space };
        let mut sim = led(Guidance::Forces(forces), somewhere(), ideal_device());
        for tick in 0..2000u64 {
            let step = sim.step(&Reading::at(Vec3::ZERO));
            // Before the first tick it is not known whether the hand is free.
            if tick < EASED + 1 {
                continue;
            }
            let at = tick as f32 * 1e-3 / 0.4;
            let (i, share) = (at.floor() as usize, at.fract());
            let felt = rows[i].force.lerp(rows[i + 1].force, share) / 3.0;
            let expected = if space == ForceSpace::World { felt } else { somewhere().rotate(felt) };
            assert!((step.force - expected).length() < 1e-4, "{space:?}, tick {tick}: {} for {expected}", step.force);
            assert_eq!(step.guidance, step.force, "in the air nothing else is felt");
        }
        for _ in 2000..2501 {
            sim.step(&Reading::at(Vec3::ZERO));
        }
        assert_eq!(sim.step(&Reading::at(Vec3::ZERO)).force, Vec3::ZERO, "half a second after its end it is gone");
    }
}

#[test]
fn the_spring_pulls_as_it_says() {
    // Aim: within the free radius nothing; at a depth d outside it k·d²/(2·0.3 mm) up to 0.3 mm, then k·(d − 0.15 mm) up to the
    // limit, straight toward the path. Method: hands that rest beside a straight path and beyond its end.
    let line = || (0..=100).map(|i| Vec3::X * (i as f32 * 0.2));
    let check = |fixture: Fixture, hand_in_tooth: Vec3, expected: Vec3| {
        let mut sim = led(Guidance::Path(fixture), somewhere(), ideal_device());
        let hand = Reading::at(somewhere() * hand_in_tooth);
        for _ in 0..=EASED {
            sim.step(&hand);
        }
        let force = somewhere().inverse().rotate(sim.step(&hand).force);
        assert!((force - expected).length() < 1e-4, "at {hand_in_tooth}: {force} for {expected}");
    };
    let up = Vec3::Z;
    check(follow(line()), Vec3::X, Vec3::ZERO);
    check(follow(line()), Vec3::X + up * 0.15, up * (-0.2 * 0.15 * 0.15 / 0.6));
    check(follow(line()), Vec3::X + up, up * (-0.2 * 0.85));
    check(follow(line()), Vec3::X + up * 3.0, up * (-0.2 * 2.85));
    check(follow(line()), Vec3::X + up * 8.0, up * -1.0);
    check(follow(line()), Vec3::X * -2.0, Vec3::X * 0.37);
    check(tube(line()), Vec3::X * 22.0, Vec3::X * -0.27);
    check(tube(line()), Vec3::X * 9.0 + up * 2.5, up * -0.37);
    check(tube(line()), Vec3::X * 9.0 + up * 0.65, up * (-0.2 * 0.15 * 0.15 / 0.6));
    check(tube(line()), Vec3::X * 9.0 + up * 12.0, up * -1.0);
    for inside in [Vec3::ZERO, Vec3::X * 7.7 + up * 0.49, Vec3::X * 20.0 + Vec3::Y * 0.3] {
        check(tube(line()), inside, Vec3::ZERO);
    }
}

#[test]
fn a_hand_that_moves_within_a_tube_feels_nothing() {
    let mut sim = led(Guidance::Path(tube(eight())), Pose::IDENTITY, DeviceSpec::phantom_omni());
    for i in 0..8000 {
        let turn = i as f32 * 0.002;
        let wobble = Vec3::new((turn * 31.0).sin(), (turn * 37.0).cos(), (turn * 41.0).sin()) * 0.25;
        let step = sim.step(&Reading::at(on_eight(turn) + wobble));
        assert_eq!(step.force, Vec3::ZERO, "tick {i}");
    }
}

/// A figure of eight, 20 mm wide, with its crossing in the middle.
fn on_eight(turn: f32) -> Vec3 {
    Vec3::new(10.0 * turn.sin(), 10.0 * turn.sin() * turn.cos(), 0.0)
}

fn eight() -> impl Iterator<Item = Vec3> {
    (0..=400).map(|i| on_eight(i as f32 / 400.0 * core::f32::consts::TAU))
}

/// A hairpin: 20 mm there, 3 mm beside it 20 mm back.
fn hairpin() -> impl Iterator<Item = Vec3> {
    [Vec3::ZERO, Vec3::X * 20.0, Vec3::new(20.0, 3.0, 0.0), Vec3::Y * 3.0].into_iter()
}

#[test]
fn no_force_jumps() {
    // Aim: at most 0.05 N in a tick, wherever the nearest place of the path changes, when guidance begins and when it ends,
    // and after the hand was let go. Method: hands drawn at 20 to 100 mm/s straight across two paths that come near themselves.
    let mut worst = 0.0f32;
    for speed in [20.0, 50.0, 100.0] {
        for stiffness in [0.05, 0.2] {
            for (name, points) in [("eight", eight().collect::<Vec<_>>()), ("hairpin", hairpin().collect())] {
                let wide = AnchorMode::Follow { look_ahead: 20.0, speed: None };
                for fixture in [
                    tube(points.clone()),
                    follow(points.clone()),
                    Fixture { anchor_mode: wide, ..follow(points.clone()) },
                ] {
                    let kind = fixture.anchor_mode;
                    let fixture = Fixture { stiffness, damping: 0.005 * stiffness, ..fixture };
                    let mut sim = led(Guidance::Path(fixture), Pose::IDENTITY, ideal_device());
                    let (mut before, mut was_let_go) = (Vec3::ZERO, false);
                    for tick in 0..8000u32 {
                        if tick == 6000 {
                            sim.apply(&Command::SetGuidance { guidance: None });
                        }
                        // To and fro over 16 mm, slowly turning, so that every branch is met from every side.
                        let across = 8.0 * (speed * tick as f32 * 1e-3 / 8.0).sin();
                        let turn = tick as f32 * 2e-4;
                        let mut hand = Vec3::new(5.0 + across * turn.sin(), 1.5 + across * turn.cos(), 0.4);
                        let is_refused = tick == 3000;
                        if is_refused {
                            hand.x = f32::NAN;
                        }
                        let force = sim.step(&Reading::at(hand)).force;
                        assert!(!is_refused || force == Vec3::ZERO);
                        let jump = force.distance(before);
                        if !is_refused {
                            assert!(
                                jump < 0.05,
                                "{name}, {kind:?}, {stiffness} N/mm, {speed} mm/s, tick {tick}: {jump} N"
                            );
                            worst = worst.max(jump);
                        }
                        assert!(!was_let_go || force.length() < 0.01, "comes back softly: {force}");
                        assert!(tick < 6500 || force == Vec3::ZERO, "gone after half a second: {force}");
                        (before, was_let_go) = (force, is_refused);
                    }
                }
            }
        }
    }
    println!("greatest change in a tick: {worst:.4} N");
}

/// A hand without any grip is thrown through a fixture; returns the greatest energy that the fixture has given beyond what
/// it was given, what the hand had at the throw, and what it has at the end; mJ.
fn thrown(fixture: Fixture, from: Vec3, velocity: Vec3, encoder_step: f32) -> [f64; 3] {
    let device = DeviceSpec { resolution: encoder_step, max_stiffness: 1.1, ..DeviceSpec::phantom_omni() };
    let model = HandModel { mass: device.apparent_mass, grip_stiffness: 0.0, grip_damping: 0.0, encoder_step };
    let energy = |hand: &SimulatedHand| 0.5e-3 * f64::from(model.mass) * f64::from(hand.velocity().length_squared());
    let mut sim = led(Guidance::Path(fixture), Pose::IDENTITY, device);
    let mut hand = SimulatedHand::resting_at(model, from);
    let (mut told, mut felt) = (Vec3::ZERO, Vec3::ZERO);
    // Eased in around a hand that is held still; then it is thrown.
    for _ in 0..2 * EASED {
        sim.step(&hand.step(&Wrench::ZERO));
    }
    hand.set_velocity(velocity);
    let before = energy(&hand);
    let (mut given, mut most) = (0.0f64, 0.0f64);
    for _ in 0..9000 {
        let at = hand.position();
        let reading = hand.step(&Wrench { force: told, ..Wrench::ZERO });
        given += f64::from(felt.dot(hand.position() - at));
        most = most.max(given);
        felt = told;
        told = sim.step(&reading).force;
    }
    [most, before, energy(&hand)]
}

#[test]
fn a_fixture_gives_no_energy() {
    // Aim: whatever hits it, a fixture gives a hand no more than it took; what was thrown comes to rest or leaves slower.
    // Method: the barest hand there is, 45 g without grip or friction, thrown along, across and at a slant, through the
    // stiffest and softest springs, onto a straight path and one that crosses itself, with ideal and coarse encoders. What
    // stands between two of an encoder's steps (q) nobody can know: energy of k·q² is allowed for.
    let line = || (0..=200).map(|i| Vec3::X * (i as f32 * 0.2 - 20.0));
    let (mut worst, mut wrong) = (0.0f64, Vec::new());
    for encoder_step in [0.0, 0.055] {
        for stiffness in [0.05, 0.2, 1.0] {
            let springs = |fixture: Fixture| Fixture { stiffness, damping: 0.005 * stiffness, ..fixture };
            let start = Vec3::X * -20.0;
            let fixtures = [
                ("tube", tube(line()), Vec3::ZERO),
                ("crossing tube", tube(eight()), Vec3::ZERO),
                ("bare tube", Fixture { radius: 0.0, ..tube(line()) }, Vec3::ZERO),
                ("follow", follow(line()), start),
                ("follow a crossing", follow(eight()), Vec3::ZERO),
            ];
            for (name, fixture, from) in fixtures {
                for direction in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.7, 0.7, 0.14), Vec3::NEG_X] {
                    for speed in [5.0, 20.0, 60.0, 150.0] {
                        let [given, before, after] =
                            thrown(springs(fixture.clone()), from, direction * speed, encoder_step);
                        let allowed = 0.02 * before + f64::from(stiffness * encoder_step * encoder_step);
                        let what = format!("{name}, {stiffness} N/mm, {direction} at {speed} mm/s, {encoder_step} mm");
                        if given > allowed || after > before + allowed {
                            wrong.push(format!("{what}: gave {given:.6}, left {after:.6} of {before:.6} mJ"));
                        }
                        worst = worst.max(given / (before + allowed));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    println!("greatest energy given beyond what was taken: {:.3} % of the throw", 100.0 * worst);
}

#[test]
fn a_spring_without_enough_damping_would_give_energy() {
    // The control of the test above: the same hand and spring, undamped. The fixture itself would refuse this, so the spring
    // is written out here.
    let model = HandModel { mass: 0.045, grip_stiffness: 0.0, grip_damping: 0.0, encoder_step: 0.0 };
    let mut hand = SimulatedHand::resting_at(model, Vec3::ZERO);
    hand.set_velocity(Vec3::Z * 20.0);
    let mut told = Vec3::ZERO;
    let mut fastest = 0.0f32;
    for _ in 0..3000 {
        told = -hand.step(&Wrench { force: told, ..Wrench::ZERO }).pose.position * 0.2;
        fastest = fastest.max(hand.velocity().length());
    }
    assert!(fastest > 30.0, "{fastest} mm/s after a throw at 20");
}

/// An exercise whose one stage is guided, with the tables it names, in a folder of its own.
fn exercise(name: &str, guidance: &str) -> PathBuf {
    let folder = folder(name);
    let text = format!(
        r#"{{
  "id": "guided", "title": "Guided",
  "scene": {{ "tooth": {{ "id": "tooth", "fdi": 36, "form": {{ "procedural": {{ "spacing_mm": 0.3 }} }} }} }},
  "instruments": ["explorer"],
  "stages": [
    {{ "id": "settle", "title": "Settle", "instruction": "Settle.", "time_limit_s": 1 }},
    {{ "id": "try", "title": "Trace", "instruction": "Trace.", "time_limit_s": 6, "guidance": {guidance} }},
    {{ "id": "rest", "title": "Rest", "instruction": "Rest.", "time_limit_s": 1 }}
  ]
}}"#
    );
    fs::write(folder.join("guided.json"), text).unwrap();
    fs::write(folder.join("expert.csv"), "x_mm,y_mm,z_mm\n0,-4,12\n0,0,7\n0,4,12\n").unwrap();
    fs::write(folder.join("felt.csv"), "time_s,fx_n,fy_n,fz_n\n0,0,0,0\n0.5,0.2,0,0.4\n1.0,0,0.1,0\n").unwrap();
    folder.join("guided.json")
}

const TUBE: &str =
    r#"{ "path": { "file": "expert.csv", "kind": "tube", "radius_mm": 0.5, "stiffness_n_per_mm": 0.2 } }"#;
const FELT: &str = r#"{ "forces": { "file": "felt.csv", "repeat": true, "scale": 1.0, "space": "tooth" } }"#;

#[test]
fn a_guided_session_is_a_proof() {
    // Aim: a guided session runs, is recorded with its tables, and holds; the guidance is felt in its stage and half a second
    // beyond, nowhere else. Method: the program itself, from the command line.
    for (name, guidance, table) in [("guided_tube", TUBE, "expert.csv"), ("guided_felt", FELT, "felt.csv")] {
        let scenario = exercise(name, guidance);
        let bundle = run(scenario.to_str().unwrap(), "careful", &folder(&format!("{name}_out")), &[]);
        // The session's source files are contained in the recording, and are not needed beside it.
        fs::remove_dir_all(scenario.parent().unwrap()).unwrap();
        let output = typodont(&["verify", bundle.to_str().unwrap()]);
        assert!(output.status.success(), "{}", complained(&output));
        let recording = Recording::read(&bundle.join("recording.mcap")).unwrap();
        assert!(recording.scenario.files.contains_key(table), "{:?}", recording.scenario.files.keys());
        let commands: Vec<_> =
            recording.commands.iter().filter(|(_, c)| matches!(c, Some(Command::SetGuidance { .. }))).collect();
        let stages = &session(&bundle)["stages"];
        assert_eq!([0, 1, 2].map(|i| stages[i]["guided"].as_bool()), [None, Some(true), None]);
        let tick = |key: &str| (stages[1][key].as_f64().unwrap() * 1e3).round() as u64;
        let expected = [(tick("started_s"), Some(0)), (tick("ended_s"), None)];
        let told = commands.iter().map(|(at, c)| match c {
            Some(Command::SetGuidance { guidance }) => (at.0, *guidance),
            _ => unreachable!("filtered above"),
        });
        assert_eq!(told.collect::<Vec<_>>(), expected);
        let workpiece = recording.workpiece().unwrap();
        let (mut led, mut pressed, mut told) = (Vec::new(), 0.0f32, 0.0f32);
        typodont_exercise::record::replay(
            &recording,
            workpiece,
            typodont_exercise::record::ReplayCheck::Full,
            |_, step, _, _| {
                led.extend((step.guidance != Vec3::ZERO).then_some(step.tick.0));
                if step.touch.is_some() {
                    pressed = pressed.max(step.force.distance(step.guidance));
                    told = told.max(step.force.length());
                }
            },
        );
        let (first, last) = (*led.first().unwrap(), *led.last().unwrap());
        assert!(first >= expected[0].0 && last < expected[1].0 + EASED, "led from {first} to {last}, {expected:?}");
        // The guidance force of the exercise is not counted as force applied by the trainee.
        let scored = metric(&session(&bundle), "force_max_n").unwrap();
        println!("{name}: pressed with {pressed} N, told {told} N, scored {scored} N");
        assert!((scored - f64::from(pressed)).abs() < 1e-6);
        assert!(
            name == "guided_tube" || (told - pressed).abs() > 0.005,
            "the tooth is touched while forces are played"
        );
    }
}

/// Plays an exercise without the command line, so that no clock is in its recording; returns the recording's bytes.
fn recorded(scenario: &File, to: &File) -> Vec<u8> {
    let text = fs::read_to_string(scenario).unwrap();
    let library = Library::shipped().with_folder(scenario.parent().unwrap());
    let scenario = Arc::new(
        scenario::resolve(SourceText::new("guided.json", text), &library, ResolveMode::MakeWorkpiece).unwrap(),
    );
    let workpiece = Arc::new(Workpiece::make(&scenario, 3).unwrap());
    let spec = DeviceSpec::phantom_omni();
    let head = RecordingHeadFile::of(&scenario, &spec, 3);
    let mut recorder = Recorder::create(to, &head, &scenario, &workpiece).unwrap();
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut sim = Simulation::new(typodont_exercise::session::setup(&scenario, &workpiece, spec.clone()));
    let file = OperatorFile::read(&library, "careful").unwrap();
    let mut operator = Operator::new(file, scenario, workpiece, spec, 3);
    typodont_exercise::session::run(&mut session, &mut sim, &mut operator, &mut recorder).unwrap();
    recorder.finish(&RecordingEndFile { reason: "complete".into(), servo: ServoStatsFile::of(&sim) }).unwrap();
    fs::read(to).unwrap()
}

#[test]
fn the_same_guided_session_gives_the_same_digest() {
    let scenario = exercise("guided_twice", TUBE);
    let out = folder("guided_twice_out");
    let [first, second] = ["a.mcap", "b.mcap"].map(|name| recorded(&scenario, &out.join(name)));
    assert!(first == second, "recordings of {} and {} bytes differ", first.len(), second.len());
    // And another table gives another one.
    fs::write(scenario.with_file_name("expert.csv"), "x_mm,y_mm,z_mm\n0,-4,12\n0,0,7\n0,4,12.5\n").unwrap();
    assert!(recorded(&scenario, &out.join("c.mcap")) != first);
}

#[test]
fn a_session_becomes_a_path_for_the_next() {
    // Aim: what `typodont path` writes is what an exercise reads. Method: path and forces of a session, put in the place of
    // the tables of another exercise.
    let bundle = run(exercise("path_source", TUBE).to_str().unwrap(), "careful", &folder("path_source_out"), &[]);
    let bundle = bundle.to_str().unwrap();
    for (name, guidance, table, more) in [
        ("path_again", TUBE, "expert.csv", &["--stage", "try"][..]),
        ("felt_again", FELT, "felt.csv", &["--stage", "try", "--forces"][..]),
    ] {
        let scenario = exercise(name, guidance);
        let table = scenario.with_file_name(table);
        let output = typodont(&[&["path", bundle, "-o", table.to_str().unwrap()], more].concat());
        assert!(output.status.success(), "{}", complained(&output));
        let output = typodont(&["check", scenario.to_str().unwrap()]);
        assert!(output.status.success(), "{}", complained(&output));
    }
    let output = typodont(&["path", bundle, "-o", "x.csv", "--stage", "tyr"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complained(&output).contains("unknown-stage") && complained(&output).contains("try"),
        "{}",
        complained(&output)
    );
}
