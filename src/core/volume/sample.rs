//! Density between voxel centres: trilinear values, and gradients smooth enough for haptics.

use crate::aabb::Aabb;
use crate::frame::Vec3;
use crate::volume::{Density, ISO, Volume};

/// Maximum length of a ray, mm: more than the distance of any viewpoint.
pub const RAY_LENGTH_MAX: f32 = 700.0;

impl Volume {
    /// Returns the first point of matter along a ray and the outward unit normal there; tooth space, mm. `along` is a
    /// unit vector.
    pub fn raycast(&self, from: Vec3, along: Vec3) -> Option<(Vec3, Vec3)> {
        let step = 0.5 * self.grid().spacing.min_element();
        let Aabb { low, high } = self.grid().extent();
        // The search begins at the point at which the ray enters the grid.
        let (a, b) = ((low - from) / along, (high - from) / along);
        let enters = a.min(b).max_element().max(0.0);
        let leaves = a.max(b).min_element().min(RAY_LENGTH_MAX);
        let steps = ((leaves - enters).max(0.0) / step) as u32;
        let point = |i: u32| from + along * (enters + i as f32 * step);
        let hit = (0..steps).map(point).find(|&p| self.density_at(p) >= ISO)?;
        let outward = -self.density_and_gradient_at(hit).1;
        Some((hit, outward.normalize_or(-along)))
    }
}

impl Volume {
    /// Trilinear density (0–1) at a point in tooth space; zero outside the grid.
    #[inline]
    pub fn density_at(&self, point_in_tooth: Vec3) -> f32 {
        self.density_in_grid(self.grid().from_tooth(point_in_tooth))
    }

    /// Radius, mm, around a point in tooth space that is guaranteed to be free of matter; 0 where matter may be near. A coarse
    /// bound that costs one look-up.
    pub fn clear_radius(&self, point_in_tooth: Vec3) -> f32 {
        let grid = self.grid();
        let Aabb { low, high } = grid.extent();
        let nearest_inside = point_in_tooth.clamp(low, high);
        let outside_squared = nearest_inside.distance_squared(point_in_tooth);
        if outside_squared > 0.0 {
            // Interpolation reaches one voxel beyond the last centre.
            return (outside_squared.sqrt() - grid.spacing.max_element()).max(0.0);
        }
        match grid.nearest(point_in_tooth) {
            Some(cell) => {
                // One step less: the point may be half a voxel off the centre of its cell, and the surface half a
                // voxel nearer.
                let steps = self.bricks().clear_steps(cell).saturating_sub(1);
                steps as f32 * grid.spacing.min_element()
            }
            None => 0.0,
        }
    }

    /// Signed distance of a point in tooth space from the surface, mm, negative inside: accurate within the half band, and beyond it
    /// nearer to zero than the true distance.
    pub fn distance_bound(&self, point_in_tooth: Vec3) -> f32 {
        let band = self.half_band();
        let density = self.density_at(point_in_tooth);
        if density > 0.0 { (ISO - density) * 2.0 * band } else { self.clear_radius(point_in_tooth).max(band) }
    }

    /// Trilinear density at a point given in voxel steps; zero outside the grid.
    #[inline]
    pub fn density_in_grid(&self, at: Vec3) -> f32 {
        let [nx, ny, nz] = self.grid().dims;
        // Written so that a NaN counts as outside.
        let inside = at.x >= 0.0
            && at.y >= 0.0
            && at.z >= 0.0
            && at.x < (nx - 1) as f32
            && at.y < (ny - 1) as f32
            && at.z < (nz - 1) as f32;
        if !inside {
            return self.density_at_edge(at);
        }
        let ([x, y, z], f) = cell_and_fraction(at);
        let (row, slice) = (nx as usize, nx as usize * ny as usize);
        let cube = &self.densities()[z * slice + y * row + x..];
        let pair = |start: usize| {
            let pair = &cube[start..start + 2];
            [pair[0].bits(), pair[1].bits()]
        };
        let pairs = [pair(0), pair(row), pair(slice), pair(slice + row)];
        if pairs == [[0; 2]; 4] {
            return 0.0;
        }
        // Four values at a time, which the compiler vectorises.
        let [low, high] = [0, 1].map(|end| pairs.map(|p| f32::from(p[end])));
        let along_x: [f32; 4] = std::array::from_fn(|i| mix(low[i], high[i], f.x));
        let near = mix(along_x[0], along_x[1], f.y);
        let far = mix(along_x[2], along_x[3], f.y);
        mix(near, far, f.z) * (1.0 / 255.0)
    }

