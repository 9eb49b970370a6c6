//! Poses over UDP, from any tracker that can send a line of JSON: a hand without force.
//!
//! Takes the address to listen on. Gives a device behind a relay that follows the newest pose. Never answers the sender, and
//! takes nothing that is not exactly as `content/devices/stream.md` says. This is how DentSim's trackers reach its program.

use super::{Beat, Device, Driver, Found, Gone, Output, Reading, Relay, Report, Spec, State, Trouble, UPRIGHT, Wire};
use crate::frame::{Pose, Quat, Vec3};
use serde::Deserialize;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

pub struct Stream;

const ADDRESS: &str = "127.0.0.1:7400";

impl Driver for Stream {
    fn name(&self) -> &'static str {
        "stream"
    }

    fn about(&self) -> &'static str {
        "poses that a tracker sends over UDP, without force (content/devices/stream.md); the argument is the address to \
         listen on (127.0.0.1:7400 unless told)"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        Ok(vec![Found { title: format!("whatever sends poses to UDP {ADDRESS}"), argument: String::new() }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let address = argument.filter(|a| !a.is_empty()).unwrap_or(ADDRESS);
        let cannot_listen = |error: io::Error| {
            Trouble::new(
                format!("cannot listen on UDP {address} ({error})"),
                "give an address of this machine and a free port, as in stream:127.0.0.1:7400; 0.0.0.0 listens to other \
                 machines too",
            )
        };
        let socket = UdpSocket::bind(address).map_err(cannot_listen)?;
        socket.set_read_timeout(Some(LISTEN_FOR)).map_err(cannot_listen)?;
        Ok(Box::new(Relay::start(Listener::on(socket))))
    }
}

/// One datagram, as the sender writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Datagram {
    t_s: f64,
    position_mm: [f32; 3],
    orientation_xyzw: Option<[f32; 4]>,
    #[serde(default)]
    buttons: u32,
}

struct Listener {
    socket: UdpSocket,
    spec: Spec,
    order: Order,
    /// Whom to listen to, and when a pose last came from there.
    sender: Option<(SocketAddr, Instant)>,
    refused: i32,
    row: Option<Row>,
}

/// Datagrams refused with no good one among them.
struct Row {
    since: Instant,
    count: u32,
}

/// How long one wait lasts: half of what the relay asks of wires.
const LISTEN_FOR: Duration = Duration::from_millis(10);

/// The longest datagram of sense has some 300 characters.
const DATAGRAM_MAX: usize = 2048;

/// Datagrams read in one turn: more in the queue than this, and somebody floods the port.
const DRAINED_MAX: usize = 256;

/// How long and how many datagrams may be refused with no good one among them, until that is said. A few may be strays.
const REFUSED_FOR: Duration = Duration::from_millis(200);
const REFUSED_MAX: u32 = 10;

/// How long a sender keeps the port to itself after its last pose: two hands in one stream would jump to and fro.
const SENDER_LIFE: Duration = Duration::from_millis(100);

impl Listener {
    fn on(socket: UdpSocket) -> Listener {
        // No force is rendered; the simulation's own spring is the Omni's, so that the same hand cuts alike on both.
        let spec = Spec { name: "pose stream, no force".into(), ..Spec::phantom_omni() };
        Listener { socket, spec, order: Order::default(), sender: None, refused: 0, row: None }
    }
}

impl Wire for Listener {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// Trackers are slower than the servo, most of them by far.
    fn beat(&self) -> Beat {
        Beat::Ours
    }

    fn turn(&mut self, _: &Output) -> Result<Option<Report>, Gone> {
        if let Some(reading) = self.newest().map_err(|error| lost(&error))? {
            return Ok(Some(Report { reading, state: State::Ready }));
        }
        if self.row.as_ref().is_some_and(|row| row.count > REFUSED_MAX && row.since.elapsed() > REFUSED_FOR) {
            let why = "what arrives are no poses as content/devices/stream.md says; the code counts them";
            return Err(Gone::Lost { why, code: self.refused });
        }
        let how = "start the sender: no pose has arrived yet";
        let waiting = Report { reading: Reading::ABSENT, state: State::Calibrate { how } };
        Ok(self.sender.is_none().then_some(waiting))
    }

    fn close(&mut self) {}
}

