//! The path of a round bur that removes decay of any shape from above.
//!
//! The bur's centre stays inside the decay's outline by the bur's radius, so that its surface meets the decay's
//! border. The path descends layer by layer to the lower end of the decay in each column.

use super::cavity_map::spread;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume, distance};

/// Greatest distance between places at which a path may run, mm. Coarser voxels are divided: a hand is not bound to the
/// columns of the voxels, and a bur that could only follow every fourth of a millimetre would miss the walls.
const FINEST_TRACK: f32 = 0.1;

/// Parameters of an excavation path; lengths in mm.
#[derive(Clone, Copy, Debug)]
pub struct Excavation {
    /// Radius of the bur.
    pub radius: f32,
    /// Distance of the bur's lowest point below the device's tip: a ball's radius, or 0 for an end that begins at the
    /// tip.
    pub below: f32,
    /// Distance between neighbouring tracks.
    pub pitch: f32,
    /// Distance by which the cut extends beyond the decay's border; negative to stay inside the border.
    pub margin: f32,
}

/// A column of voxels that contains decay; heights in tooth space, mm.
#[derive(Clone, Copy, Debug)]
struct DecayColumn {
    /// Height of the tooth's surface.
    top: f32,
    /// Height of the decay's lower end: the lower face of its lowest voxel, not its centre, so that the path is the
    /// same in coarse and in fine voxels.
    floor: f32,
}

/// Half width of the narrowest arm that is cut beside a wider lesion, in radii of the bur. 0.15–0.4 work: below, specks are
/// cut with sound tissue around them; above, caries is left in arms that the bur fits into by half.
const ARM: f32 = 0.25;

impl Excavation {
    /// Returns the path of the bur's centre, tooth space, mm. Empty without decay.
    pub fn path(&self, volume: &Volume, is_decay: impl Fn(Vec3, Label) -> bool) -> Vec<Vec3> {
        let grid = &divided(volume.grid());
        let columns = columns(volume, grid, is_decay);
        let flat = Grid { dims: [grid.dims[0], grid.dims[1], 1], ..*grid };
        // The border lies between two columns, half a column before the centre of the first one without decay.
        let half = 0.5 * grid.spacing.x.max(grid.spacing.y);
        let inside: Vec<f32> =
            distance::to_set(&flat, |i| columns[i].is_none()).into_iter().map(|d| (d - half).max(0.0)).collect();
        // Where the decay is narrower than the bur, it is cut along its centre line: a narrow arm of a wide lesion too, but
        // no speck beside it.
        let widest = inside.iter().filter(|d| d.is_finite()).fold(0.0, |a: f32, &b| a.max(b));
        let (fit, least) = (self.radius - self.margin, (ARM * self.radius).min(0.8 * widest));
        let is_arm = |i: usize| inside[i] >= least && inside[i] >= 0.8 * widest_near(&flat, &inside, i, self.radius);
        let is_track = |i: usize| inside[i] >= fit || is_arm(i);
        let tracks = self.tracks(grid, |index| columns[index].filter(|_| is_track(index)));
        let floor_of = |column: &DecayColumn| column.floor + self.below - self.margin;
        let high = tracks.iter().map(|(_, c)| c.top).fold(f32::NEG_INFINITY, f32::max);
        let low = tracks.iter().map(|(_, c)| floor_of(c)).fold(f32::INFINITY, f32::min);
        let step = self.pitch.max(0.8 * self.radius);
        let layers = ((high - low) / step).ceil().max(0.0) as u32;
        let mut path = Vec::new();
        for layer in 0..=layers {
            let height = (high - layer as f32 * step).max(low);
            // Skips columns whose floor an upper layer has reached already or whose surface lies below this layer.
            let open = tracks.iter().filter(|(_, c)| floor_of(c) < height + step && c.top > height - self.radius);
            path.extend(open.map(|(place, c)| place.with_z(height.max(floor_of(c)))));
        }
        path
    }

