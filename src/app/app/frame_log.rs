//! The state of the screen for tests that cannot see it, written to the state log.

use super::{App, CloseState};
use crate::editor::EditorState;
use crate::lesson_state::LessonState;
use crate::messages::{PauseReason, SecondHandStatus};
use crate::results::BundleState;
use crate::screen::Screen;
use crate::state_log::StateLog;
use crate::ui::lesson_view::LessonView;
use typodont_core::frame::Vec3;

impl App {
    /// Writes the state of the screen to the state log, a line per change.
    pub(super) fn log_state(&mut self) {
        let App { state_log, screen, exercise_list, overlay: open, closing, frame_count, kiosk_exit, .. } = self;
        state_log.record("kiosk", kiosk_exit.state());
        state_log.record("complaint", self.complaints.last().map_or("", String::as_str));
        let view = &self.views.lesson;
        let (history, participant, settings) = (&self.history, &self.participant, &self.settings);
        state_log.record(
            "over",
            if open.shortcuts {
                "keys"
            } else if open.settings {
                "settings"
            } else if *closing == CloseState::Asked {
                "close"
            } else {
                "nothing"
            },
        );
        match screen {
            Screen::ExerciseList => {
                state_log.record("unfinished", u8::from(history.interrupted().is_some()));
                let chosen = exercise_list.selected_exercise().map_or("", |e| e.id());
                let summary = history.summary(chosen, participant);
                state_log.record("done", format!("{} {}", summary.count, summary.is_passed));
                let required = exercise_list.required_before(exercise_list.selected, history, participant, settings);
                state_log.record("required", required.map_or("nothing", |first| first.id()));
                state_log.record("screen", "shelf");
                state_log.record("chosen", exercise_list.selected_exercise().map_or("", |e| e.id()));
            }
            Screen::Editor(editor) => {
                log_editor(state_log, editor);
                state_log.record("turn", *frame_count);
            }
            Screen::Briefing => state_log.record("screen", "briefing"),
            Screen::Lesson(lesson) => log_lesson(state_log, lesson, view),
            Screen::Completion(_) => state_log.record("screen", "scoring"),
            Screen::Results(results) => {
                if let BundleState::Finished(bundle) = &results.state {
                    state_log.record("bundle", bundle.path().display());
                }
                state_log.record("screen", "results");
            }
            Screen::Verification(verification) => {
                state_log.record("verification", verification.answer_word());
                state_log.record("screen", "verification");
            }
            Screen::Failed(why) => state_log.record("screen", format!("failed {why}")),
        }
    }
}

fn log_editor(log: &mut StateLog, editor: &EditorState) {
    log.record("part", format!("{:?}", editor.section));
    log.record("file", editor.path.as_ref().map_or(String::new(), |path| path.display().to_string()));
    log.record("unsaved", editor.is_unsaved());
    log.record("complaints", editor.complaints.len());
    log.record("checked", editor.is_checked);
    log.record("teeth", editor.preview.generation);
    log.record("told", editor.notice.as_ref().map_or("", |(key, _)| key));
    let chosen = editor.selected_decay_pointer().and_then(|at| Some(editor.draft.value_at(&at)?.to_string()));
    log.record("decay", chosen.unwrap_or_default());
    log.record("screen", "author");
}

fn log_lesson(log: &mut StateLog, lesson: &LessonState, view: &LessonView) {
    if lesson.is_scoring {
        log.record("screen", "scoring");
    } else if lesson.are_stages_over {
        log.record("statement", lesson.statement);
        log.record("rated", lesson.ratings.len());
        log.record("screen", "questionnaire");
    } else {
        log.record("screen", if lesson.stage.is_some() { "practice" } else { "making" });
    }
    if let Some(stage) = lesson.stage {
        log.record("stage", stage);
    }
    log.record("pointer", if lesson.is_pointer_captured { "held" } else { "free" });
    log.record("paused", lesson.is_paused);
    log.record("standstill", lesson.pause_reason.as_ref().map_or("", PauseReason::key));
    log.record("clock", if lesson.is_awaiting_movement { "stopped" } else { "running" });
    log.record("asked", if lesson.is_confirming_finish { "finish" } else { "nothing" });
    if let Some(SecondHandStatus::AwaitingConnection(address)) = lesson.second_hand {
        log.record("may_join", address);
    }
    log.record("hand_frame", if lesson.is_hand_placement_pending() { "pending" } else { "placed" });
    let cross = lesson.registration.as_ref().map(|draft| (draft.next_cross() + 1, lesson.can_touch_cross));
    log.record(
        "cross",
        cross.map_or("none".into(), |(n, is_ready)| format!("{n}{}", if is_ready { " ready" } else { "" })),
    );
    log.record("clutch", if lesson.is_clutch_pressed { "pressed" } else { "free" });
    let [x, y, z] = lesson.orbit.middle.to_array();
    log.record("seen", format!("{x:.2} {y:.2} {z:.2}"));
    log.record("high", format!("{:.2}", lesson.orbit.height_at_middle()));
    log.record("view", format!("{:.4} {:.4}", lesson.orbit.azimuth, lesson.orbit.elevation));
    if let Some(scene) = &lesson.scene {
        log.record("open", scene.mouth_opening);
        log.record("dust", view.particles().opaque().len());
        log.record("water", view.particles().translucent().len());
    }
    log.record("tooth", if view.has_volume() { "drawn" } else { "made" });
    log.record("shown", format!("{:?}", lesson.display_mode));
    if let Some(snapshot) = lesson.snapshot {
        let [x, y, z] = snapshot.hand.to_array();
        log.record("hand", format!("{x:.2} {y:.2} {z:.2}"));
        let [x, y, z] = snapshot.tip.to_array();
        log.record("tip", format!("{x:.2} {y:.2} {z:.2}"));
        let [x, y, z] = (snapshot.orientation * Vec3::Z).to_array();
        log.record("handle", format!("{x:.2} {y:.2} {z:.2}"));
        log.record("force", format!("{:.2}", snapshot.spring));
        log.record("cleared", format!("{:.0}", snapshot.cleared_pct.unwrap_or_default()));
        log.record("instrument", snapshot.instrument);
        log.record("ticks", snapshot.timing.ticks);
        log.record(
            "late",
            format!("{} {} {}", snapshot.timing.late_p99, snapshot.timing.late_max, snapshot.timing.missed),
        );
    }
}
