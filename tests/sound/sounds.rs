//! WAV files that take the place of synthesised sounds, whole and broken.

use crate::support::hearing;

use hearing::*;
use hound::{SampleFormat, WavSpec, WavWriter};
use std::fs;
use std::io::Cursor;
use std::path::PathBuf;
use typodont_audio::wav_files;
use typodont_audio::{Clip, DrillLoad, Replacements, Synth, SynthOptions};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A WAV file of a sine: 16 bits, at a rate, for some seconds.
fn wav(frequency: f32, rate: u32, channels: u16, seconds: f32) -> Vec<u8> {
    let spec = WavSpec { channels, sample_rate: rate, bits_per_sample: 16, sample_format: SampleFormat::Int };
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = WavWriter::new(&mut bytes, spec).unwrap();
    for i in 0..(seconds * rate as f32) as usize {
        let sine = (std::f32::consts::TAU * frequency * i as f32 / rate as f32).sin();
        (0..channels).for_each(|_| writer.write_sample((sine * 30_000.0) as i16).unwrap());
    }
    writer.finalize().unwrap();
    bytes.into_inner()
}

fn hear(synth: &mut Synth, load: &DrillLoad, seconds: f32) -> Vec<f32> {
    let mut block = vec![0.0; (seconds * RATE as f32) as usize];
    synth.fill(load, &mut block);
    block
}

#[test]
fn recordings_take_the_place_of_what_is_synthesised() {
    // Aim: each file is heard where it belongs, at the player's rate. Method: sines of their own pitch at other rates.
    let folder = folder("replaced");
    fs::write(folder.join("handpiece.wav"), wav(1000.0, 44_100, 2, 1.0)).unwrap();
    fs::write(folder.join("suction.wav"), wav(700.0, 22_050, 1, 1.0)).unwrap();
    for i in 1..=14 {
        fs::write(folder.join(format!("cry-{i:02}.wav")), wav(1500.0, 96_000, 1, 0.5)).unwrap();
    }
    let (replacements, complaints) = wav_files::read_folder(&folder);
    assert!(complaints.is_empty(), "{complaints:?}");
    let mut synth = Synth::new(&SynthOptions { replacements, ..SynthOptions::default() });
    let pitch = |samples: &[f32]| Spectrum::of(samples).peak(100.0, 20_000.0);
    let near = |pitch: f32, hertz: f32| (pitch / hertz - 1.0).abs() < 0.03;

    hear(&mut synth, &idle(), 1.0);
    let free = pitch(&hear(&mut synth, &idle(), 1.0));
    assert!(near(free, 1000.0), "{free}");
    let held = DrillLoad { hardness: 0.0, is_cutting: false, surface_speed: 0.0, ..grinding(1.0) };
    hear(&mut synth, &held, 0.5);
    let slowed = pitch(&hear(&mut synth, &held, 1.0));
    assert!(near(slowed, 667.0), "{slowed}");
    hear(&mut synth, &DrillLoad::default(), 2.0);
    let suction = pitch(&hear(&mut synth, &DrillLoad { is_suction_on: true, ..DrillLoad::default() }, 1.0));
    assert!(near(suction, 700.0), "{suction}");
    hear(&mut synth, &DrillLoad::default(), 1.0);
    synth.cry(1.0);
    let cry = pitch(&hear(&mut synth, &DrillLoad::default(), 0.4));
    assert!(near(cry, 1500.0), "{cry}");
    hear(&mut synth, &DrillLoad::default(), 0.2);
    assert_eq!(synth.current_cry(), None, "half a second stays half a second at another rate");
}

