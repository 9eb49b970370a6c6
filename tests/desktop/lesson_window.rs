//! Lessons in the window, in the test's own process.

use crate::harness::{self, Window};
use crate::support::folder::folder;
use crate::support::window_driver::{SCREEN_SIZE, SHIPPED_EXERCISES, WindowDriver};
use crate::trainee::{Trainee, lesion_in_world, site_in_world};
use std::path::Path;
use std::time::Duration;
use typodont_app::AppOptions;

/// Options of a window that shows an exercise of the project, with seed 1.
fn exercise_options(place: &Path, exercise: &str) -> AppOptions {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(exercise);
    AppOptions { exercise: Some(path), seed: Some(1), ..harness::options(place) }
}

#[test]
fn dust_flies_water_sprays_and_both_stand_still_with_the_lesson() {
    // Aim: an exercise that asks for them has dust and water before the eye, at the window's own pace. Method: the shipped
    // exercise with spray; the state log counts the particles.
    let place = folder("spray");
    let exercise = "scenarios/7-spray.json";
    let options = AppOptions { begins_at_once: true, ..exercise_options(&place, exercise) };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    let count = |text: &str| text.parse::<u32>().unwrap();
    desk.until("water", |drops| count(drops) > 10);
    desk.press("o", "pointer", "held");
    let lesion = lesion_in_world(exercise, 1);
    desk.point_at(lesion);
    desk.picture("10-spray");
    // Water soon takes it along again.
    let has_flown = |desk: &Window| desk.history("dust").iter().any(|chips| count(chips) > 5);
    let flies = desk.press_around(lesion, |desk, round| {
        desk.picture(&format!("11-dust-{round}"));
        has_flown(desk)
    });
    assert!(flies, "no dust: {:?} % of the decay is gone", desk.latest("cleared"));
    desk.press("p", "paused", "true");
    let still = |desk: &Window| ["dust", "water"].map(|topic| desk.latest(topic).unwrap());
    desk.wait(Duration::from_secs(1));
    let before = still(&desk);
    let frames = count(&desk.latest("frames").unwrap());
    desk.until("frames", |now| count(now) >= frames + 4);
    assert_eq!(still(&desk), before, "dust and water wait with the lesson");
    desk.picture("12-paused");
}

