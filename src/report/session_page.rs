//! The page of one session.
//!
//! Takes the scored recording, the pictures and the voxels. Gives one HTML file that opens from a disk without a
//! network; its contents follow from the recording and the templates alone.

use super::SessionFile;
use super::curves::{self, EventFlag};
use super::display_format;
use super::feedback::{self, Feedback, FeedbackFinding, FeedbackMoment};
use super::first_result::{self, LegendEntry, shown_verdicts};
use super::language::{Languages, Message};
use super::motion::{self, MotionHeader};
use super::phrases;
use super::pictures::{EncodedPicture, ViewKind};
use super::templates::Templates;
use super::voxels::{self, VoxelHeader};
use base64::Engine;
use minijinja::value::Value;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::{Metric, Rubric, Scenario};
use typodont_exercise::score;
use typodont_exercise::score::{Scored, Verdict};

/// Values for the template of a session's page.
#[derive(Serialize)]
struct SessionPage<'a> {
    session: &'a SessionFile,
    title: Value,
    summary: Value,
    /// Titles of the critical errors that failed the exercise.
    failed: Vec<Value>,
    started: String,
    length: String,
    points: Option<String>,
    max_points: Option<String>,
    pass_points: Option<String>,
    items: Vec<ReportItem>,
    fails: Vec<ReportCriticalError>,
    legend: Vec<ReportLegendEntry>,
    maps: Vec<ReportFigure>,
    slices: Vec<ReportFigure>,
    plain: Vec<ReportFigure>,
    curves: Value,
    /// True if the curves have a flag for at least one moment that cost points.
    has_flags: bool,
    /// Language key of the text about the maps.
    maps_about: &'static str,
    is_filling: bool,
    stages: Vec<ReportStage>,
    /// The periodontal chart, buccal and lingual sites.
    chart: Vec<ReportSite>,
    measures: Vec<ReportMeasure>,
    questionnaire: Option<ReportQuestionnaire>,
    feedback: ReportFeedback,
    languages: Vec<ReportLanguage>,
    /// Style sheet, script and shader, which are inserted unescaped.
    style: Value,
    script: Value,
    shader: Value,
    /// Content security policy: only the page's own script may run.
    policy: Value,
    /// Data of the script, as JSON; the packed voxels, empty if there is no matter; and the packed motion of the
    /// instrument, empty if there is no tick.
    data: Value,
    voxels: Value,
    motion: Value,
}

#[derive(Serialize)]
struct ReportLanguage {
    code: String,
    name: String,
}

#[derive(Serialize)]
struct ReportFeedback {
    findings: Vec<ReportFinding>,
    kept: Vec<Value>,
}

#[derive(Serialize)]
struct ReportFinding {
    title: Value,
    metric: String,
    /// Points lost; `None` for a critical error.
    lost: Option<String>,
    sentences: Vec<ReportSentence>,
    advice: Option<Value>,
}

#[derive(Serialize)]
struct ReportSentence {
    text: Value,
    /// Number of the moment to which the sentence refers.
    mark: Option<usize>,
}

