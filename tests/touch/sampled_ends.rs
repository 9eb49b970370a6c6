//! Instruments whose shape is a file: they feel and cut as the same shapes by formula.

use crate::support::phantom;

use phantom::*;
use std::path::PathBuf;
use typodont_core::device::Reading;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::{Simulation, Step};
use typodont_core::touch::{Body, BodyRegion, Instrument, WorkingEnd};
use typodont_core::volume::{Grid, Label, Volume, surface};
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_exercise::scenario::{ResolveMode, Scenario, resolve};
use typodont_formats::diagnostic::SourceText;
use typodont_formats::{Library, json};

/// Shape with its lowest point at the height of the origin; signed distances that are exact near its surface, mm.
#[derive(Clone, Copy)]
struct TestShape {
    name: &'static str,
    distance: fn(Vec3) -> f32,
    /// Box that contains it.
    low: Vec3,
    high: Vec3,
}

const BORE: f32 = 1.5;
const RIM: f32 = 0.4;

/// A ring that lies flat.
fn ring(p: Vec3) -> f32 {
    (p.truncate().length() - BORE).hypot(p.z - RIM) - RIM
}

const BEND: f32 = 1.0;
const WIRE: f32 = 0.35;

/// A wire with a half circle at its end that opens upward.
fn hook(p: Vec3) -> f32 {
    let q = p - Vec3::Z * (BEND + WIRE);
    let bend = match q.z < 0.0 {
        true => (q.x.hypot(q.z) - BEND).hypot(q.y),
        false => q.distance(Vec3::X * BEND),
    };
    let shaft = q.distance(Vec3::new(-BEND, 0.0, q.z.clamp(0.0, 5.0)));
    bend.min(shaft) - WIRE
}

/// Angle between the face of the spoon and the plane across its stem, radians.
const SPOON_LEAN: f32 = 0.6;

/// An inclined bowl, here an ellipsoid, on a stem.
fn spoon(p: Vec3) -> f32 {
    let half = Vec3::new(1.0, 0.8, 0.35);
    let face = Quat::from_rotation_y(SPOON_LEAN);
    let low = (face.conjugate() * Vec3::Z * half).length();
    let q = face.conjugate() * (p - Vec3::Z * low);
    let (scaled, slope) = ((q / half).length(), (q / (half * half)).length());
    let bowl = if slope > 1e-6 { scaled * (scaled - 1.0) / slope } else { -0.35 };
    bowl.min(p.distance(Vec3::Z * p.z.clamp(low, 6.0)) - 0.3)
}

fn shapes() -> [TestShape; 3] {
    let shape = |name, distance, low, high| TestShape { name, distance, low, high };
    [
        shape("ring", ring, Vec3::new(-1.9, -1.9, 0.0), Vec3::new(1.9, 1.9, 0.8)),
        shape("hook", hook, Vec3::new(-1.35, -0.35, 0.0), Vec3::new(1.35, 0.35, 6.7)),
        shape("spoon", spoon, Vec3::new(-1.0, -0.8, 0.0), Vec3::new(1.0, 0.8, 6.3)),
    ]
}

impl TestShape {
    fn volume(&self, spacing: f32) -> Volume {
        let grid = Grid::covering(self.low, self.high, Vec3::splat(spacing), 3);
        Volume::from_distance(grid, 1.5 * spacing, |p| ((self.distance)(p), Label(1)))
    }

    /// The shape by its formula.
    fn twin(&self, cuts: bool) -> Instrument {
        Instrument::with_body(Body::of_volume(&self.volume(0.03)), cuts)
    }

    /// The surface as a binary STL file.
    fn stl(&self) -> Vec<u8> {
        let mesh = surface::extract(&self.volume(0.06));
        let mut file = vec![0; 80];
        file.extend((mesh.triangles.len() as u32).to_le_bytes());
        for triangle in &mesh.triangles {
            let corners = triangle.iter().flat_map(|&i| mesh.positions[i as usize].to_array());
            file.extend([0.0; 3].into_iter().chain(corners).flat_map(f32::to_le_bytes).chain([0; 2]));
        }
        file
    }

