//! The cohort's page: what stands in it, in words, for the template `cohort.html`.

use super::questionnaire::{QuestionnaireSummary, Statement};
use super::reading::read_session;
use super::standard::Standard;
use super::summary::{ScenarioSummary, Spread, Summary, in_words};
use super::{Cohort, POINTS, Removal, charts, value};
use crate::frame::Vec3;
use crate::report::html::Templates;
use crate::report::session_file::SessionFile;
use crate::report::{pictures, words};
use base64::Engine;
use serde::Serialize;
use std::path::Path;

/// Letters of a code, title or path shown: what is longer was not written to be read.
const SHOWN_MAX: usize = 80;

/// Teeth of one exercise whose maps are drawn: those that most people worked on.
const MAPS_MAX: usize = 4;

/// Measures shown per session, where there are any.
const COLUMNS: [&str; 9] = [
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

/// Makes the page. `links` says where each session's own page is, relative to this one.
pub fn html(templates: &Templates, cohort: &Cohort, links: &[String]) -> Result<String, String> {
    let summary = cohort.summary();
    let page = Page {
        scenarios: summary.scenarios.iter().map(|s| scenario(cohort, s, links)).collect::<Result<_, _>>()?,
        questionnaires: summary.questionnaires.iter().map(questionnaire).collect(),
        skipped: summary.skipped.iter().map(|f| (shown(&f.file), shown(&f.reason))).collect(),
        experts: cohort.experts.iter().map(|code| shown(code)).collect(),
        bands: bands(),
        summary: &summary,
    };
    templates.render_cohort(&page)
}

/// What the template can use. What is named `svg` is a drawing; everything else is text, and is escaped.
#[derive(Serialize)]
struct Page<'a> {
    summary: &'a Summary,
    scenarios: Vec<ScenarioPart>,
    questionnaires: Vec<QuestionnairePart>,
    skipped: Vec<(String, String)>,
    experts: Vec<String>,
    bands: Vec<Band>,
}

/// A colour of the maps, and the shares that it stands for.
#[derive(Serialize)]
struct Band {
    color: String,
    text: String,
}

#[derive(Serialize)]
struct ScenarioPart {
    title: String,
    sessions: usize,
    participants: usize,
    passed: usize,
    graded: usize,
    passed_interval: String,
    points_mean: String,
    words: Vec<(String, String)>,
    cautions: Vec<String>,
    columns: Vec<String>,
    rows: Vec<Row>,
    metrics: Vec<SpreadLine>,
    progress: Vec<(String, String)>,
    repeated: Vec<RepeatedLine>,
    standard: Option<StandardPart>,
    maps: Vec<MapPart>,
    more_maps: usize,
}

#[derive(Serialize)]
struct Row {
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
    interval: String,
    sd: String,
    min: String,
    median: String,
    max: String,
    /// Mean and standard deviation of the experts' sessions; empty without.
    experts: String,
    experts_sd: String,
    svg: String,
}

#[derive(Serialize)]
struct RepeatedLine {
    title: String,
    people: usize,
    icc: String,
    correlation: String,
    gain: String,
    error: String,
}

#[derive(Serialize)]
struct StandardPart {
    by_examiners: bool,
    people: usize,
    pass_points: String,
    contrasting: Option<String>,
    regression: Option<String>,
}

#[derive(Serialize)]
struct MapPart {
    people: usize,
    experts: usize,
    file: String,
    by_any: String,
    by_half: String,
    by_all: String,
    pictures: Vec<(String, String)>,
    complaint: String,
}

#[derive(Serialize)]
struct QuestionnairePart {
    title: String,
    n: usize,
    whole: Option<AlphaLine>,
    categories: Vec<CategoryPart>,
}

#[derive(Serialize)]
struct AlphaLine {
    alpha: String,
    interval: String,
    people: usize,
    statements: usize,
}

#[derive(Serialize)]
struct CategoryPart {
    title: String,
    mean: String,
    sd: String,
    interval: String,
    alpha: Option<AlphaLine>,
    statements: Vec<StatementLine>,
}

