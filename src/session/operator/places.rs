//! Where things are as a person sees them, and the ways through the air to them.

use super::file::{CarveFile, CutFile, PlaceFile};
use super::{Operator, TOUCH_HEIGHT, TOUCH_SPEED, TRAVEL_HEIGHT, Task};
use crate::device::Move;
use crate::frame::Vec3;
use crate::volume::ISO;

/// How a hand leads a tip along a way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    /// mm/s.
    speed: f32,
    /// mm.
    lean: f32,
    /// N.
    force: f32,
    /// s.
    patience: f32,
    yields: bool,
}

impl From<&CutFile> for Lead {
    fn from(file: &CutFile) -> Lead {
        let CutFile { speed_mm_s: speed, lean_mm: lean, press_n: force, patience_s: patience, .. } = *file;
        Lead { speed, lean, force, patience, yields: false }
    }
}

impl From<&CarveFile> for Lead {
    fn from(file: &CarveFile) -> Lead {
        let CarveFile { speed_mm_s: speed, lean_mm: lean, press_n: force, patience_s: patience, .. } = *file;
        Lead { speed, lean, force, patience, yields: true }
    }
}

impl Operator {
    pub(super) fn in_world(&self, point_in_tooth: Vec3) -> Vec3 {
        self.workpiece.world_from_tooth * point_in_tooth
    }

    /// How far the working end now in the hand reaches below the device's tip, mm.
    pub(super) fn radius(&self, instrument: usize) -> f32 {
        self.scenario.instruments[instrument].make().radius()
    }

    /// Tooth, point of its surface and normal there, in tooth space.
    pub(super) fn place(&self, place: &PlaceFile) -> (usize, Vec3, Vec3) {
        let teeth = &self.workpiece.teeth;
        let tooth = match place {
            PlaceFile::Tooth(id) => teeth.iter().position(|t| t.id == *id).unwrap_or(0),
            PlaceFile::Decay(id) => self.workpiece.lesions.iter().find(|l| l.id == *id).map_or(0, |l| l.tooth),
            PlaceFile::Crown | PlaceFile::Quadrant(_) => 0,
        };
        let (low, high) = (teeth[tooth].crown_low, teeth[tooth].crown_high);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let over = match place {
            PlaceFile::Decay(id) => self.workpiece.lesions.iter().find(|l| l.id == *id).map_or(middle, |l| l.centre),
            PlaceFile::Quadrant(quadrant) => {
                let buccal = if *quadrant <= 2 { 0.42 } else { -0.42 };
                let distal = if quadrant % 2 == 1 { 0.42 } else { -0.42 };
                middle + Vec3::new(half.x * buccal, half.y * distal, 0.0)
            }
            PlaceFile::Crown | PlaceFile::Tooth(_) => middle,
        };
        let (surface, normal) = self.surface_at(over.x, over.y, high.z).unwrap_or((over, Vec3::Z));
        (tooth, surface, normal)
    }

    /// The occlusal surface over a point of the ground plan, with its normal; tooth space.
    pub(super) fn surface_at(&self, x: f32, y: f32, top: f32) -> Option<(Vec3, Vec3)> {
        let volume = &self.workpiece.volume;
        let step = 0.5 * volume.grid().spacing.min_element();
        let point = |i: u32| Vec3::new(x, y, top + 1.0 - i as f32 * step);
        let hit = (0..(12.0 / step) as u32).map(point).find(|&p| volume.density_at(p) >= ISO)?;
        let (_, gradient) = volume.density_and_gradient_at(hit);
        Some((hit, (-gradient).try_normalize().unwrap_or(Vec3::Z)))
    }

    pub(super) fn top(&self) -> f32 {
        self.workpiece.teeth.iter().map(|t| t.crown_high.z).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Straight up to travelling height from wherever the hand then is.
    pub(super) fn lift_off(&mut self) {
        let up = self.way_up();
        self.plan.push_back(up);
    }

    /// Up, across and down to a point of tooth space.
    pub(super) fn travel_to(&mut self, point_in_tooth: Vec3) {
        let way = self.way_to(point_in_tooth);
        self.plan.extend(way);
    }

    /// Where the hand will be is not known yet: the move is finished when it is made.
    pub(super) fn way_up(&self) -> Task {
        let height = (self.workpiece.world_from_tooth * (Vec3::Z * (self.top() + TRAVEL_HEIGHT))).y;
        Task::Move(Move::Rise { to_height: height, speed: self.file.hand.speed_mm_s })
    }

    pub(super) fn way_to(&self, point_in_tooth: Vec3) -> Vec<Task> {
        let speed = self.file.hand.speed_mm_s;
        let above = Vec3::new(point_in_tooth.x, point_in_tooth.y, self.top() + TRAVEL_HEIGHT);
        let (above, to) = (self.in_world(above), self.in_world(point_in_tooth));
        vec![self.way_up(), Task::Move(Move::Reach { to: above, speed }), Task::Move(Move::Reach { to, speed })]
    }

    /// From above onto a way of tooth space and along it, with an end that reaches so far below its tip, mm.
    pub(super) fn run_over(&self, lead: Lead, radius: f32, way: Vec<Vec3>) -> Vec<Task> {
        let Some(first) = way.first() else { return Vec::new() };
        let above = first.with_z(self.top() + radius + TOUCH_HEIGHT);
        let mut tasks = self.way_to(above);
        tasks.push(self.guide(lead, [above].into_iter().chain(way)));
        tasks
    }

    pub(super) fn guide(&self, lead: Lead, way: impl Iterator<Item = Vec3>) -> Task {
        let path = way.map(|place| self.in_world(place)).collect();
        let Lead { speed, lean, force, patience, yields } = lead;
        Task::Move(Move::Guide { path, speed, lean, force, patience, yields })
    }

    /// Up, across, and down on a place whose surface lies about so high.
    pub(super) fn press_down(&self, place: Vec3, height: f32, force: f32, hold: f32) -> [Move; 4] {
        let speed = self.file.hand.speed_mm_s;
        let top = self.top() + 1.0;
        let rise = Move::Rise { to_height: self.in_world(place.with_z(top)).y, speed };
        let above = Move::Reach { to: self.in_world(place.with_z(top)), speed };
        let before = Move::Reach { to: self.in_world(place.with_z((height + TOUCH_HEIGHT).min(top))), speed };
        let along = self.workpiece.world_from_tooth.turn(Vec3::NEG_Z);
        [rise, above, before, Move::Press { along, force, hold, reach: 15.0, speed: TOUCH_SPEED.min(speed) }]
    }
}
