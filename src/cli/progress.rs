//! Progress of commands that treat many files, on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar on a terminal; hidden elsewhere. `what` follows the numbers of those done and of all: "sent".
pub fn progress_bar(length: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}, {eta} left").expect("the template is valid");
    ProgressBar::new(length).with_style(style).with_message(what)
}
