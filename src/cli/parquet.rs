//! `typodont parquet`: sessions, measures and events for analysis.

use super::{Failure, cohort, say, write};
use crate::handover::tables;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// Folder that holds bundles, at any depth
    folder: PathBuf,
    /// Folder for sessions.parquet, metrics.parquet and events.parquet
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, output } = arguments;
    let cohort = cohort::read(folder)?;
    let unmade = |e: std::io::Error| Failure::wrong(format!("{}: unwritable-folder: {e}", output.display()));
    std::fs::create_dir_all(output).map_err(unmade)?;
    for (name, bytes) in tables::all(&cohort).map_err(Failure::wrong)? {
        write(&output.join(name), bytes)?;
    }
    say(format!("{}: {} sessions", output.display(), cohort.sessions.len()))
}
