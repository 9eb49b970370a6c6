//! The pointer over the practice view: it acts as the device, or moves the camera.
//!
//! While it is free, its buttons move the camera as in the thesis: left rotates, right zooms, middle shifts. While it
//! acts as the device, the hand follows the surface under the pointer, the left button presses, the wheel sets the
//! strength, and the right button rotates the view; with the Ctrl key the buttons and the wheel move the camera as
//! before. The arrow keys move the hand as the pointer does, and the space bar presses. While the key A is held, the pointer
//! or the arrows tilt the instrument, and a press of the key alone holds it upright again. A
//! pen presses as hard as it is pressed, and the instrument is tilted as the pen is; one finger points, and a second one
//! presses.

use crate::command::{AppCommand, CameraCommand, PracticeCommand};
use crate::platform;
use crate::pointer_hand::PointedPlace;
use crate::ui::touches::{Touches, pen_pressure};
use eframe::egui::{self, Event, Key, MouseWheelUnit, PointerButton};

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
    let mut contact = contact(ui, view);
    match is_captured {
        true => captured_pointer(ui, view, &mut contact, commands),
        false => {
            end_tilting(ui, view.id);
            stop_keyed_hand(ui, view.id);
            free_pointer(ui, view, commands)
        }
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
        // From now on the arrows and Space are for the instrument, also if Space chose the view.
        ui.memory_mut(|memory| memory.stop_text_input());
        commands.push(AppCommand::Practice(PracticeCommand::CapturePointer(true)));
    }
    let steps = wheel(ui);
    if view.hovered() && steps != 0.0 {
        commands.push(AppCommand::Camera(CameraCommand::Zoom((-steps * ZOOM_PER_WHEEL_STEP).exp())));
    }
    // Two fingers that part zoom in.
    if let Some(fingers) = ui.input(|input| input.multi_touch()).filter(|fingers| fingers.zoom_delta != 1.0) {
        commands.push(AppCommand::Camera(CameraCommand::Zoom(1.0 / fingers.zoom_delta)));
    }
}

/// Share of the pointer's movement that the hand follows while Shift is held.
const FINE_SHARE: f32 = 0.25;

/// Contact of the pointer with the view, from frame to frame.
#[derive(Clone, Debug, Default)]
struct PointerContact {
    touches: Touches,
    /// True while a press lasts that began on the view.
    began_on_view: bool,
}

/// Takes over the events of a frame, whether the pointer is captured or free, so that no end of a contact is missed.
fn contact(ui: &egui::Ui, view: &egui::Response) -> PointerContact {
    let (events, any_touches) = ui.input(|input| (input.events.clone(), input.any_touches()));
    let (is_pressed, is_down) = ui.input(|input| (input.pointer.primary_pressed(), input.pointer.primary_down()));
    ui.data_mut(|data| {
        let contact = data.get_temp_mut_or_default::<PointerContact>(view.id.with("contact"));
        contact.touches.update(&events);
        if !any_touches {
            contact.touches.clear();
        }
        // egui forgets the widget on which a long touch began.
        contact.began_on_view = is_down && (contact.began_on_view || is_pressed && view.is_pointer_button_down_on());
        contact.clone()
    })
}

/// Ends a press, although the button is still held.
fn let_go(ui: &egui::Ui, view: egui::Id) {
    ui.data_mut(|data| data.get_temp_mut_or_default::<PointerContact>(view.with("contact")).began_on_view = false);
}

