//! The author's view of the tooth: camera, display mode and slice position.

use crate::editor::build_worker::BuildResult;
use std::sync::Arc;
use typodont_core::frame::Vec3;
use typodont_core::volume::Label;
use typodont_exercise::catalog::TissueRole;
use typodont_render::{LabelPalette, Orbit, RenderMode, TransferFunction};
use typodont_scene as scene;

/// The way in which the tooth is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PreviewMode {
    #[default]
    Surface,
    /// Tissues drawn transparently, in their colours.
    Glass,
    /// Decay alone.
    Decay,
}

impl PreviewMode {
    pub const ALL: [(PreviewMode, &str); 3] = [
        (PreviewMode::Surface, "author.surface"),
        (PreviewMode::Glass, "menu.clear"),
        (PreviewMode::Decay, "menu.decay"),
    ];
}

pub struct PreviewState {
    pub orbit: Orbit,
    pub mode: PreviewMode,
    pub shows_surroundings: bool,
    /// Intersection of the three slices, tooth space, mm.
    pub slice_point: Vec3,
    /// Number of builds taken over so far.
    pub generation: u64,
    pub palette: LabelPalette,
    glass: Arc<TransferFunction>,
    decay: Arc<TransferFunction>,
    /// FDI numbers of the teeth; if they change, the camera returns to the usual view.
    teeth: Vec<u8>,
}

impl Default for PreviewState {
    fn default() -> PreviewState {
        let palette = LabelPalette::from_colours(|_| [0.85, 0.82, 0.75], 0.15);
        PreviewState {
            orbit: Orbit::around(Vec3::ZERO, 9.0),
            mode: PreviewMode::Surface,
            shows_surroundings: false,
            slice_point: Vec3::ZERO,
            generation: 0,
            glass: Arc::new(TransferFunction::tissue(&palette)),
            decay: Arc::new(TransferFunction::highlighting(&[], &palette)),
            palette,
            teeth: Vec::new(),
        }
    }
}

impl PreviewState {
    /// Shows a new build; the camera returns to the usual view if the teeth are others.
    pub fn update(&mut self, build: &BuildResult) {
        let tissues = &build.scenario.tissues;
        self.palette = scene::tissue_palette(tissues, true);
        let decay: Vec<Label> =
            tissues.entries().iter().filter(|e| e.role == TissueRole::Decay).map(|e| e.label()).collect();
        self.glass = Arc::new(TransferFunction::tissue(&self.palette));
        self.decay = Arc::new(TransferFunction::highlighting(&decay, &self.palette));
        let teeth: Vec<u8> = build.workpiece.teeth.iter().map(|tooth| tooth.fdi).collect();
        if teeth != self.teeth {
            self.orbit = scene::work_view(&build.workpiece).zoomed(0.8);
            let middle = build.workpiece.teeth.first().map(|tooth| tooth.crown.centre());
            let lesion = build.workpiece.lesions_in_volume().first();
            self.slice_point = lesion.map(|lesion| lesion.centre).or(middle).unwrap_or_default();
            self.teeth = teeth;
        }
        self.generation += 1;
    }

    pub fn render_mode(&self) -> RenderMode {
        match self.mode {
            PreviewMode::Surface => RenderMode::Surface,
            PreviewMode::Glass => RenderMode::Volume(self.glass.clone()),
            PreviewMode::Decay => RenderMode::Volume(self.decay.clone()),
        }
    }
}
