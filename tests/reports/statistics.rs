//! The statistics agree with an independent computation: numpy and scipy by their own formulae, and pingouin where it is there.
//!
//! Needs `TYPODONT_PYTHON`, as `scripts/test` sets it; the stored figures below hold without.

use crate::support::folder;
use crate::support::tools;

use folder::folder;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;
use typodont_core::statistics;
use typodont_core::statistics::KappaWeights;

/// Numbers that look like people's: the same every time, in steps of a thousandth.
struct Made(u64);

impl Made {
    fn next(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let unit = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        ((low + (high - low) * unit) * 1000.0).round() / 1000.0
    }
}

/// Tables of every shape the cohort's page may meet, and what the program says of each.
fn cases() -> Vec<Value> {
    let mut made = Made(1);
    let mut cases = Vec::new();
    for people in [2usize, 3, 10, 40, 400] {
        let values: Vec<f64> = (0..people).map(|_| made.next(-5.0, 120.0)).collect();
        let s = statistics::describe(&values).unwrap();
        cases
            .push(json!({ "what": "spread", "values": values, "mean": s.mean, "sd": s.sd, "interval": s.mean_interval,
            "quartiles": s.quartiles, "median": s.median }));
        let amounts: Vec<f64> = values.iter().map(|v| v.abs()).collect();
        let percentages: Vec<f64> = values.iter().map(|v| v.clamp(0.0, 99.0)).collect();
        let intervals = [
            statistics::mean_interval_in(&amounts, statistics::ValueRange::NonNegative),
            statistics::mean_interval_in(&percentages, statistics::ValueRange::Within(0.0, 100.0)),
        ];
        cases
            .push(json!({ "what": "bounded", "amounts": amounts, "percentages": percentages, "intervals": intervals }));
        let had = (made.next(0.0, 1.0) * people as f64) as usize;
        let share = statistics::proportion(had, people).unwrap();
        cases.push(json!({ "what": "share", "had": had, "of": people, "interval": share.interval }));
        for statements in [2usize, 5, 25] {
            let answer = |made: &mut Made, own: f64| (own + made.next(-1.5, 1.5)).round().clamp(1.0, 5.0);
            let answers: Vec<Vec<f64>> = (0..people)
                .map(|_| {
                    let own = made.next(1.0, 5.0);
                    (0..statements).map(|_| answer(&mut made, own)).collect()
                })
                .collect();
            let Some(found) = statistics::cronbach_alpha(&answers) else { continue };
            let items: Vec<_> =
                found.items.iter().map(|i| json!([i.item_rest_correlation, i.alpha_if_deleted])).collect();
            cases.push(json!({ "what": "alpha", "answers": answers, "alpha": found.alpha, "interval": found.interval, "items": items }));
        }
        for attempts in [2usize, 3] {
            let values: Vec<Vec<f64>> = (0..people)
                .map(|_| {
                    let own = made.next(30.0, 90.0);
                    (0..attempts).map(|a| own + 4.0 * a as f64 + made.next(-12.0, 12.0)).collect()
                })
                .collect();
            let found = statistics::icc(&values).unwrap();
            let pairs: Vec<(f64, f64)> = values.iter().map(|v| (v[0], v[1])).collect();
            let again = statistics::retest(&pairs).unwrap();
            cases.push(json!({ "what": "icc", "values": values, "icc": found.icc, "interval": found.interval,
                "correlation": again.correlation, "gain": again.gain, "gain_interval": again.gain_interval, "error": again.typical_error }));
        }
        // Two raters of known disagreement: one in three works is rated otherwise, up to two categories away.
        for categories in [3usize, 5] {
            let rated: Vec<(usize, usize)> = (0..people)
                .map(|work| {
                    let first = made.next(1.0, categories as f64 + 0.999) as usize;
                    let away = if work % 3 == 0 { made.next(-2.0, 2.0).round() as isize } else { 0 };
                    (first, first.saturating_add_signed(away).clamp(1, categories))
                })
                .collect();
            for (power, weights) in [(1, KappaWeights::Linear), (2, KappaWeights::Quadratic)] {
                let Some(found) = statistics::weighted_kappa(&rated, categories, weights) else { continue };
                cases.push(json!({ "what": "kappa", "pairs": rated, "categories": categories, "power": power,
                    "kappa": found.kappa, "interval": found.interval }));
            }
        }
        let not_yet: Vec<f64> = (0..people).map(|_| made.next(20.0, 70.0)).collect();
        let competent: Vec<f64> = (0..people + 3).map(|_| made.next(55.0, 98.0)).collect();
        let found = statistics::contrasting_groups(&not_yet, &competent);
        cases.push(
            json!({ "what": "contrasting", "not_yet": not_yet, "competent": competent, "cut": found.map(|f| f.cut),
            "wrong": found.map(|f| [f.failed_wrongly, f.passed_wrongly]) }),
        );
        let judged: Vec<(f64, f64)> = (0..people + 4)
            .map(|n| {
                let rating = (1 + n % 5) as f64;
                (rating, 30.0 + 12.0 * rating + made.next(-15.0, 15.0))
            })
            .collect();
        let found = statistics::borderline_regression(&judged, 2.0).unwrap();
        let slope = statistics::linear_fit(&judged).unwrap().slope_interval();
        cases.push(json!({ "what": "borderline", "judged": judged, "cut": found.cut, "interval": found.interval,
            "slope": found.slope, "slope_interval": slope, "explained": found.r_squared }));
    }
    cases
}

