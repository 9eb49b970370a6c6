//! A fake open handle: the firmware that `content/devices/open-handle.md` asks for, on an in-memory cable.

use crate::pipe::{DeviceEnd, cable};
use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::Relay;
use typodont_devices::open_handle::OpenHandleProtocol;

const PATIENCE: Duration = Duration::from_secs(20);

pub struct Rigged {
    hand: SharedHand,
    pub faults: Arc<Faults>,
}

#[derive(Default)]
pub struct Faults {
    wrong: AtomicU32,
    /// A state that the handle starts in instead of 3.
    state: AtomicU8,
}

impl Faults {
    fn is(&self, how: Misbehaviour) -> bool {
        self.wrong.load(Ordering::Acquire) == how as u32 + 1
    }
}

impl Rigged {
    pub fn new() -> Rigged {
        let rigged = Rigged { hand: SharedHand::at_rest(0.0), faults: Arc::default() };
        rigged.faults.state.store(3, Ordering::Release);
        rigged
    }
}

impl Rig for Rigged {
    fn name(&self) -> &'static str {
        "open-handle"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let (program, device) = cable();
        let (hand, faults) = (self.hand.clone(), self.faults.clone());
        crate::rig::spawn_device(move || firmware(device, &hand, &faults));
        Ok(Box::new(Relay::start(OpenHandleProtocol::handshake(program).map_err(|trouble| trouble.to_string())?)))
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            force: true,
            torque: true,
            orientation: true,
            buttons: true,
            resolution: 0.02,
            is_rate: false,
            misbehaviours: &[
                Misbehaviour::Unplug,
                Misbehaviour::Garbage,
                Misbehaviour::Late,
                Misbehaviour::OverSpeed,
                Misbehaviour::WarmMotors,
            ],
        }
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        self.faults.wrong.store(how as u32 + 1, Ordering::Release);
    }

    fn recover(&mut self) {
        self.faults.wrong.store(0, Ordering::Release);
    }
}

/// CRC-32 as the document has it, bit by bit.
fn checksum(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 != 0 { sum >> 1 ^ 0xedb8_8320 } else { sum >> 1 })
    })
}

fn sealed(kind: u8, number: u16, body: &[u8]) -> Vec<u8> {
    let mut report = [&b"TH"[..], &[1, kind], &number.to_le_bytes(), body].concat();
    report.resize(60, 0);
    report.extend(checksum(&report).to_le_bytes());
    report
}

/// 5 N, 1.5 N, 50 N·mm, 1.5 N/mm, 5 N·s/m, 0.02 mm, 60 45 30 mm, 60 g; force, torque and orientation.
fn description() -> Vec<u8> {
    let numbers: [u16; 10] = [5000, 1500, 500, 1500, 500, 200, 600, 450, 300, 60];
    let mut body: Vec<u8> = numbers.into_iter().flat_map(u16::to_le_bytes).collect();
    body.extend([0b111, 0]);
    body.extend(b"School handle");
    sealed(2, 0, &body)
}

/// Runs a handle until its cable is pulled.
pub fn firmware(device: DeviceEnd, hand: &SharedHand, faults: &Faults) {
    let (mut number, mut obeyed) = (0u16, 0u16);
    let mut order = Wrench::ZERO;
    let mut lives_until = Instant::now();
    let mut reports: VecDeque<(Instant, Vec<u8>)> = VecDeque::new();
    while !faults.is(Misbehaviour::Unplug) {
        std::thread::sleep(Duration::from_millis(1));
        while let Some(report) = match device.try_receive() {
            Ok(report) => report,
            Err(()) => {
                // Nobody is there: the last order lives on until its life is over.
                std::thread::sleep(lives_until.saturating_duration_since(Instant::now()));
                hand.turn(Wrench::ZERO);
                return;
            }
        } {
            assert_eq!((report.len(), &report[..4]), (65, &[0, b'T', b'O', 1][..]));
            let bytes = &report[1..];
            assert_eq!(bytes[60..], checksum(&bytes[..60]).to_le_bytes());
            let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
            let float = |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
            match bytes[3] {
                1 => {
                    obeyed = half(4);
                    let force = Vec3::new(float(8), float(12), float(16));
                    let torque = Vec3::new(float(20), float(24), float(28));
                    assert!(force.is_finite() && torque.is_finite());
                    assert!(half(32) > 0 && half(32) <= 100, "an order lives for {} ms", half(32));
                    order = Wrench { force: force.clamp_length_max(5.0), torque: torque.clamp_length_max(50.0) };
                    lives_until = Instant::now() + Duration::from_millis(half(32).into());
                }
                2 => {
                    (obeyed, order) = (0, Wrench::ZERO);
                    device.send(&description());
                }
                other => panic!("kind {other}"),
            }
        }
        let (state, cause) = match () {
            _ if faults.is(Misbehaviour::OverSpeed) => (4, 3),
            _ if faults.is(Misbehaviour::WarmMotors) => (4, 2),
            _ => (faults.state.load(Ordering::Acquire), 0),
        };
        let may_push = state == 3 && Instant::now() < lives_until;
        let at = hand.turn(if may_push { order } else { Wrench::ZERO });
        number = number.wrapping_add(1);
        let mut body = obeyed.to_le_bytes().to_vec();
        body.extend([state, cause, 0, 0]);
        body.extend(at.buttons.to_le_bytes());
        // Steps of 0.02 mm, told in 0.1 µm.
        let position = at.pose.position.to_array().map(|mm| (mm / 0.02).round() as i32 * 200);
        body.extend(position.into_iter().flat_map(i32::to_le_bytes));
        let turned = at.pose.orientation.to_array().map(|part| (part * 32767.0).round() as i16);
        body.extend(turned.into_iter().flat_map(i16::to_le_bytes));
        let mut report = sealed(1, number, &body);
        if faults.is(Misbehaviour::Garbage) {
            // One bit, somewhere else each time.
            report[usize::from(number) % 64] ^= 1 << (number % 8);
        }
        let delay = if faults.is(Misbehaviour::Late) { Duration::from_millis(50) } else { Duration::ZERO };
        reports.push_back((Instant::now() + delay, report));
        while let Some((_, report)) = reports.pop_front_if(|(due, _)| *due <= Instant::now()) {
            device.send(&report);
        }
    }
    hand.turn(Wrench::ZERO);
}

