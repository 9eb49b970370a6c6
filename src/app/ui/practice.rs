//! The practice screen: the view of the tooth, the task, the instrument in use and the force applied.

use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use crate::messages;
use crate::pointer_hand::PointerKind;
use crate::settings::{Settings, StereoMode};
use crate::snapshot::LessonSnapshot;
use crate::ui::lesson_view::PictureFrame;
use crate::ui::viewport::Viewport;
use crate::ui::views::Views;
use crate::ui::{
    case_pictures, controls_guide, periodontal_chart, questions, registration_view, section_view, shutter_glasses,
    theme, tools_panel, viewport_input,
};
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};
use typodont_core::frame::Vec3;
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::scenario::{ContactLimit, LimitPlace, LimitedQuantity};
use typodont_render::Eye;
use typodont_scene as scene;

/// Full width of the force bar, N: the maximum force of a PHANTOM Omni.
const BAR_FULL: f32 = 3.3;

/// Width of the view under which it is narrow, points.
const NARROW: f32 = 700.0;

/// Formats a time, s, as minutes and seconds.
pub fn format_time(seconds: f64) -> String {
    let whole = seconds.max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

/// The whole screen.
pub fn practice_ui(
    ui: &mut egui::Ui,
    lesson: &LessonState,
    settings: &Settings,
    views: &mut Views,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    // The window is cleared in the panels' colour; filling them again would cost as much as drawing the tooth where there
    // is no graphics processor.
    let side = egui::Frame::side_top_panel(ui.style()).inner_margin(16).fill(Color32::TRANSPARENT);
    let width = ui.available_width();
    let cost = views.lesson.picture_cost(settings, views.viewport.as_ref());
    let sides = [310.0f32.min(0.28 * width), 250.0f32.min(0.24 * width)];
    // In a narrow middle the words stand under the bar.
    let is_narrow = width - sides[0] - sides[1] < NARROW;
    egui::Panel::left("task").exact_size(sides[0]).resizable(false).frame(side).show(ui, |ui| {
        scroll_area(ui, |ui| task_ui(ui, lesson, words, commands));
    });
    egui::Panel::right("menu").exact_size(sides[1]).resizable(false).frame(side).show(ui, |ui| {
        scroll_area(ui, |ui| tools_panel::tools_panel_ui(ui, lesson, &cost, words, commands));
    });
    egui::Panel::bottom("force")
        .exact_size(if is_narrow { 128.0 } else { 64.0 })
        .resizable(false)
        .frame(side)
        .show(ui, |ui| force_ui(ui, lesson, is_narrow, words));
    egui::CentralPanel::no_frame().show(ui, |ui| view_ui(ui, lesson, settings, views, words, commands));
}

/// An area as wide as its panel: what is wider is scrolled to, and moves no panel.
fn scroll_area(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    let width = ui.available_width();
    egui::ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.set_max_width(width);
        contents(ui);
    });
}

/// The stage, its time, its questions and its end.
fn task_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    let scenario = &lesson.scenario;
    let Some(stage) = lesson.stage.and_then(|stage| scenario.stages.get(stage)) else {
        ui.label(words.get("practice.making"));
        theme::progress_dots(ui);
        return;
    };
    let number = lesson.stage.unwrap_or_default() + 1;
    ui.weak(format!("{} {number} / {}", words.get("practice.stage"), scenario.stages.len()));
    ui.heading(words.own(&scenario.texts, &stage.title));
    ui.label(words.own(&scenario.texts, &stage.instruction));
    case_pictures::titles_ui(ui, scenario, words, commands);
    ui.add_space(8.0);
    time_ui(ui, stage.time_limit, lesson.snapshot.as_ref(), words);
    if lesson.is_awaiting_movement {
        ui.colored_label(theme::ACCENT, words.get("practice.clock_stopped"));
    }
    if let Some(before) = &lesson.timed_out_stage {
        ui.colored_label(theme::WARNING, words.format("practice.time_up", words.own(&scenario.texts, before)));
    }
    if stage.show_decay
        && stage.cutting
        && let Some(cleared) = lesson.snapshot.and_then(|seen| seen.cleared_pct)
    {
        let left = 100.0 - cleared;
        // Towards the end every stroke is to be seen in the number.
        let digits = usize::from(left < 9.95);
        ui.label(words.format("practice.left", format!("{left:.digits$}")));
        ui.add(egui::ProgressBar::new(left / 100.0).fill(theme::ACCENT).desired_height(10.0));
    }
    ui.add_space(8.0);
    if let Some(second) = &lesson.second_hand {
        ui.label(words.format("practice.second", second.text(words)));
    }
    if let Some(why) = &lesson.pause_reason {
        ui.colored_label(theme::WARNING, words.format("practice.standstill", why.text(words)));
    }
    if lesson.is_paused {
        ui.colored_label(theme::WARNING, words.get("practice.paused"));
    }
    questions::questions_ui(ui, stage, lesson, words, commands);
    periodontal_chart::periodontal_chart_ui(ui, stage, lesson, words, commands);
    ui.add_space(12.0);
    if stage.ends.confirmed {
        // A row, so that the text stands in the button's middle.
        let done = ui.horizontal(|ui| ui.add(theme::primary_button(words.get("practice.done")))).inner;
        if done.clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::FinishStage));
        }
    }
    if lesson.is_confirming_finish {
        confirm_finish_ui(ui.ctx(), words, commands);
    }
    if let Some(why) = &lesson.refusal_key {
        ui.colored_label(theme::ERROR, words.format("practice.refused", words.get(why)));
    }
    ui.add_space(16.0);
    let key = if lesson.is_paused { "practice.resume" } else { "practice.pause" };
    if ui.button(words.get(key)).clicked() {
        commands.push(AppCommand::Practice(PracticeCommand::Pause(!lesson.is_paused)));
    }
    ui.add_space(8.0);
    abort_ui(ui, lesson, words, commands);
}

