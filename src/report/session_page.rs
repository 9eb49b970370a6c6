//! The page of one session.
//!
//! Takes what was scored, the pictures and the voxels. Gives one file that opens from a disk, without a network: what it shows
//! follows from the recording and the templates alone.

use super::SessionFile;
use super::curves::{self, Mark};
use super::feedback::{self, Feedback, Finding, Moment};
use super::html::Templates;
use super::language::{Languages, Said};
use super::pictures::{Picture, Shows};
use super::said;
use super::voxels::{self, About};
use super::words;
use crate::record::Recording;
use crate::scenario::{Metric, Rubric, Scenario};
use crate::score::{self, Scored, Verdict};
use base64::Engine;
use minijinja::value::Value;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

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
    curves: Value,
    /// A flag on the curves stands for each moment that cost points.
    has_flags: bool,
    /// Key of what is said of the maps.
    maps_about: &'static str,
    is_filling: bool,
    stages: Vec<StageLine>,
    /// The periodontal chart, cheek's side and tongue's.
    chart: Vec<SiteLine>,
    measures: Vec<MeasureLine>,
    questionnaire: Option<QuestionnaireLines>,
    feedback: FeedbackLines,
    languages: Vec<LanguageLine>,
    /// How the page looks, and what it does: they go into it as they are.
    style: Value,
    script: Value,
    shader: Value,
    /// What may run in the page: our script and nothing else.
    policy: Value,
    /// What the script works with, as JSON; and the packed voxels, empty where there is no matter.
    data: Value,
    voxels: Value,
}

#[derive(Serialize)]
struct LanguageLine {
    code: String,
    name: String,
}

#[derive(Serialize)]
struct FeedbackLines {
    findings: Vec<FindingLine>,
    kept: Vec<String>,
}

#[derive(Serialize)]
struct FindingLine {
    title: String,
    metric: String,
    /// Points lost; none for what fails outright.
    lost: Option<String>,
    sentences: Vec<SentenceLine>,
    advice: Option<Value>,
}

#[derive(Serialize)]
struct SentenceLine {
    text: Value,
    /// The number of the moment it speaks of.
    mark: Option<usize>,
}