/// Place and time of an event, for a button that shows it.
#[derive(Serialize)]
struct ReportPlace {
    at: Option<f64>,
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct ReportItem {
    title: Value,
    formula: Value,
    /// Dependence on another item, in words; empty for an item that counts by itself.
    counts_with: Value,
    value: Value,
    r#where: Value,
    spot: Option<ReportPlace>,
    full_at: Value,
    zero_at: Value,
    points: String,
    max_points: String,
    percent: u32,
}

#[derive(Serialize)]
struct ReportCriticalError {
    title: Value,
    formula: Value,
    limit: Value,
    value: Value,
    failed: bool,
}

#[derive(Serialize)]
struct ReportMeasure {
    name: String,
    title: Value,
    formula: Value,
    value: Value,
    /// False for a measure without a value.
    applies: bool,
    r#where: Value,
    spot: Option<ReportPlace>,
}

#[derive(Serialize)]
struct ReportLegendEntry {
    title: Value,
    color: String,
    ink: &'static str,
    sign: &'static str,
    amount: String,
}

#[derive(Serialize)]
struct ReportFigure {
    /// Identifier of the picture within the page.
    id: String,
    title: Value,
    alt: String,
    data: String,
}

#[derive(Serialize)]
struct ReportStage {
    title: Value,
    began: String,
    took: String,
    ended_by: Value,
    /// True if the exercise guided the trainee's device.
    guided: bool,
    /// Time for which another person's device led the trainee's.
    led: Option<String>,
    /// Haptic coefficients that the trainee changed, if any.
    adjusted: Option<String>,
    asked: bool,
    answers: Vec<ReportAnswer>,
}

#[derive(Serialize)]
struct ReportSite {
    site: String,
    title: Value,
    read: String,
    truth: String,
    difference: String,
    /// True if the reading is within a millimetre of the true depth.
    is_right: bool,
    force: String,
    /// Answer on calculus and whether it is correct; `None` if it was not asked for.
    calculus: Option<Value>,
    is_calculus_right: bool,
}

#[derive(Serialize)]
struct ReportAnswer {
    text: String,
    value: Value,
    judgement: Option<Value>,
    after: String,
    level: Option<f64>,
}

/// Renders the page of one session.
///
/// # Errors
///
/// When the template fails.
pub fn render(
    templates: &Templates,
    recording: &Recording,
    scored: &Scored,
    session: &SessionFile,
    pictures: &[EncodedPicture],
) -> Result<String, String> {
    let localizer = ReportLocalizer { languages: templates.languages(), session, texts: &recording.scenario.texts };
    let grade = session.grade.as_ref();
    let figures_of = |shows: fn(&ViewKind) -> bool| {
        pictures.iter().filter(|p| shows(&p.kind)).map(|p| localizer.figure(p)).collect()
    };
    let feedback = feedback::build(session, &recording.scenario, templates.rules());
    let script = templates.script();
    let packed_voxels = voxels::pack(scored);
    let packed_motion = motion::pack(recording, scored);
    let headers = PackedHeaders {
        voxels: packed_voxels.as_ref().map(|v| &v.header),
        motion: packed_motion.as_ref().map(|m| &m.header),
    };
    let data = script_data(templates, recording, scored, session, &feedback, headers);
    let page = SessionPage {
        session,
        title: localizer.own(&session.scenario.title),
        summary: localizer.own(&recording.scenario.summary),
        failed: grade.map(|g| g.hard_fails.iter().map(|title| localizer.own(title)).collect()).unwrap_or_default(),
        started: session.started.replace('T', " ").replace('Z', " UTC"),
        length: display_format::duration(session.servo.ticks as f64 * typodont_core::tick::TICK_S),
        points: grade.map(|g| display_format::points(g.points, g.pass_points)),
        max_points: grade.map(|g| display_format::plain_number(g.max_points)),
        pass_points: grade.map(|g| display_format::plain_number(g.pass_points)),
        items: grade.map(|g| g.items.iter().map(|i| localizer.item(i)).collect()).unwrap_or_default(),
        fails: grade
            .map(|g| g.hard_fail_checks.iter().map(|f| localizer.critical_error(f)).collect())
            .unwrap_or_default(),
        legend: localizer.legend(scored),
        maps: figures_of(|s| *s == ViewKind::Map),
        slices: figures_of(|s| *s == ViewKind::MapSlice),
        plain: figures_of(|s| !matches!(s, ViewKind::Map | ViewKind::MapSlice)),
        curves: Value::from_safe_string(time_plot(scored, session, &feedback, templates.languages())),
        has_flags: feedback.moments.iter().any(|moment| moment.at.is_some()),
        maps_about: match (&scored.restoration, recording.scenario.stages.iter().any(|stage| stage.cutting)) {
            (Some(_), _) => "maps.filling",
            (None, true) => "maps.about",
            (None, false) => "maps.whole",
        },
        is_filling: scored.restoration.is_some(),
        stages: localizer.stages(recording),
        chart: session.chart.iter().map(|site| localizer.site(site)).collect(),
        measures: localizer.measures(&recording.scenario, scored),
        questionnaire: questionnaire(recording, &localizer),
        feedback: localizer.feedback(&feedback),
        languages: languages(templates),
        style: Value::from_safe_string(templates.session_file("report.css").into()),
        policy: Value::from_safe_string(content_security_policy(&script)),
        script: Value::from_safe_string(script),
        shader: Value::from_safe_string(templates.session_file("solid.glsl").into()),
        data: Value::from_safe_string(data),
        voxels: Value::from_safe_string(packed_voxels.map(|v| v.packed).unwrap_or_default()),
        motion: Value::from_safe_string(packed_motion.map(|m| m.packed).unwrap_or_default()),
    };
    templates.render_session(&page)
}

/// Content security policy of the page: its own pictures, styles and (by digest) its own script are allowed; nothing
/// from a network, and no script within a text that a person wrote.
fn content_security_policy(script: &str) -> String {
    let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(script));
    format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; \
         base-uri 'none'; form-action 'none'"
    )
}

