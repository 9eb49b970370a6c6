//! Tissue that is cut out of sight: measured from the recorded views, and derived again by another program.

use crate::support::folder::folder;
use crate::support::tools;
use serde_json::{Value, json};
use std::f32::consts::PI;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use typodont_core::device::{Device, DeviceError, DeviceSpec, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::sim::{Simulation, Step};
use typodont_core::volume::Edit;
use typodont_exercise::record::{
    FILE_NAME, Recorder, Recording, RecordingEndFile, RecordingHeadFile, ReplayCheck, ServoStatsFile,
};
use typodont_exercise::scenario::{ResolveMode, Workpiece, resolve};
use typodont_exercise::score::{Scored, score};
use typodont_exercise::session::{
    Input, MirrorFace, Operator, OperatorFile, Session, Trainee, TraineeView, run, setup,
};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

/// Radius and place of the obstacle in the third session, mm. The place is in tooth space.
const BALL_RADIUS: f32 = 5.0;
const BALL_MM: [f32; 3] = [0.0, -9.0, 14.0];

/// An operator that looks from one place after the other: each view with its tick.
struct LookingOperator {
    operator: Operator,
    views: Vec<(u64, TraineeView)>,
    ticks: u64,
}

impl Device for LookingOperator {
    fn spec(&self) -> &DeviceSpec {
        self.operator.spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.ticks += 1;
        self.operator.exchange(output)
    }
}

impl Trainee for LookingOperator {
    fn observe_edits(&mut self, edits: &[Edit]) {
        self.operator.observe_edits(edits);
    }

    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input> {
        let mut inputs = self.operator.respond(session, screen);
        if self.views.first().is_some_and(|(at, _)| *at <= self.ticks) {
            inputs.insert(0, Input::Look(self.views.remove(0).1));
        }
        inputs
    }
}

fn view(eye: Vec3, focus: Vec3) -> TraineeView {
    TraineeView { eye, focus, up: Vec3::new(0.0, 1.0, -0.3), half_extent: [0.3, 0.2], mirror: None }
}

/// The tooth alone, or with a ball beside it, in voxels of 0.2 mm.
fn exercise(ball: bool, folder: &Path) -> String {
    let text = std::fs::read_to_string(format!("{}/scenarios/5-grinding.json", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let mut scenario: Value = serde_json::from_str(&text).unwrap();
    let jaw = scenario["scene"]["jaw"].as_object_mut().unwrap();
    jaw["tooth"]["form"]["procedural"]["spacing_mm"] = json!(0.2);
    jaw.remove("periodontium");
    let placed = json!({ "mesh": "ball.obj", "tissue": "gingiva", "position_mm": BALL_MM });
    jaw.insert("around".into(), if ball { json!([placed]) } else { json!([]) });
    scenario["stages"][0]["time_limit_s"] = json!(40);
    scenario.as_object_mut().unwrap().remove("questionnaire");
    scenario.as_object_mut().unwrap().remove("questionnaire_time");
    std::fs::write(folder.join("ball.obj"), ball_obj(60)).unwrap();
    scenario.to_string()
}

fn ball_obj(rings: usize) -> String {
    let mut text = format!("v 0 0 {BALL_RADIUS}\nv 0 0 {}\n", -BALL_RADIUS);
    let slices = 2 * rings;
    for (ring, slice) in (1..rings).flat_map(|ring| (0..slices).map(move |slice| (ring, slice))) {
        let (t, p) = (ring as f32 / rings as f32 * PI, slice as f32 / rings as f32 * PI);
        let corner = Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()) * BALL_RADIUS;
        writeln!(text, "v {} {} {}", corner.x, corner.y, corner.z).unwrap();
    }
    let at = |ring: usize, slice: usize| 3 + (ring - 1) * slices + slice % slices;
    for s in 0..slices {
        writeln!(text, "f 1 {} {}\nf 2 {} {}", at(1, s), at(1, s + 1), at(rings - 1, s + 1), at(rings - 1, s)).unwrap();
        for r in 1..rings - 1 {
            writeln!(text, "f {} {} {} {}", at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1)).unwrap();
        }
    }
    text
}

/// A session of an operator with views; recorded, read and scored.
fn scored(name: &str, ball: bool, views: Vec<(u64, TraineeView)>) -> Scored {
    let folder = folder(name);
    let source = SourceText::new("look.json", exercise(ball, &folder));
    let library = Library::shipped().with_folder(&folder);
    let scenario = Arc::new(resolve(source, &library, ResolveMode::ReadScans).unwrap());
    let workpiece = Arc::new(Workpiece::make(&scenario, 3).unwrap());
    let spec = DeviceSpec::phantom_omni();
    let head = RecordingHeadFile::of(&scenario, &spec, 3);
    let path = folder.join(FILE_NAME);
    let mut recorder = Recorder::create(&path, &head, &scenario, &workpiece).unwrap();
    let mut simulation = Simulation::new(setup(&scenario, &workpiece, spec.clone()));
    let mut session = Session::new(scenario.clone(), &workpiece);
    let file = OperatorFile::read(&Library::shipped(), "hasty").unwrap();
    let operator = Operator::new(file, scenario, workpiece, spec, 3);
    let mut trainee = LookingOperator { operator, views, ticks: 0 };
    run(&mut session, &mut simulation, &mut trainee, &mut recorder).unwrap();
    let servo = ServoStatsFile::of(&simulation);
    recorder.finish(&RecordingEndFile { reason: "complete".into(), servo }).unwrap();
    let recording = Recording::read(&path).unwrap();
    let scored = score(&recording, ReplayCheck::Full).unwrap();
    assert_eq!(scored.replay.difference, None, "{name}");
    let removed: Vec<_> = scored.removals.iter().map(|(voxel, removal)| json!([voxel, removal.at.0])).collect();
    let hidden: Vec<_> = scored.unseen.iter().flat_map(|unseen| &unseen.hidden).map(|found| found.voxel).collect();
    let centre = scored.replay.workpiece.surroundings.first().map(|c| c.tooth_from_collider.position.to_array());
    let ball = centre.map(|centre| json!({ "centre": centre, "radius": BALL_RADIUS }));
    let found = json!({ "removed": removed, "hidden": hidden, "ball": ball });
    std::fs::write(folder.join("found.json"), found.to_string()).unwrap();
    scored
}

/// Views by the tick from which they count.
type Views = Vec<(u64, TraineeView)>;

/// The three sessions: views that change from above to beside; a mirror behind the tooth; an obstacle before it.
fn sessions() -> [(&'static str, bool, Views); 3] {
    let crown = Vec3::new(0.0, -2.0, 0.0);
    let behind = Vec3::new(0.0, 10.0, -16.0);
    // It reflects an eye that looks along −z down to the crown.
    let to_eye = (Vec3::new(0.0, 6.0, 70.0) - behind).normalize();
    let normal = (to_eye + (crown - behind).normalize()).normalize();
    let mirror = Some(MirrorFace { centre: behind, normal, radius: 7.0 });
    let low = view(Vec3::new(0.0, -1.0, 70.0), crown);
    let changing = vec![
        (0, view(Vec3::new(0.0, 60.0, 30.0), crown)),
        (8_000, view(Vec3::new(50.0, 20.0, 40.0), crown)),
        (16_000, low),
    ];
    let mirrored = vec![(0, low), (9_000, TraineeView { mirror, ..view(Vec3::new(0.0, 6.0, 70.0), behind) })];
    let hindered =
        vec![(0, view(Vec3::new(8.0, 60.0, 40.0), crown)), (12_000, view(Vec3::new(50.0, 40.0, 0.0), crown))];
    [("look_changing", false, changing), ("look_mirror", false, mirrored), ("look_obstacle", true, hindered)]
}

#[test]
fn what_is_cut_out_of_sight_is_measured_and_another_program_agrees() {
    // Aim: at most 1 % of the removed voxels are judged differently by an independent ray test, and each session has
    // seen and unseen removals, so that the agreement means something.
    let python = tools::named_by("TYPODONT_PYTHON", "Python, for the independent ray test");
    for (name, ball, views) in sessions() {
        let scored = scored(name, ball, views);
        let unseen = scored.unseen.as_ref().unwrap();
        let share = scored.measures.value("unseen_cut_pct").unwrap();
        println!("{name}: {} removed, {share:.2} % out of sight", unseen.judged);
        assert!(unseen.judged > 1000, "{name}: {}", unseen.judged);
        assert!((2.0..98.0).contains(&share), "{name}: {share}");
        assert_eq!(unseen.judged as usize, scored.removals.iter().count(), "{name}");
        let Some(python) = &python else { continue };
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_visibility.py");
        let output = Command::new(python)
            .arg(script)
            .args([folder.join(FILE_NAME), folder.join("found.json")])
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        println!("{name}: {text}");
        assert!(output.status.success(), "{name}: {text}{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn without_a_view_nothing_is_said_of_sight() {
    let scored = scored("look_never", false, Vec::new());
    assert_eq!(scored.unseen, None);
    assert!(scored.measures.get("unseen_cut_pct").is_none());
}

#[test]
fn more_is_seen_from_above_than_from_the_side_and_nothing_from_below() {
    let share = |name: &str, eye: Vec3| {
        scored(name, false, vec![(0, view(eye, Vec3::ZERO))]).measures.value("unseen_cut_pct").unwrap()
    };
    let above = share("look_above", Vec3::new(0.0, 70.0, 6.0));
    let side = share("look_side", Vec3::new(0.0, 4.0, 70.0));
    println!("out of sight: {above:.2} % from above, {side:.2} % from the side");
    assert!(above + 20.0 < side, "{above} {side}");
    assert_eq!(share("look_below", Vec3::new(0.0, -70.0, 6.0)), 100.0);
}
