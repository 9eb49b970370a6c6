//! Grooves of a chewing surface, as an instrument finds them: where a ball that rolls over it cannot come down.

use crate::frame::Vec3;
use crate::volume::{ISO, Volume};

/// Radius of the ball, mm: the bottoms of fossae it reaches, those of fissures and pits it does not.
const BALL: f32 = 0.75;

/// How far the ball must stay above a groove's bottom, mm.
const LEAST: f32 = 0.12;

/// Of a groove's depth nearby, the share that belongs to its bottom; and how near that is, mm.
const BOTTOM: f32 = 0.6;
const NEARBY: f32 = 0.4;

/// A groove may be interrupted so far, mm.
const GAP: f32 = 0.3;

/// The bottom of a groove: places of it, tooth space, mm. At least one.
#[derive(Clone, Debug, PartialEq)]
pub struct Groove {
    line: Vec<Vec3>,
}

impl Groove {
    pub fn line(&self) -> &[Vec3] {
        &self.line
    }

    /// The box around it.
    pub fn extent(&self) -> (Vec3, Vec3) {
        self.line.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
    }

    /// Places of the bottom that are no nearer to each other than `apart` mm, and all others no farther from one of them.
    pub(super) fn thinned(&self, apart: f32) -> Vec<Vec3> {
        let mut kept: Vec<Vec3> = Vec::new();
        for place in &self.line {
            if kept.iter().all(|other| other.distance(*place) >= apart) {
                kept.push(*place);
            }
        }
        kept
    }

    /// The place of the bottom that is nearest to a point.
    pub fn nearest(&self, place: Vec3) -> usize {
        let away = |i: &usize| self.line[*i].distance_squared(place);
        (0..self.line.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
    }
}

/// The groove whose bottom is nearest to a place as seen from above, as far along it as half of `length` on both sides, mm.
///
/// `None` when there is no groove within `within` mm. Only what `holds` says is looked at: one tooth of several.
pub fn nearest_groove(
    volume: &Volume,
    place: Vec3,
    length: f32,
    within: f32,
    holds: impl Fn(Vec3) -> bool,
) -> Option<Groove> {
    let ground = Ground::around(volume, place, 0.5 * length + within + 2.0 * BALL, holds);
    let bottoms = ground.bottoms();
    let from_above = |p: &Vec3| (*p - place).truncate().length();
    let start = (0..bottoms.len()).min_by(|&a, &b| from_above(&bottoms[a]).total_cmp(&from_above(&bottoms[b])))?;
    if from_above(&bottoms[start]) > within {
        return None;
    }
    Some(Groove { line: along(&bottoms, start, 0.5 * length) })
}

/// Those places that are no farther from the start than `most` by way of the others (Dijkstra's way).
fn along(places: &[Vec3], start: usize, most: f32) -> Vec<Vec3> {
    let mut way = vec![f32::INFINITY; places.len()];
    way[start] = 0.0;
    let mut open: Vec<usize> = (0..places.len()).collect();
    while let Some(nearest) = (0..open.len()).min_by(|&a, &b| way[open[a]].total_cmp(&way[open[b]])) {
        let at = open.swap_remove(nearest);
        if way[at] > most {
            break;
        }
        for &next in &open {
            let step = (places[next] - places[at]).truncate().length();
            if step <= GAP {
                way[next] = way[next].min(way[at] + step);
            }
        }
    }
    places.iter().zip(way).filter(|(_, way)| *way <= most).map(|(place, _)| *place).collect()
}

/// The chewing surface around a place as heights.
struct Ground {
    /// Columns along x and y.
    dims: [i32; 2],
    spacing: [f32; 2],
    /// The first column's place.
    origin: [f32; 2],
    /// Of the surface, mm; minus infinity where there is none.
    top: Vec<f32>,
}

impl Ground {
    fn around(volume: &Volume, place: Vec3, reach: f32, holds: impl Fn(Vec3) -> bool) -> Ground {
        let grid = volume.grid();
        let [low, high] = grid.extent();
        let reach = Vec3::new(reach, reach, 0.0);
        let [xs, ys, zs] = grid.cells_within((place - reach).with_z(low.z), (place + reach).with_z(high.z));
        let top_of = |x: u32, y: u32| {
            let is_matter = |&z: &u32| volume.densities()[grid.index([x, y, z])].is_solid();
            let z = zs.clone().rev().find(is_matter).filter(|&z| holds(grid.centre([x, y, z])));
            z.map_or(f32::NEG_INFINITY, |z| {
                let inside = volume.densities()[grid.index([x, y, z])].unit();
                let outside =
                    if z + 1 < grid.dims[2] { volume.densities()[grid.index([x, y, z + 1])].unit() } else { 0.0 };
                // Where between both centres the density is a half.
                let share = ((inside - ISO) / (inside - outside).max(1e-6)).clamp(0.0, 1.0);
                grid.centre([x, y, z]).z + share * grid.spacing.z
            })
        };
        let top = ys.clone().flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| top_of(x, y)).collect();
        let first = grid.centre([xs.start, ys.start, 0]);
        Ground {
            dims: [xs.len() as i32, ys.len() as i32],
            spacing: [grid.spacing.x, grid.spacing.y],
            origin: [first.x, first.y],
            top,
        }
    }

