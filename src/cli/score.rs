//! `typodont score`: computes a session's results again, from the recording alone.

use super::{CliError, print_line, recording_path};
use clap::Args;
use std::path::PathBuf;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::score;
use typodont_report::SessionFile;

#[derive(Args)]
pub struct Arguments {
    /// Folder of the bundle, or a recording
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = recording_path(&arguments.bundle);
    let recording = Recording::read(&path).map_err(CliError::wrong)?;
    let scored = score::score(&recording, ReplayCheck::Skip)
        .map_err(|e| CliError::wrong(format!("{}: damaged-recording: {e}", path.display())))?;
    print_line(SessionFile::of(&recording, &scored).to_json().trim_end())?;
    if let Some(loss) = recording.describe_loss() {
        let extent = if recording.is_cut_off() { "; the score covers this part only" } else { "" };
        eprintln!("{}: {loss}{extent}", path.display());
    }
    Ok(())
}
