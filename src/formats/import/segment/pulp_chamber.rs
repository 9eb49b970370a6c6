//! Filling of cavities that a tooth encloses: pulp, even where canals are open at their ends, and flaws of the scan.

use crate::import::segment::TissueClass;
use crate::import::segment::grey_levels::GreyLevels;
use typodont_core::volume::components::Components;
use typodont_core::volume::{Grid, distance};

/// Half the width of an opening that is bridged, mm: most apical foramina are less than 0.5 mm wide.
const BRIDGE: f32 = 0.3;

/// Minimum fraction of a cavity's walls that must be tooth: a canal is open only at its end, a fissure or a gap
/// between roots along its whole length.
const WALLED: f64 = 0.9;

/// Volume below which a cavity is a bubble or noise, mm³.
const PULP: f64 = 0.1;

/// Half the width of an opening that is bridged on a grid, mm: at least 1.5 times the largest voxel spacing, which
/// exceeds the diagonal between two voxels.
pub(super) fn bridge(grid: &Grid) -> f32 {
    BRIDGE.max(1.5 * grid.spacing.max_element())
}

/// Fills enclosed cavities: with pulp where dentine surrounds them, otherwise with the surrounding tissue.
///
/// Pulp can be brighter than the surroundings of the tooth. It is therefore searched for twice: first as voxels that
/// are clearly darker than dentine, then up to halfway between the pulp's own level and that of dentine.
pub(super) fn fill(grid: &Grid, values: &[f32], levels: &GreyLevels, matter: &mut [TissueClass]) {
    fill_below(grid, values, levels.hollow_threshold(), matter);
    let pulp = values.iter().zip(&*matter).filter(|(_, matter)| **matter == TissueClass::Pulp);
    let mut pulp: Vec<f32> = pulp.map(|(&value, _)| value).collect();
    if !pulp.is_empty() {
        let middle = pulp.len() / 2;
        let (_, level, _) = pulp.select_nth_unstable_by(middle, f32::total_cmp);
        let halfway = 0.5 * (*level + levels.dentine);
        fill_below(grid, values, halfway.max(levels.dentine_threshold()), matter);
    }
}

fn fill_below(grid: &Grid, values: &[f32], below: f32, matter: &mut [TissueClass]) {
    let is_wall = |i: usize| matter[i].is_hard() && values[i] >= below;
    let is_enclosed = enclosed(grid, is_wall);
    let pieces = Components::of(grid, |i| is_enclosed[i]);
    let mut walls = vec![Walls::default(); pieces.sizes().len()];
    for index in 0..grid.len() {
        if let Some(number) = pieces.at(index) {
            grid.neighbours(index).filter(|&n| !is_enclosed[n]).for_each(|n| walls[number].count(matter[n]));
        }
    }
    let sizes = pieces.sizes().iter().map(|&size| size as f64 * grid.voxel_mm3());
    let filling: Vec<TissueClass> = walls.iter().zip(sizes).map(|(walls, size)| walls.filling(size)).collect();
    for (index, matter) in matter.iter_mut().enumerate() {
        let Some(number) = pieces.at(index) else { continue };
        match filling[number] {
            TissueClass::Pulp => *matter = TissueClass::Pulp,
            hard if *matter == TissueClass::Air => *matter = hard,
            _ => {}
        }
    }
}

/// Returns the hollow voxels that a ball as wide as the bridged openings cannot reach from outside.
fn enclosed(grid: &Grid, is_wall: impl Fn(usize) -> bool) -> Vec<bool> {
    let bridge = bridge(grid);
    let is_sealed: Vec<bool> = distance::to_set(grid, &is_wall).into_iter().map(|d| d <= bridge).collect();
    let free = Components::of(grid, |i| !is_sealed[i]);
    // The window leaves a margin around the tooth, so its first corner is outside.
    let is_outside: Vec<bool> = (0..grid.len()).map(|i| free.at(i) == Some(0)).collect();
    drop((free, is_sealed));
    let reach = distance::to_set(grid, |i| is_outside[i]);
    reach.into_iter().enumerate().map(|(index, reach)| reach > bridge && !is_wall(index)).collect()
}

/// Walls of a cavity by material, in voxel faces.
#[derive(Clone, Copy, Debug, Default)]
struct Walls {
    dentine: u64,
    enamel: u64,
    open: u64,
}

impl Walls {
    fn count(&mut self, matter: TissueClass) {
        match matter {
            TissueClass::Dentine => self.dentine += 1,
            TissueClass::Enamel => self.enamel += 1,
            TissueClass::Air | TissueClass::Pulp => self.open += 1,
        }
    }

    /// Returns the filling of a cavity, whose size is in mm³.
    fn filling(&self, size: f64) -> TissueClass {
        let hard = self.dentine + self.enamel;
        let walled = hard as f64 / (hard + self.open) as f64;
        let around = if self.dentine >= self.enamel { TissueClass::Dentine } else { TissueClass::Enamel };
        match around {
            TissueClass::Dentine if walled >= WALLED && size >= PULP => TissueClass::Pulp,
            _ if self.open == 0 => around,
            _ => TissueClass::Air,
        }
    }
}
