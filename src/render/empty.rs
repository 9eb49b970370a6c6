//! Where rays find nothing to see: per brick, how far the nearest one is that may hold something.

use super::scene::Shown;
use super::transfer::TransferFunction;
use crate::volume::rows::each;
use crate::volume::{BRICK, ISO, Label, Volume};

/// What rays through a brick can meet. A brick's cells mix its voxels with the next bricks' first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Content {
    least: u8,
    most: u8,
    /// One bit per label modulo 64.
    labels: u64,
    /// True when there is but one density and one label.
    is_even: bool,
}

/// Steps (Chebyshev) from each brick to the nearest that may show something; 0 for those that may.
///
/// An entry may bear [`EVEN`]: all samples in that brick are one.
///
/// After a change a brick's own entry and those it can have come nearer to are right at once. Where something vanished,
/// distances stay as they were, too small, which costs a little time and never a pixel.
#[derive(Clone, Debug)]
pub struct Empty {
    dims: [u32; 3],
    content: Vec<Content>,
    entries: Vec<u8>,
    shown: Shown,
}

/// The farthest distance told apart: 15 bricks are 120 voxels, a leap long enough.
const FAR: u8 = 15;

/// Marks a brick that shows something and, where matter is blended, the same wherever it is sampled. In step with `tooth.wgsl`.
pub const EVEN: u8 = 0x80;

impl Empty {
    pub fn of(volume: &Volume, shown: &Shown) -> Empty {
        let content: Vec<Content> = each(volume.bricks().len(), |brick| content(volume, brick));
        let mut empty = Empty { dims: volume.bricks().dims(), content, entries: Vec::new(), shown: shown.clone() };
        empty.measure();
        empty
    }

    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    /// One entry per brick, x fastest: steps, or [`EVEN`].
    pub fn entries(&self) -> &[u8] {
        &self.entries
    }

    /// Shows the volume another way; `true` when that made any difference.
    pub fn show(&mut self, shown: &Shown) -> bool {
        let differs = self.shown != *shown;
        if differs {
            self.shown = shown.clone();
            self.measure();
        }
        differs
    }

    /// Looks again at bricks whose voxels changed and at those that share them. Gives the entries that now differ, ascending.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        let mut differing = Vec::new();
        for brick in with_sharing(volume, changed) {
            self.content[brick] = content(volume, brick);
            let shows = self.shows(brick);
            if shows && steps(self.entries[brick]) > 0 {
                self.announce(volume, brick, &mut differing);
            }
            let entry = match (shows, self.entries[brick]) {
                (true, _) => self.mark(brick),
                (false, 0 | EVEN) => 1,
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

    fn measure(&mut self) {
        let shows: Vec<bool> = match &self.shown {
            Shown::Volume(function) => {
                let visible = Visible::of(function);
                self.content.iter().map(|c| visible.any(c)).collect()
            }
            _ => self.content.iter().map(is_solid).collect(),
        };
        self.entries = shows.into_iter().map(|s| if s { 0 } else { FAR }).collect();
        for axis in 0..3 {
            widen(&mut self.entries, self.dims, axis);
        }
        for brick in 0..self.entries.len() {
            if self.entries[brick] == 0 {
                self.entries[brick] = self.mark(brick);
            }
        }
    }

    /// The entry of a brick that shows something.
    fn mark(&self, brick: usize) -> u8 {
        match self.shown {
            Shown::Volume(_) if self.content[brick].is_even => EVEN,
            _ => 0,
        }
    }

    fn shows(&self, brick: usize) -> bool {
        match &self.shown {
            Shown::Volume(function) => Visible::of(function).any(&self.content[brick]),
            _ => is_solid(&self.content[brick]),
        }
    }

    /// A brick came to show something: those around are now at most so many steps away.
    fn announce(&mut self, volume: &Volume, brick: usize, differing: &mut Vec<usize>) {
        let at = volume.bricks().corner(brick).map(|c| c / BRICK);
        let reach = u32::from(FAR);
        let span = |a: usize| at[a].saturating_sub(reach)..=(at[a] + reach).min(self.dims[a] - 1);
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let steps = [x, y, z].iter().zip(at).map(|(v, a)| v.abs_diff(a)).max().unwrap_or(0) as u8;
                    let index = volume.bricks().index([x, y, z]);
                    if self::steps(self.entries[index]) > steps {
                        self.entries[index] = steps;
                        differing.push(index);
                    }
                }
            }
        }
    }
}

