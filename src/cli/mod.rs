//! The command line.
//!
//! Takes arguments. Gives files, lines and an exit status: 0 success, 1 the input is wrong or a check fails, 2 wrong
//! usage, 3 a bundle holds but could not be judged completely. Contains no logic that is not available as a library call.

mod anatomy;
#[cfg(feature = "devices")]
mod assist;
#[cfg(feature = "devices")]
mod link_key;
mod bench;
mod check;
mod cohort;
mod demo;
#[cfg(feature = "devices")]
mod devices;
mod doctor;
mod finish;
#[cfg(not(feature = "school"))]
mod folder_source;
#[cfg(feature = "integrations")]
mod gradebook;
#[cfg(any(feature = "review", feature = "school"))]
mod http_server;
mod import;
#[cfg(feature = "manuals")]
mod manuals;
#[cfg(feature = "devices")]
mod live;
#[cfg(feature = "integrations")]
mod parquet;
#[cfg(not(all(
    feature = "desktop",
    feature = "devices",
    feature = "integrations",
    feature = "review",
    feature = "school"
)))]
mod missing_part;
#[cfg(feature = "integrations")]
mod package;
mod path;
mod preview;
mod progress;
#[cfg(feature = "review")]
mod review;
mod run;
mod secret_file;
#[cfg(feature = "school")]
mod school;
mod score;
mod station;
mod verification;
mod verify;
#[cfg(feature = "integrations")]
mod xapi;

use clap::{Parser, Subcommand};
#[cfg(not(feature = "school"))]
pub(crate) use folder_source::FolderSource as SessionSource;
#[cfg(not(all(feature = "devices", feature = "integrations", feature = "review", feature = "school")))]
use missing_part::IgnoredArguments;
#[cfg(feature = "school")]
pub(crate) use school::SessionSource;
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
#[cfg(feature = "desktop")]
use typodont_app as app;
use typodont_formats::diagnostic::{Diagnostic, headlines};
use typodont_lesson::LessonError;

/// The open haptic simulator and assessment platform for dental training.
#[derive(Parser)]
#[command(version, after_help = "Without a command, the desktop program opens.")]
struct Arguments {
    /// File of the station with which the window opens; without it the system's, then the user's, if there is one
    #[arg(long, value_name = "FILE")]
    station: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<CliCommand>,
}

