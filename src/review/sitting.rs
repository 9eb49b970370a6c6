//! One session: what the machine measured and gave, what an examiner gives, and why.

use super::bundle::{self, VIEWS};
use super::desk::{Case, Desk, SHOWN_MAX, Visit};
use super::exchange::Response;
use super::history::{self, Told as HistoryLine};
use super::overrides::Entry;
use super::standing::{Standing, standing};
use crate::report::words;
use crate::report::{GradeFile, ItemFile, Said, SessionFile, harmless, said};
use crate::scenario::Metric;
use crate::score::Verdict;
use serde::Serialize;

/// Letters of what a person wrote at length: an answer, a title within a page.
const LONG_MAX: usize = 1000;

#[derive(Serialize)]
struct Sitting {
    id: String,
    facts: Facts,
    has_report: bool,
    grade: Option<GradeLines>,
    history: Vec<HistoryLine>,
    stages: Vec<StageLine>,
    measures: Vec<MeasureLine>,
    views: Vec<View>,
    legend: Vec<Colour>,
    /// The examiner's name, as last given.
    name: String,
}

/// What is said of a session wherever it is shown.
#[derive(Serialize)]
pub(super) struct Facts {
    pub id: String,
    pub exercise: String,
    pub who: String,
    pub began: String,
    pub length: String,
    pub operator: Option<String>,
    /// Why it ended before its time.
    pub broken_off: Option<String>,
    pub device: Option<String>,
}

#[derive(Serialize)]
struct GradeLines {
    points: String,
    max_points: String,
    pass_points: String,
    passed: bool,
    finished: bool,
    hard_fails: Vec<String>,
    /// What it comes to with an examiner's judgements; the machine's where there are none.
    stands: String,
    stands_passed: bool,
    overrides: usize,
    homeless: usize,
    items: Vec<ItemLine>,
    whole: JudgedLine,
    fails: Vec<FailLine>,
}

#[derive(Serialize)]
struct ItemLine {
    index: usize,
    title: String,
    formula: String,
    value: String,
    place: String,
    full_at: String,
    zero_at: String,
    points: String,
    max_points: String,
    judged: JudgedLine,
}

/// An examiner's judgement, or room for one.
#[derive(Serialize)]
struct JudgedLine {
    stands: bool,
    points: String,
    passed: bool,
    reason: String,
    name: String,
    at: String,
    /// The machine's points then, where they are others now.
    machine_then: Option<String>,
    /// The number of the last line about it, which a form shows to prove that its writer has seen it.
    seen: u64,
    /// What stands in the form to begin with, and the most it may be.
    begin: String,
    most: String,
}

#[derive(Serialize)]
struct FailLine {
    title: String,
    limit: String,
    value: String,
    failed: bool,
}

#[derive(Serialize)]
struct StageLine {
    title: String,
    took: String,
    ended_by: String,
    guided: bool,
    led: Option<String>,
    adjusted: Option<String>,
    answers: Vec<(String, String, String)>,
}

#[derive(Serialize)]
struct MeasureLine {
    title: String,
    formula: String,
    value: String,
    place: String,
}

/// A picture, by the stem of its name.
#[derive(Serialize)]
pub(super) struct View {
    pub stem: String,
    pub title: String,
}

pub fn page(desk: &Desk, visit: &Visit, id: &str) -> Response {
    let Case { told, listed, session } = match desk.case(visit, id) {
        Ok(case) => case,
        Err(response) => return *response,
    };
    let speaker = Speaker { desk, visit, session: &session };
    let has = |name: &str| bundle::file_within(&desk.folder, &listed.path, name).is_ok();
    let views = VIEWS.iter().filter(|view| has(&bundle::picture(&format!("map-{view}"))));
    let body = Sitting {
        id: id.to_string(),
        facts: facts(desk, visit, &listed, &session),
        has_report: !desk.anonymous && has("report.html"),
        grade: session.grade.as_ref().map(|grade| {
            speaker.grade(grade, &standing(grade, id, &told), &|item| {
                told.lines.iter().filter(|l| l.entry.draft.is_of(id, item)).map(|l| l.entry.number).max().unwrap_or(0)
            })
        }),
        history: history::of(told.lines.iter().filter(|l| l.entry.draft.session == id)),
        stages: speaker.stages(),
        measures: speaker.measures(),
        views: views.map(|view| self::view(desk, visit, view)).collect(),
        legend: legend(desk, visit),
        name: harmless(&visit.guest.name, 120),
    };
    desk.page(visit, &told, "session.html", body)
}

