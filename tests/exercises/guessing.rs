//! Detection exercises: the caries is drawn, an answer counts after contact, and guessing earns nothing.

use crate::support::bundle;
use crate::support::folder;

use bundle::{complained, metric, run_anew, session, typodont};
use folder::folder;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use typodont_core::device::{DeviceSpec, Reading};
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Simulation, Step, Touch};
use typodont_core::statistics;
use typodont_core::tick::Tick;
use typodont_core::volume::{Edit, Label};
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::metric_id::TrialMetric;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece, resolve};
use typodont_exercise::score::TrialSummary;
use typodont_exercise::session::{
    AnswerRecord, AnswerValue, Effect, Input, InputError, Observer, Operator, OperatorFile, Session, SessionEvent, run,
    setup,
};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_report::bundle::BundleFolder;
use typodont_report::cohort::read_session;
use typodont_report::{Templates, VerificationStatus, Verifier};

/// The shipped exercises in which caries is to be found.
const SEARCHES: [&str; 5] = ["3-detection", "4-diagnosis", "9-stain", "16-arch-diagnosis", "17-mouth-diagnosis"];

fn shipped(id: &str) -> String {
    std::fs::read_to_string(format!("{}/scenarios/{id}.json", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// A shipped exercise with large voxels, which makes no difference to somebody who guesses.
fn coarse(id: &str) -> String {
    let text = shipped(id)
        .replace("\"spacing_mm\": 0.15", "\"spacing_mm\": 0.4")
        .replace("\"spacing_mm\": 0.1 ", "\"spacing_mm\": 0.4 ")
        .replace("\"spacing_mm\": 0.1\n", "\"spacing_mm\": 0.4\n")
        .replace("\"spacing_mm\": 0.2", "\"spacing_mm\": 0.4");
    assert_ne!(text, shipped(id));
    text
}

fn scenario(text: String) -> Arc<Scenario> {
    let read = resolve(SourceText::new("search.json", text), &Library::shipped(), ResolveMode::ReadScans);
    Arc::new(read.unwrap())
}

/// An observer that keeps nothing.
struct Nobody;

impl Observer for Nobody {
    type Error = std::convert::Infallible;

    fn input(&mut self, _: Tick, _: &Input) -> Result<(), Self::Error> {
        Ok(())
    }

    fn command(&mut self, _: Tick, _: &Command) -> Result<(), Self::Error> {
        Ok(())
    }

    fn effect(&mut self, _: Tick, _: &Effect, _: &Session) -> Result<(), Self::Error> {
        Ok(())
    }

    fn tick_completed(&mut self, _: &Reading, _: &Step, _: &[Edit]) -> Result<(), Self::Error> {
        Ok(())
    }
}

/// The result of one session in which an operator guesses.
fn guessed(scenario: &Arc<Scenario>, workpiece: Workpiece, seed: u64) -> TrialSummary {
    let file = OperatorFile::read(&Library::shipped(), "guess").unwrap();
    let workpiece = Arc::new(workpiece);
    let spec = DeviceSpec::phantom_omni();
    let mut simulation = Simulation::new(setup(scenario, &workpiece, spec.clone()));
    let mut performed = Session::new(scenario.clone(), &workpiece);
    let mut trainee = Operator::new(file, scenario.clone(), workpiece.clone(), spec, seed);
    run(&mut performed, &mut simulation, &mut trainee, &mut Nobody).unwrap();
    let outcome = performed.outcome();
    let summary = TrialSummary::of(scenario, &workpiece, &outcome).unwrap();
    // A trial that asks for the tooth and for its quarter is correct only if both answers are.
    let is_correct = |answer: &Option<AnswerRecord>| answer.as_ref().is_some_and(|a| a.correct == Some(true));
    let correct = outcome.stages.iter().filter(|stage| stage.answers.iter().all(is_correct)).count();
    assert_eq!(summary.correct, correct);
    summary
}

#[test]
fn whoever_guesses_has_an_expected_result_of_zero() {
    // Aim: a blind answer earns nothing on average, by either corrected measure. Method: an operator that touches one
    // possible site at random and names it, over many seeds; the mean must be 0 within its standard error, which must be
    // small enough to notice an advantage of a quarter.
    const SEEDS: u64 = 30;
    for id in SEARCHES {
        let scenario = scenario(coarse(id));
        let made = Workpiece::make(&scenario, 0).unwrap();
        let session = |seed: u64| {
            let drawn = Workpiece::draw(&scenario, &made.lesions, seed);
            guessed(&scenario, Workpiece { drawn, ..made.clone() }, seed)
        };
        let sessions: Vec<TrialSummary> = (1..=SEEDS).map(session).collect();
        assert!(sessions.iter().all(|s| s.unanswered == 0), "{id}: every guess is accepted after contact");
        for (metric, scale) in [(TrialMetric::Corrected, 1.0), (TrialMetric::LevelCorrected, 100.0)] {
            let values: Vec<f64> = sessions.iter().filter_map(|s| s.measure(metric)).map(|v| v * scale).collect();
            let Some(found) = statistics::describe(&values) else { continue };
            let error = found.sd.unwrap() / (SEEDS as f64).sqrt();
            println!("{id} {metric:?}: mean {:.1}, standard error {error:.1}", found.mean);
            assert!(error < 8.0, "{id} {metric:?}: standard error {error}");
            assert!(found.mean.abs() < 3.0 * error, "{id} {metric:?}: mean {} ± {error}", found.mean);
        }
        // Wilson's interval of 95 % contains the truth, which is 0, in about that share of the sessions.
        let covers = |s: &&TrialSummary| {
            s.measure(TrialMetric::CorrectedLow).unwrap() <= 0.0
                && s.measure(TrialMetric::CorrectedHigh).unwrap() >= 0.0
        };
        let covered = sessions.iter().filter(covers).count();
        assert!(covered as u64 >= SEEDS * 8 / 10, "{id}: the interval contains 0 in {covered} of {SEEDS} sessions");
    }
}

#[test]
fn every_site_is_drawn_equally_often() {
    // Aim: the answer is in the seed and not in the file. Method: the draws of 400 seeds; no site may be drawn more than
    // four standard deviations too often or too seldom, and neither may two trials be the same.
    for id in SEARCHES {
        let scenario = scenario(coarse(id));
        let made = Workpiece::make(&scenario, 0).unwrap();
        let mut counts = BTreeMap::<usize, f64>::new();
        let (mut sequences, mut repeated, mut pairs, mut trials) = (BTreeSet::new(), 0.0, 0.0, 0);
        const SEEDS: u64 = 400;
        for seed in 0..SEEDS {
            let drawn = Workpiece::draw(&scenario, &made.lesions, seed);
            let drawn: Vec<usize> = drawn.into_iter().map(Option::unwrap).collect();
            drawn.iter().for_each(|site| *counts.entry(*site).or_default() += 1.0);
            repeated += drawn.windows(2).filter(|pair| pair[0] == pair[1]).count() as f64;
            pairs += (drawn.len() - 1) as f64;
            trials = drawn.len();
            sequences.insert(drawn);
        }
        let (sites, all) = (made.lesions.len() as f64, counts.values().sum::<f64>());
        let deviation = |n: f64, p: f64| (n * p * (1.0 - p)).sqrt();
        assert_eq!(counts.len(), made.lesions.len(), "{id}");
        for (site, count) in counts {
            assert!((count - all / sites).abs() < 4.0 * deviation(all, 1.0 / sites), "{id}: site {site}: {count}");
        }
        let unexpected = (repeated - pairs / sites).abs();
        assert!(unexpected < 4.0 * deviation(pairs, 1.0 / sites), "{id}: {repeated} of {pairs} are repeated");
        // Of so many possible sequences, so many different ones are expected.
        let possible = sites.powi(trials as i32);
        let expected = possible * (1.0 - (-(SEEDS as f64) / possible).exp());
        assert!(sequences.len() as f64 > 0.9 * expected, "{id}: {} sequences of {expected:.0}", sequences.len());
    }
}

#[test]
fn an_answer_counts_after_contact_with_the_place_that_it_names() {
    let scenario = scenario(coarse("3-detection"));
    let workpiece = Workpiece::make(&scenario, 5).unwrap();
    let mut session = Session::new(scenario.clone(), &workpiece);
    let answer = |session: &mut Session, tooth: &str| {
        let value = AnswerValue::Word(tooth.into());
        session.advance(SessionEvent::Input(&Input::Answer { question: "tooth".into(), value }))
    };
    let touch = |session: &mut Session, tick: u64, label: Label| {
        let touch = Touch { label, spring: 0.3, normal: Vec3::Y };
        let step = Step {
            touch: Some(touch),
            ..Simulation::new(idle_setup(&scenario, &workpiece)).step(&Reading::at(Vec3::ZERO))
        };
        session.advance(SessionEvent::Tick { step: &Step { tick: Tick(tick), ..step }, edits: &[] });
    };
    let refused = vec![Effect::Refused { why: InputError::NotExamined }];
    let label = |id: &str| workpiece.lesions.iter().find(|lesion| lesion.id == id).unwrap().label;
    session.begin();
    assert_eq!(answer(&mut session, "left"), refused, "nothing was touched");
    let enamel = scenario.tissues.by_name("enamel").unwrap().label();
    touch(&mut session, 0, enamel);
    assert_eq!(answer(&mut session, "left"), refused, "no possible site was touched");
    touch(&mut session, 1, label("left-2"));
    assert_eq!(answer(&mut session, "right"), refused, "only the left tooth was touched");
    assert_ne!(answer(&mut session, "left"), refused);
    assert_eq!(session.stage().unwrap().0, 1, "the next trial");
    assert_eq!(answer(&mut session, "left"), refused, "each trial needs a contact of its own");
}

fn idle_setup(scenario: &Arc<Scenario>, workpiece: &Workpiece) -> typodont_core::sim::Setup {
    setup(scenario, workpiece, DeviceSpec::phantom_omni())
}

#[test]
fn sites_that_were_not_drawn_feel_like_enamel() {
    // Aim: nothing but the drawn site differs. Method: the commands at the start of each trial.
    let scenario = scenario(coarse("4-diagnosis"));
    let label = |name: &str| scenario.tissues.by_name(name).unwrap().label();
    let workpiece = Workpiece::make(&scenario, 3).unwrap();
    let effects = Session::new(scenario.clone(), &workpiece).begin();
    let drawn = workpiece.lesions[workpiece.drawn[0].unwrap()].label;
    let mut given = BTreeMap::new();
    for effect in effects {
        if let Effect::Command(Command::SetMaterial { label, like }) = effect {
            given.insert(label.0, like);
        }
    }
    assert_eq!(given.len(), 4);
    for lesion in &workpiece.lesions {
        let expected = if lesion.label == drawn { label("caries") } else { label("enamel") };
        assert_eq!(given[&lesion.label.0], expected, "{}", lesion.id);
    }
}

fn written(name: &str, text: &str) -> (PathBuf, PathBuf) {
    let out = folder(name);
    let file = out.join("search.json");
    std::fs::write(&file, text).unwrap();
    (out, file)
}

fn truths(session: &Value) -> Vec<Value> {
    let stages = session["stages"].as_array().unwrap();
    stages.iter().flat_map(|stage| stage["answers"].as_array().unwrap()).map(|answer| answer["truth"].clone()).collect()
}

#[test]
fn a_drawn_session_is_replayed_and_verified() {
    let (out, file) = written("guessed", &coarse("9-stain"));
    let play = |seed: &str| run_anew(file.to_str().unwrap(), "guess", &out, &["--seed", seed]);
    let (first, second) = (play("11"), play("12"));
    let (one, other) = (session(&first), session(&second));
    assert_eq!(truths(&one).len(), 8);
    assert_ne!(truths(&one), truths(&other), "another seed, another truth");
    assert!(truths(&one).contains(&json!("left")) && truths(&one).contains(&json!("right")));
    let right = one["stages"].as_array().unwrap().iter().filter(|s| s["answers"][0]["right"] == true).count();
    assert_eq!(metric(&one, "detect_trials_right"), Some(right as f64));
    assert_eq!(metric(&one, "detect_corrected_pct"), Some(100.0 * (right as f64 / 8.0 - 0.5) / 0.5));
    for bundle in [&first, &second] {
        let verified = typodont(&["verify", bundle.to_str().unwrap()]);
        assert!(verified.status.success(), "{}", complained(&verified));
    }
}

#[test]
fn whoever_does_nothing_earns_nothing() {
    let text = coarse("3-detection").replace("\"time_limit_s\": 120", "\"time_limit_s\": 2");
    let (out, file) = written("searched_idly", &text);
    let idle = out.join("idle.operator.json");
    let rules = json!([{ "when": "always", "do": [{ "wait_s": 1 }], "repeat": true }]);
    let hand = json!({ "speed_mm_s": 10, "tremor_mm": 0.0 });
    let operator = json!({ "id": "idle", "title": "Idle", "hand": hand, "agrees": 3, "rules": rules });
    std::fs::write(&idle, operator.to_string()).unwrap();
    let done = session(&run_anew(file.to_str().unwrap(), idle.to_str().unwrap(), &out, &[]));
    assert_eq!(metric(&done, "detect_corrected_pct"), Some(0.0));
    assert_eq!((&done["grade"]["points"], &done["grade"]["passed"]), (&json!(0.0), &json!(false)));
}

#[test]
fn check_reports_an_answer_that_stands_in_the_file() {
    // An exercise as it was shipped before draws existed.
    let mut text: Value = serde_json::from_str(&shipped("9-stain")).unwrap();
    text["scene"]["pair"]["left"].as_object_mut().unwrap().remove("decay");
    text["scene"]["pair"]["right"]["decay"][0]["id"] = json!("lesion");
    let stage = text["stages"][0].as_object_mut().unwrap();
    stage.remove("draw");
    text["rubric"] = json!({ "pass_points": 60, "items": [
        { "title": "Found", "metric": "detect_tooth", "points": 100, "full_at": 1, "zero_at": 0 }
    ] });
    let (_, file) = written("fixed_answer", &coarse_text(&text));
    let output = typodont(&["check", file.to_str().unwrap(), "--format", "json"]);
    let found: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (&found[0]["code"], &found[0]["path"]),
        (&json!("fixed-answer"), &json!("/stages/0/ask/0/answer/tooth_with"))
    );
}

fn coarse_text(value: &Value) -> String {
    value.to_string().replace("\"spacing_mm\":0.1", "\"spacing_mm\":0.4")
}

/// The code of an examiner.
const CODE: &str = "a code of the school";

#[test]
fn a_sealed_draw_is_revealed_at_the_end_and_not_before() {
    // Aim: nothing that stands in the folder of a running examination tells the draws; a session that was cut off is
    // finished with the code and with no other; a revealed seed cannot be exchanged. Method: a whole sealed session, and
    // its recording without its last part, as a session that is still running or was cut off has it.
    let (out, file) = written("sealed", &coarse("9-stain"));
    let [code, wrong] = [("code", CODE), ("wrong", "another code of it")].map(|(name, text)| {
        let path = out.join(format!("{name}.txt"));
        std::fs::write(&path, format!("{text}\n")).unwrap();
        path.to_str().unwrap().to_string()
    });
    let exercise = file.to_str().unwrap();
    let bundle = {
        let arguments = ["run", exercise, "--headless", "--operator", "guess", "--participant", "anna"];
        let output = typodont(&[&arguments[..], &["--seed-sealed", &code, "--out", out.to_str().unwrap()]].concat());
        assert!(output.status.success(), "{}", complained(&output));
        PathBuf::from(String::from_utf8_lossy(&output.stdout).lines().last().unwrap())
    };
    let whole = session(&bundle);
    assert_eq!(whole["seed_origin"], "sealed");
    assert_eq!(truths(&whole).len(), 8);
    assert!(typodont(&["verify", bundle.to_str().unwrap()]).status.success());
    let read = read_session(&bundle.join("session.json")).unwrap();
    assert_eq!(
        Verifier::new(&Templates::shipped()).verify(&BundleFolder::on_disk(&bundle), &read),
        VerificationStatus::Verified
    );
    let bytes = std::fs::read(bundle.join("recording.mcap")).unwrap();
    let recording = Recording::parse("sealed", &bytes).unwrap();
    assert_eq!(Some(recording.head.seed), whole["seed"].as_u64());
    let hidden = recording.commands.iter().filter(|(_, command)| command.is_none()).count();
    assert_eq!(hidden, 8 * 8, "eight sites in each of eight trials");
    assert!(!recording.commands.iter().any(|(_, c)| matches!(c, Some(Command::SetMaterial { .. }))));

    // The seed is in the last records only: no text of it stands before them.
    let seed = whole["seed"].as_u64().unwrap().to_string();
    let place = bytes.windows(seed.len()).position(|part| part == seed.as_bytes()).expect("the seed is revealed");
    assert!(place > bytes.len() * 9 / 10, "the seed stands at byte {place} of {}", bytes.len());
    let running = &bytes[..place - 200];
    let refused = Recording::parse("running", running).unwrap_err().to_string();
    assert!(refused.contains("sealed-recording") && refused.contains("--seed-sealed"), "{refused}");

    let partial = out.join("cut-off.partial");
    std::fs::create_dir(&partial).unwrap();
    std::fs::write(partial.join("recording.mcap"), running).unwrap();
    let finish = |more: &[&str]| typodont(&[&["finish", partial.to_str().unwrap()], more].concat());
    assert!(complained(&finish(&[])).contains("sealed-recording"));
    assert!(complained(&finish(&["--seed-sealed", &wrong])).contains("not the code"));
    // What is left of a program that was killed as it unsealed the recording is no file of the bundle.
    std::fs::write(partial.join(".recording.mcap.0.new"), b"a part").unwrap();
    let finished = finish(&["--seed-sealed", &code]);
    assert!(finished.status.success(), "{}", complained(&finished));
    let verified = typodont(&["verify", out.join("cut-off").to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
    let again = session(&out.join("cut-off"));
    assert_eq!(again["seed"], whole["seed"]);
    let kept = truths(&again);
    assert!(kept.len() >= 7 && truths(&whole).starts_with(&kept), "{kept:?}");

    let mut exchanged = bytes.clone();
    exchanged[place] = if bytes[place] == b'1' { b'2' } else { b'1' };
    let refused = Recording::parse("exchanged", &exchanged);
    assert!(refused.is_err(), "a recording holds only with the seed that it began with");
}

#[test]
fn a_seed_is_sealed_only_where_that_conceals_the_draws() {
    let (out, file) = written("unsealed", &coarse("9-stain"));
    let path = out.join("code.txt");
    let run = |exercise: &str, code: &str| {
        std::fs::write(&path, code).unwrap();
        let sealed = ["--seed-sealed", path.to_str().unwrap(), "--out", out.to_str().unwrap()];
        complained(&typodont(&[&["run", exercise, "--headless"], &sealed[..]].concat()))
    };
    assert!(run(file.to_str().unwrap(), "short").contains("short-code"));
    assert!(run("scenarios/5-grinding.json", CODE).contains("not-sealable"));
}

#[test]
fn a_seed_that_nobody_gives_is_drawn_by_the_system() {
    let (out, file) = written("system_seed", &coarse("4-diagnosis"));
    let seed = || {
        let arguments = ["run", file.to_str().unwrap(), "--headless", "--operator", "guess", "--out"];
        let output = typodont(&[&arguments[..], &[out.to_str().unwrap()]].concat());
        assert!(output.status.success(), "{}", complained(&output));
        let done = session(&PathBuf::from(String::from_utf8_lossy(&output.stdout).lines().last().unwrap()));
        assert_eq!(done["seed_origin"], "system");
        done["seed"].as_u64().unwrap()
    };
    assert_ne!(seed(), seed());
}

#[test]
fn a_draw_that_gives_itself_away_or_cannot_be_answered_is_reported() {
    // Aim: an author learns at once what is wrong with a draw. Method: one mistake each in a shipped exercise.
    let check = |code: &str, path: &str, change: &dyn Fn(&mut Value)| {
        let mut edited: Value = serde_json::from_str(&coarse("3-detection")).unwrap();
        change(&mut edited);
        let source = SourceText::new("search.json", edited.to_string());
        let found = resolve(source, &Library::shipped(), ResolveMode::ReadScans).err().unwrap_or_default();
        let found: Vec<(&str, &str)> = found.iter().map(|d| (d.code, d.path.as_str())).collect();
        assert!(found.contains(&(code, path)), "{code} {path}: {found:?}");
    };
    let stage = |edited: &mut Value, key: &str, value: Value| edited["stages"][0][key] = value;
    let site = "/scene/pair/left/decay/0";
    check("unknown-decay", "/stages/0/draw/one_of/0", &|e| e["stages"][0]["draw"]["one_of"][0] = json!("left-5"));
    check("duplicate-id", "/stages/0/draw/one_of/1", &|e| e["stages"][0]["draw"]["one_of"][1] = json!("left-1"));
    check("duplicate-id", "/stages/0/draw/id", &|e| e["stages"][0]["draw"]["id"] = json!("left-1"));
    check("no-question", "/stages/0/draw", &|e| stage(e, "ask", json!([])));
    check("unknown-decay", "/stages/0/ask/0/answer/tooth_with", &|e| {
        e["stages"][0]["ask"][0]["answer"]["tooth_with"] = json!("left-1");
    });
    check("endless-stage", "/stages/0/draw", &|e| stage(e, "ends_when", json!([])));
    check("shown-draw", "/stages/0/show_decay", &|e| stage(e, "show_decay", json!(true)));
    check("shown-draw", "/stages/0/adjustable", &|e| stage(e, "adjustable", json!(true)));
    check("wrong-place", &format!("{site}/at"), &|e| {
        e["scene"]["pair"]["left"]["decay"][0]["at"] = json!("random_quadrant");
    });
    check("no-question", "/rubric/items/0/metric", &|e| e["rubric"]["items"][0]["metric"] = json!("detect_tooth"));
    let undrawn = |e: &mut Value| {
        e["stages"][0].as_object_mut().unwrap().remove("draw");
        e["stages"][0]["ask"][0]["answer"]["tooth_with"] = json!("left-1");
    };
    check("no-draw", "/rubric/items/0/metric", &undrawn);
}
