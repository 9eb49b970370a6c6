//! The menu beside the practice, as the thesis has it: instrument, rendering, haptics, materials,
//! and the timing of the system.

use crate::camera_preset::CameraPreset;
use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_scene::DisplayMode;
use crate::lesson_state::LessonState;
use crate::ui::lesson_view::PictureCost;
use crate::ui::theme;
use crate::ui::transfer_function_editor::transfer_function_ui;
use eframe::egui;
use typodont_core::touch::{Coefficient, CuttingLaw};
use typodont_core::volume::Label;
use typodont_exercise::catalog::TissueEntry;

pub fn tools_panel_ui(
    ui: &mut egui::Ui,
    lesson: &LessonState,
    cost: &PictureCost,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    instruments_ui(ui, lesson, words, commands);
    section_heading(ui, words.get("menu.rendering"));
    for (mode, key) in DisplayMode::available(lesson.stage()) {
        if ui.radio(lesson.display_mode == mode, words.get(key)).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::SetDisplayMode(mode)));
        }
    }
    if lesson.display_mode.shows_interior()
        && let Some(scene) = &lesson.scene
    {
        egui::CollapsingHeader::new(words.get("transfer.title")).show(ui, |ui| {
            let tissues = &lesson.scenario.tissues;
            transfer_function_ui(ui, scene, tissues, words, commands);
        });
    }
    section_heading(ui, words.get("menu.views"));
    if let Some(scene) = &lesson.scene {
        let choice = egui::ComboBox::from_id_salt("views")
            .selected_text(words.get("views.choose"))
            .width(ui.available_width().min(200.0));
        let shown = choice.height(400.0).show_ui(ui, |ui| {
            for (view, key) in CameraPreset::available(scene) {
                if ui.selectable_label(false, words.get(key)).clicked() {
                    commands.push(AppCommand::Practice(PracticeCommand::SetCamera(view)));
                }
            }
        });
        shown.response.accessible_name(words.get("menu.views"));
    }
    section_heading(ui, words.get("menu.haptics"));
    let mut is_on = !lesson.is_paused;
    if ui.checkbox(&mut is_on, words.get("menu.haptics_on")).on_hover_text(words.get("menu.haptics_about")).changed() {
        commands.push(AppCommand::Practice(PracticeCommand::Pause(!is_on)));
    }
    if lesson.can_register_hand && lesson.has_placeable_hand() && lesson.registration.is_none() {
        let register = ui.button(words.get("menu.register_hand")).on_hover_text(words.get("menu.register_hand_about"));
        if register.clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::RegisterHand(true)));
        }
    }
    section_heading(ui, words.get("menu.materials"));
    materials_ui(ui, lesson, words, commands);
    for complaint in &lesson.complaints {
        ui.colored_label(theme::WARNING, complaint);
    }
    ui.add_space(14.0);
    egui::CollapsingHeader::new(words.get("menu.beat")).show(ui, |ui| {
        performance_ui(ui, lesson, cost, words);
        if let Some(why) = &lesson.audio_error {
            ui.small(words.get("menu.sound"));
            ui.small(why);
        }
    });
}

fn section_heading(ui: &mut egui::Ui, title: &str) {
    ui.add_space(14.0);
    ui.strong(title);
}

/// The instruments that this stage offers.
fn instruments_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.strong(words.get("menu.tray"));
    let current = lesson.snapshot.map(|seen| seen.instrument as usize);
    let tray = lesson.stage().map(|stage| stage.instruments.as_slice()).unwrap_or_default();
    for &instrument in tray {
        let title = words.own(&lesson.scenario.texts, &lesson.scenario.instruments[instrument].title);
        if ui.radio(current == Some(instrument), title).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::SelectInstrument(instrument)));
        }
    }
}

