//! The practice screen: the view of the tooth, the task, the instrument in use and the force applied.

use super::command::{AppCommand, PracticeCommand};
use super::i18n::Translations;
use super::lesson_state::LessonState;
use super::settings::Settings;
use super::snapshot::LessonSnapshot;
use super::viewport::{EyeWindow, Viewport};
use super::{periodontal_chart, questions, theme, tools_panel, viewport_input};
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};
use typodont_core::frame::{Pose, Vec3};
use typodont_exercise::catalog::TissueRole;
use typodont_render::{Changes, Eye, Lamp, Lights, MeshInstance, RenderScene, VolumeInstance};
use typodont_scene as scene;
use typodont_scene::particles::ParticleField;

/// Full width of the force bar, N: the maximum force of a PHANTOM Omni.
const BAR_FULL: f32 = 3.3;

/// Force above which a warning is shown, N: the thesis's dentists cut with less.
const HIGH_FORCE: f32 = 2.0;

/// Distance that a captured pointer may move from the centre of the view, points.
const CENTRE_TOLERANCE: f32 = 40.0;

/// Formats a time, s, as minutes and seconds.
pub fn format_time(seconds: f64) -> String {
    let whole = seconds.max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

/// The whole screen.
pub fn practice_ui(
    ui: &mut egui::Ui,
    lesson: &mut LessonState,
    settings: &Settings,
    viewport: Option<&mut Viewport>,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let side = egui::Frame::side_top_panel(ui.style()).inner_margin(16);
    let width = ui.available_width();
    egui::Panel::left("task").exact_size(310.0f32.min(0.28 * width)).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| task_ui(ui, lesson, words, commands));
    });
    egui::Panel::right("menu").exact_size(250.0f32.min(0.24 * width)).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical()
            .auto_shrink([false, false])
            .show(ui, |ui| tools_panel::tools_panel_ui(ui, lesson, words, commands));
    });
    egui::Panel::bottom("force")
        .exact_size(64.0)
        .resizable(false)
        .frame(side)
        .show(ui, |ui| force_ui(ui, lesson, words));
    egui::CentralPanel::no_frame().show(ui, |ui| view_ui(ui, lesson, settings, viewport, words, commands));
}

/// The stage, its time, its questions and its end.
fn task_ui(ui: &mut egui::Ui, lesson: &mut LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    let scenario = lesson.scenario.clone();
    let Some(stage) = lesson.stage.and_then(|stage| scenario.stages.get(stage)) else {
        ui.label(words.get("practice.making"));
        theme::progress_dots(ui);
        return;
    };
    let number = lesson.stage.unwrap_or_default() + 1;
    ui.weak(format!("{} {number} / {}", words.get("practice.stage"), scenario.stages.len()));
    ui.heading(&stage.title);
    ui.label(&stage.instruction);
    ui.add_space(8.0);
    time_ui(ui, stage.time_limit, lesson.snapshot.as_ref(), words);
    if stage.show_decay
        && stage.cutting
        && let Some(cleared) = lesson.snapshot.and_then(|seen| seen.cleared_pct)
    {
        let left = 100.0 - cleared;
        ui.label(words.format("practice.left", format!("{left:.0}")));
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
            commands.push(AppCommand::Practice(PracticeCommand::ConfirmStage));
        }
    }
    if let Some(why) = &lesson.refusal_key {
        ui.colored_label(theme::ERROR, words.format("practice.refused", words.get(why)));
    }
    ui.add_space(16.0);
    abort_ui(ui, lesson, words, commands);
}

fn time_ui(ui: &mut egui::Ui, limit: Option<f64>, snapshot: Option<&LessonSnapshot>, words: &Translations) {
    /// Remaining time from which it is shown as a warning, s.
    const SHORT: f64 = 30.0;
    let elapsed = snapshot.map_or(0.0, |seen| f64::from(seen.stage_seconds));
    let (text, colour) = match limit {
        Some(limit) if limit - elapsed < SHORT => {
            (words.format("practice.time_left", format_time(limit - elapsed)), theme::WARNING)
        }
        Some(limit) => (words.format("practice.time_left", format_time(limit - elapsed)), theme::ACCENT),
        None => (words.format("practice.time", format_time(elapsed)), theme::ACCENT),
    };
    ui.label(egui::RichText::new(text).size(20.0).strong().color(colour));
}

fn abort_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    if !lesson.is_confirming_abort {
        if ui.button(words.get("practice.give_up")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(true)));
        }
        return;
    }
    ui.colored_label(theme::ERROR, words.get("practice.give_up_sure"));
    ui.horizontal(|ui| {
        if ui.button(words.get("practice.give_up_yes")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::Abort));
        }
        if ui.button(words.get("practice.give_up_no")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(false)));
        }
    });
}