#[derive(Subcommand)]
enum CliCommand {
    /// Run an exercise and write its bundle; prints the bundle's path last
    Run(run::Arguments),
    /// Run the five shipped exercises with a scripted operator and write their reports
    Demo(demo::Arguments),
    /// Check scenario files and folders, and the file of a station, and list every problem with its file, line and column
    Check(check::Arguments),
    /// Print the JSON Schema of scenarios, for editors
    Schema,
    /// Render what the trainee will see, with the decay marked
    Preview(preview::Arguments),
    /// Export the path or the forces of a session, for an exercise with haptic guidance
    Path(path::Arguments),
    /// List the devices that are connected and the drivers that can be used
    #[cfg(feature = "devices")]
    Devices,
    #[cfg(not(feature = "devices"))]
    #[command(hide = true, disable_help_flag = true)]
    Devices(IgnoredArguments),
    /// Look at what a session needs of this machine, and say what is missing and what to do about it
    Doctor(doctor::Arguments),
    /// Look after a station of a school: its exercises, its sessions, the code of its supervisor
    Station(station::Arguments),
    /// Join a session on another computer as the instructor, with a second device
    #[cfg(feature = "devices")]
    Assist(assist::Arguments),
    #[cfg(not(feature = "devices"))]
    #[command(hide = true, disable_help_flag = true)]
    Assist(IgnoredArguments),
    /// Replay a bundle's recording and compare every result with it
    Verify(verify::Arguments),
    /// Complete the bundle of a session that was interrupted
    Finish(finish::Arguments),
    /// Score a bundle again, from its recording alone
    Score(score::Arguments),
    /// Compare many bundles: a table, a page, and maps of the tissue removed
    Cohort(cohort::Arguments),
    /// Serve the pages on which examiners list and compare sessions and override grades
    #[cfg(feature = "review")]
    Review(review::Arguments),
    #[cfg(not(feature = "review"))]
    #[command(hide = true, disable_help_flag = true)]
    Review(IgnoredArguments),
    /// Export grades as a table that Moodle or Canvas imports
    #[cfg(feature = "integrations")]
    Gradebook(gradebook::Arguments),
    #[cfg(not(feature = "integrations"))]
    #[command(hide = true, disable_help_flag = true)]
    Gradebook(IgnoredArguments),
    /// Export sessions as xAPI statements, spool them on disk and send them to a learning record store
    #[cfg(feature = "integrations")]
    Xapi(xapi::Arguments),
    #[cfg(not(feature = "integrations"))]
    #[command(hide = true, disable_help_flag = true)]
    Xapi(IgnoredArguments),
    /// Put exercises and the web page into one archive that a learning platform plays and marks
    #[cfg(feature = "integrations")]
    Package(package::Arguments),
    #[cfg(not(feature = "integrations"))]
    #[command(hide = true, disable_help_flag = true)]
    Package(IgnoredArguments),
    /// Export sessions, measures and events as Parquet files for analysis
    #[cfg(feature = "integrations")]
    Parquet(parquet::Arguments),
    #[cfg(not(feature = "integrations"))]
    #[command(hide = true, disable_help_flag = true)]
    Parquet(IgnoredArguments),
    /// Administer the database for the records of many stations: tables, classes, access, erasure
    #[cfg(feature = "school")]
    School(school::Arguments),
    #[cfg(not(feature = "school"))]
    #[command(hide = true, disable_help_flag = true)]
    School(IgnoredArguments),
    /// Send finished bundles to the school's database and store; sessions already stored are not changed
    #[cfg(feature = "school")]
    Sync(school::sync::Arguments),
    #[cfg(not(feature = "school"))]
    #[command(hide = true, disable_help_flag = true)]
    Sync(IgnoredArguments),
    /// Queue the school's sessions for scoring by workers
    #[cfg(feature = "school")]
    Enqueue(school::enqueue::Arguments),
    #[cfg(not(feature = "school"))]
    #[command(hide = true, disable_help_flag = true)]
    Enqueue(IgnoredArguments),
    /// Score queued sessions until the program is stopped
    #[cfg(feature = "school")]
    Worker(school::worker::Arguments),
    #[cfg(not(feature = "school"))]
    #[command(hide = true, disable_help_flag = true)]
    Worker(IgnoredArguments),
    /// Score many bundles again without a database, divided among computers
    #[cfg(feature = "school")]
    Rescore(school::rescore::Arguments),
    #[cfg(not(feature = "school"))]
    #[command(hide = true, disable_help_flag = true)]
    Rescore(IgnoredArguments),
    /// Generate permanent teeth: label maps, surfaces and a table of sizes
    Anatomy(anatomy::Arguments),
    /// Convert a scan into a labelled volume
    Import(import::Arguments),
    /// Measure the program's own speed and memory
    Bench(bench::Arguments),
    /// Write the manual pages and the completions of shells, for packages
    #[cfg(feature = "manuals")]
    #[command(hide = true)]
    Manuals(manuals::Arguments),
}

/// Error of a command.
#[derive(Debug)]
pub(crate) enum CliError {
    /// Complaints about files that people wrote.
    Complaints(Vec<Diagnostic>),
    /// Any other problem with the input, as lines of text.
    Wrong(String),
    /// The command line is wrong.
    Misuse(String),
    /// The error was already printed; only the exit status remains.
    AlreadyReported,
    /// A bundle holds, but not everything could be judged; this was already printed.
    PartlyVerified,
}

impl From<Vec<Diagnostic>> for CliError {
    fn from(found: Vec<Diagnostic>) -> CliError {
        CliError::Complaints(found)
    }
}

impl From<Diagnostic> for CliError {
    fn from(found: Diagnostic) -> CliError {
        CliError::Complaints(vec![found])
    }
}

