//! Fake Polhem: an arm of encoders and motors on HID.
//!
//! Its geometry is worked out the other way round than the driver's: positions are inverted numerically, and what the
//! hand feels follows from the currents by virtual work.

use crate::pipe::{DeviceEnd, cable};
use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use glam::{DMat3, DQuat, DVec3};
use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceState, Reading, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::Relay;
use typodont_devices::hid::Transport;
use typodont_devices::polhem::geometry::ARM_CONFIGS;
use typodont_devices::polhem::hid_arm::HidArm;

const PATIENCE: Duration = Duration::from_secs(20);

/// Faults of the fake device, and values that tests read from it.
#[derive(Default)]
pub struct Faults {
    /// `Misbehaviour as u32 + 1`; 0 for nothing.
    pub wrong: AtomicU32,
    /// True if the device has lost the position of its encoders.
    is_lost: AtomicBool,
    /// The last preset of the third encoder.
    preset: AtomicI32,
    /// Once: the next record on the serial port lacks a byte.
    pub drop_byte: AtomicBool,
}

impl Faults {
    pub fn is(&self, how: Misbehaviour) -> bool {
        self.wrong.load(Ordering::Acquire) == how as u32 + 1
    }
}

/// Polhem v1, from its published geometry.
struct Built {
    upper: f64,
    fore: f64,
    base: f64,
    origin: DVec3,
    /// A turn of the body for a turn of its motor.
    ratio: DVec3,
    torque_constant: f64,
    counts: f64,
    wrist_counts: f64,
}

const POLHEM: Built = Built {
    upper: 0.174,
    fore: 0.133,
    base: 0.058,
    origin: DVec3::new(0.140, 0.0, 0.100),
    ratio: DVec3::new(-0.010 / 0.180, -0.010 / 0.100, -0.010 / 0.100),
    torque_constant: 0.0538,
    counts: 2000.0,
    wrist_counts: 1024.0,
};

impl Built {
    fn tip(&self, angles: DVec3) -> DVec3 {
        let out = self.upper * angles.y.sin() + self.fore * angles.z.sin();
        let up = self.base + self.upper * angles.y.cos() - self.fore * angles.z.cos();
        DVec3::new(angles.x.cos() * out, angles.x.sin() * out, up) - self.origin
    }

    /// Jacobian of the tip with respect to the joints, by central differences.
    fn slopes(&self, angles: DVec3) -> DMat3 {
        let slope = |axis: DVec3| (self.tip(angles + axis * 1e-6) - self.tip(angles - axis * 1e-6)) / 2e-6;
        DMat3::from_cols(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z))
    }

    /// Joint angles that bring the tip to a place, computed from nearby angles.
    fn reach(&self, place: DVec3, near: DVec3) -> DVec3 {
        (0..20).fold(near, |at, _| at + self.slopes(at).inverse() * (place - self.tip(at)))
    }

    /// Force at the tip for motor currents in A.
    fn force(&self, angles: DVec3, currents: DVec3) -> DVec3 {
        let torques = currents * self.torque_constant / self.ratio;
        self.slopes(angles).transpose().inverse() * torques
    }

    /// Encoder counts for joint angles and the handle's orientation; those of the wrist are wired f, e, d.
    fn encoders(&self, angles: DVec3, handle: DMat3) -> [i16; 6] {
        let joints = (angles / self.ratio / TAU * self.counts).round();
        let fore = DMat3::from_rotation_z(angles.x) * DMat3::from_rotation_y(FRAC_PI_2 - angles.z);
        let wrist = fore.transpose() * handle;
        let at = |row: usize, column: usize| wrist.col(column)[row];
        let e = at(0, 0).clamp(-1.0, 1.0).acos();
        let (d, f) = (at(1, 0).atan2(-at(2, 0)), at(0, 1).atan2(at(0, 2)));
        let counts = |angle: f64| (angle / TAU * self.wrist_counts).round() as i16;
        [joints.x as i16, joints.y as i16, joints.z as i16, counts(f), counts(e), counts(d)]
    }
}

/// World space, mm, to the arm's, m: toward the user, right, up.
pub fn in_arm(v: Vec3) -> DVec3 {
    DVec3::new(f64::from(v.z), f64::from(v.x), f64::from(v.y)) / 1000.0
}