impl Listener {
    /// The newest pose that arrives within a moment, the others forgotten.
    fn newest(&mut self) -> io::Result<Option<Reading>> {
        let mut newest = None;
        let mut datagram = [0; DATAGRAM_MAX];
        for drained in 0..DRAINED_MAX {
            // The first is waited for; what else lies in the queue is not.
            self.socket.set_nonblocking(drained > 0)?;
            match self.socket.recv_from(&mut datagram) {
                Ok((length, from)) => newest = self.take(&datagram[..length], from).or(newest),
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => break,
                Err(error) => return Err(error),
            }
        }
        Ok(newest)
    }

    fn take(&mut self, datagram: &[u8], from: SocketAddr) -> Option<Reading> {
        let is_another = self.sender.is_some_and(|(sender, at)| sender != from && at.elapsed() < SENDER_LIFE);
        let (t_s, reading) = read(datagram).filter(|_| !is_another).or_else(|| {
            self.refused = self.refused.saturating_add(1);
            self.row.get_or_insert(Row { since: Instant::now(), count: 0 }).count += 1;
            None
        })?;
        if self.sender.is_none_or(|(sender, _)| sender != from) {
            self.order = Order::default();
        }
        self.sender = Some((from, Instant::now()));
        self.row = None;
        self.order.is_next(t_s).then_some(reading)
    }
}

/// What a datagram says; `None` if anything in it is unknown, missing or no number.
fn read(datagram: &[u8]) -> Option<(f64, Reading)> {
    let Datagram { t_s, position_mm, orientation_xyzw, buttons } = serde_json::from_slice(datagram).ok()?;
    let given = orientation_xyzw.map(Quat::from_array);
    let is_unit = given.is_none_or(|turn| (turn.length() - 1.0).abs() < 0.01);
    let pose = Pose { position: Vec3::from(position_mm), orientation: given.map_or(UPRIGHT, Quat::normalize) };
    (is_unit && t_s.is_finite() && pose.is_sound()).then_some((t_s, Reading { pose, buttons }))
}

/// Which of the sender's times is newest.
#[derive(Default)]
struct Order {
    newest_s: Option<f64>,
}

/// A time further back than this is a sender that started anew: no network holds a datagram for so long.
const RESTART_S: f64 = 1.0;

impl Order {
    fn is_next(&mut self, t_s: f64) -> bool {
        let is_next = self.newest_s.is_none_or(|newest| t_s > newest || t_s < newest - RESTART_S);
        if is_next {
            self.newest_s = Some(t_s);
        }
        is_next
    }
}

fn lost(error: &io::Error) -> Gone {
    let why = "the system gives nothing from the port any more: open the stream again";
    Gone::Lost { why, code: error.raw_os_error().unwrap_or(0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_poses_are_taken() {
        // Aim: nothing that is unknown, missing or no number reaches the hand. Method: one good datagram, and its like with
        // one thing wrong each.
        let (t_s, reading) = read(br#"{"t_s": 1.25, "position_mm": [1, -2.5, 3e1]}"#).unwrap();
        assert_eq!((t_s, reading.pose.position), (1.25, Vec3::new(1.0, -2.5, 30.0)));
        assert_eq!((reading.pose.orientation, reading.buttons), (UPRIGHT, 0));
        let turned = br#"{"t_s":0,"position_mm":[0,0,0],"orientation_xyzw":[0,0,1.004,0],"buttons":5}"#;
        let (_, turned) = read(turned).unwrap();
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
            assert!(read(bad.as_bytes()).is_none(), "{bad}");
        }
    }

    #[test]
    fn what_comes_out_of_order_is_dropped_until_the_sender_starts_anew() {
        let mut order = Order::default();
        let taken = [5.0, 5.001, 5.001, 4.9, 5.002, 0.0, 0.001].map(|t_s| order.is_next(t_s));
        assert_eq!(taken, [true, true, false, false, true, true, true]);
    }

    #[test]
    fn refusals_are_counted_and_a_second_sender_is_refused() {
        let mut listener = Listener::on(UdpSocket::bind("127.0.0.1:0").unwrap());
        let (here, there) = ("127.0.0.1:1".parse().unwrap(), "127.0.0.1:2".parse().unwrap());
        let pose = br#"{"t_s": 1, "position_mm": [0, 0, 0]}"#;
        assert!(listener.take(pose, here).is_some());
        assert!(listener.take(br#"{"t_s": 2}"#, here).is_none());
        assert!(listener.take(pose, there).is_none());
        assert_eq!(listener.refused, 2);
    }
}
