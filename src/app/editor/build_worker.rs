//! Checks a draft and builds its tooth, on a thread of its own, so that typing never waits for a build; in a page, within frames,
//! where what takes seconds waits until the text has rested.
//!
//! The newest text wins: of the jobs submitted during a build, only the last one is run when that build ends.

use crate::platform;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, SceneLayout, ToothSource, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::{Diagnostic, SourceText};
use typodont_render::{MeshInstance, UnworkedTooth};
use typodont_scene::Mouth;

/// Voxel spacing of the quick first build, mm; it takes an eighth of the work.
const QUICK_SPACING: f32 = 0.2;

/// The same for all teeth of an arch.
const QUICK_ARCH_SPACING: f32 = 0.4;

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
    pub unworked_tooth: UnworkedTooth,
    /// The mouth as the trainee sees it; `None` for a tooth on a stand.
    pub mouth: Option<Mouth>,
    /// Solids around the teeth worked on; those of the mouth, if there is one.
    pub surroundings: Vec<MeshInstance>,
    /// True if it was built with coarse voxels as a first view, which the full one follows. A page has coarse voxels only.
    pub is_quick: bool,
}

/// Time without a newer text after which a page builds the coarse tooth, and after which it takes the steps that last seconds, s.
const SHORT_REST: f64 = 0.4;
const REST: f64 = 3.0;

/// Builds on a thread of its own or, in a page, which has no threads, within frames.
pub enum BuildWorker {
    Thread { jobs: Sender<BuildJob>, events: Receiver<BuildEvent> },
    Frames(BuildInFrames),
}

/// Builds within frames, at most one step in each.
#[derive(Default)]
pub struct BuildInFrames {
    build: Option<Build>,
    /// Time of the first frame with the job, s; `None` before that frame.
    since: Option<f64>,
    /// Time of the last frame with a step, s.
    stepped: f64,
}

impl BuildWorker {
    /// Starts the thread; a page has none. `wake` is called after each event, so that the window can poll it.
    pub fn start(wake: Box<dyn Fn() + Send>) -> BuildWorker {
        if platform::IS_PAGE {
            return BuildWorker::Frames(BuildInFrames::default());
        }
        let (jobs, inbox) = channel::<BuildJob>();
        let (event_sender, events) = channel();
        // If the thread cannot be started, nothing is built or checked, but the file can still be edited.
        let _ = std::thread::Builder::new().name("making".into()).spawn(move || {
            let mut next = inbox.recv().ok();
            while let Some(job) = next.take() {
                // Only the newest job is run.
                let mut build = Build::new(inbox.try_iter().last().unwrap_or(job));
                while next.is_none() && !build.is_over() {
                    let Some(event) = build.take_step() else { continue };
                    if event_sender.send(event).is_err() {
                        return;
                    }
                    wake();
                    next = inbox.try_iter().last();
                }
                next = next.or_else(|| inbox.recv().ok());
            }
        });
        BuildWorker::Thread { jobs, events }
    }

    pub fn submit(&mut self, job: BuildJob) {
        match self {
            BuildWorker::Thread { jobs, .. } => _ = jobs.send(job),
            BuildWorker::Frames(frames) => {
                *frames = BuildInFrames { build: Some(Build::new(job)), ..BuildInFrames::default() }
            }
        }
    }

    /// The next event. In a page, this takes the next step. `now`: time since the window opened, s.
    pub fn next_event(&mut self, now: f64) -> Option<BuildEvent> {
        match self {
            BuildWorker::Thread { events, .. } => events.try_recv().ok(),
            BuildWorker::Frames(frames) => frames.next_event(now),
        }
    }

    /// True if the build goes on only with further frames.
    pub fn needs_frames(&self) -> bool {
        matches!(self, BuildWorker::Frames(BuildInFrames { build: Some(_), .. }))
    }
}

impl BuildInFrames {
    /// Takes the next step, unless a frame has to be drawn before, or the author may be about to change the text again.
    fn next_event(&mut self, now: f64) -> Option<BuildEvent> {
        let build = self.build.as_mut()?;
        let Some(since) = self.since else {
            self.since = Some(now);
            return None;
        };
        if now == since || now == self.stepped || now - since < build.rest_before_next() {
            return None;
        }
        self.stepped = now;
        let event = build.take_step();
        if build.is_over() {
            self.build = None;
        }
        event
    }
}

/// A job that is being run, step by step.
struct Build {
    job: BuildJob,
    /// `None` before it is read.
    scenario: Option<Arc<Scenario>>,
    next: BuildStep,
}

#[derive(Clone, Copy)]
enum BuildStep {
    Read,
    /// The tooth with coarse voxels.
    Quick,
    Full,
    /// Everything that only the whole workpiece can show.
    Check,
    Over,
}

impl Build {
    fn new(job: BuildJob) -> Build {
        Build { job, scenario: None, next: BuildStep::Read }
    }

    /// Time for which a page waits for a newer text before it takes the next step, s.
    fn rest_before_next(&self) -> f64 {
        match self.next {
            BuildStep::Read | BuildStep::Over => 0.0,
            BuildStep::Quick => SHORT_REST,
            BuildStep::Full | BuildStep::Check => REST,
        }
    }

    fn is_over(&self) -> bool {
        matches!(self.next, BuildStep::Over)
    }