impl From<LessonError> for CliError {
    fn from(failed: LessonError) -> CliError {
        match failed {
            LessonError::UnknownDevice { .. } | LessonError::SameDevice { .. } => CliError::misuse(failed),
            LessonError::Unreadable(found) => found.into(),
            _ => CliError::wrong(failed),
        }
    }
}

impl CliError {
    fn misuse(what: impl fmt::Display) -> CliError {
        CliError::Misuse(what.to_string())
    }

    fn wrong(what: impl fmt::Display) -> CliError {
        CliError::Wrong(what.to_string())
    }

    /// Text of the error, a line for each complaint.
    fn message(&self) -> String {
        match self {
            CliError::Complaints(found) => headlines(found),
            CliError::Wrong(what) | CliError::Misuse(what) => what.clone(),
            CliError::AlreadyReported | CliError::PartlyVerified => String::new(),
        }
    }

    fn exit_status(&self) -> u8 {
        match self {
            CliError::Complaints(_) | CliError::Wrong(_) | CliError::AlreadyReported => 1,
            CliError::Misuse(_) => 2,
            CliError::PartlyVerified => 3,
        }
    }

    fn report(&self) {
        match self {
            CliError::Complaints(found) => {
                for diagnostic in found {
                    eprint!("{diagnostic}");
                }
                if found.len() > 1 {
                    eprintln!("{} problems", found.len());
                }
            }
            CliError::Wrong(what) | CliError::Misuse(what) => eprintln!("{what}"),
            CliError::AlreadyReported | CliError::PartlyVerified => {}
        }
    }
}

/// Parses the arguments, carries out the command, and prints its error.
pub fn main() -> ExitCode {
    survive_file_size_limit();
    let Arguments { station, command } = Arguments::parse();
    match execute(station.as_deref(), command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            ExitCode::from(failure.exit_status())
        }
    }
}

/// Has a write beyond the size limit for files (`ulimit -f`) fail with an error; by default the system ends the program
/// without a word.
fn survive_file_size_limit() {
    #[cfg(unix)]
    {
        // The flag is never read: what matters is that the signal is caught. If it cannot be, nothing is lost but words.
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
    }
}

