//! Pages from templates that a school may edit.
//!
//! Takes what is known as plain texts and numbers in words. Gives one self-contained page; everything a person wrote is
//! escaped.

use super::cohort::{Cohort, Spread, Summary, in_words};
use super::pictures::{Picture, Shows};
use super::session_file::SessionFile;
use super::{curves, words};
use crate::record::Recording;
use crate::scenario::Metric;
use crate::score::{Scored, Verdict};
use base64::Engine;
use minijinja::value::{Serde, Value};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

const REPORT: &str = include_str!("../../reports/templates/report.html");
const COHORT: &str = include_str!("../../reports/templates/cohort.html");

/// The texts that pages are made from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Templates {
    pub report: String,
    pub cohort: String,
}

impl Templates {
    /// Those that ship with the program.
    pub fn shipped() -> Templates {
        Templates { report: REPORT.into(), cohort: COHORT.into() }
    }

    /// Those of a folder; what it lacks ships with the program.
    ///
    /// `Err` when one of them cannot be read or is no template.
    pub fn in_folder(folder: &Path) -> Result<Templates, String> {
        let read = |name: &str, otherwise: &str| {
            let path = folder.join(name);
            let text = match fs::read_to_string(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => otherwise.to_string(),
                Err(error) => return Err(format!("{}: unreadable-file: {error}", path.display())),
                Ok(text) => text,
            };
            let parsed = Environment::new().add_template("page", &text).map(drop);
            parsed.map_err(|e| format!("{}: wrong-template: {e}", path.display()))?;
            Ok(text)
        };
        Ok(Templates { report: read("report.html", REPORT)?, cohort: read("cohort.html", COHORT)? })
    }

    fn render(name: &str, template: &str, page: &impl Serialize) -> Result<String, String> {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.add_template("page", template).map_err(|e| format!("template {name} — {e}"))?;
        let values = Value::from(Serde(page));
        let text = environment.get_template("page").and_then(|t| t.render(values));
        text.map_err(|e| format!("template {name} — {e}"))
    }
}

/// What the template of a session's page can use.
#[derive(Serialize)]
struct SessionPage<'a> {
    session: &'a SessionFile,
    summary: &'a str,
    started: String,
    length: String,
    points: Option<String>,
    max_points: Option<String>,
    pass_points: Option<String>,
    items: Vec<ItemLine>,
    fails: Vec<FailLine>,
    legend: Vec<LegendEntry>,
    maps: Vec<Figure>,
    slices: Vec<Figure>,
    plain: Vec<Figure>,
    curves: String,
    stages: Vec<StageLine>,
    measures: Vec<MeasureLine>,
    questionnaire: Option<QuestionnaireLines>,
}

/// What the template of a cohort's page can use.
#[derive(Serialize)]
struct CohortPage<'a> {
    summary: &'a Summary,
    scenarios: Vec<CohortScenario>,
    questionnaires: Vec<CohortQuestionnaire>,
}

#[derive(Serialize)]
struct ItemLine {
    title: String,
    formula: &'static str,
    value: String,
    r#where: String,
    full_at: String,
    zero_at: String,
    points: String,
    max_points: String,
    percent: u32,
}

#[derive(Serialize)]
struct FailLine {
    title: String,
    formula: &'static str,
    limit: String,
    value: String,
    failed: bool,
}

#[derive(Serialize)]
struct MeasureLine {
    name: String,
    title: String,
    formula: &'static str,
    value: String,
    r#where: String,
}

#[derive(Serialize)]
struct LegendEntry {
    title: &'static str,
    color: String,
    ink: &'static str,
    sign: &'static str,
    amount: String,
}

#[derive(Serialize)]
struct Figure {
    title: String,
    alt: String,
    data: String,
}

#[derive(Serialize)]
struct StageLine {
    title: String,
    began: String,
    took: String,
    ended_by: &'static str,
    /// The exercise led the trainee's hand.
    guided: bool,
    /// For how long another person's hand did.
    led: Option<String>,
    asked: bool,
    answers: Vec<AnswerLine>,
}

#[derive(Serialize)]
struct AnswerLine {
    text: String,
    value: String,
    judgement: String,
    after: String,
    level: Option<f64>,
}

