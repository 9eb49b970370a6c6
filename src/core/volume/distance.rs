//! Exact Euclidean distances in mm, on grids with any spacing.
//!
//! Method: Felzenszwalb & Huttenlocher, *Distance Transforms of Sampled Functions* (2012): squared distances as the
//! lower envelope of parabolas, one axis after the other.

use crate::volume::Grid;

/// Squared distance of a voxel from an empty set.
const UNREACHED: f32 = f32::INFINITY;

/// Distance in mm from the centre of each voxel to the nearest voxel centre for which `is_inside` is true; infinite
/// if there is none.
pub fn to_set(grid: &Grid, mut is_inside: impl FnMut(usize) -> bool) -> Vec<f32> {
    let mut squared: Vec<f32> = (0..grid.len()).map(|i| if is_inside(i) { 0.0 } else { UNREACHED }).collect();
    transform(grid, &mut squared, None);
    squared.iter_mut().for_each(|d| *d = d.sqrt());
    squared
}

/// Distances as given by [`to_set`], and for each voxel the array index of the nearest inside voxel.
///
/// For an empty set every distance is infinite and the indices are meaningless.
pub fn to_nearest(grid: &Grid, mut is_inside: impl FnMut(usize) -> bool) -> (Vec<f32>, Vec<u32>) {
    let mut squared: Vec<f32> = (0..grid.len()).map(|i| if is_inside(i) { 0.0 } else { UNREACHED }).collect();
    let mut nearest: Vec<u32> = (0..grid.len() as u32).collect();
    transform(grid, &mut squared, Some(&mut nearest));
    squared.iter_mut().for_each(|d| *d = d.sqrt());
    (squared, nearest)
}

/// Signed distance in mm to the border of a set of voxels: negative inside, zero halfway between voxel centres.
pub fn signed(grid: &Grid, is_inside: impl Fn(usize) -> bool) -> Vec<f32> {
    let out = to_set(grid, &is_inside);
    let mut field = to_set(grid, |i| !is_inside(i));
    let half = 0.5 * grid.spacing.min_element();
    for (inward, outward) in field.iter_mut().zip(out) {
        *inward = if outward > 0.0 { outward - half } else { half - *inward };
    }
    field
}

fn transform(grid: &Grid, squared: &mut [f32], mut nearest: Option<&mut [u32]>) {
    let [nx, ny, nz] = grid.dims.map(|n| n as usize);
    let longest = nx.max(ny).max(nz);
    let mut scratch = EnvelopeScratch::with_capacity(longest);
    let strides = [1, nx, nx * ny];
    for axis in 0..3 {
        let (length, stride, spacing) = ([nx, ny, nz][axis], strides[axis], grid.spacing[axis]);
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        // The faster of the two other axes is innermost, so that neighbouring lines share cache lines.
        let (inner, outer) = if strides[a] < strides[b] { (a, b) } else { (b, a) };
        for o in 0..[nx, ny, nz][outer] {
            for i in 0..[nx, ny, nz][inner] {
                let start = o * strides[outer] + i * strides[inner];
                scratch.transform(squared, nearest.as_deref_mut(), StridedLine { start, stride, length, spacing });
            }
        }
    }
}

/// Position of one line of voxels in the array.
#[derive(Clone, Copy)]
struct StridedLine {
    start: usize,
    stride: usize,
    length: usize,
    /// mm
    spacing: f32,
}

/// Buffers for one line.
struct EnvelopeScratch {
    values: Vec<f32>,
    sources: Vec<u32>,
    /// Indices of the parabolas in the lower envelope.
    vertex: Vec<usize>,
    /// Coordinate from which on each of them is the lowest, mm.
    from: Vec<f32>,
}

impl EnvelopeScratch {
    fn with_capacity(longest: usize) -> EnvelopeScratch {
        EnvelopeScratch {
            values: vec![0.0; longest],
            sources: vec![0; longest],
            vertex: vec![0; longest],
            from: vec![0.0; longest + 1],
        }
    }

