//! A tooth before anybody worked on it: how thick its enamel is, how deep each place lies in it, and where its fissures and cusps are.
//!
//! Takes its volume. Gives distances by which the picture tells thin enamel from thick, and a cut from the tooth's own surface.

use typodont_core::frame::Vec3;
use typodont_core::parallel::par_map;
use typodont_core::volume::{Grid, Label, Volume, distance, hollowness};

/// Spacing of the places at which the thickness is kept, mm: finer than it changes.
const SPACING: f32 = 0.25;

/// Greatest thickness that is distinguished, mm; also that of a tooth without dentine.
pub(super) const THICKEST: f32 = 4.0;

/// A tooth before anybody worked on it: the thickness of its enamel, how deep a place lies in it, and the form of its surface. Tooth space.
#[derive(Clone, Debug, PartialEq)]
pub struct UnworkedTooth {
    grid: Grid,
    /// Distance to what is under the enamel, mm, x fastest.
    enamel: Vec<f32>,
    /// Distance to what is outside the tooth, mm, x fastest.
    depths: Vec<f32>,
    /// Form of the surface, as [`hollowness`] gives it, x fastest; 0 away from the surface.
    hollows: Vec<f32>,
}

impl UnworkedTooth {
    /// Measures the distance from each place to the nearest matter under the enamel, which is dentine and what is in it, and to the
    /// surface. `under_enamel`: labels of that matter.
    pub fn of(volume: &Volume, under_enamel: &[Label]) -> UnworkedTooth {
        let fine = volume.grid();
        let edge = ((SPACING / fine.spacing.max_element()) as u32).max(1);
        let grid = Grid {
            dims: fine.dims.map(|n| n.div_ceil(edge)),
            spacing: fine.spacing * edge as f32,
            origin: fine.origin + fine.spacing * (0.5 * (edge as f32 - 1.0)),
        };
        let row_of_shares = |row: usize| -> Vec<[f32; 2]> {
            let [y, z] = [row as u32 % grid.dims[1], row as u32 / grid.dims[1]];
            (0..grid.dims[0]).map(|x| shares_of_cell(volume, [x, y, z], edge, under_enamel)).collect()
        };
        let shares = par_map(grid.dims[1] as usize * grid.dims[2] as usize, row_of_shares).concat();
        let shares_of = |part: usize| -> Vec<f32> { shares.iter().map(|cell| cell[part]).collect() };
        let outside = shares_of(1);
        let depths = distances_to_filled_cells(&grid, &outside);
        let hollows = smoothed(&grid, hollows_of(&grid, &outside, &depths));
        UnworkedTooth { grid, enamel: distances_to_filled_cells(&grid, &shares_of(0)), depths, hollows }
    }

    /// Distance between the places at which the distances are kept, mm.
    pub(super) fn spacing(&self) -> f32 {
        self.grid.spacing.max_element()
    }

    /// Thickness of the enamel under a place, mm; not above 0 in dentine.
    pub fn enamel_under(&self, point_in_tooth: Vec3) -> f32 {
        self.grid.trilinear(&self.enamel, point_in_tooth)
    }

    /// Distance of a place to the tooth's surface, mm; not above 0 outside.
    pub fn depth_of(&self, point_in_tooth: Vec3) -> f32 {
        self.grid.trilinear(&self.depths, point_in_tooth)
    }

    /// Form of the surface at a place of it: 1 deep in a fissure, 0 where it is flat, −1 on the tip of a cusp.
    pub fn hollowness_at(&self, point_in_tooth: Vec3) -> f32 {
        self.grid.trilinear(&self.hollows, point_in_tooth)
    }
}

