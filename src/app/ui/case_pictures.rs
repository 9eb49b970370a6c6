//! Pictures of a case, photographs and radiographs, beside the tasks of an exercise.

use crate::command::AppCommand;
use crate::i18n::Translations;
use crate::ui::{theme, ui_anchors};
use eframe::egui;
use image::RgbaImage;
use std::collections::BTreeMap;
use typodont_exercise::scenario::Scenario;
use typodont_formats::picture;

/// Height of a picture in the briefing.
const THUMBNAIL_HEIGHT: f32 = 120.0;

/// Share of the window's width and height that an opened picture takes at first.
const SHARE: f32 = 0.45;

/// Greatest width and height of a texture, pixels: a radiograph of a sensor in full, a photograph reduced.
const SIDE_MAX: u32 = 2048;

/// Pictures of one exercise as textures, made when they are first shown.
#[derive(Default)]
pub struct CasePictures {
    /// SHA-256 of the exercise.
    exercise: String,
    /// Textures by the picture's index; `None` for a file that cannot be read as a picture.
    textures: BTreeMap<usize, Option<egui::TextureHandle>>,
}

impl CasePictures {
    fn texture(&mut self, ctx: &egui::Context, scenario: &Scenario, index: usize) -> Option<egui::TextureHandle> {
        if self.exercise != scenario.sha256 {
            *self = CasePictures { exercise: scenario.sha256.clone(), textures: BTreeMap::new() };
        }
        self.textures.entry(index).or_insert_with(|| load(ctx, scenario, index)).clone()
    }
}

/// Texture of a picture, reduced to what the adapter takes.
fn load(ctx: &egui::Context, scenario: &Scenario, index: usize) -> Option<egui::TextureHandle> {
    let shown = scenario.pictures.get(index)?;
    let read = picture::decode(scenario.files.get(&shown.file)?).ok()?;
    let mut pixels = RgbaImage::from_raw(read.width, read.height, read.rgba)?;
    let most = SIDE_MAX.min(ctx.input(|input| input.max_texture_side) as u32);
    let longest = pixels.width().max(pixels.height());
    if longest > most {
        let [width, height] = [pixels.width(), pixels.height()].map(|side| (side * most / longest).max(1));
        pixels = image::imageops::thumbnail(&pixels, width, height);
    }
    let size = [pixels.width() as usize, pixels.height() as usize];
    let image = egui::ColorImage::from_rgba_unmultiplied(size, pixels.as_raw());
    Some(ctx.load_texture(&shown.file, image, egui::TextureOptions::LINEAR))
}

/// Draws the pictures of an exercise in a row; a click opens one.
pub fn thumbnails_ui(
    ui: &mut egui::Ui,
    scenario: &Scenario,
    pictures: &mut CasePictures,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    if scenario.pictures.is_empty() {
        return;
    }
    egui::ScrollArea::horizontal().id_salt("pictures").show(ui, |ui| {
        ui.horizontal(|ui| {
            for (index, picture) in scenario.pictures.iter().enumerate() {
                let title = words.own(&scenario.texts, &picture.title);
                let Some(texture) = pictures.texture(ui.ctx(), scenario, index) else {
                    ui.colored_label(theme::ERROR, words.format("picture.unreadable", &picture.file));
                    continue;
                };
                let size = texture.size_vec2() * (THUMBNAIL_HEIGHT / texture.size_vec2().y);
                let image = egui::Image::new(&texture).fit_to_exact_size(size).corner_radius(6).alt_text(title);
                let button = ui.add(image.sense(egui::Sense::click())).on_hover_text(title);
                ui_anchors::anchor(ui, format!("picture.{index}"), button.rect);
                if button.clicked() {
                    commands.push(AppCommand::ShowPicture(Some(index)));
                }
            }
        });
    });
    ui.add_space(8.0);
}

/// Draws the titles of the pictures as buttons that open them, beside a task.
pub fn titles_ui(ui: &mut egui::Ui, scenario: &Scenario, words: &Translations, commands: &mut Vec<AppCommand>) {
    for (index, picture) in scenario.pictures.iter().enumerate() {
        let title = words.own(&scenario.texts, &picture.title);
        let button = ui.add(egui::Button::new(title).wrap());
        ui_anchors::anchor(ui, format!("picture.{index}"), button.rect);
        if button.clicked() {
            commands.push(AppCommand::ShowPicture(Some(index)));
        }
    }
}

/// Draws one picture in a window of its own, which may stay open beside the work. `corner` is its place at first.
pub fn picture_window(
    ctx: &egui::Context,
    scenario: &Scenario,
    index: usize,
    corner: egui::Align2,
    pictures: &mut CasePictures,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let Some(picture) = scenario.pictures.get(index) else { return };
    let title = words.own(&scenario.texts, &picture.title);
    let texture = pictures.texture(ctx, scenario, index);
    let screen = ctx.content_rect();
    let room = screen.size() * SHARE;
    let size = texture.as_ref().map_or(room, |texture| {
        let pixels = texture.size_vec2();
        pixels * (room / pixels).min_elem()
    });
    let mut is_open = true;
    egui::Window::new(title)
        .id(egui::Id::unique((&scenario.sha256, index, corner)))
        .open(&mut is_open)
        .collapsible(false)
        .default_pos(corner.align_size_within_rect(size, screen.shrink2(egui::vec2(24.0, 60.0))).min)
        .default_width(size.x)
        .max_size(screen.size() - egui::vec2(40.0, 80.0))
        .show(ctx, |ui| match texture {
            Some(texture) => {
                ui.add(egui::Image::new(&texture).max_width(ui.available_width()).alt_text(title));
            }
            None => _ = ui.colored_label(theme::ERROR, words.format("picture.unreadable", &picture.file)),
        });
    if !is_open {
        commands.push(AppCommand::ShowPicture(None));
    }
}
