//! The workpiece from which a session starts, and its ground truth.
//!
//! Takes a scenario and a seed, or a scenario and the volume of an earlier session. Gives the volume with its decay,
//! the position of each tooth and each lesion, and the surroundings. The same inputs give the same voxels.

use super::arch_volume::{ArchSeats, in_arch};
use super::calculus_and_fillings::{apply_calculus, apply_old_filling};
use super::cavity::CavityError;
use super::generated_teeth::{GeneratedTooth, generated_tooth};
use super::lesion::{Lesion, apply_decay, drawn_lesion, locate_lesion};
use super::other_teeth::OtherTeeth;
use super::soft_neighbours::soft_neighbour;
use super::tooth_bounds::{ToothBounds, VolumePart, anatomy_tissues, bounds_of, bounds_within};
use super::workpiece_error::WorkpieceError;
use super::{DentalArches, Jaw, Scenario, SceneLayout, ToothSource, ToothSpec, distal};
use crate::catalog::TissueTable;
use std::sync::Arc;
use typodont_anatomy::periodontium::{Periodontium, Pockets, ToothContext};
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{ClosedMesh, Collider, ColliderGeometry, Compliance, SdfGrid};
use typodont_core::volume::{Density, Grid, Label, Volume, surface};
use typodont_formats::import::GreyValues;
use typodont_formats::limits::WORKPIECE_VOXELS_MAX;

/// The workpiece of a session.
#[derive(Clone, Debug)]
pub struct Workpiece {
    pub volume: Arc<Volume>,
    /// Grey values of the CT scan, one per voxel of `volume`; `None` unless all teeth of the volume are from CT scans. A whole
    /// arch and a workpiece from a recording have none.
    pub grey_values: Option<Arc<GreyValues>>,
    /// The volume before its cavities were cut, with its decay: the original contour. `None` without a cavity.
    pub original: Option<Arc<Volume>>,
    pub teeth: Vec<ToothBounds>,
    /// Number of teeth, the first ones, that are in the volume. The others are among the surroundings: they cannot be cut.
    pub teeth_in_volume: usize,
    pub lesions: Vec<Lesion>,
    /// For each stage of the scenario, the lesion that was drawn, as an index into `lesions`; `None` without a draw.
    pub drawn: Vec<Option<usize>>,
    /// Gingiva and neighbouring teeth.
    pub surroundings: Vec<Collider>,
    /// True if they are a jaw of the exercise's own, in place of the generated one.
    pub own_jaw: bool,
    /// True if a rubber dam covers the jaw; it cannot be touched.
    pub rubber_dam: bool,
    /// True if retractors hold the corners of the mouth; they cannot be touched.
    pub retractors: bool,
    /// Those neighbouring teeth among them that have the form of their kind.
    pub neighbours: Vec<NeighbourTooth>,
    /// Gingiva with a sulcus; `None` without pockets.
    pub periodontium: Option<Arc<Periodontium>>,
    /// Positions of the teeth in both jaws.
    pub arch: DentalArches,
    /// Pose of the arch space of the teeth's jaw (see [`typodont_anatomy::jaw`]); `None` unless all its teeth are in the
    /// volume.
    pub tooth_from_arch: Option<Pose>,
    pub world_from_tooth: Pose,
}

/// A tooth beside the one that is worked on, of average form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourTooth {
    pub fdi: u8,
    /// Pose of its own axes.
    pub tooth_from_neighbour: Pose,
    /// Its place among the workpiece's surroundings.
    pub collider: usize,
}

