//! Hand paths for filling a cavity and carving the filling.
//!
//! Takes the tooth before its cavity was cut, the tooth as it is now, and an instrument. Gives points to press on and
//! paths to carve along, in tooth space, mm.

use crate::scenario::Workpiece;
use typodont_core::frame::Vec3;
use typodont_core::touch::Instrument;
use typodont_core::volume::{Grid, Volume, distance};

/// A point to press on; tooth space, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct PressPoint {
    /// Point on the original contour.
    pub contour: Vec3,
    /// Last known height of the surface there.
    pub height: f32,
    /// Columns of the cavity that are closer to this point than to any other, each with the height of the original
    /// contour.
    columns: Vec<(usize, f32)>,
}

impl PressPoint {
    /// Returns the depth, mm, of the surface around the point below a height above the contour (mm): the root mean
    /// square, in which one hole counts more than a surface slightly low. Columns that reach the height count as 0.
    pub fn deficit(&self, surface: &[f32], height: f32) -> f32 {
        let depth = |&(column, contour): &(usize, f32)| (contour + height - surface[column]).max(0.0);
        let squares = self.columns.iter().map(|column| depth(column).powi(2)).sum::<f32>();
        (squares / self.columns.len().max(1) as f32).sqrt()
    }
}

/// Arrangement of strokes over a cavity; lengths in mm.
#[derive(Clone, Copy, Debug)]
pub struct StrokePattern {
    /// Distance between neighbouring strokes.
    pub apart: f32,
    /// Distance by which strokes extend beyond the cavity's margin.
    pub beyond: f32,
    /// Height of the working end above the contour.
    pub above: f32,
}

/// The cavity and its surroundings as maps over the columns of the tooth's grid, seen from above.
pub struct CavityMap {
    grid: Grid,
    /// Distance of each column's centre from the cavity's outline, for columns inside it, mm; 0 outside.
    depth_inside: Vec<f32>,
    /// Distance of each column from the cavity, for columns outside it, mm; 0 inside.
    distance_outside: Vec<f32>,
    /// Heights of the original contour, mm.
    contour: Vec<f32>,
    /// Heights of the surface at the start, mm.
    start: Vec<f32>,
}

/// Clearance between the instrument's face and the cavity wall beside it, mm: a hand trembles, and walls are
/// inclined.
const WALL_CLEARANCE: f32 = 0.15;

impl CavityMap {
    /// Returns the map of a workpiece's cavity; `None` without a cavity.
    pub fn of(workpiece: &Workpiece) -> Option<CavityMap> {
        let original = workpiece.original.as_ref()?;
        let whole = original.grid();
        let flat = Grid { dims: [whole.dims[0], whole.dims[1], 1], ..*whole };
        let mut is_open = vec![false; flat.len()];
        for voxel in (0..whole.len()).filter(|&v| workpiece.is_in_cavity(v)) {
            is_open[voxel % flat.len()] = true;
        }
        is_open.contains(&true).then(|| CavityMap {
            grid: flat,
            depth_inside: distance::to_set(&flat, |i| !is_open[i]),
            distance_outside: distance::to_set(&flat, |i| is_open[i]),
            contour: heights(original),
            start: heights(&workpiece.volume),
        })
    }

    /// Returns the points at which a face of the given radius fits, at most `apart` mm from each other, in
    /// alternating rows, which keeps the hand's paths short.
    ///
    /// The outermost points are as close to the walls as possible, since parts that no face comes near stay open.
    pub fn press_points(&self, radius: f32, apart: f32) -> Vec<PressPoint> {
        let widest = self.depth_inside.iter().filter(|d| d.is_finite()).fold(0.0, |a: f32, &b| a.max(b));
        // In a cavity narrower than the face, the face rests on the margin.
        let least = (radius + WALL_CLEARANCE).min(0.8 * widest);
        let is_meant = |x: u32, y: u32| {
            let i = self.grid.index([x, y, 0]);
            self.depth_inside[i] >= least && self.contour[i].is_finite()
        };
        let [nx, ny, _] = self.grid.dims;
        let [in_x, in_y] = [0, 1].map(|axis| (apart / self.grid.spacing[axis]).max(1.0) as u32);
        let rows = spread((0..nx).filter(|&x| (0..ny).any(|y| is_meant(x, y))), in_x);
        let mut places = Vec::new();
        for (row, x) in rows.into_iter().enumerate() {
            let mut ys = spread((0..ny).filter(|&y| is_meant(x, y)), in_y);
            if row % 2 == 1 {
                ys.reverse();
            }
            places.extend(ys.into_iter().filter(|&y| is_meant(x, y)).map(|y| {
                let (at, i) = (self.grid.centre([x, y, 0]), self.grid.index([x, y, 0]));
                PressPoint { contour: at.with_z(self.contour[i]), height: self.start[i], columns: Vec::new() }
            }));
        }
        self.divide_columns(&mut places);
        places
    }

