//! The pointer over the practice view: it acts as the device, or moves the camera.
//!
//! While it is free, its buttons move the camera as in the thesis: left rotates, right zooms, middle shifts. While it
//! acts as the device, the hand follows the surface under the pointer, the left button presses, the wheel sets the
//! strength, and the right button rotates the view; with the Ctrl key the buttons and the wheel move the camera as
//! before.

use super::command::{AppCommand, CameraCommand, PracticeCommand};
use super::pointer_hand::PointedPlace;
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
    if view.clicked() {
        commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(true)));
    }
    let steps = wheel(ui);
    if view.hovered() && steps != 0.0 {
        commands.push(AppCommand::Camera(CameraCommand::Zoom((-steps * ZOOM_PER_WHEEL_STEP).exp())));
    }
}

/// Share of the pointer's movement that the hand follows while Shift is held.
const FINE_SHARE: f32 = 0.25;

fn captured_pointer(ui: &egui::Ui, view: &egui::Response, commands: &mut Vec<AppCommand>) {
    view.clone().on_hover_cursor(egui::CursorIcon::Crosshair);
    let rect = view.rect;
    let (modifiers, at, is_pressed) =
        ui.input(|input| (input.modifiers, input.pointer.latest_pos(), input.pointer.primary_down()));
    let is_on_view = view.contains_pointer() || view.is_pointer_button_down_on();
    let drag = match (ui.input(camera_drag), modifiers.command) {
        (drag, true) => drag,
        (Some(CameraDrag::Zoom), false) => Some(CameraDrag::Orbit),
        (Some(CameraDrag::Pan), false) => Some(CameraDrag::Pan),
        (Some(CameraDrag::Orbit) | None, false) => None,
    };
    if view.dragged()
        && let Some(drag) = drag
        && view.drag_motion() != egui::Vec2::ZERO
    {
        commands.push(camera_command(drag, view.drag_motion(), rect.height().max(1.0)));
    }
    let steps = wheel(ui);
    if view.hovered() && steps != 0.0 {
        commands.push(match modifiers.command {
            true => AppCommand::Camera(CameraCommand::Zoom((-steps * ZOOM_PER_WHEEL_STEP).exp())),
            false => AppCommand::Practice(PracticeCommand::ChangeStrength(steps)),
        });
    }
    let is_working = is_on_view && drag.is_none();
    let is_down = is_working && is_pressed && view.is_pointer_button_down_on();
    commands.push(AppCommand::Practice(PracticeCommand::SetDeviceButton { bit: 0, is_down }));
    let place = at.filter(|_| is_working).map(|at| {
        let share = (fine_position(ui, view.id, at, modifiers.shift) - rect.min) / rect.size();
        PointedPlace { share: [share.x, share.y], aspect: rect.width() / rect.height().max(1.0) }
    });
    commands.push(AppCommand::Practice(PracticeCommand::PointAt(place)));
}

/// Position at which the hand points: that of the pointer, or, while Shift is held, one that follows it more finely
/// from where it was.
fn fine_position(ui: &egui::Ui, view: egui::Id, at: egui::Pos2, is_fine: bool) -> egui::Pos2 {
    let anchor = view.with("fine");
    if !is_fine {
        ui.data_mut(|data| data.remove_temp::<egui::Pos2>(anchor));
        return at;
    }
    let start = ui.data_mut(|data| *data.get_temp_mut_or_insert_with(anchor, || at));
    start + (at - start) * FINE_SHARE
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
