//! Meshes around a tooth feel like what they are drawn as, and a recording needs no file to be replayed.

use crate::support::bundle;
use crate::support::folder;
use crate::support::phantom;

use bundle::*;
use folder::folder;
use phantom::*;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use typodont_core::device::{Reading, UPRIGHT};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::{Setup, Simulation, Step};
use typodont_core::touch::{Body, ClosedMesh, Collider, ColliderGeometry, EDGE_RADIUS, Profile, WorkingEnd};
use typodont_core::volume::{Label, Volume};
use typodont_exercise::scenario;
use typodont_exercise::scenario::ResolveMode;
use typodont_formats::diagnostic::SourceText;
use typodont_formats::{Library, solid_mesh};

/// A ball as an OBJ file: rings and slices of triangles.
fn ball_obj(radius: f32, rings: usize, slices: usize) -> String {
    let mut text = format!("v 0 0 {radius}\nv 0 0 {}\n", -radius);
    for ring in 1..rings {
        for slice in 0..slices {
            let (t, p) = (
                ring as f32 / rings as f32 * std::f32::consts::PI,
                slice as f32 / slices as f32 * std::f32::consts::TAU,
            );
            writeln!(text, "v {} {} {}", radius * t.sin() * p.cos(), radius * t.sin() * p.sin(), radius * t.cos())
                .unwrap();
        }
    }
    let at = |ring: usize, slice: usize| 3 + (ring - 1) * slices + slice % slices;
    for s in 0..slices {
        writeln!(text, "f 1 {} {}", at(1, s), at(1, s + 1)).unwrap();
        writeln!(text, "f 2 {} {}", at(rings - 1, s + 1), at(rings - 1, s)).unwrap();
        for r in 1..rings - 1 {
            writeln!(text, "f {} {} {} {}", at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1)).unwrap();
        }
    }
    text
}

/// A block 20 mm long (along y) and wide, its top at z = 0 but for a groove along y of an opening angle, `deep` mm deep.
fn groove_obj(half_angle: f32, deep: f32) -> String {
    let half = deep * half_angle.tan();
    let outline = [(-10.0, -8.0), (10.0, -8.0), (10.0, 0.0), (half, 0.0), (0.0, -deep), (-half, 0.0), (-10.0, 0.0)];
    let mut text = String::new();
    for y in [-10.0, 10.0] {
        outline.iter().for_each(|(x, z)| writeln!(text, "v {x} {y} {z}").unwrap());
    }
    let n = outline.len();
    for i in 0..n {
        let j = (i + 1) % n;
        writeln!(text, "f {} {} {} {}", i + 1, i + 1 + n, j + 1 + n, j + 1).unwrap();
    }
    // The ends are not convex: fans about the bottom of the groove are.
    for i in 0..n {
        let j = (i + 1) % n;
        if i != 4 && j != 4 {
            writeln!(text, "f {} {} {}", 5, i + 1, j + 1).unwrap();
            writeln!(text, "f {} {} {}", 5 + n, j + 1 + n, i + 1 + n).unwrap();
        }
    }
    text
}

/// A world of one mesh, placed as given, and no voxels near.
fn around(text: &str, tooth_from_shape: Pose, end: WorkingEnd) -> Setup {
    let mesh = solid_mesh::parse(text.as_bytes(), "obj", |_| unreachable!("an OBJ file names no other")).unwrap();
    let obstacle = ClosedMesh::new(&mesh).unwrap();
    let empty = volume([4, 4, 4], 0.1, |_| (9.0, HARD));
    let mut setup = setup(empty, end, false);
    setup.scene.colliders = vec![Collider {
        label: HARD,
        tooth_from_collider: tooth_from_shape,
        geometry: ColliderGeometry::Mesh(Arc::new(obstacle)),
    }];
    setup
}

