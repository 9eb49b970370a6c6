//! The reader of recordings, complete or truncated.

use super::file::{
    DigestFile, END, EventFile, EventKindFile, HEAD, InputFile, RecordingEndFile, RecordingHeadFile, VERSION,
};
use super::mcap_walk;
use super::replay::RunningDigest;
use super::tick_record::{TickLayout, TickRecord};
use super::volume;
use crate::scenario;
use crate::scenario::{ResolveMode, Scenario, Workpiece};
use crate::session::Input;
use mcap::records::Record;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use typodont_core::sim::Command;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::Volume;
use typodont_formats::Library;
use typodont_formats::diagnostic::{Diagnostic, SourceText, headlines};

/// A recording in memory.
#[derive(Clone, Debug)]
pub struct Recording {
    pub head: RecordingHeadFile,
    /// End metadata; `None` for an interrupted session.
    pub end: Option<RecordingEndFile>,
    pub scenario: Arc<Scenario>,
    /// The volume at the start of the session.
    pub initial: Arc<Volume>,
    /// The tooth before its cavity was cut; `None` without a prepared cavity.
    pub original: Option<Arc<Volume>>,
    /// One record per tick, from tick 0 without gaps.
    pub ticks: Vec<TickRecord>,
    /// Inputs in order, each before the step of its tick.
    pub inputs: Vec<(Tick, Input)>,
    /// Commands in order, each before the step of its tick.
    pub commands: Vec<(Tick, Command)>,
    /// Bytes of the `/event` messages, in order, for the digest.
    pub(super) events: Vec<(Tick, Vec<u8>)>,
    pub(super) digests: Vec<DigestFile>,
    /// Digest of everything before the first tick.
    pub(super) initial_digest: RunningDigest,
    /// Bytes of the end metadata as written, for the digest.
    pub(super) end_bytes: Vec<u8>,
}

/// Reason for which a recording cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingError {
    /// The file cannot be read.
    File(Diagnostic),
    /// The recording was made by a newer program.
    Newer { name: String, version: u32 },
    /// A part is missing or damaged.
    Damaged { name: String, what: String },
    /// This program no longer accepts the recording's scenario or tables.
    Scenario(Vec<Diagnostic>),
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            RecordingError::File(diagnostic) => f.write_str(&diagnostic.headline()),
            RecordingError::Newer { name, version } => {
                write!(
                    f,
                    "{name}: newer-recording: the recording has version {version}, this program reads up to {VERSION}"
                )
            }
            RecordingError::Damaged { name, what } => write!(f, "{name}: damaged-recording: {what}"),
            RecordingError::Scenario(found) => f.write_str(&headlines(found)),
        }
    }
}

impl std::error::Error for RecordingError {}

/// Contents of a recording's file before they are checked and assembled.
#[derive(Default)]
struct RecordingParts {
    head: Option<RecordingHeadFile>,
    end: Option<RecordingEndFile>,
    files: BTreeMap<String, Vec<u8>>,
    channels: BTreeMap<u16, String>,
    ticks: Vec<TickRecord>,
    events: Vec<(Tick, Vec<u8>)>,
    inputs: Vec<(Tick, Input)>,
    commands: Vec<(Tick, Command)>,
    digests: Vec<DigestFile>,
    initial_digest: RunningDigest,
    end_bytes: Vec<u8>,
}

impl Recording {
    /// Reads a recording. The recording of a killed session is read up to its last complete chunk.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is damaged or was made by a newer program, or if this program no
    /// longer accepts its scenario.
    pub fn read(path: &Path) -> Result<Recording, RecordingError> {
        let bytes = typodont_formats::read_file(path).map_err(RecordingError::File)?;
        Recording::parse(&path.display().to_string(), &bytes)
    }

    /// Reads a recording from bytes; `name` is used in error messages.
    ///
    /// # Errors
    /// Returns an error if the bytes are damaged or were written by a newer program, or if this program no longer
    /// accepts the scenario.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
        let damaged = |what: String| RecordingError::Damaged { name: name.to_string(), what };
        let mut found = RecordingParts::default();
        mcap_walk::walk(bytes, |record| found.add(record)).map_err(damaged)?;
        found.assemble(name)
    }

    /// Reads the session metadata alone, without the ticks; `name` is used in error messages.
    ///
    /// # Errors
    /// Returns an error if the bytes before the metadata are damaged, or if there is none.
    pub fn parse_head(name: &str, bytes: &[u8]) -> Result<RecordingHeadFile, RecordingError> {
        let mut head = None;
        let walked = mcap_walk::walk(bytes, |record| match record {
            Record::Metadata(metadata) if metadata.name == HEAD => {
                let text = metadata.metadata.get("json").map_or("", String::as_str);
                head = serde_json::from_str(text).ok();
                // An error ends the walk: nothing after the metadata is needed.
                Err("the session metadata is invalid".to_string())
            }
            _ => Ok(()),
        });
        let what = walked.err().unwrap_or("the session metadata is missing".to_string());
        head.ok_or(RecordingError::Damaged { name: name.to_string(), what })
    }

    /// Returns the workpiece from which the session started.
    ///
    /// # Errors
    /// Returns an error if the recorded volume does not fit the scenario.
    pub fn workpiece(&self) -> Result<Workpiece, String> {
        Workpiece::from_volume(&self.scenario, self.initial.clone(), self.original.clone(), self.head.seed)
            .map_err(|e| e.to_string())
    }

    /// Returns the number of ticks.
    pub fn len(&self) -> usize {
        self.ticks.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ticks.is_empty()
    }
}

