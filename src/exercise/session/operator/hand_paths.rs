//! Positions on the visible surface, and hand paths through the air to them.

use crate::scenario::{Lesion, ToothBounds, seeded_random};
use crate::session::operator::file::{CarveFile, CutFile, PlaceFile};
use crate::session::operator::palpation::over_crown;
use crate::session::operator::{Operator, OperatorTask, TOUCH_HEIGHT, TOUCH_SPEED, TRAVEL_HEIGHT};
use typodont_core::device::Move;
use typodont_core::frame::Vec3;
use typodont_core::volume::{ISO, Volume};

/// Parameters with which a hand leads a tip along a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrokeParams {
    /// Speed along the path, mm/s.
    speed: f32,
    /// Maximum distance of the hand beyond the tip's target, mm.
    lean: f32,
    /// Maximum force, N.
    force: f32,
    /// Maximum waiting time where the tip lags behind, s.
    patience: f32,
    /// True if the hand backs off at once when the tip is beyond the path.
    yields: bool,
    /// True if the hand never presses with more than `force`.
    limits_force: bool,
}

impl From<&CutFile> for StrokeParams {
    fn from(file: &CutFile) -> StrokeParams {
        let CutFile { speed_mm_s: speed, lean_mm: lean, press_n: force, patience_s: patience, .. } = *file;
        StrokeParams { speed, lean, force, patience, yields: file.backs_off, limits_force: file.limits_force }
    }
}

impl From<&CarveFile> for StrokeParams {
    fn from(file: &CarveFile) -> StrokeParams {
        let CarveFile { speed_mm_s: speed, lean_mm: lean, press_n: force, patience_s: patience, .. } = *file;
        StrokeParams { speed, lean, force, patience, yields: true, limits_force: false }
    }
}

impl Operator {
    pub(super) fn in_world(&self, point_in_tooth: Vec3) -> Vec3 {
        self.workpiece.world_from_tooth * point_in_tooth
    }

    /// Returns the distance by which an instrument's working end extends below the device's tip, mm.
    pub(super) fn radius(&self, instrument: usize) -> f32 {
        self.scenario.instruments[instrument].to_instrument().radius()
    }

    /// Returns the index of the tooth, a point of its surface (mm) and the unit normal there, in tooth space.
    pub(super) fn locate(&self, place: &PlaceFile) -> (usize, Vec3, Vec3) {
        let teeth = &self.workpiece.teeth;
        let tooth = match place {
            PlaceFile::Tooth(id) => teeth.iter().position(|t| t.id == *id).unwrap_or(0),
            PlaceFile::Decay(id) => self.workpiece.lesions.iter().find(|l| l.id == *id).map_or(0, |l| l.tooth),
            PlaceFile::Site => self.random_site().map_or(0, |lesion| lesion.tooth),
            PlaceFile::Crown | PlaceFile::Quadrant(_) => 0,
        };
        let middle = over_crown(&teeth[tooth], 1.0, [0.0; 2]);
        let over = match place {
            PlaceFile::Decay(id) => self.workpiece.lesions.iter().find(|l| l.id == *id).map_or(middle, |l| l.centre),
            PlaceFile::Site => self.random_site().map_or(middle, |lesion| lesion.centre),
            PlaceFile::Quadrant(quadrant) => {
                let buccal = if *quadrant <= 2 { 0.42 } else { -0.42 };
                let distal = if quadrant % 2 == 1 { 0.42 } else { -0.42 };
                over_crown(&teeth[tooth], 1.0, [buccal, distal])
            }
            PlaceFile::Crown | PlaceFile::Tooth(_) => middle,
        };
        let (surface, normal) = self.surface_of(tooth, over).unwrap_or((over, self.away_from(tooth)));
        (tooth, surface, normal)
    }

    /// Returns one of the possible sites of the current stage's draw. The choice depends on the seed and on the time,
    /// but not on the draw.
    fn random_site(&self) -> Option<&Lesion> {
        let stage = &self.scenario.stages[self.stage?];
        let sites = &stage.draw.as_ref()?.sites;
        let chosen = seeded_random(self.seed, &format!("{}/site/{}", stage.id, self.stage_ticks));
        let site = &sites[(chosen % sites.len() as u64) as usize];
        self.workpiece.lesions.iter().find(|lesion| lesion.id == *site)
    }

    /// Returns the occlusal surface of a tooth at a point over it, and the unit normal there; tooth space, mm.
    pub(super) fn surface_of(&self, tooth: usize, over: Vec3) -> Option<(Vec3, Vec3)> {
        let place = &self.workpiece.teeth[tooth];
        let Some((volume, tooth_from_own)) = self.workpiece.voxels_beside(tooth) else {
            return self.surface_at(over.x, over.y, place.crown.high.z);
        };
        let own = tooth_from_own.inverse() * over;
        let (surface, normal) = uppermost_surface(volume, own.x, own.y, place.own_crown.high.z)?;
        Some((tooth_from_own * surface, tooth_from_own.rotate(normal)))
    }

    /// Returns the unit direction in tooth space in which a hand leaves the occlusal surface of a tooth.
    pub(super) fn away_from(&self, tooth: usize) -> Vec3 {
        match self.workpiece.is_overhead(tooth) {
            true => self.workpiece.teeth[tooth].tooth_from_own.rotate(Vec3::Z),
            false => Vec3::Z,
        }
    }

