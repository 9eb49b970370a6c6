//! PulseAudio's native protocol, which PipeWire speaks too.
//!
//! Takes a socket. Gives a stream that fills whatever the server asks for. Needs no library of the system; waits only on its
//! own thread, and nowhere for long.

use super::player::{BLOCK, Heard, LISTEN_FOR, Output, Shared, Silence};
use super::synth::Synth;
use pulseaudio::protocol::{
    self, AuthParams, AuthReply, ChannelMap, ChannelVolume, Command, CommandReply, CreatePlaybackStreamReply,
    DEFAULT_SINK, MAX_VERSION, PlaybackStreamParams, Prop, Props, ProtocolError, SampleFormat, SampleSpec,
    SetClientNameReply, TagStructReader,
};
use std::ffi::CString;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Samples a second. A server with another rate resamples.
const RATE: u32 = 48_000;

/// Bytes of a sample: 32-bit floats.
const SAMPLE: usize = 4;

/// How long a server may take to answer.
const ANSWERS_WITHIN: Duration = Duration::from_secs(1);

/// A server that wants nothing for so many waits, 3 s, has stopped working.
const WAITS_MAX: u32 = 60;

/// A message longer than this is none: those we get have some hundred bytes.
const MESSAGE_MAX: u32 = 1 << 16;

/// The smallest amount that a server shall ask for, of the whole latency: a fifth leaves it time to ask again.
const REQUEST_SHARE: u32 = 5;

/// A server that plays what we send.
pub struct Stream {
    wire: Wire,
    path: PathBuf,
    channel: u32,
    latency: Duration,
    /// Bytes the server wants at once.
    wanted: usize,
    is_suspended: bool,
}

impl Stream {
    pub fn open(output: &Output) -> Result<Stream, Silence> {
        let path = match &output.server {
            Some(path) => path.clone(),
            None => pulseaudio::socket_path_from_env().ok_or_else(no_server)?,
        };
        let socket = UnixStream::connect(&path).map_err(|error| Silence::None {
            why: format!(
                "nobody answers at {} ({error}); start PipeWire or PulseAudio, or have PULSE_SERVER name a socket that is \
                 answered",
                path.display()
            ),
        })?;
        let refused = |error| Silence::Refused { place: place(&path), why: said(&error) };
        let mut wire = Wire::greet(socket).map_err(refused)?;
        let reply =
            wire.ask::<CreatePlaybackStreamReply>(&Command::CreatePlaybackStream(wish(output))).map_err(refused)?;
        wire.socket.get_ref().set_read_timeout(Some(LISTEN_FOR)).map_err(|error| refused(error.into()))?;
        let buffered =
            Duration::from_secs_f64(f64::from(reply.buffer_attr.target_length) / (SAMPLE as f64 * f64::from(RATE)));
        Ok(Stream {
            wire,
            path,
            channel: reply.channel,
            latency: buffered + Duration::from_micros(reply.stream_latency),
            wanted: reply.requested_bytes as usize,
            is_suspended: reply.suspended,
        })
    }

    pub fn place(&self) -> String {
        place(&self.path)
    }

    pub fn rate(&self) -> u32 {
        RATE
    }

    /// What the server says it keeps back.
    pub fn latency(&self) -> Option<Duration> {
        Some(self.latency)
    }

    /// Plays until the end (`None`) or until the server goes away.
    pub fn play(mut self, mut synth: Synth, mut heard: Heard, shared: &Shared) -> (Option<Silence>, Heard) {
        let why = loop {
            if shared.is_over.load(Ordering::Relaxed) {
                return (None, heard);
            }
            let turn = self.send(&mut synth, &mut heard).and_then(|()| self.listen(shared));
            if let Err(error) = turn {
                break said(&error);
            }
        };
        (Some(Silence::Lost { place: place(&self.path), why }), heard)
    }

    /// Sends what the server wants, a block at a time.
    fn send(&mut self, synth: &mut Synth, heard: &mut Heard) -> Result<(), ProtocolError> {
        let mut block = [0.0; BLOCK];
        let mut bytes = [0; BLOCK * SAMPLE];
        while self.wanted >= SAMPLE {
            let count = (self.wanted / SAMPLE).min(BLOCK);
            heard.fill(synth, &mut block[..count]);
            for (to, sample) in bytes.chunks_exact_mut(SAMPLE).zip(&block[..count]) {
                to.copy_from_slice(&sample.to_le_bytes());
            }
            protocol::write_memblock(self.wire.socket.get_mut(), self.channel, &bytes[..count * SAMPLE], 0)?;
            self.wanted -= count * SAMPLE;
        }
        Ok(())
    }

    /// Waits for the server's next wish.
    fn listen(&mut self, shared: &Shared) -> Result<(), ProtocolError> {
        match self.wire.hear()? {
            // A sink that sleeps (a machine that changes users, a headset switched off) wants nothing for as long as it likes.
            Some((_, Command::PlaybackStreamSuspended(it))) => self.is_suspended = it.suspended,
            Some((_, Command::Request(it))) if it.channel == self.channel => self.wanted += it.length as usize,
            Some((_, Command::Underflow(_))) => {
                shared.gaps.fetch_add(1, Ordering::Relaxed);
            }
            Some((_, Command::PlaybackStreamKilled(_))) => {
                return Err(ProtocolError::Invalid("the stream was ended there".into()));
            }
            Some((_, Command::Error(error))) => return Err(ProtocolError::ServerError(error)),
            None if !self.is_suspended && self.wire.waits > WAITS_MAX => return Err(ProtocolError::Timeout),
            _ => {}
        }
        Ok(())
    }
}

