//! A lesson within the window's frames, for a page in a browser, which has no threads.

use super::lesson_backend::LessonBackend;
use super::lesson_run::LessonRun;

/// Frames that are drawn before a long step, so that the screen says what is being done.
const FRAMES_BEFORE_LONG_STEP: u32 = 2;

pub struct InlineLesson {
    /// `None` when the lesson is over.
    run: Option<LessonRun>,
    /// Frames since the last step.
    waited: u32,
}

impl InlineLesson {
    pub fn new(run: LessonRun) -> InlineLesson {
        InlineLesson { run: Some(run), waited: 0 }
    }
}

impl LessonBackend for InlineLesson {
    fn advance(&mut self) {
        let Some(run) = &mut self.run else { return };
        if run.is_next_step_long() && self.waited < FRAMES_BEFORE_LONG_STEP {
            self.waited += 1;
            return;
        }
        self.waited = 0;
        if !run.advance() {
            // The window learns from the abandoned queue that nothing follows.
            self.run = None;
        }
    }

    fn needs_frames(&self) -> bool {
        self.run.is_some()
    }
}