impl RecordingParts {
    fn add(&mut self, record: Record) -> Result<(), String> {
        match record {
            Record::Metadata(metadata) => {
                let text = metadata.metadata.get("json").map_or("", String::as_str);
                let broken = |e: serde_json::Error| format!("metadata \"{}\": {e}", metadata.name);
                match metadata.name.as_str() {
                    HEAD => {
                        self.initial_digest.part(HEAD, text.as_bytes());
                        self.head = Some(serde_json::from_str(text).map_err(broken)?);
                    }
                    END => {
                        self.end_bytes = text.as_bytes().to_vec();
                        self.end = Some(serde_json::from_str(text).map_err(broken)?);
                    }
                    _ => {}
                }
            }
            Record::Attachment { header, data, .. } => {
                self.initial_digest.part(&header.name, &data);
                self.files.insert(header.name, data.into_owned());
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => match self.channels.get(&header.channel_id).map(String::as_str) {
                Some("/haptic") => self.add_tick(&data)?,
                Some("/event") => self.add_event(&data)?,
                Some("/digest") => {
                    let digest = serde_json::from_slice(&data).map_err(|e| format!("invalid digest: {e}"))?;
                    self.digests.push(digest);
                }
                _ => {}
            },
            _ => {}
        }
        Ok(())
    }

    fn add_tick(&mut self, data: &[u8]) -> Result<(), String> {
        let next = self.ticks.len() as u64;
        let version = self.head.as_ref().map_or(VERSION, |head| head.version);
        if version > VERSION {
            // The whole recording is refused once everything is read: a newer format cannot be checked here.
            return Ok(());
        }
        let tick = TickRecord::parse(data, TickLayout::of(version)).ok_or(format!("tick {next} cannot be decoded"))?;
        if tick.tick.0 != next {
            return Err(format!("tick {} found where tick {next} was expected", tick.tick.0));
        }
        self.ticks.push(tick);
        Ok(())
    }

    fn add_event(&mut self, data: &[u8]) -> Result<(), String> {
        if self.head.as_ref().is_some_and(|head| head.version > VERSION) {
            return Ok(());
        }
        let event: EventFile = serde_json::from_slice(data).map_err(|e| format!("invalid event: {e}"))?;
        let tick = Tick(event.tick);
        if self.events.last().is_some_and(|(before, _)| *before > tick) || tick.0 > self.ticks.len() as u64 {
            return Err(format!("an event of tick {} is out of order after {} ticks", tick.0, self.ticks.len()));
        }
        match &event.what {
            EventKindFile::Input(input) => self.inputs.push((tick, Input::from(InputFile::clone(input)))),
            EventKindFile::Command(command) => self.commands.push((tick, Command::from(command))),
            _ => {}
        }
        self.events.push((tick, data.to_vec()));
        Ok(())
    }

    fn assemble(self, name: &str) -> Result<Recording, RecordingError> {
        let damaged = |what: &str| RecordingError::Damaged { name: name.to_string(), what: what.to_string() };
        let RecordingParts {
            head,
            end,
            mut files,
            ticks,
            events,
            inputs,
            commands,
            digests,
            initial_digest,
            end_bytes,
            ..
        } = self;
        let head = head.ok_or(damaged("the session metadata is missing"))?;
        if head.version > VERSION {
            return Err(RecordingError::Newer { name: name.to_string(), version: head.version });
        }
        let text = files.remove("scenario.json").ok_or(damaged("the scenario is missing"))?;
        let text = String::from_utf8(text).map_err(|_| damaged("the scenario is not valid UTF-8"))?;
        let (initial, original) = take_volumes(&mut files).map_err(|what| damaged(&what))?;
        let mut library = Library::empty();
        for (file, bytes) in files {
            library.insert(file, bytes);
        }
        let source = SourceText::new(format!("{name}: scenario.json"), text);
        let scenario =
            scenario::resolve(source, &library, ResolveMode::FromRecording).map_err(RecordingError::Scenario)?;
        check_agreement(&head, &scenario, original.is_some()).map_err(damaged)?;
        Ok(Recording {
            head,
            end,
            scenario: Arc::new(scenario),
            initial: Arc::new(initial),
            original: original.map(Arc::new),
            ticks,
            inputs,
            commands,
            events,
            digests,
            initial_digest,
            end_bytes,
        })
    }
}

/// Removes the volumes from the files of a recording and decodes them: the volume at the start of the session, and the
/// tooth before its cavity was cut. The error states the damage.
fn take_volumes(files: &mut BTreeMap<String, Vec<u8>>) -> Result<(Volume, Option<Volume>), String> {
    let density = files.remove(volume::DENSITY).ok_or("the initial density is missing")?;
    let label = files.remove(volume::LABEL).ok_or("the initial labels are missing")?;
    let initial = volume::parse(&density, &label)?;
    let original = match (files.remove(volume::ORIGINAL_DENSITY), files.remove(volume::ORIGINAL_LABEL)) {
        (Some(density), Some(label)) => Some(volume::parse(&density, &label)?),
        _ => None,
    };
    if original.as_ref().is_some_and(|original| original.grid() != initial.grid()) {
        return Err("the original tooth and the initial volume have different grids".into());
    }
    Ok((initial, original))
}

/// Compares a recording's scenario with its session metadata and its volumes. The error states the damage.
fn check_agreement(head: &RecordingHeadFile, scenario: &Scenario, has_original: bool) -> Result<(), &'static str> {
    if scenario.sha256 != head.scenario_sha256 {
        return Err("the scenario does not match the SHA-256 in the session metadata");
    }
    if scenario.has_cavity() != has_original {
        return Err("the original tooth, before its cavity was cut, is missing or unexpected");
    }
    if head.tick_s != TICK_S {
        return Err("the duration of a tick is not the one of this program");
    }
    Ok(())
}
