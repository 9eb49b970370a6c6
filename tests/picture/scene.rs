//! Rendered scenes: the mouth around the tooth, and the camera presets.
//!
//! The images are written to `target/tmp/scene/` for inspection.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{ClosedMesh, Collider, ColliderGeometry};
use typodont_core::volume::{Grid, Volume, surface};
use typodont_exercise::catalog::InstrumentTable;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, ToothBounds, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_render::*;
use typodont_scene::*;

fn exercise(name: &str) -> (Scenario, Workpiece) {
    resolved(typodont_formats::read_text(&scenarios().join(name)).unwrap())
}

/// The grinding exercise with gingiva and neighbours as simple shapes.
fn in_plain_gum() -> (Scenario, Workpiece) {
    let text = std::fs::read_to_string(scenarios().join("5-grinding.json")).unwrap();
    let plain = text.replace(",\n      \"periodontium\": {}", "");
    assert!(plain.len() < text.len(), "the exercise has no periodontium");
    resolved(typodont_formats::decode_text("5-grinding.json", plain.into_bytes()).unwrap())
}

fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

fn resolved(source: Arc<SourceText>) -> (Scenario, Workpiece) {
    let library = Library::shipped().with_folder(scenarios());
    let scenario = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
    let workpiece = Workpiece::make(&scenario, 0).unwrap();
    (scenario, workpiece)
}

fn keep(name: &str, image: &RgbaImage) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene");
    std::fs::create_dir_all(&folder).unwrap();
    let RgbaImage { width, height, rgba } = image;
    image::save_buffer(folder.join(format!("{name}.png")), rgba, *width, *height, image::ColorType::Rgba8).unwrap();
}

fn tooth<'a>(workpiece: &'a Workpiece, palette: &'a LabelPalette) -> VolumeInstance<'a> {
    VolumeInstance {
        volume: &workpiece.volume,
        changes: Changes::All,
        world_from_tooth: workpiece.world_from_tooth,
        palette,
        unworked_tooth: None,
        mode: RenderMode::Iso,
    }
}

#[test]
fn the_mouth_is_seen_from_everywhere() {
    // Aim: every place to look from shows the mouth, not its inside, its back or nothing. Method: draw it; teeth are bright
    // and gum is red, and each view has its share of both.
    let (scenario, workpiece) = exercise("5-grinding.json");
    let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
    let palette = tissue_palette(&scenario.tissues, true);
    let quadrant = |quadrant| mouth.quadrant_view(quadrant, WORKING_OPENING_DEG);
    let views = [
        ("front", mouth.front_view(WORKING_OPENING_DEG), mouth.solids(WORKING_OPENING_DEG)),
        ("arch", mouth.arch_view(), mouth.one_jaw()),
        ("upper-right", quadrant(Quadrant::UpperRight), mouth.solids(WORKING_OPENING_DEG)),
        ("upper-left", quadrant(Quadrant::UpperLeft), mouth.solids(WORKING_OPENING_DEG)),
        ("lower-left", quadrant(Quadrant::LowerLeft), mouth.solids(WORKING_OPENING_DEG)),
        ("lower-right", quadrant(Quadrant::LowerRight), mouth.solids(WORKING_OPENING_DEG)),
        (
            "at-work",
            Orbit { distance: 60.0, ..tooth_view(&workpiece, ToothSide::Lingual).rotated(0.4, 0.6) },
            mouth.one_jaw(),
        ),
    ];
    let mut painter = OffscreenRenderer::cpu();
    for (name, orbit, solids) in views {
        let viewpoint = orbit.viewpoint();
        let lights = Lights::along(&viewpoint);
        let scene = RenderScene { tooth: Some(tooth(&workpiece, &palette)), solids, lights, ..RenderScene::empty() };
        let image = painter.draw(&scene, &viewpoint, None, [780, 690]).unwrap();
        keep(name, &image);
        let share = |is: &dyn Fn([u8; 4]) -> bool| {
            let count = image.rgba.chunks(4).filter(|p| is([p[0], p[1], p[2], p[3]])).count();
            count as f64 / f64::from(image.width * image.height)
        };
        let gum = share(&|[r, g, _, _]| r > g.saturating_add(35));
        let teeth = share(&|[r, g, b, _]| r > 110 && r >= b && r.abs_diff(g) < 30);
        assert!(gum > 0.10 && teeth > 0.03, "{name}: {gum} gum, {teeth} teeth");
    }
}

