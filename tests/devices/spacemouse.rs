//! A fake SpaceMouse: a cap on springs, moved by the hand; reports as each generation sends them.

use crate::pipe::{DeviceEnd, ProgramEnd, cable};
use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceState, Reading, UPRIGHT, Wrench};
use typodont_core::frame::Vec3;
use typodont_devices::Relay;
use typodont_devices::spacemouse::SpaceMouseProtocol;

/// Displacement that pushes the cap to its stop, mm.
const STOP: f32 = 10.0;

pub struct Rigged {
    hand: SharedHand,
    is_wireless: bool,
    is_plugged: Arc<AtomicBool>,
}

impl Rigged {
    pub fn new(is_wireless: bool) -> Rigged {
        Rigged { hand: SharedHand::at_rest(0.0), is_wireless, is_plugged: Arc::new(AtomicBool::new(true)) }
    }
}

impl Rig for Rigged {
    fn name(&self) -> &'static str {
        if self.is_wireless { "spacemouse (wireless)" } else { "spacemouse" }
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let (program, device) = cable();
        let (hand, is_plugged, is_wireless) = (self.hand.clone(), self.is_plugged.clone(), self.is_wireless);
        crate::rig::spawn_device(move || firmware(device, &hand, &is_plugged, is_wireless));
        Ok(Box::new(Relay::start(SpaceMouseProtocol::new(program, 0xc626))))
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
            resolution: 0.1,
            is_rate: true,
            misbehaviours: &[Misbehaviour::Unplug],
        }
    }

    fn misbehave(&mut self, _how: Misbehaviour) {
        self.is_plugged.store(false, Ordering::Release);
    }

    fn recover(&mut self) {
        self.is_plugged.store(true, Ordering::Release);
    }
}

/// Reports every 8 ms while the cap is away from rest, three times zero after it came back, then nothing.
fn firmware(device: DeviceEnd, hand: &SharedHand, is_plugged: &AtomicBool, is_wireless: bool) {
    let (mut zeros, mut buttons, mut second) = (3, 0, false);
    while is_plugged.load(Ordering::Acquire) {
        for _ in 0..8 {
            hand.turn(Wrench::ZERO);
            std::thread::sleep(Duration::from_millis(1));
        }
        while let Some(report) = match device.try_receive() {
            Ok(report) => report,
            Err(()) => return,
        } {
            assert!(matches!(report[..], [4, 0 | 1]), "the light takes 0 or 1: {report:?}");
        }
        let at: Reading = hand.turn(Wrench::ZERO);
        let Vec3 { x, y, z } = at.pose.position;
        // Right, toward the user, down.
        let counts = [x, z, -y].map(|mm| (mm / STOP * 350.0).round() as i16).map(|n| if n.abs() < 4 { 0 } else { n });
        zeros = if counts == [0; 3] { zeros + 1 } else { 0 };
        if zeros <= 3 {
            let bytes = counts.map(i16::to_le_bytes).concat();
            match (is_wireless, second) {
                (true, _) => device.send(&[&[1][..], &bytes, &[0; 6]].concat()),
                (false, false) => device.send(&[&[1][..], &bytes].concat()),
                (false, true) => device.send(&[2, 0, 0, 0, 0, 0, 0]),
            }
            second = !second;
        }
        if at.buttons != buttons {
            buttons = at.buttons;
            device.send(&[3, buttons as u8, 0]);
        }
        if is_wireless {
            device.send(&[0x17, 90]);
        }
    }
}

#[test]
fn a_cabled_spacemouse_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Rigged::new(false));
    })
}

#[test]
fn a_wireless_spacemouse_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Rigged::new(true));
    })
}

fn relay() -> (Relay, DeviceEnd) {
    let (program, device): (ProgramEnd, DeviceEnd) = cable();
    (Relay::start(SpaceMouseProtocol::new(program, 0xc626)), device)
}

fn exchange(relay: &mut Relay) -> Reading {
    std::thread::sleep(Duration::from_millis(1));
    relay.exchange(&Wrench::ZERO).unwrap()
}

#[test]
fn a_cap_at_rest_is_silent_and_not_gone() {
    crate::support::peace::in_real_time(|| {
        // Aim: silence means unchanged. Method: a second without any report, far longer than other devices may be silent for;
        // then a push, silence again: the place moves on, for the cap is still pushed.
        let (mut relay, device) = relay();
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(1) {
            exchange(&mut relay);
        }
        let rest = exchange(&mut relay);
        assert_eq!((rest.pose.position, relay.state()), (Vec3::ZERO, DeviceState::Ready));
        assert!(rest.pose.orientation.angle_between(UPRIGHT) < 1e-3);
        device.send(&[1, 0x5e, 0x01, 0, 0, 0, 0]);
        let start = Instant::now();
        while exchange(&mut relay).pose.position.x < 10.0 {
            assert!(start.elapsed() < Duration::from_secs(20), "a cap that is held still moves the place");
        }
        device.send(&[1, 0, 0, 0, 0, 0, 0]);
        let mut last = exchange(&mut relay).pose.position;
        let start = Instant::now();
        let mut still_since = Instant::now();
        while still_since.elapsed() < Duration::from_millis(100) {
            let now = exchange(&mut relay).pose.position;
            if now != last {
                (last, still_since) = (now, Instant::now());
            }
            assert!(start.elapsed() < Duration::from_secs(20), "a cap that came back stops the place");
        }
    })
}

#[test]
fn the_cap_turns_the_handle_about_the_axis_it_is_turned_about() {
    crate::support::peace::in_real_time(|| {
        // Aim: device axes are right, toward the user, down. Method: turn the cap about each; watch the handle's tilt.
        for (bytes, axis) in [
            ([2, 0x5e, 0x01, 0, 0, 0, 0], Vec3::X),
            ([2, 0, 0, 0x5e, 0x01, 0, 0], Vec3::Z),
            ([2, 0, 0, 0, 0, 0x5e, 0x01], -Vec3::Y),
        ] {
            let (mut relay, device) = relay();
            device.send(&bytes);
            let start = Instant::now();
            loop {
                let turned = exchange(&mut relay).pose.orientation * UPRIGHT.conjugate();
                if turned.is_finite() && turned.to_axis_angle().1 > 0.3 {
                    let (about, _) = turned.to_axis_angle();
                    assert!(about.distance(axis) < 0.01, "{about}, not {axis}");
                    break;
                }
                assert!(start.elapsed() < Duration::from_secs(20), "about {axis}: nothing turns");
            }
        }
    })
}

#[test]
fn what_no_spacemouse_sends_ends_in_a_clear_word() {
    crate::support::peace::in_real_time(|| {
        let (mut relay, device) = relay();
        let start = Instant::now();
        let gone = loop {
            device.send(&[1, 2, 3]);
            std::thread::sleep(Duration::from_millis(1));
            if let Err(gone) = relay.exchange(&Wrench::ZERO) {
                break gone;
            }
            assert!(start.elapsed() < Duration::from_secs(20));
        };
        assert!(gone.to_string().contains("SpaceMouse"), "{gone}");
    })
}