fn place(path: &Path) -> String {
    format!("the sound server at {}", path.display())
}

fn no_server() -> Silence {
    Silence::None {
        why: "no sound server was found (neither PULSE_SERVER nor XDG_RUNTIME_DIR leads to one); start PipeWire with its \
              PulseAudio service, or PulseAudio"
            .into(),
    }
}

fn said(error: &ProtocolError) -> String {
    match error {
        ProtocolError::Timeout => "does not answer".into(),
        ProtocolError::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => "closed the connection".into(),
        ProtocolError::Io(error) if is_timeout(error) => "does not answer".into(),
        other => format!("reports: {other}"),
    }
}

/// What we ask a server for: one channel of floats, and to keep little of it back.
fn wish(output: &Output) -> PlaybackStreamParams {
    let bytes = (output.latency.as_secs_f64().clamp(0.01, 0.2) * f64::from(RATE)) as u32 * SAMPLE as u32;
    let request = (bytes / REQUEST_SHARE).next_multiple_of(SAMPLE as u32);
    let mut props = Props::new();
    props.set(Prop::MediaName, c"treatment");
    PlaybackStreamParams {
        sample_spec: SampleSpec { format: SampleFormat::Float32Le, channels: 1, sample_rate: RATE },
        channel_map: ChannelMap::mono(),
        sink_name: Some(DEFAULT_SINK.to_owned()),
        cvolume: Some(ChannelVolume::norm(1)),
        buffer_attr: protocol::stream::BufferAttr {
            max_length: 2 * bytes,
            target_length: bytes,
            // After a gap it goes on with the first block, not with a full buffer.
            pre_buffering: request,
            minimum_request_length: request,
            ..Default::default()
        },
        flags: protocol::stream::StreamFlags { adjust_latency: true, ..Default::default() },
        props,
        ..Default::default()
    }
}

/// Bytes of a cookie, by PulseAudio's protocol.
const COOKIE: usize = 256;

/// A connection over which messages go to and fro.
struct Wire {
    socket: BufReader<UnixStream>,
    version: u16,
    count: u32,
    message: Vec<u8>,
    /// Waits in a row in which nothing came.
    waits: u32,
}

impl Wire {
    /// Says who we are.
    fn greet(socket: UnixStream) -> Result<Wire, ProtocolError> {
        socket.set_read_timeout(Some(ANSWERS_WITHIN))?;
        socket.set_write_timeout(Some(ANSWERS_WITHIN))?;
        let socket = BufReader::new(socket);
        let mut wire = Wire { socket, version: MAX_VERSION, count: 0, message: Vec::new(), waits: 0 };
        // A server on the same machine knows us by our user; the cookie is for those that do not.
        let mut cookie =
            pulseaudio::cookie_path_from_env().and_then(|path| std::fs::read(path).ok()).unwrap_or_default();
        // A server ends a connection whose cookie has another length, even where it asks for none.
        cookie.resize(COOKIE, 0);
        let auth = AuthParams { version: MAX_VERSION, supports_shm: false, supports_memfd: false, cookie };
        let reply: AuthReply = wire.ask(&Command::Auth(auth))?;
        wire.version = reply.version.min(MAX_VERSION);
        let mut props = Props::new();
        props.set(Prop::ApplicationName, c"Typodont");
        let process = CString::new(std::process::id().to_string()).unwrap_or_default();
        props.set(Prop::ApplicationProcessId, process);
        let _: SetClientNameReply = wire.ask(&Command::SetClientName(props))?;
        Ok(wire)
    }

    /// Sends a command and waits for the answer to it.
    fn ask<R: CommandReply>(&mut self, command: &Command) -> Result<R, ProtocolError> {
        self.count += 1;
        let version = self.version;
        protocol::write_command_message(self.socket.get_mut(), self.count, command, version)?;
        self.socket.get_mut().flush()?;
        loop {
            match self.hear()? {
                Some((of, Command::Reply)) if of == self.count => {
                    // The head of a reply, tag and number, is two words with a type byte each.
                    const HEAD: usize = 10;
                    let mut body = self.message.get(HEAD..).unwrap_or_default();
                    return TagStructReader::new(&mut body, version).read();
                }
                Some((of, Command::Error(error))) if of == self.count => return Err(ProtocolError::ServerError(error)),
                Some(_) => {}
                None => return Err(ProtocolError::Timeout),
            }
        }
    }

    /// The next message with its number; `None` when nothing came for a while.
    fn hear(&mut self) -> Result<Option<(u32, Command)>, ProtocolError> {
        match self.socket.fill_buf() {
            Ok([]) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
            Err(error) if is_timeout(&error) => {
                self.waits += 1;
                return Ok(None);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
            other => drop(other?),
        }
        self.waits = 0;
        let head = protocol::read_descriptor(&mut self.socket)?;
        if head.length > MESSAGE_MAX {
            return Err(ProtocolError::Invalid(format!("a message of {} bytes", head.length)));
        }
        self.message.resize(head.length as usize, 0);
        self.socket.read_exact(&mut self.message)?;
        match Command::read_tag_prefixed(&mut &self.message[..], self.version) {
            Ok(message) => Ok(Some(message)),
            // Of what newer servers say besides we need nothing.
            Err(ProtocolError::Unimplemented(..) | ProtocolError::Invalid(_)) => Ok(Some((0, Command::Timeout))),
            Err(other) => Err(other),
        }
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}
