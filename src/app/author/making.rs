//! The thread that checks a draft and makes its tooth, so that nobody who types waits for a tooth.
//!
//! The newest text wins: what is asked while something is made takes its place as soon as that is done.

use crate::content::Library;
use crate::diagnostic::{Diagnostic, Source};
use crate::scenario::{self, Form, Forms, Scenario, Workpiece};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Voxels of the first, quick look, mm: an eighth of the work.
const QUICK: f32 = 0.2;

/// A text to be checked and made.
pub struct Job {
    pub number: u64,
    pub source: Arc<Source>,
    pub library: Library,
    pub seed: u64,
    /// The tooth is to be made; else the text is only checked.
    pub makes: bool,
}

/// What came of a job, as far as it is.
pub struct News {
    pub number: u64,
    /// All there are, as far as is known.
    pub complaints: Option<Vec<Diagnostic>>,
    pub made: Option<Made>,
    /// Nothing more comes of it.
    pub is_over: bool,
}

/// An exercise with its matter.
pub struct Made {
    pub scenario: Arc<Scenario>,
    pub workpiece: Workpiece,
    /// Made with coarse voxels, to be seen soon.
    pub is_quick: bool,
}

pub struct Making {
    jobs: Sender<Job>,
    news: Receiver<News>,
}

impl Making {
    /// `wake` is called when there is something to look at.
    pub fn begin(wake: Box<dyn Fn() + Send>) -> Making {
        let (jobs, inbox) = channel::<Job>();
        let (post, news) = channel();
        // Without a thread nothing is made and nothing checked, and the file can still be edited.
        let _ = std::thread::Builder::new().name("making".into()).spawn(move || {
            let mut next = inbox.recv().ok();
            while let Some(job) = next.take() {
                // Only the newest counts.
                let job = inbox.try_iter().last().unwrap_or(job);
                let mut waiting = None;
                let mut tell = |news: News| {
                    let is_heard = post.send(news).is_ok();
                    wake();
                    waiting = inbox.try_iter().last();
                    is_heard && waiting.is_none()
                };
                make(&job, &mut tell);
                next = waiting.or_else(|| inbox.recv().ok());
            }
        });
        Making { jobs, news }
    }

    pub fn ask(&self, job: Job) {
        let _ = self.jobs.send(job);
    }

    pub fn next_news(&self) -> Option<News> {
        self.news.try_recv().ok()
    }
}

/// Checks and makes, soon and then well; stops when what it tells is not wanted any more.
fn make(job: &Job, tell: &mut impl FnMut(News) -> bool) {
    let number = job.number;
    let news = |complaints, made, is_over| News { number, complaints, made, is_over };
    let scenario = match scenario::resolve(job.source.clone(), &job.library, Forms::Read) {
        Ok(scenario) => Arc::new(scenario),
        Err(found) => {
            tell(news(Some(found), None, true));
            return;
        }
    };
    if !tell(news(Some(Vec::new()), None, false)) {
        return;
    }
    let made = |workpiece, is_quick| Some(Made { scenario: scenario.clone(), workpiece, is_quick });
    let quick = quick(&scenario).filter(|_| job.makes);
    if let Some(Ok(workpiece)) = quick.map(|quick| Workpiece::make(&quick, job.seed))
        && !tell(news(None, made(workpiece, true), false))
    {
        return;
    }
    if job.makes
        && let Ok(workpiece) = Workpiece::make(&scenario, job.seed)
        && !tell(news(None, made(workpiece, false), false))
    {
        return;
    }
    let found = scenario::resolve(job.source.clone(), &job.library, Forms::Made).err().unwrap_or_default();
    tell(news(Some(found), None, true));
}

/// The same with coarse voxels, where the program grows the teeth itself and no map is drawn on their voxels.
fn quick(scenario: &Scenario) -> Option<Scenario> {
    let is_grown = |form: &Form| matches!(form, Form::Procedural { spacing, .. } if *spacing < QUICK);
    let has_maps = scenario.zones.iter().any(|zone| zone.region.map_dims().is_some());
    if has_maps || !scenario.scene.teeth.iter().all(|tooth| is_grown(&tooth.form)) {
        return None;
    }
    let mut quick = scenario.clone();
    let age = quick.scene.arch.age;
    quick.scene.teeth.iter_mut().for_each(|tooth| tooth.form = Form::Procedural { spacing: QUICK, age });
    Some(quick)
}
