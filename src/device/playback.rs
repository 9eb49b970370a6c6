//! A recording as a device: gives the readings again, whatever it is told.

use super::{Device, Gone, Output, Reading, Spec};

#[derive(Clone, Debug)]
pub struct Playback<I> {
    spec: Spec,
    readings: I,
}

impl<I: Iterator<Item = Reading>> Playback<I> {
    /// `spec` is that of the device on which the readings were made.
    pub fn new(spec: Spec, readings: I) -> Playback<I> {
        Playback { spec, readings }
    }
}

impl<I: Iterator<Item = Reading>> Device for Playback<I> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn exchange(&mut self, _output: &Output) -> Result<Reading, Gone> {
        self.readings.next().ok_or(Gone::Ended)
    }
}
