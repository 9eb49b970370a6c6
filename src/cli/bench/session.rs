//! Whole sessions: what five minutes cost to replay and to score, and the most memory one holds.

use super::figures::{Figures, repeated};
use super::work::{SEED, Scratch, exercise, grinding};
use super::{DIMS, grown, name_of};
use crate::cli::run::{Player, Run, perform};
use crate::content::Library;
use crate::device::Spec;
use crate::diagnostic::headlines;
use crate::record::{EndFile, HeadFile, Recorder, Recording, ServoFile, Watch};
use crate::score;
use crate::session::{self, ActionFile, Operator, OperatorFile, Session};
use crate::sim::Simulation;
use crate::volume::Volume;
use std::collections::BTreeMap;
use std::process::Command;
use std::sync::Arc;

pub struct FiveMinutes {
    pub replay_s: Figures,
    pub score_s: Figures,
}

/// Ticks of the measured session.
const FIVE_MINUTES: usize = 300_000;

/// The careful operator at work until the exercise's five minutes are over.
pub fn five_minutes(tooth: Volume) -> Result<FiveMinutes, String> {
    let recording = played(tooth)?;
    if recording.len() < FIVE_MINUTES {
        return Err(format!("the measured session ended after {} ticks, not {FIVE_MINUTES}", recording.len()));
    }
    let mut seen = None;
    let mut failed = None;
    let replay_s = repeated(1.0, || match score::watch(&recording, Watch::Nothing) {
        Ok(watched) => seen = Some(watched),
        Err(error) => failed = Some(error),
    });
    if let Some(error) = failed {
        return Err(error);
    }
    let watched = seen.ok_or("nothing was replayed")?;
    let mut all: Vec<_> = (0..5).map(|_| watched.clone()).collect();
    let times = std::iter::from_fn(|| {
        let watched = all.pop()?;
        let start = std::time::Instant::now();
        std::hint::black_box(score::judge(&recording, watched));
        Some(start.elapsed().as_secs_f64())
    });
    Ok(FiveMinutes { replay_s, score_s: Figures::of(times.collect()) })
}

/// Runs and records a session that goes on and on.
fn played(tooth: Volume) -> Result<Recording, String> {
    let (scenario, workpiece) = grinding(tooth)?;
    let mut operator = careful()?;
    keep_cutting(&mut operator);
    let spec = Spec::phantom_omni();
    let head = HeadFile::of(&scenario, &spec, SEED);
    let file = Scratch::new("mcap");
    let mut recorder = Recorder::create(&file.0, &head, &scenario, &workpiece).map_err(|e| e.to_string())?;
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut simulation = Simulation::new(session::setup(&scenario, &workpiece, spec.clone()));
    let mut trainee = Operator::new(operator, scenario, workpiece, spec, SEED);
    session::run(&mut session, &mut simulation, &mut trainee, &mut recorder).map_err(|e| e.to_string())?;
    recorder
        .finish(&EndFile { reason: "complete".into(), servo: ServoFile::of(&simulation) })
        .map_err(|e| e.to_string())?;
    drop((session, simulation, trainee));
    Recording::read(&file.0).map_err(|e| e.to_string())
}

/// Lets an operator pass over the decay again and again, never content.
fn keep_cutting(operator: &mut OperatorFile) {
    for action in operator.rules.iter_mut().flat_map(|rule| &mut rule.actions) {
        if let ActionFile::Cut(cut) = action {
            (cut.passes, cut.until_cleared_pct) = (50, 100.0);
        }
    }
}

/// The most memory that a process of its own holds while a session of a size is run, recorded, scored and
/// reported, MiB.
pub fn peak_mib(dims: &str) -> Result<f64, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let told = Command::new(program).args(["bench", "--session-peak", dims]).output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&told.stdout);
    text.trim().parse().map_err(|_| format!("a session of {dims}: {}", String::from_utf8_lossy(&told.stderr)))
}

/// Runs, records, scores and reports as `typodont run` does, then says what that took.
pub fn print_peak(dims: &str) -> Result<(), String> {
    let known = DIMS.into_iter().find(|d| name_of(*d) == dims);
    let dims = known.ok_or_else(|| format!("unknown-size: \"{dims}\" is none of the measured sizes"))?;
    let folder = Scratch::new("session");
    let run = Run {
        scenario: Arc::new(exercise(grown(dims)?)?),
        player: Player::Script(Box::new(careful()?)),
        seed: SEED,
        participant: "",
        out: &folder.0,
        digests: BTreeMap::new(),
    };
    perform(run).map_err(|failure| failure.lines())?;
    println!("{:.1}", peak_of_this_process()?);
    Ok(())
}

fn careful() -> Result<OperatorFile, String> {
    OperatorFile::read(&Library::shipped(), "careful").map_err(|found| headlines(&found))
}

/// The highest resident memory so far, MiB. Linux tells it; elsewhere there is no figure.
fn peak_of_this_process() -> Result<f64, String> {
    let status = std::fs::read_to_string("/proc/self/status").map_err(|e| e.to_string())?;
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = peak.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kib.map(|kib| kib / 1024.0).ok_or_else(|| "the system does not tell a process's highest memory".to_string())
}
