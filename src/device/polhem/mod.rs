//! Polhem and WoodenHaptics (Forsslund Systems, haptikfabriken): open haptic arms that anyone can build.
//!
//! Two wires that share a name and no byte: [`arm`] reads encoders over HID and does the kinematics here, [`record`] talks to
//! arms that do them themselves, in lines of text over a serial port.
//! Facts from the open `haptikfabrikenapi` and its firmware. Polhem v2 and v3 speak only the second.

pub mod arm;
pub mod geometry;
pub mod record;

use super::hid::{self, Kind, Plugged};
use super::{Device, Driver, Found, Relay, Trouble};
use crate::frame::{Quat, Vec3};
use geometry::{CONFIGS, Config};
use std::time::Duration;

/// Teensy raw HID, which every home-built device on a Teensy shares, and mbed LPC1768.
pub const KINDS: &[Kind] = &[
    Kind { vendor: 0x16c0, products: &[0x0486], usage: Some((0xffab, 0x0200)) },
    Kind { vendor: 0x1234, products: &[0x0006], usage: None },
];

/// From the arm's axes (x toward the user, y right, z up), to which its handle's keep: its shaft is along x.
const WORLD_FROM_ARM: Quat = Quat::from_xyzw(-0.5, -0.5, -0.5, 0.5);

/// A place or direction of the arm in world space.
fn to_world(v: Vec3) -> Vec3 {
    Vec3::new(v.y, v.z, v.x)
}

/// A place or direction in world space as the arm sees it.
fn to_arm(v: Vec3) -> Vec3 {
    Vec3::new(v.z, v.x, v.y)
}

/// An orientation of the handle in world space.
fn turn_to_world(arm_from_handle: Quat) -> Quat {
    WORLD_FROM_ARM * arm_from_handle * WORLD_FROM_ARM.conjugate()
}

/// `--device polhem`.
pub struct Polhem;

/// The arm that is meant when nothing else is said.
const DEFAULT_CONFIG: &str = "polhem_v1";

/// How long a serial port is listened to before it counts as no arm's. An arm sends many lines in this time.
const LISTEN: Duration = Duration::from_millis(500);

impl Driver for Polhem {
    fn name(&self) -> &'static str {
        "polhem"
    }

    fn about(&self) -> &'static str {
        "Polhem or WoodenHaptics arm; after the colon `hid`, `hid:NAME` of its geometry (polhem_v1 unless said), or `serial:PORT`"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        let mut found: Vec<Found> = arms()?
            .into_iter()
            .map(|p| Found { title: format!("{} (perhaps a Polhem)", p.title), argument: "hid".into() })
            .collect();
        found.extend(record::ports().into_iter().map(|port| Found {
            title: format!("serial port {port} (perhaps a Polhem)"),
            argument: format!("serial:{port}"),
        }));
        Ok(found)
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        match argument.map(|a| a.split_once(':').unwrap_or((a, ""))) {
            None => open_any(),
            Some(("hid", "")) => open_arm(DEFAULT_CONFIG),
            Some(("hid", name)) => open_arm(name),
            Some(("serial", port)) if !port.is_empty() => Ok(Box::new(Relay::start(record::open(port)?))),
            Some((other, _)) => Err(Trouble::new(
                format!("polhem:{other} is no way to reach a Polhem"),
                "write polhem:hid, polhem:hid:polhem_v1 or polhem:serial:/dev/ttyACM0",
            )),
        }
    }
}

/// What may be an arm. A handle of our own kind sits on the same Teensy and says so.
fn arms() -> Result<Vec<Plugged>, Trouble> {
    let mut arms = hid::find(KINDS)?;
    arms.retain(|p| p.title != super::open_handle::PRODUCT);
    Ok(arms)
}

fn open_arm(name: &str) -> Result<Box<dyn Device + Send>, Trouble> {
    let config = config(name)?;
    let plugged = arms()?.into_iter().next().ok_or_else(|| {
        Trouble::new(
            "no Polhem is plugged in as a HID device",
            "plug it in and switch its motors on, or try polhem:serial:PORT",
        )
    })?;
    let report_length = arm::report_length(plugged.vendor);
    Ok(Box::new(Relay::start(arm::Arm::new(hid::open(&plugged)?, config, report_length))))
}

fn config(name: &str) -> Result<&'static Config, Trouble> {
    CONFIGS.iter().find(|c| c.name == name).ok_or_else(|| {
        let known: Vec<&str> = CONFIGS.iter().map(|c| c.name).collect();
        Trouble::new(format!("no geometry is named {name}"), format!("write one of {}", known.join(", ")))
    })
}

/// HID first; then each serial port on which something like an arm is heard. Listening writes nothing, so that no other
/// device on such a port is disturbed.
fn open_any() -> Result<Box<dyn Device + Send>, Trouble> {
    if !arms()?.is_empty() {
        return open_arm(DEFAULT_CONFIG);
    }
    for port in record::ports() {
        if let Ok(mut wire) = record::open(&port)
            && wire.hears_an_arm(LISTEN)
        {
            return Ok(Box::new(Relay::start(wire)));
        }
    }
    Err(Trouble::new(
        "no Polhem is plugged in",
        "plug it in and switch its motors on; on Linux you must be in the group dialout to open a serial port",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_s_axes_are_turned_as_the_sheet_says() {
        // Aim: toward the user, right, up become z, x, y, for places and for turns alike.
        for (arm, world) in [(Vec3::X, Vec3::Z), (Vec3::Y, Vec3::X), (Vec3::Z, Vec3::Y)] {
            assert_eq!(to_world(arm), world);
            assert_eq!(to_arm(world), arm);
            assert!((WORLD_FROM_ARM * arm - world).length() < 1e-6);
        }
        let quarter = turn_to_world(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
        assert!((quarter * Vec3::X - -Vec3::Z).length() < 1e-6, "about the arm's z is about our y");
    }

    #[test]
    fn an_argument_that_means_nothing_is_explained() {
        let open = |argument| Polhem.open(Some(argument)).err().expect("nothing such exists").to_string();
        assert!(open("usb").contains("polhem:serial:"));
        assert!(open("hid:polhem_v9").contains("polhem_v1, "));
        assert!(open("serial:/dev/no-such-port").contains("/dev/no-such-port"));
    }
}
