//! A gamepad as a pointer with some keys.
//!
//! Takes the state of a gamepad in each frame. Gives the events that a mouse, a pen and a keyboard would have caused, so that
//! every screen can be used with it but for typing, and movements of the camera: the left stick moves the pointer, the right trigger presses as
//! hard as it is pulled, and the right stick rotates the view. Buttons are those of the W3C's standard gamepad.

use crate::command::CameraCommand;
use crate::platform::GamepadState;
use eframe::egui::{
    Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, Rect, TouchDeviceId, TouchId,
    TouchPhase, Vec2, vec2,
};

/// The pointer that a gamepad moves.
#[derive(Clone, Debug, Default)]
pub struct GamepadPointer {
    position: Option<Pos2>,
    before: GamepadState,
}

/// Deflection up to which a stick counts as at rest.
const REST: f32 = 0.15;

/// Speed of the pointer at full deflection, points/s; at half of it, a quarter.
const POINTER_SPEED: f32 = 600.0;

/// Speed of the camera at full deflection, rad/s.
const CAMERA_SPEED: f32 = 2.0;

/// Pull of a trigger from which it counts as pressed.
const PULLED: f32 = 0.05;

/// Longest time that a frame counts for, s: after a longer one the pointer would jump.
const FRAME_MAX: f32 = 0.1;

/// Standard number of the button that presses with the full strength, like a mouse's left one.
const PRESS_BUTTON: u32 = 0;

/// Standard numbers of the buttons that stand for keys.
const KEY_BUTTONS: [(u32, Key); 10] = [
    (1, Key::Escape),
    (2, Key::O),
    (3, Key::T),
    (9, Key::Enter),
    (10, Key::Minus),
    (11, Key::Plus),
    (12, Key::ArrowUp),
    (13, Key::ArrowDown),
    (14, Key::ArrowLeft),
    (15, Key::ArrowRight),
];

/// Standard numbers of the buttons that stand for a step of the wheel, and its direction.
const WHEEL_BUTTONS: [(u32, f32); 2] = [(4, -1.0), (5, 1.0)];

/// Identifies the trigger among touches: no screen has this number.
pub const TRIGGER: TouchDeviceId = TouchDeviceId(u64::MAX);

fn is_pressed(pad: &GamepadState, button: u32) -> bool {
    pad.buttons & (1 << button) != 0
}

/// Deflection of a stick beyond its rest; squared, so that small ones are fine.
fn deflection([x, y]: [f32; 2]) -> Vec2 {
    let raw = vec2(x, y);
    let beyond = ((raw.length() - REST) / (1.0 - REST)).clamp(0.0, 1.0);
    raw.normalized() * beyond * beyond
}

impl GamepadPointer {
    /// True if nothing is pressed or deflected.
    pub fn is_at_rest(&self) -> bool {
        self.before == GamepadState::default()
    }

