//! Results of sessions as files: bundles, pages, pictures, maps and tables.
//!
//! Takes scored recordings and finished bundles. Gives files whose bytes follow from the recording and the templates
//! alone. Never computes a measure: [`typodont_exercise::score`] does.
//!
//! All bundles below a folder form a cohort, which is exported as a table, a page or statistics:
//!
//! ```
//! use std::path::Path;
//! use typodont_report::cohort::Cohort;
//!
//! let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example");
//! let cohort = Cohort::read(&folder);
//! assert_eq!((cohort.sessions.len(), cohort.skipped.len()), (1, 0));
//! assert!(cohort.csv().starts_with("bundle,scenario,participant,started,points,passed,"));
//! ```

pub mod bundle;
pub mod cohort;
pub mod csv;
mod curves;
mod feedback;
mod first_result;
mod glb;
mod instrument_shape;
mod templates;
mod labelmap;
mod language;
mod motion;
mod pictures;
pub mod raycast;
pub mod name_folding;
pub mod phrases;
mod session_file;
mod session_page;
pub mod verification;
mod voxels;
pub mod display_format;

pub use display_format::{measure as measure_in_words, sanitize_display};
pub use feedback::{Feedback, FeedbackFinding, FeedbackMoment, FeedbackSentence};
pub use first_result::{FirstResult, LegendEntry};
pub use glb::{SurfacePart, encode as surfaces_glb};
pub use labelmap::{grey_values as grey_value_map, tissues as tissue_map};
pub use language::{Languages, Message, Translator};
pub use pictures::{PREVIEW_SIZE, preview_png, sections_png};
pub use session_file::{
    AnswerResultFile, CriticalErrorFile, DeviceFile, EpisodeFile, EvidenceFile, GradeFile, ItemResultFile,
    QuestionnaireFile, RatingFile, ScenarioRef, SessionFile, SiteReadingFile, StageResultFile,
};
pub use templates::Templates;
pub use verification::{VerificationStatus, Verifier};

/// The recording of the committed example with its score, for tests that need a whole session.
#[cfg(test)]
fn example() -> (typodont_exercise::record::Recording, typodont_exercise::score::Scored) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example/recording.mcap");
    let recording = typodont_exercise::record::Recording::read(&path).unwrap();
    let scored = typodont_exercise::score::score(&recording, typodont_exercise::record::ReplayCheck::Skip).unwrap();
    (recording, scored)
}
