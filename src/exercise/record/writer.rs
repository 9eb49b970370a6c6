//! The writer of a recording, which appends to its file while the session runs.

use super::file::{
    CommandFile, DigestFile, END, EventFile, EventKindFile, HEAD, InputFile, RecordingEndFile, RecordingHeadFile,
    SeedOriginFile, ended_by_name,
};
use super::seal::{SEED, SeedFile, commitment};
use super::tick_record::{self, TickLayout, TickRecord};
use super::{replay::RunningDigest, volume};
use crate::scenario;
use crate::scenario::{Scenario, Workpiece};
use crate::session::{Effect, Input, Observer, Session};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use typodont_core::device::Reading;
use typodont_core::sim::{Command, Step};
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::Edit;

/// Number of ticks between two writes to disk, which bounds the loss of a killed session.
const FLUSH_TICKS: u64 = 100;

/// Number of ticks between two digests.
pub(super) const DIGEST_TICKS: u64 = 1000;

/// Reason for which a recording cannot be written.
#[derive(Debug)]
pub struct RecorderError {
    path: PathBuf,
    why: String,
}

impl fmt::Display for RecorderError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: unwritable-file: the recording cannot be written: {}", self.path.display(), self.why)
    }
}

impl std::error::Error for RecorderError {}

/// Place for the bytes of a recording: a file, or a buffer in memory.
pub trait RecordingSink: Write + Seek + Send {}

impl<T: Write + Seek + Send> RecordingSink for T {}

/// Writer of one recording.
pub struct Recorder {
    path: PathBuf,
    writer: Writer<Box<dyn RecordingSink>>,
    tick_channel: u16,
    event_channel: u16,
    digest_channel: u16,
    sequence: u32,
    running_digest: RunningDigest,
    /// Seed to be revealed at the end; `None` for a session that is not sealed.
    sealed_seed: Option<u64>,
}

impl Recorder {
    /// Creates a recording on disk and starts it; see [`Recorder::start`].
    ///
    /// # Errors
    /// Returns an error if the file cannot be created or written, or if a volume cannot be encoded.
    pub fn create(
        path: &Path,
        head: &RecordingHeadFile,
        scenario: &Scenario,
        workpiece: &Workpiece,
    ) -> Result<Recorder, RecorderError> {
        let failed = |e| RecorderError { path: path.to_path_buf(), why: typodont_formats::write_failure(&e) };
        let file = File::create(path).map_err(failed)?;
        Recorder::start(Box::new(file), path, head, scenario, workpiece)
    }

    /// Starts a recording and writes everything that is known before the first tick. The seed of a head with the origin
    /// [`SeedOriginFile::Sealed`] is written only when the recording is finished. Complaints name the recording by `path`.
    ///
    /// # Errors
    /// Returns an error if the recording cannot be written, or if a volume cannot be encoded.
    pub fn start(
        sink: Box<dyn RecordingSink>,
        path: &Path,
        head: &RecordingHeadFile,
        scenario: &Scenario,
        workpiece: &Workpiece,
    ) -> Result<Recorder, RecorderError> {
        let failed = |why: String| RecorderError { path: path.to_path_buf(), why };
        let sealed_seed = (head.seed_origin == Some(SeedOriginFile::Sealed)).then_some(head.seed);
        let head = &match sealed_seed {
            Some(seed) => RecordingHeadFile { seed: 0, seed_sha256: Some(commitment(head, seed)), ..head.clone() },
            None => head.clone(),
        };
        let (density, label) = volume::bytes(&workpiece.volume).map_err(|e| failed(e.to_string()))?;
        let original = workpiece.original.as_ref().map(|o| volume::bytes(o)).transpose();
        let original = original.map_err(|e| failed(e.to_string()))?;
        let attempt = || -> Result<Recorder, McapError> {
            let mut writer = write_options().create(sink)?;
            let mut running = RunningDigest::new();
            running.part(HEAD, &json(head));
            writer.write_metadata(&metadata(HEAD, head))?;
            let mut attach = |name: &str, media_type: &str, data: &[u8]| {
                running.part(name, data);
                let (name, media_type) = (name.to_string(), media_type.to_string());
                writer.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data: Cow::Borrowed(data) })
            };
            attach(scenario::SCENARIO_PART, "application/json", scenario.text.as_bytes())?;
            for (name, bytes) in &scenario.files {
                attach(name, "application/octet-stream", bytes)?;
            }
            attach(scenario::INITIAL_DENSITY_PART, "application/x-nrrd", &density)?;
            attach(scenario::INITIAL_LABEL_PART, "application/x-nrrd", &label)?;
            if let Some((density, label)) = &original {
                attach(scenario::ORIGINAL_DENSITY_PART, "application/x-nrrd", density)?;
                attach(scenario::ORIGINAL_LABEL_PART, "application/x-nrrd", label)?;
            }
            let schema = writer.add_schema(tick_record::SCHEMA_NAME, "ros2msg", tick_record::SCHEMA.as_bytes())?;
            let none = BTreeMap::new();
            let tick_channel = writer.add_channel(schema, "/haptic", "cdr", &none)?;
            let event_channel = writer.add_channel(0, "/event", "json", &none)?;
            let digest_channel = writer.add_channel(0, "/digest", "json", &none)?;
            let path = path.to_path_buf();
            Ok(Recorder {
                path,
                writer,
                tick_channel,
                event_channel,
                digest_channel,
                sequence: 0,
                running_digest: running,
                sealed_seed,
            })
        };
        attempt().map_err(|e| failed(reason(&e)))
    }

    fn write(&mut self, channel_id: u16, tick: Tick, data: &[u8]) -> Result<(), RecorderError> {
        let time = (tick.0 as f64 * TICK_S * 1e9).round() as u64;
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, data).map_err(|e| self.failed(&e))
    }

    fn failed(&self, error: &McapError) -> RecorderError {
        RecorderError { path: self.path.clone(), why: reason(error) }
    }

    fn write_event(&mut self, tick: Tick, what: EventKindFile) -> Result<(), RecorderError> {
        let bytes = json(&EventFile { tick: tick.0, what });
        self.running_digest.event(&bytes);
        self.write(self.event_channel, tick, &bytes)
    }

    /// Writes an event again as another recording of the same session has it.
    pub(super) fn repeat_event(&mut self, tick: Tick, bytes: &[u8]) -> Result<(), RecorderError> {
        self.running_digest.event(bytes);
        self.write(self.event_channel, tick, bytes)
    }

    /// Passes everything on that was written so far; a tick does so only now and then.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn flush(&mut self) -> Result<(), RecorderError> {
        self.writer.flush().map_err(|e| self.failed(&e))
    }

    /// Writes the last digest and the end metadata, and closes the file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn finish(mut self, end: &RecordingEndFile) -> Result<(), RecorderError> {
        let tick = Tick(end.servo.ticks);
        self.running_digest.part(END, &json(end));
        let digest = DigestFile { tick: tick.0, sha256: self.running_digest.sha256() };
        self.write(self.digest_channel, tick, &json(&digest))?;
        let revealed = self.sealed_seed.map(|seed| self.writer.write_metadata(&metadata(SEED, &SeedFile { seed })));
        let ended = revealed.unwrap_or(Ok(())).and_then(|()| self.writer.write_metadata(&metadata(END, end)));
        let done = ended.and_then(|()| self.writer.finish().map(drop));
        done.map_err(|e| self.failed(&e))
    }
}

