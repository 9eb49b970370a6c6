//! A recording's bytes scored again: the text that `typodont score` prints.

use crate::record::{Recording, Watch};
use crate::report::SessionFile;
use crate::score;
use std::panic::{self, AssertUnwindSafe};

/// Why a recording has no score. Trying again would say the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unscored(pub String);

/// Scores a recording. `name` is told in complaints.
pub fn rescored(name: &str, bytes: &[u8]) -> Result<SessionFile, Unscored> {
    let scored = panic::catch_unwind(AssertUnwindSafe(|| {
        let recording = Recording::parse(name, bytes).map_err(|e| e.to_string())?;
        let scored = score::score(&recording, Watch::Nothing).map_err(|e| format!("{name}: damaged-recording: {e}"))?;
        Ok(SessionFile::of(&recording, &scored))
    }));
    match scored {
        Ok(result) => result.map_err(Unscored),
        // One recording that breaks the scorer must not stop the rest.
        Err(_) => Err(Unscored(format!("{name}: damaged-recording: scoring it broke off; please report it"))),
    }
}
