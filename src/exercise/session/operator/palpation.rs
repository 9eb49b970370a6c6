//! Palpation of teeth by pressing and sliding, and answers derived from the measured stiffness.

use crate::scenario::{Lesion, QuestionKind, Stage, ToothBounds};
use crate::session::operator::file::{ActionFile, AnswerActionFile, FollowFile, PressFile, ProbeFile};
use crate::session::operator::{Operator, OperatorTask, TOUCH_HEIGHT, TOUCH_SPEED, rule_applies};
use crate::session::{AnswerValue, Input};
use std::collections::BTreeSet;
use typodont_core::device::{Move, MoveResult};
use typodont_core::frame::Vec3;

/// A palpated point with its measured stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct PalpatedPoint {
    /// Index of the tooth.
    tooth: usize,
    /// Position in tooth space, mm.
    place_in_tooth: Vec3,
    /// Stiffness, N/mm.
    stiffness: f32,
}

impl Operator {
    pub(super) fn press(&mut self, press: &PressFile, radius: f32) {
        let (tooth, surface, normal) = self.locate(&press.at);
        self.press_at(tooth, surface, normal, radius, press.force_n, press.hold_s);
        if self.workpiece.is_overhead(tooth) {
            let to = self.in_world(self.clear_of(tooth, surface));
            self.plan.push_back(OperatorTask::Move(Move::Reach { to, speed: self.file.hand.speed_mm_s }));
        }
        self.lift_off();
    }

    fn press_at(&mut self, tooth: usize, surface: Vec3, normal: Vec3, radius: f32, force: f32, hold: f32) {
        self.travel_to(surface + normal * (radius + TOUCH_HEIGHT));
        let along = -self.workpiece.world_from_tooth.rotate(normal);
        let speed = TOUCH_SPEED.min(self.file.hand.speed_mm_s);
        let press = Move::Press { along, force, hold, reach: 15.0, speed };
        self.plan.push_back(OperatorTask::Palpate(press, tooth, surface));
    }

    pub(super) fn follow(&mut self, follow: &FollowFile, radius: f32) {
        let along = self.workpiece.world_from_tooth.rotate(Vec3::NEG_Z);
        for tooth in 0..self.workpiece.teeth_in_volume {
            for line in 0..follow.lines {
                let across = spread(line, follow.lines);
                let path = self.line_over(tooth, across, radius);
                let Some(&start) = path.first() else { continue };
                self.travel_to(start + Vec3::Z * TOUCH_HEIGHT);
                let path = path.into_iter().map(|p| self.in_world(p)).collect();
                self.plan.push_back(OperatorTask::Move(Move::Trace {
                    path,
                    along,
                    force: follow.press_n,
                    speed: follow.speed_mm_s,
                    overtravel: [-TOUCH_HEIGHT, 3.0],
                }));
            }
        }
        self.lift_off();
    }

    /// Returns the path of the instrument's centre along a mesiodistal line over a crown; tooth space, mm. `across`
    /// is the buccolingual position, -1 to 1.
    fn line_over(&self, tooth: usize, across: f32, radius: f32) -> Vec<Vec3> {
        /// Share of the crown's width that belongs to the occlusal surface.
        const OCCLUSAL: f32 = 0.7;
        (0..=24)
            .filter_map(|i| {
                let over = over_crown(&self.workpiece.teeth[tooth], OCCLUSAL, [across, i as f32 / 12.0 - 1.0]);
                self.surface_of(tooth, over).map(|(p, n)| p + n * radius)
            })
            .collect()
    }

    pub(super) fn probe(&mut self, probe: &ProbeFile, radius: f32) {
        let searched = self.searched_teeth();
        for (index, tooth) in self.workpiece.clone().teeth.iter().enumerate().filter(|(i, _)| searched.contains(i)) {
            for i in 0..probe.side {
                for j in 0..probe.side {
                    // Alternating direction keeps the hand's paths short.
                    let j = if i % 2 == 0 { j } else { probe.side - 1 - j };
                    let (u, v) = (spread(i, probe.side) * probe.width, spread(j, probe.side) * probe.width);
                    if let Some((surface, normal)) = self.surface_of(index, over_crown(tooth, 1.0, [u, v])) {
                        self.tap(index, surface, normal, radius, probe);
                    }
                }
            }
        }
        self.lift_off();
    }

