//! `typodont parquet`: sessions, measures and events for analysis.

use super::school::{self, Source};
use super::{Failure, cohort, say, write};
use crate::handover::tables;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Folder for sessions.parquet, metrics.parquet and events.parquet. Of a database: a folder for each class and month in it, and
    /// a store's URL will do as well
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { source, output } = arguments;
    let Some(folder) = source.folder.as_ref().filter(|_| source.at.database.is_none()) else {
        return school::write_partitions(source, output);
    };
    source.takes_all()?;
    let cohort = cohort::read(folder)?;
    let unmade = |e: std::io::Error| Failure::wrong(format!("{}: unwritable-folder: {e}", output.display()));
    std::fs::create_dir_all(output).map_err(unmade)?;
    for (name, bytes) in tables::all(&cohort).map_err(Failure::wrong)? {
        write(&output.join(name), bytes)?;
    }
    say(format!("{}: {} sessions", output.display(), cohort.sessions.len()))
}
