//! The matter a session starts from, and what is true about it.
//!
//! Takes a scenario and a seed, or a scenario and the volume of an earlier session. Gives the volume with its decay, where
//! each tooth and each lesion lies, and what stands around. The same inputs give the same voxels.

use super::lesion::{Lesion, NoRoom, locate, put_in};
use super::{Form, Layout, Scenario, Tooth, distal};
use crate::anatomy;
use crate::content::TissueTable;
use crate::frame::{Pose, Quat, Vec3};
use crate::touch::{self, Shape};
use crate::volume::{Grid, Label, Volume};
use std::fmt;
use std::sync::Arc;

/// What a session works on.
#[derive(Clone, Debug)]
pub struct Workpiece {
    pub volume: Arc<Volume>,
    pub teeth: Vec<ToothPlace>,
    pub lesions: Vec<Lesion>,
    /// Gum and neighbours.
    pub around: Vec<Shape>,
    pub world_from_tooth: Pose,
}

/// Where a tooth lies, in tooth space, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct ToothPlace {
    pub id: String,
    pub fdi: u8,
    /// Corners of the box around the whole tooth.
    pub low: Vec3,
    pub high: Vec3,
    /// Corners of the box around its crown (its enamel).
    pub crown_low: Vec3,
    pub crown_high: Vec3,
}

impl ToothPlace {
    /// Which way is distal in tooth space: +y in the upper right and the lower left of the mouth, −y elsewhere.
    pub fn distal(&self) -> Vec3 {
        distal(self.fdi)
    }
}

/// Why a workpiece cannot be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unmakeable {
    /// A decay holds no hard tissue: tooth and decay by index.
    DecayOutside { tooth: usize, decay: usize },
    /// A decay that follows a groove finds none: tooth and decay by index.
    NoGroove { tooth: usize, decay: usize },
    /// A stain holds no sound tissue, or finds no groove to follow: tooth and stain by index.
    StainOutside { tooth: usize, stain: usize },
    /// Two teeth of a pair have different voxel sizes.
    UnequalSpacing,
    /// A tooth has no enamel, so its crown cannot be told.
    NoEnamel { tooth: usize },
    /// A zone's label map is not of the workpiece's size: the zone by index, the map's size and the workpiece's.
    ZoneSize { zone: usize, map: [u32; 3], workpiece: [u32; 3] },
    /// The volume would have too many voxels.
    TooLarge { voxels: u64 },
    /// There is no tooth of this number.
    NoSuchTooth { fdi: u8 },
    /// The forms were not read: the volume is to be taken from the recording.
    OnlyRecorded,
}

impl fmt::Display for Unmakeable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unmakeable::DecayOutside { .. } => f.write_str("the decay lies outside the tooth's hard tissue"),
            Unmakeable::NoGroove { .. } => {
                f.write_str("there is no groove in the chewing surface near the decay's place")
            }
            Unmakeable::StainOutside { .. } => f.write_str("the stain finds no place in the tooth's sound tissue"),
            Unmakeable::UnequalSpacing => f.write_str("the two teeth have different voxel sizes"),
            Unmakeable::NoEnamel { .. } => f.write_str("the tooth has no enamel, so its crown cannot be told"),
            Unmakeable::ZoneSize { map, workpiece, .. } => write!(
                f,
                "the zone's label map has {}×{}×{} voxels, the workpiece {}×{}×{}",
                map[0], map[1], map[2], workpiece[0], workpiece[1], workpiece[2]
            ),
            Unmakeable::NoSuchTooth { fdi } => write!(f, "there is no tooth {fdi}"),
            Unmakeable::OnlyRecorded => f.write_str("the teeth's forms are in the recording only"),
            Unmakeable::TooLarge { voxels } => write!(f, "the volume would have {voxels} voxels"),
        }
    }
}

/// Most voxels of a workpiece: 512×512×322 and half as much again, or about 1 GiB at work.
const VOXELS_MAX: u64 = 130_000_000;

