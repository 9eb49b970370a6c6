//! All teeth of a jaw in one volume: where they stand, what lies around them, and that a recording gives the same.

use crate::support::bundle::typodont;
use crate::support::folder::folder;
use serde_json::{Value, json};
use typodont_core::frame::Vec3;
use typodont_core::touch::Collider;
use typodont_core::volume::ISO;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece, resolve};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_lesson::ToothScan;

/// The shipped arch with voxels of 0.3 mm and changes.
fn arch(mode: ResolveMode, change: impl Fn(&mut Value)) -> Scenario {
    let text =
        include_str!("../../scenarios/16-arch-diagnosis.json").replace("\"spacing_mm\": 0.2", "\"spacing_mm\": 0.3");
    let mut root: Value = serde_json::from_str(&text).unwrap();
    change(&mut root);
    let source = SourceText::new("arch.json", root.to_string());
    resolve(source, &Library::shipped(), mode).unwrap_or_else(|found| panic!("{found:?}"))
}

/// Name of the tissue that an instrument from above meets first over a point of tooth space.
fn met_from_above(scenario: &Scenario, workpiece: &Workpiece, x: f32, y: f32) -> String {
    let top = workpiece.bounds().high.z + 2.0;
    let distance = |collider: &&Collider, p: Vec3| collider.distance(p);
    for step in 0..600 {
        let p = Vec3::new(x, y, top - 0.05 * step as f32);
        if workpiece.volume.density_at(p) >= ISO {
            return "tooth".into();
        }
        if let Some(hit) = workpiece.surroundings.iter().find(|collider| distance(collider, p) < 0.0) {
            return scenario.tissues.by_label(hit.label).unwrap().name.clone();
        }
    }
    "nothing".into()
}

#[test]
fn every_tooth_of_a_jaw_stands_in_the_arch_with_its_own_form() {
    // Aim: 14 teeth of voxels where the arch has them. Method: the crown of each, along its own axes, against the sizes of its form;
    // seen from the front, the patient's left is on the right; and decay lies in the quarter that was written.
    let scenario = arch(ResolveMode::MakeWorkpiece, |_| ());
    let workpiece = Workpiece::make(&scenario, 0).unwrap();
    assert_eq!(workpiece.teeth.len(), 14);
    for tooth in &workpiece.teeth {
        let sizes = typodont_anatomy::teeth::tooth(tooth.fdi).unwrap().sizes;
        let found = tooth.own_crown.size();
        let wanted = Vec3::new(sizes.buccolingual[0], sizes.mesiodistal[0], found.z);
        assert!((found - wanted).abs().max_element() < 0.8, "{}: {found}, not {wanted}", tooth.fdi);
        let is_left = tooth.fdi / 10 == 3;
        assert_eq!(tooth.crown.centre().y > 0.0, is_left, "{}", tooth.fdi);
        let world = workpiece.world_from_tooth * tooth.crown.centre();
        assert_eq!(world.x > 0.0, is_left, "{}: {world}", tooth.fdi);
        // Distal is away from the midline and back.
        assert!(tooth.distal().x < 0.3, "{}: {}", tooth.fdi, tooth.distal());
    }
    let incisor = workpiece.teeth.iter().find(|tooth| tooth.fdi == 31).unwrap();
    let molar = workpiece.teeth.iter().find(|tooth| tooth.fdi == 37).unwrap();
    let front = |point: Vec3| (workpiece.world_from_tooth * point).z;
    assert!(front(incisor.crown.centre()) > front(molar.crown.centre()) + 25.0, "the front faces the trainee");
    assert_eq!(workpiece.lesions.len(), 32);
    for lesion in &workpiece.lesions {
        let (tooth, quadrant) = lesion.id.split_once('-').unwrap();
        assert_eq!(workpiece.teeth[lesion.tooth].id, tooth);
        assert_eq!(lesion.quadrant.to_string(), quadrant, "{}", lesion.id);
        let nearest = workpiece.nearest_tooth(lesion.centre).map(|index| &workpiece.teeth[index].id[..]);
        assert_eq!(nearest, Some(tooth));
        // Its voxels are there: the site has a label of its own.
        let grid = workpiece.volume.grid();
        let own = grid.cells().enumerate().filter(|(index, _)| workpiece.volume.tissue(*index) == lesion.label);
        let own: Vec<Vec3> = own.map(|(_, cell)| grid.centre(cell)).collect();
        assert!(own.len() > 20, "{}: {} voxels", lesion.id, own.len());
        let farthest = own.iter().map(|place| place.distance(lesion.centre)).fold(0.0, f32::max);
        assert!(farthest < 2.2, "{}: {farthest} mm off", lesion.id);
    }
}

