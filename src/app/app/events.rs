//! Events that are taken over before each frame: of lessons, bundles, kiosks and of the window itself.

use super::{App, CloseState, repaint_waker};
use crate::AppOptions;
use crate::completion::{Completion, CompletionProgress};
use crate::exercise_list::OpenedExercise;
use crate::given_file::GivenFile;
use crate::hand_placement;
use crate::platform;
use crate::results::{BundleState, LessonResults};
use crate::screen::Screen;
use crate::ui::{shortcuts, theme};
use crate::zip_verification::ZipVerification;
use eframe::egui::{self, ViewportCommand};
use std::time::Duration;
use typodont_exercise::scenario::QuestionnaireTime;
use typodont_formats::{Library, decode_text};
use typodont_report::FirstResult;
use typodont_report::bundle::BundleFolder;

/// Frame interval of a running lesson.
const LESSON_FRAME_INTERVAL: Duration = Duration::from_millis(16);

/// Frame interval of the other screens: soon after an input, and at rest.
const BUSY_FRAME_INTERVAL: Duration = Duration::from_millis(100);
const IDLE_FRAME_INTERVAL: Duration = Duration::from_secs(2);

/// Time between two frames of a lesson whose clock stands still: whatever changes requests a frame by itself.
const STANDING_FRAME_INTERVAL: Duration = Duration::from_secs(4);

/// Time after an input during which a screen is busy, s.
const BUSY_TIME: f64 = 2.0;

impl App {
    /// Takes over all events since the last frame.
    pub(super) fn poll(&mut self, ctx: &egui::Context) {
        if let Screen::Editor(editor) = &mut self.screen {
            editor.poll(ctx.input(|input| input.time));
        }
        self.history.poll();
        self.poll_given_file(ctx);
        if let Some(why) = platform::keeping_failure() {
            let what = "the browser does not keep this session; save the results before you leave the page";
            self.complaints.push(format!("unkept-recording: {what} ({why})"));
        }
        self.poll_kiosk(ctx);
        for completion in &mut self.completions {
            completion.poll();
            match &completion.state().outcome {
                Some(Ok(bundle)) => finish_bundle(&self.options, bundle),
                Some(Err(why)) => self.complaints.push(why.clone()),
                None => {}
            }
        }
        self.completions.retain(|completion| completion.state().outcome.is_none());
        if let Screen::Lesson(lesson) = &mut self.screen
            && lesson.is_pointer_captured
            && !ctx.input(|input| input.focused)
        {
            lesson.release_pointer();
        }
        match &mut self.screen {
            Screen::Lesson(lesson) => {
                // A page that nobody sees stands still, and goes on where it stopped; so does a lesson behind another page.
                let is_asked = self.closing == CloseState::Asked || self.kiosk_exit.is_asked;
                let is_covered = self.overlay.shortcuts || self.overlay.settings || is_asked;
                lesson.set_hidden(is_covered || platform::IS_PAGE && is_hidden(ctx));
                let (elapsed, is_dragging, now) =
                    ctx.input(|input| (input.unstable_dt, input.pointer.any_down(), input.time));
                lesson.poll(self.settings.volume, elapsed);
                lesson.place_hand(hand_placement::frame_of(&lesson.orbit, &self.settings), is_dragging, now);
                self.skip_questionnaire();
                self.poll_lesson();
            }
            Screen::Completion(completion) => {
                completion.poll();
                self.poll_interrupted();
            }
            Screen::Results(results) if results.is_pending() => {
                results.poll(ctx);
                if let BundleState::Finished(bundle) = &results.state {
                    finish_bundle(&self.options, bundle);
                }
            }
            Screen::Verification(verification) => verification.poll(),
            _ => {}
        }
    }

    /// Verifies a file, or opens an exercise, that the user chose or dropped while the list or an earlier answer was shown.
    /// At any other time, and in a kiosk, files are ignored.
    fn poll_given_file(&mut self, ctx: &egui::Context) {
        let is_taking = match &self.screen {
            Screen::ExerciseList => true,
            Screen::Verification(verification) => verification.answer.is_some(),
            _ => false,
        };
        let is_covered = self.overlay.shortcuts || self.overlay.settings || self.closing != CloseState::No;
        // In a page, a bundle that is still being made would wait for the answer.
        let is_busy = platform::IS_PAGE && !self.completions.is_empty();
        let file = self.inbox.take();
        self.device_answer = self.device_inbox.take().or(self.device_answer.take());
        if !is_taking || is_covered || is_busy || self.options.kiosk().is_some() {
            return;
        }
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        if let Some(first) = dropped.first().cloned() {
            platform::receive_dropped(first, dropped.len() - 1, self.inbox.clone(), ctx);
        }
        let Some(file) = file.or_else(|| self.inbox.take()) else { return };
        if file.name.to_ascii_lowercase().ends_with(".json")
            && platform::opens_exercises()
            && !self.exercise_list.is_only
        {
            self.open_given(file);
        } else {
            let templates = self.options.templates.clone();
            let verification = ZipVerification::begin(file, templates, repaint_waker(ctx));
            self.screen = Screen::Verification(Box::new(verification));
        }
    }

