//! HID reports: finding devices, opening them, reading and writing.
//!
//! Takes a vendor, products and a usage page. Gives an open [`Transport`], or a complaint that says what to install.
//! Never knows what a report means. Whoever reads from it has a thread of their own: reads wait.

use super::{Found, Gone, Trouble};
use hidapi::{HidApi, HidDevice, HidError};
use std::ffi::CString;
use std::time::Duration;

/// Longest report of any device here, with its id byte.
pub const REPORT_MAX: usize = 65;

/// Reports thrown away at most while looking for the newest. The deepest queue of a system is 64 (hidraw); a device that
/// writes faster than it is read must not hold its reader up.
const DRAIN_MAX: usize = 128;

/// What reports go through: a device's pair of endpoints, or a test's.
pub trait Transport: Send + 'static {
    /// The next report in the queue, waiting for it. No bytes means that none came in time, never that the device ended.
    fn read(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, Gone>;

    /// Sends a report; its first byte is its id, 0 for a device without ids.
    fn write(&mut self, report: &[u8]) -> Result<(), Gone>;

    /// The newest report, waiting for the first one. Older ones are thrown away: systems queue 30 to 64 reports, and a
    /// reader that once fell behind would stay late for good.
    fn newest(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, Gone> {
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
}

/// Which devices a driver is for.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    pub vendor: u16,
    /// Empty: all of them.
    pub products: &'static [u16],
    /// Usage page and usage of its top collection: one device may have several, and only one is for us.
    pub usage: Option<(u16, u16)>,
}

/// A device that is plugged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plugged {
    pub vendor: u16,
    pub product: u16,
    pub usage: (u16, u16),
    /// As the device calls itself; empty if it does not.
    pub title: String,
    pub serial: String,
    path: CString,
}

impl Kind {
    pub fn fits(&self, plugged: &Plugged) -> bool {
        plugged.vendor == self.vendor
            && (self.products.is_empty() || self.products.contains(&plugged.product))
            && self.usage.is_none_or(|usage| usage == plugged.usage)
    }
}

/// What is plugged in of some kinds. Opens nothing.
pub fn find(kinds: &[Kind]) -> Result<Vec<Plugged>, Trouble> {
    let api = HidApi::new().map_err(no_list)?;
    let plugged = api.device_list().map(|d| Plugged {
        vendor: d.vendor_id(),
        product: d.product_id(),
        usage: (d.usage_page(), d.usage()),
        title: d.product_string().unwrap_or_default().trim().into(),
        serial: d.serial_number().unwrap_or_default().trim().into(),
        path: d.path().into(),
    });
    Ok(plugged.filter(|p| kinds.iter().any(|kind| kind.fits(p))).collect())
}

fn no_list(error: HidError) -> Trouble {
    Trouble::new(
        format!("the system does not list its HID devices: {error}"),
        "unplug the device and plug it in again; on Linux the kernel needs hidraw (CONFIG_HIDRAW)",
    )
}

/// Devices as `typodont devices` lists them: told apart by their serial numbers.
pub fn listed(found: Vec<Plugged>) -> Vec<Found> {
    found.into_iter().map(|p| Found { title: p.title, argument: p.serial }).collect()
}

/// The device with a serial number, or the first; `title` and `help` are for the complaint that there is none.
pub fn chosen(found: Vec<Plugged>, serial: Option<&str>, title: &str, help: &str) -> Result<Plugged, Trouble> {
    found.into_iter().find(|p| serial.is_none_or(|serial| p.serial == serial)).ok_or_else(|| {
        let which = serial.map_or(String::new(), |serial| format!(" with the serial number {serial}"));
        Trouble::new(format!("no {title}{which} is plugged in"), help)
    })
}

/// Opens a device that [`find`] found.
pub fn open(plugged: &Plugged) -> Result<Wired, Trouble> {
    let api = HidApi::new().map_err(no_list)?;
    let device = api.open_path(&plugged.path).map_err(|error| refusal(plugged, &error.to_string()))?;
    Ok(Wired { device })
}