    /// The shape as a label map of whole voxels, which round off half a voxel at a tip.
    fn nrrd(&self) -> Vec<u8> {
        const SPACING: f32 = 0.04;
        let grid = Grid::covering(self.low, self.high, Vec3::splat(SPACING), 2);
        let ([x, y, z], o) = (grid.dims, grid.origin);
        let header = format!(
            "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {x} {y} {z}\n\
             space directions: ({SPACING},0,0) (0,{SPACING},0) (0,0,{SPACING})\nspace origin: ({},{},{})\n\
             encoding: raw\n\n",
            o.x, o.y, o.z
        );
        let voxels = grid.cells().map(|cell| u8::from((self.distance)(grid.centre(cell)) < 0.0));
        header.into_bytes().into_iter().chain(voxels).collect()
    }
}

/// Exercise 5 with one instrument of a shape; `keys` are the further keys of the shape.
fn exercise(file: &str, bytes: Vec<u8>, keys: &str, cuts: bool) -> Scenario {
    let mut library = Library::shipped();
    let entry = format!(
        r#"{{"instruments":[{{"id":"own","title":"Own","cuts":{cuts},"end":{{"shape":{{"file":"{file}"{keys}}}}}}}]}}"#
    );
    library.insert("own.json", entry.into_bytes());
    library.insert(file, bytes);
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let mut root: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    root["instrument_file"] = "own.json".into();
    root["instruments"] = serde_json::json!(["own"]);
    root["stages"].as_array_mut().unwrap().iter_mut().for_each(|stage| {
        stage.as_object_mut().unwrap().remove("instruments");
        stage["cutting"] = cuts.into();
    });
    root.as_object_mut().unwrap().remove("rubric");
    root.as_object_mut().unwrap().remove("operating_field");
    resolve(SourceText::new("own-exercise.json", root.to_string()), &library, ResolveMode::ReadScans)
        .unwrap_or_else(|found| panic!("{}", found.iter().map(|d| d.to_string()).collect::<String>()))
}

