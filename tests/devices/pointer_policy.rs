//! A trainee with nothing but a pointer: sees the picture, points at the brown tissue and presses.

use crate::support::bundle::*;
use crate::support::folder::folder;
use std::path::Path;
use std::sync::Arc;
use typodont_core::device::{Device, DeviceError, DeviceSpec, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::sim::{Simulation, Step};
use typodont_core::volume::{Edit, Volume};
use typodont_devices::mouse::{HandTarget, Mouse, MouseDevice};
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::record::{Recorder, RecordingEndFile, RecordingHeadFile, ServoStatsFile};
use typodont_exercise::scenario::{self, ResolveMode, Scenario, Workpiece};
use typodont_exercise::session::{Input, Session, Trainee};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_render::{Eye, Orbit};
use typodont_scene::particles::CollisionWorld;
use typodont_scene::pointing::{HandAction, hand_at_spot, spot_under_ray};
use typodont_scene::{ToothSide, tooth_view, work_view};

/// Ticks between two pictures: 30 a second.
const PICTURE: u64 = 33;

/// Ticks between two looks at the whole picture.
const LOOK: u64 = 330;

/// Rays along each side of the picture that the policy looks at.
const RAYS: usize = 64;

/// Ticks after which the policy tries another place, if this one stays brown.
const HOLD: u64 = 1500;

/// Distance from a place that stayed brown within which nothing is tried again in this view, rays.
const AWAY: f32 = 2.5;

/// Force that the policy presses with, N: that of the window's default.
const STRENGTH: f32 = 1.2;

/// Sees the picture from several sides, moves to the brownest place, and holds the button until it is no longer brown.
struct PointerPolicy {
    mouse: Mouse,
    device: MouseDevice,
    scenario: Arc<Scenario>,
    workpiece: Arc<Workpiece>,
    /// The tooth as the picture shows it.
    volume: Volume,
    views: Vec<Orbit>,
    view: usize,
    /// Share of the picture, right and down.
    pointer: [f32; 2],
    is_pressing: bool,
    tick: u64,
    next_look: u64,
    pressed_since: u64,
    /// Places of this view that stayed brown.
    stuck: Vec<[f32; 2]>,
    /// Voxels removed so far, and when the first view was last begun.
    removed: usize,
    removed_before: usize,
    is_done: bool,
}

impl PointerPolicy {
    fn new(scenario: Arc<Scenario>, workpiece: Arc<Workpiece>) -> PointerPolicy {
        let (mouse, device) = Mouse::new();
        let views = vec![
            work_view(&workpiece),
            tooth_view(&workpiece, ToothSide::Occlusal),
            work_view(&workpiece).rotated(1.2, 0.3),
            work_view(&workpiece).rotated(-1.2, 0.3),
            work_view(&workpiece).rotated(2.6, 0.3),
        ];
        let volume = Volume::clone(&workpiece.volume);
        PointerPolicy {
            mouse,
            device,
            scenario,
            workpiece,
            volume,
            views,
            view: 0,
            pointer: [0.5; 2],
            is_pressing: false,
            tick: 0,
            next_look: 0,
            pressed_since: 0,
            stuck: Vec::new(),
            removed: 0,
            removed_before: 0,
            is_done: false,
        }
    }

    fn eye(&self) -> Eye {
        self.views[self.view].viewpoint().eye(1.0)
    }

    fn world(&self) -> CollisionWorld<'_> {
        CollisionWorld {
            volume: &self.volume,
            world_from_tooth: self.workpiece.world_from_tooth,
            obstacles: &self.workpiece.surroundings,
        }
    }

    /// True if the picture is brown at a place.
    fn is_brown(&self, eye: &Eye, [x, y]: [f32; 2]) -> bool {
        let along = eye.ray(x, y).normalize();
        let tooth_from_world = self.workpiece.world_from_tooth.inverse();
        let (from, along) = (tooth_from_world * eye.position, tooth_from_world.rotate(along));
        let Some((place, _)) = self.volume.raycast(from, along) else { return false };
        let grid = self.volume.grid();
        // The surface has the colour of the first voxel behind it.
        let Some(voxel) = grid.nearest(place + along * grid.spacing.min_element()) else { return false };
        self.scenario.tissues.role(self.volume.labels()[grid.index(voxel)]) == Some(TissueRole::Decay)
    }

    /// The place with the most brown around it; `None` if nothing is brown.
    fn brownest(&self) -> Option<[f32; 2]> {
        let eye = self.eye();
        let at = |i: usize| (i as f32 + 0.5) / RAYS as f32;
        let brown: Vec<bool> = (0..RAYS * RAYS).map(|i| self.is_brown(&eye, [at(i % RAYS), at(i / RAYS)])).collect();
        let around = |i: usize| {
            let (x, y) = (i % RAYS, i / RAYS);
            let rows = y.saturating_sub(2)..(y + 3).min(RAYS);
            rows.flat_map(|row| (x.saturating_sub(2)..(x + 3).min(RAYS)).map(move |column| row * RAYS + column))
                .filter(|&j| brown[j])
                .count()
        };
        let place = |i: usize| [at(i % RAYS), at(i / RAYS)];
        let is_new = |i: usize| {
            let [x, y] = place(i);
            self.stuck.iter().all(|[a, b]| (a - x).hypot(b - y) * RAYS as f32 > AWAY)
        };
        (0..brown.len()).filter(|&i| brown[i] && is_new(i)).max_by_key(|&i| around(i)).map(place)
    }

    fn look(&mut self) {
        let eye = self.eye();
        if self.is_pressing && self.is_brown(&eye, self.pointer) {
            if self.tick < self.pressed_since + HOLD {
                return;
            }
            self.stuck.push(self.pointer);
        }
        match self.brownest() {
            Some(place) => (self.pointer, self.is_pressing, self.pressed_since) = (place, true, self.tick),
            None => {
                self.is_pressing = false;
                self.stuck.clear();
                self.view = (self.view + 1) % self.views.len();
                if self.view == 0 {
                    self.is_done = self.removed == self.removed_before;
                    self.removed_before = self.removed;
                }
            }
        }
    }

    fn aim(&mut self, instrument: usize, tip: Vec3) {
        let eye = self.eye();
        let along = eye.ray(self.pointer[0], self.pointer[1]).normalize();
        let Some(spot) = spot_under_ray(&self.world(), eye.position, along) else { return };
        let yaw = self.views[self.view].azimuth;
        let action = match self.is_pressing {
            true => HandAction::Press { max_force: STRENGTH },
            false => HandAction::Rest,
        };
        let orientation = Quat::from_rotation_y(yaw) * UPRIGHT;
        let hand = hand_at_spot(&spot, tip, &self.scenario.instruments[instrument], orientation, action);
        self.mouse.aim(HandTarget { place: hand.place, max_force: hand.max_force, yaw, lean: [0.0; 2] });
    }
}

