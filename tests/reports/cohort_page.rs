//! The pages of a cohort: sessions that are not comparable stand apart, each participant has a page, and a browser shows all of it.

use crate::support::browser;
use crate::support::bundle;
use crate::support::folder;
use crate::support::school;

use browser::browser;
use bundle::*;
use folder::folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

fn summary_of(folder: &Path, more: &[&str]) -> (Value, String) {
    let json = folder.join("cohort.json").to_str().unwrap().to_string();
    let output = typodont(&[&["cohort", folder.to_str().unwrap(), "--json", &json], more].concat());
    assert!(output.status.success(), "{}", complained(&output));
    (serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap(), told(&output))
}

#[test]
fn sessions_of_other_teeth_voxel_sizes_and_scorers_are_kept_apart() {
    // Aim: results that are not comparable are never pooled, and the page and the terminal name what differs. Method: a
    // class under four conditions, whose means differ; each group has its own mean. Regression: eight teeth were pooled.
    let folder = folder("kept_apart");
    let conditions = [(36, 0.1, "aa", 2), (36, 0.25, "bb", 2), (36, 0.1, "cc", 2), (46, 0.1, "dd", 3)];
    for (number, (fdi, voxel, tooth, scorer)) in conditions.into_iter().enumerate() {
        for person in 0..3 + number {
            let points = 20.0 * (number as f64 + 1.0) + person as f64;
            let mut one = school::session("5-grinding", &format!("student-{person}"), points);
            one["tooth_fdi"] = json!(fdi);
            one["voxel_mm"] = json!([voxel, voxel, voxel]);
            one["tooth_sha256"] = json!(format!("{tooth}{tooth}{tooth}{tooth}"));
            one["scorer_version"] = json!(scorer);
            school::enter(&folder, &one);
        }
    }
    let html = folder.join("cohort.html");
    let (summary, said) = summary_of(&folder, &["--html", html.to_str().unwrap()]);
    let groups = summary["scenarios"].as_array().unwrap();
    assert_eq!(groups.len(), 4);
    for (number, (fdi, voxel, ..)) in conditions.into_iter().enumerate() {
        let is_own = |g: &&Value| g["sessions"] == json!(3 + number);
        let group = groups.iter().find(is_own).unwrap();
        assert_eq!((&group["tooth_fdi"], &group["voxel_mm"][0]), (&json!(fdi), &json!(voxel)));
        let mean = 20.0 * (number as f64 + 1.0) + (2.0 + number as f64) / 2.0;
        assert!((group["points_mean"].as_f64().unwrap() - mean).abs() < 1e-9, "{group}");
        let cautions = group["cautions"].as_array().unwrap();
        assert!(cautions.iter().any(|caution| caution.as_str().unwrap().contains("in 4 groups")), "{group}");
        assert!(group["progress"].as_object().unwrap().is_empty(), "attempts under other conditions are no progress");
    }
    let page = std::fs::read_to_string(&html).unwrap();
    for named in [
        "tooth 36 (model aaaaaa), voxel size 0.1 mm, scoring version 2",
        "tooth 36, voxel size 0.25 mm",
        "tooth 46, voxel size 0.1 mm, scoring version 3",
    ] {
        assert!(page.contains(named) && said.contains(named), "{named}\n{said}");
    }
}

#[test]
fn a_session_names_its_tooth_and_its_voxels() {
    // Aim: the same tooth has the same digest whatever the seed; another tooth and another voxel size have others.
    let out = folder("tooth_names");
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut scenario: Value = serde_json::from_str(&text).unwrap();
    scenario.as_object_mut().unwrap().remove("$schema");
    let played = |name: &str, spacing: f64, fdi: u8, seed: &str| {
        let mut own = scenario.clone();
        let tooth = &mut own["scene"]["jaw"]["tooth"];
        tooth["form"]["procedural"]["spacing_mm"] = json!(spacing);
        tooth["fdi"] = json!(fdi);
        let path = out.join(format!("{name}.json"));
        std::fs::write(&path, own.to_string()).unwrap();
        session(&run(path.to_str().unwrap(), "hasty", &out.join(name), &["--seed", seed]))
    };
    let (first, again) = (played("first", 0.25, 36, "1"), played("again", 0.25, 36, "2"));
    let (finer, other) = (played("finer", 0.2, 36, "1"), played("other", 0.25, 37, "1"));
    assert_eq!(first["voxel_mm"], json!([0.25, 0.25, 0.25]));
    assert_eq!((&finer["voxel_mm"][0], &other["tooth_fdi"]), (&json!(0.2), &json!(37)));
    assert_eq!(first["tooth_sha256"], again["tooth_sha256"]);
    assert_ne!(first["tooth_sha256"], finer["tooth_sha256"]);
    assert_ne!(first["tooth_sha256"], other["tooth_sha256"]);
}

