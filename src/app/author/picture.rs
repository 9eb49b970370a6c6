//! The tooth that the author works on: turned, pointed at, its decay dragged to size.

use super::super::command::Command;
use super::super::language::Words;
use super::super::viewport::{Place, Viewport};
use super::super::{look, pointer};
use super::document::Authoring;
use super::marks::mark;
use super::parts::Part;
use super::slices::slices_ui;
use super::view::{Drawn, Way};
use super::{Ask, decay};
use crate::author::met;
use crate::frame::Vec3;
use crate::render::{Changes, Eye, Lamp, Lights, Scene, Tooth};
use eframe::egui::{self, Color32, Pos2, Rect, Sense};

/// Height of the cuts with their sliders, as a share of the column.
const CUTS: f32 = 0.36;

pub fn picture_ui(
    ui: &mut egui::Ui,
    authoring: &mut Authoring,
    viewport: Option<&mut Viewport>,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let frame = egui::Frame::NONE.inner_margin(8);
    egui::Panel::top("author ways").resizable(false).frame(frame).show(ui, |ui| ways_ui(ui, authoring, words, asked));
    let height = (CUTS * ui.available_height()).max(150.0);
    egui::Panel::bottom("author cuts").exact_size(height).resizable(false).frame(frame).show(ui, |ui| {
        slices_ui(ui, authoring, words, asked);
    });
    egui::CentralPanel::no_frame().show(ui, |ui| tooth_ui(ui, authoring, viewport, words, asked));
}

/// How it is shown, in one row as long as there is room.
fn ways_ui(ui: &mut egui::Ui, authoring: &Authoring, words: &Words, asked: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        let now = Way::ALL.iter().find(|(way, _)| *way == authoring.view.way).map_or("", |(_, key)| *key);
        let combo = egui::ComboBox::from_id_salt("way").width(130.0).truncate().selected_text(words.of(now));
        let shown = combo.show_ui(ui, |ui| {
            for (way, key) in Way::ALL {
                if ui.selectable_label(way == authoring.view.way, words.of(key)).clicked() {
                    asked.push(Command::Author(Ask::Look(way)));
                }
            }
        });
        shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, words.of("author.way")));
        if !authoring.view.around.is_empty() {
            let mut has_around = authoring.view.has_around;
            if ui.checkbox(&mut has_around, words.of("author.around")).changed() {
                asked.push(Command::Author(Ask::ShowAround(has_around)));
            }
        }
        let is_by_chance = authoring.draft.text().contains("random");
        if is_by_chance {
            let anew = ui.small_button(words.of("author.draw_anew"));
            if anew.on_hover_text(words.of("author.draw_anew_about")).clicked() {
                asked.push(Command::Author(Ask::DrawAnew));
            }
        }
    });
}

fn tooth_ui(
    ui: &mut egui::Ui,
    authoring: &mut Authoring,
    viewport: Option<&mut Viewport>,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let rect = ui.available_rect_before_wrap();
    let view = ui.interact(rect, ui.scope_id().with("tooth"), Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.of("author.view")));
    mark(ui, "view", rect);
    pointer::asked(ui, &view, false, asked);
    ui.painter().rect_filled(rect, 0, Color32::from_rgb(0xd5, 0xdc, 0xe0));
    let scale = ui.pixels_per_point();
    let size = [rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32);
    match viewport.map(|viewport| draw(authoring, viewport, size)) {
        Some(Ok(Some(id))) => {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(id, rect, whole, Color32::WHITE);
        }
        Some(Ok(None)) => {
            let key = if authoring.complaints.is_empty() { "practice.making" } else { "author.not_made" };
            ui.put(rect.shrink(30.0), egui::Label::new(words.of(key)).wrap());
        }
        Some(Err(error)) => {
            let text = egui::RichText::new(error.to_string()).color(look::WRONG);
            ui.put(rect.shrink(30.0), egui::Label::new(text).wrap());
        }
        None => {
            ui.put(rect.shrink(30.0), egui::Label::new(words.of("practice.no_picture")).wrap());
        }
    }
    let eye = authoring.view.orbit.viewpoint().eye(rect.width() / rect.height());
    if authoring.part == Part::Decay && decay::handles_ui(ui, authoring, &eye, rect, words, asked) {
        return;
    }
    if view.clicked()
        && let Some(at) = view.interact_pointer_pos()
        && let Some((point, outward)) = pointed(authoring, &eye, rect, at)
    {
        let ask = if authoring.part == Part::Decay { Ask::Point(point, outward) } else { Ask::CutAt(point) };
        asked.push(Command::Author(ask));
    }
    hint_ui(ui, authoring, rect, words);
}

