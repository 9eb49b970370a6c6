//! The pulp: a chamber with horns, and canals that follow the roots.

use crate::blend::{mix, smooth_intersection, smooth_union};
use crate::form;
use crate::form::ToothForm;
use crate::loft::{Loft, LoftSection, MIN_PULP_HALF_WIDTH, SecondaryDentine};

/// The pulp in mm.
pub(super) struct Pulp {
    chamber: Loft,
    horns: Vec<Horn>,
    canals: Vec<Canal>,
}

/// A cone with rounded ends from the chamber toward a cusp.
struct Horn {
    base: [f32; 3],
    tip: [f32; 3],
    /// Radii at the base and the tip, mm.
    radii: [f32; 2],
}

struct Canal {
    form: form::CanalForm,
    /// Heights of the apical end and the orifice, mm.
    end: f32,
    orifice: f32,
}

/// Radii of a horn at the chamber and at its tip, mm: young molars on CBCT, estimated by eye.
const HORN_RADII: [f32; 2] = [0.6, 0.2];

/// Rounding of the junctions of canals and horns with the chamber, mm.
const FUNNEL: f32 = 0.35;

/// Overlap of the canals with the chamber, mm, so that they are connected.
const OVERLAP: f32 = 0.4;

/// Rise of the floor of a chamber above a furcation, extrapolated to a remaining share of 0, mm. Most secondary dentine
/// is deposited on floor and roof, least on the walls (Philippas, *Influence of occlusal wear and age on formation of
/// dentin and size of pulp chamber*, J Dent Res 40, 1961). The walls keep their positions, since canals begin at their
/// base.
const MAX_FLOOR_RISE: f32 = 0.5;

/// Remaining pulp after deposition of secondary dentine, as shares of the form.
struct RemainingPulp {
    chamber: SecondaryDentine,
    horn: f32,
    horn_width: f32,
    /// Share of the distance from the axis at which horns leave the narrowed chamber; at the original distance, a thin
    /// horn would lie beside it.
    spread: f32,
    canal: f32,
}

impl RemainingPulp {
    const UNCHANGED: RemainingPulp = RemainingPulp {
        chamber: SecondaryDentine { width: 1.0, height: 1.0, floor: 0.0 },
        horn: 1.0,
        horn_width: 1.0,
        spread: 1.0,
        canal: 1.0,
    };

    /// Returns the remaining pulp for a share of its area on a radiograph. Above the neck the height decreases with the
    /// share, and the width makes up the rest. Horns recede first.
    fn of(share: f32, has_floor: bool) -> RemainingPulp {
        let width = 0.25 + 0.75 * share;
        let chamber = match has_floor {
            true => SecondaryDentine { width: 1.0, height: share, floor: MAX_FLOOR_RISE * (1.0 - share) },
            false => SecondaryDentine { width, height: share.min(1.0), floor: 0.0 },
        };
        let spread = chamber.width.min(1.0) * (1.0 - 0.4 * (1.0 - share.min(1.0)));
        RemainingPulp { chamber, horn: share * share, horn_width: share.min(1.0), spread, canal: width }
    }
}

