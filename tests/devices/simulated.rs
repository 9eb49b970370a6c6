//! The plainest fake: a wire that is the hand itself. It shows that the suite, the relay and the servo work, and is what the
//! servo's own tests hold.

use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Wrench};
use typodont_devices::{DeviceReport, Protocol, Relay};

pub struct Simulated {
    hand: SharedHand,
    /// Present fault, as `Misbehaviour as u32 + 1`; 0 for none.
    wrong: Arc<AtomicU32>,
}

impl Simulated {
    pub fn new() -> Simulated {
        Simulated { hand: SharedHand::at_rest(0.03), wrong: Arc::default() }
    }
}

impl Rig for Simulated {
    fn name(&self) -> &'static str {
        "simulated"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let wire = Turning {
            hand: self.hand.clone(),
            wrong: self.wrong.clone(),
            spec: DeviceSpec { max_torque: 100.0, resolution: 0.03, ..DeviceSpec::phantom_omni() },
            due: Instant::now(),
        };
        Ok(Box::new(Relay::start(wire)))
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            force: true,
            torque: true,
            orientation: true,
            buttons: true,
            resolution: 0.03,
            is_rate: false,
            misbehaviours: &[Misbehaviour::Unplug, Misbehaviour::Late, Misbehaviour::WarmMotors],
        }
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        self.wrong.store(how as u32 + 1, Ordering::Release);
    }

    fn recover(&mut self) {
        self.wrong.store(0, Ordering::Release);
    }
}

struct Turning {
    hand: SharedHand,
    wrong: Arc<AtomicU32>,
    spec: DeviceSpec,
    due: Instant,
}

impl Protocol for Turning {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, told: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        std::thread::sleep(self.due.saturating_duration_since(Instant::now()));
        // A report that is late by more than five beats is not made up for.
        self.due = (self.due + Duration::from_millis(1)).max(Instant::now() - Duration::from_millis(5));
        let is = |how: Misbehaviour| self.wrong.load(Ordering::Acquire) == how as u32 + 1;
        let length = told.force.length();
        let force = match length.is_finite() {
            true => told.force.clamp_length_max(self.spec.max_force),
            false => typodont_core::frame::Vec3::ZERO,
        };
        if is(Misbehaviour::Unplug) {
            self.hand.turn(Wrench::ZERO);
            return Err(DeviceError::Lost { why: "the cable was pulled", code: -1 });
        }
        if is(Misbehaviour::WarmMotors) {
            let reading = self.hand.turn(Wrench::ZERO);
            return Ok(Some(DeviceReport {
                reading,
                state: DeviceState::ForceOff { why: "the motors are warm; wait a minute" },
            }));
        }
        let reading = self.hand.turn(Wrench { force, torque: told.torque });
        if is(Misbehaviour::Late) {
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(Some(DeviceReport { reading, state: DeviceState::Ready }))
    }

    fn close(&mut self) {
        self.hand.turn(Wrench::ZERO);
    }
}
