//! The file of a station: the device, the seat, the exercises and the sessions of one machine.
//!
//! Takes a TOML text. Gives a [`Station`], or all complaints with their places. Never changes a file.

use schemars::JsonSchema;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json::SourceMap;
use typodont_formats::toml_reader;

/// Minutes without input after which a kiosk is made ready for the next participant, if the file does not say.
const IDLE_MINUTES: u32 = 5;

/// A station, as its administrator writes it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    description = "a station: device, seat, language, exercises, class, sessions, send_to, mode, supervisor_code, idle_minutes"
)]
struct StationFile {
    /// Code of the seat, such as "lab-2-07": up to 64 letters, digits, "-", "_" or "."
    #[schemars(regex(pattern = r"^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$"))]
    seat: Option<String>,
    /// Class whose sessions are held here, as `typodont sync --class` takes it
    #[schemars(length(min = 1, max = 200))]
    class: Option<String>,
    /// Device of the trainee, as --device takes it: "mouse", "openhaptics", "haply:SERIAL"; `typodont devices` lists them
    #[schemars(length(min = 1))]
    device: Option<String>,
    /// Language with which the window opens: the code of a language file, such as "en" or "tr"
    #[schemars(length(min = 1))]
    language: Option<String>,
    /// Exercises of the school: the whole path of a folder, or an address that begins with https://
    #[schemars(length(min = 1))]
    exercises: Option<String>,
    /// Folder in which sessions are kept: a whole path
    #[schemars(length(min = 1))]
    sessions: Option<String>,
    /// Folder to which finished sessions are copied, in a folder named by the seat: a whole path
    #[schemars(length(min = 1))]
    send_to: Option<String>,
    /// "free", or "kiosk": the whole screen, one participant after another, and no way out
    #[serde(default)]
    mode: StationMode,
    /// Digest of the code with which a supervisor closes a kiosk, as `typodont station code` prints it
    #[schemars(regex(pattern = r"^argon2id:[0-9a-f]{32}:[0-9a-f]{64}$"))]
    supervisor_code: Option<String>,
    /// Minutes without input after which a kiosk is made ready for the next participant, 1 to 120
    #[schemars(range(min = 1, max = 120))]
    idle_minutes: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum StationMode {
    #[default]
    Free,
    Kiosk,
}

/// Source of a station's exercises.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExerciseSource {
    Folder(PathBuf),
    /// Address of a folder on a web server, without a slash at its end.
    Address(String),
}

/// A kiosk: a station without a way out.
// A build without the window only checks it.
#[cfg_attr(not(feature = "desktop"), allow(dead_code))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kiosk {
    /// Digest of the code that closes it; without one only a signal does.
    pub supervisor_code: Option<String>,
    /// Time without input after which it is made ready for the next participant.
    pub idle: Duration,
}

/// A station whose file was read.
#[cfg_attr(not(all(feature = "desktop", feature = "school")), allow(dead_code))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Station {
    /// Path of its file.
    pub file: PathBuf,
    pub seat: Option<String>,
    pub class: Option<String>,
    pub device: Option<String>,
    pub language: Option<String>,
    pub exercises: Option<ExerciseSource>,
    pub sessions: Option<PathBuf>,
    /// Folder, named by the seat, to which finished sessions are copied.
    pub send_to: Option<PathBuf>,
    pub kiosk: Option<Kiosk>,
}

impl Station {
    /// Reads the file of a station. Also returns warnings: parts that a session can do without.
    ///
    /// # Errors
    /// All faults of the file.
    pub fn read(path: &Path) -> Result<(Station, Vec<Diagnostic>), Vec<Diagnostic>> {
        let source = typodont_formats::read_text(path).map_err(|complaint| vec![complaint])?;
        let read = toml_reader::read::<StationFile>(source)?;
        let StationFile { seat, class, device, language, mode, supervisor_code, idle_minutes, .. } = &read.value;
        let mut check = StationCheck { map: &read.source_map, errors: Vec::new(), warnings: Vec::new() };
        check.device(device.as_deref());
        check.language(language.as_deref());
        let exercises = check.exercises(read.value.exercises.as_deref());
        let sessions = check.folder("/sessions", read.value.sessions.as_deref());
        let target = check.folder("/send_to", read.value.send_to.as_deref());
        let send_to = check.sending(target, seat.as_deref());
        check.kiosk(*mode, supervisor_code.is_some(), idle_minutes.is_some());
        if !check.errors.is_empty() {
            return Err(check.errors);
        }
        let kiosk = (*mode == StationMode::Kiosk).then(|| Kiosk {
            supervisor_code: supervisor_code.clone(),
            idle: Duration::from_secs(60 * u64::from(idle_minutes.unwrap_or(IDLE_MINUTES))),
        });
        let (seat, class, device, language) = (seat.clone(), class.clone(), device.clone(), language.clone());
        let file = path.to_path_buf();
        Ok((Station { file, seat, class, device, language, exercises, sessions, send_to, kiosk }, check.warnings))
    }
}

