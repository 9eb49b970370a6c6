//! `typodont path`: where a hand went, or what it felt, as a table that guides another hand.

use super::{Failure, recording_in, say};
use crate::content::measured::{POINTS_MAX, ROWS_MAX};
use crate::frame::Vec3;
use crate::record::{self, Recording, Watch};
use crate::tick::Tick;
use crate::touch::POINT_DISTANCE;
use clap::Args;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The bundle's folder, or a recording
    bundle: PathBuf,
    /// The table
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,
    /// Only this stage; without it the first
    #[arg(long, value_name = "ID")]
    stage: Option<String>,
    /// Forces as they were felt, in tooth space, in place of the path of the instrument's tip
    #[arg(long)]
    forces: bool,
}

/// What one tick leaves in a table; tooth space.
struct Sample {
    tick: Tick,
    tip: Vec3,
    force: Vec3,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { bundle, output, stage, forces } = arguments;
    if output.extension().is_none_or(|e| e != "csv") {
        return Err(Failure::misuse(format!("{}: the table is a .csv file", output.display())));
    }
    let path = recording_in(bundle);
    let recording = Recording::read(&path).map_err(Failure::wrong)?;
    let wrong = |what: String| Failure::wrong(format!("{}: {what}", path.display()));
    let samples = samples(&recording, stage.as_deref()).map_err(wrong)?;
    let (table, rows) = if *forces { table_of_forces(&samples) } else { table_of_path(&samples) };
    let most = if *forces { ROWS_MAX } else { POINTS_MAX };
    if rows > most {
        eprintln!(
            "{}: has {rows} rows, of which an exercise follows at most {most}: take a part of it",
            output.display()
        );
    }
    super::write(output, table)?;
    say(format!("{}: {rows} rows", output.display()))
}

/// Every tick of a stage.
fn samples(recording: &Recording, stage: Option<&str>) -> Result<Vec<Sample>, String> {
    let stages = &recording.scenario.stages;
    let wanted = match stage {
        None => 0,
        Some(id) => stages.iter().position(|s| s.id == *id).ok_or_else(|| {
            let known = stages.iter().map(|s| s.id.as_str()).collect::<Vec<_>>().join(", ");
            format!("unknown-stage: no stage is named \"{id}\"; known: {known}")
        })?,
    };
    let workpiece = recording.workpiece()?;
    let tooth_from_world = workpiece.world_from_tooth.inverse();
    let mut samples = Vec::new();
    let replay = record::replay(recording, workpiece, Watch::Everything, |_, step, _, session| {
        if session.stage().is_some_and(|(index, _)| index == wanted) {
            let (tip, force) = (tooth_from_world * step.tip, tooth_from_world.turn(step.force));
            samples.push(Sample { tick: step.tick, tip, force });
        }
    });
    match replay.difference {
        Some(difference) => Err(format!("{}: {difference}", record::FILE_NAME)),
        None if samples.is_empty() => Err("empty-path: the stage was never reached".into()),
        None => Ok(samples),
    }
}

/// Places at least [`POINT_DISTANCE`] apart, with their times since the stage began.
fn table_of_path(samples: &[Sample]) -> (String, usize) {
    let mut table = "time_s,x_mm,y_mm,z_mm\n".to_string();
    let (mut rows, mut last): (usize, Option<Vec3>) = (0, None);
    for Sample { tick, tip, .. } in samples {
        if last.is_none_or(|last| last.distance(*tip) >= POINT_DISTANCE) {
            let seconds = tick.seconds_since(samples[0].tick);
            // Writing into a text cannot fail.
            let _ = writeln!(table, "{seconds:.3},{:.4},{:.4},{:.4}", tip.x, tip.y, tip.z);
            (rows, last) = (rows + 1, Some(*tip));
        }
    }
    (table, rows)
}

fn table_of_forces(samples: &[Sample]) -> (String, usize) {
    let mut table = "time_s,fx_n,fy_n,fz_n\n".to_string();
    for Sample { tick, force, .. } in samples {
        let seconds = tick.seconds_since(samples[0].tick);
        let _ = writeln!(table, "{seconds:.3},{:.4},{:.4},{:.4}", force.x, force.y, force.z);
    }
    (table, samples.len())
}
