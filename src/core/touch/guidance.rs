//! Guidance of the hand: forces played back from a table, or a spring to a path.
//!
//! Takes the tick, and the position and velocity of the hand. Gives a force that is added to the contact force. Never
//! depends on the contact, never removes matter.
//!
//! A path is a virtual fixture (Rosenberg 1993, "Virtual fixtures: perceptual tools for telerobotic manipulation",
//! IEEE VRAIS): a spring from the hand to an anchor, the point of the path nearest to the hand. While the anchor
//! moves to ever nearer points, the spring can only lose energy; where the nearest point jumps, the anchor moves
//! there gradually, behind the hand, which also costs the hand energy. A fixture with a speed of its own, and a table
//! of forces, do work on the hand; the force with which they do it is bounded.

use super::contact_spring::SpringLimit;
use crate::frame::{Pose, Vec3};
use crate::tick::{TICK_S, Tick};
use std::sync::Arc;

/// Guidance of the hand.
#[derive(Clone, Debug)]
pub enum Guidance {
    Forces(ForceTable),
    Path(Fixture),
}

/// Recorded forces over time.
#[derive(Clone, Debug)]
pub struct ForceTable {
    /// In order of time; the time of the first row is the beginning.
    pub rows: Arc<[ForceRow]>,
    /// Starts again half a second after the last row; otherwise the force has faded to zero by then.
    pub repeat: bool,
    pub scale: f32,
    pub space: ForceSpace,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceRow {
    /// s
    pub time: f64,
    /// N
    pub force: Vec3,
}

/// Space in which forces were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceSpace {
    World,
    Tooth,
}

/// Spring to a path in tooth space.
#[derive(Clone, Debug)]
pub struct Fixture {
    pub path: Arc<Polyline>,
    pub anchor_mode: AnchorMode,
    /// Distance from the path within which the hand is free, mm. Outside it the spring fades in over [`SOFT_BORDER`].
    pub radius: f32,
    /// N/mm
    pub stiffness: f32,
    /// N·s/mm; see [`DAMPING_TIME`].
    pub damping: f32,
    /// N
    pub max_force: f32,
}

/// Choice of the point on the path to which the hand is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnchorMode {
    /// The nearest point of the whole path.
    Tube,
    /// The nearest point from the current progress up to `look_ahead` mm farther along: the hand is led from the
    /// beginning of the path to its end, and a self-crossing of the path does not confuse it.
    Follow {
        look_ahead: f32,
        /// Speed at which the point moves on by itself, mm/s; it stops while the hand holds back with the maximum
        /// force.
        speed: Option<f32>,
    },
}

/// Time over which guidance fades in, out, and in again after a release, s. Long enough to notice and yield.
pub const FADE_S: f64 = 0.5;

const FADE_TICKS: u32 = 500;

/// Greatest change of force within one tick when the nearest point jumps, N. Together with the change of the spring
/// force at 100 mm/s it stays below 0.05 N, which is felt as a click.
const MAX_FORCE_STEP: f32 = 0.02;

/// Damping needed by a spring, as a fraction of its stiffness, s. A force is felt one and a half ticks late, and the
/// velocity is known two and a half ticks late: a spring with less damping gives energy to a free hand.
pub const DAMPING_TIME: f32 = 0.004;

/// Depth outside the free radius over which stiffness and damping fade in, mm: no jolt at the border, and no
/// perceptible encoder steps around it. Both fade in by the same fraction, so that a light contact is damped as well
/// as a hard one.
pub const SOFT_BORDER: f32 = 0.3;

/// Minimum distance between consecutive points of a path, mm: an encoder step of a common device.
pub const POINT_DISTANCE: f32 = 0.05;

impl Guidance {
    /// Returns the guidance with stiffness and damping limited to what a device renders well.
    fn limited_to(self, limit: &SpringLimit) -> Guidance {
        match self {
            Guidance::Path(fixture) => Guidance::Path(fixture.limited_to(limit)),
            Guidance::Forces(forces) => Guidance::Forces(forces),
        }
    }
}

impl ForceTable {
    /// Force at a time after the beginning, s; N.
    pub fn at(&self, seconds: f64) -> Vec3 {
        let Some((first, last)) = self.rows.first().zip(self.rows.last()) else { return Vec3::ZERO };
        let period = last.time - first.time + FADE_S;
        let into = if self.repeat { seconds - (seconds / period).floor() * period } else { seconds };
        let time = first.time + into;
        let next = self.rows.partition_point(|row| row.time <= time);
        let force = match (self.rows.get(next.wrapping_sub(1)), self.rows.get(next)) {
            (Some(before), Some(after)) => {
                let share = (time - before.time) / (after.time - before.time);
                before.force.lerp(after.force, share as f32)
            }
            _ => {
                let to = if self.repeat { first.force } else { Vec3::ZERO };
                last.force.lerp(to, ((time - last.time) / FADE_S).clamp(0.0, 1.0) as f32)
            }
        };
        force * self.scale
    }
}

