//! 3Dconnexion SpaceMouse and its kin: six axes in, no force.
//!
//! Takes deflections of the cap. Gives a place and an orientation, which they move: the cap is a rate, not a place.
//! Never renders force: what the instrument meets is to be seen only.
//!
//! Layouts of the reports as published by spacenavd, PySpaceMouse and vrpn.

use super::hid::{self, Kind, Transport};
use super::{Beat, Device, Driver, Found, Gone, Output, Reading, Relay, Report, Spec, State, Trouble, UPRIGHT, Wire};
use crate::frame::{Pose, Quat, Vec3};
use std::time::{Duration, Instant};

/// Generic desktop page, multi-axis controller.
const MULTI_AXIS: Option<(u16, u16)> = Some((1, 8));

/// Logitech's products until 2013, then 3Dconnexion's own. CadMouse (c650 to c668) is a plain mouse and is not among them.
pub const KINDS: &[Kind] = &[
    Kind {
        vendor: 0x046d,
        products: &[0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625, 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640],
        usage: MULTI_AXIS,
    },
    Kind {
        vendor: 0x256f,
        products: &[0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633, 0xc635, 0xc636, 0xc638, 0xc63a, 0xc641, 0xc652],
        usage: MULTI_AXIS,
    },
];

/// Counts at full deflection. Some units go beyond, so they are cut off there.
const FULL: f32 = 350.0;

/// Speed at full deflection, mm/s: across a tooth in a quarter of a second. With the cubic response a third of the
/// deflection gives 1.5 mm/s, slow enough to cut by.
const SPEED: f32 = 40.0;

/// Turning at full deflection, rad/s: a quarter turn in a bit more than a second.
const TURN_SPEED: f32 = 1.4;

/// Half the box in which the place is kept, mm.
const WORKSPACE_HALF: Vec3 = Vec3::new(60.0, 45.0, 35.0);

/// How long one turn waits for a report. The cap reports every 8 to 16 ms; the place moves on in between.
const BEAT: Duration = Duration::from_millis(1);

/// The longest time that a deflection is carried on for, s: a machine that stalls must not throw the instrument.
const STRIDE_MAX: f32 = 0.02;

/// Reports read in one turn at most; a queue holds 64.
const REPORTS_MAX: usize = 64;

/// Malformed reports in a row after which it is no SpaceMouse. It sends 125 a second at most.
const MALFORMED_MAX: u32 = 50;

const TRANSLATION: u8 = 1;
const ROTATION: u8 = 2;
const BUTTONS: u8 = 3;
const LED: u8 = 4;

/// A SpaceMouse on a cable or a receiver.
pub struct SpaceMouse<T> {
    transport: T,
    spec: Spec,
    cap: Cap,
    place: Pose,
    moved_at: Option<Instant>,
    malformed: u32,
}

impl<T: Transport> SpaceMouse<T> {
    /// `product` says which button is where.
    pub fn new(mut transport: T, product: u16) -> SpaceMouse<T> {
        // A light that does not go on is no reason to refuse the device: some have none.
        let _ = transport.write(&[LED, 1]);
        let cap = Cap { deflection: [0.0; 6], buttons: 0, layout: layout(product) };
        let place = Pose { position: Vec3::ZERO, orientation: UPRIGHT };
        SpaceMouse { transport, spec: spec(), cap, place, moved_at: None, malformed: 0 }
    }
}

impl<T: Transport> Wire for SpaceMouse<T> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// A cap at rest says nothing, so the device keeps no beat.
    fn beat(&self) -> Beat {
        Beat::Ours
    }

    fn turn(&mut self, _told: &Output) -> Result<Option<Report>, Gone> {
        let mut report = [0; hid::REPORT_MAX];
        let mut wait = BEAT;
        // Every report counts, not the newest alone: translation, rotation and buttons come in reports of their own.
        for _ in 0..REPORTS_MAX {
            let length = self.transport.read(&mut report, wait)?;
            if length == 0 {
                break;
            }
            match self.cap.hear(&report[..length]) {
                true => self.malformed = 0,
                false => self.malformed += 1,
            }
            wait = Duration::ZERO;
        }
        if self.malformed > MALFORMED_MAX {
            return Err(Gone::Lost { why: "what it sends is not what a SpaceMouse sends; plug it in again", code: 0 });
        }
        let now = Instant::now();
        let passed = self.moved_at.replace(now).map_or(0.0, |at| now.duration_since(at).as_secs_f32());
        self.place = moved(self.place, self.cap.deflection, passed.min(STRIDE_MAX));
        let reading = Reading { pose: self.place, buttons: self.cap.buttons };
        Ok(Some(Report { reading, state: State::Ready }))
    }

    fn close(&mut self) {
        // Nobody is left to hear that the light did not go off.
        let _ = self.transport.write(&[LED, 0]);
    }
}

