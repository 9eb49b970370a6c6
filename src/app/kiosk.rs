//! A station of a school, and a kiosk: a station that one participant after another uses and nobody leaves.
//!
//! Takes what the station's file says. Gives the settings of the window, the commands that a kiosk refuses, and the state
//! of a supervisor's attempt to close it. Never changes the user's settings file on behalf of a station.

use crate::command::AppCommand;
use crate::settings::Settings;
use crate::supervisor_code::SupervisorCode;
use std::path::PathBuf;
use std::time::Duration;

/// Instructions of a station's file to the window.
#[derive(Clone, Debug, Default)]
pub struct StationOptions {
    /// Input device, as in `--device`; without it that of the settings.
    pub device: Option<String>,
    /// Code of the language with which the window opens.
    pub language: Option<String>,
    /// Folder with the school's exercises.
    pub exercises: Option<PathBuf>,
    /// Reason why the exercises may be old, for the person at the machine.
    pub complaint: Option<String>,
    pub kiosk: Option<KioskOptions>,
}

/// A kiosk: the whole screen, no author's screen, no settings but language and size, and no way out.
#[derive(Clone, Debug)]
pub struct KioskOptions {
    /// Code that closes the window; without one only a signal does.
    pub supervisor_code: Option<SupervisorCode>,
    /// Time without input after which the window is made ready for the next participant.
    pub idle: Duration,
}

impl StationOptions {
    /// The user's settings with those of the station in their place.
    pub fn settings(&self, own: Settings) -> Settings {
        Settings {
            device: self.device.clone().unwrap_or(own.device),
            language: self.language.clone().unwrap_or(own.language),
            exercises: self.exercises.clone().unwrap_or(own.exercises),
            ..own
        }
    }

    /// The settings to be saved as the user's: the station's are not among them. `own` is what the file holds now.
    pub fn own_settings(&self, shown: &Settings, own: Settings) -> Settings {
        let Settings { device, language, exercises, .. } = shown.clone();
        Settings {
            device: if self.device.is_some() { own.device } else { device },
            language: if self.language.is_some() { own.language } else { language },
            exercises: if self.exercises.is_some() { own.exercises } else { exercises },
            ..shown.clone()
        }
    }
}

/// True for a command that leads out of a kiosk.
pub fn is_refused(command: &AppCommand) -> bool {
    matches!(
        command,
        AppCommand::OpenFolder(_)
            | AppCommand::NewExercise
            | AppCommand::EditExercise
            | AppCommand::Editor(_)
            | AppCommand::OpenReport
            | AppCommand::ChooseZip
            | AppCommand::ChooseExercise
    )
}

/// A supervisor's attempt to close the kiosk.
#[derive(Default)]
pub struct KioskExit {
    pub is_asked: bool,
    /// The supervisor's code was typed: the window may close.
    pub is_allowed: bool,
    pub code: String,
    pub is_wrong: bool,
}

impl KioskExit {
    /// Opens or closes the question. What was typed is forgotten.
    pub fn ask(&mut self, is_asked: bool) {
        *self = KioskExit { is_asked, is_allowed: self.is_allowed, ..KioskExit::default() };
    }

    /// Compares what was typed with the code; true if the window may close.
    pub fn try_code(&mut self, kiosk: &KioskOptions) -> bool {
        self.is_allowed = kiosk.supervisor_code.as_ref().is_some_and(|code| code.matches(self.code.trim()));
        self.is_wrong = !self.is_allowed;
        self.is_asked = !self.is_allowed;
        self.code.clear();
        self.is_allowed
    }

    /// State for tests: asked, refused or no question.
    pub fn state(&self) -> &'static str {
        match self {
            KioskExit { is_asked: true, is_wrong: true, .. } => "refused",
            KioskExit { is_asked: true, .. } => "asked",
            _ => "nothing",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_station_changes_no_settings_of_the_user() {
        // Aim: a person who uses a station's account at home later finds their own device. Method: the station's
        // settings are shown, and a changed size alone is saved.
        let own = Settings { device: "spacemouse".into(), language: "en".into(), ..Settings::default() };
        let station = StationOptions {
            device: Some("openhaptics".into()),
            language: Some("tr".into()),
            exercises: Some("/srv/exercises".into()),
            ..StationOptions::default()
        };
        let shown = Settings { font_size: 1.4, ..station.settings(own.clone()) };
        assert_eq!((shown.device.as_str(), shown.language.as_str()), ("openhaptics", "tr"));
        assert_eq!(station.own_settings(&shown, own.clone()), Settings { font_size: 1.4, ..own.clone() });
        let nothing = StationOptions::default();
        assert_eq!(nothing.own_settings(&shown, own), shown);
    }

    #[test]
    fn only_the_supervisors_code_lets_a_kiosk_close() {
        let kiosk = |code| KioskOptions { supervisor_code: code, idle: Duration::from_secs(60) };
        let mut exit = KioskExit { is_asked: true, code: "a wrong code".into(), ..KioskExit::default() };
        let code = SupervisorCode::of("the right code").unwrap();
        assert!(!exit.try_code(&kiosk(Some(code.clone()))) && exit.state() == "refused");
        exit.code = "the right code".into();
        assert!(exit.try_code(&kiosk(Some(code))) && exit.is_allowed);
        let mut exit = KioskExit::default();
        assert!(!exit.try_code(&kiosk(None)), "without a code no code fits, not even none");
    }
}
