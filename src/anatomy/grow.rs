//! Generation of voxels from a form.

use crate::TissueLabels;
use crate::blend::mix;
use crate::form::ToothForm;
use crate::occlusal_surface::HeightSample;
use crate::tooth_sdf::{SdfColumn, SdfLevel, SurfaceDistances, ToothSdf};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::parallel;
use typodont_core::volume::{Density, Grid, Label, Volume, density_at_distance};

/// Half-width of the density ramp across the surface, voxels: a smooth tactile surface needs a ramp of three voxels.
const HALF_BAND_VOXELS: f32 = 1.5;

/// Number of empty voxels around a tooth on its own grid.
const MARGIN: u32 = 4;

/// Spacing of nodes below which a form need not be sampled, mm. Between nodes at this spacing h, the sharpest detail,
/// the bottom of a fissure with a radius r of 0.1 mm, is at most h²/8r = 0.023 mm too shallow: two thirds of a voxel if
/// four share a cell, one third if two do.
const FINEST: f32 = 0.135;

/// Edge length of the blocks that are skipped or filled as a whole, voxels.
const BLOCK: usize = 8;

/// Maximum gradient of a shape's distances on the way out of a block, mm per mm: at 1.2 a few voxels of a molar begin
/// to be missed; values above 1.6 only take more time.
const STEEPEST: f32 = 1.6;

/// Number of half-bands outside the surface at which all corners of a cell must lie for the cell to be empty:
/// [`STEEPEST`], by which a distance may be overestimated, plus a margin for rounding.
const CLEAR: f32 = 1.01 * STEEPEST;

/// Distance to each side over which the inclination of the occlusal surface is measured, mm: the slope of a cusp is
/// relevant, not that of a groove.
const TILT: f32 = 0.4;

/// Minimum thickness of enamel, voxels: from √3 on, a layer of any orientation is connected face to face.
const THINNEST: f32 = 1.75;

/// Returns the smallest grid of a spacing (mm) that contains a tooth of this form.
pub fn grid_of_spacing(form: &ToothForm, spacing: f32) -> Grid {
    let Aabb { low, high } = ToothSdf::new(form, 0.0).bounds();
    let grid = Grid::covering(low, high, Vec3::splat(spacing), MARGIN);
    // A mirror image on the mirrored grid has the same voxels in reverse order.
    if form.is_mirrored { mirrored(grid) } else { grid }
}

/// Returns the finest grid of the given dimensions (voxels) that contains a tooth of this form, with the tooth at its
/// centre.
pub fn grid_fitting(form: &ToothForm, dims: [u32; 3]) -> Grid {
    let Aabb { low, high } = bounds(form);
    let steps = Vec3::from(dims.map(|n| n.saturating_sub(2 * MARGIN + 1).max(1) as f32));
    let spacing = ((high - low) / steps).max_element();
    let centred = Grid::centred(dims, Vec3::splat(spacing));
    Grid { origin: centred.origin + 0.5 * (low + high), ..centred }
}

/// Generates a tooth on a grid in tooth space; parts outside the grid are omitted.
pub fn grow(form: &ToothForm, grid: Grid, tissues: &TissueLabels) -> Volume {
    grow_with_ramp(form, grid, tissues, HALF_BAND_VOXELS)
}

/// [`grow`] with a density ramp of another half-width, voxels: a wide one gives smooth normals on a coarse grid.
pub fn grow_with_ramp(form: &ToothForm, grid: Grid, tissues: &TissueLabels, half_band_voxels: f32) -> Volume {
    let shape = ToothSdf::new(form, THINNEST * grid.spacing.max_element());
    let own_grid = if form.is_mirrored { mirrored(grid) } else { grid };
    let voxelizer = ToothVoxelizer::new(own_grid, tissues, half_band_voxels);
    let band = voxelizer.half_band;
    let (mut density, mut label) = voxelizer.fill(&shape);
    if form.is_mirrored {
        reverse_rows(&grid, &mut density);
        reverse_rows(&grid, &mut label);
    }
    Volume::new(grid, band, density, label, tissues.dentine)
}

