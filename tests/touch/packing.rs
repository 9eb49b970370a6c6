//! Placement of filling material by a carrier and its packing by a condenser: place, amount, and bit-exact repetition.

use crate::support::phantom;

use phantom::*;
use typodont_core::device::Reading;
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Setup, Simulation};
use typodont_core::touch::{
    Body, FillingMaterial, Instrument, Material, MaterialScale, MaterialScales, PackingTip, Profile,
};
use typodont_core::volume::{Edit, Label, Volume};

const AMALGAM: Label = Label(21);

const FILLING: FillingMaterial =
    FillingMaterial { label: AMALGAM, min_force: 0.2, condense_force: 1.2, void_share: 0.2 };

/// Carrier, condenser and carver, in this order.
const CARRIER: usize = 0;
const CONDENSER: usize = 1;
const CARVER: usize = 2;

/// A block with its top at z = 0, and a round cavity of 1.5 mm radius in it, 2 mm deep.
fn block(spacing: f32) -> Volume {
    let dims = [(7.0 / spacing) as u32; 3];
    volume(dims, spacing, |p| {
        let hole = (p.truncate().length() - 1.5).max(-2.0 - p.z);
        (p.z.max(-hole), HARD)
    })
}

fn flat(radius: f32) -> Instrument {
    Instrument::with_body(Body::revolved(Profile::frustum(radius, 0.9 * radius, 2.0, [0.06; 2]), None), false)
}

fn world(spacing: f32) -> Setup {
    let base = setup(block(spacing), typodont_core::touch::WorkingEnd::Point, false);
    let soft = Material {
        stiffness: 0.5,
        damping: 0.5,
        static_friction: 0.2,
        dynamic_friction: 0.2,
        cut_force: Some(0.15),
        hardness: Some(5.0),
    };
    let blade = Body::revolved(Profile::round_ended(0.2, 0.5, 2.0), None);
    let stops = MaterialScales::default().with(HARD, MaterialScale { cut_force: f32::INFINITY, ..MaterialScale::ONE });
    Setup {
        materials: base.materials.with(AMALGAM, soft),
        instruments: vec![
            flat(0.75).with_packing_tip(PackingTip { rate: 4.0, condenses: false }),
            flat(0.75).with_packing_tip(PackingTip { rate: 0.0, condenses: true }),
            Instrument::with_body(blade, true).non_rotary(),
        ],
        material_scales: vec![MaterialScales::default(), MaterialScales::default(), stops],
        fillings: vec![FILLING],
        ..base
    }
}

/// A hand that presses down with about a force for some ticks, and yields where it is pushed back.
fn press(sim: &mut Simulation, at: Vec3, force: f32, ticks: u32, mut each: impl FnMut(&Simulation, &[Edit])) {
    let mut hand = at;
    for _ in 0..ticks {
        let step = sim.step(&Reading::at(hand));
        each(sim, sim.edits());
        hand.z -= ((force - step.force.z) * 0.015).clamp(-0.01, 0.005);
    }
    // And up again.
    for _ in 0..400 {
        hand.z += 0.02;
        sim.step(&Reading::at(hand));
        each(sim, sim.edits());
    }
}

fn amalgam_mm3(volume: &Volume) -> f64 {
    volume.count(AMALGAM) as f64 * volume.grid().voxel_mm3()
}

/// A plug in the middle of the cavity, after some ticks of pressing.
fn filled(spacing: f32, force: f32, ticks: u32) -> (Simulation, Vec<Edit>) {
    let mut sim = Simulation::new(world(spacing));
    sim.apply(&Command::SetFilling { label: Some(AMALGAM) });
    let mut edits = Vec::new();
    press(&mut sim, Vec3::new(0.0, 0.0, -1.0), force, ticks, |_, e| edits.extend_from_slice(e));
    (sim, edits)
}

#[test]
fn a_carrier_lays_what_its_rate_says_and_every_edit_is_told() {
    // Aim: 4 mm³/s, at two voxel sizes; the stream of edits alone gives the same volume. Method: 0.9 s of
    // pressing, of which the first third is the way down.
    let mut laid = Vec::new();
    for spacing in [0.1, 0.2] {
        let (sim, edits) = filled(spacing, 1.5, 900);
        let mut copy = block(spacing);
        assert!(edits.iter().all(|e| copy.apply_edit(e)));
        assert_eq!(copy.densities(), sim.volume().densities());
        laid.push(amalgam_mm3(sim.volume()));
        assert!(edits.iter().all(|e| e.after.density >= e.before.density), "a carrier takes nothing away");
    }
    println!("{laid:?} mm³");
    assert!((1.5..4.0).contains(&laid[0]), "{laid:?}");
    assert!((laid[0] / laid[1] - 1.0).abs() < 0.25, "whatever the voxels' size: {laid:?}");
}

#[test]
fn nothing_is_laid_in_free_air_nor_without_a_filling_nor_without_force() {
    let mut sim = Simulation::new(world(0.2));
    sim.apply(&Command::SetFilling { label: Some(AMALGAM) });
    for tick in 0..500 {
        // Through the air above, and within the cavity without touching it.
        let hand = Vec3::new(0.3 * (tick as f32 * 0.01).sin(), 0.0, if tick < 250 { 1.5 } else { -1.0 });
        sim.step(&Reading::at(hand));
        assert!(sim.edits().is_empty());
    }
    press(&mut sim, Vec3::new(0.0, 0.0, -1.0), 0.1, 1500, |_, edits| assert!(edits.is_empty(), "0.1 N is too little"));
    sim.apply(&Command::SetFilling { label: None });
    press(&mut sim, Vec3::new(0.0, 0.0, -1.0), 1.5, 1500, |_, edits| assert!(edits.is_empty(), "nothing to lay"));
}