impl Workpiece {
    /// Makes the workpiece of a scenario; the seed determines everything that the scenario leaves to chance.
    ///
    /// # Errors
    /// Returns an error if a tooth or one of its lesions, fillings, deposits or cavities cannot be made.
    pub fn make(scenario: &Scenario, seed: u64) -> Result<Workpiece, WorkpieceError> {
        // The volumes before their cavities were cut; not needed if no tooth has a cavity.
        let (mut parts, mut wholes) = (Vec::new(), Vec::new());
        let has_cavity = scenario.has_cavity();
        for (index, tooth) in scenario.scene.teeth_in_volume().iter().enumerate() {
            let mut volume = tooth_volume(tooth, &scenario.tissues)?;
            let mut place =
                bounds_of(tooth, &volume, &scenario.tissues).ok_or(WorkpieceError::NoEnamel { tooth: index })?;
            if let (SceneLayout::Arch { .. }, ToothSource::Given(_)) = (scenario.scene.layout, &tooth.source) {
                (volume, place) = moved_to_seat(tooth, volume, place, &scenario.tissues);
            }
            for (number, decay) in tooth.decay.iter().enumerate() {
                volume = apply_decay(volume, decay, &place, &scenario.tissues, seed)
                    .map_err(|reason| WorkpieceError::of_decay(reason, index, number))?;
            }
            for (stain, patch) in tooth.stains.iter().enumerate() {
                volume = apply_decay(volume, patch, &place, &scenario.tissues, seed)
                    .map_err(|_| WorkpieceError::StainOutside { tooth: index, stain })?;
            }
            for (filling, written) in tooth.fillings.iter().enumerate() {
                volume = apply_old_filling(volume, written, &place, &scenario.tissues)
                    .ok_or(WorkpieceError::FillingOutside { tooth: index, filling })?;
            }
            if let Some(pockets) = scenario.scene.pockets.filter(|_| !tooth.calculus.is_empty()) {
                let gum = periodontium(&volume, &place, pockets, &scenario.tissues);
                for (calculus, deposit) in tooth.calculus.iter().enumerate() {
                    volume = apply_calculus(&volume, &gum, deposit)
                        .ok_or(WorkpieceError::NoRoot { tooth: index, calculus })?;
                }
            }
            if has_cavity {
                wholes.push(volume.clone());
            }
            if let Some(cavity) = &tooth.cavity {
                volume = cavity.cut(volume, &place, &scenario.tissues, seed).map_err(|reason| match reason {
                    CavityError::Outside => WorkpieceError::CavityOutside { tooth: index },
                    CavityError::Pulp => WorkpieceError::CavityInPulp { tooth: index },
                })?;
            }
            parts.push(volume);
        }
        let grey_values = grey_values(scenario, if has_cavity { &wholes } else { &parts })?;
        let (volume, original) = match scenario.scene.layout {
            // Both teeth keep their positions: a proximal box may remove a tooth's outermost point.
            SceneLayout::Pair { gap } if has_cavity => {
                (side_by_side(&parts, &wholes, gap)?, Some(side_by_side(&wholes, &wholes, gap)?))
            }
            SceneLayout::Pair { gap } => (side_by_side(&parts, &parts, gap)?, None),
            SceneLayout::Single | SceneLayout::Jaw | SceneLayout::Mouth { .. } => (parts.swap_remove(0), wholes.pop()),
            SceneLayout::Arch { spacing } => {
                let seats = ArchSeats::of(&scenario.scene);
                let original = has_cavity.then(|| in_arch(&wholes, &seats, spacing)).transpose()?;
                (in_arch(&parts, &seats, spacing)?, original)
            }
        };
        let original = original.map(Arc::new);
        if volume.grid().len() as u64 > WORKPIECE_VOXELS_MAX {
            return Err(WorkpieceError::TooLarge { voxels: volume.grid().len() as u64 });
        }
        for (zone, region) in scenario.zones.iter().map(|z| &z.region).enumerate() {
            if let Some(map) = region.map_dims().filter(|map| *map != volume.grid().dims) {
                return Err(WorkpieceError::ZoneSize { zone, map, workpiece: volume.grid().dims });
            }
        }
        let made = Workpiece::from_volume(scenario, Arc::new(volume), original, seed)?;
        Ok(Workpiece { grey_values: grey_values.map(Arc::new), ..made })
    }

