//! Where the shell of an instrument comes near matter, and which way out is.
//!
//! Takes matter, a working end of any shape and how it is held. Gives walls for its origin to stay in front of. A wall
//! stands where the end and matter would truly meet, between the shell's points, so that no force steps when one point
//! takes over from the next. After McNeely et al. (1999), with walls instead of springs.

use super::body::{Body, Node};
use super::matter::Matter;
use super::planes::{Plane, Touched};
use super::walls::Look;
use crate::frame::{Quat, Vec3};
use crate::volume::{ISO, Volume};

/// Distance below which a point may be what holds the tip, mm: it is looked at closely.
const CLOSE: f32 = 0.018;

/// Closer to opposite than this (1 − cos 0.7°) the end's and matter's normals are the same: what a voxel surface resolves.
const GRAIN: f32 = 7.5e-5;

/// What surely stays this far from matter in one tick's last moves is not looked at more closely, mm.
const APART: f32 = 0.004;

/// Looks along the surface for the true place of contact. Three find it on every phantom; a fourth changes nothing felt.
const LOOKS: usize = 3;

/// Directions tried one after the other: where the end is curved one way and matter the other, the deepest place lies off
/// the first.
const TURNS: usize = 2;

/// Points that follow each other in a shell lie near each other: while all of so many rest, one question passes them.
const COMPANY: usize = 16;

/// Which points need no look yet: matter is too far from them for what the instrument has moved since.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    /// Of each point, the way at which it may meet matter again, mm.
    wake: Vec<f64>,
    /// Of each [`COMPANY`] of points, the least of their ways.
    wake_first: Vec<f64>,
    /// Farthest that any point can have moved since the watch began, mm.
    way: f64,
    seen_from: Option<Vec3>,
}

impl Watch {
    pub fn with_capacity(points: usize) -> Watch {
        Watch {
            wake: Vec::with_capacity(points),
            wake_first: Vec::with_capacity(points.div_ceil(COMPANY)),
            way: 0.0,
            seen_from: None,
        }
    }

    /// True while it is a shell that is followed.
    pub fn is_looking(&self) -> bool {
        self.seen_from.is_some()
    }

    /// The instrument is another or was put elsewhere: all points are looked at again.
    pub fn forget(&mut self) {
        self.seen_from = None;
    }

    /// The instrument has turned: no point has swung farther than this, mm.
    pub fn swing(&mut self, most: f32) {
        self.way += f64::from(most);
    }

    fn arrive(&mut self, points: usize, tip: Vec3) {
        match self.seen_from {
            Some(from) => self.way += f64::from(from.distance(tip)),
            None => {
                self.wake.clear();
                self.wake.resize(points, 0.0);
                self.wake_first.clear();
                self.wake_first.resize(points.div_ceil(COMPANY), 0.0);
                self.way = 0.0;
            }
        }
        self.seen_from = Some(tip);
    }
}

/// A working end of any shape and how it is held.
#[derive(Clone, Copy)]
pub(super) struct Held<'a> {
    pub body: &'a Body,
    pub tooth_from_handle: Quat,
    pub cuts: bool,
}

/// Collects a wall for every point that matter is in reach of, and for every shape in reach of a point.
pub(super) fn find(planes: &mut Vec<Plane>, watch: &mut Watch, matter: &Matter, held: Held, look: Look) {
    planes.clear();
    let Look { tip, goal, reach } = look;
    let volume = &matter.volume;
    let band = volume.band();
    let slack = slack(volume, held);
    let way = (goal - tip).normalize_or_zero();
    let seen_from = ISO - 0.5 * (reach + slack) / band;
    let turn = glam::Mat3::from_quat(held.tooth_from_handle);
    let mut wall = |node: &Node, density: f32| {
        let distance = (ISO - density) * 2.0 * band;
        let outward = turn * node.outward;
        // What lies behind a part that moves away matters only where the end has turned into it.
        if density < seen_from || distance > 0.0 && outward.dot(way) < -0.1 {
            return;
        }
        let seen = match distance > CLOSE + slack {
            true => Sight { at: node.at, normal: -outward, distance },
            false => settled(volume, &Stand { tip, turn, held }, node),
        };
        planes.push(Plane {
            normal: seen.normal,
            offset: seen.normal.dot(tip) - seen.distance - slack,
            at: tip + turn * seen.at - seen.normal * seen.distance,
            touched: Touched::Volume,
            by: node.region,
        });
    };
    watch.arrive(held.body.shell().len(), tip);
    let grid = volume.grid();
    let (tip_in_grid, to_grid) = (grid.from_tooth(tip), glam::Mat3::from_diagonal(grid.spacing.recip()) * turn);
    let companies = held.body.shell().chunks(COMPANY).zip(watch.wake.chunks_mut(COMPANY));
    for ((nodes, wakes), first) in companies.zip(&mut watch.wake_first) {
        if *first > watch.way {
            continue;
        }
        for (node, wake) in nodes.iter().zip(wakes.iter_mut()) {
            if *wake > watch.way {
                continue;
            }
            let density = volume.density_in_grid(tip_in_grid + to_grid * node.at);
            if density > 0.0 {
                wall(node, density);
                continue;
            }
            // What is cut away only makes room: this stays true.
            let clear = matter.clear_of_volume(tip + turn * node.at).max(band);
            *wake = watch.way + f64::from(clear - reach);
        }
        *first = wakes.iter().copied().fold(f64::INFINITY, f64::min);
    }
    find_shapes(planes, matter, held, look);
}

