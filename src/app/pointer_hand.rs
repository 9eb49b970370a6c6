//! The hand of a trainee who works with a mouse, a pen or a finger: where it points, and how hard it presses.

use crate::lesson_scene::LessonScene;
use crate::snapshot::LessonSnapshot;
use typodont_core::frame::{Quat, Vec2, Vec3};
use typodont_devices::mouse::{HandTarget, LEAN_MAX, Mouse};
use typodont_exercise::catalog::{InstrumentEntry, WorkingEndEntry};
use typodont_render::{Eye, Orbit};
use typodont_scene::particles::CollisionWorld;
use typodont_scene::pointing::{HandAction, REST_FORCE, SurfaceSpot, hand_at_spot, spot_under_ray};

/// Range of the strength of a press, N: from a probe in a pocket to the maximum force of the device.
const STRENGTH_RANGE: [f32; 2] = [0.1, 3.3];

/// Change of the strength by one step of the wheel, N.
const STRENGTH_STEP: f32 = 0.1;

/// Strength of a bur at the start, N: it cuts caries; in exercises whose tissues have a cutting force, sound tissue only
/// after the dwell.
const BUR_STRENGTH: f32 = 1.2;

/// Strength of any other instrument at the start, N: that of probing (0.25 N, World Health Organization) for probes, and
/// of an explorer that feels for soft tissue.
const PROBE_STRENGTH: f32 = 0.25;
const EXPLORER_STRENGTH: f32 = 0.5;

/// Further withdrawal in each picture while the hand is inside matter without force, and the greatest, mm: a handpiece
/// is out of the deepest cavity in less than a second.
const WITHDRAWAL_STEP: f32 = 1.0;
const WITHDRAWAL_MAX: f32 = 15.0;

/// Point of the view under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointedPlace {
    /// Shares of the view's width and height, from its upper left corner.
    pub share: [f32; 2],
    /// Width of the view divided by its height.
    pub aspect: f32,
}

/// Kind of the pointer that a trainee works with, by which the hints speak of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointerKind {
    #[default]
    Mouse,
    Pen,
    Finger,
}

/// State of the pointer's hand.
#[derive(Clone, Debug)]
pub struct PointerHand {
    pub kind: PointerKind,
    pub is_pressing: bool,
    /// Share of the strength with which it presses, 0 to 1; less than 1 for a pen that is pressed lightly.
    pub pressure: f32,
    /// Lean of the handle: components of the unit vector from the tip toward the hand, to the right and toward the eye, along
    /// the ground.
    lean: [f32; 2],
    /// Direction of a pen whose tilt is known, which the handle follows: its components to the right and up, as one sees the
    /// view, of the unit vector from its tip; the third is toward the eye.
    pub pen: Option<[f32; 2]>,
    /// Surface under the pointer.
    pub spot: Option<SurfaceSpot>,
    /// Distance by which the hand is withdrawn along the handle to get clear of matter, mm.
    withdrawal: f32,
    /// Maximum forces of a press, N, that the trainee has chosen, by kind of instrument.
    strengths: Vec<(InstrumentKind, f32)>,
}

impl Default for PointerHand {
    fn default() -> PointerHand {
        PointerHand {
            kind: PointerKind::default(),
            is_pressing: false,
            pressure: 1.0,
            lean: [0.0; 2],
            pen: None,
            spot: None,
            withdrawal: 0.0,
            strengths: Vec::new(),
        }
    }
}

impl PointerHand {
    /// Maximum force of a press with an instrument, N.
    pub fn strength(&self, instrument: &InstrumentEntry) -> f32 {
        (self.exact_strength(instrument) * 10.0).round() / 10.0
    }

    /// Changes the strength of an instrument, and of all of its kind, by steps of the wheel; forward is stronger.
    pub fn change_strength(&mut self, steps: f32, instrument: &InstrumentEntry) {
        let [least, most] = STRENGTH_RANGE;
        // Not rounded: a touchpad sends small parts of a step.
        let strength = (self.exact_strength(instrument) + STRENGTH_STEP * steps).clamp(least, most);
        let kind = InstrumentKind::of(instrument);
        self.strengths.retain(|(known, _)| *known != kind);
        self.strengths.push((kind, strength));
    }

    /// Leans the handle further to the right and toward the eye, as shares of its length.
    pub fn lean(&mut self, right: f32, near: f32) {
        let lean = Vec2::from_array(self.lean) + Vec2::new(right, near);
        self.lean = lean.clamp_length_max(LEAN_MAX).to_array();
    }

