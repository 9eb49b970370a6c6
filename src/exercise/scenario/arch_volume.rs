//! All teeth of one jaw in one volume, and the mucosa around them.
//!
//! Takes teeth in their own axes and where they stand. Gives the volume in tooth space: the arch's front toward +x, the
//! occlusal surfaces up.

use super::tooth_bounds::{SeatedTooth, ToothBounds, VolumePart, anatomy_tissues};
use super::workpiece_error::WorkpieceError;
use super::{Scene, ToothSpec};
use crate::catalog::TissueTable;
use std::f32::consts::FRAC_1_SQRT_2;
use std::sync::Arc;
use typodont_anatomy::jaw::{DentalArch, Jaw, MucosaRegion};
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{ClosedMesh, Collider, ColliderGeometry};
use typodont_core::volume::{Density, Grid, Label, Volume, density_at_distance};
use typodont_formats::limits::WORKPIECE_VOXELS_MAX;

/// Length of root that is kept below the necks, mm: it ends within the gingiva, where nothing reaches it.
const ROOT_LENGTH: f32 = 6.0;

/// Seats of the teeth of an arch, in the order of the scene.
pub(super) struct ArchSeats {
    pub teeth: Vec<SeatedTooth>,
    pub tooth_from_arch: Pose,
}

impl ArchSeats {
    /// Seats of a scene whose teeth all belong to one jaw.
    pub fn of(scene: &Scene) -> ArchSeats {
        // A quarter turn: the arch's front, at −y, becomes +x of tooth space, buccal.
        let orientation = Quat::from_xyzw(0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let tooth_from_arch = Pose { position: Vec3::ZERO, orientation };
        let standing = arch_of(scene).teeth();
        let seat = |tooth: &ToothSpec| {
            let arch_from_own =
                standing.iter().find(|(fdi, _)| *fdi == tooth.fdi).map_or(Pose::IDENTITY, |(_, pose)| *pose);
            let half = typodont_anatomy::teeth::tooth(tooth.fdi).map_or([5.0; 2], |form| {
                [form.sizes.buccolingual[0], form.sizes.mesiodistal[0]].map(|size| 0.5 * size)
            });
            SeatedTooth { tooth_from_own: tooth_from_arch * arch_from_own, half }
        };
        ArchSeats { teeth: scene.teeth.iter().map(seat).collect(), tooth_from_arch }
    }

    /// Bounds of a tooth in the volume of the arch; `None` if it has no enamel.
    pub fn bounds(
        &self,
        index: usize,
        tooth: &ToothSpec,
        volume: &Volume,
        tissues: &TissueTable,
    ) -> Option<ToothBounds> {
        let enamel = anatomy_tissues(tissues).enamel;
        let part = VolumePart::Seat { seats: &self.teeth, tooth: index };
        let SeatedTooth { tooth_from_own, half } = self.teeth[index];
        let own_from_tooth = tooth_from_own.inverse();
        let grid = volume.grid();
        // No part of a tooth is farther from its axis than the diagonal of its crown.
        let reach = libm::hypotf(half[0], half[1]) + 2.0;
        let middle = tooth_from_own.position;
        let (low, high) = (middle - Vec3::new(reach, reach, 30.0), middle + Vec3::new(reach, reach, 30.0));
        let [xs, ys, zs] = grid.cells_within(low, high);
        let (mut whole, mut crown, mut own_crown) = (Aabb::EMPTY, Aabb::EMPTY, Aabb::EMPTY);
        for [y, z] in zs.flat_map(|z| ys.clone().map(move |y| [y, z])) {
            for x in xs.clone() {
                let label = volume.tissue(grid.index([x, y, z]));
                let centre = grid.centre([x, y, z]);
                if label == Label::AIR || !part.contains(centre) {
                    continue;
                }
                whole = whole.with(centre);
                if label == enamel {
                    crown = crown.with(centre);
                    own_crown = own_crown.with(own_from_tooth * centre);
                }
            }
        }
        let (id, fdi) = (tooth.id.clone(), tooth.fdi);
        (!crown.is_empty()).then_some(ToothBounds { id, fdi, whole, crown, own_crown, tooth_from_own })
    }

    /// Gingiva and palate or floor of the mouth as they are drawn.
    pub fn mucosa(&self, scene: &Scene, tissues: &TissueTable) -> Vec<Collider> {
        mucosa_colliders(&arch_of(scene), self.tooth_from_arch, tissues)
    }
}

/// The mucosa of one jaw as closed solids; `tooth_from_arch`: where its arch space is.
pub(super) fn mucosa_colliders(arch: &DentalArch, tooth_from_arch: Pose, tissues: &TissueTable) -> Vec<Collider> {
    let label = |name: &str| tissues.by_name(name).map_or(Label::AIR, |e| e.label());
    let collider = |(region, mesh)| {
        let label = label(match region {
            MucosaRegion::Gingiva => "gingiva",
            MucosaRegion::Palate => "palate",
            MucosaRegion::FloorOfMouth => "mouth_floor",
        });
        let solid = ClosedMesh::new(&mesh).expect("the solids of the mucosa are closed");
        let geometry = ColliderGeometry::Mesh(Arc::new(solid));
        Collider { label, tooth_from_collider: tooth_from_arch, geometry }
    };
    arch.gum_solids().into_iter().map(collider).collect()
}

fn arch_of(scene: &Scene) -> DentalArch {
    let jaw = scene.teeth.first().map_or(Jaw::Lower, |tooth| Jaw::of(tooth.fdi));
    scene.arch.of_jaw(jaw, scene.teeth.iter().map(|tooth| tooth.fdi))
}

/// Combines teeth in one volume, each at its seat; `spacing` is the voxel size, mm.
///
/// # Errors
/// Returns an error if the volume would have too many voxels.
pub(super) fn in_arch(teeth: &[Volume], seats: &ArchSeats, spacing: f32) -> Result<Volume, WorkpieceError> {
    let floor =
        seats.teeth.iter().map(|seat| seat.tooth_from_own.position.z).fold(f32::INFINITY, f32::min) - ROOT_LENGTH;
    let extents = teeth.iter().zip(&seats.teeth).map(|(tooth, seat)| {
        let corners = tooth.extent().corners();
        let Aabb { low, high } = Aabb::around(corners.map(|corner| seat.tooth_from_own * corner));
        Aabb::new(low.with_z(low.z.max(floor)), high)
    });
    let extents: Vec<Aabb> = extents.collect();
    let Aabb { low, high } = extents.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    let grid = Grid::covering(low, high, Vec3::splat(spacing), 4);
    let voxels = grid.dims.iter().map(|&n| u64::from(n)).product();
    if voxels > WORKPIECE_VOXELS_MAX {
        return Err(WorkpieceError::TooLarge { voxels });
    }
    let half_band = teeth.iter().map(Volume::half_band).fold(0.0, f32::max);
    let mut density = vec![Density::EMPTY; grid.len()];
    let mut label = vec![Label::AIR; grid.len()];
    for ((tooth, seat), extent) in teeth.iter().zip(&seats.teeth).zip(&extents) {
        let own_from_tooth = seat.tooth_from_own.inverse();
        let margin = Vec3::splat(half_band);
        let [xs, ys, zs] = grid.cells_within(extent.low - margin.with_z(0.0), extent.high + margin);
        for [y, z] in zs.flat_map(|z| ys.clone().map(move |y| [y, z])) {
            for x in xs.clone() {
                let place = own_from_tooth * grid.centre([x, y, z]);
                let value = tooth.density_at(place);
                if value <= 0.0 {
                    continue;
                }
                // As if the tooth had been sampled here.
                let distance = (0.5 - value) * 2.0 * tooth.half_band();
                let value = density_at_distance(distance, half_band);
                let index = grid.index([x, y, z]);
                if value > density[index] {
                    density[index] = value;
                    label[index] = tissue_near(tooth, place);
                }
            }
        }
    }
    Ok(Volume::new(grid, half_band, density, label, Label(1)))
}

/// Tissue of the nearest voxel with matter at a point.
fn tissue_near(tooth: &Volume, point: Vec3) -> Label {
    let grid = tooth.grid();
    let label_at = |at: Vec3| grid.nearest(at).map_or(Label::AIR, |cell| tooth.tissue(grid.index(cell)));
    let here = label_at(point);
    if here != Label::AIR {
        return here;
    }
    let steps = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * grid.spacing);
    let beside = steps.into_iter().flat_map(|step| [point - step, point + step]);
    beside.map(label_at).find(|label| *label != Label::AIR).unwrap_or(Label::AIR)
}