/// Between voxel centres a hollow reads narrower than it is; see [`super::walls`].
fn slack(volume: &Volume, held: Held) -> f32 {
    let radius = held.body.head_radius();
    let spacing = volume.grid().spacing.max_element();
    if held.cuts && radius > 0.0 { spacing * spacing / (4.0 * radius) } else { 0.0 }
}

fn find_shapes(planes: &mut Vec<Plane>, matter: &Matter, held: Held, look: Look) {
    let Look { tip, reach, .. } = look;
    let (middle, radius) = held.body.enclosing_ball();
    for (index, shape) in matter.around.iter().enumerate() {
        if shape.distance(tip + held.tooth_from_handle * middle) > radius + reach {
            continue;
        }
        for node in held.body.shell() {
            let place = tip + held.tooth_from_handle * node.at;
            if shape.distance(place) < reach && planes.len() < planes.capacity() {
                let (distance, normal) = shape.distance_and_normal(place);
                planes.push(Plane {
                    normal,
                    offset: normal.dot(tip) - distance,
                    at: place - normal * distance,
                    touched: Touched::Shape(index),
                    by: node.region,
                });
            }
        }
    }
}

/// Where the instrument is.
struct Stand<'a> {
    tip: Vec3,
    turn: glam::Mat3,
    held: Held<'a>,
}

/// What a place of the instrument's surface sees of matter.
#[derive(Clone, Copy)]
struct Sight {
    /// Handle space.
    at: Vec3,
    /// Unit, out of matter, tooth space.
    normal: Vec3,
    /// mm; negative when it has entered.
    distance: f32,
}

/// A look at matter from a place of the surface, in handle space.
#[derive(Clone, Copy)]
struct Glance {
    at: Vec3,
    /// Unit, out of the instrument.
    outward: Vec3,
    /// Unit, out of matter.
    normal: Vec3,
    distance: f32,
}

impl Glance {
    fn from(volume: &Volume, stand: &Stand, at: Vec3, outward: Vec3) -> Glance {
        let band = volume.band();
        let (density, gradient) = volume.density_and_gradient_at(stand.tip + stand.turn * at);
        // Deep inside or on noise there is no slope to go by: back out toward the instrument's inside.
        let normal = match gradient.length() * band > 0.05 {
            true => stand.turn.transpose() * -gradient.normalize_or_zero(),
            false => -outward,
        };
        Glance { at, outward, normal, distance: (ISO - density) * 2.0 * band }
    }

    /// How fast matter gets nearer along a direction on the surface.
    fn slope(&self, along: Vec3) -> f32 {
        -self.normal.dot(along)
    }

    fn is_opposite(&self) -> bool {
        1.0 + self.normal.dot(self.outward) < GRAIN
    }
}

/// Looks along the surface around a point for the place where the end is deepest in matter: where the normals of both are
/// opposite, or where the point's part of the surface ends.
fn settled(volume: &Volume, stand: &Stand, node: &Node) -> Sight {
    let mut found = Glance::from(volume, stand, node.at, node.outward);
    let mut normal = -found.outward;
    for _ in 0..TURNS {
        let downhill = found.outward * found.normal.dot(found.outward) - found.normal;
        let along = downhill.normalize_or_zero();
        // Or even at its deepest, a patch's width farther on, it would not touch.
        let is_clear = found.distance > found.slope(along) * reach_along(node, along) + APART;
        if is_clear || found.is_opposite() || along == Vec3::ZERO {
            break;
        }
        let is_beyond;
        (found, normal, is_beyond) = deepest_along(volume, stand, node, &found, along);
        if is_beyond {
            break;
        }
    }
    Sight { at: found.at, normal: stand.turn * normal, distance: found.distance }
}

/// The deepest place along one direction, the normal of the contact there, and whether it gets deeper still beyond the
/// point's part of the surface: then the next point will tell.
fn deepest_along(volume: &Volume, stand: &Stand, node: &Node, first: &Glance, along: Vec3) -> (Glance, Vec3, bool) {
    let reach = reach_along(node, along);
    let glance_at = |share: f32| {
        let (at, outward) = stand.held.body.on_surface(first.at + along * (reach * share), node.region);
        Glance::from(volume, stand, at, outward)
    };
    // False position between a place where it still gets deeper and one where it does so no more.
    let (mut low, mut low_slope) = (0.0, first.slope(along));
    let (mut high, mut found) = (1.0, glance_at(1.0));
    let mut high_slope = found.slope_beyond(along);
    let last = found;
    for _ in 1..LOOKS {
        if high_slope >= 0.0 || found.is_opposite() {
            break;
        }
        let share = low + (high - low) * low_slope / (low_slope - high_slope);
        found = glance_at(share);
        let slope = found.slope_beyond(along);
        if slope > 0.0 {
            (low, low_slope) = (share, slope);
        } else {
            (high, high_slope) = (share, slope);
        }
    }
    // Of two bodies that touch, the one that is flatter there tells the normal better.
    let bent = (last.outward - first.outward).length();
    let turned = (last.normal - first.normal).length();
    let normal = (found.normal * bent - found.outward * turned).try_normalize().unwrap_or(-found.outward);
    (found, normal, last.slope_beyond(along) >= 0.0)
}

impl Glance {
    /// The slope along what a direction has become on the surface here.
    fn slope_beyond(&self, along: Vec3) -> f32 {
        self.slope((along - self.outward * along.dot(self.outward)).normalize_or_zero())
    }
}

/// How far a point's part of the surface goes in a direction.
fn reach_along(node: &Node, along: Vec3) -> f32 {
    let lengthwise = along.dot(node.along);
    let across = (1.0 - lengthwise * lengthwise).max(0.0).sqrt();
    1.0 / ((lengthwise / node.half[0]).powi(2) + (across / node.half[1]).powi(2)).sqrt()
}
