//! `typodont doctor`: looks at what a session needs of this machine, and says what is missing with its remedy.
//!
//! Asks the real thing wherever that is possible: it opens the display, the graphics adapter, the sound output and the
//! device, takes real-time priority, and writes and deletes a file where sessions are stored. Changes nothing.

#[cfg(feature = "devices")]
mod device_checks;
mod finding;
mod machine_checks;
mod remedies;
mod session_folder;
mod station_checks;
#[cfg(feature = "desktop")]
mod window_checks;

use super::station::Station;
use super::{CliError, print_line};
use clap::Args;
use finding::{Finding, FindingStatus};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// Device that the machine uses, as in `typodont run`; without it that of the station or of the settings
    #[arg(long, value_name = "NAME[:WHICH]")]
    device: Option<String>,
    /// Folder in which sessions are stored; without it that of the station or of the window
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// File of the station; without it the system's, then the user's, if there is one
    #[arg(long, value_name = "FILE")]
    station: Option<PathBuf>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Result of all checks, as `--json` prints it.
#[derive(Serialize)]
struct DoctorReport {
    /// Version of this format.
    version: u32,
    typodont_version: &'static str,
    /// Operating system and processor.
    system: String,
    /// The most serious of the findings.
    status: FindingStatus,
    checks: Vec<Finding>,
}

const VERSION: u32 = 1;

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let checks = findings(arguments)?;
    let status = checks.iter().map(|finding| finding.status).max().unwrap_or(FindingStatus::Ok);
    let report = DoctorReport {
        version: VERSION,
        typodont_version: env!("CARGO_PKG_VERSION"),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        // A part that was not built is no defect of the station.
        status: if status == FindingStatus::NotIncluded { FindingStatus::Ok } else { status },
        checks,
    };
    match arguments.json {
        true => print_line(serde_json::to_string_pretty(&report).map_err(CliError::wrong)?)?,
        false => print_text(&report)?,
    }
    match report.status {
        FindingStatus::Missing => Err(CliError::AlreadyReported),
        _ => Ok(()),
    }
}

/// Findings of all checks, in the order in which a session meets their subjects.
fn findings(arguments: &Arguments) -> Result<Vec<Finding>, CliError> {
    let (station, mut findings) = station_checks::findings(arguments.station.as_deref());
    #[cfg(feature = "desktop")]
    let settings = typodont_app::readiness::review_settings();
    #[cfg(feature = "desktop")]
    let device_of_settings = settings.device.as_str();
    #[cfg(all(feature = "devices", not(feature = "desktop")))]
    let device_of_settings = "mouse";
    #[cfg(feature = "devices")]
    let device_of_station = station.as_ref().and_then(|station| station.device.as_deref());
    #[cfg(feature = "devices")]
    let chosen = arguments.device.as_deref().or(device_of_station).unwrap_or(device_of_settings);
    #[cfg(feature = "devices")]
    let device = device_checks::choose(chosen)?;
    #[cfg(feature = "desktop")]
    findings.extend(window_checks::findings(&settings));
    #[cfg(not(feature = "desktop"))]
    findings.push(Finding::not_included("window", "the window", "desktop"));
    #[cfg(feature = "devices")]
    findings.extend(device_checks::findings(&device));
    #[cfg(not(feature = "devices"))]
    findings.push(Finding::not_included("device", "devices", "devices"));
    findings.push(machine_checks::processors());
    let own_folder = || station.as_ref().map_or_else(super::default_output_folder, Station::session_folder);
    let folder = arguments.out.clone().unwrap_or_else(own_folder);
    findings.push(machine_checks::clock(&folder));
    findings.extend(session_folder::findings(&folder));
    Ok(findings)
}

fn print_text(report: &DoctorReport) -> Result<(), CliError> {
    let width = report.checks.iter().map(|finding| finding.check.len()).max().unwrap_or_default();
    for Finding { check, status, message, remedy } in &report.checks {
        print_line(format!("{:12}  {check:width$}  {message}", status.word()))?;
        if let Some(remedy) = remedy {
            print_line(format!("    help: {remedy}"))?;
        }
    }
    let count = |wanted| report.checks.iter().filter(|finding| finding.status == wanted).count();
    let (missing, warnings) = (count(FindingStatus::Missing), count(FindingStatus::Warning));
    let plural = |count, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
    let warned = plural(warnings, "warning", "warnings");
    print_line(match missing {
        0 => format!("This machine has everything that a session needs; {warned}"),
        _ => format!("A session cannot be held on this machine: {}, {warned}", plural(missing, "defect", "defects")),
    })
}
