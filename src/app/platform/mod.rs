//! Surroundings of the window: settings that are kept, the user's language, the log of its state.
//!
//! One file for a computer and one for a page in a browser, with the same functions.

mod console;
#[cfg(not(target_family = "wasm"))]
mod native;
#[cfg(target_family = "wasm")]
mod web;

pub use console::close_own_console;
#[cfg(not(target_family = "wasm"))]
pub use native::*;
#[cfg(target_family = "wasm")]
pub use web::*;

/// Frames that a page, which has no threads, draws before a long step, so that the screen says what is being done.
pub const FRAMES_BEFORE_LONG_STEP: u32 = 2;

/// A pen as the platform reports it beside the window system's own events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Share of its full pressure, 0 to 1, while it touches the screen.
    pub pressure: Option<f32>,
    /// Tilt to the right and toward the user, from the perpendicular to the screen, degrees; `None` for a pen that does not
    /// know it.
    pub tilt: Option<[f32; 2]>,
}

impl Pen {
    /// Direction from the tip to the other end as one sees the screen: components to the right and up of a unit vector, whose
    /// third component is toward the eye.
    pub fn direction(self) -> Option<[f32; 2]> {
        let [right, near] = self.tilt?.map(|degrees| degrees.to_radians().tan());
        let length = (1.0 + right * right + near * near).sqrt();
        length.is_finite().then(|| [right / length, -near / length])
    }
}

/// State of a gamepad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GamepadState {
    /// Position of the left and the right stick: right and down, −1 to 1.
    pub sticks: [[f32; 2]; 2],
    /// Pull of the left and the right trigger, 0 to 1.
    pub triggers: [f32; 2],
    /// Bit mask of the pressed buttons, by their standard numbers.
    pub buttons: u32,
}

/// The browser's answer to the question for a device: the name of the one that the user allowed, if any, or why it cannot ask.
pub type DeviceAnswer = Result<Option<String>, String>;

/// Writer of a line of the state log.
pub type LogSink = Box<dyn FnMut(&str)>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pens_tilt_is_the_direction_of_its_other_end() {
        let direction = |tilt| Pen { pressure: None, tilt: Some(tilt) }.direction();
        assert_eq!(direction([0.0, 0.0]), Some([0.0, 0.0]));
        let [right, up] = direction([45.0, 0.0]).unwrap();
        assert!((right - 0.5f32.sqrt()).abs() < 1e-6 && up == 0.0);
        let [right, up] = direction([0.0, 60.0]).unwrap();
        assert!(
            right == 0.0 && (up + 0.75f32.sqrt()).abs() < 1e-6,
            "a pen that lies toward the user points down the screen"
        );
    }
}
