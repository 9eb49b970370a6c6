//! Pens and fingers on the view: how hard they press.

use crate::gamepad::TRIGGER;
use crate::platform;
use crate::pointer_hand::PointerKind;
use eframe::egui::{Event, TouchDeviceId, TouchId, TouchPhase};

/// Pressure of a pen below which it only points, as a share of its full pressure.
const LEAST_PRESSURE: f32 = 0.05;

/// Forces with which a contact begins whose force is not measured: Windows reports a half then, browsers nothing or all.
const NOT_MEASURED: [f32; 3] = [0.0, 0.5, 1.0];

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
    /// True if the force is that of a pen or a trigger.
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
            match (phase, self.0.iter_mut().find(|contact| is_same(contact))) {
                (TouchPhase::End | TouchPhase::Cancel, _) => self.0.retain(|contact| !is_same(contact)),
                (TouchPhase::Start | TouchPhase::Move, Some(contact)) => {
                    contact.is_measured |= contact.force != force && can_measure(device_id);
                    contact.force = force;
                }
                (TouchPhase::Start | TouchPhase::Move, None) => {
                    let is_told = force.is_some_and(|force| device_id == TRIGGER || !NOT_MEASURED.contains(&force));
                    self.0.push(TouchContact {
                        device: device_id,
                        id,
                        force,
                        is_measured: is_told && can_measure(device_id),
                    });
                }
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
        let pens = self.0.iter().filter(|contact| contact.is_measured).filter_map(|contact| contact.force);
        let fingers = self.0.iter().filter(|contact| !contact.is_measured).count();
        match pens.reduce(f32::max) {
            // The palm beside a pen is no finger.
            Some(pressure) => Some(pen_pressure(pressure)),
            None if fingers == 0 => None,
            None => Some(if fingers > 1 { 1.0 } else { 0.0 }),
        }
    }

    /// Kind of the pointer that touches the screen; `None` if nothing does, or only the trigger of a gamepad.
    pub fn kind(&self) -> Option<PointerKind> {
        let of = |contact: &TouchContact| if contact.is_measured { PointerKind::Pen } else { PointerKind::Finger };
        self.0.iter().find(|contact| contact.device != TRIGGER).map(of)
    }
}

/// True if the force of a device's touches can be a measured one. In a page fingers tell of some force, too; pens are known
/// there by other means.
fn can_measure(device: TouchDeviceId) -> bool {
    device == TRIGGER || !platform::IS_PAGE
}
