//! Where a decay goes in its tooth, and what of the tooth it takes.

use super::file::SurfaceFile;
use super::workpiece::{Side, ToothPlace, Workpiece, anatomy_tissues};
use super::{Decay, DecayPlace, DecayShape, Grown, GrownEntry};
use crate::anatomy::caries::{self, Entry, Groove, Growth, Patch};
use crate::content::{Role, TissueTable};
use crate::frame::Vec3;
use crate::volume::{ISO, Label, Volume};

/// Where a lesion lies, in tooth space, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesion {
    pub id: String,
    /// Index of the tooth.
    pub tooth: usize,
    pub label: Label,
    /// Of an ellipsoid its middle, of decay that follows the tissues the place where it came in.
    pub centre: Vec3,
    /// Half axes of an ellipsoid; `None` where it follows the tissues.
    pub radii: Option<Vec3>,
    /// 1–4 as seen from above.
    pub quadrant: u8,
}

/// Why a tooth has no room for a decay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoRoom {
    /// It holds no sound hard tissue.
    Outside,
    NoGroove,
}

/// A groove may lie so far from where the author puts a decay, mm, and so far from where chance leads: anywhere on the crown.
const GROOVE_WITHIN: f32 = 2.0;
const GROOVE_ANYWHERE: f32 = 8.0;

/// The place of a surface where a decay comes in.
#[derive(Clone, Copy, Debug)]
struct Site {
    surface: Vec3,
    /// Unit, from the surface's side toward the tooth's middle, and the surface's own two directions.
    inward: Vec3,
    axes: [Vec3; 2],
    /// mm
    groove_within: f32,
}

impl Site {
    fn of(decay: &Decay, place: &ToothPlace, volume: &Volume, side: Side, seed: u64) -> Site {
        /// Of half the crown: where the middle of a quadrant lies, and how far from the middle chance may lead.
        const INTO_QUADRANT: f32 = 0.42;
        const BY_CHANCE: f32 = 0.4;
        let (middle, half) = (0.5 * (place.crown_low + place.crown_high), 0.5 * (place.crown_high - place.crown_low));
        let distal = place.distal();
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
            // 24 bits fill a single float's mantissa.
            let share = (draw(seed, &format!("{}/{name}", decay.id)) >> 40) as f32 / (1u32 << 24) as f32;
            axis * half * BY_CHANCE * (2.0 * share - 1.0)
        };
        let offset = match decay.place {
            DecayPlace::Centre => Vec3::ZERO,
            DecayPlace::Quadrant(quadrant) => in_quadrant(quadrant),
            DecayPlace::RandomQuadrant => in_quadrant(1 + (draw(seed, &decay.id) % 4) as u8),
            DecayPlace::Random => by_chance(u, "u") + by_chance(v, "v"),
            DecayPlace::Offset([a, b]) => u * a + v * b,
        };
        let outside = middle + offset - inward * (half.max_element() + 2.0);
        let by_author = !matches!(decay.place, DecayPlace::Random | DecayPlace::RandomQuadrant);
        let groove_within = if by_author { GROOVE_WITHIN } else { GROOVE_ANYWHERE };
        Site { surface: surface_below(volume, side, outside, inward), inward, axes: [u, v], groove_within }
    }

    /// The way in, square to the surface.
    fn square_in(&self, volume: &Volume) -> Vec3 {
        let square = volume.density_and_gradient_at(self.surface).1.try_normalize();
        square.filter(|way| way.dot(self.inward) > 0.3).unwrap_or(self.inward)
    }

    fn groove(&self, volume: &Volume, side: Side, length: f32) -> Option<Groove> {
        caries::nearest_groove(volume, self.surface, length, self.groove_within, |point| side.holds(point))
    }
}

/// The occlusal surface where a place says; the seed decides what is left to chance.
pub(super) fn surface_over(at: DecayPlace, place: &ToothPlace, volume: &Volume, seed: u64) -> Vec3 {
    let shape = DecayShape::Ellipsoid { radii: [1.0; 3], depth: 0.0 };
    let patch = Decay { id: "cavity".into(), label: Label::AIR, shape, surface: SurfaceFile::O, place: at };
    Site::of(&patch, place, volume, Side::All, seed).surface
}

