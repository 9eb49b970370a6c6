//! The practice: the view of the tooth, what is asked, what is in the hand and how hard it presses.

use super::command::Command;
use super::language::Words;
use super::seen::Seen;
use super::settings::Settings;
use super::sitting::Sitting;
use super::viewport::{Place, Viewport};
use super::{chart, look, menu, pointer, questions};
use crate::content::Role;
use crate::frame::{Pose, Vec3};
use crate::render::{Changes, Eye, Lamp, Lights, Scene, Solid, Tooth};
use crate::scene;
use crate::scene::field::Field;
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};

/// Full width of the force bar, N: what a PHANTOM Omni can push.
const BAR_FULL: f32 = 3.3;

/// From which the force is said to be high, N: the thesis's dentists cut with less.
const HIGH_FORCE: f32 = 2.0;

/// How far a held pointer may go from the middle of the view, points.
const CENTRED: f32 = 40.0;

/// Minutes and seconds.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.max(0.0) as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

/// The whole screen.
pub fn practice_ui(
    ui: &mut egui::Ui,
    sitting: &mut Sitting,
    settings: &Settings,
    viewport: Option<&mut Viewport>,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let side = egui::Frame::side_top_panel(ui.style()).inner_margin(16);
    let width = ui.available_width();
    egui::Panel::left("task").exact_size(310.0f32.min(0.28 * width)).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| task_ui(ui, sitting, words, asked));
    });
    egui::Panel::right("menu").exact_size(250.0f32.min(0.24 * width)).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical()
            .auto_shrink([false, false])
            .show(ui, |ui| menu::menu_ui(ui, sitting, words, asked));
    });
    egui::Panel::bottom("force")
        .exact_size(64.0)
        .resizable(false)
        .frame(side)
        .show(ui, |ui| force_ui(ui, sitting, words));
    egui::CentralPanel::no_frame().show(ui, |ui| view_ui(ui, sitting, settings, viewport, words, asked));
}

/// The stage, its time, its questions and its end.
fn task_ui(ui: &mut egui::Ui, sitting: &mut Sitting, words: &Words, asked: &mut Vec<Command>) {
    let scenario = sitting.scenario.clone();
    let Some(stage) = sitting.stage.and_then(|stage| scenario.stages.get(stage)) else {
        ui.label(words.of("practice.making"));
        look::waiting(ui);
        return;
    };
    let number = sitting.stage.unwrap_or_default() + 1;
    ui.weak(format!("{} {number} / {}", words.of("practice.stage"), scenario.stages.len()));
    ui.heading(&stage.title);
    ui.label(&stage.instruction);
    ui.add_space(8.0);
    time_ui(ui, stage.time_limit, sitting.seen.as_ref(), words);
    if stage.show_decay
        && stage.cutting
        && let Some(cleared) = sitting.seen.and_then(|seen| seen.cleared_pct)
    {
        let left = 100.0 - cleared;
        ui.label(words.with("practice.left", format!("{left:.0}")));
        ui.add(egui::ProgressBar::new(left / 100.0).fill(look::ACCENT).desired_height(10.0));
    }
    ui.add_space(8.0);
    if let Some(second) = &sitting.second {
        ui.label(words.with("practice.second", second.text(words)));
    }
    if let Some(why) = &sitting.standstill {
        ui.colored_label(look::CARE, words.with("practice.standstill", why.text(words)));
    }
    if sitting.is_paused {
        ui.colored_label(look::CARE, words.of("practice.paused"));
    }
    questions::questions_ui(ui, stage, sitting, words, asked);
    chart::chart_ui(ui, stage, sitting, words, asked);
    ui.add_space(12.0);
    if stage.ends.confirmed {
        // A row, so that the text stands in the button's middle.
        let done = ui.horizontal(|ui| ui.add(look::main_button(words.of("practice.done")))).inner;
        if done.clicked() {
            asked.push(Command::Confirm);
        }
    }
    if let Some(why) = &sitting.refused {
        ui.colored_label(look::WRONG, words.with("practice.refused", words.of(why)));
    }
    ui.add_space(16.0);
    leave_ui(ui, sitting, words, asked);
}

fn time_ui(ui: &mut egui::Ui, limit: Option<f64>, seen: Option<&Seen>, words: &Words) {
    /// Time left from which it is said with care, s.
    const SHORT: f64 = 30.0;
    let spent = seen.map_or(0.0, |seen| f64::from(seen.stage_seconds));
    let (text, colour) = match limit {
        Some(limit) if limit - spent < SHORT => (words.with("practice.time_left", clock(limit - spent)), look::CARE),
        Some(limit) => (words.with("practice.time_left", clock(limit - spent)), look::ACCENT),
        None => (words.with("practice.time", clock(spent)), look::ACCENT),
    };
    ui.label(egui::RichText::new(text).size(20.0).strong().color(colour));
}

