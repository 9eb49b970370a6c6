//! Growth of caries: inward along a groove or through a smooth surface, and laterally under the enamel.
//!
//! In enamel a lesion follows the prisms: from a groove it widens inward; through a smooth surface it narrows. At the
//! junction with dentine it spreads laterally and continues toward the pulp, deepest at its centre (A. Thylstrup and O.
//! Fejerskov, *Textbook of Clinical Cariology*, 1994). Depths are given by the radiographic scores of ICCMS.

mod groove;

pub use groove::{Groove, nearest_groove};

use crate::TissueLabels;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume, distance};

/// Depth of a lesion: radiographic scores of the ICCMS guide (2014).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LesionDepth {
    /// RA1: the outer half of the enamel.
    OuterEnamel,
    /// RA2: the inner half of the enamel.
    InnerEnamel,
    /// RA3: the outer third of the dentine.
    OuterDentine,
    /// RB4: the middle third of the dentine.
    MiddleDentine,
    /// RC5: the inner third of the dentine, short of the pulp.
    InnerDentine,
}

impl LesionDepth {
    /// Returns the decayed shares of the enamel's and of the dentine's thickness.
    fn shares(self) -> [f32; 2] {
        match self {
            LesionDepth::OuterEnamel => [0.5, 0.0],
            LesionDepth::InnerEnamel => [1.0, 0.0],
            LesionDepth::OuterDentine => [1.0, 1.0 / 3.0],
            LesionDepth::MiddleDentine => [1.0, 2.0 / 3.0],
            LesionDepth::InnerDentine => [1.0, 0.9],
        }
    }

    /// Returns true if dentine is decayed.
    pub fn is_in_dentine(self) -> bool {
        self.shares()[1] > 0.0
    }
}

/// Entry of a lesion; tooth space, mm.
#[derive(Clone, Debug)]
pub enum LesionEntry {
    /// Entry from the bottom of a groove in the occlusal surface.
    Groove(Groove),
    Smooth(SurfacePatch),
}

/// An elliptical patch of a smooth surface, with semi-axes along two directions; tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePatch {
    pub at: Vec3,
    pub inward: Vec3,
    pub axes: [Vec3; 2],
    pub half: [f32; 2],
}

impl SurfacePatch {
    /// Returns the same patch with another inward direction.
    fn aimed(self, inward: Vec3) -> SurfacePatch {
        let axes = self.axes.map(|axis| axis.reject_from_normalized(inward).normalize_or(axis));
        SurfacePatch { inward, axes, ..self }
    }
}

/// Specification of a lesion.
#[derive(Clone, Debug)]
pub struct LesionSpec {
    pub entry: LesionEntry,
    pub depth: LesionDepth,
    /// Spread to each side along the enamel–dentine junction, mm.
    pub spread: f32,
}

/// A voxel of a lesion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LesionVoxel {
    /// Index in the volume's arrays.
    pub index: usize,
    /// Position between the rim (0) and the core (1).
    pub core: f32,
}

/// Half-width of a lesion at the groove from which it begins, mm.
const OPENING_HALF_WIDTH: f32 = 0.15;

/// Relative narrowing of a lesion through a smooth surface from the surface to the junction.
const NARROWING: f32 = 0.6;

/// Upper limit of the thickness of dentine between enamel and pulp, mm; used for points under which there is no pulp.
const MAX_DENTINE: f32 = 4.0;

/// Returns the voxels of enamel and dentine that a lesion occupies, in array order. `volume` is one tooth, crown up.
pub fn lesion_voxels(volume: &Volume, tissues: &TissueLabels, lesion: &LesionSpec) -> Vec<LesionVoxel> {
    let lesion_grid = LesionGrid::around(volume, lesion);
    if let LesionEntry::Smooth(patch) = &lesion.entry
        && let Some(entry) = lesion_grid.aimed(patch, tissues).map(LesionEntry::Smooth)
    {
        return lesion_voxels(volume, tissues, &LesionSpec { entry, ..*lesion });
    }
    let enamel = lesion_grid.distances(|label| label == tissues.enamel);
    let pulp = lesion_grid.distances(|label| label == tissues.pulp);
    match &lesion.entry {
        LesionEntry::Groove(groove) => from_groove(&lesion_grid, groove, lesion, tissues, &enamel, &pulp),
        LesionEntry::Smooth(patch) => through_surface(&lesion_grid, patch, lesion, tissues, &enamel, &pulp),
    }
}

