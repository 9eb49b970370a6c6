//! `typodont verify`: checks a bundle against its recording.

use super::{CliError, print_line};
use clap::Args;
use std::path::PathBuf;
use typodont_report::bundle;
use typodont_report::bundle::Verification;

#[derive(Args)]
pub struct Arguments {
    /// Folder of the bundle, or a recording alone
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.bundle;
    let verification = match path.is_file() {
        true => bundle::verify_recording(path),
        false => bundle::verify(path, &super::load_templates()?),
    };
    let Verification { complaints, unverified: unjudged } = verification.map_err(CliError::wrong)?;
    for complaint in &complaints {
        eprintln!("{}: {complaint}", path.display());
    }
    match (complaints.is_empty(), unjudged.is_empty()) {
        (false, _) => Err(CliError::AlreadyReported),
        (true, true) => print_line(format!("{}: verified", path.display())),
        (true, false) => print_line(format!("{}: verified, except: {}", path.display(), unjudged.join("; "))),
    }
}
