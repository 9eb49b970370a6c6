//! Place of a tooth in the volume of its workpiece, and the labels of its tissues.

use super::{SceneLayout, distal};
use crate::catalog::TissueTable;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::Label;

/// Position of a tooth, tooth space, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct ToothBounds {
    pub id: String,
    pub fdi: u8,
    /// Bounding box of the whole tooth.
    pub whole: Aabb,
    /// Bounding box of the crown (the enamel).
    pub crown: Aabb,
}

impl ToothBounds {
    /// Unit vector toward distal in tooth space: +y in the upper right and the lower left quadrant, −y in the others.
    pub fn distal(&self) -> Vec3 {
        distal(self.fdi)
    }

    /// Returns the quadrant (1–4, as seen from above) of a point in tooth space on a tooth.
    pub fn quadrant(&self, point_in_tooth: Vec3) -> u8 {
        let from_middle = point_in_tooth - self.crown.centre();
        match (from_middle.x > 0.0, from_middle.y > 0.0) {
            (true, true) => 1,
            (true, false) => 2,
            (false, true) => 3,
            (false, false) => 4,
        }
    }
}

/// The part of a shared volume that belongs to a tooth.
#[derive(Clone, Copy)]
pub(super) enum PairHalf {
    All,
    /// The half with y > 0, on the trainee's left.
    Left,
    Right,
}

impl PairHalf {
    pub(super) fn of(layout: SceneLayout, tooth: usize) -> PairHalf {
        match (layout, tooth) {
            (SceneLayout::Pair { .. }, 0) => PairHalf::Left,
            (SceneLayout::Pair { .. }, _) => PairHalf::Right,
            _ => PairHalf::All,
        }
    }

    pub(super) fn contains(self, point_in_tooth: Vec3) -> bool {
        match self {
            PairHalf::All => true,
            PairHalf::Left => point_in_tooth.y > 0.0,
            PairHalf::Right => point_in_tooth.y <= 0.0,
        }
    }
}

/// Returns the labels of enamel, dentine and pulp.
pub fn anatomy_tissues(tissues: &TissueTable) -> typodont_anatomy::TissueLabels {
    let label = |name: &str, otherwise: u8| tissues.by_name(name).map_or(Label(otherwise), |e| e.label());
    typodont_anatomy::TissueLabels { enamel: label("enamel", 1), dentine: label("dentine", 2), pulp: label("pulp", 3) }
}
