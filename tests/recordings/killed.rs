//! A session killed with SIGKILL loses at most its last 1.2 s, and in practice no more than 200 ms.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use typodont_core::device::{DeviceSpec, Reading};
use typodont_core::sim::{Command as Order, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::volume::Edit;
use typodont_exercise::record::{Recorder, RecorderError, Recording, RecordingHeadFile};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Workpiece};
use typodont_exercise::session::{Effect, Input, Observer, Operator, OperatorFile, Session};
use typodont_formats::Library;

/// Environment variable with the folder for the process that will be killed.
const FOLDER: &str = "TYPODONT_TEST_KILLED";

/// Environment variable with the number of ticks after which that process slows down, so that the kill comes before the
/// end of the session.
const ENOUGH: &str = "TYPODONT_TEST_KILLED_AFTER";

/// Maximum loss that is promised for a session that is cut off in any way, ticks.
const LOSS_MAX: u64 = 1200;

/// A recorder that also writes the number of completed ticks to a file.
struct ReportingRecorder {
    recorder: Recorder,
    progress: File,
    enough: u64,
}

impl Observer for ReportingRecorder {
    type Error = RecorderError;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), RecorderError> {
        self.recorder.input(tick, input)
    }

    fn command(&mut self, tick: Tick, command: &Order) -> Result<(), RecorderError> {
        self.recorder.command(tick, command)
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), RecorderError> {
        self.recorder.effect(tick, effect, session)
    }

    fn tick_completed(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), RecorderError> {
        self.recorder.tick_completed(reading, step, edits)?;
        self.progress.write_all_at(&step.tick.next().0.to_le_bytes(), 0).unwrap();
        if step.tick.0 > self.enough {
            std::thread::sleep(Duration::from_micros(300));
        }
        Ok(())
    }
}

#[test]
#[ignore = "started by the test below, in a separate process"]
fn a_session_to_be_killed() {
    let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) else { return };
    let library = Library::shipped();
    let source = typodont_formats::read_text(Path::new("scenarios/5-grinding.json")).unwrap();
    let scenario = Arc::new(scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap());
    let workpiece = Arc::new(Workpiece::make(&scenario, 1).unwrap());
    let spec = DeviceSpec::phantom_omni();
    let head = RecordingHeadFile::of(&scenario, &spec, 1);
    let recorder = Recorder::create(&folder.join("recording.mcap"), &head, &scenario, &workpiece).unwrap();
    let progress = File::create(folder.join("progress")).unwrap();
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut simulation = Simulation::new(typodont_exercise::session::setup(&scenario, &workpiece, spec.clone()));
    let operator = OperatorFile::read(&library, "careful").unwrap();
    let mut trainee = Operator::new(operator, scenario, workpiece, spec, 1);
    let enough = std::env::var(ENOUGH).unwrap().parse().unwrap();
    let mut observer = ReportingRecorder { recorder, progress, enough };
    typodont_exercise::session::run(&mut session, &mut simulation, &mut trainee, &mut observer).unwrap();
    panic!("the session ended before it was killed");
}

fn ticks_reported(folder: &Path) -> u64 {
    let bytes = fs::read(folder.join("progress")).unwrap_or_default();
    bytes.try_into().map_or(0, u64::from_le_bytes)
}

/// Starts a session in a process of its own, kills it after this tick, and returns the number of completed ticks.
fn kill_after(tick: u64, folder: &Path) -> u64 {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "killed::a_session_to_be_killed", "--ignored"])
        .env(FOLDER, folder)
        .env(ENOUGH, tick.saturating_sub(137).to_string())
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while ticks_reported(folder) < tick {
        assert!(child.try_wait().unwrap().is_none(), "the session ended by itself");
        assert!(started.elapsed() < Duration::from_secs(600), "the session makes no progress");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    ticks_reported(folder)
}

#[test]
fn a_killed_session_is_scored_up_to_its_last_200_ms() {
    let folder = folder("killed").join("session.partial");
    fs::create_dir_all(&folder).unwrap();
    let completed = kill_after(5_458, &folder);
    let recording = folder.join("recording.mcap");
    let output = typodont(&["score", recording.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let session: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    let recovered = (metric(&session, "session_time_s").unwrap() * 1000.0).round() as u64;
    println!("{recovered} of {completed} ms recovered");
    assert!(recovered <= completed && completed - recovered <= 200, "{recovered} of {completed} ms");
    assert!(metric(&session, "decay_cleared_pct").unwrap() > 0.0);
    let told_loss = format!("cut off before its end: what followed {:.3} s was lost", recovered as f64 / 1000.0);
    assert!(complained(&output).contains(&told_loss), "{}", complained(&output));

    // The folder is an incomplete bundle, and `verify` reports it.
    let output = typodont(&["verify", folder.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complained(&output).contains("is cut off before its end"), "{}", complained(&output));
    assert!(complained(&output).contains("typodont finish"), "{}", complained(&output));
    // Finished, it verifies as a session that was cut off.
    fs::remove_file(folder.join("progress")).unwrap();
    let output = typodont(&["finish", folder.to_str().unwrap()]);
    let output = typodont(&["verify", told(&output).trim()]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
}

#[test]
#[ignore = "scripts/test --long"]
fn two_hundred_killed_sessions_lose_at_most_their_last_second() {
    let mut losses = Vec::new();
    for n in 0..200 {
        // Ticks that share no factor with the 100 and 1000 ticks of chunks and digests.
        let tick = 300 + n * 1_237 % 4_000;
        let folder = folder("killed_often");
        let completed = kill_after(tick, &folder);
        let recording = Recording::read(&folder.join("recording.mcap")).unwrap();
        assert!(recording.is_cut_off());
        losses.push(completed - recording.len() as u64);
    }
    losses.sort_unstable();
    println!(
        "lost of {} killed sessions: {} ms at most, {} ms in half of them",
        losses.len(),
        losses[199],
        losses[100]
    );
    assert!(losses[199] <= LOSS_MAX, "{losses:?}");
}
