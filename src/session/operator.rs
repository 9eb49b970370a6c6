//! A scripted trainee: turns what an operator file says into moves of a hand, and closes the loop through what it feels.
//!
//! It sees what a person sees (surfaces, and decay where the scenario shows it) and otherwise knows only what it felt.

use super::excavation::Excavation;
use super::filling::{Mouth, Place};
use super::operator_file::{
    ActionFile, AnswerActionFile, CarveFile, ChartActionFile, CondenseFile, CutFile, ExploreFile, FillFile, FollowFile,
    OperatorFile, PlaceFile, PressFile, ProbeFile, WhenFile,
};
use super::sounding::{self, Sounding};
use super::{Answer, Input, Session, Sign, Trainee};
use crate::content::{EndEntry, Role};
use crate::device::{Device, Felt, Gone, HandModel, Move, Output, Reading, Scripted, Spec, Tremor};
use crate::frame::Vec3;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Lesion, QuestionKind, Scenario, Site, Stage, Workpiece};
use crate::sim::Step;
use crate::volume::{ISO, Label};
use std::collections::VecDeque;
use std::sync::Arc;

/// How far above a tooth the hand travels, mm.
const TRAVEL_HEIGHT: f32 = 4.0;

/// How far before the surface a hand slows down to touch, mm.
const TOUCH_HEIGHT: f32 = 0.6;

/// Speed of touching, mm/s.
const TOUCH_SPEED: f32 = 8.0;

/// A scripted trainee at work.
#[derive(Clone, Debug)]
pub struct Operator {
    file: OperatorFile,
    scenario: Arc<Scenario>,
    workpiece: Arc<Workpiece>,
    device: Scripted,
    /// Index of the stage the plan is for.
    stage: Option<usize>,
    /// Ticks since the stage began.
    stage_ticks: u64,
    plan: VecDeque<Task>,
    /// Places felt in this stage.
    felt: Vec<FeltPlace>,
    /// The place being felt.
    feeling: Option<(usize, Vec3)>,
    has_rated: bool,
    /// Heights and distances from the tooth's middle of the tip on its way down a root, tooth space, mm.
    trail: Option<Vec<[f32; 2]>>,
    /// Where the tip was seen last, world space.
    tip: Vec3,
}

/// What is left to do.
#[derive(Clone, Debug)]
enum Task {
    Move(Move),
    /// A move whose feeling is remembered: tooth, and place in tooth space.
    Feel(Move, usize, Vec3),
    Input(Input),
    Answer(AnswerActionFile),
    /// Begins to follow the tip down a root.
    Trail,
    /// Notes calculus if the tip was lifted by more than this on its way down, mm.
    Notice(f32),
    /// Along a way up, from the place of it that is nearest.
    Withdraw {
        up: Vec<Vec3>,
        speed: f32,
    },
    /// Drops the following so many tasks if the decay gone suffices.
    SkipIfCleared {
        percent: f64,
        tasks: usize,
    },
    /// Goes on filling where the surface is still too low.
    Fill(Filling),
    /// Begins the stage's rule again.
    Again,
}

#[derive(Clone, Copy, Debug)]
struct FeltPlace {
    tooth: usize,
    place_in_tooth: Vec3,
    /// N/mm
    stiffness: f32,
}

/// A cavity being filled.
#[derive(Clone, Debug)]
struct Filling {
    file: FillFile,
    places: Vec<Place>,
    /// Of the face, mm.
    radius: f32,
    /// The place pressed on last, and how often any was.
    last: Option<usize>,
    presses: u32,
}

/// How long a script stays in a stage without a time limit before it gives the session up: 20 minutes. A script that
/// does nothing more would otherwise fill the disk.
const PATIENCE_TICKS: u64 = 20 * 60 * 1000;

impl Operator {
    /// An operator holding a device above the workpiece. The seed decides its tremor.
    pub fn new(
        file: OperatorFile,
        scenario: Arc<Scenario>,
        workpiece: Arc<Workpiece>,
        spec: Spec,
        seed: u64,
    ) -> Operator {
        let start = Vec3::Y * (2.0 * TRAVEL_HEIGHT);
        let model = HandModel::holding(spec.apparent_mass, spec.resolution);
        let tremor = Tremor::new(file.hand.tremor_mm, seed);
        Operator {
            device: Scripted::new(spec, model, tremor, start),
            file,
            scenario,
            workpiece,
            stage: None,
            stage_ticks: 0,
            plan: VecDeque::new(),
            felt: Vec::new(),
            feeling: None,
            has_rated: false,
            trail: None,
            tip: start,
        }
    }