/// The question before a stage ends, over the screen, so that no click that was meant for another button ends it.
fn confirm_finish_ui(ctx: &egui::Context, words: &Translations, commands: &mut Vec<AppCommand>) {
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(24);
    let shown = egui::Modal::new(egui::Id::unique("finish")).frame(frame).show(ctx, |ui| {
        ui.set_max_width(440.0);
        ui.heading(words.get("practice.finish_sure"));
        ui.label(words.get("practice.finish_about"));
        ui.add_space(8.0);
        ui.horizontal_wrapped(|ui| {
            if ui.add(theme::primary_button(words.get("practice.finish_yes"))).clicked() {
                commands.push(AppCommand::Practice(PracticeCommand::FinishStage));
            }
            if ui.button(words.get("practice.finish_no")).clicked() {
                commands.push(AppCommand::Practice(PracticeCommand::ContinueStage));
            }
        });
    });
    if shown.should_close() {
        commands.push(AppCommand::Practice(PracticeCommand::ContinueStage));
    }
}

fn time_ui(ui: &mut egui::Ui, limit: Option<f64>, snapshot: Option<&LessonSnapshot>, words: &Translations) {
    /// Remaining time from which it is shown as a warning, s.
    const SHORT: f64 = 30.0;
    let elapsed = snapshot.map_or(0.0, |seen| f64::from(seen.stage_seconds));
    let (text, colour) = match limit {
        Some(limit) if limit - elapsed < SHORT => {
            (words.format("practice.time_left", format_time((limit - elapsed).ceil())), theme::WARNING)
        }
        Some(limit) => (words.format("practice.time_left", format_time((limit - elapsed).ceil())), theme::ACCENT),
        None => (words.format("practice.time", format_time(elapsed)), theme::ACCENT),
    };
    ui.label(egui::RichText::new(text).size(20.0).strong().color(colour));
}

fn abort_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    if ui.button(words.get("practice.give_up")).clicked() {
        commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(true)));
    }
    if lesson.is_confirming_abort {
        confirm_abort_ui(ui.ctx(), words, commands);
    }
}

/// The question before an exercise ends, over the screen. Enter continues, unless another button is chosen.
fn confirm_abort_ui(ctx: &egui::Context, words: &Translations, commands: &mut Vec<AppCommand>) {
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(24);
    let shown = egui::Modal::new(egui::Id::unique("abort")).frame(frame).show(ctx, |ui| {
        ui.set_max_width(440.0);
        ui.label(words.get("practice.give_up_sure"));
        ui.add_space(8.0);
        ui.horizontal_wrapped(|ui| {
            let stay = ui.add(theme::primary_button(words.get("practice.give_up_no")));
            if ui.memory(|memory| memory.focused().is_none()) {
                stay.request_focus();
            }
            if stay.clicked() {
                commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(false)));
            }
            if ui.button(words.get("practice.give_up_yes")).clicked() {
                commands.push(AppCommand::Practice(PracticeCommand::Abort));
            }
        });
    });
    if shown.should_close() {
        commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(false)));
    }
}

