//! `typodont check`: prints all complaints about scenario files.

use super::{CliError, print_line, station};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_core::parallel::par_map;
use typodont_exercise::scenario::ResolveMode;
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_formats::diagnostic::{Diagnostic, SourceText};
use typodont_formats::json;
use typodont_lesson::{self as lesson, ExerciseWarning, LessonError, scenario_files};

#[derive(Args)]
pub struct Arguments {
    /// Scenario files, or folders that contain them; or the file of a station, which ends in .toml
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
    /// "error", or "warning" for an exercise that can be run but may not be fair.
    severity: &'a str,
    file: &'a str,
    line: Option<usize>,
    column: Option<usize>,
    code: &'a str,
    path: &'a str,
    message: &'a str,
    help: Option<&'a str>,
}

/// Number of files that are checked at the same time: each makes its teeth, some hundred megabytes.
const PARALLEL_FILES: usize = 4;

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let mut found = Vec::new();
    let mut warnings = Vec::new();
    let mut files = Vec::new();
    for path in &arguments.files {
        match scenario_files(path) {
            Ok(own) => files.extend(own),
            // The other files are checked all the same.
            Err(LessonError::NoScenarios(complaint)) => found.push(*complaint),
            Err(error) => return Err(error.into()),
        }
    }
    let check_file = |file: &PathBuf| {
        let is_station = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
        if is_station { station::check(file) } else { check(file) }
    };
    let results = files.chunks(PARALLEL_FILES).flat_map(|some| par_map(some.len(), |index| check_file(&some[index])));
    for result in results {
        match result {
            Ok(unfair) => warnings.extend(unfair),
            Err(complaints) => found.extend(complaints),
        }
    }
    if arguments.format == Format::Text {
        warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    }
    match arguments.format {
        Format::Text if found.is_empty() => {
            let result = match warnings.len() {
                0 => "no problems found".to_string(),
                1 => "no errors, 1 warning".to_string(),
                count => format!("no errors, {count} warnings"),
            };
            print_line(format!("{} files checked, {result}", files.len()))?;
        }
        Format::Text => return Err(CliError::Complaints(found)),
        Format::Json => print_line(to_json(&found, &warnings))?,
    }
    if found.is_empty() { Ok(()) } else { Err(CliError::AlreadyReported) }
}

/// The warnings about one scenario, or all complaints if it cannot be run.
fn check(path: &Path) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let scenario = Arc::new(lesson::read_scenario(path, ResolveMode::Check)?);
    let name = path.display().to_string();
    let about_file = |why: String| vec![Diagnostic::about_file(&name, "impossible-scene", why, None)];
    let warnings = lesson::exercise_warnings(&scenario).map_err(about_file)?;
    let read = json::read::<ScenarioFile>(SourceText::new(name, scenario.text.to_string()))?;
    let diagnostic = |w: ExerciseWarning| read.source_map.complain(&w.path, w.code, w.message, Some(w.help));
    Ok(warnings.into_iter().map(diagnostic).collect())
}

fn to_json(found: &[Diagnostic], warnings: &[Diagnostic]) -> String {
    let complaint = |(severity, d): (&'static str, &Diagnostic)| {
        let (line, column) = d.line_and_column().unzip();
        serde_json::to_value(ComplaintFile {
            severity,
            file: &d.source.name,
            line,
            column,
            code: d.code,
            path: &d.path,
            message: &d.message,
            help: d.help.as_deref(),
        })
    };
    let all = found.iter().map(|d| ("error", d)).chain(warnings.iter().map(|d| ("warning", d)));
    let all: Vec<_> = all.filter_map(|d| complaint(d).ok()).collect();
    serde_json::to_string_pretty(&all).unwrap_or_default()
}
