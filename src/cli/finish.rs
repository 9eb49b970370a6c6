//! `typodont finish`: completes the bundle of an interrupted session.

use super::run::read_code;
use super::{CliError, print_line};
use clap::Args;
use std::path::PathBuf;
use typodont_report::bundle::PartialBundle;

#[derive(Args)]
pub struct Arguments {
    /// Folder of the interrupted session, whose name ends in .partial
    partial: PathBuf,
    /// File with the examiner's code of a sealed session that was cut off; "-" reads it from the standard input
    #[arg(long, value_name = "FILE")]
    seed_sealed: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let templates = super::load_templates()?;
    let unfinished = PartialBundle::resume(&arguments.partial).map_err(CliError::wrong)?;
    if let Some(code) = read_code(arguments.seed_sealed.as_deref())? {
        unfinished.reveal_seed(&code).map_err(CliError::wrong)?;
    }
    let completed = unfinished.complete_interrupted(&templates, &mut |_| ()).map_err(CliError::wrong)?;
    for remark in completed.remarks {
        eprintln!("{}: {remark}", completed.folder.path().display());
    }
    print_line(completed.folder.path().display())
}
