//! A hand holding a stylus: mass, grip and encoder steps, so that scripted sessions and tests meet the same physics as
//! people do.

use super::{Output, Reading};
use crate::frame::Vec3;
use crate::tick::TICK_S;

/// What the hand and the device's moving part are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandModel {
    /// kg
    pub mass: f32,
    /// Spring between where the person wants the tip and where it is, N/mm. A relaxed pen grip is 0.2–0.5.
    pub grip_stiffness: f32,
    /// N·s/mm
    pub grip_damping: f32,
    /// Encoder step, mm; 0 for an ideal device.
    pub encoder_step: f32,
}

impl HandModel {
    /// A pen grip on a device of an apparent mass: about critically damped, as grips are.
    pub fn holding(apparent_mass: f32, encoder_step: f32) -> HandModel {
        HandModel { mass: apparent_mass + 0.05, grip_stiffness: 0.6, grip_damping: 0.008, encoder_step }
    }
}

/// A hand that wants to be at `goal` and feels the device's force one tick late.
#[derive(Clone, Debug)]
pub struct Hand {
    model: HandModel,
    /// Where the person wants the tip, world space, mm.
    pub goal: Vec3,
    position: Vec3,
    velocity: Vec3,
    /// Told last tick, felt in this one: a device renders what it was told before.
    pending: Vec3,
}

/// Integration steps per tick: explicit integration of the grip is stable from 2 on.
const SUBSTEPS: u32 = 8;

impl Hand {
    pub fn resting_at(model: HandModel, position: Vec3) -> Hand {
        Hand { model, goal: position, position, velocity: Vec3::ZERO, pending: Vec3::ZERO }
    }

    /// True position, finer than the encoder shows.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// mm/s
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }

    /// Takes another grip, from where the hand is.
    pub fn set_model(&mut self, model: HandModel) {
        self.model = model;
    }

    /// Throws the hand at a speed: for tests of impact.
    pub fn set_velocity(&mut self, velocity: Vec3) {
        self.velocity = velocity;
    }

    /// Moves for one tick under the force told in the previous tick; takes the new force for the next.
    pub fn turn(&mut self, output: &Output) -> Reading {
        let felt = std::mem::replace(&mut self.pending, output.force);
        let HandModel { mass, grip_stiffness, grip_damping, encoder_step } = self.model;
        let dt = TICK_S as f32 / SUBSTEPS as f32;
        for _ in 0..SUBSTEPS {
            let grip = (self.goal - self.position) * grip_stiffness - self.velocity * grip_damping;
            // N / kg is m/s²; the program counts in mm.
            self.velocity += (grip + felt) * (1000.0 * dt / mass);
            self.position += self.velocity * dt;
        }
        let shown = match encoder_step > 0.0 {
            true => (self.position / encoder_step).round() * encoder_step,
            false => self.position,
        };
        Reading::at(shown)
    }
}
