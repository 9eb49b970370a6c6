//! The Inverse Service, faked: a WebSocket server on the loopback that answers one frame with one state, and HTTP beside it.
//!
//! Its arithmetic is its own: x right, y away from the user, z up, metres, the middle of the workspace at (0, -0.15, 0.2).

use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use serde_json::{Value, json};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tungstenite::{Error, Message, WebSocket};
use typodont_core::device::{Device, DeviceError, DeviceState, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::driver_by_name;

/// The fake service, plugged in and running.
pub struct Haply {
    port: u16,
    shared: Arc<Shared>,
    listening: Option<JoinHandle<()>>,
}

struct Shared {
    hand: SharedHand,
    ways: Mutex<Ways>,
    seen: Mutex<Seen>,
    stop: AtomicBool,
}

/// Properties and behaviour of the fake service.
#[derive(Clone, Copy)]
struct Ways {
    /// JSON key of a force; the other key is ignored silently.
    force_key: &'static str,
    /// Answer to `GET /version`; `None` for status 400, as from a port without HTTP.
    version: Option<&'static str>,
    misbehaviour: Option<Misbehaviour>,
    /// First frame in which a grip is connected.
    grip_from: u64,
    is_calibrated: bool,
    /// True if the service closes the connection in the middle of a tick, after it has read a frame.
    drops_mid_tick: bool,
    /// True if the arm is missing in the snapshot.
    is_arm_late: bool,
}

/// Messages that the service has received from the program.
#[derive(Default)]
struct Seen {
    frames: u64,
    full_states: u64,
    /// Full states requested after the grip was connected.
    full_states_with_grip: u64,
    configured: u64,
    complaints: Vec<String>,
}

impl Haply {
    /// 3.4 or 3.5, as the two protocols are.
    pub fn plug_in(force_key: &'static str) -> Haply {
        let version = if force_key == "vector" { "3.5.2" } else { "3.4.1.0" };
        Haply::plug_in_as(Ways {
            force_key,
            version: Some(version),
            misbehaviour: None,
            grip_from: 20,
            is_calibrated: true,
            drops_mid_tick: false,
            is_arm_late: false,
        })
    }

    fn plug_in_as(ways: Ways) -> Haply {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let port = listener.local_addr().unwrap().port();
        let shared = Arc::new(Shared {
            hand: SharedHand::at_rest(0.01),
            ways: Mutex::new(ways),
            seen: Mutex::new(Seen::default()),
            stop: AtomicBool::new(false),
        });
        let there = shared.clone();
        let listening = Some(thread::spawn(move || listen(&listener, &there)));
        Haply { port, shared, listening }
    }

    fn ways(&self) -> std::sync::MutexGuard<'_, Ways> {
        self.shared.ways.lock().unwrap()
    }

    fn seen(&self) -> std::sync::MutexGuard<'_, Seen> {
        self.shared.seen.lock().unwrap()
    }
}

impl Drop for Haply {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        let _ = self.listening.take().unwrap().join();
    }
}

impl Rig for Haply {
    fn name(&self) -> &'static str {
        "haply"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        driver_by_name("haply").unwrap().open(Some(&format!("127.0.0.1:{}", self.port))).map_err(|t| t.to_string())
    }

    fn hand(&self) -> SharedHand {
        self.shared.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        use Misbehaviour::*;
        Abilities {
            force: true,
            torque: false,
            orientation: true,
            buttons: true,
            resolution: 0.01,
            is_rate: false,
            misbehaviours: &[Unplug, Garbage, Late, OverSpeed],
        }
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        self.ways().misbehaviour = Some(how);
    }

    fn recover(&mut self) {
        self.ways().misbehaviour = None;
    }
}

fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    let mut served = Vec::new();
    while !shared.stop.load(Ordering::Acquire) {
        match listener.accept() {
            // Unplugged: whoever calls is hung up on.
            Ok(_) if shared.is(Misbehaviour::Unplug) => {}
            Ok((stream, _)) => {
                let shared = shared.clone();
                served.push(crate::rig::spawn_device(move || greet(stream, &shared)));
            }
            Err(_) => thread::sleep(Duration::from_millis(2)),
        }
    }
    for thread in served {
        thread.join().unwrap();
    }
}

impl Shared {
    fn is(&self, how: Misbehaviour) -> bool {
        self.ways.lock().unwrap().misbehaviour == Some(how)
    }

    fn complain(&self, what: impl Into<String>) {
        self.seen.lock().unwrap().complaints.push(what.into());
    }
}