/// Path through points in tooth space.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    points: Vec<Vec3>,
    /// Arc length from the first point to each point, mm.
    arc_lengths: Vec<f32>,
}

/// Point on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PolylineFoot {
    /// Arc length from the first point, mm.
    arc_length: f32,
    point: Vec3,
}

impl Polyline {
    /// Creates a path through points. A point nearer than [`POINT_DISTANCE`] to its predecessor is dropped; a resting
    /// hand records many of those.
    pub fn through(all: impl IntoIterator<Item = Vec3>) -> Polyline {
        let mut path = Polyline { points: Vec::new(), arc_lengths: Vec::new() };
        for point in all {
            match (path.points.last(), path.arc_lengths.last()) {
                (Some(before), Some(along)) => {
                    let distance = point.distance(*before);
                    if distance >= POINT_DISTANCE {
                        path.arc_lengths.push(along + distance);
                        path.points.push(point);
                    }
                }
                _ => {
                    path.arc_lengths.push(0.0);
                    path.points.push(point);
                }
            }
        }
        path
    }

    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Length of the path, mm.
    pub fn length(&self) -> f32 {
        self.arc_lengths.last().copied().unwrap_or(0.0)
    }

    /// Point at an arc length, mm, from the first point; the last point beyond the end.
    fn point_at(&self, along: f32) -> Vec3 {
        let next = self.arc_lengths.partition_point(|&a| a <= along).max(1);
        let ends = self.points.get(next - 1).zip(self.points.get(next));
        match (ends, self.arc_lengths.get(next - 1).zip(self.arc_lengths.get(next))) {
            (Some((from, to)), Some((start, end))) => from.lerp(*to, (along - start) / (end - start)),
            _ => self.points.last().copied().unwrap_or_default(),
        }
    }

    /// Point nearest to `point` between two arc lengths; the first of several equally near ones.
    fn nearest(&self, point: Vec3, from: f32, to: f32) -> PolylineFoot {
        let mut best = PolylineFoot { arc_length: from, point: self.point_at(from) };
        let mut least = best.point.distance(point);
        let first = self.arc_lengths.partition_point(|&a| a <= from).saturating_sub(1);
        for (ends, along) in self.points.windows(2).zip(self.arc_lengths.windows(2)).skip(first) {
            let (&[a, b], &[start, end]) = (ends, along) else { break };
            if start >= to {
                break;
            }
            let length = end - start;
            // Most segments are too far away to contain the nearest point; this test needs neither division nor
            // square root.
            let farthest = least + length;
            if a.distance_squared(point) > farthest * farthest {
                continue;
            }
            let direction = (b - a) / length;
            let on_segment = (point - a).dot(direction).max(from - start).max(0.0).min(to - start).min(length);
            let foot = PolylineFoot { arc_length: start + on_segment, point: a + direction * on_segment };
            let distance = foot.point.distance(point);
            if distance < least {
                (best, least) = (foot, distance);
            }
        }
        best
    }
}

impl Fixture {
    /// Returns the fixture with stiffness and damping limited to what a device renders well.
    fn limited_to(self, limit: &SpringLimit) -> Fixture {
        let damping = self.damping.min(limit.max_damping);
        let stiffness = self.stiffness.min(limit.max_stiffness).min(damping / DAMPING_TIME);
        Fixture { damping, stiffness, ..self }
    }

    /// Distance from the path at which the spring reaches the maximum force, mm.
    fn saturation_distance(&self) -> f32 {
        self.radius + 0.5 * SOFT_BORDER + self.max_force / self.stiffness
    }

    /// Stretch of the spring, mm, and the fraction of stiffness and damping in effect.
    fn stretch(&self, hand: Vec3, anchor: Vec3) -> (f32, f32) {
        let depth = (hand.distance(anchor) - self.radius).max(0.0);
        match depth < SOFT_BORDER {
            true => (0.5 * depth * depth / SOFT_BORDER, depth / SOFT_BORDER),
            false => (depth - 0.5 * SOFT_BORDER, 1.0),
        }
    }

