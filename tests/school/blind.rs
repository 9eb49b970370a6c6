//! Blind marking over a real socket: what an examiner may see before and after an own rating.

use crate::support::desk;
use crate::support::folder;
use crate::support::school;

use desk::{Browser, Desk, after};
use folder::folder;
use school::{enter, session};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Texts that only the scorer, another examiner or the class list could know.
const SECRETS: [&str; 15] = [
    "61.37",
    "23.61",
    "30.76",
    "86.43",
    "0.444",
    "Pulp laid bare",
    "anna-secret",
    "careful-secret",
    "ended-secret",
    "stage-end-secret",
    "Dr. Other",
    "other-reason",
    "47.25",
    "map-",
    "report-secret",
];

/// A session with something to hide in each of its parts, and a report and pictures beside it. Its items do not add up to
/// its points, so that a note about this would tell both.
fn secretive(folder: &Path, number: usize) -> String {
    let mut one = session("5-grinding", "anna-secret", 61.37);
    one["started"] = json!(format!("2026-11-2{number}T08:15:00Z"));
    one["operator"] = json!("careful-secret");
    one["ended_because"] = json!("ended-secret");
    one["metrics"] = json!({ "decay_cleared_pct": 86.43, "force_max_n": 0.444 });
    one["stages"][0]["ended_by"] = json!("stage-end-secret");
    let item = |title: &str, metric: &str, points: f64| json!({ "title": title, "metric": metric, "value": 86.43, "points": points, "max_points": 50.0, "full_at": 98.0, "zero_at": 70.0 });
    one["grade"]["items"] =
        json!([item("Caries removed", "decay_cleared_pct", 23.61), item("Gentle force", "force_max_n", 30.76)]);
    one["grade"]["hard_fails"] = json!(["Pulp laid bare"]);
    one["grade"]["hard_fail_checks"] =
        json!([{ "title": "Pulp laid bare", "metric": "pulp_exposed", "value": 1.0, "above": 0.0, "failed": true }]);
    let files = [
        ("report.html", "report-secret".as_bytes()),
        ("views/map-occlusal.png", b"the map report-secret"),
        ("views/before-occlusal.png", b"the tooth before"),
        ("views/after-occlusal.png", b"the tooth after"),
    ];
    one["digests"] = json!({});
    for (name, bytes) in files {
        use sha2::Digest;
        let digest: String = sha2::Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
        one["digests"][name] = json!(digest);
    }
    let bundle = enter(folder, &one);
    fs::create_dir_all(bundle.join("views")).unwrap();
    for (name, bytes) in files {
        fs::write(bundle.join(name), bytes).unwrap();
    }
    bundle.file_name().unwrap().to_string_lossy().into_owned()
}

/// Gives a name at the desk.
fn sign(browser: &Browser, name: &str) {
    let page = browser.get("/name").text();
    let form = after(&page, "name=\"form\" value=\"", "\"");
    assert_eq!(browser.post("/name", &[("form", form), ("name", name)]).status, 303);
}

fn rate(browser: &Browser, id: &str, ratings: &[(&str, &str)]) -> desk::Answer {
    let page = browser.get("/name").text();
    let form = match page.contains("name=\"form\" value=\"") {
        true => after(&page, "name=\"form\" value=\"", "\"").to_string(),
        false => browser.form_value(),
    };
    let pairs = [&[("form", form.as_str())][..], ratings].concat();
    browser.post(&format!("/session/{id}/rate"), &pairs)
}

