//! What is on the screen, for whoever cannot see it: a line per change in a file that the environment names.
//!
//! Tests and kiosks wait for states by it instead of guessing times.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;

/// Names the file; without it nothing is written.
const FILE: &str = "TYPODONT_DIARY";

#[derive(Default)]
pub struct Diary {
    file: Option<File>,
    last: BTreeMap<&'static str, String>,
}

impl Diary {
    /// The diary that the environment asks for, if it does.
    pub fn from_environment() -> Diary {
        let file = std::env::var_os(FILE).and_then(|path| File::create(path).ok());
        Diary { file, last: BTreeMap::new() }
    }

    /// Writes `topic value` unless that was the topic's last line.
    pub fn note(&mut self, topic: &'static str, value: impl ToString) {
        let Some(file) = &mut self.file else { return };
        let value = value.to_string();
        if self.last.get(topic) != Some(&value) {
            // A diary that cannot be written is no reason to stop.
            let _ = writeln!(file, "{topic} {value}");
            self.last.insert(topic, value);
        }
    }
}
