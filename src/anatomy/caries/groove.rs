//! Grooves of an occlusal surface as an instrument finds them: places that a ball rolling over the surface cannot
//! reach.

use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{ISO, Volume};

/// Radius of the ball, mm: it reaches the bottoms of fossae, but not those of fissures and pits.
const BALL_RADIUS: f32 = 0.75;

/// Minimum distance between the ball and the bottom of a groove, mm.
const MIN_DEPTH: f32 = 0.12;

/// Share of the depth of a groove nearby from which a point belongs to the groove's bottom, and the radius of that
/// neighbourhood, mm.
const BOTTOM_SHARE: f32 = 0.6;
const BOTTOM_RADIUS: f32 = 0.4;

/// Maximum interruption of a groove, mm.
const MAX_GAP: f32 = 0.3;

/// The bottom of a groove as points in tooth space, mm. It contains at least one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Groove {
    line: Vec<Vec3>,
}

impl Groove {
    pub fn line(&self) -> &[Vec3] {
        &self.line
    }

    /// Returns the groove's bounding box.
    pub fn extent(&self) -> Aabb {
        Aabb::around(self.line.iter().copied())
    }

    /// Returns points of the bottom that are at least `apart` mm from each other, such that every other point is nearer
    /// than that to one of them.
    pub(super) fn thinned(&self, apart: f32) -> Vec<Vec3> {
        let mut points: Vec<Vec3> = Vec::new();
        for place in &self.line {
            if points.iter().all(|other| other.distance(*place) >= apart) {
                points.push(*place);
            }
        }
        points
    }

