//! Laying a filling, condensing it, and carving it back to the contour.

use super::file::{CarveAgainFile, CarveFile, CondenseFile, FillFile};
use super::mouth::{Mouth, Place, Strokes};
use super::{Operator, TOUCH_HEIGHT, Task};
use crate::frame::Vec3;

/// A cavity being filled.
#[derive(Clone, Debug)]
pub(super) struct Filling {
    file: FillFile,
    places: Vec<Place>,
    /// Of the face, mm.
    radius: f32,
    /// The place pressed on last, and how often any was.
    last: Option<usize>,
    presses: u32,
}

/// A carved filling that is looked at and carved again.
#[derive(Clone, Debug)]
pub(super) struct Recarving {
    file: CarveFile,
    again: CarveAgainFile,
    instrument: usize,
    /// How often it was.
    times: u32,
}

/// Places of a way that lie farther apart than so many strokes are not carved in one go.
const APART_MOST: f32 = 2.5;

impl Operator {
    pub(super) fn fill(&mut self, file: &FillFile, instrument: usize) {
        let radius = self.scenario.instruments[instrument].make().face_radius();
        let mouth = Mouth::of(&self.workpiece);
        let places = mouth.map_or(Vec::new(), |mouth| mouth.places(radius, file.pitch_mm));
        self.plan.push_back(Task::Fill(Filling { file: file.clone(), places, radius, last: None, presses: 0 }));
        self.lift_off();
    }

    /// The next press of a filling, or nothing more where the surface is as high as it is to be.
    pub(super) fn go_on_filling(&mut self, mut filling: Filling) {
        let tooth_from_world = self.workpiece.world_from_tooth.inverse();
        if let Some(last) = filling.last {
            let target = filling.places[last].contour.z + filling.file.to_mm;
            let met = self.device.take_felt().and_then(|felt| felt.touched_at);
            filling.places[last].height = (tooth_from_world * self.tip).z;
            // Full is where the surface was met high enough before anything more was laid, and that more than once.
            let is_high = met.is_some_and(|at| (tooth_from_world * at).z >= target);
            filling.places[last].visits_left = filling.places[last].visits_left.saturating_sub(u32::from(is_high));
        }
        let count = filling.places.len();
        let is_low = |p: &Place| p.visits_left > 0;
        let after = filling.last.map_or(0, |last| last + 1);
        let next = (0..count).map(|i| (after + i) % count).find(|&i| is_low(&filling.places[i]));
        let Some(next) = next.filter(|_| filling.presses < filling.file.presses) else { return };
        let place = filling.places[next];
        // What was laid beside it may stand higher, and is met by the face's rim.
        let reach = 2.0 * filling.radius + TOUCH_HEIGHT;
        let beside = filling.places.iter().filter(|p| p.contour.truncate().distance(place.contour.truncate()) < reach);
        let height = beside.map(|p| p.height).fold(place.height, f32::max);
        let moves = self.press_down(place.contour, height, filling.file.press_n, filling.file.hold_s);
        (filling.last, filling.presses) = (Some(next), filling.presses + 1);
        self.do_next(moves.into_iter().map(Task::Move).chain([Task::Fill(filling)]));
    }

    pub(super) fn condense(&mut self, file: &CondenseFile, instrument: usize) {
        /// A condensed surface may stand so far over the contour, mm.
        const OVER: f32 = 1.5;
        let radius = self.scenario.instruments[instrument].make().face_radius();
        let Some(mouth) = Mouth::of(&self.workpiece) else { return };
        for place in mouth.places(radius, file.pitch_mm) {
            let moves = self.press_down(place.contour, place.contour.z + OVER, file.press_n, file.hold_s);
            self.plan.extend(moves.into_iter().map(Task::Move));
        }
        self.lift_off();
    }

    pub(super) fn carve(&mut self, file: &CarveFile, instrument: usize) {
        let blade = self.scenario.instruments[instrument].make();
        let Some(mouth) = Mouth::of(&self.workpiece) else { return };
        for layer in &file.layers_mm {
            let way = mouth.way(&blade, strokes(file, layer.0));
            let run = self.stroke(file, way);
            self.plan.extend(run);
        }
        if let Some(again) = file.again {
            let carving = Recarving { file: file.clone(), again, instrument, times: 0 };
            self.plan.push_back(Task::CarveAgain(carving));
        }
    }

    /// Looks, and carves where the filling stands too high; nothing more where it does not.
    pub(super) fn carve_again(&mut self, carving: Recarving) {
        let Recarving { file, again, instrument, times } = &carving;
        let blade = self.scenario.instruments[*instrument].make();
        let (Some(mouth), Some(seen)) = (Mouth::of(&self.workpiece), &self.seen) else { return };
        let way = mouth.way_of_high(&blade, strokes(file, again.to_mm), seen, again.over_mm);
        let mut tasks = Vec::new();
        // Where nothing stands too high the blade is lifted across.
        for run in way.chunk_by(|a, b| a.distance(*b) < APART_MOST * file.pitch_mm) {
            tasks.extend(self.stroke(file, run.to_vec()));
        }
        if !way.is_empty() && times + 1 < again.times {
            tasks.push(Task::CarveAgain(Recarving { times: times + 1, ..carving }));
        }
        self.do_next(tasks);
    }

    /// From above onto a way, along it and up again.
    fn stroke(&self, file: &CarveFile, way: Vec<Vec3>) -> Vec<Task> {
        let mut tasks = self.run_over(file.into(), 0.0, way);
        if !tasks.is_empty() {
            tasks.push(self.way_up());
        }
        tasks
    }
}

fn strokes(file: &CarveFile, above: f32) -> Strokes {
    Strokes { apart: file.pitch_mm, beyond: file.beyond_mm, above }
}
