//! The synthesiser by itself: audible and inaudible effects of the load.

use crate::support::hearing;

use hearing::*;
use std::collections::{BTreeMap, BTreeSet};
use typodont_audio::{CRIES, DrillLoad, Synth, SynthOptions, Tool};

fn synth() -> Synth {
    Synth::new(&SynthOptions::default())
}

fn hear(synth: &mut Synth, load: &DrillLoad, seconds: f32) -> Vec<f32> {
    let mut block = vec![0.0; (seconds * RATE as f32) as usize];
    synth.fill(load, &mut block);
    block
}

/// A second of a load, once everything has settled.
fn settled(load: &DrillLoad) -> Vec<f32> {
    let mut synth = synth();
    hear(&mut synth, load, 1.0);
    hear(&mut synth, load, 1.0)
}

/// Sound that contact adds to a settled load, sample by sample. The reference is the same handpiece on the tooth with a
/// surface that does not move, which makes no contact sound.
fn contact_alone(load: &DrillLoad) -> Vec<f32> {
    let held = settled(&DrillLoad { surface_speed: 0.0, ..*load });
    settled(load).iter().zip(&held).map(|(both, handpiece)| both - handpiece).collect()
}

#[test]
fn a_free_handpiece_sings_at_its_speed() {
    // Aim: the pitch is the rotor's. Method: the strongest line of a turbine at three speeds.
    for speed in [150_000.0, 300_000.0, 400_000.0] {
        let spectrum = Spectrum::of(&settled(&DrillLoad { speed, ..idle() }));
        let peak = spectrum.peak(1000.0, 20_000.0);
        assert!((peak / (speed / 60.0) - 1.0).abs() < 0.02, "{speed} rpm: {peak} Hz");
    }
}

#[test]
fn a_turbine_gives_way_under_the_hand_and_a_motor_does_not() {
    // Aim: pitch falls with force as the drive lets it. Method: the rotor's line with and without 1 N.
    let share = |tool: Tool| {
        let free = DrillLoad { tool, ..idle() };
        let held = DrillLoad { tool, ..grinding(1.0) };
        let pitch = |load: &DrillLoad| Spectrum::of(&settled(load)).peak(2500.0, 5500.0);
        pitch(&held) / pitch(&free)
    };
    let (turbine, motor) = (share(Tool::AirTurbine), share(Tool::Electric));
    assert!((0.6..0.75).contains(&turbine), "{turbine}");
    assert!((0.93..0.99).contains(&motor), "{motor}");
}

#[test]
fn grinding_is_louder_the_harder_it_is_pressed() {
    for tool in [Tool::AirTurbine, Tool::Electric, Tool::LowSpeed] {
        let loud = |force: f32| level(&contact_alone(&DrillLoad { tool, ..grinding(force) }));
        let [light, usual, heavy] = [0.25, 1.0, 2.0].map(loud);
        assert!(light > 0.0 && usual > 1.3 * light && heavy > 1.05 * usual, "{tool:?}: {light} {usual} {heavy}");
    }
}

#[test]
fn what_rubs_is_quieter_than_what_cuts() {
    let cutting = level(&settled(&grinding(1.0)));
    let rubbing = level(&settled(&DrillLoad { is_cutting: false, ..grinding(1.0) }));
    assert!(cutting > 1.2 * rubbing && rubbing > 0.0, "{cutting} {rubbing}");
}

#[test]
fn the_harder_the_tissue_the_brighter_the_sound() {
    // Aim: enamel, dentine, decay and gum are told apart by ear. Method: mean frequency of what contact adds, for a drill and for
    // a probe.
    let tissues = [("enamel", 300.0), ("dentine", 60.0), ("decay", 15.0), ("gum", 0.0)];
    for load in [grinding(1.0), DrillLoad { tool: Tool::Electric, ..grinding(1.0) }, scratching()] {
        let bright =
            tissues.map(|(_, hardness)| Spectrum::of(&contact_alone(&DrillLoad { hardness, ..load })).brightness());
        let is_falling = bright.windows(2).all(|pair| pair[0] > 1.15 * pair[1]);
        assert!(is_falling, "{:?}: {tissues:?} sound at {bright:?} Hz", load.tool);
    }
}

#[test]
fn contact_is_heard_and_gone_within_20_ms() {
    // Aim: ear and hand agree. Method: the level from 10 to 20 ms after touch and release, beside the settled ones.
    let window = |samples: &[f32]| level(&samples[480..960]);
    for (free, touching) in [
        (idle(), grinding(1.0)),
        (DrillLoad { tool: Tool::Electric, ..idle() }, DrillLoad { tool: Tool::Electric, ..grinding(1.0) }),
        (DrillLoad { tool: Tool::Hand, ..DrillLoad::default() }, scratching()),
    ] {
        let mut synth = synth();
        let before = level(&hear(&mut synth, &free, 1.0)[24_000..]);
        let touch = hear(&mut synth, &touching, 0.5);
        let contact = level(&touch[12_000..]);
        let release = hear(&mut synth, &free, 0.5);
        let tool = free.tool;
        assert!(window(&touch) > 0.5 * contact, "{tool:?}: {} of {contact}", window(&touch));
        assert!(window(&release) < 1.1 * before + 1e-9, "{tool:?}: {} after {before}", window(&release));
        // After the release there is no contact sound: only the pitch of the bur, which recovers. A probe is silent.
        assert!(contact > 1.2 * before, "{tool:?}: {contact} {before}");
        assert!(tool != Tool::Hand || release[960..].iter().all(|s| *s == 0.0));
    }
}