/// Checks of what the schema cannot say.
struct StationCheck<'a> {
    map: &'a SourceMap,
    errors: Vec<Diagnostic>,
    warnings: Vec<Diagnostic>,
}

impl StationCheck<'_> {
    fn error(&mut self, path: &str, code: &'static str, message: String, help: impl Into<String>) {
        self.errors.push(self.map.complain(path, code, message, Some(help.into())));
    }

    fn warning(&mut self, path: &str, code: &'static str, message: String, help: &str) {
        self.warnings.push(self.map.complain(path, code, message, Some(help.to_string())));
    }

    #[cfg(feature = "devices")]
    fn device(&mut self, device: Option<&str>) {
        use typodont_devices::{DRIVERS, NamedDevice};
        use typodont_formats::diagnostic::did_you_mean;
        if let Some(Err(unknown)) = device.map(NamedDevice::parse) {
            let known: Vec<&str> = DRIVERS.iter().map(|driver| driver.name()).collect();
            let message = format!("there is no device named \"{}\"", unknown.name);
            self.error("/device", "unknown-device", message, did_you_mean(&unknown.name, known));
        }
    }

    /// A build without drivers cannot know their names.
    #[cfg(not(feature = "devices"))]
    fn device(&mut self, _: Option<&str>) {}

    #[cfg(feature = "desktop")]
    fn language(&mut self, language: Option<&str>) {
        use typodont_formats::diagnostic::did_you_mean;
        let Some(code) = language else { return };
        let known = typodont_app::readiness::language_codes();
        if !known.iter().any(|own| own == code) {
            let help = did_you_mean(code, known.iter().map(String::as_str));
            self.error("/language", "unknown-language", format!("the language \"{code}\" is not installed"), help);
        }
    }

    /// A build without the window cannot know its languages.
    #[cfg(not(feature = "desktop"))]
    fn language(&mut self, _: Option<&str>) {}

    fn exercises(&mut self, exercises: Option<&str>) -> Option<ExerciseSource> {
        let text = exercises?;
        if !text.contains("://") {
            return self.folder("/exercises", Some(text)).map(ExerciseSource::Folder);
        }
        let host = text.strip_prefix("http://").map(|rest| rest.split(['/', ':']).next().unwrap_or_default());
        let is_local = matches!(host, Some("localhost" | "127.0.0.1"));
        if !is_local && !text.starts_with("https://") {
            let help = "exercises decide what is graded: give an address that begins with https://, or a folder";
            self.error("/exercises", "plain-http", format!("\"{text}\" can be changed on its way"), help);
        } else if text.contains(['?', '#', '@']) {
            let help =
                "give the address of the folder that holds SHA256SUMS, such as https://school.example.edu/exercises";
            self.error("/exercises", "wrong-address", format!("\"{text}\" is not the address of a folder"), help);
        }
        Some(ExerciseSource::Address(text.trim_end_matches('/').to_string()))
    }

    /// A whole path; the folder may be made later, or by somebody else.
    fn folder(&mut self, path: &str, folder: Option<&str>) -> Option<PathBuf> {
        let folder: PathBuf = Path::new(folder?).components().collect();
        if !folder.is_absolute() {
            let example =
                if cfg!(windows) { r"'D:\Typodont\sessions' or '\\server\share'" } else { "\"/srv/typodont\"" };
            let help = format!("the program may be started in any folder: write the whole path, such as {example}");
            self.error(path, "relative-path", format!("\"{}\" is not a whole path", folder.display()), help);
        } else if !folder.is_dir() {
            let message = format!("there is no folder \"{}\" on this machine", folder.display());
            self.warning(path, "missing-folder", message, "connect the drive, or make the folder");
        }
        Some(folder)
    }

    fn sending(&mut self, target: Option<PathBuf>, seat: Option<&str>) -> Option<PathBuf> {
        match (target, seat) {
            (Some(target), Some(seat)) => Some(target.join(seat)),
            (Some(_), None) => {
                let message = "sessions are sent, but the station has no seat".to_string();
                self.error("/send_to", "missing-key", message, "add a line such as  seat = \"lab-2-07\"");
                None
            }
            (None, _) => None,
        }
    }

    fn kiosk(&mut self, mode: StationMode, has_code: bool, has_minutes: bool) {
        match mode {
            StationMode::Kiosk if !has_code => {
                let message = "the kiosk has no supervisor's code: only a signal closes the window".to_string();
                let help = "add the line that `typodont station code` prints, or end the process from another login";
                self.warning("/mode", "no-code", message, help);
            }
            StationMode::Kiosk => {}
            StationMode::Free => {
                for (path, _) in
                    [("/supervisor_code", has_code), ("/idle_minutes", has_minutes)].iter().filter(|(_, has)| *has)
                {
                    let message = "the key has no effect: the station is not a kiosk".to_string();
                    self.warning(path, "no-effect", message, "add the line  mode = \"kiosk\"  or delete the key");
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<(Station, Vec<Diagnostic>), Vec<Diagnostic>> {
        let path = std::env::temp_dir().join(format!("typodont-{name}-{}.toml", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let read = Station::read(&path);
        std::fs::remove_file(path).unwrap();
        read
    }

    #[test]
    fn every_key_of_a_station_is_read() {
        let folder = std::env::temp_dir();
        let folder = folder.display();
        let code = format!("argon2id:{}:{}", "0".repeat(32), "f".repeat(64));
        let text = format!(
            "seat = 'lab-2'\nclass = 'Restorative 1'\ndevice = 'mouse'\nlanguage = 'tr'\nexercises = 'https://a.example/b/'\n\
             sessions = '{folder}'\nsend_to = '{folder}'\nmode = 'kiosk'\nsupervisor_code = '{code}'\nidle_minutes = 2\n"
        );
        let (station, warnings) = read("whole", &text).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(station.exercises, Some(ExerciseSource::Address("https://a.example/b".into())));
        assert!(station.send_to.unwrap().ends_with("lab-2"));
        assert_eq!(station.kiosk, Some(Kiosk { supervisor_code: Some(code), idle: Duration::from_secs(120) }));
        assert_eq!((station.seat.as_deref(), station.class.as_deref()), (Some("lab-2"), Some("Restorative 1")));
    }

    #[test]
    fn an_empty_file_is_a_station_of_one_person() {
        let (station, warnings) = read("empty", "# nothing\n").unwrap();
        assert!(warnings.is_empty() && station.kiosk.is_none() && station.exercises.is_none());
    }

    #[test]
    fn every_mistake_is_told_with_its_place_and_remedy() {
        // Aim: an administrator mends the file without a manual. Method: one mistake a line, the place and the help.
        let check = |name: &str, text: &str, place: &str, help: &str| {
            let complaints = match read(name, text) {
                Ok((_, warnings)) => warnings,
                Err(errors) => errors,
            };
            let found = complaints.iter().any(|complaint| {
                complaint.headline().contains(place) && complaint.help.as_deref().unwrap_or_default().contains(help)
            });
            assert!(found, "{text}: {complaints:#?}");
        };
        check("key", "devise = 'mouse'\n", ":1:1: unknown-key: /devise", "did you mean \"device\"?");
        check("mode", "mode = 'kiosque'\n", ":1:8: unknown-word: /mode", "did you mean \"kiosk\"?");
        check("path", "sessions = 'sessions'\n", ":1:12: relative-path: /sessions", "whole path");
        check("http", "exercises = 'http://a.example'\n", ":1:13: plain-http: /exercises", "https://");
        check("sign", "exercises = 'https://a.example?b'\n", ":1:13: wrong-address", "SHA256SUMS");
        check("seat", "seat = '../b'\n", ":1:8: wrong-form: /seat", "letters");
        check("send", "send_to = '/'\n", ":1:11: missing-key: /send_to", "seat = ");
        check("code", "mode = 'kiosk'\n", ":1:8: no-code: /mode", "typodont station code");
        check("idle", "idle_minutes = 5\n", ":1:16: no-effect: /idle_minutes", "kiosk");
        check("minutes", "mode = 'kiosk'\nidle_minutes = 0\n", ":2:16: out-of-range: /idle_minutes", "1 to 120");
        #[cfg(feature = "devices")]
        check("device", "device = 'openhaptic'\n", ":1:10: unknown-device: /device", "did you mean \"openhaptics\"?");
        #[cfg(feature = "desktop")]
        check("language", "language = 'tk'\n", ":1:12: unknown-language: /language", "did you mean \"tr\"?");
    }
}