impl Workpiece {
    /// Makes the matter of a scenario; the seed decides what the scenario leaves to chance.
    pub fn make(scenario: &Scenario, seed: u64) -> Result<Workpiece, Unmakeable> {
        let mut parts = Vec::new();
        for (index, tooth) in scenario.scene.teeth.iter().enumerate() {
            let mut volume = form_of(tooth, &scenario.tissues)?;
            let place = place_of(tooth, &volume, &scenario.tissues).ok_or(Unmakeable::NoEnamel { tooth: index })?;
            for (number, decay) in tooth.decay.iter().enumerate() {
                volume = put_in(volume, decay, &place, &scenario.tissues, seed).map_err(|reason| match reason {
                    NoRoom::Outside => Unmakeable::DecayOutside { tooth: index, decay: number },
                    NoRoom::NoGroove => Unmakeable::NoGroove { tooth: index, decay: number },
                })?;
            }
            for (stain, patch) in tooth.stains.iter().enumerate() {
                volume = put_in(volume, patch, &place, &scenario.tissues, seed)
                    .map_err(|_| Unmakeable::StainOutside { tooth: index, stain })?;
            }
            parts.push(volume);
        }
        let volume = match scenario.scene.layout {
            Layout::Pair { gap } => side_by_side(&parts, gap)?,
            Layout::Single | Layout::Jaw => parts.swap_remove(0),
        };
        if volume.grid().len() as u64 > VOXELS_MAX {
            return Err(Unmakeable::TooLarge { voxels: volume.grid().len() as u64 });
        }
        for (zone, region) in scenario.zones.iter().map(|z| &z.region).enumerate() {
            if let Some(map) = region.map_dims().filter(|map| *map != volume.grid().dims) {
                return Err(Unmakeable::ZoneSize { zone, map, workpiece: volume.grid().dims });
            }
        }
        Workpiece::of(scenario, Arc::new(volume), seed)
    }

    /// The workpiece of a session whose first volume is known: from a recording.
    pub fn of(scenario: &Scenario, volume: Arc<Volume>, seed: u64) -> Result<Workpiece, Unmakeable> {
        let mut teeth = Vec::new();
        let mut lesions = Vec::new();
        for (index, tooth) in scenario.scene.teeth.iter().enumerate() {
            let side = Side::of(scenario.scene.layout, index);
            let place = place_within(tooth, &volume, &scenario.tissues, side);
            let place = place.ok_or(Unmakeable::NoEnamel { tooth: index })?;
            lesions.extend(tooth.decay.iter().map(|decay| locate(decay, index, &place, &volume, side, seed)));
            teeth.push(place);
        }
        let around = match (scenario.scene.layout, &scenario.scene.around) {
            (Layout::Jaw, Some(meshes)) => meshes.clone(),
            (Layout::Jaw, None) => surroundings(&teeth[0], &scenario.tissues),
            (Layout::Single | Layout::Pair { .. }, _) => Vec::new(),
        };
        let low = teeth.iter().map(|t| t.crown_low).reduce(Vec3::min).unwrap_or_default();
        let high = teeth.iter().map(|t| t.crown_high).reduce(Vec3::max).unwrap_or_default();
        let world_from_tooth = world_above(Vec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), high.z));
        Ok(Workpiece { volume, teeth, lesions, around, world_from_tooth })
    }

    /// The quadrant (1–4, as seen from above) of a point of tooth space on a tooth.
    pub fn quadrant(place: &ToothPlace, point_in_tooth: Vec3) -> u8 {
        let from_middle = point_in_tooth - 0.5 * (place.crown_low + place.crown_high);
        match (from_middle.x > 0.0, from_middle.y > 0.0) {
            (true, true) => 1,
            (true, false) => 2,
            (false, true) => 3,
            (false, false) => 4,
        }
    }
}

/// World space as the trainee sees it: the tooth stands upright, an upper one too, as in a model jaw on the bench; its buccal
/// side is away, +x of the picture is −y of tooth space (mesial in the upper right and the lower left, distal elsewhere), and the
/// given point of tooth space is the middle of the device's workspace.
fn world_above(origin_in_tooth: Vec3) -> Pose {
    // x right = -y, y up = occlusal (z), z toward the user = lingual (-x).
    let orientation = Quat::from_xyzw(-0.5, 0.5, 0.5, 0.5);
    Pose { position: -(orientation * origin_in_tooth), orientation }
}

