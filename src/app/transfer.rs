//! The transfer function as a person draws it: red, green, blue and alpha over the histogram of densities, for one tissue or
//! for all, by mouse or by keys.

use super::command::Command;
use super::language::Words;
use super::look;
use crate::content::TissueTable;
use crate::render::{Palette, Table, TransferFunction};
use crate::volume::{Label, Volume};
use eframe::egui::{self, Color32, Key, Pos2, Rect, Sense, Stroke};
use std::sync::Arc;

/// The channels with their texts and inks, as they stand in a table's entries.
const CHANNELS: [(&str, Color32); 4] = [
    ("transfer.red", Color32::from_rgb(0xc6, 0x28, 0x28)),
    ("transfer.green", Color32::from_rgb(0x2e, 0x7d, 0x32)),
    ("transfer.blue", Color32::from_rgb(0x15, 0x65, 0xc0)),
    ("transfer.alpha", Color32::from_rgb(0x42, 0x42, 0x42)),
];

/// How far an arrow key goes, of 255 densities or shares.
const STRIDE: u8 = 8;

/// Height of the curves, points.
const HEIGHT: f32 = 120.0;

/// A function of one's own, begun from a preset.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    pub function: Arc<TransferFunction>,
    /// The tissue that is drawn for; air stands for every tissue.
    pub tissue: Label,
    pub channel: usize,
    /// Density at which the keys draw.
    pub at: u8,
}

impl Curves {
    pub fn from(function: TransferFunction) -> Curves {
        Curves { function: Arc::new(function), tissue: Label::AIR, channel: 3, at: 128 }
    }

    /// The table that is drawn.
    fn table(&self) -> &Table {
        self.function.table(self.tissue)
    }

    /// The same with a line drawn from one density and share to another.
    fn drawn(&self, from: [u8; 2], to: [u8; 2]) -> Curves {
        let [low, high] = if from[0] <= to[0] { [from, to] } else { [to, from] };
        let span = f32::from(high[0] - low[0]).max(1.0);
        let value = |density: u8| {
            let share = f32::from(density - low[0]) / span;
            let rise = f32::from(high[1]) - f32::from(low[1]);
            (f32::from(low[1]) + share * rise).round() as u8
        };
        let draw = |table: &Table| {
            let mut table = *table;
            for density in low[0]..=high[0] {
                table[usize::from(density)][self.channel] = value(density);
            }
            table
        };
        let labels = if self.tissue == Label::AIR { 0..=255 } else { self.tissue.0..=self.tissue.0 };
        let function = self.function.changed(labels.map(Label), draw);
        Curves { function: Arc::new(function), at: to[0], ..self.clone() }
    }
}

/// How many voxels have each density, by label.
pub struct Histogram(Vec<[u32; 256]>);

impl Histogram {
    /// Counts everything but air.
    pub fn of(volume: &Volume) -> Histogram {
        let mut counts = vec![[0; 256]; 256];
        for (density, label) in volume.densities().iter().zip(volume.labels()) {
            counts[usize::from(label.0)][usize::from(density.bits())] += u32::from(density.bits() > 0);
        }
        Histogram(counts)
    }

    /// Heights from 0 to 1 of a tissue, or of all for air. Logarithms: borders are few beside what they enclose.
    fn heights(&self, tissue: Label) -> [f32; 256] {
        let count = |density: usize| match tissue {
            Label::AIR => self.0.iter().map(|counts| counts[density]).sum(),
            tissue => self.0[usize::from(tissue.0)][density],
        };
        let logs: [f32; 256] = std::array::from_fn(|d| libm::log1pf(count(d) as f32));
        let most = logs.iter().fold(1.0, |most: f32, &log| most.max(log));
        logs.map(|log| log / most)
    }
}

/// Presets to begin from, the tissue and channel to draw, and the drawing itself. Asks for the function as it is then.
pub fn transfer_ui(
    ui: &mut egui::Ui,
    curves: &Curves,
    histogram: &Histogram,
    tissues: &TissueTable,
    palette: &Palette,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let mut new = curves.clone();
    ui.horizontal_wrapped(|ui| {
        ui.small(words.of("transfer.begin"));
        if ui.small_button(words.of("menu.clear")).clicked() {
            new = Curves::from(TransferFunction::tissue(palette));
        }
        if ui.small_button(words.of("menu.xray")).clicked() {
            new = Curves::from(TransferFunction::x_ray());
        }
    });
    let title = |label: Label| tissues.by_label(label).map_or(words.of("transfer.all"), |entry| entry.title.as_str());
    let label = ui.small(words.of("transfer.tissue")).id;
    egui::ComboBox::from_id_salt("tissue")
        .selected_text(title(new.tissue))
        .show_ui(ui, |ui| {
            for tissue in std::iter::once(Label::AIR).chain(tissues.entries().iter().map(|entry| entry.label())) {
                ui.selectable_value(&mut new.tissue, tissue, title(tissue));
            }
        })
        .response
        .labelled_by(label);
    // A row that is wider than the menu would push it out of the window.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 6.0;
        for (channel, (key, ink)) in CHANNELS.into_iter().enumerate() {
            let text = egui::RichText::new(words.of(key)).small().color(ink);
            ui.selectable_value(&mut new.channel, channel, text);
        }
    });
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let name = format!("{}, {}, {}", words.of("transfer.curve"), title(new.tissue), words.of(CHANNELS[new.channel].0));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, &name));
    if response.clicked() {
        response.request_focus();
    }
    if response.is_pointer_button_down_on()
        && let Some(to) = response.interact_pointer_pos()
    {
        let from = to - response.drag_delta();
        new = new.drawn(entry_at(from, rect), entry_at(to, rect));
    }
    if response.has_focus() {
        new = by_keys(ui, &new, &response);
    }
    paint(ui, &new, &histogram.heights(new.tissue), rect, response.has_focus());
    ui.small(words.of("transfer.about"));
    if new != *curves {
        asked.push(Command::Draw(Box::new(new)));
    }
}