/// Bricks to the nearest that may show something, by an entry.
pub fn steps(entry: u8) -> u8 {
    entry & !EVEN
}

fn is_solid(content: &Content) -> bool {
    f32::from(content.most) / 255.0 >= ISO
}

/// Which densities of which labels a transfer function shows at all.
struct Visible {
    /// Per label: how many of the densities below an entry have opacity.
    shown: Vec<[u16; 257]>,
}

impl Visible {
    fn of(function: &TransferFunction) -> Visible {
        let count = |label: u8| {
            let table = function.table(Label(label));
            let mut shown = [0; 257];
            for d in 0..256 {
                shown[d + 1] = shown[d] + u16::from(table[d][3] > 0);
            }
            shown
        };
        Visible { shown: (0..=255).map(count).collect() }
    }

    fn any(&self, content: &Content) -> bool {
        let (least, most) = (usize::from(content.least), usize::from(content.most));
        let has = |label: usize| content.labels >> (label % 64) & 1 == 1;
        (0..256).any(|label| has(label) && self.shown[label][most + 1] > self.shown[label][least])
    }
}

/// Those bricks and the ones before them along each axis, whose cells reach into them.
fn with_sharing(volume: &Volume, changed: &[usize]) -> Vec<usize> {
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

fn content(volume: &Volume, brick: usize) -> Content {
    let grid = volume.grid();
    let corner = volume.bricks().corner(brick);
    let end: [u32; 3] = std::array::from_fn(|a| (corner[a] + BRICK + 1).min(grid.dims[a]));
    // Space beyond the grid is empty, and mixes with the first and the last voxels.
    let at_border = (0..3).any(|a| corner[a] == 0 || corner[a] + BRICK >= grid.dims[a]);
    let mut found =
        Content { least: if at_border { 0 } else { u8::MAX }, most: 0, labels: u64::from(at_border), is_even: false };
    let of_first = volume.labels()[grid.index(corner)];
    let mut is_one_label = !at_border || of_first == Label::AIR;
    for z in corner[2]..end[2] {
        for y in corner[1]..end[1] {
            let first = grid.index([corner[0], y, z]);
            let row = first..first + (end[0] - corner[0]) as usize;
            for density in &volume.densities()[row.clone()] {
                found.least = found.least.min(density.bits());
                found.most = found.most.max(density.bits());
            }
            let labels = &volume.labels()[row];
            found.labels |= labels.iter().fold(0, |all, l| all | 1u64 << (l.0 % 64));
            is_one_label &= labels.iter().all(|&label| label == of_first);
        }
    }
    found.is_even = is_one_label && found.least == found.most;
    found
}

/// Turns distances within planes across an axis into distances within space: the farther of both ways counts.
fn widen(steps: &mut [u8], dims: [u32; 3], axis: usize) {
    let [nx, ny, nz] = dims.map(|n| n as usize);
    let stride = [1, nx, nx * ny][axis];
    let length = [nx, ny, nz][axis];
    let mut line = vec![0u8; length];
    for start in (0..steps.len()).filter(|i| i / stride % length == 0) {
        for (i, value) in line.iter_mut().enumerate() {
            *value = steps[start + i * stride];
        }
        for i in 0..length {
            let mut nearest = line[i];
            for way in (1..FAR).take_while(|way| usize::from(*way) < length) {
                if way >= nearest {
                    break;
                }
                let [before, after] = [i.checked_sub(usize::from(way)), Some(i + usize::from(way))];
                for there in [before, after].into_iter().flatten().filter_map(|j| line.get(j)) {
                    nearest = nearest.min(way.max(*there));
                }
            }
            steps[start + i * stride] = nearest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;
    use crate::volume::{Voxel, phantom};
    use std::sync::Arc;

    fn ball() -> Volume {
        phantom::ball([70, 64, 60], Vec3::splat(0.2), 4.0)
    }

    #[test]
    fn no_brick_within_a_leap_shows_anything() {
        // Aim: leaping over a cube of bricks skips no surface. Method: compare with a search over all bricks.
        let volume = ball();
        let empty = Empty::of(&volume, &Shown::Iso);
        let at = |b: usize| volume.bricks().corner(b).map(|c| c / BRICK);
        let solid: Vec<usize> = (0..empty.entries.len()).filter(|&b| empty.content[b].most > 127).collect();
        for brick in 0..empty.entries.len() {
            let apart = |&o: &usize| (0..3).map(|a| at(brick)[a].abs_diff(at(o)[a])).max().unwrap();
            let nearest = solid.iter().map(apart).min().unwrap() as u8;
            assert_eq!(empty.entries[brick], nearest.min(FAR), "brick {brick}");
        }
    }

    #[test]
    fn a_brick_is_even_where_every_sample_is_the_same() {
        // Aim: one look stands for a brick. Method: ask for the marks of a ball of two tissues, then look at each voxel of the cells.
        let mut volume = phantom::ball([96; 3], Vec3::splat(0.2), 8.0);
        let middle = volume.grid().cell(volume.grid().len() / 2)[2];
        let cells: Vec<u32> = volume.grid().cells().map(|[_, _, z]| z).collect();
        volume.relabel(|index, label| if cells[index] < middle { Label(65) } else { label });
        let all = super::super::transfer::table([1.0; 3], |d| d);
        let empty = Empty::of(&volume, &Shown::Volume(Arc::new(TransferFunction::plain(all, 0.2, 0.0))));
        let dims = volume.grid().dims;
        for (brick, entry) in empty.entries.iter().enumerate() {
            let corner = volume.bricks().corner(brick);
            let voxel = |n: u32| {
                let step = [n % 9, n / 9 % 9, n / 81];
                volume.voxel(volume.grid().index(std::array::from_fn(|a| (corner[a] + step[a]).min(dims[a] - 1))))
            };
            let is_same = (0..729).all(|n| voxel(n) == voxel(0)) && voxel(0).density > crate::volume::Density::EMPTY;
            assert_eq!(*entry == EVEN, is_same, "brick {brick}");
        }
        assert!(empty.entries.iter().filter(|e| **e == EVEN).count() > 10);
    }

    #[test]
    fn after_a_cut_nothing_visible_is_leapt_over() {
        // Aim: a function that shows only half densities sees new walls inside; Method: cut, update, compare with made anew.
        let mut volume = ball();
        let shell = super::super::transfer::table([1.0; 3], |d| if (0.2..0.8).contains(&d) { 0.5 } else { 0.0 });
        let function = TransferFunction::plain(shell, 0.2, 0.0);
        for shown in [Shown::Iso, Shown::Volume(Arc::new(function))] {
            let mut empty = Empty::of(&volume, &shown);
            for z in 20..40 {
                let index = volume.grid().index([35, 32, z]);
                volume.set(index, Voxel::AIR);
            }
            let changed = volume.take_dirty();
            let differing = empty.update(&volume, &changed);
            let anew = Empty::of(&volume, &shown);
            assert!(empty.entries.iter().zip(&anew.entries).all(|(now, exact)| steps(*now) <= steps(*exact)));
            let marked = |empty: &Empty| empty.entries.iter().map(|e| e & EVEN).collect::<Vec<_>>();
            assert_eq!(marked(&empty), marked(&anew));
            assert!(empty.content == anew.content);
            assert!(differing.len() < 60, "{} entries for a few bricks", differing.len());
        }
    }
}
