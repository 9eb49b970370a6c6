//! Reading a recording, whole or cut off.

use super::file::{DigestFile, END, EndFile, EventFile, HEAD, HeadFile, InputFile, VERSION, WhatFile};
use super::haptic::{Haptic, Layout};
use super::records;
use super::replay::Running;
use super::volume;
use crate::content::Library;
use crate::diagnostic::{Diagnostic, Source, headlines};
use crate::scenario::{self, Forms, Scenario, Workpiece};
use crate::session::Input;
use crate::sim::Command;
use crate::tick::{TICK_S, Tick};
use crate::volume::Volume;
use mcap::records::Record;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// A recording in memory.
#[derive(Clone, Debug)]
pub struct Recording {
    pub head: HeadFile,
    /// `None` for a session that was cut off.
    pub end: Option<EndFile>,
    pub scenario: Arc<Scenario>,
    pub initial: Arc<Volume>,
    /// The tooth before its cavity was cut, where there is one.
    pub original: Option<Arc<Volume>>,
    /// One per tick, from tick 0 on without a gap.
    pub ticks: Vec<Haptic>,
    /// Inputs in order, each before the step of its tick.
    pub inputs: Vec<(Tick, Input)>,
    /// Commands in order, each before the step of its tick.
    pub commands: Vec<(Tick, Command)>,
    /// Bytes of the `/event` messages, in order, for the digest.
    pub(super) events: Vec<(Tick, Vec<u8>)>,
    pub(super) digests: Vec<DigestFile>,
    /// The digest of everything before the first tick.
    pub(super) begun: Running,
    /// The end as it was written, for the digest.
    pub(super) end_bytes: Vec<u8>,
}

/// Why a recording cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub enum Unreadable {
    /// The file cannot be opened, or is none of ours.
    File(Diagnostic),
    /// It is made by a newer program.
    Newer { name: String, version: u32 },
    /// A part is missing or damaged.
    Damaged { name: String, what: String },
    /// Its scenario or tables are not understood any more.
    Scenario(Vec<Diagnostic>),
}

impl fmt::Display for Unreadable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unreadable::File(diagnostic) => f.write_str(&diagnostic.headline()),
            Unreadable::Newer { name, version } => {
                write!(
                    f,
                    "{name}: newer-recording: the recording has version {version}, this program reads up to {VERSION}"
                )
            }
            Unreadable::Damaged { name, what } => write!(f, "{name}: damaged-recording: {what}"),
            Unreadable::Scenario(found) => f.write_str(&headlines(found)),
        }
    }
}

/// What was found in a file, before it is put together.
#[derive(Default)]
struct Found {
    head: Option<HeadFile>,
    end: Option<EndFile>,
    files: BTreeMap<String, Vec<u8>>,
    channels: BTreeMap<u16, String>,
    ticks: Vec<Haptic>,
    events: Vec<(Tick, Vec<u8>)>,
    inputs: Vec<(Tick, Input)>,
    commands: Vec<(Tick, Command)>,
    digests: Vec<DigestFile>,
    begun: Running,
    end_bytes: Vec<u8>,
}

impl Recording {
    /// Reads a recording. What a killed session left is read up to the last whole chunk.
    pub fn read(path: &Path) -> Result<Recording, Unreadable> {
        let bytes = crate::content::read_file(path).map_err(Unreadable::File)?;
        Recording::parse(&path.display().to_string(), &bytes)
    }

    /// Reads a recording from bytes; `name` is used in complaints.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Recording, Unreadable> {
        let damaged = |what: String| Unreadable::Damaged { name: name.to_string(), what };
        let mut found = Found::default();
        records::walk(bytes, |record| found.add(record)).map_err(damaged)?;
        found.put_together(name)
    }

    /// The workpiece the session started from.
    pub fn workpiece(&self) -> Result<Workpiece, String> {
        Workpiece::of(&self.scenario, self.initial.clone(), self.original.clone(), self.head.seed)
            .map_err(|e| e.to_string())
    }

    /// The number of ticks.
    pub fn len(&self) -> usize {
        self.ticks.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ticks.is_empty()
    }
}

