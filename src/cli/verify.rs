//! `typodont verify`: does the bundle hold?

use super::{Failure, say};
use crate::report::bundle::{self, Judgement};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The bundle's folder, or a recording alone
    bundle: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.bundle;
    let judgement = match path.is_file() {
        true => bundle::verify_recording(path),
        false => bundle::verify(path, &super::templates()?),
    };
    let Judgement { complaints, unjudged } = judgement.map_err(Failure::wrong)?;
    for complaint in &complaints {
        eprintln!("{}: {complaint}", path.display());
    }
    match (complaints.is_empty(), unjudged.is_empty()) {
        (false, _) => Err(Failure::Told),
        (true, true) => say(format!("{}: holds", path.display())),
        (true, false) => say(format!("{}: holds, but not judged: {}", path.display(), unjudged.join("; "))),
    }
}
