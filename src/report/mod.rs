//! How a session looks afterwards: bundles, pages, maps and tables.
//!
//! Takes scored recordings and finished bundles. Gives files. Never computes a measure: that is `score`.

pub mod bundle;
pub mod cohort;
pub mod csv;
mod curves;
mod glb;
// The cohort's page is made in `cohort::page`; what `html` still has for it is nobody's.
#[allow(dead_code)]
mod html;
mod labelmap;
mod pictures;
mod session_file;
mod words;

pub use html::Templates;
pub use labelmap::tissues as tissue_map;
pub use pictures::{SEEN, preview_png};
pub use session_file::{
    AnswerFile, DeviceFile, GradeFile, HardFailFile, ItemFile, QuestionnaireFile, RatingFile, ScenarioRef, SessionFile,
    StageFile,
};
pub use words::{harmless, measure as measure_in_words};
