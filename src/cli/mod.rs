//! The command line.
//!
//! Takes arguments. Gives files, lines and an exit status: 0 done, 1 the input is wrong or the check fails, 2 misuse. Never
//! decides anything a library call could not.

mod anatomy;
mod assist;
mod bench;
mod check;
mod cohort;
mod demo;
mod devices;
mod finish;
mod gradebook;
mod import;
mod live;
mod parquet;
mod path;
mod preview;
mod review;
mod run;
mod school;
mod score;
mod trusted;
mod verify;
mod xapi;

use crate::app;
use crate::diagnostic::{Diagnostic, headlines};
use crate::lesson::Failed;
use clap::{Parser, Subcommand};
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The open haptic simulator and assessment platform for dental training.
#[derive(Parser)]
#[command(version, after_help = "Without a command the desktop program opens its window.")]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Run an exercise and write its bundle; prints the bundle's path last
    Run(run::Arguments),
    /// Run the five shipped exercises by a scripted operator, then report on them
    Demo(demo::Arguments),
    /// Check scenario files and folders: every complaint with file, line and column
    Check(check::Arguments),
    /// Print the JSON Schema of scenarios, for editors
    Schema,
    /// Draw what the trainee of an exercise will see, decay marked
    Preview(preview::Arguments),
    /// Take a path or forces out of a session, for an exercise that guides the hand
    Path(path::Arguments),
    /// List the devices that can be used
    Devices,
    /// Join another machine's session as the instructor's hand
    Assist(assist::Arguments),
    /// Turn a bundle's recording again and compare everything
    Verify(verify::Arguments),
    /// Make the bundle of a session that was cut off
    Finish(finish::Arguments),
    /// Score a bundle again from its recording alone
    Score(score::Arguments),
    /// Compare many bundles: a table, a page, maps of what was removed
    Cohort(cohort::Arguments),
    /// Examiners list, compare and override sessions in a browser
    Review(review::Arguments),
    /// Grades as a table that Moodle or Canvas imports
    Gradebook(gradebook::Arguments),
    /// Sessions as xAPI statements, spooled on disk and sent to a learning record store
    Xapi(xapi::Arguments),
    /// Sessions, measures and events as Parquet, for analysis
    Parquet(parquet::Arguments),
    /// Records of many stations in one database: tables, classes, who may come in, erasing
    School(school::Arguments),
    /// Send finished bundles to the school; what is there already stays as it is
    Sync(school::sync::Arguments),
    /// Ask workers to score the school's sessions
    Enqueue(school::enqueue::Arguments),
    /// Score what was enqueued, until ended
    Worker(school::worker::Arguments),
    /// Score many bundles again without a database, a share on each machine
    Rescore(school::rescore::Arguments),
    /// Grow permanent teeth: label maps, surfaces, a table of sizes
    Anatomy(anatomy::Arguments),
    /// Turn a scan into a labelled volume
    Import(import::Arguments),
    /// Measure the program's own speed and memory
    Bench(bench::Arguments),
}

/// Why a command failed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Complaints about what a person wrote.
    Complaints(Vec<Diagnostic>),
    /// Anything else that is wrong with the input, as lines.
    Wrong(String),
    /// The command itself is wrong.
    Misuse(String),
    /// It was said already; only the status is left.
    Told,
}

impl From<Vec<Diagnostic>> for Failure {
    fn from(found: Vec<Diagnostic>) -> Failure {
        Failure::Complaints(found)
    }
}

impl From<Diagnostic> for Failure {
    fn from(found: Diagnostic) -> Failure {
        Failure::Complaints(vec![found])
    }
}

impl From<Failed> for Failure {
    fn from(failed: Failed) -> Failure {
        match failed {
            Failed::UnknownDevice { .. } | Failed::SameDevice { .. } => Failure::misuse(failed),
            Failed::Unreadable(found) => found.into(),
            _ => Failure::wrong(failed),
        }
    }
}

impl Failure {
    fn misuse(what: impl fmt::Display) -> Failure {
        Failure::Misuse(what.to_string())
    }

    fn wrong(what: impl fmt::Display) -> Failure {
        Failure::Wrong(what.to_string())
    }

