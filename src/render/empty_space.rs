//! Empty-space skipping: the distance from each brick to the nearest one that may be visible.

use super::scene::RenderMode;
use super::transfer_function::TransferFunction;
use typodont_core::parallel::par_map;
use typodont_core::volume::{BRICK, ISO, Label, Volume};

/// Densities and labels that rays through a brick can sample. Cells of a brick interpolate with the first voxels of
/// the next bricks, so these count too.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BrickSummary {
    min: u8,
    max: u8,
    /// One bit per label modulo 64.
    labels: u64,
    /// True when all voxels have the same density and the same label.
    is_uniform: bool,
    /// Labels of its matter, [`Label::AIR`] in unused places; `None` if there are more.
    tissues: Option<[Label; MAX_TISSUES]>,
}

/// Number of labels in a brick up to which it can be marked as [`ONE_TISSUE`], if they look alike.
const MAX_TISSUES: usize = 4;

/// Entry of a brick for rays, as the shaders read it: a distance in bricks, [`UNIFORM`] or [`ONE_TISSUE`]; and the label that
/// goes with the latter.
pub type BrickEntry = [u8; 2];

/// Distance (Chebyshev, in bricks) from each brick to the nearest one that may be visible; 0 for visible bricks.
///
/// A visible brick may be marked as [`UNIFORM`], where all samples are equal, or as [`ONE_TISSUE`], where all matter looks
/// alike.
///
/// After a change, the entries of the changed bricks and of all bricks that are now closer to a visible one are
/// exact. Where matter vanished, distances stay too small, which costs a little time but never a pixel.
#[derive(Clone, Debug)]
pub struct EmptySpaceMap {
    dims: [u32; 3],
    summaries: Vec<BrickSummary>,
    entries: Vec<BrickEntry>,
    mode: RenderMode,
    /// In direct volume rendering, what its transfer function shows.
    visible: Option<VisibleDensities>,
}

/// Maximum distance stored: 15 bricks are 120 voxels, which is a sufficient skip.
const MAX_DISTANCE: u8 = 15;

/// Marks a visible brick that, in direct volume rendering, gives the same sample everywhere. In step with `EVEN` in
/// `tooth.wgsl`.
pub const UNIFORM: u8 = 0x80;

/// Marks a visible brick whose matter has one label, or labels that look alike, in direct volume rendering: no labels need to
/// be mixed there. A brick with an empty place is marked only if the transfer function shows nothing in such places. In step
/// with `ONE_TISSUE` in `tooth.wgsl`.
pub const ONE_TISSUE: u8 = 0x40;

impl EmptySpaceMap {
    pub fn new(volume: &Volume, mode: &RenderMode) -> EmptySpaceMap {
        let summaries: Vec<BrickSummary> = par_map(volume.bricks().len(), |brick| summarize(volume, brick));
        let (dims, entries, mode, visible) = (volume.bricks().dims(), Vec::new(), mode.clone(), None);
        let mut map = EmptySpaceMap { dims, summaries, entries, mode, visible };
        map.rebuild();
        map
    }

    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    /// Entries of the bricks, x fastest.
    pub fn entries(&self) -> &[BrickEntry] {
        &self.entries
    }

    /// Changes the render mode. Returns `true` when the mode differs from the previous one.
    pub fn set_mode(&mut self, mode: &RenderMode) -> bool {
        let differs = self.mode != *mode;
        if differs {
            self.mode = mode.clone();
            self.rebuild();
        }
        differs
    }

