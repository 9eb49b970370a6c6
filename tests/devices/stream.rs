//! A tracker, faked: a thread that sends the hand's pose over UDP about a thousand times a second.

use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use std::net::UdpSocket;
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceState, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::driver_by_name;

pub struct Stream {
    port: u16,
    hand: SharedHand,
    misbehaviour: Arc<Mutex<Option<Misbehaviour>>>,
    stop: Arc<AtomicBool>,
    sending: Option<JoinHandle<()>>,
}

impl Stream {
    pub fn plug_in() -> Stream {
        let port = free_port();
        let hand = SharedHand::at_rest(0.01);
        let misbehaviour = Arc::new(Mutex::new(None));
        let stop = Arc::new(AtomicBool::new(false));
        let sending = {
            let (hand, misbehaviour, stop) = (hand.clone(), misbehaviour.clone(), stop.clone());
            crate::rig::spawn_device(move || send(port, &hand, &misbehaviour, &stop))
        };
        Stream { port, hand, misbehaviour, stop, sending: Some(sending) }
    }
}

/// A port that nobody had a moment ago, below those that systems give to whoever asks for any.
fn free_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = 20_000 + (std::process::id() % 100) as u16 * 100;
    let ports = std::iter::repeat_with(|| first + NEXT.fetch_add(1, Ordering::Relaxed) % 100).take(100);
    ports.into_iter().find(|port| UdpSocket::bind(("127.0.0.1", *port)).is_ok()).unwrap()
}

fn send(port: u16, hand: &SharedHand, misbehaviour: &Mutex<Option<Misbehaviour>>, stop: &AtomicBool) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let start = Instant::now();
    while !stop.load(Ordering::Acquire) {
        let reading = hand.turn(Wrench::ZERO);
        let text = line(start.elapsed().as_secs_f64(), &reading);
        let text = match *misbehaviour.lock().unwrap() {
            None => Some(text),
            Some(Misbehaviour::Garbage) => Some(text.replace("position_mm", "position_inch")),
            Some(_) => None,
        };
        // While nobody listens the system may refuse; the next pose comes anyway.
        let _ = text.map(|text| socket.send_to(text.as_bytes(), ("127.0.0.1", port)));
        thread::sleep(Duration::from_millis(1));
    }
}

fn line(t_s: f64, reading: &Reading) -> String {
    let (Vec3 { x, y, z }, q) = (reading.pose.position, reading.pose.orientation);
    let buttons = reading.buttons;
    format!(
        r#"{{"t_s": {t_s}, "position_mm": [{x}, {y}, {z}], "orientation_xyzw": [{}, {}, {}, {}], "buttons": {buttons}}}"#,
        q.x, q.y, q.z, q.w
    )
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        let _ = self.sending.take().unwrap().join();
    }
}

impl Rig for Stream {
    fn name(&self) -> &'static str {
        "stream"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        driver_by_name("stream").unwrap().open(Some(&format!("127.0.0.1:{}", self.port))).map_err(|t| t.to_string())
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            force: false,
            torque: false,
            orientation: true,
            buttons: true,
            resolution: 0.01,
            is_rate: false,
            misbehaviours: &[Misbehaviour::Unplug, Misbehaviour::Garbage],
        }
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        *self.misbehaviour.lock().unwrap() = Some(how);
    }

    fn recover(&mut self) {
        *self.misbehaviour.lock().unwrap() = None;
    }
}

/// Long enough for a loaded machine; nothing here takes a hundredth of it.
const PATIENCE: Duration = Duration::from_secs(20);

fn beat_until(device: &mut dyn Device, mut holds: impl FnMut(DeviceState, Result<Reading, DeviceError>) -> bool) {
    let until = Instant::now() + PATIENCE;
    loop {
        let reading = device.exchange(&Wrench::ZERO);
        if holds(device.state(), reading) {
            return;
        }
        assert!(Instant::now() < until, "waited in vain; the device is {}, and {reading:?}", device.state());
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_stream_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Stream::plug_in());
    })
}

