//! One frame: the screen, and the pages over it.

use super::{App, CloseState};
use crate::command::AppCommand;
use crate::completion::CompletionProgress;
use crate::i18n::Translations;
use crate::screen::Screen;
use crate::ui::briefing::BriefingFields;
use crate::ui::case_pictures::picture_window;
use crate::ui::exercise_list::{ListContext, exercise_list_ui};
use crate::ui::report_texts::ReportTexts;
use crate::ui::results::results_ui;
use crate::ui::settings_screen::{SettingsContext, kiosk_settings_ui, settings_ui};
use crate::ui::zip_verification::zip_verification_ui;
use crate::ui::{briefing, kiosk_exit, practice, questionnaire, shortcuts, theme, ui_anchors};
use eframe::egui;

impl App {
    /// Draws the whole frame, and pushes the commands that are asked for in it.
    pub(super) fn frame_ui(&mut self, ui: &mut egui::Ui, frame: &eframe::Frame, commands: &mut Vec<AppCommand>) {
        top_bar_ui(ui, &self.words, commands);
        for complaint in &self.complaints {
            ui.colored_label(theme::ERROR, complaint);
        }
        self.screen_ui(ui, frame, commands);
        self.overlay_ui(ui.ctx(), commands);
    }

    fn screen_ui(&mut self, ui: &mut egui::Ui, frame: &eframe::Frame, commands: &mut Vec<AppCommand>) {
        let is_test_run = self.test_run_origin.is_some();
        let completion = self.background_progress();
        if matches!(self.screen, Screen::Editor(_) | Screen::Lesson(_)) {
            self.views.prepare(frame.wgpu_render_state());
        }
        let App { screen, exercise_list, history, options, words, settings, participant, views, shown_picture, .. } =
            self;
        let examiner_code = options.seed_code.is_none().then_some(self.examiner_code.as_str());
        match screen {
            Screen::ExerciseList => {
                let context = ListContext { history, settings, words, is_kiosk: options.kiosk().is_some() };
                exercise_list_ui(ui, exercise_list, participant, &context, commands);
                exercise_list.scroll_to_selected = false;
            }
            Screen::Editor(editor) => {
                crate::ui::editor::editor_ui(ui, editor, settings, views, words, commands);
            }
            Screen::Briefing => {
                if let Some(Ok(scenario)) = exercise_list.selected_exercise().map(|exercise| &exercise.scenario) {
                    let is_code_required = options.kiosk().is_some();
                    let fields = BriefingFields { participant, is_code_required, examiner_code };
                    let texts = ReportTexts { words, languages: options.templates.languages() };
                    briefing::briefing_ui(ui, scenario, fields, completion, &mut views.case_pictures, &texts, commands);
                    if let Some(index) = *shown_picture {
                        let ctx = ui.ctx();
                        picture_window(
                            ctx,
                            scenario,
                            index,
                            egui::Align2::RIGHT_BOTTOM,
                            &mut views.case_pictures,
                            words,
                            commands,
                        );
                    }
                }
            }
            Screen::Lesson(lesson) if lesson.are_stages_over && !lesson.is_submitted => {
                questionnaire::questionnaire_ui(ui, lesson, words, commands);
                lesson.scroll_to_statement = false;
            }
            Screen::Lesson(lesson) if lesson.are_stages_over || lesson.is_scoring => {
                let texts = &lesson.scenario.texts;
                let timed_out = lesson.timed_out_stage.as_deref().map(|stage| words.own(texts, stage));
                scoring_ui(ui, lesson.completion.progress, timed_out, words);
            }
            Screen::Completion(completion) => scoring_ui(ui, completion.state().progress, None, words),
            Screen::Lesson(lesson) => {
                practice::practice_ui(ui, lesson, settings, views, words, commands);
                if let Some(index) = *shown_picture {
                    let corner = egui::Align2::LEFT_BOTTOM;
                    picture_window(
                        ui.ctx(),
                        &lesson.scenario,
                        index,
                        corner,
                        &mut views.case_pictures,
                        words,
                        commands,
                    );
                }
            }
            Screen::Results(results) => {
                let texts = ReportTexts { words, languages: options.templates.languages() };
                results_ui(ui, results, is_test_run, &texts, commands);
            }
            Screen::Verification(verification) => {
                zip_verification_ui(ui, verification, exercise_list, words, commands);
            }
            Screen::Failed(why) => theme::centered_column(ui, |ui| {
                ui.heading(words.get("desk.failed"));
                ui.label(why.as_str());
                ui.add_space(12.0);
                if ui.add(theme::primary_button(words.get("results.again"))).clicked() {
                    commands.push(AppCommand::BackToList);
                }
            }),
        }
    }

