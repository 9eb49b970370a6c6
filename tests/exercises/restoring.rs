//! A cavity is filled, condensed and carved; the recording proves it, and the score is taken from that.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use typodont_core::sim::Command;
use typodont_core::volume::Label;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Workpiece};
use typodont_exercise::score;
use typodont_exercise::score::Verdict;
use typodont_exercise::session::{Effect, Session};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

const SCENARIO: &str = "scenarios/14-amalgam.json";

#[test]
fn a_filled_tooth_is_measured_shown_and_proved_from_its_recording() {
    // Aim: what is laid comes back from the readings alone, and the map says what the measures say. Method: a hasty filling in
    // coarse voxels and half a minute, scored, verified, and its voxels counted by verdict.
    let text = std::fs::read_to_string(format!("{}/{SCENARIO}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let file = folder("restoring").join("14-amalgam.json");
    let text = text.replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.2");
    std::fs::write(&file, text.replace("\"time_limit_s\": 480", "\"time_limit_s\": 25")).unwrap();
    let bundle = run(file.to_str().unwrap(), "hasty", &folder("restored"), &[]);
    let session = session(&bundle);
    let of = |name| metric(&session, name).unwrap();
    assert!(of("filled_pct") > 5.0 && of("contour_p95_mm") > 0.1, "{} {}", of("filled_pct"), of("contour_p95_mm"));
    let verified = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
    let recording = Recording::read(&bundle.join("recording.mcap")).unwrap();
    let scored = score::score(&recording, ReplayCheck::Skip).unwrap();
    let grid = scored.replay.volume.grid();
    let mm3 = |verdict| scored.verdicts.iter().filter(|v| **v == verdict).count() as f64 * grid.voxel_mm3();
    assert!((mm3(Verdict::Void) - of("void_mm3")).abs() < 1e-9);
    let cavity = mm3(Verdict::Restored) + mm3(Verdict::Underfilled) + mm3(Verdict::Void);
    assert!((100.0 * mm3(Verdict::Restored) / cavity - of("filled_pct")).abs() < 1e-6);
    assert!(mm3(Verdict::Underfilled) + mm3(Verdict::Overfilled) > 0.5, "a hasty filling shows");
}

#[test]
fn a_stage_gives_its_filling_and_the_next_one_takes_it_back() {
    let text = std::fs::read_to_string(format!("{}/{SCENARIO}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let text = text.replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.4");
    let scenario =
        scenario::resolve(SourceText::new("14.json", text), &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
    let amalgam = scenario.tissues.by_name("fresh_amalgam").map(|t| t.label());
    let workpiece = Workpiece::make(&scenario, 1).unwrap();
    let original = workpiece.original.clone().unwrap();
    let solid = |volume: &typodont_core::volume::Volume| volume.tissues().filter(|l| *l != Label::AIR).count();
    let taken = (solid(&original) - solid(&workpiece.volume)) as f64 * original.grid().voxel_mm3();
    assert!((20.0..34.0).contains(&taken), "4 × 3 × 2 mm and what lies over it: {taken} mm³");
    let mut session = Session::new(scenario.into(), &workpiece);
    let told = |effects: Vec<Effect>| -> Vec<Command> {
        effects
            .into_iter()
            .filter_map(|e| if let Effect::Command(command) = e { Some(command) } else { None })
            .collect()
    };
    assert!(told(session.begin()).contains(&Command::SetFilling { label: amalgam }));
    let confirmed =
        session.advance(typodont_exercise::session::SessionEvent::Input(&typodont_exercise::session::Input::Confirm));
    assert!(told(confirmed).contains(&Command::SetFilling { label: None }));
}
