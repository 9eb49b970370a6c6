//! Messages of the lesson and the device to the user, as keys of a language file.

use crate::i18n::Translations;
use std::net::SocketAddr;
use typodont_core::device::{DeviceError, DeviceState};
use typodont_devices::servo::SecondHandEvent;
use typodont_exercise::scenario::{ContactLimit, LimitPlace, LimitedQuantity, Scenario};
use typodont_exercise::session::InputError;

/// Text key of the reason why an input was not accepted.
pub fn refusal_key(why: InputError) -> &'static str {
    match why {
        InputError::TooEarly => "refused.too_early",
        InputError::NoStage => "refused.no_stage",
        InputError::NotOnTray => "refused.not_on_tray",
        InputError::NotByConfirmation => "refused.not_by_confirmation",
        InputError::FixedTissues => "refused.fixed_tissues",
        InputError::SteppedStiffness => "refused.stepped_stiffness",
        InputError::OutOfRange => "refused.out_of_range",
        InputError::NoCoefficient => "refused.no_coefficient",
        InputError::NotAsked => "refused.not_asked",
        InputError::NoAnswer => "refused.no_answer",
        InputError::NotExamined => "refused.not_examined",
        InputError::NoQuestionnaire => "refused.no_questionnaire",
        InputError::NoStep => "refused.no_step",
        InputError::NoStatement => "refused.no_statement",
        InputError::NoChart => "refused.no_chart",
        InputError::NotAtNeck => "refused.not_at_neck",
        InputError::NoProbe => "refused.no_probe",
        InputError::NotInSulcus => "refused.not_in_sulcus",
    }
}

/// Warning of a value above a limit of the exercise, with its place, the value and the limit. `peak`: N or mm/s.
pub fn limit_text(limit: &ContactLimit, peak: f32, scenario: &Scenario, words: &Translations) -> String {
    let ContactLimit { place, quantity, most, .. } = limit;
    let advice = match quantity {
        LimitedQuantity::Force => words.get("practice.warn_force"),
        LimitedQuantity::Speed => words.get("practice.warn_speed"),
    };
    let place = match *place {
        LimitPlace::Anywhere => None,
        LimitPlace::Zone(zone) => Some(words.own(&scenario.texts, &scenario.zones[zone].title)),
        LimitPlace::Tissue(label) => scenario.tissues.by_label(label).map(|entry| entry.title.in_language(&words.code)),
    };
    let advice = match place {
        Some(place) => words.format_all("practice.warn_near", &[place, advice]),
        None => advice.to_string(),
    };
    // Rounded up, so that a value above its limit is not shown as equal to it.
    let (peak, unit) = match quantity {
        LimitedQuantity::Force => (format!("{:.2}", (peak * 100.0).ceil() / 100.0), "N"),
        LimitedQuantity::Speed => (format!("{:.0}", peak.ceil()), "mm/s"),
    };
    let [peak, most] = [peak, most.to_string()].map(|value| format!("{value} {unit}"));
    format!("{advice}: {}", words.format_all("practice.warn_values", &[&peak, &most]))
}

/// Text key for inputs after the end of a lesson.
pub const NOT_LISTENING: &str = "refused.not_listening";

/// Reason why the system has suspended a lesson.
#[derive(Clone, Debug, PartialEq)]
pub struct PauseReason {
    key: &'static str,
    /// The driver's message about its device, in English.
    detail: String,
}

impl PauseReason {
    /// Its key in the language files.
    pub fn key(&self) -> &'static str {
        self.key
    }

    /// `None` while the device is ready.
    pub fn from_state(state: DeviceState) -> Option<PauseReason> {
        let (key, detail) = match state {
            DeviceState::Ready => return None,
            DeviceState::Calibrate { how } => ("standstill.calibrate", how),
            DeviceState::Homing { what } => ("standstill.homing", what),
            DeviceState::ForceOff { why } => ("standstill.force_off", why),
        };
        Some(PauseReason { key, detail: detail.into() })
    }

    pub fn device_lost(gone: DeviceError) -> PauseReason {
        match gone {
            DeviceError::Ended => PauseReason { key: "standstill.ended", detail: String::new() },
            DeviceError::Lost { why, code: 0 } => PauseReason { key: "standstill.lost", detail: why.into() },
            DeviceError::Lost { why, code } => {
                PauseReason { key: "standstill.lost", detail: format!("{why} ({code})") }
            }
        }
    }

    /// The device that was connected again is not the one with which the lesson began.
    pub fn different_device() -> PauseReason {
        PauseReason { key: "standstill.other_device", detail: String::new() }
    }

    pub fn text(&self, words: &Translations) -> String {
        words.format(self.key, &self.detail)
    }
}

/// Status of a second hand, for display.
#[derive(Clone, Debug, PartialEq)]
pub enum SecondHandStatus {
    /// Waiting at this address for a second station that has the key.
    AwaitingConnection(SocketAddr),
    Paused(PauseReason),
    /// A key of the language file.
    Message(&'static str),
}

impl SecondHandStatus {
    pub fn from_event(event: SecondHandEvent) -> SecondHandStatus {
        let ready = SecondHandStatus::Message("second.ready");
        match event {
            SecondHandEvent::Device(state) => PauseReason::from_state(state).map_or(ready, SecondHandStatus::Paused),
            SecondHandEvent::Gone(gone) => SecondHandStatus::Paused(PauseReason::device_lost(gone)),
            SecondHandEvent::FirstHand { is_present: true } => ready,
            SecondHandEvent::FirstHand { is_present: false } => SecondHandStatus::Message("second.alone"),
            SecondHandEvent::Leading(true) => SecondHandStatus::Message("second.leads"),
            SecondHandEvent::Leading(false) => SecondHandStatus::Message("second.follows"),
        }
    }

    pub fn text(&self, words: &Translations) -> String {
        match self {
            SecondHandStatus::AwaitingConnection(address) => words.format("second.may_join", address),
            SecondHandStatus::Paused(why) => words.format("second.still", why.text(words)),
            SecondHandStatus::Message(key) => words.get(key).to_string(),
        }
    }
}
