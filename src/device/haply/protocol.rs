//! The Inverse Service's messages: what is written to it, and what its state frames say.
//!
//! Takes and gives world space, mm, N; the service's own space (x right, y away from the user, z up; m) ends here. Tolerant
//! of what is missing, strict with what is there: a frame with a number that is none gives nothing at all.

use crate::frame::{Quat, Vec3};
use serde_json::{Map, Value, json};

/// What a force is called in a command. The wrong name is no error: the device just stays limp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceKey {
    /// Services 3.1 to 3.4.
    Values,
    /// Services from 3.5 on.
    Vector,
}

impl ForceKey {
    pub fn other(self) -> ForceKey {
        match self {
            ForceKey::Values => ForceKey::Vector,
            ForceKey::Vector => ForceKey::Values,
        }
    }

    fn name(self) -> &'static str {
        match self {
            ForceKey::Values => "values",
            ForceKey::Vector => "vector",
        }
    }
}

/// One frame to the service. A force lasts for the tick that the frame starts.
#[derive(Clone, Copy, Debug)]
pub struct Command<'a> {
    pub arm: &'a str,
    pub force: Vec3,
    pub key: ForceKey,
    /// Sets the service's frame to the one that is converted here, once.
    pub configures: bool,
    /// Asks for every device with its config in the reply.
    pub wants_full_state: bool,
}

pub fn command(command: &Command) -> String {
    let Command { arm, force, key, configures, wants_full_state } = *command;
    let [x, y, z] = service_from_world(force);
    let mut device =
        json!({"device_id": arm, "commands": {"set_cursor_force": {key.name(): {"x": x, "y": y, "z": z}}}});
    let mut session = Map::new();
    if configures {
        device["configure"] = json!({"preset": {"preset": "defaults"}, "basis": {"permutation": "XYZ"}});
        session.insert("configure".into(), json!({"profile": {"name": "typodont"}}));
    }
    if wants_full_state {
        session.insert("force_render_full_state".into(), json!({}));
    }
    let mut frame = json!({"inverse3": [device]});
    if !session.is_empty() {
        frame["session"] = Value::Object(session);
    }
    frame.to_string()
}

/// A frame that moves nothing and asks for every device with its config.
pub const FULL_STATE: &str = r#"{"session":{"force_render_full_state":{}}}"#;

/// What a state frame says. What it does not mention is as before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    pub arms: Vec<Arm>,
    pub grips: Vec<Grip>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    pub id: String,
    /// Known from frames with a config only.
    pub kind: Option<Kind>,
    pub position: Option<Vec3>,
    /// The force that the service says it renders.
    pub rendered: Option<Vec3>,
    pub status: Status,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Inverse3,
    Inverse3x,
    Minverse,
}

/// How an arm is. `None` where the service did not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    pub calibrated: Option<bool>,
    pub power_supply: Option<bool>,
    pub ready: Option<bool>,
}

impl Status {
    /// Takes over what a newer frame says.
    pub fn update(&mut self, newer: Status) {
        self.calibrated = newer.calibrated.or(self.calibrated);
        self.power_supply = newer.power_supply.or(self.power_supply);
        self.ready = newer.ready.or(self.ready);
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Grip {
    pub id: String,
    pub orientation: Option<Quat>,
    pub buttons: Option<u32>,
    /// It is known to be out of reach or asleep.
    pub is_away: bool,
}

/// The frame that a text holds; `None` if it is none.
pub fn frame(text: &str) -> Option<Frame> {
    let value: Value = serde_json::from_str(text).ok()?;
    let lists = value.as_object()?;
    let arms = devices(lists, "inverse3")?.iter().map(arm).collect::<Option<_>>()?;
    let mut grips: Vec<Grip> = Vec::new();
    for list in ["wireless_verse_grip", "custom_verse_grip", "verse_grip"] {
        for value in devices(lists, list)? {
            let grip = grip(value)?;
            // One grip may stand in two lists.
            if grips.iter().all(|other| other.id != grip.id) {
                grips.push(grip);
            }
        }
    }
    Some(Frame { arms, grips })
}

/// A list of devices; an empty one where there is none.
fn devices<'a>(lists: &'a Map<String, Value>, name: &str) -> Option<&'a [Value]> {
    match lists.get(name) {
        None | Some(Value::Null) => Some(&[]),
        Some(list) => list.as_array().map(Vec::as_slice),
    }
}