    fn spring(&self, hand: Vec3, anchor: Vec3) -> Vec3 {
        let (stretch, _) = self.stretch(hand, anchor);
        (anchor - hand).normalize_or_zero() * (self.stiffness * stretch).min(self.max_force)
    }

    fn force(&self, hand: Vec3, velocity: Vec3, anchor: Vec3) -> Vec3 {
        let (_, share) = self.stretch(hand, anchor);
        (self.spring(hand, anchor) - velocity * (self.damping * share)).clamp_length_max(self.max_force)
    }
}

/// Active guidance and its progress.
#[derive(Clone, Debug)]
pub struct GuidanceController {
    /// Guidances with the stiffness and damping that their authors gave them.
    written: Vec<Guidance>,
    /// The same, limited to what the device renders well at the present scale of the hand.
    guidances: Vec<Guidance>,
    limit: SpringLimit,
    wanted: Option<ActiveGuidance>,
    /// Lags behind `wanted`: the guidance in effect fades out before another fades in.
    in_effect: Option<ActiveGuidance>,
    /// Ticks of the fade completed, up to [`FADE_TICKS`].
    fade_ticks: u32,
    /// Arc length that the hand has reached on the path, mm.
    progress: f32,
    anchor: Option<Vec3>,
    /// Position of the hand in the previous tick, tooth space.
    hand: Vec3,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ActiveGuidance {
    guidance: usize,
    since: Tick,
}

impl GuidanceController {
    /// Guidances in the order of their indices; none is active.
    pub fn new(guidances: Vec<Guidance>, limit: &SpringLimit) -> GuidanceController {
        let fitted = guidances.iter().map(|guidance| guidance.clone().limited_to(limit));
        GuidanceController {
            guidances: fitted.collect(),
            written: guidances,
            limit: *limit,
            wanted: None,
            in_effect: None,
            fade_ticks: 0,
            progress: 0.0,
            anchor: None,
            hand: Vec3::ZERO,
        }
    }

    /// Sets the distance at the tooth per distance of the hand, which then feels the same stiffness as at 1.
    pub fn set_scale(&mut self, scale: f32) {
        let limit = self.limit.at_scale(scale);
        for (guidance, written) in self.guidances.iter_mut().zip(&self.written) {
            // Only counts of shared tables change: nothing is allocated or freed.
            *guidance = written.clone().limited_to(&limit);
        }
    }

    /// Activates a guidance from its beginning, from tick `since` on; deactivates guidance if there is none with that
    /// index.
    pub fn choose(&mut self, guidance: Option<usize>, since: Tick) {
        let valid = guidance.filter(|&guidance| guidance < self.guidances.len());
        self.wanted = valid.map(|guidance| ActiveGuidance { guidance, since });
    }

    /// Force on the hand for a tick, N, world space. Position and velocity in tooth space, mm and mm/s.
    pub fn force(&mut self, tick: Tick, hand: Vec3, velocity: Vec3, world_from_tooth: &Pose) -> Vec3 {
        self.update_fade();
        let before = std::mem::replace(&mut self.hand, hand);
        let GuidanceController { guidances, in_effect, progress, anchor, .. } = self;
        let Some(ActiveGuidance { guidance, since }) = *in_effect else { return Vec3::ZERO };
        let force = match guidances.get(guidance) {
            Some(Guidance::Forces(forces)) => {
                let force = forces.at(tick.seconds_since(since));
                match forces.space {
                    ForceSpace::World => force,
                    ForceSpace::Tooth => world_from_tooth.rotate(force),
                }
            }
            Some(Guidance::Path(fixture)) => {
                *progress = advance_along_path(fixture, *progress, hand);
                let to = fixture.path.point_at(*progress);
                let at = anchor.map_or(to, |from| rate_limited_anchor(fixture, from, to, [before, hand]));
                *anchor = Some(at);
                world_from_tooth.rotate(fixture.force(hand, velocity, at))
            }
            None => Vec3::ZERO,
        };
        force * (self.fade_ticks as f32 / FADE_TICKS as f32)
    }

    /// Suspends guidance; it fades in again afterwards, from its current progress.
    pub fn suspend(&mut self) {
        self.fade_ticks = 0;
        self.anchor = None;
    }

