//! The matter a session starts from, and what is true about it.
//!
//! Takes a scenario and a seed, or a scenario and the volume of an earlier session. Gives the volume with its decay, where
//! each tooth and each lesion lies, and what stands around. The same inputs give the same voxels.

use super::cavity::Uncuttable;
use super::deposit::{put_calculus, put_filling};
use super::lesion::{Lesion, NoRoom, locate, put_in};
use super::{Arch, Form, Layout, Scenario, Tooth, distal};
use crate::anatomy;
use crate::anatomy::periodontium::{Periodontium, Pockets, Standing};
use crate::content::TissueTable;
use crate::frame::{Pose, Quat, Vec3};
use crate::touch::{self, Field, Obstacle, Shape, Yield};
use crate::volume::{Grid, Label, Volume, surface};
use std::fmt;
use std::sync::Arc;

/// What a session works on.
#[derive(Clone, Debug)]
pub struct Workpiece {
    pub volume: Arc<Volume>,
    /// The same before its cavities were cut; `None` where none was. The original contour, with a tooth's decay in it.
    pub original: Option<Arc<Volume>>,
    pub teeth: Vec<ToothPlace>,
    pub lesions: Vec<Lesion>,
    /// Gum and neighbours.
    pub around: Vec<Shape>,
    /// Gum with a sulcus, where there is one.
    pub periodontium: Option<Arc<Periodontium>>,
    /// How the teeth around it stand.
    pub arch: Arch,
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
    /// A cavity meets no tissue: tooth by index.
    CavityOutside { tooth: usize },
    /// A cavity opens the pulp: tooth by index.
    CavityInPulp { tooth: usize },
    /// Calculus finds no root at its place: tooth and deposit by index.
    NoRoot { tooth: usize, calculus: usize },
    /// An old filling holds no hard tissue: tooth and filling by index.
    FillingOutside { tooth: usize, filling: usize },
    /// A pocket reaches below the root: by how much the deepest does, tenths of a millimetre.
    PocketTooDeep { tenths: u32 },
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
            Unmakeable::CavityOutside { .. } => f.write_str("the cavity lies outside the tooth"),
            Unmakeable::CavityInPulp { .. } => f.write_str("the cavity opens the pulp"),
            Unmakeable::NoRoot { .. } => f.write_str("the calculus finds no tooth at its place"),
            Unmakeable::FillingOutside { .. } => f.write_str("the old filling lies outside the crown's hard tissue"),
            Unmakeable::PocketTooDeep { tenths } => {
                write!(f, "the deepest pocket ends {:.1} mm below the root's end", f64::from(*tenths) / 10.0)
            }
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
        // As they were before their cavities were cut; nobody asks for those of teeth without any.
        let (mut parts, mut wholes) = (Vec::new(), Vec::new());
        let has_cavity = scenario.has_cavity();
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
            for (filling, written) in tooth.fillings.iter().enumerate() {
                volume = put_filling(volume, written, &place, &scenario.tissues)
                    .ok_or(Unmakeable::FillingOutside { tooth: index, filling })?;
            }
            if let Some(pockets) = scenario.scene.pockets.filter(|_| !tooth.calculus.is_empty()) {
                let gum = periodontium(&volume, &place, pockets, &scenario.tissues);
                for (calculus, deposit) in tooth.calculus.iter().enumerate() {
                    volume =
                        put_calculus(&volume, &gum, deposit).ok_or(Unmakeable::NoRoot { tooth: index, calculus })?;
                }
            }
            if has_cavity {
                wholes.push(volume.clone());
            }
            if let Some(cavity) = &tooth.cavity {
                volume = cavity.cut(volume, &place, &scenario.tissues, seed).map_err(|reason| match reason {
                    Uncuttable::Outside => Unmakeable::CavityOutside { tooth: index },
                    Uncuttable::Pulp => Unmakeable::CavityInPulp { tooth: index },
                })?;
            }
            parts.push(volume);
        }
        let (volume, original) = match scenario.scene.layout {
            // They stand where they stood whole: a proximal box may take a tooth's outermost place.
            Layout::Pair { gap } if has_cavity => {
                (side_by_side(&parts, &wholes, gap)?, Some(side_by_side(&wholes, &wholes, gap)?))
            }
            Layout::Pair { gap } => (side_by_side(&parts, &parts, gap)?, None),
            Layout::Single | Layout::Jaw => (parts.swap_remove(0), wholes.pop()),
        };
        let original = original.map(Arc::new);
        if volume.grid().len() as u64 > VOXELS_MAX {
            return Err(Unmakeable::TooLarge { voxels: volume.grid().len() as u64 });
        }
        for (zone, region) in scenario.zones.iter().map(|z| &z.region).enumerate() {
            if let Some(map) = region.map_dims().filter(|map| *map != volume.grid().dims) {
                return Err(Unmakeable::ZoneSize { zone, map, workpiece: volume.grid().dims });
            }
        }
        Workpiece::of(scenario, Arc::new(volume), original, seed)
    }

    /// The workpiece of a session whose first volume is known, and its original where it has cavities: from a recording.
    pub fn of(
        scenario: &Scenario,
        volume: Arc<Volume>,
        original: Option<Arc<Volume>>,
        seed: u64,
    ) -> Result<Workpiece, Unmakeable> {
        let whole = original.as_ref().unwrap_or(&volume);
        let mut teeth = Vec::new();
        let mut lesions = Vec::new();
        for (index, tooth) in scenario.scene.teeth.iter().enumerate() {
            let side = Side::of(scenario.scene.layout, index);
            let place = place_within(tooth, whole, &scenario.tissues, side);
            let place = place.ok_or(Unmakeable::NoEnamel { tooth: index })?;
            lesions.extend(tooth.decay.iter().map(|decay| locate(decay, index, &place, whole, side, seed)));
            teeth.push(place);
        }
        let gum = scenario.scene.pockets.map(|pockets| periodontium(&volume, &teeth[0], pockets, &scenario.tissues));
        if let Some(gum) = &gum {
            let beyond = teeth[0].low.z - gum.deepest();
            if beyond > 0.0 {
                return Err(Unmakeable::PocketTooDeep { tenths: (10.0 * beyond).ceil() as u32 });
            }
        }
        let around = match (scenario.scene.layout, &scenario.scene.around) {
            (Layout::Jaw, Some(meshes)) => meshes.clone(),
            (Layout::Jaw, None) => surroundings(&teeth[0], gum.as_ref(), &scenario.scene.arch, &scenario.tissues),
            (Layout::Single | Layout::Pair { .. }, _) => Vec::new(),
        };
        let low = teeth.iter().map(|t| t.crown_low).reduce(Vec3::min).unwrap_or_default();
        let high = teeth.iter().map(|t| t.crown_high).reduce(Vec3::max).unwrap_or_default();
        let world_from_tooth = world_above(Vec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), high.z));
        let periodontium = gum.map(Arc::new);
        let arch = scenario.scene.arch.clone();
        Ok(Workpiece { volume, original, teeth, lesions, around, periodontium, arch, world_from_tooth })
    }

    /// Which way is distal in the first tooth, tooth space.
    pub fn distal(&self) -> Vec3 {
        self.teeth.first().map_or(Vec3::Y, ToothPlace::distal)
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
        Form::Procedural { spacing, age } => {
            let form =
                anatomy::teeth::tooth_of_age(tooth.fdi, *age).ok_or(Unmakeable::NoSuchTooth { fdi: tooth.fdi })?;
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
    let [nx, ny, nz] = grid.dims;
    for [y, z] in (0..nz).flat_map(|z| (0..ny).map(move |y| [y, z])) {
        let centre = |x: u32| grid.centre([x, y, z]);
        if !side.holds(centre(0)) {
            continue;
        }
        // Of a row the ends are enough: what a tooth measures is where it begins and ends.
        let first = grid.index([0, y, z]);
        let tissue = |x: u32| volume.tissue(first + x as usize);
        let ends = |bounds: &mut Bounds, is_meant: &dyn Fn(Label) -> bool| {
            if let Some(low) = (0..nx).find(|&x| is_meant(tissue(x))) {
                let high = (low..nx).rfind(|&x| is_meant(tissue(x))).unwrap_or(low);
                bounds.add(centre(low));
                bounds.add(centre(high));
            }
        };
        ends(&mut whole, &|label| label != Label::AIR);
        ends(&mut crown, &|label| label == enamel);
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

/// One volume with two teeth, the first on the left (y > 0), each of which would stand `gap`/2 mm from the plane between them if
/// it were `whole`.
fn side_by_side(teeth: &[Volume], whole: &[Volume], gap: f32) -> Result<Volume, Unmakeable> {
    let spacing = teeth[0].grid().spacing;
    if teeth.iter().any(|t| (t.grid().spacing - spacing).abs().max_element() > 1e-6) {
        return Err(Unmakeable::UnequalSpacing);
    }
    // Each tooth moves by whole voxels, so that its densities need no resampling.
    let mut moves = Vec::new();
    for (index, tooth) in whole.iter().enumerate() {
        let [low, high] = tight_extent(tooth);
        let middle = 0.5 * (low + high);
        let aside = if index == 0 { 0.5 * gap - low.y } else { -0.5 * gap - high.y };
        let wanted = Vec3::new(-middle.x, aside, 0.0);
        let origin = tooth.grid().origin;
        // Grids meet when both origins are the same number of voxels from zero.
        moves.push(((origin + wanted) / spacing).round() * spacing - origin);
    }
    let low = whole.iter().zip(&moves).map(|(t, m)| tight_extent(t)[0] + *m).fold(Vec3::INFINITY, Vec3::min);
    let high = whole.iter().zip(&moves).map(|(t, m)| tight_extent(t)[1] + *m).fold(Vec3::NEG_INFINITY, Vec3::max);
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

/// Distance between neighbouring crowns, mm: in contact, but for what a bur's run-out needs.
const CONTACT_GAP: f32 = 0.05;

/// Gum and two neighbours around a tooth, as plain shapes of average size.
fn surroundings(
    tooth: &ToothPlace,
    periodontium: Option<&Periodontium>,
    arch: &Arch,
    tissues: &TissueTable,
) -> Vec<Shape> {
    /// Rounding of a crown, mm.
    const ROUNDING: f32 = 1.8;
    let label = |name: &str| tissues.by_name(name).map_or(Label::AIR, |e| e.label());
    let middle = 0.5 * (tooth.crown_low + tooth.crown_high);
    let (neck, top) = (tooth.crown_low.z, tooth.crown_high.z);
    // Across the arch and along it, mm.
    let own = sizes(tooth.fdi).map_or([10.5, 11.0], |s| [s.buccolingual[0], s.mesiodistal[0]]);
    let neighbour = |fdi: u8, toward: Vec3| {
        if periodontium.is_some() {
            return neighbour_as_grown(fdi, toward, tooth, arch.age, label("neighbour"));
        }
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
    let [mesial, distal] = beside(tooth.fdi).map(|fdi| fdi.filter(|fdi| !arch.missing.contains(fdi)));
    let gone = arch.age.map_or(0.0, |years| anatomy::age::recession(years).iter().sum::<f32>() / 6.0);
    let gum_half = Vec3::new(0.5 * own[0] + 1.25, 22.0, 8.0);
    let gum = Shape {
        label: label("gingiva"),
        tooth_from_shape: Pose::at(Vec3::new(middle.x, middle.y, neck + 0.5 - gone - gum_half.z)),
        form: touch::Form::RoundBox { half: gum_half, rounding: 4.0 },
    };
    let mesial = mesial.and_then(|fdi| neighbour(fdi, -tooth.distal()));
    let distal = distal.and_then(|fdi| neighbour(fdi, tooth.distal()));
    let gum = match periodontium {
        Some(periodontium) => gum_with_pockets(tooth, periodontium, gum, label("attachment")),
        None => vec![gum],
    };
    mesial.into_iter().chain(distal).chain(gum).collect()
}

/// A neighbour with the form of its kind: a probe beside it goes where there is room.
fn neighbour_as_grown(fdi: u8, toward: Vec3, tooth: &ToothPlace, age: Option<f32>, label: Label) -> Option<Shape> {
    /// Voxels, mm: what is only met from the side needs no fissures.
    const SPACING: f32 = 0.3;
    /// Of its root so much is kept below the neck, mm: deeper no probe goes.
    const ROOT: f32 = 7.0;
    let form = anatomy::teeth::tooth_of_age(fdi, age)?;
    let whole = anatomy::grid_of_spacing(&form, SPACING);
    let cut = (((-ROOT - whole.origin.z) / SPACING).max(0.0) as u32).min(whole.dims[2] - 2);
    let [nx, ny, nz] = whole.dims;
    let origin = whole.origin + Vec3::Z * (cut as f32 * SPACING);
    let grid = Grid { dims: [nx, ny, nz - cut], origin, ..whole };
    let labels = anatomy::Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let mesh = surface::extract(&anatomy::grow(&form, grid, &labels));
    let extent = mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
    let middle = 0.5 * (tooth.crown_low + tooth.crown_high);
    let along = match toward.y < 0.0 {
        true => tooth.crown_low.y - CONTACT_GAP - extent[1].y,
        false => tooth.crown_high.y + CONTACT_GAP - extent[0].y,
    };
    let place = Vec3::new(middle.x, along, tooth.crown_high.z - 0.3 - extent[1].z);
    let form = touch::Form::Mesh(Arc::new(Obstacle::new(&mesh)?));
    Some(Shape { label, tooth_from_shape: Pose::at(place), form })
}

/// Gum as [`Periodontium`] has it next to the tooth, plain beyond, and what closes the sulcus below.
fn gum_with_pockets(tooth: &ToothPlace, periodontium: &Periodontium, plain: Shape, attachment: Label) -> Vec<Shape> {
    /// How far the gum next to the tooth reaches beyond its crown along the arch, and across it, mm.
    const ALONG: f32 = 2.5;
    const ACROSS: f32 = 2.0;
    /// Between samples, mm: a margin is rounded by half a millimetre.
    const SPACING: f32 = 0.2;
    let (low, high) = (tooth.crown_low, tooth.crown_high);
    let beside = Vec3::new(ACROSS, ALONG, 0.0);
    let (from, to) = ((low - beside).with_z(periodontium.deepest() - 2.5), (high + beside).with_z(low.z + GUM_HIGH));
    let grid = Grid::covering(from, to, Vec3::splat(SPACING), 1);
    let field = |yields: Yield, at: &dyn Fn(Vec3) -> f32| touch::Form::Field(Arc::new(Field::of(grid, yields, at)));
    let near = Shape {
        label: plain.label,
        tooth_from_shape: Pose::IDENTITY,
        form: field(Yield::default(), &|p| periodontium.gum(p)),
    };
    let floor = Shape {
        label: attachment,
        tooth_from_shape: Pose::IDENTITY,
        form: field(ATTACHMENT_YIELDS, &|p| periodontium.attachment(p)),
    };
    let touch::Form::RoundBox { half, rounding } = plain.form else { return vec![near, floor] };
    let beyond = |toward: f32| {
        let edge = if toward < 0.0 { low.y - ALONG } else { high.y + ALONG };
        let far = plain.tooth_from_shape.position.y + toward * half.y;
        let half = Vec3::new(half.x, 0.5 * (far - edge).abs(), half.z);
        let position = plain.tooth_from_shape.position.with_y(0.5 * (far + edge));
        let form = touch::Form::RoundBox { half, rounding: rounding.min(0.9 * half.y) };
        Shape { label: plain.label, tooth_from_shape: Pose::at(position), form }
    };
    vec![near, floor, beyond(-1.0), beyond(1.0)]
}

/// No gum reaches higher over the lowest enamel, mm.
const GUM_HIGH: f32 = 6.0;

/// The floor of a sulcus holds 0.25 N, the force that probing is taught with; more of it sinks a probe in: in studies with graded
/// forces readings grow by half a millimetre to a millimetre from 0.25 to 0.75 N (U. van der Velden, *Probing force and the
/// relationship of the probe tip to the periodontal tissues*, 1979, and others since). 0.7 to 2 mm/N is plausible.
const ATTACHMENT_YIELDS: Yield = Yield { from: 0.25, per_newton: 1.4, most: 2.5 };

fn periodontium(volume: &Volume, place: &ToothPlace, pockets: Pockets, tissues: &TissueTable) -> Periodontium {
    let enamel = anatomy_tissues(tissues).enamel;
    let standing = Standing { volume, enamel, crown: [place.crown_low, place.crown_high], distal: place.distal().y };
    Periodontium::around(&standing, pockets)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tooth_without_its_contact_point_stands_where_it_stood() {
        // Aim: what is cut from one of two teeth before they are set up moves neither. Method: two blocks, one shorter on the
        // side of the other; it once moved up to the gap's middle.
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
