//! `typodont preview`: what the trainee will see.

use super::{Failure, check};
use crate::content;
use crate::report::preview_png;
use crate::scenario::{self, Forms, Workpiece};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The exercise
    scenario: PathBuf,
    /// The picture
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,
    /// Decides what the exercise leaves to chance
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Failure::misuse(format!("{}: the picture is a .png file", arguments.output.display())));
    }
    let source = content::read_text(&arguments.scenario)?;
    let scenario = scenario::resolve(source, &check::library_for(&arguments.scenario), Forms::Made)?;
    let workpiece = Workpiece::make(&scenario, arguments.seed).map_err(Failure::wrong)?;
    super::write(&arguments.output, preview_png(&scenario, &workpiece))
}
