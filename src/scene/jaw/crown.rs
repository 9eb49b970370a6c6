//! One crown as triangles, lofted through outlines and closed by its chewing surface or edge.

use super::teeth::{Kind, Level, Model};
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::render::Rgb;
use std::f32::consts::TAU;

/// Corners around a crown: a quarter of a millimetre to a millimetre apart.
const AROUND: usize = 48;

/// Outlines of a crown's side between border and neck, and rings of a chewing surface, of an edge.
const SIDE_RINGS: usize = 10;
const TOP_RINGS: usize = 13;
const EDGE_RINGS: usize = 4;

/// Length of root that a crown brings along, mm: it ends out of sight in the gum.
const STUB: f32 = 4.0;

/// Fall of a cusp's flanks, mm per mm: cuspal inclines of some 30° (Ash & Nelson).
const FLANK: f32 = 0.62;

/// Rounding of a cusp's tip and of a ridge, mm.
const TIP: f32 = 0.45;

/// Where two slopes meet they are rounded, and stained, over this difference of their heights, mm.
const FISSURE: f32 = 0.45;

/// A surface with a colour at each corner.
#[derive(Clone, Debug, Default)]
pub struct Coloured {
    pub mesh: Mesh,
    pub tints: Vec<Rgb>,
}

impl Coloured {
    /// Adds another surface, its corners and normals carried over by a map.
    pub fn add(&mut self, other: &Coloured, point: impl Fn(Vec3) -> Vec3, way: impl Fn(Vec3) -> Vec3, turned: bool) {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(other.mesh.positions.iter().map(|p| point(*p)));
        self.mesh.normals.extend(other.mesh.normals.iter().map(|n| way(*n)));
        let corners = |[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] };
        self.mesh.triangles.extend(other.mesh.triangles.iter().map(|t| corners(t.map(|i| first + i))));
        self.tints.extend(&other.tints);
    }
}

/// Outward normals of the corners, weighted by the area of their triangles.
pub fn smooth_normals(mesh: &mut Mesh) {
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        triangle.iter().for_each(|&i| mesh.normals[i as usize] += (b - a).cross(c - a));
    }
    mesh.normals.iter_mut().for_each(|n| *n = n.normalize_or(Vec3::Z));
}

/// A tooth's crown and the beginning of its root, closed, in tooth space; mm.
pub fn crown(model: &Model) -> Coloured {
    let shape = Shape::of(model);
    let mut made = Coloured::default();
    let top_rings = match model.kind {
        Kind::Incisor | Kind::Canine => EDGE_RINGS,
        Kind::Premolar | Kind::Molar => TOP_RINGS,
    };
    made.push(shape.top([0.0, 0.0]), shape.tint_on_top([0.0, 0.0]));
    for ring in 1..=top_rings {
        let share = ring as f32 / top_rings as f32;
        for i in 0..AROUND {
            let at = shape.border(i).map(|v| v * share);
            made.push(shape.top(at), shape.tint_on_top(at));
        }
    }
    for ring in 1..=SIDE_RINGS + 2 {
        // Denser toward the border, where the side bends.
        let down = (ring as f32 / SIDE_RINGS as f32).min(1.0);
        let height = 1.0 - down * (0.35 + 0.65 * down);
        for i in 0..AROUND {
            let stub = STUB * (ring.saturating_sub(SIDE_RINGS)) as f32 * 0.5;
            let place = shape.side(i, height) - Vec3::Z * stub;
            made.push(place, shape.tint_on_side(height, stub));
        }
    }
    made.push(Vec3::NEG_Z * (STUB + 1.0), ROOT);
    let ring = |number: usize, i: usize| (1 + number * AROUND + i % AROUND) as u32;
    let rings = top_rings + SIDE_RINGS + 2;
    let last = made.mesh.positions.len() as u32 - 1;
    for i in 0..AROUND {
        made.mesh.triangles.push([0, ring(0, i), ring(0, i + 1)]);
        for number in 0..rings - 1 {
            let [a, b, c, d] = [ring(number, i), ring(number, i + 1), ring(number + 1, i), ring(number + 1, i + 1)];
            made.mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
        made.mesh.triangles.push([last, ring(rings - 1, i + 1), ring(rings - 1, i)]);
    }
    smooth_normals(&mut made.mesh);
    made
}

impl Coloured {
    fn push(&mut self, place: Vec3, tint: Rgb) {
        self.mesh.positions.push(place);
        self.tints.push(tint);
    }
}

/// Tints of enamel's colour: warmer toward the neck, where dentine shines through; greyish and clear at an incisor's edge.
const NECK: Rgb = [0.98, 0.93, 0.84];
const ROOT: Rgb = [0.93, 0.83, 0.66];
const EDGE: Rgb = [0.93, 0.95, 0.99];
const DEEP: Rgb = [0.84, 0.75, 0.62];
const CANINE: Rgb = [0.99, 0.975, 0.94];
const PLAIN: Rgb = [1.0; 3];

fn mixed(a: Rgb, b: Rgb, share: f32) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
}

