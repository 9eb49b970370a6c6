//! Worker thread that checks a draft and builds its tooth, so that typing never waits for a build.
//!
//! The newest text wins: of the jobs submitted during a build, only the last one is run when that build ends.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, ToothSource, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::{Diagnostic, SourceText};

/// Voxel spacing of the quick first build, mm; it takes an eighth of the work.
const QUICK_SPACING: f32 = 0.2;

/// A text to be checked and made.
pub struct BuildJob {
    pub number: u64,
    pub source: Arc<SourceText>,
    pub library: Library,
    pub seed: u64,
    /// True if the tooth is to be built; otherwise the text is only checked.
    pub builds_tooth: bool,
}

/// Partial or final result of a job.
pub struct BuildEvent {
    pub number: u64,
    /// All complaints found so far; `None` if this event brings no new list.
    pub complaints: Option<Vec<Diagnostic>>,
    pub result: Option<BuildResult>,
    /// True for the last event of the job.
    pub is_last: bool,
}

/// An exercise with its built workpiece.
pub struct BuildResult {
    pub scenario: Arc<Scenario>,
    pub workpiece: Workpiece,
    /// True if it was built with coarse voxels, as a quick first view.
    pub is_quick: bool,
}

pub struct BuildWorker {
    jobs: Sender<BuildJob>,
    events: Receiver<BuildEvent>,
}

impl BuildWorker {
    /// Starts the thread. `wake` is called after each event, so that the window can poll it.
    pub fn start(wake: Box<dyn Fn() + Send>) -> BuildWorker {
        let (jobs, inbox) = channel::<BuildJob>();
        let (event_sender, events) = channel();
        // If the thread cannot be started, nothing is built or checked, but the file can still be edited.
        let _ = std::thread::Builder::new().name("making".into()).spawn(move || {
            let mut next = inbox.recv().ok();
            while let Some(job) = next.take() {
                // Only the newest job is run.
                let job = inbox.try_iter().last().unwrap_or(job);
                let mut waiting = None;
                let mut send = |news: BuildEvent| {
                    let is_heard = event_sender.send(news).is_ok();
                    wake();
                    waiting = inbox.try_iter().last();
                    is_heard && waiting.is_none()
                };
                build(&job, &mut send);
                next = waiting.or_else(|| inbox.recv().ok());
            }
        });
        BuildWorker { jobs, events }
    }

    pub fn submit(&self, job: BuildJob) {
        let _ = self.jobs.send(job);
    }

    pub fn next_event(&self) -> Option<BuildEvent> {
        self.events.try_recv().ok()
    }
}

/// Checks the text and builds the tooth, first coarsely, then in full. Stops as soon as `send` returns false.
fn build(job: &BuildJob, send: &mut impl FnMut(BuildEvent) -> bool) {
    let number = job.number;
    let event = |complaints, result, is_last| BuildEvent { number, complaints, result, is_last };
    let scenario = match scenario::resolve(job.source.clone(), &job.library, ResolveMode::ReadScans) {
        Ok(scenario) => Arc::new(scenario),
        Err(found) => {
            send(event(Some(found), None, true));
            return;
        }
    };
    if !send(event(Some(Vec::new()), None, false)) {
        return;
    }
    let result = |workpiece, is_quick| Some(BuildResult { scenario: scenario.clone(), workpiece, is_quick });
    let quick = quick_variant(&scenario).filter(|_| job.builds_tooth);
    if let Some(Ok(workpiece)) = quick.map(|quick| Workpiece::make(&quick, job.seed))
        && !send(event(None, result(workpiece, true), false))
    {
        return;
    }
    if job.builds_tooth
        && let Ok(workpiece) = Workpiece::make(&scenario, job.seed)
        && !send(event(None, result(workpiece, false), false))
    {
        return;
    }
    let found =
        scenario::resolve(job.source.clone(), &job.library, ResolveMode::MakeWorkpiece).err().unwrap_or_default();
    send(event(Some(found), None, true));
}

/// The same scenario with coarse voxels; `None` where the teeth are scanned or a map is drawn on their voxels.
fn quick_variant(scenario: &Scenario) -> Option<Scenario> {
    let is_grown =
        |form: &ToothSource| matches!(form, ToothSource::Procedural { spacing, .. } if *spacing < QUICK_SPACING);
    let has_maps = scenario.zones.iter().any(|zone| zone.region.map_dims().is_some());
    if has_maps || !scenario.scene.teeth.iter().all(|tooth| is_grown(&tooth.source)) {
        return None;
    }
    let mut quick = scenario.clone();
    let age = quick.scene.arch.age;
    quick
        .scene
        .teeth
        .iter_mut()
        .for_each(|tooth| tooth.source = ToothSource::Procedural { spacing: QUICK_SPACING, age });
    Some(quick)
}
