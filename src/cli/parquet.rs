//! `typodont parquet`: exports sessions, metrics and events for analysis.

use super::verification::{self, VerificationArguments};
use super::{CliError, SessionSource, cohort, print_line, write_file};
use clap::Args;
use std::path::PathBuf;
use typodont_integrations::parquet_tables;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: SessionSource,
    /// Output folder for sessions.parquet, metrics.parquet and events.parquet. With --database: for a subfolder per class and
    /// month, and it may also be the URL of an object store
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    verification: VerificationArguments,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { source, output, verification } = arguments;
    let Some(folder) = source.bundle_folder()? else {
        #[cfg(feature = "school")]
        return super::school::write_partitions(source, output, verification);
        #[cfg(not(feature = "school"))]
        return Err(super::missing_part::error("--database", "school"));
    };
    let mut cohort = cohort::read_folder(folder)?;
    verification::settle(&mut cohort, verification)?;
    let unwritable = |e: std::io::Error| CliError::wrong(format!("{}: unwritable-folder: {e}", output.display()));
    std::fs::create_dir_all(output).map_err(unwritable)?;
    for (name, bytes) in parquet_tables::all_tables(&cohort).map_err(CliError::wrong)? {
        write_file(&output.join(name), bytes)?;
    }
    print_line(format!("{}: {} sessions", output.display(), cohort.sessions.len()))
}
