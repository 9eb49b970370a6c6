//! Messages of the Inverse Service: encoding of commands, parsing of state frames.
//!
//! Takes and gives world space, mm, N; the service's own space (x right, y away from the user, z up; m) is used only
//! here. Missing members are accepted. Never accepts an invalid number: the whole frame is then rejected.

use serde_json::{Map, Value, json};
use typodont_core::frame::{Quat, Vec3};

/// Key of a force in a command. With the wrong key there is no error; the device renders no force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceKey {
    /// Services 3.1 to 3.4.
    Values,
    /// Services 3.5 and later.
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

/// One frame to the service. A force holds for the tick that the frame starts.
#[derive(Clone, Copy, Debug)]
pub struct HaplyCommand<'a> {
    /// Id of the arm.
    pub arm: &'a str,
    /// N, world space.
    pub force: Vec3,
    pub key: ForceKey,
    /// Sets the service's coordinate frame to the one converted here; sent once.
    pub sends_configuration: bool,
    /// Requests all devices with their configuration in the reply.
    pub wants_full_state: bool,
}

/// Encodes a command as JSON.
pub fn encode_command(command: &HaplyCommand) -> String {
    let HaplyCommand { arm, force, key, sends_configuration, wants_full_state } = *command;
    let [x, y, z] = service_from_world(force);
    let mut device =
        json!({"device_id": arm, "commands": {"set_cursor_force": {key.name(): {"x": x, "y": y, "z": z}}}});
    let mut session = Map::new();
    if sends_configuration {
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

/// Frame that moves nothing and requests all devices with their configuration.
pub const FULL_STATE_REQUEST: &str = r#"{"session":{"force_render_full_state":{}}}"#;

/// Contents of a state frame. Members that it does not mention are unchanged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateFrame {
    pub arms: Vec<ArmReport>,
    pub grips: Vec<GripReport>,
}

/// State of one arm in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmReport {
    pub id: String,
    /// Known only from frames with a configuration.
    pub model: Option<HaplyModel>,
    /// World space, mm.
    pub position: Option<Vec3>,
    /// Force that the service reports as rendered, N, world space.
    pub rendered: Option<Vec3>,
    pub status: ArmStatus,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HaplyModel {
    Inverse3,
    Inverse3x,
    Minverse,
}

/// Status flags of an arm. `None` if the service did not report them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArmStatus {
    pub calibrated: Option<bool>,
    pub power_supply: Option<bool>,
    pub ready: Option<bool>,
}

impl ArmStatus {
    /// Takes over the flags that a newer frame contains.
    pub fn update(&mut self, newer: ArmStatus) {
        self.calibrated = newer.calibrated.or(self.calibrated);
        self.power_supply = newer.power_supply.or(self.power_supply);
        self.ready = newer.ready.or(self.ready);
    }
}

/// State of one grip in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct GripReport {
    pub id: String,
    /// World from handle.
    pub orientation: Option<Quat>,
    pub buttons: Option<u32>,
    /// The grip is known to be out of range or asleep.
    pub is_unavailable: bool,
}

/// Parses a state frame; `None` if it is invalid.
pub fn parse_frame(text: &str) -> Option<StateFrame> {
    let value: Value = serde_json::from_str(text).ok()?;
    let lists = value.as_object()?;
    let arms = device_list(lists, "inverse3")?.iter().map(parse_arm).collect::<Option<_>>()?;
    let mut grips: Vec<GripReport> = Vec::new();
    for list in ["wireless_verse_grip", "custom_verse_grip", "verse_grip"] {
        for value in device_list(lists, list)? {
            let grip = parse_grip(value)?;
            // The same grip may appear in two lists.
            if grips.iter().all(|other| other.id != grip.id) {
                grips.push(grip);
            }
        }
    }
    Some(StateFrame { arms, grips })
}