/// The part of a volume that can contain a lesion.
struct LesionGrid<'a> {
    volume: &'a Volume,
    grid: Grid,
    first: [u32; 3],
    labels: Vec<Label>,
}

impl<'a> LesionGrid<'a> {
    fn around(volume: &'a Volume, lesion: &LesionSpec) -> LesionGrid<'a> {
        /// Maximum depth of a lesion, and the margin around it that its distances need, mm.
        const DEPTH: f32 = 9.0;
        const AROUND: f32 = 1.5;
        let (low, high) = match &lesion.entry {
            LesionEntry::Groove(groove) => {
                let reach = Vec3::new(1.0, 1.0, 0.0) * (lesion.spread + AROUND) + Vec3::Z * AROUND;
                let Aabb { low, high } = groove.extent();
                (low - reach - Vec3::Z * DEPTH, high + reach)
            }
            LesionEntry::Smooth(SurfacePatch { at, inward, half, .. }) => {
                let side = half[0].max(half[1]).max(lesion.spread) + AROUND;
                let end = *at + *inward * DEPTH;
                (at.min(end) - side, at.max(end) + side)
            }
        };
        let ranges = volume.grid().cells_within(low, high);
        let first = [0, 1, 2].map(|axis| ranges[axis].start);
        let dims = [0, 1, 2].map(|axis| ranges[axis].end - ranges[axis].start);
        let grid = Grid { dims, spacing: volume.grid().spacing, origin: volume.grid().centre(first) };
        let mut near = LesionGrid { volume, grid, first, labels: Vec::new() };
        near.labels = near.grid.cells().map(|cell| volume.tissue(near.in_volume(cell))).collect();
        near
    }

    fn in_volume(&self, cell: [u32; 3]) -> usize {
        self.volume.grid().index([0, 1, 2].map(|axis| cell[axis] + self.first[axis]))
    }

    /// Returns the distance from every voxel to the nearest voxel of a tissue, mm.
    fn distances(&self, is_of: impl Fn(Label) -> bool) -> Vec<f32> {
        distance::to_set(&self.grid, |index| is_of(self.labels[index]))
    }

    fn label_at(&self, place: Vec3) -> Option<Label> {
        self.grid.nearest(place).map(|cell| self.labels[self.grid.index(cell)])
    }

    /// Returns the step of searches through the tooth, half a voxel, mm.
    fn step(&self) -> f32 {
        0.5 * self.grid.spacing.min_element()
    }

    /// Returns the number of steps from a surface point inward after which matter begins, and the number after which a
    /// run of labels ends.
    fn run(&self, from: Vec3, inward: Vec3, is_in: impl Fn(Label) -> bool) -> [u32; 2] {
        let label = |i: u32| self.label_at(from + inward * (i as f32 * self.step()));
        // A point on the surface may lie half a voxel outside.
        let begin = (0..6).find(|&i| label(i).is_some_and(|label| label != Label::AIR)).unwrap_or(0);
        [begin, (begin..).find(|&i| !label(i).is_some_and(&is_in)).unwrap_or(begin)]
    }

    /// Returns the thickness of the enamel from a surface point inward, and that of the dentine from there to the pulp,
    /// mm.
    fn thickness(&self, from: Vec3, inward: Vec3, tissues: &TissueLabels, pulp: &[f32]) -> [f32; 2] {
        let [begin, end] = self.run(from, inward, |label| label == tissues.enamel);
        let junction = self.grid.nearest(from + inward * (end as f32 * self.step()));
        let to_pulp = junction.map_or(MAX_DENTINE, |cell| pulp[self.grid.index(cell)]);
        [(end - begin) as f32 * self.step(), to_pulp.min(MAX_DENTINE)]
    }

    /// Returns the nearest point of a tissue.
    fn nearest_of(&self, from: Vec3, tissue: Label) -> Option<Vec3> {
        let cells = self.grid.cells().zip(&self.labels).filter(|(_, label)| **label == tissue);
        let places = cells.map(|(cell, _)| self.grid.centre(cell));
        places.min_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
    }

    /// Returns the patch directed along the shortest path to the dentine if its own inward direction runs along the
    /// enamel, since prisms are about perpendicular to the dentine; otherwise `None`.
    fn aimed(&self, patch: &SurfacePatch, tissues: &TissueLabels) -> Option<SurfacePatch> {
        /// Factor, and additional length in mm, by which the enamel along a direction must exceed the shortest path for
        /// the direction to be corrected.
        const ASTRAY: [f32; 2] = [1.5, 0.5];
        let [begin, end] = self.run(patch.at, patch.inward, |label| label == tissues.enamel);
        let shortest = self.nearest_of(patch.at, tissues.dentine)? - patch.at;
        let is_astray = (end - begin) as f32 * self.step() > ASTRAY[0] * shortest.length() + ASTRAY[1];
        let aimed = patch.aimed(shortest.try_normalize()?);
        // The direction is not corrected twice: that to the nearest point cannot be improved.
        (is_astray && aimed.inward.dot(patch.inward) < 0.99).then_some(aimed)
    }

    /// Returns the thickness of the tooth from a surface point inward, mm.
    fn tooth_thickness(&self, from: Vec3, inward: Vec3) -> f32 {
        self.run(from, inward, |label| label != Label::AIR)[1] as f32 * self.step()
    }

    /// Returns, for each column, the indices of the points within `reach` mm as seen from above; columns with x
    /// fastest.
    fn columns_close_to(&self, places: impl Iterator<Item = Vec3> + Clone, reach: f32) -> Vec<Vec<usize>> {
        let [nx, ny, _] = self.grid.dims;
        let columns = (0..ny).flat_map(|y| (0..nx).map(move |x| [x, y, 0]));
        let is_close = |column: Vec3, place: Vec3| (place - column).with_z(0.0).length() <= reach;
        let close = |cell| {
            let column = self.grid.centre(cell);
            places.clone().enumerate().filter(|(_, place)| is_close(column, *place)).map(|(number, _)| number).collect()
        };
        columns.map(close).collect()
    }

    /// Returns the voxels for which `core` gives a value above 0.
    fn voxels_where(&self, core: impl Fn(usize, Vec3, Label) -> f32) -> Vec<LesionVoxel> {
        let decayed = self.grid.cells().enumerate().filter_map(|(index, cell)| {
            let label = self.labels[index];
            let core = if label == Label::AIR { 0.0 } else { core(index, self.grid.centre(cell), label) };
            (core > 0.0).then(|| LesionVoxel { index: self.in_volume(cell), core: core.min(1.0) })
        });
        decayed.collect()
    }
}

/// A point of a groove from which decay spreads.
struct LesionSource {
    bottom: Vec3,
    /// Point below the bottom at which the dentine begins.
    junction: Vec3,
    enamel_depth: f32,
    dentine_depth: f32,
}

fn from_groove(
    lesion_grid: &LesionGrid,
    groove: &Groove,
    lesion: &LesionSpec,
    tissues: &TissueLabels,
    enamel: &[f32],
    pulp: &[f32],
) -> Vec<LesionVoxel> {
    /// Distance between sources, mm: less than the width of a lesion's opening.
    const SOURCE_SPACING: f32 = 0.15;
    let [in_enamel, in_dentine] = lesion.depth.shares();
    let source = |bottom: Vec3| {
        let [enamel_depth, dentine_depth] = lesion_grid.thickness(bottom, Vec3::NEG_Z, tissues, pulp);
        LesionSource { bottom, junction: bottom - Vec3::Z * enamel_depth, enamel_depth, dentine_depth }
    };
    let sources: Vec<LesionSource> = groove.thinned(SOURCE_SPACING).into_iter().map(source).collect();
    // Half-width of the lesion in enamel at the junction.
    let base = 0.5 * if lesion.depth.is_in_dentine() { lesion.spread } else { lesion.spread.min(1.0) };
    let in_enamel_of = |source: &LesionSource, place: Vec3| {
        let below = source.bottom.z - place.z;
        if !(-OPENING_HALF_WIDTH..=in_enamel * source.enamel_depth).contains(&below) {
            return 0.0;
        }
        let share = (below / source.enamel_depth.max(1e-3)).clamp(0.0, 1.0);
        let width = OPENING_HALF_WIDTH + (base - OPENING_HALF_WIDTH).max(0.0) * share;
        1.0 - (place - source.bottom).with_z(0.0).length() / width
    };
    let in_dentine_of = |source: &LesionSource, place: Vec3, depth: f32| {
        // Distance along the junction, which is not horizontal.
        let aside = (place.distance_squared(source.junction) - depth * depth).max(0.0).sqrt();
        1.0 - norm([aside / lesion.spread, depth / (in_dentine * source.dentine_depth)])
    };
    let close = lesion_grid
        .columns_close_to(sources.iter().map(|source| source.bottom), lesion.spread.max(base) + OPENING_HALF_WIDTH);
    lesion_grid.voxels_where(|index, place, label| {
        let all = close[index % close.len()].iter().map(|&number| &sources[number]);
        match label {
            _ if label == tissues.enamel => all.map(|source| in_enamel_of(source, place)).fold(0.0, f32::max),
            _ if label == tissues.dentine && in_dentine > 0.0 => {
                all.map(|source| in_dentine_of(source, place, enamel[index])).fold(0.0, f32::max)
            }
            _ => 0.0,
        }
    })
}

fn through_surface(
    lesion_grid: &LesionGrid,
    patch: &SurfacePatch,
    lesion: &LesionSpec,
    tissues: &TissueLabels,
    enamel: &[f32],
    pulp: &[f32],
) -> Vec<LesionVoxel> {
    let SurfacePatch { at, inward, axes, half } = *patch;
    let [in_enamel, in_dentine] = lesion.depth.shares();
    let [enamel_depth, dentine_depth] = lesion_grid.thickness(at, inward, tissues, pulp);
    let outside = lesion_grid.distances(|label| label == Label::AIR);
    // On a root, the dentine begins at the surface.
    let is_root = enamel_depth <= lesion_grid.grid.spacing.min_element();
    // The search is limited to the near side, since the opposite side of the tooth has its own enamel and air.
    let into = if lesion.depth.is_in_dentine() { dentine_depth + lesion.spread } else { lesion.spread };
    let most = (enamel_depth + into).min(0.5 * lesion_grid.tooth_thickness(at, inward));
    lesion_grid.voxels_where(|index, place, label| {
        let away = place - at;
        if away.dot(inward) > most {
            return 0.0;
        }
        let [u, v] = axes.map(|axis| away.dot(axis));
        // Enamel varies in thickness: a lesion that has penetrated it stops at the dentine.
        let share = outside[index] / enamel_depth.max(1e-3);
        if label == tissues.enamel && (in_enamel >= 1.0 || share <= in_enamel) {
            let narrow = 1.0 - NARROWING * share.min(1.0);
            return 1.0 - norm([u / half[0], v / half[1]]) / narrow;
        }
        if label == tissues.dentine && in_dentine > 0.0 {
            let depth = if is_root { outside[index] } else { enamel[index] };
            let wide = if is_root { half } else { [lesion.spread; 2] };
            return 1.0 - norm([u / wide[0], v / wide[1], depth / (in_dentine * dentine_depth)]);
        }
        0.0
    })
}

fn norm<const N: usize>(parts: [f32; N]) -> f32 {
    parts.iter().map(|part| part * part).sum::<f32>().sqrt()
}
