//! A servo without a thread, for a page in a browser: its ticks run when its owner asks.
//!
//! Takes the servo's state. Runs the ticks that have become due since the last call, all with the same clock time. Never
//! runs more than [`CATCH_UP_TICKS`] at once: a page that was hidden or suspended goes on where it stopped, and the ticks
//! in between are counted as missed.

use super::ServoEvent;
use super::tick_timer::TickTimer;
use super::{ServoExit, ServoLoop};
use crate::realtime::Priority;
use typodont_core::device::DeviceError;
use web_time::Duration;

/// Ticks that are made up for in one call. A frame of a slow computer takes a tenth of a second; whoever waits longer has
/// lost sight of the instrument.
const CATCH_UP_TICKS: u32 = 100;

pub(super) struct InlineServo {
    servo: ServoLoop,
    timer: TickTimer,
    /// Error with which the device ended, if it did.
    device_error: Option<DeviceError>,
}

impl InlineServo {
    pub fn new(mut servo: ServoLoop) -> InlineServo {
        servo.sink.send(ServoEvent::Started(Priority::Ordinary));
        let timer = TickTimer::new(&*servo.device, Priority::Ordinary);
        InlineServo { servo, timer, device_error: None }
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
        self.servo.exit(Priority::Ordinary, self.device_error)
    }
}