#[derive(Serialize)]
struct StatementLine {
    title: String,
    mirrored: bool,
    n: usize,
    mean: String,
    counted: String,
    sd: String,
    with_rest: String,
    alpha_without: String,
    svg: String,
}

fn shown(text: &str) -> String {
    words::harmless(text, SHOWN_MAX)
}

fn bands() -> Vec<Band> {
    let mut from = 0.0;
    let band = |&(to, [r, g, b]): &(f32, [u8; 3])| {
        let text = match from {
            0.0 => format!("up to {:.0} %", to * 100.0),
            from => format!("{:.0}–{:.0} %", from * 100.0, to * 100.0),
        };
        from = to;
        Band { color: format!("#{r:02x}{g:02x}{b:02x}"), text }
    };
    pictures::BANDS.iter().map(band).collect()
}

fn scenario(cohort: &Cohort, summary: &ScenarioSummary, links: &[String]) -> Result<ScenarioPart, String> {
    let columns: Vec<&str> = COLUMNS.into_iter().filter(|name| summary.metrics.contains_key(*name)).collect();
    let own: Vec<usize> =
        (0..cohort.sessions.len()).filter(|&i| cohort.sessions[i].1.scenario.id == summary.id).collect();
    let distances = own.iter().any(|&i| cohort.distance(i).is_some());
    let mut titles: Vec<String> = columns.iter().map(|c| words::title(c)).collect();
    if distances {
        titles.extend(["Differs from the experts".to_string(), "Alike (Dice)".to_string()]);
    }
    let rows = own.iter().map(|&index| {
        let session = &cohort.sessions[index].1;
        let mut row = row(session, &links[index], &columns);
        if distances {
            let distance = cohort.distance(index);
            row.cells.push(distance.map_or("—".into(), |d| format!("{} mm³", words::number(d.differs_mm3))));
            row.cells.push(distance.map_or("—".into(), |d| format!("{:.2}", d.dice)));
        }
        row
    });
    let values = |name: &str| own.iter().filter_map(|&i| value(&cohort.sessions[i].1, name)).collect::<Vec<f64>>();
    let with_experts =
        |line: SpreadLine, name: &str, told: &dyn Fn(f64) -> String| match summary.expert_metrics.get(name) {
            None => line,
            Some(s) => SpreadLine { experts: told(s.mean), experts_sd: s.sd.map_or(String::new(), told), ..line },
        };
    let points = summary.points.iter().map(|s| {
        let line = spread_line("Points".into(), s, words::number, &values(POINTS));
        with_experts(line, POINTS, &words::number)
    });
    let metric = |name: &String| {
        let spread = summary.metrics.get(name)?;
        // A mean of right and wrong is a share, not "right".
        let is_flag = matches!(name.as_str(), "detect_tooth" | "detect_quadrant" | "pulp_exposed");
        let told = |v: f64| if is_flag { words::number(v) } else { words::measure(name, Some(v)) };
        let line = spread_line(shown(&words::title(name)), spread, told, &values(name));
        Some(with_experts(line, name, &told))
    };
    let progress = summary.progress.iter().map(|(name, progress)| {
        let title = measure_title(name);
        let svg = charts::curves(progress, name, &title);
        (title, svg)
    });
    let mine: Vec<&Removal> = cohort.removals.iter().filter(|r| r.scenario == summary.id).collect();
    Ok(ScenarioPart {
        title: shown(&summary.title),
        sessions: summary.sessions,
        participants: summary.participants,
        passed: summary.passed,
        graded: summary.graded,
        passed_interval: summary
            .passed_interval
            .map_or(String::new(), |i| interval(&i.map(|v| 100.0 * v), |v| format!("{v:.0} %"))),
        points_mean: summary.points_mean.map_or("–".into(), words::number),
        words: in_words(summary),
        cautions: summary.cautions.clone(),
        columns: titles,
        rows: rows.collect(),
        metrics: points.chain(cohort.metric_names().iter().filter_map(metric)).collect(),
        progress: progress.collect(),
        repeated: summary.repeated.iter().map(|(name, r)| repeated(name, r)).collect(),
        standard: summary.standard.as_ref().map(standard),
        more_maps: mine.len().saturating_sub(MAPS_MAX),
        maps: mine.into_iter().take(MAPS_MAX).zip(&summary.removals).map(|(r, s)| map(r, s)).collect(),
    })
}

