//! Maps of removed voxels over many people, and the distance of each person's cavity from the experts'.

use super::{Cohort, ComparableGroup};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use typodont_core::parallel::par_map;
use typodont_core::volume::Grid;
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};

/// Names of a bundle's files that are read here.
const INITIAL_VOLUME_FILE: &str = "initial.seg.nrrd";
const REMOVAL_TIMES_FILE: &str = "removal_time.nrrd";

/// Cavities read at a time: enough to share among threads, and some megabytes of memory.
const MASKS_AT_ONCE: usize = 32;

/// Largest misalignment between a cavity's voxels and the tooth's, in voxels: that of rounding.
const ALIGNMENT_TOLERANCE: f32 = 0.02;

/// Voxels that people removed from one tooth, given its state at the start.
#[derive(Clone, Debug)]
pub struct RemovalMap {
    pub group: ComparableGroup,
    /// SHA-256 of the tooth's label map before the first cut: only identical teeth are compared.
    pub start: String,
    /// A bundle that holds this tooth.
    pub tooth: PathBuf,
    /// True if sessions of another scorer version begin with the same tooth; their map is a file of its own.
    pub is_start_shared: bool,
    /// Number of people in the map; the last session of each counts.
    pub people: usize,
    pub experts: usize,
    /// The box that holds everything anybody removed, in tooth space.
    pub grid: Grid,
    /// Share of people who removed a voxel, 0 to 1, x fastest.
    pub share: Vec<f32>,
    /// Session index and the distance of its cavity from the experts'.
    pub distances: Vec<(usize, ExpertDistance)>,
}

/// Distance from one cavity to those of the experts; an expert is compared with the other experts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpertDistance {
    /// Volume in which it differs from an expert's cavity, mean over the experts, mm³: Σ|r − p|·v, r whether a voxel was removed,
    /// p the share of experts who did, v a voxel's volume.
    pub differs_mm3: f64,
    /// 2·Σrp / (Σr + Σp): 1 where it is the experts' cavity, 0 where it shares nothing with it. Both empty: 1.
    pub dice: f64,
}

/// Summary of a [`RemovalMap`] for `cohort.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RemovalSummary {
    pub start_sha256: String,
    pub map: String,
    pub people: usize,
    pub experts: usize,
    /// Volume that anybody, that at least half, and that everybody removed, mm³.
    pub by_any_mm3: f64,
    pub by_half_mm3: f64,
    pub by_all_mm3: f64,
    /// Distance of each session's cavity from the experts'; empty without experts.
    pub distances: Vec<ExpertDistanceFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpertDistanceFile {
    pub participant: String,
    pub bundle: String,
    pub differs_mm3: f64,
    pub dice: f64,
}

impl RemovalSummary {
    pub fn of(cohort: &Cohort, removal: &RemovalMap) -> RemovalSummary {
        let distance = |&(index, distance): &(usize, ExpertDistance)| {
            let (path, session) = &cohort.sessions[index];
            ExpertDistanceFile {
                participant: session.participant.clone(),
                bundle: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
                differs_mm3: distance.differs_mm3,
                dice: distance.dice,
            }
        };
        let volume = |least: f32| {
            let count = removal.share.iter().filter(|s| **s > 0.0 && **s >= least).count();
            count as f64 * removal.grid.voxel_mm3()
        };
        RemovalSummary {
            start_sha256: removal.start.clone(),
            map: removal.file_name(),
            people: removal.people,
            experts: removal.experts,
            by_any_mm3: volume(0.0),
            by_half_mm3: volume(0.5),
            by_all_mm3: volume(1.0),
            distances: removal.distances.iter().map(distance).collect(),
        }
    }
}

impl RemovalMap {
    /// Encodes the map as NRRD, which 3D Slicer opens: share of people (0 to 1) per voxel.
    ///
    /// # Errors
    ///
    /// When the file cannot be encoded.
    pub fn nrrd(&self) -> Result<Vec<u8>, String> {
        let geometry = Geometry::of(&self.grid, CoordinateSystem::LeftPosteriorSuperior);
        let keys = [
            ("typodont_quantity", "proportion of participants who removed the voxel".to_string()),
            ("typodont_unit", "1".to_string()),
            ("typodont_people", self.people.to_string()),
            ("typodont_start_sha256", self.start.clone()),
        ];
        let keys = keys.map(|(key, value)| (key.to_string(), value)).to_vec();
        let image = VoxelImage { geometry, samples: Samples::F32(self.share.clone()), keys };
        nrrd::bytes(&image, Encoding::Gzip).map_err(|e| e.to_string())
    }