#[test]
fn python_comes_to_the_same_to_nine_digits() {
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python with scipy and pingouin") else { return };
    let file = folder("statistics").join("cases.json");
    std::fs::write(&file, serde_json::to_string(&cases()).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_statistics.py");
    let output = Command::new(python).arg(script).arg(&file).output().unwrap();
    let (told, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}{complained}");
    println!("{complained}");
}

// With their intervals, where there are three.
const ALPHA: (f64, f64, f64) = (0.9312169312169312, 0.7540031770337152, 0.9892990078305802);
const ICC: (f64, f64, f64) = (0.7904191616766467, 0.47231210393623146, 0.962383172168046);
const MEAN_LOW: f64 = 1.621939230639487;
const SHARE_LOW: f64 = 0.39677814746114526;
const CUT: f64 = 62.2916680551857;
const LINE: (f64, f64, f64) = (55.69230769230769, 50.8408685293649, 60.54374685525049);

#[test]
fn the_figures_stay_what_python_found() {
    // Aim: a slip shows where there is no Python, too. Method: figures that scipy 1.17 gave for this table once.
    let answers = [
        [4.0, 5.0, 3.0, 4.0],
        [2.0, 3.0, 2.0, 1.0],
        [5.0, 5.0, 4.0, 5.0],
        [3.0, 2.0, 3.0, 3.0],
        [4.0, 4.0, 5.0, 4.0],
        [1.0, 2.0, 2.0, 2.0],
    ]
    .map(Vec::from);
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} where {expected} was found");
    let alpha = statistics::cronbach_alpha(&answers).unwrap();
    near(alpha.alpha, ALPHA.0);
    near(alpha.interval[0], ALPHA.1);
    near(alpha.interval[1], ALPHA.2);
    let icc = statistics::icc(&answers).unwrap();
    near(icc.icc, ICC.0);
    near(icc.interval.unwrap()[0], ICC.1);
    near(icc.interval.unwrap()[1], ICC.2);
    let first: Vec<f64> = answers.iter().map(|a| a[0]).collect();
    let spread = statistics::describe(&first).unwrap();
    near(spread.mean_interval.unwrap()[0], MEAN_LOW);
    near(statistics::proportion(7, 10).unwrap().interval[0], SHARE_LOW);
    let groups = statistics::contrasting_groups(&[48.0, 55.0, 61.0, 40.0], &[66.0, 82.0, 75.0, 58.0, 90.0]).unwrap();
    near(groups.cut, CUT);
    let judged = [(1.0, 41.0), (2.0, 55.0), (2.0, 60.0), (3.0, 66.0), (4.0, 83.0), (5.0, 88.0)];
    let line = statistics::borderline_regression(&judged, 2.0).unwrap();
    near(line.cut, LINE.0);
    near(line.interval[0], LINE.1);
    near(line.interval[1], LINE.2);
}
