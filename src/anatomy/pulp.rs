//! The pulp: a chamber with horns, and canals that follow the roots.

use super::blend::{common, joined, mix};
use super::form::{self, Form};
use super::section::{Limb, Lined, Section, THREAD};

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
    /// Radius at its base and its tip.
    wide: [f32; 2],
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

/// How much the floor of a chamber over a furcation rises until nothing of a pulp's shadow would be left, mm: most dentine is laid down
/// on floor and roof, least on the walls (Philippas, *Influence of occlusal wear and age on formation of dentin and size of pulp
/// chamber*, J Dent Res 40, 1961). The walls stay where they are written, for canals leave at their feet.
const FLOOR: f32 = 0.5;

/// What secondary dentine has left of a pulp, as shares of what is written.
struct Left {
    chamber: Lined,
    horn: f32,
    horn_width: f32,
    /// How far from the axis horns leave a chamber that has come in: a thin one farther out would stand beside it.
    spread: f32,
    canal: f32,
}

impl Left {
    const ALL: Left = Left {
        chamber: Lined { width: 1.0, height: 1.0, floor: 0.0 },
        horn: 1.0,
        horn_width: 1.0,
        spread: 1.0,
        canal: 1.0,
    };

    /// Of a pulp's shadow on an X-ray so much is left: above the neck its height falls with it, and its width by the rest. Horns go
    /// first.
    fn of(share: f32, has_floor: bool) -> Left {
        let width = 0.25 + 0.75 * share;
        let chamber = match has_floor {
            true => Lined { width: 1.0, height: share, floor: FLOOR * (1.0 - share) },
            false => Lined { width, height: share.min(1.0), floor: 0.0 },
        };
        let spread = chamber.width.min(1.0) * (1.0 - 0.4 * (1.0 - share.min(1.0)));
        Left { chamber, horn: share * share, horn_width: share.min(1.0), spread, canal: width }
    }
}

impl Pulp {
    /// `roots` are what canals follow; `mm` turns shares x, y, z of the neck into mm.
    pub(super) fn new(form: &Form, roots: &[Limb], mm: impl Fn([f32; 3]) -> [f32; 3], tips: &[[f32; 3]]) -> Pulp {
        let left = form.aged.map_or(Left::ALL, |aged| Left::of(aged.pulp, !form.roots.is_empty()));
        let chamber = Limb::new(&form.pulp.chamber, form.sides, mm).lined(form.aged.map(|_| left.chamber));
        let (floor, roof) = (chamber.lowest(), chamber.highest());
        let wide = HORN.map(|radius| (radius * left.horn_width).max(THREAD));
        let horn = |(cusp, tip): (&form::Cusp, &[f32; 3])| {
            let spread = form.pulp.horn_spread * left.spread;
            let base = [tip[0] * spread, tip[1] * spread, roof - wide[0]];
            let rise = (cusp.horn * left.horn + wide[0] - wide[1]) / (tip[2] - base[2]);
            Horn { base, tip: std::array::from_fn(|a| mix(base[a], tip[a], rise)), wide }
        };
        let canal = |canal: &form::Canal| {
            let end = roots.get(canal.root).map_or(floor, |root| root.lowest() + canal.closed);
            let narrowed = |half: f32| (half * left.canal).max(half.min(THREAD));
            let form = form::Canal { orifice: canal.orifice.map(narrowed), end: narrowed(canal.end), ..*canal };
            Canal { form, end, orifice: floor + OVERLAP }
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
        dot(beside, beside).sqrt() - mix(self.wide[0], self.wide[1], t)
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