    /// Holds the handle upright again.
    pub fn hold_upright(&mut self) {
        self.lean = [0.0; 2];
    }

    /// Lean of the handle in world space, as in [`HandTarget::lean`].
    fn world_lean(&self, eye: &Eye, azimuth: f32) -> [f32; 2] {
        let handle = match self.pen {
            Some([right, up]) => {
                let near = (1.0 - right * right - up * up).max(0.0).sqrt();
                let handle = eye.right * right + eye.up * up - eye.forward * near;
                // A pen that points upward in the mouth is held as flat as a handle may be.
                if handle.y < 0.0 { handle.with_y(0.0).normalize_or_zero() } else { handle }
            }
            None => Quat::from_rotation_y(azimuth) * Vec3::new(self.lean[0], 0.0, self.lean[1]),
        };
        Vec2::new(handle.x, handle.z).clamp_length_max(LEAN_MAX).to_array()
    }

    /// Angle between the handle and the vertical, rad, unless a pen gives it.
    pub fn tilt(&self) -> f32 {
        Vec2::from_array(self.lean).length().asin()
    }

    fn exact_strength(&self, instrument: &InstrumentEntry) -> f32 {
        let kind = InstrumentKind::of(instrument);
        self.strengths.iter().find(|(known, _)| *known == kind).map_or(kind.first_strength(), |(_, chosen)| *chosen)
    }

    /// Aims the hand at the surface under the pointer. `None`: the pointer is outside the view, and the hand stays where
    /// it is, without force. After a pause, a hand that is inside matter is withdrawn first: it would cut nothing there.
    pub fn point_at(
        &mut self,
        place: Option<PointedPlace>,
        mouse: &Mouse,
        orbit: &Orbit,
        scene: &LessonScene,
        snapshot: &LessonSnapshot,
        instrument: &InstrumentEntry,
    ) {
        let Some(place) = place else {
            self.spot = None;
            return mouse.release_at(snapshot.tip);
        };
        let eye = orbit.viewpoint().eye(place.aspect);
        let along = eye.ray(place.share[0], place.share[1]).normalize_or(eye.forward);
        let world = CollisionWorld {
            volume: &scene.volume,
            world_from_tooth: scene.workpiece.world_from_tooth,
            obstacles: &scene.workpiece.surroundings,
        };
        // An opposite jaw that is left out of the picture is not pointed at either.
        let hidden = scene.mouth.as_ref().and_then(|m| m.way_past_opposite(&orbit.viewpoint(), scene.mouth_opening));
        let from = hidden.map_or(eye.position, |(place, inward)| {
            let way = (place - eye.position).dot(inward) / along.dot(inward).max(1e-3);
            eye.position + along * way.max(0.0)
        });
        self.spot = spot_under_ray(&world, from, along);
        let is_overhead = |spot: SurfaceSpot| {
            let place = scene.workpiece.world_from_tooth.inverse() * spot.place;
            scene.workpiece.other_tooth_at(place).is_some_and(|tooth| scene.workpiece.is_overhead(tooth))
        };
        // The handle turns with the view, so that a handpiece leads to the operator's side.
        let yaw = orbit.azimuth;
        let lean = match self.spot {
            // A tooth overhead is reached from the open side of the mouth: an upright handle would be inside it.
            Some(spot) if self.pen.is_none() && is_overhead(spot) => {
                let out = eye.position - spot.place;
                (Vec2::new(out.x, out.z).normalize_or(Vec2::Y) * LEAN_MAX).to_array()
            }
            _ => self.world_lean(&eye, yaw),
        };
        let held = HandTarget { place: Vec3::ZERO, max_force: REST_FORCE, yaw, lean };
        let (place, max_force) = match self.spot {
            Some(spot) => {
                let action = match self.is_pressing {
                    true => HandAction::Press { max_force: self.pressure * self.strength(instrument) },
                    false => HandAction::Rest,
                };
                let hand = hand_at_spot(&spot, snapshot.tip, instrument, held.orientation(), action);
                (hand.place, hand.max_force)
            }
            None => (beside_the_tooth(&eye, along, snapshot.tip), REST_FORCE),
        };
        self.withdrawal = match snapshot.is_hand_blocked {
            true => (self.withdrawal + WITHDRAWAL_STEP).min(WITHDRAWAL_MAX),
            false => 0.0,
        };
        let place = place + held.orientation() * Vec3::Z * self.withdrawal;
        mouse.aim(HandTarget { place, max_force, ..held });
    }
}

