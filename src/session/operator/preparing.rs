//! Taking away: decay with a bur or a spoon, and what is to be prepared in a sound tooth.

use super::excavation::Excavation;
use super::file::CutFile;
use super::{Operator, TOUCH_HEIGHT, Task};
use crate::content::Role;
use crate::frame::Vec3;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Lesion, Scenario};
use crate::volume::{Label, Volume};

/// A cavity that is looked at and cut again.
#[derive(Clone, Debug)]
pub(super) struct Preparing {
    cut: CutFile,
    instrument: usize,
    /// All of the bur's way.
    path: Vec<Vec3>,
    /// Passes that are left.
    left: u32,
}

/// How deep a bur must reach into what is to go for a person to see that something is left there, mm: half a voxel.
const SEEN_TO_STAND: f32 = 0.05;

impl Operator {
    pub(super) fn cut(&mut self, cut: &CutFile, instrument: usize) {
        let radius = self.radius(instrument);
        if !self.scenario.instruments[instrument].is_bur() {
            self.scoop(cut, instrument);
            self.lift_off();
            return;
        }
        if self.workpiece.lesions.is_empty() {
            self.prepare(cut, instrument);
        }
        for lesion in &self.workpiece.clone().lesions {
            for pass in 0..cut.passes {
                let before = self.plan.len();
                match lesion.radii {
                    Some(radii) => self.cut_pass(cut, lesion, radii, radius, pass),
                    None => self.excavate(cut, lesion, radius),
                }
                let tasks = self.plan.split_off(before);
                self.plan.push_back(Task::SkipIfCleared { percent: cut.until_cleared_pct, tasks: tasks.len() });
                self.plan.extend(tasks);
            }
        }
        self.lift_off();
    }

    /// Down into the lesion, then round and round from its floor up its walls: where the bur's surface is to run along the
    /// lesion's border, its centre runs on a bowl.
    fn cut_pass(&mut self, cut: &CutFile, lesion: &Lesion, radii: Vec3, radius: f32, pass: u32) {
        /// Radians above the lesion's equator up to which its walls are followed.
        const TOP: f32 = 0.6;
        const POINTS: u32 = 32;
        let bowl = (radii - radius + cut.margin_mm).max(Vec3::splat(0.02));
        let floor = -0.5 * core::f32::consts::PI;
        let rings = ((TOP - floor) * bowl.max_element() / cut.pitch_mm).ceil().max(2.0) as u32;
        let on_bowl = |i: u32| {
            let rise = floor + (TOP - floor) * i as f32 / (rings * POINTS) as f32;
            // Every other pass goes the other way round.
            let way = if pass.is_multiple_of(2) { 1.0 } else { -1.0 };
            let turn = way * core::f32::consts::TAU * i as f32 / POINTS as f32;
            let (level, up) = (libm::cosf(rise), libm::sinf(rise));
            lesion.centre + Vec3::new(level * libm::cosf(turn), level * libm::sinf(turn), up) * bowl
        };
        let surface =
            self.surface_at(lesion.centre.x, lesion.centre.y, self.top()).map_or(lesion.centre.z, |(p, _)| p.z);
        let above = Vec3::new(lesion.centre.x, lesion.centre.y, surface + radius + TOUCH_HEIGHT);
        self.travel_to(above);
        self.lead_bur(cut, [above].into_iter().chain((0..rings * POINTS).map(on_bowl)));
    }

