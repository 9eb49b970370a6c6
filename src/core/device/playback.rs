//! Playback of recorded readings as a device; the wrench it is given is ignored.

use crate::device::{Device, DeviceError, DeviceSpec, Reading, Wrench};

#[derive(Clone, Debug)]
pub struct PlaybackDevice<I> {
    spec: DeviceSpec,
    readings: I,
}

impl<I: Iterator<Item = Reading>> PlaybackDevice<I> {
    /// `spec` is that of the device on which the readings were recorded.
    pub fn new(spec: DeviceSpec, readings: I) -> PlaybackDevice<I> {
        PlaybackDevice { spec, readings }
    }
}

impl<I: Iterator<Item = Reading>> Device for PlaybackDevice<I> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn exchange(&mut self, _output: &Wrench) -> Result<Reading, DeviceError> {
        self.readings.next().ok_or(DeviceError::Ended)
    }
}
