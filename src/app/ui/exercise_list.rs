//! The list of exercises as it is drawn: cards with results, the participant, an interrupted session.

use crate::command::{AppCommand, TextField};
use crate::exercise_list::{Exercise, ExerciseList};
use crate::i18n::Translations;
use crate::platform;
use crate::session_history::{AttemptSummary, SessionHistory};
use crate::settings::Settings;
use crate::ui::text_field::{participant_field, push_typed};
use crate::ui::theme;
use crate::ui::ui_anchors;
use crate::ui::zip_verification::verify_button_ui;
use eframe::egui;
use typodont_lesson::{self as lesson, InterruptedSession};

/// Earlier sessions, settings and texts with which the list is drawn.
pub struct ListContext<'a> {
    pub history: &'a SessionHistory,
    pub settings: &'a Settings,
    pub words: &'a Translations,
    /// True if the list has no way to the author's screen or to another folder.
    pub is_kiosk: bool,
}

/// Draws the list. Pushes a command when the user selects an exercise or another folder.
pub fn exercise_list_ui(
    ui: &mut egui::Ui,
    list: &ExerciseList,
    participant: &str,
    context: &ListContext,
    commands: &mut Vec<AppCommand>,
) {
    let words = context.words;
    theme::centered_column(ui, |ui| {
        ui.heading(words.get("shelf.title"));
        participant_ui(ui, participant, context.is_kiosk, words, commands);
        if let Some(session) = context.history.interrupted() {
            // In a kiosk, nobody takes over the work of somebody else.
            let is_own = !context.is_kiosk || session.participant == participant;
            interrupted_ui(ui, list, session, is_own, words, commands);
        }
        ui.add_space(8.0);
        let room = (ui.available_height() - 150.0).max(160.0);
        egui::ScrollArea::vertical().id_salt("exercise list").max_height(room).auto_shrink([false, true]).show(
            ui,
            |ui| {
                for (place, exercise) in list.exercises.iter().enumerate() {
                    let required = list.required_before(place, context.history, participant, context.settings);
                    let card = ExerciseCard {
                        place,
                        is_selected: list.selected == place,
                        summary: context.history.summary(exercise.id(), participant),
                        required: required.map(|first| first.title(words)),
                    };
                    let card = exercise_ui(ui, exercise, &card, words, commands);
                    if card.gained_focus() || (list.scroll_to_selected && list.selected == place) {
                        card.scroll_to_me(None);
                    }
                }
            },
        );
        ui.add_space(12.0);
        let is_valid = list.can_open_selected(context.history, participant, context.settings);
        ui.horizontal(|ui| {
            let open = ui.add_enabled(is_valid, theme::primary_button(words.get("shelf.open")));
            ui_anchors::anchor(ui, "shelf.open", open.rect);
            if open.clicked() {
                commands.push(AppCommand::OpenBriefing);
            }
            let has_authoring =
                !context.is_kiosk && !list.is_only && (!platform::IS_PAGE || platform::opens_exercises());
            let file = platform::opens_exercises().then_some(("shelf.open_file", AppCommand::ChooseExercise));
            let authoring = [("shelf.edit", AppCommand::EditExercise), ("shelf.new", AppCommand::NewExercise)];
            for (key, command) in authoring.into_iter().chain(file).filter(|_| has_authoring) {
                let button = ui.button(words.get(key));
                ui_anchors::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
        if !context.is_kiosk {
            verify_button_ui(ui, words, commands);
        }
        if !context.is_kiosk && !platform::IS_PAGE {
            folder_ui(ui, &list.folder, words, commands);
        }
        if let Some(complaint) = &list.complaint {
            ui.colored_label(theme::ERROR, complaint);
        }
    });
}

/// The field for a further folder with exercises.
fn folder_ui(ui: &mut egui::Ui, folder: &str, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(words.get("shelf.folder")).id;
        let mut typed = folder.to_string();
        let edit = egui::TextEdit::singleline(&mut typed).desired_width(260.0);
        let line = ui.add(edit.hint_text(words.get("shelf.folder_hint"))).labelled_by(label);
        if line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
            commands.push(AppCommand::OpenFolder(typed.clone().into()));
        }
        push_typed(TextField::ExerciseFolder, folder, typed, commands);
    });
}

/// The field for the participant code, whose results the list shows.
fn participant_ui(
    ui: &mut egui::Ui,
    participant: &str,
    is_required: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(words.get("briefing.participant")).id;
        participant_field(ui, participant, is_required, label, words, commands);
        if !participant.is_empty() && ui.button(words.get("shelf.someone_else")).clicked() {
            commands.push(AppCommand::ChangeParticipant);
        }
    });
    if !lesson::is_valid_participant_code(participant) {
        ui.colored_label(theme::ERROR, words.get("briefing.participant_wrong"));
    }
}

