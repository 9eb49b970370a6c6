//! The folder in which sessions are kept: earlier results, and sessions that were interrupted.
//!
//! Takes the folder. Gives the results that agree with the digests of their files, and the sessions whose bundles were
//! never made. Never replays a recording.

use std::fs;
use std::path::{Path, PathBuf};
use typodont_exercise::record::{self, Recording, RecordingHeadFile, SeedOriginFile};
use typodont_formats::read_file;
use typodont_report::bundle::{
    BundleFolder, CompletedBundle, CompletionObserver, PartialBundle, SESSION_FILE, is_in_use, is_partial,
};
use typodont_report::{RatingFile, SessionFile, Templates, Verifier};

/// Folder, within that of the sessions, for interrupted sessions that are not to be finished.
const SET_ASIDE: &str = "set-aside";

/// Contact time from which an exercise that is not graded counts as performed, s: a trainee who only confirms every stage
/// has not.
const CONTACT_LEAST: f64 = 2.0;

/// An earlier attempt of a person at an exercise.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    pub scenario_id: String,
    pub participant: String,
    /// Start of the session, RFC 3339.
    pub started: String,
    /// Points and their maximum; `None` if the exercise is not graded.
    pub points: Option<(f64, f64)>,
    pub passed: bool,
    /// True if all stages were performed.
    pub finished: bool,
    /// Time during which the instrument touched anything, s.
    pub contact_s: f64,
    /// Id of the questionnaire, if at least one statement was rated.
    pub rated: Option<String>,
}

/// A session that was interrupted before its bundle was made.
#[derive(Clone, Debug, PartialEq)]
pub struct InterruptedSession {
    pub(super) place: RecordingPlace,
    pub scenario_id: String,
    pub participant: String,
    /// Start of the session, RFC 3339.
    pub started: String,
    /// True if the session can be scored only with the examiner's code.
    pub is_sealed: bool,
}

/// The place of an interrupted session's recording.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum RecordingPlace {
    Folder(PathBuf),
    /// A recording that was kept elsewhere than in a folder, as far as it goes.
    Memory {
        name: String,
        recording: Vec<u8>,
    },
}

/// The sessions of a folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionFolder {
    pub attempts: Vec<Attempt>,
    pub interrupted: Vec<InterruptedSession>,
}

impl SessionFolder {
    /// Reads a folder. Results that differ from the digests of their files, and those of scripted operators, are left
    /// out; so is a session that a program is recording at present.
    pub fn read(folder: &Path, templates: &Templates) -> SessionFolder {
        let verifier = Verifier::new(templates);
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        folders.sort();
        let mut found = SessionFolder::default();
        for path in folders {
            match is_partial(&path) {
                true => found.interrupted.extend(interrupted(path)),
                false => found.attempts.extend(attempt(&path, &verifier)),
            }
        }
        found.attempts.sort_by(|a, b| a.started.cmp(&b.started));
        found
    }

    /// Attempts of a person at an exercise, oldest first.
    pub fn attempts_at<'a>(&'a self, scenario_id: &'a str, participant: &'a str) -> impl Iterator<Item = &'a Attempt> {
        self.attempts.iter().filter(move |a| a.scenario_id == scenario_id && a.participant == participant)
    }
}

impl Attempt {
    /// True if the attempt passed; an exercise that is not graded is passed by performing all of it with the instrument.
    pub fn is_passed(&self) -> bool {
        if self.points.is_some() { self.passed } else { self.finished && self.contact_s >= CONTACT_LEAST }
    }