/// Both protocols come in at one port.
fn greet(mut stream: TcpStream, shared: &Shared) {
    stream.set_nonblocking(false).unwrap();
    stream.set_nodelay(true).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let mut start = [0; 12];
    while stream.peek(&mut start).is_ok_and(|length| (1..start.len()).contains(&length)) {
        thread::sleep(Duration::from_millis(1));
    }
    if start.starts_with(b"GET /version") {
        let mut request = [0; 1024];
        let _ = stream.read(&mut request);
        let version = shared.ways.lock().unwrap().version;
        let answer = match version {
            Some(version) => {
                let body =
                    json!({"ok": true, "data": {"project_name": "fake", "project_version": version}}).to_string();
                format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n{body}", body.len())
            }
            None => "HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n".to_string(),
        };
        let _ = stream.write_all(answer.as_bytes());
        return;
    }
    if let Ok(socket) = tungstenite::accept(stream) {
        serve(socket, shared);
        // The connection ended; the arm idles.
        shared.hand.turn(Wrench::ZERO);
    }
}

/// One connection: the snapshot, then one state for one frame. A frame is a tick; without frames the arm idles.
fn serve(mut socket: WebSocket<TcpStream>, shared: &Shared) {
    socket.get_ref().set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let is_arm_late = shared.ways.lock().unwrap().is_arm_late;
    let mut tick = Tick { number: 0, told: Vec3::ZERO, has_rendered: false, gives_full_state: !is_arm_late };
    if socket.send(Message::text(tick.state(shared).to_string())).is_err() {
        return;
    }
    while !shared.stop.load(Ordering::Acquire) && !shared.is(Misbehaviour::Unplug) {
        let text = match socket.read() {
            Ok(Message::Text(text)) => text,
            Ok(Message::Close(_)) => return,
            Ok(_) => continue,
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                shared.hand.turn(Wrench::ZERO);
                continue;
            }
            Err(_) => return,
        };
        tick.begin(&text, shared);
        if shared.ways.lock().unwrap().drops_mid_tick {
            return;
        }
        let answer = tick.state(shared).to_string();
        if shared.is(Misbehaviour::Late) {
            // The tick is over long before its answer goes out.
            for _ in 0..50 {
                shared.hand.turn(Wrench::ZERO);
                thread::sleep(Duration::from_millis(1));
            }
            complain_of_a_second_frame(&mut socket, shared);
        }
        let answer = if shared.is(Misbehaviour::Garbage) { garbage(tick.number, &answer) } else { answer };
        if socket.send(Message::text(answer)).is_err() {
            return;
        }
    }
}

/// Checks the lockstep: the program must not send a second frame before the first is answered.
fn complain_of_a_second_frame(socket: &mut WebSocket<TcpStream>, shared: &Shared) {
    socket.get_ref().set_nonblocking(true).unwrap();
    if let Ok(Message::Text(_)) = socket.read() {
        shared.complain("a second frame before the first was answered");
    }
    socket.get_ref().set_nonblocking(false).unwrap();
}

fn garbage(number: u64, answer: &str) -> String {
    match number % 4 {
        0 => "<html>502 Bad Gateway</html>".into(),
        1 => answer[..answer.len() / 2].into(),
        2 => r#"{"inverse3": [{"device_id": "04BA", "state": {"cursor_position": {"x": 1e300, "y": 0, "z": 0}}}]}"#
            .into(),
        _ => String::new(),
    }
}

struct Tick {
    number: u64,
    /// N, in the service's space, under the name that this service understands.
    told: Vec3,
    /// The program can know that forces are understood.
    has_rendered: bool,
    gives_full_state: bool,
}

impl Tick {
    /// Takes a frame as the service does: what it does not know it ignores, forces end with the tick.
    fn begin(&mut self, text: &str, shared: &Shared) {
        self.number += 1;
        self.told = Vec3::ZERO;
        let ways = *shared.ways.lock().unwrap();
        let frame: Value = serde_json::from_str(text).unwrap();
        self.gives_full_state = frame["session"]["force_render_full_state"].is_object();
        {
            let mut seen = shared.seen.lock().unwrap();
            seen.frames += 1;
            seen.full_states += u64::from(self.gives_full_state);
            seen.full_states_with_grip += u64::from(self.gives_full_state && self.number > ways.grip_from);
        }
        for device in frame["inverse3"].as_array().map(Vec::as_slice).unwrap_or_default() {
            if device["device_id"] != "04BA" {
                shared.complain(format!("commands for {}", device["device_id"]));
            }
            if device["configure"].is_object() {
                shared.seen.lock().unwrap().configured += 1;
                if self.number > 1 {
                    shared.complain("a configuration after the first frame");
                }
            }
            let force = |key: &str| {
                let axis =
                    |name: &str| device["commands"]["set_cursor_force"][key][name].as_f64().unwrap_or(0.0) as f32;
                Vec3::new(axis("x"), axis("y"), axis("z"))
            };
            if !self.has_rendered && (force("values") + force("vector")).length() > 0.05 {
                shared.complain("a force that can be felt before the first touch was answered");
            }
            if ways.misbehaviour != Some(Misbehaviour::OverSpeed) {
                self.told = force(ways.force_key);
            }
        }
    }