fn captured_pointer(
    ui: &egui::Ui,
    view: &egui::Response,
    contact: &mut PointerContact,
    commands: &mut Vec<AppCommand>,
) {
    view.clone().on_hover_cursor(egui::CursorIcon::Crosshair);
    let rect = view.rect;
    let (modifiers, pointer) = ui.input(|input| (input.modifiers, input.pointer.latest_pos()));
    let keyed = keyed_place(ui, view, pointer);
    let at = keyed.or(pointer);
    let is_on_view = view.contains_pointer() || contact.began_on_view || keyed.is_some();
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
    let was_tilting = is_tilting(ui, view.id);
    let tilting = tilting(ui, view.id, at, commands);
    if was_tilting && tilting.is_none() {
        // The hand goes to the pointer, wherever that is by now, without pressing.
        let_go(ui, view.id);
        contact.began_on_view = false;
    }
    let at = tilting.map(|tilting| tilting.place).or(at);
    let is_working = (is_on_view || tilting.is_some()) && drag.is_none();
    let pen = platform::pen();
    commands.push(AppCommand::Practice(PracticeCommand::SetPenDirection(pen.and_then(|pen| pen.direction()))));
    // A finger or a pen on the screen counts as the left button, and yet a finger alone only points.
    let is_pressed_by_key = tilting.is_none() && is_space_down(ui);
    let of_pen = pen.and_then(|pen| pen.pressure).map(pen_pressure);
    let of_contact = of_pen.or(contact.touches.pressure()).unwrap_or(1.0);
    let pressure = if is_pressed_by_key { 1.0 } else { of_contact };
    let is_down = is_working && (contact.began_on_view && pressure > 0.0 || is_pressed_by_key);
    commands.push(AppCommand::Practice(PracticeCommand::SetPressure(pressure)));
    commands.push(AppCommand::Practice(PracticeCommand::SetDeviceButton { bit: 0, is_down }));
    let place = at.filter(|_| is_working).map(|at| {
        // The keys move the hand more finely by themselves.
        let at = if keyed.is_some() { at } else { fine_position(ui, view.id, at, modifiers.shift) };
        let share = (at - rect.min) / rect.size();
        PointedPlace { share: [share.x, share.y], aspect: rect.width() / rect.height().max(1.0) }
    });
    commands.push(AppCommand::Practice(PracticeCommand::PointAt(place)));
}

/// Speed of a hand that the arrow keys move, points/s: at first, for small corrections, and after [`KEY_RAMP`] seconds.
const KEY_SPEEDS: [f32; 2] = [25.0, 150.0];
const KEY_RAMP: f32 = 1.2;

/// Longest time that a frame counts for, s: after a longer one the hand would jump.
const FRAME_MAX: f32 = 0.1;

/// Place to which the arrow keys have moved the hand.
#[derive(Clone, Copy)]
struct KeyedHand {
    place: egui::Pos2,
    /// Time for which the arrows have been held, s.
    held: f32,
    /// Place of the pointer, which takes over when it moves.
    pointer: Option<egui::Pos2>,
    /// False once the pointer leads the hand.
    is_leading: bool,
}

/// Moves the hand by the arrow keys. Returns its place while the keys lead it: from the first arrow, or a press of the space
/// bar while the pointer is elsewhere, until the pointer moves.
fn keyed_place(ui: &egui::Ui, view: &egui::Response, pointer: Option<egui::Pos2>) -> Option<egui::Pos2> {
    let id = view.id.with("keyed");
    let last = ui.data(|data| data.get_temp::<KeyedHand>(id));
    let known = last.filter(|hand| hand.is_leading && hand.pointer == pointer);
    let arrows = arrows(ui);
    let (is_tilting, is_fine, seconds) =
        ui.input(|input| (input.key_down(Key::A), input.modifiers.shift, input.unstable_dt.min(FRAME_MAX)));
    let on_view = pointer.filter(|at| view.rect.contains(*at));
    let begins = arrows != egui::Vec2::ZERO || on_view.is_none() && is_space_down(ui);
    if known.is_none() && !begins {
        stop_keyed_hand(ui, view.id);
        return None;
    }
    let last = last.map_or(view.rect.center(), |hand| view.rect.clamp(hand.place));
    let start = KeyedHand { place: on_view.unwrap_or(last), held: 0.0, pointer, is_leading: true };
    let KeyedHand { place, held, .. } = known.unwrap_or(start);
    let (place, held) = if arrows == egui::Vec2::ZERO {
        (place, 0.0)
    } else if is_tilting {
        (place, held)
    } else {
        let [first, last] = KEY_SPEEDS;
        let speed = (first + (last - first) * (held / KEY_RAMP).min(1.0)) * if is_fine { FINE_SHARE } else { 1.0 };
        (view.rect.clamp(place + arrows * speed * seconds), held + seconds)
    };
    if arrows != egui::Vec2::ZERO {
        ui.ctx().request_repaint();
    }
    ui.data_mut(|data| data.insert_temp(id, KeyedHand { place, held, pointer, is_leading: true }));
    Some(place)
}

