//! The pointer over the practice view: the hand itself, or what moves the camera.
//!
//! Free, its buttons move the camera as in the thesis: left turns, right comes nearer, middle shifts. Held, its movement is
//! the hand's, the wheel takes the hand in depth, and the same buttons with the Ctrl key still move the camera.

use super::command::Command;
use eframe::egui::{self, Event, MouseWheelUnit, PointerButton};

/// How far a drag across one point of the screen turns, rad: half a turn in 300 points.
const TURN: f32 = 0.0105;

/// How far a drag across one point comes nearer, as a share of the distance.
const NEARER: f32 = 0.006;

/// How far one step of the wheel comes nearer.
const WHEEL_NEARER: f32 = 0.1;

/// Points that count as one step of a wheel, where a touchpad tells only points.
const POINTS_PER_STEP: f32 = 40.0;

/// What the pointer asks for over a view, while it is held or free.
pub fn asked(ui: &egui::Ui, view: &egui::Response, is_held: bool, asked: &mut Vec<Command>) {
    match is_held {
        true => held(ui, view, asked),
        false => free(ui, view, asked),
    }
}

/// What a drag does to the camera.
#[derive(Clone, Copy)]
enum Drag {
    Turn,
    Nearer,
    Shift,
}

/// By button as in the thesis.
fn drag(input: &egui::InputState) -> Option<Drag> {
    let down = |button| input.pointer.button_down(button);
    match () {
        () if down(PointerButton::Primary) => Some(Drag::Turn),
        () if down(PointerButton::Secondary) => Some(Drag::Nearer),
        () if down(PointerButton::Middle) => Some(Drag::Shift),
        () => None,
    }
}

/// With one button, as on a touchpad, Ctrl comes nearer and Shift shifts.
fn drag_when_free(input: &egui::InputState) -> Option<Drag> {
    match (drag(input)?, input.modifiers) {
        (Drag::Turn, m) if m.command => Some(Drag::Nearer),
        (Drag::Turn, m) if m.shift => Some(Drag::Shift),
        (drag, _) => Some(drag),
    }
}

fn camera(drag: Drag, by: egui::Vec2, height: f32) -> Command {
    match drag {
        Drag::Turn => Command::Turn { right: -by.x * TURN, up: by.y * TURN },
        Drag::Nearer => Command::Nearer((by.y * NEARER).exp()),
        Drag::Shift => Command::Shift { right: by.x / height, up: -by.y / height },
    }
}

fn free(ui: &egui::Ui, view: &egui::Response, asked: &mut Vec<Command>) {
    let height = view.rect.height().max(1.0);
    if view.dragged()
        && let Some(drag) = ui.input(drag_when_free)
        && view.drag_motion() != egui::Vec2::ZERO
    {
        asked.push(camera(drag, view.drag_motion(), height));
    }
    if view.double_clicked() {
        asked.push(Command::HoldPointer(true));
    }
    let steps = wheel(ui);
    if view.hovered() && steps != 0.0 {
        asked.push(Command::Nearer((-steps * WHEEL_NEARER).exp()));
    }
}

fn held(ui: &egui::Ui, view: &egui::Response, asked: &mut Vec<Command>) {
    let by = motion(ui);
    let (is_camera, in_depth) = ui.input(|input| (input.modifiers.command, input.modifiers.shift));
    let drag = ui.input(drag).filter(|_| is_camera);
    match drag {
        Some(drag) if by != egui::Vec2::ZERO => asked.push(camera(drag, by, view.rect.height().max(1.0))),
        Some(_) => {}
        // A touchpad has no wheel: with Shift its second direction is depth.
        None if in_depth && by.y != 0.0 => asked.push(Command::MoveDeeper(-by.y / POINTS_PER_STEP)),
        None if by != egui::Vec2::ZERO => asked.push(Command::MoveHand { right: by.x, down: by.y }),
        None => {}
    }
    let steps = wheel(ui);
    if steps != 0.0 {
        asked.push(Command::MoveDeeper(steps));
    }
    for (bit, button) in [PointerButton::Primary, PointerButton::Secondary].into_iter().enumerate() {
        let (pressed, released) = ui.input(|i| (i.pointer.button_pressed(button), i.pointer.button_released(button)));
        if (pressed && !is_camera) || released {
            asked.push(Command::PressHandle { bit: bit as u32, is_down: pressed });
        }
    }
}

/// How far the mouse itself went: the pointer stops at borders, and is brought back to the middle.
fn motion(ui: &egui::Ui) -> egui::Vec2 {
    let moved = |event: &Event| if let Event::MouseMoved(by) = event { Some(*by) } else { None };
    ui.input(|input| input.events.iter().filter_map(moved).fold(egui::Vec2::ZERO, |sum, by| sum + by))
}

/// Steps of the wheel, forward positive.
fn wheel(ui: &egui::Ui) -> f32 {
    ui.input(|input| {
        let steps = |event: &Event| match event {
            Event::MouseWheel { unit: MouseWheelUnit::Point, delta, .. } => delta.y / POINTS_PER_STEP,
            Event::MouseWheel { delta, .. } => delta.y,
            _ => 0.0,
        };
        input.events.iter().map(steps).sum()
    })
}