#[test]
fn no_interval_is_impossible() {
    // Aim: intervals of times, percentages, yes-or-no measures and answers stay within what is possible. Regression: a time
    // from −0.001 s, and t intervals of 0/1 measures. Method: skewed values near every bound.
    let folder = folder("possible");
    for person in 0..6 {
        let mut one = school::session("5-grinding", &format!("p{person}"), if person == 0 { 80.0 } else { 100.0 });
        one["metrics"] = json!({
            "soft_tissue_drilled_s": if person == 0 { 0.04 } else { 0.0 },
            "pulp_exposed": f64::from(u8::from(person == 0)),
            "decay_cleared_pct": if person == 0 { 93.0 } else { 100.0 },
            "dice": if person == 0 { 0.2 } else { 0.999 },
        });
        for item in one["questionnaire"]["items"].as_array_mut().unwrap() {
            let answer = if person == 0 { 2.0 } else { 5.0 };
            (item["value"], item["counted"]) = (json!(answer), json!(answer));
        }
        school::enter(&folder, &one);
    }
    let (summary, _) = summary_of(&folder, &[]);
    let scenario = &summary["scenarios"][0];
    let metrics = &scenario["metrics"];
    for (name, spread, [low, high]) in [
        ("points", &scenario["points"], [0.0, 100.0]),
        ("soft", &metrics["soft_tissue_drilled_s"], [0.0, f64::MAX]),
        ("pulp", &metrics["pulp_exposed"], [0.0, 1.0]),
        ("cleared", &metrics["decay_cleared_pct"], [0.0, 100.0]),
        ("dice", &metrics["dice"], [0.0, 1.0]),
        ("answer", &summary["questionnaires"][0]["items"]["u1"], [1.0, 5.0]),
    ] {
        let bound = |n: usize| spread["mean_interval"][n].as_f64().unwrap();
        let mean = spread["mean"].as_f64().unwrap();
        assert!(low <= bound(0) && bound(0) < mean && mean < bound(1) && bound(1) <= high, "{name}: {spread}");
    }
    // Wilson's interval of one in six.
    let flag = &metrics["pulp_exposed"]["mean_interval"];
    assert!((flag[0].as_f64().unwrap() - 0.030_053).abs() < 1e-5, "{flag}");
}

/// A class of six with two attempts each, under one condition.
fn class(folder: &Path) {
    for person in 0..6 {
        for attempt in 0..2 {
            let points = 50.0 + 6.0 * f64::from(person) + 9.0 * f64::from(attempt);
            let mut one = school::session("5-grinding", &format!("student-{person}"), points);
            one["metrics"]["healthy_per_decay_pct"] = json!(40.0 - points / 4.0);
            one["metrics"]["force_max_n"] = json!(1.5 + points / 100.0);
            one["metrics"]["time_to_clear_s"] = json!(200.0 - points);
            one["grade"]["items"][0]["value"] = json!(points);
            school::enter(folder, &one);
        }
    }
}

#[test]
fn every_participant_has_a_page_with_rank_and_progress() {
    // Aim: a trainee learns the rank in the class and the progress against the own last attempt, and nobody else's code.
    let folder = folder("trainees");
    class(&folder);
    let pages = folder.join("pages");
    let (_, _) = summary_of(&folder, &["--trainees", pages.to_str().unwrap()]);
    let page = |code: &str| std::fs::read_to_string(pages.join(format!("{code}.html"))).unwrap();
    let best = page("student-5");
    for expected in ["Results of student-5", ">1 of 6<", ">+9<", "pass mark 70", "your points"] {
        assert!(best.contains(expected), "{expected}:\n{best}");
    }
    assert!(page("student-2").contains(">4 of 6<"));
    assert!(page("student-0").contains("not passed (too few points)"));
    for other in 0..5 {
        assert!(!best.contains(&format!("student-{other}")), "another participant is named");
    }
    let turkish = folder.join("turkish");
    let (_, _) = summary_of(&folder, &["--trainees", turkish.to_str().unwrap(), "--language", "tr"]);
    let own = std::fs::read_to_string(turkish.join("student-5.html")).unwrap();
    assert!(own.contains("lang=\"tr\"") && own.contains("geçme puanı 70") && !own.contains("Results of"), "{own}");
    // Of four people, a rank would say what another person achieved.
    let few = self::folder("few_trainees");
    for person in 0..4 {
        school::enter(&few, &school::session("5-grinding", &format!("s{person}"), 60.0 + f64::from(person)));
    }
    let (_, _) = summary_of(&few, &["--trainees", few.join("pages").to_str().unwrap()]);
    let alone = std::fs::read_to_string(few.join("pages/s0.html")).unwrap();
    assert!(
        !alone.contains(" of 4<") && alone.contains("at least 5 participants") && !alone.contains("<svg"),
        "{alone}"
    );
}

#[test]
fn the_pages_of_a_cohort_fit_every_window() {
    // Aim: nothing is cut off at 1280 and at 400 pixels, no word is broken, and every text can be read in light and in dark
    // colours. Method: a class with experts, ratings, repeated attempts and a questionnaire, in Chromium.
    let Some([playwright, chromium]) = browser() else { return };
    let folder = folder("cohort_browser");
    class(&folder);
    let mut other = school::session("5-grinding", "visitor", 88.0);
    other["scorer_version"] = json!(9);
    school::enter(&folder, &other);
    let ratings = folder.join("ratings.csv");
    let rows: Vec<String> = (0..6).map(|n| format!("student-{n};{}", 1 + n / 2)).collect();
    std::fs::write(&ratings, format!("participant;rating\n{}\n", rows.join("\n"))).unwrap();
    let (html, pages) = (folder.join("cohort.html"), folder.join("pages"));
    let path = |p: &Path| p.to_str().unwrap().to_string();
    let (ratings, page, own) = (path(&ratings), path(&html), path(&pages));
    summary_of(&folder, &["--html", &page, "--trainees", &own, "--ratings", &ratings, "--expert", "student-5"]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/cohort_page.js");
    let mut node = Command::new("node");
    node.arg(script).args([playwright, chromium]).arg(&folder).arg(&html).arg(pages.join("student-2.html"));
    let output = node.output().unwrap();
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
}
