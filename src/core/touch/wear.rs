//! Rate law: wear by the work of a rotating bur.
//!
//! Takes the force, the bur's surface speed and the tissues' hardness. Gives the advance into each tissue, and keeps
//! the budget of work. Never changes a voxel.
//!
//! Preston (1927) for grinding and Archard (1953) for wear give the same law: dV/dt = k·F·v / H. The friction work
//! F·v is accumulated tick by tick; the removal of each increment, volume times hardness of each tissue, is charged
//! against it. The removed volume therefore follows the law, whatever the voxel size and the shape of the contact;
//! the estimate of the contact area only determines how evenly it is removed.

use super::material::Materials;
use crate::tick::TICK_S;
use crate::volume::{Edit, Label};

/// Parameters of the rate law, from the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WearRate {
    /// Speed of rotation, 1/min. Air turbines under load: 150 000–300 000; contra-angles: 5 000–200 000.
    pub rpm: f32,
    /// Removal rate relative to that of a medium diamond.
    pub grit: f32,
}

/// Fraction of the friction work that becomes chips: k of the law, dimensionless. With 0.06 a ball of 1.4 mm at 200
/// 000/min removes 0.3 mm³/s of enamel at 1 N, within the range (0.1–1 mm³/s) reported for high-speed diamonds.
/// Chosen by feel within that range; 0.02–0.2 is plausible.
const WEAR: f32 = 0.06;

/// Hardness, N/mm², per Vickers number, which is in kgf/mm².
const N_MM2_PER_HV: f32 = 9.806_65;

/// Ticks of work that are saved up at most: enough for a slow increment to change a stored density of coarse voxels,
/// too little to be felt when the bur meets soft tissue.
const SAVED_TICKS: f32 = 100.0;

/// Initial estimate of the contact area, and its bounds, as fractions of the bur's cross-section.
const INITIAL_AREA: f32 = 0.25;
const MIN_AREA: f32 = 0.01;
const MAX_AREA: f32 = 2.0;

/// Greatest change of the area estimate by one increment, as a factor. 1.2–3 behaves alike.
const MAX_AREA_STEP: f32 = 1.5;

/// Factor applied to the area estimate after an increment that has changed nothing.
const AREA_SHRINK: f32 = 0.9;

/// Budget of a bur's work.
#[derive(Clone, Debug, Default)]
pub(super) struct WorkBudget {
    /// Work not yet spent on removal, N·mm; negative if an increment has removed too much.
    balance: f32,
    /// Estimate of the contact area as a fraction of the bur's cross-section; 0 before the first increment.
    area_share: f32,
    /// Cross-section of the bur, mm².
    cross_section: f32,
    /// Planned and actual cost of the increment in progress, N·mm.
    planned: f32,
    spent: f32,
}

impl WorkBudget {
    /// Resets the budget at a loss of contact: accumulated work is lost.
    pub fn reset(&mut self) {
        *self = WorkBudget::default();
    }

    /// Adds the work of a tick; returns true if it is greater than zero.
    pub fn accumulate(&mut self, rate: &WearRate, radius: f32, spring: f32) -> bool {
        let surface_speed = core::f32::consts::TAU * radius * rate.rpm / 60.0;
        let work = WEAR * rate.grit * spring * surface_speed * TICK_S as f32;
        self.balance = (self.balance + work).min(SAVED_TICKS * work);
        self.cross_section = core::f32::consts::PI * radius * radius;
        work > 0.0
    }

    /// Fills `advance` for every tissue by the rate law, mm; returns the greatest.
    pub fn plan_advance(&mut self, advance: &mut [f32; 256], materials: &Materials, max_advance: f32) -> f32 {
        self.calibrate_area();
        let area = self.area_share * self.cross_section;
        let mut deepest = 0.0;
        for (label, material) in materials.labelled() {
            let hardness = hardness(materials, label);
            let depth = match (material.cut_force, hardness) {
                (Some(_), Some(hardness)) => (self.balance / (hardness * area.max(1e-6))).clamp(0.0, max_advance),
                _ => 0.0,
            };
            advance[usize::from(label.0)] = depth;
            deepest = f32::max(deepest, depth);
        }
        self.planned = self.balance.max(0.0);
        deepest
    }

    /// Charges the cost of the removed matter.
    pub fn spend(&mut self, edits: &[Edit], materials: &Materials, voxel_mm3: f32) {
        let cost: f32 = edits
            .iter()
            .map(|e| {
                let gone = e.before.density.unit() - e.after.density.unit();
                gone * voxel_mm3 * hardness(materials, e.before.label).unwrap_or(0.0)
            })
            .sum();
        self.balance -= cost;
        self.spent += cost;
    }

    /// Corrects the area estimate by the cost of the last increment.
    fn calibrate_area(&mut self) {
        if self.area_share == 0.0 {
            self.area_share = INITIAL_AREA;
        } else if self.planned > 0.0 {
            // An increment that has changed no stored density only shows that it was too small.
            let correction = match self.spent > 0.0 {
                true => (self.spent / self.planned).clamp(1.0 / MAX_AREA_STEP, MAX_AREA_STEP),
                false => AREA_SHRINK,
            };
            self.area_share = (self.area_share * correction).clamp(MIN_AREA, MAX_AREA);
        }
        (self.planned, self.spent) = (0.0, 0.0);
    }
}

/// Hardness, N/mm²; `None` for a tissue without hardness, which does not wear.
fn hardness(materials: &Materials, label: Label) -> Option<f32> {
    materials.get(label).hardness.map(|hv| hv * N_MM2_PER_HV)
}
