//! Force and speed in contact, as the measures and the limits have them.

use typodont_core::frame::{Pose, Vec3};
use typodont_core::sim::Step;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::Label;

/// Number of ticks over which speed and path are measured: over a single tick of 1 ms, a coarse encoder alone reads as
/// 55 mm/s.
pub const SPAN: u64 = 20;

/// Follows the tip, tick by tick.
#[derive(Clone, Debug)]
pub struct ContactMotion {
    tooth_from_world: Pose,
    /// Position of the tip at the end of the last span, tooth space, mm.
    last_place: Option<Vec3>,
    /// The last contact of the running span.
    last_contact: Option<TissueContact>,
}

/// Touched tissue and force, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TissueContact {
    pub tissue: Label,
    pub force: f32,
}

/// One tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTick {
    /// Position of the tip, tooth space, mm.
    pub place: Vec3,
    /// Force on the hand without guidance, with or without contact, N, world space.
    pub pressed: Vec3,
    pub contact: Option<TissueContact>,
    /// The span that this tick ends, if it ends one.
    pub span: Option<SpanMotion>,
}

/// Motion of the tip over [`SPAN`] ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpanMotion {
    /// Distance from the position at the end of the span before, mm.
    pub length: f64,
    /// Mean speed, mm/s.
    pub speed: f64,
    /// The last contact of the span; `None` if there was none or the span before is unknown.
    pub contact: Option<TissueContact>,
}

impl ContactMotion {
    pub fn new(world_from_tooth: Pose) -> ContactMotion {
        ContactMotion { tooth_from_world: world_from_tooth.inverse(), last_place: None, last_contact: None }
    }

    pub fn observe(&mut self, tick: Tick, step: &Step) -> ContactTick {
        let place = self.tooth_from_world * step.tip;
        if step.is_hand_free {
            // Where the tip goes meanwhile is not the trainee's way.
            (self.last_place, self.last_contact) = (None, None);
        }
        // Forces of guidance by the exercise or an instructor are not forces of the trainee.
        let led = step.guidance + step.coupling_force;
        let pressed = if led == Vec3::ZERO { step.force } else { step.force - led };
        let contact = step.touch.map(|touch| TissueContact { tissue: touch.label, force: pressed.length() });
        self.last_contact = contact.or(self.last_contact);
        let span = tick.0.is_multiple_of(SPAN).then(|| self.end_span(place));
        ContactTick { place, pressed, contact, span }
    }

    fn end_span(&mut self, place: Vec3) -> SpanMotion {
        let length = self.last_place.map_or(0.0, |last| f64::from(place.distance(last)));
        let contact = self.last_contact.take().filter(|_| self.last_place.is_some());
        self.last_place = Some(place);
        SpanMotion { length, speed: length / (SPAN as f64 * TICK_S), contact }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_of_a_tip_that_the_view_moves_is_not_the_trainees() {
        // Aim: a choice of a view costs no path. Method: 100 ticks at rest, 300 in which the placement of the hand moves
        // the tip by 60 mm, 100 at rest; then 10 mm by hand.
        let mut motion = ContactMotion::new(Pose::IDENTITY);
        let mut way = 0.0;
        for n in 0..600u64 {
            let (moved, is_hand_free) = match n {
                100..400 => ((n - 100) as f32 * 0.2, true),
                500.. => (60.0 + (n - 500) as f32 * 0.1, false),
                _ => (if n < 100 { 0.0 } else { 60.0 }, false),
            };
            let step = Step { is_hand_free, ..Step::released(Tick(n), &Pose::at(Vec3::X * moved), 0) };
            way += motion.observe(Tick(n), &step).span.map_or(0.0, |span| span.length);
        }
        assert!((way - 8.0).abs() < 1e-4, "{way} mm up to the last end of a span");
    }
}
