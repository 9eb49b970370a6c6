//! What was taken away, against what was to be taken away.

use super::bits::Bits;
use super::crop::Crop;
use super::zones;
use crate::content::Role;
use crate::record::Replay;
use crate::scenario::Scenario;
use crate::scenario::file::ZoneRole;
use crate::volume::{Grid, Label, Volume, distance};

/// Sets of voxels of the workpiece and what follows from them. R is what was removed, D the decay at the start, T what was
/// to be removed: the target zones, or D where there are none.
#[derive(Clone, Debug)]
pub struct Shape {
    pub grid: Grid,
    /// One set of flags per voxel.
    pub sets: Vec<Sets>,
    /// The scenario's zones, in its order.
    pub zones: Vec<Bits>,
    pub counts: Counts,
}

/// What holds of one voxel, a bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sets(u8);

impl Sets {
    const REMOVED: u8 = 1;
    const DECAY: u8 = 2;
    const TARGET: u8 = 4;
    const SOUND: u8 = 8;
    const VULNERABLE: u8 = 16;

    fn with(self, bit: u8, holds: bool) -> Sets {
        Sets(if holds { self.0 | bit } else { self.0 })
    }

    pub fn removed(self) -> bool {
        self.0 & Sets::REMOVED != 0
    }

    pub fn decay(self) -> bool {
        self.0 & Sets::DECAY != 0
    }

    pub fn target(self) -> bool {
        self.0 & Sets::TARGET != 0
    }

    /// To be removed: decay, or a target.
    pub fn wanted(self) -> bool {
        self.0 & (Sets::DECAY | Sets::TARGET) != 0
    }

    pub fn sound(self) -> bool {
        self.0 & Sets::SOUND != 0
    }

    pub fn vulnerable(self) -> bool {
        self.0 & Sets::VULNERABLE != 0
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub removed: usize,
    pub decay: usize,
    pub target: usize,
    pub removed_decay: usize,
    pub removed_other: usize,
    pub removed_target: usize,
}

/// A distance and the voxel where it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    pub mm: f32,
    pub voxel: usize,
}

