//! Why an input changes nothing.

use std::fmt;

/// An input that does not fit. Recordings hold the English words; a window says them in its own language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
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
    NoQuestionnaire,
    NoStep,
    NoStatement,
    NoChart,
    NotAtNeck,
    NoProbe,
    NotInSulcus,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Refusal::TooEarly => "the questionnaire comes after the last stage",
            Refusal::NoStage => "no stage is running",
            Refusal::NotOnTray => "this instrument is not offered in this stage",
            Refusal::NotByConfirmation => "this stage does not end by confirmation",
            Refusal::FixedTissues => "this stage keeps the tissues as they are",
            Refusal::SteppedStiffness => "this stage changes that stiffness itself",
            Refusal::OutOfRange => "the coefficient cannot be that",
            Refusal::NoCoefficient => "no tissue has this coefficient",
            Refusal::NotAsked => "this stage does not ask that",
            Refusal::NoAnswer => "this is not an answer to that question",
            Refusal::NoQuestionnaire => "there is no questionnaire",
            Refusal::NoStep => "the scale has no such step",
            Refusal::NoStatement => "the questionnaire has no such statement",
            Refusal::NoChart => "this stage does not chart that",
            Refusal::NotAtNeck => "the instrument is not at the tooth's neck",
            Refusal::NoProbe => "depths are read off a periodontal probe",
            Refusal::NotInSulcus => "the probe is not in the sulcus",
        })
    }
}