/// Instruments that are pressed alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstrumentKind {
    Bur,
    Blade,
    Probe,
    Explorer,
    Other,
}

impl InstrumentKind {
    fn of(instrument: &InstrumentEntry) -> InstrumentKind {
        match &instrument.end {
            _ if instrument.is_bur() => InstrumentKind::Bur,
            _ if instrument.cuts => InstrumentKind::Blade,
            WorkingEndEntry::Probe(_) => InstrumentKind::Probe,
            WorkingEndEntry::Point | WorkingEndEntry::Bent(_) => InstrumentKind::Explorer,
            _ => InstrumentKind::Other,
        }
    }

    /// Strength at the start, N.
    fn first_strength(self) -> f32 {
        match self {
            InstrumentKind::Bur | InstrumentKind::Blade | InstrumentKind::Other => BUR_STRENGTH,
            InstrumentKind::Probe => PROBE_STRENGTH,
            InstrumentKind::Explorer => EXPLORER_STRENGTH,
        }
    }
}

/// Point on a ray beside everything, as far away as the working end.
fn beside_the_tooth(eye: &Eye, along: Vec3, tip: Vec3) -> Vec3 {
    /// mm; a hand behind the eye would be of no use.
    const NEAREST: f32 = 5.0;
    let depth = (tip - eye.position).dot(eye.forward).max(NEAREST);
    eye.position + along * (depth / along.dot(eye.forward).max(1e-3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use typodont_core::device::{Device, Wrench};
    use typodont_core::sim::{Command, Simulation};
    use typodont_exercise::scenario::{self, ResolveMode, Workpiece};
    use typodont_exercise::session;
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    #[test]
    fn a_hand_inside_the_tooth_is_withdrawn_and_then_presses_again() {
        // Aim: after a pause the pointer is somewhere else, and its hand may be inside the tooth, where it has no force and cuts
        // nothing; a newcomer once pressed there in vain. Method: a bur that begins deep in the tooth, pictures of 16 ticks.
        let text =
            include_str!("../../scenarios/5-grinding.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
        let library = Library::shipped();
        let source = SourceText::new("coarse.json", text);
        let scenario = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
        let workpiece = Arc::new(Workpiece::make(&scenario, 1).unwrap());
        let (scene, _) = LessonScene::build(&scenario, &library, workpiece.clone(), true);
        let (mouse, mut device) = Mouse::new();
        let mut simulation = Simulation::new(session::setup(&scenario, &workpiece, device.spec().clone()));
        let bur = scenario.instruments.iter().position(|instrument| instrument.is_bur()).unwrap();
        simulation.apply(&Command::SelectInstrument { instrument: bur });
        mouse.aim(HandTarget { place: Vec3::new(0.0, -6.0, 0.0), max_force: 1.0, yaw: 0.0, lean: [0.0; 2] });
        for _ in 0..300 {
            device.exchange(&Wrench::ZERO).unwrap();
        }

        let mut hand = PointerHand { is_pressing: true, ..PointerHand::default() };
        let orbit = Orbit { elevation: 1.2, ..Orbit::around(Vec3::ZERO, 10.0) };
        let middle = Some(PointedPlace { share: [0.5; 2], aspect: 1.0 });
        let (mut blocked, mut wrench, mut greatest) = (Vec::new(), Wrench::ZERO, 0.0f32);
        for _ in 0..120 {
            let mut seen = None;
            for _ in 0..16 {
                let step = simulation.step(&device.exchange(&wrench).unwrap());
                (wrench, seen) = (step.wrench(), Some(step));
            }
            let snapshot = LessonSnapshot::new(&seen.unwrap(), Quat::IDENTITY, 0.0, None, None);
            blocked.push(snapshot.is_hand_blocked);
            greatest = greatest.max(snapshot.spring);
            hand.point_at(middle, &mouse, &orbit, &scene, &snapshot, &scenario.instruments[bur]);
        }
        let pictures = blocked.iter().filter(|is_blocked| **is_blocked).count();
        assert!(blocked[0] && (2..40).contains(&pictures), "blocked in {pictures} pictures");
        assert!(!blocked[pictures..].contains(&true), "it stays free: {blocked:?}");
        assert!(greatest > 0.8, "{greatest} N");
    }
}