fn leave_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    if !sitting.is_giving_up {
        if ui.button(words.of("practice.give_up")).clicked() {
            asked.push(Command::GiveUp(true));
        }
        return;
    }
    ui.colored_label(look::WRONG, words.of("practice.give_up_sure"));
    ui.horizontal(|ui| {
        if ui.button(words.of("practice.give_up_yes")).clicked() {
            asked.push(Command::Abort);
        }
        if ui.button(words.of("practice.give_up_no")).clicked() {
            asked.push(Command::GiveUp(false));
        }
    });
}

/// How hard the hand presses: a bar, and in words what should not be touched.
fn force_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words) {
    let seen = sitting.seen.unwrap_or_default();
    let force = seen.spring;
    ui.horizontal_centered(|ui| {
        ui.strong(words.of("practice.force"));
        let (rect, response) = ui.allocate_exact_size(egui::vec2(260.0, 22.0), Sense::hover());
        let label = words.of("practice.force").to_string();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Meter, true, format!("{label} {force:.1} N")));
        let painter = ui.painter();
        painter.rect_filled(rect, 5, Color32::from_gray(0xe2));
        let width = rect.width() * (force / BAR_FULL).clamp(0.0, 1.0);
        let fill = if force > HIGH_FORCE { look::CARE } else { look::ACCENT };
        painter.rect_filled(Rect::from_min_size(rect.min, egui::vec2(width, rect.height())), 5, fill);
        ui.monospace(format!("{force:4.1} N"));
        if let Some(key) = warning(sitting, &seen) {
            ui.add_space(16.0);
            ui.label(egui::RichText::new(format!("! {}", words.of(key))).strong().color(look::WRONG));
        }
    });
}

/// What a trainee should stop doing.
fn warning(sitting: &Sitting, seen: &Seen) -> Option<&'static str> {
    let cuts = sitting.scenario.instruments.get(seen.instrument as usize).is_some_and(|i| i.is_bur());
    let is_cutting = cuts && sitting.stage().is_some_and(|stage| stage.cutting);
    match seen.touch.and_then(|label| sitting.scenario.tissues.role(label)) {
        Some(Role::Soft) if is_cutting => Some("practice.warn_soft"),
        Some(Role::Neighbour) if is_cutting => Some("practice.warn_neighbour"),
        Some(Role::Vulnerable) if is_cutting => Some("practice.warn_pulp"),
        _ if seen.spring > HIGH_FORCE => Some("practice.warn_force"),
        _ => None,
    }
}

/// The tooth, the hand, and who has the pointer.
fn view_ui(
    ui: &mut egui::Ui,
    sitting: &mut Sitting,
    settings: &Settings,
    viewport: Option<&mut Viewport>,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let rect = ui.available_rect_before_wrap();
    let view = ui.interact(rect, ui.scope_id().with("view"), Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.of("practice.view")));
    pointer::asked(ui, &view, sitting.is_pointer_held, asked);
    if sitting.is_pointer_held {
        let (is_focused, at) = ui.input(|input| (input.focused, input.pointer.latest_pos()));
        if !is_focused {
            asked.push(Command::HoldPointer(false));
        } else if at.is_none_or(|at| at.distance(rect.center()) > CENTRED) {
            asked.push(Command::CentrePointer(rect.center()));
        }
    }
    let scale = ui.pixels_per_point();
    let size = [rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32);
    let mut viewport = viewport;
    match viewport.as_deref_mut().map(|viewport| picture(sitting, settings, viewport, size)) {
        Some(Ok(Some(id))) => {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(id, rect, whole, Color32::WHITE);
            if settings.stereo().is_none() {
                spring(ui, sitting, rect);
            }
        }
        Some(Ok(None)) => {
            ui.painter().rect_filled(rect, 0, Color32::from_rgb(0xd5, 0xdc, 0xe0));
        }
        Some(Err(error)) => {
            ui.put(
                rect.shrink(40.0),
                egui::Label::new(egui::RichText::new(error.to_string()).color(look::WRONG)).wrap(),
            );
        }
        None => {
            ui.put(rect.shrink(40.0), egui::Label::new(words.of("practice.no_picture")));
        }
    }
    if let Some(viewport) = viewport.filter(|_| settings.second_eye().is_some()) {
        second_window(ui.ctx(), viewport, words);
    }
    if sitting.has_mouse() && sitting.matter.is_some() {
        let key = if sitting.is_pointer_held { "practice.held" } else { "practice.free" };
        let at = rect.center_bottom() - egui::vec2(0.0, 26.0);
        let place = Rect::from_center_size(at, egui::vec2((rect.width() - 24.0).clamp(40.0, 440.0), 32.0));
        ui.painter().rect_filled(place, 8, Color32::from_black_alpha(150));
        ui.put(place, egui::Label::new(egui::RichText::new(words.of(key)).color(Color32::WHITE)).selectable(false));
    }
}

