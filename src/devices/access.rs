//! Access to the HID devices that are connected, whichever driver they belong to.
//!
//! Takes nothing. Gives one error for each device that cannot be used as it is. Never moves a device: each is opened and
//! closed again, and no report is read or written.

use crate::hid::{HidDeviceInfo, HidMatch};
use crate::{OpenError, hid, open_handle, polhem, spacemouse};

/// The connected HID devices that the program supports.
///
/// # Errors
///
/// Returns an error if the system cannot list its HID devices.
pub fn connected() -> Result<Vec<HidDeviceInfo>, OpenError> {
    let kinds: Vec<HidMatch> = [spacemouse::HID_MATCHES, polhem::HID_MATCHES, &[open_handle::HID_MATCH]]
        .into_iter()
        .flatten()
        .copied()
        .collect();
    hid::find(&kinds)
}

/// Reason why a device cannot be used without disturbance: another program has it open, or it cannot be opened.
pub fn error(device: &HidDeviceInfo) -> Option<OpenError> {
    let users = hid::other_users(device);
    if !users.is_empty() {
        return Some(OpenError::new(
            format!("{} is also open in {}", device.title, users.join(", ")),
            "close that program; two programs that move one device disturb each other",
        ));
    }
    hid::open(device).err()
}
