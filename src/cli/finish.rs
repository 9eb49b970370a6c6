//! `typodont finish`: what can be had of a session that was cut off.

use super::{Failure, say};
use crate::report::bundle::Unfinished;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The folder it left, whose name ends in .partial
    partial: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let templates = super::templates()?;
    let unfinished = Unfinished::resume(&arguments.partial).map_err(Failure::wrong)?;
    say(unfinished.complete(&templates).map_err(Failure::wrong)?.display())
}
