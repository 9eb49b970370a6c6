//! A form made into voxels.

use super::Tissues;
use super::blend::mix;
use super::form::Form;
use super::relief::Ground;
use super::shape::{Column, Depths, Shape, Slice};
use crate::frame::Vec3;
use crate::volume::{Density, Grid, Label, Volume, ramp, rows};

/// Half the width of the density ramp across the surface, voxels: what the hand feels as a surface needs three voxels.
const BAND: f32 = 1.5;

/// Empty voxels around a tooth on a grid of its own.
const MARGIN: u32 = 4;

/// A form need not be sampled finer than this, mm: between nodes so far apart its sharpest detail, a fissure's bottom of
/// 0.1 mm radius r, is drawn at most h²/8r = 0.023 mm too shallow: two thirds of a voxel where four share a cell, a third where two do.
const FINEST: f32 = 0.135;

/// Edge of the blocks that are skipped or filled as a whole, voxels.
const BLOCK: usize = 8;

/// How fast the distances of a shape rise at most on the way out of a block, mm per mm: at 1.2 a first few voxels of a
/// molar are missed, more than 1.6 only costs time.
const STEEPEST: f32 = 1.6;

/// A cell whose corners are all so many bands outside the surface is empty: a distance counts for at most [`STEEPEST`] times what
/// it is, and a little is left for rounding.
const CLEAR: f32 = 1.01 * STEEPEST;

/// The ground's tilt is taken over this far to each side, mm: what matters is the slope of a cusp, not of a groove.
const TILT: f32 = 0.4;

/// Thinnest enamel, voxels: from √3 on a layer at any slant holds together face to face.
const THINNEST: f32 = 1.75;

/// The grid of a spacing (mm) that just holds a tooth of this form.
pub fn grid_of_spacing(form: &Form, spacing: f32) -> Grid {
    let [low, high] = Shape::new(form, 0.0).bounds();
    let grid = Grid::covering(low, high, Vec3::splat(spacing), MARGIN);
    // A mirror image on the mirrored grid has the same voxels, from the other end.
    if form.is_mirrored { mirrored(grid) } else { grid }
}

/// The finest grid of so many voxels that holds a tooth of this form, the tooth in its middle.
pub fn grid_fitting(form: &Form, dims: [u32; 3]) -> Grid {
    let [low, high] = bounds(form);
    let steps = Vec3::from(dims.map(|n| n.saturating_sub(2 * MARGIN + 1).max(1) as f32));
    let spacing = ((high - low) / steps).max_element();
    let centred = Grid::centred(dims, Vec3::splat(spacing));
    Grid { origin: centred.origin + 0.5 * (low + high), ..centred }
}

/// Grows a tooth on a grid in tooth space; what lies outside the grid is not there.
pub fn grow(form: &Form, grid: Grid, tissues: &Tissues) -> Volume {
    let shape = Shape::new(form, THINNEST * grid.spacing.max_element());
    let growing = Growing::on(if form.is_mirrored { mirrored(grid) } else { grid }, tissues);
    let band = growing.band;
    let (mut density, mut label) = growing.fill(&shape);
    if form.is_mirrored {
        turn_rows(&grid, &mut density);
        turn_rows(&grid, &mut label);
    }
    Volume::new(grid, band, density, label, tissues.dentine)
}

/// Corners of a box around a form's tooth, tooth space, mm.
fn bounds(form: &Form) -> [Vec3; 2] {
    let [low, high] = Shape::new(form, 0.0).bounds();
    match form.is_mirrored {
        true => [low.with_y(-high.y), high.with_y(-low.y)],
        false => [low, high],
    }
}

/// The grid in which a mirror image (y for −y) is what the tooth is in this one.
fn mirrored(grid: Grid) -> Grid {
    let last = grid.origin.y + (grid.dims[1] - 1) as f32 * grid.spacing.y;
    Grid { origin: grid.origin.with_y(-last), ..grid }
}

/// Puts the last row of every level first, and so on.
fn turn_rows<T>(grid: &Grid, voxels: &mut [T]) {
    let [nx, ny, _] = grid.dims.map(|n| n as usize);
    for level in voxels.chunks_mut(nx * ny) {
        for row in 0..ny / 2 {
            let (front, back) = level.split_at_mut((ny - 1 - row) * nx);
            front[row * nx..][..nx].swap_with_slice(&mut back[..nx]);
        }
    }
}

