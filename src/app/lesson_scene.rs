//! The scene of a lesson as it is drawn: tooth, mouth, instruments, particles and display modes.

use crate::transfer_function_draft::{DensityHistogram, TransferFunctionDraft};
use std::cell::OnceCell;
use std::sync::Arc;
use typodont_core::volume::{Edit, Label, Volume};
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::{Scenario, Stage, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;
use typodont_render::{LabelPalette, MeshInstance, RenderMode, TransferFunction, UnworkedTooth};
use typodont_scene::particles;
use typodont_scene::particles::ParticleField;
use typodont_scene::{self as scene, ContraAngle, GreyVolume, Mouth};

/// Maximum opening angle of the mouth, degrees: 50 mm between the incisors.
const MAX_MOUTH_OPENING: f32 = 35.0;

/// The drawn scene of a lesson.
pub struct LessonScene {
    pub workpiece: Arc<Workpiece>,
    /// The window's own copy of the volume, with all edits received so far.
    pub volume: Volume,
    /// The same by grey values, if the workpiece is from a CT scan and decay is shown: otherwise nothing looks into the tooth.
    grey_volume: Option<GreyVolume>,
    pub palette: LabelPalette,
    /// The jaws around the tooth, if the exercise has a mouth.
    pub mouth: Option<Mouth>,
    /// Opening angle of the mouth, degrees.
    pub mouth_opening: f32,
    /// Solids around the tooth.
    pub surroundings: Vec<MeshInstance>,
    pub instruments: Vec<MeshInstance>,
    /// Greatest radius of each instrument's working end, mm.
    head_radii: Vec<f32>,
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
    unworked_tooth: OnceCell<UnworkedTooth>,
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
        let (mouth, surroundings) = scene::mouth_and_solids(&workpiece, tissues, scenario.scene.is_in_mouth());
        let drawn = scenario.instruments.iter().map(|entry| scene::instrument_solid(entry, library));
        let (instruments, complaints): (Vec<MeshInstance>, Vec<_>) = drawn.unzip();
        let options = scenario.operating_field;
        let (ejector, suction_inlet) = match options.suction {
            true => Some(particles::saliva_ejector(&workpiece)).unzip(),
            false => (None, None),
        };
        let pulp =
            tissues.entries().iter().find(|entry| entry.role == TissueRole::Vulnerable).map(|entry| entry.label());
        let pulp = pulp.filter(|&label| volume.tissues().any(|tissue| tissue == label));
        let grey_volume = grey_volume(&workpiece, &volume, tissues, is_decay_shown);
        let built = LessonScene {
            histogram: OnceCell::new(),
            unworked_tooth: OnceCell::new(),
            transfer_function: match grey_volume {
                Some(_) => TransferFunctionDraft::straight_line(&palette),
                None => TransferFunctionDraft::new(TransferFunction::tissue(&palette)),
            },
            presets: TransferFunctionPresets::new(tissues, &palette, is_decay_shown, grey_volume.is_some()),
            volume,
            grey_volume,
            palette,
            surroundings,
            mouth,
            mouth_opening: scene::WORKING_OPENING_DEG,
            particles: (options.is_any() || pulp.is_some())
                .then(|| ParticleField::new(options, &scenario.instruments, suction_inlet, pulp)),
            ejector,
            instruments,
            head_radii: scenario.instruments.iter().map(|entry| entry.to_instrument().head_radius()).collect(),
            contra_angles: scenario.instruments.iter().map(scene::contra_angle).collect(),
            workpiece,
            edit_count: 0,
            appearance_count: 0,
            undrawn: Vec::new(),
        };
        (built, complaints.iter().flatten().map(Diagnostic::headline).collect())
    }

    /// The tooth before anybody worked on it, by which its enamel and its cuts are drawn; measured at the first call. `tissues`: those
    /// of the exercise.
    pub fn unworked_tooth(&self, tissues: &TissueTable) -> &UnworkedTooth {
        self.unworked_tooth.get_or_init(|| scene::unworked_tooth(&self.workpiece, tissues))
    }

    /// Applies an edit of the session to the window's own copy of the volume.
    pub fn apply_edit(&mut self, edit: &Edit) {
        if let Some(particles) = &mut self.particles {
            particles.record_removal(edit, self.volume.grid());
        }
        self.volume.apply_edit(edit);
        self.grey_volume.iter_mut().for_each(|grey| grey.apply_edit(edit));
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
        if self.grey_volume.is_some() != is_decay_shown {
            self.grey_volume = grey_volume(&self.workpiece, &self.volume, tissues, is_decay_shown);
            self.histogram = OnceCell::new();
        }
        self.presets = TransferFunctionPresets::new(tissues, &self.palette, is_decay_shown, self.grey_volume.is_some());
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

    /// Histogram of the grey values, or else of the densities, at the first call. It is computed on demand: few users need it,
    /// and counting the voxels of a fine tooth takes a while.
    pub fn histogram(&self) -> &DensityHistogram {
        self.histogram.get_or_init(|| DensityHistogram::new(self.volume_of(VolumeSource::GreyValues), &self.volume))
    }

    /// Translucent tissue in its own colours, as a beginning for a transfer function that is drawn by hand.
    pub fn tissue_function(&self) -> TransferFunction {
        let function = TransferFunction::tissue(&self.palette);
        if self.grey_volume.is_none() {
            return function;
        }
        // A table ends at full density, which is the most frequent grey value of its tissue.
        self.histogram().peaks().iter().fold(function, |made, peak| made.with_full_at(peak.tissue, peak.density))
    }

    /// Greatest radius of an instrument's working end, mm; 0 for an instrument that is not on the tray.
    pub fn head_radius(&self, instrument: u32) -> f32 {
        self.head_radii.get(instrument as usize).copied().unwrap_or(0.0)
    }

    /// Returns what a display mode looks at.
    pub fn volume_source(&self, mode: DisplayMode) -> VolumeSource {
        match mode {
            DisplayMode::Xray | DisplayMode::Drawn if self.grey_volume.is_some() => VolumeSource::GreyValues,
            _ => VolumeSource::Densities,
        }
    }

    /// Returns the volume with these values; without grey values that of the densities.
    pub fn volume_of(&self, source: VolumeSource) -> &Volume {
        match (source, &self.grey_volume) {
            (VolumeSource::GreyValues, Some(grey)) => grey.volume(),
            _ => &self.volume,
        }
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

/// Grey values of a workpiece where its inside may be looked at.
fn grey_volume(workpiece: &Workpiece, now: &Volume, tissues: &TissueTable, is_decay_shown: bool) -> Option<GreyVolume> {
    is_decay_shown.then(|| GreyVolume::new(workpiece, now, tissues)).flatten()
}

/// The preset transfer functions; rebuilt with the palette, not with each frame.
struct TransferFunctionPresets {
    tissue: Arc<TransferFunction>,
    x_ray: Arc<TransferFunction>,
    decay: Arc<TransferFunction>,
}

impl TransferFunctionPresets {
    fn new(
        tissues: &TissueTable,
        palette: &LabelPalette,
        is_decay_shown: bool,
        has_grey_values: bool,
    ) -> TransferFunctionPresets {
        let decay: Vec<Label> =
            tissues.entries().iter().filter(|e| e.role == TissueRole::Decay).map(|e| e.label()).collect();
        TransferFunctionPresets {
            tissue: Arc::new(TransferFunction::tissue(palette)),
            x_ray: Arc::new(match has_grey_values {
                true => GreyVolume::radiograph(tissues),
                false => TransferFunction::radiograph(|label| scene::x_ray_attenuation(tissues, label, is_decay_shown)),
            }),
            decay: Arc::new(TransferFunction::highlighting(&decay, palette)),
        }
    }
}

/// Values of the voxels that a picture is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeSource {
    /// The share of each voxel that is filled.
    Densities,
    /// The grey values of the CT scan that the workpiece is from.
    GreyValues,
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

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_exercise::scenario::{self, ResolveMode};
    use typodont_formats::diagnostic::SourceText;
    use typodont_formats::import::GreyValues;

    #[test]
    fn a_scanned_tooth_is_drawn_by_its_grey_values_and_others_by_density() {
        // Aim: only the radiograph and the user's own colours show grey values, over whose histogram the colours are drawn.
        // Method: a generated tooth, and the same with the grey values of a scan: 160 where it is enamel, 90 elsewhere.
        let text =
            include_str!("../../scenarios/5-grinding.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
        let library = Library::shipped();
        let source = SourceText::new("coarse.json", text);
        let scenario = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
        let [enamel, dentine] = ["enamel", "dentine"].map(|name| scenario.tissues.label_of(name).unwrap());
        let generated = Workpiece::make(&scenario, 1).unwrap();
        let grey = generated.volume.labels().iter().map(|&label| if label == enamel { 160 } else { 90 });
        let grey_values = Some(Arc::new(GreyValues::from_values(grey.collect())));
        let scanned = Workpiece { grey_values, ..generated.clone() };
        let [generated, mut scanned] =
            [generated, scanned].map(|made| LessonScene::build(&scenario, &library, Arc::new(made), true).0);
        let peak = |scene: &LessonScene, tissue: Label| {
            scene.histogram().peaks().into_iter().find(|peak| peak.tissue == tissue).unwrap().density
        };
        assert_eq!([enamel, dentine].map(|tissue| peak(&generated, tissue)), [255, 255]);
        assert_eq!([enamel, dentine].map(|tissue| peak(&scanned, tissue)), [160, 90]);
        for mode in DisplayMode::ALL.map(|(mode, _)| mode) {
            let is_by_grey = matches!(mode, DisplayMode::Xray | DisplayMode::Drawn);
            assert_eq!(scanned.volume_source(mode) == VolumeSource::GreyValues, is_by_grey, "{mode:?}");
            assert_eq!(generated.volume_source(mode), VolumeSource::Densities);
        }
        // Full tissue looks alike by density and by grey value.
        let [by_density, by_grey] = [&generated, &scanned].map(|scene| scene.tissue_function());
        assert_eq!(by_grey.table(dentine)[90], by_density.table(dentine)[255]);
        assert_eq!(by_grey.table(dentine)[45], by_density.table(dentine)[127]);
        // What is cut is gone from both.
        let full = |index: &usize| scanned.volume.voxel(*index).density.unit() == 1.0;
        let index = (0..scanned.volume.grid().len()).find(full).unwrap();
        let edit = scanned.volume.clone().set(index, typodont_core::volume::Voxel::AIR);
        scanned.apply_edit(&edit);
        for source in [VolumeSource::Densities, VolumeSource::GreyValues] {
            assert_eq!(scanned.volume_of(source).densities()[index].bits(), 0, "{source:?}");
        }
    }
}