/// Ends the lead of the keys; the next key goes on from where they left the hand.
fn stop_keyed_hand(ui: &egui::Ui, view: egui::Id) {
    let id = view.with("keyed");
    ui.data_mut(|data| {
        if let Some(last) = data.get_temp::<KeyedHand>(id) {
            data.insert_temp(id, KeyedHand { is_leading: false, ..last });
        }
    });
}

/// True while the space bar is held, unless it is for a focused button.
fn is_space_down(ui: &egui::Ui) -> bool {
    !ui.ctx().egui_wants_keyboard_input() && ui.input(|input| input.key_down(Key::Space))
}

/// Direction of the arrow keys that are held, unless Ctrl makes them move the camera or a widget has the keyboard focus; of
/// length 0 or 1.
fn arrows(ui: &egui::Ui) -> egui::Vec2 {
    if ui.ctx().egui_wants_keyboard_input() {
        return egui::Vec2::ZERO;
    }
    ui.input(|input| {
        let held = |key| f32::from(u8::from(input.key_down(key)));
        let along = egui::vec2(held(Key::ArrowRight) - held(Key::ArrowLeft), held(Key::ArrowDown) - held(Key::ArrowUp));
        if input.modifiers.command { egui::Vec2::ZERO } else { along.normalized() }
    })
}

/// Movement by which an arrow key tilts the instrument, points/s.
const KEY_TILT_SPEED: f32 = 120.0;

/// Lean of the handle by a movement of one point.
const LEAN_PER_POINT: f32 = 0.004;

/// Movement of the pointer up to which a press of the tilting key holds the handle upright, points.
const STILL_POINTS: f32 = 4.0;

/// State of the tilting key while it is held.
#[derive(Clone, Copy, Default)]
struct Tilting {
    /// Position at which the key was pressed.
    place: egui::Pos2,
    /// Movement of the pointer since then, points.
    moved: f32,
}

/// Tilts the instrument while its key is held; returns the state of the key. Not while somebody types.
fn tilting(ui: &egui::Ui, view: egui::Id, at: Option<egui::Pos2>, commands: &mut Vec<AppCommand>) -> Option<Tilting> {
    let id = view.with("tilting");
    let is_typing = ui.ctx().egui_wants_keyboard_input();
    let (is_down, is_plain, by) =
        ui.input(|input| (input.key_down(Key::A), input.modifiers.is_none(), input.pointer.delta()));
    let begun = ui.data(|data| data.get_temp::<Tilting>(id));
    let is_held = is_down && !is_typing && (begun.is_some() || is_plain);
    let Some(place) = at.filter(|_| is_held) else {
        if begun.is_some_and(|begun| begun.moved < STILL_POINTS) && !is_typing {
            commands.push(AppCommand::Practice(PracticeCommand::HoldUpright));
        }
        end_tilting(ui, view);
        return None;
    };
    let seconds = ui.input(|input| input.unstable_dt.min(FRAME_MAX));
    let by = by + arrows(ui) * KEY_TILT_SPEED * seconds;
    let Tilting { place, moved } = begun.unwrap_or(Tilting { place, moved: 0.0 });
    let now = Tilting { place, moved: moved + by.length() };
    ui.data_mut(|data| data.insert_temp(id, now));
    if by != egui::Vec2::ZERO {
        let (right, near) = (by.x * LEAN_PER_POINT, by.y * LEAN_PER_POINT);
        commands.push(AppCommand::Practice(PracticeCommand::Lean { right, near }));
    }
    Some(now)
}

fn is_tilting(ui: &egui::Ui, view: egui::Id) -> bool {
    ui.data(|data| data.get_temp::<Tilting>(view.with("tilting")).is_some())
}