/// Returns a box around a form's tooth, tooth space, mm.
fn bounds(form: &ToothForm) -> Aabb {
    let bounds = ToothSdf::new(form, 0.0).bounds();
    match form.is_mirrored {
        true => Aabb::new(bounds.low.with_y(-bounds.high.y), bounds.high.with_y(-bounds.low.y)),
        false => bounds,
    }
}

/// Returns the grid that is the mirror image (−y for y) of a grid.
fn mirrored(grid: Grid) -> Grid {
    let last = grid.origin.y + (grid.dims[1] - 1) as f32 * grid.spacing.y;
    Grid { origin: grid.origin.with_y(-last), ..grid }
}

/// Reverses the order of the rows in every level.
fn reverse_rows<T>(grid: &Grid, voxels: &mut [T]) {
    let [nx, ny, _] = grid.dims.map(|n| n as usize);
    for level in voxels.chunks_mut(nx * ny) {
        for row in 0..ny / 2 {
            let (front, back) = level.split_at_mut((ny - 1 - row) * nx);
            front[row * nx..][..nx].swap_with_slice(&mut back[..nx]);
        }
    }
}

/// Points at which a shape is sampled: the corners of cells of `step` voxels in each direction.
struct NodeGrid {
    /// Voxels per cell along each axis: 1, 2 or 4.
    step: usize,
    /// Number of nodes along x and y, over all blocks.
    count: [usize; 2],
    /// Position of node 0, tooth space, mm.
    origin: Vec3,
    /// Distance between nodes, mm.
    spacing: Vec3,
}

impl NodeGrid {
    fn over(grid: &Grid) -> NodeGrid {
        let voxel = grid.spacing.max_element();
        let step = [4, 2].into_iter().find(|&step| voxel * step as f32 <= FINEST).unwrap_or(1);
        let count = [0, 1].map(|axis| grid.dims[axis].div_ceil(BLOCK as u32) as usize * (BLOCK / step) + 1);
        NodeGrid { step, count, origin: grid.origin - 0.5 * grid.spacing, spacing: grid.spacing * step as f32 }
    }

    /// Returns the number of cells along an edge of a block.
    fn per_block(&self) -> usize {
        BLOCK / self.step
    }

    fn place(&self, i: usize, j: usize) -> [f32; 2] {
        [self.origin.x + i as f32 * self.spacing.x, self.origin.y + j as f32 * self.spacing.y]
    }

    fn height(&self, k: usize) -> f32 {
        self.origin.z + k as f32 * self.spacing.z
    }

    /// Returns every column of nodes, x fastest.
    fn columns(&self, shape: &ToothSdf) -> Vec<SdfColumn> {
        let [nx, ny] = self.count;
        let Aabb { low, high } = shape.bounds();
        let matters = |[x, y]: [f32; 2]| x > low.x - 1.0 && x < high.x + 1.0 && y > low.y - 1.0 && y < high.y + 1.0;
        let ground: Vec<HeightSample> = (0..nx * ny)
            .map(|n| self.place(n % nx, n / nx))
            .map(|place| if matters(place) { shape.ground(place) } else { HeightSample::default() })
            .collect();
        let [east, north] = [0, 1].map(|axis| ((TILT / self.spacing[axis]) as usize).max(1));
        let rise = |low: usize, high: usize, way: f32| (ground[high].height - ground[low].height) / way;
        (0..nx * ny)
            .map(|n| {
                let (i, j) = (n % nx, n / nx);
                let [i0, i1] = [i.saturating_sub(east), (i + east).min(nx - 1)];
                let [j0, j1] = [j.saturating_sub(north), (j + north).min(ny - 1)];
                let along_x = rise(j * nx + i0, j * nx + i1, (i1 - i0) as f32 * self.spacing.x);
                let along_y = rise(j0 * nx + i, j1 * nx + i, (j1 - j0) as f32 * self.spacing.y);
                shape.column(self.place(i, j), ground[n], [along_x, along_y])
            })
            .collect()
    }
}