    /// Decay of any shape, layer by layer from above. What lies nearer to another lesion is left to that one's turn.
    fn excavate(&mut self, cut: &CutFile, lesion: &Lesion, radius: f32) {
        let workpiece = self.workpiece.clone();
        let (lesions, tissues) = (&workpiece.lesions, &self.scenario.tissues);
        let is_own = |place: Vec3| {
            let away = lesion.centre.distance_squared(place);
            lesions.iter().all(|other| other.centre.distance_squared(place) >= away)
        };
        let excavation = Excavation { radius, below: radius, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let path = excavation
            .path(&workpiece.volume, |place, label| tissues.role(label) == Some(Role::Decay) && is_own(place));
        let Some(first) = path.first() else { return };
        let above = Vec3::new(first.x, first.y, self.top() + radius + TOUCH_HEIGHT);
        self.travel_to(above);
        self.lead_bur(cut, [above].into_iter().chain(path));
    }

    /// With a blade: what of all decay it can cut, layer by layer from above, as often as there are passes.
    fn scoop(&mut self, cut: &CutFile, instrument: usize) {
        /// Of the end's width: a bowl is narrower where it cuts deepest.
        const BOWL: f32 = 0.7;
        let scenario = self.scenario.clone();
        let materials = scenario.factors.get(instrument).map(|f| scenario.tissues.materials().times(f));
        let can_cut = |label: Label| materials.as_ref().is_some_and(|m| m.get(label).cut_force.is_some());
        let radius = BOWL * scenario.instruments[instrument].make().face_radius();
        let excavation = Excavation { radius, below: 0.0, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let volume = self.workpiece.volume.clone();
        let path =
            excavation.path(&volume, |_, label| scenario.tissues.role(label) == Some(Role::Decay) && can_cut(label));
        let Some(first) = path.first() else { return };
        let above = first.with_z(self.top() + TOUCH_HEIGHT);
        for _ in 0..cut.passes {
            self.travel_to(above);
            self.lead_bur(cut, [above].into_iter().chain(path.iter().copied()));
        }
    }

    /// What an outline asks for in a sound tooth: all target zones, layer by layer from above.
    fn prepare(&mut self, cut: &CutFile, instrument: usize) {
        let radius = self.radius(instrument);
        let wide = self.scenario.instruments[instrument].make().head_radius();
        let excavation = Excavation { radius: wide, below: radius, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let path = excavation.path(&self.workpiece.volume, |place, _| is_outlined(&self.scenario, place));
        let run = self.run_over(cut.into(), radius, path.clone());
        self.plan.extend(run);
        if cut.passes > 1 {
            let left = cut.passes - 1;
            self.plan.push_back(Task::PrepareAgain(Preparing { cut: cut.clone(), instrument, path, left }));
        }
    }

    /// Looks, and leads the bur along those places of its way where it would still meet what is to go.
    pub(super) fn prepare_again(&mut self, preparing: Preparing) {
        let Preparing { cut, instrument, path, left } = &preparing;
        let radius = self.radius(*instrument);
        let Some(seen) = &self.seen else { return };
        let bur = self.scenario.instruments[*instrument].make();
        let standing = standing(seen, |place| is_outlined(&self.scenario, place));
        let is_met = |tip: &&Vec3| standing.iter().any(|at| bur.end_distance(*at - **tip) < -SEEN_TO_STAND);
        let path: Vec<Vec3> = path.iter().filter(is_met).copied().collect();
        let mut tasks = Vec::new();
        for run in path.chunk_by(|a, b| a.distance(*b) < 3.0 * cut.pitch_mm) {
            tasks.extend(self.run_over(cut.into(), radius, run.to_vec()));
        }
        if !path.is_empty() && *left > 1 {
            tasks.push(Task::PrepareAgain(Preparing { left: left - 1, ..preparing }));
        }
        self.do_next(tasks);
    }

    /// Along places of tooth space, waiting where the bur does not get on.
    fn lead_bur(&mut self, cut: &CutFile, path: impl Iterator<Item = Vec3>) {
        let guide = self.guide(cut.into(), path);
        self.plan.push_back(guide);
    }
}

/// What of an outline is to go.
fn is_outlined(scenario: &Scenario, place: Vec3) -> bool {
    scenario.zones.iter().any(|zone| zone.role == ZoneRole::Target && zone.region.holds(place))
}

/// Where matter still stands that is to go.
fn standing(seen: &Volume, is_meant: impl Fn(Vec3) -> bool) -> Vec<Vec3> {
    let grid = seen.grid();
    let solid = seen.densities().iter().enumerate().filter(|(_, density)| density.is_solid());
    solid.map(|(index, _)| grid.centre(grid.cell(index))).filter(|place| is_meant(*place)).collect()
}