/// Where a shape is asked: the corners of cells of `step` voxels each way.
struct Nodes {
    /// Voxels per cell; 1, 2 or 4.
    step: usize,
    /// Nodes along x and y, over all blocks.
    count: [usize; 2],
    /// Of node 0, tooth space, mm.
    origin: Vec3,
    /// mm
    spacing: Vec3,
}

impl Nodes {
    fn over(grid: &Grid) -> Nodes {
        let voxel = grid.spacing.max_element();
        let step = [4, 2].into_iter().find(|&step| voxel * step as f32 <= FINEST).unwrap_or(1);
        let count = [0, 1].map(|axis| grid.dims[axis].div_ceil(BLOCK as u32) as usize * (BLOCK / step) + 1);
        Nodes { step, count, origin: grid.origin - 0.5 * grid.spacing, spacing: grid.spacing * step as f32 }
    }

    /// Nodes from one side of a block to the other.
    fn per_block(&self) -> usize {
        BLOCK / self.step
    }

    fn place(&self, i: usize, j: usize) -> [f32; 2] {
        [self.origin.x + i as f32 * self.spacing.x, self.origin.y + j as f32 * self.spacing.y]
    }

    fn height(&self, k: usize) -> f32 {
        self.origin.z + k as f32 * self.spacing.z
    }

    /// Every column of nodes, x fastest.
    fn columns(&self, shape: &Shape) -> Vec<Column> {
        let [nx, ny] = self.count;
        let [low, high] = shape.bounds();
        let matters = |[x, y]: [f32; 2]| x > low.x - 1.0 && x < high.x + 1.0 && y > low.y - 1.0 && y < high.y + 1.0;
        let ground: Vec<Ground> = (0..nx * ny)
            .map(|n| self.place(n % nx, n / nx))
            .map(|place| if matters(place) { shape.ground(place) } else { Ground::default() })
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

/// How a volume is filled.
struct Growing {
    grid: Grid,
    nodes: Nodes,
    band: f32,
    /// A block whose middle is farther than this from every surface holds none, mm.
    reach: f32,
    tissues: Tissues,
}

/// A layer of blocks being filled: all voxels of some heights.
struct Layer<'a> {
    density: &'a mut [Density],
    label: &'a mut [Label],
}

/// What is known of a place: signed distances, mm.
#[derive(Clone, Copy, Debug)]
struct Known {
    tooth: f32,
    dentine: f32,
    pulp: f32,
}

/// What is known of the nodes of a block, x fastest.
#[derive(Default)]
struct Told {
    tooth: Vec<f32>,
    dentine: Vec<f32>,
    pulp: Vec<f32>,
}

impl Growing {
    fn on(grid: Grid, tissues: &Tissues) -> Growing {
        let band = BAND * grid.spacing.max_element();
        Growing {
            nodes: Nodes::over(&grid),
            band,
            reach: STEEPEST * 0.5 * BLOCK as f32 * grid.spacing.length() + band,
            tissues: *tissues,
            grid,
        }
    }

    /// Density and label of every voxel.
    fn fill(self, shape: &Shape) -> (Vec<Density>, Vec<Label>) {
        let columns = self.nodes.columns(shape);
        let per_block = self.nodes.per_block();
        let [nx, ny, _] = self.grid.dims.map(|n| n as usize);
        let mut density = vec![Density::EMPTY; self.grid.len()];
        let mut label = vec![Label::AIR; self.grid.len()];
        let chunk = BLOCK * nx * ny;
        let chunks = density.chunks_mut(chunk).zip(label.chunks_mut(chunk));
        let mut layers: Vec<Layer> = chunks.map(|(density, label)| Layer { density, label }).collect();
        rows::in_rows(&mut layers, 1, rows::processors(), |number, layers| {
            let bz = number as usize;
            let level = |k: usize| shape.cut(self.nodes.height(bz * per_block + k));
            let levels: Vec<Slice> = (0..=per_block).map(level).collect();
            let mut told = Told::default();
            for layer in layers {
                for by in 0..ny.div_ceil(BLOCK) {
                    for bx in 0..nx.div_ceil(BLOCK) {
                        let block = Block { shape, levels: &levels, columns: &columns, at: [bx, by, bz] };
                        self.fill_block(&block, layer, &mut told);
                    }
                }
            }
        });
        (density, label)
    }

    /// Leaves a block empty or fills it as a whole where its middle says so; else asks all its nodes.
    fn fill_block(&self, block: &Block, layer: &mut Layer, told: &mut Told) {
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
        block.ask(&self.nodes, far_from_pulp.then_some(middle.pulp), told);
        let cells = self.nodes.per_block();
        for k in 0..cells {
            for j in 0..cells {
                for i in 0..cells {
                    self.fill_cell(block.at, [i, j, k], told, layer);
                }
            }
        }
    }

