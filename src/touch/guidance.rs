//! Guidance for the hand: forces played from a table, or a spring to a path.
//!
//! Takes the tick, where the hand is and how fast it moves. Gives a force to be added to what the hand feels. Never knows
//! what the hand touches, never takes matter away.
//!
//! A path is a virtual fixture (Rosenberg 1993, "Virtual fixtures: perceptual tools for telerobotic manipulation", IEEE
//! VRAIS): a spring from the hand to an anchor, the place of the path that is nearest to the hand. While the anchor moves to
//! ever nearer places the spring can only lose energy; where the nearest place jumps, the anchor glides there, behind the
//! hand, which costs the hand energy too. A fixture that is pulled along and a table of forces lead, and so do work; the
//! force with which they do it is bounded.

use super::law::SpringLimit;
use crate::frame::{Pose, Vec3};
use crate::tick::{TICK_S, Tick};
use std::sync::Arc;

/// Something that leads the hand.
#[derive(Clone, Debug)]
pub enum Guidance {
    Forces(Forces),
    Path(Fixture),
}

/// Forces over time, as somebody once felt them.
#[derive(Clone, Debug)]
pub struct Forces {
    /// In order of time; the first row's time is when they begin.
    pub rows: Arc<[ForceRow]>,
    /// Begins again half a second after the last row; otherwise the force is gone by then.
    pub repeat: bool,
    pub scale: f32,
    pub space: Space,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceRow {
    /// s
    pub time: f64,
    /// N
    pub force: Vec3,
}

/// The space in which forces were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    World,
    Tooth,
}

/// A spring to a path in tooth space.
#[derive(Clone, Debug)]
pub struct Fixture {
    pub path: Arc<Path>,
    pub kind: Kind,
    /// Distance from the path within which the hand is free, mm. Outside the spring comes in over [`WALL`].
    pub radius: f32,
    /// N/mm
    pub stiffness: f32,
    /// N·s/mm; see [`DAMPING_TIME`].
    pub damping: f32,
    /// N
    pub max_force: f32,
}

/// Which place of the path the hand is drawn to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The nearest of all.
    Tube,
    /// The nearest from where the hand has come so far, up to so many mm further on: the hand is led from the path's beginning
    /// to its end, and a crossing does not confuse it.
    Follow {
        look_ahead: f32,
        /// mm/s at which the place moves on by itself, unless the hand holds back with all the force it is pulled with.
        speed: Option<f32>,
    },
}

/// Time over which guidance comes in, goes, and comes back after the hand was let go, s. Long enough to notice and yield.
pub const EASE_S: f64 = 0.5;

const EASE_TICKS: u32 = 500;

/// Most that a jump of the nearest place may change the force in a tick, N. With what the spring gives at 100 mm/s it stays
/// below what is felt as a click, 0.05 N.
const STEP: f32 = 0.02;

/// Damping that a spring needs, as a share of its stiffness, s. A tick and a half passes until a force is felt and the
/// speed is known two and a half ticks late: a spring that is damped less gives a free hand energy.
pub const DAMPING_TIME: f32 = 0.004;

/// Depth outside the free radius over which stiffness and damping come in, mm: no jolt at its border, and nothing to feel of
/// an encoder's steps around it. The same share of both, so that a light touch is damped as well as a hard one.
pub const WALL: f32 = 0.3;

/// Points of a path are at least this far apart, mm; an encoder's step of a common device.
pub const POINT_DISTANCE: f32 = 0.05;

impl Forces {
    /// The force so many seconds after the beginning, N.
    pub fn at(&self, seconds: f64) -> Vec3 {
        let Some((first, last)) = self.rows.first().zip(self.rows.last()) else { return Vec3::ZERO };
        let period = last.time - first.time + EASE_S;
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
                last.force.lerp(to, ((time - last.time) / EASE_S).clamp(0.0, 1.0) as f32)
            }
        };
        force * self.scale
    }
}

/// A line through points in tooth space.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    points: Vec<Vec3>,
    /// Way from the first point to each, mm.
    along: Vec<f32>,
}

/// A place on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Foot {
    /// Way from the first point, mm.
    along: f32,
    point: Vec3,
}

