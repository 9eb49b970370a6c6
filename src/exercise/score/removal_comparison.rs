//! The comparison of the removed tissue with the tissue to be removed.

use super::voxel_removals::{VoxelRemoval, VoxelRemovals};
use super::zones::ZoneVoxels;
use crate::catalog::TissueRole;
use crate::record::Replay;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Scenario, Zone};
use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{Grid, Label, Volume, distance};

/// Distances that differ by less are equal, mm: the same distance along other axes differs by rounding errors.
const EQUAL_DISTANCES_MM: f32 = 1e-4;

/// Sets of voxels of the workpiece, and the measures that follow from them. R is the removed tissue, D the decay at the
/// start, T the tissue to be removed: the target zones, or D if there are none.
#[derive(Clone, Debug)]
pub struct RemovalComparison {
    pub grid: Grid,
    /// Flags of each voxel.
    pub flags: Vec<VoxelFlags>,
    /// The scenario's zones, in their order.
    pub zones: Vec<ZoneVoxels>,
    pub counts: RemovalCounts,
}

/// Properties of one voxel, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VoxelFlags(u8);

impl VoxelFlags {
    const REMOVED: u8 = 1;
    const DECAY: u8 = 2;
    const TARGET: u8 = 4;
    const SOUND: u8 = 8;
    const VULNERABLE: u8 = 16;

    fn with(self, bit: u8, holds: bool) -> VoxelFlags {
        VoxelFlags(if holds { self.0 | bit } else { self.0 })
    }

    pub fn removed(self) -> bool {
        self.0 & VoxelFlags::REMOVED != 0
    }

    pub fn decay(self) -> bool {
        self.0 & VoxelFlags::DECAY != 0
    }

    pub fn target(self) -> bool {
        self.0 & VoxelFlags::TARGET != 0
    }

    /// Returns true for tissue to be removed: decay or target.
    pub fn wanted(self) -> bool {
        self.0 & (VoxelFlags::DECAY | VoxelFlags::TARGET) != 0
    }

    pub fn sound(self) -> bool {
        self.0 & VoxelFlags::SOUND != 0
    }