/// Where and when something arose, for a button that shows it.
#[derive(Serialize)]
struct Spot {
    at: Option<f64>,
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct ItemLine {
    title: String,
    formula: Value,
    value: Value,
    r#where: Value,
    spot: Option<Spot>,
    full_at: Value,
    zero_at: Value,
    points: String,
    max_points: String,
    percent: u32,
}

#[derive(Serialize)]
struct FailLine {
    title: String,
    formula: Value,
    limit: Value,
    value: Value,
    failed: bool,
}

#[derive(Serialize)]
struct MeasureLine {
    name: String,
    title: Value,
    formula: Value,
    value: Value,
    r#where: Value,
    spot: Option<Spot>,
}

#[derive(Serialize)]
struct LegendEntry {
    title: Value,
    color: String,
    ink: &'static str,
    sign: &'static str,
    amount: String,
}

#[derive(Serialize)]
struct Figure {
    /// Names the picture within the page.
    id: String,
    title: Value,
    alt: String,
    data: String,
}

#[derive(Serialize)]
struct StageLine {
    title: String,
    began: String,
    took: String,
    ended_by: Value,
    /// The exercise led the trainee's hand.
    guided: bool,
    /// For how long another person's hand did.
    led: Option<String>,
    /// What the trainee changed of how tissues feel, where anything was.
    adjusted: Option<String>,
    asked: bool,
    answers: Vec<AnswerLine>,
}

#[derive(Serialize)]
struct SiteLine {
    site: String,
    title: Value,
    read: String,
    truth: String,
    difference: String,
    /// Within a millimetre.
    is_right: bool,
    force: String,
    /// What was said of calculus, and whether that is so; none where it was not asked for.
    calculus: Option<Value>,
    is_calculus_right: bool,
}

#[derive(Serialize)]
struct AnswerLine {
    text: String,
    value: Value,
    judgement: Option<Value>,
    after: String,
    level: Option<f64>,
}

/// The page of one session.
pub fn render(
    templates: &Templates,
    recording: &Recording,
    scored: &Scored,
    session: &SessionFile,
    pictures: &[Picture],
) -> Result<String, String> {
    let in_all = Speaker { languages: templates.languages(), session };
    let grade = session.grade.as_ref();
    let figures =
        |shows: fn(&Shows) -> bool| pictures.iter().filter(|p| shows(&p.shows)).map(|p| in_all.figure(p)).collect();
    let lapses = score::lapses(recording, scored);
    let feedback = feedback::of(session, &lapses, templates.rules(), &recording.scenario.tissues);
    let script = templates.script();
    let packed = voxels::pack(scored);
    let data = data(templates, recording, scored, session, &feedback, packed.as_ref().map(|v| &v.about));
    let page = SessionPage {
        session,
        summary: &recording.scenario.summary,
        started: session.started.replace('T', " ").replace('Z', " UTC"),
        length: words::duration(session.servo.ticks as f64 * crate::tick::TICK_S),
        points: grade.map(|g| words::number(g.points)),
        max_points: grade.map(|g| words::plain(g.max_points)),
        pass_points: grade.map(|g| words::plain(g.pass_points)),
        items: grade.map(|g| g.items.iter().map(|i| in_all.item(i)).collect()).unwrap_or_default(),
        fails: grade.map(|g| g.hard_fail_checks.iter().map(|f| in_all.fail(f)).collect()).unwrap_or_default(),
        legend: in_all.legend(scored),
        maps: figures(|s| *s == Shows::Map),
        slices: figures(|s| *s == Shows::MapSlice),
        plain: figures(|s| !matches!(s, Shows::Map | Shows::MapSlice)),
        curves: Value::from_safe_string(drawn(scored, session, &feedback, templates.languages())),
        has_flags: feedback.moments.iter().any(|moment| moment.at.is_some()),
        maps_about: match (&scored.restoration, recording.scenario.stages.iter().any(|stage| stage.cutting)) {
            (Some(_), _) => "maps.filling",
            (None, true) => "maps.about",
            (None, false) => "maps.whole",
        },
        is_filling: scored.restoration.is_some(),
        stages: in_all.stages(recording),
        chart: session.chart.iter().map(|site| in_all.site(site)).collect(),
        measures: in_all.measures(&recording.scenario, scored),
        questionnaire: questionnaire_lines(recording, session),
        feedback: in_all.feedback(&feedback),
        languages: languages(templates),
        style: Value::from_safe_string(templates.part("report.css").into()),
        policy: Value::from_safe_string(policy(&script)),
        script: Value::from_safe_string(script),
        shader: Value::from_safe_string(templates.part("solid.glsl").into()),
        data: Value::from_safe_string(data),
        voxels: Value::from_safe_string(packed.map(|v| v.packed).unwrap_or_default()),
    };
    templates.render_session(&page)
}

/// What a browser lets the page do: show its own pictures, look as it says and run its own script, by digest; nothing from
/// a network, and no script that stands in what a person wrote.
fn policy(script: &str) -> String {
    let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(script));
    format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; \
         base-uri 'none'; form-action 'none'"
    )
}

fn languages(templates: &Templates) -> Vec<LanguageLine> {
    let line = |(code, name): (&str, &str)| LanguageLine { code: code.into(), name: name.into() };
    templates.languages().names().into_iter().map(line).collect()
}

fn drawn(scored: &Scored, session: &SessionFile, feedback: &Feedback, languages: &Languages) -> String {
    let spans: Vec<curves::Span> =
        session.stages.iter().map(|s| curves::Span { title: &s.title, from: s.started_s, to: s.ended_s }).collect();
    let mark = |m: &Moment| Some(Mark { number: m.number, at: m.at?, span: m.span });
    let marks: Vec<Mark> = feedback.moments.iter().filter_map(mark).collect();
    let has_decay = !scored.replay.workpiece.lesions.is_empty();
    curves::svg(&scored.trace, has_decay, &spans, &marks, languages)
}