#[test]
fn a_pose_sent_is_a_pose_read() {
    crate::support::peace::in_real_time(|| {
        let mut rig = Stream::plug_in();
        let turned = Quat::from_xyzw(0.5, -0.5, 0.5, 0.5);
        let goal = Vec3::new(-12.0, 7.0, 3.5);
        rig.hand().reach(goal);
        rig.hand().turn_to(turned);
        rig.hand().press_buttons(2);
        let mut device = rig.open().unwrap();
        beat_until(&mut device, |state, reading| {
            state.is_ready()
                && reading.is_ok_and(|r| {
                    (r.pose.position - goal).length() < 0.05
                        && r.pose.orientation.angle_between(turned) < 1e-3
                        && r.buttons == 2
                })
        });
    })
}

#[test]
fn a_stream_waits_for_its_sender_and_says_when_it_stops() {
    crate::support::peace::in_real_time(|| {
        // Aim: before the first pose the stream waits in sight, as long as it takes; a sender that stops or sends something else
        // ends it with a reason; opened again it works.
        let mut rig = Stream::plug_in();
        for (how, reason) in [(Misbehaviour::Unplug, "silent"), (Misbehaviour::Garbage, "stream.md")] {
            rig.misbehave(Misbehaviour::Unplug);
            let mut device = rig.open().unwrap();
            beat_until(&mut device, |state, _| matches!(state, DeviceState::Calibrate { .. }));
            rig.recover();
            beat_until(&mut device, |state, reading| state.is_ready() && reading.is_ok_and(|r| r.pose.is_valid()));
            rig.misbehave(how);
            beat_until(&mut device, |_, reading| reading.is_err_and(|gone| gone.to_string().contains(reason)));
        }
    })
}

#[test]
fn the_newest_pose_wins_and_older_ones_are_dropped() {
    crate::support::peace::in_real_time(|| {
        // Aim: order is the sender's, not the network's. Method: three datagrams, the last of them the oldest but one; the pose
        // stays at the newest.
        let port = free_port();
        let mut device = driver_by_name("stream").unwrap().open(Some(&format!("127.0.0.1:{port}"))).unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        let poses = [(1.0, 1.0), (1.002, 3.0), (1.001, 2.0)];
        let send = || {
            for (t_s, x) in poses {
                let text = format!(r#"{{"t_s": {t_s}, "position_mm": [{x}, 0, 0]}}"#);
                sender.send_to(text.as_bytes(), ("127.0.0.1", port)).unwrap();
            }
        };
        send();
        let mut last = Reading::ABSENT;
        beat_until(&mut device, |_, reading| {
            last = reading.unwrap();
            last.pose.position.x == 3.0
        });
        assert_eq!(last.pose.orientation, UPRIGHT);
        // The same again, all of it old by now: nothing of it is shown before silence lets go.
        send();
        beat_until(&mut device, |_, reading| {
            let shown = reading.unwrap_or(Reading::ABSENT).pose;
            assert!(!shown.is_valid() || shown.position.x == 3.0, "{shown:?}");
            !shown.is_valid()
        });
    })
}

#[test]
fn the_manuals_sender_is_understood() {
    crate::support::peace::in_real_time(|| {
        // Aim: what `content/devices/stream.md` tells a school's engineer to run works as it stands. Method: run it, with the port
        // changed only; the tip goes round in its circle.
        let Some(python) = crate::support::tools::named_by("TYPODONT_PYTHON", "a Python") else { return };
        let manual = include_str!("../../content/devices/stream.md");
        let code = manual.split("```python").nth(1).unwrap().split("```").next().unwrap();
        let port = free_port();
        let mut device = driver_by_name("stream").unwrap().open(Some(&format!("127.0.0.1:{port}"))).unwrap();
        let mut sender = Command::new(python).arg("-c").arg(code.replace("7400", &port.to_string())).spawn().unwrap();
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        beat_until(&mut device, |_, reading| {
            let Reading { pose, buttons } = reading.unwrap();
            if pose.is_valid() {
                assert!((pose.position.length() - 5.0).abs() < 1e-3 && buttons == 1, "{pose:?}");
                assert!(pose.orientation.angle_between(UPRIGHT) < 1e-3);
                (least, most) = (least.min(pose.position.x), most.max(pose.position.x));
            }
            most - least > 1.0
        });
        sender.kill().unwrap();
        sender.wait().unwrap();
    })
}

#[test]
fn an_address_that_cannot_be_listened_on_is_a_complaint() {
    crate::support::peace::in_real_time(|| {
        let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap().to_string();
        let trouble = driver_by_name("stream").unwrap().open(Some(&address)).err().unwrap();
        assert!(trouble.message.contains(&address) && trouble.help.contains("free port"), "{trouble}");
    })
}
