//! The cheek and the tongue beside a tooth, as they are felt.

use super::DentalArches;
use super::tooth_bounds::ToothBounds;
use crate::catalog::TissueTable;
use std::sync::Arc;
use typodont_anatomy::cheek_and_tongue::{SoftBody, SoftNeighbour};
use typodont_anatomy::jaw::{DentalArch, FittedTooth, Jaw};
use typodont_anatomy::teeth::distal_sign;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::touch::{Collider, ColliderGeometry, Compliance, SdfGrid};
use typodont_core::volume::{Grid, Label};

/// Distance between samples, mm: the smallest radius is that of the furrow of the tongue.
const SPACING: f32 = 0.8;

/// Yielding of cheek and tongue to a working end, as far as what is shown. The force is that of their tissue: 0.05 N/mm, about
/// that of a ball with a radius of 1.5 mm, pressed 5 mm deep into an elastic half-space (Hertz) with three times the shear
/// modulus of the relaxed tongue, 2.7 kPa (Cheng et al., Journal of Biomechanics 44, 2011). Deeper, the retractor and the
/// muscles under the tongue hold.
const YIELD: Compliance = Compliance { from_force: 0.0, per_newton: 20.0, max_depth: 5.0 };

/// Distance of the midline from a tooth without a seat of its own, mm: that of a first molar.
const USUAL_MIDLINE: f32 = 24.0;

/// Name of the tissue of a soft neighbour.
pub(super) fn soft_neighbour_tissue(kind: SoftNeighbour) -> &'static str {
    match kind {
        SoftNeighbour::Cheek => "cheek",
        SoftNeighbour::Tongue => "tongue",
    }
}

/// Returns a soft neighbour of a tooth, tooth space.
pub(super) fn soft_neighbour(
    kind: SoftNeighbour,
    tooth: &ToothBounds,
    arch: &DentalArches,
    tissues: &TissueTable,
) -> Collider {
    let fitted = FittedTooth { fdi: tooth.fdi, crown: tooth.crown.size() };
    let jaw = Jaw::of(tooth.fdi);
    let own_jaw = DentalArch::new(jaw, 7, Some(fitted), &arch.plan(jaw));
    let seat = own_jaw.seat(distal_sign(tooth.fdi), usize::from(tooth.fdi % 10) - 1);
    let body = SoftBody::new(kind, tooth.crown, -tooth.distal().y, seat.map_or(USUAL_MIDLINE, |seat| seat.top.x.abs()));
    let Aabb { low, high } = body.bounds();
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 2);
    let field = SdfGrid::from_fn(grid, YIELD, |place| body.distance(place));
    Collider {
        label: tissues.by_name(soft_neighbour_tissue(kind)).map_or(Label::AIR, |entry| entry.label()),
        tooth_from_collider: Pose::IDENTITY,
        geometry: ColliderGeometry::Sdf(Arc::new(field)),
    }
}
