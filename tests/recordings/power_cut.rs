//! A power cut loses at most the last 1.2 s of a session.

use super::volatile_disk::VolatileDisk;
use crate::support::bundle;
use crate::support::folder;
use crate::support::tools;

use bundle::*;
use folder::folder;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use typodont_core::device::{DeviceSpec, PlaybackDevice};
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::ResolveMode;
use typodont_lesson::{Lesson, SessionConfig, SessionSeed, read_scenario};
use typodont_report::Templates;

/// Maximum loss that is promised, ticks.
const LOSS_MAX: u64 = 1200;

/// Begins a session whose hand repeats the movement of a recording, in real time.
fn begin(out: &Path) -> Lesson {
    let played = Recording::read(Path::new("tests/golden/version-2.mcap")).unwrap();
    let scenario = read_scenario(Path::new("scenarios/5-grinding.json"), ResolveMode::MakeWorkpiece).unwrap();
    let config = SessionConfig {
        scenario: Arc::new(scenario),
        seed: SessionSeed::given(4),
        participant: "",
        out: Some(out),
        digests: BTreeMap::new(),
        templates: Templates::shipped(),
        started: jiff::Timestamp::now(),
    };
    let workpiece = config.make_workpiece().unwrap();
    let spec = DeviceSpec::from(&played.head.device);
    let readings: Vec<_> = played.ticks.iter().map(|tick| tick.reading).collect();
    let device = PlaybackDevice::new(spec.clone(), readings.into_iter().cycle());
    let prepared = config.prepare(workpiece, spec, None).unwrap();
    prepared.begin(Box::new(device), None).unwrap().0
}

/// Runs the lesson until then; returns the number of ticks so far.
fn poll_until(lesson: &mut Lesson, until: Instant) -> u64 {
    loop {
        lesson.poll().unwrap();
        if Instant::now() >= until || lesson.session().are_stages_over() {
            return lesson.live().latest_step().map_or(0, |step| step.tick.0 + 1);
        }
        std::thread::sleep(Duration::from_millis(4));
    }
}

/// Cuts the power `count` times in sessions on a disk that forgets what was not synced, and returns the losses in ticks.
fn losses_of_power_cuts(count: usize, mount: &Path, disk: &VolatileDisk) -> Vec<u64> {
    let mut losses = Vec::new();
    while losses.len() < count {
        let mut lesson = begin(mount);
        while losses.len() < count && !lesson.session().are_stages_over() {
            let n = losses.len();
            // Pauses that share no factor with the second of the syncs.
            let pause = Duration::from_millis(350 + n as u64 * 577 % 1_300);
            poll_until(&mut lesson, Instant::now() + pause);
            // What was not synced is gone, is zero, or is there in part, as a disk's cache pleases.
            let left = disk.after_power_cut(|unsynced| match n % 3 {
                0 => Vec::new(),
                1 => vec![0; unsynced.len()],
                _ => unsynced[..unsynced.len() * 2 / 3].to_vec(),
            });
            let completed = poll_until(&mut lesson, Instant::now());
            let newest = left.iter().rfind(|(path, _)| path.ends_with("recording.mcap") && is_partial(path));
            let recording = newest.and_then(|(path, bytes)| Recording::parse(&path.display().to_string(), bytes).ok());
            let recovered = recording.map_or(0, |recording| recording.len() as u64);
            assert!(recovered <= completed, "{recovered} of {completed} ms");
            losses.push(completed - recovered);
        }
        if lesson.session().are_stages_over() {
            // A finished bundle is whole on the disk at once.
            let bundle = lesson.end().unwrap().complete(&mut |_| ()).unwrap();
            let left = disk.after_power_cut(|_| Vec::new());
            let kept = folder("power_cut_bundle");
            for (path, bytes) in left.iter().filter(|(path, _)| path.starts_with(bundle.name().as_ref())) {
                let path = kept.join(path);
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, bytes).unwrap();
            }
            let output = typodont(&["verify", kept.join(bundle.name().as_ref()).to_str().unwrap()]);
            assert!(output.status.success(), "{}", complained(&output));
        }
    }
    losses
}

fn is_partial(path: &Path) -> bool {
    path.parent().and_then(Path::extension).is_some_and(|extension| extension == "partial")
}

#[test]
#[ignore = "scripts/test --long"]
fn fifty_power_cuts_lose_at_most_their_last_second() {
    let mount = folder("power_cut");
    let disk = match VolatileDisk::mount(&mount) {
        Ok(disk) => disk,
        Err(error) => return tools::skip(&format!("FUSE cannot be mounted here: {error}")),
    };
    let mut losses = losses_of_power_cuts(50, &mount, &disk);
    losses.sort_unstable();
    println!("lost of {} power cuts: {} ms at most, {} ms in half of them", losses.len(), losses[49], losses[25]);
    assert!(losses[49] <= LOSS_MAX, "{losses:?}");
}
