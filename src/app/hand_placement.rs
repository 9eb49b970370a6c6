//! Placement of an arm's hand, which follows the view: a movement to the right is one to the right in the picture.
//!
//! Takes the view and the settings. Gives the frame in which the hand is to move, once the view has settled. Never sends
//! it, and never reads a clock.

use crate::settings::Settings;
use typodont_core::frame::Quat;
use typodont_core::sim::HandFrame;
use typodont_render::Orbit;

/// Time without a change of the view after which the hand follows it, s: longer than between two repeats of a held key,
/// because the hand is free while it is placed anew.
const SETTLING_TIME: f64 = 0.2;

/// Time in which a hand arrives in a frame at the latest, s: the force may have to fade out first.
const ARRIVAL_TIME: f64 = 1.0;

/// Returns the frame that fits a view: its right, its up, and out of the picture; or, for a hand that is registered with
/// the picture, the frame in which the tip is where the hand is seen.
pub fn frame_of(orbit: &Orbit, settings: &Settings) -> HandFrame {
    if let Some(registration) = &settings.hand_registration {
        return registration.frame(orbit);
    }
    let orientation = if settings.hand_follows_view { orbit.world_from_view() } else { Quat::IDENTITY };
    HandFrame { orientation, scale: settings.hand_scale, ..HandFrame::DEVICE }
}

/// Frame in which a hand moves, and the one that it is to move in.
#[derive(Clone, Copy, Debug)]
pub struct HandPlacement {
    /// Frame that the lesson was told.
    pub placed: HandFrame,
    wanted: HandFrame,
    /// Time of the last change of the wanted frame, s.
    changed_at: f64,
    /// Time at which the lesson was told, s.
    placed_at: f64,
}

impl Default for HandPlacement {
    fn default() -> HandPlacement {
        HandPlacement { placed: HandFrame::DEVICE, wanted: HandFrame::DEVICE, changed_at: 0.0, placed_at: 0.0 }
    }
}

impl HandPlacement {
    /// Takes over the wanted frame at `now`, s; returns true if the hand is to be placed there. `is_dragging`: a button of
    /// the pointer is down, and the view or a setting may still change.
    pub fn is_due(&mut self, wanted: HandFrame, is_dragging: bool, now: f64) -> bool {
        if is_dragging || wanted != self.wanted {
            (self.wanted, self.changed_at) = (wanted, now);
        }
        self.is_pending() && now - self.changed_at >= SETTLING_TIME
    }

    /// Takes over that the lesson was told of a frame at `now`, s.
    pub fn place(&mut self, frame: HandFrame, now: f64) {
        (self.placed, self.placed_at) = (frame, now);
    }

    /// Takes over at `now`, s, that the lesson stands still, in which no hand arrives.
    pub fn wait(&mut self, now: f64) {
        self.placed_at = now;
    }

    /// True if the hand moves in a frame, and has done so long enough to have arrived.
    pub fn has_arrived(&self, frame: HandFrame, now: f64) -> bool {
        self.placed == frame && now - self.placed_at >= ARRIVAL_TIME
    }

    /// True if the hand does not move in the wanted frame yet.
    pub fn is_pending(&self) -> bool {
        self.wanted != self.placed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Vec3;

    #[test]
    fn right_and_up_of_the_hand_are_those_of_the_picture() {
        // Aim: in any view. Method: the eye's axes; and with the setting off the device's own.
        let (follows, off) = (Settings { hand_scale: 2.0, ..Settings::default() }, Settings::default());
        for (right, up) in [(0.0, 0.0), (1.0, 0.4), (3.0, -9.0), (-2.0, 9.0)] {
            let orbit = Orbit::around(Vec3::ZERO, 9.0).rotated(right, up);
            let (frame, eye) = (frame_of(&orbit, &follows), orbit.viewpoint().eye(1.3));
            assert!((frame.orientation * Vec3::X).distance(eye.right) < 1e-3);
            assert!((frame.orientation * Vec3::Y).distance(eye.up) < 1e-3);
            assert_eq!(frame.scale, 2.0);
            assert_eq!(frame_of(&orbit, &Settings { hand_follows_view: false, ..off.clone() }), HandFrame::DEVICE);
        }
    }

    #[test]
    fn the_hand_follows_once_the_view_has_settled() {
        // Aim: the hand is not free all the while that somebody rotates the view. Method: a key that repeats, then a drag.
        let mut placement = HandPlacement::default();
        let frame =
            |angle: f32| HandFrame { orientation: Quat::from_rotation_y(angle), scale: 1.0, ..HandFrame::DEVICE };
        for repeat in 1..=10u8 {
            assert!(!placement.is_due(frame(0.1 * f32::from(repeat)), false, 0.03 * f64::from(repeat)));
        }
        assert!(!placement.is_due(frame(1.0), false, 0.45) && placement.is_pending());
        assert!(placement.is_due(frame(1.0), false, 0.51));
        placement.place(frame(1.0), 0.51);
        assert!(!placement.is_due(frame(1.0), false, 9.0) && !placement.is_pending());
        assert!(!placement.is_due(frame(2.0), true, 9.1) && !placement.is_due(frame(2.0), true, 9.9));
        assert!(placement.is_due(frame(2.0), false, 10.2), "0.2 s after the button was let go");
    }
}
