//! Poses over UDP, from any tracker that can send a line of JSON: a hand without force.
//!
//! Takes the address to listen on. Gives a device behind a relay that follows the newest pose. Never answers the
//! sender, and never accepts a datagram that differs from `content/devices/stream.md`. DentSim's trackers reach the
//! program this way.

use crate::{DeviceReport, Driver, FoundDevice, OpenError, Protocol, Relay};
use serde::Deserialize;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};

/// Driver of pose streams.
pub struct StreamDriver;

const ADDRESS: &str = "127.0.0.1:7400";

impl Driver for StreamDriver {
    fn name(&self) -> &'static str {
        "stream"
    }

    fn description(&self) -> &'static str {
        "poses sent by a tracker over UDP, without force (content/devices/stream.md); the argument is the address to \
         listen on (127.0.0.1:7400 by default)"
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        Ok(vec![FoundDevice {
            title: format!("any tracker that sends poses to UDP {ADDRESS}"),
            argument: String::new(),
        }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let address = argument.filter(|a| !a.is_empty()).unwrap_or(ADDRESS);
        let cannot_listen = |error: io::Error| {
            OpenError::new(
                format!("cannot listen on UDP {address} ({error})"),
                "give an address of this machine and a free port, as in stream:127.0.0.1:7400; with 0.0.0.0 it also \
                 listens to other machines",
            )
        };
        let socket = UdpSocket::bind(address).map_err(cannot_listen)?;
        socket.set_read_timeout(Some(RECEIVE_TIMEOUT)).map_err(cannot_listen)?;
        Ok(Box::new(Relay::start(PoseStreamProtocol::new(socket))))
    }
}

/// One datagram as the sender writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Datagram {
    t_s: f64,
    position_mm: [f32; 3],
    orientation_xyzw: Option<[f32; 4]>,
    #[serde(default)]
    buttons: u32,
}

struct PoseStreamProtocol {
    socket: UdpSocket,
    spec: DeviceSpec,
    timestamps: TimestampOrder,
    /// Address of the current sender, and the time of its last pose.
    sender: Option<(SocketAddr, Instant)>,
    rejected: i32,
    reject_streak: Option<RejectStreak>,
}

/// Consecutive datagrams refused.
struct RejectStreak {
    since: Instant,
    count: u32,
}

/// Longest wait for a datagram: half of what the relay allows a protocol.
const RECEIVE_TIMEOUT: Duration = Duration::from_millis(10);

/// Buffer for a datagram; the longest valid one has about 300 characters.
const DATAGRAM_MAX: usize = 2048;

/// Datagrams read per exchange at most. More in the queue mean that somebody floods the port.
const MAX_PER_POLL: usize = 256;

/// Time and number of consecutive refusals after which the device reports an error. A few may be stray datagrams.
const REJECT_TIMEOUT: Duration = Duration::from_millis(200);
const REFUSED_DATAGRAMS_MAX: u32 = 10;

/// Time after its last pose for which a sender keeps the port to itself: with two hands in one stream the hand would
/// jump back and forth.
const SENDER_TIMEOUT: Duration = Duration::from_millis(100);

impl PoseStreamProtocol {
    fn new(socket: UdpSocket) -> PoseStreamProtocol {
        // No force is rendered; the simulation uses the Omni's spring, so that the same motion cuts alike on both.
        let spec = DeviceSpec { name: "pose stream, no force".into(), ..DeviceSpec::phantom_omni() };
        PoseStreamProtocol {
            socket,
            spec,
            timestamps: TimestampOrder::default(),
            sender: None,
            rejected: 0,
            reject_streak: None,
        }
    }
}

impl Protocol for PoseStreamProtocol {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// Always [`Pacing::Host`]: trackers are slower than the servo, most of them by far.
    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    fn exchange(&mut self, _: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        if let Some(reading) = self.read_newest().map_err(|error| device_lost(&error))? {
            return Ok(Some(DeviceReport { reading, state: DeviceState::Ready }));
        }
        if self
            .reject_streak
            .as_ref()
            .is_some_and(|row| row.count > REFUSED_DATAGRAMS_MAX && row.since.elapsed() > REJECT_TIMEOUT)
        {
            let why = "the datagrams are not poses as content/devices/stream.md defines them; the code is their number";
            return Err(DeviceError::Lost { why, code: self.rejected });
        }
        let how = "start the sender: no pose has been received yet";
        let waiting = DeviceReport { reading: Reading::ABSENT, state: DeviceState::Calibrate { how } };
        Ok(self.sender.is_none().then_some(waiting))
    }

    fn close(&mut self) {}
}

impl PoseStreamProtocol {
    /// Returns the newest pose that arrives within the time-out; drops the older ones.
    fn read_newest(&mut self) -> io::Result<Option<Reading>> {
        let mut newest = None;
        let mut datagram = [0; DATAGRAM_MAX];
        for drained in 0..MAX_PER_POLL {
            // Wait for the first datagram only.
            self.socket.set_nonblocking(drained > 0)?;
            match self.socket.recv_from(&mut datagram) {
                Ok((length, from)) => newest = self.accept(&datagram[..length], from).or(newest),
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => break,
                Err(error) => return Err(error),
            }
        }
        Ok(newest)
    }

