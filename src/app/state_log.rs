//! Log of the screen's state, for programs that cannot see the screen: a line per change, in a file named by an
//! environment variable; of a page, in the browser's console.
//!
//! Tests and kiosks use it to wait for a state instead of a fixed time.

use crate::platform;
use std::collections::BTreeMap;

#[derive(Default)]
pub struct StateLog {
    sink: Option<platform::LogSink>,
    last: BTreeMap<&'static str, String>,
}

impl StateLog {
    /// A log that writes to `sink`; without one, to the one that is asked for, or nowhere if none is.
    pub fn new(sink: Option<platform::LogSink>) -> StateLog {
        StateLog { sink: sink.or_else(platform::open_log), last: BTreeMap::new() }
    }

    /// Writes `topic value` unless that was the topic's last line.
    pub fn record(&mut self, topic: &'static str, value: impl ToString) {
        let Some(sink) = &mut self.sink else { return };
        let value = value.to_string();
        if self.last.get(topic) != Some(&value) {
            sink(&format!("{topic} {value}"));
            self.last.insert(topic, value);
        }
    }
}
