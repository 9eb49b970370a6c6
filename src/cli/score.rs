//! `typodont score`: the result again, from the recording alone.

use super::{Failure, recording_in, say};
use crate::record::{Recording, Watch};
use crate::report::SessionFile;
use crate::score;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The bundle's folder, or a recording
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = recording_in(&arguments.bundle);
    let recording = Recording::read(&path).map_err(Failure::wrong)?;
    let scored = score::score(&recording, Watch::Nothing)
        .map_err(|e| Failure::wrong(format!("{}: damaged-recording: {e}", path.display())))?;
    say(SessionFile::of(&recording, &scored).text().trim_end())?;
    if recording.end.is_none() {
        let seconds = recording.len() as f64 * crate::tick::TICK_S;
        eprintln!("{}: the recording breaks off after {seconds:.3} s; this is the score up to there", path.display());
    }
    Ok(())
}