pub(super) fn facts(desk: &Desk, visit: &Visit, listed: &super::index::Listed, session: &SessionFile) -> Facts {
    let broken_off = Some(&session.ended_because).filter(|why| !matches!(why.as_str(), "" | "complete"));
    Facts {
        id: listed.id.clone(),
        exercise: harmless(&listed.title, 200),
        who: desk.called(listed),
        began: desk.began(listed),
        length: desk.say(visit, &Said::text("head.length", &[("length", Said::plain(length(session)))])),
        operator: session.operator.as_ref().map(|o| harmless(o, SHOWN_MAX)),
        broken_off: broken_off.map(|why| harmless(why, LONG_MAX)),
        device: session.device.as_ref().map(|d| harmless(&d.name, SHOWN_MAX)),
    }
}

fn length(session: &SessionFile) -> String {
    words::duration(session.servo.ticks as f64 * crate::tick::TICK_S)
}

/// The map of one side.
pub(super) fn view(desk: &Desk, visit: &Visit, view: &str) -> View {
    let side = Said::text(format!("side.{view}"), &[]);
    View { stem: format!("map-{view}"), title: desk.say(visit, &Said::text("picture.map", &[("what", side)])) }
}

/// What a colour of the maps means.
#[derive(Serialize)]
pub(super) struct Colour {
    title: String,
    color: String,
}

pub(super) fn legend(desk: &Desk, visit: &Visit) -> Vec<Colour> {
    let colour = |verdict: &Verdict| {
        let [r, g, b] = verdict.color().map(|c| (c * 255.0).round() as u8);
        let title = desk.say(visit, &Said::word(format!("verdict.{}", verdict.id()), verdict.title()));
        Colour { title, color: format!("#{r:02x}{g:02x}{b:02x}") }
    };
    Verdict::SEEN.iter().map(colour).collect()
}

/// What a measure is called.
pub(super) fn measure_title(name: &str) -> Said {
    Metric::parse(name).map_or_else(|_| Said::plain(harmless(name, SHOWN_MAX)), |metric| said::measure(&metric))
}

/// Says in the visitor's language what a session's numbers mean.
struct Speaker<'a> {
    desk: &'a Desk,
    visit: &'a Visit<'a>,
    session: &'a SessionFile,
}

