//! 3Dconnexion SpaceMouse and related devices: six axes, no force.
//!
//! Takes deflections of the cap. Gives a pose that the deflections move: they are a velocity, not a position. Never
//! renders force: contact can only be seen.
//!
//! Report layouts as published by spacenavd, PySpaceMouse and vrpn.

use crate::hid;
use crate::hid::{HidMatch, Transport};
use crate::protocol::open_device;
use crate::{DeviceReport, Driver, FoundDevice, OpenError, Protocol};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use web_time::{Duration, Instant};

/// Usage page "generic desktop", usage "multi-axis controller".
const MULTI_AXIS: Option<(u16, u16)> = Some((1, 8));

/// Logitech's products until 2013, then 3Dconnexion's own. A CadMouse (c650 to c668) is a plain mouse and is not
/// listed.
pub const HID_MATCHES: &[HidMatch] = &[
    HidMatch {
        vendor: 0x046d,
        products: &[0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625, 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640],
        usage: MULTI_AXIS,
    },
    HidMatch {
        vendor: 0x256f,
        products: &[0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633, 0xc635, 0xc636, 0xc638, 0xc63a, 0xc641, 0xc652],
        usage: MULTI_AXIS,
    },
];

/// Counts at full deflection. Some units exceed it and are clamped.
const FULL_DEFLECTION: f32 = 350.0;

/// Speed at full deflection, mm/s: across a tooth in 0.25 s. With the cubic response a third of the deflection gives
/// 1.5 mm/s, slow enough for cutting.
const SPEED: f32 = 40.0;

/// Rate of rotation at full deflection, rad/s: a quarter turn in a little more than a second.
const TURN_SPEED: f32 = 1.4;

/// Half the box that confines the position, mm.
const WORKSPACE_HALF: Vec3 = Vec3::new(60.0, 45.0, 35.0);

/// Time for which one exchange waits for a report. The cap reports every 8 to 16 ms; the position moves on in between.
const REPORT_TIMEOUT: Duration = Duration::from_millis(1);

/// Longest time over which a deflection is integrated in one step, s: a stalled machine must not make the instrument
/// jump.
const MAX_STEP_TIME: f32 = 0.02;

/// Reports read in one exchange at most; a queue holds 64.
const REPORTS_MAX: usize = 64;

/// Consecutive malformed reports after which the device is declared not to be a SpaceMouse. It sends at most 125 per
/// second.
const MALFORMED_MAX: u32 = 50;

const TRANSLATION: u8 = 1;
const ROTATION: u8 = 2;
const BUTTONS: u8 = 3;
const LED: u8 = 4;

/// Protocol of a SpaceMouse on a cable or a receiver.
pub struct SpaceMouseProtocol<T> {
    transport: T,
    spec: DeviceSpec,
    cap: Cap,
    pose: Pose,
    moved_at: Option<Instant>,
    malformed: u32,
}

impl<T: Transport> SpaceMouseProtocol<T> {
    /// Starts with the hand at the origin, upright, and switches the light on. `product` selects the button layout.
    pub fn new(mut transport: T, product: u16) -> SpaceMouseProtocol<T> {
        // A failure is ignored: some devices have no light.
        let _ = transport.write(&[LED, 1]);
        let cap = Cap { deflection: [0.0; 6], buttons: 0, layout: button_layout(product) };
        let pose = Pose { position: Vec3::ZERO, orientation: UPRIGHT };
        SpaceMouseProtocol { transport, spec: spec(), cap, pose, moved_at: None, malformed: 0 }
    }
}

impl<T: Transport> Protocol for SpaceMouseProtocol<T> {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// Always [`Pacing::Host`]: a cap at rest sends no reports.
    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    fn exchange(&mut self, _output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        let mut report = [0; hid::REPORT_MAX];
        let mut wait = REPORT_TIMEOUT;
        // Read every report, not only the newest: translation, rotation and buttons come in separate reports.
        for _ in 0..REPORTS_MAX {
            let length = self.transport.read(&mut report, wait)?;
            if length == 0 {
                break;
            }
            match self.cap.parse_report(&report[..length]) {
                true => self.malformed = 0,
                false => self.malformed += 1,
            }
            wait = Duration::ZERO;
        }
        if self.malformed > MALFORMED_MAX {
            return Err(DeviceError::Lost {
                why: "its reports are not those of a SpaceMouse; plug it in again",
                code: 0,
            });
        }
        let now = Instant::now();
        let elapsed = self.moved_at.replace(now).map_or(0.0, |at| now.duration_since(at).as_secs_f32());
        self.pose = integrate(self.pose, self.cap.deflection, elapsed.min(MAX_STEP_TIME));
        let reading = Reading { pose: self.pose, buttons: self.cap.buttons };
        Ok(Some(DeviceReport { reading, state: DeviceState::Ready }))
    }