    /// What is wrong, a line for each complaint.
    fn lines(&self) -> String {
        match self {
            Failure::Complaints(found) => headlines(found),
            Failure::Wrong(what) | Failure::Misuse(what) => what.clone(),
            Failure::Told => String::new(),
        }
    }

    fn tell(&self) {
        match self {
            Failure::Complaints(found) => {
                for diagnostic in found {
                    eprint!("{diagnostic}");
                }
                if found.len() > 1 {
                    eprintln!("{} complaints", found.len());
                }
            }
            Failure::Wrong(what) | Failure::Misuse(what) => eprintln!("{what}"),
            Failure::Told => {}
        }
    }
}

/// Parses the arguments, carries out the command, and says what went wrong.
pub fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        None => templates().and_then(|templates| desktop(app::Options::at_shelf(at_home(), templates))),
        Some(Command::Run(arguments)) => run::run(&arguments),
        Some(Command::Demo(arguments)) => demo::run(&arguments),
        Some(Command::Check(arguments)) => check::run(&arguments),
        Some(Command::Schema) => say(crate::scenario::schema_text().trim_end()),
        Some(Command::Preview(arguments)) => preview::run(&arguments),
        Some(Command::Path(arguments)) => path::run(&arguments),
        Some(Command::Devices) => devices::run(),
        Some(Command::Assist(arguments)) => assist::run(&arguments),
        Some(Command::Verify(arguments)) => verify::run(&arguments),
        Some(Command::Finish(arguments)) => finish::run(&arguments),
        Some(Command::Score(arguments)) => score::run(&arguments),
        Some(Command::Cohort(arguments)) => cohort::run(&arguments),
        Some(Command::Review(arguments)) => review::run(&arguments),
        Some(Command::Gradebook(arguments)) => gradebook::run(&arguments),
        Some(Command::Xapi(arguments)) => xapi::run(&arguments),
        Some(Command::Parquet(arguments)) => parquet::run(&arguments),
        Some(Command::School(arguments)) => school::run(&arguments),
        Some(Command::Sync(arguments)) => school::sync::run(&arguments),
        Some(Command::Enqueue(arguments)) => school::enqueue::run(&arguments),
        Some(Command::Worker(arguments)) => school::worker::run(&arguments),
        Some(Command::Rescore(arguments)) => school::rescore::run(&arguments),
        Some(Command::Anatomy(arguments)) => anatomy::run(&arguments),
        Some(Command::Import(arguments)) => import::run(&arguments),
        Some(Command::Bench(arguments)) => bench::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.tell();
            ExitCode::from(if matches!(failure, Failure::Misuse(_)) { 2 } else { 1 })
        }
    }
}

/// Opens the desktop program's window.
fn desktop(options: app::Options) -> Result<(), Failure> {
    app::open(options).map_err(Failure::Wrong)
}

/// Where finished bundles go unless told otherwise.
const SESSIONS: &str = "reports/sessions";

/// Where they go when the program was opened by its icon, in whatever folder that is: here, if this folder has `reports`, else in
/// the person's own.
fn at_home() -> PathBuf {
    match directories::UserDirs::new() {
        Some(dirs) if !Path::new("reports").is_dir() => {
            dirs.document_dir().unwrap_or(dirs.home_dir()).join("Typodont").join("sessions")
        }
        _ => PathBuf::from(SESSIONS),
    }
}

/// Templates of the folder `reports/templates` here, if there is one; otherwise those that ship with the program.
fn templates() -> Result<crate::report::Templates, Failure> {
    crate::report::Templates::in_folder(Path::new("reports/templates")).map_err(Failure::Wrong)
}

/// Prints a line. Who listens no more, as `head` after its last line, has heard enough.
fn say(line: impl fmt::Display) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Wrong(format!("standard output: unwritable-file: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a file, or says why not.
fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|e| Failure::wrong(format!("{}: unwritable-file: {e}", path.display())))
}

/// The recording of a bundle, or a recording by itself.
fn recording_in(bundle: &Path) -> PathBuf {
    if bundle.is_dir() { bundle.join(crate::record::FILE_NAME) } else { bundle.to_path_buf() }
}