/// Which part of a shared volume belongs to a tooth.
#[derive(Clone, Copy)]
pub(super) enum Side {
    All,
    /// y > 0: on the left as the trainee sees it.
    Left,
    Right,
}

impl Side {
    fn of(layout: Layout, tooth: usize) -> Side {
        match (layout, tooth) {
            (Layout::Pair { .. }, 0) => Side::Left,
            (Layout::Pair { .. }, _) => Side::Right,
            _ => Side::All,
        }
    }

    pub(super) fn holds(self, point_in_tooth: Vec3) -> bool {
        match self {
            Side::All => true,
            Side::Left => point_in_tooth.y > 0.0,
            Side::Right => point_in_tooth.y <= 0.0,
        }
    }
}

fn form_of(tooth: &Tooth, tissues: &TissueTable) -> Result<Volume, Unmakeable> {
    match &tooth.form {
        Form::Given(volume) => Ok(volume.as_ref().clone()),
        Form::Recorded => Err(Unmakeable::OnlyRecorded),
        Form::Procedural { spacing } => {
            let form = anatomy::teeth::tooth(tooth.fdi).ok_or(Unmakeable::NoSuchTooth { fdi: tooth.fdi })?;
            let grid = anatomy::grid_of_spacing(&form, *spacing);
            Ok(anatomy::grow(&form, grid, &anatomy_tissues(tissues)))
        }
    }
}

/// The labels of the tissues that every tooth is made of.
pub fn anatomy_tissues(tissues: &TissueTable) -> anatomy::Tissues {
    let label = |name: &str, otherwise: u8| tissues.by_name(name).map_or(Label(otherwise), |e| e.label());
    anatomy::Tissues { enamel: label("enamel", 1), dentine: label("dentine", 2), pulp: label("pulp", 3) }
}

fn place_of(tooth: &Tooth, volume: &Volume, tissues: &TissueTable) -> Option<ToothPlace> {
    place_within(tooth, volume, tissues, Side::All)
}

fn place_within(tooth: &Tooth, volume: &Volume, tissues: &TissueTable, side: Side) -> Option<ToothPlace> {
    let enamel = anatomy_tissues(tissues).enamel;
    let grid = volume.grid();
    let mut whole = Bounds::EMPTY;
    let mut crown = Bounds::EMPTY;
    for (index, label) in volume.tissues().enumerate().filter(|(_, l)| *l != Label::AIR) {
        let point = grid.centre(grid.cell(index));
        if side.holds(point) {
            whole.add(point);
            if label == enamel {
                crown.add(point);
            }
        }
    }
    let Bounds { low, high } = whole;
    let (crown_low, crown_high) = (crown.low, crown.high);
    let place = ToothPlace { id: tooth.id.clone(), fdi: tooth.fdi, low, high, crown_low, crown_high };
    crown_low.cmple(crown_high).all().then_some(place)
}

#[derive(Clone, Copy)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn add(&mut self, point: Vec3) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }
}