/// Force applied by the trainee, as a bar, with a warning about tissue that should not be touched.
fn force_ui(ui: &mut egui::Ui, lesson: &LessonState, is_narrow: bool, words: &Translations) {
    /// Width of the bar, and of the label and the number beside it, points.
    const BAR: f32 = 260.0;
    const BESIDE: f32 = 140.0;
    let snapshot = lesson.snapshot.unwrap_or_default();
    let force = snapshot.spring;
    let bar = |ui: &mut egui::Ui| {
        let width = BAR.min(ui.available_width() - BESIDE).max(40.0);
        ui.strong(words.get("practice.force"));
        let (rect, response) = ui.allocate_exact_size(egui::vec2(width, 22.0), Sense::hover());
        let label = words.get("practice.force").to_string();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Meter, true, format!("{label} {force:.1} N")));
        let painter = ui.painter();
        painter.rect_filled(rect, 5, Color32::from_gray(0xe2));
        let width = rect.width() * (force / BAR_FULL).clamp(0.0, 1.0);
        let fill = if is_force_high(lesson, &snapshot) { theme::WARNING } else { theme::ACCENT };
        painter.rect_filled(Rect::from_min_size(rect.min, egui::vec2(width, rect.height())), 5, fill);
        if let Some(strength) = lesson.press_strength() {
            let x = rect.min.x + rect.width() * (strength / BAR_FULL).clamp(0.0, 1.0);
            painter.vline(x, rect.y_range(), Stroke::new(2.5, theme::ACCENT));
        }
        response.on_hover_text(words.get("practice.force_about"));
        ui.monospace(format!("{force:4.1} N"));
    };
    // There is no room for both.
    let text = |ui: &mut egui::Ui| match (warning(lesson, &snapshot, words), lesson.press_strength()) {
        (Some(text), _) => {
            let text = egui::RichText::new(format!("! {text}")).strong().color(theme::ERROR);
            ui.add(egui::Label::new(text).wrap());
        }
        (None, Some(strength)) => {
            let mut text = words.format("practice.strength", format!("{strength:.1}"));
            let tilt = lesson.pointer_hand.tilt().to_degrees().round();
            if tilt > 0.0 {
                text = format!("{text} · {}", words.format("practice.tilt", tilt));
            }
            let text = egui::RichText::new(text).weak();
            ui.add(egui::Label::new(text).wrap());
        }
        (None, None) => {}
    };
    if is_narrow {
        ui.horizontal(bar);
        text(ui);
    } else {
        ui.horizontal_centered(|ui| {
            bar(ui);
            text(ui);
        });
    }
}

/// Warning about the trainee's present action, if there is one: of tissue that a bur must not touch, of a limit of the
/// exercise near a zone or a tissue, of sound tissue, and of the limits that hold anywhere.
fn warning(lesson: &LessonState, snapshot: &LessonSnapshot, words: &Translations) -> Option<String> {
    let cuts = lesson.scenario.instruments.get(snapshot.instrument as usize).is_some_and(|i| i.is_bur());
    let is_cutting = cuts && lesson.stage().is_some_and(|stage| stage.cutting);
    let limit = exceeded_limit(lesson, snapshot);
    let of_limit = || Some(messages::limit_text(limit?, snapshot.warning?.peak, &lesson.scenario, words));
    let text = |key| Some(words.get(key).to_string());
    match snapshot.touch.and_then(|label| lesson.scenario.tissues.role(label)) {
        _ if snapshot.is_hand_blocked && !lesson.is_standing_still() => text("practice.blocked"),
        Some(TissueRole::Soft) if is_cutting => text("practice.warn_soft"),
        Some(TissueRole::Neighbour) if is_cutting => text("practice.warn_neighbour"),
        Some(TissueRole::Vulnerable) if is_cutting => text("practice.warn_pulp"),
        _ if limit.is_some_and(|limit| limit.place != LimitPlace::Anywhere) => of_limit(),
        Some(TissueRole::Sound) if snapshot.cutting && lesson.is_decay_shown() => text("practice.warn_sound"),
        _ => of_limit(),
    }
}

/// The limit of which a warning is shown.
fn exceeded_limit<'a>(lesson: &'a LessonState, snapshot: &LessonSnapshot) -> Option<&'a ContactLimit> {
    lesson.scenario.limits.get(snapshot.warning?.limit as usize)
}

/// True while a warning of too much force is shown.
fn is_force_high(lesson: &LessonState, snapshot: &LessonSnapshot) -> bool {
    exceeded_limit(lesson, snapshot).is_some_and(|limit| limit.quantity == LimitedQuantity::Force)
}