#[test]
fn what_is_laid_hangs_together_with_the_tooth() {
    // Aim: no voxel in the middle of nothing. Method: from the tooth every laid voxel is reached.
    let (sim, _) = filled(0.1, 1.5, 900);
    let volume = sim.volume();
    let grid = *volume.grid();
    let mut reached = vec![false; grid.len()];
    let mut front: Vec<usize> = (0..grid.len()).filter(|&v| volume.tissue(v) == HARD).collect();
    front.iter().for_each(|&v| reached[v] = true);
    while let Some(voxel) = front.pop() {
        for next in grid.neighbours(voxel) {
            if !reached[next] && volume.tissue(next) != Label::AIR {
                reached[next] = true;
                front.push(next);
            }
        }
    }
    assert!((0..grid.len()).all(|v| volume.tissue(v) != AMALGAM || reached[v]));
    // And inside what is soft at its surface it is full: the ramp is kept.
    let full = (0..grid.len()).filter(|&v| volume.tissue(v) == AMALGAM && volume.densities()[v].unit() == 1.0).count();
    assert!(full * 2 > volume.count(AMALGAM), "{full} of {}", volume.count(AMALGAM));
}

/// Air that amalgam or tooth encloses, mm³.
fn voids_mm3(volume: &Volume) -> f64 {
    let grid = *volume.grid();
    let is_air = |v: usize| volume.tissue(v) == Label::AIR;
    let mut open = vec![false; grid.len()];
    let mut front = vec![grid.len() - 1];
    while let Some(voxel) = front.pop() {
        for next in grid.neighbours(voxel) {
            if !open[next] && is_air(next) {
                open[next] = true;
                front.push(next);
            }
        }
    }
    (0..grid.len()).filter(|&v| is_air(v) && !open[v]).count() as f64 * grid.voxel_mm3()
}

#[test]
fn light_packing_leaves_voids_and_condensing_closes_them_out_of_the_surface() {
    // Aim: voids by too little force, none by enough; a condenser closes them, and what fills them comes from the surface.
    let (firm, _) = filled(0.1, 1.5, 900);
    let (mut light, _) = filled(0.1, 0.45, 750);
    let (none, some) = (voids_mm3(firm.volume()), voids_mm3(light.volume()));
    let before = mass_mm3(light.volume());
    light.apply(&Command::SelectInstrument { instrument: CONDENSER });
    for place in [Vec3::ZERO, Vec3::X * 0.5, Vec3::X * -0.5, Vec3::Y * 0.5, Vec3::Y * -0.5] {
        press(&mut light, place + Vec3::Z * 2.0, 2.0, 1400, |_, _| ());
    }
    let (left, after) = (voids_mm3(light.volume()), mass_mm3(light.volume()));
    println!(
        "voids: firm {none:.3}, light {some:.3}, condensed {left:.3} mm³; amalgam {before:.3}, then {after:.3} mm³"
    );
    assert!(none < 0.1 && some > 0.05, "{none} {some}");
    assert!(left < 0.4 * some, "{left} of {some}");
    assert!((after / before - 1.0).abs() < 0.03, "condensing neither makes nor takes amalgam: {before} {after}");
}

/// Amalgam by its density, mm³.
fn mass_mm3(volume: &Volume) -> f64 {
    let laid = volume.labels().iter().zip(volume.densities()).filter(|(l, _)| **l == AMALGAM);
    laid.map(|(_, d)| f64::from(d.unit())).sum::<f64>() * volume.grid().voxel_mm3()
}

#[test]
fn the_same_hand_lays_the_same_bits() {
    let ((one, edits), (other, again)) = (filled(0.2, 0.5, 900), filled(0.2, 0.5, 900));
    assert_eq!(edits, again);
    assert_eq!(one.volume().densities(), other.volume().densities());
}

#[test]
fn a_carver_takes_amalgam_and_rests_on_enamel() {
    // Aim: over the filling it sinks, over the block it does not, whatever the force. Method: the same strokes.
    let (mut sim, _) = filled(0.1, 1.5, 900);
    sim.apply(&Command::SelectInstrument { instrument: CARVER });
    let [hard, soft] = [HARD, AMALGAM].map(|l| sim.volume().count(l));
    for place in [Vec3::new(0.0, 0.0, 2.5), Vec3::new(2.4, 0.0, 2.5), Vec3::new(1.5, 0.0, 2.5)] {
        press(&mut sim, place, 3.0, 2500, |_, edits| assert!(edits.iter().all(|e| e.before.label != HARD)));
    }
    assert_eq!(sim.volume().count(HARD), hard);
    assert!(sim.volume().count(AMALGAM) < soft, "{} of {soft}", sim.volume().count(AMALGAM));
}

#[test]
fn packing_never_allocates() {
    let mut sim = Simulation::new(world(0.1));
    sim.apply(&Command::SetFilling { label: Some(AMALGAM) });
    let mut changed = [0; 3];
    let counted = allocation_counter::measure(|| {
        for (instrument, force, ticks) in [(CARRIER, 0.45, 1400), (CONDENSER, 2.0, 2000), (CARVER, 1.0, 2000)] {
            sim.apply(&Command::SelectInstrument { instrument });
            press(&mut sim, Vec3::new(0.2, 0.0, 2.5), force, ticks, |_, edits| changed[instrument] += edits.len());
        }
    });
    assert!(changed.iter().all(|&n| n > 100), "{changed:?}");
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