impl Device for PointerPolicy {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.device.exchange(output)
    }
}

impl Trainee for PointerPolicy {
    fn observe_edits(&mut self, edits: &[Edit]) {
        for edit in edits {
            self.volume.apply_edit(edit);
            self.removed += usize::from(edit.removes());
        }
    }

    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input> {
        self.tick += 1;
        if self.tick >= self.next_look {
            self.next_look = self.tick + LOOK;
            self.look();
        }
        if self.tick.is_multiple_of(PICTURE) {
            self.aim(screen.map_or(0, |step| step.instrument), screen.map_or(Vec3::ZERO, |step| step.tip));
        }
        if self.is_done && !session.are_stages_over() { vec![Input::Confirm] } else { Vec::new() }
    }
}

/// Performs an exercise by pointer; returns the score as `typodont score` prints it.
fn score_by_pointer(exercise: &str, seed: u64) -> serde_json::Value {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(exercise)).unwrap();
    let source = SourceText::new(exercise, text);
    let scenario = Arc::new(scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap());
    let workpiece = Arc::new(Workpiece::make(&scenario, seed).unwrap());
    let mut policy = PointerPolicy::new(scenario.clone(), workpiece.clone());
    let spec = policy.spec().clone();
    let place = folder(&format!("pointer-{}-{seed}", scenario.id)).join("recording.mcap");
    let _ = std::fs::remove_file(&place);
    let head = RecordingHeadFile::of(&scenario, &spec, seed);
    let mut recorder = Recorder::create(&place, &head, &scenario, &workpiece).unwrap();
    let mut session = Session::new(scenario.clone(), &workpiece);
    let mut simulation = Simulation::new(typodont_exercise::session::setup(&scenario, &workpiece, spec));
    typodont_exercise::session::run(&mut session, &mut simulation, &mut policy, &mut recorder).unwrap();
    recorder.finish(&RecordingEndFile { reason: "complete".into(), servo: ServoStatsFile::of(&simulation) }).unwrap();
    let output = typodont(&["score", place.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn who_only_points_and_presses_removes_the_caries() {
    // Aim: a newcomer with a mouse who removes what is brown passes, and harms no sound tissue. Method: a policy that sees
    // the picture alone, from five sides.
    let score = score_by_pointer("scenarios/5-grinding.json", 1);
    let points = score["grade"]["points"].as_f64().unwrap();
    assert!(score["grade"]["passed"].as_bool().unwrap() && points >= 80.0, "{points}: {:#}", score["grade"]);
}

#[test]
#[ignore = "scripts/test --long"]
fn who_only_points_and_presses_passes_in_every_quarter() {
    // These seeds place the caries in the four quarters of the tooth.
    let all: Vec<f64> = (1..=4)
        .map(|seed| score_by_pointer("scenarios/5-grinding.json", seed)["grade"]["points"].as_f64().unwrap())
        .collect();
    println!("points: {all:?}");
    assert!(all.iter().all(|points| *points >= 70.0), "{all:?}");
}

#[test]
fn who_only_points_and_presses_opens_a_fissure() {
    // Aim: caries beneath a fissure can be followed by pointer, too. Method: the same policy, which sees it once it is open.
    let score = score_by_pointer("scenarios/8-fissure.json", 1);
    let points = score["grade"]["points"].as_f64().unwrap();
    println!("exercise 8: {points} points");
    assert!(score["grade"]["passed"].as_bool().unwrap() && points >= 70.0, "{points}: {:#}", score["grade"]);
}
