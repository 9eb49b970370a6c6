//! Places to look from, as the menu offers them.

use super::sitting::Matter;
use crate::render::{Orbit, Quadrant};
use crate::scene::{self, ToothSide};

/// A place to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Where one works.
    Work,
    Side(ToothSide),
    /// Needs a mouth around the tooth, as the others do.
    Front,
    Arch,
    Quadrant(Quadrant),
}

impl View {
    const ALL: [(View, &str); 12] = [
        (View::Work, "views.work"),
        (View::Side(ToothSide::Occlusal), "views.occlusal"),
        (View::Side(ToothSide::Buccal), "views.buccal"),
        (View::Side(ToothSide::Lingual), "views.lingual"),
        (View::Side(ToothSide::Mesial), "views.mesial"),
        (View::Side(ToothSide::Distal), "views.distal"),
        (View::Front, "views.front"),
        (View::Arch, "views.arch"),
        (View::Quadrant(Quadrant::UpperRight), "views.quadrant_1"),
        (View::Quadrant(Quadrant::UpperLeft), "views.quadrant_2"),
        (View::Quadrant(Quadrant::LowerLeft), "views.quadrant_3"),
        (View::Quadrant(Quadrant::LowerRight), "views.quadrant_4"),
    ];

    /// Those there are around a lesson's matter, with their texts.
    pub fn offered(matter: &Matter) -> impl Iterator<Item = (View, &'static str)> {
        let has_mouth = matter.mouth.is_some();
        let is_offered = move |view: &View| has_mouth || matches!(view, View::Work | View::Side(_));
        View::ALL.into_iter().filter(move |(view, _)| is_offered(view))
    }

    /// Where it looks from; `None` where that needs a mouth and there is none.
    pub fn orbit(self, matter: &Matter) -> Option<Orbit> {
        let mouth = matter.mouth.as_ref();
        match self {
            View::Work => Some(scene::work_view(&matter.workpiece)),
            View::Side(side) => Some(scene::tooth_view(&matter.workpiece, side)),
            View::Front => mouth.map(|mouth| mouth.front_view(matter.open)),
            View::Arch => mouth.map(|mouth| mouth.arch_view()),
            View::Quadrant(quadrant) => mouth.map(|mouth| mouth.quadrant_view(quadrant, matter.open)),
        }
    }
}
