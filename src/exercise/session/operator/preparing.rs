//! Removal of tissue: decay with a bur or a spoon excavator, and cavity outlines in a sound tooth.

use crate::catalog::TissueRole;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Lesion, Scenario};
use crate::session::operator::excavation::Excavation;
use crate::session::operator::file::CutFile;
use crate::session::operator::{Operator, OperatorTask, TOUCH_HEIGHT};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Label, Volume, distance};

/// Progress of inspecting a cavity and cutting it again.
#[derive(Clone, Debug)]
pub(super) struct PreparingTask {
    cut: CutFile,
    instrument: usize,
    /// Complete path of the bur's tip, tooth space, mm.
    path: Vec<Vec3>,
    /// Number of remaining passes.
    passes_left: u32,
}

/// Distance by which each further pass over a lesion goes beyond the pass before, mm: what is left lies at the border.
const FURTHER: f32 = 0.04;

/// Depth by which the bur must overlap a remnant of the target for a person to see the remnant, mm: half a voxel.
const VISIBLE_REMNANT: f32 = 0.05;

impl Operator {
    pub(super) fn cut(&mut self, cut: &CutFile, instrument: usize) {
        let radius = self.radius(instrument);
        if !self.scenario.instruments[instrument].is_bur() {
            self.excavate_by_hand(cut, instrument);
            self.lift_off();
            return;
        }
        if self.workpiece.lesions_in_volume().is_empty() {
            self.prepare(cut, instrument);
        }
        for lesion in self.workpiece.clone().lesions_in_volume() {
            for pass in 0..cut.passes {
                let before = self.plan.len();
                match lesion.radii {
                    Some(radii) => self.cut_pass(cut, lesion, radii, radius, pass),
                    None => self.excavate(cut, lesion, radius),
                }
                let tasks = self.plan.split_off(before);
                self.plan.push_back(OperatorTask::SkipIfCleared { percent: cut.until_cleared_pct, tasks: tasks.len() });
                self.plan.extend(tasks);
            }
        }
        self.lift_off();
    }

    /// Plans one pass over an ellipsoidal lesion, in rings from its floor up its walls. The bur's centre follows a
    /// bowl inside the lesion, so that the bur's surface follows the lesion's border.
    fn cut_pass(&mut self, cut: &CutFile, lesion: &Lesion, radii: Vec3, radius: f32, pass: u32) {
        /// Angle above the lesion's equator up to which its walls are followed, rad.
        const TOP: f32 = 0.6;
        const POINTS: u32 = 32;
        let margin = cut.margin_mm + pass as f32 * FURTHER;
        let bowl = (radii - radius + margin).max(Vec3::splat(0.02));
        let floor = -0.5 * core::f32::consts::PI;
        let rings = ((TOP - floor) * bowl.max_element() / cut.pitch_mm).ceil().max(2.0) as u32;
        let tooth_from_own = self.workpiece.teeth[lesion.tooth].tooth_from_own;
        let on_bowl = |i: u32| {
            let rise = floor + (TOP - floor) * i as f32 / (rings * POINTS) as f32;
            // Every second pass goes in the opposite sense.
            let sense = if pass.is_multiple_of(2) { 1.0 } else { -1.0 };
            let azimuth = sense * core::f32::consts::TAU * i as f32 / POINTS as f32;
            let (level, up) = (libm::cosf(rise), libm::sinf(rise));
            let own = Vec3::new(level * libm::cosf(azimuth), level * libm::sinf(azimuth), up) * bowl;
            lesion.centre + tooth_from_own.rotate(own)
        };
        let surface =
            self.surface_at(lesion.centre.x, lesion.centre.y, self.top()).map_or(lesion.centre.z, |(p, _)| p.z);
        let above = Vec3::new(lesion.centre.x, lesion.centre.y, surface + radius + TOUCH_HEIGHT);
        self.travel_to(above);
        self.lead_bur(cut, [above].into_iter().chain((0..rings * POINTS).map(on_bowl)));
    }

