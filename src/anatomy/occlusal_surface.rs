//! The occlusal surface as a height map.

use crate::age::AgeEffects;
use crate::blend::{bump, mix, smooth_max};
use crate::form;
use crate::monotone_spline::MonotoneSpline;

/// Heights by x and y, mm.
pub(super) struct OcclusalSurface {
    crests: Vec<Vec<HeightSegment>>,
    triangular: Vec<HeightSegment>,
    fissures: Vec<Fissure>,
    floor: f32,
    /// Slopes of the flanks of crests and of triangular ridges, mm per mm.
    flanks: [f32; 2],
    wear_facets: Option<WearFacets>,
}

/// Heights to which the tooth has been worn, mm.
enum WearFacets {
    /// Height of a horizontal worn edge.
    Edge(f32),
    /// Cusps: x, y and the remaining height of each.
    Cusps(Vec<[f32; 3]>),
}

/// The occlusal surface at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct HeightSample {
    /// Height without fissures, mm.
    pub(super) height: f32,
    /// Depth of fissures below that height, mm.
    pub(super) fissure_depth: f32,
    /// Height to which the tooth has been worn, mm; `None` for an unworn tooth.
    pub(super) worn_to: Option<f32>,
}

/// A straight segment of a ridge or a fissure: two points, each with x, y and a value.
type HeightSegment = [[f32; 3]; 2];

struct Fissure {
    segments: Vec<HeightSegment>,
    depth: f32,
    width: f32,
}

/// Number of straight segments per span of a crest: with 6, a bend of 60° is divided into bends of 10°.
const PIECES_PER_SPAN: usize = 6;

/// Width over which neighbouring ridges are blended, mm: valleys between cusps are rounded but not wide.
const VALLEY_WIDTH: f32 = 0.6;

/// Radius of the top of a ridge, mm.
const RIDGE_RADIUS: f32 = 0.7;

/// Curvature of worn facets, which are concave: their rise with the square of the distance from the position of the
/// former tip, mm per mm². The enamel at their rim wears more slowly than the centre.
const FACET_CURVATURE: f32 = 0.08;

impl OcclusalSurface {
    /// Makes the surface; `mm` converts shares x, y, z to mm.
    pub(super) fn new(
        relief: &form::OcclusalForm,
        aged: Option<AgeEffects>,
        mm: impl Fn([f32; 3]) -> [f32; 3],
    ) -> OcclusalSurface {
        let crest = |crest: &form::Crest| smooth_segments(&crest.iter().map(|&p| mm(p)).collect::<Vec<_>>());
        // The triangular ridge begins at a height at which blending with the crest adds almost nothing to the height of
        // the tip.
        let lowered = |[x, y, z]: [f32; 3]| [x, y, z - 0.5 * VALLEY_WIDTH];
        let triangular = |cusp: &form::Cusp| [lowered(mm(cusp.tip)), mm(cusp.foot)];
        let fissure = |f: &form::FissureForm| {
            let points: Vec<[f32; 3]> =
                f.line.iter().map(|&[x, y, share]| [mm([x, y, 1.0])[0], mm([x, y, 1.0])[1], share]).collect();
            Fissure { segments: smooth_segments(&points), depth: f.depth, width: f.width }
        };
        OcclusalSurface {
            crests: relief.crests.iter().map(crest).collect(),
            triangular: relief.cusps.iter().map(triangular).collect(),
            fissures: relief.fissures.iter().map(fissure).collect(),
            floor: mm([0.0, 0.0, relief.floor])[2],
            flanks: relief.flanks,
            wear_facets: aged.map(|aged| wear_facets(relief, aged, mm)),
        }
    }

    pub(super) fn floor(&self) -> f32 {
        self.floor
    }