    /// Fills the voxels between eight nodes. Outside the surface they are air, whatever tissue is nearest.
    fn fill_cell(&self, block: [usize; 3], cell: [usize; 3], told: &Told, layer: &mut Layer) {
        let step = self.nodes.step;
        let edge = self.nodes.per_block() + 1;
        let first = (cell[2] * edge + cell[1]) * edge + cell[0];
        let around = |nodes: &[f32]| -> [f32; 8] {
            std::array::from_fn(|n| nodes[first + (n & 1) + (n >> 1 & 1) * edge + (n >> 2) * edge * edge])
        };
        let tooth = around(&told.tooth);
        if tooth.iter().all(|&distance| distance > CLEAR * self.band) {
            return;
        }
        let (dentine, pulp) = (around(&told.dentine), around(&told.pulp));
        self.for_voxels(block, cell.map(|c| c * step), step, |index, voxel| {
            let share = voxel.map(|v| (v as f32 + 0.5) / step as f32);
            let slope = (rise(&tooth, share) / self.nodes.spacing).length().clamp(1.0 / STEEPEST, STEEPEST);
            let here = value(&tooth, share);
            let density = ramp(here / slope, self.band);
            layer.density[index] = density;
            if density.is_solid() {
                let known = Known { tooth: here, dentine: value(&dentine, share), pulp: value(&pulp, share) };
                layer.label[index] = self.tissue(known);
            }
        });
    }

    /// What a solid place is made of.
    fn tissue(&self, here: Known) -> Label {
        match here {
            Known { pulp, .. } if pulp < 0.0 => self.tissues.pulp,
            Known { dentine, .. } if dentine > 0.0 => self.tissues.enamel,
            _ => self.tissues.dentine,
        }
    }

    /// The voxels of a cube in a block that lie in the grid: index within their layer, and steps from the cube's first voxel.
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

/// Trilinear value between eight corners, x fastest.
fn value(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let along_x = |n: usize| mix(corners[n], corners[n + 1], x);
    mix(mix(along_x(0), along_x(2), y), mix(along_x(4), along_x(6), y), z)
}

/// How much [`value`] rises across the cell along each axis.
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
    shape: &'a Shape,
    /// The block's levels of nodes.
    levels: &'a [Slice<'a>],
    /// All columns of nodes.
    columns: &'a [Column],
    /// Blocks from the grid's corner.
    at: [usize; 3],
}

impl Block<'_> {
    fn middle(&self, nodes: &Nodes) -> Known {
        self.known(nodes, [nodes.per_block() / 2; 3], None)
    }

    /// Asks every node, x fastest. A distance from the pulp that holds for the whole block saves asking for it.
    fn ask(&self, nodes: &Nodes, pulp: Option<f32>, told: &mut Told) {
        let edge = nodes.per_block() + 1;
        for known in [&mut told.tooth, &mut told.dentine, &mut told.pulp] {
            known.clear();
        }
        for k in 0..edge {
            for j in 0..edge {
                for i in 0..edge {
                    let known = self.known(nodes, [i, j, k], pulp);
                    told.tooth.push(known.tooth);
                    told.dentine.push(known.dentine);
                    told.pulp.push(known.pulp);
                }
            }
        }
    }

    /// At a node, counted from the block's first.
    fn known(&self, nodes: &Nodes, [i, j, k]: [usize; 3], pulp: Option<f32>) -> Known {
        let [i, j] = [self.at[0] * nodes.per_block() + i, self.at[1] * nodes.per_block() + j];
        let (level, place) = (&self.levels[k], nodes.place(i, j));
        let Depths { tooth, dentine } = self.shape.at(level, &self.columns[j * nodes.count[0] + i], place);
        Known { tooth, dentine, pulp: pulp.unwrap_or_else(|| level.pulp(place)) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::molar::LOWER_FIRST;
    use super::super::teeth;
    use super::*;

    const TISSUES: Tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

    #[test]
    fn blocks_filled_as_a_whole_hold_what_their_voxels_would() {
        // Aim: a block's middle speaks for the block. Method: grow with and without asking it. Odd sizes leave cut blocks.
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
            let asked = Growing { reach: f32::INFINITY, ..Growing::on(grid, &TISSUES) };
            let (density, label) = asked.fill(&Shape::new(form, THINNEST * spacing));
            let asked = Volume::new(grid, volume.band(), density, label, TISSUES.dentine);
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
