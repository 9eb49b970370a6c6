//! The reader of recordings, complete, cut off or damaged.
//!
//! A recording is read up to the first damage: chunks are checked by their checksums, so that everything before it is as
//! it was written. The reader never continues beyond damage, because a replay needs every tick from the first on.

use super::file::{
    DigestFile, END, EventFile, EventKindFile, HEAD, InputFile, RecordingEndFile, RecordingHeadFile, VERSION,
};
use super::mcap_walk;
use super::mcap_walk::Stop;
use super::replay::RunningDigest;
use super::seal::{SEED, SeedFile, commitment};
use super::tick_record::{TickLayout, TickRecord};
use super::volume;
use crate::scenario;
use crate::scenario::{ResolveMode, Scenario, Workpiece};
use crate::session::Input;
use mcap::records::Record;
use serde::Deserialize;
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
    /// End metadata; `None` for a session that was cut off: interrupted, or damaged before its end.
    pub end: Option<RecordingEndFile>,
    /// Part of the file that could not be read; `None` for a whole file.
    pub loss: Option<RecordingLoss>,
    pub scenario: Arc<Scenario>,
    /// The volume at the start of the session.
    pub initial: Arc<Volume>,
    /// The tooth before its cavity was cut; `None` without a prepared cavity.
    pub original: Option<Arc<Volume>>,
    /// One record per tick, from tick 0 without gaps.
    pub ticks: Vec<TickRecord>,
    /// Inputs in order, each before the step of its tick.
    pub inputs: Vec<(Tick, Input)>,
    /// Commands in order, each before the step of its tick; `None` for a command of a sealed session that would have
    /// revealed a draw.
    pub commands: Vec<(Tick, Option<Command>)>,
    /// Bytes of the `/event` messages, in order, for the digest.
    pub(super) events: Vec<(Tick, Vec<u8>)>,
    pub(super) digests: Vec<DigestFile>,
    /// Digest of everything before the first tick.
    pub(super) initial_digest: RunningDigest,
    /// Bytes of the end metadata as written, for the digest.
    pub(super) end_bytes: Vec<u8>,
}

/// Part of a recording's file that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingLoss {
    /// Byte from which on the file cannot be read.
    pub at_byte: usize,
    /// Number of bytes from there to the end of the file.
    pub bytes: usize,
    /// Description of the damage.
    pub what: String,
    /// Latest tick that is named at or beyond the damage; `None` if nothing there can be recognised.
    pub seen_until: Option<Tick>,
}

/// Reason for which a recording cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingError {
    /// The file cannot be read.
    File(Diagnostic),
    /// The session ended before its first ticks reached the file.
    NothingRecorded { name: String },
    /// The recording was made by a newer program.
    Newer { name: String, version: u32 },
    /// The session is sealed, and was cut off before its seed was revealed.
    Sealed { name: String },
    /// A part is missing or damaged.
    Damaged { name: String, what: String },
    /// This program no longer accepts the recording's scenario or tables.
    Scenario(Vec<Diagnostic>),
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            RecordingError::File(diagnostic) => f.write_str(&diagnostic.headline()),
            RecordingError::NothingRecorded { name } => {
                write!(f, "{name}: empty-recording: nothing was recorded, because the session ended as it began")
            }
            RecordingError::Newer { name, version } => {
                write!(
                    f,
                    "{name}: newer-recording: made by a newer version of Typodont: the recording has version {version}, \
                     this program reads up to {VERSION}; update the program"
                )
            }
            RecordingError::Sealed { name } => write!(
                f,
                "{name}: sealed-recording: the examination was cut off before its seed was revealed; give the \
                 examiner's code: typodont finish FOLDER --seed-sealed FILE"
            ),
            RecordingError::Damaged { name, what } => write!(f, "{name}: damaged-recording: {what}"),
            RecordingError::Scenario(found) => f.write_str(&headlines(found)),
        }
    }
}

impl std::error::Error for RecordingError {}