struct Shape<'a> {
    model: &'a Model,
    /// Half the crown's widths, buccolingual and mesiodistal.
    half: [f32; 2],
    levels: Vec<Level>,
    /// The border of the chewing surface, or the edge's outline, x and y.
    borders: Vec<[f32; 2]>,
}

impl<'a> Shape<'a> {
    fn of(model: &'a Model) -> Shape<'a> {
        let half = [0.5 * model.sizes.buccolingual[0], 0.5 * model.sizes.mesiodistal[0]];
        let neck = [model.sizes.buccolingual, model.sizes.mesiodistal].map(|[crown, neck]| neck / crown);
        let neck = Level { height: 0.0, sides: [neck[0], neck[0], neck[1], neck[1]] };
        let levels = std::iter::once(neck).chain(model.kind.levels().iter().copied()).collect();
        let mut shape = Shape { model, half, levels, borders: Vec::new() };
        shape.borders = (0..AROUND).map(|i| shape.outline(i, 1.0)).collect();
        shape
    }

    fn border(&self, i: usize) -> [f32; 2] {
        self.borders[i]
    }

    /// Where the side is at a height (share of the way from the neckline to the border), in a direction.
    fn outline(&self, i: usize, height: f32) -> [f32; 2] {
        let [buccal, lingual, mesial, distal] = self.sides(height);
        let angle = TAU * i as f32 / AROUND as f32;
        let power = 2.0 / self.model.kind.squareness();
        let bent = |v: f32| v.signum() * libm::powf(v.abs(), power);
        let (x, y) = (bent(libm::cosf(angle)), bent(libm::sinf(angle)));
        let across = 0.5 * (buccal - lingual) + 0.5 * (buccal + lingual) * x;
        let along = 0.5 * (distal - mesial) + 0.5 * (distal + mesial) * y;
        [across * self.half[0], along * self.half[1]]
    }

    /// Smoothly between the levels.
    fn sides(&self, height: f32) -> [f32; 4] {
        let levels = &self.levels;
        let upper = levels.iter().position(|l| l.height >= height).unwrap_or(levels.len() - 1).max(1);
        let (low, high) = (&levels[upper - 1], &levels[upper]);
        let (before, after) = (&levels[upper.saturating_sub(2)], &levels[(upper + 1).min(levels.len() - 1)]);
        let step = high.height - low.height;
        let t = (height - low.height) / step;
        std::array::from_fn(|s| {
            let slope = |a: &Level, b: &Level| (b.sides[s] - a.sides[s]) / (b.height - a.height).max(1e-3) * step;
            let (from, to) = (slope(before, high), slope(low, after));
            let (t2, t3) = (t * t, t * t * t);
            low.sides[s] * (2.0 * t3 - 3.0 * t2 + 1.0)
                + from * (t3 - 2.0 * t2 + t)
                + high.sides[s] * (3.0 * t2 - 2.0 * t3)
                + to * (t3 - t2)
        })
    }

    /// Height of the neckline in a direction: it rises toward the neighbours.
    fn neckline(&self, i: usize) -> f32 {
        let y = libm::sinf(TAU * i as f32 / AROUND as f32);
        let [mesial, distal] = self.model.sizes.neckline_rise;
        y * y * if y < 0.0 { mesial } else { distal }
    }

    fn side(&self, i: usize, height: f32) -> Vec3 {
        let [x, y] = self.outline(i, height);
        let (low, high) = (self.neckline(i), self.top(self.border(i)).z);
        Vec3::new(x, y, low + (high - low) * height)
    }

    /// A place of the chewing surface or edge.
    fn top(&self, [x, y]: [f32; 2]) -> Vec3 {
        let [first, second] = self.heights([x, y]);
        let close = (1.0 - (first - second) / FISSURE).max(0.0);
        Vec3::new(x, y, first + 0.25 * FISSURE * close * close)
    }

    /// The two highest slopes at a place, mm above the neck: their crossing is a fissure.
    fn heights(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let length = self.model.sizes.crown;
        if self.model.kind == Kind::Incisor {
            // Nearly straight, rounded toward its ends, more so distally.
            let along = y / self.half[1];
            let fall = if along < 0.0 { 0.45 } else { 0.9 };
            return [length - fall * along.abs().powi(3), f32::NEG_INFINITY];
        }
        let fall = |away: f32| FLANK * (libm::sqrtf(away * away + TIP * TIP) - TIP);
        let cusp = |&[cx, cy, height]: &[f32; 3]| {
            let (dx, dy) = (x - cx * self.half[0], y - cy * self.half[1]);
            height * length - fall(libm::sqrtf(dx * dx + dy * dy))
        };
        let ridge = |ridge: &super::teeth::Ridge| {
            let at = |[a, b]: [f32; 2]| [a * self.half[0], b * self.half[1]];
            let ([ax, ay], [bx, by]) = (at(ridge.from), at(ridge.to));
            let (wx, wy) = (bx - ax, by - ay);
            let part = (((x - ax) * wx + (y - ay) * wy) / (wx * wx + wy * wy)).clamp(0.0, 1.0);
            let (dx, dy) = (x - ax - wx * part, y - ay - wy * part);
            ridge.height * length - fall(libm::sqrtf(dx * dx + dy * dy))
        };
        let slopes = self.model.cusps.iter().map(cusp).chain(self.model.ridges.iter().map(ridge));
        slopes.fold(
            [f32::NEG_INFINITY; 2],
            |[first, second], h| {
                if h > first { [h, first] } else { [first, second.max(h)] }
            },
        )
    }

    fn tint_on_top(&self, at: [f32; 2]) -> Rgb {
        let [first, second] = self.heights(at);
        match self.model.kind {
            Kind::Incisor => EDGE,
            Kind::Canine => CANINE,
            Kind::Premolar | Kind::Molar => mixed(DEEP, PLAIN, (first - second) / FISSURE),
        }
    }

    fn tint_on_side(&self, height: f32, stub: f32) -> Rgb {
        if stub > 0.0 {
            return ROOT;
        }
        let body = if self.model.kind == Kind::Canine { CANINE } else { PLAIN };
        let near_neck = mixed(NECK, body, height / 0.45);
        match self.model.kind {
            Kind::Incisor => mixed(near_neck, EDGE, (height - 0.65) / 0.3),
            _ => near_neck,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::teeth::{LOWER, UPPER};
    use super::*;
    use crate::touch::Obstacle;

    #[test]
    fn every_crown_is_closed_and_as_large_as_the_table_says() {
        // Aim: a closed surface facing outward, of the table's widths and length to a tenth of a millimetre or two.
        for model in UPPER.iter().chain(&LOWER) {
            let Coloured { mesh, tints } = crown(model);
            assert!(Obstacle::new(&mesh).is_some(), "{model:?} is closed");
            assert!(mesh.volume_mm3() > 50.0, "{model:?}");
            assert_eq!(tints.len(), mesh.positions.len());
            let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            let found = Vec3::new(high.x - low.x, high.y - low.y, high.z);
            let sizes = &model.sizes;
            let wanted = Vec3::new(sizes.buccolingual[0], sizes.mesiodistal[0], sizes.crown);
            assert!((found - wanted).abs().max_element() < 0.25, "{model:?}: {found} not {wanted}");
        }
    }
}
