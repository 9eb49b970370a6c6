//! How a session looks afterwards: bundles, pages, maps and tables.
//!
//! Takes scored recordings and finished bundles. Gives files. Never computes a measure: that is `score`.

pub mod bundle;
pub mod cohort;
pub mod csv;
mod curves;
mod feedback;
mod glb;
mod html;
mod labelmap;
mod language;
mod pictures;
pub mod said;
mod session_file;
mod session_page;
mod voxels;
pub mod words;

pub use glb::{Part as SurfacePart, bytes as surfaces_glb};
pub use html::Templates;
pub use labelmap::tissues as tissue_map;
pub use language::{Languages, Said};
pub use pictures::{SEEN, preview_png, sections_png};
pub use session_file::{
    AnswerFile, DeviceFile, EvidenceFile, GradeFile, HardFailFile, ItemFile, QuestionnaireFile, RatingFile,
    ScenarioRef, SessionFile, SiteFile, StageFile,
};
pub use words::{harmless, measure as measure_in_words};

/// The recording of the committed example with its score, for tests that need a whole session.
#[cfg(test)]
fn example() -> (crate::record::Recording, crate::score::Scored) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example/recording.mcap");
    let recording = crate::record::Recording::read(&path).unwrap();
    let scored = crate::score::score(&recording, crate::record::Watch::Nothing).unwrap();
    (recording, scored)
}