    fn transform(&mut self, squared: &mut [f32], mut nearest: Option<&mut [u32]>, line: StridedLine) {
        let StridedLine { start, stride, length, spacing } = line;
        let mut any = false;
        let mut all_zero = true;
        for i in 0..length {
            let value = squared[start + i * stride];
            self.values[i] = value;
            any |= value < UNREACHED;
            all_zero &= value == 0.0;
        }
        if !any || all_zero {
            return;
        }
        if let Some(nearest) = nearest.as_deref() {
            for i in 0..length {
                self.sources[i] = nearest[start + i * stride];
            }
        }
        let parabolas = self.lower_envelope(length, spacing);
        let mut k = 0;
        for i in 0..length {
            let x = i as f32 * spacing;
            while k + 1 < parabolas && self.from[k + 1] < x {
                k += 1;
            }
            let v = self.vertex[k];
            let step = (i as f32 - v as f32) * spacing;
            squared[start + i * stride] = step * step + self.values[v];
            if let Some(nearest) = nearest.as_deref_mut() {
                nearest[start + i * stride] = self.sources[v];
            }
        }
    }

    /// Computes the lower envelope of the parabolas; returns their number.
    fn lower_envelope(&mut self, length: usize, spacing: f32) -> usize {
        let mut count = 0;
        for i in 0..length {
            let value = self.values[i];
            if value == UNREACHED {
                continue;
            }
            let x = i as f32 * spacing;
            let mut from = f32::NEG_INFINITY;
            while count > 0 {
                let v = self.vertex[count - 1];
                let xv = v as f32 * spacing;
                from = ((value + x * x) - (self.values[v] + xv * xv)) / (2.0 * (x - xv));
                if from > self.from[count - 1] {
                    break;
                }
                count -= 1;
                from = f32::NEG_INFINITY;
            }
            self.vertex[count] = i;
            self.from[count] = from;
            count += 1;
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    /// Pseudo-random set of voxels, always the same.
    fn scatter(grid: &Grid) -> Vec<bool> {
        let mut state = 12345u32;
        (0..grid.len())
            .map(|_| {
                state = state.wrapping_mul(1664525).wrapping_add(1013904223);
                state >> 16 < 300
            })
            .collect()
    }

    #[test]
    fn distances_equal_a_search_over_all_pairs() {
        let grid = Grid::centred([19, 14, 23], Vec3::new(0.2, 0.35, 0.11));
        let inside = scatter(&grid);
        let (distance, nearest) = to_nearest(&grid, |i| inside[i]);
        let sources: Vec<Vec3> = grid.cells().zip(&inside).filter(|(_, b)| **b).map(|(c, _)| grid.centre(c)).collect();
        for (index, cell) in grid.cells().enumerate() {
            let here = grid.centre(cell);
            let expected = sources.iter().map(|s| s.distance(here)).fold(f32::INFINITY, f32::min);
            assert!((distance[index] - expected).abs() < 1e-4, "{cell:?}: {} {expected}", distance[index]);
            let to_named = grid.centre(grid.cell(nearest[index] as usize)).distance(here);
            assert!((to_named - expected).abs() < 1e-4 && inside[nearest[index] as usize]);
        }
    }

    #[test]
    fn an_empty_set_is_infinitely_far() {
        let grid = Grid::centred([4, 5, 6], Vec3::ONE);
        assert!(to_set(&grid, |_| false).iter().all(|d| d.is_infinite()));
        assert!(to_set(&grid, |_| true).iter().all(|&d| d == 0.0));
    }

    #[test]
    fn the_signed_distance_of_a_slab_is_its_depth() {
        let grid = Grid::centred([3, 3, 20], Vec3::splat(0.5));
        let field = signed(&grid, |i| grid.cell(i)[2] < 10);
        for (index, [_, _, z]) in grid.cells().enumerate() {
            assert_eq!(field[index], (z as f32 - 9.5) * 0.5);
        }
    }
}