#[test]
fn a_preview_shows_the_mouth_where_the_exercise_has_one() {
    // Aim: `typodont preview` draws what the trainee sees, then decay from two sides and cut. Method: with and without jaw the
    // first picture differs and the rest does not; a pair of teeth has no jaw to show.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scene");
    std::fs::create_dir_all(&folder).unwrap();
    let preview = |exercise: &str, more: &[&str], name: &str| {
        let path = folder.join(name);
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_typodont"));
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        let output = command.args(["preview", exercise, "-o"]).arg(&path).args(more).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let picture = image::open(&path).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (720 + 3 * 480, 480));
        picture
    };
    let half = |picture: &image::RgbImage, left: u32, width: u32| {
        (0..480 * width).map(|i| picture.get_pixel(left + i % width, i / width).0).collect::<Vec<_>>()
    };
    let with = preview("scenarios/5-grinding.json", &[], "preview.png");
    let without = preview("scenarios/5-grinding.json", &["--no-jaw"], "preview-no-jaw.png");
    assert!(half(&with, 0, 720) != half(&without, 0, 720));
    assert!(half(&with, 720, 1440) == half(&without, 720, 1440));
    let pair = preview("scenarios/2-decay.json", &["--jaw"], "preview-pair.png");
    assert!(half(&pair, 0, 720) != half(&without, 0, 720));
}

#[test]
fn a_mouth_mirror_shows_the_far_side_of_the_tooth() {
    // Aim: an instrument of the table reflects in the scene. Method: held behind the tooth, its face toward the way between
    // the tooth and the eye, it shows enamel where otherwise there is none; turned round, its steel back.
    let (scenario, workpiece) = exercise("5-grinding.json");
    let entry = InstrumentTable::read(&Library::shipped()).unwrap().by_id("mirror_5").unwrap().clone();
    let palette = tissue_palette(&scenario.tissues, true);
    let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
    let viewpoint = Orbit { azimuth: 0.1, elevation: 0.5, distance: 95.0, ..work_view(&workpiece) }.viewpoint();
    let tooth_middle = workpiece.world_from_tooth * (workpiece.teeth[0].crown.centre());
    let place = tooth_middle + Vec3::new(0.0, 11.0, -17.0);
    let halfway = (tooth_middle - place).normalize() + (viewpoint.position - place).normalize();
    let draw = |face: Vec3, name: &str| {
        // The face leans by 45° in the handle's own space; from there it is turned to where it is wanted.
        let own = mirror_face(&entry, Pose::IDENTITY).unwrap().world_from_mirror;
        let orientation = Quat::from_rotation_arc(own.rotate(Vec3::Z), face.normalize());
        let world_from_tip = Pose { position: place, orientation };
        let (held, complaint) = instrument_solid(&entry, &Library::shipped());
        assert!(complaint.is_none());
        let mut solids = mouth.one_jaw();
        solids.push(MeshInstance { world_from_solid: world_from_tip, ..held });
        let lights = Lights::along(&viewpoint);
        let mirror = mirror_face(&entry, world_from_tip);
        let scene =
            RenderScene { tooth: Some(tooth(&workpiece, &palette)), solids, mirror, lights, ..RenderScene::empty() };
        let image = OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, [780, 690]).unwrap();
        keep(name, &image);
        let ([x, y], _) = viewpoint.eye(780.0 / 690.0).project(place);
        let around = (0..1600u32)
            .map(|i| (i % 40, i / 40))
            .map(|(dx, dy)| image.pixel((x * 780.0) as u32 + dx - 20, (y * 690.0) as u32 + dy - 20));
        // Enamel and decay are warm, steel and sky are not.
        around.filter(|p| p[0] > p[2].saturating_add(4)).count()
    };
    let (shown, back) = (draw(halfway, "mirror"), draw(-halfway, "mirror-back"));
    assert!(shown > 800 && back < 100, "{shown} and {back} of 1600 pixels in its middle show the tooth");
}

#[test]
fn each_side_of_the_tooth_is_looked_at_squarely() {
    // Aim: a button that says "mesial" shows the mesial side, filling the picture.
    let (_, workpiece) = exercise("5-grinding.json");
    let place = &workpiece.teeth[0];
    let middle = place.crown.centre();
    for side in ToothSide::ALL {
        let viewpoint = tooth_view(&workpiece, side).viewpoint();
        let eye_in_tooth = workpiece.world_from_tooth.inverse() * viewpoint.position;
        let way = (eye_in_tooth - middle).normalize();
        let expected = match side {
            ToothSide::Occlusal => Vec3::Z,
            ToothSide::Buccal => Vec3::X,
            ToothSide::Lingual => Vec3::NEG_X,
            ToothSide::Mesial => Vec3::NEG_Y,
            ToothSide::Distal => Vec3::Y,
        };
        assert!(way.dot(expected) > 0.999, "{side:?}: {way}");
        let eye = viewpoint.eye(1.0);
        for corner in 0..8u32 {
            let share = Vec3::from([0, 1, 2].map(|a| (corner >> a & 1) as f32));
            let point = workpiece.world_from_tooth * (place.crown.low + place.crown.size() * share);
            let ([x, y], _) = eye.project(point);
            assert!((-0.1..1.1).contains(&x) && (-0.1..1.1).contains(&y), "{side:?}: {x} {y}");
        }
    }
}

