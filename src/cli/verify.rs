//! `typodont verify`: checks a bundle against its recording.

use super::{CliError, print_line};
use clap::Args;
use std::path::{Path, PathBuf};
use typodont_report::Templates;
use typodont_report::bundle::{self, BundleFolder, VerificationOutcome};

#[derive(Args)]
#[command(after_help = "\
Exit status: 0 everything was judged and follows from the recording; 1 something differs, or cannot be read; 3 what was \
judged follows, but not everything could be judged, such as a page made from templates that are not available here.")]
pub struct Arguments {
    /// Folder of the bundle, a ZIP file of it, or a recording alone
    bundle: PathBuf,
    /// Folder with the templates from which the bundle's page was made, besides reports/templates and the shipped ones
    #[arg(long, value_name = "DIR")]
    templates: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.bundle;
    let verification = match (path.is_file(), path.extension().is_some_and(|e| e.eq_ignore_ascii_case("zip"))) {
        (true, true) => bundle::verify(&read_zip(path)?, &known_templates(arguments)?),
        (true, false) => bundle::verify_recording(path),
        (false, _) => bundle::verify(&BundleFolder::on_disk(path), &known_templates(arguments)?),
    };
    let verification = verification.map_err(CliError::wrong)?;
    let shown = path.display();
    for line in verification.complaints.iter().chain(&verification.remarks) {
        eprintln!("{shown}: {line}");
    }
    match verification.outcome() {
        VerificationOutcome::Verified => print_line(format!("{shown}: verified")),
        VerificationOutcome::Differs => Err(CliError::AlreadyReported),
        VerificationOutcome::PartlyVerified => {
            let unjudged = verification.unverified.join("; ");
            print_line(format!("{shown}: holds, but this was not judged: {unjudged}"))?;
            Err(CliError::PartlyVerified)
        }
    }
}

/// Bundle in a ZIP file.
fn read_zip(path: &Path) -> Result<BundleFolder, CliError> {
    let bytes = typodont_formats::read_file(path).map_err(|d| CliError::wrong(d.headline()))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    BundleFolder::from_zip(&bytes, &stem)
        .map_err(|why| CliError::wrong(format!("{}: wrong-zip: {why}", path.display())))
}

/// Templates from which the page may have been made: those asked for, those of this place, and the shipped ones.
fn known_templates(arguments: &Arguments) -> Result<Vec<Templates>, CliError> {
    let mut known = Vec::new();
    if let Some(folder) = &arguments.templates {
        if !folder.is_dir() {
            return Err(CliError::misuse(format!("--templates: {} is not a folder", folder.display())));
        }
        known.push(Templates::in_folder(folder).map_err(CliError::Wrong)?);
    }
    known.extend([super::load_templates()?, Templates::shipped()]);
    Ok(known)
}
