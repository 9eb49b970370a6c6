//! One ray: over empty bricks in strides, then in steps, then halving, to the surface.

use crate::raycast::{Hit, OrthographicCamera};
use typodont_core::frame::Vec3;
use typodont_core::volume::{BRICK, CellBox, Density, ISO, Volume};

/// Step within a surface, in voxels: even a single voxel is solid for longer than that.
const STEP: f32 = 0.8;

/// Step in empty space, in voxels: even a single voxel gives a density above zero over two voxels of a ray.
const STEP_IN_AIR: f32 = 1.6;

/// Share of a step that surely leads across a border between bricks, however numbers are rounded.
const NUDGE: f32 = 0.02;

/// Halvings of a step once the surface lies in it, and false positions after them: together a thousandth of a voxel.
const HALVINGS: u32 = 2;
const SECANTS: u32 = 2;

/// Distance from a point at which its gradient is sampled, in voxels along each axis.
const SMOOTHING: f32 = 0.8;

/// Follows rays that go straight away from a camera.
pub struct RayMarcher<'a> {
    volume: &'a Volume,
    camera: OrthographicCamera,
    /// The box that holds all matter, in voxel steps.
    low: Vec3,
    high: Vec3,
    /// Voxel steps per mm of ray.
    along: Vec3,
    /// mm
    step: f32,
    step_in_air: f32,
    /// Empty space: in bricks, and in half bricks.
    empty_blocks: [EmptyBlocks; 2],
}

impl<'a> RayMarcher<'a> {
    pub fn new(volume: &'a Volume, camera: OrthographicCamera) -> RayMarcher<'a> {
        let spacing = volume.grid().spacing;
        let CellBox { low, high } = volume.bounding_box().unwrap_or_default();
        let [low, high] = [low, high].map(|cell| Vec3::from(cell.map(|v| v as f32)));
        let along = -camera.back() / spacing;
        let pace = along.abs().max_element();
        let (low, high) = (low - 1.0, high + 1.0);
        let empty_blocks = [EmptyBlocks::bricks(volume), EmptyBlocks::halves(volume)];
        RayMarcher {
            volume,
            camera,
            low,
            high,
            along,
            step: STEP / pace,
            step_in_air: STEP_IN_AIR / pace,
            empty_blocks,
        }
    }

    /// First place at which the ray through a point of the camera's plane enters matter.
    pub fn cast(&self, point_in_tooth: Vec3) -> Option<Hit> {
        self.cast_beyond(point_in_tooth, f32::NEG_INFINITY)
    }

    /// The same if no matter is nearer to the camera's plane than `depth`, mm.
    pub fn cast_beyond(&self, point_in_tooth: Vec3, depth: f32) -> Option<Hit> {
        let start = self.volume.grid().from_tooth(point_in_tooth);
        let (near, far) = self.clip_to_matter(start)?;
        let mut near = near.max(depth - self.step);
        let mut before = near;
        while near < far {
            let at = start + self.along * near;
            if let Some(clear) = self.empty_distance(at) {
                before = near + clear;
                near = before + NUDGE * self.step;
                continue;
            }
            let density = self.volume.density_in_grid(at);
            if density >= ISO {
                return Some(self.refine_hit(start, before.min(near), near));
            }
            before = near;
            near += if density > 0.0 { self.step } else { self.step_in_air };
        }
        None
    }

    /// Part of the ray within the box of matter: begin and end, mm from the camera's plane; `None` if it misses the
    /// box.
    fn clip_to_matter(&self, start: Vec3) -> Option<(f32, f32)> {
        let (mut near, mut far) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let (from, pace) = (start[axis], self.along[axis]);
            if pace.abs() < 1e-9 {
                if from < self.low[axis] || from > self.high[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.low[axis] - from) / pace, (self.high[axis] - from) / pace);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near < far).then_some((near, far))
    }

    /// Length, mm, over which the ray stays in empty space; `None` near matter.
    fn empty_distance(&self, at: Vec3) -> Option<f32> {
        let dims = self.volume.grid().dims;
        let inside = |a: usize| at[a] >= 0.0 && at[a] < dims[a] as f32;
        if !(0..3).all(inside) {
            return None;
        }
        let voxel = [0, 1, 2].map(|a| at[a] as u32);
        let clear = self.empty_blocks.iter().find(|clear| clear.is_empty_at(voxel))?;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            let first = (voxel[axis] >> clear.bits << clear.bits) as f32;
            let pace = self.along[axis];
            if pace.abs() > 1e-9 {
                let room = if pace > 0.0 { first + (1u32 << clear.bits) as f32 - at[axis] } else { at[axis] - first };
                least = least.min(room / pace.abs());
            }
        }
        least.is_finite().then_some(least)
    }

    /// The surface between a place without and a place with matter.
    fn refine_hit(&self, start: Vec3, mut outside: f32, mut inside: f32) -> Hit {
        let density = |t: f32| self.volume.density_in_grid(start + self.along * t);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (outside + inside);
            if density(middle) >= ISO { inside = middle } else { outside = middle }
        }
        let (mut low, mut high) = (density(outside), density(inside));
        for _ in 0..SECANTS {
            let rise = high - low;
            let part = if rise > 1e-6 { ((ISO - low) / rise).clamp(0.05, 0.95) } else { 0.5 };
            let middle = outside + (inside - outside) * part;
            let value = density(middle);
            if value >= ISO { (inside, high) = (middle, value) } else { (outside, low) = (middle, value) }
        }
        let depth = 0.5 * (outside + inside);
        let grid = self.volume.grid();
        let point = grid.origin + (start + self.along * depth) * grid.spacing;
        let normal = self.normal(point).unwrap_or(self.camera.back());
        Hit { point, normal, depth, open: 1.0 }
    }

    /// Outward, from gradients around a point: stairs that carving along voxels leaves do not catch the light.
    fn normal(&self, point_in_tooth: Vec3) -> Option<Vec3> {
        let reach = SMOOTHING * self.volume.grid().spacing;
        let corners = [Vec3::ONE, Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0)];
        let gradient = |corner: Vec3| self.volume.density_and_gradient_at(point_in_tooth + corner * reach).1;
        (-corners.into_iter().map(gradient).sum::<Vec3>()).try_normalize()
    }
}

