//! Screens of the window.

use super::completion::Completion;
use super::editor::EditorState;
use super::lesson_state::LessonState;
use super::results::LessonResults;

/// The screen that is shown.
pub enum Screen {
    ExerciseList,
    Briefing,
    Editor(Box<EditorState>),
    Lesson(Box<LessonState>),
    /// An interrupted session is being scored.
    Completion(Box<Completion>),
    Results(Box<LessonResults>),
    /// The lesson or its bundle failed; holds the reason.
    Failed(String),
}