#[test]
fn the_gap_fits_the_carved_tooth() {
    // Aim: the carved tooth stands in its jaw as if it had grown there. Method: a molar in the places of molars and
    // premolars: beside its crown there is a neighbour within half a millimetre, and none inside the box around it by more
    // than that box has rounded corners.
    let (scenario, mut workpiece) = exercise("5-grinding.json");
    workpiece.surroundings.clear();
    for fdi in [15, 25, 34, 36, 37, 46, 48] {
        workpiece.teeth[0].fdi = fdi;
        let ToothBounds { crown, .. } = workpiece.teeth[0];
        let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
        let [_, teeth] = &mouth.one_jaw()[..] else { panic!("gum and teeth") };
        let tooth_from_jaw = workpiece.world_from_tooth.inverse() * teeth.world_from_solid;
        let inside = |point: Vec3| (point - crown.low).min(crown.high - point).min_element();
        let corners: Vec<Vec3> = teeth.mesh.positions.iter().map(|p| tooth_from_jaw * *p).collect();
        let deepest = corners.iter().map(|p| inside(*p)).fold(f32::NEG_INFINITY, f32::max);
        assert!((-0.6..1.0).contains(&deepest), "{fdi}: a neighbour {deepest} mm inside");
    }
}

#[test]
fn gum_is_drawn_where_it_is_felt() {
    // Aim: the explorer stops at the gum that is seen. Method: near the tooth every place of the drawn gum that the
    // handpiece reaches lies on the surface that is touched.
    let (scenario, workpiece) = in_plain_gum();
    let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
    let gum_label = scenario.tissues.by_name("gingiva").unwrap().label();
    let felt = workpiece.surroundings.iter().find(|shape| shape.label == gum_label).unwrap();
    let ToothBounds { crown, .. } = workpiece.teeth[0];
    let solids = mouth.one_jaw();
    let tooth_from_gum = workpiece.world_from_tooth.inverse() * solids[0].world_from_solid;
    let near = solids[0].mesh.positions.iter().map(|p| tooth_from_gum * *p).filter(|p| {
        let aside = (*p - p.clamp(crown.low, crown.high)) * Vec3::new(1.0, 1.0, 0.0);
        let is_in_tooth = ((*p - crown.centre()) / crown.half_size()).truncate().length() < 0.8;
        aside.length() < 5.0 && p.z > crown.low.z - 5.0 && !is_in_tooth
    });
    let off: Vec<f32> = near.map(|p| felt.distance(p).abs()).collect();
    assert!(off.len() > 200, "{} places", off.len());
    assert!(off.iter().all(|d| *d < 0.05), "{:?}", off.iter().copied().fold(0.0, f32::max));
    assert_eq!(solids.len(), 2 + 2, "gum, teeth, and two neighbours as they are felt");
}

#[test]
fn no_gum_shows_in_a_cavity() {
    // Aim: whoever looks into a tooth sees the tooth. Method: no drawn gum lies within the inner part of the crown, with and
    // without a modelled margin.
    for name in ["8-fissure.json", "12-deep-caries.json", "10-class-one.json", "5-grinding.json"] {
        let (scenario, workpiece) = exercise(name);
        let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap_or_else(|| panic!("{name} has no mouth"));
        let [gum, ..] = &mouth.one_jaw()[..] else { panic!("{name} has no gum") };
        let crown = workpiece.teeth[0].crown;
        let tooth_from_gum = workpiece.world_from_tooth.inverse() * gum.world_from_solid;
        let inner = |p: Vec3| ((p - crown.centre()) / crown.half_size()).truncate().length() < 0.5;
        let places = gum.mesh.triangles.iter().map(|t| t.map(|i| tooth_from_gum * gum.mesh.positions[i as usize]));
        let all = places.flat_map(|[a, b, c]| [a, b, c, (a + b + c) / 3.0]);
        let within: Vec<f32> = all.filter(|p| inner(*p)).map(|p| p.z - crown.low.z).collect();
        let highest = within.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        assert!(within.len() > 50 && highest < -4.0, "{name}: {} places, {highest} mm above the neck", within.len());
    }
}

