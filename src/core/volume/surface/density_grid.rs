//! Densities on the edges of cells: samples, slopes, and the places at which the surface crosses.
//!
//! Takes densities on a grid, which are zero beyond it. Gives places in tooth space, mm. Never joins them.

use crate::frame::Vec3;
use crate::volume::{Density, Grid, ISO, Volume};

/// Densities on a grid, zero beyond it.
#[derive(Clone, Copy)]
pub struct DensityGrid<'a> {
    pub grid: &'a Grid,
    pub densities: &'a [Density],
}

impl<'a> DensityGrid<'a> {
    pub fn of(volume: &'a Volume) -> DensityGrid<'a> {
        DensityGrid { grid: volume.grid(), densities: volume.densities() }
    }

    pub fn at(&self, sample: [i32; 3]) -> f32 {
        let is_inside = (0..3).all(|a| sample[a] >= 0 && (sample[a] as u32) < self.grid.dims[a]);
        if is_inside { self.densities[self.grid.index(sample.map(|v| v as u32))].unit() } else { 0.0 }
    }

    /// Density and gradient (central differences per mm) at both ends of the edge from a sample along an axis.
    fn edge_samples(&self, start: [i32; 3], axis: usize) -> [(f32, Vec3); 2] {
        let end = shifted_sample(start, axis, 1);
        let last = self.grid.dims.map(|n| n as i32 - 1);
        let is_within = (0..3).all(|a| start[a] > 0 && end[a] < last[a]);
        if !is_within {
            return [start, end].map(|sample| {
                let along =
                    |axis: usize| self.at(shifted_sample(sample, axis, 1)) - self.at(shifted_sample(sample, axis, -1));
                (self.at(sample), self.per_mm(Vec3::new(along(0), along(1), along(2))))
            });
        }
        // No neighbour lies beyond the grid, so array offsets can be used.
        let [nx, ny, _] = self.grid.dims.map(|n| n as usize);
        let steps = [1, nx, nx * ny];
        let first = self.grid.index(start.map(|v| v as u32));
        let unit = |place: usize| self.densities[place].unit();
        [first, first + steps[axis]].map(|place| {
            let across = Vec3::new(
                unit(place + 1) - unit(place - 1),
                unit(place + nx) - unit(place - nx),
                unit(place + nx * ny) - unit(place - nx * ny),
            );
            (unit(place), self.per_mm(across))
        })
    }

    /// The place of a sample, tooth space, mm.
    pub fn place(&self, sample: [i32; 3]) -> Vec3 {
        self.grid.origin + Vec3::from(sample.map(|v| v as f32)) * self.grid.spacing
    }

    /// The surface on the edge from a sample along an axis, whose ends are on both sides of it.
    pub fn crossing(&self, start: [i32; 3], axis: usize) -> Crossing {
        let [(from, slope_from), (to, slope_to)] = self.edge_samples(start, axis);
        let part = (ISO - from) / (to - from);
        // If the gradient vanishes, the edge gives the outward direction.
        let out_along_edge = Vec3::AXES[axis] * (from - to).signum();
        let normal = (-slope_from.lerp(slope_to, part)).try_normalize().unwrap_or(out_along_edge);
        Crossing { position: self.place_along(start, axis, part), normal }
    }

    /// Part of the way along an edge at which the surface crosses it.
    pub fn crossing_part(&self, start: [i32; 3], axis: usize) -> f32 {
        let around = self.around(start, 1);
        let (from, to) = (around.at(axis, 0), around.at(axis, 1));
        (ISO - from) / (to - from)
    }

    /// Outward unit normal a part of the way along an edge; `None` where the density does not change.
    pub fn normal(&self, start: [i32; 3], axis: usize, part: f32) -> Option<Vec3> {
        let [(_, from), (_, to)] = self.edge_samples(start, axis);
        (-from.lerp(to, part)).try_normalize()
    }

    /// The samples around one, up to a number of steps along each axis.
    #[inline]
    pub fn around(&self, sample: [i32; 3], steps: i32) -> SamplesAround<'a> {
        let is_within = (0..3).all(|a| sample[a] >= steps && sample[a] + steps < self.grid.dims[a] as i32);
        SamplesAround { field: *self, sample, index: is_within.then(|| self.grid.index(sample.map(|v| v as u32))) }
    }

    /// The place a part of the way from a sample to the next along an axis.
    pub fn place_along(&self, start: [i32; 3], axis: usize, part: f32) -> Vec3 {
        let mut steps = Vec3::from(start.map(|v| v as f32));
        steps[axis] += part;
        self.grid.origin + steps * self.grid.spacing
    }

    fn per_mm(&self, across: Vec3) -> Vec3 {
        0.5 * across / self.grid.spacing
    }

    /// Sets one bit per sample of a row: 1 if solid.
    pub fn row(&self, low: i32, y: i32, z: i32, bits: &mut [u64], count: usize) {
        bits.fill(0);
        let [nx, ny, nz] = self.grid.dims.map(|n| n as i32);
        if y < 0 || z < 0 || y >= ny || z >= nz {
            return;
        }
        let row = self.grid.index([0, y as u32, z as u32]);
        let first = low.max(0);
        let last = (low + count as i32).min(nx);
        let values = &self.densities[row + first as usize..row + last as usize];
        let mut at = (first - low) as usize;
        let (eights, rest) = values.as_chunks::<8>();
        for eight in eights {
            let solid = solid_bits(eight);
            bits[at / 64] |= solid << (at % 64);
            if at % 64 > 56 {
                bits[at / 64 + 1] |= solid >> (64 - at % 64);
            }
            at += 8;
        }
        for density in rest {
            bits[at / 64] |= u64::from(density.is_solid()) << (at % 64);
            at += 1;
        }
    }
}

/// One bit per density: its highest bit, gathered by one multiplication.
fn solid_bits(eight: &[Density; 8]) -> u64 {
    let highest = u64::from_le_bytes(eight.map(Density::bits)) & 0x8080_8080_8080_8080;
    (highest >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// The sample some steps from another along an axis.
pub fn shifted_sample(mut sample: [i32; 3], axis: usize, steps: i32) -> [i32; 3] {
    sample[axis] += steps;
    sample
}

/// Densities of a sample and those in line with it along the axes.
pub struct SamplesAround<'a> {
    field: DensityGrid<'a>,
    sample: [i32; 3],
    /// Array index of the sample, if none of them lies beyond the grid.
    index: Option<usize>,
}

impl SamplesAround<'_> {
    /// Density some steps along an axis.
    #[inline]
    pub fn at(&self, axis: usize, steps: i32) -> f32 {
        match self.index {
            Some(index) => {
                let [nx, ny, _] = self.field.grid.dims.map(|n| n as isize);
                let stride = [1, nx, nx * ny][axis];
                self.field.densities[index.wrapping_add_signed(steps as isize * stride)].unit()
            }
            None => self.field.at(shifted_sample(self.sample, axis, steps)),
        }
    }
}

/// A place on the surface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Tooth space, mm.
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
}