/// Form of the surface at each cell near it, by the matter around: as the neighbours' crowns are tinted.
fn hollows_of(grid: &Grid, outside: &[f32], depths: &[f32]) -> Vec<f32> {
    /// Depth up to which cells count, mm. Outside, those next to matter do.
    const NEAR: f32 = 0.6;
    let extent = grid.extent();
    // There is nothing beyond the grid, where values would be continued as they rise.
    let matter_at = |place: Vec3| match extent.contains(place) {
        true => 1.0 - grid.trilinear(outside, place).clamp(0.0, 1.0),
        false => 0.0,
    };
    let hollow = |i: usize| {
        let centre = grid.centre(grid.cell(i));
        let beside = |axis: usize| [-1.0, 1.0].map(|sign| centre + Vec3::AXES[axis] * (sign * grid.spacing[axis]));
        let is_far_outside = || (0..3).flat_map(beside).all(|place| grid.trilinear(outside, place) > 0.999);
        if depths[i] > NEAR || outside[i] > 0.999 && is_far_outside() {
            return 0.0;
        }
        let deeper = Vec3::from([0, 1, 2].map(|a| {
            let step = Vec3::AXES[a] * grid.spacing[a];
            grid.trilinear(depths, centre + step) - grid.trilinear(depths, centre - step)
        }));
        // Deeper in the tooth there is more matter around a place.
        let surface = centre - deeper.normalize_or_zero() * depths[i];
        hollowness(surface, matter_at)
    };
    par_map(grid.len(), hollow)
}

/// Distance from the middle of each cell of a grid to the border of what fills its cells by these shares, mm.
fn distances_to_filled_cells(grid: &Grid, shares: &[f32]) -> Vec<f32> {
    // The border runs through the nearest cell, the nearer the more of that is filled. Across an oblique
    // border, a fuller cell behind the nearest one may be closer.
    let spacing = libm::cbrtf(grid.spacing.element_product());
    let distance_to_cells_of = |least: f32| {
        let (distances, nearest) = distance::to_nearest(grid, |i| shares[i] > least);
        distances.into_iter().zip(nearest).map(|(distance, cell)| distance - (shares[cell as usize] - 0.5) * spacing)
    };
    let nearest = distance_to_cells_of(0.0).zip(distance_to_cells_of(0.5)).map(|(a, b)| a.min(b).min(THICKEST));
    smoothed(grid, nearest.collect())
}

/// Means of each value and its neighbours, with weights of a quarter, a half and a quarter along each axis.
fn smoothed(grid: &Grid, mut values: Vec<f32>) -> Vec<f32> {
    let [nx, ny, _] = grid.dims.map(|n| n as usize);
    for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        let last = grid.dims[axis] - 1;
        let mean = |i: usize| {
            let place = grid.cell(i)[axis];
            let (before, after) = (if place > 0 { i - stride } else { i }, if place < last { i + stride } else { i });
            0.25 * (values[before] + values[after]) + 0.5 * values[i]
        };
        values = (0..values.len()).map(mean).collect();
    }
    values
}