#[test]
fn an_open_handle_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Rigged::new());
    })
}

#[test]
fn a_handle_says_what_it_is_and_what_it_waits_for() {
    crate::support::peace::in_real_time(|| {
        // Aim: the description becomes the device's spec, and each state is told as it is. Method: a handle in each state.
        let mut rig = Rigged::new();
        for (state, word) in [(0, "starting"), (1, "press its button"), (2, "hands off"), (3, "ready"), (9, "newer")] {
            rig.faults.state.store(state, Ordering::Release);
            let mut device = rig.open().unwrap();
            let spec = device.spec();
            assert_eq!((spec.name.as_str(), spec.max_force, spec.max_torque), ("School handle", 5.0, 50.0));
            assert_eq!((spec.max_stiffness, spec.resolution), (1.5, 0.02));
            assert_eq!((spec.workspace_half, spec.apparent_mass), (Vec3::new(60.0, 45.0, 30.0), 0.06));
            let (start, push) = (Instant::now(), Wrench { force: Vec3::X, ..Wrench::ZERO });
            rig.hand.most_felt();
            while !device.state().to_string().contains(word) {
                std::thread::sleep(Duration::from_millis(1));
                device.exchange(&push).unwrap();
                assert!(start.elapsed() < PATIENCE, "state {state}: {}", device.state());
            }
            if state != 3 {
                assert_eq!(rig.hand.most_felt(), 0.0, "state {state}");
            }
        }
    })
}

#[test]
fn another_teensy_is_told_from_a_handle() {
    // Aim: what does not introduce itself is refused in words. Method: a Teensy that sends its own 64 bytes.
    let (program, device) = cable();
    let other = std::thread::spawn(move || {
        while device.try_receive().is_ok() {
            device.send(&[7; 64]);
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let trouble = OpenHandleProtocol::handshake(program).err().expect("it is no handle");
    assert!(trouble.help.contains("open-handle.md"), "{trouble}");
    other.join().unwrap();
}

#[test]
fn the_example_in_the_document_is_true() {
    crate::support::peace::in_real_time(|| {
        // Aim: whoever builds a handle can trust the example. Method: the bytes of the document are what a handle at that place
        // sends, and the driver reads from them what the document says.
        let document = include_str!("../../content/devices/open-handle.md");
        let example = |title: &str| -> Vec<u8> {
            let text = document.split(title).nth(1).and_then(|after| after.split("```").nth(1)).unwrap();
            let words = text.split_whitespace().filter(|w| w.len() == 2);
            words.map(|w| u8::from_str_radix(w, 16).unwrap()).collect()
        };
        let (state, spec) = (example("### Example: a state"), example("### Example: a description"));
        assert_eq!(spec, description());
        for report in [&state, &spec] {
            assert_eq!((report.len(), &report[60..]), (64, &checksum(&report[..60]).to_le_bytes()[..]));
        }
        let (program, device) = cable();
        let handle = std::thread::spawn(move || {
            let mut number = 0u16;
            while let Ok(report) = device.try_receive() {
                match report {
                    Some(report) if report[4] == 2 => device.send(&spec),
                    _ => {
                        // The same report with a number of its own each time.
                        number = number.wrapping_add(1);
                        let mut next = state.clone();
                        next[4..6].copy_from_slice(&number.to_le_bytes());
                        let sum = checksum(&next[..60]);
                        next[60..].copy_from_slice(&sum.to_le_bytes());
                        device.send(&next);
                    }
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        let mut relay = Relay::start(OpenHandleProtocol::handshake(program).unwrap());
        let start = Instant::now();
        let reading = loop {
            std::thread::sleep(Duration::from_millis(1));
            let reading = relay.exchange(&Wrench::ZERO).unwrap();
            if reading.pose.is_valid() {
                break reading;
            }
            assert!(start.elapsed() < PATIENCE);
        };
        assert!(reading.pose.position.distance(Vec3::new(12.5, -3.2, 0.75)) < 1e-4, "{reading:?}");
        assert!(reading.pose.orientation.angle_between(UPRIGHT) < 1e-3);
        assert!(reading.pose.orientation.angle_between(Quat::IDENTITY) > 1.5);
        assert_eq!(reading.buttons, 1);
        drop(relay);
        handle.join().unwrap();
    })
}