/// One volume with two teeth, the first on the left (y > 0), each `gap`/2 mm from the plane between them.
fn side_by_side(teeth: &[Volume], gap: f32) -> Result<Volume, Unmakeable> {
    let spacing = teeth[0].grid().spacing;
    if teeth.iter().any(|t| (t.grid().spacing - spacing).abs().max_element() > 1e-6) {
        return Err(Unmakeable::UnequalSpacing);
    }
    // Each tooth moves by whole voxels, so that its densities need no resampling.
    let mut moves = Vec::new();
    for (index, tooth) in teeth.iter().enumerate() {
        let [low, high] = tight_extent(tooth);
        let middle = 0.5 * (low + high);
        let aside = if index == 0 { 0.5 * gap - low.y } else { -0.5 * gap - high.y };
        let wanted = Vec3::new(-middle.x, aside, 0.0);
        let origin = teeth[index].grid().origin;
        // Grids meet when both origins are the same number of voxels from zero.
        moves.push(((origin + wanted) / spacing).round() * spacing - origin);
    }
    let low = teeth.iter().zip(&moves).map(|(t, m)| tight_extent(t)[0] + *m).fold(Vec3::INFINITY, Vec3::min);
    let high = teeth.iter().zip(&moves).map(|(t, m)| tight_extent(t)[1] + *m).fold(Vec3::NEG_INFINITY, Vec3::max);
    let low = (low / spacing).round() * spacing;
    let grid = Grid::covering(low, high, spacing, 4);
    let voxels = grid.dims.iter().map(|&n| u64::from(n)).product();
    if voxels > VOXELS_MAX {
        return Err(Unmakeable::TooLarge { voxels });
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
    Ok(Volume::new(grid, teeth[0].band(), density, label, Label(1)))
}

fn tight_extent(volume: &Volume) -> [Vec3; 2] {
    match volume.tight_box() {
        Some([low, high]) => [volume.grid().centre(low), volume.grid().centre(high)],
        None => volume.grid().extent(),
    }
}

/// Gum and two neighbours around a tooth, as plain shapes of average size.
fn surroundings(tooth: &ToothPlace, tissues: &TissueTable) -> Vec<Shape> {
    /// Distance between neighbouring crowns, mm: in contact, but for what a bur's run-out needs.
    const CONTACT_GAP: f32 = 0.05;
    /// Rounding of a crown, mm.
    const ROUNDING: f32 = 1.8;
    let label = |name: &str| tissues.by_name(name).map_or(Label::AIR, |e| e.label());
    let middle = 0.5 * (tooth.crown_low + tooth.crown_high);
    let (neck, top) = (tooth.crown_low.z, tooth.crown_high.z);
    // Across the arch and along it, mm.
    let own = sizes(tooth.fdi).map_or([10.5, 11.0], |s| [s.buccolingual[0], s.mesiodistal[0]]);
    let neighbour = |fdi: u8, toward: Vec3| {
        let sizes = sizes(fdi)?;
        let half = Vec3::new(0.5 * sizes.buccolingual[0], 0.5 * sizes.mesiodistal[0], 4.5);
        let side = match toward.y < 0.0 {
            true => tooth.crown_low.y - CONTACT_GAP - half.y,
            false => tooth.crown_high.y + CONTACT_GAP + half.y,
        };
        Some(Shape {
            label: label("neighbour"),
            tooth_from_shape: Pose::at(Vec3::new(middle.x, side, top - 0.3 - half.z)),
            form: touch::Form::RoundBox { half, rounding: ROUNDING.min(0.6 * half.min_element()) },
        })
    };
    let [mesial, distal] = beside(tooth.fdi);
    let gum_half = Vec3::new(0.5 * own[0] + 1.25, 22.0, 8.0);
    let gum = Shape {
        label: label("gingiva"),
        tooth_from_shape: Pose::at(Vec3::new(middle.x, middle.y, neck + 0.5 - gum_half.z)),
        form: touch::Form::RoundBox { half: gum_half, rounding: 4.0 },
    };
    let mesial = mesial.and_then(|fdi| neighbour(fdi, -tooth.distal()));
    let distal = distal.and_then(|fdi| neighbour(fdi, tooth.distal()));
    mesial.into_iter().chain(distal).chain([gum]).collect()
}

fn sizes(fdi: u8) -> Option<anatomy::form::Sizes> {
    anatomy::teeth::tooth(fdi).map(|form| form.sizes)
}

/// The mesial and the distal neighbour of a tooth in a jaw of 28 teeth; a third molar has the second before it.
fn beside(fdi: u8) -> [Option<u8>; 2] {
    let (quadrant, position) = (fdi / 10, fdi % 10);
    // Over the midline: 11 stands beside 21, 31 beside 41.
    let other = [0, 2, 1, 4, 3].get(usize::from(quadrant)).map(|q| 10 * q + 1);
    let mesial = if position == 1 { other } else { Some(fdi - 1) };
    [mesial, (position < 7).then_some(fdi + 1)]
}