    pub(super) fn at(&self, place: [f32; 2]) -> HeightSample {
        let [steep, gentle] = self.flanks;
        let crest =
            |crest: &Vec<HeightSegment>| crest.iter().map(|s| ridge_height(s, steep, place)).fold(f32::MIN, f32::max);
        let crests = self.crests.iter().map(crest);
        let triangular = self.triangular.iter().map(|s| ridge_height(s, gentle, place));
        let height = crests.chain(triangular).fold(self.floor, |a, b| smooth_max(a, b, VALLEY_WIDTH));
        let carved = self.fissures.iter().map(|f| f.depth_at(place)).fold(0.0, f32::max);
        HeightSample { height, fissure_depth: carved, worn_to: self.wear_facets.as_ref().map(|worn| worn.at(place)) }
    }
}

fn wear_facets(relief: &form::OcclusalForm, aged: AgeEffects, mm: impl Fn([f32; 3]) -> [f32; 3]) -> WearFacets {
    let cusps: Vec<[f32; 3]> = relief.cusps.iter().map(|cusp| mm(cusp.tip)).collect();
    if cusps.is_empty() {
        let edge = relief.crests.iter().flat_map(|crest| crest.iter()).map(|&p| mm(p)[2]).fold(f32::MIN, f32::max);
        return WearFacets::Edge(edge - aged.wear);
    }
    // A crown ends at its length even if a tip is higher in the form.
    let ends = mm([0.0, 0.0, 1.0])[2];
    WearFacets::Cusps(cusps.into_iter().map(|[x, y, z]| [x, y, z.min(ends) - aged.cusp_wear(x)]).collect())
}

impl WearFacets {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        match self {
            WearFacets::Edge(level) => *level,
            WearFacets::Cusps(cusps) => {
                let over =
                    |&[cx, cy, left]: &[f32; 3]| left + FACET_CURVATURE * ((x - cx) * (x - cx) + (y - cy) * (y - cy));
                cusps.iter().map(over).fold(f32::INFINITY, f32::min)
            }
        }
    }
}

/// Returns the height at a point beside a segment of a ridge, which has a rounded top and flanks of constant slope.
fn ridge_height(segment: &HeightSegment, flank: f32, place: [f32; 2]) -> f32 {
    let (distance, height) = nearest(segment, place);
    height - flank * ((distance * distance + RIDGE_RADIUS * RIDGE_RADIUS).sqrt() - RIDGE_RADIUS)
}

impl Fissure {
    fn depth_at(&self, place: [f32; 2]) -> f32 {
        let depth = |segment: &HeightSegment| {
            let (distance, share) = nearest(segment, place);
            self.depth * share * bump(distance, self.width)
        };
        self.segments.iter().map(depth).fold(0.0, f32::max)
    }
}

/// Returns the horizontal distance from a segment, and the segment's value at the nearest point.
fn nearest(&[a, b]: &HeightSegment, [x, y]: [f32; 2]) -> (f32, f32) {
    let (bx, by) = (b[0] - a[0], b[1] - a[1]);
    let (px, py) = (x - a[0], y - a[1]);
    let t = ((px * bx + py * by) / (bx * bx + by * by)).clamp(0.0, 1.0);
    let (dx, dy) = (px - t * bx, py - t * by);
    ((dx * dx + dy * dy).sqrt(), mix(a[2], b[2], t))
}

/// Returns a smooth curve through points as straight segments.
fn smooth_segments(points: &[[f32; 3]]) -> Vec<HeightSegment> {
    let mut arc_length = 0.0;
    let mut places = Vec::with_capacity(points.len());
    for (i, &point) in points.iter().enumerate() {
        if i > 0 {
            let before = points[i - 1];
            let (dx, dy) = (point[0] - before[0], point[1] - before[1]);
            arc_length += (dx * dx + dy * dy).sqrt();
        }
        places.push((arc_length, point));
    }
    let track = MonotoneSpline::new(places.iter().copied());
    let mut segments = Vec::with_capacity(points.len() * PIECES_PER_SPAN);
    for span in places.windows(2) {
        let at = |piece: usize| track.at(mix(span[0].0, span[1].0, piece as f32 / PIECES_PER_SPAN as f32));
        segments.extend((0..PIECES_PER_SPAN).map(|piece| [at(piece), at(piece + 1)]));
    }
    segments
}
