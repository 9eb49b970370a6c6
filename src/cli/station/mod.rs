//! `typodont station`: the file of a station, its exercises and its sessions.
//!
//! The window and `typodont run` read the same file. Nothing here is needed on the machine of a single person.

mod exercise_copy;
#[cfg(feature = "integrations")]
mod exercise_server;
mod session_sender;
mod station_file;

use super::{CliError, default_output_folder, print_line};
use clap::{Args, Subcommand};
use exercise_copy::CopyChanges;
pub use station_file::Station;
use std::path::{Path, PathBuf};
#[cfg(feature = "desktop")]
use std::{sync::mpsc, thread, time::Duration};
#[cfg(feature = "desktop")]
use typodont_app as app;
use typodont_formats::diagnostic::Diagnostic;

/// Name of the file of a station.
const FILE: &str = "station.toml";

/// Time for which the window waits for the school's exercises, before it opens with the last copy.
#[cfg(feature = "desktop")]
const UPDATE_TIME: Duration = Duration::from_secs(10);

/// Interval at which an open window's finished sessions are sent.
#[cfg(feature = "desktop")]
const SEND_INTERVAL: Duration = Duration::from_secs(60);

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: StationCommand,
}

#[derive(Subcommand)]
enum StationCommand {
    /// Bring the station's exercises up to date, and copy finished sessions to the school's folder
    Sync(SyncArguments),
    /// Print the line of the station's file for a supervisor's code, which is read from the standard input
    Code,
}

#[derive(Args)]
struct SyncArguments {
    /// File of the station; without it the system's, then the user's
    #[arg(long, value_name = "FILE")]
    station: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.command {
        StationCommand::Sync(arguments) => sync(arguments),
        StationCommand::Code => print_code(),
    }
}

/// The station of this machine: the named file, else the system's, else the user's; `None` if there is none.
///
/// # Errors
/// All faults of the file.
pub fn find(named: Option<&Path>) -> Result<Option<Station>, CliError> {
    Ok(find_with_warnings(named)?.map(|(station, _)| station))
}

/// As [`find`], with warnings.
///
/// # Errors
/// All faults of the file.
pub fn find_with_warnings(named: Option<&Path>) -> Result<Option<(Station, Vec<Diagnostic>)>, CliError> {
    let file = named.map(Path::to_path_buf).or_else(|| places().into_iter().find(|path| path.is_file()));
    Ok(file.map(|file| Station::read(&file)).transpose()?)
}

/// Checks the file of a station; returns warnings.
///
/// # Errors
/// All faults of the file.
pub fn check(path: &Path) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    Station::read(path).map(|(_, warnings)| warnings)
}

/// Places of the file: the system's comes first, so that a user's own file does not open a kiosk.
pub fn places() -> Vec<PathBuf> {
    let system = if cfg!(windows) {
        std::env::var_os("ProgramData").map(|folder| PathBuf::from(folder).join("Typodont"))
    } else if cfg!(target_os = "macos") {
        Some(PathBuf::from("/Library/Application Support/Typodont"))
    } else {
        Some(PathBuf::from("/etc/typodont"))
    };
    let own = directories::ProjectDirs::from("", "", "typodont").map(|folders| folders.config_dir().to_path_buf());
    system.into_iter().chain(own).map(|folder| folder.join(FILE)).collect()
}

/// Folder of the station's copy of the school's exercises; `None` if the user has no home folder.
fn copy_folder() -> Option<PathBuf> {
    directories::ProjectDirs::from("", "", "typodont").map(|folders| folders.data_local_dir().join("exercises"))
}

impl Station {
    /// Folder of the sessions: the station's, else the usual one.
    pub fn session_folder(&self) -> PathBuf {
        self.sessions.clone().unwrap_or_else(default_output_folder)
    }

    /// Folder in which the window finds the school's exercises: the copy.
    #[cfg(feature = "desktop")]
    pub fn exercise_folder(&self) -> Option<PathBuf> {
        self.exercises.as_ref().and_then(|_| copy_folder())
    }

    /// Brings the copy of the exercises up to date.
    ///
    /// # Errors
    /// The reason; the copy is then as it was.
    fn update_exercises(&self) -> Result<CopyChanges, String> {
        let Some(source) = &self.exercises else { return Ok(CopyChanges::default()) };
        let copy = copy_folder().ok_or("no-home: the user has no home folder for the exercises")?;
        exercise_copy::update(&*exercise_copy::files_of(source)?, &copy)
    }

