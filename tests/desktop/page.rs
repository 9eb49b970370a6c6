//! The program as a page, in a real browser, from the shelf to a downloaded bundle.
//!
//! Needs the page that `scripts/web` builds into `target/web`, and `TYPODONT_PLAYWRIGHT` and `TYPODONT_CHROMIUM`, as
//! `scripts/test --long` sets them.

use crate::harness::keep_settings;
use crate::support::browser::browser;
use crate::support::bundle::{complained, metric, run, session, typodont};
use crate::support::folder::folder;
use crate::support::screen::{Desk, Display, WindowDriver};
use crate::support::tools::{named_by, skip};
use crate::trainee::{DrawnTrial, drawn_trials, lesion_in_world};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use typodont_report::bundle::{BundleFolder, SESSION_FILE};

/// Exercise in which the test removes caries.
const DRILLED: &str = "5-grinding";

/// Adapters of the browser.
const WEBGL: &str = "webgl";
const WEBGPU: &str = "webgpu";

/// The folder of the page; `None` if it is not built.
fn built_page() -> Option<PathBuf> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/web");
    if !page.join("index.html").is_file() {
        skip("target/web has no page (scripts/web)");
        return None;
    }
    Some(page)
}

/// A script that works in the page, by an adapter of the browser, and the display that it needs; `None` without a browser, a
/// display or the page.
fn page_script(name: &str, adapter: &str) -> Option<(Command, Option<Display>)> {
    let mut node = Command::new("node");
    node.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser").join(name))
        .args(browser()?)
        .arg(built_page()?);
    if adapter != WEBGPU {
        return Some((node, None));
    }
    let display = Display::open()?;
    node.env("DISPLAY", &display.name);
    Some((node, Some(display)))
}

/// Work for `page.js` in an exercise: caries to be removed, or the places that the trials draw, with their answers.
fn work_in_page(exercise: &str, seed: u64) -> Value {
    let path = format!("scenarios/{exercise}.json");
    if exercise == DRILLED {
        return json!({ "goal": lesion_in_world(&path, seed).to_array() });
    }
    let trial = |trial: DrawnTrial| json!({ "place": trial.place.to_array(), "answers": trial.answers });
    json!({ "trials": drawn_trials(&path, seed).into_iter().map(trial).collect::<Vec<_>>() })
}

