//! A tooth among all others of the mouth: what is drawn can be touched, and a recording of the one tooth gives the others again.

use serde_json::Value;
use typodont_core::frame::Vec3;
use typodont_core::touch::ColliderGeometry;
use typodont_core::volume::{ISO, Volume};
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece, resolve};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_scene::{Mouth, WORKING_OPENING_DEG};

/// The shipped mouth with changes.
fn mouth(mode: ResolveMode, change: impl Fn(&mut Value)) -> Scenario {
    let mut root: Value = serde_json::from_str(include_str!("../../scenarios/17-mouth-diagnosis.json")).unwrap();
    change(&mut root);
    let source = SourceText::new("mouth.json", root.to_string());
    resolve(source, &Library::shipped(), mode).unwrap_or_else(|found| panic!("{found:?}"))
}

#[test]
fn every_tooth_of_the_mouth_is_touched_where_it_is_drawn() {
    // Aim: 28 teeth of voxels, one of them finer, none inside another, and no drawn crown beside what is felt. Method: distances of the
    // drawn meshes' corners from the felt voxels, and the voxels of each tooth in its neighbours.
    let scenario = mouth(ResolveMode::MakeWorkpiece, |_| ());
    let workpiece = Workpiece::make(&scenario, 0).unwrap();
    assert_eq!((workpiece.teeth.len(), workpiece.teeth_in_volume), (28, 1));
    assert_eq!(workpiece.volume.grid().spacing, Vec3::splat(0.1));
    let others: Vec<(&Volume, _)> = (1..28).map(|tooth| workpiece.voxels_beside(tooth).unwrap()).collect();
    assert!(others.iter().all(|(volume, _)| volume.grid().spacing == Vec3::splat(0.15)));
    for (index, tooth) in workpiece.teeth.iter().enumerate() {
        let is_upper = tooth.fdi < 30;
        assert_eq!(workpiece.is_overhead(index), is_upper, "{}", tooth.fdi);
        // Occlusal surfaces face each other across the open mouth.
        let occlusal = tooth.tooth_from_own.rotate(Vec3::Z);
        assert!(if is_upper { occlusal.z < -0.6 } else { occlusal.z > 0.7 }, "{}: {occlusal}", tooth.fdi);
    }
    let height = |fdi: u8| workpiece.teeth.iter().find(|tooth| tooth.fdi == fdi).unwrap().crown.centre().z;
    assert!((35.0..60.0).contains(&(height(11) - height(31))), "{} mm between the incisors", height(11) - height(31));
    assert!((18.0..40.0).contains(&(height(27) - height(37))), "{} mm between the molars", height(27) - height(37));

    let drawn = Mouth::around(&workpiece, &scenario.tissues).unwrap().solids(WORKING_OPENING_DEG);
    let tooth_from_world = workpiece.world_from_tooth.inverse();
    let shapes: Vec<_> = workpiece.surroundings.iter().collect();
    let (mut corners, mut beside) = (0, 0);
    for solid in &drawn {
        for place in solid.mesh.positions.iter().step_by(7) {
            let place = tooth_from_world * (solid.world_from_solid * *place);
            // Below the gingiva the drawn roots end sooner than the felt ones.
            let felt = shapes.iter().map(|shape| shape.distance(place)).fold(f32::INFINITY, f32::min);
            corners += 1;
            beside += usize::from(felt > 0.2);
        }
    }
    println!("{beside} of {corners} corners are more than 0.2 mm outside of what is felt");
    assert!(corners > 10_000 && beside * 100 < corners, "{beside} of {corners}");

    let all = std::iter::once((&*workpiece.volume, workpiece.teeth[0].tooth_from_own)).chain(others);
    let all: Vec<(&Volume, _)> = all.collect();
    for (a, (volume, tooth_from_own)) in all.iter().enumerate() {
        let grid = volume.grid();
        let cells = grid.cells().enumerate().step_by(5).filter(|(index, _)| volume.densities()[*index].is_solid());
        let places: Vec<Vec3> = cells.map(|(_, cell)| *tooth_from_own * grid.centre(cell)).collect();
        for (b, (other, other_pose)) in all.iter().enumerate().filter(|(b, _)| a != *b) {
            let own_from_tooth = other_pose.inverse();
            let shared = places.iter().filter(|place| other.density_at(own_from_tooth * **place) >= ISO).count();
            let [fdi, other_fdi] = [a, b].map(|tooth| workpiece.teeth[tooth].fdi);
            assert!(shared * 500 < places.len(), "{fdi} in {other_fdi}: {shared} of {}", places.len());
        }
    }
}

