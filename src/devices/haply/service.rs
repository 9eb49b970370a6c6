//! Connection to the Inverse Service: its version over HTTP, then frames over a WebSocket.
//!
//! Takes host:port. Gives one state frame per frame sent, in lockstep: a second frame sent before the first is
//! answered would stay in the queue, and every later reply would be one tick late. Never interprets the frames.

use crate::OpenError;
use crate::haply::messages;
use crate::haply::messages::{ForceKey, StateFrame};
use serde_json::Value;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};
use tungstenite::{Error, Message, WebSocket};

/// A connection to the Inverse Service.
pub struct InverseService {
    socket: WebSocket<TcpStream>,
    /// `None` if the service did not report it; versions before 3.5 do not, on this port.
    pub version: Option<(u32, u32)>,
    /// Time at which the frame was sent that has not been answered yet.
    sent_at: Option<Instant>,
}

/// Result of waiting for a reply.
pub enum ServiceReply {
    /// A reply, and the time since the frame was sent.
    Answer { text: String, elapsed: Duration },
    /// No reply within [`REPLY_TIMEOUT`]; the frame stays unanswered.
    Nothing,
}

/// Time for which one wait for a reply lasts: the relay requires a protocol to return within about this time.
const REPLY_TIMEOUT: Duration = Duration::from_millis(20);

/// Time within which the service must accept the connection, send its first frame and describe its devices.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(2);

/// Remedy for a service that is not running, in the words of the system.
const START: &str = if cfg!(windows) {
    "start the Inverse Service in Haply's Device Manager, or \"Haply Inverse Service\" in Windows' Services (services.msc)"
} else if cfg!(target_os = "macos") {
    "start the Inverse Service in Haply's Device Manager"
} else {
    "start the Inverse Service in Haply's Device Manager, or by `systemctl start haply-inverse-service`"
};

impl InverseService {
    /// Connects, and reads the snapshot that the service sends first.
    ///
    /// # Errors
    ///
    /// Returns an error if the address is invalid, if the service does not respond or is too old, or if another
    /// server responds.
    pub fn connect(address: &str) -> Result<(InverseService, StateFrame), OpenError> {
        let candidates: Vec<SocketAddr> = address.to_socket_addrs().map(Iterator::collect).map_err(|error| {
            OpenError::new(
                format!("\"{address}\" is not an address ({error})"),
                "use host:port, as in haply:localhost:10001",
            )
        })?;
        let version = query_version(&candidates, address);
        if version.is_some_and(|v| v < MIN_VERSION) {
            let (major, minor) = version.unwrap_or_default();
            let help = "update the Inverse Service to 3.1 or later";
            return Err(OpenError::new(format!("the Inverse Service has version {major}.{minor}"), help));
        }
        let stream = connect_any(&candidates).map_err(|error| {
            OpenError::absent(format!("cannot reach the Inverse Service at {address} ({error})"), START)
        })?;
        let no_service = |what: &dyn std::fmt::Display| {
            let help = "give the port of its WebSocket, 10001 by default";
            OpenError::new(format!("the server at {address} is not the Inverse Service ({what})"), help)
        };
        let (socket, _) = tungstenite::client(format!("ws://{address}/"), stream).map_err(|e| no_service(&e))?;
        let mut service = InverseService { socket, version, sent_at: Some(Instant::now()) };
        let snapshot = service.receive_within(CONNECT_TIMEOUT).map_err(|e| no_service(&e))?;
        let snapshot =
            messages::parse_frame(&snapshot).ok_or_else(|| no_service(&"its first message is not a state frame"))?;
        let stream = service.socket.get_ref();
        stream.set_read_timeout(Some(REPLY_TIMEOUT)).map_err(|e| no_service(&e))?;
        stream.set_write_timeout(Some(REPLY_TIMEOUT)).map_err(|e| no_service(&e))?;
        Ok((service, snapshot))
    }

    /// Returns the key name for forces to try first.
    pub fn default_force_key(&self) -> ForceKey {
        match self.version {
            Some(version) if version >= FIRST_WITH_VECTOR => ForceKey::Vector,
            _ => ForceKey::Values,
        }
    }

    /// Requests all devices with their configuration, and waits for the reply.
    ///
    /// # Errors
    ///
    /// Returns an error if the service does not reply in time, or if the reply cannot be parsed.
    pub fn full_state(&mut self) -> Result<StateFrame, OpenError> {
        let silent = |what: &dyn std::fmt::Display| {
            OpenError::new(format!("the Inverse Service did not describe its devices ({what})"), "restart it")
        };
        self.send(messages::FULL_STATE_REQUEST).map_err(|e| silent(&e))?;
        let text = self.receive_within(CONNECT_TIMEOUT).map_err(|e| silent(&e))?;
        messages::parse_frame(&text).ok_or_else(|| silent(&"its reply cannot be read"))
    }

