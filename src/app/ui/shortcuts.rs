//! Keyboard shortcuts, and the page that lists them.

use crate::command::{AppCommand, CameraCommand, PracticeCommand};
use crate::editor::EditorCommand;
use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use crate::screen::Screen;
use eframe::egui::{self, Event, Key, Modifiers};
use typodont_exercise::session::ChartInput;

/// Keys with the text keys of their functions, in the order of the page. A key whose name differs between languages is
/// itself a text key.
const SHORTCUTS: [(&str, &str); 32] = [
    ("F1", "keys.help"),
    ("F2", "keys.settings"),
    ("Tab", "keys.tab"),
    ("keyname.up_down", "keys.choose"),
    ("Enter", "keys.next"),
    ("Esc", "keys.back"),
    ("O", "keys.hold"),
    ("O", "keys.clutch"),
    ("Ctrl Enter", "keys.done"),
    ("A", "keys.tilt"),
    ("T", "keys.tool"),
    ("D", "keys.depth"),
    ("C", "keys.calculus"),
    ("P", "keys.pause"),
    ("V", "keys.view"),
    ("J M", "keys.mouth"),
    ("keyname.arrows", "keys.turn_by_key"),
    ("+ -", "keys.nearer_by_key"),
    ("keyname.arrows", "keys.move_by_key"),
    ("keyname.space", "keys.press_by_key"),
    ("keyname.page_keys", "keys.strength_by_key"),
    ("keyname.ctrl_arrows", "keys.turn_in_hand"),
    ("keyname.digits", "keys.rate"),
    ("keyname.mouse", "keys.mouse"),
    ("keyname.wheel", "keys.wheel"),
    ("keyname.left_drag", "keys.turn"),
    ("keyname.right_drag", "keys.nearer"),
    ("keyname.ctrl_drag", "keys.touchpad_nearer"),
    ("keyname.middle_drag", "keys.shift"),
    ("R", "keys.report"),
    ("Ctrl S, Z, Y", "keys.save"),
    ("F5, F8", "keys.try"),
];

/// Key that is the clutch of an arm.
const CLUTCH_KEY: Key = Key::O;

/// Angle by which one key press opens the mouth, degrees.
const MOUTH_STEP: f32 = 2.5;