/// Returns a list of devices; empty if it is missing, `None` if it is not a list.
fn device_list<'a>(lists: &'a Map<String, Value>, name: &str) -> Option<&'a [Value]> {
    match lists.get(name) {
        None | Some(Value::Null) => Some(&[]),
        Some(list) => list.as_array().map(Vec::as_slice),
    }
}

fn parse_arm(value: &Value) -> Option<ArmReport> {
    let state = &value["state"];
    let position = parse_optional(&state["cursor_position"], parse_vector)?.map(position_in_world);
    let is_within_reach = position.is_none_or(|p| p.length() < REACH_MAX);
    let flag = |name: &str| value["status"][name].as_bool();
    is_within_reach.then_some(ArmReport {
        id: value["device_id"].as_str()?.to_string(),
        model: value.get("config").and_then(parse_model),
        position,
        rendered: parse_optional(&state["current_cursor_force"], parse_vector)?.map(world_from_service),
        status: ArmStatus { calibrated: flag("calibrated"), power_supply: flag("power_supply"), ready: flag("ready") },
    })
}

/// Distance from the middle of the workspace above which a position is invalid, mm: no arm of this family reaches a
/// metre.
const REACH_MAX: f32 = 1000.0;

fn parse_model(config: &Value) -> Option<HaplyModel> {
    let device_type = &config["device_info"]["device_type"];
    let name = config["type"].as_str().or(device_type.as_str()).unwrap_or_default();
    match (name, device_type.as_i64()) {
        ("inverse3", _) | ("", Some(4)) => Some(HaplyModel::Inverse3),
        ("inverse3x", _) => Some(HaplyModel::Inverse3x),
        ("minverse", _) | ("", Some(6)) => Some(HaplyModel::Minverse),
        _ => None,
    }
}

/// Names of a grip's buttons, in the order of their bits. A wired grip has a single button without a letter.
const BUTTONS: [&str; 10] = ["a", "b", "c", "d", "e", "f", "up", "down", "left", "right"];

fn parse_grip(value: &Value) -> Option<GripReport> {
    let state = &value["state"];
    let pressed = |name: &str| state["buttons"][name].as_bool();
    let named = BUTTONS.iter().enumerate().filter_map(|(bit, name)| Some(u32::from(pressed(name)?) << bit));
    let buttons = named.chain(state["button"].as_bool().map(u32::from)).reduce(|all, one| all | one);
    let is_down = |name: &str| value["status"][name].as_bool() == Some(false);
    Some(GripReport {
        id: value["device_id"].as_str()?.to_string(),
        orientation: parse_optional(&state["orientation"], parse_quaternion)?,
        buttons,
        is_unavailable: is_down("connected") || is_down("awake"),
    })
}

/// Returns `Some(None)` for a missing value (or `{}`, as transforms may be), and `None` for one that cannot be parsed.
fn parse_optional<T>(value: &Value, read: impl Fn(&Value) -> Option<T>) -> Option<Option<T>> {
    match value {
        Value::Null => Some(None),
        Value::Object(members) if members.is_empty() => Some(None),
        _ => read(value).map(Some),
    }
}

fn parse_vector(value: &Value) -> Option<[f64; 3]> {
    Some([value["x"].as_f64()?, value["y"].as_f64()?, value["z"].as_f64()?])
}

/// Returns a grip's orientation as that of a handle in world space.
///
/// The direction of a grip at rest is not published. The vendor's Euler order Z-X-Y rotates last about +Y, forward,
/// so +Y is taken as the direction of the working end. Then grip and handle differ by the same rotation as the two
/// spaces, and only the quaternion's axis changes.
fn parse_quaternion(value: &Value) -> Option<Quat> {
    let [x, y, z] = world_from_service(parse_vector(value)?).to_array();
    let rotation = Quat::from_xyzw(x, y, z, value["w"].as_f64()? as f32);
    let length = rotation.length();
    (0.9..1.1).contains(&length).then(|| rotation / length)
}

