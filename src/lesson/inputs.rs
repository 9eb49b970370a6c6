//! Files of an exercise, and the codes and seeds of a session.

use super::LessonError;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;

/// Reads an exercise.
///
/// # Errors
///
/// All faults found in the file.
pub fn read_scenario(path: &Path, forms: ResolveMode) -> Result<Scenario, Vec<Diagnostic>> {
    scenario::resolve(typodont_formats::read_text(path).map_err(|d| vec![d])?, &library_for(path), forms)
}

/// The tables that ship with the program, and the files beside a scenario.
pub fn library_for(scenario: &Path) -> Library {
    let folder = scenario.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Library::shipped().with_folder(folder)
}

/// All scenario files of a folder, sorted by name, with numbers by their value; for the path of a file, that file.
///
/// # Errors
///
/// When the folder cannot be read or contains no scenario.
pub fn scenario_files(path: &Path) -> Result<Vec<PathBuf>, LessonError> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let wrong = |code, why: String| {
        LessonError::NoScenarios(Box::new(Diagnostic::about_file(&path.display().to_string(), code, why, None)))
    };
    let entries = std::fs::read_dir(path).map_err(|error| wrong("unreadable-folder", error.to_string()))?;
    let is_scenario = |p: &PathBuf| {
        // Also of a name that is not UTF-8: a file that is passed over counts as a file without faults.
        let name = p.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        name.ends_with(".json") && !name.ends_with(".schema.json")
    };
    // With one kind of separator, also on Windows.
    let paths = entries.filter_map(|e| Some(e.ok()?.path().components().collect()));
    let mut files: Vec<PathBuf> = paths.filter(is_scenario).collect();
    files.sort_by_cached_key(|path| natural_key(path));
    match files.is_empty() {
        true => Err(wrong("no-scenarios", "the folder contains no scenario (*.json)".into())),
        false => Ok(files),
    }
}

/// Key by which names sort as people expect: "2-decay" before "10-class-one".
fn natural_key(path: &Path) -> Vec<(u64, String)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut key: Vec<(u64, String)> = Vec::new();
    for c in name.chars() {
        match (c.to_digit(10), key.last_mut()) {
            (Some(digit), Some((number, text))) if text.is_empty() => {
                *number = number.saturating_mul(10).saturating_add(u64::from(digit));
            }
            (Some(digit), _) => key.push((u64::from(digit), String::new())),
            (None, Some((_, text))) => text.push(c),
            // Names that begin with a letter follow those that begin with a number.
            (None, None) => key.push((u64::MAX, c.to_string())),
        }
    }
    key
}

/// True for a valid participant code: at most 64 ASCII letters, digits, "-", "_" and ".". The empty code is valid, too.
pub fn is_valid_participant_code(text: &str) -> bool {
    text.len() <= 64 && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exercises_sort_by_the_value_of_their_numbers() {
        let sorted =
            ["1-introduction.json", "2-decay.json", "9-stain.json", "10-class-one.json", "a1.json", "a12.json"];
        let mut names: Vec<PathBuf> = sorted.iter().rev().map(PathBuf::from).collect();
        names.sort_by_cached_key(|path| natural_key(path));
        assert_eq!(names, sorted.map(PathBuf::from));
    }
}
