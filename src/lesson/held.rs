//! What a lesson needs from outside: the device in the hand, and the files of an exercise.

use super::Failed;
use crate::content::{self, Library};
use crate::device::{Device, Driver};
use crate::diagnostic::Diagnostic;
use crate::scenario::{self, Forms, Scenario};
use std::path::{Path, PathBuf};

/// A device that a person holds, and how to find it again.
pub struct Held {
    /// As it was asked for.
    pub name: String,
    pub device: Box<dyn Device + Send>,
    pub driver: &'static dyn Driver,
    pub argument: Option<String>,
}

/// Opens the device that `NAME[:WHICH]` names.
pub fn open(asked: &str) -> Result<Held, Failed> {
    let (name, argument) = match asked.split_once(':') {
        Some((name, argument)) => (name, Some(argument.to_string())),
        None => (asked, None),
    };
    let Some(driver) = crate::device::driver(name) else {
        let known = crate::device::DRIVERS.iter().map(|d| d.name()).collect::<Vec<_>>().join(", ");
        return Err(Failed::UnknownDevice { name: name.to_string(), known });
    };
    let opened = driver.open(argument.as_deref());
    let device = opened.map_err(|trouble| Failed::NoDevice { name: name.to_string(), why: trouble.to_string() })?;
    Ok(Held { name: asked.to_string(), device, driver, argument })
}

/// Reads an exercise, or says everything that is wrong with it.
pub fn read(path: &Path, forms: Forms) -> Result<Scenario, Vec<Diagnostic>> {
    scenario::resolve(content::read_text(path).map_err(|d| vec![d])?, &library_for(path), forms)
}

/// The tables that ship with the program, and the files beside a scenario.
pub fn library_for(scenario: &Path) -> Library {
    let folder = scenario.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Library::shipped().with_folder(folder)
}

/// A file itself; of a folder all scenarios in it, by name.
pub fn scenario_files(path: &Path) -> Result<Vec<PathBuf>, Failed> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let wrong = |why: String| Failed::NoScenarios { folder: path.to_path_buf(), why };
    let entries = std::fs::read_dir(path).map_err(|e| wrong(format!("unreadable-folder: {e}")))?;
    let is_scenario = |p: &PathBuf| {
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        name.ends_with(".json") && !name.ends_with(".schema.json")
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(is_scenario).collect();
    files.sort();
    match files.is_empty() {
        true => Err(wrong("no-scenarios: the folder holds no scenario (*.json)".to_string())),
        false => Ok(files),
    }
}

/// True for a trainee's code: up to 64 letters, digits, "-", "_" and "."; never a name. None at all is one, too.
pub fn is_code(text: &str) -> bool {
    text.len() <= 64 && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
}

/// A seed from the moment a lesson begins. Whole numbers up to 2⁵³ survive every JSON reader.
pub fn seed_from(started: jiff::Timestamp) -> u64 {
    (started.as_nanosecond() as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11
}
