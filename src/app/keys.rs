//! What each key does, and the page that says so.

use super::author::Ask;
use super::command::{Command, Screen};
use super::language::Words;
use super::sitting::Sitting;
use crate::session::Sign;
use eframe::egui::{self, Event, Key, Modifiers};

/// Keys and what they do, as the page lists them.
const LISTED: [(&str, &str); 30] = [
    ("F1", "keys.help"),
    ("F2", "keys.settings"),
    ("Tab", "keys.tab"),
    ("Up Down", "keys.choose"),
    ("Enter", "keys.next"),
    ("Esc", "keys.back"),
    ("O", "keys.hold"),
    ("Ctrl Enter", "keys.done"),
    ("T", "keys.tool"),
    ("D", "keys.depth"),
    ("C", "keys.calculus"),
    ("P", "keys.pause"),
    ("V", "keys.view"),
    ("J M", "keys.mouth"),
    ("Arrows", "keys.turn_by_key"),
    ("+ -", "keys.nearer_by_key"),
    ("Shift Arrows", "keys.shift_by_key"),
    ("1 to 9", "keys.rate"),
    ("Mouse", "keys.mouse"),
    ("Wheel", "keys.wheel"),
    ("Left drag", "keys.turn"),
    ("Right drag", "keys.nearer"),
    ("Middle drag", "keys.shift"),
    ("Ctrl drag", "keys.touchpad_nearer"),
    ("Shift drag", "keys.touchpad_shift"),
    ("R", "keys.report"),
    ("Ctrl S", "keys.save"),
    ("Ctrl Z, Ctrl Y", "keys.undo"),
    ("F5", "keys.try"),
    ("F8", "keys.check"),
];

/// How far one press of a key opens the mouth, degrees.
const MOUTH_STEP: f32 = 2.5;

