//! A servo that runs several ticks at once: for a device whose force nobody feels, and in a browser's page.
//!
//! Takes the servo's state. Runs the ticks that have become due since the last call, all with the same clock time: on a
//! thread that sleeps a few milliseconds between two calls, or, in a browser's page, which has no threads, when its owner
//! asks. Never runs more ticks at once than a limit: a page that was hidden, or a thread that was held up, goes on where it
//! stopped, and the ticks in between are counted as missed.

use super::ServoEvent;
use super::tick_timer::TickTimer;
use super::{RELEASE_AFTER, ServoExit, ServoLoop};
use crate::realtime::Priority;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use typodont_core::device::{Device, DeviceError, Pacing, Wrench};
use web_time::Duration;

/// Ticks that a page makes up for in one call. A frame of a slow computer takes a tenth of a second; whoever waits longer has
/// lost sight of the instrument.
const PAGE_LIMIT: u32 = 100;

/// Ticks that a page makes up for in one call with a device whose force is felt: the hand has moved on meanwhile.
const FELT_LIMIT: u32 = 10;

/// Ticks that the thread makes up for in one call: a frame of a display and some of the next.
const THREAD_LIMIT: u32 = 25;

/// Sleep of the thread between two calls: no longer than a frame of a display at 240 Hz, with a quarter of the wake-ups of
/// a servo that runs every tick by itself.
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
        while !self.has_ended() {
            thread::sleep(BATCH_INTERVAL);
            if should_stop.load(Ordering::Acquire) {
                break;
            }
            self.run_due(THREAD_LIMIT);
        }
        self.stop()
    }

    /// Runs the ticks of a page that have become due.
    pub fn advance(&mut self) {
        if !self.has_ended() {
            self.run_due(if self.servo.device.renders_force() { FELT_LIMIT } else { PAGE_LIMIT });
        }
    }

    fn run_due(&mut self, limit: u32) {
        let (count, mut late) = self.timer.ticks_due(limit, &mut self.servo.sink.timing);
        for _ in 0..count {
            // A hand that feels no force moves with the ticks, so that a late one need not release it.
            let late = if self.servo.device.renders_force() { std::mem::take(&mut late) } else { Duration::ZERO };
            let output = if late > RELEASE_AFTER { Wrench::ZERO } else { self.servo.output };
            let exchanged = self.servo.device.exchange(&output);
            if let Err(gone) = self.servo.process(exchanged, late) {
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
