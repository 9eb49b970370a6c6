//! The cohort's page: its contents in the words of one language, for the template `cohort.html`.

use super::agreement::{AgreementFile, AgreementPair, IccFile, KappaFile, MACHINE};
use super::charts::{CurveLabels, HistogramLabels};
use super::loader::read_session;
use super::measurement_error::{DoubtfulResult, MeasurementErrorFile};
use super::pass_mark::PassMarkEstimate;
use super::progress::LearningCurves;
use super::questionnaire::{QuestionnaireStatement, QuestionnaireSummary};
use super::ranges::FLAGS;
use super::summary::{CohortSummary, ScenarioSummary, SpreadFile, summary_lines};
use super::{Cohort, POINTS, RemovalMap, charts, points_or_measure};
use crate::language::{COUNT, Message, Translator};
use crate::session_file::{GradeFile, SessionFile};
use crate::templates::Templates;
use crate::verification::VerificationStatus;
use crate::{display_format, phrases, pictures};
use base64::Engine;
use minijinja::value::Value;
use serde::Serialize;
use std::path::Path;
use typodont_core::frame::Vec3;
use typodont_core::statistics::Interval;

/// Most characters of a code, title or path that are shown.
const SHOWN_MAX: usize = 80;

/// Most characters of the differences of a session that are shown.
const NOTE_MAX: usize = 300;

/// Teeth of one exercise whose maps are drawn: those that most people worked on.
const MAPS_MAX: usize = 4;

/// Measures shown per session, where there are any.
const SESSION_MEASURES: [&str; 9] = [
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

/// Renders the page in one language. `links` holds the relative link to each session's own page, empty for none.
///
/// # Errors
///
/// When there is no such language, a map cannot be drawn or the template fails.
pub fn html(templates: &Templates, cohort: &Cohort, links: &[String], language: &str) -> Result<String, String> {
    let translator = templates.languages().translator(language)?;
    let summary = cohort.summary();
    let scenarios = summary.scenarios.iter().map(|s| scenario(translator, cohort, s, links));
    let page = CohortPage {
        language: translator.code(),
        style: Value::from_safe_string(templates.cohort_style().into()),
        scenarios: scenarios.collect::<Result<_, _>>()?,
        questionnaires: summary.questionnaires.iter().map(|q| questionnaire(translator, q)).collect(),
        skipped: summary.skipped.iter().map(|f| (sanitize(&f.file), sanitize(&f.reason))).collect(),
        experts: cohort.experts.iter().map(|code| sanitize(code)).collect(),
        bands: bands(translator),
        summary: &summary,
    };
    templates.render_cohort(&page, translator.code())
}

/// Values for the template. A value named `svg` is a drawing; every other value is text, and is escaped.
#[derive(Serialize)]
struct CohortPage<'a> {
    /// Code of the page's language.
    language: &'a str,
    /// Style sheet, which is inserted unescaped.
    style: Value,
    summary: &'a CohortSummary,
    scenarios: Vec<ScenarioPart>,
    questionnaires: Vec<QuestionnairePart>,
    skipped: Vec<(String, String)>,
    experts: Vec<String>,
    bands: Vec<ShareBand>,
}

/// A colour of the maps, and the shares that it stands for.
#[derive(Serialize)]
struct ShareBand {
    color: String,
    text: String,
}

#[derive(Serialize)]
struct ScenarioPart {
    title: String,
    /// Tooth, voxel size and scorer version; empty if all sessions of the exercise agree in them.
    conditions: String,
    /// Drawing of the distribution of points with the pass mark; empty if nothing was graded.
    histogram: String,
    sessions: usize,
    participants: usize,
    passed: usize,
    graded: usize,
    passed_interval: String,
    points_mean: String,
    words: Vec<(String, String)>,
    cautions: Vec<String>,
    columns: Vec<String>,
    rows: Vec<CohortSessionRow>,
    metrics: Vec<SpreadLine>,
    progress: Vec<(String, String)>,
    repeated: Vec<RepeatedLine>,
    standard: Option<StandardPart>,
    agreement: Vec<AgreementPart>,
    measurement_error: Option<MeasurementErrorPart>,
    maps: Vec<MapPart>,
    more_maps: usize,
}

#[derive(Serialize)]
struct CohortSessionRow {
    participant: String,
    started: String,
    link: String,
    points: String,
    result: String,
    class: &'static str,
    /// Relation to the recording: a word, and the differences or the reason.
    verification: String,
    verification_class: &'static str,
    verification_note: String,
    cells: Vec<String>,
}