/// Options of a recording's writer. One thread and chunks buffered in memory: equal sessions give equal bytes, and a
/// killed one complete chunks.
fn write_options() -> WriteOptions {
    let options = WriteOptions::new()
        .profile("ros2")
        .library(concat!("typodont ", env!("CARGO_PKG_VERSION")))
        .chunk_size(None)
        .disable_seeking(true);
    #[cfg(not(target_family = "wasm"))]
    let options = options.compression_threads(0);
    options
}

/// Returns the reason of a failed write; of an error of the system, not of the compression that met it.
fn reason(error: &McapError) -> String {
    match error {
        McapError::Io(error) => typodont_formats::write_failure(error),
        other => other.to_string(),
    }
}

/// Serializes a value as one line of JSON. Serialization of the types used here cannot fail.
fn json(value: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_default()
}

fn metadata(name: &str, value: &impl Serialize) -> Metadata {
    let text = String::from_utf8(json(value)).unwrap_or_default();
    Metadata { name: name.into(), metadata: BTreeMap::from([("json".to_string(), text)]) }
}

impl Observer for Recorder {
    type Error = RecorderError;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), RecorderError> {
        self.write_event(tick, EventKindFile::Input(InputFile::from(input)))
    }

    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), RecorderError> {
        let what = match command {
            Command::SetMaterial { .. } | Command::SetCoefficient { .. } if self.sealed_seed.is_some() => {
                EventKindFile::SealedCommand {}
            }
            _ => EventKindFile::Command(CommandFile::from(command)),
        };
        self.write_event(tick, what)
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), RecorderError> {
        let id = |stage: usize| session.scenario().stages[stage].id.clone();
        let what = match effect {
            Effect::StageStarted { stage } => EventKindFile::StageStarted { stage: id(*stage) },
            Effect::StageEnded { stage, by } => {
                EventKindFile::StageEnded { stage: id(*stage), by: ended_by_name(*by).into() }
            }
            Effect::StagesOver => EventKindFile::StagesOver {},
            Effect::Refused { why } => EventKindFile::Refused { why: why.to_string() },
            // Commands are recorded by `command`; steps, answers and chart entries follow from commands and inputs.
            Effect::Command(_) | Effect::StepStarted { .. } | Effect::Answered { .. } | Effect::Charted { .. } => {
                return Ok(());
            }
        };
        self.write_event(tick, what)
    }

    fn tick_completed(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), RecorderError> {
        let bytes = TickRecord::of(reading, step).bytes(TickLayout::NEWEST);
        self.running_digest.tick(&bytes, edits);
        self.write(self.tick_channel, step.tick, &bytes)?;
        let ticks_done = step.tick.0 + 1;
        if ticks_done.is_multiple_of(DIGEST_TICKS) {
            let digest = DigestFile { tick: ticks_done, sha256: self.running_digest.sha256() };
            self.write(self.digest_channel, step.tick, &json(&digest))?;
        }
        if ticks_done.is_multiple_of(FLUSH_TICKS) {
            self.flush()?;
        }
        Ok(())
    }
}