fn end_tilting(ui: &egui::Ui, view: egui::Id) {
    ui.data_mut(|data| data.remove_temp::<Tilting>(view.with("tilting")));
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

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Modifiers, Pos2, RawInput, Rect, Sense, TouchDeviceId, TouchId, TouchPhase, Vec2};

    /// A view that fills a window, and the commands of each frame.
    #[derive(Default)]
    struct Screen(egui::Context);

    impl Screen {
        /// Shows a frame in which these events come in; returns the share of the strength with which the hand presses, and
        /// the place at which it points.
        fn frame(&self, events: Vec<Event>) -> (f32, Option<[f32; 2]>) {
            self.frame_at(None, events)
        }

        /// The same at a time, s.
        fn frame_at(&self, time: Option<f64>, events: Vec<Event>) -> (f32, Option<[f32; 2]>) {
            let commands = self.commands(time, events);
            let (mut pressure, mut is_pressed) = (1.0, false);
            for command in &commands {
                match command {
                    AppCommand::Practice(PracticeCommand::SetPressure(share)) => pressure = *share,
                    AppCommand::Practice(PracticeCommand::SetDeviceButton { is_down, .. }) => is_pressed = *is_down,
                    _ => {}
                }
            }
            (if is_pressed { pressure } else { 0.0 }, pointed(&commands))
        }

        /// Shows a frame in which these events come in; returns its commands.
        fn commands(&self, time: Option<f64>, events: Vec<Event>) -> Vec<AppCommand> {
            let mut commands = Vec::new();
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 600.0)));
            let input = RawInput { screen_rect, time, events, ..RawInput::default() };
            let mut output = self.0.run_ui(input, |ui| {
                let view = ui.interact(ui.max_rect(), ui.scope_id().with("view"), Sense::click_and_drag());
                commands.clear();
                collect_commands(ui, &view, true, &mut commands);
            });
            output.textures_delta.clear();
            commands
        }
    }

    /// The place at which the hand points by these commands.
    fn pointed(commands: &[AppCommand]) -> Option<[f32; 2]> {
        let place = |command: &AppCommand| match command {
            AppCommand::Practice(PracticeCommand::PointAt(place)) => Some(place.map(|place| place.share)),
            _ => None,
        };
        commands.iter().rev().find_map(place).flatten()
    }

    /// Events of a touch as winit's egui integration sends them: the first touch moves the pointer, too.
    fn touch(id: u64, phase: TouchPhase, pos: Pos2, force: Option<f32>) -> Vec<Event> {
        let touch = Event::Touch { device_id: TouchDeviceId(1), id: TouchId(id), phase, pos, force };
        let button =
            |pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE };
        let pointer = match (id, phase) {
            (0, TouchPhase::Start) => vec![Event::PointerMoved(pos), button(true)],
            (0, TouchPhase::Move) => vec![Event::PointerMoved(pos)],
            (0, TouchPhase::End | TouchPhase::Cancel) => vec![button(false), Event::PointerGone],
            _ => Vec::new(),
        };
        [vec![touch], pointer].concat()
    }

    #[test]
    fn one_finger_points_and_a_second_one_presses() {
        let screen = Screen::default();
        screen.frame(Vec::new());
        let (first, second) = (Pos2::new(400.0, 300.0), Pos2::new(200.0, 150.0));
        assert_eq!(screen.frame(touch(0, TouchPhase::Start, first, None)), (0.0, Some([0.5, 0.5])));
        assert_eq!(screen.frame(touch(1, TouchPhase::Start, second, None)), (1.0, Some([0.5, 0.5])));
        let moved = touch(0, TouchPhase::Move, Pos2::new(200.0, 300.0), None);
        assert_eq!(screen.frame(moved), (1.0, Some([0.25, 0.5])), "the first finger points while the second presses");
        assert_eq!(screen.frame(touch(1, TouchPhase::End, second, None)).0, 0.0);
        assert_eq!(screen.frame(touch(0, TouchPhase::End, first, None)), (0.0, None), "a lifted hand is put down");
    }

    #[test]
    fn a_pen_presses_as_hard_as_it_is_pressed() {
        let screen = Screen::default();
        screen.frame(Vec::new());
        let at = Pos2::new(400.0, 300.0);
        assert_eq!(screen.frame(touch(0, TouchPhase::Start, at, Some(0.02))).0, 0.0, "it rests on the screen");
        assert_eq!(screen.frame(touch(0, TouchPhase::Move, at, Some(0.4))).0, 0.4);
        assert_eq!(screen.frame(touch(0, TouchPhase::Move, at, Some(1.0))).0, 1.0);
        assert_eq!(screen.frame(touch(0, TouchPhase::End, at, Some(0.0))).0, 0.0);
    }

    #[test]
    fn a_long_press_at_one_place_stays_a_press() {
        let screen = Screen::default();
        screen.frame_at(Some(0.0), Vec::new());
        let (first, second) = (Pos2::new(400.0, 300.0), Pos2::new(200.0, 150.0));
        screen.frame_at(Some(0.1), touch(0, TouchPhase::Start, first, None));
        for tenth in 2..30 {
            assert_eq!(screen.frame_at(Some(0.1 * f64::from(tenth)), Vec::new()), (0.0, Some([0.5, 0.5])));
        }
        assert_eq!(screen.frame_at(Some(3.0), touch(1, TouchPhase::Start, second, None)), (1.0, Some([0.5, 0.5])));
        for tenth in 31..60 {
            assert_eq!(screen.frame_at(Some(0.1 * f64::from(tenth)), Vec::new()).0, 1.0);
        }
        assert_eq!(screen.frame_at(Some(6.0), touch(1, TouchPhase::End, second, None)).0, 0.0);
    }

    #[test]
    fn the_pointer_tilts_while_its_key_is_held_and_the_hand_stays() {
        let screen = Screen::default();
        screen.frame(Vec::new());
        let key = |pressed| Event::Key {
            key: Key::A,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let at = |x: f32, y: f32| Event::PointerMoved(Pos2::new(x, y));
        let tilts = |commands: &[AppCommand]| {
            let tilt = |command: &AppCommand| match command {
                AppCommand::Practice(PracticeCommand::Lean { right, near }) => Some([*right, *near]),
                AppCommand::Practice(PracticeCommand::HoldUpright) => Some([0.0; 2]),
                _ => None,
            };
            commands.iter().filter_map(tilt).collect::<Vec<_>>()
        };
        screen.frame(vec![at(400.0, 300.0)]);
        assert_eq!(tilts(&screen.commands(None, vec![key(true)])), Vec::<[f32; 2]>::new());
        let commands = screen.commands(None, vec![at(450.0, 275.0)]);
        assert_eq!(tilts(&commands), [[50.0 * LEAN_PER_POINT, -25.0 * LEAN_PER_POINT]]);
        assert_eq!(pointed(&commands), Some([0.5, 0.5]), "the hand moves while it is tilted");
        let commands = screen.commands(None, vec![key(false)]);
        assert_eq!((tilts(&commands), pointed(&commands)), (vec![], Some([0.5625, 275.0 / 600.0])));
        // The key alone.
        screen.commands(None, vec![key(true)]);
        assert_eq!(tilts(&screen.commands(None, vec![key(false)])), [[0.0; 2]]);
    }

    #[test]
    fn the_arrow_keys_move_the_hand_and_the_space_bar_presses() {
        let screen = Screen::default();
        let key = |key, pressed| {
            vec![Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }]
        };
        let mut time = 0.0;
        let mut frame = |events| {
            time += 0.05;
            screen.frame_at(Some(time), events)
        };
        frame(Vec::new());
        assert_eq!(frame(Vec::new()), (0.0, None), "nobody has pointed yet");
        assert_eq!(frame(key(Key::Space, true)), (1.0, Some([0.5; 2])), "the middle of the view");
        assert_eq!(frame(key(Key::Space, false)), (0.0, Some([0.5; 2])));
        let (_, Some([near, y])) = frame(key(Key::ArrowRight, true)) else { panic!("the hand does not point") };
        for _ in 0..20 {
            frame(Vec::new());
        }
        let (_, Some([far, _])) = frame(Vec::new()) else { panic!("the hand does not point") };
        assert!(
            y == 0.5 && near > 0.5 && near < 0.505 && far > near + 0.08,
            "{near} {far}: slowly at first, then faster"
        );
        frame(key(Key::ArrowRight, false));
        let (pressure, Some([stays, _])) = frame(key(Key::Space, true)) else { panic!("the hand does not point") };
        assert!(pressure == 1.0 && (stays - far).abs() < 0.02, "{stays}");
        // The pointer takes over.
        assert_eq!(frame(vec![Event::PointerMoved(Pos2::new(200.0, 150.0))]), (1.0, Some([0.25; 2])));
    }

    #[test]
    fn a_mouse_presses_with_its_full_strength() {
        let screen = Screen::default();
        screen.frame(Vec::new());
        let pos = Pos2::new(400.0, 300.0);
        let button =
            Event::PointerButton { pos, button: PointerButton::Primary, pressed: true, modifiers: Modifiers::NONE };
        assert_eq!(screen.frame(vec![Event::PointerMoved(pos)]), (0.0, Some([0.5, 0.5])));
        assert_eq!(screen.frame(vec![button]).0, 1.0);
    }
}