/// The shape as read from an STL file and from voxels.
fn from_files(shape: &TestShape, cuts: bool) -> [(&'static str, Instrument); 2] {
    let made = |file: &str, bytes| exercise(file, bytes, "", cuts).instruments[0].to_instrument();
    [("STL", made("own.stl", shape.stl())), ("voxels", made("own.nrrd", shape.nrrd()))]
}

/// A place at which a shape is pressed, and the way there.
struct Contact {
    matter: Volume,
    orientation: Quat,
    /// Position of the hand before contact, mm.
    start: Vec3,
    /// Direction of the hand.
    toward: Vec3,
}

impl Contact {
    fn on_plane(orientation: Quat, label: Label) -> Contact {
        Contact {
            matter: volume([60, 60, 60], 0.1, |p| (p.z, label)),
            orientation,
            start: Vec3::Z * 1.0,
            toward: Vec3::NEG_Z,
        }
    }

    fn simulation(&self, instrument: &Instrument, friction: f32) -> Simulation {
        let mut setup = setup(self.matter.clone(), WorkingEnd::Point, false);
        let mut hard = *setup.materials.get(HARD);
        (hard.static_friction, hard.dynamic_friction) = (friction, friction);
        setup.materials.set(HARD, hard);
        setup.instruments = vec![instrument.clone()];
        Simulation::new(setup)
    }

    fn step(&self, sim: &mut Simulation, along: f32, aside: Vec3) -> Step {
        let position = self.start + self.toward * along + aside;
        sim.step(&Reading { pose: Pose { position, orientation: self.orientation }, buttons: 0 })
    }

    /// Force at rest after each of these distances along the way, N.
    fn forces_at_rest(&self, instrument: &Instrument, distances: &[f32]) -> Vec<Vec3> {
        let mut sim = self.simulation(instrument, 0.0);
        let mut from = 0.0;
        let mut forces = Vec::new();
        for &to in distances {
            let way = (0..400).map(|tick| from + (to - from) * tick as f32 / 399.0);
            let rest = std::iter::repeat_n(to, 200);
            let last = way.chain(rest).map(|along| self.step(&mut sim, along, Vec3::ZERO)).last();
            forces.push(last.unwrap().force);
            from = to;
        }
        forces
    }
}

/// The contacts of a shape: on a plane, and where it is hollow.
fn contacts(name: &str) -> Vec<Contact> {
    let plane = |orientation| Contact::on_plane(orientation, HARD);
    let post = || volume([60, 60, 60], 0.1, |p| ((p.truncate().length() - 0.6).max(p.z - 2.0), HARD));
    let bar = || volume([60, 60, 60], 0.1, |p| (p.x.hypot(p.z) - 0.4, HARD));
    let upright = Quat::IDENTITY;
    match name {
        "ring" => {
            let around_post = Contact { matter: post(), orientation: upright, start: Vec3::ZERO, toward: Vec3::X };
            vec![plane(upright), around_post]
        }
        "hook" => {
            let start = Vec3::NEG_Z * (BEND + WIRE);
            vec![plane(upright), Contact { matter: bar(), orientation: upright, start, toward: Vec3::Z }]
        }
        _ => vec![plane(upright), plane(Quat::from_rotation_x(0.5))],
    }
}

#[test]
fn shapes_from_files_push_as_their_formulas() {
    // Aim: the force at rest within 5 % over a range of depths, on a plane and with a post, a bar or a side of the bowl.
    // Method: a twin of each shape by its formula, finely sampled, is moved alike.
    for shape in shapes() {
        let twin = shape.twin(false);
        let made = from_files(&shape, false);
        for (index, contact) in contacts(shape.name).iter().enumerate() {
            let distances = [1.9, 2.2, 2.6, 3.0];
            let expected = contact.forces_at_rest(&twin, &distances);
            for (file, instrument) in &made {
                let found = contact.forces_at_rest(instrument, &distances);
                for ((found, expected), distance) in found.iter().zip(&expected).zip(distances) {
                    let off = found.distance(*expected) / expected.length();
                    println!("{} {index} from {file} at {distance}: {found} for {expected}, off {off:.4}", shape.name);
                    assert!(expected.length() > 0.3, "{} {index}: {expected}", shape.name);
                    assert!(off < 0.05, "{} {index} from {file} at {distance}: {found} for {expected}", shape.name);
                }
            }
        }
    }
}

#[test]
fn shapes_from_files_slide_as_their_formulas() {
    // Aim: force with friction within 5 %. Method: pressed 1 mm into a plane with a coefficient of 0.3, drawn sideways at
    // 2 mm/s; the mean force over the second half of the way.
    for shape in shapes() {
        let contact = Contact::on_plane(Quat::IDENTITY, HARD);
        let mean = |instrument: &Instrument| {
            let mut sim = contact.simulation(instrument, 0.3);
            for tick in 0..500 {
                contact.step(&mut sim, 2.0 * tick as f32 / 499.0, Vec3::ZERO);
            }
            let drawn = (0..800).map(|tick| contact.step(&mut sim, 2.0, Vec3::X * (0.002 * tick as f32)).force);
            drawn.skip(400).sum::<Vec3>() / 400.0
        };
        let expected = mean(&shape.twin(false));
        assert!((-expected.x / expected.z - 0.3).abs() < 0.02, "{}: {expected}", shape.name);
        for (file, instrument) in from_files(&shape, false) {
            let found = mean(&instrument);
            let off = found.distance(expected) / expected.length();
            println!("{} from {file}: {found} for {expected}, off {off:.4}", shape.name);
            assert!(off < 0.05, "{} from {file}: {found} for {expected}", shape.name);
        }
    }
}

#[test]
fn shapes_from_files_cut_as_their_formulas() {
    // Aim: the volume that a plunge into decay removes, within 5 %. Method: the bowl of the spoon lies flat, since an
    // inclined one slides aside, by a length that depends on the least detail.
    for shape in shapes() {
        let lean = if shape.name == "spoon" { -SPOON_LEAN } else { 0.0 };
        let contact = Contact::on_plane(Quat::from_rotation_y(lean), SOFT);
        let cut_mm3 = |instrument: &Instrument| {
            let mut sim = contact.simulation(instrument, 0.0);
            let matter = |sim: &Simulation| surface::extract(sim.volume()).volume_mm3();
            let before = matter(&sim);
            for tick in 0..2000 {
                contact.step(&mut sim, 4.0 * tick as f32 / 1999.0, Vec3::ZERO);
            }
            before - matter(&sim)
        };
        let expected = cut_mm3(&shape.twin(true));
        assert!(expected > 0.2, "{}: {expected} mm³", shape.name);
        for (file, instrument) in from_files(&shape, true) {
            let found = cut_mm3(&instrument);
            println!("{} from {file}: {found:.3} mm³ for {expected:.3}", shape.name);
            assert!((found / expected - 1.0).abs() < 0.05, "{} from {file}: {found} for {expected}", shape.name);
        }
    }
}

#[test]
fn only_the_cutting_part_of_a_shape_cuts() {
    // Aim: contact and cutting parts apart. Method: a hook in inches, turned on its head and raised again by the keys of the
    // file, with the lowest 0.8 mm cutting; pressed upright it cuts, pressed with its shaft on a ridge it does not.
    let shape = shapes()[1];
    let keys = r#","unit":"in","position_mm":[0,0,6.7],"orientation_deg":[180,0,0],"cutting":{"length_mm":0.8}"#;
    let mut turned = shape.stl();
    for corner in turned[84..].chunks_exact_mut(50).flat_map(|t| t[12..48].chunks_exact_mut(12)) {
        for axis in 0..3 {
            let place = 4 * axis..4 * axis + 4;
            let value = f32::from_le_bytes(corner[place.clone()].try_into().unwrap());
            let value = [value, -value, 6.7 - value][axis] / 25.4;
            corner[place].copy_from_slice(&value.to_le_bytes());
        }
    }
    let scenario = exercise("own.stl", turned, keys, true);
    let instrument = scenario.instruments[0].to_instrument();
    let WorkingEnd::Body(body) = &instrument.end else { panic!("a shape is a body") };
    for point in body.surface_points() {
        let expected = if point.position.z < 0.8 { BodyRegion::Head } else { BodyRegion::Shank };
        let is_at_border = (point.position.z - 0.8).abs() < 0.1;
        assert!(is_at_border || point.region == expected, "{}", point.position);
        assert!((shape.distance)(point.position).abs() < 0.02, "{}", point.position);
    }
    let removed = |orientation: Quat, start: Vec3| {
        let matter = volume([60, 60, 60], 0.1, |p| ((p.x.abs() - 0.3).max(p.z), SOFT));
        let contact = Contact { matter, orientation, start, toward: Vec3::NEG_Z };
        let mut sim = contact.simulation(&instrument, 0.0);
        let steps = (0..1500).map(|tick| contact.step(&mut sim, 4.0 * tick as f32 / 1499.0, Vec3::ZERO));
        steps.fold((0, 0.0f32), |(removed, force), step| (removed + step.removed, force.max(step.force.length())))
    };
    let (cut, _) = removed(Quat::IDENTITY, Vec3::Z);
    assert!(cut > 50, "the end cuts: {cut}");
    let (cut, force) = removed(Quat::from_rotation_arc(Vec3::Z, Vec3::X), Vec3::new(-4.5, 0.0, 2.4));
    assert!(cut == 0 && force > 0.05, "the shaft pushes and does not cut: {cut}, {force} N");
}

#[test]
fn recordings_and_packages_hold_the_files_of_a_shape() {
    // Aim: a replay and a package need no other file. Method: the exercise is resolved again from its own files alone, and
    // names them.
    let scenario = exercise("own.stl", shapes()[0].stl(), "", false);
    let mut library = Library::empty();
    scenario.files.iter().for_each(|(name, bytes)| library.insert(name.clone(), bytes.clone()));
    let source = SourceText::new("own-exercise.json", scenario.text.to_string());
    let written = json::read::<ScenarioFile>(source.clone()).unwrap().value;
    assert_eq!(written.instrument_files(&library).into_iter().collect::<Vec<_>>(), ["own.stl"]);
    let again = resolve(source, &library, ResolveMode::FromRecording).unwrap();
    assert_eq!(again.instruments[0].to_instrument(), scenario.instruments[0].to_instrument());
}