/// The view of the tooth and the instrument, with the state of the pointer.
fn view_ui(
    ui: &mut egui::Ui,
    lesson: &LessonState,
    settings: &Settings,
    views: &mut Views,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    // The crosses are in the picture of one eye.
    let in_mono = lesson.registration.as_ref().map(|_| Settings { stereo: StereoMode::Off, ..settings.clone() });
    let settings = in_mono.as_ref().unwrap_or(settings);
    let rect = ui.available_rect_before_wrap();
    let view = ui.interact(rect, ui.scope_id().with("view"), Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.get("practice.view")));
    viewport_input::collect_commands(ui, &view, lesson.is_pointer_captured, commands);
    let scale = ui.pixels_per_point();
    let size = [rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32);
    if lesson.scene.is_some() && views.viewport.is_some() {
        let aspect = size[0] as f32 / size[1] as f32;
        commands.push(AppCommand::Practice(PracticeCommand::RecordView(aspect)));
    }
    let frame = PictureFrame { size, now: ui.input(|input| input.time) };
    let Views { viewport, lesson: view, .. } = views;
    let drawn = viewport.as_mut().map(|viewport| view.draw(lesson, settings, viewport, frame, commands));
    match drawn {
        Some(Ok(Some(id))) => {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            let takes_turn = settings.is_frame_sequential() && shutter_glasses::is_right_eye(ui.ctx());
            let right = viewport.as_ref().and_then(Viewport::second_eye_texture).filter(|_| takes_turn);
            ui.painter().image(right.unwrap_or(id), rect, whole, Color32::WHITE);
            if settings.is_frame_sequential() {
                shutter_glasses::eye_mark_ui(ui.ctx(), settings.mirrored);
            }
            if settings.stereo().is_none() {
                pointer_ring(ui, lesson, rect);
            }
            if is_section_allowed(lesson) {
                section_view::section_ui(ui, rect, lesson, &mut view.section, words);
            }
            match &lesson.registration {
                Some(draft) => {
                    registration_view::registration_ui(ui, rect, draft, lesson.can_touch_cross, words, commands);
                }
                None => controls_guide::controls_guide_ui(ui, lesson, rect, words),
            }
        }
        Some(Ok(None)) => {
            ui.painter().rect_filled(rect, 0, Color32::from_rgb(0xd5, 0xdc, 0xe0));
        }
        Some(Err(error)) => {
            ui.put(
                rect.shrink(40.0),
                egui::Label::new(egui::RichText::new(error.to_string()).color(theme::ERROR)).wrap(),
            );
        }
        None => {
            ui.put(rect.shrink(40.0), egui::Label::new(words.get("practice.no_picture")));
        }
    }
    if let Some(viewport) = viewport.as_mut().filter(|_| settings.has_second_window()) {
        second_eye_window(ui.ctx(), viewport, view.has_volume(), words);
    }
    // A hand inside the tooth is withdrawn in each picture.
    let is_blocked = lesson.snapshot.is_some_and(|seen| seen.is_hand_blocked);
    if is_blocked && lesson.pointer_hand.spot.is_some() && !lesson.is_standing_still() {
        ui.ctx().request_repaint();
    }
    if lesson.has_mouse() && lesson.scene.is_some() {
        pointer_hint_ui(ui, rect, lesson, words, commands);
    }
}

/// Hint at the lower edge of the view about the pointer, and a button that puts the instrument down for those who have no
/// keyboard.
fn pointer_hint_ui(
    ui: &mut egui::Ui,
    view: Rect,
    lesson: &LessonState,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    /// Width of the button, points.
    const BUTTON: f32 = 136.0;
    let is_captured = lesson.is_pointer_captured;
    let [free, free_paused, held, put_down] = match lesson.pointer_hand.kind {
        PointerKind::Mouse => ["practice.free", "practice.free_paused", "practice.held", "practice.put_down"],
        PointerKind::Pen => {
            ["practice.free_pen", "practice.free_paused_tap", "practice.held_pen", "practice.put_down_tap"]
        }
        PointerKind::Finger => {
            ["practice.free_finger", "practice.free_paused_tap", "practice.held_finger", "practice.put_down_tap"]
        }
    };
    let width = (view.width() - 24.0).clamp(40.0, if is_captured { 680.0 } else { 620.0 });
    let button = if is_captured { BUTTON.min(0.5 * width) } else { 0.0 };
    let lines = words.get(if is_captured { held } else { free }).to_string();
    let room = width - button - 16.0;
    let lines = ui.painter().layout(lines, egui::FontId::proportional(13.0), Color32::WHITE, room);
    let height = (lines.size().y + 12.0).max(36.0);
    let at = view.center_bottom() - egui::vec2(0.0, 8.0 + 0.5 * height);
    let place = Rect::from_center_size(at, egui::vec2(width, height));
    ui.painter().rect_filled(place, 8, Color32::from_black_alpha(150));
    let text = |key| egui::RichText::new(words.get(key)).size(13.0);
    let hint = |key| egui::Label::new(text(key).color(Color32::WHITE)).selectable(false);
    if !is_captured {
        ui.put(place, hint(if lesson.is_paused { free_paused } else { free }));
        return;
    }
    let (left, right) = place.split_left_right_at_x(place.max.x - button);
    ui.put(left.shrink2(egui::vec2(8.0, 0.0)), hint(held));
    if ui
        .put(right.shrink(4.0), egui::Button::new(text(put_down)).small().wrap_mode(egui::TextWrapMode::Extend))
        .clicked()
    {
        commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(false)));
    }
}

