//! The chewing surface as a map of heights.

use super::age::Aged;
use super::blend::{bump, mix, soft_max};
use super::form;
use super::track::Track;

/// Heights over x and y, mm.
pub(super) struct Relief {
    crests: Vec<Vec<Segment>>,
    triangular: Vec<Segment>,
    fissures: Vec<Fissure>,
    floor: f32,
    /// Fall of the flanks of crests and of triangular ridges.
    flanks: [f32; 2],
    worn: Option<Worn>,
}

/// How far chewing has come down, mm.
enum Worn {
    /// An edge: level.
    Edge(f32),
    /// Cusps: x, y and the height that is left of each.
    Cusps(Vec<[f32; 3]>),
}

/// The ground at one place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ground {
    /// Height without fissures, mm.
    pub(super) height: f32,
    /// What fissures take from it, mm.
    pub(super) carved: f32,
    /// Chewing has left nothing above this height, mm.
    pub(super) worn: Option<f32>,
}

/// A straight piece of a ridge or a fissure: two points, each x, y and a value.
type Segment = [[f32; 3]; 2];

struct Fissure {
    segments: Vec<Segment>,
    depth: f32,
    width: f32,
}

/// Straight pieces that stand for one span of a crest: at 6 a bend of 60° is rounded to 10°.
const PIECES: usize = 6;

/// Width over which neighbouring ridges flow into each other, mm: valleys between cusps are round but not wide.
const VALLEY: f32 = 0.6;

/// Radius of a ridge's back, mm.
const BACK: f32 = 0.7;

/// Worn facets are hollow: how much they rise with the square of the way from where the tip was, mm per mm². The enamel at their rim
/// outlasts what is within.
const HOLLOW: f32 = 0.08;

impl Relief {
    /// `mm` turns shares x, y, z into mm.
    pub(super) fn new(relief: &form::Relief, aged: Option<Aged>, mm: impl Fn([f32; 3]) -> [f32; 3]) -> Relief {
        let crest = |crest: &form::Crest| smooth(&crest.iter().map(|&p| mm(p)).collect::<Vec<_>>());
        // The triangular ridge starts where blending with the crest adds next to nothing to the tip's height.
        let lowered = |[x, y, z]: [f32; 3]| [x, y, z - 0.5 * VALLEY];
        let triangular = |cusp: &form::Cusp| [lowered(mm(cusp.tip)), mm(cusp.foot)];
        let fissure = |f: &form::Fissure| {
            let points: Vec<[f32; 3]> =
                f.line.iter().map(|&[x, y, share]| [mm([x, y, 1.0])[0], mm([x, y, 1.0])[1], share]).collect();
            Fissure { segments: smooth(&points), depth: f.depth, width: f.width }
        };
        Relief {
            crests: relief.crests.iter().map(crest).collect(),
            triangular: relief.cusps.iter().map(triangular).collect(),
            fissures: relief.fissures.iter().map(fissure).collect(),
            floor: mm([0.0, 0.0, relief.floor])[2],
            flanks: relief.flanks,
            worn: aged.map(|aged| worn(relief, aged, mm)),
        }
    }

    pub(super) fn floor(&self) -> f32 {
        self.floor
    }

    pub(super) fn at(&self, place: [f32; 2]) -> Ground {
        let [steep, gentle] = self.flanks;
        let crest = |crest: &Vec<Segment>| crest.iter().map(|s| beside(s, steep, place)).fold(f32::MIN, f32::max);
        let crests = self.crests.iter().map(crest);
        let triangular = self.triangular.iter().map(|s| beside(s, gentle, place));
        let height = crests.chain(triangular).fold(self.floor, |a, b| soft_max(a, b, VALLEY));
        let carved = self.fissures.iter().map(|f| f.depth_at(place)).fold(0.0, f32::max);
        Ground { height, carved, worn: self.worn.as_ref().map(|worn| worn.at(place)) }
    }
}

fn worn(relief: &form::Relief, aged: Aged, mm: impl Fn([f32; 3]) -> [f32; 3]) -> Worn {
    let cusps: Vec<[f32; 3]> = relief.cusps.iter().map(|cusp| mm(cusp.tip)).collect();
    if cusps.is_empty() {
        let edge = relief.crests.iter().flat_map(|crest| crest.iter()).map(|&p| mm(p)[2]).fold(f32::MIN, f32::max);
        return Worn::Edge(edge - aged.wear);
    }
    // A crown ends at its length, where a tip is written higher.
    let ends = mm([0.0, 0.0, 1.0])[2];
    Worn::Cusps(cusps.into_iter().map(|[x, y, z]| [x, y, z.min(ends) - aged.off_cusp(x)]).collect())
}

impl Worn {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        match self {
            Worn::Edge(level) => *level,
            Worn::Cusps(cusps) => {
                let over = |&[cx, cy, left]: &[f32; 3]| left + HOLLOW * ((x - cx) * (x - cx) + (y - cy) * (y - cy));
                cusps.iter().map(over).fold(f32::INFINITY, f32::min)
            }
        }
    }
}

/// Height beside a piece of a ridge: its back is round, its flanks fall evenly.
fn beside(segment: &Segment, flank: f32, place: [f32; 2]) -> f32 {
    let (distance, height) = nearest(segment, place);
    height - flank * ((distance * distance + BACK * BACK).sqrt() - BACK)
}

impl Fissure {
    fn depth_at(&self, place: [f32; 2]) -> f32 {
        let depth = |segment: &Segment| {
            let (distance, share) = nearest(segment, place);
            self.depth * share * bump(distance, self.width)
        };
        self.segments.iter().map(depth).fold(0.0, f32::max)
    }
}

/// Distance in the plane to a segment, and the segment's value at the nearest point.
fn nearest(&[a, b]: &Segment, [x, y]: [f32; 2]) -> (f32, f32) {
    let (bx, by) = (b[0] - a[0], b[1] - a[1]);
    let (px, py) = (x - a[0], y - a[1]);
    let t = ((px * bx + py * by) / (bx * bx + by * by)).clamp(0.0, 1.0);
    let (dx, dy) = (px - t * bx, py - t * by);
    ((dx * dx + dy * dy).sqrt(), mix(a[2], b[2], t))
}

/// A curve through points, as straight pieces.
fn smooth(points: &[[f32; 3]]) -> Vec<Segment> {
    let mut way = 0.0;
    let mut places = Vec::with_capacity(points.len());
    for (i, &point) in points.iter().enumerate() {
        if i > 0 {
            let before = points[i - 1];
            let (dx, dy) = (point[0] - before[0], point[1] - before[1]);
            way += (dx * dx + dy * dy).sqrt();
        }
        places.push((way, point));
    }
    let track = Track::new(places.iter().copied());
    let mut segments = Vec::with_capacity(points.len() * PIECES);
    for span in places.windows(2) {
        let at = |piece: usize| track.at(mix(span[0].0, span[1].0, piece as f32 / PIECES as f32));
        segments.extend((0..PIECES).map(|piece| [at(piece), at(piece + 1)]));
    }
    segments
}