fn languages(templates: &Templates) -> Vec<ReportLanguage> {
    let line = |(code, name): (&str, &str)| ReportLanguage { code: code.into(), name: name.into() };
    templates.languages().names().into_iter().map(line).collect()
}

fn time_plot(scored: &Scored, session: &SessionFile, feedback: &Feedback, languages: &Languages) -> String {
    let spans: Vec<curves::StageSpan> = session
        .stages
        .iter()
        .map(|s| curves::StageSpan { title: &s.title, from: s.started_s, to: s.ended_s })
        .collect();
    let flag_of = |m: &FeedbackMoment| Some(EventFlag { number: m.number, at: m.at?, span: m.span });
    let flags: Vec<EventFlag> = feedback.moments.iter().filter_map(flag_of).collect();
    let has_decay = !scored.replay.workpiece.lesions_in_volume().is_empty();
    curves::svg(&scored.trace, has_decay, &spans, &flags, languages)
}

/// Data of the page's script.
#[derive(Serialize)]
struct ScriptData<'a> {
    /// Length of the session, s.
    seconds: f64,
    #[serde(flatten)]
    headers: PackedHeaders<'a>,
    tissues: Vec<LabelRow>,
    verdicts: Vec<LabelRow>,
    tools: Vec<InstrumentName>,
    moments: Vec<ScriptMoment>,
    /// Texts of the script by language and key.
    words: BTreeMap<&'a str, BTreeMap<&'a str, &'a str>>,
}

/// Descriptions of the packed parts of the page.
#[derive(Serialize)]
struct PackedHeaders<'a> {
    voxels: Option<&'a VoxelHeader>,
    motion: Option<&'a MotionHeader>,
}

/// An instrument of the tray.
#[derive(Serialize)]
struct InstrumentName {
    /// By language.
    title: BTreeMap<String, String>,
}

/// A tissue or a verdict by its number in label maps.
#[derive(Serialize)]
struct LabelRow {
    id: u8,
    /// By language.
    title: BTreeMap<String, String>,
    /// Red, green, blue in 0–1.
    color: [f32; 3],
    sign: &'static str,
    /// True for decay, which is to be removed.
    decay: bool,
}

#[derive(Serialize)]
struct ScriptMoment {
    number: usize,
    at: Option<f64>,
    place: [f64; 3],
}

