//! The four shipped operators are what their names say, in every exercise and every measure where it shows.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use serde_json::Value;

const OPERATORS: [&str; 4] = ["expert", "careful", "hasty", "timid"];

/// Seeds of the exercises: lesions in different quarters and on either tooth.
const SEEDS: [&str; 2] = ["1", "2"];

/// A measure's mean over the seeds, by operator; `None` where none of an operator's sessions has it.
fn means(scenario: &str) -> impl Fn(&str, &str) -> Option<f64> {
    means_over(scenario, &SEEDS)
}

fn means_over(scenario: &str, seeds: &[&str]) -> impl Fn(&str, &str) -> Option<f64> + use<> {
    let out = folder(&format!("operators_{}", scenario.replace('/', "_")));
    let mut sessions: Vec<(&str, Vec<Value>)> = Vec::new();
    for operator in OPERATORS {
        let of_seed = |seed: &&str| session(&run(scenario, operator, &out, &["--seed", seed]));
        sessions.push((operator, seeds.iter().map(of_seed).collect()));
    }
    move |operator, name| {
        let found = sessions.iter().find(|(o, _)| *o == operator).unwrap();
        let value = |s: &Value| if name == "points" { s["grade"]["points"].as_f64() } else { metric(s, name) };
        let values: Vec<f64> = found.1.iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Asserts that a metric increases along a list of operators, and prints its values.
fn grows(mean: &impl Fn(&str, &str) -> Option<f64>, name: &str, operators: &[&str]) {
    let values: Vec<f64> =
        operators.iter().map(|o| mean(o, name).unwrap_or_else(|| panic!("{o} has no {name}"))).collect();
    println!("{name}: {operators:?} {values:.3?}");
    assert!(values.windows(2).all(|w| w[0] < w[1]), "{name} of {operators:?}: {values:?}");
}

/// Asserts that a measure grows or stays along a list of operators.
fn never_falls(mean: &impl Fn(&str, &str) -> Option<f64>, name: &str, operators: &[&str]) {
    let values: Vec<f64> =
        operators.iter().map(|o| mean(o, name).unwrap_or_else(|| panic!("{o} has no {name}"))).collect();
    println!("{name}: {operators:?} {values:.3?}");
    assert!(values.windows(2).all(|w| w[0] <= w[1]), "{name} of {operators:?}: {values:?}");
}

#[test]
fn grinding_tells_them_apart() {
    let mean = means("scenarios/5-grinding.json");
    grows(&mean, "time_to_clear_s", &["hasty", "careful"]);
    grows(&mean, "time_to_clear_s", &["expert", "careful"]);
    grows(&mean, "force_max_n", &["timid", "careful", "hasty"]);
    grows(&mean, "force_max_n", &["expert", "hasty"]);
    grows(&mean, "force_mean_n", &["timid", "careful", "hasty"]);
    grows(&mean, "speed_max_mm_s", &["careful", "hasty"]);
    grows(&mean, "efficiency_pct_s", &["careful", "expert"]);
    grows(&mean, "decay_cleared_pct", &["timid", "careful"]);
    grows(&mean, "decay_cleared_pct", &["timid", "expert"]);
    grows(&mean, "recall", &["timid", "expert"]);
    grows(&mean, "undercut_depth_max_mm", &["expert", "timid"]);
    for calm in ["timid", "careful", "expert"] {
        grows(&mean, "healthy_per_decay_pct", &[calm, "hasty"]);
        grows(&mean, "overcut_depth_max_mm", &[calm, "hasty"]);
        grows(&mean, "hausdorff95_mm", &[calm, "hasty"]);
        grows(&mean, "precision", &["hasty", calm]);
        grows(&mean, "remaining_dentine_thickness_min_mm", &["hasty", calm]);
    }
    for better in ["careful", "expert"] {
        grows(&mean, "dice", &["timid", better]);
        grows(&mean, "dice", &["hasty", better]);
        grows(&mean, "points", &["timid", better]);
        grows(&mean, "points", &["hasty", better]);
        never_falls(&mean, "surface_within_tol(0.3)", &["hasty", better]);
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn excavating_a_fissure_tells_them_apart() {
    // Excavating takes minutes: one seed.
    let mean = means_over("scenarios/8-fissure.json", &SEEDS[..1]);
    grows(&mean, "force_max_n", &["careful", "hasty"]);
    grows(&mean, "decay_cleared_pct", &["timid", "careful"]);
    for better in ["careful", "expert"] {
        grows(&mean, "healthy_per_decay_pct", &[better, "hasty"]);
        grows(&mean, "overcut_depth_max_mm", &[better, "hasty"]);
        for worse in ["timid", "hasty"] {
            grows(&mean, "dice", &[worse, better]);
            grows(&mean, "points", &[worse, better]);
        }
    }
}

/// A shipped exercise with coarser voxels, so that a session of minutes takes seconds.
fn coarse(name: &str) -> String {
    let text = std::fs::read_to_string(format!("{}/scenarios/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    assert!(text.contains("\"spacing_mm\": 0.1"), "{name}");
    let file = folder(&format!("coarse_{name}")).join(name);
    std::fs::write(&file, text.replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.2")).unwrap();
    file.to_str().unwrap().to_string()
}

/// One measure of one session each of some operators.
fn played(name: &str, operators: &[&str]) -> impl Fn(&str, &str) -> Option<f64> {
    let (scenario, out) = (coarse(name), folder(&format!("played_{name}")));
    let sessions: Vec<(String, Value)> =
        operators.iter().map(|o| (o.to_string(), session(&run(&scenario, o, &out, &[])))).collect();
    move |operator, name| {
        let (_, session) = sessions.iter().find(|(o, _)| o == operator).unwrap();
        if name == "points" { session["grade"]["points"].as_f64() } else { metric(session, name) }
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn deep_decay_tells_them_apart() {
    let mean = played("12-deep-caries.json", &["expert", "hasty"]);
    grows(&mean, "dice", &["hasty", "expert"]);
    grows(&mean, "points", &["hasty", "expert"]);
    assert_eq!((mean("expert", "pulp_exposed"), mean("hasty", "pulp_exposed")), (Some(0.0), Some(1.0)));
}

#[test]
#[ignore = "scripts/test --long"]
fn preparing_an_outline_tells_them_apart() {
    // Aim: who gives the bur its time cuts what is drawn and no more. Method: both outlines, in coarse voxels.
    for name in ["10-class-one.json", "11-class-two.json"] {
        let mean = played(name, &["expert", "careful", "hasty"]);
        for better in ["careful", "expert"] {
            grows(&mean, "points", &["hasty", better]);
            grows(&mean, "dice", &["hasty", better]);
        }
        assert!(mean("expert", "points") >= Some(70.0), "{name}: the expert passes");
        assert_eq!(mean("expert", "pulp_exposed"), Some(0.0), "{name}");
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn scooping_soft_decay_tells_them_apart_and_leaves_sound_dentine() {
    let mean = played("13-spoon.json", &["expert", "hasty"]);
    grows(&mean, "zone_removed_pct(soft)", &["hasty", "expert"]);
    grows(&mean, "points", &["hasty", "expert"]);
    for operator in ["expert", "hasty"] {
        assert_eq!(mean(operator, "zone_removed_pct(firm)"), Some(0.0), "{operator}");
        assert_eq!(mean(operator, "healthy_per_decay_pct"), Some(0.0), "{operator}");
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn charting_tells_them_apart() {
    // A chart takes minutes: one seed.
    let mean = means_over("scenarios/15-charting.json", &SEEDS[..1]);
    for better in ["careful", "expert"] {
        assert_eq!(mean(better, "probing_within_1mm_pct"), Some(100.0), "{better}");
        assert_eq!(mean(better, "calculus_found_pct"), Some(100.0), "{better}");
        grows(&mean, "probing_force_max_n", &[better, "hasty"]);
        grows(&mean, "probing_bias_mm", &[better, "hasty"]);
        grows(&mean, "sites_read_pct", &["hasty", better]);
        grows(&mean, "calculus_found_pct", &["timid", better]);
        for worse in ["timid", "hasty"] {
            grows(&mean, "points", &[worse, better]);
        }
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn searching_tells_them_apart() {
    let (right, time) = ("detect_corrected_pct", "detect_trial_time_s");
    for scenario in ["scenarios/3-detection.json", "scenarios/4-diagnosis.json"] {
        let mean = means(scenario);
        for operator in OPERATORS {
            println!("{scenario} {operator}: right {:?}, after {:?} s", mean(operator, right), mean(operator, time));
        }
        grows(&mean, "force_max_n", &["timid", "hasty"]);
        grows(&mean, "force_max_n", &["careful", "hasty"]);
        match scenario.contains("detection") {
            // The stiffer the decay still was, the finer and the quicker the hand that found it.
            true => grows(&mean, "detect_level_corrected", &["timid", "careful", "expert"]),
            false => grows(&mean, time, &["hasty", "expert", "careful"]),
        }
        grows(&mean, time, &["expert", "careful"]);
        assert_eq!(mean("expert", right), Some(100.0), "the expert finds it: {scenario}");
        assert_eq!(mean("careful", right), Some(100.0), "the careful one finds it: {scenario}");
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn stain_misleads_nobody_who_feels() {
    let mean = means("scenarios/9-stain.json");
    grows(&mean, "session_time_s", &["hasty", "expert", "careful"]);
    for operator in ["expert", "careful"] {
        assert_eq!(mean(operator, "detect_corrected_pct"), Some(100.0), "{operator} finds it");
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn everyone_gets_through_the_introductions() {
    for scenario in ["scenarios/1-introduction.json", "scenarios/2-decay.json"] {
        let mean = means(scenario);
        grows(&mean, "session_time_s", &["hasty", "careful"]);
        grows(&mean, "force_max_n", &["timid", "hasty"]);
        for operator in OPERATORS {
            assert!(mean(operator, "contact_time_s") > Some(0.0), "{operator} touches the tooth: {scenario}");
        }
    }
}

#[test]
#[ignore = "scripts/test --long"]
fn points_of_all_operators_in_all_exercises() {
    // Aim: the table of `docs/operators.md`. Method: every graded exercise, by idle hands and by each operator, with
    // the seeds 1 to TYPODONT_SEEDS (1 if it is not set), at the voxel size TYPODONT_SPACING (the exercise's own).
    // Timid and hasty hands never have more points than careful ones.
    let seeds: u64 = std::env::var("TYPODONT_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let spacing = std::env::var("TYPODONT_SPACING").ok();
    let scenarios = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let out = folder("operators_table");
    println!("| exercise | idle | timid | hasty | careful | expert |\n| --- | --- | --- | --- | --- | --- |");
    let mut wrong = Vec::new();
    for file in typodont_lesson::scenario_files(&scenarios).unwrap() {
        let text = std::fs::read_to_string(&file).unwrap();
        if !text.contains("\"rubric\"") {
            continue;
        }
        let name = file.file_name().unwrap().to_str().unwrap();
        let own = spacing
            .as_ref()
            .map_or(text.clone(), |mm| text.replace("\"spacing_mm\": 0.1", &format!("\"spacing_mm\": {mm}")));
        let file = out.join(name);
        std::fs::write(&file, own).unwrap();
        let scenario = typodont_exercise::scenario::ResolveMode::ReadScans;
        let scenario = std::sync::Arc::new(typodont_lesson::read_scenario(&file, scenario).unwrap());
        let workpiece = typodont_exercise::scenario::Workpiece::make(&scenario, 1).unwrap();
        let idle = typodont_exercise::score::idle_grade(&scenario, &workpiece, 1).unwrap().unwrap().points;
        let mut row = format!("| {} | {idle:.1} |", name.trim_end_matches(".json"));
        let mut means = Vec::new();
        for operator in ["timid", "hasty", "careful", "expert"] {
            let sessions: Vec<Value> = (1..=seeds)
                .map(|seed| session(&run(file.to_str().unwrap(), operator, &out, &["--seed", &seed.to_string()])))
                .collect();
            let points: Vec<f64> = sessions.iter().map(|s| s["grade"]["points"].as_f64().unwrap()).collect();
            let passed = sessions.iter().filter(|s| s["grade"]["passed"] == true).count();
            let mean = points.iter().sum::<f64>() / points.len() as f64;
            let [low, high] =
                [points.iter().copied().fold(f64::INFINITY, f64::min), points.iter().copied().fold(0.0, f64::max)];
            row += &match seeds {
                1 => format!(" {mean:.1}{} |", if passed == 1 { "" } else { " F" }),
                _ => format!(" {mean:.1} ({low:.1}–{high:.1}), {passed} of {seeds} pass |"),
            };
            means.push(mean);
        }
        println!("{row}");
        if means[0] > means[2] || means[1] > means[2] {
            wrong.push(name.to_string());
        }
    }
    assert!(wrong.is_empty(), "careful hands have fewer points than timid or hasty ones: {wrong:?}");
}