    fn close(&mut self) {
        // A failure is ignored: the device may be gone.
        let _ = self.transport.write(&[LED, 0]);
    }
}

/// Last state of the cap. The device sends nothing while the state does not change; after a release it sends zero
/// three times.
#[derive(Clone, Debug)]
struct Cap {
    /// x y z and rotations about them, -1 to 1, in the device's axes: right, toward the user, down.
    deflection: [f32; 6],
    buttons: u32,
    layout: &'static [u32],
}

impl Cap {
    /// Updates the state from a report; returns false if it is malformed. Other kinds of reports (battery, keys of an
    /// Enterprise) are ignored.
    fn parse_report(&mut self, report: &[u8]) -> bool {
        match (report[0], report.len() - 1) {
            (TRANSLATION, 6) => self.deflection[..3].copy_from_slice(&axes(&report[1..])[..3]),
            (TRANSLATION, 12) => self.deflection = axes(&report[1..]),
            (ROTATION, 6) => self.deflection[3..].copy_from_slice(&axes(&report[1..])[..3]),
            (BUTTONS, 1..) => self.buttons = reorder_buttons(&report[1..], self.layout),
            (TRANSLATION | ROTATION | BUTTONS, _) => return false,
            _ => {}
        }
        true
    }
}

/// Decodes up to six axes, little-endian, and scales them to -1 to 1.
fn axes(bytes: &[u8]) -> [f32; 6] {
    let mut axes = [0.0; 6];
    for (axis, two) in axes.iter_mut().zip(bytes.chunks_exact(2)) {
        *axis = (f32::from(i16::from_le_bytes([two[0], two[1]])) / FULL_DEFLECTION).clamp(-1.0, 1.0);
    }
    axes
}

/// Returns the pose after the given time at this deflection.
///
/// The response is cubic: fine near rest, where the instrument cuts, and fast at full deflection. A cap that does not
/// quite return to zero does not drift visibly.
fn integrate(pose: Pose, deflection: [f32; 6], seconds: f32) -> Pose {
    let [x, y, z, rx, ry, rz] = deflection.map(|d| d * d * d);
    // The device's z points down and its y toward the user.
    let (shift, rotation) = (Vec3::new(x, -z, y), Vec3::new(rx, -rz, ry));
    let position = (pose.position + shift * (SPEED * seconds)).clamp(-WORKSPACE_HALF, WORKSPACE_HALF);
    let turned = Quat::from_scaled_axis(rotation * (TURN_SPEED * seconds)) * pose.orientation;
    Pose { position, orientation: turned.normalize() }
}

/// Device bit for each of the program's buttons, bit 0 first. Empty: the device's order.
type ButtonLayout = &'static [u32];

/// Keys 1 to 4, then MENU FIT TOP REAR FRONT ROLL ESC ALT SHIFT CTRL LOCK: the keys used for work come first.
const PRO: ButtonLayout = &[12, 13, 14, 15, 0, 1, 2, 4, 5, 8, 22, 23, 24, 25, 26];

/// Keys 1 to 12, then as PRO.
const ENTERPRISE: ButtonLayout = &[12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 0, 1, 2, 4, 5, 8, 22, 23, 24, 25, 26];

/// Keys 1 to 5, then MENU FIT TOP FRONT ROLL ESC ALT SHIFT CTRL LOCK.
const PILOT_PRO: ButtonLayout = &[17, 18, 14, 15, 16, 0, 1, 2, 5, 8, 22, 23, 24, 25, 26];

/// Returns the button layout of a product, after PySpaceMouse's device table.
fn button_layout(product: u16) -> ButtonLayout {
    match product {
        0xc62b | 0xc631 | 0xc632 | 0xc638 | 0xc652 => PRO,
        0xc633 => ENTERPRISE,
        0xc629 => PILOT_PRO,
        _ => &[],
    }
}

/// Returns the device's buttons in the program's order.
fn reorder_buttons(bytes: &[u8], layout: ButtonLayout) -> u32 {
    let raw = bytes.iter().take(4).enumerate().fold(0, |raw, (i, byte)| raw | u32::from(*byte) << (8 * i));
    match layout {
        [] => raw,
        _ => layout.iter().enumerate().fold(0, |ours, (i, bit)| ours | (raw >> bit & 1) << i),
    }
}