fn goes_through_a_lesson(adapter: &str, exercise: &str) {
    let Some((mut node, _display)) = page_script("page.js", adapter) else { return };
    let out = folder(&format!("page_{adapter}_{exercise}"));
    let zip = out.join("bundle.zip");
    node.arg(&out).arg(&zip).args([adapter, exercise]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut running = node.spawn().unwrap();
    let lines = BufReader::new(running.stdout.take().unwrap()).lines().map_while(Result::ok);
    let mut answers = running.stdin.take().unwrap();
    for line in lines {
        println!("{line}");
        if let Some(seed) = line.strip_prefix("seed ") {
            writeln!(answers, "{}", work_in_page(exercise, seed.parse().unwrap())).unwrap();
        }
    }
    assert!(running.wait().unwrap().success(), "the lesson in the page failed; see above");

    let output = typodont(&["verify", zip.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let unzipped = Command::new("unzip").args(["-q", "-o"]).arg(&zip).arg("-d").arg(&out).output().unwrap();
    assert!(unzipped.status.success(), "{}", complained(&unzipped));
    let mut folders = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path());
    let bundle = folders.find(|path| path.join("session.json").is_file()).expect("the ZIP file holds a bundle");
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let session = session(&bundle);
    assert_eq!(session["device"]["name"], "mouse");
    assert_eq!(session["ended_because"], "complete");
    assert_eq!(session["scenario"]["id"], exercise);
    if exercise == DRILLED {
        assert!(metric(&session, "decay_cleared_pct").unwrap() >= 9.0);
    }
    if let Some(detected) = session["metrics"].get("detect_corrected_pct") {
        assert_eq!(detected, 100.0);
    }
    println!("servo: {}", session["servo"]);
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_lesson_in_a_page_by_webgl_gives_a_bundle_that_holds() {
    // Aim: a trainee with nothing but a browser hands in the same evidence as one at a station. Method: the page in Chromium,
    // driven by mouse and keys; the downloaded file is verified by the program on this computer.
    goes_through_a_lesson(WEBGL, DRILLED);
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_lesson_in_a_page_by_webgpu_gives_a_bundle_that_holds() {
    goes_through_a_lesson(WEBGPU, DRILLED);
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn further_exercises_in_a_page_give_bundles_that_hold() {
    // Aim: a fissure and deep caries run in a page, too, by both adapters; their bundles hold although little was done. And the trials of a
    // detection, on two teeth and in an arch, are touched and answered there.
    for exercise in ["8-fissure", "12-deep-caries", "3-detection", "16-arch-diagnosis"] {
        for adapter in [WEBGL, WEBGPU] {
            goes_through_a_lesson(adapter, exercise);
        }
    }
}

/// Lets the page verify files, each with the answer that it must give.
fn verifies_in_the_page(adapter: &str, out: &Path, files: &[(&str, PathBuf)]) {
    let Some((mut node, _display)) = page_script("verify_page.js", adapter) else { return };
    node.arg(out).arg(adapter);
    node.args(files.iter().map(|(answer, file)| format!("{answer}={}", file.display())));
    assert!(node.status().unwrap().success(), "the page gives other answers; see above");
}

/// Writes a bundle as a ZIP file; `change` changes the text of its `session.json`.
fn zipped(bundle: &Path, out: &Path, name: &str, change: impl Fn(&str) -> String) -> PathBuf {
    let whole = BundleFolder::on_disk(bundle);
    let read = |file: String| {
        let bytes = whole.read(&file).unwrap().into_owned();
        let bytes = if file == SESSION_FILE { change(str::from_utf8(&bytes).unwrap()).into_bytes() } else { bytes };
        (file, bytes)
    };
    let files = whole.names().into_iter().map(read).collect();
    let zip = BundleFolder::InMemory { name: whole.name().into_owned(), files }.to_zip().unwrap();
    let file = out.join(name);
    std::fs::write(&file, zip).unwrap();
    file
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn the_page_verifies_results_as_the_program_does() {
    // Aim: an examiner with nothing but a browser gets the answers of `typodont verify`. Method: files are chosen and dropped; a
    // genuine result, one with other points, a file that is none. By both adapters.
    if built_page().is_none() {
        return;
    }
    let out = folder("page_verifies");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
    let genuine = zipped(&example, &out, "genuine.zip", str::to_string);
    let forged = zipped(&example, &out, "forged.zip", |text| text.replacen("\"passed\": false", "\"passed\": true", 1));
    let damaged = out.join("damaged.zip");
    std::fs::write(&damaged, &std::fs::read(&genuine).unwrap()[..1000]).unwrap();
    let again = zipped(&example, &out, "again.zip", str::to_string);
    let files = [("verified", genuine), ("differs", forged), ("unreadable", damaged), ("verified", again)];
    for adapter in [WEBGL, WEBGPU] {
        verifies_in_the_page(adapter, &out, &files);
    }
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn every_shipped_exercise_of_this_computer_is_verified_in_the_page() {
    // Aim: a browser computes every tick, score and picture with the same bits. Method: a session of each exercise by a script on
    // this computer, verified in the page.
    if built_page().is_none() {
        return;
    }
    let out = folder("page_verifies_all");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut exercises: Vec<PathBuf> =
        std::fs::read_dir(root.join("scenarios")).unwrap().map(|e| e.unwrap().path()).collect();
    exercises
        .retain(|path| path.to_str().is_some_and(|name| name.ends_with(".json") && !name.ends_with(".schema.json")));
    exercises.sort();
    assert!(exercises.len() >= 16);
    let files: Vec<(&str, PathBuf)> = exercises
        .iter()
        .map(|exercise| {
            let bundle = run(exercise.to_str().unwrap(), "hasty", &out, &[]);
            let name = format!("{}.zip", exercise.file_stem().unwrap().to_string_lossy());
            ("verified", zipped(&bundle, &out, &name, str::to_string))
        })
        .collect();
    verifies_in_the_page(WEBGL, &out, &files);
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn the_page_opens_without_a_network_after_one_visit() {
    // Aim: a tablet works in a room without a network. Method: one visit, then the server is gone.
    let Some((mut node, _)) = page_script("offline_page.js", WEBGL) else { return };
    assert!(node.status().unwrap().success(), "the page does not open; see above");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn nothing_around_the_canvas_is_a_barrier() {
    // Aim: whoever uses a screen reader learns what the page is, and why it shows no exercise. Method: axe-core's rules.
    let Some((mut node, _)) = page_script("axe_page.js", WEBGL) else { return };
    let Some(axe) = named_by("TYPODONT_AXE", "axe-core") else { return };
    assert!(node.arg(axe).status().unwrap().success(), "axe finds barriers; see above");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_closed_page_loses_at_most_a_second_of_its_session() {
    // Aim: nothing that was done is lost with a tab. Method: the page is closed at twenty random moments of a lesson, without a
    // question; the next page scores what was kept. Its bundle holds, and lacks at most a second of the ticks that were seen.
    let Some((mut node, _)) = page_script("closed_page.js", WEBGL) else { return };
    let out = folder("page_closed");
    let moments = if std::env::var_os("TYPODONT_LONG").is_some() { "20" } else { "3" };
    assert!(node.arg(&out).arg(moments).status().unwrap().success(), "a session is lost; see above");
    let zips: Vec<PathBuf> = std::fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "zip"))
        .collect();
    assert_eq!(zips.len().to_string(), moments);
    for zip in zips {
        let output = typodont(&["verify", zip.to_str().unwrap()]);
        assert!(output.status.success(), "{}", complained(&output));
    }
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn an_exercise_is_written_in_the_page() {
    // Aim: a designer who has installed nothing writes an exercise that a station takes. Method: new, a tooth, a decay by a click, a
    // test run, saved, opened again; the program on this computer checks the file.
    let Some((mut node, _)) = page_script("author_page.js", WEBGL) else { return };
    let out = folder("page_author");
    let file = out.join("cheek-side.json");
    assert!(node.arg(&out).arg(&file).status().unwrap().success(), "the exercise cannot be written; see above");
    let output = typodont(&["check", file.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
}

/// Lets one thing fail around the page, and verifies the bundle that is saved all the same.
fn survives(adapter: &str, trouble: &str) {
    let Some((mut node, _display)) = page_script("troubled_page.js", adapter) else { return };
    let out = folder(&format!("page_{trouble}_{adapter}"));
    let exercises = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let passes = node.arg(&out).args([adapter, trouble]).arg(exercises).status().unwrap().success();
    assert!(passes, "{trouble}, {adapter}: see above");
    let output = typodont(&["verify", out.join(format!("{trouble}.zip")).to_str().unwrap()]);
    assert!(output.status.success(), "{trouble}, {adapter}: {}", complained(&output));
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_browser_that_keeps_nothing_loses_nothing_that_is_saved() {
    // Aim: one sentence, and the session goes on to its bundle. Method: storage that is blocked in the browser's profile, and
    // a quota of a kilobyte.
    survives(WEBGL, "blocked");
    survives(WEBGL, "full");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_graphics_processor_that_stops_costs_no_session() {
    // Aim: one sentence and a way on. Method: the browser's graphics process is ended during a session.
    survives(WEBGL, "stopped");
    survives(WEBGPU, "stopped");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_second_page_leaves_a_running_session_alone() {
    survives(WEBGL, "second");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn hostile_exercises_do_no_harm_in_the_page() {
    // Aim: no script runs, nothing is fetched from elsewhere, and the page does not stand still. Method: exercises with markup in every
    // text, files at other servers and above their folder, too many voxels, too much text, too much nesting, and addresses of others.
    let Some((mut node, _)) = page_script("hostile_page.js", WEBGL) else { return };
    let out = folder("page_hostile");
    let shipped = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut exercise: Value = serde_json::from_str(&shipped).unwrap();
    exercise.as_object_mut().unwrap().remove("$schema");
    let write = |name: &str, text: &str| std::fs::write(out.join(name), text).unwrap();
    let with = |pointer: &str, value: Value| {
        let mut changed = exercise.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        changed.pointer_mut(parent).unwrap()[key] = value;
        changed.to_string()
    };
    let markup = "<img src=x onerror=alert(1)><script>alert(2)</script>";
    write("markup.json", &with("/title", markup.into()).replace("Remove", markup));
    let elsewhere = |file: &str| with("/scene/jaw/tooth/form", serde_json::json!({ "ct": { "file": file } }));
    write("elsewhere.json", &elsewhere("https://example.com/tooth.nrrd"));
    write("other-server.json", &elsewhere("//example.com/tooth.nrrd"));
    write("above.json", &elsewhere("../../tooth.nrrd"));
    write("fine.json", &with("/scene/jaw/tooth/form/procedural/spacing_mm", 0.0001.into()));
    write("spaces.json", &" ".repeat(6 << 20));
    write("nested.json", &"[".repeat(200_000));
    write("bytes.json", "\0\0\0");
    node.arg(&out).arg(&out).arg("opened=markup.json");
    for refused in ["elsewhere.json", "other-server.json", "above.json", "fine.json", "spaces.json", "nested.json"] {
        node.arg(format!("refused={refused}"));
    }
    for refused in
        ["bytes.json", "missing.json", "https://example.com/own.json", "//example.com/own.json", "data:,%7B%7D"]
    {
        node.arg(format!("refused={refused}"));
    }
    assert!(node.status().unwrap().success(), "the page is harmed; see above");
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_pen_fingers_and_a_gamepad_work_in_the_page() {
    // Aim: a tablet's pen presses as hard as it is pressed and holds the instrument as it is held; one finger points and a
    // second one presses; a gamepad does what a mouse does. Method: the browser's input with pressure and tilt; a gamepad as
    // the browser shows one; the bundle holds.
    let Some((mut node, _)) = page_script("hands_page.js", WEBGL) else { return };
    let out = folder("page_hands");
    let zip = out.join("bundle.zip");
    assert!(node.arg(&out).arg(&zip).status().unwrap().success(), "see above");
    let output = typodont(&["verify", zip.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn hid_devices_work_in_the_page() {
    // Aim: an open handle is felt, without a buzz and with the force that the report states; a SpaceMouse and a Polhem move the
    // instrument, and the motors of a Polhem stay off. Method: devices that speak the real protocols in place of the browser's; the
    // handle is pressed onto the tooth, unplugged and plugged in again.
    for (kind, force) in [("open-handle", Some("reduced")), ("spacemouse", None), ("polhem", Some("off"))] {
        let Some((mut node, _)) = page_script("device_page.js", WEBGL) else { return };
        let out = folder(&format!("page_{kind}"));
        let zip = out.join("bundle.zip");
        let output = node.arg(&out).arg(&zip).arg(kind).stderr(Stdio::inherit()).output().unwrap();
        let told = String::from_utf8_lossy(&output.stdout);
        println!("{told}");
        assert!(output.status.success(), "{kind}: see above");
        let verified = typodont(&["verify", zip.to_str().unwrap()]);
        assert!(verified.status.success(), "{}", complained(&verified));
        let bundle = BundleFolder::from_zip(&std::fs::read(&zip).unwrap(), kind).unwrap();
        let session: Value = serde_json::from_slice(&bundle.read(SESSION_FILE).unwrap()).unwrap();
        assert_eq!(session["device"]["page_force"].as_str(), force, "{kind}");
        let report = String::from_utf8_lossy(&bundle.read("report.html").unwrap()).into_owned();
        assert_eq!(report.contains("an eighth of this force"), force == Some("reduced"), "{kind}");
        assert_eq!(report.contains("No force was felt"), force == Some("off"), "{kind}");
        if kind == "open-handle" {
            let told: Value = serde_json::from_str(&told).unwrap();
            let rms = told["rms"].as_f64().unwrap();
            // The bur cuts and slides meanwhile; a buzz is some hundred mm/s.
            assert!(rms < 20.0, "the contact buzzes: {told}");
        }
    }
}

/// Moves the mouse of a window in circles for a time, as `beside_page.js` does; returns ticks and frames per second.
fn circle(desk: &mut Desk, seconds: f64) -> [f64; 2] {
    let counts = |desk: &Desk| ["ticks", "frames"].map(|topic| desk.latest(topic).unwrap().parse::<f64>().unwrap());
    let (begun, before) = (Instant::now(), counts(desk));
    for at in 0.. {
        if begun.elapsed().as_secs_f64() > seconds {
            break;
        }
        let angle = 0.3 * f64::from(at);
        desk.move_to([640 + (60.0 * angle.cos()) as i32, 400 + (60.0 * angle.sin()) as i32]);
        std::thread::sleep(Duration::from_millis(20));
    }
    let (took, after) = (begun.elapsed().as_secs_f64(), counts(desk));
    [0, 1].map(|i| (after[i] - before[i]) / took)
}

/// Picture of the window in RGB, as far as the page's is wide and high.
fn window_picture(desk: &Desk, file: &Path) -> image::RgbImage {
    let name = &desk.display.name;
    let taken = Command::new("import").args(["-window", "root"]).arg(file).env("DISPLAY", name).status().unwrap();
    assert!(taken.success());
    image::open(file).unwrap().to_rgb8()
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn the_page_is_beside_the_window_in_picture_and_pace() {
    // Aim: the same program in both places. Method: the same exercise and seed in the page and in the window, one after the other at
    // the same size. The picture of the teeth differs no more than those of two adapters; ticks and frames are printed.
    const SECONDS: &str = "8";
    const PICTURE: [u32; 4] = [330, 90, 960, 720];
    let out = folder("page_beside");
    for exercise in ["10-class-one", "5-grinding"] {
        let Some((mut node, _display)) = page_script("beside_page.js", WEBGL) else { return };
        let page_file = out.join(format!("{exercise}-page.png"));
        let output = node.arg(&page_file).args([WEBGL, exercise, SECONDS]).stderr(Stdio::inherit()).output().unwrap();
        assert!(output.status.success(), "the exercise in the page failed; see above");
        let in_page: Value = serde_json::from_slice(&output.stdout).unwrap();

        let place = folder(&format!("window_beside_{exercise}"));
        keep_settings(&place, r#"{ "volume": 0.0, "introduction_first": false }"#);
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{exercise}.json"));
        let seed = in_page["seed"].as_str().unwrap();
        let begun = ["run", file.to_str().unwrap(), "--seed", seed, "--begin", "--out", "bundles"];
        let Some(display) = Display::open() else { return };
        let mut desk = Desk::sit_down(display, &place, &begun);
        desk.until("clock", |clock| clock == "stopped");
        desk.move_to([2, 2]);
        std::thread::sleep(Duration::from_secs(4));
        let window = window_picture(&desk, &out.join(format!("{exercise}-window.png")));
        desk.move_to([640, 400]);
        desk.press("o", "pointer", "held");
        let [ticks, frames] = circle(&mut desk, SECONDS.parse().unwrap());
        println!("{exercise}: page {in_page}; window ticks_per_s {ticks:.0}, frames_per_s {frames:.1}");

        let page = image::open(&page_file).unwrap().to_rgb8();
        let [left, top, right, bottom] = PICTURE;
        let places = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
        let differences = places.flat_map(|(x, y)| {
            let pair = page.get_pixel(x, y).0.into_iter().zip(window.get_pixel(x, y).0);
            pair.map(|(a, b)| f64::from(a.abs_diff(b)))
        });
        let differences: Vec<f64> = differences.collect();
        let mean = differences.iter().sum::<f64>() / differences.len() as f64;
        let within = differences.iter().filter(|d| **d <= 8.0).count() as f64 / differences.len() as f64;
        println!("{exercise}: mean difference {mean:.3} of 255, {:.3} % within 8", 100.0 * within);
        assert!(mean < 1.0 && within >= 0.999, "{exercise}: the page draws another picture; see {}", out.display());
    }
}

/// Writes a ZIP file of what a Python expression gives for `entries`: pairs of a name and a content.
fn zip_of(out: &Path, name: &str, entries: &str) -> PathBuf {
    let file = out.join(name);
    let script = format!(
        "import sys, zipfile, random\nwith zipfile.ZipFile(sys.argv[1], 'w', zipfile.ZIP_DEFLATED) as z:\n    for name, content in {entries}: z.writestr(name, content)"
    );
    let output = Command::new("python3").args(["-W", "ignore", "-c", &script]).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", complained(&output));
    file
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn hostile_bundles_do_no_harm_in_the_page() {
    // Aim: an examiner may drop anything onto the page. Method: archives that grow a thousand times, that lead out of their folder, with
    // too many files, too much nesting, markup in every place that is shown, a recording of noise, and the same file twice; each has an
    // answer, no dialog opens, nothing is asked for, and a genuine result is verified after them.
    if built_page().is_none() {
        return;
    }
    let out = folder("page_hostile_bundles");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
    let markup = "<img src=x onerror=alert(1)><script>alert(2)</script>";
    let shown = json!(markup).to_string();
    let marked = zipped(&example, &out, "marked.zip", |text| {
        let text = text.replacen("\"participant\": \"example\"", &format!("\"participant\": {shown}"), 1);
        text.replacen("\"title\": \"Caries removal\"", &format!("\"title\": {shown}"), 1)
    });
    let session = std::fs::read_to_string(example.join(SESSION_FILE)).unwrap();
    let session = json!(session).to_string();
    let files = [
        ("unreadable", zip_of(&out, "grows.zip", "[('b/session.json', b' ' * (1100 << 20))]")),
        ("unreadable", zip_of(&out, "outside.zip", "[('../../b/session.json', b'{}'), ('/b/recording.mcap', b'')]")),
        ("unreadable", zip_of(&out, "many.zip", "[('b/%d' % n, b'') for n in range(70000)]")),
        ("unreadable", zip_of(&out, "nested.zip", "[('b/session.json', b'[' * 200000)]")),
        ("unreadable", zip_of(&out, "large.zip", "[('b/session.json', b' ' * (300 << 20))]")),
        ("unreadable", zip_of(&out, "nothing.zip", "[]")),
        (
            "unreadable",
            zip_of(
                &out,
                "noise.zip",
                &format!(
                    "[('b/session.json', {session}), ('b/recording.mcap', b'\\x89MCAP0\\r\\n' + random.Random(1).randbytes(1 << 20))]"
                ),
            ),
        ),
        ("unreadable", zip_of(&out, "twice.zip", &format!("[('b/session.json', {session})] * 2"))),
        ("differs", marked),
        ("verified", zipped(&example, &out, "genuine.zip", str::to_string)),
    ];
    verifies_in_the_page(WEBGL, &out, &files);
}