#[test]
fn gingiva_palate_and_floor_of_the_mouth_are_met_beside_the_teeth() {
    // Aim: an instrument meets something everywhere over a jaw, and it is the tissue that is there. Method: straight down over the
    // middles of all crowns, beside them, and over the middle of the jaw.
    for (fdi, inner) in [(36, "mouth_floor"), (16, "palate")] {
        let scenario = arch(ResolveMode::MakeWorkpiece, |root| {
            let site = |quadrant: u8| {
                json!({ "id": format!("site-{quadrant}"), "shape": { "sphere": { "radius_mm": 1.5 } },
                "surface": "O", "at": { "quadrant": quadrant }, "depth_mm": 0.3 })
            };
            let form = json!({ "procedural": { "spacing_mm": 0.3 } });
            let tooth = json!({ "id": "tooth", "fdi": fdi, "form": form, "decay": [site(1), site(4)] });
            root["scene"]["dental_arch"]["teeth"] = json!([tooth]);
            root["scene"]["dental_arch"]["arch"] = json!({ "missing": [fdi - 1] });
            root["stages"][0]["draw"]["one_of"] = json!(["site-1", "site-4"]);
            root["stages"][0]["ask"].as_array_mut().unwrap().remove(0);
        });
        let workpiece = Workpiece::make(&scenario, 0).unwrap();
        assert_eq!(workpiece.teeth.len(), 13, "one tooth is missing");
        for tooth in &workpiece.teeth {
            let middle = tooth.crown.centre();
            assert_eq!(met_from_above(&scenario, &workpiece, middle.x, middle.y), "tooth", "{}", tooth.fdi);
            let outside = tooth.tooth_from_own * (tooth.own_crown.centre().with_x(tooth.own_crown.high.x + 2.0));
            assert_eq!(met_from_above(&scenario, &workpiece, outside.x, outside.y), "gingiva", "{}", tooth.fdi);
        }
        let bounds = workpiece.crown_bounds();
        let middle = bounds.centre();
        assert_eq!(met_from_above(&scenario, &workpiece, middle.x - 5.0, 3.0), inner);
        assert_eq!(met_from_above(&scenario, &workpiece, middle.x - 5.0, -3.0), inner);
    }
}

#[test]
fn an_arch_from_a_recording_is_the_one_that_was_made() {
    // Aim: what is scored is what was worked on. Method: teeth, decay and surroundings from the volume alone against those that were
    // made, with a rotated and a missing tooth.
    let turned = |root: &mut Value| {
        root["scene"]["dental_arch"]["arch"] =
            json!({ "rotated": [{ "fdi": 36, "degrees": 20 }, { "fdi": 33, "degrees": -15 }], "missing": [31] });
    };
    let scenario = arch(ResolveMode::MakeWorkpiece, turned);
    let made = Workpiece::make(&scenario, 3).unwrap();
    let recorded = arch(ResolveMode::FromRecording, turned);
    let replayed = Workpiece::from_volume(&recorded, made.volume.clone(), None, 3).unwrap();
    assert_eq!(replayed.teeth, made.teeth);
    assert_eq!(replayed.lesions, made.lesions);
    assert_eq!(replayed.drawn, made.drawn);
    assert_eq!(replayed.world_from_tooth, made.world_from_tooth);
    assert_eq!(format!("{:?}", replayed.surroundings), format!("{:?}", made.surroundings));
    // And the rotated tooth is turned from where it stands otherwise.
    let straight = Workpiece::make(&arch(ResolveMode::MakeWorkpiece, |_| ()), 3).unwrap();
    let distal = |workpiece: &Workpiece| workpiece.teeth.iter().find(|tooth| tooth.fdi == 36).unwrap().distal();
    let turn = distal(&made).angle_between(distal(&straight)).to_degrees();
    assert!((turn - 20.0).abs() < 3.0, "{turn}°");
}

#[test]
fn a_scanned_tooth_takes_the_place_of_one_in_the_arch() {
    // Aim: teeth of an arch are exchanged one by one. Method: tooth 36 from a label map of finer voxels, worn by 70 years, in an arch of
    // unworn ones; it stands where 36 stands, lower than the tooth that was there.
    let folder = folder("arch_exchange");
    let output =
        typodont(&["anatomy", "--fdi", "36", "--age", "70", "--spacing-mm", "0.2", "-o", folder.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text =
        include_str!("../../scenarios/16-arch-diagnosis.json").replace("\"spacing_mm\": 0.2", "\"spacing_mm\": 0.3");
    let mut root: Value = serde_json::from_str(&text).unwrap();
    let map = json!({ "file": "36.seg.nrrd", "tissues": { "1": "enamel", "2": "dentine", "3": "pulp" } });
    root["scene"]["dental_arch"]["teeth"][1]["form"] = json!({ "labels": map });
    let library = Library::shipped().with_folder(&folder);
    let source = SourceText::new("exchanged.json", root.to_string());
    let exchanged = resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap_or_else(|found| panic!("{found:?}"));
    let [worn, unworn] = [exchanged, arch(ResolveMode::MakeWorkpiece, |_| ())].map(|scenario| {
        let workpiece = Workpiece::make(&scenario, 0).unwrap();
        workpiece.teeth.iter().find(|tooth| tooth.fdi == 36).unwrap().clone()
    });
    assert_eq!(worn.tooth_from_own, unworn.tooth_from_own);
    let (place, usual) = (worn.crown.centre(), unworn.crown.centre());
    assert!((place - usual).truncate().length() < 0.6, "{place} instead of {usual}");
    let lost = unworn.crown.high.z - worn.crown.high.z;
    assert!((0.5..2.5).contains(&lost), "{lost} mm lower");
    // The same by the command line's option, which must say which tooth is meant.
    let scan = |fdi: Option<u8>| ToothScan::read(&folder.join("36.seg.nrrd"), None, fdi).unwrap();
    let mut scenario = arch(ResolveMode::MakeWorkpiece, |_| ());
    assert!(scan(None).replace_teeth(&mut scenario).is_err());
    assert!(scan(Some(16)).replace_teeth(&mut scenario).is_err());
    scan(Some(36)).replace_teeth(&mut scenario).unwrap();
    let workpiece = Workpiece::make(&scenario, 0).unwrap();
    let tooth = workpiece.teeth.iter().find(|tooth| tooth.fdi == 36).unwrap();
    // This way a volume is cropped to whole voxels of its own.
    let off = |a: Vec3, b: Vec3| (a - b).abs().max_element();
    assert!(off(tooth.crown.low, worn.crown.low) < 0.35 && off(tooth.crown.high, worn.crown.high) < 0.35);
}
