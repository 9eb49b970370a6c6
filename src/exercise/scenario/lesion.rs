//! Position of decay in its tooth, and the replacement of sound tissue by decay.

use super::file::SurfaceFile;
use super::tooth_bounds::{ToothBounds, VolumePart, anatomy_tissues};
use super::{Decay, DecayOrigin, DecayPlace, DecayShape, GrownDecay, Stage, distal};
use crate::catalog::{TissueRole, TissueTable};
use typodont_anatomy::caries;
use typodont_anatomy::caries::{Groove, LesionEntry, LesionSpec, SurfacePatch};
use typodont_core::frame::Vec3;
use typodont_core::volume::{ISO, Label, Volume};

/// Position of a lesion, tooth space, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesion {
    pub id: String,
    /// Index of the tooth.
    pub tooth: usize,
    pub label: Label,
    /// Centre of an ellipsoid; for decay that follows the tissues, the point of entry.
    pub centre: Vec3,
    /// Semi-axes of an ellipsoid along the tooth's own axes; `None` for decay that follows the tissues.
    pub radii: Option<Vec3>,
    /// Quadrant, 1–4 as seen from above.
    pub quadrant: u8,
}

/// Reason for which decay cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DecayPlacementError {
    /// The decay contains no sound hard tissue.
    Outside,
    NoGroove,
}

/// Maximum distance of a groove from the position given by the author, and from a position selected at random (anywhere
/// on the crown), mm.
const GROOVE_WITHIN: f32 = 2.0;
const GROOVE_ANYWHERE: f32 = 8.0;

/// The point of a surface at which decay enters.
#[derive(Clone, Copy, Debug)]
struct EntrySite {
    surface: Vec3,
    /// Unit vector from the surface's side toward the centre of the tooth, and the two directions of the surface.
    inward: Vec3,
    axes: [Vec3; 2],
    /// Maximum distance of a groove, mm.
    groove_within: f32,
}

impl EntrySite {
    fn of(decay: &Decay, place: &ToothBounds, volume: &Volume, part: VolumePart, seed: u64) -> EntrySite {
        /// Shares of half the crown: position of the centre of a quadrant, and maximum random offset from the centre of
        /// the surface.
        const INTO_QUADRANT: f32 = 0.42;
        const BY_CHANCE: f32 = 0.4;
        // In the tooth's own axes.
        let (middle, half) = (place.own_crown.centre(), place.own_crown.half_size());
        let distal = distal(place.fdi);
        let (inward, u, v) = match decay.surface {
            SurfaceFile::O => (Vec3::NEG_Z, Vec3::X, distal),
            SurfaceFile::B => (Vec3::NEG_X, distal, Vec3::Z),
            SurfaceFile::L => (Vec3::X, distal, Vec3::Z),
            SurfaceFile::D => (-distal, Vec3::X, Vec3::Z),
            SurfaceFile::M => (distal, Vec3::X, Vec3::Z),
        };
        let in_quadrant = |quadrant: u8| {
            let buccal = if quadrant <= 2 { 1.0 } else { -1.0 };
            let left = if quadrant % 2 == 1 { 1.0 } else { -1.0 };
            (Vec3::X * buccal + Vec3::Y * left) * half * INTO_QUADRANT
        };
        let by_chance = |axis: Vec3, name: &str| {
            // 24 bits fill the mantissa of an `f32`.
            let share = (seeded_random(seed, &format!("{}/{name}", decay.id)) >> 40) as f32 / (1u32 << 24) as f32;
            axis * half * BY_CHANCE * (2.0 * share - 1.0)
        };
        let offset = match decay.place {
            DecayPlace::Centre => Vec3::ZERO,
            DecayPlace::Quadrant(quadrant) => in_quadrant(quadrant),
            DecayPlace::RandomQuadrant => in_quadrant(1 + (seeded_random(seed, &decay.id) % 4) as u8),
            DecayPlace::Random => by_chance(u, "u") + by_chance(v, "v"),
            DecayPlace::Offset([a, b]) => u * a + v * b,
        };
        let outside = middle + offset - inward * (half.max_element() + 2.0);
        let by_author = !matches!(decay.place, DecayPlace::Random | DecayPlace::RandomQuadrant);
        let groove_within = if by_author { GROOVE_WITHIN } else { GROOVE_ANYWHERE };
        let outside = place.tooth_from_own * outside;
        let [inward, u, v] = [inward, u, v].map(|way| place.tooth_from_own.rotate(way));
        EntrySite { surface: first_surface_along(volume, part, outside, inward), inward, axes: [u, v], groove_within }
    }

    /// Returns the unit normal of the surface, directed inward.
    fn inward_normal(&self, volume: &Volume) -> Vec3 {
        let square = volume.density_and_gradient_at(self.surface).1.try_normalize();
        square.filter(|way| way.dot(self.inward) > 0.3).unwrap_or(self.inward)
    }

    fn groove(&self, volume: &Volume, part: VolumePart, length: f32) -> Option<Groove> {
        caries::nearest_groove(volume, self.surface, length, self.groove_within, |point| part.contains(point))
    }
}

/// Returns the point of the occlusal surface at a position; the seed determines random positions.
pub(super) fn occlusal_point(at: DecayPlace, place: &ToothBounds, volume: &Volume, seed: u64) -> Vec3 {
    let shape = DecayShape::Ellipsoid { radii: [1.0; 3], depth: 0.0 };
    let patch = Decay { id: "cavity".into(), label: Label::AIR, shape, surface: SurfaceFile::O, place: at };
    EntrySite::of(&patch, place, volume, VolumePart::All, seed).surface
}