fn arm(value: &Value) -> Option<Arm> {
    let state = &value["state"];
    let position = optional(&state["cursor_position"], vector)?.map(position_in_world);
    let is_within_reach = position.is_none_or(|p| p.length() < REACH_MAX);
    let flag = |name: &str| value["status"][name].as_bool();
    is_within_reach.then_some(Arm {
        id: value["device_id"].as_str()?.to_string(),
        kind: value.get("config").and_then(kind),
        position,
        rendered: optional(&state["current_cursor_force"], vector)?.map(world_from_service),
        status: Status { calibrated: flag("calibrated"), power_supply: flag("power_supply"), ready: flag("ready") },
    })
}

/// No arm of the family reaches a metre from its middle, mm: a number beyond is none.
const REACH_MAX: f32 = 1000.0;

fn kind(config: &Value) -> Option<Kind> {
    let device_type = &config["device_info"]["device_type"];
    let name = config["type"].as_str().or(device_type.as_str()).unwrap_or_default();
    match (name, device_type.as_i64()) {
        ("inverse3", _) | ("", Some(4)) => Some(Kind::Inverse3),
        ("inverse3x", _) => Some(Kind::Inverse3x),
        ("minverse", _) | ("", Some(6)) => Some(Kind::Minverse),
        _ => None,
    }
}

/// Names of a grip's buttons, by the bit they set. A wired grip has one without a letter.
const BUTTONS: [&str; 10] = ["a", "b", "c", "d", "e", "f", "up", "down", "left", "right"];

fn grip(value: &Value) -> Option<Grip> {
    let state = &value["state"];
    let pressed = |name: &str| state["buttons"][name].as_bool();
    let lettered = BUTTONS.iter().enumerate().filter_map(|(bit, name)| Some(u32::from(pressed(name)?) << bit));
    let buttons = lettered.chain(state["button"].as_bool().map(u32::from)).reduce(|all, one| all | one);
    let is_down = |name: &str| value["status"][name].as_bool() == Some(false);
    Some(Grip {
        id: value["device_id"].as_str()?.to_string(),
        orientation: optional(&state["orientation"], quaternion)?,
        buttons,
        is_away: is_down("connected") || is_down("awake"),
    })
}

/// `Some(None)` for what is not there (or `{}`, as transforms may be), `None` for what cannot be read.
fn optional<T>(value: &Value, read: impl Fn(&Value) -> Option<T>) -> Option<Option<T>> {
    match value {
        Value::Null => Some(None),
        Value::Object(members) if members.is_empty() => Some(None),
        _ => read(value).map(Some),
    }
}

fn vector(value: &Value) -> Option<[f64; 3]> {
    Some([value["x"].as_f64()?, value["y"].as_f64()?, value["z"].as_f64()?])
}

/// A grip's orientation as that of a handle in world space.
///
/// Which way a grip points at rest is not published. The vendor's Euler order Z-X-Y turns last about +Y, forward, so that is
/// taken for the direction of the working end. Then grip and handle differ by the same turn as the two spaces, and only the
/// quaternion's axis changes.
fn quaternion(value: &Value) -> Option<Quat> {
    let [x, y, z] = world_from_service(vector(value)?).to_array();
    let turn = Quat::from_xyzw(x, y, z, value["w"].as_f64()? as f32);
    let length = turn.length();
    (0.9..1.1).contains(&length).then(|| turn / length)
}

/// Middle of the workspace in the service's space, m, as CHAI3D's fork for the Inverse3 has it; the vendor's samples lie
/// around it.
const MIDDLE: [f64; 3] = [0.0, -0.15, 0.2];

