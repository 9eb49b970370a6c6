//! Preparation of a session from an exercise, and the completion of its recording to a bundle.

use super::LessonError;
use super::disk_sync::DiskSync;
use super::seed::{SessionSeed, started_text};
#[cfg(feature = "devices")]
use super::{Lesson, PendingSecondHand, continuation::Resumption, live::LiveEvent};
use jiff::Timestamp;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
#[cfg(feature = "devices")]
use typodont_core::device::Device;
use typodont_core::device::DeviceSpec;
use typodont_core::sim::Simulation;
use typodont_exercise::record::{Recorder, RecordingEndFile, RecordingHeadFile, SeedOriginFile, ServoStatsFile};
use typodont_exercise::scenario::{Scenario, Workpiece, hex};
use typodont_exercise::session::{Operator, OperatorFile, RunEnd, Session};
use typodont_report::Templates;
use typodont_report::bundle::{BundleFolder, CompletionObserver, PartialBundle, RecordingGrowth};

/// Configuration of a session.
pub struct SessionConfig<'a> {
    pub scenario: Arc<Scenario>,
    /// Seed of all random choices of the exercise.
    pub seed: SessionSeed,
    /// A code of up to 64 letters; never a name.
    pub participant: &'a str,
    /// Folder in which the bundle is made; `None` for a bundle in memory.
    pub out: Option<&'a Path>,
    /// SHA-256 of files that the scenario does not name, by name.
    pub digests: BTreeMap<String, String>,
    /// Templates of the bundle's pages.
    pub templates: Templates,
    /// Time at which the session begins.
    pub started: Timestamp,
}

/// A session whose workpiece is made and whose recording is open; the simulation does not run yet.
pub struct PreparedSession {
    pub(super) scenario: Arc<Scenario>,
    pub(super) workpiece: Arc<Workpiece>,
    pub(super) recorder: Recorder,
    /// `None` in memory.
    pub(super) disk_sync: Option<DiskSync>,
    pub(super) partial_bundle: PartialBundle,
    pub(super) templates: Templates,
    spec: DeviceSpec,
    seed: u64,
    /// State of a session that goes on; `None` for a new one.
    #[cfg(feature = "devices")]
    pub(super) resumption: Option<Resumption>,
}

impl SessionConfig<'_> {
    /// Makes the volume and its surroundings.
    ///
    /// # Errors
    ///
    /// [`LessonError::ImpossibleScene`] if the exercise cannot be made with this seed.
    pub fn make_workpiece(&self) -> Result<Arc<Workpiece>, LessonError> {
        let made = Workpiece::make(&self.scenario, self.seed.value);
        made.map(Arc::new).map_err(|why| LessonError::ImpossibleScene { scenario: self.scenario.id.clone(), why })
    }

    /// Creates the bundle's folder and opens the recording, for a device and for the script that operates it, if there
    /// is one.
    ///
    /// # Errors
    ///
    /// When the folder or the recording cannot be created.
    pub fn prepare(
        self,
        workpiece: Arc<Workpiece>,
        spec: DeviceSpec,
        operator: Option<&OperatorFile>,
    ) -> Result<PreparedSession, LessonError> {
        let SessionConfig { scenario, seed, participant, out, digests, templates, started } = self;
        let head = RecordingHeadFile {
            participant: participant.to_string(),
            started: started_text(started),
            seed_origin: Some(seed.origin),
            live: operator.is_none(),
            operator: operator.map(|o| o.id.clone()),
            digests,
            ..RecordingHeadFile::of(&scenario, &spec, seed.value)
        };
        SessionConfig::open(&head, scenario, workpiece, spec, out, templates)
    }

    /// Creates the folder and the recording that a head describes.
    pub(super) fn open(
        head: &RecordingHeadFile,
        scenario: Arc<Scenario>,
        workpiece: Arc<Workpiece>,
        spec: DeviceSpec,
        out: Option<&Path>,
        templates: Templates,
    ) -> Result<PreparedSession, LessonError> {
        let name = bundle_name(head);
        let partial_bundle = match out {
            Some(out) => PartialBundle::create(out, &name)?,
            None => PartialBundle::in_memory(&name),
        };
        let recorder = partial_bundle.start_recording(head, &scenario, &workpiece);
        let opened = recorder.map_err(LessonError::RecordingNotStarted).and_then(|recorder| {
            let start = |path: PathBuf| DiskSync::start(&path).map_err(|why| LessonError::NoDiskSync { path, why });
            Ok((recorder, partial_bundle.recording_path().map(start).transpose()?))
        });
        match opened {
            Ok((recorder, disk_sync)) => Ok(PreparedSession {
                scenario,
                workpiece,
                recorder,
                disk_sync,
                partial_bundle,
                templates,
                spec,
                seed: head.seed,
                #[cfg(feature = "devices")]
                resumption: None,
            }),
            Err(error) => {
                partial_bundle.abandon();
                Err(error)
            }
        }
    }
}