    fn in_world(&self, point_in_tooth: Vec3) -> Vec3 {
        self.workpiece.world_from_tooth * point_in_tooth
    }

    /// How far the working end now in the hand reaches below the device's tip, mm.
    fn radius(&self, instrument: usize) -> f32 {
        self.scenario.instruments[instrument].make().radius()
    }

    fn begin_stage(&mut self, index: usize) {
        self.stage = Some(index);
        self.stage_ticks = 0;
        self.felt.clear();
        self.feeling = None;
        self.device.stop();
        self.plan.clear();
        self.follow_rule(index);
    }

    fn follow_rule(&mut self, index: usize) {
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let file = self.file.clone();
        let Some(rule) = file.rules.iter().find(|r| fits(&r.when, stage)) else { return };
        let mut instrument = stage.instruments[0];
        for action in &rule.actions {
            self.compile(action, stage, &mut instrument);
        }
        if rule.repeat {
            self.plan.push_back(Task::Again);
        }
    }

    fn compile(&mut self, action: &ActionFile, stage: &Stage, instrument: &mut usize) {
        match action {
            ActionFile::WaitS(seconds) => self.plan.push_back(Task::Move(Move::Wait { seconds: *seconds })),
            ActionFile::Take(name) => {
                if let Some(chosen) = self.choose(name, stage) {
                    *instrument = chosen;
                    self.lift_off();
                    self.plan.push_back(Task::Input(Input::Take { instrument: chosen }));
                }
            }
            ActionFile::Approach(approach) => {
                let (_, surface, _) = self.place(&approach.at);
                self.travel_to(surface + Vec3::Z * approach.above_mm);
            }
            ActionFile::Press(press) => self.press(press, self.radius(*instrument)),
            ActionFile::Follow(follow) => self.follow(follow, self.radius(*instrument)),
            ActionFile::Probe(probe) => self.probe(probe, self.radius(*instrument)),
            ActionFile::Cut(cut) => self.cut(cut, *instrument),
            ActionFile::Fill(fill) => self.fill(fill, *instrument),
            ActionFile::Condense(condense) => self.condense(condense, *instrument),
            ActionFile::Carve(carve) => self.carve(carve, *instrument),
            ActionFile::Chart(chart) => self.chart(chart),
            ActionFile::Explore(explore) => self.explore(explore),
            ActionFile::Answer(answer) => self.plan.push_back(Task::Answer(answer.clone())),
            ActionFile::Adjust(adjust) => {
                // What the exercise does not know is air, which the session refuses to change.
                let label = self.scenario.tissues.by_name(&adjust.tissue).map_or(Label::AIR, |tissue| tissue.label());
                let (coefficient, value) = (adjust.coefficient.into(), adjust.value);
                self.plan.push_back(Task::Input(Input::Adjust { label, coefficient, value }));
            }
            ActionFile::Confirm => {
                self.lift_off();
                self.plan.push_back(Task::Input(Input::Confirm));
            }
        }
    }

    /// An instrument of the stage by id, or the first bur or explorer.
    fn choose(&self, name: &str, stage: &Stage) -> Option<usize> {
        let is_meant = |&&index: &&usize| {
            let entry = &self.scenario.instruments[index];
            let is_probe = matches!(entry.end, EndEntry::Probe(_));
            let kind = match name {
                "bur" => entry.is_bur(),
                "explorer" => !entry.cuts && !is_probe && entry.packs.is_none(),
                "probe" => is_probe,
                _ => false,
            };
            entry.id == name || kind
        };
        stage.instruments.iter().find(is_meant).copied()
    }

