//! A session killed with SIGKILL leaves everything up to its last 200 ms.

mod bundle;
mod folder;

use bundle::*;
use folder::folder;
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use typodont::content::{self, Library};
use typodont::device::{Reading, Spec};
use typodont::record::{HeadFile, Recorder, Unwritable};
use typodont::scenario::{self, Forms, Workpiece};
use typodont::session::{self, Effect, Input, Observer, Operator, OperatorFile, Session};
use typodont::sim::{Command as Order, Simulation, Step};
use typodont::tick::Tick;
use typodont::volume::Edit;

/// Names the folder to the process that is to be killed.
const FOLDER: &str = "TYPODONT_TEST_KILLED";

/// Ticks that must have been turned before the kill.
const ENOUGH: u64 = 5_321;

/// A recorder that also says, outside of itself, how far it has come.
struct Telling {
    recorder: Recorder,
    progress: File,
}

impl Observer for Telling {
    type Error = Unwritable;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Unwritable> {
        self.recorder.input(tick, input)
    }

    fn command(&mut self, tick: Tick, command: &Order) -> Result<(), Unwritable> {
        self.recorder.command(tick, command)
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), Unwritable> {
        self.recorder.effect(tick, effect, session)
    }

    fn turned(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), Unwritable> {
        self.recorder.turned(reading, step, edits)?;
        self.progress.write_all_at(&step.tick.next().0.to_le_bytes(), 0).unwrap();
        // Slow enough that the kill strikes in the middle of things.
        if step.tick.0 > ENOUGH {
            std::thread::sleep(Duration::from_micros(300));
        }
        Ok(())
    }
}

#[test]
#[ignore = "started by the test below, in a process of its own"]
fn a_session_to_be_killed() {
    let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) else { return };
    let library = Library::shipped();
    let source = content::read_text(Path::new("scenarios/5-grinding.json")).unwrap();
    let scenario = Arc::new(scenario::resolve(source, &library, Forms::Made).unwrap());
    let workpiece = Arc::new(Workpiece::make(&scenario, 1).unwrap());
    let spec = Spec::phantom_omni();
    let head = HeadFile::of(&scenario, &spec, 1);
    let recorder = Recorder::create(&folder.join("recording.mcap"), &head, &scenario, &workpiece).unwrap();
    let progress = File::create(folder.join("progress")).unwrap();
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut simulation = Simulation::new(session::setup(&scenario, &workpiece, spec.clone()));
    let operator = OperatorFile::read(&library, "careful").unwrap();
    let mut trainee = Operator::new(operator, scenario, workpiece, spec, 1);
    let mut observer = Telling { recorder, progress };
    session::run(&mut session, &mut simulation, &mut trainee, &mut observer).unwrap();
    panic!("the session was to be killed before its end");
}

fn ticks_told(folder: &Path) -> u64 {
    let bytes = fs::read(folder.join("progress")).unwrap_or_default();
    bytes.try_into().map_or(0, u64::from_le_bytes)
}

#[test]
fn a_killed_session_is_scored_up_to_its_last_200_ms() {
    let folder = folder("killed");
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "a_session_to_be_killed", "--ignored"])
        .env(FOLDER, &folder)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while ticks_told(&folder) < ENOUGH + 137 {
        assert!(child.try_wait().unwrap().is_none(), "the session ended by itself");
        assert!(begun.elapsed() < Duration::from_secs(120), "the session does not get on");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let lived = ticks_told(&folder);

    let recording = folder.join("recording.mcap");
    let output = typodont(&["score", recording.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let session: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    let recovered = (metric(&session, "session_time_s").unwrap() * 1000.0).round() as u64;
    println!("{recovered} of {lived} ms recovered");
    assert!(recovered <= lived && lived - recovered <= 200, "{recovered} of {lived} ms");
    assert!(metric(&session, "decay_cleared_pct").unwrap() > 0.0);
    assert!(complained(&output).contains("breaks off"), "{}", complained(&output));

    // What is left is no whole bundle, and `verify` says so.
    let output = typodont(&["verify", folder.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complained(&output).contains("breaks off before its end"), "{}", complained(&output));
}
