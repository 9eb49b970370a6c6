//! The contract of a driver.
//!
//! Takes an optional argument, the text after the colon in `NAME:ARGUMENT`. Gives an open device, or one error that says
//! what to do about it. Never prints and never waits for a person: an open device that needs one says so in its
//! [`DeviceState`](typodont_core::device::DeviceState).

use crate::hid::HidMatch;
use std::fmt;
use typodont_core::device::Device;

/// A driver: finds and opens devices of one kind.
pub trait Driver: Sync {
    /// Returns the name that `--device` takes.
    fn name(&self) -> &'static str;

    /// Returns one line of text: which devices the driver opens, and the meaning of the argument after the colon.
    fn description(&self) -> &'static str;

    /// Kinds of HID devices that the driver opens. In a browser the user allows each device, and only these can be opened.
    fn hid_kinds(&self) -> &'static [HidMatch] {
        &[]
    }

    /// Lists the devices that are connected now. Opens nothing that can move.
    ///
    /// # Errors
    ///
    /// Returns an error if the system or the vendor's library cannot list its devices.
    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError>;

    /// Opens the device that `argument` names, or the first one found.
    ///
    /// # Errors
    ///
    /// Returns an error if there is no such device, or if it cannot be opened.
    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError>;
}

/// A device that [`Driver::discover`] found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundDevice {
    /// Product name, with the serial number where there is one.
    pub title: String,
    /// Argument after the colon that selects this device; empty if the driver has only one.
    pub argument: String,
}

/// Error of looking for a device or opening one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenError {
    /// The failure, in one line.
    pub message: String,
    /// Remedy for the user, in one line.
    pub help: String,
    /// True if the vendor's software is not installed or not running, which is an error only for whoever wants its
    /// device.
    pub is_absent: bool,
}

impl OpenError {
    pub fn new(message: impl Into<String>, help: impl Into<String>) -> OpenError {
        OpenError { message: message.into(), help: help.into(), is_absent: false }
    }

    /// Error of a vendor's software that is not installed or not running.
    pub fn absent(message: impl Into<String>, help: impl Into<String>) -> OpenError {
        OpenError { is_absent: true, ..OpenError::new(message, help) }
    }
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}\n    help: {}", self.message, self.help)
    }
}

impl std::error::Error for OpenError {}