    fn told_in_world(&self) -> Vec3 {
        Vec3::new(self.told.x, self.told.z, -self.told.y)
    }

    /// Advances the hand by one tick, and returns the state of the device.
    fn state(&mut self, shared: &Shared) -> Value {
        let ways = *shared.ways.lock().unwrap();
        let reading = shared.hand.turn(Wrench { force: self.told_in_world(), torque: Vec3::ZERO });
        let (p, q) = (reading.pose.position, reading.pose.orientation);
        let is_due = !ways.is_arm_late || self.number > 0;
        // A whole list may be missing now and then.
        let mut state = json!({"session_id": 7});
        if self.number % 11 != 10 && is_due {
            let mut arm = json!({
                "device_id": "04BA",
                "state": {
                    "cursor_position": {
                        "x": number(f64::from(p.x) / 1000.0),
                        "y": number(-0.15 - f64::from(p.z) / 1000.0),
                        "z": number(0.2 + f64::from(p.y) / 1000.0),
                    },
                    "current_cursor_force": {"x": self.told.x, "y": self.told.y, "z": self.told.z},
                    "body_orientation": {"w": 1, "x": 0, "y": 0, "z": 0},
                    "control_mode": "force", "mode": "idle", "transform": {}, "transform_velocity": {},
                },
                "status": {"calibrated": ways.is_calibrated, "in_use": true, "power_supply": true, "ready": true,
                           "started": true},
            });
            if self.gives_full_state {
                arm["config"] = json!({
                    "type": "inverse3x", "port": "/dev/ttyACM0", "mount": {}, "basis": {"permutation": "XYZ"},
                    "device_info": {"id": "04BA", "device_type": 4, "major_version": 8, "minor_version": 0},
                });
            }
            state["inverse3"] = json!([arm]);
        }
        if self.number >= ways.grip_from && self.number % 7 != 6 {
            let mut grip = json!({
                "device_id": "61576",
                "state": {
                    "battery_level": 1, "hall": 12, "transform": {},
                    "buttons": {"a": reading.buttons & 1 != 0, "b": reading.buttons & 2 != 0, "c": reading.buttons & 4 != 0},
                    "orientation": {"w": q.w, "z": q.y, "x": q.x, "y": -q.z},
                },
                "status": {"connected": true, "awake": true, "ready": true},
            });
            if self.gives_full_state {
                grip["config"] = json!({"type": "verse_grip_wireless"});
            }
            state["wireless_verse_grip"] = json!([grip]);
        }
        self.gives_full_state = false;
        self.has_rendered |= self.told != Vec3::ZERO;
        state
    }
}

/// As a service in C++ writes it: whole numbers without a point.
fn number(value: f64) -> Value {
    if value.fract() == 0.0 { json!(value as i64) } else { json!(value) }
}

/// Long enough for a loaded machine; nothing here takes a hundredth of it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Keeps the servo's beat until a condition holds; the force is always the same.
fn beat_until(
    device: &mut dyn Device,
    force: Vec3,
    mut holds: impl FnMut(&mut dyn Device, Result<typodont_core::device::Reading, DeviceError>) -> bool,
) {
    let until = Instant::now() + PATIENCE;
    loop {
        let reading = device.exchange(&Wrench { force, torque: Vec3::ZERO });
        if holds(device, reading) {
            return;
        }
        assert!(Instant::now() < until, "waited in vain; the device is {}, and {reading:?}", device.state());
        thread::sleep(Duration::from_micros(300));
    }
}

fn until_ready(device: &mut dyn Device) {
    beat_until(device, Vec3::ZERO, |device, reading| device.state().is_ready() && reading.is_ok());
}

fn until_gone(device: &mut dyn Device) -> DeviceError {
    let mut gone = None;
    beat_until(device, Vec3::ZERO, |_, reading| {
        gone = reading.err();
        gone.is_some()
    });
    gone.unwrap()
}