    /// Events of a frame that took `seconds`, and movements of the camera. `pointer`: position of the pointer as it is.
    pub fn update(
        &mut self,
        pad: GamepadState,
        pointer: Option<Pos2>,
        screen: Rect,
        seconds: f32,
    ) -> (Vec<Event>, Option<CameraCommand>) {
        let seconds = seconds.clamp(0.0, FRAME_MAX);
        let before = std::mem::replace(&mut self.before, pad);
        let mut events = Vec::new();
        let start = pointer.or(self.position).unwrap_or(screen.center());
        let pos = screen.clamp(start + deflection(pad.sticks[0]) * POINTER_SPEED * seconds);
        self.position = Some(pos);
        if pos != start {
            events.push(Event::PointerMoved(pos));
        }
        let [was_pulled, is_pulled] = [before, pad].map(|state| state.triggers[1] > PULLED);
        let phase = match (was_pulled, is_pulled) {
            (false, true) => Some(TouchPhase::Start),
            (true, true) => Some(TouchPhase::Move),
            (true, false) => Some(TouchPhase::End),
            (false, false) => None,
        };
        if let Some(phase) = phase {
            let force = Some(pad.triggers[1]);
            events.push(Event::Touch { device_id: TRIGGER, id: TouchId(0), phase, pos, force });
        }
        let [was_down, is_down] =
            [(before, was_pulled), (pad, is_pulled)].map(|(state, pulled)| pulled || is_pressed(&state, PRESS_BUTTON));
        if was_down != is_down {
            let modifiers = Modifiers::NONE;
            events.push(Event::PointerButton { pos, button: PointerButton::Primary, pressed: is_down, modifiers });
        }
        let keys = KEY_BUTTONS.map(|(button, key)| (key, is_pressed(&before, button), is_pressed(&pad, button)));
        let tilting = (Key::A, before.triggers[0] > PULLED, pad.triggers[0] > PULLED);
        for (key, _, is) in keys.into_iter().chain([tilting]).filter(|(_, was, is)| was != is) {
            let modifiers = Modifiers::NONE;
            events.push(Event::Key { key, physical_key: None, pressed: is, repeat: false, modifiers });
        }
        for (_, steps) in WHEEL_BUTTONS.into_iter().filter(|(b, _)| is_pressed(&pad, *b) && !is_pressed(&before, *b)) {
            let (unit, delta, modifiers) = (MouseWheelUnit::Line, vec2(0.0, steps), Modifiers::NONE);
            let (phase, source) = (TouchPhase::Move, MouseWheelSource::Unknown);
            events.push(Event::MouseWheel { unit, delta, phase, modifiers, source });
        }
        let turn = deflection(pad.sticks[1]) * CAMERA_SPEED * seconds;
        let camera = (turn != Vec2::ZERO).then_some(CameraCommand::Orbit { right: turn.x, up: -turn.y });
        (events, camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCREEN: Rect = Rect::from_min_max(Pos2::ZERO, Pos2::new(800.0, 600.0));

    fn frame(pointer: &mut GamepadPointer, pad: GamepadState) -> Vec<Event> {
        pointer.update(pad, pointer.position, SCREEN, 0.02).0
    }

    #[test]
    fn a_stick_moves_the_pointer_and_stays_on_the_screen() {
        let mut pointer = GamepadPointer::default();
        let moved = |sticks| GamepadState { sticks, ..GamepadState::default() };
        assert_eq!(frame(&mut pointer, moved([[0.1, 0.1], [0.0, 0.0]])), [], "a stick at rest drifts");
        let Some(Event::PointerMoved(half)) = frame(&mut pointer, moved([[0.575, 0.0], [0.0, 0.0]])).pop() else {
            panic!("the pointer does not move")
        };
        assert!((half.x - 403.0).abs() < 0.01 && half.y == 300.0, "a quarter of 600 points/s for 0.02 s: {half}");
        for _ in 0..100 {
            frame(&mut pointer, moved([[1.0, 0.0], [0.0, 0.0]]));
        }
        assert_eq!(pointer.position, Some(Pos2::new(800.0, 300.0)));
        let (_, camera) = pointer.update(moved([[0.0, 0.0], [1.0, 0.0]]), None, SCREEN, 0.02);
        assert!(matches!(camera, Some(CameraCommand::Orbit { right, up: 0.0 } ) if (right - 0.04).abs() < 1e-6));
    }

    #[test]
    fn the_trigger_presses_as_hard_as_it_is_pulled() {
        let mut pointer = GamepadPointer::default();
        let pulled = |pull| GamepadState { triggers: [0.0, pull], ..GamepadState::default() };
        let force = |events: &[Event]| {
            events.iter().find_map(|event| {
                if let Event::Touch { force, phase, .. } = event { Some((*phase, *force)) } else { None }
            })
        };
        let button = |events: &[Event]| {
            events
                .iter()
                .find_map(|event| if let Event::PointerButton { pressed, .. } = event { Some(*pressed) } else { None })
        };
        let events = frame(&mut pointer, pulled(0.4));
        assert_eq!((force(&events), button(&events)), (Some((TouchPhase::Start, Some(0.4))), Some(true)));
        let events = frame(&mut pointer, pulled(0.9));
        assert_eq!((force(&events), button(&events)), (Some((TouchPhase::Move, Some(0.9))), None));
        let events = frame(&mut pointer, pulled(0.0));
        assert_eq!((force(&events), button(&events)), (Some((TouchPhase::End, Some(0.0))), Some(false)));
    }

    #[test]
    fn each_press_of_a_button_is_one_key() {
        let mut pointer = GamepadPointer::default();
        let held = |button: u32| GamepadState { buttons: 1 << button, ..GamepadState::default() };
        let keys = |events: Vec<Event>| -> Vec<(Key, bool)> {
            let key = |event| if let Event::Key { key, pressed, .. } = event { Some((key, pressed)) } else { None };
            events.into_iter().filter_map(key).collect()
        };
        assert_eq!(keys(frame(&mut pointer, held(1))), [(Key::Escape, true)]);
        assert_eq!(keys(frame(&mut pointer, held(1))), []);
        assert_eq!(keys(frame(&mut pointer, GamepadState::default())), [(Key::Escape, false)]);
        let wheel = frame(&mut pointer, held(5));
        assert!(matches!(wheel[..], [Event::MouseWheel { delta, .. }] if delta.y == 1.0), "{wheel:?}");
    }
}
