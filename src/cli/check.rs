//! `typodont check`: every complaint about every file.

use super::{Failure, say};
use crate::content::{self, Library};
use crate::diagnostic::Diagnostic;
use crate::scenario::{self, Forms};
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
    let source = match content::read_text(path) {
        Ok(source) => source,
        Err(diagnostic) => return vec![diagnostic],
    };
    scenario::resolve(source, &library_for(path), Forms::Made).err().unwrap_or_default()
}

/// The tables that ship with the program, and the files beside a scenario.
pub fn library_for(scenario: &Path) -> Library {
    let folder = scenario.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Library::shipped().with_folder(folder)
}

/// A file itself; of a folder all scenarios in it, by name.
fn scenario_files(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let unreadable = |e| Failure::wrong(format!("{}: unreadable-folder: {e}", path.display()));
    let entries = std::fs::read_dir(path).map_err(unreadable)?;
    let is_scenario = |p: &PathBuf| {
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        name.ends_with(".json") && !name.ends_with(".schema.json")
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(is_scenario).collect();
    files.sort();
    match files.is_empty() {
        true => Err(Failure::wrong(format!("{}: no-scenarios: the folder holds no scenario (*.json)", path.display()))),
        false => Ok(files),
    }
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