/// Parameters for filling a volume.
struct ToothVoxelizer {
    grid: Grid,
    nodes: NodeGrid,
    half_band: f32,
    /// Distance of a block's centre from every surface beyond which the block contains no surface, mm.
    reach: f32,
    tissues: TissueLabels,
}

/// A layer of blocks to be filled: all voxels of a range of heights.
struct Layer<'a> {
    density: &'a mut [Density],
    label: &'a mut [Label],
}

/// Signed distances of a point from the tissues, mm.
#[derive(Clone, Copy, Debug)]
struct TissueDistances {
    tooth: f32,
    dentine: f32,
    pulp: f32,
}

/// Signed distances of the nodes of a block, mm, x fastest.
#[derive(Default)]
struct BlockDistances {
    tooth: Vec<f32>,
    dentine: Vec<f32>,
    pulp: Vec<f32>,
}

impl ToothVoxelizer {
    fn new(grid: Grid, tissues: &TissueLabels, half_band_voxels: f32) -> ToothVoxelizer {
        let half_band = half_band_voxels * grid.spacing.max_element();
        ToothVoxelizer {
            nodes: NodeGrid::over(&grid),
            half_band,
            reach: STEEPEST * 0.5 * BLOCK as f32 * grid.spacing.length() + half_band,
            tissues: *tissues,
            grid,
        }
    }

    /// Returns density and label of every voxel.
    fn fill(self, shape: &ToothSdf) -> (Vec<Density>, Vec<Label>) {
        let columns = self.nodes.columns(shape);
        let per_block = self.nodes.per_block();
        let [nx, ny, _] = self.grid.dims.map(|n| n as usize);
        let mut density = vec![Density::EMPTY; self.grid.len()];
        let mut label = vec![Label::AIR; self.grid.len()];
        let chunk = BLOCK * nx * ny;
        let chunks = density.chunks_mut(chunk).zip(label.chunks_mut(chunk));
        let mut layers: Vec<Layer> = chunks.map(|(density, label)| Layer { density, label }).collect();
        parallel::par_rows(&mut layers, 1, parallel::available_threads(), |number, layers| {
            let bz = number as usize;
            let level = |k: usize| shape.at_height(self.nodes.height(bz * per_block + k));
            let levels: Vec<SdfLevel> = (0..=per_block).map(level).collect();
            let mut distances = BlockDistances::default();
            for layer in layers {
                for by in 0..ny.div_ceil(BLOCK) {
                    for bx in 0..nx.div_ceil(BLOCK) {
                        let block = Block { shape, levels: &levels, columns: &columns, at: [bx, by, bz] };
                        self.fill_block(&block, layer, &mut distances);
                    }
                }
            }
        });
        (density, label)
    }

    /// Leaves a block empty or fills it as a whole if its centre shows that it contains no surface; otherwise samples
    /// all its nodes.
    fn fill_block(&self, block: &Block, layer: &mut Layer, distances: &mut BlockDistances) {
        let reach = self.reach;
        let middle = block.middle(&self.nodes);
        if middle.tooth > reach {
            return;
        }
        let far_from_pulp = middle.pulp.abs() > reach;
        if far_from_pulp && middle.tooth < -reach && middle.dentine.abs() > reach {
            let label = self.tissue(middle);
            self.for_voxels(block.at, [0; 3], BLOCK, |index, _| {
                layer.density[index] = Density::FULL;
                layer.label[index] = label;
            });
            return;
        }
        block.sample(&self.nodes, far_from_pulp.then_some(middle.pulp), distances);
        let cells = self.nodes.per_block();
        for k in 0..cells {
            for j in 0..cells {
                for i in 0..cells {
                    self.fill_cell(block.at, [i, j, k], distances, layer);
                }
            }
        }
    }

