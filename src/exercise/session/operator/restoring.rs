//! Placing a filling, condensing it, and carving it back to the contour.

use crate::session::operator::cavity_map::{CavityMap, PressPoint, StrokePattern, heights};
use crate::session::operator::file::{CarveAgainFile, CarveFile, CondenseFile, FillFile};
use crate::session::operator::{Operator, OperatorTask, TOUCH_HEIGHT};
use typodont_core::frame::Vec3;

/// Progress of filling a cavity.
#[derive(Clone, Debug)]
pub(super) struct FillingTask {
    file: FillFile,
    places: Vec<PressPoint>,
    /// Radius of the instrument's face, mm.
    radius: f32,
    /// Index of the point pressed on last, with its deficit before, mm.
    last: Option<(usize, f32)>,
    /// Indices of points at which a press did not help: what is high beside them holds the face up.
    given_up: Vec<usize>,
    /// Number of presses so far.
    presses: u32,
}

/// Progress of inspecting a carved filling and carving it again.
#[derive(Clone, Debug)]
pub(super) struct RecarvingTask {
    file: CarveFile,
    again: CarveAgainFile,
    instrument: usize,
    /// Number of repetitions so far.
    times: u32,
}

/// Distance between neighbouring path points, in stroke distances, above which the blade is lifted between them.
const APART_MOST: f32 = 2.5;

impl Operator {
    pub(super) fn fill(&mut self, file: &FillFile, instrument: usize) {
        let radius = self.scenario.instruments[instrument].to_instrument().face_radius();
        let cavity_map = CavityMap::of(&self.workpiece);
        let places = cavity_map.map_or(Vec::new(), |map| map.press_points(radius, file.pitch_mm));
        self.plan.push_back(OperatorTask::Fill(FillingTask {
            file: file.clone(),
            places,
            radius,
            last: None,
            given_up: Vec::new(),
            presses: 0,
        }));
        self.lift_off();
    }

    /// Plans the next press of a filling, where it is lowest; plans nothing once the surface is high enough everywhere.
    pub(super) fn continue_filling(&mut self, mut filling: FillingTask) {
        /// Deficit from which a point is seen to be low, mm.
        const VISIBLE_DEFICIT: f32 = 0.05;
        /// Least gain of a press that is worth another one, mm.
        const WORTHWHILE: f32 = 0.02;
        let Some(surface) = self.visible_volume.as_ref().map(heights) else { return };
        let deficit = |p: &PressPoint| p.deficit(&surface, filling.file.to_mm);
        if let Some((last, before)) = filling.last {
            let tooth_from_world = self.workpiece.world_from_tooth.inverse();
            filling.places[last].height = (tooth_from_world * self.tip).z;
            if before - deficit(&filling.places[last]) < WORTHWHILE {
                filling.given_up.push(last);
            }
        }
        let hopeful = (0..filling.places.len()).filter(|i| !filling.given_up.contains(i));
        let deficits = hopeful.map(|i| (i, deficit(&filling.places[i])));
        let lowest = deficits.filter(|&(_, mm)| mm > VISIBLE_DEFICIT).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((next, mm)) = lowest.filter(|_| filling.presses < filling.file.presses) else { return };
        let PressPoint { contour, height, .. } = filling.places[next];
        // Filling placed beside the point may be higher, and the rim of the face would meet it.
        let reach = 2.0 * filling.radius + TOUCH_HEIGHT;
        let beside = filling.places.iter().filter(|p| p.contour.truncate().distance(contour.truncate()) < reach);
        let height = beside.map(|p| p.height).fold(height, f32::max);
        let moves = self.press_down(contour, height, filling.file.press_n, filling.file.hold_s);
        (filling.last, filling.presses) = (Some((next, mm)), filling.presses + 1);
        self.do_next(moves.into_iter().map(OperatorTask::Move).chain([OperatorTask::Fill(filling)]));
    }

    pub(super) fn condense(&mut self, file: &CondenseFile, instrument: usize) {
        /// Maximum expected height of the filling above the contour, mm.
        const OVER: f32 = 1.5;
        let radius = self.scenario.instruments[instrument].to_instrument().face_radius();
        let Some(cavity_map) = CavityMap::of(&self.workpiece) else { return };
        for place in cavity_map.press_points(radius, file.pitch_mm) {
            let moves = self.press_down(place.contour, place.contour.z + OVER, file.press_n, file.hold_s);
            self.plan.extend(moves.into_iter().map(OperatorTask::Move));
        }
        self.lift_off();
    }

    pub(super) fn carve(&mut self, file: &CarveFile, instrument: usize) {
        let blade = self.scenario.instruments[instrument].to_instrument();
        let Some(cavity_map) = CavityMap::of(&self.workpiece) else { return };
        for layer in &file.layers_mm {
            let path = cavity_map.carving_path(&blade, strokes(file, layer.0));
            let run = self.stroke(file, path);
            self.plan.extend(run);
        }
        if let Some(again) = file.again {
            let carving = RecarvingTask { file: file.clone(), again, instrument, times: 0 };
            self.plan.push_back(OperatorTask::CarveAgain(carving));
        }
    }

    /// Inspects the filling and plans carving where it is too high.
    pub(super) fn carve_again(&mut self, carving: RecarvingTask) {
        let RecarvingTask { file, again, instrument, times } = &carving;
        let blade = self.scenario.instruments[*instrument].to_instrument();
        let (Some(cavity_map), Some(visible_volume)) = (CavityMap::of(&self.workpiece), &self.visible_volume) else {
            return;
        };
        let path = cavity_map.path_over_high_spots(&blade, strokes(file, again.to_mm), visible_volume, again.over_mm);
        let mut tasks = Vec::new();
        // The blade is lifted across parts where nothing is too high.
        for run in path.chunk_by(|a, b| a.distance(*b) < APART_MOST * file.pitch_mm) {
            tasks.extend(self.stroke(file, run.to_vec()));
        }
        if !path.is_empty() && times + 1 < again.times {
            tasks.push(OperatorTask::CarveAgain(RecarvingTask { times: times + 1, ..carving }));
        }
        self.do_next(tasks);
    }

    /// Returns tasks that lead the blade from above onto a path (tooth space, mm), along it and up again.
    fn stroke(&self, file: &CarveFile, path: Vec<Vec3>) -> Vec<OperatorTask> {
        let mut tasks = self.stroke_tasks(file.into(), 0.0, path);
        if !tasks.is_empty() {
            tasks.push(self.rise_task());
        }
        tasks
    }
}

fn strokes(file: &CarveFile, above: f32) -> StrokePattern {
    StrokePattern { apart: file.pitch_mm, beyond: file.beyond_mm, above }
}