    /// Returns the columns at most one pitch apart, in rows of alternating direction along y, which keeps the hand's
    /// paths short. The outermost tracks run along the walls: parts that no track comes near would stay.
    fn tracks(&self, grid: &Grid, column: impl Fn(usize) -> Option<DecayColumn>) -> Vec<(Vec3, DecayColumn)> {
        let step = |axis: usize| ((self.pitch / grid.spacing[axis]).round() as u32).max(1);
        let column_at = |x: u32, y: u32| column(grid.index([x, y, 0])).map(|column| (grid.centre([x, y, 0]), column));
        let [nx, ny, _] = grid.dims;
        let rows = spread((0..nx).filter(|&x| (0..ny).any(|y| column_at(x, y).is_some())), step(0));
        let mut tracks = Vec::new();
        for (count, x) in rows.into_iter().enumerate() {
            let mut ys = spread((0..ny).filter(|&y| column_at(x, y).is_some()), step(1));
            if count % 2 == 1 {
                ys.reverse();
            }
            tracks.extend(ys.into_iter().filter_map(|y| column_at(x, y)));
        }
        tracks
    }
}

/// Returns the greatest value among the cells within a distance (mm) of a cell of a flat grid, the infinite left out.
fn widest_near(flat: &Grid, inside: &[f32], cell: usize, distance: f32) -> f32 {
    let [x, y, _] = flat.cell(cell);
    let reach = [flat.spacing.x, flat.spacing.y].map(|spacing| (distance / spacing) as u32);
    let span = |at: u32, reach: u32, count: u32| at.saturating_sub(reach)..(at + reach + 1).min(count);
    let middle = flat.centre([x, y, 0]);
    let mut widest = 0.0_f32;
    for j in span(y, reach[1], flat.dims[1]) {
        for i in span(x, reach[0], flat.dims[0]) {
            let value = inside[flat.index([i, j, 0])];
            if value.is_finite() && flat.centre([i, j, 0]).distance(middle) <= distance {
                widest = widest.max(value);
            }
        }
    }
    widest
}

/// Returns a grid with its cells divided to at most [`FINEST_TRACK`].
fn divided(grid: &Grid) -> Grid {
    let parts = parts_of(grid);
    let spacing = grid.spacing / parts as f32;
    let origin = grid.origin - 0.5 * (grid.spacing - spacing);
    Grid { dims: grid.dims.map(|n| n * parts), spacing, origin }
}

/// Returns the number of parts into which a cell is divided in each direction.
fn parts_of(grid: &Grid) -> u32 {
    ((grid.spacing.max_element() / FINEST_TRACK - 0.01).ceil() as u32).max(1)
}