/// The arrows go along the curve and lift or lower it there.
fn by_keys(ui: &egui::Ui, curves: &Curves, response: &egui::Response) -> Curves {
    let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let pressed = |key| ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key));
    let here = curves.table()[usize::from(curves.at)][curves.channel];
    let to = if pressed(Key::ArrowLeft) {
        return Curves { at: curves.at.saturating_sub(STRIDE), ..curves.clone() };
    } else if pressed(Key::ArrowRight) {
        return Curves { at: curves.at.saturating_add(STRIDE), ..curves.clone() };
    } else if pressed(Key::ArrowUp) {
        here.saturating_add(STRIDE)
    } else if pressed(Key::ArrowDown) {
        here.saturating_sub(STRIDE)
    } else {
        return curves.clone();
    };
    // A stretch as wide as a step along, so that neighbouring steps leave no spike.
    let [low, high] = [curves.at.saturating_sub(STRIDE / 2), curves.at.saturating_add(STRIDE / 2)];
    Curves { at: curves.at, ..curves.drawn([low, to], [high, to]) }
}

/// The density and share that a place of the drawing stands for.
fn entry_at(at: Pos2, rect: Rect) -> [u8; 2] {
    let share = (at - rect.min) / rect.size();
    [share.x, 1.0 - share.y].map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn paint(ui: &egui::Ui, curves: &Curves, heights: &[f32; 256], rect: Rect, has_focus: bool) {
    let painter = ui.painter_at(rect.expand(1.0));
    painter.rect_filled(rect, 3, Color32::WHITE);
    let place = |density: usize, share: f32| {
        let [x, y] = [density as f32 / 255.0, 1.0 - share];
        rect.min + egui::vec2(x, y) * rect.size()
    };
    for (density, height) in heights.iter().enumerate().filter(|(_, height)| **height > 0.0) {
        let line = [place(density, 0.0), place(density, *height)];
        painter.line_segment(line, Stroke::new(1.5, Color32::from_gray(0xdd)));
    }
    // The drawn one last, above the others.
    let order = (0..CHANNELS.len()).filter(|&c| c != curves.channel).chain([curves.channel]);
    for channel in order {
        let value = |density: usize| f32::from(curves.table()[density][channel]) / 255.0;
        let points: Vec<Pos2> = (0..256).map(|density| place(density, value(density))).collect();
        let width = if channel == curves.channel { 2.5 } else { 1.0 };
        painter.add(egui::Shape::line(points, Stroke::new(width, CHANNELS[channel].1)));
    }
    if has_focus {
        let here = curves.table()[usize::from(curves.at)][curves.channel];
        painter.circle_stroke(
            place(usize::from(curves.at), f32::from(here) / 255.0),
            5.0,
            Stroke::new(2.0, look::ACCENT),
        );
    }
    painter.rect_stroke(rect, 3, Stroke::new(1.0, Color32::from_gray(0x99)), egui::StrokeKind::Inside);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_drawn_into_one_channel_of_one_tissue() {
        // Aim: what the mouse draws is what is seen, and nothing else changes. Method: a rising line for one label, drawn
        // from right to left; its ends, its middle, the other channels and the other labels.
        let before = Curves { tissue: Label(2), channel: 0, ..Curves::from(TransferFunction::x_ray()) };
        let after = before.drawn([200, 150], [100, 50]);
        let own = after.function.table(Label(2));
        assert_eq!([own[100][0], own[150][0], own[200][0]], [50, 100, 150]);
        assert_eq!(own[99], before.function.table(Label(2))[99]);
        assert_eq!(own[150][1..], before.function.table(Label(2))[150][1..]);
        assert_eq!(after.function.table(Label(3)), before.function.table(Label(3)));
        assert_eq!(after.at, 100);
        let all = Curves { tissue: Label::AIR, ..before }.drawn([0, 7], [255, 7]);
        assert!([0, 2, 255].iter().all(|&label| all.function.table(Label(label)).iter().all(|entry| entry[0] == 7)));
    }
}