/// The page of keys.
pub fn keys_ui(ui: &mut egui::Ui, words: &Words, asked: &mut Vec<Command>) {
    // Two columns, so that all of it is seen at once.
    let (left, right) = LISTED.split_at(LISTED.len().div_ceil(2));
    egui::Grid::new("keys").num_columns(4).spacing([20.0, 6.0]).striped(true).show(ui, |ui| {
        for place in 0..left.len() {
            for (key, about) in [left.get(place), right.get(place)].into_iter().flatten() {
                ui.strong(*key);
                ui.label(words.of(about));
            }
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    if ui.button(words.of("settings.close")).clicked() {
        asked.push(Command::ShowKeys(false));
    }
}

/// Digits by key.
const DIGITS: [Key; 9] =
    [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];

/// True when a key has just gone down: one that is kept down asks for nothing more.
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

/// What the keys ask for on a screen, besides what a focused widget takes for itself. `had_focus`: a widget had the keys when
/// they went down; Esc then only takes them from it.
pub fn asked(ctx: &egui::Context, screen: &Screen, is_open: Open, had_focus: bool, asked: &mut Vec<Command>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    if pressed(Key::F1) {
        asked.push(Command::ShowKeys(!is_open.keys));
    }
    if pressed(Key::F2) {
        asked.push(Command::ShowSettings(!is_open.settings));
    }
    if is_open.keys || is_open.settings {
        if pressed(Key::Escape) {
            asked.extend([Command::ShowKeys(false), Command::ShowSettings(false)]);
        }
        return;
    }
    if let Screen::Author(authoring) = screen {
        author(ctx, authoring.asking.is_some(), asked);
    }
    let is_done = is_pressed(ctx, Modifiers::COMMAND, Key::Enter);
    if (had_focus || ctx.egui_wants_keyboard_input()) && !is_done {
        return;
    }
    match screen {
        Screen::Shelf => {
            for (key, by) in [(Key::ArrowUp, -1), (Key::ArrowDown, 1)] {
                if is_down(ctx, key) {
                    asked.push(Command::ChooseNext(by));
                }
            }
            if pressed(Key::Enter) {
                asked.push(Command::Open);
            }
        }
        Screen::Author(authoring) if authoring.asking.is_none() => camera(ctx, asked),
        Screen::Briefing if pressed(Key::Enter) => asked.push(Command::Begin),
        Screen::Briefing if pressed(Key::Escape) => asked.push(Command::ToShelf),
        Screen::Lesson(sitting) if sitting.are_stages_over => questionnaire(ctx, sitting, is_done, asked),
        Screen::Lesson(sitting) => practice(ctx, sitting, is_done, asked),
        Screen::Results(_) | Screen::Failed(_) if pressed(Key::Enter) || pressed(Key::Escape) => {
            asked.push(Command::ToShelf);
        }
        Screen::Results(_) if pressed(Key::R) => asked.push(Command::ShowReport),
        Screen::Author(_) | Screen::Briefing | Screen::Results(_) | Screen::Failed(_) => {}
    }
}

/// At the author's screen, also while something is typed.
fn author(ctx: &egui::Context, is_asking: bool, asked: &mut Vec<Command>) {
    if is_asking {
        if is_pressed(ctx, Modifiers::NONE, Key::Escape) {
            asked.push(Command::Author(Ask::Where(false)));
        }
        return;
    }
    let redo = Modifiers::COMMAND | Modifiers::SHIFT;
    let keys = [
        (Modifiers::COMMAND, Key::S, Ask::Save),
        // With Shift first: without it the same key takes back.
        (redo, Key::Z, Ask::Redo),
        (Modifiers::COMMAND, Key::Y, Ask::Redo),
        (Modifiers::COMMAND, Key::Z, Ask::Undo),
        (Modifiers::NONE, Key::F5, Ask::Try),
        (Modifiers::NONE, Key::F8, Ask::Check),
    ];
    for (modifiers, key, ask) in keys {
        if is_pressed(ctx, modifiers, key) {
            asked.push(Command::Author(ask));
        }
    }
}

/// What lies over the screen.
#[derive(Clone, Copy, Default)]
pub struct Open {
    pub keys: bool,
    pub settings: bool,
}

/// True as long as a key is kept down, as often as it repeats.
fn is_down(ctx: &egui::Context, key: Key) -> bool {
    ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key))
}

fn practice(ctx: &egui::Context, sitting: &Sitting, is_done: bool, asked: &mut Vec<Command>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    if is_done && sitting.stage().is_some_and(|stage| stage.ends.confirmed) {
        asked.push(Command::Confirm);
    }
    if pressed(Key::O) && sitting.has_mouse() {
        asked.push(Command::HoldPointer(!sitting.is_pointer_held));
    }
    if pressed(Key::T)
        && let Some(instrument) = next_instrument(sitting)
    {
        asked.push(Command::Take(instrument));
    }
    let chart = sitting.stage().map(|stage| stage.chart).unwrap_or_default();
    if chart.depths && pressed(Key::D) {
        asked.push(Command::Chart(Sign::Depth));
    }
    if chart.calculus && pressed(Key::C) {
        asked.push(Command::Chart(Sign::Calculus));
    }
    if pressed(Key::P) {
        asked.push(Command::Pause(!sitting.is_paused));
    }
    if pressed(Key::V) {
        asked.push(Command::Show(sitting.next_way()));
    }
    for (key, by) in [(Key::J, MOUTH_STEP), (Key::M, -MOUTH_STEP)] {
        if is_down(ctx, key) {
            asked.push(Command::OpenMouth(by));
        }
    }
    camera(ctx, asked);
    if pressed(Key::Escape) {
        asked.push(match sitting.is_pointer_held {
            true => Command::HoldPointer(false),
            false => Command::GiveUp(!sitting.is_giving_up),
        });
    }
}

/// The camera, for whoever has no mouse to spare.
fn camera(ctx: &egui::Context, asked: &mut Vec<Command>) {
    /// rad
    const TURN: f32 = 0.1;
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
        // Shift first: without it the same key would turn.
        if ctx.input_mut(|input| input.consume_key(Modifiers::SHIFT, key)) {
            asked.push(Command::Shift { right: SHIFT * right, up: SHIFT * up });
        } else if is_down(ctx, key) {
            asked.push(Command::Turn { right: TURN * right, up: TURN * up });
        }
    }
    for (key, factor) in [(Key::Plus, NEARER), (Key::Equals, NEARER), (Key::Minus, 1.0 / NEARER)] {
        if is_down(ctx, key) {
            asked.push(Command::Nearer(factor));
        }
    }
}

/// The one after that in the hand, on this stage's tray.
fn next_instrument(sitting: &Sitting) -> Option<usize> {
    let tray = &sitting.stage()?.instruments;
    let held = sitting.seen?.instrument as usize;
    let place = tray.iter().position(|&i| i == held).map_or(0, |place| (place + 1) % tray.len());
    tray.get(place).copied()
}

fn questionnaire(ctx: &egui::Context, sitting: &Sitting, is_done: bool, asked: &mut Vec<Command>) {
    let pressed = |key| is_pressed(ctx, Modifiers::NONE, key);
    let Some(questionnaire) = &sitting.scenario.questionnaire else { return };
    if is_done {
        asked.push(Command::HandIn);
        return;
    }
    for (key, by) in [(Key::ArrowUp, -1), (Key::ArrowDown, 1)] {
        if is_down(ctx, key) {
            asked.push(Command::NextStatement(by));
        }
    }
    for (value, key) in (1u8..).zip(DIGITS) {
        if value <= questionnaire.steps
            && pressed(key)
            && let Some(item) = questionnaire.items().nth(sitting.statement)
        {
            asked.extend([Command::Rate(item.id.clone(), value), Command::NextStatement(1)]);
        }
    }
}