/// Offers to go on with a session that was interrupted, or to finish it.
fn interrupted_ui(
    ui: &mut egui::Ui,
    list: &ExerciseList,
    session: &InterruptedSession,
    is_own: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let own = list.exercises.iter().find(|exercise| exercise.id() == session.scenario_id);
    let title = own.map_or(session.scenario_id.as_str(), |own| own.title(words));
    let when = session.started.get(..16).unwrap_or_default().replace('T', " ");
    let frame = egui::Frame::NONE.stroke(egui::Stroke::new(2.0, theme::WARNING)).corner_radius(8).inner_margin(12);
    ui.add_space(8.0);
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let whose = [title, &session.participant, &format!("{when} UTC")];
        let whose: Vec<&str> = whose.into_iter().filter(|part| !part.is_empty()).collect();
        ui.strong(words.format("shelf.interrupted", whose.join(" · ")));
        ui.label(words.get(if session.is_sealed { "shelf.interrupted_sealed" } else { "shelf.interrupted_about" }));
        ui.horizontal_wrapped(|ui| {
            let asked = [
                ("shelf.resume", AppCommand::ResumeInterrupted, is_own && !session.is_sealed),
                ("shelf.finish", AppCommand::FinishInterrupted, !session.is_sealed),
                ("shelf.aside", AppCommand::SetAsideInterrupted, true),
            ];
            for (key, command, _) in asked.into_iter().filter(|(_, _, is_offered)| *is_offered) {
                let button = ui.button(words.get(key));
                ui_anchors::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
    });
}

/// An exercise as its card shows it, beside its own texts.
struct ExerciseCard<'a> {
    place: usize,
    is_selected: bool,
    summary: AttemptSummary,
    /// Title of the exercise that must be passed first, if any.
    required: Option<&'a str>,
}

fn exercise_ui(
    ui: &mut egui::Ui,
    exercise: &Exercise,
    card: &ExerciseCard,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) -> egui::Response {
    let (title, about, colour) = match &exercise.scenario {
        Ok(scenario) => (exercise.title(words), words.own(&scenario.texts, &scenario.summary), None),
        Err(complaint) => (exercise.name.as_str(), complaint.as_str(), Some(theme::ERROR)),
    };
    let place = card.place;
    let fill = if card.is_selected { theme::ACCENT.gamma_multiply(0.14) } else { egui::Color32::WHITE };
    let edge = if card.is_selected {
        egui::Stroke::new(2.0, theme::ACCENT)
    } else {
        egui::Stroke::new(1.0, egui::Color32::from_gray(0xdd))
    };
    let (state, state_colour) = state_of(card, words);
    let frame = egui::Frame::NONE.fill(fill).stroke(edge).corner_radius(8).inner_margin(14);
    let shown = frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let numbered = format!("{}. {title}", place + 1);
        ui.add(egui::Label::new(egui::RichText::new(numbered).strong().size(18.0)).selectable(false));
        let about = egui::RichText::new(about);
        let about = if let Some(colour) = colour { about.color(colour) } else { about };
        ui.add(egui::Label::new(about).wrap().selectable(false));
        if colour.is_none() {
            let state = egui::RichText::new(&state).color(state_colour);
            ui.add(egui::Label::new(state).wrap().selectable(false));
        }
    });
    let response = ui.interact(shown.response.rect, ui.scope_id().with(("exercise", place)), egui::Sense::click());
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::Button, true, card.is_selected, format!("{title}. {state}"))
    });
    if response.clicked() {
        commands.push(AppCommand::SelectExercise(place));
    }
    if response.double_clicked() {
        commands.push(AppCommand::OpenBriefing);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(response.rect, 8, egui::Stroke::new(2.0, theme::ACCENT), egui::StrokeKind::Outside);
    }
    ui.add_space(4.0);
    response
}

/// Results of the participant at an exercise, or the condition under which it opens, with a colour.
fn state_of(card: &ExerciseCard, words: &Translations) -> (String, egui::Color32) {
    let grey = egui::Color32::from_gray(0x60);
    let AttemptSummary { count, best, last, last_date, is_passed } = &card.summary;
    let points = |(points, most): &(f64, f64)| format!("{points:.0} / {most:.0}");
    match (card.required, count) {
        (Some(first), _) => (words.format("shelf.required", first), theme::WARNING),
        (None, 0) => (words.get("shelf.not_done").to_string(), grey),
        (None, _) => {
            let mut parts = vec![words.get(if *is_passed { "shelf.passed" } else { "shelf.not_passed" }).to_string()];
            parts.extend(best.as_ref().map(|best| words.format("shelf.best", points(best))));
            parts.extend(last.as_ref().map(|last| words.format("shelf.last", points(last))));
            parts.push(words.format("shelf.attempts", count));
            parts.push(last_date.clone());
            (parts.join(" · "), if *is_passed { theme::SUCCESS } else { grey })
        }
    }
}
