//! What lesson and device tell a person, as texts of a language file.

use super::language::Words;
use crate::device::{Gone, State};
use crate::session::Refusal;
use crate::sim::AssistNews;
use std::net::SocketAddr;

/// Why something that was said is not taken: the key of its text.
pub fn refusal(why: Refusal) -> &'static str {
    match why {
        Refusal::TooEarly => "refused.too_early",
        Refusal::NoStage => "refused.no_stage",
        Refusal::NotOnTray => "refused.not_on_tray",
        Refusal::NotByConfirmation => "refused.not_by_confirmation",
        Refusal::FixedTissues => "refused.fixed_tissues",
        Refusal::SteppedStiffness => "refused.stepped_stiffness",
        Refusal::OutOfRange => "refused.out_of_range",
        Refusal::NoCoefficient => "refused.no_coefficient",
        Refusal::NotAsked => "refused.not_asked",
        Refusal::NoAnswer => "refused.no_answer",
        Refusal::NoQuestionnaire => "refused.no_questionnaire",
        Refusal::NoStep => "refused.no_step",
        Refusal::NoStatement => "refused.no_statement",
        Refusal::NoChart => "refused.no_chart",
        Refusal::NotAtNeck => "refused.not_at_neck",
        Refusal::NoProbe => "refused.no_probe",
        Refusal::NotInSulcus => "refused.not_in_sulcus",
    }
}

/// When nothing is heard any more: a lesson that has ended.
pub const NOT_LISTENING: &str = "refused.not_listening";

/// Why time stands still by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Standstill {
    key: &'static str,
    /// What a driver says of its device; in English.
    detail: String,
}

impl Standstill {
    /// `None` while the device is ready.
    pub fn of(state: State) -> Option<Standstill> {
        let (key, detail) = match state {
            State::Ready => return None,
            State::Calibrate { how } => ("standstill.calibrate", how),
            State::Homing { what } => ("standstill.homing", what),
            State::ForceOff { why } => ("standstill.force_off", why),
        };
        Some(Standstill { key, detail: detail.into() })
    }

    pub fn gone(gone: Gone) -> Standstill {
        match gone {
            Gone::Ended => Standstill { key: "standstill.ended", detail: String::new() },
            Gone::Lost { why, code: 0 } => Standstill { key: "standstill.lost", detail: why.into() },
            Gone::Lost { why, code } => Standstill { key: "standstill.lost", detail: format!("{why} ({code})") },
        }
    }

    /// The device that came back is not the one that the lesson began with.
    pub fn other_device() -> Standstill {
        Standstill { key: "standstill.other_device", detail: String::new() }
    }

    pub fn text(&self, words: &Words) -> String {
        words.with(self.key, &self.detail)
    }
}

/// What there is to say of a second hand.
#[derive(Clone, Debug, PartialEq)]
pub enum OfSecond {
    /// A machine that has the key is waited for.
    MayJoin(SocketAddr),
    Still(Standstill),
    /// A key of the language's texts.
    Plain(&'static str),
}

impl OfSecond {
    pub fn of(news: AssistNews) -> OfSecond {
        let ready = OfSecond::Plain("second.ready");
        match news {
            AssistNews::Device(state) => Standstill::of(state).map_or(ready, OfSecond::Still),
            AssistNews::Gone(gone) => OfSecond::Still(Standstill::gone(gone)),
            AssistNews::First { is_there: true } => ready,
            AssistNews::First { is_there: false } => OfSecond::Plain("second.alone"),
            AssistNews::Leading(true) => OfSecond::Plain("second.leads"),
            AssistNews::Leading(false) => OfSecond::Plain("second.follows"),
        }
    }

    pub fn text(&self, words: &Words) -> String {
        match self {
            OfSecond::MayJoin(address) => words.with("second.may_join", address),
            OfSecond::Still(why) => words.with("second.still", why.text(words)),
            OfSecond::Plain(key) => words.of(key).to_string(),
        }
    }
}