    /// Plans one pass over decay of any shape, layer by layer from above. Decay nearer to another lesion is left to
    /// the pass over that lesion.
    fn excavate(&mut self, cut: &CutFile, lesion: &Lesion, radius: f32) {
        let workpiece = self.workpiece.clone();
        let (lesions, tissues) = (workpiece.lesions_in_volume(), &self.scenario.tissues);
        let is_own = |place: Vec3| {
            let away = lesion.centre.distance_squared(place);
            lesions.iter().all(|other| other.centre.distance_squared(place) >= away)
        };
        let is_near_pulp = self.near_pulp(cut.clear_of_pulp_mm);
        let excavation = Excavation { radius, below: radius, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let path = excavation.path(&workpiece.volume, |place, label| {
            tissues.role(label) == Some(TissueRole::Decay) && is_own(place) && !is_near_pulp(place)
        });
        let Some(first) = path.first() else { return };
        let above = Vec3::new(first.x, first.y, self.top() + radius + TOUCH_HEIGHT);
        self.travel_to(above);
        self.lead_bur(cut, [above].into_iter().chain(path));
    }

    /// Plans all passes of a blade over the decay that it can cut, layer by layer from above.
    fn excavate_by_hand(&mut self, cut: &CutFile, instrument: usize) {
        /// Share of the end's width used as its cutting width: a bowl is narrower where it cuts deepest.
        const BOWL: f32 = 0.7;
        let scenario = self.scenario.clone();
        let materials = scenario.factors.get(instrument).map(|f| scenario.tissues.materials().scaled_by(f));
        let can_cut = |label: Label| materials.as_ref().is_some_and(|m| m.get(label).cut_force.is_some());
        let radius = BOWL * scenario.instruments[instrument].to_instrument().face_radius();
        let excavation = Excavation { radius, below: 0.0, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let (volume, is_near_pulp) = (self.workpiece.volume.clone(), self.near_pulp(cut.clear_of_pulp_mm));
        let path = excavation.path(&volume, |place, label| {
            scenario.tissues.role(label) == Some(TissueRole::Decay) && can_cut(label) && !is_near_pulp(place)
        });
        let Some(first) = path.first() else { return };
        let above = first.with_z(self.top() + TOUCH_HEIGHT);
        for _ in 0..cut.passes {
            self.travel_to(above);
            self.lead_bur(cut, [above].into_iter().chain(path.iter().copied()));
        }
    }

    /// Returns a test of whether a voxel's centre (tooth space, mm) lies closer than `clearance` (mm) to the pulp.
    fn near_pulp(&self, clearance: f32) -> impl Fn(Vec3) -> bool + use<> {
        let (volume, tissues) = (&self.workpiece.volume, &self.scenario.tissues);
        let grid = *volume.grid();
        let is_pulp = |index: usize| tissues.role(volume.labels()[index]) == Some(TissueRole::Vulnerable);
        let distances = (clearance > 0.0).then(|| distance::to_set(&grid, is_pulp));
        move |place| {
            let index = grid.nearest(place).map(|cell| grid.index(cell));
            distances.as_ref().zip(index).is_some_and(|(distances, index)| distances[index] < clearance)
        }
    }

    /// Plans the preparation of all target zones of a sound tooth, layer by layer from above.
    fn prepare(&mut self, cut: &CutFile, instrument: usize) {
        let radius = self.radius(instrument);
        let wide = self.scenario.instruments[instrument].to_instrument().head_radius();
        let excavation = Excavation { radius: wide, below: radius, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let path = excavation.path(&self.workpiece.volume, |place, _| is_outlined(&self.scenario, place));
        let run = self.stroke_tasks(cut.into(), radius, path.clone());
        self.plan.extend(run);
        if cut.passes > 1 {
            let passes_left = cut.passes - 1;
            let again = PreparingTask { cut: cut.clone(), instrument, path, passes_left };
            self.plan.push_back(OperatorTask::PrepareAgain(again));
        }
    }

    /// Inspects the cavity and plans the parts of the bur's path on which the bur would still meet the target.
    pub(super) fn prepare_again(&mut self, preparing: PreparingTask) {
        let PreparingTask { cut, instrument, path, passes_left } = &preparing;
        let radius = self.radius(*instrument);
        let Some(visible_volume) = &self.visible_volume else { return };
        let bur = self.scenario.instruments[*instrument].to_instrument();
        let remaining = remaining_target(visible_volume, |place| is_outlined(&self.scenario, place));
        let is_met = |tip: &&Vec3| remaining.iter().any(|at| bur.end_distance(*at - **tip) < -VISIBLE_REMNANT);
        let path: Vec<Vec3> = path.iter().filter(is_met).copied().collect();
        let mut tasks = Vec::new();
        for run in path.chunk_by(|a, b| a.distance(*b) < 3.0 * cut.pitch_mm) {
            tasks.extend(self.stroke_tasks(cut.into(), radius, run.to_vec()));
        }
        if !path.is_empty() && *passes_left > 1 {
            tasks.push(OperatorTask::PrepareAgain(PreparingTask { passes_left: passes_left - 1, ..preparing }));
        }
        self.do_next(tasks);
    }

    /// Plans leading the bur along a path in tooth space (mm), waiting where the bur does not advance.
    fn lead_bur(&mut self, cut: &CutFile, path: impl Iterator<Item = Vec3>) {
        let guide = self.guide_task(cut.into(), path);
        self.plan.push_back(guide);
    }
}

/// Returns true for a point (tooth space, mm) inside a target zone.
fn is_outlined(scenario: &Scenario, place: Vec3) -> bool {
    scenario.zones.iter().any(|zone| zone.role == ZoneRole::Target && zone.region.contains(place))
}

/// Returns the centres of the solid voxels that are to be removed and still present; tooth space, mm.
fn remaining_target(visible_volume: &Volume, is_meant: impl Fn(Vec3) -> bool) -> Vec<Vec3> {
    let grid = visible_volume.grid();
    let solid = visible_volume.densities().iter().enumerate().filter(|(_, density)| density.is_solid());
    solid.map(|(index, _)| grid.centre(grid.cell(index))).filter(|place| is_meant(*place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{ResolveMode, Workpiece, resolve};
    use crate::session::operator::OperatorFile;
    use std::sync::Arc;
    use typodont_core::device::{DeviceSpec, Move};
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    #[test]
    fn a_bur_that_keeps_clear_of_the_pulp_turns_back_above_it() {
        // Aim: the clearance holds for the path, and changes nothing far from the pulp. Method: the planned paths over deep
        // caries; a bur of 0.5 mm that removes a voxel's layer reaches down to a voxel above the clearance.
        const SPACING: f32 = 0.25;
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/12-deep-caries.json");
        let text = std::fs::read_to_string(path).unwrap().replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.25");
        let library = Library::shipped();
        let scenario = Arc::new(resolve(SourceText::new("12.json", text), &library, ResolveMode::ReadScans).unwrap());
        let workpiece = Arc::new(Workpiece::make(&scenario, 1).unwrap());
        let file = OperatorFile::read(&library, "careful").unwrap();
        let lesion = workpiece.lesions[0].clone();
        let grid = *workpiece.volume.grid();
        let is_pulp =
            |index: usize| scenario.tissues.role(workpiece.volume.labels()[index]) == Some(TissueRole::Vulnerable);
        let pulp_distances = distance::to_set(&grid, is_pulp);
        // Smallest distance of the bur's surface from the pulp along the path, mm, and the path's number of points.
        let nearest = |clear_of_pulp_mm: f32| {
            let mut operator =
                Operator::new(file.clone(), scenario.clone(), workpiece.clone(), DeviceSpec::phantom_omni(), 1);
            let instrument = scenario.instruments.iter().position(|i| i.is_bur()).unwrap();
            let radius = operator.radius(instrument);
            let cut = CutFile { clear_of_pulp_mm, ..any_cut() };
            operator.excavate(&cut, &lesion, radius);
            let path = operator.plan.iter().find_map(|task| match task {
                OperatorTask::Move(Move::TrackTip { path, .. }) => Some(path.clone()),
                _ => None,
            });
            let tooth_from_world = workpiece.world_from_tooth.inverse();
            let path: Vec<Vec3> = path.unwrap().into_iter().map(|place| tooth_from_world * place).collect();
            let distances =
                path.iter().filter_map(|tip| Some(pulp_distances[grid.index(grid.nearest(*tip)?)] - radius));
            (distances.fold(f32::INFINITY, f32::min), path.len())
        };
        let (without, with) = (nearest(0.0), nearest(1.0));
        assert!(without.0 < 1.0 - SPACING, "the caries reaches within {} mm of the pulp", without.0);
        assert!(with.0 > 1.0 - SPACING, "the bur comes within {} mm of the pulp", with.0);
        assert!(with.1 > without.1 / 2, "{} of {} points are left", with.1, without.1);
    }

    fn any_cut() -> CutFile {
        CutFile {
            press_n: 1.0,
            patience_s: 1.0,
            speed_mm_s: 1.0,
            pitch_mm: 0.4,
            lean_mm: 4.0,
            margin_mm: 0.0,
            passes: 1,
            until_cleared_pct: 100.0,
            backs_off: true,
            limits_force: true,
            clear_of_pulp_mm: 0.0,
        }
    }
}
