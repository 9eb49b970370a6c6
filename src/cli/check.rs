//! `typodont check`: every complaint about every file.

use super::{Failure, say};
use crate::diagnostic::Diagnostic;
use crate::lesson::{self, scenario_files};
use crate::scenario::Forms;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    /// Scenario files, or folders of them
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// How complaints are written
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// A complaint as a program reads it; line and column are null for a complaint about a whole file.
#[derive(Serialize)]
struct ComplaintFile<'a> {
    file: &'a str,
    line: Option<usize>,
    column: Option<usize>,
    code: &'a str,
    path: &'a str,
    message: &'a str,
    help: Option<&'a str>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut found = Vec::new();
    let mut checked = 0;
    for path in &arguments.files {
        let files = scenario_files(path)?;
        checked += files.len();
        for file in files {
            found.extend(check(&file));
        }
    }
    match arguments.format {
        Format::Text if found.is_empty() => say(format!("{checked} files, no complaints"))?,
        Format::Text => return Err(Failure::Complaints(found)),
        Format::Json => say(as_json(&found))?,
    }
    if found.is_empty() { Ok(()) } else { Err(Failure::Told) }
}

/// All complaints about one scenario.
fn check(path: &Path) -> Vec<Diagnostic> {
    lesson::read(path, Forms::Made).err().unwrap_or_default()
}

fn as_json(found: &[Diagnostic]) -> String {
    let complaint = |d: &Diagnostic| {
        let (line, column) = d.line_and_column().unzip();
        serde_json::to_value(ComplaintFile {
            file: &d.source.name,
            line,
            column,
            code: d.code,
            path: &d.path,
            message: &d.message,
            help: d.help.as_deref(),
        })
    };
    let all: Vec<_> = found.iter().filter_map(|d| complaint(d).ok()).collect();
    serde_json::to_string_pretty(&all).unwrap_or_default()
}