    /// Returns the workpiece of a session whose initial volume is known from a recording; `original` is given if the
    /// teeth have cavities.
    ///
    /// # Errors
    /// Returns an error if a tooth in the volume has no enamel, or if a pocket extends below its root.
    pub fn from_volume(
        scenario: &Scenario,
        volume: Arc<Volume>,
        original: Option<Arc<Volume>>,
        seed: u64,
    ) -> Result<Workpiece, WorkpieceError> {
        let whole = original.as_ref().unwrap_or(&volume);
        let seats = scenario.scene.is_arch().then(|| ArchSeats::of(&scenario.scene));
        let mut teeth = Vec::new();
        let mut lesions = Vec::new();
        for (index, tooth) in scenario.scene.teeth_in_volume().iter().enumerate() {
            let part = match (scenario.scene.layout, &seats) {
                (_, Some(seats)) => VolumePart::Seat { seats: &seats.teeth, tooth: index },
                (SceneLayout::Pair { .. }, _) if index == 0 => VolumePart::Left,
                (SceneLayout::Pair { .. }, _) => VolumePart::Right,
                _ => VolumePart::All,
            };
            let place = match &seats {
                Some(seats) => seats.bounds(index, tooth, whole, &scenario.tissues),
                None => bounds_within(tooth, whole, &scenario.tissues, part),
            };
            let place = place.ok_or(WorkpieceError::NoEnamel { tooth: index })?;
            lesions.extend(tooth.decay.iter().map(|decay| locate_lesion(decay, index, &place, whole, part, seed)));
            teeth.push(place);
        }
        let gum = scenario.scene.pockets.map(|pockets| periodontium(&volume, &teeth[0], pockets, &scenario.tissues));
        if let Some(gum) = &gum {
            let beyond = teeth[0].whole.low.z - gum.lowest_floor();
            if beyond > 0.0 {
                return Err(WorkpieceError::PocketTooDeep { tenths: (10.0 * beyond).ceil() as u32 });
            }
        }
        let mut neighbours = Vec::new();
        let mut around = match (scenario.scene.layout, &scenario.scene.surroundings) {
            (SceneLayout::Jaw, Some(meshes)) => {
                let own = gum.iter().flat_map(|gum| gum_beside_tooth(&teeth[0], gum, &scenario.tissues));
                meshes.iter().cloned().chain(own).collect()
            }
            (SceneLayout::Jaw, None) => {
                let around = surroundings(&teeth[0], gum.as_ref(), &scenario.scene.arch, &scenario.tissues);
                neighbours = around.neighbours;
                around.colliders
            }
            (SceneLayout::Mouth { .. }, _) => {
                let others = OtherTeeth::around(&scenario.scene, &teeth[0], &scenario.tissues, seed)?;
                teeth.extend(others.teeth);
                lesions.extend(others.lesions);
                others.colliders
            }
            (SceneLayout::Single | SceneLayout::Pair { .. }, _) => Vec::new(),
            (SceneLayout::Arch { .. }, _) => {
                seats.as_ref().map_or_else(Vec::new, |seats| seats.mucosa(&scenario.scene, &scenario.tissues))
            }
        };
        let soft = scenario.scene.soft_neighbours.iter();
        around.extend(soft.map(|kind| soft_neighbour(*kind, &teeth[0], &scenario.scene.arch, &scenario.tissues)));
        let teeth_in_volume = scenario.scene.teeth_in_volume().len();
        let crowns = union(teeth[..teeth_in_volume].iter().map(|tooth| tooth.crown));
        let orientation = if seats.is_some() { ARCH_ORIENTATION } else { TOOTH_ORIENTATION };
        let world_from_tooth = world_from_tooth_above(crowns.centre().with_z(crowns.high.z), orientation);
        let periodontium = gum.map(Arc::new);
        let drawn = Workpiece::draw(scenario, &lesions, seed);
        let arch = scenario.scene.arch.clone();
        let tooth_from_arch = seats.map(|seats| seats.tooth_from_arch);
        Ok(Workpiece {
            volume,
            grey_values: None,
            original,
            teeth,
            teeth_in_volume,
            lesions,
            drawn,
            surroundings: around,
            own_jaw: scenario.scene.own_jaw,
            rubber_dam: scenario.scene.rubber_dam,
            retractors: scenario.scene.retractors,
            neighbours,
            periodontium,
            arch,
            tooth_from_arch,
            world_from_tooth,
        })
    }

    /// Returns, for each stage, the lesion that a seed draws, as an index into `lesions`; `None` without a draw.
    pub fn draw(scenario: &Scenario, lesions: &[Lesion], seed: u64) -> Vec<Option<usize>> {
        scenario.stages.iter().map(|stage| drawn_lesion(stage, lesions, seed)).collect()
    }

    /// Returns the lesion to which a question of a stage refers by an id: the lesion that was drawn, if the id is that of
    /// the stage's draw.
    pub fn lesion(&self, scenario: &Scenario, stage: usize, id: &str) -> Option<&Lesion> {
        let is_draw = scenario.stages.get(stage)?.draw.as_ref().is_some_and(|draw| draw.id == id);
        match is_draw {
            true => self.lesions.get((*self.drawn.get(stage)?)?),
            false => self.lesions.iter().find(|lesion| lesion.id == id),
        }
    }

