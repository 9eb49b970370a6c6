//! The pointer over the practice view: it acts as the device, or moves the camera.
//!
//! While it is free, its buttons move the camera as in the thesis: left rotates, right zooms, middle shifts. While it
//! is captured, its movement moves the hand, the wheel moves the hand in depth, and the same buttons with the Ctrl key
//! still move the camera.

use super::command::{AppCommand, CameraCommand, PracticeCommand};
use eframe::egui::{self, Event, MouseWheelUnit, PointerButton};

/// Rotation by a drag across one point of the screen, rad: half a turn in 300 points.
const RADIANS_PER_POINT: f32 = 0.0105;

/// Zoom by a drag across one point, as a share of the distance.
const ZOOM_PER_POINT: f32 = 0.006;

/// Zoom by one step of the wheel, as a share of the distance.
const ZOOM_PER_WHEEL_STEP: f32 = 0.1;

/// Points that count as one step of a wheel, for touchpads, which report points only.
const POINTS_PER_STEP: f32 = 40.0;

/// Collects the commands of the pointer over a view, captured or free.
pub fn collect_commands(ui: &egui::Ui, view: &egui::Response, is_captured: bool, commands: &mut Vec<AppCommand>) {
    match is_captured {
        true => captured_pointer(ui, view, commands),
        false => free_pointer(ui, view, commands),
    }
}

/// Effect of a drag on the camera.
#[derive(Clone, Copy)]
enum CameraDrag {
    Orbit,
    Zoom,
    Pan,
}

/// The drag of the pressed button, as in the thesis.
fn camera_drag(input: &egui::InputState) -> Option<CameraDrag> {
    let down = |button| input.pointer.button_down(button);
    match () {
        () if down(PointerButton::Primary) => Some(CameraDrag::Orbit),
        () if down(PointerButton::Secondary) => Some(CameraDrag::Zoom),
        () if down(PointerButton::Middle) => Some(CameraDrag::Pan),
        () => None,
    }
}

/// As [`camera_drag`]; with one button only, as on a touchpad, Ctrl zooms and Shift shifts.
fn free_camera_drag(input: &egui::InputState) -> Option<CameraDrag> {
    match (camera_drag(input)?, input.modifiers) {
        (CameraDrag::Orbit, m) if m.command => Some(CameraDrag::Zoom),
        (CameraDrag::Orbit, m) if m.shift => Some(CameraDrag::Pan),
        (drag, _) => Some(drag),
    }
}

fn camera_command(drag: CameraDrag, by: egui::Vec2, height: f32) -> AppCommand {
    match drag {
        CameraDrag::Orbit => {
            AppCommand::Camera(CameraCommand::Orbit { right: -by.x * RADIANS_PER_POINT, up: by.y * RADIANS_PER_POINT })
        }
        CameraDrag::Zoom => AppCommand::Camera(CameraCommand::Zoom((by.y * ZOOM_PER_POINT).exp())),
        CameraDrag::Pan => AppCommand::Camera(CameraCommand::Pan { right: by.x / height, up: -by.y / height }),
    }
}

fn free_pointer(ui: &egui::Ui, view: &egui::Response, commands: &mut Vec<AppCommand>) {
    let height = view.rect.height().max(1.0);
    if view.dragged()
        && let Some(drag) = ui.input(free_camera_drag)
        && view.drag_motion() != egui::Vec2::ZERO
    {
        commands.push(camera_command(drag, view.drag_motion(), height));
    }
    if view.double_clicked() {
        commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(true)));
    }
    let steps = wheel(ui);
    if view.hovered() && steps != 0.0 {
        commands.push(AppCommand::Camera(CameraCommand::Zoom((-steps * ZOOM_PER_WHEEL_STEP).exp())));
    }
}

fn captured_pointer(ui: &egui::Ui, view: &egui::Response, commands: &mut Vec<AppCommand>) {
    let by = motion(ui);
    let (is_camera, in_depth) = ui.input(|input| (input.modifiers.command, input.modifiers.shift));
    let drag = ui.input(camera_drag).filter(|_| is_camera);
    match drag {
        Some(drag) if by != egui::Vec2::ZERO => commands.push(camera_command(drag, by, view.rect.height().max(1.0))),
        Some(_) => {}
        // A touchpad has no wheel: with Shift, its vertical movement is depth.
        None if in_depth && by.y != 0.0 => {
            commands.push(AppCommand::Practice(PracticeCommand::MoveHandDepth(-by.y / POINTS_PER_STEP)))
        }
        None if by != egui::Vec2::ZERO => {
            commands.push(AppCommand::Practice(PracticeCommand::MoveHand { right: by.x, down: by.y }))
        }
        None => {}
    }
    let steps = wheel(ui);
    if steps != 0.0 {
        commands.push(AppCommand::Practice(PracticeCommand::MoveHandDepth(steps)));
    }
    for (bit, button) in [PointerButton::Primary, PointerButton::Secondary].into_iter().enumerate() {
        let (pressed, released) = ui.input(|i| (i.pointer.button_pressed(button), i.pointer.button_released(button)));
        if (pressed && !is_camera) || released {
            commands.push(AppCommand::Practice(PracticeCommand::SetDeviceButton { bit: bit as u32, is_down: pressed }));
        }
    }
}

/// Movement of the mouse itself, counts; the pointer stops at the window's edges and is moved back to the centre.
fn motion(ui: &egui::Ui) -> egui::Vec2 {
    let moved = |event: &Event| if let Event::MouseMoved(by) = event { Some(*by) } else { None };
    ui.input(|input| input.events.iter().filter_map(moved).fold(egui::Vec2::ZERO, |sum, by| sum + by))
}

/// Steps of the wheel since the last frame; forward is positive.
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