/// Carries out a command; without one, opens the window.
fn execute(station: Option<&Path>, command: Option<CliCommand>) -> Result<(), CliError> {
    if let (Some(_), Some(_)) = (station, &command) {
        return Err(CliError::misuse(
            "--station without a command opens the window; with a command, write it after the command's name",
        ));
    }
    match command {
        #[cfg(feature = "desktop")]
        None => open_at_exercise_list(station),
        #[cfg(not(feature = "desktop"))]
        None => Err(missing_part::error("the window", "desktop")),
        Some(CliCommand::Run(arguments)) => run::run(&arguments),
        Some(CliCommand::Demo(arguments)) => demo::run(&arguments),
        Some(CliCommand::Check(arguments)) => check::run(&arguments),
        Some(CliCommand::Schema) => print_line(typodont_exercise::scenario::schema_text().trim_end()),
        Some(CliCommand::Preview(arguments)) => preview::run(&arguments),
        Some(CliCommand::Path(arguments)) => path::run(&arguments),
        #[cfg(feature = "devices")]
        Some(CliCommand::Devices) => devices::run(),
        #[cfg(not(feature = "devices"))]
        Some(CliCommand::Devices(_)) => Err(missing_part::error("typodont devices", "devices")),
        Some(CliCommand::Doctor(arguments)) => doctor::run(&arguments),
        Some(CliCommand::Station(arguments)) => station::run(&arguments),
        #[cfg(feature = "devices")]
        Some(CliCommand::Assist(arguments)) => assist::run(&arguments),
        #[cfg(not(feature = "devices"))]
        Some(CliCommand::Assist(_)) => Err(missing_part::error("typodont assist", "devices")),
        Some(CliCommand::Verify(arguments)) => verify::run(&arguments),
        Some(CliCommand::Finish(arguments)) => finish::run(&arguments),
        Some(CliCommand::Score(arguments)) => score::run(&arguments),
        Some(CliCommand::Cohort(arguments)) => cohort::run(&arguments),
        #[cfg(feature = "review")]
        Some(CliCommand::Review(arguments)) => review::run(&arguments),
        #[cfg(not(feature = "review"))]
        Some(CliCommand::Review(_)) => Err(missing_part::error("typodont review", "review")),
        #[cfg(feature = "integrations")]
        Some(CliCommand::Gradebook(arguments)) => gradebook::run(&arguments),
        #[cfg(not(feature = "integrations"))]
        Some(CliCommand::Gradebook(_)) => Err(missing_part::error("typodont gradebook", "integrations")),
        #[cfg(feature = "integrations")]
        Some(CliCommand::Xapi(arguments)) => xapi::run(&arguments),
        #[cfg(not(feature = "integrations"))]
        Some(CliCommand::Xapi(_)) => Err(missing_part::error("typodont xapi", "integrations")),
        #[cfg(feature = "integrations")]
        Some(CliCommand::Package(arguments)) => package::run(&arguments),
        #[cfg(not(feature = "integrations"))]
        Some(CliCommand::Package(_)) => Err(missing_part::error("typodont package", "integrations")),
        #[cfg(feature = "integrations")]
        Some(CliCommand::Parquet(arguments)) => parquet::run(&arguments),
        #[cfg(not(feature = "integrations"))]
        Some(CliCommand::Parquet(_)) => Err(missing_part::error("typodont parquet", "integrations")),
        #[cfg(feature = "school")]
        Some(CliCommand::School(arguments)) => school::run(&arguments),
        #[cfg(not(feature = "school"))]
        Some(CliCommand::School(_)) => Err(missing_part::error("typodont school", "school")),
        #[cfg(feature = "school")]
        Some(CliCommand::Sync(arguments)) => school::sync::run(arguments),
        #[cfg(not(feature = "school"))]
        Some(CliCommand::Sync(_)) => Err(missing_part::error("typodont sync", "school")),
        #[cfg(feature = "school")]
        Some(CliCommand::Enqueue(arguments)) => school::enqueue::run(&arguments),
        #[cfg(not(feature = "school"))]
        Some(CliCommand::Enqueue(_)) => Err(missing_part::error("typodont enqueue", "school")),
        #[cfg(feature = "school")]
        Some(CliCommand::Worker(arguments)) => school::worker::run(&arguments),
        #[cfg(not(feature = "school"))]
        Some(CliCommand::Worker(_)) => Err(missing_part::error("typodont worker", "school")),
        #[cfg(feature = "school")]
        Some(CliCommand::Rescore(arguments)) => school::rescore::run(&arguments),
        #[cfg(not(feature = "school"))]
        Some(CliCommand::Rescore(_)) => Err(missing_part::error("typodont rescore", "school")),
        Some(CliCommand::Anatomy(arguments)) => anatomy::run(&arguments),
        Some(CliCommand::Import(arguments)) => import::run(&arguments),
        Some(CliCommand::Bench(arguments)) => bench::run(&arguments),
        #[cfg(feature = "manuals")]
        Some(CliCommand::Manuals(arguments)) => manuals::run(&arguments),
    }
}

/// Opens the window at the list of exercises: that of the station, if this machine has one.
#[cfg(feature = "desktop")]
fn open_at_exercise_list(station: Option<&Path>) -> Result<(), CliError> {
    let templates = load_templates()?;
    match station::find(station)? {
        Some(station) => {
            let options = app::AppOptions::at_exercise_list(station.session_folder(), templates);
            station::open_window(station, options)
        }
        None => open_window(app::AppOptions::at_exercise_list(default_output_folder(), templates)),
    }
}

/// Opens the window of the desktop application.
#[cfg(feature = "desktop")]
fn open_window(options: app::AppOptions) -> Result<(), CliError> {
    app::open_window(options).map_err(CliError::Wrong)
}

/// Default folder of finished bundles.
const SESSIONS: &str = "reports/sessions";