#[derive(Serialize)]
struct SpreadLine {
    title: String,
    n: usize,
    mean: String,
    interval: String,
    sd: String,
    median: String,
    /// Minimum and maximum.
    extremes: String,
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

/// Agreement about the sessions of one exercise under the same conditions, as text.
#[derive(Serialize)]
pub struct AgreementTables {
    title: String,
    /// Conditions in words, where sessions of the exercise differ in them.
    conditions: Option<String>,
    parts: Vec<AgreementPart>,
}

#[derive(Serialize)]
struct AgreementPart {
    title: String,
    rows: Vec<AgreementLine>,
    /// ICC of all raters, where there are more than two.
    all: Option<String>,
}

#[derive(Serialize)]
struct AgreementLine {
    raters: String,
    works: usize,
    linear: String,
    quadratic: String,
    icc: String,
}

#[derive(Serialize)]
struct MeasurementErrorPart {
    text: String,
    /// Participant, start, points and result.
    rows: Vec<[String; 4]>,
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

fn sanitize(text: &str) -> String {
    display_format::sanitize_display(text, SHOWN_MAX)
}

fn bands(translator: Translator) -> Vec<ShareBand> {
    let mut from = 0.0;
    let band = |&(to, [r, g, b]): &(f32, [u8; 3])| {
        let text = match from {
            0.0 => translator.text("cohort.up_to", &[("share", format!("{:.0} %", to * 100.0))]),
            from => format!("{:.0}–{:.0} %", from * 100.0, to * 100.0),
        };
        from = to;
        ShareBand { color: format!("#{r:02x}{g:02x}{b:02x}"), text }
    };
    pictures::SHARE_BANDS.iter().map(band).collect()
}

fn scenario(
    translator: Translator,
    cohort: &Cohort,
    summary: &ScenarioSummary,
    links: &[String],
) -> Result<ScenarioPart, String> {
    let own = cohort.sessions_of(&summary.group);
    let (columns, rows) = session_table(translator, cohort, summary, &own, links);
    let own_removals: Vec<&RemovalMap> = cohort.removals.iter().filter(|r| r.group == summary.group).collect();
    Ok(ScenarioPart {
        title: sanitize(&summary.title),
        conditions: summary.conditions.as_ref().map_or(String::new(), |message| translator.translate(message)),
        histogram: histogram(translator, cohort, &own, None),
        sessions: summary.sessions,
        participants: summary.participants,
        passed: summary.passed,
        graded: summary.graded,
        passed_interval: summary
            .passed_interval
            .map_or(String::new(), |i| interval(translator, &i.map(|v| 100.0 * v), |v| format!("{v:.0} %"))),
        points_mean: summary.points_mean.map_or("–".into(), display_format::number),
        words: summary_lines(summary, translator),
        cautions: summary.cautions.iter().map(|caution| translator.translate(caution)).collect(),
        columns,
        rows,
        metrics: spread_lines(translator, cohort, summary, &own),
        progress: summary.progress.iter().map(|(name, curves)| progress(translator, name, curves)).collect(),
        repeated: summary.repeated.iter().map(|(name, r)| repeated(translator, name, r)).collect(),
        standard: summary.standard.as_ref().map(|s| standard(translator, s)),
        agreement: summary.agreement.iter().map(|a| agreement(translator, a)).collect(),
        measurement_error: summary.measurement_error.as_ref().map(|e| measurement_error(translator, e)),
        more_maps: own_removals.len().saturating_sub(MAPS_MAX),
        maps: own_removals
            .into_iter()
            .take(MAPS_MAX)
            .zip(&summary.removals)
            .map(|(r, s)| map_part(translator, r, s))
            .collect(),
    })
}

/// Table of an exercise's sessions: the titles of the columns that not every exercise has, and a row for each session.
fn session_table(
    translator: Translator,
    cohort: &Cohort,
    summary: &ScenarioSummary,
    own: &[usize],
    links: &[String],
) -> (Vec<String>, Vec<CohortSessionRow>) {
    let columns: Vec<&str> = SESSION_MEASURES.into_iter().filter(|name| summary.metrics.contains_key(*name)).collect();
    let distances = own.iter().any(|&i| cohort.distance_to_experts(i).is_some());
    let mut titles: Vec<String> = columns.iter().map(|c| measure_title(translator, c)).collect();
    if distances {
        titles.extend(["cohort.expert_difference", "cohort.expert_agreement"].map(|key| translator.text(key, &[])));
    }
    let rows = own.iter().map(|&index| {
        let session = &cohort.sessions[index].1;
        let status = cohort.status(&cohort.sessions[index].0);
        let mut row = row(translator, session, status, &links[index], &columns);
        if distances {
            let distance = cohort.distance_to_experts(index);
            row.cells.push(distance.map_or("—".into(), |d| format!("{} mm³", display_format::number(d.differs_mm3))));
            row.cells.push(distance.map_or("—".into(), |d| format!("{:.2}", d.dice)));
        }
        row
    });
    (titles, rows.collect())
}

/// Distributions of the points and of the measures of an exercise.
fn spread_lines(translator: Translator, cohort: &Cohort, summary: &ScenarioSummary, own: &[usize]) -> Vec<SpreadLine> {
    let values =
        |name: &str| own.iter().filter_map(|&i| points_or_measure(&cohort.sessions[i].1, name)).collect::<Vec<f64>>();
    let with_experts =
        |line: SpreadLine, name: &str, to_text: &dyn Fn(f64) -> String| match summary.expert_metrics.get(name) {
            None => line,
            Some(s) => SpreadLine { experts: to_text(s.mean), experts_sd: s.sd.map_or(String::new(), to_text), ..line },
        };
    let points = summary.points.iter().map(|s| {
        let title = measure_title(translator, POINTS);
        let line = spread_line(translator, title, s, display_format::number, &values(POINTS));
        with_experts(line, POINTS, &display_format::number)
    });
    let metric = |name: &String| {
        let spread = summary.metrics.get(name)?;
        // A mean of right and wrong is a share, not "right".
        let is_flag = FLAGS.contains(&name.as_str());
        let to_text = |v: f64| if is_flag { display_format::number(v) } else { display_format::measure(name, Some(v)) };
        let title = sanitize(&measure_title(translator, name));
        let line = spread_line(translator, title, spread, to_text, &values(name));
        Some(with_experts(line, name, &to_text))
    };
    points.chain(cohort.metric_names().iter().filter_map(metric)).collect()
}

/// Title of a measure, and the drawing of its learning curves.
fn progress(translator: Translator, name: &str, curves: &LearningCurves) -> (String, String) {
    let title = measure_title(translator, name);
    let labels = CurveLabels {
        alt: translator.text("cohort.curves_alt", &[("title", title.clone())]),
        attempt: translator.text("cohort.attempt", &[]),
    };
    let svg = charts::learning_curves(curves, name, &labels);
    (title, svg)
}

/// Drawing of the points of sessions, with the pass mark if it is the same for all, and with one session's own points.
/// Empty if nothing was graded.
pub(super) fn histogram(translator: Translator, cohort: &Cohort, sessions: &[usize], own: Option<f64>) -> String {
    let grades: Vec<&GradeFile> = sessions.iter().filter_map(|&i| cohort.sessions[i].1.grade.as_ref()).collect();
    let points: Vec<f64> = grades.iter().map(|grade| grade.points).collect();
    if points.is_empty() {
        return String::new();
    }
    let most = grades.iter().map(|grade| grade.max_points).chain(points.iter().copied()).fold(0.0, f64::max);
    let mark = grades.iter().all(|grade| grade.pass_points == grades[0].pass_points).then(|| grades[0].pass_points);
    let below = mark.map_or(0, |mark| points.iter().filter(|p| **p < mark).count());
    let described = [
        ("sessions", counted(translator, "cohort.sessions", points.len())),
        ("mark", mark.map_or("–".into(), display_format::plain_number)),
        ("below", below.to_string()),
    ];
    let labels = HistogramLabels {
        alt: translator.text("cohort.histogram_alt", &described),
        mark: mark
            .map(|mark| translator.text("cohort.histogram_mark", &[("points", display_format::plain_number(mark))])),
        own: translator.text("cohort.histogram_own", &[]),
        points: translator.text("cohort.points", &[]),
        sessions: translator.text("cohort.sessions_title", &[]),
    };
    charts::points_histogram(&charts::PointsHistogram { points: &points, most, mark, own }, &labels)
}

/// Result of a session in words, with the reason if it was not passed, and the class of its colour.
pub(super) fn result_of(translator: Translator, session: &SessionFile) -> (String, &'static str) {
    let not_passed = |key: &str| (translator.text(key, &[]), "bad");
    match &session.grade {
        None => ("–".to_string(), ""),
        Some(grade) if grade.passed => (translator.text("cohort.passed", &[]), "good"),
        Some(grade) if !grade.hard_fails.is_empty() => not_passed("cohort.failed"),
        Some(grade) if !grade.finished => not_passed("cohort.unfinished"),
        Some(_) => not_passed("cohort.not_passed"),
    }
}

fn row(
    translator: Translator,
    session: &SessionFile,
    status: &VerificationStatus,
    link: &str,
    columns: &[&str],
) -> CohortSessionRow {
    let grade = session.grade.as_ref();
    let (result, class) = result_of(translator, session);
    CohortSessionRow {
        participant: sanitize(&session.participant),
        started: sanitize(&session.started.replace('T', " ").replace('Z', "")),
        link: link.to_string(),
        points: grade.map_or("–".into(), |g| display_format::number(g.points)),
        result,
        class,
        verification: translator.text(verification_key(status), &[]),
        verification_class: if status.differs() { "bad" } else { "" },
        verification_note: display_format::sanitize_display(&status.note(), NOTE_MAX),
        cells: columns.iter().map(|c| translator.translate(&phrases::value(c, session.metric(c)))).collect(),
    }
}

/// Key of the word for a session's relation to its recording.
fn verification_key(status: &VerificationStatus) -> &'static str {
    match status {
        VerificationStatus::Verified => "cohort.verified",
        VerificationStatus::Differs(_) => "cohort.differs",
        VerificationStatus::Pending | VerificationStatus::Unverified(_) => "cohort.not_verified",
    }
}

fn measure_title(translator: Translator, name: &str) -> String {
    match name {
        POINTS => translator.text("cohort.points", &[]),
        name => translator.translate(&phrases::measure_title(name)),
    }
}

fn interval(translator: Translator, &[low, high]: &[f64; 2], to_text: impl Fn(f64) -> String) -> String {
    translator.text("cohort.interval", &[("low", to_text(low)), ("high", to_text(high))])
}

/// A text with the number that selects its singular or plural.
fn counted(translator: Translator, key: &str, count: usize) -> String {
    translator.text(key, &[(COUNT, count.to_string())])
}

fn spread_line(
    translator: Translator,
    title: String,
    spread: &SpreadFile,
    to_text: impl Fn(f64) -> String,
    values: &[f64],
) -> SpreadLine {
    let described = [
        ("title", title.clone()),
        ("sessions", counted(translator, "cohort.sessions", spread.n)),
        ("low", to_text(spread.min)),
        ("high", to_text(spread.max)),
        ("mean", to_text(spread.mean)),
    ];
    let alt = translator.text("cohort.distribution_alt", &described);
    SpreadLine {
        n: spread.n,
        mean: to_text(spread.mean),
        interval: spread.mean_interval.as_ref().map_or("–".into(), |i| interval(translator, i, &to_text)),
        sd: spread.sd.map_or("–".into(), &to_text),
        median: to_text(spread.median),
        extremes: interval(translator, &[spread.min, spread.max], &to_text),
        svg: charts::strip_plot(values, spread, &alt),
        experts: String::new(),
        experts_sd: String::new(),
        title,
    }
}

fn repeated(translator: Translator, name: &str, found: &super::progress::RepeatedAttempts) -> RepeatedLine {
    let with = |value: Option<f64>, bounds: Option<&[f64; 2]>| match (value, bounds) {
        (None, _) => "–".to_string(),
        (Some(value), None) => format!("{value:.2}"),
        (Some(value), Some(bounds)) => format!("{value:.2} ({})", interval(translator, bounds, |v| format!("{v:.2}"))),
    };
    RepeatedLine {
        title: measure_title(translator, name),
        people: found.people,
        icc: with(found.icc, found.icc_interval.as_ref()),
        correlation: with(found.correlation, None),
        gain: format!(
            "{} ({})",
            display_format::number(found.gain),
            interval(translator, &found.gain_interval, display_format::number)
        ),
        error: display_format::number(found.error),
    }
}

fn standard(translator: Translator, standard: &PassMarkEstimate) -> StandardPart {
    let group = |g: &super::pass_mark::RatedGroup| {
        let values = [
            ("participants", counted(translator, "cohort.participants", g.people)),
            ("mean", display_format::number(g.mean)),
            ("sd", display_format::number(g.sd)),
        ];
        translator.text("cohort.group", &values)
    };
    let contrasting = standard.contrasting_groups.as_ref().map(|c| {
        let values = [
            ("cut", display_format::number(c.cut)),
            ("not_yet", group(&c.not_yet)),
            ("competent", group(&c.competent)),
            ("failed", counted(translator, "cohort.competent_participants", c.failed_wrongly)),
            ("passed", counted(translator, "cohort.not_yet_competent_participants", c.passed_wrongly)),
        ];
        translator.text("cohort.contrasting_result", &values)
    });
    let regression = standard.borderline_regression.as_ref().map(|r| {
        let values = [
            ("cut", display_format::number(r.cut)),
            ("interval", interval(translator, &r.interval, display_format::number)),
            ("participants", counted(translator, "cohort.participants", r.people)),
            ("slope", display_format::number(r.points_per_step)),
            ("explained", format!("{:.2}", r.explained)),
        ];
        translator.text("cohort.regression_result", &values)
    });
    StandardPart {
        by_examiners: standard.judged_by == "examiners",
        people: standard.people,
        pass_points: standard
            .pass_points
            .map_or_else(|| translator.text("cohort.pass_marks_differ", &[]), display_format::plain_number),
        contrasting,
        regression,
    }
}

/// Formats a coefficient with its interval: "0.62 (0.40 to 0.84)"; "–" where there is none.
fn coefficient(translator: Translator, value: Option<(f64, Option<Interval>)>) -> String {
    let two = |v: f64| format!("{v:.2}");
    match value {
        None => "–".into(),
        Some((value, None)) => two(value),
        Some((value, Some(bounds))) => format!("{} ({})", two(value), interval(translator, &bounds, two)),
    }
}

/// Returns the agreement about every exercise that was rated.
pub(super) fn agreement_tables(translator: Translator, cohort: &Cohort) -> Vec<AgreementTables> {
    let tables = |summary: &ScenarioSummary| AgreementTables {
        title: sanitize(&summary.title),
        conditions: summary.conditions.as_ref().map(|said| translator.translate(said)),
        parts: summary.agreement.iter().map(|about| agreement(translator, about)).collect(),
    };
    cohort.summary().scenarios.iter().filter(|summary| !summary.agreement.is_empty()).map(tables).collect()
}

fn agreement(translator: Translator, about: &AgreementFile) -> AgreementPart {
    let name = |rater: &String| match rater.as_str() {
        MACHINE => translator.text("cohort.agreement_machine", &[]),
        "" => translator.text("cohort.agreement_unnamed", &[]),
        rater => sanitize(rater),
    };
    let kappa = |found: Option<KappaFile>| coefficient(translator, found.map(|k| (k.kappa, Some(k.interval))));
    let icc = |found: Option<IccFile>| coefficient(translator, found.map(|i| (i.icc, i.interval)));
    let row = |pair: &AgreementPair| AgreementLine {
        raters: pair.raters.each_ref().map(name).join(" – "),
        works: pair.works,
        linear: kappa(pair.kappa_linear),
        quadratic: kappa(pair.kappa_quadratic),
        icc: icc(pair.icc),
    };
    let scale = ("scale", about.scale.to_string());
    let all = about.icc.filter(|_| about.raters.len() > 2).map(|found| {
        let values = [("raters", about.raters.len().to_string()), ("works", found.works.to_string())];
        translator.text("cohort.agreement_all", &[&values[..], &[("icc", icc(Some(found)))]].concat())
    });
    AgreementPart {
        title: match &about.item {
            None => translator.text("cohort.agreement_overall", &[scale]),
            Some(item) => translator.text("cohort.agreement_item", &[("title", sanitize(&item.title)), scale]),
        },
        rows: about.pairs.iter().map(row).collect(),
        all,
    }
}

/// Returns the agreement about the works as a whole as lines for a terminal.
pub(super) fn agreement_lines(translator: Translator, about: &AgreementFile) -> Vec<String> {
    if about.item.is_some() {
        return Vec::new();
    }
    let part = agreement(translator, about);
    let line = |row: &AgreementLine| {
        format!(
            "  agreement, {}: κ {}, quadratic κ {}, ICC(2,1) {}, n {}",
            row.raters, row.linear, row.quadratic, row.icc, row.works
        )
    };
    part.rows.iter().map(line).chain(part.all.iter().map(|all| format!("  {all}"))).collect()
}

fn measurement_error(translator: Translator, error: &MeasurementErrorFile) -> MeasurementErrorPart {
    let number = |value: f64| display_format::number(value);
    let key = if error.method == "repeated_attempts" { "cohort.error_by_attempts" } else { "cohort.error_by_items" };
    let values = [
        ("sem", number(error.sem)),
        ("people", error.people.to_string()),
        ("points", display_format::plain_number(error.pass_points)),
        ("low", number(error.pass_points - error.sem)),
        ("high", number(error.pass_points + error.sem)),
        ("doubtful", error.in_doubt.len().to_string()),
        ("decided", error.decided.to_string()),
    ];
    let text = format!("{} {}", translator.text(key, &values), translator.text("cohort.error_doubtful", &values));
    let row = |result: &DoubtfulResult| {
        let key = if result.passed { "cohort.passed" } else { "cohort.not_passed" };
        [
            sanitize(&result.participant),
            sanitize(&result.started.replace('T', " ").replace('Z', "")),
            number(result.points),
            translator.text(key, &[]),
        ]
    };
    MeasurementErrorPart { text, rows: error.in_doubt.iter().map(row).collect() }
}

fn map_part(translator: Translator, removal: &RemovalMap, summary: &super::removal::RemovalSummary) -> MapPart {
    let volume = |v: f64| format!("{} mm³", display_format::number(v));
    let tooth = removal.tooth.join("initial.seg.nrrd");
    let drawn = pictures::draw_removal_share(&tooth, distal_of_bundle(&removal.tooth), &removal.grid, &removal.share);
    let encode =
        |png: &[u8]| format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png));
    let title = |p: &pictures::EncodedPicture| {
        let view = p.name.strip_prefix("share-").unwrap_or(&p.name);
        translator.translate(&Message::text_or(format!("side.{view}"), &p.title))
    };
    let (pictures, complaint) = match drawn {
        Ok(pictures) => (pictures.iter().map(|p| (title(p), encode(&p.png))).collect(), String::new()),
        Err(why) => (Vec::new(), sanitize(&why)),
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

/// Distal direction in a bundle's first tooth, in tooth space; +y (as in the lower left quadrant) if the tooth is not
/// known. `None` for an arch.
fn distal_of_bundle(bundle: &Path) -> Option<Vec3> {
    let session = read_session(&bundle.join("session.json")).ok();
    let is_arch = session.as_ref().is_some_and(|session| session.jaw.is_some());
    let distal = session.and_then(|session| session.tooth_fdi).map_or(Vec3::Y, typodont_exercise::scenario::distal);
    (!is_arch).then_some(distal)
}

fn questionnaire(translator: Translator, summary: &QuestionnaireSummary) -> QuestionnairePart {
    let alpha = |category: &str| {
        let found = summary.alphas.iter().find(|a| a.category == category)?;
        Some(AlphaLine {
            alpha: format!("{:.2}", found.alpha),
            interval: interval(translator, &found.interval, |v| format!("{v:.2}")),
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
            title: sanitize(name),
            mean: spread.map_or("–".into(), |s| format!("{:.2}", s.mean)),
            sd: spread.and_then(|s| s.sd).map_or("–".into(), |sd| format!("{sd:.2}")),
            interval: spread
                .and_then(|s| s.mean_interval)
                .map_or("–".into(), |i| interval(translator, &i, |v| format!("{v:.2}"))),
            alpha: alpha(name),
            statements: own.map(|s| statement(translator, s, steps)).collect(),
        }
    };
    QuestionnairePart {
        title: sanitize(if summary.title.is_empty() { &summary.id } else { &summary.title }),
        n: summary.n,
        whole: alpha(""),
        categories: names.into_iter().map(category).collect(),
    }
}

fn statement(translator: Translator, statement: &QuestionnaireStatement, steps: usize) -> StatementLine {
    let two = |value: Option<f64>| value.map_or("–".to_string(), |v| format!("{v:.2}"));
    let title = sanitize(if statement.text.is_empty() { &statement.id } else { &statement.text });
    let alt = translator.text("cohort.answers_alt", &[("title", title.clone())]);
    StatementLine {
        mirrored: statement.mirrored == Some(true),
        n: statement.answered.as_ref().map_or(0, |s| s.n),
        mean: two(statement.answered.as_ref().map(|s| s.mean)),
        counted: two(statement.counted.as_ref().map(|s| s.mean)),
        sd: two(statement.answered.as_ref().and_then(|s| s.sd)),
        with_rest: two(statement.with_rest),
        alpha_without: two(statement.alpha_without),
        svg: charts::answer_histogram(&statement.counts, steps, &alt),
        title,
    }
}