    fn update_fade(&mut self) {
        if self.in_effect == self.wanted {
            self.fade_ticks = (self.fade_ticks + 1).min(FADE_TICKS);
        } else if self.fade_ticks > 0 && self.in_effect.is_some() {
            self.fade_ticks -= 1;
        } else {
            self.in_effect = self.wanted;
            self.fade_ticks = 1;
            self.progress = 0.0;
            self.anchor = None;
        }
    }
}

/// Arc length of the point to which the hand is drawn, mm.
fn advance_along_path(fixture: &Fixture, progress: f32, hand: Vec3) -> f32 {
    let path = &fixture.path;
    match fixture.anchor_mode {
        AnchorMode::Tube => path.nearest(hand, 0.0, path.length()).arc_length,
        AnchorMode::Follow { look_ahead, speed } => {
            let foot = path.nearest(hand, progress, (progress + look_ahead).min(path.length()));
            match speed {
                Some(speed) if foot.point.distance(hand) < fixture.saturation_distance() => {
                    (foot.arc_length + speed * TICK_S as f32).min(path.length())
                }
                _ => foot.arc_length,
            }
        }
    }
}

/// Anchor after one tick of motion toward `to`: the target itself, unless the force would jump. `[before, now]`: hand
/// positions of the previous and this tick.
fn rate_limited_anchor(fixture: &Fixture, from: Vec3, to: Vec3, [before, now]: [Vec3; 2]) -> Vec3 {
    let jump = fixture.spring(now, to).distance(fixture.spring(now, from));
    if jump <= MAX_FORCE_STEP {
        return to;
    }
    let displacement = to - from;
    let along = displacement.normalize_or_zero();
    // Following the hand's own motion in that direction does not change the force.
    let most = MAX_FORCE_STEP / fixture.stiffness + (now - before).dot(along).max(0.0);
    from + along * most.min(displacement.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: SpringLimit = SpringLimit { max_stiffness: 1.0, max_damping: 0.005, resolution: 0.0 };

    fn fixture(points: &[[f32; 3]], kind: AnchorMode) -> Fixture {
        let path = Arc::new(Polyline::through(points.iter().copied().map(Vec3::from)));
        Fixture { path, anchor_mode: kind, radius: 0.0, stiffness: 0.2, damping: 0.001, max_force: 1.0 }
    }

    fn guide(guidance: Guidance) -> GuidanceController {
        let mut guide = GuidanceController::new(vec![guidance], &LIMIT);
        guide.choose(Some(0), Tick(0));
        guide
    }

    #[test]
    fn a_path_finds_its_places() {
        // Aim: points by arc length and by proximity, at ends and corners. Method: a right angle with legs of 4 and 3
        // mm.
        let path = Polyline::through([Vec3::ZERO, Vec3::X * 0.01, Vec3::X * 4.0, Vec3::new(4.0, 3.0, 0.0)]);
        assert_eq!((path.points().len(), path.length()), (3, 7.0), "a point too close to its predecessor is left out");
        assert_eq!(path.point_at(5.5), Vec3::new(4.0, 1.5, 0.0));
        assert_eq!(path.point_at(9.0), Vec3::new(4.0, 3.0, 0.0));
        let check = |point: [f32; 3], from: f32, to: f32, along: f32| {
            let foot = path.nearest(Vec3::from(point), from, to);
            assert!((foot.arc_length - along).abs() < 1e-5, "{point:?} in {from}–{to}: {foot:?}");
        };
        check([1.0, 1.0, 0.0], 0.0, 7.0, 1.0);
        check([3.5, 1.0, 0.0], 0.0, 7.0, 5.0);
        check([3.5, 1.0, 0.0], 0.0, 3.0, 3.0);
        check([1.0, 1.0, 0.0], 2.0, 7.0, 2.0);
        check([9.0, 9.0, 0.0], 0.0, 7.0, 7.0);
        check([9.0, 9.0, 0.0], 7.0, 7.0, 7.0);
    }

    #[test]
    fn a_place_comes_after_another() {
        // Aim: progress never decreases and does not jump at a crossing. Method: follow a figure of eight once
        // around; at its centre both branches are equally near.
        let eight = |i: u32| {
            let turn = i as f32 / 400.0 * core::f32::consts::TAU;
            Vec3::new(5.0 * turn.sin(), 5.0 * turn.sin() * turn.cos(), 0.0)
        };
        let path = Arc::new(Polyline::through((0..=400).map(eight)));
        let kind = AnchorMode::Follow { look_ahead: 1.0, speed: None };
        let fixture = Fixture { path: path.clone(), ..fixture(&[], kind) };
        let mut progress = 0.0;
        for i in 0..=4000 {
            let (whole, part) = (i / 10, (i % 10) as f32 / 10.0);
            let hand = eight(whole).lerp(eight(whole + 1), part);
            let next = advance_along_path(&fixture, progress, hand);
            assert!((progress..progress + 0.05).contains(&next), "step {i}: {progress} to {next}");
            progress = next;
        }
        assert!(progress > path.length() - 0.1, "{progress} of {}", path.length());
    }

    #[test]
    fn a_lead_waits_for_the_hand() {
        // Aim: a path with a speed advances no farther than its spring reaches. Method: a hand that does not move.
        let kind = AnchorMode::Follow { look_ahead: 1.0, speed: Some(10.0) };
        let fixture = fixture(&[[0.0; 3], [50.0, 0.0, 0.0]], kind);
        let mut guide = guide(Guidance::Path(fixture));
        let mut force = Vec3::ZERO;
        for tick in 0..4000 {
            force = guide.force(Tick(tick), Vec3::ZERO, Vec3::ZERO, &Pose::IDENTITY);
            if tick == 300 {
                assert!((guide.progress - 3.01).abs() < 1e-3, "10 mm/s: {}", guide.progress);
            }
        }
        assert!((guide.progress - 5.15).abs() < 0.02, "waits where the spring pulls with 1 N: {}", guide.progress);
        assert!((force - Vec3::X).length() < 1e-3, "{force}");
    }

    #[test]
    fn forces_come_again_and_go() {
        // Aim: forces between rows, after the last row, and in the second round. Method: a table of one second that
        // begins at 3 s.
        let row = |time, x| ForceRow { time, force: Vec3::X * x };
        let rows: Arc<[ForceRow]> = Arc::new([row(3.0, 1.0), row(3.5, 2.0), row(4.0, -1.0)]);
        let once = ForceTable { rows, repeat: false, scale: 2.0, space: ForceSpace::World };
        let again = ForceTable { repeat: true, ..once.clone() };
        let check = |forces: &ForceTable, seconds: f64, x: f32| {
            let force = forces.at(seconds);
            assert!((force - Vec3::X * x).length() < 1e-5, "{seconds} s: {force}");
        };
        for forces in [&once, &again] {
            check(forces, 0.0, 2.0);
            check(forces, 0.25, 3.0);
            check(forces, 0.75, 1.0);
            check(forces, 1.0, -2.0);
        }
        check(&once, 1.25, -1.0);
        check(&once, 2.0, 0.0);
        check(&again, 1.25, 0.0);
        check(&again, 1.5, 2.0);
        check(&again, 3.0 * 1.5 + 0.25, 3.0);
        check(&ForceTable { rows: Arc::new([]), ..again }, 1.0, 0.0);
    }

    #[test]
    fn what_is_in_effect_goes_before_something_else_comes() {
        // Aim: the force does not jump when guidance is exchanged, removed or invalid. Method: two tables of
        // constant, opposite forces.
        let constant = |x: f32| {
            let rows = Arc::new([0.0, 100.0].map(|time| ForceRow { time, force: Vec3::X * x }));
            Guidance::Forces(ForceTable { rows, repeat: false, scale: 1.0, space: ForceSpace::World })
        };
        let mut guide = GuidanceController::new(vec![constant(1.0), constant(-1.0)], &LIMIT);
        let mut before = Vec3::ZERO;
        for tick in 0..6000 {
            match tick {
                10 => guide.choose(Some(0), Tick(tick)),
                1000 => guide.choose(Some(1), Tick(tick)),
                1200 => guide.choose(Some(0), Tick(tick)),
                1300 => guide.choose(Some(1), Tick(tick)),
                3000 => guide.choose(None, Tick(tick)),
                4000 => guide.choose(Some(7), Tick(tick)),
                _ => {}
            }
            let force = guide.force(Tick(tick), Vec3::ZERO, Vec3::ZERO, &Pose::IDENTITY);
            assert!((force - before).length() < 0.0021, "tick {tick}: {before} to {force}");
            match tick {
                900 => assert_eq!(force, Vec3::X),
                2900 => assert_eq!(force, Vec3::NEG_X),
                0..10 | 3600.. => assert_eq!(force, Vec3::ZERO),
                _ => {}
            }
            before = force;
        }
    }

    #[test]
    fn a_device_gets_no_stiffer_spring_than_it_can_damp() {
        let wished = Fixture { stiffness: 1.0, damping: 0.01, ..fixture(&[], AnchorMode::Tube) };
        let weak = SpringLimit { max_stiffness: 0.5, max_damping: 0.001, resolution: 0.0 };
        let fitted = wished.limited_to(&weak);
        assert_eq!((fitted.stiffness, fitted.damping), (0.25, 0.001));
    }
}