#[test]
fn a_loop_has_no_seam() {
    // Aim: where a recording begins anew nothing clicks. Method: a low sine that does not end where it began; no step is larger
    // than one and a half of its steepest.
    let rate = RATE;
    let samples = (0..rate as usize * 2 / 5).map(|i| (0.013 * i as f32).sin()).collect();
    let suction = Some(Clip { rate, samples });
    let replacements = Replacements { suction, ..Replacements::default() };
    let mut synth = Synth::new(&SynthOptions { replacements, ..SynthOptions::default() });
    let load = DrillLoad { is_suction_on: true, ..DrillLoad::default() };
    hear(&mut synth, &load, 0.2);
    let sound = hear(&mut synth, &load, 2.0);
    let peak = sound.iter().fold(0.0f32, |peak, s| peak.max(s.abs()));
    assert!(largest_step(&sound) < 1.5 * 0.013 * peak, "{} of {peak}", largest_step(&sound));
}

#[test]
fn a_broken_recording_is_named_and_synthesised() {
    // Aim: one complaint per file: what, where, what to do; and the synthesised sound. Method: every way to break a file.
    let whole = wav(500.0, 48_000, 1, 0.5);
    let mut floats = Cursor::new(Vec::new());
    let spec = WavSpec { channels: 1, sample_rate: 48_000, bits_per_sample: 32, sample_format: SampleFormat::Float };
    let mut writer = WavWriter::new(&mut floats, spec).unwrap();
    (0..9600).for_each(|i| writer.write_sample(if i == 77 { f32::NAN } else { 0.1f32 }).unwrap());
    writer.finalize().unwrap();
    let broken = [
        ("empty file", Vec::new(), "wrong-sound"),
        ("no WAV", b"OggS and so on, which is another format".to_vec(), "wrong-sound"),
        ("half a head", whole[..30].to_vec(), "wrong-sound"),
        ("cut off", whole[..whole.len() / 2].to_vec(), "cut-off-sound"),
        ("no samples", wav(500.0, 48_000, 1, 0.0), "wrong-length"),
        ("too short to loop", wav(500.0, 48_000, 1, 0.05), "wrong-length"),
        ("too long", wav(500.0, 8_000, 1, 31.0), "wrong-length"),
        ("too slow", wav(500.0, 4_000, 1, 0.5), "unsuitable-sound"),
        ("too fast", wav(500.0, 384_000, 1, 0.5), "unsuitable-sound"),
        ("many channels", wav(500.0, 48_000, 9, 0.2), "unsuitable-sound"),
        ("not a number", floats.into_inner(), "wrong-sound"),
    ];
    for (name, bytes, code) in broken {
        let folder = folder("broken");
        fs::write(folder.join("handpiece.wav"), bytes).unwrap();
        let (replacements, complaints) = wav_files::read_folder(&folder);
        assert_eq!(replacements, Replacements::default(), "{name}");
        let [complaint] = &complaints[..] else { panic!("{name}: {complaints:?}") };
        assert_eq!(complaint.code, code, "{name}: {complaint}");
        let said = complaint.to_string();
        assert!(said.contains("handpiece.wav") && said.contains("synthesised") && complaint.help.is_some(), "{said}");
        let mut synth = Synth::new(&SynthOptions { replacements, ..SynthOptions::default() });
        assert!(level(&hear(&mut synth, &idle(), 0.5)) > 0.01, "{name}");
    }
}

#[test]
fn a_misspelt_name_is_named_with_the_nearest() {
    let folder = folder("misspelt");
    fs::write(folder.join("cry-1.wav"), wav(500.0, 48_000, 1, 0.5)).unwrap();
    let (replacements, complaints) = wav_files::read_folder(&folder);
    assert_eq!(replacements, Replacements::default());
    let [complaint] = &complaints[..] else { panic!("{complaints:?}") };
    assert!(complaint.help.as_ref().unwrap().contains("did you mean \"cry-"), "{complaint}");
}

#[test]
fn a_folder_that_is_not_there_replaces_nothing() {
    let (replacements, complaints) = wav_files::read_folder(&folder("empty").join("none"));
    assert_eq!((replacements, complaints), (Replacements::default(), Vec::new()));
}
