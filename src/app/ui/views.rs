//! Pictures as the window last drew them. Screens read their state, and change nothing but these.

use crate::ui::case_pictures::CasePictures;
use crate::ui::lesson_view::LessonView;
use crate::ui::preview_view::PreviewView;
use crate::ui::viewport::Viewport;
use eframe::egui_wgpu::RenderState;

/// The viewport, which draws for one screen at a time, and each screen's last pictures.
#[derive(Default)]
pub struct Views {
    /// Created for the first screen that shows a tooth, and kept for the next; `None` without a graphics adapter.
    pub viewport: Option<Viewport>,
    pub lesson: LessonView,
    pub preview: PreviewView,
    pub case_pictures: CasePictures,
}

impl Views {
    /// Creates the viewport, unless there is one, on the adapter that draws the window.
    pub fn prepare(&mut self, state: Option<&RenderState>) {
        if let (None, Some(state)) = (&self.viewport, state) {
            self.viewport = Some(Viewport::new(state));
        }
    }

    /// Forgets everything drawn of a tooth, because another one is shown next.
    pub fn forget(&mut self) {
        self.lesson = LessonView::default();
        self.preview = PreviewView::default();
    }
}
