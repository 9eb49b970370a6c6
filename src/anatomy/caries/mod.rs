//! Caries as it grows: in along a groove or through a smooth surface, and wide under the enamel.
//!
//! In enamel a lesion follows the prisms: from a groove it widens inward, through a smooth surface it narrows. At the junction
//! with dentine it spreads sideways and goes on toward the pulp with its deepest place in the middle (A. Thylstrup and
//! O. Fejerskov, *Textbook of Clinical Cariology*, 1994). How deep is said in the thirds in which radiographs are read.

mod groove;

pub use groove::{Groove, nearest_groove};

use super::Tissues;
use crate::frame::Vec3;
use crate::volume::{Grid, Label, Volume, distance};

/// How deep a lesion has come: radiographic scores of the ICCMS guide (2014).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
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

impl Reach {
    /// Shares of the enamel's and of the dentine's thickness that are decayed.
    fn shares(self) -> [f32; 2] {
        match self {
            Reach::OuterEnamel => [0.5, 0.0],
            Reach::InnerEnamel => [1.0, 0.0],
            Reach::OuterDentine => [1.0, 1.0 / 3.0],
            Reach::MiddleDentine => [1.0, 2.0 / 3.0],
            Reach::InnerDentine => [1.0, 0.9],
        }
    }

    /// Whether dentine is decayed.
    pub fn is_in_dentine(self) -> bool {
        self.shares()[1] > 0.0
    }
}

/// Where a lesion comes in; tooth space, mm.
#[derive(Clone, Debug)]
pub enum Entry {
    /// From the bottom of a groove in the chewing surface.
    Groove(Groove),
    Smooth(Patch),
}

/// A place of a smooth surface, as wide as half axes along two directions of it; tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    pub at: Vec3,
    pub inward: Vec3,
    pub axes: [Vec3; 2],
    pub half: [f32; 2],
}

impl Patch {
    /// The same place with another way in.
    fn aimed(self, inward: Vec3) -> Patch {
        let axes = self.axes.map(|axis| axis.reject_from_normalized(inward).normalize_or(axis));
        Patch { inward, axes, ..self }
    }
}

/// A lesion to be grown.
#[derive(Clone, Debug)]
pub struct Growth {
    pub entry: Entry,
    pub reach: Reach,
    /// How far it has spread to each side along the junction, mm.
    pub spread: f32,
}

/// A voxel of a lesion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decayed {
    /// In the volume's arrays.
    pub index: usize,
    /// From the rim (0) to the core (1).
    pub core: f32,
}

/// Half the width of a lesion where it comes out of a groove, mm.
const MOUTH: f32 = 0.15;

/// How much narrower a lesion through a smooth surface is at the junction than outside.
const NARROWING: f32 = 0.6;

/// Thicker than any dentine between enamel and pulp, mm: for a place under which there is no pulp.
const DENTINE_MOST: f32 = 4.0;

/// The voxels of enamel and dentine that a lesion takes, in array order. `volume` is one tooth, crown up.
pub fn grow(volume: &Volume, tissues: &Tissues, growth: &Growth) -> Vec<Decayed> {
    let near = Near::around(volume, growth);
    if let Entry::Smooth(patch) = &growth.entry
        && let Some(entry) = near.aimed(patch, tissues).map(Entry::Smooth)
    {
        return grow(volume, tissues, &Growth { entry, ..*growth });
    }
    let enamel = near.distances(|label| label == tissues.enamel);
    let pulp = near.distances(|label| label == tissues.pulp);
    match &growth.entry {
        Entry::Groove(groove) => from_groove(&near, groove, growth, tissues, &enamel, &pulp),
        Entry::Smooth(patch) => through_surface(&near, patch, growth, tissues, &enamel, &pulp),
    }
}

/// The part of a volume in which a lesion can lie.
struct Near<'a> {
    volume: &'a Volume,
    grid: Grid,
    first: [u32; 3],
    labels: Vec<Label>,
}