impl Shape {
    pub fn of(scenario: &Scenario, replay: &Replay) -> Shape {
        let initial = &replay.workpiece.volume;
        let zones: Vec<Bits> = scenario.zones.iter().map(|z| zones::mask(z, initial)).collect();
        let targets: Vec<usize> = (0..zones.len()).filter(|&z| scenario.zones[z].role == ZoneRole::Target).collect();
        let role: [Option<Role>; 256] = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)));
        let mut counts = Counts::default();
        let after = replay.volume.tissues();
        let sets = initial.tissues().zip(after).enumerate().map(|(index, (before, after))| {
            if before == Label::AIR {
                return Sets::default();
            }
            let role = role[usize::from(before.0)];
            let decay = role == Some(Role::Decay);
            let target = if targets.is_empty() { decay } else { targets.iter().any(|&z| zones[z].contains(index)) };
            let set = Sets::default()
                .with(Sets::REMOVED, after == Label::AIR)
                .with(Sets::DECAY, decay)
                .with(Sets::TARGET, target)
                .with(Sets::SOUND, role == Some(Role::Sound))
                .with(Sets::VULNERABLE, role == Some(Role::Vulnerable));
            counts.add(set);
            set
        });
        let sets = sets.collect();
        Shape { grid: *initial.grid(), sets, zones, counts }
    }

    fn indices(&self, holds: impl Fn(Sets) -> bool) -> impl Iterator<Item = usize> {
        self.sets.iter().enumerate().filter(move |(_, s)| holds(**s)).map(|(i, _)| i)
    }

    /// The voxel of one set that is farthest from another; `None` when either is empty.
    pub fn farthest(&self, of: impl Fn(Sets) -> bool, from: impl Fn(Sets) -> bool) -> Option<Deepest> {
        self.extreme(of, from, |a, b| a > b)
    }

    /// The voxel of one set that is nearest to another; `None` when either is empty.
    pub fn nearest(&self, of: impl Fn(Sets) -> bool, to: impl Fn(Sets) -> bool) -> Option<Deepest> {
        self.extreme(of, to, |a, b| a < b)
    }

    fn extreme(
        &self,
        of: impl Fn(Sets) -> bool,
        from: impl Fn(Sets) -> bool,
        beats: impl Fn(f32, f32) -> bool,
    ) -> Option<Deepest> {
        let crop = Crop::around(&self.grid, 0, self.indices(|s| of(s) || from(s)))?;
        let distances = distance::to_set(&crop.grid, |i| from(self.sets[crop.whole_index(i)]));
        let mut best: Option<Deepest> = None;
        for (index, &mm) in distances.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            let voxel = crop.whole_index(index);
            if of(self.sets[voxel]) && best.is_none_or(|b| beats(mm, b.mm)) {
                best = Some(Deepest { mm, voxel });
            }
        }
        best
    }

    /// Distances between the borders of R and T, both ways, in ascending order; `None` when either is empty.
    pub fn outline_distances(&self) -> Option<Vec<f32>> {
        let crop = Crop::around(&self.grid, 1, self.indices(|s| s.removed() || s.target()))?;
        let at = |i: usize| self.sets[crop.whole_index(i)];
        let is_border = |i: usize, holds: &dyn Fn(Sets) -> bool| {
            // A voxel on the box's own edge has neighbours outside that hold nothing.
            holds(at(i)) && (crop.grid.neighbours(i).count() < 6 || crop.grid.neighbours(i).any(|n| !holds(at(n))))
        };
        let of_removed: Vec<bool> = (0..crop.grid.len()).map(|i| is_border(i, &|s| s.removed())).collect();
        let of_target: Vec<bool> = (0..crop.grid.len()).map(|i| is_border(i, &|s| s.target())).collect();
        if !of_removed.contains(&true) || !of_target.contains(&true) {
            return None;
        }
        let to_removed = distance::to_set(&crop.grid, |i| of_removed[i]);
        let to_target = distance::to_set(&crop.grid, |i| of_target[i]);
        let from_removed = of_removed.iter().zip(&to_target).filter(|(b, _)| **b).map(|(_, d)| *d);
        let from_target = of_target.iter().zip(&to_removed).filter(|(b, _)| **b).map(|(_, d)| *d);
        let mut distances: Vec<f32> = from_removed.chain(from_target).collect();
        distances.sort_by(f32::total_cmp);
        Some(distances)
    }

    /// The first voxel that [`Shape::is_exposed`].
    pub fn exposed(&self) -> Option<usize> {
        self.indices(|s| s.vulnerable()).find(|&voxel| self.is_exposed(voxel))
    }

    /// True for a vulnerable voxel that was removed or lies beside a removed one.
    pub fn is_exposed(&self, voxel: usize) -> bool {
        self.sets[voxel].vulnerable()
            && (self.sets[voxel].removed() || self.grid.neighbours(voxel).any(|n| self.sets[n].removed()))
    }

    /// 100·|R∩Z| / |Z|; `None` for an empty zone.
    pub fn zone_removed_pct(&self, zone: usize) -> Option<f64> {
        let all = self.zones[zone].count();
        let removed = self.zones[zone].iter().filter(|&v| self.sets[v].removed()).count();
        (all > 0).then(|| 100.0 * removed as f64 / all as f64)
    }
}

impl Counts {
    fn add(&mut self, set: Sets) {
        let (removed, decay, target) = (set.removed(), set.decay(), set.target());
        self.removed += usize::from(removed);
        self.decay += usize::from(decay);
        self.target += usize::from(target);
        self.removed_decay += usize::from(removed && decay);
        self.removed_other += usize::from(removed && !decay);
        self.removed_target += usize::from(removed && target);
    }
}

/// The vulnerable tissue of a volume and how near each place around it lies, up to a distance.
pub struct Danger {
    crop: Option<Crop>,
    distances: Vec<f32>,
    within: f32,
}

impl Danger {
    pub fn around(scenario: &Scenario, initial: &Volume, within: f32) -> Danger {
        let is_vulnerable = |i: usize| scenario.tissues.role(initial.tissue(i)) == Some(Role::Vulnerable);
        let grid = initial.grid();
        let margin = (within / grid.spacing.min_element()).ceil() as u32 + 1;
        let crop = Crop::around(grid, margin, (0..grid.len()).filter(|&i| is_vulnerable(i)));
        let distances = match &crop {
            Some(crop) => distance::to_set(&crop.grid, |i| is_vulnerable(crop.whole_index(i))),
            None => Vec::new(),
        };
        Danger { crop, distances, within }
    }

    /// True for a point of tooth space within the distance.
    pub fn is_near(&self, point_in_tooth: crate::frame::Vec3) -> bool {
        let place = self.crop.and_then(|crop| Some(crop.grid.index(crop.grid.nearest(point_in_tooth)?)));
        place.is_some_and(|i| self.distances[i] <= self.within)
    }
}
