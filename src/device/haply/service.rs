//! The connection to the Inverse Service: its version over HTTP, then frames over a WebSocket.
//!
//! Takes host:port. Gives one state frame for one frame sent, in lockstep: a second frame sent before the first is answered
//! would stay in the queue, and every answer be one tick late for good. Never knows what the frames say.

use super::protocol::{self, ForceKey, Frame};
use crate::device::Trouble;
use serde_json::Value;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};
use tungstenite::{Error, Message, WebSocket};

pub struct Service {
    socket: WebSocket<TcpStream>,
    /// `None` where the service did not say, as those before 3.5 do not on this port.
    pub version: Option<(u32, u32)>,
    /// When the frame went out that is still to be answered.
    asked: Option<Instant>,
}

/// What came back.
pub enum Heard {
    /// The answer, and how long it took.
    Answer { text: String, after: Duration },
    /// Nothing within [`HEAR_WAIT`]; the frame stays unanswered.
    Nothing,
}

/// How long one wait for an answer lasts: the relay asks wires to be back within about so much.
const HEAR_WAIT: Duration = Duration::from_millis(20);

/// How long the service may take to accept, to greet and to describe its devices.
const OPEN_WAIT: Duration = Duration::from_secs(2);

impl Service {
    /// Connects, and reads the snapshot with which the service greets.
    pub fn connect(address: &str) -> Result<(Service, Frame), Trouble> {
        let candidates: Vec<SocketAddr> = address.to_socket_addrs().map(Iterator::collect).map_err(|error| {
            Trouble::new(
                format!("\"{address}\" is no address ({error})"),
                "write host:port, as in haply:localhost:10001",
            )
        })?;
        let version = version(&candidates, address);
        if version.is_some_and(|v| v < OLDEST) {
            let (major, minor) = version.unwrap_or_default();
            let help = "update the Inverse Service to 3.1 or later";
            return Err(Trouble::new(format!("the Inverse Service is of version {major}.{minor}"), help));
        }
        let stream = reach(&candidates).map_err(|error| {
            let help =
                "start the Inverse Service (Haply's Device Manager does, or systemctl start haply-inverse-service)";
            Trouble::new(format!("no Inverse Service answers at {address} ({error})"), help)
        })?;
        let no_service = |what: &dyn std::fmt::Display| {
            let help = "give the port of its WebSocket, 10001 unless its settings say otherwise";
            Trouble::new(format!("what answers at {address} is not the Inverse Service ({what})"), help)
        };
        let (socket, _) = tungstenite::client(format!("ws://{address}/"), stream).map_err(|e| no_service(&e))?;
        let mut service = Service { socket, version, asked: Some(Instant::now()) };
        let snapshot = service.answer_within(OPEN_WAIT).map_err(|e| no_service(&e))?;
        let snapshot = protocol::frame(&snapshot).ok_or_else(|| no_service(&"it greets with something else"))?;
        let stream = service.socket.get_ref();
        stream.set_read_timeout(Some(HEAR_WAIT)).map_err(|e| no_service(&e))?;
        stream.set_write_timeout(Some(HEAR_WAIT)).map_err(|e| no_service(&e))?;
        Ok((service, snapshot))
    }

    /// The name of a force to try first.
    pub fn likely_key(&self) -> ForceKey {
        match self.version {
            Some(version) if version >= FIRST_WITH_VECTOR => ForceKey::Vector,
            _ => ForceKey::Values,
        }
    }

    /// Asks for every device with its config, and waits for the answer.
    pub fn full_state(&mut self) -> Result<Frame, Trouble> {
        let silent = |what: &dyn std::fmt::Display| {
            Trouble::new(format!("the Inverse Service does not describe its devices ({what})"), "restart it")
        };
        self.ask(protocol::FULL_STATE).map_err(|e| silent(&e))?;
        let text = self.answer_within(OPEN_WAIT).map_err(|e| silent(&e))?;
        protocol::frame(&text).ok_or_else(|| silent(&"its answer cannot be read"))
    }

    pub fn is_answered(&self) -> bool {
        self.asked.is_none()
    }

