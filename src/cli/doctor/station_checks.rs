//! Checks of the station's file: its faults, and whether its exercises are up to date.

use super::super::CliError;
use super::super::station::{self, Station};
use super::finding::{Finding, FindingStatus};
use super::remedies::StationFault;
use std::path::Path;

const CHECK: &str = "station";

/// The station of this machine, and the findings about its file. Nothing for the machine of a single person.
pub fn findings(named: Option<&Path>) -> (Option<Station>, Vec<Finding>) {
    let wrong = |what: String| Finding::fault(CHECK, FindingStatus::Missing, what, StationFault::WrongStation);
    let (station, warnings) = match station::find_with_warnings(named) {
        Ok(Some(found)) => found,
        Ok(None) => return (None, Vec::new()),
        Err(CliError::Complaints(found)) => {
            return (None, found.iter().map(|complaint| wrong(complaint.headline())).collect());
        }
        Err(error) => return (None, vec![wrong(error.message())]),
    };
    let mode = if station.kiosk.is_some() { "a kiosk" } else { "a free station" };
    let seat = station.seat.as_ref().map_or(String::new(), |seat| format!(", seat {seat}"));
    let mut findings = vec![Finding::ok(CHECK, format!("{}: {mode}{seat}", station.file.display()))];
    findings.extend(warnings.iter().map(|warning| {
        let remedy = warning.help.as_deref().unwrap_or_default();
        Finding::with_remedy(CHECK, FindingStatus::Warning, warning.headline(), remedy)
    }));
    findings.extend(exercises(&station));
    (Some(station), findings)
}

/// The copy of the school's exercises, compared with its source. Nothing is copied.
fn exercises(station: &Station) -> Option<Finding> {
    let check = "exercises";
    let old = |what| Finding::fault(check, FindingStatus::Warning, what, StationFault::OldExercises);
    Some(match station.compare_exercises()? {
        Ok(changes) if changes.count() == 0 => Finding::ok(check, "the copy of the school's exercises is up to date"),
        Ok(changes) => old(format!("{} files of the school's exercises differ from the copy", changes.count())),
        Err(why) => old(format!("the school's exercises cannot be compared with the copy: {why}")),
    })
}
