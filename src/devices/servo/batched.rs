//! A servo that runs several ticks at once, for a device whose force nobody feels.
//!
//! Takes the servo's state. Runs the ticks that have become due since the last call, all with the same clock time: on a
//! thread that sleeps a few milliseconds between two calls, or, in a browser's page, which has no threads, when its owner
//! asks. Never runs more than [`CATCH_UP_TICKS`] at once: a page that was hidden, or a computer that slept, goes on where
//! it stopped, and the ticks in between are counted as missed.

use super::ServoEvent;
use super::tick_timer::TickTimer;
use super::{ServoExit, ServoLoop};
use crate::realtime::Priority;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use typodont_core::device::{Device, DeviceError, Pacing};
use web_time::Duration;

/// Ticks that are made up for in one call. A frame of a slow computer takes a tenth of a second; whoever waits longer has
/// lost sight of the instrument.
const CATCH_UP_TICKS: u32 = 100;

/// Sleep of the thread between two calls: less than the time between two frames of a display, and a quarter of the wake-ups
/// of a servo that runs every tick by itself.
const BATCH_INTERVAL: Duration = Duration::from_millis(4);

/// Returns true if ticks of this device may run several at once: nobody feels its force, and it does not set the pace.
pub(super) fn may_batch(device: &dyn Device) -> bool {
    !device.renders_force() && device.pacing() == Pacing::Host
}

pub(super) struct BatchedServo {
    servo: ServoLoop,
    timer: TickTimer,
    priority: Priority,
    /// Error with which the device ended, if it did.
    device_error: Option<DeviceError>,
}

impl BatchedServo {
    pub fn new(mut servo: ServoLoop, priority: Priority) -> BatchedServo {
        servo.sink.send(ServoEvent::Started(priority));
        let timer = TickTimer::new(&*servo.device, priority);
        BatchedServo { servo, timer, priority, device_error: None }
    }

    /// Runs the servo on this thread until it is stopped or its device fails.
    pub fn run(mut self, should_stop: &AtomicBool) -> ServoExit {
        while !should_stop.load(Ordering::Acquire) && !self.has_ended() {
            thread::sleep(BATCH_INTERVAL);
            self.advance();
        }
        self.stop()
    }

    /// Runs the ticks that have become due.
    pub fn advance(&mut self) {
        if self.has_ended() {
            return;
        }
        for _ in 0..self.timer.ticks_due(CATCH_UP_TICKS, &mut self.servo.sink.timing) {
            let exchanged = self.servo.device.exchange(&self.servo.output);
            // The hand is stepped at the same ticks, and feels no force: a late tick need not release it.
            if let Err(gone) = self.servo.process(exchanged, Duration::ZERO) {
                self.device_error = Some(gone);
                return;
            }
        }
    }

    pub fn has_ended(&self) -> bool {
        self.device_error.is_some()
    }

    pub fn stop(self) -> ServoExit {
        self.servo.exit(self.priority, self.device_error)
    }
}
