//! The menu beside the practice, as the thesis has it: instrument, rendering, haptics, materials, and how the beat is kept.

use super::command::Command;
use super::language::Words;
use super::look;
use super::sitting::{Sitting, Way};
use super::transfer::transfer_ui;
use super::views::View;
use crate::content::TissueEntry;
use crate::touch::{Coefficient, CuttingLaw};
use crate::volume::Label;
use eframe::egui;

pub fn menu_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    tray_ui(ui, sitting, words, asked);
    part(ui, words.of("menu.rendering"));
    for (way, key) in Way::offered(sitting.stage()) {
        if ui.radio(sitting.shown == way, words.of(key)).clicked() {
            asked.push(Command::Show(way));
        }
    }
    if sitting.shown.looks_inside()
        && let Some(matter) = &sitting.matter
    {
        egui::CollapsingHeader::new(words.of("transfer.title")).show(ui, |ui| {
            let tissues = &sitting.scenario.tissues;
            transfer_ui(ui, &matter.curves, matter.histogram(), tissues, &matter.palette, words, asked);
        });
    }
    part(ui, words.of("menu.views"));
    if let Some(matter) = &sitting.matter {
        let choice = egui::ComboBox::from_id_salt("views").selected_text(words.of("views.choose")).width(200.0);
        choice.height(400.0).show_ui(ui, |ui| {
            for (view, key) in View::offered(matter) {
                if ui.selectable_label(false, words.of(key)).clicked() {
                    asked.push(Command::Look(view));
                }
            }
        });
    }
    part(ui, words.of("menu.haptics"));
    let mut is_on = !sitting.is_paused;
    if ui.checkbox(&mut is_on, words.of("menu.haptics_on")).on_hover_text(words.of("menu.haptics_about")).changed() {
        asked.push(Command::Pause(!is_on));
    }
    part(ui, words.of("menu.materials"));
    materials_ui(ui, sitting, words, asked);
    part(ui, words.of("menu.beat"));
    beat_ui(ui, sitting, words);
    for complaint in &sitting.complaints {
        ui.colored_label(look::CARE, complaint);
    }
    if let Some(why) = &sitting.silence {
        part(ui, words.of("menu.sound"));
        ui.small(why);
    }
    ui.add_space(16.0);
    if ui.button(words.of("menu.keys")).clicked() {
        asked.push(Command::ShowKeys(true));
    }
    if ui.button(words.of("menu.settings")).clicked() {
        asked.push(Command::ShowSettings(true));
    }
}

fn part(ui: &mut egui::Ui, title: &str) {
    ui.add_space(14.0);
    ui.strong(title);
}

/// The instruments that this stage offers.
fn tray_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    ui.strong(words.of("menu.tray"));
    let held = sitting.seen.map(|seen| seen.instrument as usize);
    let tray = sitting.stage().map(|stage| stage.instruments.as_slice()).unwrap_or_default();
    for &instrument in tray {
        let title = &sitting.scenario.instruments[instrument].title;
        if ui.radio(held == Some(instrument), title).clicked() {
            asked.push(Command::Take(instrument));
        }
    }
}

/// The coefficients by which each tissue feels as it does; to be changed where the stage allows it.
fn materials_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    let is_adjustable = sitting.stage().is_some_and(|stage| stage.is_adjustable) && sitting.standstill.is_none();
    // By the rate law a tissue's hardness decides, not the force from which it is cut.
    let is_by_force = matches!(sitting.scenario.carving.law, CuttingLaw::Threshold);
    let coefficients = egui::CollapsingHeader::new(words.of("menu.coefficients"));
    coefficients.show(ui, |ui| {
        for entry in sitting.scenario.tissues.entries() {
            ui.label(egui::RichText::new(&entry.title).size(14.0).strong());
            // What a stage does to a stiffness in steps is what it tests: only the exercise's own number is told.
            let shown = if is_adjustable { *sitting.felt.get(entry.label()) } else { entry.material() };
            for which in Coefficient::ALL {
                let is_free = is_adjustable && (is_by_force || which != Coefficient::CutForce);
                coefficient_ui(ui, (entry, which), shown.coefficient(which), is_free, words, asked);
            }
        }
        if is_adjustable && ui.button(words.of("menu.as_written")).clicked() {
            asked.extend(changed(sitting).map(|(label, which, value)| Command::Adjust(label, which, value)));
        }
    });
}