/// What the page's script works with.
#[derive(Serialize)]
struct PageData<'a> {
    /// Length of the session.
    seconds: f64,
    voxels: Option<&'a About>,
    tissues: Vec<Named>,
    verdicts: Vec<Named>,
    tools: Vec<&'a str>,
    moments: Vec<MomentData>,
    /// Texts of the script by language and key.
    words: BTreeMap<&'a str, BTreeMap<&'a str, &'a str>>,
}

/// A tissue or a verdict by its number in label maps.
#[derive(Serialize)]
struct Named {
    id: u8,
    /// By language.
    title: BTreeMap<String, String>,
    /// Red, green, blue in 0–1.
    color: [f32; 3],
    sign: &'static str,
    /// Decay: what is to be removed while it is there.
    decay: bool,
}

#[derive(Serialize)]
struct MomentData {
    number: usize,
    at: Option<f64>,
    place: [f64; 3],
}

/// The script's data as JSON that can stand in a page: nothing in it ends the element.
fn data(
    templates: &Templates,
    recording: &Recording,
    scored: &Scored,
    session: &SessionFile,
    feedback: &Feedback,
    voxels: Option<&About>,
) -> String {
    let languages = templates.languages();
    let tissue = |t: &crate::content::TissueEntry| Named {
        id: t.id,
        title: languages.each(&Said::word(format!("tissues.{}", t.name), &t.title)),
        color: t.rgb(),
        sign: "",
        decay: t.role == crate::content::Role::Decay,
    };
    let verdict = |v: &Verdict| Named {
        id: *v as u8,
        title: languages.each(&Said::word(format!("verdict.{}", v.id()), v.title())),
        color: v.color(),
        sign: v.sign(),
        decay: false,
    };
    let moment = |m: &Moment| MomentData { number: m.number, at: m.at, place: m.place };
    let data = PageData {
        seconds: session.servo.ticks as f64 * crate::tick::TICK_S,
        voxels,
        tissues: recording.scenario.tissues.entries().iter().map(tissue).collect(),
        verdicts: seen(scored).map(verdict).collect(),
        tools: recording.scenario.instruments.iter().map(|i| i.title.as_str()).collect(),
        moments: feedback.moments.iter().map(moment).collect(),
        words: languages.beginning("script."),
    };
    // Numbers are finite and keys are texts: writing cannot fail.
    serde_json::to_string(&data).unwrap_or_default().replace('<', "\\u003c")
}

/// The verdicts that a session's maps may show.
fn seen(scored: &Scored) -> impl Iterator<Item = &'static Verdict> + use<> {
    let of_fillings: &[Verdict] = if scored.restoration.is_some() { &Verdict::OF_FILLINGS } else { &[] };
    Verdict::SEEN.iter().chain(of_fillings)
}

/// Says in all languages what a session's numbers mean.
struct Speaker<'a> {
    languages: &'a Languages,
    session: &'a SessionFile,
}