/// Specification of a SpaceMouse. The limits are those of a PHANTOM Omni: removal follows from the force, whether it
/// is felt or not.
fn spec() -> DeviceSpec {
    DeviceSpec {
        name: "SpaceMouse".into(),
        max_torque: 0.0,
        // The position is integrated here, so its resolution is that of the numbers.
        resolution: 0.001,
        workspace_half: WORKSPACE_HALF,
        ..DeviceSpec::phantom_omni()
    }
}

/// Driver of SpaceMouse devices.
pub struct SpaceMouseDriver;

impl Driver for SpaceMouseDriver {
    fn name(&self) -> &'static str {
        "spacemouse"
    }

    fn description(&self) -> &'static str {
        "3Dconnexion SpaceMouse, no force; the argument is its serial number"
    }

    fn hid_kinds(&self) -> &'static [HidMatch] {
        HID_MATCHES
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        Ok(hid::found_devices(hid::find(HID_MATCHES)?))
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let help =
            "plug it in, or switch it on and wait for a steady light; `typodont devices` lists what is connected";
        let plugged = hid::select(hid::find(HID_MATCHES)?, argument, "SpaceMouse", help)?;
        Ok(open_device(SpaceMouseProtocol::new(hid::open(&plugged)?, plugged.product)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cap() -> Cap {
        Cap { deflection: [0.0; 6], buttons: 0, layout: &[] }
    }

    #[test]
    fn short_and_long_reports_mean_the_same() {
        // Aim: wired units send two reports of 7 bytes, wireless ones a single one of 13. Method: both, in the
        // captured layouts.
        let (mut wired, mut wireless) = (cap(), cap());
        assert!(wired.parse_report(&[1, 0x5e, 0x01, 0x51, 0xff, 0, 0]));
        assert!(wired.parse_report(&[2, 0, 0, 0xaf, 0, 0, 0]));
        assert!(wireless.parse_report(&[1, 0x5e, 0x01, 0x51, 0xff, 0, 0, 0, 0, 0xaf, 0, 0, 0]));
        assert_eq!(wired.deflection, [1.0, -0.5, 0.0, 0.0, 0.5, 0.0]);
        assert_eq!(wired.deflection, wireless.deflection);
    }

    #[test]
    fn malformed_reports_change_nothing() {
        let mut cap = cap();
        assert!(cap.parse_report(&[1, 0xff, 0x7f, 0, 0, 0, 0]), "beyond the range, clamped");
        assert_eq!(cap.deflection[0], 1.0);
        for malformed in [&[1][..], &[1, 0], &[2, 1, 2, 3], &[3], &[1, 0, 0, 0, 0, 0, 0, 0]] {
            assert!(!cap.parse_report(malformed), "{malformed:?}");
        }
        assert!(cap.parse_report(&[0x17, 80]), "battery reports are ignored");
        assert_eq!((cap.deflection[0], cap.buttons), (1.0, 0));
    }

    #[test]
    fn each_product_has_its_main_button_first() {
        assert_eq!(reorder_buttons(&[0b01, 0], button_layout(0xc626)), 0b01);
        assert_eq!(reorder_buttons(&[0b10, 0], button_layout(0xc635)), 0b10);
        // SpaceMouse Pro: key 1 is bit 4 of the second byte, MENU bit 0 of the first, LOCK bit 2 of the fourth.
        assert_eq!(reorder_buttons(&[0, 0x10, 0, 0], button_layout(0xc62b)), 1);
        assert_eq!(reorder_buttons(&[1, 0, 0, 0], button_layout(0xc62b)), 1 << 4);
        assert_eq!(reorder_buttons(&[0, 0, 0, 4], button_layout(0xc62b)), 1 << 14);
        assert_eq!(reorder_buttons(&[0, 0, 2], button_layout(0xc629)), 1, "key 1 of a SpacePilot Pro");
    }

    #[test]
    fn half_the_deflection_is_an_eighth_of_the_speed() {
        let full = integrate(Pose::IDENTITY, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.01).position;
        let half = integrate(Pose::IDENTITY, [0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 0.01).position;
        assert!((full.x - SPEED * 0.01).abs() < 1e-5 && (half.x * 8.0 - full.x).abs() < 1e-5, "{full} {half}");
        let far = (0..1000).fold(Pose::IDENTITY, |at, _| integrate(at, [1.0; 6], MAX_STEP_TIME));
        assert_eq!(far.position, Vec3::new(60.0, -45.0, 35.0), "confined to the box");
        assert!(far.is_valid());
    }
}
