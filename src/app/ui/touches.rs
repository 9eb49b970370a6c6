//! Pens and fingers on the view: how hard they press.

use eframe::egui::{Event, TouchId, TouchPhase};

/// Pressure of a pen below which it only points, as a share of its full pressure.
const LEAST_PRESSURE: f32 = 0.05;

/// Pens and fingers that touch the screen, in the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Touches(Vec<(TouchId, Option<f32>)>);

/// Share of the strength with which a pen presses that is pressed this hard, 0 to 1.
pub fn pen_pressure(pressure: f32) -> f32 {
    if pressure >= LEAST_PRESSURE { pressure.min(1.0) } else { 0.0 }
}

impl Touches {
    /// Takes over the events of a frame.
    pub fn update(&mut self, events: &[Event]) {
        for event in events {
            let Event::Touch { id, phase, force, .. } = event else { continue };
            match (phase, self.0.iter_mut().find(|(known, _)| known == id)) {
                (TouchPhase::End | TouchPhase::Cancel, _) => self.0.retain(|(known, _)| known != id),
                (TouchPhase::Start | TouchPhase::Move, Some((_, pressure))) => *pressure = *force,
                (TouchPhase::Start | TouchPhase::Move, None) => self.0.push((*id, *force)),
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
        let pens = self.0.iter().filter_map(|(_, pressure)| *pressure);
        let fingers = self.0.iter().filter(|(_, pressure)| pressure.is_none()).count();
        match pens.reduce(f32::max) {
            // The palm beside a pen is no finger.
            Some(pressure) => Some(pen_pressure(pressure)),
            None if fingers == 0 => None,
            None => Some(if fingers > 1 { 1.0 } else { 0.0 }),
        }
    }
}
