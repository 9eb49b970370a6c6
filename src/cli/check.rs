//! `typodont check`: prints all complaints about scenario files.

use super::{CliError, print_line};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::ResolveMode;
use typodont_formats::diagnostic::Diagnostic;
use typodont_lesson::{self as lesson, scenario_files};

#[derive(Args)]
pub struct Arguments {
    /// Scenario files, or folders that contain them
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Output format of the problems found
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// A complaint in JSON output; line and column are null for a complaint about a whole file.
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

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
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
        Format::Text if found.is_empty() => print_line(format!("{checked} files checked, no problems found"))?,
        Format::Text => return Err(CliError::Complaints(found)),
        Format::Json => print_line(to_json(&found))?,
    }
    if found.is_empty() { Ok(()) } else { Err(CliError::AlreadyReported) }
}

/// All complaints about one scenario.
fn check(path: &Path) -> Vec<Diagnostic> {
    lesson::read_scenario(path, ResolveMode::MakeWorkpiece).err().unwrap_or_default()
}

fn to_json(found: &[Diagnostic]) -> String {
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
