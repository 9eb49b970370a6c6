//! Log of the screen's state, for programs that cannot see the screen: a line per change, in a file named by an
//! environment variable.
//!
//! Tests and kiosks use it to wait for a state instead of a fixed time.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;

/// Environment variable that names the file; without it nothing is written.
const FILE_VARIABLE: &str = "TYPODONT_STATE_LOG";

#[derive(Default)]
pub struct StateLog {
    file: Option<File>,
    last: BTreeMap<&'static str, String>,
}

impl StateLog {
    /// The log that the environment variable names; a log that records nothing if it is not set.
    pub fn from_environment() -> StateLog {
        let file = std::env::var_os(FILE_VARIABLE).and_then(|path| File::create(path).ok());
        StateLog { file, last: BTreeMap::new() }
    }

    /// Writes `topic value` unless that was the topic's last line.
    pub fn record(&mut self, topic: &'static str, value: impl ToString) {
        let Some(file) = &mut self.file else { return };
        let value = value.to_string();
        if self.last.get(topic) != Some(&value) {
            // The program goes on if the log cannot be written.
            let _ = writeln!(file, "{topic} {value}");
            self.last.insert(topic, value);
        }
    }
}