/// Folder of finished bundles if the program is started by its icon, in an arbitrary working folder: [`SESSIONS`] if
/// sessions are kept there, else a folder in the user's documents.
#[cfg(feature = "desktop")]
fn default_output_folder() -> PathBuf {
    let kept_here = match (std::env::current_dir(), std::env::current_exe()) {
        (Ok(working), Ok(program)) => keeps_sessions(&working, &program),
        _ => true,
    };
    match directories::UserDirs::new() {
        Some(dirs) if !kept_here => dirs.document_dir().unwrap_or(dirs.home_dir()).join("Typodont").join("sessions"),
        _ => PathBuf::from(SESSIONS),
    }
}

/// True if sessions are kept in the working folder: it has a folder `reports` and is not the folder of the program's own
/// files. Windows starts a program by its icon in the latter, which users may not write into.
#[cfg(feature = "desktop")]
fn keeps_sessions(working: &Path, program: &Path) -> bool {
    working.join("reports").is_dir() && program.parent() != Some(working)
}

/// Default folder of finished bundles of a build without the window.
#[cfg(not(feature = "desktop"))]
fn default_output_folder() -> PathBuf {
    PathBuf::from(SESSIONS)
}

/// Language of pages and tables that are written in one language, if none is asked for.
const DEFAULT_LANGUAGE: &str = "en";

/// Templates of the folder `reports/templates` in the working folder, if it exists; otherwise the built-in ones.
fn load_templates() -> Result<typodont_report::Templates, CliError> {
    typodont_report::Templates::in_folder(Path::new("reports/templates")).map_err(CliError::Wrong)
}

/// Checks that a folder for output is not a file.
///
/// # Errors
/// A message that names the option if the path, or a folder on the way to it, is a file.
fn check_output_folder(out: &Path) -> Result<(), CliError> {
    match out.ancestors().find(|folder| folder.is_file()) {
        Some(file) => Err(CliError::misuse(format!("--out: {} is a file, not a folder", file.display()))),
        None => Ok(()),
    }
}

/// Prints a line. A closed pipe, as of `head` after its last line, is not an error.
fn print_line(line: impl fmt::Display) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::Wrong(format!("standard output: unwritable-file: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a file.
///
/// # Errors
/// A message with the path and the reason if the file cannot be written.
fn write_file(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), CliError> {
    std::fs::write(path, bytes).map_err(|e| CliError::wrong(format!("{}: unwritable-file: {e}", path.display())))
}

/// Path of a bundle's recording; a path to a recording itself is returned unchanged.
fn recording_path(bundle: &Path) -> PathBuf {
    if bundle.is_dir() { bundle.join(typodont_exercise::record::FILE_NAME) } else { bundle.to_path_buf() }
}

/// The examiners' overrides beside the bundles of a folder; damaged entries are reported on standard error.
#[cfg(feature = "integrations")]
fn read_override_log(folder: &Path) -> Result<typodont_review::OverrideSnapshot, CliError> {
    let path = folder.join(typodont_review::OVERRIDES);
    let unreadable = |e| CliError::wrong(format!("{}: unreadable-file: {e}", path.display()));
    let log = typodont_review::OverrideLog::of(folder).read(None).map_err(unreadable)?;
    for issue in &log.issues {
        eprintln!("{}: {issue}", path.display());
    }
    Ok(log)
}

#[cfg(all(test, feature = "desktop"))]
mod tests {
    use std::path::Path;

    use super::keeps_sessions;

    #[test]
    fn an_icon_keeps_sessions_in_a_checkout_but_not_beside_the_program() {
        let checkout = Path::new(env!("CARGO_MANIFEST_DIR"));
        let elsewhere = checkout.join("target/release/typodont");
        assert!(keeps_sessions(checkout, &elsewhere), "a checkout");
        assert!(!keeps_sessions(&checkout.join("src"), &elsewhere), "a folder without reports");
        assert!(!keeps_sessions(checkout, &checkout.join("typodont.exe")), "the folder of an installed program");
    }
}
