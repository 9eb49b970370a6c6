//! Planes on which samples lie: where a density is a ramp, as the distance from a side of matter is.
//!
//! Takes densities on a grid. Gives each sample's plane, from those of its neighbours that lie on it as well, and looks
//! at each sample once. Never says which of them are the sides of an edge.

use super::density_grid::{CellRange, DensityGrid, Neighbours, shifted_sample};
use crate::frame::Vec3;
use crate::volume::ISO;

/// Bend up to which three samples lie on one plane, as a share of the density's slope there.
const PLANE_BEND_MAX: f32 = 0.25;

/// Deviation from the surface's density of samples whose planes are asked for: 1.2 voxels, beyond which the ramp's end is near.
const PLANE_DEPTH: f32 = 0.4;

/// Deviation of a plane's slope from that of the ramp, as a share. The distances of carved teeth are within a twentieth.
const PLANE_SLOPE_TOLERANCE: f32 = 0.1;

/// Layers of samples that are kept: those within reach of the edges of a cell and of the cells around it.
pub const LAYERS: usize = 8;

/// A density that rises evenly.
#[derive(Clone, Copy, Debug, Default)]
pub struct EvenDensity {
    /// Value at the sample from which offsets are measured.
    pub value: f32,
    /// Per mm.
    pub slope: Vec3,
}

impl EvenDensity {
    /// Density at an offset, mm.
    pub fn at(&self, offset: Vec3) -> f32 {
        self.value + self.slope.dot(offset)
    }

    /// The density at a sample on a plane of a ramp, whose slope is given per mm.
    fn around(field: &DensityGrid, sample: [i32; 3], plane_slope: f32) -> Option<EvenDensity> {
        if (field.at(sample) - ISO).abs() > PLANE_DEPTH {
            return None;
        }
        let is_within = |density: f32| density > 0.0 && density < 1.0;
        let Neighbours { here: value, beside } = field.neighbours(sample);
        let mut slope = Vec3::ZERO;
        for (axis, [below, above]) in beside.into_iter().enumerate() {
            let limit = PLANE_BEND_MAX * plane_slope * field.grid.spacing[axis];
            let is_even = is_within(below) && is_within(above) && (below - 2.0 * value + above).abs() <= limit;
            // On one side only, if the density goes on evenly there until the ramp ends.
            let goes_on = |near: f32, steps: i32| {
                let expected = (2.0 * near - value).clamp(0.0, 1.0);
                is_within(near) && (field.at(shifted_sample(sample, axis, steps)) - expected).abs() <= limit
            };
            let rise = match is_even {
                true => 0.5 * (above - below),
                false => match (goes_on(below, -2), goes_on(above, 2)) {
                    (true, false) => value - below,
                    (false, true) => above - value,
                    _ => return None,
                },
            };
            slope[axis] = rise / field.grid.spacing[axis];
        }
        let is_ramp = (slope.length() / plane_slope - 1.0).abs() < PLANE_SLOPE_TOLERANCE;
        is_ramp.then_some(EvenDensity { value, slope })
    }
}

/// The plane on which a sample lies.
#[derive(Clone, Copy, Debug)]
pub struct SamplePlane {
    /// Density, with offsets measured from the sample.
    pub density: EvenDensity,
    /// Unit normal into matter.
    pub inward: Vec3,
}

/// Planes of the samples around a range of cells, found when they are first asked for. The cells are asked for in the
/// order of their z, so that the last few layers are enough.
pub struct SamplePlanes {
    /// Slope of the density at a plane, per mm.
    slope: f32,
    /// Lowest sample along x and y.
    low: [i32; 2],
    samples: [usize; 2],
    /// The layer that is kept at each place.
    layers: [i32; LAYERS],
    planes: Vec<Known>,
}

/// Knowledge of one sample.
#[derive(Clone, Copy)]
enum Known {
    Nothing,
    NoPlane,
    Plane(SamplePlane),
}

impl SamplePlanes {
    /// Planes of samples up to a number of steps beyond cells.
    pub fn new(cells: &CellRange, margin: i32, slope: f32) -> SamplePlanes {
        let low = [0, 1].map(|a| cells.low[a] - margin);
        let samples = [0, 1].map(|a| (cells.end[a] + margin - low[a]) as usize + 1);
        SamplePlanes { slope, low, samples, layers: [i32::MIN; LAYERS], planes: Vec::new() }
    }

    /// The plane on which a sample lies, if it does.
    #[inline]
    pub fn at(&mut self, field: &DensityGrid, sample: [i32; 3]) -> Option<&SamplePlane> {
        let [x, y, z] = sample;
        let layer = z.rem_euclid(LAYERS as i32) as usize;
        if self.layers[layer] != z {
            self.clear(layer);
            self.layers[layer] = z;
        }
        let [nx, ny] = self.samples;
        let known = &mut self.planes[(layer * ny + (y - self.low[1]) as usize) * nx + (x - self.low[0]) as usize];
        if let Known::Nothing = known {
            *known = match EvenDensity::around(field, sample, self.slope) {
                Some(density) => Known::Plane(SamplePlane { density, inward: density.slope.normalize() }),
                None => Known::NoPlane,
            };
        }
        match known {
            Known::Plane(plane) => Some(plane),
            _ => None,
        }
    }

    #[cold]
    fn clear(&mut self, layer: usize) {
        let count = self.samples[0] * self.samples[1];
        self.planes.resize(LAYERS * count, Known::Nothing);
        self.planes[layer * count..][..count].fill(Known::Nothing);
    }
}