/// What the cap said last. It falls silent when it does not change: after a release it says zero three times.
#[derive(Clone, Debug)]
struct Cap {
    /// x y z, and rotations about them, -1 to 1, in the device's axes: right, toward the user, down.
    deflection: [f32; 6],
    buttons: u32,
    layout: &'static [u32],
}

impl Cap {
    /// Takes in a report; false if it is malformed. Reports of other kinds (battery, keys of an Enterprise) are none of ours.
    fn hear(&mut self, report: &[u8]) -> bool {
        match (report[0], report.len() - 1) {
            (TRANSLATION, 6) => self.deflection[..3].copy_from_slice(&axes(&report[1..])[..3]),
            (TRANSLATION, 12) => self.deflection = axes(&report[1..]),
            (ROTATION, 6) => self.deflection[3..].copy_from_slice(&axes(&report[1..])[..3]),
            (BUTTONS, 1..) => self.buttons = arranged(&report[1..], self.layout),
            (TRANSLATION | ROTATION | BUTTONS, _) => return false,
            _ => {}
        }
        true
    }
}

/// Up to six axes, little-endian, -1 to 1.
fn axes(bytes: &[u8]) -> [f32; 6] {
    let mut axes = [0.0; 6];
    for (axis, two) in axes.iter_mut().zip(bytes.chunks_exact(2)) {
        *axis = (f32::from(i16::from_le_bytes([two[0], two[1]])) / FULL).clamp(-1.0, 1.0);
    }
    axes
}

/// Where the place is after a while of deflection.
///
/// Cubic: fine near rest, where the instrument cuts, and quick at the stop; a cap that does not quite come back to zero
/// stays put.
fn moved(place: Pose, deflection: [f32; 6], seconds: f32) -> Pose {
    let [x, y, z, rx, ry, rz] = deflection.map(|d| d * d * d);
    // The device's z points down and its y toward the user.
    let (shift, turn) = (Vec3::new(x, -z, y), Vec3::new(rx, -rz, ry));
    let position = (place.position + shift * (SPEED * seconds)).clamp(-WORKSPACE_HALF, WORKSPACE_HALF);
    let turned = Quat::from_scaled_axis(turn * (TURN_SPEED * seconds)) * place.orientation;
    Pose { position, orientation: turned.normalize() }
}

/// For each button of ours, bit 0 first, the device's bit. Empty: as the device counts.
type Layout = &'static [u32];

/// Keys 1 to 4, then MENU FIT TOP REAR FRONT ROLL ESC ALT SHIFT CTRL LOCK: the keys one works with come first.
const PRO: Layout = &[12, 13, 14, 15, 0, 1, 2, 4, 5, 8, 22, 23, 24, 25, 26];

/// Keys 1 to 12, then as PRO.
const ENTERPRISE: Layout = &[12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 0, 1, 2, 4, 5, 8, 22, 23, 24, 25, 26];

/// Keys 1 to 5, then MENU FIT TOP FRONT ROLL ESC ALT SHIFT CTRL LOCK.
const PILOT_PRO: Layout = &[17, 18, 14, 15, 16, 0, 1, 2, 5, 8, 22, 23, 24, 25, 26];

/// Which button is where, after PySpaceMouse's table of devices.
fn layout(product: u16) -> Layout {
    match product {
        0xc62b | 0xc631 | 0xc632 | 0xc638 | 0xc652 => PRO,
        0xc633 => ENTERPRISE,
        0xc629 => PILOT_PRO,
        _ => &[],
    }
}

/// The device's buttons in our order.
fn arranged(bytes: &[u8], layout: Layout) -> u32 {
    let raw = bytes.iter().take(4).enumerate().fold(0, |raw, (i, byte)| raw | u32::from(*byte) << (8 * i));
    match layout {
        [] => raw,
        _ => layout.iter().enumerate().fold(0, |ours, (i, bit)| ours | (raw >> bit & 1) << i),
    }
}