/// The coefficients by which each tissue feels as it does; to be changed where the stage allows it.
fn materials_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    let is_adjustable = lesson.stage().is_some_and(|stage| stage.is_adjustable) && lesson.pause_reason.is_none();
    // By the rate law a tissue's hardness decides, not the force from which it is cut.
    let is_by_force = matches!(lesson.scenario.carving.law, CuttingLaw::Threshold);
    let coefficients = egui::CollapsingHeader::new(words.get("menu.coefficients"));
    coefficients.show(ui, |ui| {
        // Possible sites of a draw have the properties of their decay, which is listed once.
        for entry in lesson.scenario.tissues.entries().iter().filter(|entry| entry.site_of.is_none()) {
            ui.label(egui::RichText::new(words.own(&lesson.scenario.texts, &entry.title)).size(14.0).strong());
            // A stage that changes a stiffness in steps tests whether the trainee feels it: only the exercise's own
            // value is shown there.
            let shown = if is_adjustable { *lesson.materials.get(entry.label()) } else { entry.material() };
            for which in Coefficient::ALL {
                let is_free = is_adjustable && (is_by_force || which != Coefficient::CutForce);
                coefficient_ui(ui, (entry, which), shown.coefficient(which), is_free, words, commands);
            }
        }
        if is_adjustable && ui.button(words.get("menu.as_written")).clicked() {
            commands.extend(adjusted_coefficients(lesson).map(|(label, which, value)| {
                AppCommand::Practice(PracticeCommand::AdjustCoefficient(label, which, value))
            }));
        }
    });
}

/// One number: as wide as the menu is, its name above its slider.
fn coefficient_ui(
    ui: &mut egui::Ui,
    (tissue, which): (&TissueEntry, Coefficient),
    now: Option<f32>,
    is_adjustable: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    /// Width of a slider, points; its number is shown beside it.
    const SLIDER: f32 = 110.0;
    let name = words.get(label_key(which));
    let Some(value) = now.filter(|_| is_adjustable) else {
        let value = now.map_or("—".to_string(), |value| format!("{value:.2}{}", unit_of(which)));
        ui.small(format!("{name}: {value}"));
        return;
    };
    let name = ui.small(name);
    ui.spacing_mut().slider_width = SLIDER;
    // While it is dragged the value is the slider's own: the hand is given, and the recording keeps, where it is let go.
    let place = ui.scope_id().with((tissue.id, label_key(which)));
    let dragged: Option<f32> = ui.data(|data| data.get_temp(place));
    let mut chosen = dragged.unwrap_or(value);
    let slider = ui.add(slider_of(which, &mut chosen)).labelled_by(name.id);
    if slider.dragged() {
        ui.data_mut(|data| data.insert_temp(place, chosen));
    } else {
        ui.data_mut(|data| data.remove_temp::<f32>(place));
        if (slider.changed() || dragged.is_some()) && chosen != value {
            commands.push(AppCommand::Practice(PracticeCommand::AdjustCoefficient(tissue.label(), which, chosen)));
        }
    }
}

/// Coefficients that differ from those of the exercise, with the exercise's values.
fn adjusted_coefficients(lesson: &LessonState) -> impl Iterator<Item = (Label, Coefficient, f32)> + '_ {
    lesson.scenario.tissues.entries().iter().flat_map(|entry| {
        let (written, now) = (entry.material(), lesson.materials.get(entry.label()));
        let differs = move |which: &Coefficient| written.coefficient(*which) != now.coefficient(*which);
        let back = move |which| Some((entry.label(), which, written.coefficient(which)?));
        Coefficient::ALL.into_iter().filter(differs).filter_map(back)
    })
}

fn label_key(which: Coefficient) -> &'static str {
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

/// Cost of the pictures, and how late the servo's ticks come.
fn performance_ui(ui: &mut egui::Ui, lesson: &LessonState, cost: &PictureCost, words: &Translations) {
    let timing = lesson.snapshot.unwrap_or_default().timing;
    ui.small(words.get(match (cost.has_shadows, cost.is_smooth) {
        (true, true) => "menu.picture_full",
        (true, false) => "menu.picture_shadows",
        (false, true) => "menu.picture_smooth",
        (false, false) => "menu.picture_light",
    }));
    if cost.has_depth_of_field {
        ui.small(words.get("menu.picture_depth_of_field"));
    }
    ui.small(&cost.adapter);
    ui.small(words.format("menu.pictures", format!("{:.0}", cost.frames_per_second)));
    if cost.share_while_changing < 1.0 {
        ui.small(words.format("menu.resolution", format!("{:.0}", 100.0 * cost.share_while_changing)));
    }
    ui.small(words.format("menu.ticks", timing.ticks));
    ui.small(words.format("menu.late", format!("{:.2}", f64::from(timing.late_p99) / 1000.0)));
    ui.small(words.format("menu.missed", timing.missed));
}
