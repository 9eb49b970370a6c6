//! The seed of a session and its source.

use super::LessonError;
use jiff::Timestamp;
use typodont_core::readable_key::{KEY_BYTES, readable_key};
use typodont_exercise::record::{CODE_MIN, SeedOriginFile, sealed_seed};
use typodont_exercise::scenario::Scenario;

/// Seed of all random choices of a session; at most 2⁵³, the largest whole number that every JSON reader keeps exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionSeed {
    pub value: u64,
    pub origin: SeedOriginFile,
}

impl SessionSeed {
    /// Draws a seed from the operating system.
    ///
    /// # Errors
    ///
    /// [`LessonError::NoRandomness`] if the system gives no random numbers.
    pub fn drawn() -> Result<SessionSeed, LessonError> {
        let mut bytes = [0; 8];
        getrandom::fill(&mut bytes).map_err(|why| LessonError::NoRandomness { why: why.to_string() })?;
        Ok(SessionSeed { value: u64::from_le_bytes(bytes) >> 11, origin: SeedOriginFile::System })
    }

    /// A seed that a person chose.
    pub fn given(value: u64) -> SessionSeed {
        SessionSeed { value, origin: SeedOriginFile::Given }
    }

    /// The seed of an examination, which the recording reveals when the session has ended.
    ///
    /// # Errors
    ///
    /// [`LessonError::ShortCode`] for a code that could be guessed, and [`LessonError::NotSealable`] for an exercise
    /// without a draw, or with other random choices, which the recording could not conceal.
    pub fn sealed(
        code: &str,
        participant: &str,
        started: Timestamp,
        scenario: &Scenario,
    ) -> Result<SessionSeed, LessonError> {
        if !is_long_enough(code) {
            return Err(LessonError::ShortCode { least: CODE_MIN });
        }
        if !is_sealable(scenario) {
            return Err(LessonError::NotSealable { scenario: scenario.id.clone() });
        }
        let value = sealed_seed(code, participant, &started_text(started), &scenario.sha256);
        Ok(SessionSeed { value, origin: SeedOriginFile::Sealed })
    }

    pub fn is_sealed(&self) -> bool {
        self.origin == SeedOriginFile::Sealed
    }
}

/// Returns true if an examiner's code has enough characters.
pub fn is_long_enough(code: &str) -> bool {
    code.chars().count() >= CODE_MIN
}

/// Returns true if everything that an exercise leaves to chance can be sealed: it has a draw, and no other random choices.
pub fn is_sealable(scenario: &Scenario) -> bool {
    scenario.stages.iter().any(|stage| stage.draw.is_some()) && !scenario.is_workpiece_drawn()
}

/// Returns a new examiner's code that cannot be guessed, such as `k3f9w-…`.
///
/// # Errors
///
/// [`LessonError::NoRandomness`] if the system gives no random numbers.
pub fn new_examiner_code() -> Result<String, LessonError> {
    let mut bytes = [0; KEY_BYTES];
    getrandom::fill(&mut bytes).map_err(|why| LessonError::NoRandomness { why: why.to_string() })?;
    Ok(readable_key(&bytes))
}

/// The start of a session as recordings contain it.
pub(super) fn started_text(started: Timestamp) -> String {
    format!("{started:.0}")
}