    /// The attempt of which a result tells; `None` for a scripted operator.
    pub fn of(session: &SessionFile) -> Option<Attempt> {
        let grade = session.grade.as_ref();
        let is_rated = |item: &RatingFile| item.value.is_some();
        session.operator.is_none().then(|| Attempt {
            scenario_id: session.scenario.id.clone(),
            participant: session.participant.clone(),
            started: session.started.clone(),
            points: grade.map(|grade| (grade.points, grade.max_points)),
            passed: grade.is_some_and(|grade| grade.passed),
            finished: session.ended_because == "complete",
            contact_s: session.metrics.get("contact_time_s").copied().flatten().unwrap_or_default(),
            rated: session.questionnaire.as_ref().filter(|q| q.items.iter().any(is_rated)).map(|q| q.id.clone()),
        })
    }
}

impl InterruptedSession {
    /// Scores the session as far as it was recorded, and makes its bundle.
    ///
    /// # Errors
    ///
    /// When the recording cannot be scored or a file cannot be written; the message says why.
    pub fn finish(&self, templates: &Templates, observer: CompletionObserver) -> Result<CompletedBundle, String> {
        let unfinished = match &self.place {
            RecordingPlace::Folder(folder) => PartialBundle::resume(folder).map_err(|e| e.to_string())?,
            RecordingPlace::Memory { name, recording } => PartialBundle::in_memory_from(name, recording.clone()),
        };
        unfinished.complete_interrupted(templates, observer).map_err(|e| e.to_string())
    }

    /// Moves the session's folder to the folder `set-aside`, where `typodont finish` can still complete it. A recording
    /// that is in no folder is left to its keeper.
    ///
    /// # Errors
    ///
    /// When the folder cannot be moved; the message says why.
    pub fn set_aside(&self) -> Result<(), String> {
        let RecordingPlace::Folder(folder) = &self.place else { return Ok(()) };
        let name = folder.file_name().unwrap_or_default();
        let aside = folder.with_file_name(SET_ASIDE);
        let to = aside.join(name);
        let moved = fs::create_dir_all(&aside).and_then(|()| fs::rename(folder, &to));
        moved.map_err(|e| format!("{}: unwritable-file: {e}", to.display()))
    }

    /// The interrupted session of a person whose recording was kept in memory; `None` if the recording has no beginning.
    /// `name` is that of the bundle.
    pub fn kept(name: &str, recording: Vec<u8>) -> Option<InterruptedSession> {
        let head = Recording::parse_head(record::FILE_NAME, &recording).ok()?;
        InterruptedSession::of(&head, RecordingPlace::Memory { name: name.to_string(), recording })
    }

    /// Name of the bundle and the bytes of a recording that is in no folder.
    pub fn kept_recording(&self) -> Option<(&str, &[u8])> {
        match &self.place {
            RecordingPlace::Folder(_) => None,
            RecordingPlace::Memory { name, recording } => Some((name, recording)),
        }
    }

    /// A person's interrupted session; `None` for that of a script.
    fn of(head: &RecordingHeadFile, place: RecordingPlace) -> Option<InterruptedSession> {
        head.operator.is_none().then(|| InterruptedSession {
            place,
            is_sealed: head.seed_origin == Some(SeedOriginFile::Sealed),
            scenario_id: head.scenario_id.clone(),
            participant: head.participant.clone(),
            started: head.started.clone(),
        })
    }
}

/// The attempt of a bundle, if its files agree with their digests.
fn attempt(bundle: &Path, verifier: &Verifier) -> Option<Attempt> {
    let text = fs::read_to_string(bundle.join(SESSION_FILE)).ok()?;
    let session = SessionFile::from_json(&text).ok()?;
    let attempt = Attempt::of(&session)?;
    (!verifier.check(&BundleFolder::on_disk(bundle), &session).differs()).then_some(attempt)
}

/// The interrupted session of a folder; `None` without a recording, and while a program is recording it.
fn interrupted(folder: PathBuf) -> Option<InterruptedSession> {
    if is_in_use(&folder) {
        return None;
    }
    let bytes = read_file(&folder.join(record::FILE_NAME)).ok()?;
    let head = Recording::parse_head(record::FILE_NAME, &bytes).ok()?;
    InterruptedSession::of(&head, RecordingPlace::Folder(folder))
}