    pub fn vulnerable(self) -> bool {
        self.0 & VoxelFlags::VULNERABLE != 0
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RemovalCounts {
    pub removed: usize,
    pub decay: usize,
    pub target: usize,
    pub removed_decay: usize,
    pub removed_other: usize,
    pub removed_target: usize,
}

/// A distance, and the voxel at which it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelDistance {
    pub mm: f32,
    pub voxel: usize,
}

impl RemovalComparison {
    pub fn of(scenario: &Scenario, replay: &Replay) -> RemovalComparison {
        let initial = &replay.workpiece.volume;
        let zones: Vec<ZoneVoxels> = scenario.zones.iter().map(|z| ZoneVoxels::of(z, scenario, initial)).collect();
        let targets: Vec<usize> = (0..zones.len()).filter(|&z| scenario.zones[z].role == ZoneRole::Target).collect();
        let role: [Option<TissueRole>; 256] = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)));
        let mut counts = RemovalCounts::default();
        let after = replay.volume.tissues();
        let sets = initial.tissues().zip(after).enumerate().map(|(index, (before, after))| {
            if before == Label::AIR {
                return VoxelFlags::default();
            }
            let role = role[usize::from(before.0)];
            let decay = role == Some(TissueRole::Decay);
            let target =
                if targets.is_empty() { decay } else { targets.iter().any(|&z| zones[z].counted.contains(index)) };
            let set = VoxelFlags::default()
                .with(VoxelFlags::REMOVED, after == Label::AIR)
                .with(VoxelFlags::DECAY, decay)
                .with(VoxelFlags::TARGET, target)
                .with(VoxelFlags::SOUND, role == Some(TissueRole::Sound))
                .with(VoxelFlags::VULNERABLE, role == Some(TissueRole::Vulnerable));
            counts.add(set);
            set
        });
        let flags = sets.collect();
        RemovalComparison { grid: *initial.grid(), flags, zones, counts }
    }

    fn indices(&self, holds: impl Fn(VoxelFlags) -> bool) -> impl Iterator<Item = usize> {
        self.flags.iter().enumerate().filter(move |(_, s)| holds(**s)).map(|(i, _)| i)
    }

    /// Returns the voxel of one set that is farthest from another set; `None` if either is empty. Of voxels at the same
    /// distance, the one that was removed first is returned.
    pub fn farthest(
        &self,
        of: impl Fn(VoxelFlags) -> bool,
        from: impl Fn(VoxelFlags) -> bool,
        removals: &VoxelRemovals,
    ) -> Option<VoxelDistance> {
        self.extreme(of, from, f32::max, removals)
    }

    /// Returns the voxel of one set that is nearest to another set; `None` if either is empty. Of voxels at the same
    /// distance, the one that was removed first is returned.
    pub fn nearest(
        &self,
        of: impl Fn(VoxelFlags) -> bool,
        to: impl Fn(VoxelFlags) -> bool,
        removals: &VoxelRemovals,
    ) -> Option<VoxelDistance> {
        self.extreme(of, to, f32::min, removals)
    }

    fn extreme(
        &self,
        of: impl Fn(VoxelFlags) -> bool,
        from: impl Fn(VoxelFlags) -> bool,
        choose: fn(f32, f32) -> f32,
        removals: &VoxelRemovals,
    ) -> Option<VoxelDistance> {
        let crop = SubGrid::around(&self.grid, 0, self.indices(|s| of(s) || from(s)))?;
        let distances = distance::to_set(&crop.grid, |i| from(self.flags[crop.whole_index(i)]));
        let all = distances.iter().enumerate().filter(|(_, d)| d.is_finite());
        let all = all.map(|(index, &mm)| (mm, crop.whole_index(index))).filter(|&(_, voxel)| of(self.flags[voxel]));
        let mm = all.clone().map(|(mm, _)| mm).reduce(choose)?;
        let equals = all.filter(|(other, _)| (other - mm).abs() <= EQUAL_DISTANCES_MM);
        let (_, voxel) = equals.min_by_key(|&(_, voxel)| (removals.at(voxel), voxel))?;
        Some(VoxelDistance { mm, voxel })
    }

    /// Returns the distances between the borders of R and T in both directions, mm, in ascending order; `None` if
    /// either is empty.
    pub fn outline_distances(&self) -> Option<Vec<f32>> {
        let crop = SubGrid::around(&self.grid, 1, self.indices(|s| s.removed() || s.target()))?;
        let at = |i: usize| self.flags[crop.whole_index(i)];
        let is_border = |i: usize, holds: &dyn Fn(VoxelFlags) -> bool| {
            // A voxel on the border of the box has neighbours outside, which belong to no set.
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

    /// Returns the vulnerable voxel that [was exposed](RemovalComparison::is_exposed) first, with the removal that
    /// exposed it.
    pub fn first_exposed(&self, removals: &VoxelRemovals) -> Option<(usize, Option<VoxelRemoval>)> {
        let exposed = self.indices(|s| s.vulnerable()).filter(|&voxel| self.is_exposed(voxel));
        let exposed = exposed.map(|voxel| (voxel, removals.exposing(&self.grid, voxel)));
        exposed.min_by_key(|(voxel, removal)| (removal.map(|r| r.at), *voxel))
    }

    /// Number of voxels of vulnerable tissue that were removed.
    pub fn removed_vulnerable(&self) -> usize {
        self.indices(|s| s.vulnerable() && s.removed()).count()
    }

    /// Returns true for a vulnerable voxel that was removed or is next to a removed one.
    pub fn is_exposed(&self, voxel: usize) -> bool {
        self.flags[voxel].vulnerable()
            && (self.flags[voxel].removed() || self.grid.neighbours(voxel).any(|n| self.flags[n].removed()))
    }

    /// Returns 100·|R∩D′| / |D′|, where D′ is the decay that a ball of this radius (mm) reaches without overlapping
    /// any other tissue of the volume at the start; `None` without decay.
    ///
    /// The border of a tissue is a staircase of voxels, and a bur cannot enter the corners between its steps without
    /// cutting them. Their volume grows with the voxels: in voxels of 0.25 mm they are 4 % of a lesion of 3 mm, which
    /// even a hand without fault leaves. A ball's centre lies at least its radius and half a voxel away from the
    /// centres of other tissue, whose faces lie half a voxel before them. The other half voxel is the tolerance of
    /// centres that are themselves tried at voxels only.
    pub fn accessible_cleared_pct(&self, initial: &Volume, radius: f32) -> Option<f64> {
        let spacing = self.grid.spacing.max_element();
        let reach = radius + 0.5 * spacing;
        let margin = (2.0 * reach / self.grid.spacing.min_element()).ceil() as u32 + 1;
        let crop = SubGrid::around(&self.grid, margin, self.indices(|s| s.decay()))?;
        let is_other = |voxel: usize| initial.tissue(voxel) != Label::AIR && !self.flags[voxel].decay();
        let to_other = distance::to_set(&crop.grid, |i| is_other(crop.whole_index(i)));
        let to_centre = distance::to_set(&crop.grid, |i| to_other[i] >= reach);
        let accessible = (0..crop.grid.len()).filter(|&i| to_centre[i] <= reach).map(|i| crop.whole_index(i));
        let (mut all, mut removed) = (0u64, 0u64);
        for voxel in accessible.filter(|&v| self.flags[v].decay()) {
            all += 1;
            removed += u64::from(self.flags[voxel].removed());
        }
        // A lesion that no instrument of the tray reaches is judged as a whole.
        match all {
            0 => Some(100.0 * self.counts.removed_decay as f64 / self.counts.decay as f64),
            _ => Some(100.0 * removed as f64 / all as f64),
        }
    }

    /// Returns 100·|R∩Z| / |Z| for the zone Z with this index. A zone that consists of decay alone has nothing to
    /// protect: 0. `None` for an empty zone.
    pub fn zone_removed_pct(&self, zone: usize) -> Option<f64> {
        let ZoneVoxels { counted, decay } = &self.zones[zone];
        let all = counted.count();
        match all {
            0 => (*decay > 0).then_some(0.0),
            _ => Some(100.0 * self.removed_of_zone(zone).count() as f64 / all as f64),
        }
    }

    /// Returns the removed voxels of the zone with this index.
    pub fn removed_of_zone(&self, zone: usize) -> impl Iterator<Item = usize> + '_ {
        self.zones[zone].counted.iter().filter(move |&v| self.flags[v].removed())
    }
}