impl Speaker<'_> {
    fn say(&self, said: &Said) -> String {
        self.desk.say(self.visit, said)
    }

    fn value(&self, metric: &str, value: Option<f64>) -> String {
        self.say(&said::value(metric, value))
    }

    fn place(&self, metric: &str) -> String {
        self.session
            .evidence
            .get(metric)
            .map_or_else(String::new, |e| self.say(&said::place(e, self.session.tooth_fdi)))
    }

    fn grade(&self, grade: &GradeFile, now: &Standing, seen: &dyn Fn(Option<usize>) -> u64) -> GradeLines {
        let items = grade.items.iter().zip(&now.items).enumerate();
        let judged = |entry, machine, item, begin, most| self.judged(entry, machine, seen(item), begin, most);
        GradeLines {
            points: words::number(grade.points),
            max_points: words::plain(grade.max_points),
            pass_points: words::plain(grade.pass_points),
            passed: grade.passed,
            finished: grade.finished,
            hard_fails: grade.hard_fails.iter().map(|title| harmless(title, 200)).collect(),
            stands: words::number(now.points),
            stands_passed: now.passed,
            overrides: now.overrides(),
            homeless: now.homeless,
            items: items
                .map(|(index, (item, entry))| {
                    let judged = judged(*entry, item.points, Some(index), item.points, item.max_points);
                    self.item(index, item, judged)
                })
                .collect(),
            whole: judged(now.whole, grade.points, None, now.points, grade.max_points),
            fails: grade.hard_fail_checks.iter().map(|fail| self.fail(fail)).collect(),
        }
    }

    fn judged(&self, entry: Option<&Entry>, machine: f64, seen: u64, begin: f64, most: f64) -> JudgedLine {
        let given = entry.and_then(|e| e.draft.examiner);
        let then = entry.map(|e| e.draft.machine.points).filter(|then| *then != machine);
        JudgedLine {
            stands: given.is_some(),
            points: given.map_or_else(String::new, |g| words::number(g.points)),
            passed: given.and_then(|g| g.passed).unwrap_or(false),
            reason: entry.map_or_else(String::new, |e| history::lines(&e.draft.reason)),
            name: entry.map_or_else(String::new, |e| harmless(&e.draft.name, SHOWN_MAX)),
            at: entry.map_or_else(String::new, |e| history::when(&e.at)),
            machine_then: then.map(words::number),
            seen,
            begin: words::plain(given.map_or(begin, |g| g.points)),
            most: words::plain(most),
        }
    }

    fn item(&self, index: usize, item: &ItemFile, judged: JudgedLine) -> ItemLine {
        ItemLine {
            index,
            title: harmless(&item.title, 200),
            formula: self.say(&said::formula(&item.metric)),
            value: self.value(&item.metric, item.value),
            place: self.place(&item.metric),
            full_at: self.value(&item.metric, Some(item.full_at)),
            zero_at: self.value(&item.metric, Some(item.zero_at)),
            points: words::number(item.points),
            max_points: words::plain(item.max_points),
            judged,
        }
    }

    fn fail(&self, fail: &crate::report::HardFailFile) -> FailLine {
        FailLine {
            title: harmless(&fail.title, 200),
            limit: self.say(&said::limit(fail)),
            value: self.value(&fail.metric, fail.value),
            failed: fail.failed,
        }
    }

    fn stages(&self) -> Vec<StageLine> {
        let line = |stage: &crate::report::StageFile| StageLine {
            title: harmless(if stage.title.is_empty() { &stage.id } else { &stage.title }, 200),
            took: words::duration(stage.ended_s - stage.started_s),
            ended_by: harmless(&self.say(&said::ended_by(&stage.ended_by)), 200),
            guided: stage.guided,
            led: stage.led_s.map(words::duration),
            adjusted: (!stage.adjusted.is_empty()).then(|| harmless(&stage.adjusted.join(", "), LONG_MAX)),
            answers: stage.answers.iter().map(|answer| self.answer(answer)).collect(),
        };
        self.session.stages.iter().map(line).collect()
    }

    /// Question, answer, and whether it was right.
    fn answer(&self, answer: &crate::report::AnswerFile) -> (String, String, String) {
        let question = if answer.text.is_empty() { &answer.question } else { &answer.text };
        let judgement = said::judgement(answer).map_or_else(String::new, |said| self.say(&said));
        let given = self.say(&said::answer(&answer.value));
        (harmless(question, LONG_MAX), harmless(&given, LONG_MAX), harmless(&judgement, LONG_MAX))
    }

    fn measures(&self) -> Vec<MeasureLine> {
        let line = |(name, value): (&String, &Option<f64>)| MeasureLine {
            title: harmless(&self.say(&measure_title(name)), 200),
            formula: self.say(&said::formula(name)),
            value: self.value(name, *value),
            place: self.place(name),
        };
        self.session.metrics.iter().map(line).collect()
    }
}