/// The page of one session.
pub fn session_page(
    templates: &Templates,
    recording: &Recording,
    scored: &Scored,
    session: &SessionFile,
    pictures: &[Picture],
) -> Result<String, String> {
    let grade = session.grade.as_ref();
    let figures =
        |shows: fn(&Shows) -> bool| pictures.iter().filter(|p| shows(&p.shows)).map(figure).collect::<Vec<_>>();
    let spans: Vec<curves::Span> =
        session.stages.iter().map(|s| curves::Span { title: &s.title, from: s.started_s, to: s.ended_s }).collect();
    let page = SessionPage {
        session,
        summary: &recording.scenario.summary,
        started: session.started.replace('T', " ").replace('Z', " UTC"),
        length: words::duration(session.servo.ticks as f64 * crate::tick::TICK_S),
        points: grade.map(|g| words::number(g.points)),
        max_points: grade.map(|g| words::plain(g.max_points)),
        pass_points: grade.map(|g| words::plain(g.pass_points)),
        items: grade.map(|g| g.items.iter().map(|i| item_line(i, session)).collect()).unwrap_or_default(),
        fails: grade.map(|g| g.hard_fail_checks.iter().map(fail_line).collect()).unwrap_or_default(),
        legend: legend(scored),
        maps: figures(|s| *s == Shows::Map),
        slices: figures(|s| *s == Shows::MapSlice),
        plain: figures(|s| !matches!(s, Shows::Map | Shows::MapSlice)),
        curves: curves::svg(&scored.trace, &spans),
        stages: stage_lines(recording, session),
        measures: measure_lines(scored, session),
        questionnaire: questionnaire_lines(recording, session),
    };
    Templates::render("report.html", &templates.report, &page)
}

fn figure(picture: &Picture) -> Figure {
    let data = base64::engine::general_purpose::STANDARD.encode(&picture.png);
    Figure { title: picture.title.clone(), alt: picture.title.clone(), data: format!("data:image/png;base64,{data}") }
}

fn formula(metric: &str) -> &'static str {
    Metric::parse(metric).map_or("", |m| m.about.formula)
}

/// Where and when a measure arose, in words.
fn place(metric: &str, session: &SessionFile) -> String {
    let Some(evidence) = session.evidence.get(metric) else { return String::new() };
    let when = evidence.at_s.map(|s| format!("at {}, ", words::duration(s))).unwrap_or_default();
    let [x, y, z] = evidence.place_mm;
    let part = |v: f64, positive: &str, negative: &str| {
        format!("{:.1} mm {}", v.abs(), if v >= 0.0 { positive } else { negative })
    };
    format!("{when}{}, {}, {}", part(x, "buccal", "lingual"), part(y, "distal", "mesial"), part(z, "up", "down"))
}

fn item_line(item: &super::ItemFile, session: &SessionFile) -> ItemLine {
    let value = |v: f64| words::measure(&item.metric, Some(v));
    ItemLine {
        title: item.title.clone(),
        formula: formula(&item.metric),
        value: words::measure(&item.metric, item.value),
        r#where: place(&item.metric, session),
        full_at: value(item.full_at),
        zero_at: value(item.zero_at),
        points: words::number(item.points),
        max_points: words::plain(item.max_points),
        percent: (100.0 * item.points / item.max_points).round().clamp(0.0, 100.0) as u32,
    }
}

fn fail_line(fail: &super::HardFailFile) -> FailLine {
    let value = |v: f64| match fail.metric.as_str() {
        "pulp_exposed" => "it is".to_string(),
        metric => words::measure(metric, Some(v)),
    };
    let limit = match (fail.above, fail.below) {
        (Some(limit), _) if fail.metric == "pulp_exposed" => value(limit),
        (Some(limit), _) => format!("more than {}", value(limit)),
        (_, Some(limit)) => format!("less than {}", value(limit)),
        _ => String::new(),
    };
    FailLine {
        title: fail.title.clone(),
        formula: formula(&fail.metric),
        limit,
        value: words::measure(&fail.metric, fail.value),
        failed: fail.failed,
    }
}

fn measure_lines(scored: &Scored, session: &SessionFile) -> Vec<MeasureLine> {
    let line = |m: &crate::score::Measure| {
        let name = m.metric.name();
        MeasureLine {
            title: words::title(&name),
            formula: m.metric.about.formula,
            value: words::measure(&name, m.value),
            r#where: place(&name, session),
            name,
        }
    };
    scored.measures.all.iter().map(line).collect()
}