#[test]
fn nothing_is_heard_where_nothing_touches_and_nothing_runs() {
    // Aim: silence is zero, not nearly zero. Method: before anything, with a bur that stands on a tooth, and two seconds after
    // everything was on.
    let mut synth = synth();
    let everything = DrillLoad { is_suction_on: true, is_spray_on: true, ..grinding(2.0) };
    let standing = DrillLoad { is_running: false, ..grinding(2.0) };
    assert!(hear(&mut synth, &DrillLoad::default(), 0.5).iter().all(|s| *s == 0.0));
    assert!(hear(&mut synth, &standing, 0.5).iter().all(|s| *s == 0.0));
    assert!(level(&hear(&mut synth, &everything, 0.5)) > 0.05);
    hear(&mut synth, &DrillLoad::default(), 2.0);
    assert!(hear(&mut synth, &DrillLoad::default(), 0.5).iter().all(|s| *s == 0.0));
}

#[test]
fn nothing_clicks_as_it_comes_and_goes() {
    // Aim: on, off and every change are free of clicks. Method: dull sounds, in which a click would be the largest step; around
    // every change no step is larger than the settled sounds before and after it have.
    let soft =
        DrillLoad { hardness: 0.0, tool: Tool::LowSpeed, speed: 6000.0, surface_speed: 10_000.0, ..grinding(2.0) };
    let rest = DrillLoad::default();
    let suction = DrillLoad { is_suction_on: true, ..rest };
    let low = DrillLoad { is_touching: false, ..soft };
    let changes = [
        ("touch", low, soft),
        ("release", soft, low),
        ("suction on", rest, suction),
        ("suction off", suction, rest),
        ("probe on gum", rest, DrillLoad { hardness: 0.0, ..scratching() }),
        ("probe off gum", DrillLoad { hardness: 0.0, ..scratching() }, rest),
        ("gum to enamel", soft, DrillLoad { hardness: 300.0, ..soft }),
        ("another handpiece", DrillLoad { tool: Tool::Electric, ..low }, low),
        ("faster", low, DrillLoad { speed: 12_000.0, ..low }),
        ("start", rest, low),
        ("stop", low, rest),
    ];
    for (name, from, to) in changes {
        for seed in 0..8 {
            let mut synth = Synth::new(&SynthOptions { seed, ..SynthOptions::default() });
            hear(&mut synth, &from, 0.9 + 0.0117 * seed as f32);
            let before = hear(&mut synth, &from, 0.5);
            let mut change = before[before.len() - 480..].to_vec();
            change.extend(hear(&mut synth, &to, 0.05));
            hear(&mut synth, &to, 0.8);
            let after = hear(&mut synth, &to, 0.5);
            let usual = largest_step(&before).max(largest_step(&after));
            assert!(largest_step(&change) < 1.3 * usual, "{name}, seed {seed}: {} of {usual}", largest_step(&change));
        }
    }
}

#[test]
fn contact_fades_and_is_not_cut() {
    // Aim: noise hides a cut from a look at steps, not from the ear. Method: the level of the first millisecond of touch and of
    // release, over many seeds, beside the usual level: touch begins faint, release begins nearly as loud as before.
    let rest = DrillLoad { tool: Tool::Hand, ..DrillLoad::default() };
    let touching = DrillLoad { surface_speed: 60.0, ..scratching() };
    let (mut first, mut last, mut usual) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..32 {
        let mut synth = Synth::new(&SynthOptions { seed, ..SynthOptions::default() });
        hear(&mut synth, &rest, 0.1);
        let touch = hear(&mut synth, &touching, 0.3);
        first.extend(&touch[..48]);
        usual.extend(&touch[4800..]);
        last.extend(&hear(&mut synth, &rest, 0.1)[..48]);
    }
    let (first, last, usual) = (level(&first), level(&last), level(&usual));
    assert!(first < 0.3 * usual && last > 0.6 * usual, "{first} {last} of {usual}");
}

#[test]
fn the_same_seed_sounds_the_same_however_it_is_cut() {
    // Aim: a server that asks for other blocks changes nothing. Method: one block against many, for one seed; another seed differs.
    let whole = hear(&mut synth(), &grinding(1.0), 0.5);
    let mut cut = vec![0.0; whole.len()];
    let mut same = synth();
    cut.chunks_mut(16 * 7).for_each(|block| same.fill(&grinding(1.0), block));
    assert_eq!(whole, cut);
    let other = hear(&mut Synth::new(&SynthOptions { seed: 1, ..SynthOptions::default() }), &grinding(1.0), 0.5);
    assert_ne!(whole, other);
}