/// What a click does here, and whether what is seen is what the text says.
fn hint_ui(ui: &mut egui::Ui, authoring: &Authoring, rect: Rect, words: &Words) {
    let key = if authoring.part == Part::Decay { "author.point" } else { "author.point_cuts" };
    let is_old = authoring.made.as_ref().is_some_and(|made| made.is_quick) || !authoring.is_checked;
    let more = if is_old { format!(" · {}", words.of("author.being_made")) } else { String::new() };
    let text = egui::RichText::new(format!("{}{more}", words.of(key))).color(Color32::WHITE).size(13.0);
    let width = (rect.width() - 16.0).max(40.0);
    let galley = egui::WidgetText::from(text).into_galley(
        ui,
        Some(egui::TextWrapMode::Wrap),
        width - 16.0,
        egui::TextStyle::Small,
    );
    let size = galley.size() + egui::vec2(16.0, 8.0);
    let place = Rect::from_center_size(rect.center_bottom() - egui::vec2(0.0, 0.5 * size.y + 8.0), size);
    ui.painter().rect_filled(place, 8, Color32::from_black_alpha(150));
    ui.painter().galley(place.min + egui::vec2(8.0, 4.0), galley, Color32::WHITE);
}

/// Draws the tooth unless nothing has changed; `None` before there is one.
fn draw(
    authoring: &mut Authoring,
    viewport: &mut Viewport,
    size: [u32; 2],
) -> Result<Option<egui::TextureId>, crate::render::Error> {
    let Some(made) = &authoring.made else { return Ok(None) };
    let view = &mut authoring.view;
    let (orbit, way, has_around, generation) = (view.orbit, view.way, view.has_around, view.generation);
    let now = Drawn { orbit, way, has_around, size, generation };
    if let Some((drawn, id)) = &view.drawn
        && *drawn == now
    {
        return Ok(Some(*id));
    }
    let viewpoint = orbit.viewpoint();
    let scene = Scene {
        tooth: Some(Tooth {
            volume: &made.workpiece.volume,
            changes: if view.is_new { Changes::Anew } else { Changes::Bricks(&[]) },
            world_from_tooth: made.workpiece.world_from_tooth,
            palette: &view.palette,
            shown: view.shown(),
        }),
        solids: if has_around { view.around.clone() } else { Vec::new() },
        lights: Lights { head: Lamp::head(viewpoint.position), ..Lights::default() },
        ..Scene::empty()
    };
    let drawn = viewport.draw(Place::Main, &scene, &viewpoint, None, size);
    view.is_new = drawn.is_err();
    view.drawn = drawn.as_ref().ok().map(|id| (now, *id));
    drawn.map(Some)
}

/// Where on the tooth a place of the screen points, tooth space, and the way out of it.
fn pointed(authoring: &Authoring, eye: &Eye, rect: Rect, at: Pos2) -> Option<(Vec3, Vec3)> {
    let made = authoring.made.as_ref()?;
    let share = (at - rect.min) / rect.size();
    let tooth_from_world = made.workpiece.world_from_tooth.inverse();
    let from = tooth_from_world * eye.position;
    let along = tooth_from_world.turn(eye.ray(share.x, share.y)).try_normalize()?;
    met(&made.workpiece.volume, from, along)
}

/// Where on the screen a point of tooth space is seen, and how many points a millimetre is there.
pub fn seen_at(authoring: &Authoring, eye: &Eye, rect: Rect, point_in_tooth: Vec3) -> Option<(Pos2, f32)> {
    let made = authoring.made.as_ref()?;
    let ([x, y], depth) = eye.place(made.workpiece.world_from_tooth * point_in_tooth);
    let height = depth * (eye.window.top - eye.window.bottom);
    (depth > 0.0).then(|| (rect.min + egui::vec2(x * rect.width(), y * rect.height()), rect.height() / height))
}
