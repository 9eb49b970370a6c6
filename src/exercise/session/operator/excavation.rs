//! The path of a round bur that removes decay of any shape from above.
//!
//! The bur's centre stays inside the decay's outline by the bur's radius, so that its surface meets the decay's
//! border. The path descends layer by layer to the lower end of the decay in each column.

use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume, distance};

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

impl Excavation {
    /// Returns the path of the bur's centre, tooth space, mm. Empty without decay.
    pub fn path(&self, volume: &Volume, is_decay: impl Fn(Vec3, Label) -> bool) -> Vec<Vec3> {
        let grid = volume.grid();
        let columns = columns(volume, is_decay);
        let flat = Grid { dims: [grid.dims[0], grid.dims[1], 1], ..*grid };
        // The border lies between two columns, half a voxel before the centre of the first column without decay.
        let half = 0.5 * grid.spacing.x.max(grid.spacing.y);
        let inside: Vec<f32> =
            distance::to_set(&flat, |i| columns[i].is_none()).into_iter().map(|d| (d - half).max(0.0)).collect();
        let widest = inside.iter().filter(|d| d.is_finite()).fold(0.0, |a: f32, &b| a.max(b));
        // Decay narrower than the bur is cut along its centre line.
        let least = (self.radius - self.margin).min(0.8 * widest);
        let tracks = self.tracks(grid, |index| columns[index].filter(|_| inside[index] >= least));
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

    /// Returns the columns one pitch apart, in rows of alternating direction along y, which keeps the hand's paths
    /// short.
    fn tracks(&self, grid: &Grid, column: impl Fn(usize) -> Option<DecayColumn>) -> Vec<(Vec3, DecayColumn)> {
        let step = |axis: usize| ((self.pitch / grid.spacing[axis]).round() as usize).max(1);
        let mut tracks = Vec::new();
        for (count, x) in (0..grid.dims[0]).step_by(step(0)).enumerate() {
            let mut ys: Vec<u32> = (0..grid.dims[1]).step_by(step(1)).collect();
            if count % 2 == 1 {
                ys.reverse();
            }
            tracks.extend(ys.into_iter().filter_map(|y| {
                let index = grid.index([x, y, 0]);
                column(index).map(|column| (grid.centre([x, y, 0]), column))
            }));
        }
        tracks
    }
}

/// Returns the decay of every column of the volume, x fastest; `None` for a column without decay.
fn columns(volume: &Volume, is_decay: impl Fn(Vec3, Label) -> bool) -> Vec<Option<DecayColumn>> {
    let grid = volume.grid();
    let flat = grid.dims[0] as usize * grid.dims[1] as usize;
    let mut tops = vec![f32::NEG_INFINITY; flat];
    let mut floors = vec![f32::INFINITY; flat];
    for (index, label) in volume.tissues().enumerate().filter(|(_, label)| *label != Label::AIR) {
        let place = grid.centre(grid.cell(index));
        let column = index % flat;
        tops[column] = tops[column].max(place.z);
        if floors[column].is_infinite() && is_decay(place, label) {
            floors[column] = place.z - 0.5 * grid.spacing.z;
        }
    }
    let both = tops.into_iter().zip(floors);
    both.map(|(top, floor)| floor.is_finite().then_some(DecayColumn { top, floor })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let (low, high) = path.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        assert!((low.z - (-1.0 + 0.5)).abs() < 0.11, "down to the floor: {low}");
        assert!(low.x >= -1.55 && high.x <= 1.55 && low.y >= -1.05 && high.y <= 1.05, "inside the walls: {low} {high}");
        assert!(low.x < -1.1 && high.x > 1.1 && low.y < -0.6 && high.y > 0.6, "out to the walls: {low} {high}");
        assert!(path.windows(2).filter(|w| (w[1] - w[0]).length() > 1.0).count() < 20, "long moves");
        assert!(excavation.path(&volume, |_, _| false).is_empty());
    }
}
