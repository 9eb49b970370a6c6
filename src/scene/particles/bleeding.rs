//! Bleeding of an opened pulp.

use super::collision::CollisionWorld;
use super::water::Water;
use super::xorshift::Xorshift32;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Edit, Grid, Label};

/// Places from which blood comes, at most, and the least distance between two of them, mm.
const MAX_OPENINGS: usize = 8;
const OPENING_DISTANCE: f32 = 0.5;

/// One drop in so many steps of 4 ms, half a cubic millimetre in a second, and the number of steps after which the blood has clotted, and
/// fills a small cavity. Blood of a healthy pulp clots within minutes; this is shorter, so that the lesson goes on.
const DROP_INTERVAL: usize = 2;
const MAX_STEPS: usize = 4000;

/// Bleeding of the tissue with one label.
pub struct Bleeding {
    /// The pulp's; `None` if nothing bleeds.
    label: Option<Label>,
    /// Tooth space, mm.
    openings: [Vec3; MAX_OPENINGS],
    opening_count: usize,
    step_count: usize,
}

impl Bleeding {
    pub fn of(label: Option<Label>) -> Bleeding {
        Bleeding { label, openings: [Vec3::ZERO; MAX_OPENINGS], opening_count: 0, step_count: 0 }
    }

    /// Opens the pulp where a voxel of it was removed.
    pub fn record_removal(&mut self, edit: &Edit, grid: &Grid) {
        if self.label != Some(edit.before.label) || self.opening_count == MAX_OPENINGS {
            return;
        }
        let place = grid.centre(grid.cell(edit.index as usize));
        let known = &self.openings[..self.opening_count];
        if known.iter().all(|opening| opening.distance(place) > OPENING_DISTANCE) {
            self.openings[self.opening_count] = place;
            self.opening_count += 1;
        }
    }

    /// True while drops leave an opening.
    pub fn is_flowing(&self) -> bool {
        self.opening_count > 0 && self.step_count < MAX_STEPS
    }

    /// One step: a drop leaves one of the openings.
    pub fn step(&mut self, water: &mut Water, world: &CollisionWorld, rng: &mut Xorshift32) {
        if !self.is_flowing() {
            return;
        }
        self.step_count += 1;
        if self.step_count.is_multiple_of(DROP_INTERVAL) {
            let opening = self.openings[self.step_count / DROP_INTERVAL % self.opening_count];
            if let Some(place) = world.nearest_free(world.world_from_tooth * opening) {
                water.bleed(place, rng);
            }
        }
    }
}
