//! Earlier sessions of this computer, read on a thread of its own; of a page, those that the browser keeps.

use crate::platform;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use typodont_exercise::scenario::Scenario;
use typodont_lesson::{Attempt, InterruptedSession, SessionFolder};
use typodont_report::{SessionFile, Templates};

/// Earlier sessions; empty until they have been read.
#[derive(Default)]
pub struct SessionHistory {
    sessions: SessionFolder,
    reader: Option<Receiver<SessionFolder>>,
    /// Interrupted sessions that a page has kept; they arrive one by one.
    kept: Option<Receiver<InterruptedSession>>,
}

/// Results as a page keeps them; bundles are kept by the user who downloads them.
#[derive(Serialize, Deserialize)]
struct KeptHistory {
    version: u32,
    attempts: Vec<KeptAttempt>,
}

/// A result as a page keeps it.
#[derive(Serialize, Deserialize)]
struct KeptAttempt(#[serde(with = "AttemptFields")] Attempt);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Attempt")]
struct AttemptFields {
    scenario_id: String,
    participant: String,
    started: String,
    points: Option<(f64, f64)>,
    passed: bool,
    finished: bool,
    contact_s: f64,
    rated: Option<String>,
}

const KEPT_VERSION: u32 = 1;

/// Maximum number of results that a page keeps: fewer than 200 kB, of the 5 MB that browsers grant at least.
const KEPT_MAX: usize = 500;

/// Results of one person at one exercise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AttemptSummary {
    pub count: usize,
    /// Highest points, of how many; `None` if the exercise is not graded.
    pub best: Option<(f64, f64)>,
    pub last: Option<(f64, f64)>,
    /// Date of the last attempt, year-month-day.
    pub last_date: String,
    pub is_passed: bool,
}

/// Results that the page has kept; none if they cannot be read.
fn kept_attempts() -> Vec<Attempt> {
    let kept = platform::read_history().and_then(|text| serde_json::from_str::<KeptHistory>(&text).ok());
    kept.filter(|kept| kept.version == KEPT_VERSION)
        .map_or_else(Vec::new, |kept| kept.attempts.into_iter().map(|one| one.0).collect())
}

impl SessionHistory {
    /// Begins to read a folder. `wake` is called when it has been read.
    pub fn read(folder: &Path, templates: Templates, wake: Box<dyn Fn() + Send>) -> SessionHistory {
        if platform::IS_PAGE {
            let sessions = SessionFolder { attempts: kept_attempts(), ..SessionFolder::default() };
            let (sender, kept) = mpsc::channel();
            platform::read_kept_recordings(sender, wake);
            return SessionHistory { sessions, reader: None, kept: Some(kept) };
        }
        let (sender, reader) = mpsc::channel();
        let folder: PathBuf = folder.to_path_buf();
        let started = std::thread::Builder::new().name("session-history".into()).spawn(move || {
            let _ = sender.send(SessionFolder::read(&folder, &templates));
            wake();
        });
        // Without a thread the list of exercises is shown without results.
        SessionHistory { sessions: SessionFolder::default(), reader: started.is_ok().then_some(reader), kept: None }
    }

    /// Takes over the sessions once they have been read.
    pub fn poll(&mut self) {
        self.sessions.interrupted.extend(self.kept.iter().flat_map(Receiver::try_iter));
        let Some(read) = self.reader.as_ref().and_then(|reader| reader.try_recv().ok()) else { return };
        self.reader = None;
        let added = std::mem::replace(&mut self.sessions, read);
        self.sessions.attempts.extend(added.attempts);
    }

    pub fn is_read(&self) -> bool {
        self.reader.is_none()
    }

    /// Adds a session that has just ended; returns a complaint if a page cannot keep it.
    pub fn add(&mut self, session: &SessionFile) -> Option<String> {
        self.sessions.attempts.extend(Attempt::of(session));
        if !platform::IS_PAGE {
            return None;
        }
        let attempts = &self.sessions.attempts;
        let newest = attempts[attempts.len().saturating_sub(KEPT_MAX)..].iter().cloned().map(KeptAttempt).collect();
        let text = serde_json::to_string(&KeptHistory { version: KEPT_VERSION, attempts: newest }).ok()?;
        platform::write_history(&text).map(|why| format!("unwritable-history: {why}; the shelf forgets this result"))
    }

    /// The oldest interrupted session.
    pub fn interrupted(&self) -> Option<&InterruptedSession> {
        self.sessions.interrupted.first()
    }

    /// Puts an interrupted session back that could not go on.
    pub fn put_back(&mut self, session: InterruptedSession) {
        self.sessions.interrupted.insert(0, session);
    }

    /// Takes the oldest interrupted session off the list.
    pub fn take_interrupted(&mut self) -> Option<InterruptedSession> {
        let is_any = !self.sessions.interrupted.is_empty();
        is_any.then(|| self.sessions.interrupted.remove(0))
    }

    pub fn summary(&self, scenario_id: &str, participant: &str) -> AttemptSummary {
        let mut summary = AttemptSummary::default();
        for attempt in self.sessions.attempts_at(scenario_id, participant) {
            let is_better = |(points, _): &(f64, f64)| summary.best.is_none_or(|(best, _)| *points > best);
            summary.best = attempt.points.filter(is_better).or(summary.best);
            summary.count += 1;
            summary.last = attempt.points;
            summary.last_date = attempt.started.get(..10).unwrap_or_default().to_string();
            summary.is_passed |= attempt.is_passed();
        }
        summary
    }

    /// True if an exercise of the course is to be followed by its questionnaire: the person has finished every other
    /// exercise that has the same one, and has not answered it yet.
    pub fn is_course_over(&self, scenario: &Scenario, course: &[&Scenario], participant: &str) -> bool {
        let Some(own) = scenario.questionnaire.as_ref().map(|q| &q.id) else { return false };
        let mine = || self.sessions.attempts.iter().filter(|attempt| attempt.participant == participant);
        let is_finished = |id: &str| mine().any(|attempt| attempt.finished && attempt.scenario_id == id);
        let has_own = |other: &&&Scenario| other.questionnaire.as_ref().is_some_and(|q| q.id == *own);
        let others = course.iter().filter(has_own).filter(|other| other.id != scenario.id);
        others.into_iter().all(|other| is_finished(&other.id))
            && !mine().any(|attempt| attempt.rated.as_ref() == Some(own))
    }
}
