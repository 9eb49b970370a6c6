//! A device without a thread of its own, as a browser's page has it.
//!
//! Takes a [`Protocol`] that never waits. Gives a [`Device`] that speaks it on the servo's own thread. A page cannot promise
//! that its servo goes on: another tab, the browser or the system may hold it up at any time, and nothing else in the page
//! could release the hand meanwhile. So force is rendered only on a device that releases the hand by itself soon after the
//! last command, and only the share of it that a late servo can hold. Tissue responds as on a device that is fully felt,
//! because removal follows from the force: exercises are as difficult as elsewhere.

use crate::Protocol;
use crate::hid::DRAIN_MAX;
use crate::hid::forwarded::QUEUE_MAX;
use crate::protocol::LastReport;
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, PageForce, Reading, Wrench};
use web_time::Duration;

/// Longest time without a command after which a device must release the hand by itself: in this time a hand that is pushed
/// with 3 N moves some millimetres.
const RELEASE_TIME_MAX: Duration = Duration::from_millis(50);

/// Share of the force and torque that is rendered, and so of the stiffness that is felt. A sampled spring of stiffness K is
/// passive if the damping of the device is above K·T/2 (Colgate and Schenkel 1997): the stiffness falls with the period T.
/// From a report to the force that answers it, a page takes up to 8 ms where a program takes 1 ms: two passages between
/// processes, and the browser's timer of 4 ms.
const FORCE_SHARE: f32 = 1.0 / 8.0;

/// Exchanges before the first one that counts: they read all reports that have come while the exercise was being prepared, and
/// render no force.
const OLD_EXCHANGES: usize = QUEUE_MAX.div_ceil(DRAIN_MAX);

/// Device on the servo's own thread.
pub struct DirectDevice<P: Protocol> {
    protocol: P,
    spec: DeviceSpec,
    /// `None` before the first exchange.
    last: Option<LastReport>,
}

impl<P: Protocol> DirectDevice<P> {
    pub fn new(protocol: P) -> DirectDevice<P> {
        let page_force = page_force(protocol.release_time());
        DirectDevice { spec: DeviceSpec { page_force, ..protocol.spec().clone() }, protocol, last: None }
    }
}

/// Force that a page renders on a device that releases the hand after this time by itself.
fn page_force(release_time: Option<Duration>) -> Option<PageForce> {
    release_time.map(|time| if time <= RELEASE_TIME_MAX { PageForce::Reduced } else { PageForce::Off })
}

impl<P: Protocol> Device for DirectDevice<P> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn renders_force(&self) -> bool {
        self.spec.page_force == Some(PageForce::Reduced)
    }

    fn state(&self) -> DeviceState {
        self.last.as_ref().map_or(LastReport::AWAITED, LastReport::state)
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        let share = if self.renders_force() { FORCE_SHARE } else { 0.0 };
        let Wrench { force, torque } = output.clamped_to(&self.spec);
        let output = Wrench { force: force * share, torque: torque * share };
        let last = match &mut self.last {
            Some(last) => last,
            None => {
                for _ in 0..OLD_EXCHANGES {
                    self.protocol.exchange(&Wrench::ZERO)?;
                }
                self.last.insert(LastReport::awaited())
            }
        };
        if let Some(report) = self.protocol.exchange(&output)? {
            last.receive(report);
        }
        last.reading()
    }
}

impl<P: Protocol> Drop for DirectDevice<P> {
    fn drop(&mut self) {
        self.protocol.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_is_left_only_to_a_device_that_releases_the_hand_by_itself() {
        let of = |ms| page_force(Some(Duration::from_millis(ms)));
        assert_eq!((of(20), of(500)), (Some(PageForce::Reduced), Some(PageForce::Off)));
        assert_eq!(page_force(None), None, "a device that renders none anyway");
    }
}
