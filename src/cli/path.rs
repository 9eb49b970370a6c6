//! `typodont path`: exports the path of a session, or its forces, as a table for haptic guidance.

use super::{CliError, print_line, recording_path};
use clap::Args;
use std::fmt::Write;
use std::path::PathBuf;
use typodont_core::frame::Vec3;
use typodont_core::tick::Tick;
use typodont_core::touch::POINT_DISTANCE;
use typodont_exercise::record;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_formats::csv_tables::{POINTS_MAX, ROWS_MAX};

#[derive(Args)]
pub struct Arguments {
    /// Folder of the bundle, or a recording
    bundle: PathBuf,
    /// Table to write
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Stage to export; by default the first
    #[arg(long, value_name = "ID")]
    stage: Option<String>,
    /// Export the rendered forces, in tooth space, instead of the path of the instrument's tip
    #[arg(long)]
    forces: bool,
}

/// Tip position, mm, and force, N, at one tick, in tooth space.
struct PathSample {
    tick: Tick,
    tip: Vec3,
    force: Vec3,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { bundle, output, stage, forces } = arguments;
    if output.extension().is_none_or(|e| e != "csv") {
        return Err(CliError::misuse(format!("{}: the name of the table must end in .csv", output.display())));
    }
    let path = recording_path(bundle);
    let recording = Recording::read(&path).map_err(CliError::wrong)?;
    let wrong = |what: String| CliError::wrong(format!("{}: {what}", path.display()));
    let samples = samples(&recording, stage.as_deref()).map_err(wrong)?;
    let (table, rows) = if *forces { table_of_forces(&samples) } else { table_of_path(&samples) };
    let most = if *forces { ROWS_MAX } else { POINTS_MAX };
    if rows > most {
        eprintln!(
            "{}: the table has {rows} rows, and an exercise uses at most {most}; shorten the table",
            output.display()
        );
    }
    super::write_file(output, table)?;
    print_line(format!("{}: {rows} rows", output.display()))
}

/// Samples of every tick of a stage.
fn samples(recording: &Recording, stage: Option<&str>) -> Result<Vec<PathSample>, String> {
    let stages = &recording.scenario.stages;
    let wanted = match stage {
        None => 0,
        Some(id) => stages.iter().position(|s| s.id == *id).ok_or_else(|| {
            let known = stages.iter().map(|s| s.id.as_str()).collect::<Vec<_>>().join(", ");
            format!("unknown-stage: there is no stage \"{id}\"; known: {known}")
        })?,
    };
    let workpiece = recording.workpiece()?;
    let tooth_from_world = workpiece.world_from_tooth.inverse();
    let mut samples = Vec::new();
    let replay = record::replay(recording, workpiece, ReplayCheck::Full, |_, step, _, session| {
        if session.stage().is_some_and(|(index, _)| index == wanted) {
            let (tip, force) = (tooth_from_world * step.tip, tooth_from_world.rotate(step.force));
            samples.push(PathSample { tick: step.tick, tip, force });
        }
    });
    match replay.difference {
        Some(difference) => Err(format!("{}: {difference}", record::FILE_NAME)),
        None if samples.is_empty() => Err("empty-path: the session did not reach this stage".into()),
        None => Ok(samples),
    }
}

/// Table of tip positions at least [`POINT_DISTANCE`] apart, with their times since the stage began.
fn table_of_path(samples: &[PathSample]) -> (String, usize) {
    let mut table = "time_s,x_mm,y_mm,z_mm\n".to_string();
    let (mut rows, mut last): (usize, Option<Vec3>) = (0, None);
    for PathSample { tick, tip, .. } in samples {
        if last.is_none_or(|last| last.distance(*tip) >= POINT_DISTANCE) {
            let seconds = tick.seconds_since(samples[0].tick);
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{seconds:.3},{:.4},{:.4},{:.4}", tip.x, tip.y, tip.z);
            (rows, last) = (rows + 1, Some(*tip));
        }
    }
    (table, rows)
}

fn table_of_forces(samples: &[PathSample]) -> (String, usize) {
    let mut table = "time_s,fx_n,fy_n,fz_n\n".to_string();
    for PathSample { tick, force, .. } in samples {
        let seconds = tick.seconds_since(samples[0].tick);
        let _ = writeln!(table, "{seconds:.3},{:.4},{:.4},{:.4}", force.x, force.y, force.z);
    }
    (table, samples.len())
}