#[test]
fn a_recording_of_one_tooth_gives_the_others_again() {
    // Aim: what is scored is what was touched. Method: teeth, lesions and surroundings from the recorded volume against those that
    // were made, with a rotated, a missing and a third molar.
    let change = |root: &mut Value| {
        root["scene"]["jaw"]["arch"] =
            serde_json::json!({ "rotated": [{ "fdi": 45, "degrees": 20 }], "missing": [14, 38], "angle_class": "II" });
        let mut third = root["scene"]["jaw"]["other_teeth"]["teeth"][0].clone();
        (third["id"], third["fdi"], third["decay"]) = ("28".into(), 28.into(), serde_json::json!([]));
        root["scene"]["jaw"]["other_teeth"]["teeth"].as_array_mut().unwrap().push(third);
    };
    let made = Workpiece::make(&mouth(ResolveMode::MakeWorkpiece, change), 3).unwrap();
    assert_eq!(made.teeth.len(), 28, "one more and one less");
    assert!(made.teeth.iter().any(|tooth| tooth.fdi == 28) && !made.teeth.iter().any(|tooth| tooth.fdi == 14));
    assert_eq!(made.lesions.len(), 32);
    for lesion in &made.lesions {
        let tooth = &made.teeth[lesion.tooth];
        let (fdi, quadrant) = lesion.id.split_once('-').unwrap();
        assert_eq!((tooth.fdi.to_string().as_str(), lesion.quadrant.to_string().as_str()), (fdi, quadrant));
        let other = (lesion.tooth > 0).then_some(lesion.tooth);
        assert_eq!(made.other_tooth_at(lesion.centre), other, "{}", lesion.id);
    }
    let recorded = mouth(ResolveMode::FromRecording, change);
    let replayed = Workpiece::from_volume(&recorded, made.volume.clone(), None, 3).unwrap();
    assert_eq!(replayed.teeth, made.teeth);
    assert_eq!(replayed.lesions, made.lesions);
    assert_eq!((replayed.drawn, replayed.world_from_tooth), (made.drawn, made.world_from_tooth));
    assert_eq!(replayed.surroundings.len(), made.surroundings.len());
    for (a, b) in replayed.surroundings.iter().zip(&made.surroundings) {
        assert_eq!((a.label, a.tooth_from_collider), (b.label, b.tooth_from_collider));
        if let (ColliderGeometry::Voxels(a), ColliderGeometry::Voxels(b)) = (&a.geometry, &b.geometry) {
            assert!(a.densities() == b.densities() && a.labels() == b.labels());
        }
    }
}

#[test]
fn caries_on_the_other_teeth_alone_leaves_nothing_to_remove() {
    // Aim: the treated tooth may be sound; what is examined only is no target and is not missed in the volume.
    let scenario = mouth(ResolveMode::MakeWorkpiece, |root| {
        root["scene"]["jaw"]["tooth"]["decay"] = serde_json::json!([]);
        let sites = root["stages"][0]["draw"]["one_of"].as_array_mut().unwrap();
        sites.retain(|site| !site.as_str().unwrap().starts_with("36"));
    });
    let workpiece = Workpiece::make(&scenario, 0).unwrap();
    assert_eq!((workpiece.lesions.len(), workpiece.lesions_in_volume().len()), (28, 0));
    assert!(!scenario.has_target());
}
