//! Pressing and gliding to feel what a tissue is like, and what is answered by it.

use super::file::{ActionFile, AnswerActionFile, FollowFile, PressFile, ProbeFile};
use super::{Operator, TOUCH_HEIGHT, TOUCH_SPEED, Task};
use crate::device::{Felt, Move};
use crate::frame::Vec3;
use crate::scenario::{QuestionKind, Stage, Workpiece};
use crate::session::{Answer, Input};

/// A place that was pressed on, and what it felt like.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeltPlace {
    tooth: usize,
    place_in_tooth: Vec3,
    /// N/mm
    stiffness: f32,
}

impl Operator {
    pub(super) fn press(&mut self, press: &PressFile, radius: f32) {
        let (tooth, surface, normal) = self.place(&press.at);
        self.press_at(tooth, surface, normal, radius, press.force_n, press.hold_s);
        self.lift_off();
    }

    fn press_at(&mut self, tooth: usize, surface: Vec3, normal: Vec3, radius: f32, force: f32, hold: f32) {
        self.travel_to(surface + normal * (radius + TOUCH_HEIGHT));
        let along = -self.workpiece.world_from_tooth.turn(normal);
        let speed = TOUCH_SPEED.min(self.file.hand.speed_mm_s);
        let press = Move::Press { along, force, hold, reach: 15.0, speed };
        self.plan.push_back(Task::Feel(press, tooth, surface));
    }

    pub(super) fn follow(&mut self, follow: &FollowFile, radius: f32) {
        let along = self.workpiece.world_from_tooth.turn(Vec3::NEG_Z);
        for tooth in self.workpiece.clone().teeth.iter() {
            for line in 0..follow.lines {
                let across = spread(line, follow.lines);
                let path = self.line_over(tooth.crown_low, tooth.crown_high, across, radius);
                let Some(&start) = path.first() else { continue };
                self.travel_to(start + Vec3::Z * TOUCH_HEIGHT);
                let path = path.into_iter().map(|p| self.in_world(p)).collect();
                self.plan.push_back(Task::Move(Move::Trace {
                    path,
                    along,
                    force: follow.press_n,
                    speed: follow.speed_mm_s,
                    lean: [-TOUCH_HEIGHT, 3.0],
                }));
            }
        }
        self.lift_off();
    }

    /// A line from mesial to distal over a crown, where the instrument's centre would glide; tooth space.
    fn line_over(&self, low: Vec3, high: Vec3, across: f32, radius: f32) -> Vec<Vec3> {
        /// Share of the crown's width that is occlusal surface.
        const OCCLUSAL: f32 = 0.7;
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * OCCLUSAL);
        (0..=24)
            .filter_map(|i| {
                let (x, y) = (middle.x + half.x * across, middle.y + half.y * (i as f32 / 12.0 - 1.0));
                self.surface_at(x, y, high.z).map(|(p, n)| p + n * radius)
            })
            .collect()
    }

    pub(super) fn probe(&mut self, probe: &ProbeFile, radius: f32) {
        /// Share of the crown's width that is probed: beyond, surfaces are too steep to press on.
        const PROBED: f32 = 0.62;
        for (index, tooth) in self.workpiece.clone().teeth.iter().enumerate() {
            let (middle, half) =
                (0.5 * (tooth.crown_low + tooth.crown_high), 0.5 * (tooth.crown_high - tooth.crown_low));
            for i in 0..probe.side {
                for j in 0..probe.side {
                    // Back and forth, so that the hand has short ways.
                    let j = if i % 2 == 0 { j } else { probe.side - 1 - j };
                    let (u, v) = (spread(i, probe.side) * PROBED, spread(j, probe.side) * PROBED);
                    let at = self.surface_at(middle.x + half.x * u, middle.y + half.y * v, tooth.crown_high.z);
                    if let Some((surface, normal)) = at {
                        self.tap(index, surface, normal, radius, probe);
                    }
                }
            }
        }
        self.lift_off();
    }

    /// A short press and back, without the way up to travelling height.
    fn tap(&mut self, tooth: usize, surface: Vec3, normal: Vec3, radius: f32, probe: &ProbeFile) {
        let speed = self.file.hand.speed_mm_s;
        let before = self.in_world(surface + normal * (radius + TOUCH_HEIGHT));
        let above = self.in_world(Vec3::new(surface.x, surface.y, self.top() + 1.0));
        let along = -self.workpiece.world_from_tooth.turn(normal);
        let press_speed = TOUCH_SPEED.min(speed);
        self.plan.push_back(Task::Move(Move::Reach { to: above, speed }));
        self.plan.push_back(Task::Move(Move::Reach { to: before, speed }));
        let press = Move::Press { along, force: probe.press_n, hold: 0.02, reach: 15.0, speed: press_speed };
        self.plan.push_back(Task::Feel(press, tooth, surface));
        self.plan.push_back(Task::Move(Move::Reach { to: before, speed }));
        self.plan.push_back(Task::Move(Move::Reach { to: above, speed }));
    }

    /// Remembers what was felt by the move that just ended.
    pub(super) fn remember(&mut self) {
        let (Some((tooth, place_in_tooth)), Some(felt)) = (self.feeling.take(), self.device.take_felt()) else {
            return;
        };
        if let Felt { stiffness: Some(stiffness), .. } = felt {
            self.felt.push(FeltPlace { tooth, place_in_tooth, stiffness });
        }
    }

    /// The softest place felt, and how soft it is against the typical place of its kind.
    fn softest(&self) -> Option<(FeltPlace, f32)> {
        let mut all: Vec<f32> = self.felt.iter().map(|f| f.stiffness).collect();
        all.sort_by(f32::total_cmp);
        let typical = *all.get(all.len() / 2)?;
        let softest = self.felt.iter().min_by(|a, b| a.stiffness.total_cmp(&b.stiffness))?;
        Some((*softest, softest.stiffness / typical))
    }

    /// Answers by what was felt.
    pub(super) fn answers(&self, kind: &AnswerActionFile, stage: &Stage) -> Vec<Input> {
        let noticed_below = self.file.rules.iter().flat_map(|r| &r.actions).find_map(|a| match a {
            ActionFile::Probe(probe) => Some(probe.notices_below),
            _ => None,
        });
        let Some((place, ratio)) = self.softest() else { return Vec::new() };
        let is_sure = noticed_below.is_some_and(|below| ratio < below);
        if !is_sure && !matches!(kind, AnswerActionFile::Guess) {
            return Vec::new();
        }
        let tooth = &self.workpiece.teeth[place.tooth];
        let answer = |kind: &QuestionKind| match kind {
            QuestionKind::ToothWith { .. } => Some(Answer::Word(tooth.id.clone())),
            QuestionKind::QuadrantOf { .. } => Some(Answer::Quadrant(Workpiece::quadrant(tooth, place.place_in_tooth))),
            _ => None,
        };
        let input =
            |q: &crate::scenario::Question| Some(Input::Answer { question: q.id.clone(), value: answer(&q.kind)? });
        stage.ask.iter().filter_map(input).collect()
    }
}

/// The i-th of n places spread evenly over -1…1, ends included; 0 for a single one.
fn spread(i: u32, n: u32) -> f32 {
    if n > 1 { 2.0 * i as f32 / (n - 1) as f32 - 1.0 } else { 0.0 }
}
