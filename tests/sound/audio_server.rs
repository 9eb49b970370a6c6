//! The player against a real sound server's null sink, against none, and against a broken one.
use crate::support::hearing;

use crate::support::peace;

use hearing::server::*;
use hearing::*;
use std::fs;
use std::io::{Read, Write};
use std::os::unix::net::UnixListener;
use std::time::Duration;
use typodont_audio::{
    AudioError, DrillLoad, PlaybackOptions, PlayerEvent, RETRY_INTERVAL, SoundPlayer, SoundSender, Tool, sound_channel,
};

/// Half a second of what a load sounds like, after it has settled.
fn settled(recorder: &mut Recorder, sounds: &mut SoundSender, load: &DrillLoad) -> Vec<f32> {
    sounds.set_load(load);
    recorder.catch_up();
    recorder.take(1.5);
    recorder.take(0.5)
}

fn playing(player: &mut SoundPlayer) -> (String, Duration) {
    match wait_for("news", || player.next_event()) {
        PlayerEvent::Playing { place, latency } => (place, latency.unwrap()),
        other => panic!("{other:?}"),
    }
}

fn silent(player: &mut SoundPlayer) -> AudioError {
    match wait_for("news", || player.next_event()) {
        PlayerEvent::Silent(silence) => silence,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_server_lets_idle_light_and_heavy_grinding_be_heard() {
    peace::in_real_time(|| {
        // Aim: what the synthesiser makes reaches an ear. Method: the null sink's monitor, recorded; spectra as middle values, so
        // that a gap on a busy machine decides nothing.
        let folder = folder("spectra");
        let Some(_server) = server(&folder) else { return };
        let (mut sounds, heard) = sound_channel();
        let server = Some(folder.join("socket"));
        let mut player = SoundPlayer::start(heard, PlaybackOptions { server, ..PlaybackOptions::default() });
        let (_, latency) = playing(&mut player);
        // The latency granted by the server, not a measured one.
        assert!(latency <= Duration::from_millis(40), "{latency:?}");
        let mut recorder = Recorder::start(&folder);

        let silence = settled(&mut recorder, &mut sounds, &DrillLoad::default());
        assert_eq!(level(&silence), 0.0);
        let [idle, light, heavy, dentine] =
            [idle(), grinding(0.3), grinding(2.0), DrillLoad { hardness: 60.0, ..grinding(2.0) }]
                .map(|load| Spectrum::of(&settled(&mut recorder, &mut sounds, &load)));
        // The rotor: 5000 Hz free, a tenth less at 0.3 N, a third of it at 2 N.
        let pitch = idle.peak(3000.0, 5500.0);
        assert!((pitch / 5000.0 - 1.0).abs() < 0.02, "{pitch}");
        let pitch = light.peak(3000.0, 5500.0);
        assert!((pitch / 4500.0 - 1.0).abs() < 0.02, "{pitch}");
        assert!(heavy.power(4400.0, 5100.0) < 0.5 * idle.power(4900.0, 5100.0));
        // The grinding: where a free handpiece is quiet.
        let grind = |spectrum: &Spectrum| spectrum.power(200.0, 900.0);
        assert!(grind(&light) > 3.0 * grind(&idle), "{} {}", grind(&light), grind(&idle));
        assert!(grind(&heavy) > 1.5 * grind(&light), "{} {}", grind(&heavy), grind(&light));
        assert!(heavy.brightness() > 1.2 * dentine.brightness(), "{} {}", heavy.brightness(), dentine.brightness());

        let silence = settled(&mut recorder, &mut sounds, &DrillLoad::default());
        assert_eq!(level(&silence), 0.0);
        println!("latency {latency:?}, {} gaps", player.underruns());
        let _ = fs::remove_dir_all(folder);
    })
}

#[test]
fn contact_starts_and_stops_within_20_ms_at_the_ear() {
    peace::in_real_time(|| {
        // Aim: touch and release arrive as sharp as they were sent. Method: a probe on enamel, out of silence; in the recorded stream,
        // how long it takes from the first sound to the usual level, and from the last of the usual level to silence. The best of
        // several touches: a gap of a busy server may tear one.
        let folder = folder("contact");
        let Some(_server) = server(&folder) else { return };
        let (mut sounds, heard) = sound_channel();
        let mut player = SoundPlayer::start(
            heard,
            PlaybackOptions { server: Some(folder.join("socket")), ..PlaybackOptions::default() },
        );
        playing(&mut player);
        let mut recorder = Recorder::start(&folder);
        let rest = DrillLoad { tool: Tool::Hand, ..DrillLoad::default() };
        settled(&mut recorder, &mut sounds, &rest);
        // Steady enough to have a usual level within 5 ms: drawn so fast that its ridges blur.
        let touching = DrillLoad { surface_speed: 60.0, ..scratching() };

        let (mut starts, mut stops) = (Vec::new(), Vec::new());
        for _ in 0..5 {
            recorder.catch_up();
            sounds.set_load(&touching);
            let on = recorder.take(0.6);
            let usual = level(&on[on.len() - 9600..]);
            assert!(usual > 0.005, "{usual}");
            sounds.set_load(&rest);
            let off = recorder.take(0.6);
            let begun = on.iter().position(|s| *s != 0.0).unwrap_or(0);
            starts.push(on[begun..].chunks(240).position(|part| level(part) > 0.6 * usual).unwrap_or(999) * 5 + 5);
            let parts: Vec<f32> = off.chunks(240).map(level).collect();
            let last = parts.iter().rposition(|part| *part > 0.6 * usual).unwrap_or(0);
            let end = parts.iter().rposition(|part| *part > 0.0).unwrap_or(0);
            assert_eq!(parts.last(), Some(&0.0), "it ends in silence");
            stops.push((end - last) * 5);
        }
        println!("from first sound to the usual level {starts:?} ms, from there to silence {stops:?} ms");
        assert!(starts.iter().any(|ms| *ms <= 20), "{starts:?}");
        assert!(stops.iter().any(|ms| *ms <= 20), "{stops:?}");
        let _ = fs::remove_dir_all(folder);
    })
}

#[test]
fn a_cry_reaches_the_ear_and_ends() {
    peace::in_real_time(|| {
        let folder = folder("cry");
        let Some(_server) = server(&folder) else { return };
        let (mut sounds, heard) = sound_channel();
        let mut player = SoundPlayer::start(
            heard,
            PlaybackOptions { server: Some(folder.join("socket")), ..PlaybackOptions::default() },
        );
        playing(&mut player);
        let mut recorder = Recorder::start(&folder);
        assert_eq!(level(&recorder.take(0.3)), 0.0);
        assert!(sounds.cry(1.0));
        let said = recorder.take(2.0);
        assert!(level(&said) > 0.01, "{}", level(&said));
        assert_eq!(level(&recorder.take(0.3)), 0.0);
        let _ = fs::remove_dir_all(folder);
    })
}

#[test]
fn a_server_that_dies_is_named_once_and_found_again() {
    peace::in_real_time(|| {
        // Aim: a dying server costs one sentence, and a new one is heard. Method: kill it while it plays, start another one.
        let folder = folder("death");
        let Some(first) = server(&folder) else { return };
        let (mut sounds, heard) = sound_channel();
        let mut player = SoundPlayer::start(
            heard,
            PlaybackOptions { server: Some(folder.join("socket")), ..PlaybackOptions::default() },
        );
        sounds.set_load(&idle());
        playing(&mut player);
        drop(first);
        let silence = silent(&mut player);
        assert!(matches!(silence, AudioError::Lost { .. }), "{silence:?}");
        std::thread::sleep(RETRY_INTERVAL + RETRY_INTERVAL / 2);
        assert_eq!(player.next_event(), None, "said once");
        let _ = fs::remove_file(folder.join("socket"));
        let _second = server(&folder);
        playing(&mut player);
        let mut recorder = Recorder::start(&folder);
        recorder.take(0.5);
        assert!(level(&recorder.take(0.5)) > 0.01);
        let _ = fs::remove_dir_all(folder);
    })
}

#[test]
fn without_a_server_it_says_so_once_and_goes_on() {
    peace::in_real_time(|| {
        let folder = folder("none");
        let (mut sounds, heard) = sound_channel();
        let mut player = SoundPlayer::start(
            heard,
            PlaybackOptions { server: Some(folder.join("socket")), ..PlaybackOptions::default() },
        );
        let silence = silent(&mut player);
        let said = silence.to_string();
        assert!(matches!(silence, AudioError::Unavailable { .. }), "{silence:?}");
        assert!(said.contains("socket") && said.contains("start PipeWire or PulseAudio"), "{said}");
        // Loads are taken all the same; of cries only as many as may wait.
        let taken = (0..100).filter(|_| sounds.cry(1.0)).count();
        assert!((1..100).contains(&taken), "{taken}");
        sounds.set_load(&idle());
        std::thread::sleep(RETRY_INTERVAL + RETRY_INTERVAL / 2);
        assert_eq!(player.next_event(), None, "said once");
        let _ = fs::remove_dir_all(folder);
    })
}

#[test]
fn a_server_that_talks_nonsense_is_refused_and_does_no_harm() {
    peace::in_real_time(|| {
        // Aim: whatever answers at the socket, the player names it and goes on. Method: nonsense, a message beyond all measure, and
        // one that hangs up.
        for (what, answer) in [("nonsense", vec![7u8; 400]), ("hangs up", vec![]), ("zeros", vec![0u8; 400])] {
            let folder = folder(&format!("nonsense-{}", what.replace(' ', "-")));
            let listener = UnixListener::bind(folder.join("socket")).unwrap();
            let answering = std::thread::spawn(move || {
                let (mut socket, _) = listener.accept().unwrap();
                let mut asked = [0; 20];
                let _ = socket.read(&mut asked);
                let _ = socket.write_all(&answer);
            });
            let (_sounds, heard) = sound_channel();
            let mut player = SoundPlayer::start(
                heard,
                PlaybackOptions { server: Some(folder.join("socket")), ..PlaybackOptions::default() },
            );
            let silence = silent(&mut player);
            assert!(matches!(silence, AudioError::Refused { .. }), "{what}: {silence:?}");
            drop(player);
            answering.join().unwrap();
            let _ = fs::remove_dir_all(folder);
        }
    })
}