/// The script's data as JSON that can stand in a page: nothing in it ends the element.
fn script_data(
    templates: &Templates,
    recording: &Recording,
    scored: &Scored,
    session: &SessionFile,
    feedback: &Feedback,
    headers: PackedHeaders,
) -> String {
    let languages = templates.languages();
    let tissue = |t: &typodont_exercise::catalog::TissueEntry| LabelRow {
        id: t.id,
        title: languages.in_each_language(&Message::text_or(format!("tissues.{}", t.name), t.title.to_string())),
        color: t.rgb(),
        sign: "",
        decay: t.role == typodont_exercise::catalog::TissueRole::Decay,
    };
    let verdict = |v: &Verdict| LabelRow {
        id: *v as u8,
        title: languages.in_each_language(&Message::text_or(format!("verdict.{}", v.id()), v.title())),
        color: v.color(),
        sign: v.sign(),
        decay: false,
    };
    let moment = |m: &FeedbackMoment| ScriptMoment { number: m.number, at: m.at, place: m.place };
    let data = ScriptData {
        seconds: session.servo.ticks as f64 * typodont_core::tick::TICK_S,
        headers,
        tissues: recording.scenario.tissues.entries().iter().map(tissue).collect(),
        verdicts: shown_verdicts(scored).map(verdict).collect(),
        tools: recording
            .scenario
            .instruments
            .iter()
            .map(|i| Message::authored(&recording.scenario.texts, &i.title))
            .map(|title| InstrumentName { title: languages.in_each_language(&title) })
            .collect(),
        moments: feedback.moments.iter().map(moment).collect(),
        words: languages.with_prefix("script."),
    };
    // Numbers are finite and keys are texts: writing cannot fail.
    serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c")
}

/// Turns a session's results into texts in all languages.
struct ReportLocalizer<'a> {
    languages: &'a Languages,
    session: &'a SessionFile,
    texts: &'a LocalTexts,
}

