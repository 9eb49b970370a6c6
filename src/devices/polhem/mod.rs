//! Polhem and WoodenHaptics (Forsslund Systems, haptikfabriken): open haptic arms that anyone can build.
//!
//! Takes the transport and the name of a geometry or port. Gives an arm behind a relay. Two unrelated protocols share
//! the name: [`hid_arm`] reads encoders over HID and computes the kinematics here; [`serial_arm`] exchanges lines of
//! text over a serial port with arms that compute them themselves. Facts from the open `haptikfabrikenapi` and its
//! firmware. Polhem v2 and v3 support only the second protocol.

pub mod hid_arm;
pub mod geometry;
#[cfg(not(target_family = "wasm"))]
mod ports;
#[cfg(not(target_family = "wasm"))]
pub mod serial_arm;

use crate::hid;
use crate::hid::{HidDeviceInfo, HidMatch};
use crate::protocol::open_device;
use crate::{Driver, FoundDevice, OpenError};
use geometry::{ARM_CONFIGS, ArmConfig};
use typodont_core::device::Device;
use typodont_core::frame::{Quat, Vec3};

/// Teensy raw HID, which all home-built devices on a Teensy share, and mbed LPC1768.
pub const HID_MATCHES: &[HidMatch] = &[
    HidMatch { vendor: 0x16c0, products: &[0x0486], usage: Some((0xffab, 0x0200)) },
    HidMatch { vendor: 0x1234, products: &[0x0006], usage: None },
];

/// Rotation from the arm's axes (x toward the user, y right, z up) to world space. It also converts the handle's own
/// axes, because its shaft is along x.
const WORLD_FROM_ARM: Quat = Quat::from_xyzw(-0.5, -0.5, -0.5, 0.5);

/// Converts a position or direction from the arm's axes to world space.
fn to_world(v: Vec3) -> Vec3 {
    Vec3::new(v.y, v.z, v.x)
}

/// Converts a position or direction from world space to the arm's axes.
fn to_arm(v: Vec3) -> Vec3 {
    Vec3::new(v.z, v.x, v.y)
}

/// Converts an orientation of the handle from the arm's axes to world space.
fn orientation_to_world(arm_from_handle: Quat) -> Quat {
    WORLD_FROM_ARM * arm_from_handle * WORLD_FROM_ARM.conjugate()
}

/// Driver of Polhem and WoodenHaptics arms.
pub struct PolhemDriver;

/// A page has no serial ports.
#[cfg(target_family = "wasm")]
mod ports {
    use crate::{FoundDevice, OpenError};
    use typodont_core::device::Device;

    pub fn find() -> Vec<FoundDevice> {
        Vec::new()
    }

    pub fn open(_port: &str) -> Result<Box<dyn Device + Send>, OpenError> {
        Err(OpenError::new("a page has no serial ports", "use the program that is installed"))
    }

    pub fn open_first() -> Option<Box<dyn Device + Send>> {
        None
    }
}

/// Geometry used if the argument names none.
const DEFAULT_CONFIG: &str = "polhem_v1";

impl Driver for PolhemDriver {
    fn name(&self) -> &'static str {
        "polhem"
    }

    fn description(&self) -> &'static str {
        "Polhem or WoodenHaptics arm; the argument is `hid`, `hid:GEOMETRY` (polhem_v1 by default) or `serial:PORT`"
    }

    fn hid_kinds(&self) -> &'static [HidMatch] {
        HID_MATCHES
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        let mut found: Vec<FoundDevice> = hid_candidates()?
            .into_iter()
            .map(|p| FoundDevice { title: format!("{} (may be a Polhem)", p.title), argument: "hid".into() })
            .collect();
        found.extend(ports::find());
        Ok(found)
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        match argument.map(|a| a.split_once(':').unwrap_or((a, ""))) {
            None => open_any(),
            Some(("hid", "")) => open_hid_arm(DEFAULT_CONFIG),
            Some(("hid", name)) => open_hid_arm(name),
            Some(("serial", port)) if !port.is_empty() => ports::open(port),
            Some((other, _)) => Err(OpenError::new(
                format!("unknown connection polhem:{other}"),
                "use polhem:hid, polhem:hid:polhem_v1 or polhem:serial:/dev/ttyACM0",
            )),
        }
    }
}

/// Lists the HID devices that may be an arm. An open handle uses the same Teensy and is recognized by its product
/// string.
fn hid_candidates() -> Result<Vec<HidDeviceInfo>, OpenError> {
    let mut arms = hid::find(HID_MATCHES)?;
    arms.retain(|p| p.title != crate::open_handle::PRODUCT);
    Ok(arms)
}

fn open_hid_arm(name: &str) -> Result<Box<dyn Device + Send>, OpenError> {
    let config = config_by_name(name)?;
    let plugged = hid_candidates()?.into_iter().next().ok_or_else(|| {
        OpenError::new(
            "no Polhem is connected as a HID device",
            "plug it in and switch its motors on, or try polhem:serial:PORT",
        )
    })?;
    let report_length = hid_arm::report_length(plugged.vendor);
    Ok(open_device(hid_arm::HidArm::new(hid::open(&plugged)?, config, report_length)))
}

fn config_by_name(name: &str) -> Result<&'static ArmConfig, OpenError> {
    ARM_CONFIGS.iter().find(|c| c.name == name).ok_or_else(|| {
        let known: Vec<&str> = ARM_CONFIGS.iter().map(|c| c.name).collect();
        OpenError::new(format!("unknown geometry {name}"), format!("use one of {}", known.join(", ")))
    })
}

/// Opens a HID arm if there is one, else the first serial port on which an arm is detected.
fn open_any() -> Result<Box<dyn Device + Send>, OpenError> {
    if !hid_candidates()?.is_empty() {
        return open_hid_arm(DEFAULT_CONFIG);
    }
    ports::open_first().ok_or_else(|| {
        OpenError::new(
            "no Polhem is connected",
            hid::connect_help(
                "plug it in and switch its motors on; on Linux you must be in the group dialout to open a serial port",
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_the_arm_are_converted_as_documented() {
        // Aim: toward the user, right, up become z, x, y, for positions and rotations alike.
        for (arm, world) in [(Vec3::X, Vec3::Z), (Vec3::Y, Vec3::X), (Vec3::Z, Vec3::Y)] {
            assert_eq!(to_world(arm), world);
            assert_eq!(to_arm(world), arm);
            assert!((WORLD_FROM_ARM * arm - world).length() < 1e-6);
        }
        let quarter = orientation_to_world(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
        assert!((quarter * Vec3::X - -Vec3::Z).length() < 1e-6, "the arm's z is the world's y");
    }

    #[test]
    fn an_invalid_argument_is_explained() {
        let open = |argument| PolhemDriver.open(Some(argument)).err().expect("no such device exists").to_string();
        assert!(open("usb").contains("polhem:serial:"));
        assert!(open("hid:polhem_v9").contains("polhem_v1, "));
        assert!(open("serial:/dev/no-such-port").contains("/dev/no-such-port"));
    }
}