    /// Summarizes changed bricks again, and those whose cells reach into them. Returns the entries that changed,
    /// ascending. After [`Volume::relabel`], which reports no changed bricks, the map must be made anew.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        let mut differing = Vec::new();
        for brick in with_neighbours(volume, changed) {
            self.summaries[brick] = summarize(volume, brick);
            let is_visible = self.is_visible(brick);
            if is_visible && distance(self.entries[brick]) > 0 {
                self.lower_distances_around(volume, brick, &mut differing);
            }
            let entry = match (is_visible, self.entries[brick]) {
                (true, _) => self.entry_for(brick),
                (false, known) if distance(known) == 0 => [1, 0],
                (false, known) => known,
            };
            if self.entries[brick] != entry {
                self.entries[brick] = entry;
                differing.push(brick);
            }
        }
        differing.sort_unstable();
        differing.dedup();
        differing
    }

    fn rebuild(&mut self) {
        self.visible = match &self.mode {
            RenderMode::Volume(function) => Some(VisibleDensities::new(function)),
            _ => None,
        };
        let bricks = 0..self.summaries.len();
        let mut distances: Vec<u8> =
            bricks.clone().map(|brick| if self.is_visible(brick) { 0 } else { MAX_DISTANCE }).collect();
        for axis in 0..3 {
            spread_along_axis(&mut distances, self.dims, axis);
        }
        let entry = |brick: usize| match distances[brick] {
            0 => self.entry_for(brick),
            distance => [distance, 0],
        };
        self.entries = bricks.map(entry).collect();
    }

    /// Returns the entry of a visible brick.
    fn entry_for(&self, brick: usize) -> BrickEntry {
        let (summary, Some(visible)) = (&self.summaries[brick], &self.visible) else { return [0; 2] };
        let has_one_density = summary.min == summary.max;
        match visible.sole_tissue(summary) {
            Some(_) if has_one_density => [UNIFORM, 0],
            _ if summary.is_uniform => [UNIFORM, 0],
            Some(Label(label)) => [ONE_TISSUE, label],
            None => [0; 2],
        }
    }

    fn is_visible(&self, brick: usize) -> bool {
        match &self.visible {
            Some(visible) => visible.any(&self.summaries[brick]),
            None => is_solid(&self.summaries[brick]),
        }
    }

    /// Lowers the distances around a brick that became visible.
    fn lower_distances_around(&mut self, volume: &Volume, brick: usize, differing: &mut Vec<usize>) {
        let at = volume.bricks().corner(brick).map(|c| c / BRICK);
        let reach = u32::from(MAX_DISTANCE);
        let span = |a: usize| at[a].saturating_sub(reach)..=(at[a] + reach).min(self.dims[a] - 1);
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let distance = [x, y, z].iter().zip(at).map(|(v, a)| v.abs_diff(a)).max().unwrap_or(0) as u8;
                    let index = volume.bricks().index([x, y, z]);
                    if self::distance(self.entries[index]) > distance {
                        self.entries[index] = [distance, 0];
                        differing.push(index);
                    }
                }
            }
        }
    }
}

/// Returns the distance in bricks to the nearest brick that may be visible; 0 for a marked brick.
pub fn distance([code, _]: BrickEntry) -> u8 {
    code & !(UNIFORM | ONE_TISSUE)
}

fn is_solid(content: &BrickSummary) -> bool {
    f32::from(content.max) / 255.0 >= ISO
}

/// Densities that a transfer function makes visible, by label.
#[derive(Clone, Debug)]
struct VisibleDensities {
    /// Per label and index: the number of densities below the index that have opacity.
    opaque_counts: Vec<[u16; 257]>,
    /// True if a label has opacity where there is no matter.
    shows_empty_space: bool,
    /// For each label, the first that looks like it.
    alike: [Label; 256],
}

impl VisibleDensities {
    fn new(function: &TransferFunction) -> VisibleDensities {
        let count = |label: u8| {
            let table = function.table(Label(label));
            let mut counts = [0; 257];
            for d in 0..256 {
                counts[d + 1] = counts[d] + u16::from(table[d][3] > 0);
            }
            counts
        };
        let opaque_counts: Vec<[u16; 257]> = (0..=255).map(count).collect();
        let shows_empty_space = opaque_counts.iter().any(|counts| counts[1] > 0);
        VisibleDensities { opaque_counts, shows_empty_space, alike: function.alike_labels() }
    }

    fn any(&self, content: &BrickSummary) -> bool {
        let (least, most) = (usize::from(content.min), usize::from(content.max));
        let has = |label: usize| content.labels >> (label % 64) & 1 == 1;
        (0..256).any(|label| has(label) && self.opaque_counts[label][most + 1] > self.opaque_counts[label][least])
    }

