//! The other teeth of a mouth, each a volume of its own that can be examined but not cut, and the mucosa of both jaws.
//!
//! Takes a scene and the tooth that is worked on. Gives solids in its tooth space, with each tooth's place and lesions. The same
//! inputs give the same voxels, so that a recording needs none of them.

use super::arch_volume::mucosa_colliders;
use super::generated_teeth::{GeneratedTooth, generated_tooth};
use super::lesion::{Lesion, apply_decay, locate_lesion};
use super::tooth_bounds::{ToothBounds, VolumePart, anatomy_tissues, bounds_of};
use super::workpiece_error::WorkpieceError;
use super::{DentalArches, Scene, SceneLayout, ToothSpec};
use crate::catalog::TissueTable;
use std::collections::BTreeMap;
use std::sync::Arc;
use typodont_anatomy::jaw::{DentalArch, FittedTooth, Jaw, WORKING_OPENING_DEG};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Pose;
use typodont_core::parallel;
use typodont_core::touch::{Collider, ColliderGeometry};
use typodont_core::volume::Label;

/// Length of root that is kept below the necks, mm: it ends within the gingiva, where nothing reaches it.
const ROOT_LENGTH: f32 = 3.0;

/// Everything in the mouth but the tooth that is worked on.
pub(super) struct OtherTeeth {
    /// In the order of the scene, from its second tooth on.
    pub teeth: Vec<ToothBounds>,
    pub lesions: Vec<Lesion>,
    /// The teeth, in the same order, then the mucosa.
    pub colliders: Vec<Collider>,
}

/// Both jaws about the tooth that is worked on, the mouth open.
pub struct MouthArches {
    /// The jaw of that tooth, with room for its crown.
    pub near: DentalArch,
    pub opposite: DentalArch,
    /// Arch spaces of the two in tooth space.
    pub tooth_from_near: Pose,
    pub tooth_from_opposite: Pose,
}

impl MouthArches {
    /// `numbers`: of all teeth, FDI. `None` if the arch has no seat for the one that is worked on.
    pub fn around_tooth(plan: &DentalArches, worked: &ToothBounds, numbers: &[u8]) -> Option<MouthArches> {
        let jaw = Jaw::of(worked.fdi);
        let has_third_molar = numbers.iter().any(|fdi| fdi % 10 == 8 && Jaw::of(*fdi) == jaw);
        let fitted = FittedTooth { fdi: worked.fdi, crown: worked.crown.size() };
        let near = DentalArch::new(jaw, if has_third_molar { 8 } else { 7 }, Some(fitted), &plan.plan(jaw));
        let opposite = plan.of_jaw(jaw.other(), numbers.iter().copied().filter(|fdi| Jaw::of(*fdi) != jaw));
        let tooth_from_near = near.arch_from_fitted(worked.fdi, &worked.crown)?.inverse();
        let near_from_opposite = plan.occlusion(&near, &opposite).near_from_opposite(WORKING_OPENING_DEG);
        let [near, opposite] = [near, opposite].map(DentalArch::with_felt_teeth);
        Some(MouthArches { near, opposite, tooth_from_near, tooth_from_opposite: tooth_from_near * near_from_opposite })
    }

    /// Pose of each tooth's own axes in tooth space, by FDI number.
    fn seats(&self) -> BTreeMap<u8, Pose> {
        let near = self.near.teeth().into_iter().map(|(fdi, seat)| (fdi, self.tooth_from_near * seat));
        near.chain(self.opposite.teeth().into_iter().map(|(fdi, seat)| (fdi, self.tooth_from_opposite * seat)))
            .collect()
    }
}

impl OtherTeeth {
    /// # Errors
    /// Returns an error if a tooth or one of its lesions cannot be made.
    pub fn around(
        scene: &Scene,
        worked: &ToothBounds,
        tissues: &TissueTable,
        seed: u64,
    ) -> Result<OtherTeeth, WorkpieceError> {
        let SceneLayout::Mouth { spacing } = scene.layout else {
            return Ok(OtherTeeth { teeth: Vec::new(), lesions: Vec::new(), colliders: Vec::new() });
        };
        let numbers: Vec<u8> = scene.teeth.iter().map(|tooth| tooth.fdi).collect();
        let arches = MouthArches::around_tooth(&scene.arch, worked, &numbers)
            .ok_or(WorkpieceError::NoSuchTooth { fdi: worked.fdi })?;
        let seats = arches.seats();
        let label = tissues.by_name("neighbour").map_or(Label::AIR, |entry| entry.label());
        let others = scene.teeth.get(1..).unwrap_or_default();
        let made = parallel::par_map(others.len(), |index| {
            let tooth = &others[index];
            let seat = seats.get(&tooth.fdi).ok_or(WorkpieceError::NoSuchTooth { fdi: tooth.fdi })?;
            let at = PlacedTooth { index: index + 1, tooth_from_own: *seat, spacing, label };
            at.make(tooth, scene.arch.age, tissues, seed)
        });
        let mut found = OtherTeeth { teeth: Vec::new(), lesions: Vec::new(), colliders: Vec::new() };
        for tooth in made {
            let (bounds, lesions, collider) = tooth?;
            found.teeth.push(bounds);
            found.lesions.extend(lesions);
            found.colliders.push(collider);
        }
        found.colliders.extend(mucosa_colliders(&arches.near, arches.tooth_from_near, tissues));
        found.colliders.extend(mucosa_colliders(&arches.opposite, arches.tooth_from_opposite, tissues));
        Ok(found)
    }
}

/// Place of one of the other teeth, and what it is made of.
struct PlacedTooth {
    /// Index in the scene.
    index: usize,
    tooth_from_own: Pose,
    /// Voxel size, mm.
    spacing: f32,
    /// Tissue of the solid as a whole, as a bur meets it.
    label: Label,
}

impl PlacedTooth {
    fn make(
        &self,
        tooth: &ToothSpec,
        age: Option<f32>,
        tissues: &TissueTable,
        seed: u64,
    ) -> Result<(ToothBounds, Vec<Lesion>, Collider), WorkpieceError> {
        let form = GeneratedTooth {
            fdi: tooth.fdi,
            age,
            spacing: self.spacing,
            root_length: Some(ROOT_LENGTH),
            tissues: anatomy_tissues(tissues),
        };
        let mut volume = generated_tooth(form).ok_or(WorkpieceError::NoSuchTooth { fdi: tooth.fdi })?;
        let own = bounds_of(tooth, &volume, tissues).ok_or(WorkpieceError::NoEnamel { tooth: self.index })?;
        for (number, decay) in tooth.decay.iter().enumerate() {
            volume = apply_decay(volume, decay, &own, tissues, seed)
                .map_err(|reason| WorkpieceError::of_decay(reason, self.index, number))?;
        }
        let located = tooth.decay.iter().map(|decay| {
            let found = locate_lesion(decay, self.index, &own, &volume, VolumePart::All, seed);
            Lesion { centre: self.tooth_from_own * found.centre, ..found }
        });
        let lesions = located.collect();
        let placed = |bounds: Aabb| Aabb::around(bounds.corners().map(|corner| self.tooth_from_own * corner));
        let bounds = ToothBounds {
            whole: placed(own.whole),
            crown: placed(own.crown),
            tooth_from_own: self.tooth_from_own,
            ..own
        };
        let geometry = ColliderGeometry::Voxels(Arc::new(volume));
        Ok((bounds, lesions, Collider { label: self.label, tooth_from_collider: self.tooth_from_own, geometry }))
    }
}
