//! Drops of water on a mouth mirror: where spray meets its face they form and join; large ones run down, and air blows them off.

use super::{STEP, WATER_OFFSET};
use typodont_core::frame::{Pose, Vec3};
use typodont_render::{Appearance, Particle, PlaneMirror};

/// Drops on one mirror, at most; more spray joins the nearest.
pub const MAX_DROPS: usize = 60;

/// The cube of a drop's radius is this times its volume, as of one that meets the rhodium at 55° (an estimate).
const SPREAD_FACTOR: f32 = 1.1;

/// Most water in one drop, mm³; more runs off the face.
const MAX_VOLUME: f32 = 12.0;

/// Volume from which a drop runs down an upright mirror, mm³, and its speed, mm/s.
const RUNNING_VOLUME: f32 = 2.0;
const RUNNING_SPEED: f32 = 20.0;

/// Air speed from which it drives drops, mm/s, as from a syringe within a centimetre; the share of that along the face that they take on,
/// and their greatest speed, mm/s.
const DRIVING_AIR: f32 = 9000.0;
const DRIVEN_SHARE: f32 = 0.02;
const GREATEST_SPEED: f32 = 120.0;

const CLEAR: Appearance = Appearance { colour: [0.78, 0.86, 0.92], gloss: 0.7 };
const OPACITY: f32 = 0.25;

/// The drops of the mirror in use.
pub struct MirrorDrops {
    /// World space, mm; `None` while no mirror is in use.
    mirror: Option<PlaneMirror>,
    drops: Vec<MirrorDrop>,
}

#[derive(Clone, Copy)]
struct MirrorDrop {
    /// On the face, in the mirror's own space, mm.
    place: Vec3,
    /// mm³
    volume: f32,
    is_moving: bool,
    /// True if it has got water since the last step.
    has_grown: bool,
}

impl MirrorDrop {
    fn radius(&self) -> f32 {
        libm::cbrtf(SPREAD_FACTOR * self.volume)
    }
}

impl MirrorDrops {
    pub fn new() -> MirrorDrops {
        MirrorDrops { mirror: None, drops: Vec::with_capacity(MAX_DROPS) }
    }

    /// Holds a mirror in its new pose. It is dry if something else was held before.
    pub fn hold(&mut self, mirror: Option<PlaneMirror>) {
        self.mirror = mirror;
        if mirror.is_none() {
            self.drops.clear();
        }
    }

    /// Catches water, mm³, that flies from a place to another, if it meets the face in between.
    pub fn catch(&mut self, from: Vec3, to: Vec3, volume: f32) -> bool {
        let Some(mirror) = self.mirror else { return false };
        let own_from_world = mirror.world_from_mirror.inverse();
        let [from, to] = [from, to].map(|place| own_from_world * place);
        if from.z <= 0.0 || to.z > 0.0 {
            return false;
        }
        let place = from.lerp(to, from.z / (from.z - to.z)).with_z(0.0);
        if place.length_squared() > mirror.radius * mirror.radius {
            return false;
        }
        let new = MirrorDrop { place, volume, is_moving: false, has_grown: true };
        let distance = |drop: &MirrorDrop| drop.place.distance(place) - drop.radius();
        let is_full = self.drops.len() == MAX_DROPS;
        let nearest = self.drops.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        match nearest.filter(|drop| is_full || distance(drop) < new.radius()) {
            Some(drop) => (drop.volume, drop.has_grown) = ((drop.volume + volume).min(MAX_VOLUME), true),
            None => self.drops.push(new),
        }
        true
    }

    /// One step. `air`: its velocity at a place, world space, mm/s; `is_drawn`: whether suction takes what is there.
    pub fn step(&mut self, air: impl Fn(Vec3) -> Vec3, is_drawn: impl Fn(Vec3) -> bool) {
        let Some(PlaneMirror { world_from_mirror, radius, .. }) = self.mirror else { return };
        let own_from_world = world_from_mirror.inverse();
        let downhill = own_from_world.rotate(Vec3::NEG_Y).with_z(0.0);
        self.drops.retain_mut(|drop| {
            let place = world_from_mirror * drop.place;
            let wind = own_from_world.rotate(air(place));
            let velocity = if wind.length() > DRIVING_AIR {
                (wind.with_z(0.0) * DRIVEN_SHARE).clamp_length_max(GREATEST_SPEED)
            } else if drop.volume * downhill.length() > RUNNING_VOLUME {
                downhill * RUNNING_SPEED
            } else {
                Vec3::ZERO
            };
            drop.is_moving = velocity != Vec3::ZERO;
            drop.place += velocity * STEP;
            drop.place.length_squared() <= radius * radius && !is_drawn(place)
        });
        self.join();
    }