impl Path {
    /// A path through points; those nearer than [`POINT_DISTANCE`] to the one before are left out, as a resting hand leaves many.
    pub fn through(all: impl IntoIterator<Item = Vec3>) -> Path {
        let mut path = Path { points: Vec::new(), along: Vec::new() };
        for point in all {
            match (path.points.last(), path.along.last()) {
                (Some(before), Some(along)) => {
                    let way = point.distance(*before);
                    if way >= POINT_DISTANCE {
                        path.along.push(along + way);
                        path.points.push(point);
                    }
                }
                _ => {
                    path.along.push(0.0);
                    path.points.push(point);
                }
            }
        }
        path
    }

    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// mm
    pub fn length(&self) -> f32 {
        self.along.last().copied().unwrap_or(0.0)
    }

    /// The place so many mm from the first point; the last point beyond the end.
    fn at(&self, along: f32) -> Vec3 {
        let next = self.along.partition_point(|&a| a <= along).max(1);
        let ends = self.points.get(next - 1).zip(self.points.get(next));
        match (ends, self.along.get(next - 1).zip(self.along.get(next))) {
            (Some((from, to)), Some((start, end))) => from.lerp(*to, (along - start) / (end - start)),
            _ => self.points.last().copied().unwrap_or_default(),
        }
    }

    /// The place nearest to a point between two places of the path; of equals the first.
    fn nearest(&self, point: Vec3, from: f32, to: f32) -> Foot {
        let mut best = Foot { along: from, point: self.at(from) };
        let mut least = best.point.distance(point);
        let first = self.along.partition_point(|&a| a <= from).saturating_sub(1);
        for (ends, along) in self.points.windows(2).zip(self.along.windows(2)).skip(first) {
            let (&[a, b], &[start, end]) = (ends, along) else { break };
            if start >= to {
                break;
            }
            let length = end - start;
            // Most legs are too far away for any of their points: seen without a division or a root.
            let farthest = least + length;
            if a.distance_squared(point) > farthest * farthest {
                continue;
            }
            let way = (b - a) / length;
            let on_leg = (point - a).dot(way).max(from - start).max(0.0).min(to - start).min(length);
            let foot = Foot { along: start + on_leg, point: a + way * on_leg };
            let distance = foot.point.distance(point);
            if distance < least {
                (best, least) = (foot, distance);
            }
        }
        best
    }
}

impl Fixture {
    /// The same with a spring no stiffer than a device renders well.
    fn on(self, limit: &SpringLimit) -> Fixture {
        let damping = self.damping.min(limit.max_damping);
        let stiffness = self.stiffness.min(limit.max_stiffness).min(damping / DAMPING_TIME);
        Fixture { damping, stiffness, ..self }
    }

    /// Distance at which the spring pulls as hard as it may, mm.
    fn reach(&self) -> f32 {
        self.radius + 0.5 * WALL + self.max_force / self.stiffness
    }

    /// How far the spring is stretched, mm, and the share of stiffness and damping in effect.
    fn stretch(&self, hand: Vec3, anchor: Vec3) -> (f32, f32) {
        let depth = (hand.distance(anchor) - self.radius).max(0.0);
        match depth < WALL {
            true => (0.5 * depth * depth / WALL, depth / WALL),
            false => (depth - 0.5 * WALL, 1.0),
        }
    }

    fn spring(&self, hand: Vec3, anchor: Vec3) -> Vec3 {
        let (stretch, _) = self.stretch(hand, anchor);
        (anchor - hand).normalize_or_zero() * (self.stiffness * stretch).min(self.max_force)
    }

    fn pull(&self, hand: Vec3, velocity: Vec3, anchor: Vec3) -> Vec3 {
        let (_, share) = self.stretch(hand, anchor);
        (self.spring(hand, anchor) - velocity * (self.damping * share)).clamp_length_max(self.max_force)
    }
}

