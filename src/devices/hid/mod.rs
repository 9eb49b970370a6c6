//! HID reports: finding devices, opening them, reading and writing.
//!
//! Takes a vendor, products and a usage page. Gives an open [`Transport`], or an error that says what to install. The devices are
//! those of the system or, in a browser, those that the page [forwards](forwarded). Never interprets a report.

pub mod forwarded;
#[cfg(not(target_family = "wasm"))]
mod system;

#[cfg(target_family = "wasm")]
pub use forwarded::{find, open};
#[cfg(not(target_family = "wasm"))]
pub use system::{find, open, open_error, other_users, udev_rule};

use crate::{FoundDevice, OpenError};
use std::ffi::CString;
use std::time::Duration;
use typodont_core::device::DeviceError;

/// Length of the longest report of any supported device, including the id byte.
pub const REPORT_MAX: usize = 65;

/// Reports discarded at most while looking for the newest one. The deepest queue of any system is 64 (hidraw); a
/// device that sends faster than it is read must not block its reader.
pub(crate) const DRAIN_MAX: usize = 128;

/// Channel for reports: a pair of endpoints of a device, or that of a test.
pub trait Transport: Send + 'static {
    /// Reads the next report in the queue, waiting up to `wait`. Zero bytes mean that none came in time, never that
    /// the device has gone.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] if reading fails.
    fn read(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, DeviceError>;

    /// Sends a report; its first byte is the report id, 0 for a device without ids.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] if writing fails.
    fn write(&mut self, report: &[u8]) -> Result<(), DeviceError>;

    /// Sends a report that makes those of its kind obsolete that have not been sent yet.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] if writing fails.
    fn write_newest(&mut self, report: &[u8]) -> Result<(), DeviceError> {
        self.write(report)
    }

    /// Reads the newest report, waiting up to `wait` for the first one. Older reports are discarded: systems queue 30
    /// to 64 reports, and a reader that once fell behind would stay late for ever.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] if reading fails.
    fn read_newest(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, DeviceError> {
        let mut length = self.read(report, wait)?;
        let mut newer = [0; REPORT_MAX];
        for _ in 0..DRAIN_MAX {
            if length == 0 {
                break;
            }
            match self.read(&mut newer, Duration::ZERO)? {
                0 => break,
                n => {
                    length = n.min(report.len());
                    report[..length].copy_from_slice(&newer[..length]);
                }
            }
        }
        Ok(length)
    }

    /// False if [`Transport::read`] returns at once, because no report comes in while its caller waits.
    fn can_wait(&self) -> bool {
        true
    }
}

/// Selection of the devices that a driver supports.
#[derive(Clone, Copy, Debug)]
pub struct HidMatch {
    pub vendor: u16,
    /// Empty: all products of the vendor.
    pub products: &'static [u16],
    /// Usage page and usage of the top-level collection: a device may have several, of which only one is ours.
    pub usage: Option<(u16, u16)>,
}

/// A connected HID device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HidDeviceInfo {
    pub vendor: u16,
    pub product: u16,
    pub usage: (u16, u16),
    /// Product name that the device reports; empty if it reports none.
    pub title: String,
    pub serial: String,
    /// Path of the system, or a number of the page.
    pub path: CString,
}

impl HidMatch {
    pub fn matches(&self, info: &HidDeviceInfo) -> bool {
        info.vendor == self.vendor
            && (self.products.is_empty() || self.products.contains(&info.product))
            && self.usage.is_none_or(|usage| usage == info.usage)
    }
}

/// Converts devices to the list for `typodont devices`: their serial numbers tell them apart.
pub fn found_devices(found: Vec<HidDeviceInfo>) -> Vec<FoundDevice> {
    found.into_iter().map(|p| FoundDevice { title: p.title, argument: p.serial }).collect()
}

/// Returns the device with a serial number, or the first one.
///
/// # Errors
///
/// Returns an error, with `title` and `help`, if there is none.
pub fn select(
    found: Vec<HidDeviceInfo>,
    serial: Option<&str>,
    title: &str,
    help: &str,
) -> Result<HidDeviceInfo, OpenError> {
    found.into_iter().find(|p| serial.is_none_or(|serial| p.serial == serial)).ok_or_else(|| {
        let which = serial.map_or(String::new(), |serial| format!(" with the serial number {serial}"));
        OpenError::new(format!("no {title}{which} is connected"), connect_help(help))
    })
}

/// Advice for a device that is not connected: that of the driver, or what a page needs.
pub fn connect_help(of_driver: &str) -> &str {
    if cfg!(target_family = "wasm") { "allow it in the settings (F2), and plug it in" } else { of_driver }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A connected device of a vendor.
    pub(super) fn plugged(vendor: u16, product: u16, usage: (u16, u16)) -> HidDeviceInfo {
        HidDeviceInfo {
            vendor,
            product,
            usage,
            title: "SpaceNavigator".into(),
            serial: String::new(),
            path: c"/x".into(),
        }
    }

    #[test]
    fn a_device_matches_by_vendor_product_and_usage() {
        let kind = HidMatch { vendor: 0x046d, products: &[0xc626], usage: Some((1, 8)) };
        assert!(kind.matches(&plugged(0x046d, 0xc626, (1, 8))));
        assert!(!kind.matches(&plugged(0x046d, 0xc626, (12, 1))), "another collection of the same device");
        assert!(!kind.matches(&plugged(0x046d, 0xc077, (1, 8))), "a plain mouse of the same vendor");
        assert!(!kind.matches(&plugged(0x256f, 0xc626, (1, 8))));
        assert!(HidMatch { products: &[], usage: None, ..kind }.matches(&plugged(0x046d, 1, (0, 0))));
    }
}