fn is_near(a: Vec3, b: Vec3, distance: f32) -> bool {
    (a - b).length() < distance
}

#[test]
fn the_protocol_up_to_version_3_4_passes_the_suite() {
    crate::support::peace::in_real_time(|| suite::check(&mut Haply::plug_in("values")));
}

#[test]
fn the_protocol_from_version_3_5_passes_the_suite() {
    crate::support::peace::in_real_time(|| suite::check(&mut Haply::plug_in("vector")));
}

#[test]
fn a_force_arrives_whatever_the_service_calls_it() {
    crate::support::peace::in_real_time(|| {
        // Aim: the name of the force that this service understands is found, by version or by trying, before a real force is
        // sent. Method: both services, each telling its version, none, and a wrong one; a force of three different components
        // must arrive in world space as it was sent.
        let force = Vec3::new(0.4, -0.2, 0.3);
        for (key, version) in [
            ("values", Some("3.4.1")),
            ("vector", Some("3.5.0")),
            ("vector", None),
            ("values", None),
            ("values", Some("3.6.0")),
            ("vector", Some("3.2.0")),
        ] {
            let mut rig = Haply::plug_in(key);
            rig.ways().version = version;
            let mut device = rig.open().unwrap();
            let hand = rig.hand();
            beat_until(&mut device, force, |device, _| device.state().is_ready());
            beat_until(&mut device, force, |_, _| is_near(hand.felt().force, force, 1e-3));
            drop(device);
            assert_eq!(rig.seen().complaints, [""; 0], "{key} {version:?}");
        }
    })
}

#[test]
fn a_service_that_renders_nothing_is_not_trusted() {
    crate::support::peace::in_real_time(|| {
        // Aim: an arm that stays limp under both names says so, and works once it no longer does.
        let mut rig = Haply::plug_in("vector");
        rig.misbehave(Misbehaviour::OverSpeed);
        let mut device = rig.open().unwrap();
        beat_until(&mut device, Vec3::X, |device, _| matches!(device.state(), DeviceState::ForceOff { .. }));
        assert_eq!(rig.hand().most_felt(), 0.0);
        rig.recover();
        beat_until(&mut device, Vec3::X, |device, _| device.state().is_ready());
        // Cut again, in the middle of a push: the echo tells.
        let hand = rig.hand();
        beat_until(&mut device, Vec3::X, |_, _| is_near(hand.felt().force, Vec3::X, 1e-3));
        rig.misbehave(Misbehaviour::OverSpeed);
        beat_until(&mut device, Vec3::X, |device, _| matches!(device.state(), DeviceState::ForceOff { .. }));
    })
}

#[test]
fn what_is_missing_from_a_frame_erases_nothing() {
    crate::support::peace::in_real_time(|| {
        // Aim: a grip that comes later is taken, missing lists change nothing, and the service is asked to describe the stranger
        // once. Method: turn and press before the grip is there; then no reading may fall back to an upright, released handle.
        let mut rig = Haply::plug_in("vector");
        let hand = rig.hand();
        let turned = Quat::from_xyzw(0.5, 0.5, -0.5, 0.5);
        hand.turn_to(turned);
        hand.press_buttons(0b101);
        hand.reach(Vec3::new(10.0, -5.0, 20.0));
        let mut device = rig.open().unwrap();
        assert_eq!(device.spec().name, "Haply Inverse3x");
        beat_until(&mut device, Vec3::ZERO, |_, reading| reading.is_ok_and(|r| r.buttons == 0b101));
        let from = rig.seen().frames;
        beat_until(&mut device, Vec3::ZERO, |_, reading| {
            let reading = reading.unwrap();
            if reading.pose.is_valid() {
                assert_eq!(reading.buttons, 0b101);
                assert!(reading.pose.orientation.angle_between(turned) < 1e-3, "{}", reading.pose.orientation);
            }
            rig.seen().frames > from + 100
        });
        beat_until(&mut device, Vec3::ZERO, |_, reading| {
            is_near(reading.unwrap().pose.position, Vec3::new(10.0, -5.0, 20.0), 0.1)
        });
        let seen = rig.seen();
        assert_eq!((seen.full_states_with_grip, seen.configured), (1, 1));
        assert_eq!(seen.complaints, [""; 0]);
    })
}