#[test]
fn a_mesh_of_a_ball_feels_like_a_ball() {
    // Aim: force within 3 % and 3° of k·depth along the radius, no jump above 0.08 N at 50 mm/s. Method: a ball of 5 mm
    // in 80×160 facets, turned and moved, circled over 1 mm deep.
    let place = Pose { position: Vec3::new(2.0, -1.0, 3.0), orientation: Quat::from_xyzw(0.5, 0.5, -0.5, 0.5) };
    for end in [WorkingEnd::Point, WorkingEnd::Ball { radius: 0.7 }] {
        let mut sim = Simulation::new(around(&ball_obj(5.0, 80, 160), place, end.clone()));
        let reach = 5.0 + if let WorkingEnd::Ball { radius } = end { radius } else { 0.0 };
        let (u, v) = (Vec3::new(0.8, 0.6, 0.0), Vec3::new(-0.36, 0.48, 0.8));
        let down = (0..400).map(|i| u * (reach + 0.5 - 1.5 * i as f32 / 399.0));
        let circle = (0..600).map(|i| {
            let turn = 50e-3 * i as f32 / (reach - 1.0);
            (u * turn.cos() + v * turn.sin()) * (reach - 1.0)
        });
        let steps = follow(&mut sim, down.chain(circle).map(|p| p + place.position));
        let sliding = &steps[400..];
        let off = sliding.iter().map(|s| (s.force.length() - 1.0).abs()).fold(0.0, f32::max);
        let angle = sliding.iter().map(|s| s.force.angle_between(s.hand - place.position).to_degrees());
        let angle = angle.fold(0.0, f32::max);
        let jump = steps[1..].iter().zip(&steps).map(|(a, b)| (a.force - b.force).length()).fold(0.0, f32::max);
        println!("{end:?}: {off:.4} N, {angle:.2}°, jump {jump:.4} N");
        assert!(off < 0.03 && angle < 3.0 && jump < 0.08, "{end:?}: {off} N, {angle}°, {jump} N");
    }
}

#[test]
fn a_groove_holds_a_ball_on_both_sides() {
    // Aim: the ball rests where geometry says, and never falls through, though the hand goes far below, to and fro.
    for half_angle in [25.0f32, 45.0, 60.0] {
        let half_angle = half_angle.to_radians();
        for radius in [0.0, 0.5] {
            let end = if radius > 0.0 { WorkingEnd::Ball { radius } } else { WorkingEnd::Point };
            let mut sim = Simulation::new(around(&groove_obj(half_angle, 3.0), Pose::IDENTITY, end));
            let rest = radius / half_angle.sin() - 3.0;
            let mut worst = 0.0f32;
            let mut jump = 0.0f32;
            let mut last = Vec3::ZERO;
            for tick in 0..4000 {
                let depth = (tick as f32 / 1000.0).min(1.0);
                let hand = Vec3::new(
                    0.3 * (tick as f32 * 0.01).sin(),
                    3.0 * (tick as f32 * 0.003).sin(),
                    2.0 - (2.0 - rest + 1.0) * depth,
                );
                let step = sim.step(&Reading::at(hand));
                jump = jump.max(step.force.distance(last));
                last = step.force;
                if tick > 1500 {
                    worst = worst.max((step.tip.z - rest).abs()).max(step.tip.x.abs());
                }
            }
            println!("{:.0}°, radius {radius}: {worst:.4} mm off, jump {jump:.4} N", half_angle.to_degrees());
            assert!(worst < 0.01, "{}°, radius {radius}: {worst} mm", half_angle.to_degrees());
            assert!(jump < 0.05, "{}°, radius {radius}: {jump} N", half_angle.to_degrees());
        }
    }
}

/// A tooth-like block with a groove and a soft spot in its top.
fn grooved_block() -> Volume {
    let slope = |p: Vec3| (p.z - 0.9 * p.x.abs() + 0.8) / (1.0f32 + 0.9 * 0.9).sqrt();
    let groove = |p: Vec3| p.z.max(slope(p));
    volume([60, 60, 40], 0.15, |p| {
        let is_soft = Vec3::new(p.x + 2.0, p.y - 1.0, p.z).length() < 1.2;
        (groove(p).max(-2.5 - p.z), if is_soft { SOFT } else { HARD })
    })
}