/// Force applied by the trainee, as a bar, with a warning about tissue that should not be touched.
fn force_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations) {
    let snapshot = lesson.snapshot.unwrap_or_default();
    let force = snapshot.spring;
    ui.horizontal_centered(|ui| {
        ui.strong(words.get("practice.force"));
        let (rect, response) = ui.allocate_exact_size(egui::vec2(260.0, 22.0), Sense::hover());
        let label = words.get("practice.force").to_string();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Meter, true, format!("{label} {force:.1} N")));
        let painter = ui.painter();
        painter.rect_filled(rect, 5, Color32::from_gray(0xe2));
        let width = rect.width() * (force / BAR_FULL).clamp(0.0, 1.0);
        let fill = if force > HIGH_FORCE { theme::WARNING } else { theme::ACCENT };
        painter.rect_filled(Rect::from_min_size(rect.min, egui::vec2(width, rect.height())), 5, fill);
        ui.monospace(format!("{force:4.1} N"));
        if let Some(key) = warning(lesson, &snapshot) {
            ui.add_space(16.0);
            ui.label(egui::RichText::new(format!("! {}", words.get(key))).strong().color(theme::ERROR));
        }
    });
}

/// Text key of a warning about the trainee's present action, if there is one.
fn warning(lesson: &LessonState, snapshot: &LessonSnapshot) -> Option<&'static str> {
    let cuts = lesson.scenario.instruments.get(snapshot.instrument as usize).is_some_and(|i| i.is_bur());
    let is_cutting = cuts && lesson.stage().is_some_and(|stage| stage.cutting);
    match snapshot.touch.and_then(|label| lesson.scenario.tissues.role(label)) {
        Some(TissueRole::Soft) if is_cutting => Some("practice.warn_soft"),
        Some(TissueRole::Neighbour) if is_cutting => Some("practice.warn_neighbour"),
        Some(TissueRole::Vulnerable) if is_cutting => Some("practice.warn_pulp"),
        _ if snapshot.spring > HIGH_FORCE => Some("practice.warn_force"),
        _ => None,
    }
}