#[test]
fn what_is_no_number_does_no_harm() {
    let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30];
    let mut synth = synth();
    for value in wild {
        let load = DrillLoad { speed: value, force: value, surface_speed: value, hardness: value, ..grinding(1.0) };
        synth.cry(value);
        for load in [load, DrillLoad { speed: 300_000.0, ..load }, DrillLoad { tool: Tool::Hand, ..load }] {
            assert!(hear(&mut synth, &load, 0.2).iter().all(|s| s.abs() <= 1.0), "{value}");
        }
    }
    assert!(level(&hear(&mut synth, &idle(), 1.0)) > 0.01, "it sounds again afterwards");
}

#[test]
fn filling_never_allocates() {
    let mut synth = synth();
    let mut block = [0.0; 480];
    let loads =
        [idle(), grinding(0.5), DrillLoad { is_suction_on: true, is_spray_on: true, ..grinding(3.0) }, scratching()];
    let mut loudest = 0.0f32;
    let counted = allocation_counter::measure(|| {
        for i in 0..2000 {
            synth.cry(0.5);
            synth.fill(&loads[i / 7 % loads.len()], &mut block);
            loudest = block.iter().fold(loudest, |peak, s| peak.max(s.abs()));
        }
    });
    assert!(loudest > 0.1);
    assert_eq!(counted.count_total, 0);
}

/// Begins a cry and listens to its end.
fn whole_cry(synth: &mut Synth) -> (usize, Vec<f32>) {
    synth.cry(1.0);
    let which = synth.current_cry().unwrap();
    let (mut said, mut block) = (Vec::new(), [0.0; 16]);
    while synth.current_cry().is_some() {
        synth.fill(&DrillLoad::default(), &mut block);
        said.extend(block);
    }
    (which, said)
}

#[test]
fn fourteen_cries_are_fourteen() {
    // Aim: no two cries sound alike. Method: the mean difference in dB of third-octave bands in four parts of each; or a length
    // that differs by a quarter.
    let mut synth = synth();
    let mut cries = BTreeMap::new();
    while cries.len() < CRIES {
        let (which, said) = whole_cry(&mut synth);
        cries.insert(which, said);
    }
    let prints: Vec<(f32, Vec<f32>)> = cries.values().map(|said| (said.len() as f32, print(said))).collect();
    for (i, (length, bands)) in prints.iter().enumerate() {
        for (j, (other_length, other)) in prints.iter().enumerate().skip(i + 1) {
            let far = bands.iter().zip(other).map(|(a, b)| (a - b).abs()).sum::<f32>() / bands.len() as f32;
            let longer = (length / other_length).max(other_length / length);
            assert!(far > 3.0 || (far > 2.0 && longer > 1.25), "cries {i} and {j}: {far} dB, {longer} times as long");
        }
    }
    assert!(cries.values().all(|said| (0.15..1.5).contains(&(said.len() as f32 / RATE as f32))));
}

/// Levels in dB of third-octave bands from 150 Hz up, in four parts, each beside the loudest.
fn print(said: &[f32]) -> Vec<f32> {
    let parts = said.chunks(said.len() / 4).take(4).map(Spectrum::of);
    let levels: Vec<f32> = parts
        .flat_map(|part| {
            (0..18).map(move |band| {
                let from = 150.0 * 2f32.powf(band as f32 / 3.0);
                part.power(from, from * 2f32.powf(1.0 / 3.0))
            })
        })
        .collect();
    let loudest = levels.iter().copied().fold(0.0, f32::max);
    // A sound 50 dB below the loudest one is inaudible beside it.
    levels.iter().map(|level| (10.0 * (level / loudest).max(1e-5).log10()).max(-50.0)).collect()
}

#[test]
fn cries_are_drawn_by_the_seed_and_never_twice_in_a_row() {
    let draw = |seed: u64| {
        let mut synth = Synth::new(&SynthOptions { seed, ..SynthOptions::default() });
        (0..120).map(|_| whole_cry(&mut synth).0).collect::<Vec<usize>>()
    };
    let first = draw(1);
    assert_eq!(first, draw(1));
    assert_ne!(first, draw(2));
    assert!(first.windows(2).all(|pair| pair[0] != pair[1]));
    assert_eq!(first.iter().copied().collect::<BTreeSet<usize>>().len(), CRIES);
}

#[test]
fn who_cries_does_not_begin_another_cry() {
    let mut synth = synth();
    synth.cry(1.0);
    let which = synth.current_cry();
    hear(&mut synth, &DrillLoad::default(), 0.05);
    synth.cry(1.0);
    assert_eq!(synth.current_cry(), which);
    hear(&mut synth, &DrillLoad::default(), 2.0);
    assert_eq!(synth.current_cry(), None);
}

#[test]
fn a_stronger_cry_is_louder() {
    let loud = |strength: f32| {
        let mut synth = synth();
        synth.cry(strength);
        level(&hear(&mut synth, &DrillLoad::default(), 0.3))
    };
    assert!(loud(1.0) > 1.5 * loud(0.2) && loud(0.2) > 0.01, "{} {}", loud(1.0), loud(0.2));
}
