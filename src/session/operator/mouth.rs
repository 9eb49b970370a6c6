//! The ways of a hand that fills a cavity and carves it.
//!
//! Takes the tooth before its cavity was cut, as it is now, and an instrument. Gives places to press on and ways to carve along,
//! in tooth space.

use crate::frame::Vec3;
use crate::scenario::Workpiece;
use crate::touch::Instrument;
use crate::volume::{Grid, Volume, distance};

/// A place to press on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// On the original contour.
    pub contour: Vec3,
    /// Height of the surface there, as it is known, mm.
    pub height: f32,
    /// How often the surface has still to be met high enough.
    pub visits_left: u32,
}

/// How strokes lie over a cavity, mm.
#[derive(Clone, Copy, Debug)]
pub struct Strokes {
    /// Between neighbouring ones.
    pub apart: f32,
    /// How far they reach beyond the rim.
    pub beyond: f32,
    /// How far above the contour the end stays.
    pub above: f32,
}

/// The cavity as seen from above.
pub struct Mouth {
    grid: Grid,
    /// Of every column, how far its middle lies inside the cavity's outline, mm; 0 outside.
    inside: Vec<f32>,
    /// How far a column outside it lies from it, mm.
    outside: Vec<f32>,
    /// Heights of the original contour, mm.
    contour: Vec<f32>,
    /// Heights of the surface at the start, mm.
    start: Vec<f32>,
}

/// What a hand keeps between a face and the wall beside it, mm: it trembles, and walls lean.
const ROOM: f32 = 0.15;

/// A place counts as full when it was found so often to be: the first time what lies beside the face may still be open.
const VISITS: u32 = 2;

impl Mouth {
    /// `None` without a cavity.
    pub fn of(workpiece: &Workpiece) -> Option<Mouth> {
        let original = workpiece.original.as_ref()?;
        let whole = original.grid();
        let flat = Grid { dims: [whole.dims[0], whole.dims[1], 1], ..*whole };
        let mut is_open = vec![false; flat.len()];
        for voxel in (0..whole.len()).filter(|&v| workpiece.is_in_cavity(v)) {
            is_open[voxel % flat.len()] = true;
        }
        is_open.contains(&true).then(|| Mouth {
            grid: flat,
            inside: distance::to_set(&flat, |i| !is_open[i]),
            outside: distance::to_set(&flat, |i| is_open[i]),
            contour: heights(original),
            start: heights(&workpiece.volume),
        })
    }

    /// Where a face of a radius finds room, no farther apart than so; to and fro, so that the hand has short ways. The outermost
    /// places lie as near to the walls as they may: what no face comes near is left open.
    pub fn places(&self, radius: f32, apart: f32) -> Vec<Place> {
        let widest = self.inside.iter().filter(|d| d.is_finite()).fold(0.0, |a: f32, &b| a.max(b));
        // In a cavity narrower than the face it stands on the rim.
        let least = (radius + ROOM).min(0.8 * widest);
        let is_meant = |x: u32, y: u32| {
            let i = self.grid.index([x, y, 0]);
            self.inside[i] >= least && self.contour[i].is_finite()
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
                Place { contour: at.with_z(self.contour[i]), height: self.start[i], visits_left: VISITS }
            }));
        }
        places
    }

    /// The way of an instrument's tip over the contour, so that nothing of the end lies deeper than it may.
    pub fn way(&self, instrument: &Instrument, strokes: Strokes) -> Vec<Vec3> {
        let profile = self.profile(instrument);
        let columns = self.columns(strokes.apart, |i| self.is_near(i, strokes.beyond));
        columns.map(|(at, i)| at.with_z(self.rest(&profile, i) + strokes.above)).collect()
    }

    /// Those places of that way at which the end would take more than so much of what stands there now, mm.
    pub fn way_of_high(&self, instrument: &Instrument, strokes: Strokes, now: &Volume, over: f32) -> Vec<Vec3> {
        let profile = self.profile(instrument);
        let surface = heights(now);
        let columns = self.columns(strokes.apart, |i| self.is_near(i, strokes.beyond));
        let places = columns.map(|(at, i)| (at.with_z(self.rest(&profile, i) + strokes.above), i));
        let is_high = |tip: f32, i: usize| self.under(&profile, i).any(|(i, height)| surface[i] > tip + height + over);
        places.filter(|&(place, i)| is_high(place.z, i)).map(|(place, _)| place).collect()
    }

    fn is_near(&self, column: usize, beyond: f32) -> bool {
        self.outside[column] <= beyond && self.contour[column].is_finite()
    }

    /// Columns so far apart, to and fro along y.
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

    /// How high the end's underside lies over its tip, by steps of columns aside.
    fn profile(&self, instrument: &Instrument) -> Vec<([i64; 2], f32)> {
        /// What lies higher is not met, and the resolution of heights, mm.
        const HIGH: f32 = 2.5;
        const STEP: f32 = 0.01;
        let spacing = self.grid.spacing;
        let reach = (HIGH / spacing.x) as i64;
        let mut profile = Vec::new();
        for j in -reach..=reach {
            for i in -reach..=reach {
                let aside = Vec3::new(i as f32 * spacing.x, j as f32 * spacing.y, -HIGH);
                // Down to the tip of a ball, whose middle is the device's tip; a shaped end begins at it.
                let steps = (2.0 * HIGH / STEP) as u32;
                let met = (0..steps).find(|&k| instrument.end_distance(aside + Vec3::Z * (k as f32 * STEP)) <= 0.0);
                profile.extend(met.map(|k| ([i, j], k as f32 * STEP - HIGH)));
            }
        }
        profile
    }

    /// How high a tip must stay over a column so that its end lies on the contour and nowhere in it.
    fn rest(&self, profile: &[([i64; 2], f32)], column: usize) -> f32 {
        self.under(profile, column).map(|(i, height)| self.contour[i] - height).fold(f32::NEG_INFINITY, f32::max)
    }

    /// The columns below an end whose tip is over a column, and how high its underside lies there over the tip.
    fn under<'a>(&self, profile: &'a [([i64; 2], f32)], column: usize) -> impl Iterator<Item = (usize, f32)> + use<'a> {
        let [x, y, _] = self.grid.cell(column).map(i64::from);
        let [nx, ny, _] = self.grid.dims.map(i64::from);
        profile.iter().filter_map(move |&([i, j], height)| {
            let (x, y) = (x + i, y + j);
            let is_in = (0..nx).contains(&x) && (0..ny).contains(&y);
            is_in.then_some(((y * nx + x) as usize, height))
        })
    }
}

