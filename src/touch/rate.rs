//! How much a bur wears away by the work it does: the rate law.
//!
//! Takes the force, the bur's surface speed and the tissues' hardness. Gives how far the bur advances into each tissue, and
//! keeps the account. Never touches a voxel.
//!
//! Preston (1927) for grinding and Archard (1953) for wear say the same: dV/dt = k·F·v / H. The work of friction F·v is
//! saved up tick by tick; what a bite has truly taken, each tissue's volume times its hardness, is paid from it. So the
//! volume follows the law whatever the voxels' size and the shape of the contact; the estimate of the contact's area only
//! decides how evenly it falls.

use super::material::Materials;
use crate::tick::TICK_S;
use crate::volume::{Edit, Label};

/// The rate law's numbers, from the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Turns of the bur, 1/min. Air turbines under load: 150 000–300 000; contra-angles: 5 000–200 000.
    pub rpm: f32,
    /// How many times more the bur takes than a medium diamond.
    pub grit: f32,
}

/// Share of the work of friction that becomes chips, k of the law: dimensionless. With 0.06 a ball of 1.4 mm at
/// 200 000/min takes 0.3 mm³/s of enamel at 1 N, within the order (0.1–1 mm³/s) of what is reported for high-speed
/// diamonds. By feel within that order; 0.02–0.2 is plausible.
const WEAR: f32 = 0.06;

/// N/mm² of hardness per Vickers number: kgf/mm².
const N_MM2_PER_HV: f32 = 9.806_65;

/// Work of so many ticks is saved up at most: enough for a slow bite to change a stored density of coarse voxels, little
/// enough that nothing is felt of it when the bur meets something soft.
const SAVED_TICKS: f32 = 100.0;

/// Contact area that is assumed at first, and its bounds, as shares of the bur's cross-section.
const AREA_AT_FIRST: f32 = 0.25;
const AREA_LEAST: f32 = 0.01;
const AREA_MOST: f32 = 2.0;

/// How far one bite may change the estimate of the area, as a factor. 1.2–3 behaves alike.
const AREA_STEP: f32 = 1.5;

/// What a bite that has changed nothing makes of it.
const UNSEEN: f32 = 0.9;

/// The account of a bur's work.
#[derive(Clone, Debug, Default)]
pub(super) struct Account {
    /// N·mm of wear not yet turned into chips; negative when a bite has taken too much.
    saved: f32,
    /// Estimate of the contact's area as a share of the bur's cross-section; 0 before the first bite.
    area_share: f32,
    /// mm²
    cross_section: f32,
    /// What the bite being carried out was meant to cost, and what it has cost so far, N·mm.
    planned: f32,
    paid: f32,
}

impl Account {
    /// Nothing is touched: what was saved up is lost.
    pub fn close(&mut self) {
        *self = Account::default();
    }

    /// Saves up a tick's work. True while the bur does any.
    pub fn save(&mut self, rate: &Rate, radius: f32, spring: f32) -> bool {
        let surface_speed = core::f32::consts::TAU * radius * rate.rpm / 60.0;
        let work = WEAR * rate.grit * spring * surface_speed * TICK_S as f32;
        self.saved = (self.saved + work).min(SAVED_TICKS * work);
        self.cross_section = core::f32::consts::PI * radius * radius;
        work > 0.0
    }

    /// Fills how far the bur is to advance into every tissue, mm; returns the greatest.
    pub fn plan(&mut self, advance: &mut [f32; 256], materials: &Materials, most: f32) -> f32 {
        self.learn();
        let area = self.area_share * self.cross_section;
        let mut deepest = 0.0;
        for (label, material) in materials.known() {
            let hardness = hardness(materials, label);
            let far = match (material.cut_force, hardness) {
                (Some(_), Some(hardness)) => (self.saved / (hardness * area.max(1e-6))).clamp(0.0, most),
                _ => 0.0,
            };
            advance[usize::from(label.0)] = far;
            deepest = f32::max(deepest, far);
        }
        self.planned = self.saved.max(0.0);
        deepest
    }

    /// Pays for what has fallen.
    pub fn pay(&mut self, edits: &[Edit], materials: &Materials, voxel_mm3: f32) {
        let cost: f32 = edits
            .iter()
            .map(|e| {
                let gone = e.before.density.unit() - e.after.density.unit();
                gone * voxel_mm3 * hardness(materials, e.before.label).unwrap_or(0.0)
            })
            .sum();
        self.saved -= cost;
        self.paid += cost;
    }

    /// Corrects the area by what the last bite has cost.
    fn learn(&mut self) {
        if self.area_share == 0.0 {
            self.area_share = AREA_AT_FIRST;
        } else if self.planned > 0.0 {
            // A bite too small to change any stored density tells nothing but that it was too small.
            let off = match self.paid > 0.0 {
                true => (self.paid / self.planned).clamp(1.0 / AREA_STEP, AREA_STEP),
                false => UNSEEN,
            };
            self.area_share = (self.area_share * off).clamp(AREA_LEAST, AREA_MOST);
        }
        (self.planned, self.paid) = (0.0, 0.0);
    }
}

/// N/mm²; `None` for a tissue without hardness, which no work wears away.
fn hardness(materials: &Materials, label: Label) -> Option<f32> {
    materials.get(label).hardness.map(|hv| hv * N_MM2_PER_HV)
}
