//! PulseAudio's native protocol, which PipeWire supports too.
//!
//! Takes a socket. Gives a stream that sends the samples that the server requests. Never needs a library of the
//! system, and never waits on any thread but its own.

use super::playback::{AudioError, BLOCK, LISTEN_FOR, PlaybackOptions, PlaybackState};
use super::sound_channel::SoundReceiver;
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

/// Sample rate, Hz. A server with another rate resamples.
const RATE: u32 = 48_000;

/// Bytes per sample: 32-bit floats.
const SAMPLE: usize = 4;

/// Time within which a server must answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Consecutive waits without a request, 3 s in all, after which the server counts as stalled.
const MAX_IDLE_WAITS: u32 = 60;

/// Maximum length of a valid message: those received here have some hundred bytes.
const MESSAGE_MAX: u32 = 1 << 16;

/// Smallest request of the server, as a fraction of the whole latency: a fifth leaves it time for the next request.
const REQUEST_SHARE: u32 = 5;

/// A playback stream on a server.
pub struct PulseStream {
    connection: PulseConnection,
    path: PathBuf,
    channel: u32,
    latency: Duration,
    /// Bytes that the server has requested.
    requested_bytes: usize,
    is_suspended: bool,
}

impl PulseStream {
    /// Connects to a server and creates a stream.
    ///
    /// # Errors
    ///
    /// Returns an error if no server can be reached, or if it refuses.
    pub fn open(options: &PlaybackOptions) -> Result<PulseStream, AudioError> {
        let path = match &options.server {
            Some(path) => path.clone(),
            None => pulseaudio::socket_path_from_env().ok_or_else(no_server)?,
        };
        let socket = UnixStream::connect(&path).map_err(|error| AudioError::Unavailable {
            why: format!(
                "no sound server responds at {} ({error}); start PipeWire or PulseAudio, or set PULSE_SERVER to the \
                 socket of a running server",
                path.display()
            ),
        })?;
        let refused = |error| AudioError::Refused { place: server_description(&path), why: describe(&error) };
        let mut connection = PulseConnection::handshake(socket).map_err(refused)?;
        let reply = connection
            .request::<CreatePlaybackStreamReply>(&Command::CreatePlaybackStream(stream_params(options)))
            .map_err(refused)?;
        connection.socket.get_ref().set_read_timeout(Some(LISTEN_FOR)).map_err(|error| refused(error.into()))?;
        let buffered =
            Duration::from_secs_f64(f64::from(reply.buffer_attr.target_length) / (SAMPLE as f64 * f64::from(RATE)));
        Ok(PulseStream {
            connection,
            path,
            channel: reply.channel,
            latency: buffered + Duration::from_micros(reply.stream_latency),
            requested_bytes: reply.requested_bytes as usize,
            is_suspended: reply.suspended,
        })
    }

    pub fn place(&self) -> String {
        server_description(&self.path)
    }

    pub fn rate(&self) -> u32 {
        RATE
    }

    /// Returns the latency that the server reports.
    pub fn latency(&self) -> Option<Duration> {
        Some(self.latency)
    }

    /// Plays until the player is dropped (`None`) or the server is lost.
    pub fn play(
        mut self,
        mut synth: Synth,
        mut receiver: SoundReceiver,
        shared: &PlaybackState,
    ) -> (Option<AudioError>, SoundReceiver) {
        let why = loop {
            if shared.is_over.load(Ordering::Relaxed) {
                return (None, receiver);
            }
            let result = self.send_samples(&mut synth, &mut receiver).and_then(|()| self.poll_server(shared));
            if let Err(error) = result {
                break describe(&error);
            }
        };
        (Some(AudioError::Lost { place: server_description(&self.path), why }), receiver)
    }

    /// Sends the samples that the server has requested, in blocks.
    fn send_samples(&mut self, synth: &mut Synth, receiver: &mut SoundReceiver) -> Result<(), ProtocolError> {
        let mut block = [0.0; BLOCK];
        let mut bytes = [0; BLOCK * SAMPLE];
        while self.requested_bytes >= SAMPLE {
            let count = (self.requested_bytes / SAMPLE).min(BLOCK);
            receiver.fill(synth, &mut block[..count]);
            for (to, sample) in bytes.chunks_exact_mut(SAMPLE).zip(&block[..count]) {
                to.copy_from_slice(&sample.to_le_bytes());
            }
            protocol::write_memblock(self.connection.socket.get_mut(), self.channel, &bytes[..count * SAMPLE], 0)?;
            self.requested_bytes -= count * SAMPLE;
        }
        Ok(())
    }

    /// Waits for the next message of the server and handles it.
    fn poll_server(&mut self, shared: &PlaybackState) -> Result<(), ProtocolError> {
        match self.connection.receive()? {
            // A suspended sink (after a change of users, or with a headset switched off) may request nothing for any
            // length of time.
            Some((_, Command::PlaybackStreamSuspended(it))) => self.is_suspended = it.suspended,
            Some((_, Command::Request(it))) if it.channel == self.channel => self.requested_bytes += it.length as usize,
            Some((_, Command::Underflow(_))) => {
                shared.underruns.fetch_add(1, Ordering::Relaxed);
            }
            Some((_, Command::PlaybackStreamKilled(_))) => {
                return Err(ProtocolError::Invalid("the server ended the stream".into()));
            }
            Some((_, Command::Error(error))) => return Err(ProtocolError::ServerError(error)),
            None if !self.is_suspended && self.connection.idle_waits > MAX_IDLE_WAITS => {
                return Err(ProtocolError::Timeout);
            }
            _ => {}
        }
        Ok(())
    }
}