/// Where a decay lies, in a volume that may hold it already.
pub(super) fn locate(
    decay: &Decay,
    tooth: usize,
    place: &ToothPlace,
    volume: &Volume,
    side: Side,
    seed: u64,
) -> Lesion {
    let site = Site::of(decay, place, volume, side, seed);
    let (centre, radii) = match &decay.shape {
        DecayShape::Ellipsoid { radii, depth } => (site.surface + site.inward * *depth, Some(Vec3::from(*radii))),
        DecayShape::Grown(Grown { entry: GrownEntry::Fissure { length }, .. }) => {
            let groove = site.groove(volume, side, *length);
            (groove.map_or(site.surface, |groove| groove.line()[groove.nearest(site.surface)]), None)
        }
        DecayShape::Grown(Grown { entry: GrownEntry::Smooth { .. }, .. }) => (site.surface, None),
    };
    let quadrant = Workpiece::quadrant(place, centre);
    Lesion { id: decay.id.clone(), tooth, label: decay.label, centre, radii, quadrant }
}

/// The tooth with its decay, or its stain: sound tissue within it is of that kind from here on.
pub(super) fn put_in(
    volume: Volume,
    decay: &Decay,
    place: &ToothPlace,
    tissues: &TissueTable,
    seed: u64,
) -> Result<Volume, NoRoom> {
    let site = Site::of(decay, place, &volume, Side::All, seed);
    match &decay.shape {
        DecayShape::Ellipsoid { radii, depth } => {
            put_ellipsoid(volume, decay.label, site.surface + site.inward * *depth, Vec3::from(*radii), tissues)
        }
        DecayShape::Grown(grown) => put_grown(volume, decay, grown, &site, tissues, seed),
    }
}

fn put_ellipsoid(
    mut volume: Volume,
    decay: Label,
    centre: Vec3,
    radii: Vec3,
    tissues: &TissueTable,
) -> Result<Volume, NoRoom> {
    let grid = *volume.grid();
    let densities: Vec<bool> = volume.densities().iter().map(|d| d.is_solid()).collect();
    let mut count = 0;
    volume.relabel(|index, label| {
        let from_centre = (grid.centre(grid.cell(index)) - centre) / radii;
        let is_hit = from_centre.length_squared() <= 1.0 && tissues.role(label) == Some(Role::Sound);
        count += usize::from(is_hit && densities[index]);
        if is_hit { decay } else { label }
    });
    if count == 0 { Err(NoRoom::Outside) } else { Ok(volume) }
}

fn put_grown(
    volume: Volume,
    decay: &Decay,
    grown: &Grown,
    site: &Site,
    tissues: &TissueTable,
    seed: u64,
) -> Result<Volume, NoRoom> {
    let entry = match grown.entry {
        GrownEntry::Fissure { length } => {
            Entry::Groove(site.groove(&volume, Side::All, length).ok_or(NoRoom::NoGroove)?)
        }
        GrownEntry::Smooth { half } => {
            let inward = site.square_in(&volume);
            let [u, v] = site.axes;
            let v = v.reject_from_normalized(inward).normalize_or(v);
            let u = v.cross(inward) * u.dot(v.cross(inward)).signum();
            Entry::Smooth(Patch { at: site.surface, inward, axes: [u, v], half })
        }
    };
    let drawn = draw(seed, &format!("{}/reach", decay.id)) % grown.reaches.len() as u64;
    let growth = Growth { entry, reach: grown.reaches[drawn as usize], spread: grown.spread };
    let decayed = caries::grow(&volume, &anatomy_tissues(tissues), &growth);
    if decayed.is_empty() {
        return Err(NoRoom::Outside);
    }
    let mut labels: Vec<Label> = volume.tissues().collect();
    for voxel in decayed {
        labels[voxel.index] = match grown.rim {
            Some((rim, share)) if voxel.core < share => rim,
            _ => decay.label,
        };
    }
    Ok(Volume::new(*volume.grid(), volume.band(), volume.densities().to_vec(), labels, Label(1)))
}

/// Where a ray first meets matter on a side of the scene; its far end when it meets none.
fn surface_below(volume: &Volume, side: Side, from: Vec3, along: Vec3) -> Vec3 {
    let step = 0.5 * volume.grid().spacing.min_element();
    let steps = (30.0 / step) as u32;
    let point = |i: u32| from + along * (i as f32 * step);
    (0..steps).map(point).find(|&p| side.holds(p) && volume.density_at(p) >= ISO).unwrap_or(point(steps))
}

/// A number from a seed and a name (SplitMix64 over the name's bytes): the same on every machine, for ever.
fn draw(seed: u64, name: &str) -> u64 {
    let mix = |mut z: u64| {
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    name.bytes().fold(mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15)), |state, byte| {
        mix(state.wrapping_add(u64::from(byte)).wrapping_add(0x9e37_79b9_7f4a_7c15))
    })
}