impl<'a> Near<'a> {
    fn around(volume: &'a Volume, growth: &Growth) -> Near<'a> {
        /// What a lesion can be deep, and what its distances look at around it, mm.
        const DEPTH: f32 = 9.0;
        const AROUND: f32 = 1.5;
        let (low, high) = match &growth.entry {
            Entry::Groove(groove) => {
                let reach = Vec3::new(1.0, 1.0, 0.0) * (growth.spread + AROUND) + Vec3::Z * AROUND;
                let (low, high) = groove.extent();
                (low - reach - Vec3::Z * DEPTH, high + reach)
            }
            Entry::Smooth(Patch { at, inward, half, .. }) => {
                let side = half[0].max(half[1]).max(growth.spread) + AROUND;
                let end = *at + *inward * DEPTH;
                (at.min(end) - side, at.max(end) + side)
            }
        };
        let ranges = volume.grid().cells_within(low, high);
        let first = [0, 1, 2].map(|axis| ranges[axis].start);
        let dims = [0, 1, 2].map(|axis| ranges[axis].end - ranges[axis].start);
        let grid = Grid { dims, spacing: volume.grid().spacing, origin: volume.grid().centre(first) };
        let mut near = Near { volume, grid, first, labels: Vec::new() };
        near.labels = near.grid.cells().map(|cell| volume.tissue(near.in_volume(cell))).collect();
        near
    }

    fn in_volume(&self, cell: [u32; 3]) -> usize {
        self.volume.grid().index([0, 1, 2].map(|axis| cell[axis] + self.first[axis]))
    }

    /// mm from every voxel to the nearest of a tissue.
    fn distances(&self, is_of: impl Fn(Label) -> bool) -> Vec<f32> {
        distance::to_set(&self.grid, |index| is_of(self.labels[index]))
    }

    fn label_at(&self, place: Vec3) -> Option<Label> {
        self.grid.nearest(place).map(|cell| self.labels[self.grid.index(cell)])
    }

    /// Half a voxel: how finely ways through the tooth are walked, mm.
    fn step(&self) -> f32 {
        0.5 * self.grid.spacing.min_element()
    }

    /// After how many steps from a place of the surface inward matter begins, and where from there on a run of labels ends.
    fn run(&self, from: Vec3, inward: Vec3, is_in: impl Fn(Label) -> bool) -> [u32; 2] {
        let label = |i: u32| self.label_at(from + inward * (i as f32 * self.step()));
        // A place on the surface may lie half a voxel outside.
        let begin = (0..6).find(|&i| label(i).is_some_and(|label| label != Label::AIR)).unwrap_or(0);
        [begin, (begin..).find(|&i| !label(i).is_some_and(&is_in)).unwrap_or(begin)]
    }

    /// How thick the enamel is from a place of the surface inward, mm, and how thick the dentine from there to the pulp.
    fn thickness(&self, from: Vec3, inward: Vec3, tissues: &Tissues, pulp: &[f32]) -> [f32; 2] {
        let [begin, end] = self.run(from, inward, |label| label == tissues.enamel);
        let junction = self.grid.nearest(from + inward * (end as f32 * self.step()));
        let to_pulp = junction.map_or(DENTINE_MOST, |cell| pulp[self.grid.index(cell)]);
        [(end - begin) as f32 * self.step(), to_pulp.min(DENTINE_MOST)]
    }

    /// The nearest place of a tissue.
    fn nearest_of(&self, from: Vec3, tissue: Label) -> Option<Vec3> {
        let cells = self.grid.cells().zip(&self.labels).filter(|(_, label)| **label == tissue);
        let places = cells.map(|(cell, _)| self.grid.centre(cell));
        places.min_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
    }

    /// A patch with the shortest way to the dentine, where its own way in runs along the enamel: prisms stand about square on
    /// the dentine.
    fn aimed(&self, patch: &Patch, tissues: &Tissues) -> Option<Patch> {
        /// So many times as much enamel as on the shortest way, and so much more, mm, is along it.
        const ASTRAY: [f32; 2] = [1.5, 0.5];
        let [begin, end] = self.run(patch.at, patch.inward, |label| label == tissues.enamel);
        let shortest = self.nearest_of(patch.at, tissues.dentine)? - patch.at;
        let is_astray = (end - begin) as f32 * self.step() > ASTRAY[0] * shortest.length() + ASTRAY[1];
        let aimed = patch.aimed(shortest.try_normalize()?);
        // Not twice: what lies nearest cannot be aimed at any better.
        (is_astray && aimed.inward.dot(patch.inward) < 0.99).then_some(aimed)
    }

    /// How thick the tooth is from a place of its surface inward, mm.
    fn through(&self, from: Vec3, inward: Vec3) -> f32 {
        self.run(from, inward, |label| label != Label::AIR)[1] as f32 * self.step()
    }

    /// Which places each column lies near to as seen from above, x fastest.
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

    /// The voxels for which `core` gives a value above 0.
    fn decayed(&self, core: impl Fn(usize, Vec3, Label) -> f32) -> Vec<Decayed> {
        let decayed = self.grid.cells().enumerate().filter_map(|(index, cell)| {
            let label = self.labels[index];
            let core = if label == Label::AIR { 0.0 } else { core(index, self.grid.centre(cell), label) };
            (core > 0.0).then(|| Decayed { index: self.in_volume(cell), core: core.min(1.0) })
        });
        decayed.collect()
    }
}

/// A place of a groove from which decay goes on.
struct Source {
    bottom: Vec3,
    /// Under it, where the dentine begins.
    junction: Vec3,
    enamel_depth: f32,
    dentine_depth: f32,
}

fn from_groove(
    near: &Near,
    groove: &Groove,
    growth: &Growth,
    tissues: &Tissues,
    enamel: &[f32],
    pulp: &[f32],
) -> Vec<Decayed> {
    /// Between places that are looked at, mm: less than a lesion's mouth is wide.
    const APART: f32 = 0.15;
    let [in_enamel, in_dentine] = growth.reach.shares();
    let source = |bottom: Vec3| {
        let [enamel_depth, dentine_depth] = near.thickness(bottom, Vec3::NEG_Z, tissues, pulp);
        Source { bottom, junction: bottom - Vec3::Z * enamel_depth, enamel_depth, dentine_depth }
    };
    let sources: Vec<Source> = groove.thinned(APART).into_iter().map(source).collect();
    // Half the width that it has at the junction.
    let base = 0.5 * if growth.reach.is_in_dentine() { growth.spread } else { growth.spread.min(1.0) };
    let in_enamel_of = |source: &Source, place: Vec3| {
        let below = source.bottom.z - place.z;
        if !(-MOUTH..=in_enamel * source.enamel_depth).contains(&below) {
            return 0.0;
        }
        let share = (below / source.enamel_depth.max(1e-3)).clamp(0.0, 1.0);
        let width = MOUTH + (base - MOUTH).max(0.0) * share;
        1.0 - (place - source.bottom).with_z(0.0).length() / width
    };
    let in_dentine_of = |source: &Source, place: Vec3, depth: f32| {
        // Along the junction, which is not level.
        let aside = (place.distance_squared(source.junction) - depth * depth).max(0.0).sqrt();
        1.0 - norm([aside / growth.spread, depth / (in_dentine * source.dentine_depth)])
    };
    let close = near.columns_close_to(sources.iter().map(|source| source.bottom), growth.spread.max(base) + MOUTH);
    near.decayed(|index, place, label| {
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
    near: &Near,
    patch: &Patch,
    growth: &Growth,
    tissues: &Tissues,
    enamel: &[f32],
    pulp: &[f32],
) -> Vec<Decayed> {
    let Patch { at, inward, axes, half } = *patch;
    let [in_enamel, in_dentine] = growth.reach.shares();
    let [enamel_depth, dentine_depth] = near.thickness(at, inward, tissues, pulp);
    let outside = near.distances(|label| label == Label::AIR);
    // On a root the dentine begins at the surface.
    let is_root = enamel_depth <= near.grid.spacing.min_element();
    // The other side of the tooth has enamel and air of its own.
    let into = if growth.reach.is_in_dentine() { dentine_depth + growth.spread } else { growth.spread };
    let most = (enamel_depth + into).min(0.5 * near.through(at, inward));
    near.decayed(|index, place, label| {
        let away = place - at;
        if away.dot(inward) > most {
            return 0.0;
        }
        let [u, v] = axes.map(|axis| away.dot(axis));
        // Enamel is not equally thick: what has come through it stops at the dentine, wherever that is.
        let share = outside[index] / enamel_depth.max(1e-3);
        if label == tissues.enamel && (in_enamel >= 1.0 || share <= in_enamel) {
            let narrow = 1.0 - NARROWING * share.min(1.0);
            return 1.0 - norm([u / half[0], v / half[1]]) / narrow;
        }
        if label == tissues.dentine && in_dentine > 0.0 {
            let depth = if is_root { outside[index] } else { enamel[index] };
            let wide = if is_root { half } else { [growth.spread; 2] };
            return 1.0 - norm([u / wide[0], v / wide[1], depth / (in_dentine * dentine_depth)]);
        }
        0.0
    })
}

fn norm<const N: usize>(parts: [f32; N]) -> f32 {
    parts.iter().map(|part| part * part).sum::<f32>().sqrt()
}