    /// Adds an exercise that was given to the page to the list.
    fn open_given(&mut self, file: GivenFile) {
        let GivenFile { name, content, left_out } = file;
        self.screen = Screen::ExerciseList;
        self.exercise_list.complaint =
            (left_out > 0).then(|| format!("{name}: one file at a time: {left_out} more were not opened"));
        match content.read().and_then(|bytes| decode_text(&name, bytes).map_err(|complaint| complaint.headline())) {
            Ok(source) => {
                self.exercise_list.put_opened(OpenedExercise::of_file(source), Library::shipped(), None);
            }
            Err(why) => self.exercise_list.complaint = Some(why),
        }
    }

    /// Makes a kiosk ready for the next participant after some time without input, and keeps it on the whole screen.
    pub(super) fn poll_kiosk(&mut self, ctx: &egui::Context) {
        let Some(kiosk) = self.options.kiosk() else { return };
        let now = ctx.input(|input| input.time);
        let is_at_rest = matches!(self.screen, Screen::Briefing | Screen::Results(_) | Screen::Failed(_))
            || (matches!(self.screen, Screen::ExerciseList) && !self.participant.is_empty());
        let idle_limit = kiosk.idle.as_secs_f64();
        if !is_at_rest {
            // Whoever moves a haptic device touches neither the mouse nor the keyboard.
            self.last_input = now;
        } else if now - self.last_input > idle_limit {
            self.change_participant(ctx);
        }
        let (is_full, is_minimized) =
            ctx.input(|input| (input.viewport().fullscreen, input.viewport().minimized.unwrap_or(false)));
        // A covered window is brought to the whole screen when it is seen again.
        if is_minimized || (is_full == Some(false) && !is_hidden(ctx)) {
            ctx.send_viewport_cmd(ViewportCommand::Minimized(false));
            ctx.send_viewport_cmd(ViewportCommand::Fullscreen(true));
        }
    }

    /// Shows the result of the lesson once it is scored, or the reason why there is none.
    pub(super) fn poll_lesson(&mut self) {
        let Screen::Lesson(lesson) = &mut self.screen else { return };
        if let Some(first) = lesson.completion.first_result.take() {
            if let Some(ended) = lesson.ended {
                self.state_log.record("result_after_ms", ended.elapsed().as_millis());
            }
            if let Screen::Lesson(lesson) = std::mem::replace(&mut self.screen, Screen::ExerciseList) {
                let is_test_run = self.test_run_origin.is_some();
                self.show_results(*first, Completion::of_lesson(lesson), !is_test_run);
            }
        } else if let Some(Err(why)) = lesson.completion.outcome.take() {
            if let Some(former) = lesson.former.take() {
                self.history.put_back(former);
            }
            self.screen = Screen::Failed(why);
        }
    }

    /// Shows the result of an interrupted session once it is scored, or the reason why there is none.
    pub(super) fn poll_interrupted(&mut self) {
        let Screen::Completion(completion) = &mut self.screen else { return };
        if let Some(first) = completion.take_first_result() {
            let has_retry = self.exercise_list.select_id(&first.session.scenario.id);
            if let Screen::Completion(completion) = std::mem::replace(&mut self.screen, Screen::ExerciseList) {
                self.show_results(*first, *completion, has_retry);
            }
        } else if let Some(Err(why)) = completion.state().outcome.clone() {
            self.screen = Screen::Failed(why);
        }
    }

    pub(super) fn show_results(&mut self, first: FirstResult, completion: Completion, has_retry: bool) {
        if self.test_run_origin.is_none() {
            self.complaints.extend(self.history.add(&first.session));
        }
        let has_report = self.options.kiosk().is_none();
        self.screen = Screen::Results(Box::new(LessonResults::new(first, completion, has_retry, has_report)));
    }

    /// Ends a lesson without its questionnaire if the exercise asks it at the end of the course, and that is not yet.
    pub(super) fn skip_questionnaire(&mut self) {
        let Screen::Lesson(lesson) = &mut self.screen else { return };
        if !lesson.are_stages_over || lesson.is_submitted || lesson.is_questionnaire_due {
            return;
        }
        let course = self.exercise_list.course();
        let scenario = &lesson.scenario;
        lesson.is_questionnaire_due = self.test_run_origin.is_some()
            || scenario.questionnaire_time == QuestionnaireTime::EachTime
            || self.history.is_course_over(scenario, &course, &self.participant);
        if !lesson.is_questionnaire_due {
            lesson.submit_questionnaire();
        }
    }

