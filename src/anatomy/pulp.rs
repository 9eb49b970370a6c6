//! The pulp: a chamber with horns, and canals that follow the roots.

use super::blend::{common, joined, mix};
use super::form::{self, Form};
use super::section::{Limb, Section};

/// The pulp in mm.
pub(super) struct Pulp {
    chamber: Limb,
    horns: Vec<Horn>,
    canals: Vec<Canal>,
}

/// A cone with round ends from the chamber toward a cusp.
struct Horn {
    base: [f32; 3],
    tip: [f32; 3],
}

struct Canal {
    form: form::Canal,
    /// Heights of its end and its orifice.
    end: f32,
    orifice: f32,
}

/// Radius of a horn where it leaves the chamber and at its tip, mm: young molars on CBCT, by eye.
const HORN: [f32; 2] = [0.6, 0.2];

/// Rounding where canals and horns meet the chamber, mm.
const FUNNEL: f32 = 0.35;

/// How far the canals reach up into the chamber, mm, so that both surely meet.
const OVERLAP: f32 = 0.4;

impl Pulp {
    /// `roots` are what canals follow; `mm` turns shares x, y, z of the neck into mm.
    pub(super) fn new(form: &Form, roots: &[Limb], mm: impl Fn([f32; 3]) -> [f32; 3], tips: &[[f32; 3]]) -> Pulp {
        let chamber = Limb::new(&form.pulp.chamber, form.sides, mm);
        let (floor, roof) = (chamber.lowest(), chamber.highest());
        let horn = |(cusp, tip): (&form::Cusp, &[f32; 3])| {
            let spread = form.pulp.horn_spread;
            let base = [tip[0] * spread, tip[1] * spread, roof - HORN[0]];
            let rise = (cusp.horn + HORN[0] - HORN[1]) / (tip[2] - base[2]);
            Horn { base, tip: std::array::from_fn(|a| mix(base[a], tip[a], rise)) }
        };
        let canal = |canal: &form::Canal| {
            let end = roots.get(canal.root).map_or(floor, |root| root.lowest() + canal.closed);
            Canal { form: *canal, end, orifice: floor + OVERLAP }
        };
        Pulp {
            horns: form.relief.cusps.iter().zip(tips).map(horn).collect(),
            canals: form.pulp.canals.iter().map(canal).collect(),
            chamber,
        }
    }

    /// `roots` are the roots cut at the same height.
    pub(super) fn cut(&self, z: f32, roots: &[Section]) -> PulpSection<'_> {
        let canals = self.canals.iter().filter_map(|canal| canal.cut(z, roots.get(canal.form.root)?));
        PulpSection { z, chamber: self.chamber.cut(z), horns: &self.horns, canals: canals.collect() }
    }
}

impl Canal {
    fn cut(&self, z: f32, root: &Section) -> Option<CanalSection> {
        let ends = (self.end - z).max(z - self.orifice);
        let share = ((z - self.end) / (self.orifice - self.end)).clamp(0.0, 1.0);
        let half = self.form.orifice.map(|wide| mix(self.form.end, wide, share));
        (ends < 2.0).then_some(CanalSection { centre: root.place(self.form.at), half, ends })
    }
}

/// One level of the pulp.
pub(super) struct PulpSection<'a> {
    z: f32,
    chamber: Section,
    horns: &'a [Horn],
    canals: Vec<CanalSection>,
}

struct CanalSection {
    centre: [f32; 2],
    half: [f32; 2],
    ends: f32,
}

impl PulpSection<'_> {
    /// Signed distance to the pulp.
    pub(super) fn distance(&self, at: [f32; 2]) -> f32 {
        let horns = self.horns.iter().map(|horn| horn.distance([at[0], at[1], self.z]));
        let canals = self.canals.iter().map(|canal| canal.distance(at));
        horns.chain(canals).fold(self.chamber.distance(at), |a, b| joined(a, b, FUNNEL))
    }
}

impl Horn {
    fn distance(&self, at: [f32; 3]) -> f32 {
        let along: [f32; 3] = std::array::from_fn(|a| self.tip[a] - self.base[a]);
        let from: [f32; 3] = std::array::from_fn(|a| at[a] - self.base[a]);
        let t = (dot(from, along) / dot(along, along)).clamp(0.0, 1.0);
        let beside: [f32; 3] = std::array::from_fn(|a| from[a] - t * along[a]);
        dot(beside, beside).sqrt() - mix(HORN[0], HORN[1], t)
    }
}

impl CanalSection {
    fn distance(&self, at: [f32; 2]) -> f32 {
        let [dx, dy] = [0, 1].map(|a| at[a] - self.centre[a]);
        let [u, v] = [dx / self.half[0], dy / self.half[1]];
        let norm = (u * u + v * v).sqrt();
        let narrow = self.half[0].min(self.half[1]);
        let side = if norm < 1e-3 { -narrow } else { (dx * dx + dy * dy).sqrt() * (1.0 - 1.0 / norm) };
        common(side, self.ends, narrow)
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