/// Returns the position of a decay, in a volume that may already contain the decay.
pub(super) fn locate_lesion(
    decay: &Decay,
    tooth: usize,
    place: &ToothBounds,
    volume: &Volume,
    part: VolumePart,
    seed: u64,
) -> Lesion {
    let site = EntrySite::of(decay, place, volume, part, seed);
    let (centre, radii) = match &decay.shape {
        DecayShape::Ellipsoid { radii, depth } => (site.surface + site.inward * *depth, Some(Vec3::from(*radii))),
        DecayShape::Grown(GrownDecay { origin: DecayOrigin::Fissure { length }, .. }) => {
            let groove = site.groove(volume, part, *length);
            (groove.map_or(site.surface, |groove| groove.line()[groove.nearest(site.surface)]), None)
        }
        DecayShape::Grown(GrownDecay { origin: DecayOrigin::Smooth { .. }, .. }) => (site.surface, None),
    };
    let quadrant = place.quadrant(centre);
    Lesion { id: decay.id.clone(), tooth, label: decay.label, centre, radii, quadrant }
}

/// Returns the lesion that the seed draws for a stage, as an index into `lesions`; `None` for a stage without a draw.
pub(super) fn drawn_lesion(stage: &Stage, lesions: &[Lesion], seed: u64) -> Option<usize> {
    let sites = &stage.draw.as_ref()?.sites;
    let site = &sites[(seeded_random(seed, &format!("{}/draw", stage.id)) % sites.len() as u64) as usize];
    lesions.iter().position(|lesion| lesion.id == *site)
}

/// Returns the tooth with a decay or a stain: sound tissue within it is relabelled.
///
/// # Errors
/// Returns an error if the decay contains no sound hard tissue, or finds no groove to follow.
pub(super) fn apply_decay(
    volume: Volume,
    decay: &Decay,
    place: &ToothBounds,
    tissues: &TissueTable,
    seed: u64,
) -> Result<Volume, DecayPlacementError> {
    let site = EntrySite::of(decay, place, &volume, VolumePart::All, seed);
    match &decay.shape {
        DecayShape::Ellipsoid { radii, depth } => {
            apply_ellipsoid(volume, decay.label, site.surface + site.inward * *depth, Vec3::from(*radii), tissues)
        }
        DecayShape::Grown(grown) => apply_grown(volume, decay, grown, &site, tissues, seed),
    }
}

fn apply_ellipsoid(
    mut volume: Volume,
    decay: Label,
    centre: Vec3,
    radii: Vec3,
    tissues: &TissueTable,
) -> Result<Volume, DecayPlacementError> {
    let grid = *volume.grid();
    let densities: Vec<bool> = volume.densities().iter().map(|d| d.is_solid()).collect();
    let mut count = 0;
    volume.relabel(|index, label| {
        let from_centre = (grid.centre(grid.cell(index)) - centre) / radii;
        let is_hit = from_centre.length_squared() <= 1.0 && tissues.role(label) == Some(TissueRole::Sound);
        count += usize::from(is_hit && densities[index]);
        if is_hit { decay } else { label }
    });
    if count == 0 { Err(DecayPlacementError::Outside) } else { Ok(volume) }
}

fn apply_grown(
    volume: Volume,
    decay: &Decay,
    grown: &GrownDecay,
    site: &EntrySite,
    tissues: &TissueTable,
    seed: u64,
) -> Result<Volume, DecayPlacementError> {
    let entry = match grown.origin {
        DecayOrigin::Fissure { length } => {
            LesionEntry::Groove(site.groove(&volume, VolumePart::All, length).ok_or(DecayPlacementError::NoGroove)?)
        }
        DecayOrigin::Smooth { half } => {
            let inward = site.inward_normal(&volume);
            let [u, v] = site.axes;
            let v = v.reject_from_normalized(inward).normalize_or(v);
            let u = v.cross(inward) * u.dot(v.cross(inward)).signum();
            LesionEntry::Smooth(SurfacePatch { at: site.surface, inward, axes: [u, v], half })
        }
    };
    let drawn = seeded_random(seed, &format!("{}/reach", decay.id)) % grown.depths.len() as u64;
    let growth = LesionSpec { entry, depth: grown.depths[drawn as usize], spread: grown.spread };
    let decayed = caries::lesion_voxels(&volume, &anatomy_tissues(tissues), &growth);
    if decayed.is_empty() {
        return Err(DecayPlacementError::Outside);
    }
    let mut labels: Vec<Label> = volume.tissues().collect();
    for voxel in decayed {
        labels[voxel.index] = match grown.rim {
            Some((rim, share)) if voxel.core < share => rim,
            _ => decay.label,
        };
    }
    Ok(Volume::new(*volume.grid(), volume.half_band(), volume.densities().to_vec(), labels, Label(1)))
}

/// Returns the first point of matter along a ray in a part of the scene, or the ray's far end if it meets none.
fn first_surface_along(volume: &Volume, part: VolumePart, from: Vec3, along: Vec3) -> Vec3 {
    let step = 0.5 * volume.grid().spacing.min_element();
    let steps = (30.0 / step) as u32;
    let point = |i: u32| from + along * (i as f32 * step);
    (0..steps).map(point).find(|&p| part.contains(p) && volume.density_at(p) >= ISO).unwrap_or(point(steps))
}

/// Returns a number from a seed and a name (SplitMix64 over the name's bytes), the same on every machine.
pub fn seeded_random(seed: u64, name: &str) -> u64 {
    let mix = |mut z: u64| {
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    name.bytes().fold(mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15)), |state, byte| {
        mix(state.wrapping_add(u64::from(byte)).wrapping_add(0x9e37_79b9_7f4a_7c15))
    })
}
