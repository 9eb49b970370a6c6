//! Writing a recording while its session runs.

use super::file::{
    CommandFile, DigestFile, END, EndFile, EventFile, HEAD, HeadFile, InputFile, WhatFile, ended_by_name,
};
use super::haptic::{self, Haptic, Layout};
use super::{replay::Running, volume};
use crate::device::Reading;
use crate::scenario::{Scenario, Workpiece};
use crate::session::{Effect, Input, Observer, Session};
use crate::sim::{Command, Step};
use crate::tick::{TICK_S, Tick};
use crate::volume::Edit;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Ticks between two writes to disk: what a killed session can lose.
const FLUSH_TICKS: u64 = 100;

/// Ticks between two digests.
pub(super) const DIGEST_TICKS: u64 = 1000;

/// Why a recording cannot be written.
#[derive(Debug)]
pub struct Unwritable {
    path: PathBuf,
    why: String,
}

impl fmt::Display for Unwritable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "writing the recording — {} — {}", self.why, self.path.display())
    }
}

/// A recording being written.
pub struct Recorder {
    path: PathBuf,
    writer: Writer<File>,
    haptic: u16,
    event: u16,
    digest: u16,
    sequence: u32,
    running: Running,
}

impl Recorder {
    /// Begins a recording: writes everything that is known before the first tick.
    pub fn create(
        path: &Path,
        head: &HeadFile,
        scenario: &Scenario,
        workpiece: &Workpiece,
    ) -> Result<Recorder, Unwritable> {
        let failed = |why: String| Unwritable { path: path.to_path_buf(), why };
        let (density, label) = volume::bytes(&workpiece.volume).map_err(|e| failed(e.to_string()))?;
        let original = workpiece.original.as_ref().map(|o| volume::bytes(o)).transpose();
        let original = original.map_err(|e| failed(e.to_string()))?;
        let file = File::create(path).map_err(|e| failed(e.to_string()))?;
        // One thread and whole chunks in memory: the same session gives the same bytes, and a killed one whole chunks.
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("typodont ", env!("CARGO_PKG_VERSION")))
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true);
        let attempt = || -> Result<Recorder, McapError> {
            let mut writer = options.create(file)?;
            let mut running = Running::new();
            running.part(HEAD, &json(head));
            writer.write_metadata(&metadata(HEAD, head))?;
            let mut attach = |name: &str, media_type: &str, data: &[u8]| {
                running.part(name, data);
                let (name, media_type) = (name.to_string(), media_type.to_string());
                writer.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data: Cow::Borrowed(data) })
            };
            attach("scenario.json", "application/json", scenario.text.as_bytes())?;
            for (name, bytes) in &scenario.files {
                attach(name, "application/octet-stream", bytes)?;
            }
            attach(volume::DENSITY, "application/x-nrrd", &density)?;
            attach(volume::LABEL, "application/x-nrrd", &label)?;
            if let Some((density, label)) = &original {
                attach(volume::ORIGINAL_DENSITY, "application/x-nrrd", density)?;
                attach(volume::ORIGINAL_LABEL, "application/x-nrrd", label)?;
            }
            let schema = writer.add_schema(haptic::SCHEMA_NAME, "ros2msg", haptic::SCHEMA.as_bytes())?;
            let none = BTreeMap::new();
            let haptic = writer.add_channel(schema, "/haptic", "cdr", &none)?;
            let event = writer.add_channel(0, "/event", "json", &none)?;
            let digest = writer.add_channel(0, "/digest", "json", &none)?;
            let path = path.to_path_buf();
            Ok(Recorder { path, writer, haptic, event, digest, sequence: 0, running })
        };
        attempt().map_err(|e| failed(e.to_string()))
    }

    fn write(&mut self, channel_id: u16, tick: Tick, data: &[u8]) -> Result<(), Unwritable> {
        let time = (tick.0 as f64 * TICK_S * 1e9).round() as u64;
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time: time, publish_time: time };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, data).map_err(|e| self.failed(e))
    }

    fn failed(&self, error: McapError) -> Unwritable {
        Unwritable { path: self.path.clone(), why: error.to_string() }
    }

    fn write_event(&mut self, tick: Tick, what: WhatFile) -> Result<(), Unwritable> {
        let bytes = json(&EventFile { tick: tick.0, what });
        self.running.event(&bytes);
        self.write(self.event, tick, &bytes)
    }

    /// Ends the recording.
    pub fn finish(mut self, end: &EndFile) -> Result<(), Unwritable> {
        let tick = Tick(end.servo.ticks);
        self.running.part(END, &json(end));
        let digest = DigestFile { tick: tick.0, sha256: self.running.sha256() };
        self.write(self.digest, tick, &json(&digest))?;
        let done = self.writer.write_metadata(&metadata(END, end)).and_then(|()| self.writer.finish().map(drop));
        done.map_err(|e| self.failed(e))
    }
}

/// A text as one line of JSON. The types here hold nothing that JSON cannot say.
fn json(value: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_default()
}

fn metadata(name: &str, value: &impl Serialize) -> Metadata {
    let text = String::from_utf8(json(value)).unwrap_or_default();
    Metadata { name: name.into(), metadata: BTreeMap::from([("json".to_string(), text)]) }
}

impl Observer for Recorder {
    type Error = Unwritable;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Unwritable> {
        self.write_event(tick, WhatFile::Input(InputFile::from(input)))
    }

    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), Unwritable> {
        self.write_event(tick, WhatFile::Command(CommandFile::from(command)))
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), Unwritable> {
        let id = |stage: usize| session.scenario().stages[stage].id.clone();
        let what = match effect {
            Effect::StageStarted { stage } => WhatFile::StageStarted { stage: id(*stage) },
            Effect::StageEnded { stage, by } => {
                WhatFile::StageEnded { stage: id(*stage), by: ended_by_name(*by).into() }
            }
            Effect::StagesOver => WhatFile::StagesOver {},
            Effect::Refused { why } => WhatFile::Refused { why: why.to_string() },
            // Commands are written as such; steps and answers follow from commands and inputs.
            Effect::Tell(_) | Effect::StepStarted { .. } | Effect::Answered { .. } | Effect::Charted { .. } => {
                return Ok(());
            }
        };
        self.write_event(tick, what)
    }

    fn turned(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), Unwritable> {
        let bytes = Haptic::of(reading, step).bytes(Layout::NEWEST);
        self.running.tick(&bytes, edits);
        self.write(self.haptic, step.tick, &bytes)?;
        let turned = step.tick.0 + 1;
        if turned.is_multiple_of(DIGEST_TICKS) {
            let digest = DigestFile { tick: turned, sha256: self.running.sha256() };
            self.write(self.digest, step.tick, &json(&digest))?;
        }
        if turned.is_multiple_of(FLUSH_TICKS) {
            self.writer.flush().map_err(|e| self.failed(e))?;
        }
        Ok(())
    }
}
