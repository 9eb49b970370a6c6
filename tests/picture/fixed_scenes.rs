//! Twelve fixed scenes: three exercises, each before and after the work, close by and from the mouth's front.
//!
//! `scripts/pictures` writes them as PNG, so that the picture of two programs can be laid side by side.

use crate::scenes::carve;
use std::path::Path;
use typodont_core::frame::Vec3;
use typodont_core::volume::Volume;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece};
use typodont_formats::Library;
use typodont_render::*;
use typodont_scene::*;

/// An exercise with its tooth untouched and prepared.
pub struct FixedCase {
    pub number: u32,
    pub scenario: Scenario,
    pub workpiece: Workpiece,
    pub prepared: Volume,
    pub palette: LabelPalette,
    unworked_tooth: UnworkedTooth,
}

/// One view of a case.
#[derive(Clone, Copy)]
pub struct FixedView {
    pub name: &'static str,
    is_prepared: bool,
    /// Distance to the eye as a share of the usual one; the mouth from in front, if none.
    distance: Option<f32>,
}

pub const FIXED_VIEWS: [FixedView; 4] = [
    FixedView { name: "before", is_prepared: false, distance: Some(1.0) },
    FixedView { name: "after", is_prepared: true, distance: Some(1.0) },
    FixedView { name: "cavity", is_prepared: true, distance: Some(0.45) },
    FixedView { name: "mouth", is_prepared: false, distance: None },
];

impl FixedCase {
    pub fn all() -> Vec<FixedCase> {
        [(5, "5-grinding.json"), (8, "8-fissure.json"), (12, "12-deep-caries.json")]
            .into_iter()
            .map(|(number, file)| FixedCase::new(number, file))
            .collect()
    }

    pub fn new(number: u32, file: &str) -> FixedCase {
        let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let source = typodont_formats::read_text(&scenarios.join(file)).unwrap();
        let library = Library::shipped().with_folder(scenarios);
        let scenario = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
        let workpiece = Workpiece::make(&scenario, 0).unwrap();
        let mut prepared = (*workpiece.volume).clone();
        if !workpiece.lesions.is_empty() {
            prepare(&mut prepared, &workpiece);
        }
        prepared.take_dirty();
        let palette = tissue_palette(&scenario.tissues, true);
        let unworked_tooth = unworked_tooth(&workpiece, &scenario.tissues);
        FixedCase { number, scenario, workpiece, prepared, palette, unworked_tooth }
    }

    /// The scene as the trainee has it, and where it is seen from. `is_full`: with shadows and relief, as a graphics processor draws it.
    pub fn scene(&self, view: FixedView, mode: RenderMode, is_full: bool) -> (RenderScene<'_>, Viewpoint) {
        let mouth = Mouth::around(&self.workpiece, &self.scenario.tissues).unwrap();
        let orbit = match view.distance {
            Some(share) => {
                let usual = work_view(&self.workpiece);
                Orbit { distance: share * usual.distance, ..usual }
            }
            None => mouth.front_view(WORKING_OPENING_DEG),
        };
        let viewpoint = orbit.viewpoint();
        let scene = RenderScene {
            tooth: Some(VolumeInstance {
                volume: if view.is_prepared { &self.prepared } else { &self.workpiece.volume },
                changes: Changes::All,
                world_from_tooth: self.workpiece.world_from_tooth,
                palette: &self.palette,
                unworked_tooth: Some(&self.unworked_tooth),
                mode,
            }),
            solids: mouth
                .solids(WORKING_OPENING_DEG)
                .into_iter()
                .chain(mouth.front_solids(&viewpoint, WORKING_OPENING_DEG))
                .collect(),
            lights: Lights::along(&viewpoint),
            shadows: is_full.then(|| shadow_region(&self.workpiece, &orbit)),
            relief_seed: is_full.then(|| relief_seed(&self.scenario)),
            is_antialiased: true,
            ..RenderScene::empty()
        };
        (scene, viewpoint)
    }
}

/// Cuts a cavity over the first lesion, most of the way through it, as a round bur does: in overlapping balls.
fn prepare(volume: &mut Volume, workpiece: &Workpiece) {
    const RADIUS: f32 = 0.7;
    const TURNS: u32 = 36;
    let lesion = &workpiece.lesions[0];
    let top = workpiece.teeth[0].crown.high.z;
    let floor = lesion.centre.z - lesion.radii.map_or(2.2, |r| 0.5 * r.z);
    let levels = ((top - floor) / 0.2).ceil() as u32;
    for level in 0..=levels {
        let z = floor + 0.2 * level as f32;
        carve(volume, Vec3::new(lesion.centre.x, lesion.centre.y, z), RADIUS);
        for turn in 0..TURNS {
            let (sin, cos) = (turn as f32 * std::f32::consts::TAU / TURNS as f32).sin_cos();
            carve(volume, Vec3::new(lesion.centre.x + 0.8 * cos, lesion.centre.y + 1.1 * sin, z), RADIUS);
        }
    }
}