    /// Density and its gradient (per mm) at a point in tooth space.
    ///
    /// The gradient is the trilinear interpolation of central differences: unlike the exact derivative of the
    /// trilinear density, it has no steps at voxel borders, which a hand would feel.
    pub fn density_and_gradient_at(&self, point_in_tooth: Vec3) -> (f32, Vec3) {
        let at = self.grid().from_tooth(point_in_tooth);
        let [nx, ny, nz] = self.grid().dims;
        let inside = at.x >= 1.0
            && at.y >= 1.0
            && at.z >= 1.0
            && at.x < (nx - 2) as f32
            && at.y < (ny - 2) as f32
            && at.z < (nz - 2) as f32;
        if !inside {
            return self.density_and_gradient_at_edge(at);
        }
        let ([x, y, z], f) = cell_and_fraction(at);
        let (row, slice) = (nx as usize, nx as usize * ny as usize);
        let corner = (z - 1) * slice + (y - 1) * row + x - 1;
        let block = &self.densities()[corner..];
        let run = |j: usize, k: usize| {
            let start = j * row + k * slice;
            let run = &block[start..start + 4];
            [run[0], run[1], run[2], run[3]].map(|d| f32::from(d.bits()))
        };
        // Along x: value and central difference between the two middle voxels of a row.
        let level = |[_, b, c, _]: [f32; 4]| mix(b, c, f.x);
        let rise = |[a, b, c, d]: [f32; 4]| mix(c - a, d - b, f.x);
        let middle = [run(1, 1), run(2, 1), run(1, 2), run(2, 2)];
        let [m0, m1, m2, m3] = middle.map(level);
        let rises = middle.map(rise);
        let near = [level(run(0, 1)), m0, m1, level(run(3, 1))];
        let far = [level(run(0, 2)), m2, m3, level(run(3, 2))];
        let front = [level(run(1, 0)), level(run(2, 0))];
        let back = [level(run(1, 3)), level(run(2, 3))];
        let value = mix(mix(near[1], near[2], f.y), mix(far[1], far[2], f.y), f.z);
        let along_x = mix(mix(rises[0], rises[1], f.y), mix(rises[2], rises[3], f.y), f.z);
        let along_y =
            mix(mix(near[2] - near[0], near[3] - near[1], f.y), mix(far[2] - far[0], far[3] - far[1], f.y), f.z);
        let along_z = mix(
            mix(far[1], far[2], f.y) - mix(front[0], front[1], f.y),
            mix(back[0], back[1], f.y) - mix(near[1], near[2], f.y),
            f.z,
        );
        let unit = 1.0 / 255.0;
        (value * unit, Vec3::new(along_x, along_y, along_z) * (0.5 * unit) / self.grid().spacing)
    }

    /// Density and gradient near the border of the grid, by central differences of the density itself.
    #[cold]
    fn density_and_gradient_at_edge(&self, at: Vec3) -> (f32, Vec3) {
        let along = |axis: Vec3| 0.5 * (self.density_in_grid(at + axis) - self.density_in_grid(at - axis));
        let slope = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
        (self.density_in_grid(at), slope / self.grid().spacing)
    }

    /// Density of the voxel at whole steps; zero outside the grid.
    fn density_at_steps(&self, steps: Vec3) -> Density {
        let [nx, ny, nz] = self.grid().dims.map(|n| n as f32);
        let inside = steps.x >= 0.0 && steps.y >= 0.0 && steps.z >= 0.0 && steps.x < nx && steps.y < ny && steps.z < nz;
        match inside {
            true => self.densities()[self.grid().index([steps.x as u32, steps.y as u32, steps.z as u32])],
            false => Density::EMPTY,
        }
    }

    /// Trilinear density of a cell that may lie partly outside the grid.
    #[cold]
    fn density_at_edge(&self, at: Vec3) -> f32 {
        // Beyond the last cells all eight voxels are missing. Written so that a NaN passes and is caught below.
        let [nx, ny, nz] = self.grid().dims.map(|n| n as f32);
        if at.x <= -1.0 || at.y <= -1.0 || at.z <= -1.0 || at.x >= nx || at.y >= ny || at.z >= nz {
            return 0.0;
        }
        let base = at.floor();
        let f = at - base;
        let corner = |x: f32, y: f32, z: f32| self.density_at_steps(base + Vec3::new(x, y, z)).unit();
        let along_x = |y: f32, z: f32| mix(corner(0.0, y, z), corner(1.0, y, z), f.x);
        let value =
            mix(mix(along_x(0.0, 0.0), along_x(1.0, 0.0), f.y), mix(along_x(0.0, 1.0), along_x(1.0, 1.0), f.y), f.z);
        if value.is_finite() { value } else { 0.0 }
    }
}