    /// Fills the voxels between eight nodes. Voxels outside the surface are air, whatever tissue is nearest.
    fn fill_cell(&self, block: [usize; 3], cell: [usize; 3], distances: &BlockDistances, layer: &mut Layer) {
        let step = self.nodes.step;
        let edge = self.nodes.per_block() + 1;
        let first = (cell[2] * edge + cell[1]) * edge + cell[0];
        let around = |nodes: &[f32]| -> [f32; 8] {
            std::array::from_fn(|n| nodes[first + (n & 1) + (n >> 1 & 1) * edge + (n >> 2) * edge * edge])
        };
        let tooth = around(&distances.tooth);
        if tooth.iter().all(|&distance| distance > CLEAR * self.half_band) {
            return;
        }
        let (dentine, pulp) = (around(&distances.dentine), around(&distances.pulp));
        self.for_voxels(block, cell.map(|c| c * step), step, |index, voxel| {
            let share = voxel.map(|v| (v as f32 + 0.5) / step as f32);
            let slope = (rise(&tooth, share) / self.nodes.spacing).length().clamp(1.0 / STEEPEST, STEEPEST);
            let here = value(&tooth, share);
            let density = density_at_distance(here / slope, self.half_band);
            layer.density[index] = density;
            if density.is_solid() {
                let known = TissueDistances { tooth: here, dentine: value(&dentine, share), pulp: value(&pulp, share) };
                layer.label[index] = self.tissue(known);
            }
        });
    }

    /// Returns the tissue of a solid point.
    fn tissue(&self, here: TissueDistances) -> Label {
        match here {
            TissueDistances { pulp, .. } if pulp < 0.0 => self.tissues.pulp,
            TissueDistances { dentine, .. } if dentine > 0.0 => self.tissues.enamel,
            _ => self.tissues.dentine,
        }
    }

    /// Calls `each` for the voxels of a cube in a block that lie in the grid, with their index within the layer and
    /// their steps from the first voxel of the cube.
    fn for_voxels(&self, block: [usize; 3], first: [usize; 3], edge: usize, mut each: impl FnMut(usize, [usize; 3])) {
        let [nx, ny, nz] = self.grid.dims.map(|n| n as usize);
        let [x0, y0] = [0, 1].map(|axis| block[axis] * BLOCK + first[axis]);
        let (bottom, z0) = (block[2] * BLOCK, block[2] * BLOCK + first[2]);
        for z in z0..(z0 + edge).min(nz) {
            for y in y0..(y0 + edge).min(ny) {
                for x in x0..(x0 + edge).min(nx) {
                    each(((z - bottom) * ny + y) * nx + x, [x - x0, y - y0, z - z0]);
                }
            }
        }
    }
}

/// Returns the trilinear value between eight corners, x fastest.
fn value(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let along_x = |n: usize| mix(corners[n], corners[n + 1], x);
    mix(mix(along_x(0), along_x(2), y), mix(along_x(4), along_x(6), y), z)
}

/// Returns the differences of [`value`] across the cell along each axis.
fn rise(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> Vec3 {
    let along_x = |n: usize| mix(corners[n], corners[n + 1], x);
    let step = |n: usize| corners[n + 1] - corners[n];
    let [a, b, c, d] = [along_x(0), along_x(2), along_x(4), along_x(6)];
    Vec3::new(
        mix(mix(step(0), step(2), y), mix(step(4), step(6), y), z),
        mix(b - a, d - c, z),
        mix(c, d, y) - mix(a, b, y),
    )
}

/// A block of nodes of one shape.
struct Block<'a> {
    shape: &'a ToothSdf,
    /// Levels of the block's nodes.
    levels: &'a [SdfLevel<'a>],
    /// All columns of nodes of the grid.
    columns: &'a [SdfColumn],
    /// Position of the block, counted in blocks from the grid's corner.
    at: [usize; 3],
}