impl ReportLocalizer<'_> {
    fn html(&self, message: &Message) -> Value {
        self.languages.html(message)
    }

    /// A text of the exercise, in its author's languages.
    fn own(&self, text: &str) -> Value {
        self.html(&Message::authored(self.texts, text))
    }

    fn figure(&self, picture: &EncodedPicture) -> ReportFigure {
        let data = base64::engine::general_purpose::STANDARD.encode(&picture.png);
        let (when, what) = picture.name.split_once('-').unwrap_or(("", &picture.name));
        let what = phrases::side(what, self.session);
        ReportFigure {
            id: picture.name.clone(),
            title: self.html(&Message::text(format!("picture.{when}"), &[("what", what)])),
            alt: picture.title.clone(),
            data: format!("data:image/png;base64,{data}"),
        }
    }

    fn value(&self, metric: &str, value: Option<f64>) -> Value {
        self.html(&phrases::value_text(display_format::measured(metric, value)))
    }

    fn formula(&self, metric: &str) -> Value {
        self.html(&phrases::formula(metric))
    }

    /// Place and time at which a measure arose, in words.
    fn place(&self, metric: &str) -> Value {
        let evidence = self.session.evidence.get(metric);
        evidence.map_or(Value::from(""), |e| self.html(&phrases::place(e, self.session)))
    }

    fn evidence_place(&self, metric: &str) -> Option<ReportPlace> {
        let evidence = self.session.evidence.get(metric)?;
        let [x, y, z] = evidence.place_mm;
        Some(ReportPlace { at: evidence.at_s, x, y, z })
    }

    fn item(&self, item: &super::ItemResultFile) -> ReportItem {
        let written = |v: f64| self.html(&phrases::written(&item.metric, v));
        ReportItem {
            title: self.own(&item.title),
            formula: self.formula(&item.metric),
            counts_with: self.html(&phrases::counts_with(item, self.session.grade.as_ref(), self.texts)),
            value: self.value(&item.metric, item.value),
            r#where: self.place(&item.metric),
            spot: self.evidence_place(&item.metric),
            full_at: written(item.full_at),
            zero_at: written(item.zero_at),
            points: display_format::item_points(item.points, item.max_points),
            max_points: display_format::plain_number(item.max_points),
            percent: (100.0 * item.points / item.max_points).round().clamp(0.0, 100.0) as u32,
        }
    }

    fn critical_error(&self, fail: &super::CriticalErrorFile) -> ReportCriticalError {
        ReportCriticalError {
            title: self.own(&fail.title),
            formula: self.formula(&fail.metric),
            limit: self.html(&phrases::limit(fail)),
            value: self.value(&fail.metric, fail.value),
            failed: fail.failed,
        }
    }

    /// Measures that apply to the session, and all measures of the rubric.
    fn measures(&self, scenario: &Scenario, scored: &Scored) -> Vec<ReportMeasure> {
        let has_target = scenario.has_target();
        let rubric_metrics: Vec<&Metric> = scenario.rubric.iter().flat_map(Rubric::metrics).collect();
        let is_shown =
            |m: &&score::Measure| has_target || !m.metric.info.is_of_target || rubric_metrics.contains(&&m.metric);
        let zone_title = |id: &str| {
            let zone = scenario.zones.iter().find(|zone| zone.id == id)?;
            Some(Message::authored(&scenario.texts, &zone.title))
        };
        let line = |m: &score::Measure| {
            let name = m.metric.name();
            ReportMeasure {
                title: self.html(&phrases::measure_of_zone(&m.metric, zone_title)),
                formula: self.formula(&name),
                value: self.value(&name, m.value),
                applies: m.value.is_some(),
                r#where: self.place(&name),
                spot: self.evidence_place(&name),
                name,
            }
        };
        scored.measures.all.iter().filter(is_shown).map(line).collect()
    }

    /// The signs are a second cue beside the colours.
    fn legend(&self, scored: &Scored) -> Vec<ReportLegendEntry> {
        let entry = |entry: LegendEntry| {
            let [r, g, b] = entry.color;
            ReportLegendEntry {
                title: self.html(&entry.title),
                color: format!("#{r:02x}{g:02x}{b:02x}"),
                ink: if entry.is_dark { "#fff" } else { "#000" },
                sign: entry.sign,
                amount: format!("{} mm³", display_format::significant(entry.volume, 2)),
            }
        };
        first_result::legend(scored).into_iter().map(entry).collect()
    }

    fn stages(&self, recording: &Recording) -> Vec<ReportStage> {
        let stages = self.session.stages.iter().zip(&recording.scenario.stages);
        let line = |(result, stage): (&super::StageResultFile, &typodont_exercise::scenario::Stage)| ReportStage {
            title: self.own(&result.title),
            began: display_format::duration(result.started_s),
            took: display_format::duration(result.ended_s - result.started_s),
            ended_by: self.html(&phrases::ended_by(&result.ended_by)),
            guided: result.guided,
            led: result.led_s.map(display_format::duration),
            adjusted: (!result.adjusted.is_empty()).then(|| result.adjusted.join(", ")),
            asked: !stage.ask.is_empty(),
            answers: result.answers.iter().map(|a| self.answer(a, result.started_s)).collect(),
        };
        stages.map(line).collect()
    }

    fn site(&self, site: &super::SiteReadingFile) -> ReportSite {
        let deviation = site.read_mm.map(|read| f64::from(read) - site.true_mm);
        let none = || "–".to_string();
        let calculus = site.calculus_marked.map(|marked| {
            let key = match (marked, site.calculus) {
                (true, true) => "chart.found",
                (true, false) => "chart.false_alarm",
                (false, true) => "chart.missed",
                (false, false) => "chart.none",
            };
            self.html(&Message::text(key, &[]))
        });
        ReportSite {
            title: self.html(&Message::text(format!("chart.site_{}", site.site.to_lowercase()), &[])),
            site: site.site.clone(),
            read: site.read_mm.map_or_else(none, |mm| mm.to_string()),
            truth: format!("{:.1}", site.true_mm),
            difference: deviation.map_or_else(none, |mm| format!("{mm:+.1}")),
            is_right: deviation.is_some_and(|mm| mm.abs() <= 1.0),
            force: site.force_n.map_or_else(none, |force| format!("{force:.2}")),
            is_calculus_right: site.calculus_marked == Some(site.calculus),
            calculus,
        }
    }

    fn answer(&self, answer: &super::AnswerResultFile, stage_started: f64) -> ReportAnswer {
        ReportAnswer {
            text: answer.text.clone(),
            value: self.html(&phrases::answer(&answer.value)),
            judgement: phrases::correctness(answer).map(|said| self.html(&said)),
            after: display_format::duration(answer.at_s - stage_started),
            level: answer.level,
        }
    }

    fn feedback(&self, feedback: &Feedback) -> ReportFeedback {
        let sentence = |s: &feedback::FeedbackSentence| ReportSentence { text: self.html(&s.message), mark: s.moment };
        let line = |finding: &FeedbackFinding| ReportFinding {
            title: self.html(&finding.title),
            metric: finding.metric.clone(),
            lost: finding.lost.map(|points| format!("{points:.1}")),
            sentences: finding.sentences.iter().map(sentence).collect(),
            advice: finding.advice.as_ref().map(|said| self.html(said)),
        };
        ReportFeedback {
            findings: feedback.findings.iter().map(line).collect(),
            kept: feedback.full_marks.iter().map(|title| self.html(title)).collect(),
        }
    }
}

