//! Projection of the hand position onto the region allowed by a set of contact constraints.
//!
//! A small quadratic programme: minimise |x − goal|² subject to n·x ≥ d for every constraint. Solved by a dual
//! active-set method with at most three active constraints (in three dimensions a fourth adds nothing), after
//! Goldfarb & Idnani (1983).

use super::body::BodyRegion;
use crate::frame::Vec3;

/// Half-space to which a contact confines the tip's centre: `normal · x >= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Constraint {
    /// Unit normal, out of the matter.
    pub normal: Vec3,
    pub offset: f32,
    /// Contact point on the surface, tooth space.
    pub point: Vec3,
    pub source: ConstraintSource,
    /// Region of the instrument that makes the contact.
    pub region: BodyRegion,
}

/// Origin of a constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ConstraintSource {
    Volume,
    /// Index into [`super::CollisionScene::colliders`].
    Collider(usize),
}

/// Active constraints and their multipliers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ActiveSet {
    members: [usize; 3],
    pushes: [f32; 3],
    count: usize,
}

impl ActiveSet {
    /// Indices of the active constraints and their multipliers (displacement along the normal, mm; all positive).
    pub fn iter(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        (0..self.count).map(|i| (self.members[i], self.pushes[i]))
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// Violation below which a constraint counts as satisfied, mm: a tenth of the finest encoder step of the known
/// devices.
const TOLERANCE: f32 = 1e-4;

/// Maximum number of iterations, each of which adds a constraint. A convex corner needs three; a bur in the socket
/// that it has cut needs a few more.
const ROUNDS_MAX: usize = 12;

/// Returns the point nearest to `goal` that satisfies all constraints, and the constraints active there.
pub(super) fn project_to_feasible(constraints: &[Constraint], goal: Vec3) -> (Vec3, ActiveSet) {
    let mut active = ActiveSet::default();
    let mut at = goal;
    for _ in 0..ROUNDS_MAX {
        let Some(worst) = most_violated(constraints, at) else { break };
        let Some(next) = add_constraint(constraints, goal, active, worst) else { break };
        active = next;
        at = goal + active.iter().map(|(i, push)| constraints[i].normal * push).sum::<Vec3>();
    }
    (at, active)
}

fn most_violated(constraints: &[Constraint], at: Vec3) -> Option<usize> {
    let mut worst = None;
    let mut depth = TOLERANCE;
    for (index, plane) in constraints.iter().enumerate() {
        let violation = plane.offset - plane.normal.dot(at);
        if violation > depth {
            (worst, depth) = (Some(index), violation);
        }
    }
    worst
}

/// Adds a constraint to the active set and drops constraints whose multiplier would be negative.
///
/// Of all sets made of the new constraint and up to two old ones, takes the feasible one with the largest
/// displacement: the dual objective grows in every iteration, so the search cannot cycle.
fn add_constraint(constraints: &[Constraint], goal: Vec3, active: ActiveSet, new: usize) -> Option<ActiveSet> {
    let old = active.members;
    let mut best: Option<(f32, ActiveSet)> = None;
    for keep in 0..1u32 << active.count {
        if keep.count_ones() > 2 {
            continue;
        }
        let mut trial = ActiveSet::default();
        for (bit, &member) in old[..active.count].iter().enumerate() {
            if keep >> bit & 1 == 1 {
                trial.members[trial.count] = member;
                trial.count += 1;
            }
        }
        trial.members[trial.count] = new;
        trial.count += 1;
        if !solve(constraints, goal, &mut trial) {
            continue;
        }
        let displacement: Vec3 = trial.iter().map(|(i, push)| constraints[i].normal * push).sum();
        let far = displacement.length_squared();
        if best.as_ref().is_none_or(|(b, _)| far > *b) {
            best = Some((far, trial));
        }
    }
    best.map(|(_, held)| held)
}

/// Computes the multipliers that put the point exactly on all constraints of the set; returns `false` if a multiplier
/// is negative or two constraints are parallel.
fn solve(constraints: &[Constraint], goal: Vec3, active: &mut ActiveSet) -> bool {
    let n = |i: usize| constraints[active.members[i]].normal;
    let violation = |i: usize| constraints[active.members[i]].offset - n(i).dot(goal);
    /// Determinant of the Gram matrix below which constraints are within about 2.5° of parallel: the newer one
    /// suffices.
    const MIN_GRAM_DETERMINANT: f32 = 2e-3;
    let pushes = match active.count {
        1 => [violation(0), 0.0, 0.0],
        2 => {
            let c = n(0).dot(n(1));
            let determinant = 1.0 - c * c;
            if determinant < MIN_GRAM_DETERMINANT {
                return false;
            }
            [(violation(0) - c * violation(1)) / determinant, (violation(1) - c * violation(0)) / determinant, 0.0]
        }
        _ => {
            let gram = glam::Mat3::from_cols(
                Vec3::new(1.0, n(0).dot(n(1)), n(0).dot(n(2))),
                Vec3::new(n(0).dot(n(1)), 1.0, n(1).dot(n(2))),
                Vec3::new(n(0).dot(n(2)), n(1).dot(n(2)), 1.0),
            );
            if gram.determinant() < MIN_GRAM_DETERMINANT * MIN_GRAM_DETERMINANT {
                return false;
            }
            (gram.inverse() * Vec3::new(violation(0), violation(1), violation(2))).to_array()
        }
    };
    active.pushes = pushes;
    pushes[..active.count].iter().all(|&p| p >= -1e-6 && p.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(normal: Vec3, offset: f32) -> Constraint {
        Constraint {
            normal: normal.normalize(),
            offset,
            point: Vec3::ZERO,
            source: ConstraintSource::Volume,
            region: BodyRegion::Head,
        }
    }

    fn check(planes: &[Constraint], goal: Vec3, expected: Vec3) {
        let (at, _) = project_to_feasible(planes, goal);
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
        // A constraint that the answer already satisfies has no effect.
        check(&[floor, side], Vec3::new(5.0, 2.0, -3.0), Vec3::new(5.0, 2.0, 0.0));
    }

    #[test]
    fn the_answer_is_the_nearest_point_of_random_polyhedra() {
        // Aim: agree with slow alternating projection (Dykstra) on constraints that all face the hand, as on a bumpy
        // surface.
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        };
        for round in 0..300 {
            let count = 1 + round % 20;
            let planes: Vec<Constraint> =
                (0..count).map(|_| wall(Vec3::new(random(), random(), 1.2 + random()), random() * 0.05)).collect();
            let goal = Vec3::new(random(), random(), random() - 1.0);
            let (at, _) = project_to_feasible(&planes, goal);
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
            assert!(at.distance(slow) < 5e-3, "round {round}: {at} but {slow}, {count} constraints");
        }
    }
}
