//! The four shipped operators are what their names say, in every exercise and every measure where it shows.

use crate::support::bundle;
use crate::support::coarse_exercise::coarse_exercise;
use crate::support::folder;

use bundle::*;
use folder::folder;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use typodont_core::device::DeviceSpec;
use typodont_core::parallel::available_threads;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece};
use typodont_exercise::score::{SCORER_VERSION, Scored, idle_grade, score_trainee};
use typodont_exercise::session::{Operator, OperatorFile};
use typodont_formats::Library;

const OPERATORS: [&str; 4] = ["expert", "careful", "hasty", "timid"];

/// Size of a voxel, mm, with which a session of minutes takes seconds.
const COARSE: f32 = 0.2;

/// Seeds of the exercises: lesions in different quarters and on either tooth.
const SEEDS: [u64; 2] = [1, 2];

/// A measure's mean over the seeds, by operator; `None` where none of an operator's sessions has it.
fn means(scenario: &str) -> impl Fn(&str, &str) -> Option<f64> + use<> {
    means_over(scenario, &OPERATORS, &SEEDS)
}

fn means_over(scenario: &str, operators: &[&str], seeds: &[u64]) -> impl Fn(&str, &str) -> Option<f64> + use<> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(scenario);
    let scenario = Arc::new(typodont_lesson::read_scenario(&file, ResolveMode::ReadScans).unwrap());
    let mut sessions: Vec<(String, Scored)> = Vec::new();
    for &seed in seeds {
        let workpiece = Arc::new(Workpiece::make(&scenario, seed).unwrap());
        let of = |operator: &&str| (operator.to_string(), score_of(&scenario, &workpiece, operator, seed));
        sessions.extend(operators.iter().map(of));
    }
    move |operator, name| {
        assert!(sessions.iter().any(|(o, _)| o == operator), "{operator} played nothing");
        let value = |scored: &Scored| match name {
            "points" => scored.grade.as_ref().map(|grade| grade.points),
            _ => {
                let measure = scored.measures.all.iter().find(|measure| measure.metric.name() == name);
                measure.unwrap_or_else(|| panic!("no metric {name}")).value
            }
        };
        let values: Vec<f64> = sessions.iter().filter(|(o, _)| o == operator).filter_map(|(_, s)| value(s)).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Score of a session in memory.
fn score_of(scenario: &Arc<Scenario>, workpiece: &Arc<Workpiece>, operator: &str, seed: u64) -> Scored {
    let file = OperatorFile::read(&Library::shipped(), operator).unwrap();
    let spec = DeviceSpec::phantom_omni();
    let trainee = Operator::new(file, scenario.clone(), workpiece.clone(), spec, seed);
    score_trainee(scenario, workpiece, seed, trainee).unwrap()
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
    let mean = means(&coarse_exercise("5-grinding", COARSE, "operators"));
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
    let mean = means_over("scenarios/8-fissure.json", &OPERATORS, &SEEDS[..1]);
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

/// One measure of one session each of some operators, in coarse voxels.
fn played(name: &str, operators: &[&str]) -> impl Fn(&str, &str) -> Option<f64> + use<> {
    means_over(&coarse_exercise(name, COARSE, "played"), operators, &SEEDS[..1])
}

#[test]
#[ignore = "scripts/test --long"]
fn deep_decay_tells_them_apart() {
    let mean = played("12-deep-caries", &["expert", "hasty"]);
    grows(&mean, "dice", &["hasty", "expert"]);
    grows(&mean, "points", &["hasty", "expert"]);
    assert_eq!((mean("expert", "pulp_exposed"), mean("hasty", "pulp_exposed")), (Some(0.0), Some(1.0)));
}

#[test]
#[ignore = "scripts/test --long"]
fn preparing_an_outline_tells_them_apart() {
    // Aim: who gives the bur its time cuts what is drawn and no more. Method: both outlines, in coarse voxels.
    for name in ["10-class-one", "11-class-two"] {
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
    let mean = played("13-spoon", &["expert", "hasty"]);
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
    let mean = means_over("scenarios/15-charting.json", &OPERATORS, &SEEDS[..1]);
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
fn an_arch_is_searched_by_touch() {
    // Aim: tooth and quarter are found by whoever feels for them, and by nobody else. Method: the expert, who cannot see the caries, in
    // three trials; a trial counts only if both answers are right. Chance is 1 in 32; guessing.rs tries it.
    let out = folder("arch_searched");
    let session = session(&run("scenarios/16-arch-diagnosis.json", "expert", &out, &["--seed", "1"]));
    assert_eq!(metric(&session, "detect_corrected_pct"), Some(100.0));
}

#[test]
fn both_jaws_are_searched_by_touch() {
    // Aim: among 28 teeth of voxels, one of them fine, the carious one is found by whoever feels for it. Method: the expert, who cannot
    // see the caries, with seeds that draw upper and lower teeth; at least 8 of 10 sessions must be right in each of three trials.
    // Chance is 1 in 32; guessing.rs tries it. A recording holds the treated tooth only, and is verified all the same.
    let out = folder("mouth_searched");
    let (mut right, mut elsewhere) = (0, 0);
    for seed in 1..=10 {
        let bundle = run("scenarios/17-mouth-diagnosis.json", "expert", &out, &["--seed", &seed.to_string()]);
        let session = session(&bundle);
        right += usize::from(metric(&session, "detect_corrected_pct") == Some(100.0));
        // The report names the tooth on which the force was greatest, unless it is the treated one.
        let tooth = &session["evidence"]["force_max_n"]["tooth_fdi"];
        let molars = [16, 17, 26, 27, 37, 46, 47];
        assert!(tooth.is_null() || molars.iter().any(|fdi| *tooth == *fdi), "{tooth}");
        elsewhere += usize::from(!tooth.is_null());
        if seed == 1 {
            let verified = typodont(&["verify", bundle.to_str().unwrap()]);
            assert!(verified.status.success(), "{}", complained(&verified));
        }
    }
    println!("right with {right} of 10 seeds; the greatest force was on another tooth in {elsewhere}");
    assert!(right >= 8 && elsewhere >= 1, "{right} and {elsewhere} of 10");
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

/// Points of one session: the key is exercise, voxel size (mm), operator and seed.
type OperatorResults = std::collections::BTreeMap<(String, String, String, u64), (f64, bool)>;

/// Reads results of earlier runs: lines of exercise, voxel size, operator, seed, points and passed.
fn read_results(file: &Path) -> OperatorResults {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let result = |line: &str| {
        let [exercise, spacing, operator, seed, points, passed] =
            line.split(',').collect::<Vec<_>>().try_into().ok()?;
        let key = (exercise.to_string(), spacing.to_string(), operator.to_string(), seed.parse().ok()?);
        Some((key, (points.parse().ok()?, passed == "true")))
    };
    text.lines().filter_map(result).collect()
}

/// The graded exercises with voxels of a size, mm: number and name, and the exercise.
fn graded_exercises(spacing: &str) -> Vec<(String, Arc<Scenario>)> {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let out = folder(&format!("operators_table_{spacing}"));
    let mut exercises = Vec::new();
    for file in typodont_lesson::scenario_files(&scenarios).unwrap() {
        let text = std::fs::read_to_string(&file).unwrap();
        if !text.contains("\"rubric\"") {
            continue;
        }
        // All teeth of a jaw have the voxels that the exercise gives them, which are large already.
        let is_arch = text.contains("dental_arch");
        if is_arch && spacing != "0.1" {
            continue;
        }
        let shipped = format!("\"spacing_mm\": {}", if is_arch { "0.2" } else { "0.1" });
        assert!(text.contains(&shipped), "{}", file.display());
        let text = text.replace("\"$schema\": \"scenario.schema.json\",", "");
        let own = out.join(file.file_name().unwrap());
        let spacing = if is_arch { "0.2" } else { spacing };
        std::fs::write(&own, text.replace(&shipped, &format!("\"spacing_mm\": {spacing}"))).unwrap();
        let name = file.file_stem().unwrap().to_str().unwrap().to_string();
        exercises.push((name, Arc::new(typodont_lesson::read_scenario(&own, ResolveMode::ReadScans).unwrap())));
    }
    let number = |name: &str| name.split('-').next().unwrap().parse::<u32>().unwrap();
    exercises.sort_by_key(|(name, _)| number(name));
    exercises
}

/// Points of a session of an operator, and true if it was passed.
fn points_of(scenario: &Arc<Scenario>, workpiece: &Arc<Workpiece>, operator: &str, seed: u64) -> (f64, bool) {
    let grade = match operator {
        "idle" => idle_grade(scenario, workpiece, seed).unwrap(),
        _ => score_of(scenario, workpiece, operator, seed).grade,
    };
    let grade = grade.unwrap();
    (grade.points, grade.passed)
}

#[test]
#[ignore = "scripts/test --long"]
fn points_of_all_operators_in_all_exercises() {
    // Aim: the table of `docs/operators.md`, and its order: idle hands earn under 10 points, timid and hasty ones no more
    // than careful ones, and careful and expert hands pass. Method: every graded exercise, by idle hands and by each
    // operator, with the seeds 1 to TYPODONT_SEEDS (1), at the voxel sizes TYPODONT_SPACINGS (0.25; several are separated
    // by commas). TYPODONT_OPERATORS_RESULTS names a table of results, to which every session is appended and whose
    // sessions are not run again; TYPODONT_OPERATORS_PAGE the page to be written; TYPODONT_EXERCISES the numbers of the
    // exercises, all without it.
    let set = |name: &str| std::env::var(name).ok();
    let seeds: u64 = set("TYPODONT_SEEDS").map_or(1, |n| n.parse().unwrap());
    let spacings = set("TYPODONT_SPACINGS").unwrap_or("0.25".into());
    let chosen = set("TYPODONT_EXERCISES");
    let is_chosen =
        |name: &str| chosen.as_ref().is_none_or(|c| c.split(',').any(|n| name.starts_with(&format!("{n}-"))));
    let file = set("TYPODONT_OPERATORS_RESULTS").map(std::path::PathBuf::from);
    let mut results = file.as_deref().map_or_else(OperatorResults::new, read_results);
    let mut open: Vec<OpenSessions> = Vec::new();
    for spacing in spacings.split(',') {
        for (name, scenario) in graded_exercises(spacing).into_iter().filter(|(name, _)| is_chosen(name)) {
            for seed in 1..=seeds {
                let key = |o: &str| (name.clone(), spacing.to_string(), o.to_string(), seed);
                let operators: Vec<&str> = COLUMNS.into_iter().filter(|o| !results.contains_key(&key(o))).collect();
                let (name, spacing) = (name.clone(), spacing.to_string());
                open.push(OpenSessions { name, spacing, scenario: scenario.clone(), seed, operators });
            }
        }
    }
    open.retain(|sessions| !sessions.operators.is_empty());
    results.extend(run_sessions(&open, file.as_deref()));
    let (page, wrong) = operators_page(&results);
    println!("{page}");
    if let Some(file) = set("TYPODONT_OPERATORS_PAGE") {
        std::fs::write(file, &page).unwrap();
    }
    assert!(wrong.is_empty(), "out of order: {wrong:#?}");
}

/// Sessions of one exercise with one seed that were not run yet.
struct OpenSessions {
    name: String,
    /// Voxel size, mm.
    spacing: String,
    scenario: Arc<Scenario>,
    seed: u64,
    operators: Vec<&'static str>,
}

/// Runs sessions on all processors, and appends the result of each to a file as soon as it is known.
fn run_sessions(open: &[OpenSessions], file: Option<&Path>) -> OperatorResults {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(OperatorResults::new()));
    let work = || {
        while let Some(sessions) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
            let OpenSessions { name, spacing, scenario, seed, operators } = sessions;
            let workpiece = Arc::new(Workpiece::make(scenario, *seed).unwrap());
            for operator in operators {
                let (points, passed) = points_of(scenario, &workpiece, operator, *seed);
                let line = format!("{name},{spacing},{operator},{seed},{points},{passed}\n");
                print!("{line}");
                let mut found = found.lock().unwrap();
                if let Some(file) = file {
                    let mut log = std::fs::OpenOptions::new().create(true).append(true).open(file).unwrap();
                    std::io::Write::write_all(&mut log, line.as_bytes()).unwrap();
                }
                found.insert((name.clone(), spacing.clone(), operator.to_string(), *seed), (points, passed));
            }
        }
    };
    std::thread::scope(|scope| {
        (0..available_threads()).for_each(|_| {
            scope.spawn(work);
        });
    });
    found.into_inner().unwrap()
}

const COLUMNS: [&str; 5] = ["idle", "timid", "hasty", "careful", "expert"];

/// Returns the page of all results, and what is out of order.
fn operators_page(results: &OperatorResults) -> (String, Vec<String>) {
    let output = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
        output.map_or_else(|_| "unknown".into(), |o| String::from_utf8_lossy(&o.stdout).trim().to_string())
    };
    let (day, commit) = (output("date", &["+%Y-%m-%d"]), output("git", &["describe", "--always", "--dirty"]));
    let mut page = format!(
        "# Scripted operators in all graded exercises\n\nMean points, in brackets the least and the greatest, and the number of \
         sessions that were passed. The operators are\nthose of `content/operators/`; `idle` touches nothing and confirms every \
         stage. Made on {day} from {commit}, scoring\nversion {SCORER_VERSION}. The points of every session are in \
         [operators.csv](operators.csv): exercise, voxel size (mm), operator, seed, points,\nand whether it was passed. All \
         teeth of a jaw (exercise 16) have voxels of\n0.2 mm, as the exercise has them. A session \
         in that file is not run again by\n\n    TYPODONT_SEEDS=10 TYPODONT_SPACINGS=0.1,0.25 \
         TYPODONT_OPERATORS_RESULTS=docs/operators.csv \\\n    TYPODONT_OPERATORS_PAGE=docs/operators.md cargo test --release \
         --all-features --test exercises points_of_all -- --ignored\n"
    );
    let mut wrong = Vec::new();
    let mut spacings: Vec<&String> = results.keys().map(|(_, spacing, ..)| spacing).collect();
    spacings.sort();
    spacings.dedup();
    for spacing in spacings {
        page += &format!("\n## Voxels of {spacing} mm\n\n| exercise |");
        COLUMNS.iter().for_each(|operator| page += &format!(" {operator} |"));
        page += &format!("\n| --- |{}\n", " --- |".repeat(COLUMNS.len()));
        let mut names: Vec<&String> =
            results.keys().filter(|(_, own, ..)| own == spacing).map(|(name, ..)| name).collect();
        names.sort_by_key(|name| name.split('-').next().unwrap().parse::<u32>().unwrap());
        names.dedup();
        for name in names {
            let of = |operator: &str| -> Vec<(f64, bool)> {
                let own = results.iter().filter(|((n, s, o, _), _)| (n, s, o.as_str()) == (name, spacing, operator));
                own.map(|(_, result)| *result).collect()
            };
            let columns = COLUMNS.map(of);
            page += &format!("| {name} |");
            columns.iter().for_each(|column| page += &format!(" {} |", cell(column)));
            page += "\n";
            wrong.extend(disorder(&columns).map(|what| format!("{name} at {spacing} mm: {what}")));
        }
    }
    let (expected, wrong): (Vec<String>, Vec<String>) = wrong.into_iter().partition(|what| is_expected(what));
    for (title, list) in [("Not as it should be", &wrong), ("As the exercises are made", &expected)] {
        if !list.is_empty() {
            page += &format!("\n## {title}\n\n");
            list.iter().for_each(|what| page += &format!("- {what}\n"));
        }
    }
    if !expected.is_empty() {
        page += "\nThese exercises ask what is found and not how it is cut; careful hands lose points there for the time they take.\n";
    }
    (page, wrong)
}

/// True for a disorder of exercises that ask what is found and not how it is cut: careful hands lose points there for the
/// time they take.
fn is_expected(disorder: &str) -> bool {
    const ASKED: [&str; 5] = ["3-detection ", "4-diagnosis ", "9-stain ", "16-arch-diagnosis ", "17-mouth-diagnosis "];
    ASKED.iter().any(|name| disorder.starts_with(name)) && disorder.ends_with("hands earn more than careful ones")
}

fn mean_points(column: &[(f64, bool)]) -> f64 {
    column.iter().map(|(points, _)| points).sum::<f64>() / column.len() as f64
}

fn cell(column: &[(f64, bool)]) -> String {
    if column.is_empty() {
        return "not run".into();
    }
    let least = column.iter().map(|(points, _)| *points).fold(f64::INFINITY, f64::min);
    let greatest = column.iter().map(|(points, _)| *points).fold(0.0, f64::max);
    let passed = column.iter().filter(|(_, passed)| *passed).count();
    format!("{:.1} ({least:.1}–{greatest:.1}), {passed}/{} passed", mean_points(column), column.len())
}

/// Returns what is out of order in a row of [`COLUMNS`]; columns that were not run are left out.
fn disorder(columns: &[Vec<(f64, bool)>; 5]) -> impl Iterator<Item = String> + use<> {
    let [idle, timid, hasty, careful, _] = columns.each_ref().map(|c| (!c.is_empty()).then(|| mean_points(c)));
    let mut wrong = Vec::new();
    let mut demand = |holds: Option<bool>, what: &str| {
        if holds == Some(false) {
            wrong.push(what.to_string());
        }
    };
    demand(idle.map(|points| points < typodont_lesson::IDLE_POINTS_MAX), "idle hands earn points");
    demand(idle.zip(timid).map(|(idle, timid)| idle <= timid), "timid hands earn less than idle ones");
    demand(timid.zip(careful).map(|(timid, careful)| timid <= careful), "timid hands earn more than careful ones");
    demand(hasty.zip(careful).map(|(hasty, careful)| hasty <= careful), "hasty hands earn more than careful ones");
    for (name, column) in [("careful", &columns[3]), ("expert", &columns[4])] {
        let failed = column.iter().filter(|(_, passed)| !passed).count();
        demand(
            (!column.is_empty()).then_some(failed == 0),
            &format!("the {name} operator fails with {failed} of {} seeds", column.len()),
        );
    }
    wrong.into_iter()
}