#[test]
fn shutter_glasses_get_one_eye_after_the_other_with_its_mark() {
    // Aim: each frame shows one eye, and the line code at the lower edge says which one. Method: frames of a lesson at rest;
    // the white part of the last row is a quarter of the width or three quarters, by turns; frames of one mark are equal in
    // the middle of the view, and those of the two marks differ as two eyes do.
    let place = folder("shutter_glasses");
    harness::keep_settings(&place, r#"{ "language": "en", "stereo": "frame_sequential", "eye_distance_mm": 6.0 }"#);
    let options = AppOptions { begins_at_once: true, ..exercise_options(&place, "scenarios/5-grinding.json") };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.wait(Duration::from_secs(1));
    let [width, height] = SCREEN_SIZE.map(|pixels| pixels as usize);
    let view = |pixels: &[u8]| -> Vec<u8> {
        let rows = (height / 4..height / 2).map(|y| &pixels[4 * (y * width + width / 4)..4 * (y * width + width / 2)]);
        rows.flatten().copied().collect()
    };
    let mut frames = Vec::new();
    for frame in 0..6 {
        desk.turn();
        desk.picture(&format!("shutter-{frame}"));
        let pixels = desk.pixels();
        let last_row = &pixels[4 * (height - 1) * width..];
        let white = last_row.chunks(4).filter(|pixel| pixel[..3] == [255; 3]).count();
        assert!(last_row.chunks(4).all(|pixel| pixel[..3] == [255; 3] || pixel[..3] == [0; 3]), "the mark is sharp");
        frames.push((white, view(&pixels)));
    }
    let marks: Vec<usize> = frames.iter().map(|(white, _)| 4 * white / width).collect();
    assert!(marks == [1, 3, 1, 3, 1, 3] || marks == [3, 1, 3, 1, 3, 1], "{marks:?}");
    let difference = |a: usize, b: usize| {
        let pairs = frames[a].1.iter().zip(&frames[b].1);
        pairs.filter(|(a, b)| a.abs_diff(**b) > 8).count() as f64 / frames[a].1.len() as f64
    };
    assert!(difference(2, 4) < 0.001 && difference(3, 5) < 0.001, "{} {}", difference(2, 4), difference(3, 5));
    assert!(difference(4, 5) > 0.02, "{}", difference(4, 5));
}

#[test]
fn the_servo_does_not_wait_for_the_picture() {
    // Aim: with two pictures a second at most the session is turned as ever. Method: half a second between two frames; the
    // ticks in ten of them are counted. Whoever waited for a picture would turn a few ticks each, not hundreds.
    let place = folder("slow_window");
    let Some(mut desk) = Window::open(&place, exercise_options(&place, "scenarios/5-grinding.json")) else { return };
    desk.until("screen", |screen| screen == "briefing");
    desk.press("Return", "screen", "practice");
    let count = |text: String| text.parse::<u64>().unwrap();
    desk.until("clock", |clock| clock == "stopped");
    desk.press("o", "pointer", "held");
    desk.move_by([40, 20]);
    desk.until("clock", |clock| clock == "running");
    let first = count(desk.until("ticks", |ticks| ticks != "0"));
    for _ in 0..10 {
        std::thread::sleep(Duration::from_millis(500));
        desk.proceed();
    }
    let turned = count(desk.latest("ticks").unwrap()) - first;
    println!("{turned} ticks in 10 pictures; late (p99, max, missed): {}", desk.latest("late").unwrap());
    assert!(turned > 10 * 100, "{turned} ticks in 10 pictures");
}

#[test]
fn what_is_typed_on_one_screen_holds_on_the_next() {
    // Aim: screens only read, and a typed text is a command: none is lost on its way. Method: a folder and a code are typed
    // in the list; the code stands in the instructions, and the folder's exercise in the list.
    let place = folder("typed");
    let exercises = place.join("course");
    std::fs::create_dir_all(&exercises).unwrap();
    let text =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json")).unwrap();
    std::fs::write(exercises.join("own.json"), text.replace("\"5-grinding\"", "\"own-grinding\"")).unwrap();
    let Some(mut desk) = Window::open(&place, harness::options(&place)) else { return };
    desk.until("screen", |screen| screen == "shelf");
    desk.write_into("Your school’s exercises:", exercises.to_str().unwrap());
    desk.key("Return");
    desk.write_into("Participant code", "P-7");
    assert_eq!(desk.text_of("Participant code"), "P-7");
    desk.key("Escape");
    for _ in 0..SHIPPED_EXERCISES {
        desk.key("Down");
    }
    desk.until("chosen", |chosen| chosen == "own-grinding");
    desk.press("Return", "screen", "briefing");
    assert_eq!(desk.text_of("Participant code"), "P-7");
    desk.press("Escape", "screen", "shelf");
    assert_eq!(desk.text_of("Your school’s exercises:"), exercises.to_str().unwrap());
}

#[test]
fn a_code_that_was_cleared_is_not_brought_back_by_undoing() {
    // Aim: nobody gets at the code of an examiner or of another participant. Undoing once brought it back. Method: both
    // codes are typed and cleared by the program; then Ctrl+Z in the empty fields.
    let place = folder("cleared_codes");
    let Some(mut desk) = Window::open(&place, exercise_options(&place, "scenarios/4-diagnosis.json")) else { return };
    desk.until("screen", |screen| screen == "briefing");
    desk.write_into("Participant code", "P-7");
    desk.write_into("Examiner's code", "a long code of an examiner");
    assert_ne!(desk.text_of("Examiner's code"), "");
    // A field notes what may be brought back when its text has stayed the same for a second.
    desk.wait(Duration::from_secs(2));
    desk.key("Escape");
    desk.press("Escape", "screen", "shelf");
    desk.click("shelf.open");
    desk.until("screen", |screen| screen == "briefing");
    desk.write_into("Examiner's code", "");
    desk.key("ctrl+z");
    assert_eq!(desk.text_of("Examiner's code"), "");
    desk.key("Escape");
    desk.press("Escape", "screen", "shelf");
    desk.click_button("Someone else");
    desk.write_into("Participant code", "");
    desk.key("ctrl+z");
    assert_eq!(desk.text_of("Participant code"), "");
}

#[test]
fn a_tooth_of_an_arch_is_touched_and_its_quarter_named() {
    // Aim: whoever examines an arch answers with a tooth and, by its anatomical name, with a quarter of it. Method: the mouse goes to one
    // of the possible sites; another tooth, which was not touched, is refused; with both answers the next trial begins.
    let place = folder("arch_window");
    let exercise = "scenarios/16-arch-diagnosis.json";
    let options = AppOptions { begins_at_once: true, ..exercise_options(&place, exercise) };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.until("tooth", |tooth| tooth == "drawn");
    desk.press("o", "pointer", "held");
    // The first site: tooth 37, distobuccal.
    desk.point_at(lesion_in_world(exercise, 0));
    desk.set_button(true);
    desk.wait(Duration::from_millis(1500));
    desk.picture("21-arch");
    desk.set_button(false);
    desk.press("Escape", "pointer", "free");
    let quarter = "Which quarter of its occlusal surface?: distobuccal";
    desk.choose("Which tooth is carious?: 36");
    desk.wait(Duration::from_millis(500));
    assert!(!desk.offers(quarter), "an answer about a tooth that was not touched is taken");
    desk.choose("Which tooth is carious?: 37");
    desk.wait(Duration::from_millis(500));
    desk.picture("21-arch-quarter");
    desk.choose(quarter);
    desk.until("stage", |stage| stage == "1");
}

#[test]
fn a_tooth_overhead_is_touched_and_its_quarter_named() {
    // Aim: a trainee with a mouse examines the opposite jaw, too. In the upper left, quarter 2 is distobuccal. Method: the view of the upper left quadrant; the pointer is led over
    // a possible site on tooth 26 by where the hand is, and presses; the answer that it was there is taken, one about a tooth that
    // was not touched is not.
    let place = folder("mouth_window");
    let exercise = "scenarios/17-mouth-diagnosis.json";
    let options = AppOptions { begins_at_once: true, ..exercise_options(&place, exercise) };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.until("tooth", |tooth| tooth == "drawn");
    // The view at work looks through the upper jaw, which is left out of the picture and not pointed at.
    desk.move_to([670, 387]);
    desk.turn();
    desk.set_button(true);
    desk.set_button(false);
    desk.wait(Duration::from_millis(1500));
    desk.point_at(site_in_world(exercise, "36-1"));
    desk.set_button(true);
    desk.wait(Duration::from_millis(1500));
    desk.picture("22-mouth-below");
    desk.set_button(false);
    desk.choose("Which tooth is carious?: 36");
    desk.wait(Duration::from_millis(500));
    desk.choose("Which quarter of its occlusal surface?: distobuccal");
    desk.until("stage", |stage| stage == "1");
    desk.press("Escape", "pointer", "free");
    desk.choose_from("View", "2 upper left");
    desk.wait(Duration::from_millis(1500));
    desk.picture("22-mouth");
    // Over tooth 26: a click picks the instrument up.
    desk.move_to([690, 440]);
    desk.turn();
    desk.set_button(true);
    desk.set_button(false);
    desk.wait(Duration::from_millis(1500));
    desk.point_at(site_in_world(exercise, "26-2"));
    desk.set_button(true);
    desk.wait(Duration::from_millis(1500));
    desk.picture("22-mouth-pressed");
    desk.set_button(false);
    let quarter = "Which quarter of its occlusal surface?: distobuccal";
    desk.choose("Which tooth is carious?: 27");
    desk.wait(Duration::from_millis(500));
    assert!(!desk.offers(quarter), "an answer about a tooth that was not touched is taken");
    desk.choose("Which tooth is carious?: 26");
    desk.wait(Duration::from_millis(500));
    desk.choose(quarter);
    desk.until("stage", |stage| stage == "2");
}

#[test]
fn one_stroke_draws_all_channels_that_are_switched_on() {
    // Aim: the editor begins at y = x with all channels, and a stroke changes the tooth. Method: the names of the drawing say
    // which channels are drawn; the screen before and after a stroke that lowers all channels but green.
    let place = folder("transfer");
    let options = AppOptions { begins_at_once: true, ..exercise_options(&place, "scenarios/12-deep-caries.json") };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.choose("User-defined colours");
    desk.wait(Duration::from_millis(500));
    desk.unfold("Colours and opacity");
    desk.wait(Duration::from_secs(1));
    desk.click_button("y = x");
    desk.wait(Duration::from_secs(1));
    desk.picture("20-straight-line");
    let before = desk.pixels();
    desk.click_button("Green");
    desk.wait(Duration::from_millis(200));
    desk.draw_in("Curve, all tissues, Red + Blue + Alpha", [[0.01, 0.3], [0.99, 0.3]]);
    desk.wait(Duration::from_secs(1));
    desk.picture("21-green");
    let differing = before.iter().zip(desk.pixels()).filter(|(a, b)| a.abs_diff(*b) > 8).count();
    assert!(differing > 20_000, "{differing} values of the screen differ");
}

#[test]
fn pictures_of_the_case_are_seen_before_the_work_and_beside_it() {
    // Aim: a trainee looks at a radiograph in the briefing, opens it, and has it beside the tooth during the lesson. Method: a
    // photograph of one colour; its pixels are counted on the screen.
    let place = folder("case_pictures_window");
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut exercise: serde_json::Value =
        serde_json::from_str(&text.replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.25")).unwrap();
    exercise.as_object_mut().unwrap().remove("$schema");
    exercise["pictures"] = serde_json::json!([{ "file": "bitewing.jpg", "title": "Bite-wing radiograph" }]);
    let path = place.join("case.json");
    std::fs::write(&path, exercise.to_string()).unwrap();
    image::RgbImage::from_pixel(600, 400, image::Rgb([250, 0, 200])).save(place.join("bitewing.jpg")).unwrap();
    let options = AppOptions { exercise: Some(path), seed: Some(1), ..harness::options(&place) };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "briefing");
    let shown = |desk: &mut Window| {
        let is_pink = |pixel: &[u8]| pixel[0] > 240 && pixel[1] < 12 && pixel[2].abs_diff(200) < 12;
        desk.pixels().chunks(4).filter(|pixel| is_pink(pixel)).count()
    };
    desk.turn();
    let small = shown(&mut desk);
    assert!((5_000..60_000).contains(&small), "{small} pixels of the picture in the briefing");
    desk.picture("case-briefing");
    desk.click("picture.0");
    desk.turn();
    let large = shown(&mut desk);
    assert!(large > 3 * small, "{large} pixels of the opened picture, {small} in the briefing");
    desk.picture("case-opened");
    desk.click_button("Close window");
    desk.click("briefing.begin");
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    assert_eq!(shown(&mut desk), 0, "it is closed");
    desk.click("picture.0");
    desk.turn();
    assert!(shown(&mut desk) > 3 * small, "it is beside the tooth");
    desk.picture("case-practice");
}

#[test]
fn a_window_seen_in_a_mirror_is_drawn_flipped() {
    // Aim: who sees the screen in a mirror sees the window as everybody does, text and picture. Method: the same exercise at
    // rest in three windows; the flipped pixels are those of the ordinary window, except along some edges.
    let [width, height] = SCREEN_SIZE.map(|pixels| pixels as usize);
    let draw = |mirrored: &str| {
        let place = folder(&format!("mirrored_{mirrored}"));
        harness::keep_settings(&place, &format!(r#"{{ "language": "en", "mirrored": "{mirrored}" }}"#));
        let options = AppOptions { begins_at_once: true, ..exercise_options(&place, "scenarios/5-grinding.json") };
        let mut desk = Window::open(&place, options)?;
        desk.until("screen", |screen| screen == "practice");
        desk.until("tooth", |tooth| tooth == "drawn");
        desk.wait(Duration::from_secs(1));
        desk.picture(&format!("mirrored-{mirrored}"));
        Some(desk.pixels())
    };
    let Some(ordinary) = draw("no") else { return };
    for (mirrored, flip) in [("left_right", [true, false]), ("top_bottom", [false, true])] {
        let flipped = draw(mirrored).unwrap();
        let is_equal = |i: &usize| {
            let (x, y) = (i % width, i / width);
            let x = if flip[0] { width - 1 - x } else { x };
            let y = if flip[1] { height - 1 - y } else { y };
            let (a, b) = (&ordinary[4 * i..4 * i + 3], &flipped[4 * (y * width + x)..][..3]);
            a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) < 24)
        };
        let share = (0..width * height).filter(is_equal).count() as f32 / (width * height) as f32;
        assert!(share > 0.99, "{mirrored}: {share} of the pixels are the same");
    }
}

#[test]
fn stereo_in_a_mirror_keeps_each_eye_in_its_half() {
    // Aim: a screen for side-by-side stereo gives its left half to the left eye, also where the window is flipped. Method: the
    // left half of the flipped view is the mirror image of the left half of the ordinary one, and not of the right one.
    let width = SCREEN_SIZE[0] as usize;
    let draw = |mirrored: &str| {
        let place = folder(&format!("mirrored_stereo_{mirrored}"));
        let settings = format!(
            r#"{{ "language": "en", "mirrored": "{mirrored}", "stereo": "side_by_side", "eye_distance_mm": 20.0 }}"#
        );
        harness::keep_settings(&place, &settings);
        let options = AppOptions { begins_at_once: true, ..exercise_options(&place, "scenarios/5-grinding.json") };
        let mut desk = Window::open(&place, options)?;
        desk.until("screen", |screen| screen == "practice");
        desk.until("tooth", |tooth| tooth == "drawn");
        desk.wait(Duration::from_secs(1));
        Some((desk.pixels(), desk.view_of("The tooth")))
    };
    let Some((ordinary, [left, top, right, bottom])) = draw("no") else { return };
    let (flipped, _) = draw("left_right").unwrap();
    let half = (right - left) / 2;
    let share = |half_begins: usize| {
        // Without the edges of the panels and the hint below.
        let places = (top + 10..bottom - 80).flat_map(|y| (10..half - 10).map(move |x| [x, y]));
        let is_equal = |&[x, y]: &[usize; 2]| {
            let a = &ordinary[4 * (y * width + half_begins + half - 1 - x)..][..3];
            let b = &flipped[4 * (y * width + width - right + x)..][..3];
            a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) < 24)
        };
        places.clone().filter(is_equal).count() as f32 / places.count() as f32
    };
    let (same_eye, other_eye) = (share(left), share(left + half));
    assert!(same_eye > 0.97 && other_eye < same_eye - 0.05, "{same_eye} of the same eye, {other_eye} of the other");
}
