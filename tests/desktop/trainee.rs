//! Actions of a trainee at the window, by whichever driver.

use crate::support::window_driver::{PATIENCE, WindowDriver};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};
use typodont_core::frame::{Quat, Vec3};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{Question, QuestionKind, ResolveMode, Scenario, Stage, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_render::Orbit;

/// Maximum distance of one mouse movement, pixels.
const STRETCH: f32 = 120.0;

/// Pixels of the view to a millimetre, at least: the pointer then approaches a place without passing it.
const PIXELS_PER_MM: f32 = 8.0;

/// Distance across the line of sight at which the hand counts as arrived, mm.
const NEAR: f32 = 0.4;

/// Time for which the instrument is pressed at one place.
const PRESS: Duration = Duration::from_millis(1500);

pub trait Trainee: WindowDriver {
    fn hand(&self) -> Vec3 {
        let line = self.latest("hand").unwrap_or_default();
        let numbers: Vec<f32> = line.split(' ').filter_map(|n| n.parse().ok()).collect();
        Vec3::from_slice(&numbers)
    }

    fn rate_everything(&mut self) {
        for rated in 1..=25 {
            self.press("4", "rated", &rated.to_string());
        }
    }

    /// Orientation of the view in world space.
    fn world_from_view(&self) -> Quat {
        let line = self.latest("view").unwrap_or_default();
        let (turn, tilt) = line.split_once(' ').unwrap_or_default();
        let orbit = Orbit {
            azimuth: turn.parse().unwrap(),
            elevation: tilt.parse().unwrap(),
            ..Orbit::around(Vec3::ZERO, 1.0)
        };
        orbit.world_from_view()
    }

    /// Moves the mouse until the hand is over or under a place of world space, as one sees it in the picture.
    fn point_at(&mut self, goal: Vec3) {
        let begun = Instant::now();
        loop {
            let hand = self.hand();
            let away = self.world_from_view().inverse() * (goal - hand);
            if away.truncate().length() < NEAR {
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "the hand stays at {hand}, away from {goal}");
            let pixels = [away.x, -away.y].map(|mm| (mm * PIXELS_PER_MM).clamp(-STRETCH, STRETCH).round());
            self.move_by(pixels.map(|pixels| pixels as i32));
            self.settle(hand);
        }
    }

    /// Presses the instrument around a place, a little farther round each time, until something is true.
    fn press_around(&mut self, place: Vec3, mut is_done: impl FnMut(&mut Self, usize) -> bool) -> bool {
        (0..40).any(|round| {
            let (sin, cos) = (0.8 * round as f32).sin_cos();
            self.point_at(place + Vec3::new(cos, 0.0, sin) * 0.6);
            self.set_button(true);
            self.wait(PRESS);
            let is_enough = is_done(self, round);
            self.set_button(false);
            is_enough
        })
    }

    /// Until the hand that was somewhere has moved and come to rest, or does not move at all.
    fn settle(&mut self, before: Vec3) {
        let begun = Instant::now();
        let mut last = before;
        let mut calm = 0;
        while calm < 6 && begun.elapsed() < Duration::from_secs(4) {
            self.wait(Duration::from_millis(50));
            let hand = self.hand();
            calm = if hand == last && hand != before { calm + 1 } else { 0 };
            last = hand;
        }
    }
}

impl<Driver: WindowDriver> Trainee for Driver {}

/// Centre of the decay of an exercise for a seed, world space, mm.
pub fn lesion_in_world(exercise: &str, seed: u64) -> Vec3 {
    let (_, workpiece) = made(exercise, seed);
    workpiece.world_from_tooth * workpiece.lesions[0].centre
}

/// The place of a lesion, world space, mm.
pub fn site_in_world(exercise: &str, id: &str) -> Vec3 {
    let (_, workpiece) = made(exercise, 0);
    let lesion = workpiece.lesions.iter().find(|lesion| lesion.id == id).unwrap();
    workpiece.world_from_tooth * lesion.centre
}

/// The caries that a trial draws, world space, mm, and the correct answers to its questions as `QUESTION:ANSWER`.
pub struct DrawnTrial {
    pub place: Vec3,
    pub answers: Vec<String>,
}

/// All trials of an exercise for a seed; none in an exercise without a draw.
pub fn drawn_trials(exercise: &str, seed: u64) -> Vec<DrawnTrial> {
    let (scenario, workpiece) = made(exercise, seed);
    let drawn = scenario.stages.iter().zip(&workpiece.drawn);
    let trial = |(stage, drawn): (&Stage, &Option<usize>)| {
        let lesion = &workpiece.lesions[(*drawn)?];
        let answer = |question: &Question| match question.kind {
            QuestionKind::ToothWith { .. } => Some(format!("{}:{}", question.id, workpiece.teeth[lesion.tooth].id)),
            QuestionKind::QuadrantOf { .. } => Some(format!("{}:{}", question.id, lesion.quadrant)),
            _ => None,
        };
        let place = workpiece.world_from_tooth * lesion.centre;
        Some(DrawnTrial { place, answers: stage.ask.iter().filter_map(answer).collect() })
    };
    drawn.filter_map(trial).collect()
}

fn made(exercise: &str, seed: u64) -> (Scenario, Workpiece) {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(exercise)).unwrap();
    let scenario =
        scenario::resolve(SourceText::new(exercise, text), &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
    let workpiece = Workpiece::make(&scenario, seed).unwrap();
    (scenario, workpiece)
}
