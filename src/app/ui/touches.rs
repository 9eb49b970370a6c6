//! Pens and fingers on the screen: what they are, and how hard they press.

use crate::gamepad::TRIGGER;
use crate::platform;
use crate::pointer_hand::PointerKind;
use eframe::egui::{self, Event, TouchDeviceId, TouchId, TouchPhase};

/// Pressure of a pen below which it only points, as a share of its full pressure.
const LEAST_PRESSURE: f32 = 0.05;

/// Force that Windows reports for a finger whose force is not measured.
const NOT_MEASURED: f32 = 0.5;

/// Pens and fingers that touch the screen, in the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Touches(Vec<TouchContact>);

/// A pen or a finger that touches the screen.
#[derive(Clone, Debug)]
struct TouchContact {
    device: TouchDeviceId,
    id: TouchId,
    /// Reported force, as a share of the greatest.
    force: Option<f32>,
    /// True if the force is that of a pen or a trigger; in a page, where pens are known by other means, never that of a pen.
    is_measured: bool,
}

/// Share of the strength with which a pen presses that is pressed this hard, 0 to 1.
pub fn pen_pressure(pressure: f32) -> f32 {
    if pressure >= LEAST_PRESSURE { pressure.min(1.0) } else { 0.0 }
}

impl Touches {
    /// Takes over the events of a frame.
    pub fn update(&mut self, events: &[Event]) {
        for event in events {
            let &Event::Touch { device_id, id, phase, force, .. } = event else { continue };
            let is_same = |contact: &TouchContact| contact.device == device_id && contact.id == id;
            if matches!(phase, TouchPhase::End | TouchPhase::Cancel) {
                self.0.retain(|contact| !is_same(contact));
                continue;
            }
            let is_measured = match device_id == TRIGGER {
                true => true,
                // In a page fingers report some force, too.
                false => !platform::IS_PAGE && force.is_some_and(|force| force != NOT_MEASURED),
            };
            match self.0.iter_mut().find(|contact| is_same(contact)) {
                Some(contact) => {
                    contact.is_measured |= is_measured;
                    contact.force = force;
                }
                None => self.0.push(TouchContact { device: device_id, id, force, is_measured }),
            }
        }
    }

    /// Forgets all of them: their ends were not seen.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Share of the strength with which they press, 0 to 1; `None` if nothing touches the screen. A pen presses as hard as
    /// it is pressed; a finger points, and a second finger presses.
    pub fn pressure(&self) -> Option<f32> {
        let pens = self.0.iter().filter(|contact| contact.is_measured).map(|contact| contact.force.unwrap_or(0.0));
        let fingers = self.0.iter().filter(|contact| !contact.is_measured).count();
        match pens.reduce(f32::max) {
            // The palm beside a pen is no finger.
            Some(pressure) => Some(pen_pressure(pressure)),
            None if fingers == 0 => None,
            None => Some(if fingers > 1 { 1.0 } else { 0.0 }),
        }
    }

    /// Kind of the pointer that touches the screen; `None` if nothing does, or only the trigger of a gamepad.
    fn kind(&self) -> Option<PointerKind> {
        let of_screen = || self.0.iter().filter(|contact| contact.device != TRIGGER);
        // The palm beside a pen is no finger.
        let has_pen = of_screen().any(|contact| contact.is_measured);
        of_screen().next().map(|_| if has_pen { PointerKind::Pen } else { PointerKind::Finger })
    }
}

/// The pointer that was used last, anywhere in the window.
#[derive(Debug, Default)]
pub struct PointerInUse {
    touches: Touches,
    kind: PointerKind,
}

impl PointerInUse {
    /// Takes over the events of a frame, and returns the kind of the pointer.
    pub fn update(&mut self, ctx: &egui::Context) -> PointerKind {
        let (events, any_touches, is_moving) =
            ctx.input(|input| (input.events.clone(), input.any_touches(), input.pointer.is_moving()));
        self.touches.update(&events);
        if !any_touches {
            self.touches.clear();
        }
        // The window system moves the pointer with a finger, too, and once more as the finger leaves.
        let has_touch = any_touches || events.iter().any(|event| matches!(event, Event::Touch { .. }));
        let of_mouse = (!has_touch && is_moving).then_some(PointerKind::Mouse);
        let of_pen = platform::pen().map(|_| PointerKind::Pen);
        self.kind = of_pen.or(self.touches.kind()).or(of_mouse).unwrap_or(self.kind);
        self.kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Pos2;

    /// Pressure and kind of the pointer after touches of a device, each with its id, its phase and its force.
    fn touched(
        device: TouchDeviceId,
        touches: &[(u64, TouchPhase, Option<f32>)],
    ) -> (Option<f32>, Option<PointerKind>) {
        let event = |&(id, phase, force): &(u64, TouchPhase, Option<f32>)| Event::Touch {
            device_id: device,
            id: TouchId(id),
            phase,
            pos: Pos2::ZERO,
            force,
        };
        let mut all = Touches::default();
        all.update(&touches.iter().map(event).collect::<Vec<Event>>());
        (all.pressure(), all.kind())
    }

    #[test]
    fn a_pen_presses_as_hard_as_it_is_pressed_and_a_second_finger_presses() {
        use TouchPhase::{End, Move, Start};
        let screen = |touches: &[(u64, TouchPhase, Option<f32>)]| touched(TouchDeviceId(1), touches);
        let (pen, finger) = (Some(PointerKind::Pen), Some(PointerKind::Finger));
        assert_eq!(screen(&[(1, Start, Some(0.3)), (1, Move, Some(1.0))]), (Some(1.0), pen));
        assert_eq!(screen(&[(1, Start, Some(0.3)), (1, Move, None)]), (Some(0.0), pen), "a pen that hardly touches");
        assert_eq!(screen(&[(1, Start, None), (2, Start, Some(0.4))]), (Some(0.4), pen), "a palm and a pen");
        assert_eq!(screen(&[(1, Start, Some(0.5)), (1, Move, Some(0.5))]), (Some(0.0), finger));
        assert_eq!(screen(&[(1, Start, Some(0.5)), (2, Start, Some(0.5))]), (Some(1.0), finger));
        assert_eq!(screen(&[(1, Start, None), (2, Start, None), (2, End, None)]), (Some(0.0), finger));
        assert_eq!(screen(&[(1, Start, None), (1, End, None)]), (None, None));
        assert_eq!(touched(TRIGGER, &[(0, Start, Some(0.5))]), (Some(0.5), None), "a gamepad is no pen");
    }
}