fn in_world(v: DVec3) -> Vec3 {
    Vec3::new(v.y as f32, v.z as f32, v.x as f32)
}

/// The handle's x, y, z are the world's z, x, y of its own: its shaft is along the arm's x.
pub fn handle_in_arm(q: Quat) -> DMat3 {
    let world = DMat3::from_quat(DQuat::from_xyzw(q.x.into(), q.y.into(), q.z.into(), q.w.into()).normalize());
    let axis = |v: DVec3| DVec3::new(v.z, v.x, v.y);
    DMat3::from_cols(axis(world.z_axis), axis(world.x_axis), axis(world.y_axis))
}

pub struct HidRig {
    hand: SharedHand,
    faults: Arc<Faults>,
}

impl HidRig {
    pub fn new() -> HidRig {
        HidRig { hand: SharedHand::at_rest(0.0), faults: Arc::default() }
    }
}

impl Rig for HidRig {
    fn name(&self) -> &'static str {
        "polhem:hid"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let (program, device) = cable();
        let (hand, faults) = (self.hand.clone(), self.faults.clone());
        crate::rig::spawn_device(move || firmware(device, &hand, &faults));
        let config = ARM_CONFIGS.iter().find(|c| c.name == "polhem_v1").unwrap();
        Ok(Box::new(Relay::start(HidArm::new(program, config, 65))))
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            force: true,
            torque: false,
            orientation: true,
            buttons: true,
            resolution: 0.06,
            is_rate: false,
            misbehaviours: &[Misbehaviour::Unplug, Misbehaviour::Garbage, Misbehaviour::Late],
        }
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        self.faults.wrong.store(how as u32 + 1, Ordering::Release);
    }

    fn recover(&mut self) {
        self.faults.wrong.store(0, Ordering::Release);
    }
}

/// Answers each report with one; lets go half a second after the last.
fn firmware(device: DeviceEnd, hand: &SharedHand, faults: &Faults) {
    let mut device = Some(device);
    let mut joints = POLHEM.reach(DVec3::ZERO, DVec3::new(0.0, 0.2, 1.5));
    let (mut currents, mut told_at) = (DVec3::ZERO, Instant::now());
    let mut answers: VecDeque<(Instant, Vec<u8>)> = VecDeque::new();
    let mut noise = 0x2545_f491_4f6c_dd1d_u64;
    loop {
        std::thread::sleep(Duration::from_millis(1));
        if faults.is(Misbehaviour::Unplug) {
            device = None;
        }
        let mut asked = 0;
        while let Some(end) = &device {
            match end.try_receive() {
                Ok(Some(report)) => {
                    assert_eq!((report.len(), report[0]), (65, 0), "64 bytes behind the id");
                    let word = |i: usize| i16::from_le_bytes([report[1 + 2 * i], report[2 + 2 * i]]);
                    match word(3) {
                        0 => {
                            let milliamperes = [word(0), word(1), word(2)];
                            assert!(milliamperes.iter().all(|n| n.abs() <= 1999), "{milliamperes:?}");
                            currents = DVec3::from_array(milliamperes.map(|n| f64::from(n) / 1000.0));
                        }
                        1 => {
                            faults.preset.store(word(6).into(), Ordering::Release);
                            faults.is_lost.store(false, Ordering::Release);
                        }
                        other => panic!("command {other}"),
                    }
                    told_at = Instant::now();
                    asked += 1;
                }
                Ok(None) => break,
                Err(()) => device = None,
            }
        }
        if told_at.elapsed() > Duration::from_millis(500) {
            currents = DVec3::ZERO;
        }
        let force = POLHEM.force(joints, currents);
        let at: Reading = hand.turn(Wrench { force: in_world(force), ..Wrench::ZERO });
        joints = POLHEM.reach(in_arm(at.pose.position), joints);
        let mut words = POLHEM.encoders(joints, handle_in_arm(at.pose.orientation));
        words[3] += if at.buttons & 1 != 0 { 10_000 } else { 0 };
        let info = i16::from(faults.is_lost.load(Ordering::Acquire));
        let mut report: Vec<u8> = words.into_iter().chain([info]).flat_map(i16::to_le_bytes).collect();
        report.resize(64, 0);
        if faults.is(Misbehaviour::Garbage) {
            report.fill_with(|| {
                noise ^= noise << 13;
                noise ^= noise >> 7;
                noise ^= noise << 17;
                noise as u8
            });
        }
        let delay = if faults.is(Misbehaviour::Late) { Duration::from_millis(50) } else { Duration::ZERO };
        answers.extend((0..asked).map(|_| (Instant::now() + delay, report.clone())));
        while let Some((_, answer)) = answers.pop_front_if(|(due, _)| *due <= Instant::now()) {
            if let Some(end) = &device {
                end.send(&answer);
            }
        }
        if device.is_none() && currents == DVec3::ZERO {
            hand.turn(Wrench::ZERO);
            return;
        }
    }
}