/// Opens every address that a page leads to, and those that a curious person would try.
fn everything(browser: &Browser, ids: &[String]) -> Vec<(String, String)> {
    let mut ahead: Vec<String> = [
        "/",
        "/?sort=machine",
        "/?sort=machine&down=yes",
        "/?result=passed",
        "/?overridden=yes",
        "/history",
        "/left-out",
        "/sessions.csv",
        "/sessions.json",
        "/ratings.csv",
        "/ratings.json",
        "/name",
        "/sessions.csv?result=failed&sort=machine",
    ]
    .map(String::from)
    .to_vec();
    for id in ids {
        ahead.extend(
            ["", "/report", "/view/map-occlusal.png", "/view/map-buccal.png"].map(|at| format!("/session/{id}{at}")),
        );
    }
    ahead.push(format!("/compare?session={}&session={}", ids[0], ids[1]));
    let mut seen = BTreeSet::new();
    let mut answers = Vec::new();
    while let Some(at) = ahead.pop() {
        if !seen.insert(at.clone()) || at.starts_with("/language") {
            continue;
        }
        let answer = browser.get(&at);
        let head = answer.headers.iter().map(|(name, value)| format!("{name}: {value}\n")).collect::<String>();
        let text = answer.text();
        for attribute in ["href=\"/", "src=\"/"] {
            let links = text.split(attribute).skip(1).filter_map(|part| part.split('"').next());
            ahead.extend(links.map(|link| format!("/{}", link.split('#').next().unwrap().replace("&amp;", "&"))));
        }
        answers.push((at, head + &text));
    }
    answers
}

fn leaks(answers: &[(String, String)], secrets: &[&str]) -> Vec<String> {
    let found = |(at, text): &(String, String)| {
        let own = secrets.iter().filter(|secret| text.contains(**secret));
        own.map(|secret| format!("{at}: {secret}")).collect::<Vec<_>>()
    };
    answers.iter().flat_map(found).collect()
}

