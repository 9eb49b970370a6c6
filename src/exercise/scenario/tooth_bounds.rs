//! Place of a tooth in the volume of its workpiece, and the labels of its tissues.

use super::{ToothSpec, distal};
use crate::catalog::TissueTable;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Label, Volume};

/// Position of a tooth, mm. Its *own axes* are those of tooth space, unless it stands in an arch: x lingual to buccal, y
/// mesial to distal (the reverse for 21–28 and 41–48), z occlusal.
#[derive(Clone, Debug, PartialEq)]
pub struct ToothBounds {
    pub id: String,
    pub fdi: u8,
    /// Bounding box of the whole tooth, tooth space.
    pub whole: Aabb,
    /// Bounding box of the crown (the enamel), tooth space.
    pub crown: Aabb,
    /// Bounding box of the crown along the tooth's own axes.
    pub own_crown: Aabb,
    pub tooth_from_own: Pose,
}

impl ToothBounds {
    /// Unit vector toward distal in tooth space: in the tooth's own axes +y in the upper right and the lower left
    /// quadrant, −y in the others.
    pub fn distal(&self) -> Vec3 {
        self.tooth_from_own.rotate(distal(self.fdi))
    }

    /// Returns the quadrant (1–4, as seen from above) of a point in tooth space on a tooth.
    pub fn quadrant(&self, point_in_tooth: Vec3) -> u8 {
        let from_middle = self.tooth_from_own.inverse() * point_in_tooth - self.own_crown.centre();
        match (from_middle.x > 0.0, from_middle.y > 0.0) {
            (true, true) => 1,
            (true, false) => 2,
            (false, true) => 3,
            (false, false) => 4,
        }
    }
}

/// Seat of a tooth in an arch of voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeatedTooth {
    pub tooth_from_own: Pose,
    /// Half the crown's size, mm: buccolingual and mesiodistal.
    pub half: [f32; 2],
}

impl SeatedTooth {
    /// Distance of a point in tooth space from the tooth's axis, as a share of half its crown's size; above 1 outside.
    fn share(&self, point_in_tooth: Vec3) -> f32 {
        let own = self.tooth_from_own.inverse() * point_in_tooth;
        (own.x.abs() / self.half[0]).max(own.y.abs() / self.half[1])
    }
}

/// The part of a shared volume that belongs to a tooth.
#[derive(Clone, Copy)]
pub(super) enum VolumePart<'a> {
    All,
    /// The half with y > 0, on the trainee's left.
    Left,
    Right,
    /// Matter that is nearest to a tooth of an arch.
    Seat {
        seats: &'a [SeatedTooth],
        tooth: usize,
    },
}

impl VolumePart<'_> {
    pub(super) fn contains(self, point_in_tooth: Vec3) -> bool {
        /// Share of half a crown's size up to which matter can belong to it: roots spread, and crowns are not centred.
        const REACH: f32 = 1.4;
        match self {
            VolumePart::All => true,
            VolumePart::Left => point_in_tooth.y > 0.0,
            VolumePart::Right => point_in_tooth.y <= 0.0,
            VolumePart::Seat { seats, tooth } => {
                let own = seats[tooth].share(point_in_tooth);
                own < REACH
                    && seats.iter().enumerate().all(|(other, seat)| other == tooth || own <= seat.share(point_in_tooth))
            }
        }
    }
}

/// Returns the labels of enamel, dentine and pulp.
pub fn anatomy_tissues(tissues: &TissueTable) -> typodont_anatomy::TissueLabels {
    let label = |name: &str, otherwise: u8| tissues.by_name(name).map_or(Label(otherwise), |e| e.label());
    typodont_anatomy::TissueLabels { enamel: label("enamel", 1), dentine: label("dentine", 2), pulp: label("pulp", 3) }
}

/// Returns the place of a tooth that has a volume of its own; `None` if it has no enamel.
pub(super) fn bounds_of(tooth: &ToothSpec, volume: &Volume, tissues: &TissueTable) -> Option<ToothBounds> {
    bounds_within(tooth, volume, tissues, VolumePart::All)
}

/// The same of a tooth that shares its volume with others.
pub(super) fn bounds_within(
    tooth: &ToothSpec,
    volume: &Volume,
    tissues: &TissueTable,
    part: VolumePart,
) -> Option<ToothBounds> {
    let enamel = anatomy_tissues(tissues).enamel;
    let grid = volume.grid();
    let mut whole = Aabb::EMPTY;
    let mut crown = Aabb::EMPTY;
    let [nx, ny, nz] = grid.dims;
    for [y, z] in (0..nz).flat_map(|z| (0..ny).map(move |y| [y, z])) {
        let centre = |x: u32| grid.centre([x, y, z]);
        if !part.contains(centre(0)) {
            continue;
        }
        // The ends of each row are sufficient to determine the bounds.
        let first = grid.index([0, y, z]);
        let tissue = |x: u32| volume.tissue(first + x as usize);
        let ends = |bounds: &mut Aabb, is_meant: &dyn Fn(Label) -> bool| {
            if let Some(low) = (0..nx).find(|&x| is_meant(tissue(x))) {
                let high = (low..nx).rfind(|&x| is_meant(tissue(x))).unwrap_or(low);
                *bounds = bounds.with(centre(low)).with(centre(high));
            }
        };
        ends(&mut whole, &|label| label != Label::AIR);
        ends(&mut crown, &|label| label == enamel);
    }
    let (id, tooth_from_own) = (tooth.id.clone(), Pose::IDENTITY);
    let place = ToothBounds { id, fdi: tooth.fdi, whole, crown, own_crown: crown, tooth_from_own };
    (!crown.is_empty()).then_some(place)
}