    /// Returns the label that stands for all matter of a brick, if none of its samples needs another.
    fn sole_tissue(&self, summary: &BrickSummary) -> Option<Label> {
        // Empty places show the label of air, unless nothing is shown there.
        let tissues = summary.tissues.filter(|_| summary.min > 0 || !self.shows_empty_space)?;
        let mut looks =
            tissues.iter().filter(|&&label| label != Label::AIR).map(|label| self.alike[usize::from(label.0)]);
        let first = looks.next()?;
        looks.all(|look| look == first).then_some(first)
    }
}

/// Adds a label to a list that ends with [`Label::AIR`]; `None` if it is full.
fn with_label(tissues: [Label; MAX_TISSUES], label: Label) -> Option<[Label; MAX_TISSUES]> {
    let place = tissues.iter().position(|&known| known == label || known == Label::AIR)?;
    let mut more = tissues;
    more[place] = label;
    Some(more)
}

/// Returns the changed bricks and the ones before them along each axis, whose cells reach into them.
fn with_neighbours(volume: &Volume, changed: &[usize]) -> Vec<usize> {
    let bricks = volume.bricks();
    let mut all: Vec<usize> = Vec::with_capacity(changed.len() * 8);
    for &brick in changed {
        let at = bricks.corner(brick).map(|c| c / BRICK);
        all.extend((0..8u32).map(|n| bricks.index(std::array::from_fn(|a| at[a].saturating_sub(n >> a & 1)))));
    }
    all.sort_unstable();
    all.dedup();
    all
}

fn summarize(volume: &Volume, brick: usize) -> BrickSummary {
    let grid = volume.grid();
    let corner = volume.bricks().corner(brick);
    let end: [u32; 3] = std::array::from_fn(|a| (corner[a] + BRICK + 1).min(grid.dims[a]));
    // Space beyond the grid is empty and is interpolated with the first and the last voxels.
    let at_border = (0..3).any(|a| corner[a] == 0 || corner[a] + BRICK >= grid.dims[a]);
    let mut summary = BrickSummary {
        min: if at_border { 0 } else { u8::MAX },
        max: 0,
        labels: u64::from(at_border),
        is_uniform: false,
        tissues: Some([Label::AIR; MAX_TISSUES]),
    };
    let mut last_tissue = Label::AIR;
    let first_label = volume.labels()[grid.index(corner)];
    let mut is_one_label = !at_border || first_label == Label::AIR;
    for z in corner[2]..end[2] {
        for y in corner[1]..end[1] {
            let first = grid.index([corner[0], y, z]);
            let row = first..first + (end[0] - corner[0]) as usize;
            for density in &volume.densities()[row.clone()] {
                summary.min = summary.min.min(density.bits());
                summary.max = summary.max.max(density.bits());
            }
            let labels = &volume.labels()[row];
            summary.labels |= labels.iter().fold(0, |all, l| all | 1u64 << (l.0 % 64));
            is_one_label &= labels.iter().all(|&label| label == first_label);
            // Most rows hold nothing but the tissue before.
            if labels.iter().any(|&label| label != last_tissue && label != Label::AIR) {
                for &label in labels.iter().filter(|&&label| label != Label::AIR) {
                    summary.tissues = summary.tissues.and_then(|tissues| with_label(tissues, label));
                    last_tissue = label;
                }
            }
        }
    }
    summary.is_uniform = is_one_label && summary.min == summary.max;
    summary
}