fn row(session: &SessionFile, link: &str, columns: &[&str]) -> Row {
    let grade = session.grade.as_ref();
    let (result, class) = match grade {
        Some(grade) if grade.passed => ("passed", "good"),
        Some(grade) if !grade.hard_fails.is_empty() => ("failed outright", "bad"),
        Some(_) => ("not passed", "bad"),
        None => ("–", ""),
    };
    Row {
        participant: shown(&session.participant),
        started: shown(&session.started.replace('T', " ").replace('Z', "")),
        link: link.to_string(),
        points: grade.map_or("–".into(), |g| words::number(g.points)),
        result,
        class,
        cells: columns.iter().map(|c| words::measure(c, session.metric(c))).collect(),
    }
}

fn measure_title(name: &str) -> String {
    if name == POINTS { "Points".into() } else { words::title(name) }
}

fn interval(&[low, high]: &[f64; 2], told: impl Fn(f64) -> String) -> String {
    format!("{} to {}", told(low), told(high))
}

fn spread_line(title: String, spread: &Spread, told: impl Fn(f64) -> String, values: &[f64]) -> SpreadLine {
    let alt = format!(
        "{title}: {} sessions from {} to {}, mean {}",
        spread.n,
        told(spread.min),
        told(spread.max),
        told(spread.mean)
    );
    SpreadLine {
        n: spread.n,
        mean: told(spread.mean),
        interval: spread.mean_interval.as_ref().map_or("–".into(), |i| interval(i, words::number)),
        sd: spread.sd.map_or("–".into(), &told),
        min: told(spread.min),
        median: told(spread.median),
        max: told(spread.max),
        svg: charts::strip(values, spread, &alt),
        experts: String::new(),
        experts_sd: String::new(),
        title,
    }
}

fn repeated(name: &str, found: &super::progress::Repeated) -> RepeatedLine {
    let with = |value: Option<f64>, bounds: Option<&[f64; 2]>| match (value, bounds) {
        (None, _) => "–".to_string(),
        (Some(value), None) => format!("{value:.2}"),
        (Some(value), Some(bounds)) => format!("{value:.2} ({})", interval(bounds, |v| format!("{v:.2}"))),
    };
    RepeatedLine {
        title: measure_title(name),
        people: found.people,
        icc: with(found.icc, found.icc_interval.as_ref()),
        correlation: with(found.correlation, None),
        gain: format!("{} ({})", words::number(found.gain), interval(&found.gain_interval, words::number)),
        error: words::number(found.error),
    }
}

fn standard(standard: &Standard) -> StandardPart {
    let group = |g: &super::standard::Group| {
        format!("{} people, mean {}, SD {}", g.people, words::number(g.mean), words::number(g.sd))
    };
    let contrasting = standard.contrasting_groups.as_ref().map(|c| {
        format!(
            "{} points. Not yet competent: {}. Competent: {}. At this mark {} of the competent would fail, and {} of the not yet \
             competent pass.",
            words::number(c.cut),
            group(&c.not_yet),
            group(&c.competent),
            c.failed_wrongly,
            c.passed_wrongly
        )
    });
    let regression = standard.borderline_regression.as_ref().map(|r| {
        format!(
            "{} points ({}), over {} people; {} points for each step of the rating, R² {:.2}.",
            words::number(r.cut),
            interval(&r.interval, words::number),
            r.people,
            words::number(r.points_per_step),
            r.explained
        )
    });
    StandardPart {
        by_examiners: standard.judged_by == "examiners",
        people: standard.people,
        pass_points: standard.pass_points.map_or("not the same for all".into(), words::plain),
        contrasting,
        regression,
    }
}

