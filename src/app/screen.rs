//! Screens of the window.

use crate::completion::Completion;
use crate::editor::EditorState;
use crate::lesson_state::LessonState;
use crate::results::LessonResults;
use crate::zip_verification::ZipVerification;

/// The screen that is shown.
pub enum Screen {
    ExerciseList,
    Briefing,
    Editor(Box<EditorState>),
    Lesson(Box<LessonState>),
    /// An interrupted session is being scored.
    Completion(Box<Completion>),
    Results(Box<LessonResults>),
    /// A result that was handed in is being verified, or was.
    Verification(Box<ZipVerification>),
    /// The lesson or its bundle failed; holds the reason.
    Failed(String),
}