    /// Returns a point in the air over a point of a tooth's surface, from which the hand may move straight to any other such point;
    /// tooth space, mm.
    pub(super) fn clear_of(&self, tooth: usize, surface: Vec3) -> Vec3 {
        if !self.workpiece.is_overhead(tooth) {
            return surface.with_z(self.top() + 1.0);
        }
        // All the way out to the plane on the cusps of all teeth overhead.
        let overhead = (0..self.workpiece.teeth.len()).filter(|&other| self.workpiece.is_overhead(other));
        let overhead: Vec<&ToothBounds> = overhead.map(|other| &self.workpiece.teeth[other]).collect();
        let out =
            overhead.iter().map(|tooth| tooth.tooth_from_own.rotate(Vec3::Z)).sum::<Vec3>().normalize_or(Vec3::NEG_Z);
        let corners =
            overhead.iter().flat_map(|tooth| tooth.own_crown.corners().map(|c| (tooth.tooth_from_own * c).dot(out)));
        let plane = corners.fold(f32::NEG_INFINITY, f32::max);
        surface + out * (plane + 1.0 - surface.dot(out))
    }

    /// Returns the uppermost surface point of the volume at (x, y) and its unit normal; tooth space, mm.
    ///
    /// Searches downward from 1 mm above `top` over 12 mm.
    pub(super) fn surface_at(&self, x: f32, y: f32, top: f32) -> Option<(Vec3, Vec3)> {
        uppermost_surface(&self.workpiece.volume, x, y, top)
    }

    /// Returns the height of the highest crown of the jaw that is worked on, tooth space, mm.
    pub(super) fn top(&self) -> f32 {
        let near = (0..self.workpiece.teeth.len()).filter(|&tooth| !self.workpiece.is_overhead(tooth));
        near.map(|tooth| self.workpiece.teeth[tooth].crown.high.z).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Plans a move straight up to travelling height from the hand's position at that time.
    pub(super) fn lift_off(&mut self) {
        let up = self.rise_task();
        self.plan.push_back(up);
    }

    /// Plans moves up, across and down to a point in tooth space, mm.
    pub(super) fn travel_to(&mut self, point_in_tooth: Vec3) {
        let tasks = self.travel_tasks(point_in_tooth);
        self.plan.extend(tasks);
    }

    /// Returns a move straight up to travelling height. Its start is the position of the hand when the move begins.
    pub(super) fn rise_task(&self) -> OperatorTask {
        let height = (self.workpiece.world_from_tooth * (Vec3::Z * (self.top() + TRAVEL_HEIGHT))).y;
        OperatorTask::Move(Move::Rise { to_height: height, speed: self.file.hand.speed_mm_s })
    }

    /// Returns moves up, across and down to a point in tooth space, mm.
    pub(super) fn travel_tasks(&self, point_in_tooth: Vec3) -> Vec<OperatorTask> {
        let speed = self.file.hand.speed_mm_s;
        let above = Vec3::new(point_in_tooth.x, point_in_tooth.y, self.top() + TRAVEL_HEIGHT);
        let (above, to) = (self.in_world(above), self.in_world(point_in_tooth));
        vec![
            self.rise_task(),
            OperatorTask::Move(Move::Reach { to: above, speed }),
            OperatorTask::Move(Move::Reach { to, speed }),
        ]
    }

    /// Returns tasks that lead the tip from above onto a path in tooth space and along it. `radius` is the distance
    /// by which the working end extends below the tip, mm. Empty for an empty path.
    pub(super) fn stroke_tasks(&self, stroke: StrokeParams, radius: f32, path: Vec<Vec3>) -> Vec<OperatorTask> {
        let Some(first) = path.first() else { return Vec::new() };
        let above = first.with_z(self.top() + radius + TOUCH_HEIGHT);
        let mut tasks = self.travel_tasks(above);
        tasks.push(self.guide_task(stroke, [above].into_iter().chain(path)));
        tasks
    }

    /// Returns a task that leads the tip along a path in tooth space, mm.
    pub(super) fn guide_task(&self, stroke: StrokeParams, path_in_tooth: impl Iterator<Item = Vec3>) -> OperatorTask {
        let path = path_in_tooth.map(|place| self.in_world(place)).collect();
        let StrokeParams { speed, lean: max_lead, force, patience: max_wait, yields: backs_off, limits_force } = stroke;
        OperatorTask::Move(Move::TrackTip { path, speed, max_lead, force, max_wait, backs_off, limits_force })
    }

    /// Returns moves up, across, and down onto a point whose surface lies at about `height` (tooth space, mm);
    /// `force` in N, `hold` in s.
    pub(super) fn press_down(&self, place: Vec3, height: f32, force: f32, hold: f32) -> [Move; 4] {
        let speed = self.file.hand.speed_mm_s;
        let top = self.top() + 1.0;
        let rise = Move::Rise { to_height: self.in_world(place.with_z(top)).y, speed };
        let above = Move::Reach { to: self.in_world(place.with_z(top)), speed };
        let before = Move::Reach { to: self.in_world(place.with_z((height + TOUCH_HEIGHT).min(top))), speed };
        let along = self.workpiece.world_from_tooth.rotate(Vec3::NEG_Z);
        [rise, above, before, Move::Press { along, force, hold, reach: 15.0, speed: TOUCH_SPEED.min(speed) }]
    }
}

/// Returns the uppermost surface point of a volume at (x, y) and its unit normal, in the volume's space, mm. Searches downward from
/// 1 mm above `top` over 12 mm.
fn uppermost_surface(volume: &Volume, x: f32, y: f32, top: f32) -> Option<(Vec3, Vec3)> {
    let step = 0.5 * volume.grid().spacing.min_element();
    let point = |i: u32| Vec3::new(x, y, top + 1.0 - i as f32 * step);
    let hit = (0..(12.0 / step) as u32).map(point).find(|&p| volume.density_at(p) >= ISO)?;
    let (_, gradient) = volume.density_and_gradient_at(hit);
    Some((hit, (-gradient).try_normalize().unwrap_or(Vec3::Z)))
}