#[test]
fn another_tooth_of_voxels_feels_as_the_one_that_is_worked_on() {
    // Aim: each tissue, groove and edge of a tooth that stands beside feels as if it were worked on, however it is turned. Method: the
    // same block as the volume and as a collider, with the same hand; then turned and moved, with the hand and the forces turned
    // with it. A point, a ball and a body. A ball is sampled in directions that do not turn with the block; a body slips
    // over edges a tick earlier or later, so that 99 % of the ticks are compared.
    let body = Body::revolved(Profile::frustum(0.5, 0.5, 3.0, [EDGE_RADIUS; 2]), None);
    let ends = [
        ("point", WorkingEnd::Point, [0.0, 1e-4]),
        ("ball", WorkingEnd::Ball { radius: 0.5 }, [0.0, 0.08]),
        ("body", WorkingEnd::Body(Arc::new(body)), [0.05, 0.08]),
    ];
    let turned = Pose { position: Vec3::new(3.0, -2.0, 5.0), orientation: Quat::from_xyzw(0.5, 0.5, -0.5, 0.5) };
    let hand = |tick: usize| {
        let turn = tick as f32 * 0.004;
        let depth = (tick as f32 / 500.0).min(1.0);
        Vec3::new(2.2 * libm::cosf(turn), 1.6 * libm::sinf(turn), 1.5 - 2.2 * depth)
    };
    // A flat end would rest on all of its points at once, each on another tissue.
    let leaning = UPRIGHT * Quat::from_rotation_x(0.2) * Quat::from_rotation_y(0.1);
    for (name, end, [tolerance, tolerance_moved]) in ends {
        let mut own = Simulation::new(setup(grooved_block(), end.clone(), false));
        let other = |pose: Pose| {
            let empty = volume([4, 4, 4], 0.15, |_| (9.0, HARD));
            let mut other = setup(empty, end.clone(), false);
            other.scene.colliders = vec![Collider {
                label: Label(9),
                tooth_from_collider: pose,
                geometry: ColliderGeometry::Voxels(Arc::new(grooved_block())),
            }];
            Simulation::new(other)
        };
        let (mut beside, mut moved) = (other(Pose::IDENTITY), other(turned));
        let (mut soft, mut touched) = (0, 0);
        let (mut off, mut off_moved) = (Vec::new(), Vec::new());
        for tick in 0..4000 {
            let pose = Pose { position: hand(tick), orientation: leaning };
            let wanted = own.step(&Reading { pose, buttons: 0 });
            let found = beside.step(&Reading { pose, buttons: 0 });
            let found_moved = moved.step(&Reading { pose: turned * pose, buttons: 0 });
            off.push(found.force.distance(wanted.force));
            off_moved.push(found_moved.force.distance(turned.rotate(wanted.force)));
            let label = |step: &Step| step.touch.map(|touch| touch.label);
            soft += usize::from(label(&found) == Some(SOFT));
            touched += usize::from(label(&found).is_some());
            if tolerance == 0.0 {
                assert_eq!(label(&found), label(&wanted), "{name}, tick {tick}");
            }
        }
        let [off, off_moved] = [off, off_moved].map(|off| percentile(off, 0.99));
        println!("{name}: {off} N, turned {off_moved} N; {soft} of {touched} ticks on the soft spot");
        assert!(touched > 2500 && soft > 200, "{name}: {touched} ticks, {soft} soft");
        assert!(off <= tolerance && off_moved <= tolerance_moved, "{name}: {off} N, turned {off_moved} N");
    }
}

#[test]
fn a_bur_meets_another_tooth_as_one_that_must_not_be_cut() {
    // Aim: the contact is that of the tooth beside, whatever its tissue, and no voxel is cut.
    let empty = volume([4, 4, 4], 0.15, |_| (9.0, HARD));
    let mut world = setup(empty, WorkingEnd::Ball { radius: 0.5 }, true);
    let geometry = ColliderGeometry::Voxels(Arc::new(grooved_block()));
    world.scene.colliders = vec![Collider { label: Label(9), tooth_from_collider: Pose::IDENTITY, geometry }];
    let mut sim = Simulation::new(world);
    let steps = follow(&mut sim, (0..800).map(|t| Vec3::new(2.5, 0.0, 2.0 - 3.0 * t as f32 / 800.0)));
    let last = steps.last().unwrap();
    assert_eq!(last.touch.map(|touch| touch.label), Some(Label(9)));
    assert!(last.force.z > 1.0 && steps.iter().all(|step| step.removed == 0));
}