    /// Returns the indices of the teeth on which caries may be, as the stage's instruction tells: those with a possible site
    /// of its draw; without a draw all.
    fn searched_teeth(&self) -> BTreeSet<usize> {
        let draw = self.stage.and_then(|stage| self.scenario.stages[stage].draw.as_ref());
        let is_site = |lesion: &&Lesion| draw.is_some_and(|draw| draw.sites.contains(&lesion.id));
        match draw {
            Some(_) => self.workpiece.lesions.iter().filter(is_site).map(|lesion| lesion.tooth).collect(),
            None => (0..self.workpiece.teeth.len()).collect(),
        }
    }

    /// Plans a short press on a surface point and back, without rising to travelling height.
    fn tap(&mut self, tooth: usize, surface: Vec3, normal: Vec3, radius: f32, probe: &ProbeFile) {
        let speed = self.file.hand.speed_mm_s;
        let before = self.in_world(surface + normal * (radius + TOUCH_HEIGHT));
        let above = self.in_world(self.clear_of(tooth, surface));
        let along = -self.workpiece.world_from_tooth.rotate(normal);
        let press_speed = TOUCH_SPEED.min(speed);
        self.plan.push_back(OperatorTask::Move(Move::Reach { to: above, speed }));
        self.plan.push_back(OperatorTask::Move(Move::Reach { to: before, speed }));
        let press = Move::Press { along, force: probe.press_n, hold: 0.02, reach: 15.0, speed: press_speed };
        self.plan.push_back(OperatorTask::Palpate(press, tooth, surface));
        self.plan.push_back(OperatorTask::Move(Move::Reach { to: before, speed }));
        self.plan.push_back(OperatorTask::Move(Move::Reach { to: above, speed }));
    }

    /// Records the stiffness measured by the move that just ended.
    pub(super) fn record_palpation(&mut self) {
        let (Some((tooth, place_in_tooth)), Some(felt)) = (self.palpating.take(), self.device.take_result()) else {
            return;
        };
        if let MoveResult { stiffness: Some(stiffness), .. } = felt {
            self.palpated.push(PalpatedPoint { tooth, place_in_tooth, stiffness });
        }
    }

    /// Returns the softest palpated point and the ratio of its stiffness to the median stiffness.
    fn softest(&self) -> Option<(PalpatedPoint, f32)> {
        let mut all: Vec<f32> = self.palpated.iter().map(|f| f.stiffness).collect();
        all.sort_by(f32::total_cmp);
        let typical = *all.get(all.len() / 2)?;
        let softest = self.palpated.iter().min_by(|a, b| a.stiffness.total_cmp(&b.stiffness))?;
        Some((*softest, softest.stiffness / typical))
    }

    /// Returns answers to a stage's questions about decay, derived from the palpated points.
    pub(super) fn answers(&self, kind: &AnswerActionFile, stage: &Stage) -> Vec<Input> {
        let rule = self.file.rules.iter().find(|rule| rule_applies(&rule.when, stage));
        let noticed_below = rule.into_iter().flat_map(|rule| &rule.actions).find_map(|a| match a {
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
            QuestionKind::ToothWith { .. } => Some(AnswerValue::Word(tooth.id.clone())),
            QuestionKind::QuadrantOf { .. } => Some(AnswerValue::Quadrant(tooth.quadrant(place.place_in_tooth))),
            _ => None,
        };
        let input =
            |q: &crate::scenario::Question| Some(Input::Answer { question: q.id.clone(), value: answer(&q.kind)? });
        stage.ask.iter().filter_map(input).collect()
    }
}

/// Returns a point over a share of a crown's width, tooth space, mm: from lingual to buccal and along the tooth's own
/// mesiodistal axis, each -1 to 1.
pub(super) fn over_crown(tooth: &ToothBounds, share: f32, [across, along]: [f32; 2]) -> Vec3 {
    let (middle, half) = (tooth.own_crown.centre(), tooth.own_crown.half_size() * share);
    tooth.tooth_from_own * (middle + Vec3::new(half.x * across, half.y * along, 0.0))
}

/// Returns the i-th of n values spaced evenly from -1 to 1, ends included; 0 for n = 1.
fn spread(i: u32, n: u32) -> f32 {
    if n > 1 { 2.0 * i as f32 / (n - 1) as f32 - 1.0 } else { 0.0 }
}