    /// Gives every column of the cavity to the point next to it.
    fn divide_columns(&self, places: &mut [PressPoint]) {
        for column in (0..self.grid.len()).filter(|&i| self.depth_inside[i] > 0.0 && self.contour[i].is_finite()) {
            let centre = self.grid.centre(self.grid.cell(column)).truncate();
            let distance = |place: &PressPoint| place.contour.truncate().distance_squared(centre);
            let nearest = places.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            nearest.into_iter().for_each(|place| place.columns.push((column, self.contour[column])));
        }
    }

    /// Returns the path of an instrument's tip over the contour on which no part of its end cuts below the intended
    /// height; tooth space, mm.
    pub fn carving_path(&self, instrument: &Instrument, strokes: StrokePattern) -> Vec<Vec3> {
        let profile = self.profile(instrument);
        let columns = self.columns(strokes.apart, |i| self.is_near(i, strokes.beyond));
        columns.map(|(at, i)| at.with_z(self.resting_height(&profile, i) + strokes.above)).collect()
    }

    /// Returns the points of the carving path at which the current surface is more than `over` mm above the end's
    /// underside; tooth space, mm.
    pub fn path_over_high_spots(
        &self,
        instrument: &Instrument,
        strokes: StrokePattern,
        now: &Volume,
        over: f32,
    ) -> Vec<Vec3> {
        let profile = self.profile(instrument);
        let surface = heights(now);
        let columns = self.columns(strokes.apart, |i| self.is_near(i, strokes.beyond));
        let places = columns.map(|(at, i)| (at.with_z(self.resting_height(&profile, i) + strokes.above), i));
        let is_high =
            |tip: f32, i: usize| self.footprint(&profile, i).any(|(i, height)| surface[i] > tip + height + over);
        places.filter(|&(place, i)| is_high(place.z, i)).map(|(place, _)| place).collect()
    }

    fn is_near(&self, column: usize, beyond: f32) -> bool {
        self.distance_outside[column] <= beyond && self.contour[column].is_finite()
    }

    /// Returns the selected columns `apart` mm from each other, in rows of alternating direction along y.
    fn columns<'a>(
        &'a self,
        apart: f32,
        is_meant: impl Fn(usize) -> bool + 'a,
    ) -> impl Iterator<Item = (Vec3, usize)> + 'a {
        let step = move |axis: usize| ((apart / self.grid.spacing[axis]).round() as usize).max(1);
        let [nx, ny, _] = self.grid.dims;
        let rows = (0..nx).step_by(step(0)).enumerate();
        rows.flat_map(move |(row, x)| {
            let count = ny.div_ceil(step(1) as u32);
            (0..count).map(move |j| [x, step(1) as u32 * if row % 2 == 0 { j } else { count - 1 - j }, 0])
        })
        .map(|cell| (self.grid.centre(cell), self.grid.index(cell)))
        .filter(move |(_, i)| is_meant(*i))
    }

    /// Returns the height of the end's underside above its tip, mm, by column offset.
    fn profile(&self, instrument: &Instrument) -> Vec<([i64; 2], f32)> {
        /// Height above which the end is ignored, mm.
        const HIGH: f32 = 2.5;
        /// Resolution of heights, mm.
        const STEP: f32 = 0.01;
        let spacing = self.grid.spacing;
        let reach = (HIGH / spacing.x) as i64;
        let mut profile = Vec::new();
        for j in -reach..=reach {
            for i in -reach..=reach {
                let aside = Vec3::new(i as f32 * spacing.x, j as f32 * spacing.y, -HIGH);
                // The search starts below the device's tip: a ball is centred on it, a shaped end begins at it.
                let steps = (2.0 * HIGH / STEP) as u32;
                let met = (0..steps).find(|&k| instrument.end_distance(aside + Vec3::Z * (k as f32 * STEP)) <= 0.0);
                profile.extend(met.map(|k| ([i, j], k as f32 * STEP - HIGH)));
            }
        }
        profile
    }

    /// Returns the height of the tip over a column at which its end touches the contour without entering it, mm.
    fn resting_height(&self, profile: &[([i64; 2], f32)], column: usize) -> f32 {
        self.footprint(profile, column).map(|(i, height)| self.contour[i] - height).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns the columns below an end whose tip is over `column`, each with the height of the end's underside above
    /// the tip, mm.
    fn footprint<'a>(
        &self,
        profile: &'a [([i64; 2], f32)],
        column: usize,
    ) -> impl Iterator<Item = (usize, f32)> + use<'a> {
        let [x, y, _] = self.grid.cell(column).map(i64::from);
        let [nx, ny, _] = self.grid.dims.map(i64::from);
        profile.iter().filter_map(move |&([i, j], height)| {
            let (x, y) = (x + i, y + j);
            let is_in = (0..nx).contains(&x) && (0..ny).contains(&y);
            is_in.then_some(((y * nx + x) as usize, height))
        })
    }
}