/// Name `exercise_time_digest`: it sorts by exercise and time, differs for two sessions of the same second, and
/// contains no participant code.
fn bundle_name(head: &RecordingHeadFile) -> String {
    // The name of a folder must not help to find a sealed seed.
    let seed = if head.seed_origin == Some(SeedOriginFile::Sealed) { 0 } else { head.seed };
    // A browser has no processes.
    let process = if cfg!(target_family = "wasm") { 0 } else { std::process::id() };
    let RecordingHeadFile { participant, started, resumed, .. } = head;
    let parts = resumed
        .iter()
        .fold(format!("{participant}/{seed}/{process}/{started}"), |parts, one| format!("{parts}/{}", one.tick));
    let digest = Sha256::digest(parts);
    let moment = started.replace(['-', ':'], "");
    format!("{}_{moment}_{}", head.scenario_id, hex(&digest[..4]))
}

impl PreparedSession {
    /// Name of the bundle that the session will have.
    pub fn name(&self) -> String {
        self.partial_bundle.name()
    }

    /// The growing recording of a session in memory; `None` for one that is recorded in a folder.
    pub fn growth(&self) -> Option<RecordingGrowth> {
        self.partial_bundle.growth()
    }

    /// Begins a session with a device that a person operates, in real time, or goes on with one that was interrupted, without
    /// a second hand. Returns the first events.
    ///
    /// # Errors
    ///
    /// When the servo cannot be started or the recording cannot be written.
    #[cfg(feature = "devices")]
    pub fn begin(
        self,
        device: Box<dyn Device + Send>,
        second: Option<PendingSecondHand>,
    ) -> Result<(Lesson, Vec<LiveEvent>), LessonError> {
        let simulation = self.simulation();
        match self.resumption {
            Some(_) => Lesson::go_on(self, device),
            None => Lesson::begin(self, simulation, device, second),
        }
    }

    /// Performs the whole session with a scripted operator, as fast as the machine can.
    ///
    /// # Errors
    ///
    /// When the recording cannot be written.
    pub fn run_script(self, operator: OperatorFile) -> Result<RecordedSession, LessonError> {
        let mut simulation = self.simulation();
        let PreparedSession {
            scenario, workpiece, mut recorder, disk_sync, partial_bundle, templates, spec, seed, ..
        } = self;
        let mut session = Session::new(scenario.clone(), &workpiece);
        let mut trainee = Operator::new(operator, scenario, workpiece, spec, seed);
        let progress = typodont_exercise::session::run(&mut session, &mut simulation, &mut trainee, &mut recorder);
        let reason = match progress.map_err(|e| LessonError::stopped(&partial_bundle, &e))? {
            RunEnd::Complete if session.outcome().aborted => "aborted".to_string(),
            RunEnd::Complete => "complete".to_string(),
            RunEnd::DeviceGone(gone) => gone.to_string(),
        };
        let end = RecordingEndFile { reason, servo: ServoStatsFile::of(&simulation) };
        RecordedSession::close(recorder, disk_sync, &end, partial_bundle, templates)
    }

    fn simulation(&self) -> Simulation {
        Simulation::new(typodont_exercise::session::setup(&self.scenario, &self.workpiece, self.spec.clone()))
    }
}

/// A recorded session that is not scored yet.
pub struct RecordedSession {
    partial_bundle: PartialBundle,
    templates: Templates,
}

impl RecordedSession {
    pub(super) fn close(
        recorder: Recorder,
        disk_sync: Option<DiskSync>,
        end: &RecordingEndFile,
        partial_bundle: PartialBundle,
        templates: Templates,
    ) -> Result<RecordedSession, LessonError> {
        recorder.finish(end).map_err(|e| LessonError::stopped(&partial_bundle, &e))?;
        let synced = disk_sync.map_or(Ok(()), DiskSync::finish);
        synced.map_err(|e| LessonError::stopped(&partial_bundle, &e))?;
        Ok(RecordedSession { partial_bundle, templates })
    }

    /// Scores the recording and makes all files of the bundle. The result is known long before the
    /// files are made: the observer is told of every step.
    ///
    /// # Errors
    ///
    /// [`LessonError::Bundle`] if the recording cannot be scored or a file cannot be written.
    pub fn complete(self, observer: CompletionObserver) -> Result<BundleFolder, LessonError> {
        Ok(self.partial_bundle.complete(&self.templates, observer)?)
    }
}
