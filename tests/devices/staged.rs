//! A device on a stage: something happens before a beat of the test's choice, on the servo's own thread.

use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, Wrench};

/// A device that changes what another one does at a beat of its choice.
pub struct Staged<D, F> {
    pub device: D,
    pub beats: u64,
    pub at_beat: F,
}

impl<D: Device, F: FnMut(u64)> Device for Staged<D, F> {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        (self.at_beat)(self.beats);
        self.beats += 1;
        self.device.exchange(output)
    }

    fn pacing(&self) -> Pacing {
        self.device.pacing()
    }

    fn state(&self) -> DeviceState {
        self.device.state()
    }
}
