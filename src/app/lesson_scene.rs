//! The scene of a lesson as it is drawn: tooth, mouth, instruments, particles and display modes.

use crate::transfer_function_draft::{DensityHistogram, TransferFunctionDraft};
use std::cell::OnceCell;
use std::sync::Arc;
use typodont_core::volume::{Edit, Label, Volume};
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::{Scenario, Stage, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;
use typodont_render::{EnamelDepth, LabelPalette, MeshInstance, RenderMode, TransferFunction};
use typodont_scene::particles;
use typodont_scene::particles::ParticleField;
use typodont_scene::{self as scene, ContraAngle, Mouth};

/// Maximum opening angle of the mouth, degrees: 50 mm between the incisors.
const MAX_MOUTH_OPENING: f32 = 35.0;

/// The drawn scene of a lesson.
pub struct LessonScene {
    pub workpiece: Arc<Workpiece>,
    /// The window's own copy of the volume, with all edits received so far.
    pub volume: Volume,
    pub palette: LabelPalette,
    /// The jaws around the tooth, if the exercise has a mouth.
    pub mouth: Option<Mouth>,
    /// Opening angle of the mouth, degrees.
    pub mouth_opening: f32,
    /// Solids around the tooth.
    pub surroundings: Vec<MeshInstance>,
    pub instruments: Vec<MeshInstance>,
    /// The instruments as a pointer holds them; `None` for those that no handpiece turns.
    pub contra_angles: Vec<Option<ContraAngle>>,
    /// Dust and water, if the exercise has any.
    pub particles: Option<ParticleField>,
    /// Model of the saliva ejector, which removes dust and water.
    pub ejector: Option<MeshInstance>,
    /// Number of edits of the volume so far.
    pub edit_count: u64,
    /// Number of changes of the tissues' colours, the jaws and the transfer function so far.
    pub appearance_count: u64,
    /// Bricks of the volume that were edited and are not drawn yet, in ascending order.
    pub undrawn: Vec<usize>,
    histogram: OnceCell<DensityHistogram>,
    enamel_depth: OnceCell<EnamelDepth>,
    pub transfer_function: TransferFunctionDraft,
    presets: TransferFunctionPresets,
}

impl LessonScene {
    /// Builds the scene of a lesson. Returns with it complaints about parts that cannot be drawn as the exercise
    /// requires.
    pub fn build(
        scenario: &Scenario,
        library: &Library,
        workpiece: Arc<Workpiece>,
        is_decay_shown: bool,
    ) -> (LessonScene, Vec<String>) {
        let tissues = &scenario.tissues;
        let mut volume = Volume::clone(&workpiece.volume);
        volume.take_dirty();
        let palette = scene::tissue_palette(tissues, is_decay_shown);
        let is_in_jaw = scenario.scene.is_in_mouth();
        let mouth = Mouth::around(&workpiece, tissues).filter(|_| is_in_jaw);
        let drawn = scenario.instruments.iter().map(|entry| scene::instrument_solid(entry, library));
        let (instruments, complaints): (Vec<MeshInstance>, Vec<_>) = drawn.unzip();
        let options = scenario.operating_field;
        let (ejector, suction_inlet) = match options.suction {
            true => Some(particles::saliva_ejector(&workpiece)).unzip(),
            false => (None, None),
        };
        let built = LessonScene {
            histogram: OnceCell::new(),
            enamel_depth: OnceCell::new(),
            transfer_function: TransferFunctionDraft::new(TransferFunction::tissue(&palette)),
            presets: TransferFunctionPresets::new(tissues, &palette, is_decay_shown),
            volume,
            palette,
            surroundings: match &mouth {
                Some(mouth) => mouth.solids(scene::WORKING_OPENING_DEG),
                None => scene::surrounding_solids(&workpiece, tissues),
            },
            mouth,
            mouth_opening: scene::WORKING_OPENING_DEG,
            particles: options.is_any().then(|| ParticleField::new(options, &scenario.instruments, suction_inlet)),
            ejector,
            instruments,
            contra_angles: scenario.instruments.iter().map(scene::contra_angle).collect(),
            workpiece,
            edit_count: 0,
            appearance_count: 0,
            undrawn: Vec::new(),
        };
        (built, complaints.iter().flatten().map(Diagnostic::headline).collect())
    }

    /// Thickness of the enamel before the session, where dentine shines through it; measured at the first call. `tissues`: those
    /// of the exercise.
    pub fn enamel_depth(&self, tissues: &TissueTable) -> Option<&EnamelDepth> {
        let is_seen = self.palette.under_translucent.is_some();
        is_seen.then(|| self.enamel_depth.get_or_init(|| scene::enamel_depth(&self.workpiece.volume, tissues)))
    }

    /// Applies an edit of the session to the window's own copy of the volume.
    pub fn apply_edit(&mut self, edit: &Edit) {
        if let Some(particles) = &mut self.particles {
            particles.record_removal(edit, self.volume.grid());
        }
        self.volume.apply_edit(edit);
        self.edit_count += 1;
    }

    /// Notes the bricks that were edited since the last call as not drawn yet.
    pub fn collect_undrawn(&mut self) {
        let edited = self.volume.take_dirty();
        if !edited.is_empty() {
            self.undrawn.extend(edited);
            self.undrawn.sort_unstable();
            self.undrawn.dedup();
        }
    }

    /// Sets the colours of the tissues anew, with or without visible decay.
    pub fn colour(&mut self, tissues: &TissueTable, is_decay_shown: bool) {
        self.palette = scene::tissue_palette(tissues, is_decay_shown);
        self.presets = TransferFunctionPresets::new(tissues, &self.palette, is_decay_shown);
        self.appearance_count += 1;
    }

    /// Replaces the transfer function drawn by the user.
    pub fn set_transfer_function(&mut self, curves: TransferFunctionDraft) {
        self.transfer_function = curves;
        self.appearance_count += 1;
    }

    /// Opens the mouth further by this angle, degrees, if there is a mouth.
    pub fn open_mouth(&mut self, by: f32) {
        let Some(mouth) = &self.mouth else { return };
        self.mouth_opening = (self.mouth_opening + by).clamp(0.0, MAX_MOUTH_OPENING);
        self.surroundings = mouth.solids(self.mouth_opening);
        self.appearance_count += 1;
    }

    /// Density histogram of the volume at the first call. It is computed on demand: few users need it, and counting the
    /// voxels of a fine tooth takes a while.
    pub fn histogram(&self) -> &DensityHistogram {
        self.histogram.get_or_init(|| DensityHistogram::new(&self.volume))
    }

    pub fn render_mode(&self, mode: DisplayMode) -> RenderMode {
        match mode {
            DisplayMode::Surface => RenderMode::Surface,
            DisplayMode::Iso => RenderMode::Iso,
            DisplayMode::Tissue => RenderMode::Volume(self.presets.tissue.clone()),
            DisplayMode::Xray => RenderMode::Volume(self.presets.x_ray.clone()),
            DisplayMode::Decay => RenderMode::Volume(self.presets.decay.clone()),
            DisplayMode::Drawn => RenderMode::Volume(self.transfer_function.function.clone()),
        }
    }
}

/// The preset transfer functions; rebuilt with the palette, not with each frame.
struct TransferFunctionPresets {
    tissue: Arc<TransferFunction>,
    x_ray: Arc<TransferFunction>,
    decay: Arc<TransferFunction>,
}

impl TransferFunctionPresets {
    fn new(tissues: &TissueTable, palette: &LabelPalette, is_decay_shown: bool) -> TransferFunctionPresets {
        let decay: Vec<Label> =
            tissues.entries().iter().filter(|e| e.role == TissueRole::Decay).map(|e| e.label()).collect();
        TransferFunctionPresets {
            tissue: Arc::new(TransferFunction::tissue(palette)),
            x_ray: Arc::new(TransferFunction::radiograph(|label| {
                scene::x_ray_attenuation(tissues, label, is_decay_shown)
            })),
            decay: Arc::new(TransferFunction::highlighting(&decay, palette)),
        }
    }
}

/// Display mode of the tooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplayMode {
    Surface,
    Iso,
    Tissue,
    Xray,
    /// Decay alone, the rest transparent; available if the exercise shows decay.
    Decay,
    /// The transfer function drawn by the user.
    Drawn,
}

impl DisplayMode {
    const ALL: [(DisplayMode, &str); 6] = [
        (DisplayMode::Surface, "menu.surface"),
        (DisplayMode::Iso, "menu.iso"),
        (DisplayMode::Tissue, "menu.clear"),
        (DisplayMode::Xray, "menu.xray"),
        (DisplayMode::Decay, "menu.decay"),
        (DisplayMode::Drawn, "menu.drawn"),
    ];

    /// Modes that a stage allows, with their text keys. Modes that look into the tooth need a stage that shows decay,
    /// so that hidden decay cannot be found with them.
    pub fn available(stage: Option<&Stage>) -> impl Iterator<Item = (DisplayMode, &'static str)> {
        let is_decay_shown = stage.is_some_and(|stage| stage.show_decay);
        DisplayMode::ALL.into_iter().filter(move |(way, _)| is_decay_shown || !way.shows_interior())
    }

    /// True if tissues beneath the surface are visible.
    pub fn shows_interior(self) -> bool {
        !matches!(self, DisplayMode::Surface | DisplayMode::Iso)
    }
}