fn server_description(path: &Path) -> String {
    format!("the sound server at {}", path.display())
}

fn no_server() -> AudioError {
    AudioError::Unavailable {
        why: "no sound server was found (neither PULSE_SERVER nor XDG_RUNTIME_DIR names one); start PipeWire with its \
              PulseAudio service, or PulseAudio"
            .into(),
    }
}

fn describe(error: &ProtocolError) -> String {
    match error {
        ProtocolError::Timeout => "does not respond".into(),
        ProtocolError::Io(error) if error.kind() == io::ErrorKind::UnexpectedEof => "closed the connection".into(),
        ProtocolError::Io(error) if is_timeout(error) => "does not respond".into(),
        other => format!("reports: {other}"),
    }
}

/// Returns the parameters of the stream: one channel of floats with a short buffer.
fn stream_params(options: &PlaybackOptions) -> PlaybackStreamParams {
    let bytes = (options.latency.as_secs_f64().clamp(0.01, 0.2) * f64::from(RATE)) as u32 * SAMPLE as u32;
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
            // After a gap, continue with the first block instead of waiting for a full buffer.
            pre_buffering: request,
            minimum_request_length: request,
            ..Default::default()
        },
        flags: protocol::stream::StreamFlags { adjust_latency: true, ..Default::default() },
        props,
        ..Default::default()
    }
}

/// Length of a cookie in PulseAudio's protocol, bytes.
const COOKIE: usize = 256;

/// A connection for commands and replies.
struct PulseConnection {
    socket: BufReader<UnixStream>,
    version: u16,
    message_count: u32,
    message: Vec<u8>,
    /// Consecutive waits in which nothing arrived.
    idle_waits: u32,
}

impl PulseConnection {
    /// Authenticates and sends the program's name.
    fn handshake(socket: UnixStream) -> Result<PulseConnection, ProtocolError> {
        socket.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        socket.set_write_timeout(Some(ANSWER_TIMEOUT))?;
        let socket = BufReader::new(socket);
        let mut connection =
            PulseConnection { socket, version: MAX_VERSION, message_count: 0, message: Vec::new(), idle_waits: 0 };
        // A server on the same machine authenticates by the user; the cookie is for those that do not.
        let mut cookie =
            pulseaudio::cookie_path_from_env().and_then(|path| std::fs::read(path).ok()).unwrap_or_default();
        // A server closes the connection if the cookie has another length, even if it requires none.
        cookie.resize(COOKIE, 0);
        let auth = AuthParams { version: MAX_VERSION, supports_shm: false, supports_memfd: false, cookie };
        let reply: AuthReply = connection.request(&Command::Auth(auth))?;
        connection.version = reply.version.min(MAX_VERSION);
        let mut props = Props::new();
        props.set(Prop::ApplicationName, c"Typodont");
        let process = CString::new(std::process::id().to_string()).unwrap_or_default();
        props.set(Prop::ApplicationProcessId, process);
        let _: SetClientNameReply = connection.request(&Command::SetClientName(props))?;
        Ok(connection)
    }

    /// Sends a command and waits for its reply.
    fn request<R: CommandReply>(&mut self, command: &Command) -> Result<R, ProtocolError> {
        self.message_count += 1;
        let version = self.version;
        protocol::write_command_message(self.socket.get_mut(), self.message_count, command, version)?;
        self.socket.get_mut().flush()?;
        loop {
            match self.receive()? {
                Some((of, Command::Reply)) if of == self.message_count => {
                    // The head of a reply, tag and number, is two words with a type byte each.
                    const HEAD: usize = 10;
                    let mut body = self.message.get(HEAD..).unwrap_or_default();
                    return TagStructReader::new(&mut body, version).read();
                }
                Some((of, Command::Error(error))) if of == self.message_count => {
                    return Err(ProtocolError::ServerError(error));
                }
                Some(_) => {}
                None => return Err(ProtocolError::Timeout),
            }
        }
    }

    /// Returns the next message with its number; `None` if nothing arrived in time.
    fn receive(&mut self) -> Result<Option<(u32, Command)>, ProtocolError> {
        match self.socket.fill_buf() {
            Ok([]) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
            Err(error) if is_timeout(&error) => {
                self.idle_waits += 1;
                return Ok(None);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
            other => drop(other?),
        }
        self.idle_waits = 0;
        let head = protocol::read_descriptor(&mut self.socket)?;
        if head.length > MESSAGE_MAX {
            return Err(ProtocolError::Invalid(format!("a message of {} bytes", head.length)));
        }
        self.message.resize(head.length as usize, 0);
        self.socket.read_exact(&mut self.message)?;
        match Command::read_tag_prefixed(&mut &self.message[..], self.version) {
            Ok(message) => Ok(Some(message)),
            // Messages that only newer servers send are not needed.
            Err(ProtocolError::Unimplemented(..) | ProtocolError::Invalid(_)) => Ok(Some((0, Command::Timeout))),
            Err(other) => Err(other),
        }
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}
