//! The desktop program itself, driven as a person drives it: real keys and a real mouse under a virtual display. A whole
//! lesson, and what needs a display, a sound server or a killed program; all else is tested in the test's own process
//! (`lesson_window.rs`, `author_window.rs`).
//!
//! The program writes what is on its screen into a state log (`TYPODONT_STATE_LOG`), so that these tests wait for states and never
//! for times. Where there is no Xvfb or xdotool they say SKIPPED.
use crate::support::bundle;
use crate::support::folder;
use crate::support::hearing;
use crate::support::screen;

use bundle::*;
use folder::folder;
use glam::DVec3;
use hearing::Spectrum;
use hearing::server::{Recorder, server};
use screen::{Desk, Display, LOOK_EVERY, PATIENCE, WindowDriver};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::harness::keep_settings;
use crate::trainee::{Trainee, lesion_in_world};
use typodont_core::device::{Device, DeviceError, DeviceSpec, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::volume::Label;
use typodont_devices::HandLink;
use typodont_devices::servo::{SecondHandEvent, SecondHandServo};
use typodont_exercise::record::{FILE_NAME, Recording};
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples};
use typodont_report::bundle::is_partial;

/// Settings with the language and the text size that pictures are requested in, and others.
fn large(others: &str) -> String {
    let wanted = |name: &str, otherwise: &str| std::env::var(name).unwrap_or_else(|_| otherwise.into());
    let (language, size) = (wanted("TYPODONT_TEST_LANGUAGE", "en"), wanted("TYPODONT_TEST_TEXT_SIZE", "1.0"));
    format!(r#"{{ "language": "{language}", "font_size": {size}, {others} }}"#)
}

/// A copy of exercise 5 that asks its questionnaire every time.
fn asking_each_time(place: &Path) -> PathBuf {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let text = fs::read_to_string(shipped).unwrap();
    let changed = text.replace("end_of_course", "each_time");
    assert_ne!(text, changed, "exercise 5 asks at the end of the course");
    let path = place.join("asking.json");
    fs::write(&path, changed).unwrap();
    path
}

#[test]
fn a_trainee_grinds_with_the_mouse_and_leaves_a_bundle_that_holds() {
    // Aim: the whole way of a lesson at the desktop program. Method: the program itself; keys choose the exercise, the mouse
    // goes to the decay and cuts, keys finish the stage and fill the questionnaire; then the bundle on disk is verified.
    let Some(display) = Display::open() else { return };
    let place = folder("window");
    keep_settings(&place, &large(r#""introduction_first": false"#));
    let mut desk = Desk::sit_down(display, &place, &[]);
    desk.until("screen", |screen| screen == "shelf");
    desk.picture("1-shelf");
    desk.press("F1", "over", "keys");
    desk.picture("2-keys");
    desk.press("Escape", "over", "nothing");
    desk.press("F2", "over", "settings");
    desk.picture("3-settings");
    desk.press("F2", "over", "nothing");
    for chosen in ["2-decay", "3-detection", "4-diagnosis", "5-grinding"] {
        desk.press("Down", "chosen", chosen);
    }
    desk.press("Return", "screen", "briefing");
    desk.picture("4-briefing");
    desk.press("Return", "screen", "practice");
    let seed = desk.until("seed", |_| true).parse().unwrap();
    desk.until("hand", |_| true);
    desk.until("clock", |clock| clock == "stopped");
    desk.picture("5-task");
    desk.press("o", "pointer", "held");

    let lesion = lesion_in_world("scenarios/5-grinding.json", seed);
    desk.point_at(lesion);
    desk.picture("5-practice");
    let is_cleared = desk.press_around(lesion, |desk, _| {
        let cleared: f32 = desk.latest("cleared").unwrap().parse().unwrap();
        cleared >= 10.0
    });
    desk.picture("6-cutting");
    assert_eq!(desk.latest("clock").as_deref(), Some("running"), "the first movement starts the clock");
    assert!(is_cleared, "{:?} % of the decay is gone", desk.latest("cleared"));
    desk.press("Escape", "pointer", "free");
    desk.press("v", "shown", "Iso");
    desk.press("v", "shown", "Tissue");
    desk.picture("7-see-through");
    desk.press("ctrl+Return", "asked", "finish");
    desk.picture("8-finish");
    // The course is not over: the result comes at once, without the questionnaire.
    desk.press("Return", "screen", "results");
    println!("the result is shown after {:?} ms", desk.latest("result_after_ms"));
    desk.picture("9-first-result");
    let bundle = PathBuf::from(desk.until("bundle", |_| true));
    desk.picture("9-results");
    let bundle = place.join(bundle);
    let session = session(&bundle);
    assert_eq!(session["device"]["name"], "mouse");
    assert_eq!(session["ended_because"], "complete");
    assert_eq!(session["stages"][0]["ended_by"], "confirmation");
    assert!(metric(&session, "decay_cleared_pct").unwrap() >= 9.0);
    let read_s = session["stages"][0]["started_s"].as_f64().unwrap();
    assert!(read_s < 0.01, "no time passed while the task was read: {read_s} s");
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    desk.press("Escape", "screen", "shelf");
    desk.until("done", |done| done.starts_with("1 "));
    desk.picture("9-shelf-with-results");
    println!("late (p99, max, missed): {}", desk.latest("late").unwrap_or_default());
}

/// A CT of a tooth, as numbers alone: an upper premolar in 8 bits, with a little noise. Gives its voxels along each axis.
fn scanned(path: &Path) -> [u32; 3] {
    const SPACING: f32 = 0.25;
    let tissues = typodont_anatomy::TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let form = typodont_anatomy::teeth::tooth(14).unwrap();
    let tooth = typodont_anatomy::grow(&form, typodont_anatomy::grid_of_spacing(&form, SPACING), &tissues);
    let bright = |voxel: usize| match tooth.tissue(voxel) {
        Label(1) => 235.0,
        Label(2) => 160.0,
        _ => 70.0,
    };
    let sample = |voxel: usize| {
        let share = tooth.densities()[voxel].unit();
        let noise = (voxel.wrapping_mul(2_654_435_761) >> 16) % 9;
        (70.0 + share * (bright(voxel) - 70.0)) as u8 + noise as u8
    };
    let samples = Samples::U8((0..tooth.grid().len()).map(sample).collect());
    let steps = [DVec3::X, DVec3::Y, DVec3::Z];
    let space = CoordinateSystem::LeftPosteriorSuperior;
    let geometry = Geometry { dims: tooth.grid().dims, steps, origin: DVec3::ZERO, space };
    let image = nrrd::VoxelImage { geometry, samples, keys: Vec::new() };
    fs::write(path, nrrd::bytes(&image, Encoding::Gzip).unwrap()).unwrap();
    tooth.grid().dims
}

/// An instructor's hand that rests far above.
struct Resting(DeviceSpec);

impl Device for Resting {
    fn spec(&self) -> &DeviceSpec {
        &self.0
    }

    fn exchange(&mut self, _: &Wrench) -> Result<Reading, DeviceError> {
        Ok(Reading::at(Vec3::Y * 60.0))
    }
}

#[test]
fn a_scanned_tooth_is_worked_on_and_an_instructor_joins_from_another_machine() {
    let Some(display) = Display::open() else { return };
    let place = folder("scan_window");
    let dims = scanned(&place.join("scan.nrrd"));
    let exercise = asking_each_time(&place);
    let begun = ["run", exercise.to_str().unwrap(), "--seed", "1", "--begin", "--out", "bundles"];
    let scan = ["--tooth", "scan.nrrd", "--tooth-spacing-mm", "0.25"];
    let second = ["--second-at", "127.0.0.1:0", "--second-key", "a key of ours"];
    let mut desk = Desk::sit_down(display, &place, &[&begun[..], &scan, &second].concat());
    desk.until("tooth", |tooth| tooth == "drawn");
    let address = desk.until("may_join", |_| true);
    let link = HandLink::connect(&address, "a key of ours").unwrap();
    let mut instructor = SecondHandServo::start(Box::new(Resting(DeviceSpec::phantom_omni())), link).unwrap();
    let begun = Instant::now();
    let joined = SecondHandEvent::FirstHand { is_present: true };
    while !std::iter::from_fn(|| instructor.next_event()).any(|news| news == joined) {
        assert!(begun.elapsed() < PATIENCE, "nobody is at {address}");
        std::thread::sleep(LOOK_EVERY);
    }
    desk.picture("scan");
    desk.press("ctrl+Return", "asked", "finish");
    desk.press("Return", "screen", "questionnaire");
    desk.rate_everything();
    desk.picture("questionnaire");
    desk.press("ctrl+Return", "screen", "results");
    let bundle = place.join(desk.until("bundle", |_| true));
    let ratings = session(&bundle)["questionnaire"]["items"].as_array().unwrap().clone();
    assert!(ratings.len() == 25 && ratings.iter().all(|rating| rating["value"] == 4.0), "{ratings:?}");
    let began = nrrd::read(&bundle.join("initial.seg.nrrd")).unwrap();
    assert_eq!(began.geometry.dims, dims, "the bundle is about the scan");
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
}

/// An assistant's hand over the tooth, its button held.
struct Spraying(DeviceSpec);

impl Device for Spraying {
    fn spec(&self) -> &DeviceSpec {
        &self.0
    }

    fn exchange(&mut self, _: &Wrench) -> Result<Reading, DeviceError> {
        Ok(Reading { buttons: 1, ..Reading::at(Vec3::new(-6.0, 8.0, 5.0)) })
    }
}

#[test]
fn an_assistant_joins_from_another_machine_with_the_syringe() {
    // Aim: over the network, too, an assistant's hand is taken up by the lesson, feels its tool there, and is drawn. Method: the
    // program waits for a second device; it learns where its tool is as soon as the trainee has begun.
    let Some(display) = Display::open() else { return };
    let place = folder("syringe_window");
    let exercise = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/7-spray.json");
    let begun = ["run", exercise, "--seed", "1", "--begin", "--out", "bundles"];
    let second = ["--second-at", "127.0.0.1:0", "--second-key", "a key of ours", "--second-role", "irrigation"];
    let mut desk = Desk::sit_down(display, &place, &[&begun[..], &second].concat());
    desk.until("tooth", |tooth| tooth == "drawn");
    let address = desk.until("may_join", |_| true);
    let link = HandLink::connect(&address, "a key of ours").unwrap();
    let mut assistant = SecondHandServo::start(Box::new(Spraying(DeviceSpec::phantom_omni())), link).unwrap();
    desk.press("o", "pointer", "held");
    let (begun, mut n) = (Instant::now(), 0);
    let joined = SecondHandEvent::FirstHand { is_present: true };
    while !std::iter::from_fn(|| assistant.next_event()).any(|news| news == joined) {
        assert!(begun.elapsed() < PATIENCE, "the lesson at {address} does not take up the hand");
        // The clock starts with the trainee's first movement.
        n += 1;
        desk.move_to([600 + 3 * (n % 20), 400]);
        std::thread::sleep(LOOK_EVERY);
    }
    std::thread::sleep(std::time::Duration::from_secs(2));
    desk.picture("syringe");
}

#[test]
fn what_the_window_does_is_heard_at_a_real_server() {
    // Aim: sound follows the lesson, not only the synthesiser's test. Method: a private server's null sink, recorded: the
    // handpiece turns freely above the tooth, grinds in it, and is still when the stage is over.
    let ears = hearing::server::folder("window");
    let (Some(display), Some(_server)) = (Display::open(), server(&ears)) else { return };
    let place = folder("heard_window");
    let exercise = asking_each_time(&place);
    let begun = ["run", exercise.to_str().unwrap(), "--seed", "1", "--begin", "--out", "bundles"];
    let socket = format!("unix:{}", ears.join("socket").display());
    let mut desk = Desk::sit_down_with(display, &place, &begun, &[("PULSE_SERVER", socket)]);
    desk.until("hand", |_| true);
    desk.press("o", "pointer", "held");
    let lesion = lesion_in_world("scenarios/5-grinding.json", 1);
    desk.point_at(lesion);
    let mut recorder = Recorder::start(&ears);
    const WHILE: usize = hearing::RATE as usize / 4;
    let heard = |recorder: &mut Recorder| Spectrum::of(&recorder.take(0.25));
    // A handpiece that starts needs a while to be at its speed.
    let begun = Instant::now();
    let mut free = heard(&mut recorder);
    while (free.peak(3000.0, 5500.0) / 5000.0 - 1.0).abs() > 0.02 {
        assert!(begun.elapsed() < PATIENCE, "the free handpiece is heard at {} Hz", free.peak(3000.0, 5500.0));
        free = heard(&mut recorder);
    }
    // Load lowers the pitch of a turbine, and contact with enamel adds noise above it (`audio::contact`).
    let hiss = |spectrum: &Spectrum| spectrum.power(5200.0, 9000.0);
    let grinds = |heard: &Spectrum| {
        heard.peak(2500.0, 5500.0) < 0.95 * free.peak(3000.0, 5500.0) && hiss(heard) > 1.3 * hiss(&free)
    };
    let is_ground = desk.press_around(lesion, |_, _| {
        recorder.catch_up();
        let heard = recorder.take(1.0);
        heard.chunks_exact(WHILE).any(|part| grinds(&Spectrum::of(part)))
    });
    assert!(is_ground, "nobody hears that the handpiece grinds");
    desk.press("Escape", "pointer", "free");
    desk.press("ctrl+Return", "asked", "finish");
    desk.press("Return", "screen", "questionnaire");
    let begun = Instant::now();
    while heard(&mut recorder).power(100.0, 10_000.0) > 0.0 {
        assert!(begun.elapsed() < PATIENCE, "it is not still when the stage is over");
    }
    let _ = fs::remove_dir_all(ears);
}

#[test]
fn each_eye_has_a_window_of_its_own_where_two_projectors_are_asked_for() {
    let Some(display) = Display::open() else { return };
    let place = folder("two_windows");
    keep_settings(&place, r#"{ "stereo": "two_windows", "eye_distance_mm": 6.0 }"#);
    let exercise = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let begun = ["run", exercise.to_str().unwrap(), "--seed", "1", "--begin", "--out", "bundles"];
    let mut desk = Desk::sit_down(display, &place, &begun);
    desk.until("tooth", |tooth| tooth == "drawn");
    let second = ["search", "--onlyvisible", "--name", "right eye"];
    let begun = Instant::now();
    while !desk.display.xdotool(&second) {
        assert!(begun.elapsed() < PATIENCE, "the right eye has no window");
        std::thread::sleep(LOOK_EVERY);
    }
    desk.display.xdotool(&[&second[..], &["windowraise"]].concat());
    desk.picture("10-two-windows");
    // Both go on: the state log counts pictures in tens.
    let frames: u64 = desk.latest("frames").unwrap().parse().unwrap();
    desk.until("frames", |now| now.parse::<u64>().unwrap() >= frames + 4);
    assert_eq!(desk.latest("screen").unwrap(), "practice");
}

/// Ticks of each recording in a folder whose bundle is not made yet.
fn ticks_of_partial_bundles(folder: &Path) -> Vec<u64> {
    let folders = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| is_partial(path));
    folders.map(|path| Recording::read(&path.join(FILE_NAME)).unwrap().len() as u64).collect()
}

#[test]
fn the_introduction_comes_first_and_an_interrupted_session_is_offered_again() {
    // Aim: the list leads. Method: a new trainee cannot open exercise 2; the introduction is begun and the program is
    // killed in it; the next start offers that session, which goes on and is killed again; then it is scored, and counts as an attempt that did not pass.
    let Some(display) = Display::open() else { return };
    let place = folder("interrupted_window");
    keep_settings(&place, &large(r#""volume": 0.0"#));
    let mut desk = Desk::sit_down(display, &place, &[]);
    desk.until("screen", |screen| screen == "shelf");
    desk.press("Down", "chosen", "2-decay");
    desk.until("required", |required| required == "1-introduction");
    desk.key("Return");
    assert_eq!(desk.latest("screen").as_deref(), Some("shelf"), "exercise 2 waits for the introduction");
    desk.press("Up", "chosen", "1-introduction");
    desk.until("required", |required| required == "nothing");
    desk.press("Return", "screen", "briefing");
    desk.press("Return", "screen", "practice");
    desk.until("clock", |clock| clock == "stopped");
    desk.press("o", "pointer", "held");
    desk.display.xdotool(&["mousemove_relative", "60", "30"]);
    desk.until("clock", |clock| clock == "running");
    let ticks = |desk: &Desk| desk.latest("ticks").unwrap().parse::<u64>().unwrap();
    let begun = ticks(&desk);
    desk.until("ticks", |now| now.parse::<u64>().unwrap() > begun + 1500);
    desk.picture("20-introduction");
    desk.program.kill().unwrap();
    desk.program.wait().unwrap();
    drop(desk);

    let before = ticks_of_partial_bundles(&place.join("home/Typodont/sessions"));
    let mut desk = Desk::sit_down(Display::open().unwrap(), &place, &[]);
    desk.until("unfinished", |unfinished| unfinished == "1");
    desk.picture("21-unfinished");
    desk.click("shelf.resume");
    desk.until("screen", |screen| screen == "practice");
    desk.until("clock", |clock| clock == "stopped");
    let after = ticks_of_partial_bundles(&place.join("home/Typodont/sessions"));
    assert!(before.len() == 1 && after.len() == 1, "the former recording is replaced: {before:?}, {after:?}");
    assert!(after[0] >= before[0], "{after:?} of {before:?} ticks are left");
    // From the button of the list into the view.
    desk.move_to([640, 400]);
    desk.press("o", "pointer", "held");
    desk.move_to([700, 430]);
    desk.until("clock", |clock| clock == "running");
    desk.until("ticks", |now| now.parse::<u64>().unwrap() > 1000);
    desk.program.kill().unwrap();
    desk.program.wait().unwrap();
    drop(desk);

    let mut desk = Desk::sit_down(Display::open().unwrap(), &place, &[]);
    desk.until("unfinished", |unfinished| unfinished == "1");
    desk.click("shelf.finish");
    desk.until("screen", |screen| screen == "results");
    let bundle = place.join(desk.until("bundle", |_| true));
    desk.picture("22-finished");
    let scored = session(&bundle);
    assert_ne!(scored["ended_because"], "complete");
    assert_eq!(scored["resumed"].as_array().unwrap().len(), 1);
    assert!(scored["servo"]["ticks"].as_u64().unwrap() > before[0] + 500, "{} of {before:?}", scored["servo"]);
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    desk.press("Escape", "screen", "shelf");
    desk.until("done", |done| done == "1 false");
    desk.until("unfinished", |unfinished| unfinished == "0");
}

#[test]
fn a_watched_file_is_shown_by_the_command_line() {
    // Aim: `typodont preview FILE --watch` opens the author's screen with the file, and shows what another program makes
    // of it.
    let Some(display) = Display::open() else { return };
    let place = folder("watched_window");
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json")).unwrap();
    let file = place.join("mine.json");
    fs::write(&file, &text).unwrap();
    let mut desk = Desk::sit_down(display, &place, &["preview", file.to_str().unwrap(), "--watch"]);
    desk.until("screen", |screen| screen == "author");
    desk.until("checked", |checked| checked == "true");
    fs::write(&file, text.replace("\"pass_points\": 70", "\"pass_points\": 700")).unwrap();
    desk.until("complaints", |count| count == "1");
}