    /// Drops that move or have grown take up those that they touch.
    fn join(&mut self) {
        let mut at = 0;
        while at < self.drops.len() {
            let MirrorDrop { place, is_moving, has_grown, .. } = self.drops[at];
            let radius = self.drops[at].radius();
            let touched = |other: usize| other != at && self.drops[other].place.distance(place) < radius;
            match (0..self.drops.len()).find(|&other| (is_moving || has_grown) && touched(other)) {
                Some(other) => {
                    self.drops[at].volume = (self.drops[at].volume + self.drops[other].volume).min(MAX_VOLUME);
                    self.drops.swap_remove(other);
                    at = 0;
                }
                None => {
                    self.drops[at].has_grown = false;
                    at += 1;
                }
            }
        }
    }

    pub fn particles(&self) -> impl Iterator<Item = Particle> + '_ {
        let pose = self.mirror.map_or(Pose::IDENTITY, |mirror| mirror.world_from_mirror);
        let facing = pose.rotate(Vec3::Z);
        self.drops.iter().map(move |drop| Particle {
            position: pose * drop.place + facing * WATER_OFFSET,
            radius: drop.radius(),
            facing: Some(facing),
            appearance: CLEAR,
            opacity: OPACITY,
        })
    }

    pub fn moving_count(&self) -> usize {
        self.drops.iter().filter(|drop| drop.is_moving).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Quat;

    /// A mirror whose face looks toward +z, upright, or up.
    fn mirror(is_upright: bool) -> PlaneMirror {
        let turn = if is_upright { 0.0 } else { -std::f32::consts::FRAC_PI_2 };
        let world_from_mirror = Pose { position: Vec3::new(5.0, -3.0, 2.0), orientation: Quat::from_rotation_x(turn) };
        PlaneMirror { world_from_mirror, radius: 10.0, reflectance: 0.8 }
    }

    /// Sprays a mirror with drops of 0.02 mm³ all over.
    fn sprayed(mirror: PlaneMirror) -> MirrorDrops {
        let mut drops = MirrorDrops::new();
        drops.hold(Some(mirror));
        for n in 0..200 {
            let turn = 2.4 * n as f32;
            let aside = Vec3::new(libm::cosf(turn), libm::sinf(turn), 0.0) * 0.65 * (n as f32).sqrt();
            let [from, to] = [1.0, -1.0].map(|z| mirror.world_from_mirror * aside.with_z(z));
            assert!(drops.catch(from, to, 0.02));
        }
        drops
    }

    fn volume(drops: &MirrorDrops) -> f32 {
        drops.drops.iter().map(|drop| drop.volume).sum()
    }

    #[test]
    fn spray_meets_the_face_only_and_lies_on_it() {
        // Aim: drops are where the face is hit, from in front. Method: ways past it, from behind and short of it, and a level mirror
        // on which all that was caught stays.
        let held = mirror(false);
        let mut drops = sprayed(held);
        let pose = held.world_from_mirror;
        for [from, to] in [
            [[11.0, 0.0, 1.0], [11.0, 0.0, -1.0]],
            [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]],
            [[0.0, 0.0, 2.0], [0.0, 0.0, 1.0]],
        ] {
            assert!(!drops.catch(pose * Vec3::from(from), pose * Vec3::from(to), 1.0));
        }
        let before = volume(&drops);
        (0..500).for_each(|_| drops.step(|_| Vec3::ZERO, |_| false));
        assert!(drops.drops.len() > 20 && drops.moving_count() == 0);
        assert_eq!(volume(&drops), before);
        for particle in drops.particles() {
            let own = pose.inverse() * particle.position;
            assert!(own.z > 0.0 && own.z < 0.1 && own.truncate().length() <= 10.0, "{own}");
        }
        drops.hold(None);
        assert_eq!(drops.particles().count(), 0, "a mirror that is taken up again is dry");
    }

    #[test]
    fn large_drops_run_down_and_take_others_along() {
        let held = mirror(true);
        let mut drops = sprayed(held);
        let [from, to] = [1.0, -1.0].map(|z| held.world_from_mirror * Vec3::new(0.0, 5.0, z));
        assert!(drops.catch(from, to, 3.0));
        let (count, before) = (drops.drops.len(), volume(&drops));
        drops.step(|_| Vec3::ZERO, |_| false);
        assert_eq!(drops.moving_count(), 1, "only the large one");
        (0..400).for_each(|_| drops.step(|_| Vec3::ZERO, |_| false));
        assert_eq!(drops.moving_count(), 0, "it is gone");
        assert!(drops.drops.len() < count && volume(&drops) < before - 3.0, "with those on its way");
        assert!(drops.drops.len() * 2 > count, "the others stay");
    }

    #[test]
    fn air_drives_drops_off_and_a_breath_does_not() {
        let mut drops = sprayed(mirror(false));
        let count = drops.drops.len();
        (0..500).for_each(|_| drops.step(|_| Vec3::X * 500.0, |_| false));
        assert_eq!(drops.drops.len(), count);
        (0..500).for_each(|_| drops.step(|_| Vec3::new(12_000.0, -30_000.0, 0.0), |_| false));
        assert!(drops.drops.is_empty(), "{} are left", drops.drops.len());
    }
}