    /// Returns the index of the tooth in the volume whose crown is nearest to a point in tooth space; `None` without teeth.
    pub fn nearest_tooth(&self, point_in_tooth: Vec3) -> Option<usize> {
        let distance = |tooth: &ToothBounds| {
            let own = tooth.tooth_from_own.inverse() * point_in_tooth;
            own.distance(tooth.own_crown.nearest(own))
        };
        (0..self.teeth_in_volume).min_by(|a, b| distance(&self.teeth[*a]).total_cmp(&distance(&self.teeth[*b])))
    }

    /// Returns the index of the tooth beside the volume that is touched at a point in tooth space; `None` where the volume is
    /// nearer, or no tooth is within a millimetre.
    pub fn other_tooth_at(&self, point_in_tooth: Vec3) -> Option<usize> {
        /// mm
        const TOUCHED_WITHIN: f32 = 1.0;
        let others = (self.teeth_in_volume..self.teeth.len()).filter_map(|tooth| {
            let (volume, tooth_from_own) = self.voxels_beside(tooth)?;
            Some((volume.distance_bound(tooth_from_own.inverse() * point_in_tooth), tooth))
        });
        let (distance, tooth) = others.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let is_nearer = distance < self.volume.distance_bound(point_in_tooth);
        (is_nearer && distance < TOUCHED_WITHIN).then_some(tooth)
    }

    /// Returns the lesions in the volume, which can be cut.
    pub fn lesions_in_volume(&self) -> &[Lesion] {
        // In the order of the teeth.
        &self.lesions[..self.lesions.partition_point(|lesion| lesion.tooth < self.teeth_in_volume)]
    }

    /// Returns the voxels of a tooth that is not in the volume, by its index, and their place in tooth space.
    pub fn voxels_beside(&self, tooth: usize) -> Option<(&Volume, Pose)> {
        let collider = self.surroundings.get(tooth.checked_sub(self.teeth_in_volume)?)?;
        match &collider.geometry {
            ColliderGeometry::Voxels(volume) => Some((volume, collider.tooth_from_collider)),
            _ => None,
        }
    }

    /// Returns true for a tooth of the jaw opposite to the one that is worked on, by its index.
    pub fn is_overhead(&self, tooth: usize) -> bool {
        tooth >= self.teeth_in_volume && Jaw::of(self.teeth[tooth].fdi) != Jaw::of(self.teeth[0].fdi)
    }

    /// Returns the bounding box of all teeth in the volume, tooth space, mm; without teeth the origin.
    pub fn bounds(&self) -> Aabb {
        union(self.teeth[..self.teeth_in_volume].iter().map(|tooth| tooth.whole))
    }

    /// Returns the bounding box of their crowns, tooth space, mm; without teeth the origin.
    pub fn crown_bounds(&self) -> Aabb {
        union(self.teeth[..self.teeth_in_volume].iter().map(|tooth| tooth.crown))
    }

    /// Returns the jaw whose teeth are all in the volume; `None` for one or two teeth.
    pub fn arch_jaw(&self) -> Option<Jaw> {
        self.tooth_from_arch?;
        self.teeth.first().map(|tooth| Jaw::of(tooth.fdi))
    }

    /// Unit vector toward distal of the first tooth, tooth space; +y for a whole arch, whose teeth have no common one.
    pub fn distal(&self) -> Vec3 {
        self.common_distal().unwrap_or(Vec3::Y)
    }

    /// The same for all teeth; `None` for a whole arch.
    pub fn common_distal(&self) -> Option<Vec3> {
        let first = self.teeth.first().filter(|_| self.tooth_from_arch.is_none());
        first.map(ToothBounds::distal)
    }

    /// Returns a direction in tooth space along the own axes of the tooth nearest to a point, and the sign of distal on
    /// their y axis.
    pub fn along_own_axes(&self, point_in_tooth: Vec3, direction: Vec3) -> (Vec3, f32) {
        match self.nearest_tooth(point_in_tooth).map(|index| &self.teeth[index]) {
            Some(tooth) => (tooth.tooth_from_own.inverse().rotate(direction), distal(tooth.fdi).y),
            None => (direction, 1.0),
        }
    }
}

/// Orientation of tooth space in world space, as the trainee sees it: the tooth stands upright, an upper tooth too, as in
/// a model jaw on the bench. Its buccal side faces away from the trainee; +x of world space is −y of tooth space (mesial in
/// the upper right and the lower left, distal elsewhere), +y is occlusal, +z, toward the trainee, lingual.
const TOOTH_ORIENTATION: Quat = Quat::from_xyzw(-0.5, 0.5, 0.5, 0.5);

/// The same for a whole arch, whose front (+x of tooth space) faces the trainee.
const ARCH_ORIENTATION: Quat = Quat::from_xyzw(-0.5, -0.5, -0.5, 0.5);

