//! `typodont verify`: does the bundle hold?

use super::Failure;
use crate::report::bundle;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The bundle's folder
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let complaints = bundle::verify(&arguments.bundle, &super::templates()).map_err(Failure::wrong)?;
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