/// The signs are a second cue beside the colours.
fn legend(scored: &Scored) -> Vec<LegendEntry> {
    let voxel = scored.replay.workpiece.volume.grid().voxel_mm3();
    let entry = |verdict: &Verdict| {
        let count = scored.verdicts.iter().filter(|v| *v == verdict).count();
        let [r, g, b] = verdict.color();
        let is_dark = 0.3 * r + 0.59 * g + 0.11 * b < 0.5;
        let [r, g, b] = [r, g, b].map(|c| (c * 255.0).round() as u8);
        LegendEntry {
            title: verdict.title(),
            color: format!("#{r:02x}{g:02x}{b:02x}"),
            ink: if is_dark { "#fff" } else { "#000" },
            sign: verdict.sign(),
            amount: format!("{} mm³", words::number(count as f64 * voxel)),
        }
    };
    Verdict::SEEN.iter().filter(|v| scored.verdicts.contains(v)).map(entry).collect()
}

fn stage_lines(recording: &Recording, session: &SessionFile) -> Vec<StageLine> {
    let stages = session.stages.iter().zip(&recording.scenario.stages);
    let line = |(result, stage): (&super::StageFile, &crate::scenario::Stage)| StageLine {
        title: result.title.clone(),
        began: words::duration(result.started_s),
        took: words::duration(result.ended_s - result.started_s),
        ended_by: match result.ended_by.as_str() {
            "time" => "its time limit",
            "answer" => "the answer",
            "confirmation" => "the trainee, who was done",
            "cleared" => "the decay being gone",
            _ => "being broken off",
        },
        guided: result.guided,
        led: result.led_s.map(words::duration),
        asked: !stage.ask.is_empty(),
        answers: result.answers.iter().map(|a| answer_line(a, result.started_s)).collect(),
    };
    stages.map(line).collect()
}

fn answer_line(answer: &super::AnswerFile, stage_started: f64) -> AnswerLine {
    let text = |value: &serde_json::Value| match value {
        serde_json::Value::String(text) => text.clone(),
        serde_json::Value::Bool(yes) => words::yes_no(*yes).into(),
        other => other.to_string(),
    };
    let judgement = match answer.right {
        Some(true) => "right".to_string(),
        Some(false) => format!("wrong, right is {}", text(&answer.truth)),
        None => String::new(),
    };
    AnswerLine {
        text: answer.text.clone(),
        value: text(&answer.value),
        judgement,
        after: words::duration(answer.at_s - stage_started),
        level: answer.level,
    }
}

#[derive(Serialize)]
struct QuestionnaireLines {
    title: String,
    lowest: String,
    highest: String,
    steps: u8,
    categories: Vec<CategoryLines>,
}

#[derive(Serialize)]
struct CategoryLines {
    title: String,
    mean: String,
    /// Not "items": in a template that is a mapping's own method.
    entries: Vec<RatingLine>,
}

#[derive(Serialize)]
struct RatingLine {
    text: String,
    value: String,
    counted: String,
}

fn questionnaire_lines(recording: &Recording, session: &SessionFile) -> Option<QuestionnaireLines> {
    let (asked, given) = (recording.scenario.questionnaire.as_ref()?, session.questionnaire.as_ref()?);
    let shown = |v: Option<f64>| v.map_or("–".to_string(), words::plain);
    let categories = asked.categories.iter().map(|category| {
        let items = category.items.iter().filter_map(|item| {
            let rating = given.items.iter().find(|r| r.id == item.id)?;
            Some(RatingLine { text: item.text.clone(), value: shown(rating.value), counted: shown(rating.counted) })
        });
        let mean = given.categories.get(&category.id).copied().flatten();
        CategoryLines {
            title: category.title.clone(),
            mean: mean.map_or("–".to_string(), |m| format!("{m:.2}")),
            entries: items.collect(),
        }
    });
    Some(QuestionnaireLines {
        title: asked.title.clone(),
        lowest: asked.lowest.clone(),
        highest: asked.highest.clone(),
        steps: asked.steps,
        categories: categories.collect(),
    })
}

#[derive(Serialize)]
struct CohortScenario {
    title: String,
    sessions: usize,
    passed: usize,
    graded: usize,
    points_mean: String,
    words: Vec<(String, String)>,
    cautions: Vec<String>,
    columns: Vec<String>,
    rows: Vec<CohortRow>,
    metrics: Vec<SpreadLine>,
}