    /// Takes the next step; `None` if it brings nothing new.
    fn take_step(&mut self) -> Option<BuildEvent> {
        let number = self.job.number;
        let complained =
            |complaints, is_last| BuildEvent { number, complaints: Some(complaints), result: None, is_last };
        let built = |result| BuildEvent { number, complaints: None, result: Some(result), is_last: false };
        match self.next {
            BuildStep::Read => {
                match scenario::resolve(self.job.source.clone(), &self.job.library, ResolveMode::ReadScans) {
                    Ok(scenario) => {
                        self.scenario = Some(Arc::new(scenario));
                        self.next = if self.job.builds_tooth { BuildStep::Quick } else { BuildStep::Check };
                        Some(complained(Vec::new(), false))
                    }
                    Err(found) => {
                        self.next = BuildStep::Over;
                        Some(complained(found, true))
                    }
                }
            }
            BuildStep::Quick => {
                let quick = self.scenario.as_ref().and_then(|scenario| quick_variant(scenario));
                let result = quick.and_then(|quick| self.build(&quick, !platform::IS_PAGE));
                // A page shows the coarse tooth: the whole one would take seconds of it after every change.
                self.next = if platform::IS_PAGE && result.is_some() { BuildStep::Check } else { BuildStep::Full };
                result.map(built)
            }
            BuildStep::Full => {
                self.next = BuildStep::Check;
                self.scenario.as_ref().and_then(|scenario| self.build(scenario, false)).map(built)
            }
            BuildStep::Check => {
                self.next = BuildStep::Over;
                let source = self.job.source.clone();
                let found = scenario::resolve(source, &self.job.library, ResolveMode::MakeWorkpiece);
                Some(complained(found.err().unwrap_or_default(), true))
            }
            BuildStep::Over => None,
        }
    }

    /// Builds the workpiece of a variant of the scenario.
    fn build(&self, variant: &Scenario, is_quick: bool) -> Option<BuildResult> {
        let workpiece = Workpiece::make(variant, self.job.seed).ok()?;
        let tissues = &variant.tissues;
        let unworked_tooth = typodont_scene::unworked_tooth(&workpiece, tissues);
        let is_in_mouth = variant.scene.is_in_mouth();
        let (mouth, surroundings) = typodont_scene::mouth_and_solids(&workpiece, tissues, is_in_mouth);
        let scenario = self.scenario.clone()?;
        Some(BuildResult { scenario, workpiece, unworked_tooth, mouth, surroundings, is_quick })
    }
}

/// The same scenario with coarse voxels; `None` where the teeth are scanned or a map is drawn on their voxels.
fn quick_variant(scenario: &Scenario) -> Option<Scenario> {
    let is_arch = scenario.scene.is_arch();
    let quick_spacing = if is_arch { QUICK_ARCH_SPACING } else { QUICK_SPACING };
    let is_grown =
        |form: &ToothSource| matches!(form, ToothSource::Procedural { spacing, .. } if *spacing < quick_spacing);
    let has_maps = scenario.zones.iter().any(|zone| zone.region.map_dims().is_some());
    let treated = scenario.scene.teeth_in_volume().len();
    if has_maps || !scenario.scene.teeth[..treated].iter().all(|tooth| is_grown(&tooth.source)) {
        return None;
    }
    let mut quick = scenario.clone();
    let age = quick.scene.arch.age;
    quick
        .scene
        .teeth
        .iter_mut()
        .for_each(|tooth| tooth.source = ToothSource::Procedural { spacing: quick_spacing, age });
    match &mut quick.scene.layout {
        SceneLayout::Arch { spacing } => *spacing = quick_spacing,
        SceneLayout::Mouth { spacing } => *spacing = spacing.max(QUICK_ARCH_SPACING),
        _ => {}
    }
    Some(quick)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(number: u64, text: &str) -> BuildJob {
        let source = SourceText::new("draft.json", text);
        BuildJob { number, source, library: Library::shipped(), seed: 0, builds_tooth: true }
    }

    #[test]
    fn a_build_within_frames_shows_what_is_done_and_waits_until_nobody_types() {
        let text =
            include_str!("../../../scenarios/5-grinding.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
        let mut frames = BuildInFrames { build: Some(Build::new(job(1, &text))), ..BuildInFrames::default() };
        assert!(frames.next_event(10.0).is_none(), "no frame was drawn before the first step");
        let read = frames.next_event(10.1).unwrap();
        assert_eq!((read.complaints.unwrap().len(), read.is_last), (0, false));
        assert!(frames.next_event(10.1).is_none() && frames.next_event(10.2).is_none());
        let mut built = None;
        let mut last = None;
        for at in 0..100 {
            let now = 10.3 + 0.1 * f64::from(at);
            if let Some(event) = frames.next_event(now) {
                assert!(now > 10.0 + REST - 0.05, "a step of seconds after {now} s");
                last = event.is_last.then_some(now).or(last);
                built = event.result.or(built);
            }
        }
        let built = built.unwrap();
        assert!(built.workpiece.teeth[0].crown.high.z > 1.0);
        assert!(last.is_some() && frames.build.is_none());
        // A newer text takes the place of the one before.
        let mut worker = BuildWorker::Frames(BuildInFrames::default());
        worker.submit(job(2, &text));
        worker.submit(job(3, "{"));
        assert!(worker.needs_frames() && worker.next_event(30.0).is_none());
        let refused = worker.next_event(30.1).unwrap();
        assert_eq!((refused.number, refused.is_last), (3, true));
        assert!(!worker.needs_frames());
    }
}