    /// A name for its file: the exercise's, as far as it fits into one, and the beginning of the tooth's digest.
    pub fn file_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
        let name: String = self.group.scenario.chars().take(60).map(plain).collect();
        let start: String = self.start.chars().take(8).map(plain).collect();
        let scorer =
            if self.is_start_shared { format!("-scorer-{}", self.group.scorer_version) } else { String::new() };
        format!("{name}-{start}{scorer}.removed-share.nrrd")
    }
}

impl Cohort {
    /// Adds up the cavities of identical teeth, for each tooth on which two or more people worked.
    pub fn map_removals(&mut self) {
        let mut groups: BTreeMap<(ComparableGroup, String), Vec<usize>> = BTreeMap::new();
        for (index, (_, session)) in self.sessions.iter().enumerate() {
            if let (Some(start), true) =
                (session.digests.get(INITIAL_VOLUME_FILE), session.digests.contains_key(REMOVAL_TIMES_FILE))
            {
                groups.entry((ComparableGroup::of(session), start.clone())).or_default().push(index);
            }
        }
        let mut removals = Vec::new();
        let starts: Vec<(String, String)> =
            groups.keys().map(|(group, start)| (group.scenario.clone(), start.clone())).collect();
        for ((group, start), sessions) in groups {
            let same = starts.iter().filter(|(scenario, s)| (scenario, s) == (&group.scenario, &start)).count();
            let removal = self.removal(group, start, &sessions);
            removals.extend(removal.map(|removal| RemovalMap { is_start_shared: same > 1, ..removal }));
        }
        // The tooth with the most people first.
        removals.sort_by(|a, b| (&a.group, b.people, &a.start).cmp(&(&b.group, a.people, &b.start)));
        self.removals = removals;
    }

    fn removal(&mut self, group: ComparableGroup, start: String, sessions: &[usize]) -> Option<RemovalMap> {
        let people: Vec<Vec<usize>> = self
            .attempts_by_participant(&group)
            .into_iter()
            .filter_map(|person| {
                let of_them: Vec<usize> = person.into_iter().filter(|i| sessions.contains(i)).collect();
                (!of_them.is_empty()).then_some(of_them)
            })
            .collect();
        if people.len() < 2 {
            return None;
        }
        let (tooth, tooth_grid) = sessions.iter().find_map(|&i| {
            let bundle = &self.sessions[i].0;
            let map = nrrd::segmentation::read(&bundle.join(INITIAL_VOLUME_FILE)).ok()?;
            Some((bundle.clone(), map.geometry.grid()?))
        })?;
        let last: Vec<usize> = people.iter().map(|person| person[person.len() - 1]).collect();
        let (mut all_counts, mut experts) = (VoxelCounter::on_grid(tooth_grid), VoxelCounter::on_grid(tooth_grid));
        let mut own: BTreeMap<String, RemovalMask> = BTreeMap::new();
        let mut unreadable: BTreeMap<PathBuf, String> = BTreeMap::new();
        self.for_each_mask(&last, &tooth_grid, &mut unreadable, |index, cavity| {
            all_counts.add(&cavity);
            let session = &self.sessions[index].1;
            if self.is_expert(session) {
                experts.add(&cavity);
                own.insert(session.participant.clone(), cavity);
            }
        });
        let mut distances = Vec::new();
        if experts.masks > 0 {
            self.for_each_mask(sessions, &tooth_grid, &mut unreadable, |index, cavity| {
                let own = own.get(&self.sessions[index].1.participant);
                distances.extend(experts.distance(&cavity, own).map(|d| (index, d)));
            });
        }
        self.skipped.extend(unreadable);
        let share = all_counts.counts.iter().map(|&c| c as f32 / all_counts.masks as f32).collect();
        let (people, experts) = (all_counts.masks as usize, experts.masks as usize);
        (people > 1).then(|| RemovalMap {
            group,
            start,
            tooth,
            is_start_shared: false,
            people,
            experts,
            grid: all_counts.grid(),
            share,
            distances,
        })
    }

