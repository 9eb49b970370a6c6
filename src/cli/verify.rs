//! `typodont verify`: does the bundle hold?

use super::Failure;
use crate::report::bundle;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The bundle's folder, or a recording alone
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.bundle;
    let complaints = match path.is_file() {
        true => bundle::verify_recording(path),
        false => bundle::verify(path, &super::templates()),
    };
    let complaints = complaints.map_err(Failure::wrong)?;
    match complaints.is_empty() {
        true => {
            println!("{}: holds", arguments.bundle.display());
            Ok(())
        }
        false => {
            for complaint in &complaints {
                eprintln!("{}: {complaint}", arguments.bundle.display());
            }
            Err(Failure::Told)
        }
    }
}
