//! Periodontal charts: readings of a probe in the sulcus, their replay from a recording, and their report.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use serde_json::Value;
use std::path::Path;

const CHARTING: &str = "scenarios/15-charting.json";

fn sites(session: &Value) -> &[Value] {
    session["chart"].as_array().expect("the session has a chart")
}

#[test]
fn a_chart_tells_the_operators_apart_and_is_proved_by_its_recording() {
    // Aim: depths are felt, not known: light hands read within a millimetre, a hard one too deep, and calculus is found by whoever
    // leans on the root. Method: the shipped operators, all at once.
    let out = folder("charting");
    let runs = ["expert", "careful", "hasty", "timid"].map(|operator| {
        let out = out.join(operator);
        std::thread::spawn(move || run(CHARTING, operator, &out, &[]))
    });
    let bundles = runs.map(|run| run.join().unwrap());
    let [expert, careful, hasty, timid] = bundles.each_ref().map(|bundle| session(bundle));
    for site in [&expert, &careful].into_iter().flat_map(sites) {
        println!("{site}");
        let (read, true_depth) = (site["read_mm"].as_f64().unwrap(), site["true_mm"].as_f64().unwrap());
        assert!((read - true_depth).abs() <= 1.0, "{site}");
        assert!(site["force_n"].as_f64().unwrap() <= 0.35, "{site}");
        assert_eq!(site["calculus_marked"], site["calculus"], "{site}");
    }
    let points = |session: &Value| session["grade"]["points"].as_f64().unwrap();
    for better in [&expert, &careful] {
        let bias = metric(better, "probing_bias_mm").unwrap();
        assert!(metric(&hasty, "probing_bias_mm").unwrap() > bias + 0.3, "a hard hand reads too deep");
        assert!(metric(&hasty, "probing_force_max_n") > metric(better, "probing_force_max_n"));
        assert!(metric(&hasty, "sites_read_pct") < metric(better, "sites_read_pct"));
        for worse in [&hasty, &timid] {
            assert!(metric(worse, "calculus_found_pct") < metric(better, "calculus_found_pct"));
            assert!(points(worse) < points(better));
            assert_eq!(worse["grade"]["passed"], false);
        }
        assert_eq!(better["grade"]["passed"], true);
    }
    let verified = typodont(&["verify", bundles[0].to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
    let page = std::fs::read_to_string(bundles[0].join("report.html")).unwrap();
    assert!(page.contains("Periodontal chart") && page.contains("Periodontal şema"));
}

#[test]
fn any_tooth_can_be_charted() {
    // Aim: sites lie where a dentist expects them in every quarter, the front included. Method: the same six depths, all
    // different, on an upper front tooth and a lower right premolar.
    let out = folder("charting_any");
    for fdi in [11, 45] {
        let path = out.join(format!("tooth-{fdi}.json"));
        write(&path, fdi, r#"{ "pocket_mm": { "MB": 3, "B": 1.5, "DB": 5, "ML": 4, "L": 2, "DL": 6 } }"#);
        let found = session(&run(path.to_str().unwrap(), "expert", &out, &[]));
        for site in sites(&found) {
            println!("{fdi} {site}");
            let read = site["read_mm"].as_f64().unwrap_or_else(|| panic!("{fdi}: {site} was not read"));
            assert!((read - site["true_mm"].as_f64().unwrap()).abs() <= 1.0, "{fdi}: {site}");
        }
    }
}

#[test]
fn what_cannot_be_charted_is_said_with_its_place() {
    let out = folder("charting_wrong");
    let check = |periodontium: &str, expected: &str| {
        let path = out.join("wrong.json");
        write(&path, 36, periodontium);
        let output = typodont(&["check", path.to_str().unwrap()]);
        let said = told(&output) + &complained(&output);
        assert!(!output.status.success() && said.contains(expected), "{periodontium}: {said}");
    };
    check(r#"{ "pocket_mm": { "MD": 3 } }"#, "MD");
    check(r#"{ "pocket_mm": { "B": 14 } }"#, "/scene/jaw/periodontium/pocket_mm/B");
    check(r#"{ "pocket_mm": { "B": 12 }, "recession_mm": { "B": 8 } }"#, "beyond the apex of the root");
    check("null", "charting requires gingiva with a sulcus");
}

fn write(path: &Path, fdi: u8, periodontium: &str) {
    let text = format!(
        r#"{{ "id": "chart-any", "title": "Chart", "scene": {{ "jaw": {{ "tooth": {{ "id": "tooth", "fdi": {fdi}, "form": {{
        "procedural": {{ "spacing_mm": 0.15 }} }} }}, "periodontium": {periodontium} }} }}, "instruments": ["probe_who"],
        "stages": [ {{ "id": "probe", "title": "Probe", "instruction": "Probe six sites.", "time_limit_s": 240,
        "chart": ["depth"], "ends_when": ["confirmed"] }} ] }}"#
    );
    std::fs::write(path, text).unwrap();
}