/// The part of the session metadata that every version has.
#[derive(Deserialize)]
struct VersionFile {
    version: u32,
}

/// Contents of a recording's file before they are checked and assembled.
#[derive(Default)]
struct RecordingParts {
    head: Option<RecordingHeadFile>,
    /// Version of a recording that was made by a newer program, of which nothing else is read.
    newer_version: Option<u32>,
    end: Option<RecordingEndFile>,
    files: BTreeMap<String, Vec<u8>>,
    channels: BTreeMap<u16, String>,
    ticks: Vec<TickRecord>,
    events: Vec<(Tick, Vec<u8>)>,
    inputs: Vec<(Tick, Input)>,
    commands: Vec<(Tick, Option<Command>)>,
    /// Seed that a sealed session revealed.
    revealed_seed: Option<u64>,
    digests: Vec<DigestFile>,
    initial_digest: RunningDigest,
    end_bytes: Vec<u8>,
}

impl Recording {
    /// Reads a recording up to its end or to the first damage; [`Recording::loss`] tells of the rest.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, has no intact tick or was made by a newer program, or if this
    /// program no longer accepts its scenario.
    pub fn read(path: &Path) -> Result<Recording, RecordingError> {
        let bytes = typodont_formats::read_file(path).map_err(RecordingError::File)?;
        Recording::parse(&path.display().to_string(), &bytes)
    }

    /// Reads a recording from bytes; `name` is used in error messages.
    ///
    /// # Errors
    /// Returns an error if no tick is intact or the bytes were written by a newer program, or if this program no longer
    /// accepts the scenario.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
        let nothing_recorded = || RecordingError::NothingRecorded { name: name.to_string() };
        // After a power cut a file may have its size, but only zeros for content.
        if bytes.iter().all(|byte| *byte == 0) {
            return Err(nothing_recorded());
        }
        let mut found = RecordingParts::default();
        let stop = mcap_walk::walk(bytes, |record| found.add(record)).err();
        let incomplete = found.discard_inconsistent_end(bytes.len());
        let loss = stop.or(incomplete).map(|Stop { at, what }| {
            let seen_until = mcap_walk::last_time_after(bytes, at).map(tick_at);
            RecordingLoss { at_byte: at, bytes: bytes.len() - at, what, seen_until }
        });
        let has_ticks = !found.ticks.is_empty();
        found.assemble(name, loss.clone()).map_err(|error| match (error, loss) {
            // The file ends before the first tick. Where ticks can be seen beyond the damage, something was recorded.
            (RecordingError::Damaged { .. }, Some(loss))
                if !has_ticks && loss.seen_until.is_none() && loss.at_byte > 0 =>
            {
                nothing_recorded()
            }
            // What is missing was not read because of the damage: the damage is the reason.
            (RecordingError::Damaged { name, what }, Some(loss)) => {
                RecordingError::Damaged { name, what: format!("{what}: {}", loss.what) }
            }
            (error, _) => error,
        })
    }

    /// Returns a recording of a session that has no file, still without ticks, inputs and commands. It has no digests:
    /// it can be scored, but not verified.
    pub fn unverified(head: RecordingHeadFile, scenario: Arc<Scenario>, workpiece: &Workpiece) -> Recording {
        Recording {
            head,
            end: None,
            scenario,
            initial: workpiece.volume.clone(),
            original: workpiece.original.clone(),
            ticks: Vec::new(),
            inputs: Vec::new(),
            commands: Vec::new(),
            events: Vec::new(),
            digests: Vec::new(),
            initial_digest: RunningDigest::new(),
            end_bytes: Vec::new(),
            loss: None,
        }
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
        let what = walked.err().map_or("the session metadata is missing".to_string(), |stop| stop.what);
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

    /// Returns true if the recording ends before the session did.
    pub fn is_cut_off(&self) -> bool {
        self.end.is_none()
    }

    /// Returns a sentence for the person who reads a cut-off or damaged recording: what was read and what was lost;
    /// `None` for a whole one.
    pub fn describe_loss(&self) -> Option<String> {
        let kept = Tick(self.ticks.len() as u64).seconds();
        let what = self.loss.as_ref().map_or("", |loss| loss.what.as_str());
        let seen_until = self.loss.as_ref().and_then(|loss| loss.seen_until).map(Tick::seconds);
        match (self.is_cut_off(), seen_until) {
            (false, _) if self.loss.is_none() => None,
            (false, _) => Some(format!("the session is complete, and nothing of it was lost ({what})")),
            (true, Some(until)) if until > kept => Some(format!(
                "the recording is damaged after {kept:.3} s: from there to {until:.3} s at least, {:.3} s were lost ({what})",
                until - kept
            )),
            (true, _) if what.is_empty() => {
                Some(format!("the recording is cut off before its end: it ends after {kept:.3} s"))
            }
            (true, _) => {
                Some(format!("the recording is cut off before its end: what followed {kept:.3} s was lost ({what})"))
            }
        }
    }
}