/// The limits are those of a PHANTOM Omni: what is cut follows from the force, whether it is felt or not.
fn spec() -> Spec {
    Spec {
        name: "SpaceMouse".into(),
        max_torque: 0.0,
        // At rest it counts nothing: the place is ours, and as fine as a number.
        resolution: 0.001,
        workspace_half: WORKSPACE_HALF,
        ..Spec::phantom_omni()
    }
}

/// `--device spacemouse`.
pub struct SpaceMouseDriver;

impl Driver for SpaceMouseDriver {
    fn name(&self) -> &'static str {
        "spacemouse"
    }

    fn about(&self) -> &'static str {
        "3Dconnexion SpaceMouse, no force; after the colon a serial number, if there are several"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        Ok(hid::listed(hid::find(KINDS)?))
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let help =
            "plug it in, or switch it on and wait until its light is steady; `typodont devices` lists what is there";
        let plugged = hid::chosen(hid::find(KINDS)?, argument, "SpaceMouse", help)?;
        Ok(Box::new(Relay::start(SpaceMouse::new(hid::open(&plugged)?, plugged.product))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cap() -> Cap {
        Cap { deflection: [0.0; 6], buttons: 0, layout: &[] }
    }

    #[test]
    fn short_and_long_reports_say_the_same() {
        // Aim: cabled units send 7 bytes twice, wireless ones 13 at once. Method: both, as captured layouts have them.
        let (mut cabled, mut wireless) = (cap(), cap());
        assert!(cabled.hear(&[1, 0x5e, 0x01, 0x51, 0xff, 0, 0]));
        assert!(cabled.hear(&[2, 0, 0, 0xaf, 0, 0, 0]));
        assert!(wireless.hear(&[1, 0x5e, 0x01, 0x51, 0xff, 0, 0, 0, 0, 0xaf, 0, 0, 0]));
        assert_eq!(cabled.deflection, [1.0, -0.5, 0.0, 0.0, 0.5, 0.0]);
        assert_eq!(cabled.deflection, wireless.deflection);
    }

    #[test]
    fn what_is_no_report_changes_nothing() {
        let mut cap = cap();
        assert!(cap.hear(&[1, 0xff, 0x7f, 0, 0, 0, 0]), "beyond the range, cut off");
        assert_eq!(cap.deflection[0], 1.0);
        for malformed in [&[1][..], &[1, 0], &[2, 1, 2, 3], &[3], &[1, 0, 0, 0, 0, 0, 0, 0]] {
            assert!(!cap.hear(malformed), "{malformed:?}");
        }
        assert!(cap.hear(&[0x17, 80]), "the battery is none of ours");
        assert_eq!((cap.deflection[0], cap.buttons), (1.0, 0));
    }

    #[test]
    fn each_product_has_its_main_button_first() {
        assert_eq!(arranged(&[0b01, 0], layout(0xc626)), 0b01);
        assert_eq!(arranged(&[0b10, 0], layout(0xc635)), 0b10);
        // SpaceMouse Pro: key 1 is bit 4 of the second byte, MENU bit 0 of the first, LOCK bit 2 of the fourth.
        assert_eq!(arranged(&[0, 0x10, 0, 0], layout(0xc62b)), 1);
        assert_eq!(arranged(&[1, 0, 0, 0], layout(0xc62b)), 1 << 4);
        assert_eq!(arranged(&[0, 0, 0, 4], layout(0xc62b)), 1 << 14);
        assert_eq!(arranged(&[0, 0, 2], layout(0xc629)), 1, "key 1 of a SpacePilot Pro");
    }

    #[test]
    fn half_the_deflection_is_an_eighth_of_the_speed() {
        let full = moved(Pose::IDENTITY, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.01).position;
        let half = moved(Pose::IDENTITY, [0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 0.01).position;
        assert!((full.x - SPEED * 0.01).abs() < 1e-5 && (half.x * 8.0 - full.x).abs() < 1e-5, "{full} {half}");
        let far = (0..1000).fold(Pose::IDENTITY, |at, _| moved(at, [1.0; 6], STRIDE_MAX));
        assert_eq!(far.position, Vec3::new(60.0, -45.0, 35.0), "the box holds it");
        assert!(far.is_sound());
    }
}
