//! The making of a bundle after its session: of a lesson in this window, or of a session that was interrupted.

use crate::lesson_state::LessonState;
use crate::platform;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use typodont_lesson::InterruptedSession;
use typodont_report::bundle::{BundleFolder, CompletionStep};
use typodont_report::{FirstResult, Templates};

/// State of a completion, as far as its steps have been reported.
#[derive(Default)]
pub struct CompletionState {
    pub progress: CompletionProgress,
    pub first_result: Option<Box<FirstResult>>,
    /// The bundle, or the reason why there is none.
    pub outcome: Option<Result<BundleFolder, String>>,
}

/// Progress of a completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionProgress {
    /// Text key of the present step.
    pub key: &'static str,
    /// Share that is done, by the usual duration of the steps.
    pub share: f32,
}

impl Default for CompletionProgress {
    fn default() -> CompletionProgress {
        CompletionProgress { key: "completion.scoring", share: 0.0 }
    }
}

impl CompletionState {
    pub fn apply(&mut self, step: CompletionStep) {
        let (key, share) = match step {
            CompletionStep::Scoring => ("completion.scoring", 0.0),
            CompletionStep::Scored(first) => {
                self.first_result = Some(first);
                ("completion.maps", 0.15)
            }
            CompletionStep::Maps => ("completion.maps", 0.15),
            CompletionStep::Surfaces => ("completion.surfaces", 0.25),
            CompletionStep::Pictures { done, all } => {
                ("completion.pictures", 0.3 + 0.5 * done as f32 / all.max(1) as f32)
            }
            CompletionStep::Page => ("completion.page", 0.8),
            CompletionStep::Saving => ("completion.saving", 0.95),
        };
        self.progress = CompletionProgress { key, share };
    }
}

/// A bundle that is being made.
pub struct Completion(CompletionSource);

enum CompletionSource {
    Lesson(Box<LessonState>),
    Interrupted(InterruptedCompletion),
    Kept(Box<KeptCompletion>),
}

/// The completion of an interrupted session, on a thread of its own.
struct InterruptedCompletion {
    messages: Receiver<CompletionMessage>,
    state: CompletionState,
}

/// The completion of an interrupted session in a page, which has no threads: within a frame.
struct KeptCompletion {
    /// `None` once it is done.
    session: Option<(InterruptedSession, Templates)>,
    /// Frames that are still drawn before, so that the screen says what is being done.
    frames_left: u32,
    state: CompletionState,
}

enum CompletionMessage {
    Step(CompletionStep),
    Ended(Result<BundleFolder, String>),
}

impl Completion {
    /// The completion of a lesson whose stages are over.
    pub fn of_lesson(mut lesson: Box<LessonState>) -> Completion {
        // The drawn scene is the largest part of a lesson, and no longer needed.
        lesson.scene = None;
        Completion(CompletionSource::Lesson(lesson))
    }

    /// Completes an interrupted session. `wake` is called after every step.
    pub fn of_interrupted(
        session: InterruptedSession,
        templates: Templates,
        wake: Box<dyn Fn() + Send>,
    ) -> std::io::Result<Completion> {
        if platform::IS_PAGE {
            let state = CompletionState::default();
            let kept = KeptCompletion {
                session: Some((session, templates)),
                frames_left: platform::FRAMES_BEFORE_LONG_STEP,
                state,
            };
            return Ok(Completion(CompletionSource::Kept(Box::new(kept))));
        }
        let (sender, messages) = mpsc::channel();
        std::thread::Builder::new().name("completion".into()).spawn(move || {
            // The window may be closed meanwhile; the bundle is made in any case.
            let send = |message| {
                let _ = sender.send(message);
                wake();
            };
            let ended = session.finish(&templates, &mut |step| send(CompletionMessage::Step(step)));
            send(CompletionMessage::Ended(ended.map(|completed| completed.folder)));
        })?;
        let state = CompletionState::default();
        Ok(Completion(CompletionSource::Interrupted(InterruptedCompletion { messages, state })))
    }

    /// Takes over all steps since the last call.
    pub fn poll(&mut self) {
        match &mut self.0 {
            CompletionSource::Lesson(lesson) => lesson.poll_completion(),
            CompletionSource::Interrupted(completion) => completion.poll(),
            CompletionSource::Kept(completion) => completion.poll(),
        }
    }

    /// True if the completion goes on only with further frames.
    pub fn needs_frames(&self) -> bool {
        matches!(&self.0, CompletionSource::Kept(kept) if kept.session.is_some())
    }

    pub fn state(&self) -> &CompletionState {
        match &self.0 {
            CompletionSource::Lesson(lesson) => &lesson.completion,
            CompletionSource::Interrupted(completion) => &completion.state,
            CompletionSource::Kept(completion) => &completion.state,
        }
    }

    pub fn take_first_result(&mut self) -> Option<Box<FirstResult>> {
        match &mut self.0 {
            CompletionSource::Lesson(lesson) => lesson.completion.first_result.take(),
            CompletionSource::Interrupted(completion) => completion.state.first_result.take(),
            CompletionSource::Kept(completion) => completion.state.first_result.take(),
        }
    }
}

impl InterruptedCompletion {
    fn poll(&mut self) {
        loop {
            match self.messages.try_recv() {
                Ok(CompletionMessage::Step(step)) => self.state.apply(step),
                Ok(CompletionMessage::Ended(ended)) => self.state.outcome = Some(ended),
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    let why = "unmade-bundle: the session could not be scored; please report this".to_string();
                    self.state.outcome.get_or_insert(Err(why));
                    return;
                }
            }
        }
    }
}

impl KeptCompletion {
    fn poll(&mut self) {
        if self.frames_left > 0 {
            self.frames_left -= 1;
            return;
        }
        let Some((session, templates)) = self.session.take() else { return };
        let state = &mut self.state;
        let ended = session.finish(&templates, &mut |step| state.apply(step));
        state.outcome = Some(ended.map(|completed| completed.folder));
    }
}
