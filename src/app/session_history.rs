//! Earlier sessions of this computer, read on a thread of its own.

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
}

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

impl SessionHistory {
    /// Begins to read a folder. `wake` is called when it has been read.
    pub fn read(folder: &Path, templates: Templates, wake: Box<dyn Fn() + Send>) -> SessionHistory {
        let (sender, reader) = mpsc::channel();
        let folder: PathBuf = folder.to_path_buf();
        let started = std::thread::Builder::new().name("session-history".into()).spawn(move || {
            let _ = sender.send(SessionFolder::read(&folder, &templates));
            wake();
        });
        // Without a thread the list of exercises is shown without results.
        SessionHistory { sessions: SessionFolder::default(), reader: started.is_ok().then_some(reader) }
    }

    /// Takes over the sessions once they have been read.
    pub fn poll(&mut self) {
        let Some(read) = self.reader.as_ref().and_then(|reader| reader.try_recv().ok()) else { return };
        self.reader = None;
        let added = std::mem::replace(&mut self.sessions, read);
        self.sessions.attempts.extend(added.attempts);
    }

    pub fn is_read(&self) -> bool {
        self.reader.is_none()
    }

    /// Adds a session that has just ended.
    pub fn add(&mut self, session: &SessionFile) {
        self.sessions.attempts.extend(Attempt::of(session));
    }

    /// The oldest interrupted session.
    pub fn interrupted(&self) -> Option<&InterruptedSession> {
        self.sessions.interrupted.first()
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