#[test]
fn an_arm_on_hid_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut HidRig::new());
    })
}

pub fn open(rig: &mut dyn Rig) -> Box<dyn Device + Send> {
    rig.open().unwrap()
}

/// Exchanges until a state or a reading holds.
pub fn until(
    device: &mut Box<dyn Device + Send>,
    told: Wrench,
    what: &str,
    holds: impl Fn(&Reading, DeviceState) -> bool,
) {
    let start = Instant::now();
    loop {
        std::thread::sleep(Duration::from_millis(1));
        let reading = device.exchange(&told).unwrap_or_else(|gone| panic!("{what}: {gone}"));
        if holds(&reading, device.state()) {
            return;
        }
        assert!(start.elapsed() < PATIENCE, "{what}: {}", device.state());
    }
}

#[test]
fn a_silent_arm_is_woken_by_a_report_of_zeros() {
    crate::support::peace::in_real_time(|| {
        // Aim: the arm says nothing before it is spoken to, and the first word to it is no force. Method: the bare cable.
        let (mut program, device) = cable();
        let mut report = [0; 65];
        assert_eq!(program.read(&mut report, Duration::from_millis(20)), Ok(0));
        let config = ARM_CONFIGS.iter().find(|c| c.name == "woodenhaptics_v2015").unwrap();
        let mut relay = Relay::start(HidArm::new(program, config, 65));
        // The program pushes at once; the arm has not said where it is.
        let _ = relay.exchange(&Wrench { force: Vec3::X * 3.0, ..Wrench::ZERO });
        assert_eq!(device.receive(PATIENCE), Some(vec![0; 65]));
    })
}

#[test]
fn an_arm_that_is_lost_is_calibrated_by_a_person() {
    crate::support::peace::in_real_time(|| {
        // Aim: a visible state, no force while in it, the preset when the button is pressed, and not before.
        let mut rig = HidRig::new();
        rig.faults.is_lost.store(true, Ordering::Release);
        let mut device = open(&mut rig);
        let push = Wrench { force: Vec3::Y, ..Wrench::ZERO };
        until(
            &mut device,
            push,
            "it asks",
            |_, state| matches!(state, DeviceState::Calibrate { how } if how.contains("button")),
        );
        for _ in 0..50 {
            std::thread::sleep(Duration::from_millis(1));
            device.exchange(&push).unwrap();
        }
        assert_eq!((rig.faults.preset.load(Ordering::Acquire), rig.hand.most_felt()), (0, 0.0));
        rig.hand.press_buttons(1);
        until(&mut device, Wrench::ZERO, "it is told", |_, state| state == DeviceState::Ready);
        assert_eq!(rig.faults.preset.load(Ordering::Acquire), -5000);
    })
}

#[test]
fn the_wrist_is_read_in_its_own_order() {
    crate::support::peace::in_real_time(|| {
        // Aim: rolling the handle about its shaft is a roll, and the button in the same encoder does not turn it. Method: roll
        // with the button down; the shaft stays where it is.
        let mut rig = HidRig::new();
        let mut device = open(&mut rig);
        let tilted = Quat::from_rotation_x(-0.4);
        let rolled = tilted * Quat::from_rotation_z(0.8);
        rig.hand.turn_to(rolled);
        rig.hand.press_buttons(1);
        until(&mut device, Wrench::ZERO, "rolled", |reading, _| {
            reading.buttons == 1 && reading.pose.is_valid() && reading.pose.orientation.angle_between(rolled) < 0.02
        });
    })
}