fn position_in_world(in_service: [f64; 3]) -> Vec3 {
    let [x, y, z] = in_service;
    let [x0, y0, z0] = MIDDLE;
    world_from_service([(x - x0) * 1000.0, (y - y0) * 1000.0, (z - z0) * 1000.0])
}

fn world_from_service([x, y, z]: [f64; 3]) -> Vec3 {
    Vec3::new(x as f32, z as f32, -y as f32)
}

fn service_from_world(v: Vec3) -> [f32; 3] {
    [v.x, -v.z, v.y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_may_leave_out_nearly_everything() {
        // Aim: nothing that is missing is an error or erases something. Method: frames as the vendor's tests have them.
        assert_eq!(frame("{}"), Some(Frame::default()));
        assert_eq!(frame(r#"{"session_id": 4, "inverse3": null}"#), Some(Frame::default()));
        let bare = frame(r#"{"inverse3": [{"device_id": "04BA", "state": {"transform": {}, "cursor_position": {}}}]}"#);
        let arm = &bare.unwrap().arms[0];
        assert_eq!((arm.position, arm.kind, arm.status), (None, None, Status::default()));
    }

    #[test]
    fn a_position_is_read_into_world_space() {
        let text =
            r#"{"inverse3": [{"device_id": "04BA", "state": {"cursor_position": {"z": 0.21, "x": 0, "y": -0.17}}}]}"#;
        let position = frame(text).unwrap().arms[0].position.unwrap();
        // 10 mm above the middle and 20 mm nearer to the user.
        assert!((position - Vec3::new(0.0, 10.0, 20.0)).length() < 1e-3, "{position}");
    }

    #[test]
    fn what_is_no_number_makes_the_frame_garbage() {
        let place = |p: &str| format!(r#"{{"inverse3": [{{"device_id": "1", "state": {{"cursor_position": {p}}}}}]}}"#);
        let bad = [r#"{"x": 1e300, "y": 0, "z": 0}"#, r#"{"x": null, "y": 0, "z": 0}"#, r#"[0, 0, 0]"#, r#"{"x": 0}"#];
        for bad in bad {
            assert_eq!(frame(&place(bad)), None, "{bad}");
        }
        for text in ["", "<html>", "[]", r#"{"inverse3": "none"}"#, r#"{"inverse3": [{"state": {}}]}"#] {
            assert_eq!(frame(text), None, "{text}");
        }
        let limp =
            r#"{"verse_grip": [{"device_id": "1", "state": {"orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}}]}"#;
        assert_eq!(frame(limp), None);
    }

    #[test]
    fn grips_of_every_kind_are_read_once() {
        // Aim: buttons get their bits, and a grip that stands in two lists is one grip.
        let text = r#"{
            "verse_grip": [{"device_id": "w", "state": {"button": true}}],
            "wireless_verse_grip": [{"device_id": "r", "state": {"buttons": {"a": false, "c": true}, "battery_level": 1},
                                     "status": {"connected": false}}],
            "custom_verse_grip": [{"device_id": "r", "state": {"buttons": {"up": true}}}]}"#;
        let grips = frame(text).unwrap().grips;
        let seen: Vec<_> = grips.iter().map(|g| (g.id.as_str(), g.buttons, g.is_away)).collect();
        assert_eq!(seen, [("r", Some(0b100), true), ("w", Some(1), false)]);
    }

    #[test]
    fn kinds_are_told_by_name_or_number() {
        let check = |config: &str, expected: Option<Kind>| {
            assert_eq!(kind(&serde_json::from_str(config).unwrap()), expected, "{config}");
        };
        check(r#"{"type": "minverse"}"#, Some(Kind::Minverse));
        check(r#"{"type": "inverse3x", "device_info": {"device_type": 4}}"#, Some(Kind::Inverse3x));
        check(r#"{"device_info": {"device_type": 6}}"#, Some(Kind::Minverse));
        check(r#"{"device_info": {"device_type": "inverse3"}}"#, Some(Kind::Inverse3));
        check(r#"{}"#, None);
    }
}