/// Returns the pose of tooth space in world space. The given point of tooth space is the centre of the device's
/// workspace.
fn world_from_tooth_above(origin_in_tooth: Vec3, orientation: Quat) -> Pose {
    Pose { position: -(orientation * origin_in_tooth), orientation }
}

fn tooth_volume(tooth: &ToothSpec, tissues: &TissueTable) -> Result<Volume, WorkpieceError> {
    match &tooth.source {
        ToothSource::Given(tooth) => Ok(tooth.volume.clone()),
        ToothSource::Recorded => Err(WorkpieceError::OnlyRecorded),
        ToothSource::Procedural { spacing, age } => {
            let tissues = anatomy_tissues(tissues);
            let form = GeneratedTooth { fdi: tooth.fdi, age: *age, spacing: *spacing, root_length: None, tissues };
            generated_tooth(form).ok_or(WorkpieceError::NoSuchTooth { fdi: tooth.fdi })
        }
    }
}

/// Returns the grey values of a workpiece, if all its teeth are from CT scans and it is not a whole arch. `whole`: the teeth
/// before their cavities were cut.
fn grey_values(scenario: &Scenario, whole: &[Volume]) -> Result<Option<GreyValues>, WorkpieceError> {
    let scanned = scenario.scene.teeth_in_volume().iter().zip(whole).map(|(tooth, now)| match &tooth.source {
        ToothSource::Given(tooth) => Some(tooth.grey_values.as_ref()?.only_where(&tooth.volume, now)),
        ToothSource::Procedural { .. } | ToothSource::Recorded => None,
    });
    if let SceneLayout::Arch { .. } = scenario.scene.layout {
        return Ok(None);
    }
    let Some(mut scanned) = scanned.collect::<Option<Vec<GreyValues>>>() else { return Ok(None) };
    match scenario.scene.layout {
        SceneLayout::Single | SceneLayout::Jaw | SceneLayout::Mouth { .. } => Ok(scanned.pop()),
        SceneLayout::Pair { gap } => {
            // The values take the place of the densities and go where the teeth go.
            let as_volume = |(tooth, values): (&Volume, &GreyValues)| {
                let value = |(&value, &label): (&u8, &Label)| {
                    Density::from_bits(if label == Label::AIR { 0 } else { value.max(1) })
                };
                let values = values.values().iter().zip(tooth.labels()).map(value).collect();
                Volume::from_parts(*tooth.grid(), tooth.half_band(), values, tooth.labels().to_vec())
            };
            let Some(teeth) = whole.iter().zip(&scanned).map(as_volume).collect::<Option<Vec<Volume>>>() else {
                return Ok(None);
            };
            let both = side_by_side(&teeth, whole, gap)?;
            Ok(Some(GreyValues::from_values(both.densities().iter().map(|density| density.bits()).collect())))
        }
        SceneLayout::Arch { .. } => Ok(None),
    }
}

/// Returns a tooth from a file, whose place in its file says nothing about the arch, where the generated tooth of the same
/// number is: the middle of its crown and its lowest enamel.
fn moved_to_seat(
    tooth: &ToothSpec,
    volume: Volume,
    place: ToothBounds,
    tissues: &TissueTable,
) -> (Volume, ToothBounds) {
    /// Voxel size of the generated tooth, mm.
    const SPACING: f32 = 0.3;
    let generated = ToothSpec { source: ToothSource::Procedural { spacing: SPACING, age: None }, ..tooth.clone() };
    let seat = tooth_volume(&generated, tissues).ok().and_then(|volume| bounds_of(&generated, &volume, tissues));
    let Some(seat) = seat else { return (volume, place) };
    let foot = |bounds: &ToothBounds| bounds.crown.centre().with_z(bounds.crown.low.z);
    let shift = foot(&seat) - foot(&place);
    let grid = Grid { origin: volume.grid().origin + shift, ..*volume.grid() };
    let moved = |bounds: Aabb| Aabb::new(bounds.low + shift, bounds.high + shift);
    let (whole, crown) = (moved(place.whole), moved(place.crown));
    let labels: Vec<Label> = volume.tissues().collect();
    let moved = Volume::from_parts(grid, volume.half_band(), volume.densities().to_vec(), labels);
    // The parts are those of a volume.
    (moved.unwrap_or(volume), ToothBounds { whole, crown, own_crown: crown, ..place })
}

