//! Effects of a patient's age on teeth and gingiva, measured on voxels and on the gingival margin, not read from the
//! rates.

use typodont_anatomy::periodontium::ProbingSite;
use typodont_anatomy::{TissueLabels, age, caliper, grid_of_spacing, grow, teeth};
use typodont_core::frame::Vec3;
use typodont_core::touch::ClosedMesh;
use typodont_core::volume::{Label, Volume, surface};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

fn tooth(fdi: u8, years: Option<f32>, spacing: f32) -> Volume {
    let form = teeth::tooth_of_age(fdi, years).unwrap();
    grow(&form, grid_of_spacing(&form, spacing), &TISSUES)
}

fn pulp_mm3(tooth: &Volume) -> f64 {
    tooth.count(TISSUES.pulp) as f64 * tooth.grid().voxel_mm3()
}

/// A tissue's shadow on an X-ray from the cheek's side, mm².
fn shadow(tooth: &Volume, tissue: Label) -> f32 {
    let of_tissue = tooth.grid().cells().zip(tooth.tissues()).filter(|(_, t)| *t == tissue);
    let seen: std::collections::HashSet<[u32; 2]> = of_tissue.map(|([_, y, z], _)| [y, z]).collect();
    seen.len() as f32 * tooth.grid().spacing.y * tooth.grid().spacing.z
}

/// Height of the surface over a place, mm, finer than a voxel.
fn height(tooth: &Volume, place: [f32; 2]) -> f32 {
    let grid = tooth.grid();
    let [x, y, _] = grid.nearest(Vec3::new(place[0], place[1], 0.0)).unwrap();
    let top = (0..grid.dims[2]).rev().find(|&z| tooth.tissue(grid.index([x, y, z])) != Label::AIR).unwrap();
    let [inside, outside] = [top, top + 1].map(|z| tooth.voxel(grid.index([x, y, z])).density.unit());
    grid.centre([x, y, top]).z + (inside - 0.5) / (inside - outside).max(1e-3) * grid.spacing.z
}

#[test]
fn the_pulp_narrows_from_year_to_year() {
    // Aim: at 30 the pulp is as written, before larger, then ever smaller; at 70 a canine's casts half the shadow (0.062 of
    // 0.126 of the tooth's) and a molar's chamber is about half as high. Method: voxels counted and measured.
    for fdi in [11, 23, 24, 16, 36] {
        let volumes = [12.0, 30.0, 45.0, 60.0, 75.0, 90.0].map(|years| pulp_mm3(&tooth(fdi, Some(years), 0.1)));
        println!("{fdi}: pulp {volumes:.2?} mm³");
        assert_eq!(volumes[1], pulp_mm3(&tooth(fdi, None, 0.1)), "{fdi}");
        assert!(volumes.windows(2).all(|pair| pair[1] < 0.95 * pair[0]), "{fdi}: {volumes:?}");
    }
    let [young, old] = [30.0, 70.0].map(|years| shadow(&tooth(13, Some(years), 0.1), TISSUES.pulp));
    println!("shadow of 13's pulp: {young:.1} mm², at 70 {old:.1} mm²");
    assert!((0.42..0.58).contains(&(old / young)), "{old} mm² of {young} mm²");
    let chamber = |years: f32| {
        let tooth = tooth(36, Some(years), 0.05);
        let grid = tooth.grid();
        let [x, y, _] = grid.nearest(Vec3::ZERO).unwrap();
        let is_pulp = |z: &u32| tooth.tissue(grid.index([x, y, *z])) == TISSUES.pulp;
        (0..grid.dims[2]).filter(is_pulp).count() as f32 * grid.spacing.z
    };
    let [young, old] = [30.0, 70.0].map(chamber);
    println!("chamber of 36: {young:.2} mm, at 70 {old:.2} mm");
    assert!((0.35..0.6).contains(&(old / young)), "{old} mm of {young} mm");
}

#[test]
fn cusps_and_edges_wear_and_nothing_else_does() {
    // Aim: what chewing takes is what was measured in mouths: 29 µm a year of the buccal cusps of a lower molar, 15 µm of an edge;
    // roots and widths stay. Method: heights over the unworn tips, and a caliper.
    let drop = |fdi: u8, place: [f32; 2], years: f32| {
        height(&tooth(fdi, None, 0.1), place) - height(&tooth(fdi, Some(years), 0.1), place)
    };
    let form = teeth::tooth(36).unwrap();
    let at = |cusp: usize| {
        let [x, y, _] = form.occlusal.cusps[cusp].tip;
        [x * 0.5 * form.sizes.buccolingual[0], y * 0.5 * form.sizes.mesiodistal[0]]
    };
    for (years, buccal) in [(20.0, 0.39), (45.0, 1.12), (70.0, 1.84)] {
        let [working, guiding] = [drop(36, at(0), years), drop(36, at(1), years)];
        println!("36 at {years}: {working:.2} mm off the mesiobuccal cusp, {guiding:.2} mm off the mesiolingual one");
        assert!((working - buccal).abs() < 0.15, "{working} mm at {years}");
        assert!((guiding - 0.5 * buccal).abs() < 0.15, "{guiding} mm at {years}");
    }
    let edge = drop(11, [0.18 * 3.5, 0.0], 70.0);
    assert!((edge - 0.94).abs() < 0.12, "{edge} mm off the edge of 11");
    for fdi in [11, 13, 14, 36, 26] {
        let [new, old] = [None, Some(70.0)]
            .map(|years| caliper::sizes(&tooth(fdi, years, 0.1), &TISSUES, teeth::is_mirrored(fdi)).unwrap());
        assert_eq!(
            (new.root, new.mesiodistal[1], new.buccolingual),
            (old.root, old.mesiodistal[1], old.buccolingual),
            "{fdi}"
        );
        assert!(new.crown - old.crown > 0.25, "{fdi}: {} mm and {} mm", new.crown, old.crown);
    }
    // Worn, not thicker anywhere: what the old tooth has, the new one had.
    let [new, old] = [None, Some(90.0)].map(|years| tooth(36, years, 0.15));
    assert!(new.tissues().zip(old.tissues()).all(|(new, old)| old == Label::AIR || new != Label::AIR));
}