#[test]
fn under_gum_that_is_a_mesh_the_drawn_gum_does_not_show() {
    // Aim: a school's own gum is what is seen near the tooth. Method: the usual gum as a mesh; the jaw's own lies under it.
    let (scenario, mut workpiece) = in_plain_gum();
    let gum_label = scenario.tissues.by_name("gingiva").unwrap().label();
    let usual = workpiece.surroundings.iter().find(|shape| shape.label == gum_label).unwrap().clone();
    let middle = usual.tooth_from_collider.position;
    let grid = Grid::covering(middle - 24.0, middle + 24.0, Vec3::splat(0.8), 3);
    let mesh = surface::extract(&Volume::from_distance(grid, 1.2, |p| (usual.distance(p), gum_label)));
    let form = ColliderGeometry::Mesh(Arc::new(ClosedMesh::new(&mesh).unwrap()));
    workpiece.surroundings = vec![Collider { label: gum_label, tooth_from_collider: Pose::IDENTITY, geometry: form }];
    let ToothBounds { crown, .. } = workpiece.teeth[0];
    let solids = Mouth::around(&workpiece, &scenario.tissues).unwrap().one_jaw();
    assert_eq!(solids.len(), 2 + 1, "gum, teeth, and the mesh itself");
    let tooth_from_gum = workpiece.world_from_tooth.inverse() * solids[0].world_from_solid;
    let near = solids[0].mesh.positions.iter().map(|p| tooth_from_gum * *p).filter(|p| {
        let aside = (*p - p.clamp(crown.low, crown.high)) * Vec3::new(1.0, 1.0, 0.0);
        aside.length() < 5.0 && p.z > crown.low.z - 5.0
    });
    let highest = near.map(|p| workpiece.surroundings[0].distance(p)).fold(f32::NEG_INFINITY, f32::max);
    assert!((-0.6..-0.2).contains(&highest), "{highest} mm");
}

#[test]
fn the_mouth_opens_about_the_condyles() {
    // Aim: the jaws part in front and stay together behind. Method: the way of the opposite jaw's front and back corners.
    let (scenario, workpiece) = exercise("5-grinding.json");
    let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
    let arch_from_world = mouth.world_from_arch().inverse();
    let gap = |open: f32| {
        let teeth = &mouth.solids(open)[3];
        let places = teeth.mesh.positions.iter().map(|p| arch_from_world * (teeth.world_from_solid * *p));
        let lowest =
            |is: &dyn Fn(&Vec3) -> bool| places.clone().filter(|p| is(p)).map(|p| p.z).fold(f32::INFINITY, f32::min);
        [lowest(&|p| p.x.abs() < 4.0), lowest(&|p| p.x.abs() > 20.0)]
    };
    let ([closed, _], [open, behind]) = (gap(0.0), gap(WORKING_OPENING_DEG));
    assert!((-4.0..0.0).contains(&closed), "overbite of {closed} mm");
    assert!((28.0..45.0).contains(&open), "{open} mm between the incisors");
    assert!(behind < 0.75 * open, "{behind} mm between the molars");
}

#[test]
fn the_opposite_jaw_is_left_out_where_it_hides_the_work() {
    // Aim: a tooth is seen from above though the opposite jaw would be before it, as the lower jaw is before an upper tooth, which stands
    // upright; from the front both jaws are there. Method: the solids of both views for teeth of both jaws.
    for fdi in [16, 26, 36, 46] {
        let text = std::fs::read_to_string(scenarios().join("17-mouth-diagnosis.json")).unwrap();
        let mut root: serde_json::Value = serde_json::from_str(&text).unwrap();
        root["scene"]["jaw"].as_object_mut().unwrap().remove("other_teeth");
        root["scene"]["jaw"]["tooth"]["fdi"] = fdi.into();
        root["scene"]["jaw"]["retractors"] = (fdi < 30).into();
        root["scene"]["jaw"]["tooth"]["form"]["procedural"]["spacing_mm"] = 0.3.into();
        let stage = root["stages"][0].as_object_mut().unwrap();
        stage.remove("draw");
        stage.remove("ask");
        stage.insert("ends_when".into(), serde_json::json!(["confirmed"]));
        root.as_object_mut().unwrap().remove("rubric");
        let (scenario, workpiece) =
            resolved(typodont_formats::decode_text("upper.json", root.to_string().into_bytes()).unwrap());
        let mouth = Mouth::around(&workpiece, &scenario.tissues).unwrap();
        let solids = mouth.solids(WORKING_OPENING_DEG);
        let seen = |viewpoint: &Viewpoint| mouth.seen_from(&solids, viewpoint, WORKING_OPENING_DEG, None).len();
        let (work, front) = (work_view(&workpiece).viewpoint(), mouth.front_view(WORKING_OPENING_DEG).viewpoint());
        // Lips frame what is seen through them, and nothing else: with cheeks and throat, the tongue, and retractors if there are any.
        assert_eq!(seen(&front), solids.len() + if fdi < 30 { 4 } else { 3 }, "{fdi}");
        assert_eq!(seen(&work), solids.len() - 2, "{fdi}: without teeth and gum of the opposite jaw");
    }
}