/// One number: as wide as the menu is, its name above its slider.
fn coefficient_ui(
    ui: &mut egui::Ui,
    (tissue, which): (&TissueEntry, Coefficient),
    now: Option<f32>,
    is_adjustable: bool,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    /// Points; its number stands beside it.
    const SLIDER: f32 = 110.0;
    let name = words.of(key_of(which));
    let Some(value) = now.filter(|_| is_adjustable) else {
        let value = now.map_or("—".to_string(), |value| format!("{value:.2}{}", unit_of(which)));
        ui.small(format!("{name}: {value}"));
        return;
    };
    let name = ui.small(name);
    ui.spacing_mut().slider_width = SLIDER;
    // While it is dragged the value is the slider's own: the hand is given, and the recording keeps, where it is let go.
    let place = ui.scope_id().with((tissue.id, key_of(which)));
    let dragged: Option<f32> = ui.data(|data| data.get_temp(place));
    let mut chosen = dragged.unwrap_or(value);
    let slider = ui.add(slider_of(which, &mut chosen)).labelled_by(name.id);
    if slider.dragged() {
        ui.data_mut(|data| data.insert_temp(place, chosen));
    } else {
        ui.data_mut(|data| data.remove_temp::<f32>(place));
        if (slider.changed() || dragged.is_some()) && chosen != value {
            asked.push(Command::Adjust(tissue.label(), which, chosen));
        }
    }
}

/// What differs from the exercise's own coefficients, with their values there.
fn changed(sitting: &Sitting) -> impl Iterator<Item = (Label, Coefficient, f32)> + '_ {
    sitting.scenario.tissues.entries().iter().flat_map(|entry| {
        let (written, now) = (entry.material(), sitting.felt.get(entry.label()));
        let differs = move |which: &Coefficient| written.coefficient(*which) != now.coefficient(*which);
        let back = move |which| Some((entry.label(), which, written.coefficient(which)?));
        Coefficient::ALL.into_iter().filter(differs).filter_map(back)
    })
}

fn key_of(which: Coefficient) -> &'static str {
    match which {
        Coefficient::Stiffness => "menu.stiffness",
        Coefficient::Damping => "menu.damping",
        Coefficient::StaticFriction => "menu.static_friction",
        Coefficient::DynamicFriction => "menu.dynamic_friction",
        Coefficient::CutForce => "menu.cut_force",
    }
}

fn unit_of(which: Coefficient) -> &'static str {
    if which == Coefficient::CutForce { " N" } else { "" }
}

fn slider_of(which: Coefficient, value: &mut f32) -> egui::Slider<'_> {
    let (least, most) = which.range();
    // Forces are chosen between a hundredth of a newton and fifty: by their size, not by their place.
    let is_force = which == Coefficient::CutForce;
    let slider = egui::Slider::new(value, least..=most).logarithmic(is_force).max_decimals(2).suffix(unit_of(which));
    // A table's own number may be finer than what is shown; and half a typed number is none.
    slider.clamping(egui::SliderClamping::Edits).update_while_editing(false)
}

/// Pictures a second, and how late the servo's ticks come.
fn beat_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words) {
    let beats = sitting.seen.unwrap_or_default().beats;
    ui.small(words.with("menu.pictures", format!("{:.0}", sitting.pictures_per_second)));
    ui.small(words.with("menu.ticks", beats.ticks));
    ui.small(words.with("menu.late", format!("{:.2}", f64::from(beats.late_p99) / 1000.0)));
    ui.small(words.with("menu.missed", beats.missed));
}
