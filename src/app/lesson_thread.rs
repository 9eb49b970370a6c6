//! A lesson on a thread of its own, which polls the servo every few milliseconds, whatever the window does.

use crate::lesson_backend::LessonBackend;
use crate::lesson_run::LessonRun;
use std::thread::JoinHandle;
use web_time::Duration;

/// Poll interval of the thread; a screen cannot show changes faster.
const POLL_INTERVAL: Duration = Duration::from_millis(4);

/// The thread; joined when it is dropped.
pub struct LessonThread(Option<JoinHandle<()>>);

impl LessonThread {
    /// Starts a lesson.
    ///
    /// # Errors
    /// The system's error if the thread cannot be started.
    pub fn start(mut run: LessonRun) -> std::io::Result<LessonThread> {
        let thread = std::thread::Builder::new().name("lesson".into()).spawn(move || {
            while run.advance() {
                std::thread::sleep(POLL_INTERVAL);
            }
        })?;
        Ok(LessonThread(Some(thread)))
    }
}

impl LessonBackend for LessonThread {
    fn advance(&mut self) {}

    fn pass_on(&mut self) {}

    fn needs_frames(&self) -> bool {
        false
    }
}

impl Drop for LessonThread {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            let _ = thread.join();
        }
    }
}