/// Cubes of voxels in which every place is empty. Between its last voxels and the next cube's a cube mixes with the next, so
/// those must be empty too.
struct EmptyBlocks {
    /// Voxels along one edge, as a power of two.
    bits: u32,
    dims: [u32; 3],
    is_empty: Vec<bool>,
}

impl EmptyBlocks {
    fn bricks(volume: &Volume) -> EmptyBlocks {
        let bricks = volume.bricks();
        let occupied: Vec<bool> = (0..bricks.len()).map(|b| bricks.is_occupied(cell(bricks.dims(), b))).collect();
        EmptyBlocks::around(BRICK.ilog2(), bricks.dims(), &occupied)
    }

    fn halves(volume: &Volume) -> EmptyBlocks {
        const EDGE: u32 = BRICK / 2;
        let [nx, ny, _] = volume.grid().dims;
        let dims = volume.grid().dims.map(|n| n.div_ceil(EDGE));
        let mut occupied = vec![false; dims.iter().map(|&n| n as usize).product()];
        for (row, values) in volume.densities().chunks_exact(nx as usize).enumerate() {
            let [y, z] = [row as u32 % ny, row as u32 / ny];
            let first = ((z / EDGE * dims[1] + y / EDGE) * dims[0]) as usize;
            for (cube, run) in occupied[first..].iter_mut().zip(values.chunks(EDGE as usize)) {
                *cube |= run.iter().any(|&d| d > Density::EMPTY);
            }
        }
        EmptyBlocks::around(EDGE.ilog2(), dims, &occupied)
    }

    fn around(bits: u32, dims: [u32; 3], occupied: &[bool]) -> EmptyBlocks {
        let mut is_empty: Vec<bool> = occupied.iter().map(|o| !o).collect();
        for (index, _) in occupied.iter().enumerate().filter(|(_, o)| **o) {
            let at = cell(dims, index);
            for before in 1..8 {
                let step: [u32; 3] = std::array::from_fn(|a| at[a].saturating_sub(before >> a & 1));
                is_empty[((step[2] * dims[1] + step[1]) * dims[0] + step[0]) as usize] = false;
            }
        }
        EmptyBlocks { bits, dims, is_empty }
    }

    fn is_empty_at(&self, voxel: [u32; 3]) -> bool {
        let [x, y, z] = voxel.map(|v| v >> self.bits);
        self.is_empty[((z * self.dims[1] + y) * self.dims[0] + x) as usize]
    }
}

fn cell([nx, ny, _]: [u32; 3], index: usize) -> [u32; 3] {
    let index = index as u32;
    [index % nx, index / nx % ny, index / (nx * ny)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raycast::ViewSide;
    use crate::raycast::phantom;

    #[test]
    fn rays_from_every_side_end_on_the_surface() {
        // Aim: within a hundredth of a voxel, also off the axes. Method: a ball, whose surface is known.
        let volume = phantom::ball([120, 90, 110], Vec3::new(0.1, 0.13, 0.1), 3.0);
        let mut cameras: Vec<OrthographicCamera> =
            ViewSide::ALL.map(|side| OrthographicCamera::framing_volume(side, &volume, 1.0)).to_vec();
        let right = Vec3::new(0.6, 0.0, -0.8);
        cameras.push(OrthographicCamera {
            middle: Vec3::ZERO,
            right,
            up: right.cross(Vec3::new(0.48, 0.8, 0.36)),
            half_height: 4.0,
        });
        for camera in cameras {
            let marcher = RayMarcher::new(&volume, camera);
            for (a, b) in [(0.0, 0.0), (1.0, 0.5), (-2.0, 1.5), (0.3, -2.5), (2.0, 2.1)] {
                let hit = marcher.cast(camera.middle + camera.right * a + camera.up * b).unwrap();
                assert!((hit.point.length() - 3.0).abs() < 0.01, "{camera:?} {a} {b}: {}", hit.point.length());
                assert!(hit.normal.dot(camera.back()) > 0.0);
            }
            assert_eq!(marcher.cast(camera.middle + camera.right * 3.2), None);
        }
    }
}