#[test]
fn touching_a_mesh_never_allocates() {
    let mut sim = Simulation::new(around(&ball_obj(5.0, 60, 120), Pose::IDENTITY, WorkingEnd::Ball { radius: 0.7 }));
    let mut touched = 0;
    let counted = allocation_counter::measure(|| {
        for tick in 0..4000 {
            let turn = tick as f32 * 0.003;
            let out = 5.7 + 2.0 * libm::cosf(turn * 1.7);
            let hand = Vec3::new(libm::cosf(turn), libm::sinf(turn) * 0.8, libm::sinf(turn) * 0.6) * out;
            touched += u32::from(sim.step(&Reading::at(hand)).touch.is_some());
        }
    });
    assert!(touched > 1000, "{touched}");
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

#[test]
fn touching_teeth_of_voxels_never_allocates() {
    // Four blocks that meet in the middle, so that all of them are in reach at once, and a body and a ball among them.
    let body = Body::revolved(Profile::frustum(0.5, 0.5, 3.0, [EDGE_RADIUS; 2]), None);
    for end in [WorkingEnd::Ball { radius: 0.5 }, WorkingEnd::Body(Arc::new(body))] {
        let empty = volume([4, 4, 4], 0.15, |_| (9.0, HARD));
        let mut world = setup(empty, end, false);
        let block = Arc::new(grooved_block());
        let at = |x: f32, y: f32| Collider {
            label: Label(9),
            tooth_from_collider: Pose::at(Vec3::new(x, y, 0.0)),
            geometry: ColliderGeometry::Voxels(block.clone()),
        };
        world.scene.colliders = vec![at(-4.0, -4.0), at(4.0, -4.0), at(-4.0, 4.0), at(4.0, 4.0)];
        let mut sim = Simulation::new(world);
        let mut touched = 0;
        let counted = allocation_counter::measure(|| {
            for tick in 0..3000 {
                let turn = tick as f32 * 0.003;
                let hand = Vec3::new(libm::cosf(turn), libm::sinf(turn), 1.5 - (tick as f32 / 500.0).min(2.5));
                let step = sim.step(&Reading { pose: Pose { position: hand, orientation: UPRIGHT }, buttons: 0 });
                touched += u32::from(step.touch.is_some());
            }
        });
        assert!(touched > 1000, "{touched}");
        assert_eq!(counted.count_total, 0, "{counted:?}");
    }
}

/// A short exercise in a jaw of one mesh.
fn exercise(mesh: Value) -> String {
    let shipped = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut scenario: Value = serde_json::from_str(&shipped).unwrap();
    scenario["scene"]["jaw"]["tooth"]["form"]["procedural"]["spacing_mm"] = json!(0.2);
    let jaw = scenario["scene"]["jaw"].as_object_mut().unwrap();
    jaw.remove("periodontium");
    jaw.insert("around".into(), json!([mesh]));
    scenario["stages"][0]["time_limit_s"] = json!(4);
    scenario.as_object_mut().unwrap().remove("questionnaire");
    scenario.to_string()
}

#[test]
fn a_recording_needs_no_mesh_beside_it() {
    // Aim: the mesh's bytes are in the recording. Method: play, delete the mesh, verify.
    let folder = folder("obstacles");
    let (file, mesh) = (folder.join("exercise.json"), folder.join("gum.obj"));
    let placed =
        json!({ "mesh": "gum.obj", "tissue": "gingiva", "position_mm": [0, 0, -4.5], "orientation_deg": [0, 0, 90] });
    std::fs::write(&mesh, ball_obj(6.0, 20, 40)).unwrap();
    std::fs::write(&file, exercise(placed)).unwrap();
    let bundle = run(file.to_str().unwrap(), "hasty", &folder, &[]);
    std::fs::remove_file(&mesh).unwrap();
    let verified = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
    let played = typodont(&["run", file.to_str().unwrap(), "--headless", "--operator", "hasty", "--out", "/dev/null"]);
    assert!(complained(&played).contains("missing-file"), "a new session does need it");
}

fn check(folder: &Path, mesh: &str, expected: &[(&str, &str)]) {
    std::fs::write(folder.join("gum.obj"), mesh).unwrap();
    let text = exercise(json!({ "mesh": "gum.obj", "tissue": "gingiva" }));
    let library = Library::shipped().with_folder(folder);
    let found = scenario::resolve(SourceText::new("exercise.json", text), &library, ResolveMode::MakeWorkpiece)
        .err()
        .unwrap_or_default();
    let pairs: Vec<(&str, &str)> = found.iter().map(|d| (d.code, d.path.as_str())).collect();
    assert_eq!(pairs, expected);
    assert!(found.iter().all(|d| d.message.contains("gum.obj") && d.help.is_some()));
}

#[test]
fn meshes_that_cannot_be_touched_are_complained_about() {
    let folder = folder("obstacle_complaints");
    let whole = ball_obj(6.0, 10, 20);
    let at = "/scene/jaw/around/0/mesh";
    let (first, rest) = whole.split_once("\nf ").unwrap();
    let without_one = format!("{first}\nf {}", rest.split_once("\nf ").unwrap().1);
    check(&folder, &whole, &[]);
    check(&folder, &without_one, &[("open-mesh", at)]);
    check(&folder, &whole.replacen("f 1 3 4", "f 1 4 3", 1), &[("inconsistent-mesh", at)]);
    check(&folder, &ball_obj(6000.0, 10, 20), &[("wrong-size", at)]);
    check(&folder, &ball_obj(6.0, 400, 400), &[("too-large", at)]);
    check(&folder, "no mesh at all", &[("empty-mesh", at)]);
}

/// A closed surface in OBJ as ASCII STL.
fn stl(obj: &str) -> String {
    let mesh = solid_mesh::parse(obj.as_bytes(), "obj", |_| unreachable!("an OBJ file names no other")).unwrap();
    let facet = |triangle: &[u32; 3]| {
        let corner = |i: &u32| {
            let Vec3 { x, y, z } = mesh.positions[*i as usize];
            format!("vertex {x} {y} {z}\n")
        };
        format!(
            "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
            triangle.iter().map(corner).collect::<String>()
        )
    };
    format!("solid tooth\n{}endsolid tooth\n", mesh.triangles.iter().map(facet).collect::<String>())
}

#[test]
fn a_jaw_of_ones_own_stands_in_place_of_ours_and_its_pockets_are_probed() {
    // Aim: a school's own jaw, with the gingiva of a periodontium next to the tooth. Method: the charting exercise among two
    // teeth from STL over a ridge from OBJ; whoever probes carefully charts as well as in the generated jaw, nothing of
    // that is drawn, and the recording holds without the files.
    let folder = folder("own_jaw");
    let shipped = std::fs::read_to_string("scenarios/15-charting.json").unwrap();
    let mut scenario: Value = serde_json::from_str(&shipped).unwrap();
    let jaw = &mut scenario["scene"]["jaw"];
    let tooth = |y: f32| json!({ "mesh": "tooth.stl", "tissue": "neighbour", "position_mm": [0, y, 4] });
    let ridge = json!({ "mesh": "ridge.obj", "tissue": "gingiva", "position_mm": [0, 0, -10] });
    jaw["around"] = json!([ridge, tooth(-10.5), tooth(10.5)]);
    std::fs::write(folder.join("ridge.obj"), groove_obj(0.5, 1.0)).unwrap();
    std::fs::write(folder.join("tooth.stl"), stl(&ball_obj(4.5, 20, 40))).unwrap();
    let file = folder.join("own-jaw.json");
    std::fs::write(&file, scenario.to_string()).unwrap();
    let refused = typodont(&["check", file.to_str().unwrap()]);
    assert!(complained(&refused).contains("two-gums"), "{}", complained(&refused));
    scenario["scene"]["jaw"]["own_jaw"] = json!(true);
    std::fs::write(&file, scenario.to_string()).unwrap();

    let library = Library::shipped().with_folder(&folder);
    let source = SourceText::new("own-jaw.json", scenario.to_string());
    let resolved = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
    let workpiece = scenario::Workpiece::make(&resolved, 1).unwrap();
    let mouth = typodont_scene::Mouth::around(&workpiece, &resolved.tissues).unwrap();
    let drawn: Vec<usize> =
        mouth.solids(20.0).iter().map(|solid| solid.mesh.triangles.len()).filter(|&n| n > 0).collect();
    assert_eq!(drawn.len(), 4, "the ridge, two teeth, and the gingiva with its sulcus: {drawn:?} triangles");

    let points = |file: &str| {
        let bundle = run(file, "careful", &folder, &["--seed", "3"]);
        (session(&bundle)["grade"]["points"].as_f64().unwrap(), bundle)
    };
    let (ours, _) = points("scenarios/15-charting.json");
    let (own, bundle) = points(file.to_str().unwrap());
    assert!((own - ours).abs() < 3.0 && own > 60.0, "{own} points in the own jaw, {ours} in ours");
    std::fs::remove_file(folder.join("ridge.obj")).unwrap();
    std::fs::remove_file(folder.join("tooth.stl")).unwrap();
    let verified = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
}