#[test]
fn nothing_of_the_marks_is_in_any_response_before_the_own_rating() {
    // Aim: an examiner cannot be led by the machine or a colleague. Method: every page, export and picture that can be
    // reached is searched for texts that only they know; then the examiner rates one of two sessions.
    let folder = folder("review_blind");
    for number in 0..2 {
        secretive(&folder, number);
    }
    // A colleague has overridden both at an open desk.
    {
        let desk = Desk::open(&folder, &[]);
        let browser = desk.browser();
        for id in browser.ids("/") {
            let given = [("points", "47.25"), ("reason", "other-reason"), ("name", "Dr. Other")];
            assert_eq!(browser.judge(&id, "0", &given).status, 303);
            assert!(browser.get(&format!("/session/{id}")).text().contains("61.37"), "the secrets are real");
        }
    }
    let desk = Desk::open(&folder, &["--blind"]);
    let browser = desk.browser();
    let answer = browser.get("/");
    assert_eq!((answer.status, answer.header("location")), (303, "/name"), "what is shown depends on the name");
    sign(&browser, "Dr. Öz");
    let ids = browser.ids("/");
    assert_eq!(ids.len(), 2);
    assert_eq!(browser.ids("/?sort=machine&down=yes&result=passed&overridden=no"), ids, "no order or filter by marks");
    let answers = everything(&browser, &ids);
    assert!(
        answers.len() > 20 && answers.iter().any(|(at, _)| at.ends_with("/view/after-occlusal.png")),
        "{answers:?}"
    );
    assert_eq!(leaks(&answers, &SECRETS), Vec::<String>::new());

    // Nor can anything be decided before the own rating.
    let form = browser.form_value();
    let given = [
        ("form", form.as_str()),
        ("item", "0"),
        ("seen", "1"),
        ("points", "50"),
        ("reason", "r"),
        ("name", "Dr. Other"),
    ];
    assert_eq!(browser.post(&format!("/session/{}/override", ids[0]), &given).status, 403);
    assert_eq!(browser.post(&format!("/session/{}/withdraw", ids[0]), &given).status, 403);
    for wrong in ["", "0", "6", "2.5", "x"] {
        assert_eq!(rate(&browser, &ids[0], &[("overall", wrong), ("item-0", "3")]).status, 422, "{wrong}");
    }
    assert!(!folder.join("ratings.jsonl").exists());

    let own = [("overall", "2"), ("item-0", "3"), ("item-1", ""), ("note", "own-note"), ("name", "Dr. Other")];
    assert_eq!(rate(&browser, &ids[0], &own).status, 303);
    assert_eq!(rate(&browser, &ids[0], &own).status, 303, "a second click writes nothing");
    let page = browser.get(&format!("/session/{}", ids[0])).text();
    for expected in ["61.37", "Dr. Other", "other-reason", "own-note", "Dr. Öz", "Pulp laid bare", ids[1].as_str()] {
        assert!(page.contains(expected), "{expected}");
    }
    // Of the other session nothing yet, wherever the first one is shown now.
    let other: Vec<(String, String)> =
        everything(&browser, &ids).into_iter().filter(|(at, _)| at.contains(&ids[1])).collect();
    assert_eq!(leaks(&other, &SECRETS), Vec::<String>::new());
    let export: Value = serde_json::from_str(&browser.get("/sessions.json").text()).unwrap();
    let of = |id: &str| export["sessions"].as_array().unwrap().iter().find(|one| one["id"] == id).unwrap().clone();
    assert_eq!(
        (&of(&ids[1])["machine"], &of(&ids[1])["history"], &of(&ids[1])["hidden"]),
        (&json!(null), &json!([]), &json!(true))
    );
    assert_eq!(
        (&of(&ids[0])["machine"]["points"], of(&ids[0])["history"].as_array().unwrap().len()),
        (&json!(61.37), 1)
    );

    // A rating entered now is recorded as what it is.
    assert_eq!(rate(&browser, &ids[0], &[("overall", "5")]).status, 303);
    let lines: Vec<Value> = fs::read_to_string(folder.join("ratings.jsonl"))
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let told =
        |line: &Value| (line["overall"].clone(), line["blind"].clone(), line["name"].clone(), line["scale"].clone());
    assert_eq!(lines.len(), 2);
    assert_eq!(told(&lines[0]), (json!(2), json!(true), json!("Dr. Öz"), json!(5)));
    assert_eq!(told(&lines[1]), (json!(5), json!(false), json!("Dr. Öz"), json!(5)));
    let table = browser.get("/ratings.csv").text();
    assert_eq!(table.lines().count(), 3, "the overall rating and one item, of the blind rating only: {table}");
    assert!(table.contains(",Dr. Öz,Caries removed,decay_cleared_pct,3,5,yes,"), "{table}");

    // A second examiner sees nothing of the first one's judgement.
    drop(desk);
    let desk = Desk::open(&folder, &["--blind"]);
    let browser = desk.browser();
    sign(&browser, "Prof. Lee");
    let secrets = [&SECRETS[..], &["own-note", "Dr. Öz"]].concat();
    assert_eq!(leaks(&everything(&browser, &ids), &secrets), Vec::<String>::new());
    // The first one, signed in again, sees what he has unlocked; the name cannot be changed within a sign-in.
    let desk = Desk::open(&folder, &["--blind"]);
    let browser = desk.browser();
    sign(&browser, "dr. öz");
    assert!(browser.get(&format!("/session/{}", ids[0])).text().contains("61.37"));
    let form = browser.form_value();
    browser.post("/name", &[("form", form.as_str()), ("name", "Prof. Lee")]);
    assert!(browser.get("/").text().contains("dr. öz"));
}

#[test]
fn an_altered_rating_hides_the_marks_again() {
    // Aim: the log of ratings has the chain of the log of overrides. Method: a rating is edited in the file while the
    // desk is running.
    let folder = folder("review_blind_chain");
    for number in 0..2 {
        secretive(&folder, number);
    }
    let desk = Desk::open(&folder, &["--blind", "--scale", "7"]);
    let browser = desk.browser();
    sign(&browser, "Dr. Öz");
    let ids = browser.ids("/");
    for id in &ids {
        assert_eq!(rate(&browser, id, &[("overall", "7")]).status, 303);
        assert!(browser.get(&format!("/session/{id}")).text().contains("61.37"));
    }
    let path = folder.join("ratings.jsonl");
    let before = fs::metadata(&path).unwrap().modified().unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains("\"overall\":7"), "{text}");
    fs::write(&path, text.replacen("\"overall\":7", "\"overall\":1", 1)).unwrap();
    fs::File::options().write(true).open(&path).unwrap().set_modified(before).unwrap();
    let page = browser.get(&format!("/session/{}", ids[0])).text();
    assert!(page.contains("ratings.jsonl: Line 1 was changed") && !page.contains("61.37"), "{page}");
}