/// Draws the lesson's matter; `None` before there is any.
fn picture(
    sitting: &mut Sitting,
    settings: &Settings,
    viewport: &mut Viewport,
    size: [u32; 2],
) -> Result<Option<egui::TextureId>, crate::render::Error> {
    let (viewpoint, way, seen) = (sitting.orbit.viewpoint(), sitting.shown, sitting.seen);
    let Some(matter) = &mut sitting.matter else { return Ok(None) };
    let changed = matter.volume.take_dirty();
    let mut solids = matter.around.clone();
    solids.extend(matter.ejector.clone());
    if let Some(field) = &mut matter.field {
        field.look(&viewpoint);
    }
    let mut mirror = None;
    if let Some(seen) = seen
        && let Some(instrument) = matter.instruments.get(seen.instrument as usize)
    {
        let held = Pose { position: seen.tip, orientation: seen.held };
        solids.push(Solid { world_from_solid: held, ..instrument.clone() });
        mirror =
            sitting.scenario.instruments.get(seen.instrument as usize).and_then(|entry| scene::mirror(entry, held));
    }
    let mut scene = Scene {
        tooth: Some(Tooth {
            volume: &matter.volume,
            changes: if matter.is_new { Changes::Anew } else { Changes::Bricks(&changed) },
            world_from_tooth: matter.workpiece.world_from_tooth,
            palette: &matter.palette,
            shown: matter.shown(way),
        }),
        solids,
        grains: matter.field.as_ref().map(Field::grains).unwrap_or_default(),
        drops: matter.field.as_ref().map(Field::drops).unwrap_or_default(),
        mirror,
        lights: Lights { head: Lamp::head(viewpoint.position), ..Lights::default() },
        is_smooth: settings.is_smooth(viewport.has_graphics()),
        ..Scene::empty()
    };
    let mut drawn = viewport.draw(Place::Main, &scene, &viewpoint, settings.stereo(), size);
    if let Some(second) = settings.second_eye()
        && drawn.is_ok()
    {
        // Nothing has changed between the two eyes.
        scene.tooth.iter_mut().for_each(|tooth| tooth.changes = Changes::Bricks(&[]));
        let other = viewport.draw(Place::Second, &scene, &viewpoint, Some(second), viewport.second_size());
        drawn = other.and(drawn);
    }
    // What a picture that failed should have brought to the adapter is lost.
    matter.is_new = drawn.is_err();
    drawn.map(Some)
}

/// The right eye's window; where the system has no second window, one within this.
fn second_window(ctx: &egui::Context, viewport: &mut Viewport, words: &Words) {
    let title = words.of("practice.right_eye");
    let builder =
        egui::ViewportBuilder::default().with_title(format!("Typodont · {title}")).with_inner_size([640.0, 480.0]);
    let id = egui::ViewportId::from_hash_of("right eye");
    ctx.show_viewport_immediate(id, builder, |ui, _| {
        let rect = ui.max_rect();
        let scale = ui.pixels_per_point();
        viewport.size_second([rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32));
        if let Some(picture) = viewport.second() {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(picture, rect, whole, Color32::WHITE);
        }
    });
}

/// What a mouse cannot push back: a spring from the instrument to where the hand would be.
fn spring(ui: &egui::Ui, sitting: &Sitting, rect: Rect) {
    /// Nearer than this the hand is where the instrument is, mm.
    const SLACK: f32 = 0.05;
    let Some(seen) = sitting.seen else { return };
    if !sitting.has_mouse() || seen.hand.distance(seen.tip) < SLACK {
        return;
    }
    let eye = sitting.orbit.viewpoint().eye(rect.width() / rect.height());
    let [Some(tip), Some(hand)] = [seen.tip, seen.hand].map(|point| place(&eye, point, rect)) else { return };
    let colour = if seen.spring > HIGH_FORCE { look::CARE } else { look::ACCENT };
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

/// Where on the screen a point of the world is seen, if it lies before the eye.
fn place(eye: &Eye, point_in_world: Vec3, rect: Rect) -> Option<Pos2> {
    let ([x, y], depth) = eye.place(point_in_world);
    (depth > 0.0).then(|| rect.min + egui::vec2(x * rect.width(), y * rect.height()))
}
