//! Checks of devices: the one that the station uses, all others that are connected, and the priority of the servo.

use super::super::CliError;
use super::finding::{Finding, FindingStatus};
use super::remedies::StationFault;
use typodont_devices::realtime::{Priority, granted_priority};
use typodont_devices::{DRIVERS, Driver, NamedDevice, OpenError, access};

/// Drivers whose device is always there, so that finding it says nothing.
const ALWAYS_THERE: [&str; 2] = ["mouse", "stream"];

/// The device that a station uses.
pub struct ChosenDevice<'a> {
    /// Name as in `--device`.
    name: &'a str,
    device: NamedDevice<'a>,
}

/// Driver and argument of `NAME[:WHICH]`.
///
/// # Errors
/// There is no such driver.
pub fn choose(chosen: &str) -> Result<ChosenDevice<'_>, CliError> {
    let device = NamedDevice::parse(chosen).map_err(|error| CliError::misuse(format!("unknown-device: {error}")))?;
    Ok(ChosenDevice { name: chosen, device })
}

/// Findings for the station's device and for everything that is connected.
pub fn findings(chosen: &ChosenDevice) -> Vec<Finding> {
    let mut findings = vec![open_and_close(chosen)];
    findings.extend(hid_access());
    let own = chosen.device.driver.name();
    for other in DRIVERS.iter().filter(|other| other.name() != own && !ALWAYS_THERE.contains(&other.name())) {
        findings.extend(other_driver(*other));
    }
    findings.extend(device_rules());
    findings.push(realtime());
    findings
}

/// Opens the station's device, without force, and closes it again.
fn open_and_close(chosen: &ChosenDevice) -> Finding {
    let name = chosen.name;
    // The mouse is moved by the window, which has one wherever there is a display.
    if chosen.device.driver.name() == "mouse" {
        return Finding::ok("device", "mouse: the mouse of the window");
    }
    match chosen.device.driver.open(chosen.device.argument) {
        Ok(device) => {
            let spec = device.spec();
            let force = match spec.max_force > 0.0 {
                true => format!("up to {} N", spec.max_force),
                false => "without force".to_string(),
            };
            Finding::ok("device", format!("{name}: {}, {force}", spec.name))
        }
        Err(error) => finding_of("device", FindingStatus::Missing, &error, Some(name)),
    }
}

/// Connected HID devices that cannot be used as they are.
fn hid_access() -> Vec<Finding> {
    let check = "device-access";
    match access::connected() {
        Ok(connected) => connected
            .iter()
            .map(|device| match access::error(device) {
                Some(error) => finding_of(check, FindingStatus::Warning, &error, None),
                None => Finding::ok(check, format!("{} may be used", device.title)),
            })
            .collect(),
        Err(error) => vec![finding_of(check, FindingStatus::Warning, &error, None)],
    }
}

/// Devices of a driver that the station does not use, or the defect of its installed software. Nothing if neither is
/// there.
fn other_driver(driver: &dyn Driver) -> Vec<Finding> {
    let check = "other-device";
    match driver.discover() {
        Ok(found) => {
            let titles = found.into_iter().map(|found| found.title).filter(|title| !title.is_empty());
            titles.map(|title| Finding::ok(check, format!("{}: {title} is connected", driver.name()))).collect()
        }
        Err(error) if error.is_absent => Vec::new(),
        Err(error) => vec![finding_of(check, FindingStatus::Warning, &error, Some(driver.name()))],
    }
}

fn finding_of(check: &'static str, status: FindingStatus, error: &OpenError, name: Option<&str>) -> Finding {
    let message = match name {
        Some(name) => format!("{name}: {}", error.message),
        None => error.message.clone(),
    };
    Finding::with_remedy(check, status, message, &error.help)
}

/// The rules that give whoever sits at the machine access to devices: only Linux needs them.
#[cfg(target_os = "linux")]
fn device_rules() -> Option<Finding> {
    const FOLDERS: [&str; 4] = ["/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"];
    const FILE: &str = "70-typodont.rules";
    let found = FOLDERS.iter().map(|folder| std::path::Path::new(folder).join(FILE)).find(|path| path.is_file());
    Some(match found {
        Some(path) => Finding::ok("device-rules", path.display()),
        None => Finding::fault(
            "device-rules",
            FindingStatus::Warning,
            format!("{FILE} is not installed: only the administrator can use HID and USB devices"),
            StationFault::NoDeviceRules,
        ),
    })
}

#[cfg(not(target_os = "linux"))]
fn device_rules() -> Option<Finding> {
    None
}

fn realtime() -> Finding {
    match granted_priority() {
        Priority::Realtime => Finding::ok("real-time", Priority::Realtime),
        Priority::Ordinary => {
            Finding::fault("real-time", FindingStatus::Warning, Priority::Ordinary, StationFault::NoRealtime)
        }
    }
}