    /// Pages over the screen: shortcuts, settings, the question before closing.
    fn overlay_ui(&mut self, ctx: &egui::Context, commands: &mut Vec<AppCommand>) {
        let words = &self.words;
        if let Some(kiosk) = self.options.kiosk().filter(|_| self.kiosk_exit.is_asked) {
            let exit = &self.kiosk_exit;
            modal_page(ctx, words.get("kiosk.close_title"), |ui| kiosk_exit::exit_ui(ui, exit, kiosk, words, commands));
        }
        if self.overlay.shortcuts {
            modal_page(ctx, words.get("keys.title"), |ui| shortcuts::shortcuts_ui(ui, words, commands));
        }
        if self.overlay.settings {
            modal_page(ctx, words.get("settings.title"), |ui| match self.options.kiosk() {
                Some(_) => kiosk_settings_ui(ui, &self.settings, &self.languages, words, commands),
                None => settings_ui(
                    ui,
                    &self.settings,
                    &SettingsContext {
                        file: self.user_folder.settings_file().as_deref(),
                        has_graphics: self.has_graphics,
                        device_answer: self.device_answer.as_ref(),
                    },
                    &self.languages,
                    words,
                    commands,
                ),
            });
        }
        if self.closing == CloseState::Asked {
            modal_page(ctx, words.get("desk.close"), |ui| {
                ui.label(words.get("practice.give_up_sure"));
                ui.add_space(8.0);
                ui.horizontal(|ui| {
                    for (key, is_closing) in [("desk.close_yes", true), ("practice.give_up_no", false)] {
                        if ui.button(words.get(key)).clicked() {
                            commands.push(AppCommand::CloseWindow(is_closing));
                        }
                    }
                });
            });
        }
    }
}

/// The bar above every screen, with the buttons for help and settings.
fn top_bar_ui(ui: &mut egui::Ui, words: &Translations, commands: &mut Vec<AppCommand>) {
    let frame = egui::Frame::NONE.inner_margin(egui::Margin::symmetric(12, 4));
    egui::Panel::top("top").resizable(false).frame(frame).show_separator_line(false).show(ui, |ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (key, command) in
                [("menu.settings", AppCommand::ShowSettings(true)), ("menu.keys", AppCommand::ShowShortcuts(true))]
            {
                let button = ui.add(egui::Button::new(words.get(key)).small());
                ui_anchors::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
    });
}

/// The page that is shown until the result is known.
fn scoring_ui(ui: &mut egui::Ui, progress: CompletionProgress, timed_out: Option<&str>, words: &Translations) {
    theme::centered_column(ui, |ui| {
        if let Some(stage) = timed_out {
            ui.label(egui::RichText::new(words.format("results.time_up", stage)).size(20.0).color(theme::WARNING));
        }
        ui.heading(words.get("practice.scoring"));
        theme::progress_bar(ui, words.get(progress.key), progress.share);
        theme::progress_dots(ui);
    });
}

/// A modal page over the screen; it takes all keyboard and pointer input.
fn modal_page(ctx: &egui::Context, title: &str, contents: impl FnOnce(&mut egui::Ui)) {
    let room = ctx.content_rect().size() - egui::vec2(80.0, 120.0);
    let height = room.y.max(200.0);
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(24);
    egui::Modal::new(egui::Id::unique(title)).frame(frame).show(ctx, |ui| {
        ui.heading(title);
        ui.add_space(10.0);
        // As high as it needs to be, up to the window's own height.
        egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, contents);
    });
}
