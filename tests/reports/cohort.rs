//! The ten dentists of the thesis (Table 8.1), entered as sessions, come out with the means the thesis prints.

use crate::support::bundle;
use crate::support::folder;
use crate::support::school;

use bundle::*;
use folder::folder;
use serde_json::{Value, json};
use std::path::Path;

/// Scenario 3: stiffness at the answer, whether it was right, time. Scenario 4: quadrant's truth, time. Scenario 5: time
/// to clear, decay cleared %, healthy per decay %. Times in minutes and seconds as printed.
type Row = (f64, bool, &'static str, bool, &'static str, &'static str, f64, f64);

#[rustfmt::skip]
const TABLE: [Row; 10] = [
    (0.4, true,  "1:35", false, "5:00", "3:16", 98.74,  75.84),
    (0.4, true,  "5:00", false, "5:00", "5:00", 97.75,  96.89),
    (0.7, true,  "1:12", true,  "1:20", "5:00", 72.92,  47.88),
    (0.1, true,  "0:40", false, "3:56", "3:38", 96.03,  91.22),
    (0.4, true,  "1:46", true,  "5:00", "5:00", 97.54,  99.06),
    (0.7, true,  "1:09", true,  "1:40", "3:18", 95.52,  44.94),
    (0.7, true,  "0:57", true,  "4:22", "4:12", 99.70, 125.0),
    (0.7, false, "1:38", true,  "1:05", "4:30", 97.40,  67.89),
    (0.4, false, "1:40", true,  "3:15", "4:10", 97.49,  76.07),
    (0.7, true,  "0:53", true,  "3:20", "4:20", 98.84,  88.14),
];

fn seconds(time: &str) -> f64 {
    let (minutes, seconds) = time.split_once(':').unwrap();
    minutes.parse::<f64>().unwrap() * 60.0 + seconds.parse::<f64>().unwrap()
}

fn enter(folder: &Path, scenario: &str, user: usize, metrics: Value) {
    let folder = folder.join(scenario).join(format!("user-{user:02}"));
    std::fs::create_dir_all(&folder).unwrap();
    let session = json!({
        "version": 1, "scenario": { "id": scenario }, "participant": format!("{user}"), "metrics": metrics
    });
    std::fs::write(folder.join("session.json"), session.to_string()).unwrap();
}

#[test]
fn table_8_1_comes_out_as_printed() {
    let folder = folder("table_8_1");
    for (row, &(level, tooth, found, quadrant, located, cleared_in, cleared, healthy)) in TABLE.iter().enumerate() {
        let flag = |right: bool| f64::from(u8::from(right));
        enter(
            &folder,
            "3-detection",
            row + 1,
            json!({ "detect_tooth": flag(tooth), "detect_level": level, "detect_level_time_s": seconds(found) }),
        );
        enter(
            &folder,
            "4-diagnosis",
            row + 1,
            json!({ "detect_quadrant": flag(quadrant), "detect_quadrant_time_s": seconds(located) }),
        );
        let metrics = json!({
            "decay_cleared_pct": cleared, "healthy_per_decay_pct": healthy, "time_to_clear_s": seconds(cleared_in)
        });
        enter(&folder, "5-grinding", row + 1, metrics);
    }
    let [html, csv, json] = ["html", "csv", "json"].map(|e| folder.join(format!("cohort.{e}")));
    let path = |p: &Path| p.to_str().unwrap().to_string();
    let arguments = ["cohort", &path(&folder), "--html", &path(&html), "--csv", &path(&csv), "--json", &path(&json)];
    let output = typodont(&arguments);
    assert!(output.status.success(), "{}", complained(&output));

    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let scenario = |id: &str| {
        let all = summary["scenarios"].as_array().unwrap();
        all.iter().find(|s| s["id"] == id).unwrap().clone()
    };
    let mean = |name: &str| scenario("5-grinding")["metrics"][name]["mean"].as_f64().unwrap();
    assert_eq!(format!("{:.2}", mean("decay_cleared_pct")), "95.19");
    assert_eq!(format!("{:.2}", mean("healthy_per_decay_pct")), "81.29");
    assert_eq!(mean("time_to_clear_s").floor(), 4.0 * 60.0 + 14.0);
    let right = |id: &str, flag: &str| scenario(id)["right"][flag].clone();
    let (tooth, quadrant) = (right("3-detection", "detect_tooth"), right("4-diagnosis", "detect_quadrant"));
    assert_eq!((&tooth["right"], &tooth["of"]), (&json!(8), &json!(10)));
    assert_eq!(tooth["levels"], json!({ "0.1": 1, "0.4": 3, "0.7": 4 }));
    assert_eq!((&quadrant["right"], &quadrant["of"]), (&json!(7), &json!(10)));

    // The same in words, on the page and in the terminal.
    let page = std::fs::read_to_string(&html).unwrap();
    for text in [page, told(&output)] {
        // The thesis prints 2:00 for the mean time of the seven right answers of scenario 4: their sum, divided by ten.
        for expected in ["95.19", "81.29", "4:14", "8 of 10", "7 of 10", "2:51.7", "divided by all 10", "2:00.2"] {
            assert!(text.contains(expected), "{expected} is missing in\n{text}");
        }
    }
    let table = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(table.lines().count(), 31);
    assert!(table.contains("125"));
}

#[test]
fn what_is_no_session_is_named_and_left_out() {
    let folder = folder("odd_cohort");
    enter(&folder, "5-grinding", 1, json!({ "decay_cleared_pct": 50.0 }));
    for (name, text) in [("broken", "{"), ("newer", r#"{"version":9,"scenario":{"id":"x"},"metrics":{}}"#)] {
        std::fs::create_dir_all(folder.join(name)).unwrap();
        std::fs::write(folder.join(name).join("session.json"), text).unwrap();
    }
    let output = typodont(&["cohort", folder.to_str().unwrap()]);
    assert!(output.status.success());
    let complaints = complained(&output);
    assert!(complaints.contains("broken") && complaints.contains("newer program (version 9)"), "{complaints}");
    assert!(told(&output).contains("(1 session"), "{}", told(&output));
}

#[test]
fn a_participant_is_never_a_formula() {
    // Aim: a code that a spreadsheet would run as a formula, or a browser as a script, stays a text.
    let folder = folder("formula");
    let bundle = folder.join("one");
    std::fs::create_dir_all(&bundle).unwrap();
    let code = "=cmd|'/c calc'!A1 <script>alert(1)</script>";
    let session = json!({ "version": 1, "scenario": { "id": "x" }, "participant": code, "metrics": { "dice": 1.0 } });
    std::fs::write(bundle.join("session.json"), session.to_string()).unwrap();
    let [html, csv] = ["html", "csv"].map(|e| folder.join(format!("cohort.{e}")).to_str().unwrap().to_string());
    let output = typodont(&["cohort", folder.to_str().unwrap(), "--html", &html, "--csv", &csv]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(std::fs::read_to_string(csv).unwrap().contains(",'=cmd"));
    assert!(!std::fs::read_to_string(html).unwrap().contains("<script>alert"));
}

/// Appendix E of the thesis: the mean answer of ten dentists to each statement, by category. Of two statements no figure is legible;
/// the last is printed as 44.
#[rustfmt::skip]
const APPENDIX_E: [(&str, &str, [Option<f64>; 5]); 5] = [
    ("usability",     "u", [Some(2.8), Some(3.7), Some(3.6), Some(3.2), Some(2.6)]),
    ("clarity",       "c", [Some(3.3), Some(2.8), Some(3.0), Some(1.9), Some(2.7)]),
    ("effectiveness", "e", [Some(2.2), Some(3.0), Some(3.1), Some(3.7), Some(3.4)]),
    ("support",       "s", [Some(2.9), Some(3.2), Some(3.9), Some(3.6), Some(3.5)]),
    ("satisfaction",  "t", [Some(3.9), None, None, Some(3.1), Some(4.4)]),
];

/// Statements against the system.
const AGAINST: [&str; 9] = ["u2", "u4", "u5", "c5", "e2", "s2", "s3", "s4", "t2"];

#[test]
fn appendix_e_comes_out_as_printed() {
    // Aim: the printed means, and the categories with negative statements mirrored. Method: ten people whose answers to a statement
    // are whole numbers with the printed mean, shared out so that people differ.
    let folder = folder("appendix_e");
    for person in 0..10usize {
        let mut items = Vec::new();
        for (category, letter, means) in APPENDIX_E {
            for (number, mean) in means.iter().enumerate() {
                let id = format!("{letter}{}", number + 1);
                let value = mean.map(|mean| {
                    let (low, more) = (mean.floor(), (mean * 10.0).round() as usize % 10);
                    low + f64::from(u8::from((person + number) % 10 < more))
                });
                let counted = value.map(|v| if AGAINST.contains(&id.as_str()) { 6.0 - v } else { v });
                items.push(json!({ "id": id, "category": category, "value": value, "counted": counted }));
            }
        }
        let categories: serde_json::Map<String, Value> = APPENDIX_E
            .iter()
            .map(|(name, _, _)| {
                let own = items.iter().filter(|i| i["category"] == *name).filter_map(|i| i["counted"].as_f64());
                let own: Vec<f64> = own.collect();
                (name.to_string(), json!(own.iter().sum::<f64>() / own.len() as f64))
            })
            .collect();
        let session = json!({
            "version": 1, "scenario": { "id": "5-grinding" }, "participant": format!("{person}"), "metrics": {},
            "questionnaire": { "id": "simulator", "items": items, "categories": categories },
        });
        let bundle = folder.join(format!("user-{person}"));
        std::fs::create_dir_all(&bundle).unwrap();
        std::fs::write(bundle.join("session.json"), session.to_string()).unwrap();
    }
    let [html, json] = ["html", "json"].map(|e| folder.join(format!("cohort.{e}")).to_str().unwrap().to_string());
    let output = typodont(&["cohort", folder.to_str().unwrap(), "--html", &html, "--json", &json]);
    assert!(output.status.success(), "{}", complained(&output));
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let found = &summary["questionnaires"][0];
    for (category, letter, means) in APPENDIX_E {
        let mut counted = Vec::new();
        for (number, mean) in means.iter().enumerate() {
            let id = format!("{letter}{}", number + 1);
            let statement = found["statements"].as_array().unwrap().iter().find(|s| s["id"] == id.as_str()).unwrap();
            assert_eq!(statement["mirrored"], json!(AGAINST.contains(&id.as_str())), "{id}");
            let Some(mean) = mean else {
                assert_eq!(statement["answered"], Value::Null);
                continue;
            };
            assert!((statement["answered"]["mean"].as_f64().unwrap() - mean).abs() < 1e-9, "{id}");
            counted.push(if AGAINST.contains(&id.as_str()) { 6.0 - mean } else { *mean });
            assert!((statement["counted"]["mean"].as_f64().unwrap() - counted[counted.len() - 1]).abs() < 1e-9, "{id}");
        }
        let expected = counted.iter().sum::<f64>() / counted.len() as f64;
        assert!((found["categories"][category]["mean"].as_f64().unwrap() - expected).abs() < 1e-9, "{category}");
    }
    // α of each category and of all, over the statements that anybody answered.
    assert_eq!(found["alphas"].as_array().unwrap().last().unwrap()["statements"], 23);
    let page = std::fs::read_to_string(html).unwrap();
    assert!(
        page.contains("Practising with the simulator improves my manual skills.") && page.contains(">2.80<"),
        "{page}"
    );
}

#[test]
fn cavities_are_laid_over_each_other_and_measured_from_the_experts() {
    // Aim: the share map and the distance to the experts, by their definition. Method: a bundle of the program's own, whose times of
    // removal are given to five people, three of whom lose what lies in one half; every voxel is counted again here.
    use typodont_formats::nrrd;
    use typodont_formats::nrrd::{Encoding, Samples};
    let folder = folder("removals");
    let played = run("scenarios/5-grinding.json", "hasty", &folder.join("played"), &[]);
    let whole = nrrd::read(&played.join("removal_time.nrrd")).unwrap();
    let Samples::F32(times) = &whole.samples else { panic!("times are floats") };
    let half: Vec<f32> =
        times.iter().enumerate().map(|(i, t)| if i < times.len() / 2 { f32::NAN } else { *t }).collect();
    let count = |times: &[f32]| times.iter().filter(|t| !t.is_nan()).count() as f64;
    let (all, some) = (count(times), count(&half));
    let cohort = folder.join("cohort");
    for (number, person) in ["expert-1", "expert-2", "c", "d", "e"].into_iter().enumerate() {
        let bundle = cohort.join(person);
        std::fs::create_dir_all(&bundle).unwrap();
        std::fs::copy(played.join("initial.seg.nrrd"), bundle.join("initial.seg.nrrd")).unwrap();
        let image = nrrd::VoxelImage {
            samples: Samples::F32(if number < 2 { times.clone() } else { half.clone() }),
            ..whole.clone()
        };
        std::fs::write(bundle.join("removal_time.nrrd"), nrrd::bytes(&image, Encoding::Gzip).unwrap()).unwrap();
        let mut one = session(&played);
        one["participant"] = json!(person);
        // Five people with one recording would be counted as one.
        one["digests"].as_object_mut().unwrap().remove("recording.mcap");
        std::fs::write(bundle.join("session.json"), one.to_string()).unwrap();
    }
    std::fs::write(cohort.join("e").join("removal_time.nrrd"), "NRRD0004\nnothing").unwrap();
    let file = |name: &str| folder.join(name).to_str().unwrap().to_string();
    let (csv, html, json, maps) = (file("c.csv"), file("c.html"), file("c.json"), file("maps"));
    let output = typodont(&[
        "cohort",
        cohort.to_str().unwrap(),
        "--expert",
        "expert-1,expert-2",
        "--csv",
        &csv,
        "--html",
        &html,
        "--json",
        &json,
        "--maps",
        &maps,
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(complained(&output).contains("removal_time.nrrd: skipped"), "{}", complained(&output));

    let map = std::fs::read_dir(&maps).unwrap().next().unwrap().unwrap().path();
    let map = nrrd::read(&map).unwrap();
    let Samples::F32(share) = &map.samples else { panic!("shares are floats") };
    assert_eq!(share.iter().filter(|s| **s == 1.0).count() as f64, some);
    assert_eq!(share.iter().filter(|s| **s == 0.5).count() as f64, all - some);
    assert_eq!((map.key("typodont_people"), map.geometry.dims), (Some("4"), whole.geometry.dims));

    let table = std::fs::read_to_string(&csv).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|l| l.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|c| *c == name).unwrap();
    let (differs, dice) = (column("expert_differs_mm3"), column("expert_dice"));
    let voxel = whole.geometry.spacing().element_product();
    for row in &rows[1..] {
        match row[column("participant")] {
            "expert-1" | "expert-2" => assert_eq!((row[differs], row[dice]), ("0", "1")),
            "e" => assert_eq!(row[differs], ""),
            _ => {
                assert!((row[differs].parse::<f64>().unwrap() / ((all - some) * voxel) - 1.0).abs() < 1e-6, "{row:?}");
                assert!((row[dice].parse::<f64>().unwrap() - 2.0 * some / (all + some)).abs() < 1e-12, "{row:?}");
            }
        }
    }
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let removal = &summary["scenarios"][0]["removals"][0];
    assert_eq!((&removal["people"], &removal["experts"]), (&json!(4), &json!(2)));
    assert_eq!(removal["distances"].as_array().unwrap().len(), 4);
    assert_eq!(summary["scenarios"][0]["expert_metrics"]["points"]["n"], 2);
    let page = std::fs::read_to_string(&html).unwrap();
    assert_eq!(page.matches("png;base64,iVBOR").count(), 4, "the chewing surface and three cuts");
    let unknown = typodont(&["cohort", cohort.to_str().unwrap(), "--expert", "nobody"]);
    assert!(!unknown.status.success() && complained(&unknown).contains("unknown-expert"));
}

#[test]
fn attempts_and_judgements_are_put_together() {
    let folder = folder("attempts");
    let mut ratings = "participant;rating\n".to_string();
    for person in 0..8 {
        let code = format!("student-{person}");
        for attempt in 0..3 {
            let points = 40.0 + 6.0 * f64::from(person) + 5.0 * f64::from(attempt) + f64::from(person * attempt % 3);
            school::enter(&folder, &school::session("5-grinding", &code, points));
        }
        ratings += &format!("{code};{}\n", ["fail", "1", "borderline", "2", "pass", "3", "good", "5"][person as usize]);
    }
    let table = folder.join("ratings.csv");
    std::fs::write(&table, &ratings).unwrap();
    let [html, json] = ["html", "json"].map(|e| folder.join(format!("cohort.{e}")).to_str().unwrap().to_string());
    let judged = |file: &Path| {
        typodont(&[
            "cohort",
            folder.to_str().unwrap(),
            "--ratings",
            file.to_str().unwrap(),
            "--html",
            &html,
            "--json",
            &json,
        ])
    };
    let output = judged(&table);
    assert!(output.status.success(), "{}", complained(&output));
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let scenario = &summary["scenarios"][0];
    assert_eq!(scenario["participants"], 8);
    let progress = &scenario["progress"]["points"];
    assert_eq!(progress["participants"].as_array().unwrap().len(), 8);
    assert_eq!(progress["by_attempt"].as_array().unwrap().len(), 3);
    // Student 3: 58, 63, 68.
    assert_eq!(progress["participants"][3]["values"], json!([58.0, 63.0, 68.0]));
    assert!((progress["participants"][3]["slope"].as_f64().unwrap() - 5.0).abs() < 1e-9);
    let repeated = &scenario["repeated"]["points"];
    assert_eq!(repeated["people"], 8);
    assert!(repeated["icc"].as_f64().unwrap() > 0.8 && repeated["correlation"].as_f64().unwrap() > 0.99, "{repeated}");
    let standard = &scenario["standard"];
    assert_eq!(
        (&standard["judged_by"], &standard["people"], &standard["pass_points"]),
        (&json!("examiners"), &json!(8), &json!(70.0))
    );
    let cut = |method: &str| standard[method]["cut"].as_f64().unwrap();
    assert!(
        (58.0..80.0).contains(&cut("contrasting_groups")) && (58.0..72.0).contains(&cut("borderline_regression")),
        "{standard}"
    );
    let page = std::fs::read_to_string(&html).unwrap();
    for expected in ["ICC(2,1)", "Contrasting groups", "Borderline regression", "Assumes that"] {
        assert!(page.contains(expected), "{expected} is missing");
    }
    // Every wrong rating is named at once.
    std::fs::write(&table, "participant,rating\nstudent-0,well\nstudent-1,9\n").unwrap();
    let output = judged(&table);
    assert!(!output.status.success());
    assert!(
        complained(&output).contains("row 2: wrong-rating") && complained(&output).contains("row 3"),
        "{}",
        complained(&output)
    );
}

#[test]
fn a_cohorts_page_is_written_in_one_language() {
    // Aim: the same page and the same numbers in English and in Turkish, without a sentence of the other. Method: a class
    // with experts, ratings, several attempts, a questionnaire, cautions and a broken file; the numbers of both pages' tables
    // and the English texts are compared with the Turkish page.
    let folder = folder("cohort_language");
    let mut ratings = "participant;rating\n".to_string();
    for person in 0..8 {
        let code = format!("student-{person}");
        for attempt in 0..3 {
            let points = 40.0 + 6.0 * f64::from(person) + 5.0 * f64::from(attempt) + f64::from(person * attempt % 3);
            let mut one = school::session("5-grinding", &code, points);
            one["metrics"]["detect_tooth"] = json!(f64::from(attempt % 2));
            one["metrics"]["detect_level"] = json!(0.4);
            one["metrics"]["detect_level_time_s"] = json!(60.0);
            school::enter(&folder, &one);
        }
        ratings += &format!("{code};{}\n", 1 + person / 2);
    }
    let mut early = school::session("5-grinding", "student-0", 90.0);
    early["ended_because"] = json!("given up");
    early["grade"]["hard_fails"] = json!(["Pulp"]);
    school::enter(&folder, &early);
    std::fs::create_dir_all(folder.join("broken")).unwrap();
    std::fs::write(folder.join("broken/session.json"), "{").unwrap();
    let file = |name: &str| folder.join(name).to_str().unwrap().to_string();
    let (html, table, never) = (file("cohort.html"), file("ratings.csv"), file("never.html"));
    std::fs::write(&table, ratings).unwrap();
    let page = |more: &[&str]| {
        let folder = folder.to_str().unwrap();
        let fixed = ["cohort", folder, "--ratings", &table, "--expert", "student-7", "--html", &html];
        let output = typodont(&[&fixed, more].concat());
        assert!(output.status.success(), "{}", complained(&output));
        std::fs::read_to_string(&html).unwrap()
    };
    let (english, turkish) = (page(&[]), page(&["--language", "tr"]));
    assert_eq!(english, page(&["--language", "en"]));
    assert!(english.contains("<html lang=\"en\">") && turkish.contains("<html lang=\"tr\">"));
    assert!(english.contains("Caution: 1 session was ended early or interrupted."), "{english}");
    for page in [&english, &turkish] {
        let body = page.split("</style>").nth(1).unwrap();
        assert!(!body.contains("cohort.") && !body.contains('{'), "a bare key or placeholder:\n{body}");
    }
    for sentence in ["Each dot is a session", "Both methods require judgements", "Caution: ", "correct answers after"] {
        assert!(english.contains(sentence) && !turkish.contains(sentence), "{sentence}");
    }
    let texts = |code: &str| -> std::collections::BTreeMap<String, String> {
        serde_json::from_str(&std::fs::read_to_string(format!("reports/templates/languages/{code}.json")).unwrap())
            .unwrap()
    };
    let own = texts("tr");
    for (key, text) in texts("en") {
        // Every stretch of words between placeholders that is long enough to be no other word's part.
        let stretches = text.split(['{', '}']).step_by(2).filter(|part| part.trim().len() > 12);
        for stretch in stretches.filter(|_| key.starts_with("cohort.") && own[&key] != text) {
            assert!(!turkish.contains(stretch), "{key}: {stretch}");
        }
    }
    let numbers = |page: &str| -> Vec<String> {
        let cells = page.split("<td class=\"n\"").skip(1).map(|cell| cell.split("</td>").next().unwrap());
        let cells = cells.map(|cell| cell.split_once('>').unwrap().1).flat_map(|cell| cell.split(['<', '>']));
        let parts = cells.flat_map(|cell| cell.split(|c: char| !c.is_ascii_digit() && !".:-".contains(c)));
        parts.filter(|part| !part.is_empty()).map(String::from).collect()
    };
    assert!(numbers(&english).len() > 100);
    assert_eq!(numbers(&english), numbers(&turkish));

    let unknown = typodont(&["cohort", folder.to_str().unwrap(), "--html", &never, "--language", "xx"]);
    assert_eq!(unknown.status.code(), Some(2));
    let complaint = complained(&unknown);
    assert!(complaint.contains("unknown-language") && complaint.contains("known: en, tr"), "{complaint}");
}

#[test]
fn whatever_a_person_wrote_stays_a_text() {
    // Aim: nothing a person wrote is run by a browser, a spreadsheet or a terminal. Method: the same texts as code, title, answer,
    // folder and reason; the page is looked at for markup that is not the template's, the terminal for control characters.
    let folder = folder("whatever");
    let texts = [
        "<script>alert(1)</script>",
        "=cmd|'/c calc'!A1",
        "\"><img src=x onerror=alert(1)>",
        "\u{202e}\u{1b}[2J\u{7}",
        "{{ 7*7 }}",
    ];
    for text in texts.iter().map(|t| t.to_string()).chain(["x".repeat(10_000), "مرحبا".into()]) {
        for points in [60.0, 80.0] {
            // Codes and ids are no longer than a reader takes.
            let [code, id] = [64, 256].map(|most| text.chars().take(most).collect::<String>());
            let mut one = school::session("x", &code, points);
            one["scenario"]["id"] = json!(id);
            one["scenario"]["title"] = json!(text);
            one["questionnaire"]["id"] = json!(id);
            one["questionnaire"]["items"][0]["category"] = json!(id);
            one["grade"]["hard_fails"] = json!([text]);
            one["metrics"][&id] = json!(1.0);
            school::enter(&folder, &one);
        }
    }
    let broken = folder.join("<b>bold</b>\u{1b}[31m");
    std::fs::create_dir_all(&broken).unwrap();
    std::fs::write(broken.join("session.json"), "<script>").unwrap();
    let [html, csv] = ["html", "csv"].map(|e| folder.join(format!("cohort.{e}")).to_str().unwrap().to_string());
    let output = typodont(&["cohort", folder.to_str().unwrap(), "--html", &html, "--csv", &csv]);
    assert!(output.status.success(), "{}", complained(&output));
    let page = std::fs::read_to_string(html).unwrap();
    for harm in ["<script", "<img src=x", "<b>", "\u{1b}", "\u{202e}"] {
        assert!(!page.contains(harm), "{harm:?} is in the page");
    }
    assert!(page.contains("{{ 7*7 }}") && !page.contains(&"x".repeat(200)));
    assert!(page.contains("مرحبا"));
    for text in [told(&output), complained(&output)] {
        assert!(text.chars().all(|c| c == '\n' || !c.is_control()) && !text.contains('\u{202e}'), "{text:?}");
        assert!(text.lines().all(|l| l.chars().count() < 1000));
    }
    let table = std::fs::read_to_string(csv).unwrap();
    assert!(table.contains("'=cmd") && !table.contains(",=cmd") && !table.contains(";=cmd"));
}

#[test]
fn two_thousand_bundles_are_one_page() {
    // Aim: a faculty's year fits into memory: 500 MB, of which the program's own is the least part. Method: the example's bundle under
    // 500 codes, four attempts each; the most memory it held is asked of the system. How long it took is told and decides nothing.
    let folder = folder("two_thousand");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
    let played = session(&example);
    for number in 0..2000 {
        let bundle = folder.join("bundles").join(format!("{number:04}"));
        std::fs::create_dir_all(&bundle).unwrap();
        let mut one = played.clone();
        one["participant"] = json!(format!("student-{:03}", number / 4));
        // One recording would count once.
        one["digests"].as_object_mut().unwrap().remove("recording.mcap");
        one["started"] = json!(format!("2026-11-{:02}T08:00:00Z", 1 + number % 4));
        one["grade"]["points"] = json!(30.0 + f64::from(number * 7919 % 600) / 10.0);
        std::fs::write(bundle.join("session.json"), one.to_string()).unwrap();
        for name in ["initial.seg.nrrd", "removal_time.nrrd"] {
            std::fs::copy(example.join(name), bundle.join(name)).unwrap();
        }
    }
    let file = |name: &str| folder.join(name).to_str().unwrap().to_string();
    let begun = std::time::Instant::now();
    let program = bundle::program();
    let arguments =
        ["cohort", &file("bundles"), "--html", &file("c.html"), "--csv", &file("c.csv"), "--json", &file("c.json")];
    let experts = ["--expert", "student-001,student-002", "--maps", &file("maps")];
    // The shell's child is the program itself; its own peak stands in the last line.
    let script = "\"$@\" > /dev/null & p=$!; m=0; while v=$(grep VmHWM /proc/$p/status 2> /dev/null | tr -dc 0-9) && [ -n \"$v\" ]; do m=$v; sleep 0.02; done; wait $p; s=$?; echo $m; exit $s";
    let output = std::process::Command::new("sh")
        .args(["-c", script, "sh", program])
        .args(arguments)
        .args(experts)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", complained(&output));
    println!("2000 bundles in {:.1} s, {} kB at most", begun.elapsed().as_secs_f64(), told(&output).trim());
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(file("c.json")).unwrap()).unwrap();
    assert_eq!((&summary["sessions"], &summary["scenarios"][0]["removals"][0]["people"]), (&json!(2000), &json!(500)));
    // Elsewhere than on Linux nobody says.
    if let Ok(peak) = told(&output).trim().parse::<u64>() {
        assert!(peak < 500_000, "{peak} kB");
    }
}