#[test]
#[ignore = "scripts/test --long"]
fn every_tooth_holds_together_at_every_age() {
    // Aim: a thread of a pulp is one piece and lies in dentine, a worn crown is closed. Method: as for unworn teeth, on the right side;
    // the left is its mirror image.
    for fdi in (11..=18).chain(31..=38) {
        for years in [age::MIN_AGE, 50.0, age::MAX_AGE] {
            let tooth = tooth(fdi, Some(years), 0.1);
            let grid = tooth.grid();
            let tissues: Vec<Label> = tooth.tissues().collect();
            let pulp = (0..grid.len()).filter(|&i| tissues[i] == TISSUES.pulp);
            let mut open: Vec<usize> = pulp.clone().take(1).collect();
            let mut seen: std::collections::HashSet<usize> = open.iter().copied().collect();
            while let Some(index) = open.pop() {
                let next = grid.neighbours(index).filter(|n| tissues[*n] == TISSUES.pulp);
                open.extend(next.filter(|n| seen.insert(*n)));
            }
            assert_eq!(seen.len(), pulp.clone().count(), "{fdi} at {years}: the pulp is in pieces");
            for index in pulp {
                let is_wall = |n: usize| tissues[n] == TISSUES.pulp || tissues[n] == TISSUES.dentine;
                assert!(grid.neighbours(index).all(is_wall), "{fdi} at {years}: {}", grid.centre(grid.cell(index)));
            }
            assert!(ClosedMesh::new(&surface::extract(&tooth)).is_some(), "{fdi} at {years} is not closed");
        }
    }
}

fn exercise(patient: &str, periodontium: &str) -> Result<Workpiece, String> {
    let text = format!(
        r#"{{ "id": "age", "title": "Age", {patient} "scene": {{ "jaw": {{ "tooth": {{ "id": "tooth", "fdi": 36, "form": {{
        "procedural": {{ "spacing_mm": 0.2 }} }} }}, "periodontium": {periodontium} }} }}, "instruments": ["explorer"],
        "stages": [ {{ "id": "look", "title": "Look", "instruction": "Look.", "time_limit_s": 10 }} ] }}"#
    );
    let source = SourceText::new("age.json", text);
    let scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece)
        .map_err(|found| found.iter().map(|d| d.to_string()).collect::<String>())?;
    Ok(Workpiece::make(&scenario, 0).unwrap())
}

#[test]
fn an_author_has_the_mouth_look_its_age() {
    // Aim: the key reaches tooth, neighbours and gum; without it an age only changes how tissues feel, so older recordings stay what
    // they were. Method: voxels, and heights of the gum's margin.
    let plain = exercise("", "{}").unwrap();
    let felt = exercise(r#""patient": { "age_years": 70 },"#, "{}").unwrap();
    assert!(plain.volume.densities() == felt.volume.densities() && plain.volume.labels() == felt.volume.labels());
    assert_eq!(plain.periodontium.as_ref().unwrap().pockets, felt.periodontium.as_ref().unwrap().pockets);
    let patient = r#""patient": { "age_years": 70, "shows_age": true },"#;
    let old = exercise(patient, "{}").unwrap();
    let pulp = |workpiece: &Workpiece| workpiece.volume.count(Label(3));
    assert!(pulp(&old) * 2 < pulp(&plain), "{} of {} voxels", pulp(&old), pulp(&plain));
    let margin =
        |workpiece: &Workpiece, site: ProbingSite| workpiece.periodontium.as_ref().unwrap().margin(site.azimuth());
    let gone = ProbingSite::ALL.map(|site| margin(&plain, site) - margin(&old, site));
    println!("at 70 the margin of 36 has gone back by {gone:.2?} mm");
    assert!((gone.iter().sum::<f32>() / 6.0 - 0.9).abs() < 0.15, "{gone:?}");
    assert!(gone[1] > gone[0] + 0.3, "most on the cheek's side: {gone:?}");
    let height = |workpiece: &Workpiece| workpiece.teeth[0].crown.high.z;
    assert!(height(&plain) - height(&old) > 0.5);
    let ours = exercise(patient, r#"{ "recession_mm": { "B": -0.8 } }"#).unwrap();
    assert!(
        (margin(&ours, ProbingSite::Buccal) - margin(&plain, ProbingSite::Buccal)).abs() < 0.05,
        "what is written stays"
    );
    let complaint = exercise(r#""patient": { "age_years": 8, "shows_age": true },"#, "{}").unwrap_err();
    assert!(complaint.contains("cannot show an age of 8 years: expected 12 to 90"), "{complaint}");
}
