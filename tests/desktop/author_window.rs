//! The author's screen, driven as a curriculum designer drives it, in the test's own process.
//!
//! `TYPODONT_TEST_PICTURES=DIR` keeps pictures.

use crate::harness::{self, Window};
use crate::support::bundle::{complained, session, typodont};
use crate::support::folder::folder;
use crate::support::window_driver::{PATIENCE, SHIPPED_EXERCISES, WindowDriver};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use typodont_app::{AppOptions, OpenMode};

const DECAY: &str = "/scene/jaw/tooth/decay/0";

/// The decay that is worked on, as the file has it.
fn decay(desk: &Window) -> Value {
    serde_json::from_str(&desk.latest("decay").unwrap_or_default()).unwrap_or_default()
}

fn pointer(value: &Value, at: &str) -> f64 {
    value.pointer(at).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

#[test]
fn an_exercise_is_made_from_nothing_tried_saved_checked_run_and_reported() {
    // Aim: a designer who never programs gets from nothing to a marked session. Method: the program itself; the mouse chooses
    // a tooth on the chart, points at it and drags the decay's size; keys write; then the command line takes the file.
    let place = folder("author");
    let Some(mut desk) = Window::open(&place, harness::options(&place)) else { return };
    desk.until("screen", |screen| screen == "shelf");
    desk.picture("author-0-shelf");
    desk.click("shelf.new");
    desk.until("screen", |screen| screen == "author");
    desk.until("checked", |checked| checked == "true");
    desk.picture("author-1-exercise");
    desk.write("/title", "Decay on the cheek side of 16");
    desk.write("/id", "cheek-side");

    desk.click("part:Tooth");
    desk.place_of("tooth:36");
    let before = desk.latest("teeth").unwrap();
    desk.click("tooth:16");
    desk.until("teeth", |teeth| teeth != before);
    desk.until("checked", |checked| checked == "true");
    desk.picture("author-2-tooth");

    desk.click("part:Decay");
    desk.place_of(&format!("entry:{DECAY}"));
    let [x, y] = desk.place_of("view");
    let now = desk.latest("decay").unwrap();
    // A little beside the middle, where no handle is.
    desk.click_at([x + 30, y + 55]);
    desk.until("decay", |decay| decay != now && decay.contains("offset_mm"));
    desk.until("checked", |checked| checked == "true");
    let radius = pointer(&decay(&desk), "/shape/sphere/radius_mm");
    desk.drag(&format!("handle:{DECAY}/shape/sphere/radius_mm"), [24, 0]);
    desk.until("decay", |decay| {
        let value: Value = serde_json::from_str(decay).unwrap_or_default();
        pointer(&value, "/shape/sphere/radius_mm") > radius + 0.2
    });
    desk.until("checked", |checked| checked == "true");
    desk.picture("author-3-decay");

    desk.click("part:Tissues");
    desk.picture("author-4-tissues");
    desk.click("part:Instruments");
    desk.picture("author-5-instruments");
    desk.click("part:Stages");
    desk.write("/stages/0/time_limit_s", "240");
    desk.picture("author-6-stages");
    desk.click("part:Zones");
    desk.click("add:/zones");
    desk.place_of("entry:/zones/0");
    desk.picture("author-7-zones");

    desk.click("part:Marks");
    desk.write("/rubric/pass_points", "170");
    desk.until("complaints", |count| count == "1");
    desk.picture("author-8-wrong");
    desk.key("ctrl+z");
    desk.until("complaints", |count| count == "0");
    desk.until("checked", |checked| checked == "true");
    desk.picture("author-9-marks");
    desk.click("part:Text");
    desk.picture("author-10-text");
    desk.key("F8");
    desk.click("answer:close");

    let before = desk.pixels();
    desk.key("F5");
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.picture("author-11-try");
    desk.press("ctrl+Return", "asked", "finish");
    desk.press("Return", "screen", "results");
    desk.until("bundle", |_| true);
    desk.picture("author-12-tried");
    desk.press("Return", "screen", "author");
    // The renderer has drawn another tooth in between.
    desk.turn();
    let differing = before.iter().zip(desk.pixels()).filter(|(a, b)| a.abs_diff(*b) > 8).count();
    assert!(differing * 100 < before.len(), "{differing} of {} samples of the screen differ", before.len());

    let file = place.join("my exercises").join("cheek-side.json");
    // The field is ready to be typed in. A mistyped folder is not created.
    let save_as = |desk: &mut Window| {
        desk.key("ctrl+s");
        desk.turn();
        desk.key("ctrl+a");
        desk.type_text(file.to_str().unwrap());
        desk.turn();
        desk.picture("author-13-save");
        desk.key("Return");
        desk.turn();
    };
    save_as(&mut desk);
    assert!(!file.parent().unwrap().exists());
    assert_eq!(desk.latest("unsaved").as_deref(), Some("true"));
    fs::create_dir(file.parent().unwrap()).unwrap();
    save_as(&mut desk);
    desk.until("file", |name| name == file.to_str().unwrap());
    desk.until("unsaved", |unsaved| unsaved == "false");
    let text = fs::read_to_string(&file).unwrap();
    let scenario: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(scenario["title"], "Decay on the cheek side of 16");
    assert_eq!(scenario["scene"]["jaw"]["tooth"]["fdi"], 16);
    assert_eq!(scenario["stages"][0]["time_limit_s"], 240.0);
    assert_eq!(scenario["zones"].as_array().unwrap().len(), 1);
    assert!(text.lines().all(|line| line.len() < 200), "a person can read it");

    // Back on the shelf it stands among the others.
    desk.click("leave");
    desk.until("chosen", |chosen| chosen == "cheek-side");
    drop(desk);

    let path = file.to_str().unwrap();
    let checked = typodont(&["check", path]);
    assert!(checked.status.success(), "{}", complained(&checked));
    let out = place.join("bundles");
    let run =
        typodont(&["run", path, "--headless", "--operator", "expert", "--seed", "1", "--out", out.to_str().unwrap()]);
    assert!(run.status.success(), "{}", complained(&run));
    let said = String::from_utf8(run.stdout).unwrap();
    let bundle = PathBuf::from(said.lines().last().unwrap());
    let session = session(&bundle);
    assert_eq!(session["scenario"]["id"], "cheek-side");
    assert!(session["grade"]["points"].as_f64().is_some_and(|points| points > 0.0), "{}", session["grade"]);
    assert!(bundle.join("report.html").is_file());
    println!("grade: {}", session["grade"]["points"]);
}

#[test]
fn a_file_that_changes_elsewhere_is_shown_anew_and_nothing_of_ones_own_is_lost() {
    // Aim: an editor and the window work on one file. Method: the file is written from outside while it is shown, broken, and
    // mended; while it is edited; and the window goes without a chance to save, with a change unsaved.
    let place = folder("author-reload");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let text = fs::read_to_string(shipped).unwrap().replace("\"id\": \"5-grinding\"", "\"id\": \"mine\"");
    let file = place.join("mine.json");
    fs::write(&file, &text).unwrap();
    let path = file.to_str().unwrap().to_string();
    let watching =
        AppOptions { exercise: Some(file.clone()), editor_mode: Some(OpenMode::ReadOnly), ..harness::options(&place) };
    let Some(mut desk) = Window::open(&place, watching) else { return };
    desk.until("screen", |screen| screen == "author");
    desk.until("checked", |checked| checked == "true");
    let seen = desk.latest("teeth").unwrap();
    fs::write(&file, text.replace("\"fdi\": 36", "\"fdi\": 11")).unwrap();
    desk.until("told", |told| told == "author.shown_anew");
    desk.until("teeth", |teeth| teeth != seen);
    fs::write(&file, text.replace("\"pass_points\": 70", "\"pass_points\": 700")).unwrap();
    desk.until("complaints", |count| count == "1");
    desk.picture("author-14-watched");
    fs::write(&file, &text[..text.len() / 2]).unwrap();
    desk.until("checked", |checked| checked == "true");
    desk.click("part:Text");
    desk.picture("author-15-broken");
    fs::write(&file, &text).unwrap();
    desk.until("complaints", |count| count == "0");
    drop(desk);

    let home = harness::user_folder(&place);
    harness::keep_settings(&place, &format!("{{ \"exercises\": {place:?}, \"language\": \"en\" }}"));
    let Some(mut desk) = Window::open(&place, harness::options(&place)) else { return };
    let edit = |desk: &mut Window| {
        for _ in 0..SHIPPED_EXERCISES {
            desk.key("Down");
        }
        desk.until("chosen", |chosen| chosen == "mine");
        desk.click("shelf.edit");
        desk.until("screen", |screen| screen == "author");
    };
    edit(&mut desk);
    assert_eq!(desk.until("file", |file| !file.is_empty()), path, "the school's file, not the shipped one");
    desk.write("/title/en", "Mine");
    desk.until("unsaved", |unsaved| unsaved == "true");
    fs::write(&file, text.replace("Caries removal", "Theirs")).unwrap();
    desk.place_of("answer:mine");
    desk.picture("author-16-elsewhere");
    desk.click("answer:mine");
    // One's own still stands, and is kept beside the settings: the machine may go out.
    let drafts = home.join("drafts");
    let begun = std::time::Instant::now();
    while fs::read_dir(&drafts).map_or(0, |files| files.count()) == 0 {
        assert!(begun.elapsed() < PATIENCE, "no draft");
        desk.proceed();
    }
    drop(desk);

    let Some(mut desk) = Window::open(&place, harness::options(&place)) else { return };
    edit(&mut desk);
    desk.until("told", |told| told == "author.brought_back");
    desk.key("ctrl+s");
    desk.until("unsaved", |unsaved| unsaved == "false");
    let saved = fs::read_to_string(&file).unwrap();
    assert_eq!(saved, text.replace("Caries removal", "Mine"), "only the title has changed");

    // A new exercise that was begun outlives whoever only looks at it; it was once forgotten then.
    for is_begun in [false, true] {
        desk.click("leave");
        desk.until("screen", |screen| screen == "shelf");
        desk.click("shelf.new");
        desk.until("screen", |screen| screen == "author");
        if !is_begun {
            desk.write("/title", "Begun and not saved");
        }
    }
    desk.click("leave");
    desk.until("screen", |screen| screen == "shelf");
    let kept = fs::read_to_string(drafts.join("new.draft.json")).unwrap();
    assert!(kept.contains("Begun and not saved"), "{kept}");
}

#[test]
fn everything_can_be_reached_in_large_type_and_in_both_languages() {
    // Aim: whoever needs large type finds every part. Method: the largest type on a small screen; each part is clicked, and every
    // button of the bar lies in the window.
    for language in ["en", "tr"] {
        let place = folder(&format!("author-large-{language}"));
        harness::keep_settings(&place, &format!("{{ \"language\": {language:?}, \"font_size\": 1.6 }}"));
        let Some(mut desk) = Window::open(&place, harness::options(&place)) else { return };
        desk.picture(&format!("author-large-{language}-shelf"));
        desk.click("shelf.new");
        desk.until("screen", |screen| screen == "author");
        desk.until("checked", |checked| checked == "true");
        let all = ["leave", "undo", "redo", "check", "save", "save_as", "try", "view", "cut:0", "cut:1", "cut:2"];
        for name in all {
            let [x, y] = desk.place_of(name);
            assert!((0..1280).contains(&x) && (0..800).contains(&y), "{language} {name}: {x},{y}");
        }
        for part in ["Exercise", "Tooth", "Decay", "Tissues", "Instruments", "Stages", "Zones", "Marks", "Text"] {
            desk.click(&format!("part:{part}"));
            desk.until("part", |shown| shown == part);
            desk.picture(&format!("author-large-{language}-{part}"));
        }
    }
}