    /// Returns whether no frame is waiting for its reply.
    pub fn is_answered(&self) -> bool {
        self.sent_at.is_none()
    }

    /// Sends a frame. The previous one must have been answered.
    ///
    /// # Errors
    ///
    /// Returns an error if the connection fails.
    pub fn send(&mut self, text: &str) -> Result<(), Box<Error>> {
        debug_assert!(self.is_answered(), "a frame was sent before the last one was answered");
        self.sent_at = Some(Instant::now());
        self.socket.send(Message::text(text)).map_err(Box::new)
    }

    /// Waits for the reply to the last frame, up to [`REPLY_TIMEOUT`].
    ///
    /// # Errors
    ///
    /// Returns an error if the connection fails or is closed.
    pub fn receive(&mut self) -> Result<ServiceReply, Box<Error>> {
        let until = Instant::now() + REPLY_TIMEOUT;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(self.take_answer(text.to_string())),
                // Not a frame of this service: pass on an empty reply, which the parser rejects.
                Ok(Message::Binary(_)) => return Ok(self.take_answer(String::new())),
                Ok(Message::Close(_)) => return Err(Box::new(Error::ConnectionClosed)),
                Ok(_) => {}
                Err(Error::Io(error)) if is_timeout(&error) => return Ok(ServiceReply::Nothing),
                Err(error) => return Err(Box::new(error)),
            }
            if Instant::now() >= until {
                return Ok(ServiceReply::Nothing);
            }
        }
    }

    /// Closes the connection; the device then renders no force, because a force holds for one tick only.
    pub fn close(&mut self) {
        // If the connection is broken already, nothing remains to be done.
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }

    fn take_answer(&mut self, text: String) -> ServiceReply {
        let elapsed = self.sent_at.take().map_or(Duration::ZERO, |at| at.elapsed());
        ServiceReply::Answer { text, elapsed }
    }

    fn receive_within(&mut self, wait: Duration) -> Result<String, Box<Error>> {
        let until = Instant::now() + wait;
        loop {
            match self.receive()? {
                ServiceReply::Answer { text, .. } => return Ok(text),
                ServiceReply::Nothing if Instant::now() < until => {}
                ServiceReply::Nothing => return Err(Box::new(Error::Io(io::ErrorKind::TimedOut.into()))),
            }
        }
    }
}

/// The first version with the WebSocket protocol used here.
const MIN_VERSION: (u32, u32) = (3, 1);

/// The first version with the force key `vector`.
const FIRST_WITH_VECTOR: (u32, u32) = (3, 5);

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

fn connect_any(candidates: &[SocketAddr]) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
    for address in candidates {
        match TcpStream::connect_timeout(address, CONNECT_TIMEOUT) {
            Ok(stream) => {
                // Frames are small, and each waits for the last reply: delaying them to combine packets would break
                // the rate.
                stream.set_nodelay(true)?;
                stream.set_read_timeout(Some(CONNECT_TIMEOUT))?;
                stream.set_write_timeout(Some(CONNECT_TIMEOUT))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Bytes read of the answer to `GET /version` at most: the vendor's has about 300 characters.
const VERSION_RESPONSE_MAX: u64 = 16 * 1024;

/// Queries `GET /version`. Services before 3.5 answer on another port or not at all; that is no error.
fn query_version(candidates: &[SocketAddr], host: &str) -> Option<(u32, u32)> {
    let mut stream = connect_any(candidates).ok()?;
    let request =
        format!("GET /version HTTP/1.1\r\nHost: {host}\r\nAccept: application/json\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).ok()?;
    let mut answer = Vec::new();
    // If the server keeps the connection open, the read times out with the answer already in the buffer.
    let _ = stream.take(VERSION_RESPONSE_MAX).read_to_end(&mut answer);
    let answer = String::from_utf8_lossy(&answer);
    let (_, body) = answer.split_once("\r\n\r\n")?;
    // From brace to brace, in case the body is chunked and surrounded by its length.
    let body = &body[body.find('{')?..=body.rfind('}')?];
    project_version(&serde_json::from_str(body).ok()?)
}

/// Returns the version from a plain answer, or from the envelope that newer services use.
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