impl Found {
    fn add(&mut self, record: Record) -> Result<(), String> {
        match record {
            Record::Metadata(metadata) => {
                let text = metadata.metadata.get("json").map_or("", String::as_str);
                let broken = |e: serde_json::Error| format!("metadata \"{}\": {e}", metadata.name);
                match metadata.name.as_str() {
                    HEAD => {
                        self.begun.part(HEAD, text.as_bytes());
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
                self.begun.part(&header.name, &data);
                self.files.insert(header.name, data.into_owned());
            }
            Record::Channel(channel) => {
                self.channels.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => match self.channels.get(&header.channel_id).map(String::as_str) {
                Some("/haptic") => self.add_tick(&data)?,
                Some("/event") => self.add_event(&data)?,
                Some("/digest") => {
                    let digest = serde_json::from_slice(&data).map_err(|e| format!("a digest: {e}"))?;
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
            // Refused as a whole once everything is read: what a newer program wrote cannot be judged here.
            return Ok(());
        }
        let tick = Haptic::parse(data, Layout::of(version)).ok_or(format!("tick {next} is not understood"))?;
        if tick.tick.0 != next {
            return Err(format!("tick {} stands where tick {next} belongs", tick.tick.0));
        }
        self.ticks.push(tick);
        Ok(())
    }

    fn add_event(&mut self, data: &[u8]) -> Result<(), String> {
        if self.head.as_ref().is_some_and(|head| head.version > VERSION) {
            return Ok(());
        }
        let event: EventFile = serde_json::from_slice(data).map_err(|e| format!("an event: {e}"))?;
        let tick = Tick(event.tick);
        if self.events.last().is_some_and(|(before, _)| *before > tick) || tick.0 > self.ticks.len() as u64 {
            return Err(format!("an event of tick {} stands after {} ticks", tick.0, self.ticks.len()));
        }
        match &event.what {
            WhatFile::Input(input) => self.inputs.push((tick, Input::from(InputFile::clone(input)))),
            WhatFile::Command(command) => self.commands.push((tick, Command::from(command))),
            _ => {}
        }
        self.events.push((tick, data.to_vec()));
        Ok(())
    }

    fn put_together(self, name: &str) -> Result<Recording, Unreadable> {
        let damaged = |what: &str| Unreadable::Damaged { name: name.to_string(), what: what.to_string() };
        let Found { head, end, mut files, ticks, events, inputs, commands, digests, begun, end_bytes, .. } = self;
        let head = head.ok_or(damaged("it does not say which session it is of"))?;
        if head.version > VERSION {
            return Err(Unreadable::Newer { name: name.to_string(), version: head.version });
        }
        let text = files.remove("scenario.json").ok_or(damaged("the scenario is missing"))?;
        let text = String::from_utf8(text).map_err(|_| damaged("the scenario is not text"))?;
        let density = files.remove(volume::DENSITY).ok_or(damaged("the volume at the start is missing"))?;
        let label = files.remove(volume::LABEL).ok_or(damaged("the labels at the start are missing"))?;
        let initial = volume::parse(&density, &label).map_err(|e| damaged(&e))?;
        let original = match (files.remove(volume::ORIGINAL_DENSITY), files.remove(volume::ORIGINAL_LABEL)) {
            (Some(density), Some(label)) => Some(volume::parse(&density, &label).map_err(|e| damaged(&e))?),
            _ => None,
        };
        if original.as_ref().is_some_and(|original| original.grid() != initial.grid()) {
            return Err(damaged("the tooth before its cavity was cut has another grid"));
        }
        let mut library = Library::empty();
        for (file, bytes) in files {
            library.hold(file, bytes);
        }
        let source = Source::new(format!("{name}: scenario.json"), text);
        let scenario = scenario::resolve(source, &library, Forms::Recorded).map_err(Unreadable::Scenario)?;
        if scenario.sha256 != head.scenario_sha256 {
            return Err(damaged("its scenario is not the one that its head names"));
        }
        if scenario.has_cavity() != original.is_some() {
            return Err(damaged("the tooth before its cavity was cut is missing"));
        }
        if head.tick_s != TICK_S {
            return Err(damaged("its ticks are of another length"));
        }
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
            begun,
            end_bytes,
        })
    }
}
