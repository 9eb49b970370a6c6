//! `typodont manuals`: writes the manual pages and the completions of shells, for packages.
//!
//! Takes the command line as it is declared. Gives files named as systems look for them. Hidden, and only in builds with
//! the feature `manuals`: nobody else needs it.

use super::{CliError, write_file};
use clap::{Args, Command, CommandFactory, ValueEnum};
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// Folder in which the files are written
    folder: PathBuf,
}

/// The name under which the program is installed.
const PROGRAM: &str = "typodont";

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder)
        .map_err(|error| CliError::wrong(format!("{}: unwritable-folder: {error}", folder.display())))?;
    let mut command = super::Arguments::command();
    for shell in Shell::value_variants() {
        clap_complete::generate_to(*shell, &mut command, PROGRAM, folder)
            .map_err(|error| CliError::wrong(format!("{}: unwritable-file: {error}", folder.display())))?;
    }
    command.build();
    write_manual(&command, folder)
}

/// Writes the page of a command and those of its subcommands, named by all words of the command.
fn write_manual(command: &Command, folder: &std::path::Path) -> Result<(), CliError> {
    let name = command.get_display_name().unwrap_or(PROGRAM).to_string();
    let page = clap_mangen::Man::new(command.clone()).title(name.to_uppercase()).manual("Typodont");
    let mut text = Vec::new();
    page.render(&mut text).map_err(CliError::wrong)?;
    write_file(&folder.join(format!("{name}.1")), text)?;
    command
        .get_subcommands()
        .filter(|sub| !sub.is_hide_set() && sub.get_name() != "help")
        .try_for_each(|sub| write_manual(sub, folder))
}