impl Pulp {
    /// Makes the pulp of a form. Canals follow `roots`; `mm` converts shares x, y, z of the neck to mm.
    pub(super) fn new(form: &ToothForm, roots: &[Loft], mm: impl Fn([f32; 3]) -> [f32; 3], tips: &[[f32; 3]]) -> Pulp {
        let remaining = form
            .age_effects
            .map_or(RemainingPulp::UNCHANGED, |aged| RemainingPulp::of(aged.pulp_share, !form.roots.is_empty()));
        let chamber = Loft::new(&form.pulp.chamber, form.side_metric, mm)
            .with_secondary_dentine(form.age_effects.map(|_| remaining.chamber));
        let (floor, roof) = (chamber.lowest(), chamber.highest());
        let radii = HORN_RADII.map(|radius| (radius * remaining.horn_width).max(MIN_PULP_HALF_WIDTH));
        let horn = |(cusp, tip): (&form::Cusp, &[f32; 3])| {
            let spread = form.pulp.horn_spread * remaining.spread;
            let base = [tip[0] * spread, tip[1] * spread, roof - radii[0]];
            let rise = (cusp.horn * remaining.horn + radii[0] - radii[1]) / (tip[2] - base[2]);
            Horn { base, tip: std::array::from_fn(|a| mix(base[a], tip[a], rise)), radii }
        };
        let canal = |canal: &form::CanalForm| {
            let end = roots.get(canal.root).map_or(floor, |root| root.lowest() + canal.closed);
            let narrowed = |half: f32| (half * remaining.canal).max(half.min(MIN_PULP_HALF_WIDTH));
            let form = form::CanalForm { orifice: canal.orifice.map(narrowed), end: narrowed(canal.end), ..*canal };
            Canal { form, end, orifice: floor + OVERLAP }
        };
        Pulp {
            horns: form.occlusal.cusps.iter().zip(tips).map(horn).collect(),
            canals: form.pulp.canals.iter().map(canal).collect(),
            chamber,
        }
    }

    /// Returns the pulp at a height; `roots` are the roots at the same height.
    pub(super) fn at_height(&self, z: f32, roots: &[LoftSection]) -> PulpSection<'_> {
        let canals = self.canals.iter().filter_map(|canal| canal.at_height(z, roots.get(canal.form.root)?));
        PulpSection { z, chamber: self.chamber.at_height(z), horns: &self.horns, canals: canals.collect() }
    }
}

impl Canal {
    fn at_height(&self, z: f32, root: &LoftSection) -> Option<CanalSection> {
        let ends = (self.end - z).max(z - self.orifice);
        let share = ((z - self.end) / (self.orifice - self.end)).clamp(0.0, 1.0);
        let half = self.form.orifice.map(|wide| mix(self.form.end, wide, share));
        (ends < 2.0).then_some(CanalSection { centre: root.place(self.form.at), half, ends })
    }
}

/// The pulp at one height.
pub(super) struct PulpSection<'a> {
    z: f32,
    chamber: LoftSection,
    horns: &'a [Horn],
    canals: Vec<CanalSection>,
}

struct CanalSection {
    centre: [f32; 2],
    half: [f32; 2],
    ends: f32,
}

impl PulpSection<'_> {
    /// Returns the signed distance from the pulp, mm.
    pub(super) fn distance(&self, at: [f32; 2]) -> f32 {
        let horns = self.horns.iter().map(|horn| horn.distance([at[0], at[1], self.z]));
        let canals = self.canals.iter().map(|canal| canal.distance(at));
        horns.chain(canals).fold(self.chamber.distance(at), |a, b| smooth_union(a, b, FUNNEL))
    }
}

impl Horn {
    fn distance(&self, at: [f32; 3]) -> f32 {
        let along: [f32; 3] = std::array::from_fn(|a| self.tip[a] - self.base[a]);
        let from: [f32; 3] = std::array::from_fn(|a| at[a] - self.base[a]);
        let t = (dot(from, along) / dot(along, along)).clamp(0.0, 1.0);
        let beside: [f32; 3] = std::array::from_fn(|a| from[a] - t * along[a]);
        dot(beside, beside).sqrt() - mix(self.radii[0], self.radii[1], t)
    }
}

impl CanalSection {
    fn distance(&self, at: [f32; 2]) -> f32 {
        let [dx, dy] = [0, 1].map(|a| at[a] - self.centre[a]);
        let [u, v] = [dx / self.half[0], dy / self.half[1]];
        let norm = (u * u + v * v).sqrt();
        let narrow = self.half[0].min(self.half[1]);
        let side = if norm < 1e-3 { -narrow } else { (dx * dx + dy * dy).sqrt() * (1.0 - 1.0 / norm) };
        smooth_intersection(side, self.ends, narrow)
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