#[derive(Serialize)]
struct ReportQuestionnaire {
    title: Value,
    lowest: Value,
    highest: Value,
    steps: u8,
    categories: Vec<ReportCategory>,
}

#[derive(Serialize)]
struct ReportCategory {
    title: Value,
    mean: String,
    /// Not "items": in a template that is a mapping's own method.
    entries: Vec<ReportRating>,
}

#[derive(Serialize)]
struct ReportRating {
    text: Value,
    value: String,
    counted: String,
}

/// The questionnaire with its answers; `None` if nothing was answered.
fn questionnaire(recording: &Recording, localizer: &ReportLocalizer) -> Option<ReportQuestionnaire> {
    let (definition, answers) = (recording.scenario.questionnaire.as_ref()?, localizer.session.questionnaire.as_ref()?);
    answers.items.iter().find(|rating| rating.value.is_some())?;
    let shown = |v: Option<f64>| v.map_or("–".to_string(), display_format::plain_number);
    let categories = definition.categories.iter().map(|category| {
        let items = category.items.iter().filter_map(|item| {
            let rating = answers.items.iter().find(|r| r.id == item.id)?;
            let (value, counted) = (shown(rating.value), shown(rating.counted));
            Some(ReportRating { text: localizer.own(&item.text), value, counted })
        });
        let mean = answers.categories.get(&category.id).copied().flatten();
        ReportCategory {
            title: localizer.own(&category.title),
            mean: mean.map_or("–".to_string(), |m| format!("{m:.2}")),
            entries: items.collect(),
        }
    });
    Some(ReportQuestionnaire {
        title: localizer.own(&definition.title),
        lowest: localizer.own(&definition.lowest),
        highest: localizer.own(&definition.highest),
        steps: definition.steps,
        categories: categories.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{escape_html, placeholders};
    use std::collections::BTreeSet;
    use std::sync::Arc;

    fn page_of(recording: &Recording, scored: &Scored) -> String {
        let session = SessionFile::of(recording, scored);
        render(&Templates::shipped(), recording, scored, &session, &[]).unwrap()
    }

    #[test]
    fn what_a_person_wrote_never_becomes_markup() {
        // Aim: a code, a title or a note does no harm, however hostile, long or foreign. Method: write it everywhere a person
        // can, and look for elements that the page without it does not have.
        let (recording, scored) = crate::example();
        let elements = |page: &str| page.matches("<script").count() + page.matches("</script").count();
        let plain = page_of(&recording, &scored);
        let long = "x".repeat(10_000);
        for hostile in
            ["<script>alert(1)</script>", "</script><img src=x onerror=alert(1)>", long.as_str(), "\u{202e}משתתף \"7\""]
        {
            let mut recording = recording.clone();
            recording.head.participant = hostile.into();
            recording.head.operator = Some(hostile.into());
            if let Some(end) = recording.end.as_mut() {
                end.reason = hostile.into();
            }
            let scenario = Arc::make_mut(&mut recording.scenario);
            (scenario.title, scenario.summary) = (hostile.into(), hostile.into());
            scenario.stages[0].title = hostile.into();
            scenario.instruments[0].title = hostile.into();
            let mut scored = scored.clone();
            let grade = scored.grade.as_mut().unwrap();
            grade.items[0].title = hostile.into();
            grade.hard_fails[0].title = hostile.into();
            let page = page_of(&recording, &scored);
            assert_eq!(elements(&page), elements(&plain), "{hostile}");
            assert!(!page.contains("<img src=x") && !page.contains("<script>alert"), "{hostile}");
            assert!(page.contains(&format!("<bdi>{}</bdi>", escape_html(hostile).replace('/', "&#x2f;"))), "{hostile}");
        }
    }

    #[test]
    fn a_page_asks_nothing_of_a_network() {
        let (recording, scored) = crate::example();
        let page = page_of(&recording, &scored);
        assert!(page.contains("default-src 'none'"));
        for outside in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn every_language_has_every_text_of_the_page() {
        // Aim: no reader meets a bare key or half a sentence. Method: the shipped languages beside each other, and every key
        // that the page and its script, the cohort's page and the gradebook ask for.
        let templates = Templates::shipped();
        let texts = |code: &str| -> BTreeMap<String, String> {
            let path = format!("{}/../../reports/templates/languages/{code}.json", env!("CARGO_MANIFEST_DIR"));
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
        };
        let (english, turkish) = (texts("en"), texts("tr"));
        for (key, text) in &english {
            let other = turkish.get(key).unwrap_or_else(|| panic!("tr.json lacks {key}"));
            let names = |text| placeholders(text).map(str::to_string).collect::<BTreeSet<_>>();
            assert_eq!(names(text), names(other), "{key}");
        }
        let asked = regex_lite::Regex::new(r#"\bt\("([a-z_.]+[a-z_])""#).unwrap();
        let said = regex_lite::Regex::new(r#"'(script\.[a-z_]+)'"#).unwrap();
        let (page, script) = (templates.session_file("report.html"), templates.script());
        let keys = asked.captures_iter(page).chain(said.captures_iter(&script)).map(|c| c[1].to_string());
        for key in keys {
            assert!(english.contains_key(&key), "en.json lacks {key}");
        }
        // The cohort's page and the gradebook: every key asked for, in both languages, and no text that nothing asks for.
        let quoted = regex_lite::Regex::new(r#""((?:cohort|gradebook)\.[a-z_]+)""#).unwrap();
        let users = [
            "reports/templates/cohort.html",
            "reports/templates/trainee.html",
            "src/report/cohort/groups.rs",
            "src/report/cohort/page.rs",
            "src/report/cohort/summary.rs",
            "src/report/cohort/trainee.rs",
            "src/integrations/gradebook.rs",
        ];
        let users = users.map(|path| std::fs::read_to_string(format!("{}/../../{path}", env!("CARGO_MANIFEST_DIR"))));
        let used: BTreeSet<String> = users
            .iter()
            .flat_map(|text| quoted.captures_iter(text.as_ref().unwrap()).map(|c| c[1].to_string()))
            .collect();
        for texts in [&english, &turkish] {
            let keys = texts.keys().filter(|key| key.starts_with("cohort.") || key.starts_with("gradebook."));
            let keys: BTreeSet<String> = keys.map(|key| key.strip_suffix(".one").unwrap_or(key).to_string()).collect();
            assert_eq!(used, keys);
        }
        // The English texts take precedence over the table of measures: both are the same.
        for about in typodont_exercise::scenario::metric::all() {
            for (kind, text) in [("measure", about.title), ("formula", about.formula)] {
                let key = format!("{kind}.{}", about.name);
                assert!(turkish.contains_key(&key), "tr.json lacks {key}");
                assert_eq!(english.get(&key).map(String::as_str), Some(text), "en.json: {key}");
            }
        }
        assert!(
            Verdict::VISIBLE
                .iter()
                .chain(&Verdict::OF_FILLINGS)
                .all(|v| turkish.contains_key(&format!("verdict.{}", v.id())))
        );
    }
}
