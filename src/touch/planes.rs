//! The place nearest to the hand that a set of walls allows.
//!
//! A small quadratic programme: minimise |x − goal|² with n·x ≥ d for every wall. Solved by a dual active set of at most
//! three walls (in three dimensions a fourth adds nothing), after Goldfarb & Idnani (1983).

use super::body::Region;
use crate::frame::Vec3;

/// A wall that the tip's centre must stay in front of: `normal · x >= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// Unit, pointing out of the matter.
    pub normal: Vec3,
    pub offset: f32,
    /// Where on the surface the wall was found, tooth space.
    pub at: Vec3,
    pub touched: Touched,
    /// The part of the instrument that meets it.
    pub by: Region,
}

/// What a wall belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Touched {
    Volume,
    /// Index into [`super::Matter::around`].
    Shape(usize),
}

/// Walls holding the tip, with the share of the push that each carries.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Held {
    members: [usize; 3],
    pushes: [f32; 3],
    count: usize,
}

impl Held {
    /// Wall indices and their pushes (mm of displacement along the wall's normal; all positive).
    pub fn iter(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        (0..self.count).map(|i| (self.members[i], self.pushes[i]))
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A wall counts as respected when violated by less than this, mm: a tenth of the finest encoder step we know.
const TOLERANCE: f32 = 1e-4;

/// Rounds of adding walls. A convex corner needs three; a bur in its own socket a few more.
const ROUNDS_MAX: usize = 12;

/// The point nearest to `goal` in front of all `planes`, and the walls that keep it there.
pub(super) fn nearest_allowed(planes: &[Plane], goal: Vec3) -> (Vec3, Held) {
    let mut held = Held::default();
    let mut at = goal;
    for _ in 0..ROUNDS_MAX {
        let Some(worst) = most_violated(planes, at) else { break };
        let Some(next) = hold(planes, goal, held, worst) else { break };
        held = next;
        at = goal + held.iter().map(|(i, push)| planes[i].normal * push).sum::<Vec3>();
    }
    (at, held)
}

fn most_violated(planes: &[Plane], at: Vec3) -> Option<usize> {
    let mut worst = None;
    let mut depth = TOLERANCE;
    for (index, plane) in planes.iter().enumerate() {
        let violation = plane.offset - plane.normal.dot(at);
        if violation > depth {
            (worst, depth) = (Some(index), violation);
        }
    }
    worst
}

/// Adds a wall to those held and lets go of walls that would have to pull.
///
/// Of all sets made of the new wall and up to two old ones, takes the feasible one that pushes farthest: the dual
/// objective grows in every round, so the search cannot run in circles.
fn hold(planes: &[Plane], goal: Vec3, held: Held, new: usize) -> Option<Held> {
    let old = held.members;
    let mut best: Option<(f32, Held)> = None;
    for keep in 0..1u32 << held.count {
        if keep.count_ones() > 2 {
            continue;
        }
        let mut trial = Held::default();
        for (bit, &member) in old[..held.count].iter().enumerate() {
            if keep >> bit & 1 == 1 {
                trial.members[trial.count] = member;
                trial.count += 1;
            }
        }
        trial.members[trial.count] = new;
        trial.count += 1;
        if !solve(planes, goal, &mut trial) {
            continue;
        }
        let displacement: Vec3 = trial.iter().map(|(i, push)| planes[i].normal * push).sum();
        let far = displacement.length_squared();
        if best.as_ref().is_none_or(|(b, _)| far > *b) {
            best = Some((far, trial));
        }
    }
    best.map(|(_, held)| held)
}

/// Pushes that put the point exactly on all walls of the set; `false` when a wall would pull or two are parallel.
fn solve(planes: &[Plane], goal: Vec3, held: &mut Held) -> bool {
    let n = |i: usize| planes[held.members[i]].normal;
    let lack = |i: usize| planes[held.members[i]].offset - n(i).dot(goal);
    /// Below this determinant of the Gram matrix walls are closer than about 2.5° to parallel: the newer one suffices.
    const INDEPENDENT: f32 = 2e-3;
    let pushes = match held.count {
        1 => [lack(0), 0.0, 0.0],
        2 => {
            let c = n(0).dot(n(1));
            let determinant = 1.0 - c * c;
            if determinant < INDEPENDENT {
                return false;
            }
            [(lack(0) - c * lack(1)) / determinant, (lack(1) - c * lack(0)) / determinant, 0.0]
        }
        _ => {
            let gram = glam::Mat3::from_cols(
                Vec3::new(1.0, n(0).dot(n(1)), n(0).dot(n(2))),
                Vec3::new(n(0).dot(n(1)), 1.0, n(1).dot(n(2))),
                Vec3::new(n(0).dot(n(2)), n(1).dot(n(2)), 1.0),
            );
            if gram.determinant() < INDEPENDENT * INDEPENDENT {
                return false;
            }
            (gram.inverse() * Vec3::new(lack(0), lack(1), lack(2))).to_array()
        }
    };
    held.pushes = pushes;
    pushes[..held.count].iter().all(|&p| p >= -1e-6 && p.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(normal: Vec3, offset: f32) -> Plane {
        Plane { normal: normal.normalize(), offset, at: Vec3::ZERO, touched: Touched::Volume, by: Region::Head }
    }

    fn check(planes: &[Plane], goal: Vec3, expected: Vec3) {
        let (at, _) = nearest_allowed(planes, goal);
        assert!(at.distance(expected) < 1e-3, "{at} instead of {expected}");
    }

    #[test]
    fn walls_edges_and_corners_hold() {
        let floor = wall(Vec3::Z, 0.0);
        let side = wall(Vec3::X, 1.0);
        let front = wall(Vec3::Y, 2.0);
        check(&[], Vec3::new(1.0, 2.0, -3.0), Vec3::new(1.0, 2.0, -3.0));
        check(&[floor], Vec3::new(1.0, 2.0, -3.0), Vec3::new(1.0, 2.0, 0.0));
        check(&[floor, side], Vec3::new(0.0, 2.0, -3.0), Vec3::new(1.0, 2.0, 0.0));
        check(&[floor, side, front], Vec3::new(0.0, 0.0, -3.0), Vec3::new(1.0, 2.0, 0.0));
        // A wall that the answer already respects pushes nothing.
        check(&[floor, side], Vec3::new(5.0, 2.0, -3.0), Vec3::new(5.0, 2.0, 0.0));
    }

    #[test]
    fn the_answer_is_the_nearest_point_of_random_polyhedra() {
        // Aim: agree with slow projection (Dykstra) on walls all facing the hand, as on a bumpy surface.
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        };
        for round in 0..300 {
            let count = 1 + round % 20;
            let planes: Vec<Plane> =
                (0..count).map(|_| wall(Vec3::new(random(), random(), 1.2 + random()), random() * 0.05)).collect();
            let goal = Vec3::new(random(), random(), random() - 1.0);
            let (at, _) = nearest_allowed(&planes, goal);
            let mut slow = goal;
            let mut corrections = vec![Vec3::ZERO; count];
            for _ in 0..20_000 {
                for (plane, correction) in planes.iter().zip(&mut corrections) {
                    let from = slow + *correction;
                    let push = (plane.offset - plane.normal.dot(from)).max(0.0);
                    slow = from + plane.normal * push;
                    *correction = from - slow;
                }
            }
            assert!(at.distance(slow) < 5e-3, "round {round}: {at} but {slow}, {count} walls");
        }
    }
}