/// The page that lists the shortcuts.
pub fn shortcuts_ui(ui: &mut egui::Ui, words: &Translations, commands: &mut Vec<AppCommand>) {
    /// Width of the window from which there is room for two columns, so that the whole list is visible at once; points.
    const TWO_COLUMNS: f32 = 1150.0;
    let columns = if ui.ctx().content_rect().width() >= TWO_COLUMNS { 2 } else { 1 };
    let (left, right) = SHORTCUTS.split_at(SHORTCUTS.len().div_ceil(columns));
    egui::Grid::new("keys").num_columns(2 * columns).spacing([20.0, 6.0]).striped(true).show(ui, |ui| {
        for place in 0..left.len() {
            for (key, about) in [left.get(place), right.get(place)].into_iter().flatten() {
                ui.strong(words.get(key));
                ui.label(words.get(about));
            }
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    if ui.button(words.get("settings.close")).clicked() {
        commands.push(AppCommand::ShowShortcuts(false));
    }
}

/// Digits by key.
const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];

/// True if a key has just been pressed; repeats of a held key do not count.
fn is_pressed(ctx: &egui::Context, modifiers: Modifiers, key: Key) -> bool {
    let is_it = |event: &Event| match event {
        Event::Key { key: other, pressed: true, modifiers: held, .. } => {
            *other == key && held.matches_logically(modifiers)
        }
        _ => false,
    };
    ctx.input_mut(|input| {
        let is_new = |event: &Event| is_it(event) && matches!(event, Event::Key { repeat: false, .. });
        let is_pressed = input.events.iter().any(is_new);
        input.events.retain(|event| !is_it(event));
        is_pressed
    })
}

/// Collects the commands of the keys pressed on a screen, except those that a focused widget consumes. `had_focus`: a
/// widget had the keyboard focus when they were pressed; Esc then only removes the focus.
pub fn collect_commands(
    ctx: &egui::Context,
    screen: &Screen,
    overlay: OverlayState,
    had_focus: bool,
    commands: &mut Vec<AppCommand>,
) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    // Also without an event: a window that loses the keyboard hears of no key any more.
    if let Screen::Lesson(lesson) = screen
        && lesson.is_clutch_pressed
        && !ctx.input(|input| input.key_down(CLUTCH_KEY))
    {
        commands.push(AppCommand::Practice(PracticeCommand::PressClutch(false)));
    }
    if pressed(Key::F1) {
        commands.push(AppCommand::ShowShortcuts(!overlay.shortcuts));
    }
    if pressed(Key::F2) {
        commands.push(AppCommand::ShowSettings(!overlay.settings));
    }
    if overlay.shortcuts || overlay.settings {
        if pressed(Key::Escape) {
            commands.extend([AppCommand::ShowShortcuts(false), AppCommand::ShowSettings(false)]);
        }
        return;
    }
    if let Screen::Editor(editor) = screen {
        editor_shortcuts(ctx, editor.dialog.is_some(), commands);
    }
    let is_done = is_pressed(ctx, Modifiers::COMMAND, Key::Enter);
    // A focused button needs no letters.
    if let Screen::Lesson(lesson) = screen
        && !lesson.are_stages_over
        && !lesson.is_confirming_finish
        && !lesson.is_confirming_abort
        && lesson.registration.is_none()
        && !ctx.text_edit_focused()
    {
        letter_shortcuts(ctx, lesson, commands);
    }
    if (had_focus || ctx.egui_wants_keyboard_input()) && !is_done {
        return;
    }
    match screen {
        Screen::ExerciseList => {
            for (key, by) in [(Key::ArrowUp, -1), (Key::ArrowDown, 1)] {
                if is_down(ctx, key) {
                    commands.push(AppCommand::SelectNextExercise(by));
                }
            }
            if pressed(Key::Enter) {
                commands.push(AppCommand::OpenBriefing);
            }
        }
        Screen::Editor(editor) if editor.dialog.is_none() => camera_shortcuts(ctx, Modifiers::NONE, commands),
        Screen::Briefing if pressed(Key::Enter) => commands.push(AppCommand::BeginLesson),
        Screen::Briefing if pressed(Key::Escape) => commands.push(AppCommand::BackToList),
        Screen::Lesson(lesson) if lesson.are_stages_over => questionnaire_shortcuts(ctx, lesson, is_done, commands),
        Screen::Lesson(lesson) => practice_shortcuts(ctx, lesson, is_done, commands),
        // As the coloured button.
        Screen::Results(results) if results.invites_retry() && pressed(Key::Enter) => {
            commands.push(AppCommand::TryAgain);
        }
        Screen::Results(_) | Screen::Verification(_) | Screen::Failed(_)
            if pressed(Key::Enter) || pressed(Key::Escape) =>
        {
            commands.push(AppCommand::BackToList);
        }
        Screen::Results(_) if pressed(Key::R) => commands.push(AppCommand::OpenReport),
        Screen::Editor(_)
        | Screen::Briefing
        | Screen::Completion(_)
        | Screen::Results(_)
        | Screen::Verification(_)
        | Screen::Failed(_) => {}
    }
}

/// Shortcuts of the author's screen, which also work while text is being typed.
fn editor_shortcuts(ctx: &egui::Context, is_asking: bool, commands: &mut Vec<AppCommand>) {
    if is_asking {
        if is_pressed(ctx, Modifiers::NONE, Key::Escape) {
            commands.push(AppCommand::Editor(EditorCommand::ShowSaveAs(false)));
        }
        return;
    }
    let redo = Modifiers::COMMAND | Modifiers::SHIFT;
    let keys = [
        (Modifiers::COMMAND, Key::S, EditorCommand::Save),
        // Checked with Shift first: without it the same key is undo.
        (redo, Key::Z, EditorCommand::Redo),
        (Modifiers::COMMAND, Key::Y, EditorCommand::Redo),
        (Modifiers::COMMAND, Key::Z, EditorCommand::Undo),
        (Modifiers::NONE, Key::F5, EditorCommand::TestRun),
        (Modifiers::NONE, Key::F8, EditorCommand::Check),
    ];
    for (modifiers, key, ask) in keys {
        if is_pressed(ctx, modifiers, key) {
            commands.push(AppCommand::Editor(ask));
        }
    }
}

/// Pages open over the screen.
#[derive(Clone, Copy, Default)]
pub struct OverlayState {
    pub shortcuts: bool,
    pub settings: bool,
}

/// True on the press of a key and on each of its repeats while it is held.
fn is_down(ctx: &egui::Context, key: Key) -> bool {
    ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key))
}