/// What leads the hand now, and how far it has come.
#[derive(Clone, Debug)]
pub struct Guide {
    guidances: Vec<Guidance>,
    wanted: Option<Chosen>,
    /// Lags behind `wanted`: what is in effect goes before something else comes.
    in_effect: Option<Chosen>,
    /// Ticks by which it has come in, up to [`EASE_TICKS`].
    eased: u32,
    /// Way along the path to where the hand has come, mm.
    progress: f32,
    anchor: Option<Vec3>,
    /// Where the hand was in the tick before.
    hand: Vec3,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Chosen {
    guidance: usize,
    since: Tick,
}

impl Guide {
    /// Guidances in the order in which they are chosen, none of them in effect.
    pub fn new(guidances: Vec<Guidance>, limit: &SpringLimit) -> Guide {
        let fitted = guidances.into_iter().map(|guidance| match guidance {
            Guidance::Path(fixture) => Guidance::Path(fixture.on(limit)),
            forces => forces,
        });
        Guide {
            guidances: fitted.collect(),
            wanted: None,
            in_effect: None,
            eased: 0,
            progress: 0.0,
            anchor: None,
            hand: Vec3::ZERO,
        }
    }

    /// Leads by a guidance from a tick on, from its beginning; by none if there is none of that number.
    pub fn choose(&mut self, guidance: Option<usize>, since: Tick) {
        let known = guidance.filter(|&guidance| guidance < self.guidances.len());
        self.wanted = known.map(|guidance| Chosen { guidance, since });
    }

    /// The force on the hand for a tick, N, world space. Place and velocity in tooth space, mm and mm/s.
    pub fn force(&mut self, tick: Tick, hand: Vec3, velocity: Vec3, world_from_tooth: &Pose) -> Vec3 {
        self.ease();
        let before = std::mem::replace(&mut self.hand, hand);
        let Guide { guidances, in_effect, progress, anchor, .. } = self;
        let Some(Chosen { guidance, since }) = *in_effect else { return Vec3::ZERO };
        let force = match guidances.get(guidance) {
            Some(Guidance::Forces(forces)) => {
                let force = forces.at(tick.seconds_since(since));
                match forces.space {
                    Space::World => force,
                    Space::Tooth => world_from_tooth.turn(force),
                }
            }
            Some(Guidance::Path(fixture)) => {
                *progress = advanced(fixture, *progress, hand);
                let to = fixture.path.at(*progress);
                let at = anchor.map_or(to, |from| glided(fixture, from, to, [before, hand]));
                *anchor = Some(at);
                world_from_tooth.turn(fixture.pull(hand, velocity, at))
            }
            None => Vec3::ZERO,
        };
        force * (self.eased as f32 / EASE_TICKS as f32)
    }

    /// Nothing leads for now; it comes in again softly, from where it was.
    pub fn let_go(&mut self) {
        self.eased = 0;
        self.anchor = None;
    }