/// Why a device that is there cannot be opened. On Linux only root may unless a udev rule says otherwise, and hidapi gives
/// the reason as text only.
pub fn refusal(plugged: &Plugged, reason: &str) -> Trouble {
    let Plugged { vendor, title, .. } = plugged;
    let what = format!("cannot open {title} ({vendor:04x}:{:04x}): {reason}", plugged.product);
    let help = match reason.to_lowercase().contains("permission denied") {
        true => format!(
            "copy content/devices/70-typodont.rules to /etc/udev/rules.d/, or write there: {}; then run `sudo udevadm \
             control --reload` and plug the device in again",
            udev_rule(*vendor)
        ),
        false => {
            "close other programs that use it (a 3Dconnexion or vendor's service may), then plug it in again".into()
        }
    };
    Trouble::new(what, help)
}

/// Gives the devices of a vendor to whoever sits at the machine.
pub fn udev_rule(vendor: u16) -> String {
    format!("KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", MODE=\"0660\", TAG+=\"uaccess\"")
}

/// A device on a real cable.
pub struct Wired {
    device: HidDevice,
}

impl Transport for Wired {
    fn read(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, Gone> {
        // -1 would wait for ever.
        let wait_ms = wait.as_millis().min(1000) as i32;
        self.device.read_timeout(report, wait_ms).map_err(|e| lost("reading from it failed; is it plugged in?", &e))
    }

    fn write(&mut self, report: &[u8]) -> Result<(), Gone> {
        // The count is not looked at: hidapi's back-ends pad, and one gives 0 on success.
        self.device.write(report).map(|_| ()).map_err(|e| lost("writing to it failed; is it plugged in?", &e))
    }
}

fn lost(why: &'static str, error: &HidError) -> Gone {
    let code = match error {
        HidError::IoError { error } => error.raw_os_error().unwrap_or(0),
        _ => 0,
    };
    Gone::Lost { why, code }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plugged(vendor: u16, product: u16, usage: (u16, u16)) -> Plugged {
        Plugged { vendor, product, usage, title: "SpaceNavigator".into(), serial: String::new(), path: c"/x".into() }
    }

    #[test]
    fn a_kind_fits_by_vendor_product_and_usage() {
        let kind = Kind { vendor: 0x046d, products: &[0xc626], usage: Some((1, 8)) };
        assert!(kind.fits(&plugged(0x046d, 0xc626, (1, 8))));
        assert!(!kind.fits(&plugged(0x046d, 0xc626, (12, 1))), "another collection of the same device");
        assert!(!kind.fits(&plugged(0x046d, 0xc077, (1, 8))), "a plain mouse of the same vendor");
        assert!(!kind.fits(&plugged(0x256f, 0xc626, (1, 8))));
        assert!(Kind { products: &[], usage: None, ..kind }.fits(&plugged(0x046d, 1, (0, 0))));
    }

    #[test]
    fn a_device_that_may_not_be_opened_names_the_rule_to_install() {
        let device = plugged(0x046d, 0xc626, (1, 8));
        let trouble = refusal(&device, "failed to open device with path /dev/hidraw3: Permission denied (os error 13)");
        assert!(trouble.what.contains("046d:c626"), "{trouble}");
        assert!(trouble.help.contains(r#"ATTRS{idVendor}=="046d", MODE="0660", TAG+="uaccess""#), "{trouble}");
        let busy = refusal(&device, "Device or resource busy (os error 16)");
        assert!(!busy.help.contains("udev"), "{busy}");
    }

    #[test]
    fn the_rules_that_are_shipped_cover_every_hid_device() {
        // Aim: what the complaint tells people to copy helps with each vendor. Method: every vendor stands in the file.
        let rules = include_str!("../../content/devices/70-typodont.rules");
        let kinds = [super::super::spacemouse::KINDS, super::super::polhem::KINDS, &[super::super::open_handle::KIND]];
        for kind in kinds.into_iter().flatten() {
            assert!(rules.contains(&udev_rule(kind.vendor)), "{:04x}", kind.vendor);
        }
    }
}