    /// Tooth, point of its surface and normal there, in tooth space.
    fn place(&self, place: &PlaceFile) -> (usize, Vec3, Vec3) {
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
    fn surface_at(&self, x: f32, y: f32, top: f32) -> Option<(Vec3, Vec3)> {
        let volume = &self.workpiece.volume;
        let step = 0.5 * volume.grid().spacing.min_element();
        let point = |i: u32| Vec3::new(x, y, top + 1.0 - i as f32 * step);
        let hit = (0..(12.0 / step) as u32).map(point).find(|&p| volume.density_at(p) >= ISO)?;
        let (_, gradient) = volume.density_and_gradient_at(hit);
        Some((hit, (-gradient).try_normalize().unwrap_or(Vec3::Z)))
    }

    fn top(&self) -> f32 {
        self.workpiece.teeth.iter().map(|t| t.crown_high.z).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Straight up to travelling height from wherever the hand then is.
    fn lift_off(&mut self) {
        let speed = self.file.hand.speed_mm_s;
        let height = (self.workpiece.world_from_tooth * (Vec3::Z * (self.top() + TRAVEL_HEIGHT))).y;
        // Where the hand will be is not known yet: the move is finished when it is made.
        self.plan.push_back(Task::Move(Move::Rise { to_height: height, speed }));
    }

    /// Up, across and down to a point of tooth space.
    fn travel_to(&mut self, point_in_tooth: Vec3) {
        let speed = self.file.hand.speed_mm_s;
        self.lift_off();
        let above = Vec3::new(point_in_tooth.x, point_in_tooth.y, self.top() + TRAVEL_HEIGHT);
        let (above, to) = (self.in_world(above), self.in_world(point_in_tooth));
        self.plan.push_back(Task::Move(Move::Reach { to: above, speed }));
        self.plan.push_back(Task::Move(Move::Reach { to, speed }));
    }

    fn press(&mut self, press: &PressFile, radius: f32) {
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

    fn follow(&mut self, follow: &FollowFile, radius: f32) {
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

    fn probe(&mut self, probe: &ProbeFile, radius: f32) {
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

    fn cut(&mut self, cut: &CutFile, instrument: usize) {
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
        let scenario = self.scenario.clone();
        let targets: Vec<_> = scenario.zones.iter().filter(|z| z.role == ZoneRole::Target).collect();
        let wide = self.scenario.instruments[instrument].make().head_radius();
        let excavation = Excavation { radius: wide, below: radius, pitch: cut.pitch_mm, margin: cut.margin_mm };
        let volume = self.workpiece.volume.clone();
        let path = excavation.path(&volume, |place, _| targets.iter().any(|zone| zone.region.holds(place)));
        let Some(first) = path.first() else { return };
        let above = first.with_z(self.top() + radius + TOUCH_HEIGHT);
        self.travel_to(above);
        self.lead_bur(cut, [above].into_iter().chain(path));
    }

    /// Along places of tooth space, waiting where the bur does not get on.
    fn lead_bur(&mut self, cut: &CutFile, path: impl Iterator<Item = Vec3>) {
        let path = path.map(|place| self.in_world(place)).collect();
        self.plan.push_back(Task::Move(Move::Guide {
            path,
            speed: cut.speed_mm_s,
            lean: cut.lean_mm,
            force: cut.press_n,
            patience: cut.patience_s,
        }));
    }

    fn fill(&mut self, file: &FillFile, instrument: usize) {
        let radius = self.scenario.instruments[instrument].make().face_radius();
        let mouth = Mouth::of(&self.workpiece);
        let places = mouth.map_or(Vec::new(), |mouth| mouth.places(radius, file.pitch_mm));
        self.plan.push_back(Task::Fill(Filling { file: file.clone(), places, radius, last: None, presses: 0 }));
        self.lift_off();
    }

    /// The next press of a filling, or nothing more where the surface is as high as it is to be.
    fn go_on_filling(&mut self, mut filling: Filling) {
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
        self.plan.push_front(Task::Fill(filling));
        moves.into_iter().rev().for_each(|next| self.plan.push_front(Task::Move(next)));
    }

    fn condense(&mut self, file: &CondenseFile, instrument: usize) {
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

    /// A probe into the sulcus at each site, read where it is held up.
    fn chart(&mut self, chart: &ChartActionFile) {
        /// The middle of a probe's end runs so far off a root without calculus, mm: free between root and gum.
        const OFF: f32 = 0.42;
        for site in sounding::sites(chart.sites.as_deref()) {
            let Some(way) = self.sounding(site, OFF) else { continue };
            let path: Vec<Vec3> = way.down.iter().map(|p| self.in_world(*p)).collect();
            self.come_to(&way);
            let (force, hold, speed) = (chart.press_n, chart.hold_s, chart.speed_mm_s);
            self.plan.push_back(Task::Move(Move::Slide { path, force, hold, speed }));
            self.plan.push_back(Task::Input(Input::Chart(Sign::Depth)));
            self.leave(&way, speed);
        }
        self.lift_off();
    }

    /// Up, across, and down on a place whose surface lies about so high.
    fn press_down(&self, place: Vec3, height: f32, force: f32, hold: f32) -> [Move; 4] {
        let speed = self.file.hand.speed_mm_s;
        let top = self.top() + 1.0;
        let rise = Move::Rise { to_height: self.in_world(place.with_z(top)).y, speed };
        let above = Move::Reach { to: self.in_world(place.with_z(top)), speed };
        let before = Move::Reach { to: self.in_world(place.with_z((height + TOUCH_HEIGHT).min(top))), speed };
        let along = self.workpiece.world_from_tooth.turn(Vec3::NEG_Z);
        [rise, above, before, Move::Press { along, force, hold, reach: 15.0, speed: TOUCH_SPEED.min(speed) }]
    }

    fn carve(&mut self, file: &CarveFile, instrument: usize) {
        let instrument = self.scenario.instruments[instrument].make();
        let Some(mouth) = Mouth::of(&self.workpiece) else { return };
        for layer in &file.layers_mm {
            let way = mouth.way(&instrument, file.pitch_mm, file.beyond_mm, layer.0);
            let Some(first) = way.first() else { return };
            let above = first.with_z(self.top() + TOUCH_HEIGHT);
            self.travel_to(above);
            let path = [above].into_iter().chain(way).map(|place| self.in_world(place)).collect();
            self.plan.push_back(Task::Move(Move::Guide {
                path,
                speed: file.speed_mm_s,
                lean: file.lean_mm,
                force: file.press_n,
                patience: file.patience_s,
            }));
            self.lift_off();
        }
    }

    /// An explorer down each root, leaning on it.
    fn explore(&mut self, explore: &ExploreFile) {
        for site in sounding::sites(explore.sites.as_deref()) {
            let Some(way) = self.sounding(site, -explore.lean_mm) else { continue };
            let path: Vec<Vec3> = way.down.iter().map(|p| self.in_world(*p)).collect();
            self.come_to(&way);
            self.plan.push_back(Task::Trail);
            let (force, speed) = (explore.press_n, explore.speed_mm_s);
            self.plan.push_back(Task::Move(Move::Slide { path, force, hold: 0.05, speed }));
            self.plan.push_back(Task::Notice(explore.notices_mm));
            self.leave(&way, speed);
        }
        self.lift_off();
    }

    fn sounding(&self, site: Site, off: f32) -> Option<Sounding> {
        let gum = self.workpiece.periodontium.as_ref()?;
        let deposits: Vec<Label> =
            self.scenario.tissues.entries().iter().filter(|e| e.role == Role::Deposit).map(|e| e.label()).collect();
        let lowest = self.workpiece.teeth.first()?.low.z;
        Sounding::at(site, gum, &self.workpiece.volume, &deposits, lowest, off)
    }

    /// From above, past the crown's bulge, to the gum's margin.
    fn come_to(&mut self, way: &Sounding) {
        let speed = TOUCH_SPEED.min(self.file.hand.speed_mm_s);
        self.travel_to(way.beside.with_z(self.top() + 1.0));
        for to in [way.beside, way.entry] {
            let to = self.in_world(to);
            self.plan.push_back(Task::Move(Move::Reach { to, speed }));
        }
    }

    /// Up again the way it came.
    fn leave(&mut self, way: &Sounding, speed: f32) {
        self.plan.push_back(Task::Withdraw { up: way.up.iter().map(|p| self.in_world(*p)).collect(), speed });
        for to in [way.entry, way.beside, way.beside.with_z(self.top() + 1.0)] {
            let (to, speed) = (self.in_world(to), self.file.hand.speed_mm_s.min(20.0));
            self.plan.push_back(Task::Move(Move::Reach { to, speed }));
        }
    }

    /// Remembers where the tip is on its way down a root.
    fn follow_trail(&mut self, tip: Vec3) {
        let (Some(trail), Some(gum)) = (&mut self.trail, &self.workpiece.periodontium) else { return };
        let place = self.workpiece.world_from_tooth.inverse() * tip;
        let from_middle = (place - gum.middle()).with_z(0.0);
        trail.push([place.z, from_middle.length()]);
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
    fn answers(&self, kind: &AnswerActionFile, stage: &Stage) -> Vec<Input> {
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

    /// Rates every statement as the operator feels about the system.
    fn ratings(&mut self) -> Vec<Input> {
        if std::mem::replace(&mut self.has_rated, true) {
            return Vec::new();
        }
        let Some(questionnaire) = &self.scenario.questionnaire else { return Vec::new() };
        let agrees = self.file.agrees.min(questionnaire.steps);
        let rate = |item| Input::Rate {
            item: crate::scenario::Item::clone(item).id,
            value: questionnaire.counted(item, agrees),
        };
        questionnaire.items().map(rate).collect()
    }

    /// Remembers what was felt by the move that just ended.
    fn remember(&mut self) {
        let (Some((tooth, place_in_tooth)), Some(felt)) = (self.feeling.take(), self.device.take_felt()) else {
            return;
        };
        if let Felt { stiffness: Some(stiffness), .. } = felt {
            self.felt.push(FeltPlace { tooth, place_in_tooth, stiffness });
        }
    }

    /// Goes on with the plan until the hand is busy or something is to be said.
    fn go_on(&mut self, session: &Session, index: usize) -> Vec<Input> {
        while self.device.is_idle() {
            self.remember();
            match self.plan.pop_front() {
                None => break,
                Some(Task::Move(next)) => self.device.push(next),
                Some(Task::Feel(next, tooth, place)) => {
                    self.feeling = Some((tooth, place));
                    self.device.push(next);
                }
                Some(Task::Input(input)) => return vec![input],
                Some(Task::Withdraw { up, speed }) => {
                    // From where the tip is: the hand may lean far deeper.
                    let from = up.iter().position(|p| p.y > self.tip.y).unwrap_or(up.len());
                    let way = up[from..].iter().step_by(4);
                    way.for_each(|to| self.device.push(Move::Reach { to: *to, speed }));
                }
                Some(Task::Trail) => self.trail = Some(Vec::new()),
                Some(Task::Notice(more_than)) => {
                    let trail = self.trail.take().unwrap_or_default();
                    if sounding::bump(&trail) > more_than {
                        return vec![Input::Chart(Sign::Calculus)];
                    }
                }
                Some(Task::Answer(kind)) => {
                    let inputs = self.answers(&kind, &self.scenario.stages[index]);
                    if !inputs.is_empty() {
                        return inputs;
                    }
                }
                Some(Task::SkipIfCleared { percent, tasks }) => {
                    if session.cleared_pct().is_none_or(|now| now >= percent) {
                        self.plan.drain(..tasks.min(self.plan.len()));
                    }
                }
                Some(Task::Fill(filling)) => self.go_on_filling(filling),
                Some(Task::Again) => {
                    self.felt.clear();
                    self.follow_rule(index);
                    // A rule without any move would go round for ever within this tick.
                    break;
                }
            }
        }
        Vec::new()
    }
}

fn fits(when: &WhenFile, stage: &Stage) -> bool {
    match when {
        WhenFile::Always => true,
        WhenFile::Cutting => stage.cutting,
        WhenFile::Searching => {
            stage.ask.iter().any(|q| matches!(q.kind, QuestionKind::ToothWith { .. } | QuestionKind::QuadrantOf { .. }))
        }
        WhenFile::Stage(id) => stage.id == *id,
    }
}

/// The i-th of n places spread evenly over -1…1, ends included; 0 for a single one.
fn spread(i: u32, n: u32) -> f32 {
    if n > 1 { 2.0 * i as f32 / (n - 1) as f32 - 1.0 } else { 0.0 }
}

impl Device for Operator {
    fn spec(&self) -> &Spec {
        self.device.spec()
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        self.device.exchange(output)
    }
}

impl Trainee for Operator {
    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input> {
        if let Some(step) = screen {
            self.device.see(step.tip);
            self.tip = step.tip;
            self.follow_trail(step.tip);
        }
        match session.stage() {
            None => self.ratings(),
            Some((index, _)) => {
                if self.stage != Some(index) {
                    self.begin_stage(index);
                }
                self.stage_ticks += 1;
                match self.scenario.stages[index].time_limit {
                    None if self.stage_ticks > PATIENCE_TICKS => vec![Input::Abort],
                    _ => self.go_on(session, index),
                }
            }
        }
    }
}