    /// Returns the index of the point of the bottom that is nearest to a point.
    pub fn nearest(&self, place: Vec3) -> usize {
        let away = |i: &usize| self.line[*i].distance_squared(place);
        (0..self.line.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
    }
}

/// Returns the groove whose bottom is nearest to a point as seen from above, along half of `length` (mm) on both sides.
///
/// `None` if there is no groove within `within` mm. Only points for which `holds` returns true are considered, such as
/// those of one tooth of several.
pub fn nearest_groove(
    volume: &Volume,
    place: Vec3,
    length: f32,
    within: f32,
    holds: impl Fn(Vec3) -> bool,
) -> Option<Groove> {
    let height_map = HeightMap::around(volume, place, 0.5 * length + within + 2.0 * BALL_RADIUS, holds);
    let bottoms = height_map.bottoms();
    let from_above = |p: &Vec3| (*p - place).truncate().length();
    let start = (0..bottoms.len()).min_by(|&a, &b| from_above(&bottoms[a]).total_cmp(&from_above(&bottoms[b])))?;
    if from_above(&bottoms[start]) > within {
        return None;
    }
    Some(Groove { line: reachable_along(&bottoms, start, 0.5 * length) })
}

/// Returns the points whose path length from the start over other points is at most `most` mm (Dijkstra's algorithm).
fn reachable_along(places: &[Vec3], start: usize, most: f32) -> Vec<Vec3> {
    let mut path_length = vec![f32::INFINITY; places.len()];
    path_length[start] = 0.0;
    let mut open: Vec<usize> = (0..places.len()).collect();
    while let Some(nearest) = (0..open.len()).min_by(|&a, &b| path_length[open[a]].total_cmp(&path_length[open[b]])) {
        let at = open.swap_remove(nearest);
        if path_length[at] > most {
            break;
        }
        for &next in &open {
            let step = (places[next] - places[at]).truncate().length();
            if step <= MAX_GAP {
                path_length[next] = path_length[next].min(path_length[at] + step);
            }
        }
    }
    places.iter().zip(path_length).filter(|(_, way)| *way <= most).map(|(place, _)| *place).collect()
}

/// The occlusal surface around a point as heights.
struct HeightMap {
    /// Number of columns along x and y.
    dims: [i32; 2],
    spacing: [f32; 2],
    /// Position of the first column.
    origin: [f32; 2],
    /// Heights of the surface, mm; minus infinity if a column has no surface.
    heights: Vec<f32>,
}

impl HeightMap {
    fn around(volume: &Volume, place: Vec3, reach: f32, holds: impl Fn(Vec3) -> bool) -> HeightMap {
        let grid = volume.grid();
        let Aabb { low, high } = grid.extent();
        let reach = Vec3::new(reach, reach, 0.0);
        let [xs, ys, zs] = grid.cells_within((place - reach).with_z(low.z), (place + reach).with_z(high.z));
        let top_of = |x: u32, y: u32| {
            let is_matter = |&z: &u32| volume.densities()[grid.index([x, y, z])].is_solid();
            let z = zs.clone().rev().find(is_matter).filter(|&z| holds(grid.centre([x, y, z])));
            z.map_or(f32::NEG_INFINITY, |z| {
                let inside = volume.densities()[grid.index([x, y, z])].unit();
                let outside =
                    if z + 1 < grid.dims[2] { volume.densities()[grid.index([x, y, z + 1])].unit() } else { 0.0 };
                // Position between both centres at which the density is one half.
                let share = ((inside - ISO) / (inside - outside).max(1e-6)).clamp(0.0, 1.0);
                grid.centre([x, y, z]).z + share * grid.spacing.z
            })
        };
        let heights = ys.clone().flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| top_of(x, y)).collect();
        let first = grid.centre([xs.start, ys.start, 0]);
        HeightMap {
            dims: [xs.len() as i32, ys.len() as i32],
            spacing: [grid.spacing.x, grid.spacing.y],
            origin: [first.x, first.y],
            heights,
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

    /// Returns the columns within `reach` mm around a column, as steps with their distances, mm.
    fn around_column(&self, reach: f32) -> Vec<([i32; 2], f32)> {
        let [nx, ny] = self.spacing.map(|spacing| (reach / spacing) as i32);
        let steps = (-ny..=ny).flat_map(|y| (-nx..=nx).map(move |x| [x, y]));
        let far = |[x, y]: [i32; 2]| Vec3::new(x as f32 * self.spacing[0], y as f32 * self.spacing[1], 0.0).length();
        steps.map(|step| (step, far(step))).filter(|(_, far)| *far <= reach).collect()
    }

    /// Returns the distance, mm, between a ball that rolls over the surface and the surface in each column.
    fn ball_gaps(&self) -> Vec<f32> {
        let around = self.around_column(BALL_RADIUS);
        let cap = |far: f32| (BALL_RADIUS * BALL_RADIUS - far * far).max(0.0).sqrt();
        let centre = |[x, y]: [i32; 2]| {
            let heights = around.iter().map(|([dx, dy], far)| self.at(&self.heights, x + dx, y + dy) + cap(*far));
            heights.fold(f32::NEG_INFINITY, f32::max)
        };
        let centres: Vec<f32> = self.columns().map(centre).collect();
        let above = |[x, y]: [i32; 2]| {
            let heights = around.iter().map(|([dx, dy], far)| self.at(&centres, x + dx, y + dy) - cap(*far));
            // Heights beyond the border are unknown.
            let lowest = heights.filter(|h| h.is_finite()).fold(f32::INFINITY, f32::min);
            let top = self.at(&self.heights, x, y);
            if top.is_finite() && lowest.is_finite() { lowest - top } else { 0.0 }
        };
        self.columns().map(above).collect()
    }

    /// Returns the points at the bottoms of grooves.
    fn bottoms(&self) -> Vec<Vec3> {
        let depth = self.ball_gaps();
        let nearby = self.around_column(BOTTOM_RADIUS);
        let columns = self.columns().enumerate().filter(|&(i, [x, y])| {
            let deepest = nearby.iter().map(|([dx, dy], _)| self.at(&depth, x + dx, y + dy)).fold(0.0, f32::max);
            depth[i] >= MIN_DEPTH && depth[i] >= BOTTOM_SHARE * deepest
        });
        let place = |(i, [x, y]): (usize, [i32; 2])| {
            let [x, y] = [x as f32, y as f32];
            Vec3::new(self.origin[0] + x * self.spacing[0], self.origin[1] + y * self.spacing[1], self.heights[i])
        };
        columns.map(place).collect()
    }
}