impl RemovalCounts {
    fn add(&mut self, set: VoxelFlags) {
        let (removed, decay, target) = (set.removed(), set.decay(), set.target());
        self.removed += usize::from(removed);
        self.decay += usize::from(decay);
        self.target += usize::from(target);
        self.removed_decay += usize::from(removed && decay);
        self.removed_other += usize::from(removed && !decay);
        self.removed_target += usize::from(removed && target);
    }
}

/// Distance to the vulnerable tissue, to a tissue or to a zone of a volume, up to a maximum distance.
#[derive(Clone, Debug)]
pub struct ProximityField {
    crop: Option<SubGrid>,
    distances: Vec<f32>,
    within: f32,
}

impl ProximityField {
    pub fn around_vulnerable(scenario: &Scenario, initial: &Volume, within: f32) -> ProximityField {
        let is_vulnerable = |i: usize| scenario.tissues.role(initial.tissue(i)) == Some(TissueRole::Vulnerable);
        ProximityField::around(initial.grid(), within, is_vulnerable)
    }

    /// Returns the field of a tissue as it is at the start.
    pub fn around_tissue(label: Label, initial: &Volume, within: f32) -> ProximityField {
        ProximityField::around(initial.grid(), within, |i| initial.tissue(i) == label)
    }

    /// Returns the field of a zone as it is judged: of a protected zone, without its decay.
    pub fn around_zone(zone: &Zone, scenario: &Scenario, initial: &Volume, within: f32) -> ProximityField {
        let ZoneVoxels { counted, .. } = ZoneVoxels::of(zone, scenario, initial);
        ProximityField::around(initial.grid(), within, |i| counted.contains(i))
    }

    fn around(grid: &Grid, within: f32, is_in: impl Fn(usize) -> bool) -> ProximityField {
        let margin = (within / grid.spacing.min_element()).ceil() as u32 + 1;
        let crop = SubGrid::around(grid, margin, (0..grid.len()).filter(|&i| is_in(i)));
        let distances = match &crop {
            Some(crop) => distance::to_set(&crop.grid, |i| is_in(crop.whole_index(i))),
            None => Vec::new(),
        };
        ProximityField { crop, distances, within }
    }

    /// Returns true for a point (tooth space, mm) within the maximum distance.
    pub fn is_near(&self, point_in_tooth: typodont_core::frame::Vec3) -> bool {
        let place = self.crop.and_then(|crop| Some(crop.grid.index(crop.grid.nearest(point_in_tooth)?)));
        place.is_some_and(|i| self.distances[i] <= self.within)
    }
}