    /// Reads the cavities of sessions, some at a time; damaged files are passed to `unread`.
    fn for_each_mask(
        &self,
        sessions: &[usize],
        whole: &Grid,
        unreadable: &mut BTreeMap<PathBuf, String>,
        mut take: impl FnMut(usize, RemovalMask),
    ) {
        for part in sessions.chunks(MASKS_AT_ONCE) {
            let path = |n: usize| self.sessions[part[n]].0.join(REMOVAL_TIMES_FILE);
            for (n, cavity) in par_map(part.len(), |n| RemovalMask::read(&path(n), whole)).into_iter().enumerate() {
                match cavity {
                    Ok(cavity) => take(part[n], cavity),
                    Err(why) => drop(unreadable.insert(path(n), why)),
                }
            }
        }
    }
}

/// A box of a tooth's voxels: which of them fell.
struct RemovalMask {
    low: [u32; 3],
    dims: [u32; 3],
    removed: Vec<bool>,
}

impl RemovalMask {
    /// From the times at which voxels fell; `whole` is the tooth's grid.
    fn read(path: &Path, whole: &Grid) -> Result<RemovalMask, String> {
        if !path.is_file() {
            return Err("the file does not exist".into());
        }
        let image = nrrd::read(path).map_err(|e| e.to_string())?;
        let grid = image.geometry.grid().ok_or("its axes differ from those of the tooth")?;
        let Samples::F32(times) = image.samples else { return Err("it contains no times".into()) };
        let at = whole.from_tooth(grid.origin);
        let is_off = (at - at.round()).abs().max_element() > ALIGNMENT_TOLERANCE
            || (grid.spacing / whole.spacing - 1.0).abs().max_element() > 1e-4;
        let low = at.round().to_array();
        let fits = |a: usize| low[a] >= 0.0 && low[a] + grid.dims[a] as f32 <= whole.dims[a] as f32;
        if is_off || !(0..3).all(fits) {
            return Err("its voxels differ from those of the tooth".into());
        }
        Ok(RemovalMask {
            low: low.map(|v| v as u32),
            dims: grid.dims,
            removed: times.iter().map(|t| !t.is_nan()).collect(),
        })
    }

    /// The voxels that fell, in the tooth's grid.
    fn removed_cells(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let cell = move |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
        let fell = self.removed.iter().enumerate().filter(|(_, fell)| **fell);
        fell.map(move |(i, _)| std::array::from_fn(|a| self.low[a] + cell(i)[a] as u32))
    }
}

/// Cavities of one tooth, counted voxel by voxel in a box that grows as they come.
struct VoxelCounter {
    tooth_grid: Grid,
    low: [u32; 3],
    dims: [u32; 3],
    counts: Vec<u32>,
    masks: u32,
}

impl VoxelCounter {
    fn on_grid(tooth_grid: Grid) -> VoxelCounter {
        VoxelCounter { tooth_grid, low: [0; 3], dims: [0; 3], counts: Vec::new(), masks: 0 }
    }

    fn add(&mut self, mask: &RemovalMask) {
        self.grow(mask);
        for cell in mask.removed_cells() {
            let index = self.index(cell).expect("the box has grown to hold the cavity");
            self.counts[index] += 1;
        }
        self.masks += 1;
    }

    fn grow(&mut self, mask: &RemovalMask) {
        if self.counts.is_empty() {
            (self.low, self.dims) = (mask.low, mask.dims);
            self.counts = vec![0; self.grid().len()];
            return;
        }
        let high = |low: [u32; 3], dims: [u32; 3]| -> [u32; 3] { std::array::from_fn(|a| low[a] + dims[a]) };
        let (own, new) = (high(self.low, self.dims), high(mask.low, mask.dims));
        let low: [u32; 3] = std::array::from_fn(|a| self.low[a].min(mask.low[a]));
        let dims: [u32; 3] = std::array::from_fn(|a| own[a].max(new[a]) - low[a]);
        if (low, dims) == (self.low, self.dims) {
            return;
        }
        let before = std::mem::replace(
            self,
            VoxelCounter { tooth_grid: self.tooth_grid, low, dims, counts: Vec::new(), masks: self.masks },
        );
        self.counts = vec![0; self.grid().len()];
        let old = before.grid();
        for (index, &count) in before.counts.iter().enumerate().filter(|(_, c)| **c > 0) {
            let cell = old.cell(index);
            let place = self.index(std::array::from_fn(|a| before.low[a] + cell[a])).expect("a box only grows");
            self.counts[place] = count;
        }
    }

    /// The box in tooth space.
    fn grid(&self) -> Grid {
        Grid { dims: self.dims, spacing: self.tooth_grid.spacing, origin: self.tooth_grid.centre(self.low) }
    }