/// Shares of a cell of `edge` voxels along each axis that are matter under enamel, and no matter.
fn shares_of_cell(volume: &Volume, cell: [u32; 3], edge: u32, under_enamel: &[Label]) -> [f32; 2] {
    let grid = volume.grid();
    let [xs, ys, zs] = std::array::from_fn(|a| cell[a] * edge..((cell[a] + 1) * edge).min(grid.dims[a]));
    let (mut under, mut outside) = (0, 0);
    for [y, z] in zs.clone().flat_map(|z| ys.clone().map(move |y| [y, z])) {
        let row = grid.index([xs.start, y, z]);
        for i in row..row + xs.len() {
            under += u32::from(under_enamel.contains(&volume.tissue(i)));
            outside += u32::from(volume.tissue(i) == Label::AIR);
        }
    }
    let count = (xs.len() * ys.len() * zs.len()) as f32;
    [under, outside].map(|cells| cells as f32 / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_those_of_a_slab_at_every_size_of_voxels() {
        // Aim: continuous to a tenth of a millimetre. Method: dentine below a slanted border, measured along its normal; without
        // dentine the enamel is as thick as can be.
        let under = Label(2);
        let normal = Vec3::new(0.3, 0.1, 1.0).normalize();
        for spacing in [Vec3::splat(0.3), Vec3::splat(0.1), Vec3::splat(0.06), Vec3::new(0.1, 0.12, 0.25)] {
            let dims = std::array::from_fn(|a| ([6.0, 5.0, 7.0][a] / spacing[a]) as u32);
            let label = |p: Vec3| if p.dot(normal) < 0.0 { under } else { Label(1) };
            let volume = Volume::from_distance(Grid::centred(dims, spacing), 0.3, |p| (-1.0, label(p)));
            assert_eq!(UnworkedTooth::of(&volume, &[]).enamel_under(Vec3::ZERO), THICKEST);
            let depth = UnworkedTooth::of(&volume, &[under]);
            for i in 0..40 {
                let place = Vec3::new(0.02 * i as f32 - 0.4, 0.3, 0.05 * i as f32);
                let (measured, expected) = (depth.enamel_under(place), place.dot(normal));
                assert!(
                    (measured - expected).abs() < 0.1 + 0.2 * spacing.max_element(),
                    "{spacing}: {measured} for {expected}"
                );
            }
        }
    }

    #[test]
    fn depths_are_measured_from_the_surface() {
        // Aim: within a tenth of a millimetre, so that a cut is told from the tooth's own surface. Method: a ball of 3 mm.
        for spacing in [0.2, 0.1, 0.06] {
            let cells = (8.0 / spacing) as u32;
            let grid = Grid::centred([cells; 3], Vec3::splat(spacing));
            let ball = Volume::from_distance(grid, 2.0 * spacing, |p| (p.length() - 3.0, Label(1)));
            let unworked = UnworkedTooth::of(&ball, &[]);
            for i in 0..60 {
                let out = Vec3::new(0.3 + 0.01 * i as f32, 0.5 - 0.02 * i as f32, 0.7).normalize();
                for depth in [0.0, 0.1, 0.4, 1.0, 2.0] {
                    let measured = unworked.depth_of(out * (3.0 - depth));
                    assert!((measured - depth).abs() < 0.12, "{spacing}: {measured} for {depth}");
                }
            }
        }
    }

    #[test]
    fn fissures_flat_places_and_edges_are_told_apart() {
        // Aim: what stains is the fissure, and what is clear the edge, at every size of voxels. Method: a block with a V-shaped furrow of 1.2 mm in its top.
        // The second grid has no more room around it than that of a tooth.
        let grids = [0.2f32, 0.1, 0.06]
            .map(|spacing| [(8.0 / spacing) as u32, (6.0 / spacing) as u32 + 8].map(|n| (spacing, n)));
        for (number, (spacing, cells)) in grids.into_iter().flatten().enumerate() {
            let grid = Grid::centred([cells; 3], Vec3::splat(spacing));
            let furrow = |p: Vec3| (1.2 - p.x.abs()).max(0.0);
            let block = |p: Vec3| (p.abs() - 3.0).max_element().max((p.z - 3.0 + furrow(p)) * 0.7);
            let volume = Volume::from_distance(grid, 2.0 * spacing, |p| (block(p), Label(1)));
            let unworked = UnworkedTooth::of(&volume, &[]);
            let [deep, beside, side, edge] =
                [Vec3::Z * 1.8, Vec3::new(2.1, 0.0, 3.0), Vec3::new(3.0, 0.0, 0.0), Vec3::new(3.0, 0.0, 3.0)]
                    .map(|place| unworked.hollowness_at(place));
            let is_roomy = number % 2 == 0;
            assert!(deep > if is_roomy { 0.35 } else { 0.25 }, "{spacing}: {deep} in the furrow");
            assert!(beside.abs() < 0.1 && side.abs() < 0.1, "{spacing}: {beside} beside it, {side} on a side");
            assert!(edge < -0.2, "{spacing}: {edge} on an edge");
        }
    }
}