/// True if the section may show what lies beneath the surface: where decay is hidden, it would give it away.
fn is_section_allowed(lesson: &LessonState) -> bool {
    lesson.has_mouse() && lesson.is_pointer_captured && lesson.stage().is_some_and(|stage| stage.show_decay)
}

/// The window of the right eye; if the system supports only one window, a panel within it. Without a picture of this
/// lesson it is empty: the last one may show another person's work.
fn second_eye_window(ctx: &egui::Context, viewport: &mut Viewport, has_picture: bool, words: &Translations) {
    let title = words.get("practice.right_eye");
    let builder =
        egui::ViewportBuilder::default().with_title(format!("Typodont · {title}")).with_inner_size([640.0, 480.0]);
    let id = egui::ViewportId::from_hash_of("right eye");
    ctx.show_viewport_immediate(id, builder, |ui, _| {
        let rect = ui.max_rect();
        let scale = ui.pixels_per_point();
        viewport
            .set_second_eye_size([rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32));
        if let Some(picture) = viewport.second_eye_texture().filter(|_| has_picture) {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(picture, rect, whole, Color32::WHITE);
        }
    });
}

/// Draws the working end's ring on the surface under the pointer, and the share of the strength with which it presses.
fn pointer_ring(ui: &egui::Ui, lesson: &LessonState, rect: Rect) {
    const CORNERS: usize = 32;
    /// Distance of the gauge from the ring, points.
    const GAUGE: f32 = 7.0;
    let (Some(snapshot), Some(spot), Some(strength)) =
        (lesson.snapshot, lesson.pointer_hand.spot, lesson.press_strength())
    else {
        return;
    };
    let Some(instrument) = lesson.scenario.instruments.get(snapshot.instrument as usize) else { return };
    let eye = lesson.orbit.viewpoint().eye(rect.width() / rect.height());
    let radius = scene::pointing::ring_radius(&instrument.end);
    let side = spot.normal.any_orthonormal_vector();
    let corner = |i: usize| {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / CORNERS as f32).sin_cos();
        project(&eye, spot.place + (side * cos + spot.normal.cross(side) * sin) * radius, rect)
    };
    let colour = if is_force_high(lesson, &snapshot) { theme::WARNING } else { theme::ACCENT };
    let ring: Vec<Pos2> = (0..=CORNERS).filter_map(corner).collect();
    ui.painter().add(egui::Shape::line(ring.clone(), Stroke::new(4.0, Color32::from_black_alpha(90))));
    ui.painter().add(egui::Shape::line(ring.clone(), Stroke::new(2.0, Color32::WHITE)));
    let Some(middle) = project(&eye, spot.place, rect) else { return };
    let share = (snapshot.spring / strength.max(0.1)).clamp(0.0, 1.0);
    if lesson.pointer_hand.is_pressing && share > 0.02 {
        let reach = ring.iter().map(|p| p.distance(middle)).fold(8.0, f32::max) + GAUGE;
        let end = (CORNERS as f32 * share).round() as usize;
        let at = |i: usize| {
            let angle = std::f32::consts::TAU * i as f32 / CORNERS as f32 - std::f32::consts::FRAC_PI_2;
            middle + egui::vec2(angle.cos(), angle.sin()) * reach
        };
        ui.painter().add(egui::Shape::line((0..=end).map(at).collect(), Stroke::new(4.0, colour)));
    }
}

/// Screen position of a point of the world; `None` behind the camera.
fn project(eye: &Eye, point_in_world: Vec3, rect: Rect) -> Option<Pos2> {
    let ([x, y], depth) = eye.project(point_in_world);
    (depth > 0.0).then(|| rect.min + egui::vec2(x * rect.width(), y * rect.height()))
}
