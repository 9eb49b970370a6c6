//! Reinitialisation of a field that crosses zero at a surface to the signed distance from that surface.
//!
//! Method: where the field changes sign between neighbours, its zero crossing gives the distance with subvoxel
//! accuracy; from there fast sweeping extends it (Zhao, *A fast sweeping method for Eikonal equations*, 2005).

use crate::volume::Grid;

/// Half the width of the density ramp across a surface, voxels.
const HALF_BAND_VOXELS: f32 = 1.5;

/// Margin beyond the ramp in which distances are computed, voxels, so that smoothing them keeps the ramp straight.
const MARGIN_VOXELS: f32 = 2.0;

/// Least distance of a voxel's centre from a surface, voxels: at zero distance it would be neither inside nor
/// outside.
pub const MIN_DISTANCE_VOXELS: f32 = 1e-3;

/// Half the width of the density ramp on a grid, mm.
pub fn half_band(grid: &Grid) -> f32 {
    HALF_BAND_VOXELS * grid.spacing.max_element()
}

/// Distance up to which signed distances must be computed on a grid, mm.
pub fn max_distance(grid: &Grid) -> f32 {
    (HALF_BAND_VOXELS + MARGIN_VOXELS) * grid.spacing.max_element()
}

/// Signed distance in mm to the zero crossing of a field, negative where the field is positive or zero;
/// ±`max_distance` farther away.
pub fn signed_distance_from_field(grid: &Grid, field: &[f32], max_distance: f32) -> Vec<f32> {
    let mut distance: Vec<f32> =
        (0..grid.len()).map(|i| distance_beside_surface(grid, field, i).unwrap_or(max_distance)).collect();
    let is_fixed: Vec<bool> = distance.iter().map(|&d| d < max_distance).collect();
    for directions in 0..8 {
        sweep(grid, &mut distance, &is_fixed, [directions & 1 != 0, directions & 2 != 0, directions & 4 != 0]);
    }
    for (value, &field) in distance.iter_mut().zip(field) {
        *value = if field >= 0.0 { -*value } else { *value };
    }
    distance
}

/// Distance from the centre of a voxel next to the surface; `None` if no neighbour lies on the other side.
///
/// It is the value of the field divided by its gradient, taken across the surface where possible.
fn distance_beside_surface(grid: &Grid, field: &[f32], index: usize) -> Option<f32> {
    let cell = grid.cell(index);
    let strides = [1, grid.dims[0] as usize, grid.dims[0] as usize * grid.dims[1] as usize];
    let here = field[index];
    let (mut rise_squared, mut is_beside) = (0.0, false);
    for axis in 0..3 {
        let below = if cell[axis] > 0 { field[index - strides[axis]] } else { here };
        let above = if cell[axis] + 1 < grid.dims[axis] { field[index + strides[axis]] } else { here };
        let across = [below, above].into_iter().filter(|there| (*there >= 0.0) != (here >= 0.0));
        let steepest = across.map(|there| (here - there).abs()).reduce(f32::max);
        is_beside |= steepest.is_some();
        let rise = steepest.unwrap_or(0.5 * (above - below)) / grid.spacing[axis];
        rise_squared += rise * rise;
    }
    let least = MIN_DISTANCE_VOXELS * grid.spacing.min_element();
    is_beside.then(|| (here.abs() / rise_squared.sqrt()).max(least))
}

/// Passes over the grid once, forward or backward along each axis.
fn sweep(grid: &Grid, distance: &mut [f32], is_fixed: &[bool], backward: [bool; 3]) {
    let dims = grid.dims.map(|n| n as usize);
    let strides = [1, dims[0], dims[0] * dims[1]];
    let spacing = grid.spacing.to_array();
    let place = |axis: usize, step: usize| if backward[axis] { dims[axis] - 1 - step } else { step };
    for z in (0..dims[2]).map(|step| place(2, step)) {
        for y in (0..dims[1]).map(|step| place(1, step)) {
            for x in (0..dims[0]).map(|step| place(0, step)) {
                let index = x + y * strides[1] + z * strides[2];
                if is_fixed[index] {
                    continue;
                }
                let cell = [x, y, z];
                let nearest: [f32; 3] = std::array::from_fn(|axis| {
                    let below = if cell[axis] > 0 { distance[index - strides[axis]] } else { f32::INFINITY };
                    let above =
                        if cell[axis] + 1 < dims[axis] { distance[index + strides[axis]] } else { f32::INFINITY };
                    below.min(above)
                });
                if nearest.iter().any(|&n| n < distance[index]) {
                    distance[index] = distance[index].min(solve_eikonal(nearest, spacing));
                }
            }
        }
    }
}

/// Distance that increases by 1 mm per mm from the nearest neighbours along each axis.
fn solve_eikonal(nearest: [f32; 3], spacing: [f32; 3]) -> f32 {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
    let mut found = f32::INFINITY;
    // Sums of 1/h², u/h² and u²/h² over the axes included so far.
    let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
    for axis in order {
        if found <= nearest[axis] || nearest[axis].is_infinite() {
            break;
        }
        // Measured from the least value, to avoid cancellation.
        let (u, weight) = (nearest[axis] - nearest[order[0]], 1.0 / (spacing[axis] * spacing[axis]));
        a += weight;
        b += u * weight;
        c += u * u * weight;
        let root = (b * b - a * (c - 1.0)).max(0.0).sqrt();
        found = nearest[order[0]] + (b + root) / a;
    }
    found
}

/// Averages each voxel with its neighbours, 1:2:1 along each axis: this removes noise and preserves planes.
pub fn binomial_smooth(grid: &Grid, field: &mut [f32]) {
    let dims = grid.dims.map(|n| n as usize);
    let strides = [1, dims[0], dims[0] * dims[1]];
    for axis in 0..3 {
        for index in 0..field.len() {
            // Each line is processed from its first voxel; `before` is the old value of the previous voxel.
            if index / strides[axis] % dims[axis] != 0 {
                continue;
            }
            let mut before = field[index];
            for step in 0..dims[axis] {
                let at = index + step * strides[axis];
                let here = field[at];
                let after = if step + 1 < dims[axis] { field[at + strides[axis]] } else { here };
                field[at] = 0.25 * (before + 2.0 * here + after);
                before = here;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn distances_are_finer_than_a_voxel() {
        // Aim: the ramp is straight and in the right place at any angle. Method: planes and a ball; steep or shallow
        // fields.
        let grid = Grid::centred([30, 34, 28], Vec3::new(0.2, 0.18, 0.22));
        let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
        check(&grid, 0.02, |p| p.z + 0.03);
        check(&grid, 0.02, |p| p.dot(normal) - 0.07);
        check(&grid, 0.06, |p| p.length() - 2.03);
    }

    fn check(grid: &Grid, tolerance: f32, distance: impl Fn(Vec3) -> f32) {
        let exact: Vec<f32> = grid.cells().map(|cell| distance(grid.centre(cell))).collect();
        let field: Vec<f32> = exact.iter().map(|d| (-3.0 * d).clamp(-1.0, 1.0)).collect();
        let reach = max_distance(grid);
        let found = signed_distance_from_field(grid, &field, reach);
        for ((found, exact), cell) in found.iter().zip(&exact).zip(grid.cells()) {
            let is_inner = (0..3).all(|axis| cell[axis] >= 4 && cell[axis] + 4 < grid.dims[axis]);
            if is_inner && exact.abs() < half_band(grid) {
                assert!((found - exact).abs() < tolerance, "{cell:?}: {found} for {exact}");
            }
        }
    }
}