/// Returns the decay of every column of a divided grid of the volume, x fastest; `None` for a column without decay.
fn columns(volume: &Volume, fine: &Grid, is_decay: impl Fn(Vec3, Label) -> bool) -> Vec<Option<DecayColumn>> {
    let grid = volume.grid();
    let parts = parts_of(grid);
    let flat = fine.dims[0] as usize * fine.dims[1] as usize;
    let mut tops = vec![f32::NEG_INFINITY; flat];
    let mut floors = vec![f32::INFINITY; flat];
    for (index, label) in volume.tissues().enumerate().filter(|(_, label)| *label != Label::AIR) {
        let first = grid.cell(index).map(|n| n * parts);
        for part in 0..parts.pow(3) {
            let [x, y, z] = [part % parts, part / parts % parts, part / parts.pow(2)];
            let cell = [first[0] + x, first[1] + y, first[2] + z];
            let place = fine.centre(cell);
            let column = fine.index([cell[0], cell[1], 0]);
            tops[column] = tops[column].max(place.z);
            if floors[column].is_infinite() && is_decay(place, label) {
                floors[column] = place.z - 0.5 * fine.spacing.z;
            }
        }
    }
    let both = tops.into_iter().zip(floors);
    both.map(|(top, floor)| floor.is_finite().then_some(DecayColumn { top, floor })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::aabb::Aabb;

    #[test]
    fn a_path_reaches_the_same_walls_in_coarse_voxels() {
        // Aim: the size of the voxels does not decide how far the bur reaches. Method: an outline of 1.2 mm × 4 mm, 2 mm
        // deep, in a sound block of voxels of 0.1 and 0.25 mm, for a bur of 0.4 mm radius; the extent of both paths.
        let extent = |spacing: f32| {
            let size = |mm: f32| (mm / spacing).round() as u32;
            let grid = Grid::centred([size(4.0), size(6.0), size(6.0)], Vec3::splat(spacing));
            let volume = Volume::from_distance(grid, 1.5 * spacing, |p| (p.z - 1.0, Label(1)));
            let excavation = Excavation { radius: 0.4, below: 0.4, pitch: 0.2, margin: 0.0 };
            let path = excavation.path(&volume, |p, _| p.x.abs() < 0.6 && p.y.abs() < 2.0 && p.z > -1.0);
            Aabb::around(path)
        };
        let (fine, coarse) = (extent(0.1), extent(0.25));
        assert!((fine.low - coarse.low).abs().max_element() < 0.11, "{fine:?} {coarse:?}");
        assert!((fine.high - coarse.high).abs().truncate().max_element() < 0.11, "{fine:?} {coarse:?}");
        assert!(coarse.size().x > 0.25, "tracks along both walls: {coarse:?}");
    }

    #[test]
    fn a_narrow_arm_of_a_wide_lesion_is_cut_along_its_centre_line() {
        // Aim: decay narrower than the bur is reached although the bur fits into the rest of the lesion, and only along
        // its middle. Method: a box of 3 mm × 3 mm with an arm 0.6 mm wide, and a bur 1 mm wide.
        let decay = Label(4);
        let grid = Grid::centred([100, 80, 40], Vec3::splat(0.1));
        let is_in = |p: Vec3| {
            let (body, arm) = (p.x < 0.0 && p.x > -3.0 && p.y.abs() < 1.5, p.x >= 0.0 && p.x < 3.0 && p.y.abs() < 0.3);
            (body || arm) && p.z > 0.0
        };
        let volume = Volume::from_distance(grid, 0.15, |p| (p.z - 1.0, if is_in(p) { decay } else { Label(1) }));
        let excavation = Excavation { radius: 0.5, below: 0.5, pitch: 0.2, margin: 0.0 };
        let path = excavation.path(&volume, |_, label| label == decay);
        let in_arm: Vec<_> = path.iter().filter(|p| p.x > 0.6).collect();
        let farthest = in_arm.iter().map(|p| p.x).fold(f32::NEG_INFINITY, f32::max);
        assert!(farthest > 2.5, "along the whole arm: {farthest}");
        assert!(in_arm.iter().all(|p| p.y.abs() < 0.11), "along its middle");
        assert!(path.iter().all(|p| p.x > 0.6 || p.y.abs() < 1.05), "inside the body's walls");
    }

    #[test]
    fn a_box_of_decay_is_removed_up_to_its_border_and_no_further() {
        // Aim: the bur's surface meets the decay's walls and floor from inside. Method: a box of decay, 4 mm × 3 mm
        // and 2 mm deep, under a flat surface; every point of the path is compared with the box.
        let decay = Label(4);
        let grid = Grid::centred([80, 80, 60], Vec3::splat(0.1));
        let is_in = |p: Vec3| p.x.abs() < 2.0 && p.y.abs() < 1.5 && p.z > -1.0;
        let volume = Volume::from_distance(grid, 0.15, |p| (p.z - 1.0, if is_in(p) { decay } else { Label(1) }));
        let excavation = Excavation { radius: 0.5, below: 0.5, pitch: 0.3, margin: 0.0 };
        let path = excavation.path(&volume, |_, label| label == decay);
        let Aabb { low, high } = Aabb::around(path.iter().copied());
        assert!((low.z - (-1.0 + 0.5)).abs() < 0.11, "down to the floor: {low}");
        assert!(low.x >= -1.55 && high.x <= 1.55 && low.y >= -1.05 && high.y <= 1.05, "inside the walls: {low} {high}");
        assert!(low.x < -1.1 && high.x > 1.1 && low.y < -0.6 && high.y > 0.6, "out to the walls: {low} {high}");
        assert!(path.windows(2).filter(|w| (w[1] - w[0]).length() > 1.0).count() < 20, "long moves");
        assert!(excavation.path(&volume, |_, _| false).is_empty());
    }
}
