//! The reasons for which a session refuses an input.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Reason for refusing an input. Recordings contain the English text; the application shows it in its own language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputError {
    TooEarly,
    NoStage,
    NotOnTray,
    NotByConfirmation,
    FixedTissues,
    SteppedStiffness,
    OutOfRange,
    NoCoefficient,
    NotAsked,
    NoAnswer,
    NotExamined,
    NoQuestionnaire,
    NoStep,
    NoStatement,
    NoChart,
    NotAtNeck,
    NoProbe,
    NotInSulcus,
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            InputError::TooEarly => "the questionnaire comes after the last stage",
            InputError::NoStage => "no stage is running",
            InputError::NotOnTray => "this instrument is not offered in this stage",
            InputError::NotByConfirmation => "this stage does not end by confirmation",
            InputError::FixedTissues => "the tissue properties cannot be adjusted in this stage",
            InputError::SteppedStiffness => "this stiffness changes in steps and cannot be adjusted",
            InputError::OutOfRange => "the value of the coefficient is out of range",
            InputError::NoCoefficient => "no tissue has this coefficient",
            InputError::NotAsked => "this question is not asked in this stage",
            InputError::NoAnswer => "this is not an answer to that question",
            InputError::NotExamined => "the instrument has not touched the place that the answer names in this trial",
            InputError::NoQuestionnaire => "there is no questionnaire",
            InputError::NoStep => "the rating is not on the scale",
            InputError::NoStatement => "the questionnaire has no such statement",
            InputError::NoChart => "this is not charted in this stage",
            InputError::NotAtNeck => "the instrument is not at the cervical margin of the tooth",
            InputError::NoProbe => "a depth can be recorded only with a periodontal probe",
            InputError::NotInSulcus => "the probe is not in the sulcus",
        })
    }
}

impl std::error::Error for InputError {}