/// Selects columns spaced evenly from the first to the last, at most `apart` columns from one to the next.
pub(super) fn spread(columns: impl Iterator<Item = u32>, apart: u32) -> Vec<u32> {
    let columns: Vec<u32> = columns.collect();
    let (Some(first), Some(last)) = (columns.first(), columns.last()) else { return Vec::new() };
    let parts = (last - first).div_ceil(apart).max(1);
    let mut spread: Vec<u32> = (0..=parts).map(|i| first + ((last - first) * i + parts / 2) / parts).collect();
    spread.dedup();
    spread
}

/// Returns the height of the highest surface of every column, mm; −∞ for a column without matter.
pub(super) fn heights(volume: &Volume) -> Vec<f32> {
    let grid = volume.grid();
    let flat = grid.dims[0] as usize * grid.dims[1] as usize;
    let mut heights = vec![f32::NEG_INFINITY; flat];
    for (index, density) in volume.densities().iter().enumerate().filter(|(_, d)| d.is_solid()) {
        // The surface lies between the highest solid voxel and the one above, where the density crosses one half.
        let above = volume.densities().get(index + flat).map_or(0.0, |d| d.unit());
        let rise = (density.unit() - typodont_core::volume::ISO) / (density.unit() - above).max(1e-6);
        let height = grid.centre(grid.cell(index)).z + grid.spacing.z * rise.clamp(0.0, 1.0);
        heights[index % flat] = heights[index % flat].max(height);
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::touch::WorkingEnd;
    use typodont_core::volume::Label;

    #[test]
    fn a_ball_follows_the_contour_without_entering_it() {
        // Aim: the tip stays one radius above a plane and a bowl alike, over the cavity and a little beyond. Method:
        // a block with a spherical depression of 3 mm radius in its top, and a square hole in the depression.
        let grid = Grid::centred([70, 70, 50], Vec3::splat(0.1));
        let surface = |p: Vec3| (p.z - 0.5).max(3.0 - p.distance(Vec3::Z * 3.0));
        let hole = |p: Vec3| (p.x.abs().max(p.y.abs()) - 1.0).max(-1.0 - p.z);
        let whole = Volume::from_distance(grid, 0.15, |p| (surface(p), Label(1)));
        let cut = Volume::from_distance(grid, 0.15, |p| (surface(p).max(-hole(p)), Label(1)));
        let workpiece = Workpiece::prepared(whole, cut);
        let cavity_map = CavityMap::of(&workpiece).unwrap();
        let ball = Instrument::new(WorkingEnd::Ball { radius: 0.5 }, true).non_rotary();
        let path = cavity_map.carving_path(&ball, StrokePattern { apart: 0.3, beyond: 0.2, above: 0.0 });
        assert!(path.len() > 40, "{}", path.len());
        for place in &path {
            let clearance = surface(*place);
            assert!((clearance - 0.5).abs() < 0.04, "{place}: {clearance}");
        }
        let places = cavity_map.press_points(0.4, 0.3);
        assert!(!places.is_empty());
        // Every column counts by its own contour, and belongs to one point: the cavity is 1 mm deep, less in the depression.
        let open = cavity_map.depth_inside.iter().filter(|d| **d > 0.0).count();
        assert_eq!(places.iter().map(|p| p.columns.len()).sum::<usize>(), open);
        let mut seen = heights(&workpiece.volume);
        let deficit = places[0].deficit(&seen, 0.0);
        assert!((deficit - 1.0).abs() < 0.2, "{deficit}");
        assert!(places[0].deficit(&seen, 0.2) > deficit + 0.19);
        places[0].columns.iter().skip(1).for_each(|&(column, contour)| seen[column] = contour + 1.0);
        let (column, contour) = places[0].columns[0];
        seen[column] = contour - 0.6;
        let of_one = 0.6 / (places[0].columns.len() as f32).sqrt();
        assert!((places[0].deficit(&seen, 0.0) - of_one).abs() < 1e-4, "one column is still low");
        seen[column] = contour;
        assert_eq!(places[0].deficit(&seen, 0.0), 0.0);
        for PressPoint { contour, height, .. } in places {
            assert!(contour.x.abs() <= 0.55 && contour.y.abs() <= 0.55 && surface(contour).abs() < 0.03, "{contour}");
            assert!((height + 1.0).abs() < 0.06, "{height}");
        }
    }
}
