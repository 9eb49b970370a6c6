//! The registry of drivers, by the name that `--device` takes.

use super::driver::Driver;
use std::fmt;

/// All drivers, in the order in which `typodont devices` lists them.
#[cfg(not(target_family = "wasm"))]
pub static DRIVERS: &[&dyn Driver] = &[
    &crate::mouse::MouseDriver,
    &crate::spacemouse::SpaceMouseDriver,
    &crate::openhaptics::OpenHapticsDriver,
    &crate::forcedimension::ForceDimensionDriver,
    &crate::haply::HaplyDriver,
    &crate::polhem::PolhemDriver,
    &crate::open_handle::OpenHandleDriver,
    &crate::stream::StreamDriver,
];

/// All drivers of a browser, which passes HID reports to a page.
#[cfg(target_family = "wasm")]
pub static DRIVERS: &[&dyn Driver] = &[
    &crate::mouse::MouseDriver,
    &crate::spacemouse::SpaceMouseDriver,
    &crate::polhem::PolhemDriver,
    &crate::open_handle::OpenHandleDriver,
];

/// Returns the driver with this name.
pub fn driver_by_name(name: &str) -> Option<&'static dyn Driver> {
    DRIVERS.iter().copied().find(|d| d.name() == name)
}

/// A driver as `--device` names it.
#[derive(Clone, Copy)]
pub struct NamedDevice<'a> {
    /// Name of the driver.
    pub name: &'a str,
    pub driver: &'static dyn Driver,
    /// Which of its devices, in the words of the driver.
    pub argument: Option<&'a str>,
}

/// No driver has the name that was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownDriverError {
    pub name: String,
    /// Names of all drivers, separated by commas.
    pub known: String,
}

impl fmt::Display for UnknownDriverError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "there is no device named \"{}\"; known: {}", self.name, self.known)
    }
}

impl std::error::Error for UnknownDriverError {}

impl NamedDevice<'_> {
    /// Reads `NAME[:WHICH]`.
    ///
    /// # Errors
    ///
    /// [`UnknownDriverError`] if there is no driver of this name.
    pub fn parse(device_name: &str) -> Result<NamedDevice<'_>, UnknownDriverError> {
        let (name, argument) = match device_name.split_once(':') {
            Some((name, argument)) => (name, Some(argument)),
            None => (device_name, None),
        };
        match driver_by_name(name) {
            Some(driver) => Ok(NamedDevice { name, driver, argument }),
            None => {
                let known = DRIVERS.iter().map(|driver| driver.name()).collect::<Vec<_>>().join(", ");
                Err(UnknownDriverError { name: name.to_string(), known })
            }
        }
    }
}