impl Speaker<'_> {
    fn html(&self, said: &Said) -> Value {
        self.languages.html(said)
    }

    fn word(&self, key: impl Into<String>, otherwise: &str) -> Value {
        self.html(&Said::word(key, otherwise))
    }

    fn figure(&self, picture: &Picture) -> Figure {
        let data = base64::engine::general_purpose::STANDARD.encode(&picture.png);
        let (when, what) = picture.name.split_once('-').unwrap_or(("", &picture.name));
        let what = Said::text(format!("side.{what}"), &[]);
        Figure {
            id: picture.name.clone(),
            title: self.html(&Said::text(format!("picture.{when}"), &[("what", what)])),
            alt: picture.title.clone(),
            data: format!("data:image/png;base64,{data}"),
        }
    }

    fn value(&self, metric: &str, value: Option<f64>) -> Value {
        self.html(&said::value(metric, value))
    }

    fn formula(&self, metric: &str) -> Value {
        self.html(&said::formula(metric))
    }

    /// Where and when a measure arose, in words.
    fn place(&self, metric: &str) -> Value {
        let tooth = self.session.tooth_fdi;
        self.session.evidence.get(metric).map_or(Value::from(""), |e| self.html(&said::place(e, tooth)))
    }

    fn spot(&self, metric: &str) -> Option<Spot> {
        let evidence = self.session.evidence.get(metric)?;
        let [x, y, z] = evidence.place_mm;
        Some(Spot { at: evidence.at_s, x, y, z })
    }

    fn item(&self, item: &super::ItemFile) -> ItemLine {
        let value = |v: f64| self.value(&item.metric, Some(v));
        ItemLine {
            title: item.title.clone(),
            formula: self.formula(&item.metric),
            value: self.value(&item.metric, item.value),
            r#where: self.place(&item.metric),
            spot: self.spot(&item.metric),
            full_at: value(item.full_at),
            zero_at: value(item.zero_at),
            points: words::number(item.points),
            max_points: words::plain(item.max_points),
            percent: (100.0 * item.points / item.max_points).round().clamp(0.0, 100.0) as u32,
        }
    }

    fn fail(&self, fail: &super::HardFailFile) -> FailLine {
        FailLine {
            title: fail.title.clone(),
            formula: self.formula(&fail.metric),
            limit: self.html(&said::limit(fail)),
            value: self.value(&fail.metric, fail.value),
            failed: fail.failed,
        }
    }

    /// Those that say something, and whatever the rubric asks for.
    fn measures(&self, scenario: &Scenario, scored: &Scored) -> Vec<MeasureLine> {
        let has_target = scenario.has_target();
        let asked: Vec<&Metric> = scenario.rubric.iter().flat_map(Rubric::metrics).collect();
        let is_told = |m: &&score::Measure| has_target || !m.metric.about.is_of_target() || asked.contains(&&m.metric);
        let line = |m: &score::Measure| {
            let name = m.metric.name();
            MeasureLine {
                title: self.html(&said::measure(&m.metric)),
                formula: self.formula(&name),
                value: self.value(&name, m.value),
                r#where: self.place(&name),
                spot: self.spot(&name),
                name,
            }
        };
        scored.measures.all.iter().filter(is_told).map(line).collect()
    }

    /// The signs are a second cue beside the colours.
    fn legend(&self, scored: &Scored) -> Vec<LegendEntry> {
        let voxel = scored.replay.workpiece.volume.grid().voxel_mm3();
        let entry = |verdict: &Verdict| {
            let count = scored.verdicts.iter().filter(|v| *v == verdict).count();
            let [r, g, b] = verdict.color();
            let is_dark = 0.3 * r + 0.59 * g + 0.11 * b < 0.5;
            let [r, g, b] = [r, g, b].map(|c| (c * 255.0).round() as u8);
            LegendEntry {
                title: self.word(format!("verdict.{}", verdict.id()), verdict.title()),
                color: format!("#{r:02x}{g:02x}{b:02x}"),
                ink: if is_dark { "#fff" } else { "#000" },
                sign: verdict.sign(),
                amount: format!("{} mm³", words::number(count as f64 * voxel)),
            }
        };
        seen(scored).filter(|v| scored.verdicts.contains(v)).map(entry).collect()
    }

    fn stages(&self, recording: &Recording) -> Vec<StageLine> {
        let stages = self.session.stages.iter().zip(&recording.scenario.stages);
        let line = |(result, stage): (&super::StageFile, &crate::scenario::Stage)| StageLine {
            title: result.title.clone(),
            began: words::duration(result.started_s),
            took: words::duration(result.ended_s - result.started_s),
            ended_by: self.html(&said::ended_by(&result.ended_by)),
            guided: result.guided,
            led: result.led_s.map(words::duration),
            adjusted: (!result.adjusted.is_empty()).then(|| result.adjusted.join(", ")),
            asked: !stage.ask.is_empty(),
            answers: result.answers.iter().map(|a| self.answer(a, result.started_s)).collect(),
        };
        stages.map(line).collect()
    }

    fn site(&self, site: &super::SiteFile) -> SiteLine {
        let off = site.read_mm.map(|read| f64::from(read) - site.true_mm);
        let none = || "–".to_string();
        let calculus = site.calculus_marked.map(|marked| {
            let key = match (marked, site.calculus) {
                (true, true) => "chart.found",
                (true, false) => "chart.false_alarm",
                (false, true) => "chart.missed",
                (false, false) => "chart.none",
            };
            self.html(&Said::text(key, &[]))
        });
        SiteLine {
            title: self.html(&Said::text(format!("chart.site_{}", site.site.to_lowercase()), &[])),
            site: site.site.clone(),
            read: site.read_mm.map_or_else(none, |mm| mm.to_string()),
            truth: format!("{:.1}", site.true_mm),
            difference: off.map_or_else(none, |mm| format!("{mm:+.1}")),
            is_right: off.is_some_and(|mm| mm.abs() <= 1.0),
            force: site.force_n.map_or_else(none, |force| format!("{force:.2}")),
            is_calculus_right: site.calculus_marked == Some(site.calculus),
            calculus,
        }
    }

    fn answer(&self, answer: &super::AnswerFile, stage_started: f64) -> AnswerLine {
        AnswerLine {
            text: answer.text.clone(),
            value: self.html(&said::answer(&answer.value)),
            judgement: said::judgement(answer).map(|said| self.html(&said)),
            after: words::duration(answer.at_s - stage_started),
            level: answer.level,
        }
    }

    fn feedback(&self, feedback: &Feedback) -> FeedbackLines {
        let sentence = |s: &feedback::Sentence| SentenceLine { text: self.html(&s.said), mark: s.moment };
        let line = |finding: &Finding| FindingLine {
            title: finding.title.clone(),
            metric: finding.metric.clone(),
            lost: finding.lost.map(|points| format!("{points:.1}")),
            sentences: finding.sentences.iter().map(sentence).collect(),
            advice: finding.advice.as_ref().map(|said| self.html(said)),
        };
        FeedbackLines { findings: feedback.findings.iter().map(line).collect(), kept: feedback.kept.clone() }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::language::{escaped, names_in};
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
        let (recording, scored) = crate::report::example();
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
            assert!(page.contains(&format!("<bdi>{}</bdi>", escaped(hostile).replace('/', "&#x2f;"))), "{hostile}");
        }
    }

    #[test]
    fn a_page_asks_nothing_of_a_network() {
        let (recording, scored) = crate::report::example();
        let page = page_of(&recording, &scored);
        assert!(page.contains("default-src 'none'"));
        for outside in ["src=\"http", "href=\"http", "url(http", "@import", "fetch(", "XMLHttpRequest"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn every_language_has_every_text_of_the_page() {
        // Aim: no reader meets a bare key or half a sentence. Method: the shipped languages beside each other, and every key
        // that the page and its script ask for.
        let templates = Templates::shipped();
        let texts = |code: &str| -> BTreeMap<String, String> {
            let path = format!("{}/reports/templates/languages/{code}.json", env!("CARGO_MANIFEST_DIR"));
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
        };
        let (english, turkish) = (texts("en"), texts("tr"));
        for (key, text) in &english {
            let other = turkish.get(key).unwrap_or_else(|| panic!("tr.json lacks {key}"));
            let names = |text| names_in(text).map(str::to_string).collect::<BTreeSet<_>>();
            assert_eq!(names(text), names(other), "{key}");
        }
        let asked = regex_lite::Regex::new(r#"\bt\("([a-z_.]+[a-z_])""#).unwrap();
        let said = regex_lite::Regex::new(r#"'(script\.[a-z_]+)'"#).unwrap();
        let (page, script) = (templates.part("report.html"), templates.script());
        let keys = asked.captures_iter(page).chain(said.captures_iter(&script)).map(|c| c[1].to_string());
        for key in keys {
            assert!(english.contains_key(&key), "en.json lacks {key}");
        }
        for about in crate::scenario::metric::every() {
            for kind in ["measure", "formula"] {
                assert!(turkish.contains_key(&format!("{kind}.{}", about.name)), "tr.json lacks {kind}.{}", about.name);
            }
        }
        assert!(
            Verdict::SEEN
                .iter()
                .chain(&Verdict::OF_FILLINGS)
                .all(|v| turkish.contains_key(&format!("verdict.{}", v.id())))
        );
    }
}
