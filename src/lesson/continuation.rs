//! An interrupted session that goes on: its recording is repeated, and written again as the beginning of a new one.
//!
//! Takes the recording as far as it was kept. Gives a session that is prepared like a new one. The former recording stays
//! until the new one contains all of it.

use super::preparation::{PreparedSession, SessionConfig};
use super::seed::started_text;
use super::session_folder::{InterruptedSession, RecordingPlace};
use super::{LessonError, SessionSeed};
use jiff::Timestamp;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use typodont_core::device::DeviceSpec;
use typodont_exercise::record::{
    self, Continuation, ContinuationError, DeviceSpecFile, Recording, ResumptionFile, SeedOriginFile, VERSION,
};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_formats::sync_folder;
use typodont_report::Templates;
use typodont_report::bundle::PartialBundle;

/// An interrupted session whose recording has been read.
pub struct ReopenedSession {
    session: InterruptedSession,
    recording: Recording,
    /// The former folder, which other programs find in use meanwhile; `None` in memory.
    former: Option<PartialBundle>,
}

/// State of a session that goes on.
pub(super) struct Resumption {
    pub continuation: Continuation,
    pub former: Option<PartialBundle>,
}

impl InterruptedSession {
    /// Reads the recording, so that the session can go on.
    ///
    /// # Errors
    ///
    /// [`LessonError::NotResumable`] if the recording is damaged, ended, sealed, or of another version of this program.
    pub fn reopen(self) -> Result<ReopenedSession, LessonError> {
        let not = |why: String| LessonError::NotResumable { why };
        let (former, recording) = match &self.place {
            RecordingPlace::Folder(folder) => {
                let former = PartialBundle::resume(folder)?;
                (Some(former), Recording::read(&folder.join(record::FILE_NAME)))
            }
            RecordingPlace::Memory { recording, .. } => (None, Recording::parse(record::FILE_NAME, recording)),
        };
        let recording = recording.map_err(|error| not(error.to_string()))?;
        let head = &recording.head;
        if recording.end.is_some() {
            return Err(not("all of it was recorded".into()));
        }
        if recording.is_empty() {
            return Err(not("nothing of it was recorded".into()));
        }
        let damage =
            recording.loss.as_ref().filter(|loss| loss.seen_until.is_some_and(|tick| tick.0 >= recording.len() as u64));
        if let Some(damage) = damage {
            return Err(not(format!("its recording is damaged ({})", damage.what)));
        }
        if !head.live || head.operator.is_some() {
            return Err(not("no person performed it".into()));
        }
        if head.seed_origin == Some(SeedOriginFile::Sealed) {
            return Err(not("its random choices are sealed".into()));
        }
        if (head.version, head.typodont_version.as_str()) != (VERSION, env!("CARGO_PKG_VERSION")) {
            return Err(not(format!("it began with version {}", head.typodont_version)));
        }
        Ok(ReopenedSession { session: self, recording, former })
    }
}

impl ReopenedSession {
    pub fn session(&self) -> &InterruptedSession {
        &self.session
    }

    pub fn scenario(&self) -> &Arc<Scenario> {
        &self.recording.scenario
    }

    pub fn seed(&self) -> SessionSeed {
        let head = &self.recording.head;
        SessionSeed { value: head.seed, origin: head.seed_origin.unwrap_or(SeedOriginFile::System) }
    }

    /// The workpiece with which the session began.
    ///
    /// # Errors
    ///
    /// [`LessonError::NotResumable`] if the recorded volume does not fit the exercise.
    pub fn make_workpiece(&self) -> Result<Arc<Workpiece>, LessonError> {
        self.recording.workpiece().map(Arc::new).map_err(|why| LessonError::NotResumable { why })
    }

    /// Repeats the session into a new recording, for a device like the one with which it began.
    ///
    /// # Errors
    ///
    /// [`LessonError::NotResumable`] if the device is another one, all stages were performed, or this machine repeats the
    /// recording with other results; other errors if the folder or the recording cannot be written.
    pub fn prepare(
        self,
        workpiece: Arc<Workpiece>,
        spec: DeviceSpec,
        templates: Templates,
        now: Timestamp,
    ) -> Result<PreparedSession, LessonError> {
        let ReopenedSession { session, recording, former } = self;
        let not = |why: String| LessonError::NotResumable { why };
        let mut head = recording.head.clone();
        if DeviceSpecFile::from(&spec) != head.device {
            return Err(not(format!("it began with another device ({})", head.device.name)));
        }
        head.resumed.push(ResumptionFile { tick: recording.len() as u64, at: started_text(now) });
        let out = match &session.place {
            RecordingPlace::Folder(folder) => folder.parent(),
            RecordingPlace::Memory { .. } => None,
        };
        let mut prepared =
            SessionConfig::open(&head, recording.scenario.clone(), workpiece.clone(), spec, out, templates)?;
        let gone_on = record::go_on(&recording, &workpiece, &mut prepared.recorder);
        match gone_on.and_then(|continuation| Ok((continuation, prepared.recorder.flush()?))) {
            Ok((continuation, ())) => {
                prepared.resumption = Some(Resumption { continuation, former });
                Ok(prepared)
            }
            Err(error) => {
                let PreparedSession { recorder, disk_sync, partial_bundle, .. } = prepared;
                // Some systems remove no file that is open.
                drop((recorder, disk_sync));
                partial_bundle.abandon();
                Err(match error {
                    ContinuationError::Recorder(error) => LessonError::RecordingNotStarted(error),
                    ContinuationError::StagesOver | ContinuationError::Different(_) => not(error.to_string()),
                })
            }
        }
    }
}

impl Resumption {
    /// Removes the former recording from the disk, once the new one is there.
    pub fn replace_former(former: Option<PartialBundle>, new: &PartialBundle) {
        // Some systems sync no file that was opened only for reading.
        let is_written = |path: PathBuf| {
            let synced = fs::File::options().write(true).open(&path).and_then(|file| file.sync_all());
            path.ancestors().skip(1).take(2).for_each(sync_folder);
            synced.is_ok()
        };
        // A former recording that cannot be removed is offered again; nothing is lost by it.
        if let Some(former) = former.filter(|_| new.recording_path().is_none_or(is_written)) {
            former.abandon();
        }
    }
}