fn map(removal: &Removal, summary: &super::removal::RemovalSummary) -> MapPart {
    let volume = |v: f64| format!("{} mm³", words::number(v));
    let tooth = removal.tooth.join("initial.seg.nrrd");
    let drawn = pictures::shares(&tooth, distal(&removal.tooth), &removal.grid, &removal.share);
    let encode =
        |png: &[u8]| format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png));
    let (pictures, complaint) = match drawn {
        Ok(pictures) => (pictures.into_iter().map(|p| (p.title, encode(&p.png))).collect(), String::new()),
        Err(why) => (Vec::new(), shown(&why)),
    };
    MapPart {
        people: removal.people,
        experts: removal.experts,
        file: summary.map.clone(),
        by_any: volume(summary.by_any_mm3),
        by_half: volume(summary.by_half_mm3),
        by_all: volume(summary.by_all_mm3),
        pictures,
        complaint,
    }
}

/// Which way is distal in a bundle's first tooth; where nobody says which that is, as in the lower left.
fn distal(bundle: &Path) -> Vec3 {
    let session = read_session(&bundle.join("session.json")).ok();
    session.and_then(|session| session.tooth_fdi).map_or(Vec3::Y, crate::scenario::distal)
}

fn questionnaire(summary: &QuestionnaireSummary) -> QuestionnairePart {
    let alpha = |category: &str| {
        let found = summary.alphas.iter().find(|a| a.category == category)?;
        Some(AlphaLine {
            alpha: format!("{:.2}", found.alpha),
            interval: interval(&found.interval, |v| format!("{v:.2}")),
            people: found.people,
            statements: found.statements,
        })
    };
    let mut names: Vec<&str> = Vec::new();
    for statement in &summary.statements {
        if !names.contains(&statement.category.as_str()) {
            names.push(&statement.category);
        }
    }
    let steps = summary.statements.iter().flat_map(|s| s.counts.keys().filter_map(|k| k.parse::<f64>().ok()));
    let steps = steps.fold(5.0, f64::max).min(11.0) as usize;
    let category = |name: &str| {
        let spread = summary.categories.get(name);
        let own = summary.statements.iter().filter(|s| s.category == name);
        CategoryPart {
            title: shown(name),
            mean: spread.map_or("–".into(), |s| format!("{:.2}", s.mean)),
            sd: spread.and_then(|s| s.sd).map_or("–".into(), |sd| format!("{sd:.2}")),
            interval: spread
                .and_then(|s| s.mean_interval)
                .map_or("–".into(), |i| interval(&i, |v| format!("{v:.2}"))),
            alpha: alpha(name),
            statements: own.map(|s| statement(s, steps)).collect(),
        }
    };
    QuestionnairePart {
        title: shown(if summary.title.is_empty() { &summary.id } else { &summary.title }),
        n: summary.n,
        whole: alpha(""),
        categories: names.into_iter().map(category).collect(),
    }
}

fn statement(statement: &Statement, steps: usize) -> StatementLine {
    let two = |value: Option<f64>| value.map_or("–".to_string(), |v| format!("{v:.2}"));
    let title = shown(if statement.text.is_empty() { &statement.id } else { &statement.text });
    StatementLine {
        mirrored: statement.mirrored == Some(true),
        n: statement.answered.as_ref().map_or(0, |s| s.n),
        mean: two(statement.answered.as_ref().map(|s| s.mean)),
        counted: two(statement.counted.as_ref().map(|s| s.mean)),
        sd: two(statement.answered.as_ref().and_then(|s| s.sd)),
        with_rest: two(statement.with_rest),
        alpha_without: two(statement.alpha_without),
        svg: charts::answers(&statement.counts, steps, &format!("{title}: how often each answer was given")),
        title,
    }
}