    /// Progress of a bundle that is being made in the background.
    pub(super) fn background_progress(&self) -> Option<CompletionProgress> {
        self.completions.first().map(|completion| completion.state().progress)
    }

    /// Delays a request to close the window while a lesson runs and until its bundle is written.
    pub(super) fn handle_close_request(&mut self, ctx: &egui::Context) {
        let is_asked = ctx.input(|input| input.viewport().close_requested());
        if is_asked && self.options.kiosk().is_some() && !self.kiosk_exit.is_allowed {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.overlay = shortcuts::OverlayState::default();
            return self.kiosk_exit.ask(true);
        }
        let is_in_lesson = matches!(self.screen, Screen::Lesson(_));
        let is_completing = !self.completions.is_empty()
            || match &self.screen {
                Screen::Lesson(lesson) => lesson.is_scoring,
                Screen::Completion(_) => true,
                Screen::Results(results) => results.is_pending(),
                _ => false,
            };
        if ctx.input(|input| input.viewport().close_requested())
            && let Screen::Editor(editor) = &mut self.screen
        {
            editor.autosave();
        }
        if ctx.input(|input| input.viewport().close_requested()) && (is_in_lesson || is_completing) {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            if is_completing {
                self.closing = CloseState::AfterLesson;
            } else if self.closing == CloseState::No {
                self.overlay = shortcuts::OverlayState::default();
                self.closing = CloseState::Asked;
            }
        }
        // A request can be lost, and is repeated until the window has closed.
        let is_wanted = self.closing == CloseState::AfterLesson || self.kiosk_exit.is_allowed;
        if is_wanted && !is_in_lesson && !is_completing {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    /// True if work would be lost with a page that is closed now.
    pub(super) fn has_unsaved_work(&self) -> bool {
        match &self.screen {
            Screen::Lesson(_) | Screen::Completion(_) => true,
            Screen::Results(results) => !results.is_downloaded,
            // The draft is saved one second after the last change.
            Screen::Editor(editor) if editor.has_unsaved_draft() => true,
            _ => !self.completions.is_empty() || self.exercise_list.has_unkept(),
        }
    }

    /// Time until the next frame, if nothing requests one before.
    pub(super) fn frame_interval(&mut self, ctx: &egui::Context) -> Duration {
        let now = ctx.input(|input| input.time);
        if ctx.input(|input| !input.events.is_empty()) {
            self.last_input = now;
        }
        let is_view_active = self.views.lesson.is_active(now);
        match &self.screen {
            Screen::Lesson(lesson) if lesson.needs_frames() => Duration::ZERO,
            // Building the workpiece needs the processors; when it is built, the lesson's thread requests a frame.
            Screen::Lesson(lesson) if lesson.scene.is_none() => theme::PROGRESS_DOT_INTERVAL,
            // The eyes change with every frame of the screen.
            Screen::Lesson(lesson) if !lesson.are_stages_over && self.settings.is_frame_sequential() => Duration::ZERO,
            Screen::Lesson(lesson) if !lesson.are_stages_over => {
                let is_hand_moving = lesson.pointer_hand.is_pressing || lesson.is_hand_placement_pending();
                match is_view_active || is_hand_moving {
                    true => LESSON_FRAME_INTERVAL,
                    false if lesson.is_awaiting_movement || lesson.is_standing_still() => STANDING_FRAME_INTERVAL,
                    // Only the clock moves. Movement of the hand requests a frame at once.
                    false => lesson.time_to_next_second(),
                }
            }
            Screen::Completion(completion) if completion.needs_frames() => Duration::ZERO,
            Screen::Editor(editor) if editor.needs_frames() => BUSY_FRAME_INTERVAL,
            Screen::Verification(verification) if verification.needs_frames() => Duration::ZERO,
            Screen::Verification(verification) if verification.answer.is_none() => theme::PROGRESS_DOT_INTERVAL,
            _ if now - self.last_input < BUSY_TIME => BUSY_FRAME_INTERVAL,
            _ => IDLE_FRAME_INTERVAL,
        }
    }
}

/// Tells of a bundle that has just been finished.
fn finish_bundle(options: &AppOptions, bundle: &BundleFolder) {
    if let Some(listener) = &options.on_bundle {
        listener(bundle);
    }
}

/// Returns true if the window is known to be minimised or covered, or the page to be in the background.
pub(super) fn is_hidden(ctx: &egui::Context) -> bool {
    ctx.input(|input| input.viewport().visible()) == Some(false)
}