#[test]
fn an_arm_that_is_not_in_the_snapshot_is_asked_for() {
    crate::support::peace::in_real_time(|| {
        let mut rig = Haply::plug_in("vector");
        rig.ways().is_arm_late = true;
        let mut device = rig.open().unwrap();
        assert_eq!(device.spec().name, "Haply Inverse3x");
        until_ready(&mut device);
    })
}

#[test]
fn an_arm_waits_for_its_calibration_in_sight_and_without_force() {
    crate::support::peace::in_real_time(|| {
        let mut rig = Haply::plug_in("values");
        rig.ways().is_calibrated = false;
        let mut device = rig.open().unwrap();
        beat_until(&mut device, Vec3::X, |device, _| matches!(device.state(), DeviceState::Calibrate { .. }));
        assert_eq!(rig.hand().most_felt(), 0.0);
        rig.ways().is_calibrated = true;
        until_ready(&mut device);
    })
}

#[test]
fn a_command_lasts_one_tick() {
    crate::support::peace::in_real_time(|| {
        // Aim: when the program ends or only stops to turn the servo, the hand is free. Method: push, then stop exchanging; then
        // push again, and drop the device.
        let mut rig = Haply::plug_in("vector");
        let hand = rig.hand();
        let mut device = rig.open().unwrap();
        for is_dropped in [false, true] {
            beat_until(&mut device, Vec3::Y, |_, _| is_near(hand.felt().force, Vec3::Y, 1e-3));
            if is_dropped {
                break;
            }
            wait_for(|| hand.felt() == Wrench::ZERO);
        }
        drop(device);
        wait_for(|| hand.felt() == Wrench::ZERO);
    })
}

fn wait_for(holds: impl Fn() -> bool) {
    let until = Instant::now() + PATIENCE;
    while !holds() {
        assert!(Instant::now() < until, "waited in vain");
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn late_answers_let_go_and_are_never_overtaken() {
    crate::support::peace::in_real_time(|| {
        // Aim: an answer that comes 50 ms late pushes nobody, and no second frame is sent meanwhile.
        let mut rig = Haply::plug_in("vector");
        let hand = rig.hand();
        let mut device = rig.open().unwrap();
        until_ready(&mut device);
        rig.misbehave(Misbehaviour::Late);
        let since = rig.seen().frames;
        beat_until(&mut device, Vec3::X, |_, _| rig.seen().frames > since + 6);
        assert!(matches!(device.state(), DeviceState::ForceOff { .. }), "{}", device.state());
        hand.most_felt();
        beat_until(&mut device, Vec3::X, |_, _| rig.seen().frames > since + 12);
        assert_eq!(hand.most_felt(), 0.0);
        rig.recover();
        until_ready(&mut device);
        assert_eq!(rig.seen().complaints, [""; 0]);
    })
}

#[test]
fn a_broken_line_or_broken_words_end_with_a_reason() {
    crate::support::peace::in_real_time(|| {
        // Aim: each way of losing the service says what happened, lets go, and a new connection works.
        type Break = fn(&mut Haply);
        let break_it: [(&str, Break); 3] = [
            ("ended the connection", |rig| rig.ways().drops_mid_tick = true),
            ("the Inverse Service", |rig| rig.misbehave(Misbehaviour::Unplug)),
            ("cannot be read", |rig| rig.misbehave(Misbehaviour::Garbage)),
        ];
        for (reason, break_it) in break_it {
            let mut rig = Haply::plug_in("vector");
            let mut device = rig.open().unwrap();
            until_ready(&mut device);
            break_it(&mut rig);
            let gone = until_gone(&mut device);
            assert!(gone.to_string().contains(reason), "{gone}");
            drop(device);
            wait_for(|| rig.hand().felt() == Wrench::ZERO);
            rig.recover();
            rig.ways().drops_mid_tick = false;
            until_ready(&mut rig.open().unwrap());
        }
    })
}

#[test]
fn what_is_no_service_is_named() {
    crate::support::peace::in_real_time(|| {
        // Aim: everything that may stand at the address in place of the service ends in a complaint that says what to do.
        let haply = driver_by_name("haply").unwrap();
        let complaint = |argument: &str| haply.open(Some(argument)).err().unwrap().to_string();
        let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        assert!(complaint(&nobody.to_string()).contains("start the Inverse Service"));
        assert!(complaint("nonsense").contains("is not an address"));
        let rig = Haply::plug_in("vector");
        assert!(complaint(&format!("127.0.0.1:{}/0000", rig.port)).contains("no device 0000"));
        rig.ways().version = Some("3.0.8");
        assert!(complaint(&format!("127.0.0.1:{}", rig.port)).contains("update"));
    })
}