    /// Differences between the exercises and their copy; `None` for a station without exercises of its own.
    pub fn compare_exercises(&self) -> Option<Result<CopyChanges, String>> {
        let copy = copy_folder()?;
        let files = exercise_copy::files_of(self.exercises.as_ref()?);
        Some(files.and_then(|files| exercise_copy::compare(&*files, &copy)))
    }

    /// Copies finished sessions to the school's folder; returns their number.
    ///
    /// # Errors
    /// The reason; nothing is lost, and the next attempt continues.
    fn send_sessions(&self) -> Result<usize, String> {
        match &self.send_to {
            Some(target) => session_sender::send(&self.session_folder(), target),
            None => Ok(0),
        }
    }
}

fn sync(arguments: &SyncArguments) -> Result<(), CliError> {
    let Some(station) = find(arguments.station.as_deref())? else {
        let places = places().iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(" or ");
        return Err(CliError::wrong(format!(
            "no-station: there is no station file; write {places}, or give --station FILE"
        )));
    };
    let (updated, sent) = (station.update_exercises(), station.send_sessions());
    if station.exercises.is_some()
        && let Ok(CopyChanges { added, changed, removed }) = &updated
    {
        print_line(format!("exercises: {added} files added, {changed} changed, {removed} removed"))?;
    }
    if station.send_to.is_some()
        && let Ok(count) = &sent
    {
        print_line(format!("sessions: {count} sent"))?;
    }
    let failures: Vec<String> = [updated.err(), sent.err()].into_iter().flatten().collect();
    if failures.is_empty() { Ok(()) } else { Err(CliError::Wrong(failures.join("\n"))) }
}

#[cfg(feature = "desktop")]
fn print_code() -> Result<(), CliError> {
    let text =
        std::io::read_to_string(std::io::stdin()).map_err(|error| CliError::wrong(format!("no code: {error}")))?;
    let code = text.lines().next().unwrap_or_default().trim();
    let digest = app::SupervisorCode::of(code).map_err(CliError::Wrong)?;
    print_line(format!("supervisor_code = \"{digest}\""))
}

#[cfg(not(feature = "desktop"))]
fn print_code() -> Result<(), CliError> {
    Err(super::missing_part::error("the window, whose kiosk the code closes", "desktop"))
}

/// Opens the window at a station: brings the exercises up to date first, and sends finished sessions while it is open and
/// when it is closed.
///
/// # Errors
/// The window cannot be opened.
#[cfg(feature = "desktop")]
pub fn open_window(station: Station, options: app::AppOptions) -> Result<(), CliError> {
    let complaint = update_within(&station, UPDATE_TIME).err();
    let kiosk = station.kiosk.as_ref().map(|kiosk| app::KioskOptions {
        supervisor_code: kiosk.supervisor_code.as_deref().and_then(app::SupervisorCode::parse),
        idle: kiosk.idle,
    });
    let station_options = app::StationOptions {
        device: station.device.clone(),
        language: station.language.clone(),
        exercises: station.exercise_folder(),
        complaint,
        kiosk,
    };
    let (window_is_open, closed) = mpsc::channel::<()>();
    let sender = thread::spawn(move || {
        loop {
            // A drive that is away is reported by `typodont station sync` and by `typodont doctor`.
            let _ = station.send_sessions();
            if closed.recv_timeout(SEND_INTERVAL) == Err(mpsc::RecvTimeoutError::Disconnected) {
                let _ = station.send_sessions();
                return;
            }
        }
    });
    let result = super::open_window(app::AppOptions { station: Some(station_options), ..options });
    drop(window_is_open);
    // The thread ends by itself; only its panic could be told.
    let _ = sender.join();
    result
}

/// Brings the exercises up to date; after `limit` the update continues, and the window opens with the last copy.
#[cfg(feature = "desktop")]
fn update_within(station: &Station, limit: Duration) -> Result<(), String> {
    let (done, result) = mpsc::channel();
    let own = station.clone();
    thread::spawn(move || done.send(own.update_exercises().map(drop)));
    let why = match result.recv_timeout(limit) {
        Ok(result) => result.err(),
        Err(_) => Some("no answer yet".to_string()),
    };
    match why {
        Some(why) => Err(format!("The exercises could not be brought up to date: {why}")),
        None => Ok(()),
    }
}
