//! Rescoring of a recording, with the result that `typodont score` prints.

use std::fmt;
use std::panic::{self, AssertUnwindSafe};
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::score;
use typodont_report::SessionFile;

/// Reason for which a recording cannot be scored. The error is permanent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScoringError(pub String);

impl fmt::Display for ScoringError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ScoringError {}

/// Scores a recording. `name` identifies the recording in error messages.
///
/// # Errors
///
/// Returns an error when the recording is damaged or the scorer panics.
pub fn rescore(name: &str, bytes: &[u8]) -> Result<SessionFile, ScoringError> {
    let scored = panic::catch_unwind(AssertUnwindSafe(|| {
        let recording = Recording::parse(name, bytes).map_err(|e| e.to_string())?;
        let scored =
            score::score(&recording, ReplayCheck::Skip).map_err(|e| format!("{name}: damaged-recording: {e}"))?;
        Ok(SessionFile::of(&recording, &scored))
    }));
    match scored {
        Ok(result) => result.map_err(ScoringError),
        // A recording that makes the scorer panic must not stop the others.
        Err(_) => {
            Err(ScoringError(format!("{name}: damaged-recording: the scorer failed unexpectedly; please report it")))
        }
    }
}
