//! Choice of the device that a person holds, by name.

use super::LessonError;
use typodont_core::device::Device;
use typodont_devices::{Driver, NamedDevice};

/// An open device, with its driver and argument for opening it again.
pub struct OpenDevice {
    /// Name as it was requested.
    pub name: String,
    pub device: Box<dyn Device + Send>,
    pub driver: &'static dyn Driver,
    pub argument: Option<String>,
}

/// Opens the device that `NAME[:WHICH]` names.
///
/// # Errors
///
/// [`LessonError::UnknownDevice`] for an unknown name, [`LessonError::NoDevice`] if the device cannot be opened.
pub fn open_device(device_name: &str) -> Result<OpenDevice, LessonError> {
    let NamedDevice { name, driver, argument } = NamedDevice::parse(device_name)
        .map_err(|unknown| LessonError::UnknownDevice { name: unknown.name, known: unknown.known })?;
    let opened = driver.open(argument);
    let device =
        opened.map_err(|trouble| LessonError::NoDevice { name: name.to_string(), why: trouble.to_string() })?;
    Ok(OpenDevice { name: device_name.to_string(), device, driver, argument: argument.map(str::to_string) })
}