    /// Sends a frame. The one before must have been answered.
    pub fn ask(&mut self, text: &str) -> Result<(), Box<Error>> {
        debug_assert!(self.is_answered(), "a frame before the last one was answered");
        self.asked = Some(Instant::now());
        self.socket.send(Message::text(text)).map_err(Box::new)
    }

    /// Waits a moment for the answer to the last frame.
    pub fn hear(&mut self) -> Result<Heard, Box<Error>> {
        let until = Instant::now() + HEAR_WAIT;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(self.answered(text.to_string())),
                // No frame of this service; it stands in for the answer, and will not be understood.
                Ok(Message::Binary(_)) => return Ok(self.answered(String::new())),
                Ok(Message::Close(_)) => return Err(Box::new(Error::ConnectionClosed)),
                Ok(_) => {}
                Err(Error::Io(error)) if is_timeout(&error) => return Ok(Heard::Nothing),
                Err(error) => return Err(Box::new(error)),
            }
            if Instant::now() >= until {
                return Ok(Heard::Nothing);
            }
        }
    }

    /// Ends the connection; the device lets go, for a force lasts one tick only.
    pub fn close(&mut self) {
        // A connection that is broken already is as closed as it can be.
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }

    fn answered(&mut self, text: String) -> Heard {
        let after = self.asked.take().map_or(Duration::ZERO, |at| at.elapsed());
        Heard::Answer { text, after }
    }

    fn answer_within(&mut self, wait: Duration) -> Result<String, Box<Error>> {
        let until = Instant::now() + wait;
        loop {
            match self.hear()? {
                Heard::Answer { text, .. } => return Ok(text),
                Heard::Nothing if Instant::now() < until => {}
                Heard::Nothing => return Err(Box::new(Error::Io(io::ErrorKind::TimedOut.into()))),
            }
        }
    }
}

/// The first version that speaks WebSocket as it is spoken here.
const OLDEST: (u32, u32) = (3, 1);

/// The first version that calls a force `vector`.
const FIRST_WITH_VECTOR: (u32, u32) = (3, 5);

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

fn reach(candidates: &[SocketAddr]) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
    for address in candidates {
        match TcpStream::connect_timeout(address, OPEN_WAIT) {
            Ok(stream) => {
                // Frames are small and each waits for the last one's answer: collecting them would ruin the rhythm.
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(OPEN_WAIT))?;
                stream.set_write_timeout(Some(OPEN_WAIT))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Longest answer to `GET /version` that is read: the vendor's has some 300 characters.
const VERSION_MAX: u64 = 16 * 1024;

/// What `GET /version` says. Services before 3.5 answer on another port or not at all: that is no trouble.
fn version(candidates: &[SocketAddr], host: &str) -> Option<(u32, u32)> {
    let mut stream = reach(candidates).ok()?;
    let request =
        format!("GET /version HTTP/1.1\r\nHost: {host}\r\nAccept: application/json\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).ok()?;
    let mut answer = Vec::new();
    // A server that keeps the connection open runs into the time-out, with its answer already here.
    let _ = stream.take(VERSION_MAX).read_to_end(&mut answer);
    let answer = String::from_utf8_lossy(&answer);
    let (_, body) = answer.split_once("\r\n\r\n")?;
    // From brace to brace, in case the body comes in one chunk with its length around it.
    let body = &body[body.find('{')?..=body.rfind('}')?];
    project_version(&serde_json::from_str(body).ok()?)
}

/// Bare, or in the envelope of the newer services.
fn project_version(answer: &Value) -> Option<(u32, u32)> {
    let text = answer.get("data").unwrap_or(answer)["project_version"].as_str()?;
    let mut numbers = text.split(|c: char| !c.is_ascii_digit()).map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_bare_and_in_an_envelope() {
        let check = |answer: &str, expected| {
            assert_eq!(project_version(&serde_json::from_str(answer).unwrap()), expected, "{answer}");
        };
        check(r#"{"project_version": "3.1.1.0", "project_name": "haply-inverse-service"}"#, Some((3, 1)));
        check(r#"{"ok": true, "data": {"project_version": "3.10.0-beta"}}"#, Some((3, 10)));
        check(r#"{"ok": false, "error": "no"}"#, None);
        check(r#"{"project_version": "v?"}"#, None);
    }
}
