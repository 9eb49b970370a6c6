//! Fake Polhem that speaks lines over a pair of pseudo-terminals; there are none on Windows.

use crate::polhem::{Faults, handle_in_arm, in_arm, open, until};
use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use glam::DMat3;
use serial2::SerialPort;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use typodont_core::device::{Device, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_devices::Relay;
use typodont_devices::polhem::serial_arm::SerialArm;

pub struct SerialRig {
    hand: SharedHand,
    faults: Arc<Faults>,
}

impl SerialRig {
    pub fn new() -> SerialRig {
        SerialRig { hand: SharedHand::at_rest(0.0), faults: Arc::default() }
    }
}

impl Rig for SerialRig {
    fn name(&self) -> &'static str {
        "polhem:serial"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let (program, arm) = SerialPort::pair().map_err(|e| e.to_string())?;
        let (hand, faults) = (self.hand.clone(), self.faults.clone());
        crate::rig::spawn_device(move || speak(arm, &hand, &faults));
        Ok(Box::new(Relay::start(SerialArm::new(program).map_err(|e| e.to_string())?)))
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            force: true,
            torque: false,
            orientation: true,
            // Its only button sits on a stylus with a radio of its own.
            buttons: false,
            resolution: 0.001,
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

/// Speaks unasked until it hears the first record, then one record for each it hears, in two halves.
fn speak(mut arm: SerialPort, hand: &SharedHand, faults: &Faults) {
    arm.set_read_timeout(Duration::from_millis(1)).unwrap();
    let (mut heard, mut was_woken) = (Vec::new(), false);
    let (mut force, mut told_at, mut due) = (Vec3::ZERO, Instant::now(), Instant::now());
    let mut answers: VecDeque<(Instant, Vec<u8>)> = VecDeque::new();
    while !faults.is(Misbehaviour::Unplug) {
        // A pseudo-terminal without a program gives an error or nothing, a quiet one a time-out.
        let mut bytes = [0; 256];
        match arm.read(&mut bytes) {
            Ok(0) => break,
            Ok(n) => heard.extend_from_slice(&bytes[..n]),
            Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {}
            Err(_) => break,
        }
        let mut asked = u32::from(!was_woken);
        while heard.len() >= 64 {
            let record: Vec<u8> = heard.drain(..64).collect();
            if record[63] != b'\n' {
                heard.clear();
                break;
            }
            let text = std::str::from_utf8(&record).unwrap();
            let numbers: Vec<i32> = text.split_whitespace().map(|n| n.parse().unwrap()).collect();
            assert_eq!((numbers.len(), numbers[3]), (7, 2), "{text}");
            if !was_woken {
                assert_eq!(numbers[..3], [0; 3], "the first record wakes and does not push");
                (was_woken, asked) = (true, 0);
            }
            // Toward the user, right, up; mN.
            let [x, y, z] = [0, 1, 2].map(|i| numbers[i] as f32 / 1000.0);
            force = Vec3::new(y, z, x);
            told_at = Instant::now();
            asked += 1;
        }
        if told_at.elapsed() > Duration::from_millis(500) {
            force = Vec3::ZERO;
        }
        // It works at 1 kHz, however fast it is spoken to.
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        due = (due + Duration::from_millis(1)).max(Instant::now() - Duration::from_millis(5));
        let at = hand.turn(Wrench { force, ..Wrench::ZERO });
        let delay = if faults.is(Misbehaviour::Late) { Duration::from_millis(50) } else { Duration::ZERO };
        let line = if faults.is(Misbehaviour::Garbage) { vec![b'#'; 64] } else { line(&at) };
        answers.extend((0..asked).map(|_| (Instant::now() + delay, line.clone())));
        while let Some((_, mut answer)) = answers.pop_front_if(|(due, _)| *due <= Instant::now()) {
            if faults.drop_byte.swap(false, Ordering::AcqRel) {
                answer.remove(20);
            }
            let (first, second) = answer.split_at(23);
            if arm.write_all(first).is_err() || arm.write_all(second).is_err() {
                break;
            }
        }
    }
    hand.turn(Wrench::ZERO);
}

/// x y z of the arm in mm; the angles A and λ of a forearm that points along the handle, D, E of the wrist; a state.
///
/// Every turn without roll can be told by A and λ alone; what is left is D, about the shaft.
fn line(at: &Reading) -> Vec<u8> {
    let place = in_arm(at.pose.position) * 1000.0;
    let handle = handle_in_arm(at.pose.orientation);
    let shaft = handle.x_axis;
    let (a, lambda) = (shaft.y.atan2(shaft.x), shaft.z.atan2(shaft.x.hypot(shaft.y)));
    let fore = DMat3::from_rotation_z(a) * DMat3::from_rotation_y(-lambda);
    let rest = fore.transpose() * handle;
    let d = rest.y_axis.z.atan2(rest.y_axis.y);
    let text = format!("{:.3} {:.3} {:.3} {a:.4} {lambda:.4} {d:.4} 0.0000 0", place.x, place.y, place.z);
    let mut line = text.into_bytes();
    line.resize(63, b' ');
    line.push(b'\n');
    line
}

#[test]
fn an_arm_on_a_serial_port_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut SerialRig::new());
    })
}

#[test]
fn a_lost_byte_costs_a_moment_and_not_the_device() {
    crate::support::peace::in_real_time(|| {
        // Aim: after a byte is lost the two find each other again, in step. Method: lose one of the arm's bytes several times;
        // after each the readings follow the hand again.
        let mut rig = SerialRig::new();
        let mut device = open(&mut rig);
        until(&mut device, Wrench::ZERO, "it speaks", |reading, state| state.is_ready() && reading.pose.is_valid());
        for round in 1..=5 {
            rig.faults.drop_byte.store(true, Ordering::Release);
            let goal = Vec3::X * round as f32;
            rig.hand.reach(goal);
            until(&mut device, Wrench::ZERO, "it follows again", |reading, state| {
                state.is_ready() && reading.pose.position.distance(goal) < 0.2
            });
        }
        let push = Wrench { force: Vec3::Y * 0.5, ..Wrench::ZERO };
        until(&mut device, push, "it pushes again", |_, _| rig.hand.felt().force.distance(push.force) < 0.01);
    })
}