/// Voxel at the lower corner of the cell around a point within the grid (in voxel steps), and the fractional position
/// of the point in the cell.
///
/// Converts by way of `i32`, for which processors need one instruction each way; `usize` needs a dozen.
#[inline]
fn cell_and_fraction(at: Vec3) -> ([usize; 3], Vec3) {
    let [x, y, z] = at.to_array().map(|v| v as i32);
    ([x as usize, y as usize, z as usize], at - Vec3::new(x as f32, y as f32, z as f32))
}

#[inline]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    #[test]
    fn the_surface_of_a_ball_is_where_geometry_says() {
        // Aim: iso crossing within 0.005 mm, normal within 0.6°. Method: a ball on a grid with unequal spacings.
        let spacing = Vec3::new(0.1, 0.15, 0.12);
        let volume = phantom::ball([100, 70, 90], spacing, 3.0);
        let mut worst_angle = 0.0f32;
        for i in 0..500 {
            let (u, v) = (i as f32 * 0.618034 % 1.0, (i as f32 + 0.5) / 500.0);
            let (z, turn) = (1.0 - 2.0 * v, u * std::f32::consts::TAU);
            let direction = Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z);
            let (density, gradient) = volume.density_and_gradient_at(direction * 3.0);
            let off = (density - 0.5) / gradient.length();
            assert!(off.abs() < 0.005, "surface off by {off} mm at {direction}");
            worst_angle = worst_angle.max(gradient.angle_between(-direction).to_degrees());
        }
        assert!(worst_angle < 0.6, "{worst_angle}°");
    }

    #[test]
    fn outside_the_grid_is_empty_and_the_border_is_continuous() {
        let mut volume = phantom::ball([8, 8, 8], Vec3::ONE, 1.0);
        for index in 0..volume.grid().len() {
            volume.set(index, crate::volume::Voxel { density: Density::FULL, label: crate::volume::Label(1) });
        }
        for (x, expected) in [(-1.0, 0.0), (-0.5, 0.5), (0.0, 1.0), (7.0, 1.0), (7.25, 0.75), (8.0, 0.0), (1e9, 0.0)] {
            let density = volume.density_in_grid(Vec3::new(x, 3.5, 3.5));
            assert!((density - expected).abs() < 1e-6, "x {x}: {density}");
        }
        assert_eq!(volume.density_in_grid(Vec3::new(f32::NAN, 1.0, 1.0)), 0.0);
    }

    #[test]
    fn a_sample_has_the_very_bits_of_the_formula() {
        // Aim: recordings replay bit for bit, however sampling is optimised. Method: noise with much empty space,
        // compared with the formula written out corner by corner, in and around the grid.
        let grid = crate::volume::Grid::centred([9, 12, 10], Vec3::new(0.1, 0.2, 0.3));
        let mut volume = phantom::ball(grid.dims, grid.spacing, 0.1);
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for index in 0..grid.len() {
            let density = if random() > 0.8 { Density::from_unit(random()) } else { Density::EMPTY };
            volume.set(index, crate::volume::Voxel { density, label: crate::volume::Label(1) });
        }
        let (mut empty, mut filled) = (0, 0);
        for _ in 0..20_000 {
            let at = Vec3::new(random() * 12.0 - 2.0, random() * 15.0 - 2.0, random() * 13.0 - 2.0);
            let is_inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(Vec3::new(8.0, 11.0, 9.0)).all();
            let (base, unit) = (at.floor(), if is_inside { 1.0 } else { 1.0 / 255.0 });
            let f = at - base;
            let corner = |x, y, z| f32::from(volume.density_at_steps(base + Vec3::new(x, y, z)).bits()) * unit;
            let along_x = |y, z| mix(corner(0.0, y, z), corner(1.0, y, z), f.x);
            let along_y = |z| mix(along_x(0.0, z), along_x(1.0, z), f.y);
            let whole = mix(along_y(0.0), along_y(1.0), f.z);
            let expected: f32 = if is_inside { whole * (1.0 / 255.0) } else { whole };
            assert_eq!(volume.density_in_grid(at).to_bits(), expected.to_bits(), "{at}");
            *(if expected > 0.0 { &mut filled } else { &mut empty }) += 1;
        }
        assert!(empty > 1000 && filled > 1000, "{empty} empty, {filled} filled");
    }

    #[test]
    fn both_ways_of_sampling_agree() {
        let volume = phantom::ball([30, 30, 30], Vec3::splat(0.2), 2.0);
        for i in 0..2000 {
            let t = i as f32;
            let p = Vec3::new((t * 0.37).sin(), (t * 0.73).cos(), (t * 0.11).sin()) * 3.2;
            let plain = volume.density_at(p);
            let (value, _) = volume.density_and_gradient_at(p);
            assert!((plain - value).abs() < 1e-5, "{p}: {plain} {value}");
        }
    }
}
