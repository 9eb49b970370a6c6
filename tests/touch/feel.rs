//! Age and tool change how a tissue feels, and nothing else does.

use crate::support::phantom;

use phantom::*;
use serde_json::{Value, json};
use typodont_core::device::Reading;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Setup, Simulation};
use typodont_core::touch::{Coefficient, Instrument, MaterialScale, MaterialScales, WorkingEnd};
use typodont_core::volume::Label;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

/// N after a second half a millimetre deep in a wall.
fn pressed(sim: &mut Simulation) -> f32 {
    (0..2000)
        .map(|tick| sim.step(&Reading::at(Vec3::Z * (0.5 - tick as f32 * 1e-3).max(-0.5))).force.length())
        .last()
        .unwrap()
}

#[test]
fn an_instrument_feels_the_wall_through_its_own_factors() {
    // Aim: a factor of a half halves the force of its instrument only, also after a tissue was given another stiffness.
    let wall = volume([40, 40, 40], 0.1, |p| (p.z, HARD));
    let world = setup(wall, WorkingEnd::Point, false);
    let half = MaterialScales::default().with(HARD, MaterialScale { stiffness: 0.5, ..MaterialScale::ONE });
    let mut instruments = world.instruments.clone();
    instruments.push(Instrument::new(WorkingEnd::Point, false));
    let mut sim =
        Simulation::new(Setup { instruments, material_scales: vec![MaterialScales::default(), half], ..world });
    let mut check = |command: Option<Command>, expected: f32| {
        command.iter().for_each(|c| sim.apply(c));
        let force = pressed(&mut sim);
        assert!((force - expected).abs() < 0.01, "{command:?}: {force} N, not {expected}");
    };
    check(None, 0.5);
    check(Some(Command::SelectInstrument { instrument: 1 }), 0.25);
    check(Some(Command::SetCoefficient { label: HARD, coefficient: Coefficient::Stiffness, value: 0.8 }), 0.2);
    check(Some(Command::SelectInstrument { instrument: 0 }), 0.4);
}

#[test]
fn a_hand_that_was_lost_for_a_moment_takes_hold_again() {
    // Aim: a machine's hiccup costs the force, which comes back softly, and not the tooth: nobody passes through it. Method: half
    // a millimetre deep in a wall one reading is lost; then the hand is there, or far inside, or holds something else.
    let leaning = || {
        let world = setup(volume([80, 80, 80], 0.1, |p| (p.z, HARD)), WorkingEnd::Point, false);
        let instruments = vec![Instrument::new(WorkingEnd::Point, false); 2];
        let mut sim = Simulation::new(Setup { ramp: 500, instruments, ..world });
        assert!((pressed(&mut sim) - 0.5).abs() < 0.01);
        let lost = sim.step(&Reading::ABSENT);
        assert_eq!((lost.force, lost.touch), (Vec3::ZERO, None));
        sim
    };
    let mut sim = leaning();
    let held = follow(&mut sim, (0..700).map(|_| Vec3::Z * -0.6));
    let rise = held.windows(2).map(|w| (w[1].force - w[0].force).length()).fold(held[0].force.length(), f32::max);
    assert!(rise < 0.005, "a step of {rise} N");
    let last = held.last().unwrap();
    assert!((last.force.length() - 0.6).abs() < 0.01 && last.tip.z.abs() < 0.02, "{last:?}");

    let is_through = |sim: &mut Simulation, depth: f32| {
        follow(sim, (0..700).map(|_| Vec3::Z * -depth)).iter().all(|step| step.force == Vec3::ZERO)
    };
    assert!(is_through(&mut leaning(), 3.5), "a hand that has gone far inside is not thrown out");
    // While cutting, the hand is millimetres beyond the surface, and a wall may be thinner than that.
    let plate = volume([80, 80, 80], 0.1, |p| ((p.z.abs() - 0.4), HARD));
    let world = setup(plate, WorkingEnd::Point, false);
    let mut sim = Simulation::new(Setup { ramp: 500, ..world });
    let lean = |sim: &mut Simulation| follow(sim, (0..4000).map(|t| Vec3::Z * (1.5 - t as f32 * 1e-3).max(-2.0)));
    assert!(lean(&mut sim).last().unwrap().tip.z > 0.3, "held by the plate");
    sim.step(&Reading::ABSENT);
    let back = follow(&mut sim, (0..700).map(|_| Vec3::Z * -2.5));
    assert!(back[1..].iter().all(|step| step.tip.z > 0.3), "held again, and not behind the plate");
    let mut sim = leaning();
    sim.apply(&Command::SelectInstrument { instrument: 1 });
    assert!(is_through(&mut sim, 0.5), "another instrument was never outside");
}

fn read(change: impl FnOnce(&mut Value)) -> Scenario {
    let mut scenario: Value =
        serde_json::from_str(&std::fs::read_to_string("scenarios/5-grinding.json").unwrap()).unwrap();
    change(&mut scenario);
    scenario::resolve(SourceText::new("x.json", scenario.to_string()), &Library::shipped(), ResolveMode::FromRecording)
        .unwrap()
}

#[test]
fn without_patient_and_kind_nothing_changes() {
    // Aim: exercises written before feel as they did, to the last bit.
    assert!(read(|_| ()).factors.iter().all(|f| *f == MaterialScales::default()));
}

#[test]
fn old_dentine_is_harder_and_a_diamond_drags_more() {
    let (enamel, dentine) = (Label(1), Label(2));
    let of = |age: f64, tool: &str| {
        read(|s| {
            s["patient"] = json!({ "age_years": age });
            s["instruments"] = json!([tool]);
        })
        .factors[0]
            .clone()
    };
    let (young, old) = (of(25.0, "round_bur_014"), of(70.0, "round_bur_014"));
    assert_eq!(young.get(dentine), MaterialScale::ONE);
    assert!(old.get(dentine).hardness > 1.1 && old.get(dentine).stiffness > 1.0);
    let (diamond, carbide) = (of(25.0, "diamond_round_014"), of(25.0, "carbide_round_014"));
    assert!(diamond.get(enamel).dynamic_friction > carbide.get(enamel).dynamic_friction);
    // A coarse grain takes more: the tissue is as if softer.
    let (fine, coarse) = (of(25.0, "diamond_round_014_fine"), of(25.0, "diamond_round_014_coarse"));
    assert!((fine.get(enamel).hardness / coarse.get(enamel).hardness - 4.0).abs() < 1e-4);
}
