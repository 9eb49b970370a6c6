//! Densities on the edges of cells: samples, slopes, and the places at which the surface crosses.
//!
//! Takes densities on a grid, which are zero beyond it. Gives places in tooth space, mm. Never joins them.

use crate::frame::Vec3;
use crate::volume::{CellBox, Density, Grid, ISO, Volume};

/// Range of cells of eight samples each, by their lowest sample: from `low` up to, but excluding, `end`.
#[derive(Clone, Copy)]
pub struct CellRange {
    pub low: [i32; 3],
    pub end: [i32; 3],
}

impl CellRange {
    pub fn around_matter(volume: &Volume) -> Option<CellRange> {
        let CellBox { low, high } = volume.bounding_box()?;
        Some(CellRange { low: low.map(|v| v as i32 - 1), end: high.map(|v| v as i32 + 1) })
    }
}

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

    /// The samples at both ends of the edge from one along an axis.
    #[inline(always)]
    pub fn ends(&self, start: [i32; 3], axis: usize) -> EdgeEnds {
        let end = shifted_sample(start, axis, 1);
        let is_within = (0..3).all(|a| start[a] > 0 && end[a] + 1 < self.grid.dims[a] as i32);
        if !is_within {
            return EdgeEnds([start, end].map(|sample| self.neighbours_at_border(sample)));
        }
        let first = self.grid.index(start.map(|v| v as u32));
        let next = first + self.strides()[axis];
        EdgeEnds([self.neighbours_within(first), self.neighbours_within(next)])
    }

    /// A sample with its neighbours.
    #[inline(always)]
    pub fn neighbours(&self, sample: [i32; 3]) -> Neighbours {
        let is_within = (0..3).all(|a| sample[a] > 0 && sample[a] + 1 < self.grid.dims[a] as i32);
        if !is_within {
            return self.neighbours_at_border(sample);
        }
        self.neighbours_within(self.grid.index(sample.map(|v| v as u32)))
    }

    /// The same where no neighbour lies beyond the grid, so that array offsets can be used.
    #[inline(always)]
    fn neighbours_within(&self, place: usize) -> Neighbours {
        let unit = |place: usize| self.densities[place].unit();
        let [x, y, z] = self.strides();
        let beside = [
            [unit(place - x), unit(place + x)],
            [unit(place - y), unit(place + y)],
            [unit(place - z), unit(place + z)],
        ];
        Neighbours { here: unit(place), beside }
    }

    /// Steps from a sample to the next along each axis, in the array.
    fn strides(&self) -> [usize; 3] {
        let [nx, ny, _] = self.grid.dims.map(|n| n as usize);
        [1, nx, nx * ny]
    }

    #[cold]
    fn neighbours_at_border(&self, sample: [i32; 3]) -> Neighbours {
        let beside = [0, 1, 2].map(|axis| [-1, 1].map(|steps| self.at(shifted_sample(sample, axis, steps))));
        Neighbours { here: self.at(sample), beside }
    }

    /// The place of a sample, tooth space, mm.
    pub fn place(&self, sample: [i32; 3]) -> Vec3 {
        self.grid.origin + Vec3::from(sample.map(|v| v as f32)) * self.grid.spacing
    }

    /// The surface on the edge from a sample along an axis, whose ends are on both sides of it.
    pub fn crossing(&self, start: [i32; 3], axis: usize) -> Crossing {
        let ends = self.ends(start, axis);
        let part = ends.crossing_part();
        let normal = ends.normal(part, self.grid.spacing).unwrap_or_else(|| ends.outward_along(axis));
        Crossing { position: self.place_along(start, axis, part), normal }
    }

    /// The place a part of the way from a sample to the next along an axis.
    pub fn place_along(&self, start: [i32; 3], axis: usize, part: f32) -> Vec3 {
        let mut steps = Vec3::from(start.map(|v| v as f32));
        steps[axis] += part;
        self.grid.origin + steps * self.grid.spacing
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

/// Densities of a sample and of those beside it.
#[derive(Clone, Copy)]
pub struct Neighbours {
    pub here: f32,
    /// The sample before and the one after, along each axis.
    pub beside: [[f32; 2]; 3],
}

impl Neighbours {
    /// Central differences, per mm.
    fn gradient(&self, spacing: Vec3) -> Vec3 {
        0.5 * Vec3::from(self.beside.map(|[below, above]| above - below)) / spacing
    }
}

/// Both ends of an edge.
#[derive(Clone, Copy)]
pub struct EdgeEnds(pub [Neighbours; 2]);

impl EdgeEnds {
    /// Part of the way at which the surface crosses the edge.
    pub fn crossing_part(&self) -> f32 {
        let [from, to] = self.0.map(|end| end.here);
        (ISO - from) / (to - from)
    }

    /// Outward unit normal a part of the way; `None` where the density does not change.
    pub fn normal(&self, part: f32, spacing: Vec3) -> Option<Vec3> {
        let [from, to] = self.0.map(|end| end.gradient(spacing));
        (-from.lerp(to, part)).try_normalize()
    }

    /// Direction from the solid end of an edge along an axis to the other.
    pub fn outward_along(&self, axis: usize) -> Vec3 {
        let [from, to] = self.0.map(|end| end.here);
        Vec3::AXES[axis] * (from - to).signum()
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