    fn ease(&mut self) {
        if self.in_effect == self.wanted {
            self.eased = (self.eased + 1).min(EASE_TICKS);
        } else if self.eased > 0 && self.in_effect.is_some() {
            self.eased -= 1;
        } else {
            self.in_effect = self.wanted;
            self.eased = 1;
            self.progress = 0.0;
            self.anchor = None;
        }
    }
}

/// The way along the path to the place that the hand is drawn to now, mm.
fn advanced(fixture: &Fixture, progress: f32, hand: Vec3) -> f32 {
    let path = &fixture.path;
    match fixture.kind {
        Kind::Tube => path.nearest(hand, 0.0, path.length()).along,
        Kind::Follow { look_ahead, speed } => {
            let foot = path.nearest(hand, progress, (progress + look_ahead).min(path.length()));
            match speed {
                Some(speed) if foot.point.distance(hand) < fixture.reach() => {
                    (foot.along + speed * TICK_S as f32).min(path.length())
                }
                _ => foot.along,
            }
        }
    }
}

/// Where the anchor is after a tick on its way to a place: there, unless the force would jump. `hand`: before and now.
fn glided(fixture: &Fixture, from: Vec3, to: Vec3, [before, now]: [Vec3; 2]) -> Vec3 {
    let jump = fixture.spring(now, to).distance(fixture.spring(now, from));
    if jump <= STEP {
        return to;
    }
    let way = to - from;
    let along = way.normalize_or_zero();
    // As far as the hand itself went that way, the force does not change.
    let most = STEP / fixture.stiffness + (now - before).dot(along).max(0.0);
    from + along * most.min(way.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: SpringLimit = SpringLimit { max_stiffness: 1.0, max_damping: 0.005, resolution: 0.0 };

    fn fixture(points: &[[f32; 3]], kind: Kind) -> Fixture {
        let path = Arc::new(Path::through(points.iter().copied().map(Vec3::from)));
        Fixture { path, kind, radius: 0.0, stiffness: 0.2, damping: 0.001, max_force: 1.0 }
    }

    fn guide(guidance: Guidance) -> Guide {
        let mut guide = Guide::new(vec![guidance], &LIMIT);
        guide.choose(Some(0), Tick(0));
        guide
    }

    #[test]
    fn a_path_finds_its_places() {
        // Aim: places by way and by nearness, at ends and corners. Method: a right angle with legs of 4 and 3 mm.
        let path = Path::through([Vec3::ZERO, Vec3::X * 0.01, Vec3::X * 4.0, Vec3::new(4.0, 3.0, 0.0)]);
        assert_eq!((path.points().len(), path.length()), (3, 7.0), "a point within the grain is left out");
        assert_eq!(path.at(5.5), Vec3::new(4.0, 1.5, 0.0));
        assert_eq!(path.at(9.0), Vec3::new(4.0, 3.0, 0.0));
        let check = |point: [f32; 3], from: f32, to: f32, along: f32| {
            let foot = path.nearest(Vec3::from(point), from, to);
            assert!((foot.along - along).abs() < 1e-5, "{point:?} in {from}–{to}: {foot:?}");
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
        // Aim: progress never goes back and does not jump at a crossing. Method: a figure of eight, walked once round; at its
        // middle the other branch is as near as the own one.
        let eight = |i: u32| {
            let turn = i as f32 / 400.0 * core::f32::consts::TAU;
            Vec3::new(5.0 * turn.sin(), 5.0 * turn.sin() * turn.cos(), 0.0)
        };
        let path = Arc::new(Path::through((0..=400).map(eight)));
        let kind = Kind::Follow { look_ahead: 1.0, speed: None };
        let fixture = Fixture { path: path.clone(), ..fixture(&[], kind) };
        let mut progress = 0.0;
        for i in 0..=4000 {
            let (whole, part) = (i / 10, (i % 10) as f32 / 10.0);
            let hand = eight(whole).lerp(eight(whole + 1), part);
            let next = advanced(&fixture, progress, hand);
            assert!((progress..progress + 0.05).contains(&next), "step {i}: {progress} to {next}");
            progress = next;
        }
        assert!(progress > path.length() - 0.1, "{progress} of {}", path.length());
    }

    #[test]
    fn a_lead_waits_for_the_hand() {
        // Aim: a path with a speed leads no further ahead than its spring reaches. Method: a hand that does not move.
        let kind = Kind::Follow { look_ahead: 1.0, speed: Some(10.0) };
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
        // Aim: between rows, after the last one, and in the second round. Method: a table of one second that begins at 3 s.
        let row = |time, x| ForceRow { time, force: Vec3::X * x };
        let rows: Arc<[ForceRow]> = Arc::new([row(3.0, 1.0), row(3.5, 2.0), row(4.0, -1.0)]);
        let once = Forces { rows, repeat: false, scale: 2.0, space: Space::World };
        let again = Forces { repeat: true, ..once.clone() };
        let check = |forces: &Forces, seconds: f64, x: f32| {
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
        check(&Forces { rows: Arc::new([]), ..again }, 1.0, 0.0);
    }

    #[test]
    fn what_is_in_effect_goes_before_something_else_comes() {
        // Aim: no step when guidance is exchanged, taken away or let go. Method: two tables of constant, opposite forces.
        let constant = |x: f32| {
            let rows = Arc::new([0.0, 100.0].map(|time| ForceRow { time, force: Vec3::X * x }));
            Guidance::Forces(Forces { rows, repeat: false, scale: 1.0, space: Space::World })
        };
        let mut guide = Guide::new(vec![constant(1.0), constant(-1.0)], &LIMIT);
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
        let wished = Fixture { stiffness: 1.0, damping: 0.01, ..fixture(&[], Kind::Tube) };
        let weak = SpringLimit { max_stiffness: 0.5, max_damping: 0.001, resolution: 0.0 };
        let fitted = wished.on(&weak);
        assert_eq!((fitted.stiffness, fitted.damping), (0.25, 0.001));
    }
}
