//! HID devices of the system.
//!
//! Takes what a driver looks for. Gives the connected devices, and an open one. Reads block, so each caller uses a thread of
//! its own.

use super::{HidDeviceInfo, HidMatch, Transport};
use crate::OpenError;
use hidapi::{HidApi, HidDevice, HidError};
use std::time::Duration;
use typodont_core::device::DeviceError;

/// Lists the connected devices that match one of `kinds`. Opens nothing.
///
/// # Errors
///
/// Returns an error if the system cannot list its HID devices.
pub fn find(kinds: &[HidMatch]) -> Result<Vec<HidDeviceInfo>, OpenError> {
    let api = HidApi::new().map_err(enumeration_error)?;
    let plugged = api.device_list().map(|d| HidDeviceInfo {
        vendor: d.vendor_id(),
        product: d.product_id(),
        usage: (d.usage_page(), d.usage()),
        title: d.product_string().unwrap_or_default().trim().into(),
        serial: d.serial_number().unwrap_or_default().trim().into(),
        path: d.path().into(),
    });
    Ok(plugged.filter(|p| kinds.iter().any(|kind| kind.matches(p))).collect())
}

fn enumeration_error(error: HidError) -> OpenError {
    OpenError::new(
        format!("cannot list the HID devices: {error}"),
        if cfg!(target_os = "linux") {
            "unplug the device and plug it in again; the kernel needs hidraw (CONFIG_HIDRAW)"
        } else {
            "unplug the device and plug it in again; if that does not help, restart the computer"
        },
    )
}

/// Opens a device returned by [`find`].
///
/// # Errors
///
/// Returns an error if the system denies access or another program uses the device.
pub fn open(info: &HidDeviceInfo) -> Result<HidTransport, OpenError> {
    let api = HidApi::new().map_err(enumeration_error)?;
    let device = api.open_path(&info.path).map_err(|error| open_error(info, &error.to_string()))?;
    Ok(HidTransport { device })
}

/// Returns the error for a device that is present but cannot be opened. On Linux only root may open it unless a udev
/// rule grants access, and hidapi gives the reason only as text.
pub fn open_error(info: &HidDeviceInfo, reason: &str) -> OpenError {
    let HidDeviceInfo { vendor, title, .. } = info;
    let what = format!("cannot open {title} ({vendor:04x}:{:04x}): {reason}", info.product);
    let reason = reason.to_lowercase();
    let is_denied = reason.contains("permission denied") || reason.contains("access is denied");
    let help = match is_denied {
        true if cfg!(windows) => {
            "close other programs that use it, such as the vendor's control panel; if that does not \
                                  help, uninstall the device in Windows' Device Manager and plug it in again"
                .into()
        }
        true if cfg!(target_os = "macos") => {
            "allow the program in System Settings, Privacy & Security, Input Monitoring; then plug it in again".into()
        }
        true => format!(
            "install the package of Typodont, or copy content/devices/70-typodont.rules to /etc/udev/rules.d/, or create \
             a file there with the line {}; then run `sudo udevadm control --reload` and plug the device in again",
            udev_rule(*vendor)
        ),
        false => {
            "close other programs that use it (such as a vendor's background service), then plug it in again".into()
        }
    };
    OpenError::new(what, help)
}

/// Other programs that have the device open, as far as this user may see them: name and process number. Two programs
/// that write forces to one device disturb each other, and the system does not prevent it. Only Linux tells.
pub fn other_users(info: &HidDeviceInfo) -> Vec<String> {
    let Ok(node) = info.path.to_str() else { return Vec::new() };
    let own = std::process::id().to_string();
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let mut users: Vec<String> = processes
        .filter(|process| process.file_name().to_str().is_some_and(|id| id != own && id.parse::<u32>().is_ok()))
        .filter(|process| {
            let files = std::fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten();
            files.filter_map(|file| std::fs::read_link(file.path()).ok()).any(|open| open.as_os_str() == node)
        })
        .map(|process| {
            let name = std::fs::read_to_string(process.path().join("comm")).unwrap_or_default();
            format!("{} (process {})", name.trim(), process.file_name().display())
        })
        .collect();
    users.sort();
    users
}

/// Returns the udev rule that gives the user at the machine access to the devices of a vendor.
pub fn udev_rule(vendor: u16) -> String {
    format!("KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", MODE=\"0660\", TAG+=\"uaccess\"")
}

/// A device on a real cable.
pub struct HidTransport {
    device: HidDevice,
}

impl Transport for HidTransport {
    fn read(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, DeviceError> {
        // A negative time-out would wait for ever.
        let wait_ms = wait.as_millis().min(1000) as i32;
        self.device
            .read_timeout(report, wait_ms)
            .map_err(|e| device_lost("reading from it failed; is it plugged in?", &e))
    }

    fn write(&mut self, report: &[u8]) -> Result<(), DeviceError> {
        // The returned count is ignored: the back-ends of hidapi pad reports, and one returns 0 on success.
        self.device.write(report).map(|_| ()).map_err(|e| device_lost("writing to it failed; is it plugged in?", &e))
    }
}

fn device_lost(why: &'static str, error: &HidError) -> DeviceError {
    let code = match error {
        HidError::IoError { error } => error.raw_os_error().unwrap_or(0),
        _ => 0,
    };
    DeviceError::Lost { why, code }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plugged;
    use super::*;

    #[test]
    fn a_device_that_may_not_be_opened_names_the_rule_to_install() {
        let device = plugged(0x046d, 0xc626, (1, 8));
        let error =
            open_error(&device, "failed to open device with path /dev/hidraw3: Permission denied (os error 13)");
        assert!(error.message.contains("046d:c626"), "{error}");
        assert!(error.help.contains(r#"ATTRS{idVendor}=="046d", MODE="0660", TAG+="uaccess""#), "{error}");
        let busy = open_error(&device, "Device or resource busy (os error 16)");
        assert!(!busy.help.contains("udev"), "{busy}");
    }

    #[test]
    fn the_rules_that_are_shipped_cover_every_hid_device() {
        // Aim: the rules that the error message recommends cover each vendor. Method: the file contains the rule of
        // each vendor.
        let rules = include_str!("../../../content/devices/70-typodont.rules");
        let kinds = [crate::spacemouse::HID_MATCHES, crate::polhem::HID_MATCHES, &[crate::open_handle::HID_MATCH]];
        for kind in kinds.into_iter().flatten() {
            assert!(rules.contains(&udev_rule(kind.vendor)), "{:04x}", kind.vendor);
        }
    }
}