    fn index(&self, cell: [u32; 3]) -> Option<usize> {
        let inside = (0..3).all(|a| cell[a] >= self.low[a] && cell[a] - self.low[a] < self.dims[a]);
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let place = |a: usize| (cell[a] - self.low[a]) as usize;
        inside.then(|| (place(2) * ny + place(1)) * nx + place(0))
    }

    fn count(&self, cell: [u32; 3]) -> u32 {
        self.index(cell).map_or(0, |i| self.counts[i])
    }

    /// Distance from a cavity to those counted, without the same person's own; `None` if no other is left.
    fn distance(&self, mask: &RemovalMask, own: Option<&RemovalMask>) -> Option<ExpertDistance> {
        let others = self.masks - u32::from(own.is_some());
        if others == 0 {
            return None;
        }
        // |r − p| is p where r = 0, and 1 − p where r = 1: Σp + Σr − 2·Σrp.
        let is_own = |cell: [u32; 3]| own.is_some_and(|own| own.is_removed(cell));
        let own_size = own.map_or(0, |own| own.removed_cells().count());
        let shares =
            (self.counts.iter().map(|&c| u64::from(c)).sum::<u64>() - own_size as u64) as f64 / f64::from(others);
        let (mut size, mut common) = (0u64, 0u64);
        for cell in mask.removed_cells() {
            size += 1;
            common += u64::from(self.count(cell) - u32::from(is_own(cell)));
        }
        let (size, common) = (size as f64, common as f64 / f64::from(others));
        let differs_mm3 = (shares + size - 2.0 * common) * self.tooth_grid.voxel_mm3();
        let dice = if shares + size > 0.0 { 2.0 * common / (shares + size) } else { 1.0 };
        Some(ExpertDistance { differs_mm3, dice })
    }
}

impl RemovalMask {
    fn is_removed(&self, cell: [u32; 3]) -> bool {
        let inside = (0..3).all(|a| cell[a] >= self.low[a] && cell[a] - self.low[a] < self.dims[a]);
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let place = |a: usize| (cell[a] - self.low[a]) as usize;
        inside && self.removed[(place(2) * ny + place(1)) * nx + place(0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Vec3;

    fn cavity(low: [u32; 3], dims: [u32; 3]) -> RemovalMask {
        RemovalMask { low, dims, removed: vec![true; dims.iter().product::<u32>() as usize] }
    }

    #[test]
    fn cavities_pile_up_wherever_they_lie() {
        let mut pile = VoxelCounter::on_grid(Grid::centred([20, 20, 20], Vec3::splat(0.5)));
        for part in [cavity([5, 5, 5], [2, 2, 2]), cavity([2, 6, 5], [4, 1, 1]), cavity([6, 6, 6], [3, 3, 3])] {
            pile.add(&part);
        }
        for (cell, expected) in [([5, 6, 5], 2), ([6, 6, 6], 2), ([2, 6, 5], 1), ([8, 8, 8], 1), ([9, 9, 9], 0)] {
            assert_eq!(pile.count(cell), expected, "{cell:?}");
        }
        assert_eq!(pile.counts.iter().sum::<u32>(), 8 + 4 + 27);
        assert_eq!(pile.grid().origin, pile.tooth_grid.centre([2, 5, 5]));
    }

    #[test]
    fn the_distance_is_the_mean_volume_in_which_two_cavities_differ() {
        // Aim: Σ|r − p| by its definition. Method: two experts, a trainee, voxels of 1 mm³ counted by hand: 8 + 8 voxels of the
        // experts, of which the trainee's 12 share 8 with the one and 4 with the other: 4 and 12 differ.
        let mut pile = VoxelCounter::on_grid(Grid::centred([20, 20, 20], Vec3::ONE));
        let (first, second) = (cavity([5, 5, 5], [2, 2, 2]), cavity([7, 5, 5], [2, 2, 2]));
        pile.add(&first);
        pile.add(&second);
        let trainee = cavity([5, 5, 5], [3, 2, 2]);
        let found = pile.distance(&trainee, None).unwrap();
        assert_eq!(found, ExpertDistance { differs_mm3: 8.0, dice: 2.0 * 6.0 / (8.0 + 12.0) });
        // An expert is compared with the other one alone, and the only expert with nobody.
        assert_eq!(pile.distance(&first, Some(&first)).unwrap(), ExpertDistance { differs_mm3: 16.0, dice: 0.0 });
        let mut alone = VoxelCounter::on_grid(pile.tooth_grid);
        alone.add(&first);
        assert_eq!(alone.distance(&first, Some(&first)), None);
    }
}