/// Extends distances within planes perpendicular to an axis to distances in space: the larger of the distance along
/// the axis and the distance within the plane counts.
fn spread_along_axis(distances: &mut [u8], dims: [u32; 3], axis: usize) {
    let [nx, ny, nz] = dims.map(|n| n as usize);
    let stride = [1, nx, nx * ny][axis];
    let length = [nx, ny, nz][axis];
    let mut line = vec![0u8; length];
    for start in (0..distances.len()).filter(|i| i / stride % length == 0) {
        for (i, value) in line.iter_mut().enumerate() {
            *value = distances[start + i * stride];
        }
        for i in 0..length {
            let mut nearest = line[i];
            for offset in (1..MAX_DISTANCE).take_while(|offset| usize::from(*offset) < length) {
                if offset >= nearest {
                    break;
                }
                let [before, after] = [i.checked_sub(usize::from(offset)), Some(i + usize::from(offset))];
                for there in [before, after].into_iter().flatten().filter_map(|j| line.get(j)) {
                    nearest = nearest.min(offset.max(*there));
                }
            }
            distances[start + i * stride] = nearest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom;
    use std::sync::Arc;
    use typodont_core::frame::Vec3;
    use typodont_core::volume::Voxel;

    fn ball() -> Volume {
        phantom::ball([70, 64, 60], Vec3::splat(0.2), 4.0)
    }

    #[test]
    fn no_brick_within_the_stored_distance_is_visible() {
        // Aim: skipping a cube of bricks skips no surface. Method: compare with a search over all bricks.
        let volume = ball();
        let empty = EmptySpaceMap::new(&volume, &RenderMode::Iso);
        let at = |b: usize| volume.bricks().corner(b).map(|c| c / BRICK);
        let solid: Vec<usize> = (0..empty.entries.len()).filter(|&b| empty.summaries[b].max > 127).collect();
        for brick in 0..empty.entries.len() {
            let apart = |&o: &usize| (0..3).map(|a| at(brick)[a].abs_diff(at(o)[a])).max().unwrap();
            let nearest = solid.iter().map(apart).min().unwrap() as u8;
            assert_eq!(empty.entries[brick], [nearest.min(MAX_DISTANCE), 0], "brick {brick}");
        }
    }

    #[test]
    fn a_brick_is_marked_where_all_samples_or_their_labels_are_the_same() {
        // Aim: one sample stands for a whole uniform brick, and one label for all matter of a brick of one tissue. Method:
        // compute the entries of a ball of two tissues, then check every voxel of each visible brick's cells.
        let mut volume = phantom::ball([96; 3], Vec3::splat(0.2), 8.0);
        let middle = volume.grid().cell(volume.grid().len() / 2)[2];
        let cells: Vec<u32> = volume.grid().cells().map(|[_, _, z]| z).collect();
        volume.relabel(|index, label| if cells[index] < middle { Label(65) } else { label });
        let all = super::super::transfer_function::table([1.0; 3], |d| d);
        let half = super::super::transfer_function::table([1.0; 3], |d| 0.5 * d);
        let function = TransferFunction::single_table(all, 0.2, 0.0).with_table([Label(65)], half);
        let alike = function.alike_labels();
        let mode = RenderMode::Volume(Arc::new(function));
        let empty = EmptySpaceMap::new(&volume, &mode);
        let dims = volume.grid().dims;
        for (brick, entry) in empty.entries.iter().enumerate() {
            let corner = volume.bricks().corner(brick);
            let voxel = |n: u32| {
                let step = [n % 9, n / 9 % 9, n / 81];
                volume.voxel(volume.grid().index(std::array::from_fn(|a| (corner[a] + step[a]).min(dims[a] - 1))))
            };
            let is_same =
                (0..729).all(|n| voxel(n) == voxel(0)) && voxel(0).density > typodont_core::volume::Density::EMPTY;
            assert_eq!(entry[0] == UNIFORM, is_same, "brick {brick}");
            let mut tissues: Vec<Label> =
                (0..729).map(|n| voxel(n).label).filter(|&label| label != Label::AIR).collect();
            tissues.sort_by_key(|label| label.0);
            tissues.dedup();
            if distance(*entry) == 0 && !is_same {
                let is_alone = matches!(tissues[..], [_]);
                let look = tissues.first().map_or(0, |tissue| alike[usize::from(tissue.0)].0);
                assert_eq!(*entry, if is_alone { [ONE_TISSUE, look] } else { [0; 2] }, "brick {brick}");
            }
        }
        for code in [UNIFORM, ONE_TISSUE, 0] {
            assert!(empty.entries.iter().filter(|e| e[0] == code).count() > 10, "{code}");
        }

        // Decay that looks like the tissue around it changes no mark.
        volume.relabel(|index, label| if label == Label(65) || index % 7 > 0 { label } else { Label(66) });
        assert!(EmptySpaceMap::new(&volume, &mode).entries == empty.entries);
    }

    #[test]
    fn after_a_cut_no_visible_brick_is_skipped() {
        // Aim: a transfer function that shows only medium densities shows the new walls inside. Method: cut, update,
        // compare with a map computed anew.
        let mut volume = ball();
        let shell =
            super::super::transfer_function::table([1.0; 3], |d| if (0.2..0.8).contains(&d) { 0.5 } else { 0.0 });
        let function = TransferFunction::single_table(shell, 0.2, 0.0);
        for shown in [RenderMode::Iso, RenderMode::Volume(Arc::new(function))] {
            let mut empty = EmptySpaceMap::new(&volume, &shown);
            for z in 20..40 {
                let index = volume.grid().index([35, 32, z]);
                volume.set(index, Voxel::AIR);
            }
            let changed = volume.take_dirty();
            let differing = empty.update(&volume, &changed);
            let anew = EmptySpaceMap::new(&volume, &shown);
            assert!(empty.entries.iter().zip(&anew.entries).all(|(now, exact)| distance(*now) <= distance(*exact)));
            let marked = |empty: &EmptySpaceMap| -> Vec<BrickEntry> {
                empty.entries.iter().map(|&[code, label]| [code & (UNIFORM | ONE_TISSUE), label]).collect()
            };
            assert_eq!(marked(&empty), marked(&anew));
            assert!(empty.summaries == anew.summaries);
            assert!(differing.len() < 60, "{} entries for a few bricks", differing.len());
        }
    }

    #[test]
    fn after_a_change_of_tissue_every_mark_is_as_made_anew() {
        // Aim: no brick keeps the label of tissue that is gone, and every changed entry is named for the adapter. Method: a
        // ball of two tissues with tables of their own; cut through both, and a third placed in two spots.
        let mut volume = phantom::ball([96; 3], Vec3::splat(0.2), 8.0);
        let middle = volume.grid().dims[2] / 2;
        let heights: Vec<u32> = volume.grid().cells().map(|[_, _, z]| z).collect();
        volume.relabel(|index, label| if heights[index] < middle { Label(2) } else { label });
        let ramp = |share: f32| super::super::transfer_function::table([1.0; 3], move |d| share * d);
        let function = TransferFunction::single_table(ramp(0.1), 0.2, 0.0)
            .with_table([Label(2)], ramp(0.2))
            .with_table([Label(3)], ramp(0.3));
        let mode = RenderMode::Volume(Arc::new(function));
        let mut map = EmptySpaceMap::new(&volume, &mode);
        let before = map.entries.clone();
        let full = Voxel { density: typodont_core::volume::Density::FULL, label: Label(3) };
        for z in 30..66 {
            for [x, y] in [[48, 48], [49, 48], [50, 49]] {
                let index = volume.grid().index([x, y, z]);
                volume.set(index, Voxel::AIR);
            }
            for x in [30, 62] {
                let index = volume.grid().index([x, 40, z]);
                volume.set(index, Voxel::AIR);
                volume.set(index, full);
            }
        }
        let changed = volume.take_dirty();
        let differing = map.update(&volume, &changed);
        let anew = EmptySpaceMap::new(&volume, &mode);
        let is_marked = |entry: &BrickEntry| entry[0] & (UNIFORM | ONE_TISSUE) != 0;
        for (brick, (now, exact)) in map.entries.iter().zip(&anew.entries).enumerate() {
            assert!(now == exact || !is_marked(now) && !is_marked(exact), "brick {brick}: {now:?}, not {exact:?}");
            assert_eq!(differing.contains(&brick), before[brick] != *now, "brick {brick}");
        }
        assert!(differing.len() > 10);
    }
}