fn union(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    boxes.reduce(Aabb::union).unwrap_or_default()
}

/// Combines two teeth in one volume, the first on the left (y > 0). Each tooth is placed so that its `whole` form
/// stands `gap`/2 mm from the plane between them.
fn side_by_side(teeth: &[Volume], whole: &[Volume], gap: f32) -> Result<Volume, WorkpieceError> {
    let spacing = teeth[0].grid().spacing;
    if teeth.iter().any(|t| (t.grid().spacing - spacing).abs().max_element() > 1e-6) {
        return Err(WorkpieceError::UnequalSpacing);
    }
    // Each tooth is moved by whole voxels, so that its densities need no resampling.
    let mut moves = Vec::new();
    for (index, tooth) in whole.iter().enumerate() {
        let extent = tooth.extent();
        let middle = extent.centre();
        let aside = if index == 0 { 0.5 * gap - extent.low.y } else { -0.5 * gap - extent.high.y };
        let wanted = Vec3::new(-middle.x, aside, 0.0);
        let origin = tooth.grid().origin;
        // The grids coincide if both origins are a whole number of voxels from zero.
        moves.push(((origin + wanted) / spacing).round() * spacing - origin);
    }
    let moved = |(tooth, shift): (&Volume, &Vec3)| {
        let extent = tooth.extent();
        Aabb::new(extent.low + *shift, extent.high + *shift)
    };
    let Aabb { low, high } = whole.iter().zip(&moves).map(moved).fold(Aabb::EMPTY, Aabb::union);
    let low = (low / spacing).round() * spacing;
    let grid = Grid::covering(low, high, spacing, 4);
    let voxels = grid.dims.iter().map(|&n| u64::from(n)).product();
    if voxels > WORKPIECE_VOXELS_MAX {
        return Err(WorkpieceError::TooLarge { voxels });
    }
    let mut density = vec![Default::default(); grid.len()];
    let mut label = vec![Label::AIR; grid.len()];
    for (tooth, shift) in teeth.iter().zip(&moves) {
        for (index, cell) in tooth.grid().cells().enumerate() {
            let voxel = tooth.voxel(index);
            if let Some(to) = grid.nearest(tooth.grid().centre(cell) + *shift).filter(|_| voxel.label != Label::AIR) {
                density[grid.index(to)] = voxel.density;
                label[grid.index(to)] = voxel.label;
            }
        }
    }
    Ok(Volume::new(grid, teeth[0].half_band(), density, label, Label(1)))
}

/// Distance between neighbouring crowns, mm: in contact, except for the clearance that the run-out of a bur needs.
const CONTACT_GAP: f32 = 0.05;

/// Colliders around a tooth.
struct Surroundings {
    colliders: Vec<Collider>,
    neighbours: Vec<NeighbourTooth>,
}

/// Returns the gingiva and two neighbouring teeth around a tooth, as simple shapes of average size; beside gingiva with a
/// sulcus the teeth have their form.
fn surroundings(
    tooth: &ToothBounds,
    periodontium: Option<&Periodontium>,
    arch: &DentalArches,
    tissues: &TissueTable,
) -> Surroundings {
    /// Rounding of a crown, mm.
    const ROUNDING: f32 = 1.8;
    let label = |name: &str| tissues.by_name(name).map_or(Label::AIR, |e| e.label());
    let middle = tooth.crown.centre();
    let (neck, top) = (tooth.crown.low.z, tooth.crown.high.z);
    // Across and along the arch, mm.
    let own = sizes(tooth.fdi).map_or([10.5, 11.0], |s| [s.buccolingual[0], s.mesiodistal[0]]);
    let neighbour = |fdi: u8, toward: Vec3| {
        if periodontium.is_some() {
            return anatomical_neighbour(fdi, toward, tooth, arch.age, label("neighbour"));
        }
        let sizes = sizes(fdi)?;
        let half = Vec3::new(0.5 * sizes.buccolingual[0], 0.5 * sizes.mesiodistal[0], 4.5);
        let side = match toward.y < 0.0 {
            true => tooth.crown.low.y - CONTACT_GAP - half.y,
            false => tooth.crown.high.y + CONTACT_GAP + half.y,
        };
        Some(Collider {
            label: label("neighbour"),
            tooth_from_collider: Pose::at(Vec3::new(middle.x, side, top - 0.3 - half.z)),
            geometry: ColliderGeometry::RoundBox { half, rounding: ROUNDING.min(0.6 * half.min_element()) },
        })
    };
    let [mesial, distal] = adjacent_teeth(tooth.fdi).map(|fdi| fdi.filter(|fdi| !arch.missing.contains(fdi)));
    let gone = arch.age.map_or(0.0, |years| typodont_anatomy::age::recession(years).iter().sum::<f32>() / 6.0);
    let gum_half = Vec3::new(0.5 * own[0] + 1.25, 22.0, 8.0);
    let gum = Collider {
        label: label("gingiva"),
        tooth_from_collider: Pose::at(Vec3::new(middle.x, middle.y, neck + 0.5 - gone - gum_half.z)),
        geometry: ColliderGeometry::RoundBox { half: gum_half, rounding: 4.0 },
    };
    let beside = [(mesial, -tooth.distal()), (distal, tooth.distal())]
        .into_iter()
        .filter_map(|(fdi, toward)| Some((fdi?, neighbour(fdi?, toward)?)));
    let beside: Vec<(u8, Collider)> = beside.collect();
    let neighbours = beside.iter().enumerate().filter(|_| periodontium.is_some());
    let neighbours = neighbours.map(|(collider, (fdi, shape))| NeighbourTooth {
        fdi: *fdi,
        tooth_from_neighbour: shape.tooth_from_collider,
        collider,
    });
    let neighbours = neighbours.collect();
    let gum = match periodontium {
        Some(periodontium) => gum_with_pockets(tooth, periodontium, gum, tissues),
        None => vec![gum],
    };
    Surroundings { colliders: beside.into_iter().map(|(_, collider)| collider).chain(gum).collect(), neighbours }
}