fn practice_shortcuts(ctx: &egui::Context, lesson: &LessonState, is_done: bool, commands: &mut Vec<AppCommand>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    if lesson.is_confirming_abort {
        if pressed(Key::Escape) {
            commands.push(AppCommand::Practice(PracticeCommand::AskToAbort(false)));
        }
        return;
    }
    if is_done && lesson.stage().is_some_and(|stage| stage.ends.confirmed) {
        commands.push(AppCommand::Practice(PracticeCommand::FinishStage));
    }
    if lesson.is_confirming_finish {
        if pressed(Key::Enter) {
            commands.push(AppCommand::Practice(PracticeCommand::FinishStage));
        }
        if pressed(Key::Escape) {
            commands.push(AppCommand::Practice(PracticeCommand::ContinueStage));
        }
        return;
    }
    if lesson.registration.is_some() {
        if pressed(Key::Space) || pressed(Key::Enter) {
            commands.push(AppCommand::Practice(PracticeCommand::TouchCross));
        }
        if pressed(Key::Escape) {
            commands.push(AppCommand::Practice(PracticeCommand::RegisterHand(false)));
        }
        return;
    }
    match lesson.is_pointer_captured {
        // The arrows alone move the instrument (`viewport_input`).
        true => {
            camera_shortcuts(ctx, Modifiers::COMMAND, commands);
            for (key, steps) in [(Key::PageUp, 1.0), (Key::PageDown, -1.0)] {
                if is_down(ctx, key) {
                    commands.push(AppCommand::Practice(PracticeCommand::ChangeStrength(steps)));
                }
            }
        }
        false => camera_shortcuts(ctx, Modifiers::NONE, commands),
    }
    if pressed(Key::Escape) {
        commands.push(match lesson.is_pointer_captured {
            true => AppCommand::Practice(PracticeCommand::CapturePointer(false)),
            false => AppCommand::Practice(PracticeCommand::AskToAbort(true)),
        });
    }
}

/// Shortcuts of the practice screen that are letters.
fn letter_shortcuts(ctx: &egui::Context, lesson: &LessonState, commands: &mut Vec<AppCommand>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    if lesson.has_mouse() && pressed(Key::O) {
        // From now on the arrows and Space are for the instrument.
        ctx.memory_mut(|memory| memory.stop_text_input());
        commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(!lesson.is_pointer_captured)));
    }
    if lesson.has_placeable_hand() {
        clutch_shortcut(ctx, commands);
    }
    if pressed(Key::T)
        && let Some(instrument) = next_instrument(lesson)
    {
        commands.push(AppCommand::Practice(PracticeCommand::SelectInstrument(instrument)));
    }
    let chart = lesson.stage().map(|stage| stage.chart).unwrap_or_default();
    if chart.depths && pressed(Key::D) {
        commands.push(AppCommand::Practice(PracticeCommand::AddToChart(ChartInput::Depth)));
    }
    if chart.calculus && pressed(Key::C) {
        commands.push(AppCommand::Practice(PracticeCommand::AddToChart(ChartInput::Calculus)));
    }
    if pressed(Key::P) {
        commands.push(AppCommand::Practice(PracticeCommand::Pause(!lesson.is_paused)));
    }
    if pressed(Key::V) {
        commands.push(AppCommand::Practice(PracticeCommand::SetDisplayMode(lesson.next_display_mode())));
    }
    for (key, by) in [(Key::J, MOUTH_STEP), (Key::M, -MOUTH_STEP)] {
        if is_down(ctx, key) {
            commands.push(AppCommand::Practice(PracticeCommand::AdjustMouthOpening(by)));
        }
    }
}

