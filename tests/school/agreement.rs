//! Two scripted raters at the review desk, and what `typodont cohort` says of their agreement.

use crate::support::bundle::typodont;
use crate::support::desk;
use crate::support::folder;
use crate::support::school;
use crate::support::tools;

use desk::{Browser, Desk, after};
use folder::folder;
use school::{enter, session};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

const WORKS: usize = 24;

/// A graded session with a recording of its own, whose points grow with its number.
fn work(number: usize) -> Value {
    let points = [20.0 + 1.5 * number as f64, 15.0 + 1.2 * number as f64];
    let mut one = session("5-grinding", &format!("student-{number:02}"), points[0] + points[1]);
    one["started"] = json!(format!("2026-11-21T10:{number:02}:00Z"));
    one["digests"] = json!({ "recording.mcap": format!("{number:064x}") });
    let item = |title: &str, metric: &str, points: f64| json!({ "title": title, "metric": metric, "value": 87.5, "points": points, "max_points": 60.0, "full_at": 98.0, "zero_at": 70.0 });
    one["grade"]["items"] =
        json!([item("Caries removed", "decay_cleared_pct", points[0]), item("Gentle force", "force_max_n", points[1])]);
    one
}

/// Rating by a rater of known severity: two raters agree in two works of three, and differ by one or two elsewhere.
fn rating(rater: usize, number: usize) -> usize {
    let truth = 1 + number * 5 / WORKS;
    let away = if rater == 1 && number.is_multiple_of(3) { [1, -1, 2][number / 3 % 3] } else { 0 };
    truth.saturating_add_signed(away).clamp(1, 5)
}

fn form_value(browser: &Browser) -> String {
    after(&browser.get("/name").text(), "name=\"form\" value=\"", "\"").to_string()
}

#[test]
fn two_scripted_raters_agree_as_python_says() {
    // Aim: ratings entered blind come out of the cohort with the kappa and ICC of statsmodels and pingouin. Method: two
    // raters at desks of their own, the desk's export, the cohort's figures, and a script that computes them again.
    let folder = folder("review_agreement");
    let bundles = folder.join("bundles");
    for number in 0..WORKS {
        enter(&bundles, &work(number));
    }
    let table = folder.join("ratings.csv");
    let mut desk_page = String::new();
    for (rater, name) in ["Dr. Öz", "Prof. Lee"].into_iter().enumerate() {
        let desk = Desk::open(&bundles, &["--blind"]);
        let browser = desk.browser();
        let form = form_value(&browser);
        assert_eq!(browser.post("/name", &[("form", &form), ("name", name)]).status, 303);
        if rater == 1 {
            let page = browser.get("/agreement").text();
            assert!(page.contains(&format!("left out: {WORKS}.")), "{page}");
            assert!(!page.contains("automatic grade</bdi>"), "nothing is told before an own rating: {page}");
        }
        let export: Value = serde_json::from_str(&browser.get("/sessions.json").text()).unwrap();
        let sessions = export["sessions"].as_array().unwrap();
        assert_eq!(sessions.len(), WORKS);
        for id in sessions.iter().map(|one| one["id"].as_str().unwrap()) {
            // The desk shows only the day; the number of the work is found as a scripted examiner may.
            let number = number_of(&bundles, id);
            let (overall, item) = (rating(rater, number).to_string(), rating(rater, (number + 1) % WORKS).to_string());
            let form = browser.form_value();
            let pairs = [("form", form.as_str()), ("overall", &overall), ("item-0", &item)];
            let answer = browser.post(&format!("/session/{id}/rate"), &pairs);
            assert_eq!(answer.status, 303, "{}", answer.text());
        }
        fs::write(&table, browser.get("/ratings.csv").body).unwrap();
        desk_page = browser.get("/agreement").text();
    }
    let (summary, page) = (folder.join("cohort.json"), folder.join("cohort.html"));
    let paths = [&bundles, &table, &summary, &page].map(|path| path.to_str().unwrap().to_string());
    let output = typodont(&["cohort", &paths[0], "--ratings", &paths[1], "--json", &paths[2], "--html", &paths[3]]);
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{told}{}", String::from_utf8_lossy(&output.stderr));
    assert!(told.contains("agreement, Dr. Öz – Prof. Lee: κ 0."), "{told}");
    // The page of the desk states the figures of the cohort.
    let kappa = after(&told, "agreement, Dr. Öz – Prof. Lee: κ ", ", quadratic");
    assert!(desk_page.contains("Dr. Öz – Prof. Lee") && desk_page.contains(kappa), "{kappa}: {desk_page}");
    assert!(desk_page.contains("Caries removed, scale 1 to 5") && desk_page.contains("Dr. Öz – automatic grade"));
    let figures: Value = serde_json::from_str(&fs::read_to_string(&summary).unwrap()).unwrap();
    let about = &figures["scenarios"][0]["agreement"];
    assert_eq!(about.as_array().unwrap().len(), 2, "the works as a whole, and one item: {about}");
    assert_eq!(about[0]["pairs"].as_array().unwrap().len(), 3, "the raters, and each with the machine: {about}");
    assert_eq!((&about[0]["item"], &about[0]["works"]), (&Value::Null, &json!(WORKS)));
    let html = fs::read_to_string(&page).unwrap();
    for expected in ["Inter-examiner agreement", "Dr. Öz – automatic grade", "Points near the pass mark", "Contrasting"]
    {
        assert!(html.contains(expected), "{expected}");
    }
    // The error of measurement names those within it, and nobody else.
    let error = &figures["scenarios"][0]["measurement_error"];
    let sem = error["sem"].as_f64().unwrap();
    let near = (0..WORKS).filter(|n| (35.0 + 2.7 * *n as f64 - 70.0).abs() <= sem).count();
    assert!(near > 0 && near < WORKS, "{error}");
    assert_eq!((error["in_doubt"].as_array().unwrap().len(), &error["decided"]), (near, &json!(WORKS)), "{error}");

    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python with scipy, statsmodels and pingouin") else {
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_agreement.py");
    let output = Command::new(python).arg(script).args([&bundles, &table, &summary]).output().unwrap();
    let (told, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}{complained}");
    println!("{complained}");
}

/// Number of the work with a session id.
fn number_of(bundles: &Path, id: &str) -> usize {
    let read = |path: std::path::PathBuf| -> Value {
        serde_json::from_str(&fs::read_to_string(path.join("session.json")).unwrap()).unwrap()
    };
    let sessions = fs::read_dir(bundles).unwrap().map(|entry| entry.unwrap().path());
    let sessions = sessions.filter(|path| path.is_dir()).map(read);
    let number = sessions.filter(|one| {
        let session: typodont_report::SessionFile = serde_json::from_value(one.clone()).unwrap();
        typodont_integrations::session_id(&session) == id
    });
    let own = number.map(|one| one["participant"].as_str().unwrap()[8..].parse().unwrap()).next();
    own.expect("the session is one of the folder")
}
