//! Cheek and tongue: soft, and hurt by a rotating bur.

use typodont_core::device::{DeviceSpec, Reading};
use typodont_core::frame::{Pose, Vec3};
use typodont_core::sim::{Command, Simulation, Touch};
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::scenario::{self, ResolveMode, Scenario, Workpiece};
use typodont_exercise::session;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

fn made() -> (Scenario, Workpiece) {
    let text = include_str!("../../scenarios/7-spray.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
    let source = SourceText::new("7-spray.json", text);
    let scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
    let workpiece = Workpiece::make(&scenario, 1).unwrap();
    (scenario, workpiece)
}

/// A tip on its way toward buccal; distances from the crown, mm.
struct Moment {
    hand: f32,
    /// Of the tip as it is shown.
    shown: f32,
    touch: Option<Touch>,
}

/// Moves a tip from beside the crown straight toward buccal.
fn toward_buccal(scenario: &Scenario, workpiece: &Workpiece, instrument: usize) -> Vec<Moment> {
    let device = DeviceSpec { max_force: 100.0, ..DeviceSpec::phantom_omni() };
    let mut simulation = Simulation::new(session::setup(scenario, workpiece, device));
    simulation.apply(&Command::SelectInstrument { instrument });
    let (crown, world_from_tooth) = (workpiece.teeth[0].crown, workpiece.world_from_tooth);
    let moved = (0..1400).map(|tick| {
        let aside = 2.0 + 0.01 * tick as f32;
        let hand = Vec3::new(crown.high.x + aside, 0.0, crown.high.z + 3.0);
        let pose = Pose { position: world_from_tooth * hand, orientation: world_from_tooth.orientation };
        let step = simulation.step(&Reading { pose, buttons: 0 });
        let shown = (world_from_tooth.inverse() * step.tip).x - crown.high.x;
        Moment { hand: aside, shown, touch: step.touch }
    });
    moved.collect()
}

#[test]
fn the_cheek_gives_way_and_holds_at_last() {
    // Aim: soft tissue feels soft and is seen to give way. Method: a probe and two burs move 6 mm into the cheek; its force is
    // 0.05 N/mm, and the shown tip goes with the hand for 5 mm and not farther. What is touched is soft tissue, so that a
    // rotating bur there counts as an injury.
    let (scenario, workpiece) = made();
    for (instrument, entry) in scenario.instruments.iter().enumerate() {
        let moved = toward_buccal(&scenario, &workpiece, instrument);
        let met = moved.iter().position(|moment| moment.touch.is_some()).unwrap();
        let (surface, label) = (moved[met].hand, moved[met].touch.unwrap().label);
        assert!((8.0..9.2).contains(&surface), "{}: met at {surface} mm", entry.id);
        assert_eq!(scenario.tissues.role(label), Some(TissueRole::Soft), "{}", entry.id);
        for Moment { hand, shown, touch } in &moved[met..] {
            let deep = hand - surface;
            let force = touch.unwrap().spring;
            assert!((force - 0.05 * deep).abs() < 0.03, "{}: {force} N at {deep} mm", entry.id);
            if deep < 4.0 {
                assert!((hand - shown).abs() < 0.35, "{}: shown at {shown}, not {hand}", entry.id);
            }
            assert!(*shown < surface + 5.3, "{}: shown at {shown}", entry.id);
        }
    }
}

#[test]
fn cheek_and_tongue_are_beside_the_teeth_where_they_are_in_a_mouth() {
    // Aim: an author cannot place a tongue beside an upper tooth. Method: the shipped exercise with other teeth.
    let text = include_str!("../../scenarios/7-spray.json");
    for (fdi, complaints) in [(36, 0), (45, 0), (16, 1), (41, 2), (21, 2)] {
        let text = text.replace("\"fdi\": 36", &format!("\"fdi\": {fdi}"));
        let source = SourceText::new("7-spray.json", text);
        let found = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece);
        let count = found.err().map_or(0, |found| found.iter().filter(|each| each.code == "no-neighbour").count());
        assert_eq!(count, complaints, "tooth {fdi}");
    }
}

#[test]
fn retractors_need_lips() {
    // Aim: an author learns that nothing of what was asked for is drawn. Method: an exercise with retractors, in the generated jaw and in
    // one of its own.
    let text = include_str!("../../scenarios/14-amalgam.json");
    for (jaw, complaints) in [("\"retractors\": true", 0), ("\"own_jaw\": true, \"retractors\": true", 1)] {
        let source = SourceText::new("14-amalgam.json", text.replace("\"rubber_dam\": true", jaw));
        let found = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece);
        let count = found.err().map_or(0, |found| found.iter().filter(|each| each.code == "no-lips").count());
        assert_eq!(count, complaints, "{jaw}");
    }
}

#[test]
fn a_rubber_dam_hides_nothing_that_has_to_be_seen() {
    // Aim: an author cannot cover what the exercise asks for. Method: the shipped exercise with a dam, with each thing beside it.
    let text = include_str!("../../scenarios/14-amalgam.json");
    let others = [
        ("", 0),
        ("\"cheek\": true,", 1),
        ("\"tongue\": true,", 1),
        ("\"other_teeth\": {},", 1),
        ("\"retractors\": true,", 1),
    ];
    for (other, complaints) in others {
        let text = text.replace("\"rubber_dam\": true", &format!("{other} \"rubber_dam\": true"));
        let source = SourceText::new("14-amalgam.json", text);
        let found = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece);
        let count = found.err().map_or(0, |found| found.iter().filter(|each| each.code == "hidden-by-dam").count());
        assert_eq!(count, complaints, "{other}");
    }
}