/// The view of the tooth and the instrument, with the state of the pointer.
fn view_ui(
    ui: &mut egui::Ui,
    lesson: &mut LessonState,
    settings: &Settings,
    viewport: Option<&mut Viewport>,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let rect = ui.available_rect_before_wrap();
    let view = ui.interact(rect, ui.scope_id().with("view"), Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.get("practice.view")));
    viewport_input::collect_commands(ui, &view, lesson.is_pointer_captured, commands);
    if lesson.is_pointer_captured {
        let (is_focused, at) = ui.input(|input| (input.focused, input.pointer.latest_pos()));
        if !is_focused {
            commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(false)));
        } else if at.is_none_or(|at| at.distance(rect.center()) > CENTRE_TOLERANCE) {
            commands.push(AppCommand::Practice(PracticeCommand::CentrePointer(rect.center())));
        }
    }
    let scale = ui.pixels_per_point();
    let size = [rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32);
    let mut viewport = viewport;
    match viewport.as_deref_mut().map(|viewport| draw_view(lesson, settings, viewport, size)) {
        Some(Ok(Some(id))) => {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(id, rect, whole, Color32::WHITE);
            if settings.stereo().is_none() {
                hand_spring(ui, lesson, rect);
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
    if let Some(viewport) = viewport.filter(|_| settings.second_eye().is_some()) {
        second_eye_window(ui.ctx(), viewport, words);
    }
    if lesson.has_mouse() && lesson.scene.is_some() {
        let key = if lesson.is_pointer_captured { "practice.held" } else { "practice.free" };
        let at = rect.center_bottom() - egui::vec2(0.0, 26.0);
        let place = Rect::from_center_size(at, egui::vec2((rect.width() - 24.0).clamp(40.0, 440.0), 32.0));
        ui.painter().rect_filled(place, 8, Color32::from_black_alpha(150));
        ui.put(place, egui::Label::new(egui::RichText::new(words.get(key)).color(Color32::WHITE)).selectable(false));
    }
}

/// Draws the lesson's scene; `None` before it is built.
fn draw_view(
    lesson: &mut LessonState,
    settings: &Settings,
    viewport: &mut Viewport,
    size: [u32; 2],
) -> Result<Option<egui::TextureId>, typodont_render::RenderError> {
    let (viewpoint, mode, snapshot) = (lesson.orbit.viewpoint(), lesson.display_mode, lesson.snapshot);
    let Some(lesson_scene) = &mut lesson.scene else { return Ok(None) };
    let changed = lesson_scene.volume.take_dirty();
    let mut solids = lesson_scene.surroundings.clone();
    solids.extend(lesson_scene.ejector.clone());
    if let Some(field) = &mut lesson_scene.particles {
        field.sort_for_view(&viewpoint);
    }
    let mut mirror = None;
    if let Some(snapshot) = snapshot
        && let Some(instrument) = lesson_scene.instruments.get(snapshot.instrument as usize)
    {
        let world_from_tip = Pose { position: snapshot.tip, orientation: snapshot.orientation };
        solids.push(MeshInstance { world_from_solid: world_from_tip, ..instrument.clone() });
        mirror = lesson
            .scenario
            .instruments
            .get(snapshot.instrument as usize)
            .and_then(|entry| scene::mirror_face(entry, world_from_tip));
    }
    let mut scene = RenderScene {
        tooth: Some(VolumeInstance {
            volume: &lesson_scene.volume,
            changes: if lesson_scene.is_new { Changes::All } else { Changes::Bricks(&changed) },
            world_from_tooth: lesson_scene.workpiece.world_from_tooth,
            palette: &lesson_scene.palette,
            mode: lesson_scene.render_mode(mode),
        }),
        solids,
        opaque_particles: lesson_scene.particles.as_ref().map(ParticleField::opaque).unwrap_or_default(),
        translucent_particles: lesson_scene.particles.as_ref().map(ParticleField::translucent).unwrap_or_default(),
        mirror,
        lights: Lights { head: Lamp::head(viewpoint.position), ..Lights::default() },
        is_antialiased: settings.is_smooth(viewport.has_graphics()),
        ..RenderScene::empty()
    };
    let mut drawn = viewport.draw(EyeWindow::Main, &scene, &viewpoint, settings.stereo(), size);
    if let Some(second_eye) = settings.second_eye()
        && drawn.is_ok()
    {
        // Nothing has changed between the two eyes.
        scene.tooth.iter_mut().for_each(|tooth| tooth.changes = Changes::Bricks(&[]));
        let other =
            viewport.draw(EyeWindow::SecondEye, &scene, &viewpoint, Some(second_eye), viewport.second_eye_size());
        drawn = other.and(drawn);
    }
    // After a failed frame the whole volume is sent to the renderer again, since its changes were lost.
    lesson_scene.is_new = drawn.is_err();
    drawn.map(Some)
}

/// The window of the right eye; if the system supports only one window, a panel within it.
fn second_eye_window(ctx: &egui::Context, viewport: &mut Viewport, words: &Translations) {
    let title = words.get("practice.right_eye");
    let builder =
        egui::ViewportBuilder::default().with_title(format!("Typodont · {title}")).with_inner_size([640.0, 480.0]);
    let id = egui::ViewportId::from_hash_of("right eye");
    ctx.show_viewport_immediate(id, builder, |ui, _| {
        let rect = ui.max_rect();
        let scale = ui.pixels_per_point();
        viewport
            .set_second_eye_size([rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32));
        if let Some(picture) = viewport.second_eye_texture() {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(picture, rect, whole, Color32::WHITE);
        }
    });
}

/// Draws a spring from the instrument to the hand's position, to show the force that a mouse cannot render.
fn hand_spring(ui: &egui::Ui, lesson: &LessonState, rect: Rect) {
    /// Distance below which hand and instrument count as being at the same position, mm.
    const SLACK: f32 = 0.05;
    let Some(snapshot) = lesson.snapshot else { return };
    if !lesson.has_mouse() || snapshot.hand.distance(snapshot.tip) < SLACK {
        return;
    }
    let eye = lesson.orbit.viewpoint().eye(rect.width() / rect.height());
    let [Some(tip), Some(hand)] = [snapshot.tip, snapshot.hand].map(|point| project(&eye, point, rect)) else { return };
    let colour = if snapshot.spring > HIGH_FORCE { theme::WARNING } else { theme::ACCENT };
    let along = hand - tip;
    let aside = egui::vec2(-along.y, along.x).normalized() * 5.0;
    const TURNS: usize = 14;
    let bend = |i: usize| {
        let side = if i == 0 || i == TURNS {
            0.0
        } else if i.is_multiple_of(2) {
            1.0
        } else {
            -1.0
        };
        tip + along * (i as f32 / TURNS as f32) + aside * side
    };
    let points: Vec<Pos2> = (0..=TURNS).map(bend).collect();
    ui.painter().add(egui::Shape::line(points, Stroke::new(2.5, colour)));
    ui.painter().circle(hand, 6.0, Color32::WHITE, Stroke::new(2.5, colour));
}

/// Screen position of a point of the world; `None` behind the camera.
fn project(eye: &Eye, point_in_world: Vec3, rect: Rect) -> Option<Pos2> {
    let ([x, y], depth) = eye.project(point_in_world);
    (depth > 0.0).then(|| rect.min + egui::vec2(x * rect.width(), y * rect.height()))
}