    fn accept(&mut self, datagram: &[u8], from: SocketAddr) -> Option<Reading> {
        let is_another = self.sender.is_some_and(|(sender, at)| sender != from && at.elapsed() < SENDER_TIMEOUT);
        let (t_s, reading) = parse_datagram(datagram).filter(|_| !is_another).or_else(|| {
            self.rejected = self.rejected.saturating_add(1);
            self.reject_streak.get_or_insert(RejectStreak { since: Instant::now(), count: 0 }).count += 1;
            None
        })?;
        if self.sender.is_none_or(|(sender, _)| sender != from) {
            self.timestamps = TimestampOrder::default();
        }
        self.sender = Some((from, Instant::now()));
        self.reject_streak = None;
        self.timestamps.is_next(t_s).then_some(reading)
    }
}

/// Parses a datagram; `None` if any key is unknown or missing, or any value is not a finite number.
fn parse_datagram(datagram: &[u8]) -> Option<(f64, Reading)> {
    let Datagram { t_s, position_mm, orientation_xyzw, buttons } = serde_json::from_slice(datagram).ok()?;
    let given = orientation_xyzw.map(Quat::from_array);
    let is_unit = given.is_none_or(|turn| (turn.length() - 1.0).abs() < 0.01);
    let pose = Pose { position: Vec3::from(position_mm), orientation: given.map_or(UPRIGHT, Quat::normalize) };
    (is_unit && t_s.is_finite() && pose.is_valid()).then_some((t_s, Reading { pose, buttons }))
}

/// Newest time stamp of the sender.
#[derive(Default)]
struct TimestampOrder {
    newest_s: Option<f64>,
}

/// A time stamp further back than this means that the sender was restarted: no network delays a datagram for so long,
/// s.
const RESTART_S: f64 = 1.0;

impl TimestampOrder {
    fn is_next(&mut self, t_s: f64) -> bool {
        let is_next = self.newest_s.is_none_or(|newest| t_s > newest || t_s < newest - RESTART_S);
        if is_next {
            self.newest_s = Some(t_s);
        }
        is_next
    }
}

fn device_lost(error: &io::Error) -> DeviceError {
    let why = "reading from the port failed; open the stream again";
    DeviceError::Lost { why, code: error.raw_os_error().unwrap_or(0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_complete_poses_are_accepted() {
        // Aim: no datagram with anything unknown, missing or not finite reaches the hand. Method: one valid datagram,
        // and copies with one error each.
        let (t_s, reading) = parse_datagram(br#"{"t_s": 1.25, "position_mm": [1, -2.5, 3e1]}"#).unwrap();
        assert_eq!((t_s, reading.pose.position), (1.25, Vec3::new(1.0, -2.5, 30.0)));
        assert_eq!((reading.pose.orientation, reading.buttons), (UPRIGHT, 0));
        let turned = br#"{"t_s":0,"position_mm":[0,0,0],"orientation_xyzw":[0,0,1.004,0],"buttons":5}"#;
        let (_, turned) = parse_datagram(turned).unwrap();
        assert_eq!((turned.pose.orientation, turned.buttons), (Quat::from_xyzw(0.0, 0.0, 1.0, 0.0), 5));
        for bad in [
            "",
            "null",
            "[1, 2, 3]",
            r#"{"position_mm": [0, 0, 0]}"#,
            r#"{"t_s": 1}"#,
            r#"{"t_s": 1, "position_mm": [0, 0]}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, null]}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 1e39]}"#,
            r#"{"t_s": 1e999, "position_mm": [0, 0, 0]}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 0], "orientation_xyzw": [0, 0, 0, 0]}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 0], "orientation_xyzw": [0, 0, 0, 1.1]}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 0], "buttons": -1}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 0], "speed": 1}"#,
            r#"{"t_s": 1, "position_mm": [0, 0, 0]} {"#,
        ] {
            assert!(parse_datagram(bad.as_bytes()).is_none(), "{bad}");
        }
    }

    #[test]
    fn datagrams_out_of_order_are_dropped_until_the_sender_restarts() {
        let mut order = TimestampOrder::default();
        let taken = [5.0, 5.001, 5.001, 4.9, 5.002, 0.0, 0.001].map(|t_s| order.is_next(t_s));
        assert_eq!(taken, [true, true, false, false, true, true, true]);
    }

    #[test]
    fn refusals_are_counted_and_a_second_sender_is_refused() {
        let mut listener = PoseStreamProtocol::new(UdpSocket::bind("127.0.0.1:0").unwrap());
        let (here, there) = ("127.0.0.1:1".parse().unwrap(), "127.0.0.1:2".parse().unwrap());
        let pose = br#"{"t_s": 1, "position_mm": [0, 0, 0]}"#;
        assert!(listener.accept(pose, here).is_some());
        assert!(listener.accept(br#"{"t_s": 2}"#, here).is_none());
        assert!(listener.accept(pose, there).is_none());
        assert_eq!(listener.rejected, 2);
    }
}