/// Returns a neighbouring tooth with its anatomical form, so that a probe finds the same space beside it as in a mouth.
fn anatomical_neighbour(
    fdi: u8,
    toward: Vec3,
    tooth: &ToothBounds,
    age: Option<f32>,
    label: Label,
) -> Option<Collider> {
    /// Voxel size, mm: coarse, since neighbouring teeth are touched only from the side and need no fissures.
    const SPACING: f32 = 0.3;
    /// Length of root kept below the neck, mm: no probe reaches deeper.
    const ROOT: f32 = 7.0;
    let form = typodont_anatomy::teeth::tooth_of_age(fdi, age)?;
    let grid = typodont_anatomy::grid_of_spacing(&form, SPACING).above(-ROOT);
    let labels = typodont_anatomy::TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let mesh = surface::extract(&typodont_anatomy::grow(&form, grid, &labels));
    let extent = Aabb::around(mesh.positions.iter().copied());
    let middle = tooth.crown.centre();
    let along = match toward.y < 0.0 {
        true => tooth.crown.low.y - CONTACT_GAP - extent.high.y,
        false => tooth.crown.high.y + CONTACT_GAP - extent.low.y,
    };
    let place = Vec3::new(middle.x, along, tooth.crown.high.z - 0.3 - extent.high.z);
    let form = ColliderGeometry::Mesh(Arc::new(ClosedMesh::new(&mesh)?));
    Some(Collider { label, tooth_from_collider: Pose::at(place), geometry: form })
}

/// Extent of the gingiva next to the tooth beyond its crown, along the arch and across it, mm.
const GUM_ALONG: f32 = 2.5;
const GUM_ACROSS: f32 = 2.0;

/// Returns the gingiva next to the tooth by [`Periodontium`], and the attachment that closes the sulcus.
fn gum_beside_tooth(tooth: &ToothBounds, periodontium: &Periodontium, tissues: &TissueTable) -> [Collider; 2] {
    /// Distance between samples, mm: a margin is rounded by half a millimetre.
    const SPACING: f32 = 0.2;
    let (low, high) = (tooth.crown.low, tooth.crown.high);
    let label = |name: &str| tissues.by_name(name).map_or(Label::AIR, |e| e.label());
    let beside = Vec3::new(GUM_ACROSS, GUM_ALONG, 0.0);
    let (from, to) =
        ((low - beside).with_z(periodontium.lowest_floor() - 2.5), (high + beside).with_z(low.z + GUM_HIGH));
    let grid = Grid::covering(from, to, Vec3::splat(SPACING), 1);
    let field = |yields: Compliance, at: &dyn Fn(Vec3) -> f32| {
        ColliderGeometry::Sdf(Arc::new(SdfGrid::from_fn(grid, yields, at)))
    };
    let near = Collider {
        label: label("gingiva"),
        tooth_from_collider: Pose::IDENTITY,
        geometry: field(Compliance::default(), &|p| periodontium.gum_sdf_probing(p)),
    };
    let floor = Collider {
        label: label("attachment"),
        tooth_from_collider: Pose::IDENTITY,
        geometry: field(ATTACHMENT_COMPLIANCE, &|p| periodontium.attachment_sdf(p)),
    };
    [near, floor]
}