/// Returns the tick of a message by its time, ns.
fn tick_at(time: u64) -> Tick {
    Tick((time as f64 / 1e9 / TICK_S).round() as u64)
}

impl RecordingParts {
    /// Discards the end metadata if the records before it are not all there, and returns the reason.
    fn discard_inconsistent_end(&mut self, size: usize) -> Option<Stop> {
        let ticks = self.ticks.len() as u64;
        let last_digest = self.digests.last().map(|digest| digest.tick);
        let is_consistent = |end: &RecordingEndFile| end.servo.ticks == ticks && last_digest == Some(ticks);
        if self.end.as_ref().is_none_or(is_consistent) {
            return None;
        }
        self.end = None;
        Some(Stop { at: size, what: "the last records before the end are missing".to_string() })
    }

    fn add(&mut self, record: Record) -> Result<(), String> {
        if self.newer_version.is_some() {
            // The whole recording is refused once everything is read: a newer format cannot be checked here.
            return Ok(());
        }
        match record {
            Record::Metadata(metadata) => {
                let text = metadata.metadata.get("json").map_or("", String::as_str);
                let broken = |e: serde_json::Error| format!("metadata \"{}\": {e}", metadata.name);
                match metadata.name.as_str() {
                    HEAD => {
                        self.initial_digest.part(HEAD, text.as_bytes());
                        let VersionFile { version } = serde_json::from_str(text).map_err(broken)?;
                        match version > VERSION {
                            true => self.newer_version = Some(version),
                            false => self.head = Some(serde_json::from_str(text).map_err(broken)?),
                        }
                    }
                    SEED => {
                        let SeedFile { seed } = serde_json::from_str(text).map_err(broken)?;
                        self.revealed_seed = Some(seed);
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
        let tick = TickRecord::parse(data, TickLayout::of(version)).ok_or(format!("tick {next} cannot be decoded"))?;
        if tick.tick.0 != next {
            return Err(format!("tick {} found where tick {next} was expected", tick.tick.0));
        }
        self.ticks.push(tick);
        Ok(())
    }

    fn add_event(&mut self, data: &[u8]) -> Result<(), String> {
        let event: EventFile = serde_json::from_slice(data).map_err(|e| format!("invalid event: {e}"))?;
        let tick = Tick(event.tick);
        if self.events.last().is_some_and(|(before, _)| *before > tick) || tick.0 > self.ticks.len() as u64 {
            return Err(format!("an event of tick {} is out of order after {} ticks", tick.0, self.ticks.len()));
        }
        match &event.what {
            EventKindFile::Input(input) => self.inputs.push((tick, Input::from(InputFile::clone(input)))),
            EventKindFile::Command(command) => self.commands.push((tick, Some(Command::from(command)))),
            EventKindFile::SealedCommand {} => self.commands.push((tick, None)),
            _ => {}
        }
        self.events.push((tick, data.to_vec()));
        Ok(())
    }

    fn assemble(self, name: &str, loss: Option<RecordingLoss>) -> Result<Recording, RecordingError> {
        let damaged = |what: &str| RecordingError::Damaged { name: name.to_string(), what: what.to_string() };
        if let Some(version) = self.newer_version {
            return Err(RecordingError::Newer { name: name.to_string(), version });
        }
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
            revealed_seed,
            ..
        } = self;
        let mut head = head.ok_or(damaged("the session metadata is missing"))?;
        if let Some(expected) = &head.seed_sha256 {
            let seed = revealed_seed.ok_or(RecordingError::Sealed { name: name.to_string() })?;
            if commitment(&head, seed) != *expected {
                return Err(damaged("the seed is not the one to which the recording committed itself at the start"));
            }
            head.seed = seed;
        }
        let text = files.remove(scenario::SCENARIO_PART).ok_or(damaged("the scenario is missing"))?;
        let text = String::from_utf8(text).map_err(|_| damaged("the scenario is not valid UTF-8"))?;
        let (initial, original) = take_volumes(&mut files).map_err(|what| damaged(&what))?;
        let mut library = Library::empty();
        for (file, bytes) in files {
            library.insert(file, bytes);
        }
        let source = SourceText::new(format!("{name}: scenario.json"), text);
        let mut scenario =
            scenario::resolve(source, &library, ResolveMode::FromRecording).map_err(RecordingError::Scenario)?;
        if let Some(fdi) = head.tooth_fdi {
            scenario.renumber_teeth(fdi).map_err(|what| damaged(&what))?;
        }
        check_agreement(&head, &scenario, original.is_some()).map_err(damaged)?;
        if end.is_none() && ticks.is_empty() {
            return Err(damaged("no tick is intact"));
        }
        Ok(Recording {
            head,
            end,
            loss,
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
    let density = files.remove(scenario::INITIAL_DENSITY_PART).ok_or("the initial density is missing")?;
    let label = files.remove(scenario::INITIAL_LABEL_PART).ok_or("the initial labels are missing")?;
    let initial = volume::parse(&density, &label)?;
    let original = match (files.remove(scenario::ORIGINAL_DENSITY_PART), files.remove(scenario::ORIGINAL_LABEL_PART)) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use mcap::records::{MessageHeader, Metadata};
    use mcap::write::WriteOptions;

    #[test]
    fn a_recording_of_a_newer_program_is_named_as_that() {
        // Aim: whoever opens tomorrow's recording with today's program reads what to do, and not of damage in the middle
        // of it. Method: a recording of the next version, with other metadata, ticks of another length and a command that
        // this version does not have.
        let mut bytes = Vec::new();
        let options = WriteOptions::new().chunk_size(None).disable_seeking(true).compression_threads(0);
        let mut writer = options.create(std::io::Cursor::new(&mut bytes)).unwrap();
        let json = format!("{{\"version\":{},\"session\":\"of another form\"}}", VERSION + 1);
        let metadata = [("json".to_string(), json)].into_iter().collect();
        writer.write_metadata(&Metadata { name: HEAD.to_string(), metadata }).unwrap();
        let none = BTreeMap::new();
        for (topic, data) in [("/haptic", &b"short"[..]), ("/event", b"{\"tick\":0,\"command\":{\"sterilise\":{}}}")] {
            let channel_id = writer.add_channel(0, topic, "json", &none).unwrap();
            let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let Err(error) = Recording::parse("new.mcap", &bytes) else { panic!("it is read") };
        assert_eq!(error, RecordingError::Newer { name: "new.mcap".to_string(), version: VERSION + 1 });
        assert!(error.to_string().contains("newer version of Typodont"), "{error}");
        // A power cut in the middle does not hide the reason.
        let Err(error) = Recording::parse("new.mcap", &bytes[..bytes.len() - 40]) else { panic!("it is read") };
        assert!(matches!(error, RecordingError::Newer { .. }), "{error}");
    }
}