/// Middle of the workspace in the service's space, m, as in CHAI3D's fork for the Inverse3; the positions in the
/// vendor's samples are around it.
const WORKSPACE_CENTRE: [f64; 3] = [0.0, -0.15, 0.2];

fn position_in_world(in_service: [f64; 3]) -> Vec3 {
    let [x, y, z] = in_service;
    let [x0, y0, z0] = WORKSPACE_CENTRE;
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
        // Aim: missing members are no error and erase nothing. Method: frames as in the vendor's tests.
        assert_eq!(parse_frame("{}"), Some(StateFrame::default()));
        assert_eq!(parse_frame(r#"{"session_id": 4, "inverse3": null}"#), Some(StateFrame::default()));
        let bare =
            parse_frame(r#"{"inverse3": [{"device_id": "04BA", "state": {"transform": {}, "cursor_position": {}}}]}"#);
        let arm = &bare.unwrap().arms[0];
        assert_eq!((arm.position, arm.model, arm.status), (None, None, ArmStatus::default()));
    }

    #[test]
    fn a_position_is_read_into_world_space() {
        let text =
            r#"{"inverse3": [{"device_id": "04BA", "state": {"cursor_position": {"z": 0.21, "x": 0, "y": -0.17}}}]}"#;
        let position = parse_frame(text).unwrap().arms[0].position.unwrap();
        // 10 mm above the middle and 20 mm nearer to the user.
        assert!((position - Vec3::new(0.0, 10.0, 20.0)).length() < 1e-3, "{position}");
    }

    #[test]
    fn an_invalid_number_invalidates_the_frame() {
        let frame = |p: &str| format!(r#"{{"inverse3": [{{"device_id": "1", "state": {{"cursor_position": {p}}}}}]}}"#);
        let bad = [r#"{"x": 1e300, "y": 0, "z": 0}"#, r#"{"x": null, "y": 0, "z": 0}"#, r#"[0, 0, 0]"#, r#"{"x": 0}"#];
        for bad in bad {
            assert_eq!(parse_frame(&frame(bad)), None, "{bad}");
        }
        for text in ["", "<html>", "[]", r#"{"inverse3": "none"}"#, r#"{"inverse3": [{"state": {}}]}"#] {
            assert_eq!(parse_frame(text), None, "{text}");
        }
        let limp =
            r#"{"verse_grip": [{"device_id": "1", "state": {"orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}}]}"#;
        assert_eq!(parse_frame(limp), None);
    }

    #[test]
    fn grips_of_every_kind_are_read_once() {
        // Aim: buttons get their bits, and a grip that appears in two lists is one grip.
        let text = r#"{
            "verse_grip": [{"device_id": "w", "state": {"button": true}}],
            "wireless_verse_grip": [{"device_id": "r", "state": {"buttons": {"a": false, "c": true}, "battery_level": 1},
                                     "status": {"connected": false}}],
            "custom_verse_grip": [{"device_id": "r", "state": {"buttons": {"up": true}}}]}"#;
        let grips = parse_frame(text).unwrap().grips;
        let parsed: Vec<_> = grips.iter().map(|g| (g.id.as_str(), g.buttons, g.is_unavailable)).collect();
        assert_eq!(parsed, [("r", Some(0b100), true), ("w", Some(1), false)]);
    }

    #[test]
    fn models_are_recognized_by_name_or_number() {
        let check = |config: &str, expected: Option<HaplyModel>| {
            assert_eq!(parse_model(&serde_json::from_str(config).unwrap()), expected, "{config}");
        };
        check(r#"{"type": "minverse"}"#, Some(HaplyModel::Minverse));
        check(r#"{"type": "inverse3x", "device_info": {"device_type": 4}}"#, Some(HaplyModel::Inverse3x));
        check(r#"{"device_info": {"device_type": 6}}"#, Some(HaplyModel::Minverse));
        check(r#"{"device_info": {"device_type": "inverse3"}}"#, Some(HaplyModel::Inverse3));
        check(r#"{}"#, None);
    }
}
