//! What a tooth encloses: pulp, even where canals are open at their ends, and flaws of the scan.

use super::Matter;
use super::levels::Levels;
use crate::anatomy::pieces::Pieces;
use crate::volume::{Grid, distance};

/// Half the width of an opening that is bridged, mm: most apical foramina are under 0.5 mm wide.
const BRIDGE: f32 = 0.3;

/// Least share of a cavity's walls that must be tooth: a canal is open at its end, a fissure or a gap between roots all
/// along.
const WALLED: f64 = 0.9;

/// A smaller cavity is a bubble or noise, mm³.
const PULP: f64 = 0.1;

/// Half the width of an opening that is bridged on a grid, mm: at least the diagonal between two voxels.
pub(super) fn bridge(grid: &Grid) -> f32 {
    BRIDGE.max(1.5 * grid.spacing.max_element())
}

/// Fills what the tooth encloses: with pulp where dentine surrounds it, else with what surrounds it.
///
/// Pulp can be brighter than what surrounds the tooth. So it is looked for twice: as what is clearly darker than dentine,
/// and then up to halfway between its own level and dentine's.
pub(super) fn fill(grid: &Grid, values: &[f32], levels: &Levels, matter: &mut [Matter]) {
    fill_below(grid, values, levels.hollow_below(), matter);
    let pulp = values.iter().zip(&*matter).filter(|(_, matter)| **matter == Matter::Pulp);
    let mut pulp: Vec<f32> = pulp.map(|(&value, _)| value).collect();
    if !pulp.is_empty() {
        let middle = pulp.len() / 2;
        let (_, level, _) = pulp.select_nth_unstable_by(middle, f32::total_cmp);
        let halfway = 0.5 * (*level + levels.dentine);
        fill_below(grid, values, halfway.max(levels.dentine_from()), matter);
    }
}

fn fill_below(grid: &Grid, values: &[f32], below: f32, matter: &mut [Matter]) {
    let is_wall = |i: usize| matter[i].is_hard() && values[i] >= below;
    let is_enclosed = enclosed(grid, is_wall);
    let pieces = Pieces::of(grid, |i| is_enclosed[i]);
    let mut walls = vec![Walls::default(); pieces.sizes().len()];
    for index in 0..grid.len() {
        if let Some(number) = pieces.at(index) {
            grid.neighbours(index).filter(|&n| !is_enclosed[n]).for_each(|n| walls[number].count(matter[n]));
        }
    }
    let sizes = pieces.sizes().iter().map(|&size| size as f64 * grid.voxel_mm3());
    let filling: Vec<Matter> = walls.iter().zip(sizes).map(|(walls, size)| walls.filling(size)).collect();
    for (index, matter) in matter.iter_mut().enumerate() {
        let Some(number) = pieces.at(index) else { continue };
        match filling[number] {
            Matter::Pulp => *matter = Matter::Pulp,
            hard if *matter == Matter::Air => *matter = hard,
            _ => {}
        }
    }
}

/// Hollow voxels that a ball as wide as the bridged openings cannot reach from outside.
fn enclosed(grid: &Grid, is_wall: impl Fn(usize) -> bool) -> Vec<bool> {
    let bridge = bridge(grid);
    let is_sealed: Vec<bool> = distance::to_set(grid, &is_wall).into_iter().map(|d| d <= bridge).collect();
    let free = Pieces::of(grid, |i| !is_sealed[i]);
    // The window leaves room around the tooth, so its first corner is outside.
    let is_outside: Vec<bool> = (0..grid.len()).map(|i| free.at(i) == Some(0)).collect();
    drop((free, is_sealed));
    let reach = distance::to_set(grid, |i| is_outside[i]);
    reach.into_iter().enumerate().map(|(index, reach)| reach > bridge && !is_wall(index)).collect()
}

/// What surrounds a cavity, in faces of voxels.
#[derive(Clone, Copy, Debug, Default)]
struct Walls {
    dentine: u64,
    enamel: u64,
    open: u64,
}

impl Walls {
    fn count(&mut self, matter: Matter) {
        match matter {
            Matter::Dentine => self.dentine += 1,
            Matter::Enamel => self.enamel += 1,
            Matter::Air | Matter::Pulp => self.open += 1,
        }
    }

    /// What belongs in a cavity of a size in mm³.
    fn filling(&self, size: f64) -> Matter {
        let hard = self.dentine + self.enamel;
        let walled = hard as f64 / (hard + self.open) as f64;
        let around = if self.dentine >= self.enamel { Matter::Dentine } else { Matter::Enamel };
        match around {
            Matter::Dentine if walled >= WALLED && size >= PULP => Matter::Pulp,
            _ if self.open == 0 => around,
            _ => Matter::Air,
        }
    }
}
