//! The contract of a device's protocol, and the rules for reports that do not come.
//!
//! Takes a [`Protocol`]. Gives the device that speaks it: behind a [`Relay`](crate::Relay) with a thread of its own or, in a
//! browser, where there are no threads, a [`DirectDevice`](crate::DirectDevice). Never reads or writes by itself.

use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, Wrench};
use web_time::{Duration, Instant};

/// Time for which the last report stands in for a missing one: USB and radio links pause for some milliseconds.
const REPORT_LIFE: Duration = Duration::from_millis(20);

/// Time without a report after which a device counts as lost.
pub(crate) const SILENCE_TIMEOUT: Duration = Duration::from_millis(500);

/// Time from opening to the first report that a device may take: controllers boot and services start.
const FIRST_REPORT_TIMEOUT: Duration = Duration::from_secs(5);

/// Protocol of one device.
pub trait Protocol: Send + 'static {
    /// Returns the device's limits.
    fn spec(&self) -> &DeviceSpec;

    /// Returns whether [`Protocol::exchange`] waits for the device's own report rate, or returns at once.
    fn pacing(&self) -> Pacing;

    /// Sends a force to the device and waits for its report. World space, mm, N.
    ///
    /// Returns within about 20 ms even if the device sends nothing; `Ok(None)` means that it sent nothing new.
    ///
    /// # Errors
    ///
    /// Returns an error if the device has failed or was unplugged; [`Protocol::close`] is called then.
    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError>;

    /// Releases the hand and closes the device.
    fn close(&mut self);

    /// Time without a command after which the device releases the hand by itself; `None` if it renders no force. Asked only
    /// in a browser.
    fn release_time(&self) -> Option<Duration> {
        None
    }
}

/// One report of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceReport {
    pub reading: Reading,
    pub state: DeviceState,
}

/// Opens a device for the servo: behind a relay, or directly in a browser.
pub(crate) fn open_device(protocol: impl Protocol) -> Box<dyn Device + Send> {
    #[cfg(not(target_family = "wasm"))]
    let device = crate::Relay::start(protocol);
    #[cfg(target_family = "wasm")]
    let device = crate::DirectDevice::new(protocol);
    Box::new(device)
}

/// The newest report of a device, and the rules for the time after it.
#[derive(Debug)]
pub(crate) struct LastReport {
    reading: Reading,
    /// Time at which it was received; `None` before the first one.
    received: Option<Instant>,
    opened: Instant,
    state: DeviceState,
}

impl LastReport {
    /// State before the first report.
    pub const AWAITED: DeviceState = DeviceState::Homing { what: "waiting for the device's first report" };

    /// Begins to wait for the first report of a device that was opened now.
    pub fn awaited() -> LastReport {
        LastReport { reading: Reading::ABSENT, received: None, opened: Instant::now(), state: LastReport::AWAITED }
    }

    pub fn receive(&mut self, report: DeviceReport) {
        self.reading = report.reading;
        self.received = Some(Instant::now());
        self.state = report.state;
    }

    /// State of the device as of the last call of [`LastReport::reading`].
    pub fn state(&self) -> DeviceState {
        self.state
    }

    /// Returns the reading that counts now.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] after a silence that is too long.
    pub fn reading(&mut self) -> Result<Reading, DeviceError> {
        let silent = self.received.map_or(self.opened.elapsed(), |at| at.elapsed());
        match self.received {
            Some(_) if silent < REPORT_LIFE => Ok(self.reading),
            _ if silent < SILENCE_TIMEOUT => {
                if self.received.is_some() {
                    self.state = DeviceState::ForceOff { why: "the device does not respond; is it plugged in?" };
                }
                Ok(Reading::ABSENT)
            }
            _ if !self.state.is_ready() && self.received.is_none() && silent < FIRST_REPORT_TIMEOUT => {
                Ok(Reading::ABSENT)
            }
            _ => Err(DeviceError::Lost { why: "it has been silent for too long; is it plugged in?", code: 0 }),
        }
    }
}
