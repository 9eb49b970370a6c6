//! The arms on the computer's serial ports.

use super::serial_arm;
use crate::protocol::open_device;
use crate::{FoundDevice, OpenError};
use std::time::Duration;
use typodont_core::device::Device;

/// Time for which a serial port is checked for an arm. An arm sends many lines in this time.
const LISTEN_TIME: Duration = Duration::from_millis(500);

/// Lists the ports, on each of which an arm may be.
pub fn find() -> Vec<FoundDevice> {
    let found = |port| FoundDevice {
        title: format!("serial port {port} (may be a Polhem)"),
        argument: format!("serial:{port}"),
    };
    serial_arm::ports().into_iter().map(found).collect()
}

/// Opens the arm on a port.
///
/// # Errors
///
/// Returns an error if the port cannot be opened.
pub fn open(port: &str) -> Result<Box<dyn Device + Send>, OpenError> {
    Ok(open_device(serial_arm::open(port)?))
}

/// Opens the first port on which an arm is detected. Detection writes nothing, so that it disturbs no other device on such a
/// port.
pub fn open_first() -> Option<Box<dyn Device + Send>> {
    let mut arms = serial_arm::ports().into_iter().filter_map(|port| serial_arm::open(&port).ok());
    arms.find_map(|mut arm| arm.detects_arm(LISTEN_TIME).then(|| open_device(arm)))
}