#[derive(Serialize)]
struct CohortRow {
    participant: String,
    started: String,
    link: String,
    points: String,
    result: &'static str,
    class: &'static str,
    cells: Vec<String>,
}

#[derive(Serialize)]
struct SpreadLine {
    title: String,
    n: usize,
    mean: String,
    sd: String,
    min: String,
    median: String,
    max: String,
}

#[derive(Serialize)]
struct CohortQuestionnaire {
    id: String,
    n: usize,
    categories: Vec<SpreadLine>,
    items: Vec<SpreadLine>,
}

/// The page of many sessions. `links` says where each session's own page is, relative to this one.
pub fn cohort_page(templates: &Templates, cohort: &Cohort, links: &[String]) -> Result<String, String> {
    let summary = cohort.summary();
    let scenarios: Vec<CohortScenario> = summary.scenarios.iter().map(|s| cohort_scenario(cohort, s, links)).collect();
    let questionnaires: Vec<CohortQuestionnaire> = summary
        .questionnaires
        .iter()
        .map(|q| {
            let line = |(name, spread): (&String, &Spread)| spread_line(name.clone(), spread, words::number);
            let (categories, items) = (q.categories.iter().map(line).collect(), q.items.iter().map(line).collect());
            CohortQuestionnaire { id: q.id.clone(), n: q.n, categories, items }
        })
        .collect();
    let page = CohortPage { summary: &summary, scenarios, questionnaires };
    Templates::render("cohort.html", &templates.cohort, &page)
}

fn cohort_scenario(cohort: &Cohort, summary: &super::cohort::ScenarioSummary, links: &[String]) -> CohortScenario {
    /// Measures shown per session, where there are any.
    const SHOWN: [&str; 9] = [
        "detect_tooth",
        "detect_level",
        "detect_level_time_s",
        "detect_quadrant",
        "detect_quadrant_time_s",
        "decay_cleared_pct",
        "healthy_per_decay_pct",
        "time_to_clear_s",
        "force_max_n",
    ];
    let columns: Vec<&str> = SHOWN.into_iter().filter(|name| summary.metrics.contains_key(*name)).collect();
    let sessions = cohort.sessions.iter().zip(links).filter(|((_, s), _)| s.scenario.id == summary.id);
    let row = |((_, session), link): (&(std::path::PathBuf, SessionFile), &String)| {
        let grade = session.grade.as_ref();
        let (result, class) = match grade {
            Some(grade) if grade.passed => ("passed", "good"),
            Some(grade) if !grade.hard_fails.is_empty() => ("failed outright", "bad"),
            Some(_) => ("not passed", "bad"),
            None => ("–", ""),
        };
        CohortRow {
            participant: session.participant.clone(),
            started: session.started.replace('T', " ").replace('Z', ""),
            link: link.clone(),
            points: grade.map_or("–".into(), |g| words::number(g.points)),
            result,
            class,
            cells: columns.iter().map(|c| words::measure(c, session.metric(c))).collect(),
        }
    };
    let metric = |name: &String| {
        let spread = summary.metrics.get(name)?;
        // A mean of right and wrong is a share, not "right".
        let is_flag = matches!(name.as_str(), "detect_tooth" | "detect_quadrant" | "pulp_exposed");
        let shown = |v: f64| if is_flag { words::number(v) } else { words::measure(name, Some(v)) };
        Some(spread_line(words::title(name), spread, shown))
    };
    CohortScenario {
        title: summary.title.clone(),
        sessions: summary.sessions,
        passed: summary.passed,
        graded: summary.graded,
        points_mean: summary.points_mean.map_or("–".into(), words::number),
        words: in_words(summary),
        cautions: summary.cautions.clone(),
        columns: columns.iter().map(|c| words::title(c)).collect(),
        rows: sessions.map(row).collect(),
        metrics: cohort.metric_names().iter().filter_map(metric).collect(),
    }
}

fn spread_line(title: String, spread: &Spread, shown: impl Fn(f64) -> String) -> SpreadLine {
    SpreadLine {
        title,
        n: spread.n,
        mean: shown(spread.mean),
        sd: spread.sd.map_or("–".into(), &shown),
        min: shown(spread.min),
        median: shown(spread.median),
        max: shown(spread.max),
    }
}