/// Presses and releases the clutch with its key, in order: two short presses in one frame recentre the arm.
fn clutch_shortcut(ctx: &egui::Context, commands: &mut Vec<AppCommand>) {
    ctx.input(|input| {
        for event in &input.events {
            if let Event::Key { key: CLUTCH_KEY, pressed, repeat: false, modifiers, .. } = event
                && (!pressed || modifiers.is_none())
            {
                commands.push(AppCommand::Practice(PracticeCommand::PressClutch(*pressed)));
            }
        }
    });
}

/// Shortcuts that move the camera, for users whose mouse is not free. The arrows are used with the modifiers.
fn camera_shortcuts(ctx: &egui::Context, modifiers: Modifiers, commands: &mut Vec<AppCommand>) {
    /// rad
    const TURN_STEP: f32 = 0.1;
    /// Share of the picture's height.
    const SHIFT: f32 = 0.05;
    /// Share of the distance.
    const NEARER: f32 = 0.9;
    let arrows = [
        (Key::ArrowRight, 1.0, 0.0),
        (Key::ArrowLeft, -1.0, 0.0),
        (Key::ArrowUp, 0.0, 1.0),
        (Key::ArrowDown, 0.0, -1.0),
    ];
    for (key, right, up) in arrows {
        // Checked with Shift first: without it the same key rotates the camera.
        if ctx.input_mut(|input| input.consume_key(modifiers | Modifiers::SHIFT, key)) {
            commands.push(AppCommand::Camera(CameraCommand::Pan { right: SHIFT * right, up: SHIFT * up }));
        } else if ctx.input_mut(|input| input.consume_key(modifiers, key)) {
            commands.push(AppCommand::Camera(CameraCommand::Orbit { right: TURN_STEP * right, up: TURN_STEP * up }));
        }
    }
    for (key, factor) in [(Key::Plus, NEARER), (Key::Equals, NEARER), (Key::Minus, 1.0 / NEARER)] {
        if is_down(ctx, key) {
            commands.push(AppCommand::Camera(CameraCommand::Zoom(factor)));
        }
    }
}

/// Index of the instrument that follows the one in use on this stage's tray.
fn next_instrument(lesson: &LessonState) -> Option<usize> {
    let tray = &lesson.stage()?.instruments;
    let current = lesson.snapshot?.instrument as usize;
    let place = tray.iter().position(|&i| i == current).map_or(0, |place| (place + 1) % tray.len());
    tray.get(place).copied()
}

fn questionnaire_shortcuts(ctx: &egui::Context, lesson: &LessonState, is_done: bool, commands: &mut Vec<AppCommand>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    let Some(questionnaire) = &lesson.scenario.questionnaire else { return };
    if is_done {
        commands.push(AppCommand::Practice(PracticeCommand::SubmitQuestionnaire));
        return;
    }
    for (key, by) in [(Key::ArrowUp, -1), (Key::ArrowDown, 1)] {
        if is_down(ctx, key) {
            commands.push(AppCommand::Practice(PracticeCommand::SelectNextStatement(by)));
        }
    }
    for (value, key) in (1u8..).zip(DIGITS) {
        if value <= questionnaire.steps
            && pressed(key)
            && let Some(item) = questionnaire.items().nth(lesson.statement)
        {
            commands.extend([
                AppCommand::Practice(PracticeCommand::RateStatement(item.id.clone(), value)),
                AppCommand::Practice(PracticeCommand::SelectNextStatement(1)),
            ]);
        }
    }
}
