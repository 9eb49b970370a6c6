//! Results of a lesson: the grade, its reasons, and maps of tissue wrongly removed or left.
//!
//! The grade and its reasons are shown as soon as the session is scored; maps and report follow when they are made.

use crate::completion::Completion;
use crate::platform;
use eframe::egui;
use typodont_exercise::score::Verdict;
use typodont_lesson::Attempt;
use typodont_report::FirstResult;
use typodont_report::bundle::BundleFolder;

/// The result of a session, and its bundle as far as it is made.
pub struct LessonResults {
    pub first: FirstResult,
    pub state: BundleState,
    /// The maps listed in `MAPS`, as far as the bundle contains them.
    pub maps: Vec<egui::TextureHandle>,
    /// True if the exercise can be tried again from here.
    pub has_retry: bool,
    /// True if the report may be opened in the browser.
    pub has_report: bool,
    /// True once the user has saved the bundle, in a page.
    pub is_downloaded: bool,
}

/// State of the bundle of a result.
pub enum BundleState {
    Pending(Completion),
    Finished(BundleFolder),
    /// The reason why there is none.
    Failed(String),
}

/// Names of the maps shown in the window; the report page shows all.
const MAPS: [&str; 2] = ["map-occlusal", "after-occlusal"];

impl LessonResults {
    /// True if the exercise was passed or performed.
    pub fn is_done(&self) -> bool {
        Attempt::of(&self.first.session).is_some_and(|attempt| attempt.is_passed())
    }

    /// True if work can be right or wrong in the exercise: it is graded, or has tissue to be removed or a cavity to be filled.
    pub fn is_judged(&self) -> bool {
        let is_of_target = |verdict| {
            matches!(verdict, Verdict::RightlyRemoved | Verdict::Left) || Verdict::OF_FILLINGS.contains(&verdict)
        };
        let has_target = self.first.legend.iter().any(|entry| is_of_target(entry.verdict));
        self.first.session.grade.is_some() || has_target
    }

    /// True if most want to try again next.
    pub fn invites_retry(&self) -> bool {
        self.has_retry && !self.is_done()
    }

    /// The result of a session whose bundle is still being made.
    pub fn new(first: FirstResult, completion: Completion, has_retry: bool, has_report: bool) -> LessonResults {
        LessonResults {
            first,
            state: BundleState::Pending(completion),
            maps: Vec::new(),
            has_retry,
            has_report,
            is_downloaded: false,
        }
    }

    /// Takes over the steps of the completion, and loads the maps at its end.
    pub fn poll(&mut self, ctx: &egui::Context) {
        let BundleState::Pending(completion) = &mut self.state else { return };
        completion.poll();
        match completion.state().outcome.clone() {
            Some(Ok(bundle)) => {
                // The first colours what was right and wrong.
                let names = if self.is_judged() { &MAPS[..] } else { &MAPS[1..] };
                self.maps = names.iter().filter_map(|name| load_map(&bundle, name, ctx)).collect();
                self.state = BundleState::Finished(bundle);
            }
            Some(Err(why)) => self.state = BundleState::Failed(why),
            None => {}
        }
    }

    pub fn is_pending(&self) -> bool {
        matches!(self.state, BundleState::Pending(_))
    }

    /// URL of the report page; `None` before the page exists, and if its path cannot be written as a URL.
    pub fn report_url(&self) -> Option<String> {
        let BundleState::Finished(bundle) = &self.state else { return None };
        platform::report_url(bundle)
    }
}

fn load_map(bundle: &BundleFolder, name: &str, ctx: &egui::Context) -> Option<egui::TextureHandle> {
    let bytes = bundle.read(&format!("views/{name}.png")).ok()?;
    let image = image::load_from_memory(&bytes).ok()?.to_rgba8();
    let size = [image.width() as usize, image.height() as usize];
    let pixels = egui::ColorImage::from_rgba_unmultiplied(size, image.as_raw());
    Some(ctx.load_texture(name, pixels, egui::TextureOptions::LINEAR))
}