    fn at(&self, values: &[f32], x: i32, y: i32) -> f32 {
        let is_in = (0..self.dims[0]).contains(&x) && (0..self.dims[1]).contains(&y);
        if is_in { values[(y * self.dims[0] + x) as usize] } else { f32::NEG_INFINITY }
    }

    fn columns(&self) -> impl Iterator<Item = [i32; 2]> + use<> {
        let [nx, ny] = self.dims;
        (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y]))
    }

    /// Columns around one, as steps, no farther than `reach` mm, with how far they are.
    fn around_column(&self, reach: f32) -> Vec<([i32; 2], f32)> {
        let [nx, ny] = self.spacing.map(|spacing| (reach / spacing) as i32);
        let steps = (-ny..=ny).flat_map(|y| (-nx..=nx).map(move |x| [x, y]));
        let far = |[x, y]: [i32; 2]| Vec3::new(x as f32 * self.spacing[0], y as f32 * self.spacing[1], 0.0).length();
        steps.map(|step| (step, far(step))).filter(|(_, far)| *far <= reach).collect()
    }

    /// How far a ball that rolls over the ground stays above each column, mm.
    fn out_of_reach(&self) -> Vec<f32> {
        let around = self.around_column(BALL);
        let cap = |far: f32| (BALL * BALL - far * far).max(0.0).sqrt();
        let centre = |[x, y]: [i32; 2]| {
            let heights = around.iter().map(|([dx, dy], far)| self.at(&self.top, x + dx, y + dy) + cap(*far));
            heights.fold(f32::NEG_INFINITY, f32::max)
        };
        let centres: Vec<f32> = self.columns().map(centre).collect();
        let above = |[x, y]: [i32; 2]| {
            let heights = around.iter().map(|([dx, dy], far)| self.at(&centres, x + dx, y + dy) - cap(*far));
            // Beyond the border nobody knows what stands there.
            let lowest = heights.filter(|h| h.is_finite()).fold(f32::INFINITY, f32::min);
            let top = self.at(&self.top, x, y);
            if top.is_finite() && lowest.is_finite() { lowest - top } else { 0.0 }
        };
        self.columns().map(above).collect()
    }

    /// The places at the bottoms of grooves.
    fn bottoms(&self) -> Vec<Vec3> {
        let depth = self.out_of_reach();
        let nearby = self.around_column(NEARBY);
        let columns = self.columns().enumerate().filter(|&(i, [x, y])| {
            let deepest = nearby.iter().map(|([dx, dy], _)| self.at(&depth, x + dx, y + dy)).fold(0.0, f32::max);
            depth[i] >= LEAST && depth[i] >= BOTTOM * deepest
        });
        let place = |(i, [x, y]): (usize, [i32; 2])| {
            let [x, y] = [x as f32, y as f32];
            Vec3::new(self.origin[0] + x * self.spacing[0], self.origin[1] + y * self.spacing[1], self.top[i])
        };
        columns.map(place).collect()
    }
}
