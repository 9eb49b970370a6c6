//! Checks of what the window needs: display, graphics, sound, settings.

use super::finding::{Finding, FindingStatus};
use super::remedies::StationFault;
use typodont_app::readiness;
use typodont_app::readiness::SettingsReview;
use typodont_render::Gpu;

pub fn findings(settings: &SettingsReview) -> Vec<Finding> {
    let mut findings = vec![display(), graphics(), sound()];
    findings.extend(settings_findings(settings));
    findings
}

fn display() -> Finding {
    match readiness::connect_to_display() {
        Ok(()) => Finding::ok("display", "a window can be opened"),
        Err(why) => Finding::fault("display", FindingStatus::Missing, why, StationFault::NoDisplay),
    }
}

fn graphics() -> Finding {
    match Gpu::open() {
        Ok(gpu) if gpu.is_software => Finding::fault(
            "graphics",
            FindingStatus::Warning,
            format!("{}: the processor draws, so pictures are slow", gpu.name),
            StationFault::SoftwareGraphics,
        ),
        Ok(gpu) => Finding::ok("graphics", gpu.name),
        Err(error) => Finding::fault("graphics", FindingStatus::Missing, error, StationFault::NoGraphics),
    }
}

#[cfg(feature = "audio")]
fn sound() -> Finding {
    match readiness::sound_output() {
        Ok(place) => Finding::ok("sound", place),
        Err(why) => Finding::fault("sound", FindingStatus::Warning, why, StationFault::NoSound),
    }
}

#[cfg(not(feature = "audio"))]
fn sound() -> Finding {
    Finding::not_included("sound", "sound", "audio")
}

fn settings_findings(settings: &SettingsReview) -> Vec<Finding> {
    let fault = |what: &str, fault| Finding::fault("settings", FindingStatus::Warning, what, fault);
    let mut findings: Vec<Finding> =
        settings.complaints.iter().map(|what| fault(what, StationFault::WrongSettings)).collect();
    if !settings.exercises.as_os_str().is_empty() && !settings.exercises.is_dir() {
        let what = format!("{}: the folder of the school's exercises cannot be read", settings.exercises.display());
        findings.push(fault(&what, StationFault::NoExercises));
    }
    if findings.is_empty() {
        let file = match &settings.file {
            Some(file) if file.exists() => file.display().to_string(),
            _ => "the defaults".to_string(),
        };
        findings.push(Finding::ok("settings", format!("{file}; language {}", settings.language)));
    }
    findings
}