impl Block<'_> {
    fn middle(&self, nodes: &NodeGrid) -> TissueDistances {
        self.distances_at(nodes, [nodes.per_block() / 2; 3], None)
    }

    /// Samples every node, x fastest. A distance from the pulp that is valid for the whole block saves its computation.
    fn sample(&self, nodes: &NodeGrid, pulp: Option<f32>, distances: &mut BlockDistances) {
        let edge = nodes.per_block() + 1;
        for values in [&mut distances.tooth, &mut distances.dentine, &mut distances.pulp] {
            values.clear();
        }
        for k in 0..edge {
            for j in 0..edge {
                for i in 0..edge {
                    let known = self.distances_at(nodes, [i, j, k], pulp);
                    distances.tooth.push(known.tooth);
                    distances.dentine.push(known.dentine);
                    distances.pulp.push(known.pulp);
                }
            }
        }
    }

    /// Returns the distances at a node, counted from the block's first node.
    fn distances_at(&self, nodes: &NodeGrid, [i, j, k]: [usize; 3], pulp: Option<f32>) -> TissueDistances {
        let [i, j] = [self.at[0] * nodes.per_block() + i, self.at[1] * nodes.per_block() + j];
        let (level, place) = (&self.levels[k], nodes.place(i, j));
        let SurfaceDistances { tooth, dentine } = self.shape.at(level, &self.columns[j * nodes.count[0] + i], place);
        TissueDistances { tooth, dentine, pulp: pulp.unwrap_or_else(|| level.pulp(place)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lower_first_molar::LOWER_FIRST;
    use crate::teeth;

    const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

    #[test]
    fn blocks_filled_as_a_whole_hold_what_their_voxels_would() {
        // Aim: a block's centre represents the block. Method: generate with and without evaluating it. Odd sizes leave
        // partial blocks.
        for (fdi, dims, spacing) in [
            (36, [131, 127, 233], 0.095),
            (36, [69, 66, 119], 0.187),
            (36, [61, 59, 77], 0.31),
            (11, [81, 95, 243], 0.101),
            (31, [41, 43, 121], 0.19),
            (14, [99, 86, 234], 0.1),
            (17, [65, 57, 103], 0.2),
        ] {
            let centred = Grid::centred(dims, Vec3::splat(spacing));
            let grid = Grid { origin: centred.origin - Vec3::new(0.0, 0.0, 3.4), ..centred };
            let form = &teeth::tooth(fdi).unwrap();
            let volume = grow(form, grid, &TISSUES);
            let asked =
                ToothVoxelizer { reach: f32::INFINITY, ..ToothVoxelizer::new(grid, &TISSUES, HALF_BAND_VOXELS) };
            let (density, label) = asked.fill(&ToothSdf::new(form, THINNEST * spacing));
            let asked = Volume::new(grid, volume.half_band(), density, label, TISSUES.dentine);
            let differing = (0..grid.len()).filter(|&i| asked.voxel(i) != volume.voxel(i)).count();
            assert_eq!(differing, 0, "{fdi} at {spacing} mm");
        }
    }

    #[test]
    fn finer_nodes_than_voxels_need_change_nothing_that_counts() {
        // Aim: a fine grid sampled every other voxel holds the same tooth as a coarse one. Method: volumes of tissues.
        let [fine, coarse] = [0.05, 0.1].map(|spacing| {
            let volume = grow(&LOWER_FIRST, grid_of_spacing(&LOWER_FIRST, spacing), &TISSUES);
            let mm3 = volume.grid().voxel_mm3();
            [TISSUES.enamel, TISSUES.dentine, TISSUES.pulp].map(|t| volume.count(t) as f64 * mm3)
        });
        for (fine, coarse) in fine.into_iter().zip(coarse) {
            assert!((fine / coarse - 1.0).abs() < 0.02, "{fine} mm³ and {coarse} mm³");
        }
    }
}
