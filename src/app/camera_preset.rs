//! Camera presets offered by the menu.

use crate::lesson_scene::LessonScene;
use typodont_render::{Orbit, Quadrant};
use typodont_scene::{self as scene, ToothSide};

/// A preset position of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraPreset {
    /// The operator's working view.
    Work,
    Side(ToothSide),
    /// Front view of the mouth. This preset and those below need a mouth around the tooth.
    Front,
    Arch,
    Quadrant(Quadrant),
}

impl CameraPreset {
    const ALL: [(CameraPreset, &str); 12] = [
        (CameraPreset::Work, "views.work"),
        (CameraPreset::Side(ToothSide::Occlusal), "views.occlusal"),
        (CameraPreset::Side(ToothSide::Buccal), "views.buccal"),
        (CameraPreset::Side(ToothSide::Lingual), "views.lingual"),
        (CameraPreset::Side(ToothSide::Mesial), "views.mesial"),
        (CameraPreset::Side(ToothSide::Distal), "views.distal"),
        (CameraPreset::Front, "views.front"),
        (CameraPreset::Arch, "views.arch"),
        (CameraPreset::Quadrant(Quadrant::UpperRight), "views.quadrant_1"),
        (CameraPreset::Quadrant(Quadrant::UpperLeft), "views.quadrant_2"),
        (CameraPreset::Quadrant(Quadrant::LowerLeft), "views.quadrant_3"),
        (CameraPreset::Quadrant(Quadrant::LowerRight), "views.quadrant_4"),
    ];

    /// Presets available for a lesson's scene, with their text keys.
    pub fn available(scene: &LessonScene) -> impl Iterator<Item = (CameraPreset, &'static str)> {
        let has_mouth = scene.mouth.is_some();
        let is_arch = scene.workpiece.arch_jaw().is_some();
        let is_offered = move |view: &CameraPreset| match view {
            CameraPreset::Work | CameraPreset::Side(ToothSide::Occlusal) => true,
            // The teeth of an arch have no sides in common.
            CameraPreset::Side(_) => !is_arch,
            CameraPreset::Front | CameraPreset::Arch | CameraPreset::Quadrant(_) => has_mouth,
        };
        CameraPreset::ALL.into_iter().filter(move |(view, _)| is_offered(view))
    }

    /// Camera position; `None` if the preset needs a mouth and the scene has none.
    pub fn orbit(self, scene: &LessonScene) -> Option<Orbit> {
        let mouth = scene.mouth.as_ref();
        match self {
            CameraPreset::Work => Some(scene::work_view(&scene.workpiece)),
            CameraPreset::Side(side) => Some(scene::tooth_view(&scene.workpiece, side)),
            CameraPreset::Front => mouth.map(|mouth| mouth.front_view(scene.mouth_opening)),
            CameraPreset::Arch => mouth.map(|mouth| mouth.arch_view()),
            CameraPreset::Quadrant(quadrant) => mouth.map(|mouth| mouth.quadrant_view(quadrant, scene.mouth_opening)),
        }
    }
}