/// From the first to the last of some columns, evenly, no more than so many from one to the next.
fn spread(columns: impl Iterator<Item = u32>, apart: u32) -> Vec<u32> {
    let columns: Vec<u32> = columns.collect();
    let (Some(first), Some(last)) = (columns.first(), columns.last()) else { return Vec::new() };
    let parts = (last - first).div_ceil(apart).max(1);
    let mut spread: Vec<u32> = (0..=parts).map(|i| first + ((last - first) * i + parts / 2) / parts).collect();
    spread.dedup();
    spread
}

/// Height of the highest surface of every column, mm; −∞ where there is none.
fn heights(volume: &Volume) -> Vec<f32> {
    let grid = volume.grid();
    let flat = grid.dims[0] as usize * grid.dims[1] as usize;
    let mut heights = vec![f32::NEG_INFINITY; flat];
    for (index, density) in volume.densities().iter().enumerate().filter(|(_, d)| d.is_solid()) {
        // Between the highest solid voxel and the one above, where density falls through a half.
        let above = volume.densities().get(index + flat).map_or(0.0, |d| d.unit());
        let rise = (density.unit() - crate::volume::ISO) / (density.unit() - above).max(1e-6);
        let height = grid.centre(grid.cell(index)).z + grid.spacing.z * rise.clamp(0.0, 1.0);
        heights[index % flat] = heights[index % flat].max(height);
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::WorkingEnd;
    use crate::volume::Label;

    #[test]
    fn a_ball_is_led_so_that_it_lies_on_the_contour_and_never_in_it() {
        // Aim: its tip stays a radius above a plane and a bowl alike, over the cavity and a little beyond. Method: a block
        // with a hollow of 3 mm radius in its top, and a square hole in that.
        let grid = Grid::centred([70, 70, 50], Vec3::splat(0.1));
        let surface = |p: Vec3| (p.z - 0.5).max(3.0 - p.distance(Vec3::Z * 3.0));
        let hole = |p: Vec3| (p.x.abs().max(p.y.abs()) - 1.0).max(-1.0 - p.z);
        let whole = Volume::from_distance(grid, 0.15, |p| (surface(p), Label(1)));
        let cut = Volume::from_distance(grid, 0.15, |p| (surface(p).max(-hole(p)), Label(1)));
        let workpiece = Workpiece::prepared(whole, cut);
        let mouth = Mouth::of(&workpiece).unwrap();
        let ball = Instrument::new(WorkingEnd::Ball { radius: 0.5 }, true).by_hand();
        let way = mouth.way(&ball, Strokes { apart: 0.3, beyond: 0.2, above: 0.0 });
        assert!(way.len() > 40, "{}", way.len());
        for place in &way {
            let clearance = surface(*place);
            assert!((clearance - 0.5).abs() < 0.04, "{place}: {clearance}");
        }
        let places = mouth.places(0.4, 0.3);
        assert!(!places.is_empty());
        for Place { contour, height, .. } in places {
            assert!(contour.x.abs() <= 0.55 && contour.y.abs() <= 0.55 && surface(contour).abs() < 0.03, "{contour}");
            assert!((height + 1.0).abs() < 0.06, "{height}");
        }
    }
}
