//! Model of a hand that holds a stylus: mass, grip and encoder steps, so that scripted sessions and tests meet the
//! same physics as people do.

use crate::device::{Reading, Wrench};
use crate::frame::Vec3;
use crate::tick::TICK_S;

/// Parameters of the hand and of the moving part of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandModel {
    /// Moving mass, kg.
    pub mass: f32,
    /// Stiffness of the spring between the intended and the actual tip position, N/mm. A relaxed pen grip has
    /// 0.2–0.5.
    pub grip_stiffness: f32,
    /// Damping of the grip, N·s/mm.
    pub grip_damping: f32,
    /// Encoder step, mm; 0 for an ideal device.
    pub encoder_step: f32,
}

impl HandModel {
    /// Pen grip on a device with the given apparent mass (kg) and encoder step (mm). The damping is about critical,
    /// as that of human grips.
    pub fn holding(apparent_mass: f32, encoder_step: f32) -> HandModel {
        HandModel { mass: apparent_mass + 0.05, grip_stiffness: 0.6, grip_damping: 0.008, encoder_step }
    }
}

/// Hand that is drawn to `goal` and feels the force of the device one tick late.
#[derive(Clone, Debug)]
pub struct SimulatedHand {
    model: HandModel,
    /// Intended tip position, world space, mm.
    pub goal: Vec3,
    position: Vec3,
    velocity: Vec3,
    /// Force sent in the previous tick and felt in this one, N: a device renders it one cycle late.
    pending_force: Vec3,
}

/// Integration steps per tick. Explicit integration of the grip is stable from 2 on.
const SUBSTEPS: u32 = 8;

impl SimulatedHand {
    pub fn resting_at(model: HandModel, position: Vec3) -> SimulatedHand {
        SimulatedHand { model, goal: position, position, velocity: Vec3::ZERO, pending_force: Vec3::ZERO }
    }

    /// True position, world space, mm; not rounded to encoder steps.
    pub fn position(&self) -> Vec3 {
        self.position
    }

    /// Velocity, world space, mm/s.
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }

    pub fn model(&self) -> &HandModel {
        &self.model
    }

    /// Replaces the grip; the hand stays at its position.
    pub fn set_model(&mut self, model: HandModel) {
        self.model = model;
    }

    /// Sets the velocity, mm/s, for tests of impact.
    pub fn set_velocity(&mut self, velocity: Vec3) {
        self.velocity = velocity;
    }

    /// Moves the hand by one tick under the force of the previous tick; stores the new force for the next tick.
    pub fn step(&mut self, output: &Wrench) -> Reading {
        let felt = std::mem::replace(&mut self.pending_force, output.force);
        let HandModel { mass, grip_stiffness, grip_damping, encoder_step } = self.model;
        let dt = TICK_S as f32 / SUBSTEPS as f32;
        for _ in 0..SUBSTEPS {
            let grip = (self.goal - self.position) * grip_stiffness - self.velocity * grip_damping;
            // N / kg is m/s², but positions are in mm.
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
