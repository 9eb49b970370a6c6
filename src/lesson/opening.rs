//! From an exercise to a session that is about to begin, and from a recording to its bundle.

use super::{Failed, Lesson, SecondHand};
use crate::device::{Device, Spec};
use crate::record::{EndFile, HeadFile, Recorder, ServoFile};
use crate::report::Templates;
use crate::report::bundle::Unfinished;
use crate::scenario::{Scenario, Workpiece, hex};
use crate::session::{self, Heard, Operator, OperatorFile, Progress, Session};
use crate::sim::Simulation;
use jiff::Timestamp;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a lesson begins with.
pub struct Opening<'a> {
    pub scenario: Arc<Scenario>,
    /// Decides what the exercise leaves to chance; up to 2⁵³, as far as every JSON reader counts.
    pub seed: u64,
    /// A code of up to 64 letters; never a name.
    pub participant: &'a str,
    /// Folder in which the bundle is made.
    pub out: &'a Path,
    /// SHA-256 of files that the scenario does not name, by name.
    pub digests: BTreeMap<String, String>,
    /// Whose pages the bundle gets.
    pub templates: Templates,
    /// When it begins.
    pub started: Timestamp,
}

/// Everything made and opened; nothing turns yet.
pub struct Prepared {
    pub(super) scenario: Arc<Scenario>,
    pub(super) workpiece: Arc<Workpiece>,
    pub(super) recorder: Recorder,
    pub(super) unfinished: Unfinished,
    pub(super) templates: Templates,
    spec: Spec,
    seed: u64,
}

impl Opening<'_> {
    /// Makes the matter.
    pub fn make(&self) -> Result<Arc<Workpiece>, Failed> {
        let made = Workpiece::make(&self.scenario, self.seed);
        made.map(Arc::new).map_err(|why| Failed::Impossible { scenario: self.scenario.id.clone(), why })
    }

    /// Opens the recording of what was made, for a device and for the script that moves it, if one does.
    pub fn prepare(
        self,
        workpiece: Arc<Workpiece>,
        spec: Spec,
        operator: Option<&OperatorFile>,
    ) -> Result<Prepared, Failed> {
        let Opening { scenario, seed, participant, out, digests, templates, started } = self;
        let head = HeadFile {
            participant: participant.to_string(),
            started: format!("{started:.0}"),
            live: operator.is_none(),
            operator: operator.map(|o| o.id.clone()),
            digests,
            ..HeadFile::of(&scenario, &spec, seed)
        };
        let unfinished = Unfinished::begin(out, &bundle_name(&head, started))?;
        match Recorder::create(&unfinished.recording(), &head, &scenario, &workpiece) {
            Ok(recorder) => Ok(Prepared { scenario, workpiece, recorder, unfinished, templates, spec, seed }),
            Err(error) => {
                unfinished.abandon();
                Err(Failed::Unbegun(error))
            }
        }
    }
}

/// `exercise_time_digest`: sorts by exercise and time, and two sessions of one second differ. It names nobody.
fn bundle_name(head: &HeadFile, started: Timestamp) -> String {
    let mark = Sha256::digest(format!("{}/{}/{}/{started}", head.participant, head.seed, std::process::id()));
    format!("{}_{}_{}", head.scenario_id, started.strftime("%Y%m%dT%H%M%SZ"), hex(&mark[..4]))
}

impl Prepared {
    /// Begins with a device in a person's hand, in real time. Gives what is to be said first.
    pub fn begin(
        self,
        device: Box<dyn Device + Send>,
        second: Option<SecondHand>,
    ) -> Result<(Lesson, Vec<Heard>), Failed> {
        let simulation = self.simulation();
        Lesson::begin(self, simulation, device, second)
    }

    /// Lets a script play it to its end, as fast as the machine can.
    pub fn play(self, operator: OperatorFile) -> Result<Recorded, Failed> {
        let mut simulation = self.simulation();
        let Prepared { scenario, workpiece, mut recorder, unfinished, templates, spec, seed } = self;
        let mut session = Session::new(scenario.clone(), &workpiece);
        let mut trainee = Operator::new(operator, scenario, workpiece, spec, seed);
        let progress = session::run(&mut session, &mut simulation, &mut trainee, &mut recorder);
        let reason = match progress.map_err(|e| Failed::stopped(&unfinished, &e))? {
            Progress::Complete if session.outcome().aborted => "aborted".to_string(),
            Progress::Complete => "complete".to_string(),
            Progress::DeviceGone(gone) => gone.to_string(),
        };
        let end = EndFile { reason, servo: ServoFile::of(&simulation) };
        Recorded::close(recorder, &end, unfinished, templates)
    }

    fn simulation(&self) -> Simulation {
        Simulation::new(session::setup(&self.scenario, &self.workpiece, self.spec.clone()))
    }
}

/// A session that is over and not scored yet.
pub struct Recorded {
    unfinished: Unfinished,
    templates: Templates,
}

impl Recorded {
    pub(super) fn close(
        recorder: Recorder,
        end: &EndFile,
        unfinished: Unfinished,
        templates: Templates,
    ) -> Result<Recorded, Failed> {
        recorder.finish(end).map_err(|e| Failed::stopped(&unfinished, &e))?;
        Ok(Recorded { unfinished, templates })
    }

    /// Scores, draws and writes; returns the bundle's folder.
    pub fn complete(self) -> Result<PathBuf, Failed> {
        Ok(self.unfinished.complete(&self.templates)?)
    }
}