/// Returns the gingiva next to the tooth, and simple gingiva beyond it.
fn gum_with_pockets(
    tooth: &ToothBounds,
    periodontium: &Periodontium,
    plain: Collider,
    tissues: &TissueTable,
) -> Vec<Collider> {
    let (low, high) = (tooth.crown.low, tooth.crown.high);
    let [near, floor] = gum_beside_tooth(tooth, periodontium, tissues);
    let ColliderGeometry::RoundBox { half, rounding } = plain.geometry else { return vec![near, floor] };
    let beyond = |toward: f32| {
        let edge = if toward < 0.0 { low.y - GUM_ALONG } else { high.y + GUM_ALONG };
        let far = plain.tooth_from_collider.position.y + toward * half.y;
        let half = Vec3::new(half.x, 0.5 * (far - edge).abs(), half.z);
        let position = plain.tooth_from_collider.position.with_y(0.5 * (far + edge));
        let form = ColliderGeometry::RoundBox { half, rounding: rounding.min(0.9 * half.y) };
        Collider { label: plain.label, tooth_from_collider: Pose::at(position), geometry: form }
    };
    vec![near, floor, beyond(-1.0), beyond(1.0)]
}

/// Maximum height of the gingiva above the lowest enamel, mm.
const GUM_HIGH: f32 = 6.0;

/// Compliance of the floor of a sulcus. It resists 0.25 N, the force that is taught for probing; a higher force moves
/// the probe deeper: in studies with graded forces, readings increase by half a millimetre to a millimetre from 0.25 to
/// 0.75 N (U. van der Velden, *Probing force and the relationship of the probe tip to the periodontal tissues*, 1979,
/// and later studies). 0.7 to 2 mm/N is plausible.
const ATTACHMENT_COMPLIANCE: Compliance = Compliance { from_force: 0.25, per_newton: 1.4, max_depth: 2.5 };

fn periodontium(volume: &Volume, place: &ToothBounds, pockets: Pockets, tissues: &TissueTable) -> Periodontium {
    let enamel = anatomy_tissues(tissues).enamel;
    let tooth_context = ToothContext { volume, enamel, crown: place.crown, distal: place.distal().y };
    Periodontium::around(&tooth_context, pockets)
}

fn sizes(fdi: u8) -> Option<typodont_anatomy::form::Sizes> {
    typodont_anatomy::teeth::tooth(fdi).map(|form| form.sizes)
}

/// Returns the mesial and the distal neighbour of a tooth in a jaw of 28 teeth; the mesial neighbour of a third molar
/// is the second molar.
fn adjacent_teeth(fdi: u8) -> [Option<u8>; 2] {
    let (quadrant, position) = (fdi / 10, fdi % 10);
    // Across the midline: 11 is beside 21, 31 beside 41.
    let other = [0, 2, 1, 4, 3].get(usize::from(quadrant)).map(|q| 10 * q + 1);
    let mesial = if position == 1 { other } else { Some(fdi - 1) };
    [mesial, (position < 7).then_some(fdi + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tooth_without_its_contact_point_stands_where_it_stood() {
        // Aim: a cavity cut into one of two teeth before they are placed moves neither. Method: two blocks, one of them
        // shorter on the side of the other; it was once moved to the middle of the gap.
        let grid = Grid::centred([20, 20, 20], Vec3::splat(0.5));
        let block = |back: f32| {
            Volume::from_distance(grid, 0.75, |p| ((p.abs().max_element() - 3.0).max(back - p.y), Label(1)))
        };
        let whole = [block(-9.0), block(-9.0)];
        let before = side_by_side(&whole, &whole, 1.0).unwrap();
        let after = side_by_side(&[block(-1.5), block(-9.0)], &whole, 1.0).unwrap();
        assert_eq!(before.grid(), after.grid());
        let pairs = || before.densities().iter().zip(after.densities());
        assert!(pairs().all(|(was, is)| was.is_solid() || !is.is_solid()), "nothing stands where nothing stood");
        let gone = pairs().filter(|(was, is)| was.is_solid() && !is.is_solid()).count();
        assert_eq!(gone, 3 * 12 * 12, "1.5 mm of 6 mm by 6 mm");
    }
}
