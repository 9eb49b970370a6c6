//! Page of one session: metrics, the scorer's grade, the examiners' overrides and the forms to override.

use super::app::{LoadedSession, RequestContext, ReviewApp, SHOWN_MAX};
use super::blind_page;
use super::bundle::{self, VIEWS};
use super::effective_grade::{EffectiveGrade, EffectiveItem, effective_grade};
use super::history::{self, HistoryRow};
use super::http::Response;
use super::overrides::OverrideEntry;
use super::rating_form::{self, RatingFields, RatingRow};
use super::verification::ShownVerification;
use serde::Serialize;
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::scenario::Metric;
use typodont_exercise::score::Verdict;
use typodont_report::display_format;
use typodont_report::{GradeFile, ItemResultFile, Message, SessionFile, phrases, sanitize_display};

/// Maximum displayed length of longer user-written texts, such as answers, characters.
const LONG_MAX: usize = 1000;

#[derive(Serialize)]
struct ReviewSessionPage {
    id: String,
    facts: SessionFacts,
    has_report: bool,
    grade: Option<ReviewGrade>,
    history: Vec<HistoryRow>,
    stages: Vec<ReviewStage>,
    measures: Vec<ReviewMeasure>,
    views: Vec<MapView>,
    legend: Vec<LegendColour>,
    /// Image of the finished tooth, shown beside the forms.
    after: Option<MapView>,
    rating: RatingFields,
    /// Ratings of all examiners, those that count.
    ratings: Vec<RatingRow>,
    /// Id of the next session to rate, in blind mode.
    next: Option<String>,
    /// Examiner's name as last entered.
    name: String,
}

/// Facts about a session, shown on several pages.
#[derive(Serialize)]
pub(super) struct SessionFacts {
    pub id: String,
    pub exercise: String,
    pub who: String,
    pub began: String,
    pub length: String,
    pub operator: Option<String>,
    /// Number of interruptions after which the session went on.
    pub resumed: usize,
    /// Reason for which the session ended early.
    pub broken_off: Option<String>,
    pub device: Option<String>,
    pub verification: ShownVerification,
    /// Id and participant of the other sessions with the same recording.
    pub same_recording: Vec<(String, String)>,
}

#[derive(Serialize)]
struct ReviewGrade {
    points: String,
    max_points: String,
    pass_points: String,
    passed: bool,
    finished: bool,
    hard_fails: Vec<String>,
    /// Effective points after overrides; the scorer's without overrides.
    stands: String,
    stands_passed: bool,
    overrides: usize,
    homeless: usize,
    items: Vec<ReviewItem>,
    whole: ReviewOverride,
    fails: Vec<ReviewCriticalError>,
}

#[derive(Serialize)]
struct ReviewItem {
    index: usize,
    title: String,
    formula: String,
    counts_with: String,
    value: String,
    place: String,
    full_at: String,
    zero_at: String,
    points: String,
    max_points: String,
    judged: ReviewOverride,
    /// Points that follow from the override of the item on which this one depends, and the reason; `None` otherwise.
    followed: Option<FollowedPoints>,
}

/// Points of an item that follow from the override of another one.
#[derive(Serialize)]
struct FollowedPoints {
    points: String,
    reason: String,
}

/// Override of an item or of the whole grade, if there is one, and the initial values of its form.
#[derive(Serialize)]
struct ReviewOverride {
    stands: bool,
    points: String,
    passed: bool,
    reason: String,
    name: String,
    at: String,
    /// The scorer's points at the time of the override, if they differ from the current ones.
    machine_then: Option<String>,
    /// Number of the last log line about this item. The form sends it back, so that overrides made since are
    /// detected.
    seen: u64,
    /// Initial and maximum points in the form.
    begin: String,
    most: String,
}

#[derive(Serialize)]
struct ReviewCriticalError {
    title: String,
    limit: String,
    value: String,
    failed: bool,
}

#[derive(Serialize)]
struct ReviewStage {
    title: String,
    took: String,
    ended_by: String,
    guided: bool,
    led: Option<String>,
    adjusted: Option<String>,
    answers: Vec<(String, String, String)>,
}

#[derive(Serialize)]
struct ReviewMeasure {
    title: String,
    formula: String,
    value: String,
    place: String,
}

/// Image of a view, by file stem.
#[derive(Serialize)]
pub(super) struct MapView {
    pub stem: String,
    pub title: String,
}

pub fn page(app: &ReviewApp, context: &RequestContext, id: &str) -> Response {
    let LoadedSession { log, ratings, indexed, session } = match app.load_session(context, id) {
        Ok(case) => case,
        Err(response) => return *response,
    };
    if !app.may_see_marks(context, &ratings, id) {
        return blind_page::page(app, context, &log, &indexed, &session);
    }
    let localizer = ReviewLocalizer { app, context, session: &session };
    let has = |name: &str| bundle::file_within(&app.folder, &indexed.path, name).is_ok();
    let views = VIEWS.iter().filter(|view| has(&bundle::picture_path(&format!("map-{view}"))));
    let body = ReviewSessionPage {
        id: id.to_string(),
        facts: facts(app, context, &indexed, &session),
        has_report: !app.anonymous && has("report.html"),
        grade: session.grade.as_ref().map(|grade| {
            localizer.grade(grade, &effective_grade(grade, id, &log), &|item| {
                log.lines.iter().filter(|l| l.entry.draft.concerns(id, item)).map(|l| l.entry.number).max().unwrap_or(0)
            })
        }),
        history: history::rows(log.lines.iter().filter(|l| l.entry.draft.session == id)),
        stages: localizer.stages(),
        measures: localizer.measures(),
        views: views.map(|view| self::map_view(app, context, view)).collect(),
        legend: legend(app, context),
        after: after_view(app, context, &has),
        rating: rating_form::fields(app, context, session.grade.as_ref()),
        ratings: ratings.counting(id).into_iter().map(rating_form::row).collect(),
        next: app.blind.then(|| blind_page::next_unrated(app, context)).flatten(),
        name: sanitize_display(&context.login.display_name, 120),
    };
    app.page(context, &log, "session.html", body)
}

pub(super) fn facts(
    app: &ReviewApp,
    context: &RequestContext,
    indexed: &super::index::IndexedSession,
    session: &SessionFile,
) -> SessionFacts {
    let same = app.state().index.same_recording(indexed).unwrap_or_default();
    let broken_off = Some(&session.ended_because).filter(|why| !matches!(why.as_str(), "" | "complete"));
    SessionFacts {
        id: indexed.id.clone(),
        exercise: sanitize_display(&indexed.title, 200),
        who: app.display_name(indexed),
        began: app.display_start(indexed),
        length: app.translate(context, &Message::text("head.length", &[("length", Message::plain(length(session)))])),
        operator: session.operator.as_ref().map(|o| sanitize_display(o, SHOWN_MAX)),
        resumed: session.resumed.len(),
        broken_off: broken_off.map(|why| sanitize_display(why, LONG_MAX)),
        device: session.device.as_ref().map(|d| sanitize_display(&d.name, SHOWN_MAX)),
        verification: ShownVerification::of(&app.verification(indexed)),
        same_recording: same.into_iter().map(|other| (other.id.clone(), app.display_name(&other))).collect(),
    }
}

fn length(session: &SessionFile) -> String {
    display_format::duration(session.servo.ticks as f64 * typodont_core::tick::TICK_S)
}

/// Returns the removal map of a view.
pub(super) fn map_view(app: &ReviewApp, context: &RequestContext, view: &str) -> MapView {
    picture_view(app, context, "map", view)
}

/// Returns the first view of which the bundle has an image of the finished tooth.
fn after_view(app: &ReviewApp, context: &RequestContext, has: &dyn Fn(&str) -> bool) -> Option<MapView> {
    let view = VIEWS.iter().find(|view| has(&bundle::picture_path(&format!("after-{view}"))))?;
    Some(picture_view(app, context, "after", view))
}

/// Returns an image of a view; `moment` is `before`, `after` or `map`.
pub(super) fn picture_view(app: &ReviewApp, context: &RequestContext, moment: &str, view: &str) -> MapView {
    let side = Message::text(format!("side.{view}"), &[]);
    MapView {
        stem: format!("{moment}-{view}"),
        title: app.translate(context, &Message::text(format!("picture.{moment}"), &[("what", side)])),
    }
}

/// Colour of the maps and its meaning.
#[derive(Serialize)]
pub(super) struct LegendColour {
    title: String,
    color: String,
}

pub(super) fn legend(app: &ReviewApp, context: &RequestContext) -> Vec<LegendColour> {
    let colour = |verdict: &Verdict| {
        let [r, g, b] = verdict.color().map(|c| (c * 255.0).round() as u8);
        let title = app.translate(context, &Message::text_or(format!("verdict.{}", verdict.id()), verdict.title()));
        LegendColour { title, color: format!("#{r:02x}{g:02x}{b:02x}") }
    };
    Verdict::VISIBLE.iter().map(colour).collect()
}

/// Returns the title of a metric.
pub(super) fn measure_title(name: &str) -> Message {
    Metric::parse(name)
        .map_or_else(|_| Message::plain(sanitize_display(name, SHOWN_MAX)), |metric| phrases::measure(&metric))
}

/// Formats a session's values in the language of the request.
struct ReviewLocalizer<'a> {
    app: &'a ReviewApp,
    context: &'a RequestContext<'a>,
    session: &'a SessionFile,
}

impl ReviewLocalizer<'_> {
    fn translate(&self, message: &Message) -> String {
        self.app.translate(self.context, message)
    }

    fn value(&self, metric: &str, value: Option<f64>) -> String {
        self.translate(&phrases::value(metric, value))
    }

    fn place(&self, metric: &str) -> String {
        self.session.evidence.get(metric).map_or_else(String::new, |e| self.translate(&phrases::place(e, self.session)))
    }

    fn grade(
        &self,
        grade: &GradeFile,
        effective: &EffectiveGrade,
        last_line: &dyn Fn(Option<usize>) -> u64,
    ) -> ReviewGrade {
        let items = grade.items.iter().zip(&effective.items).enumerate();
        let judged = |entry, machine, item, begin, most| self.override_of(entry, machine, last_line(item), begin, most);
        ReviewGrade {
            points: display_format::number(grade.points),
            max_points: display_format::plain_number(grade.max_points),
            pass_points: display_format::plain_number(grade.pass_points),
            passed: grade.passed,
            finished: grade.finished,
            hard_fails: grade.hard_fails.iter().map(|title| sanitize_display(title, 200)).collect(),
            stands: display_format::number(effective.points),
            stands_passed: effective.passed,
            overrides: effective.overrides(),
            homeless: effective.orphaned,
            items: items
                .map(|(index, (item, now))| {
                    let judged = judged(now.judged, item.points, Some(index), now.points, item.max_points);
                    self.item(index, item, judged, self.followed(grade, item, now))
                })
                .collect(),
            whole: judged(effective.whole, grade.points, None, effective.points, grade.max_points),
            fails: grade.hard_fail_checks.iter().map(|fail| self.critical_error(fail)).collect(),
        }
    }

    fn override_of(
        &self,
        entry: Option<&OverrideEntry>,
        machine: f64,
        last_line: u64,
        initial_points: f64,
        max_points: f64,
    ) -> ReviewOverride {
        let given = entry.and_then(|e| e.draft.examiner);
        let then = entry.map(|e| e.draft.machine.points).filter(|then| *then != machine);
        ReviewOverride {
            stands: given.is_some(),
            points: given.map_or_else(String::new, |g| display_format::number(g.points)),
            passed: given.and_then(|g| g.passed).unwrap_or(false),
            reason: entry.map_or_else(String::new, |e| history::sanitize_lines(&e.draft.reason)),
            name: entry.map_or_else(String::new, |e| sanitize_display(&e.draft.name, SHOWN_MAX)),
            at: entry.map_or_else(String::new, |e| history::format_time(&e.at)),
            machine_then: then.map(display_format::number),
            seen: last_line,
            begin: display_format::plain_number(given.map_or(initial_points, |g| g.points)),
            most: display_format::plain_number(max_points),
        }
    }

    /// Returns the points of an item that follow from the override of another one.
    fn followed(&self, grade: &GradeFile, item: &ItemResultFile, now: &EffectiveItem) -> Option<FollowedPoints> {
        let share = now.followed_share?;
        let reason = phrases::followed_share(item, share, Some(grade), &LocalTexts::default());
        Some(FollowedPoints { points: display_format::number(now.points), reason: self.translate(&reason) })
    }

    fn item(
        &self,
        index: usize,
        item: &ItemResultFile,
        judged: ReviewOverride,
        followed: Option<FollowedPoints>,
    ) -> ReviewItem {
        ReviewItem {
            index,
            title: sanitize_display(&item.title, 200),
            formula: self.translate(&phrases::formula(&item.metric)),
            counts_with: self.translate(&phrases::counts_with(
                item,
                self.session.grade.as_ref(),
                &LocalTexts::default(),
            )),
            value: self.value(&item.metric, item.value),
            place: self.place(&item.metric),
            full_at: self.value(&item.metric, Some(item.full_at)),
            zero_at: self.value(&item.metric, Some(item.zero_at)),
            points: display_format::item_points(item.points, item.max_points),
            max_points: display_format::plain_number(item.max_points),
            judged,
            followed,
        }
    }

    fn critical_error(&self, fail: &typodont_report::CriticalErrorFile) -> ReviewCriticalError {
        ReviewCriticalError {
            title: sanitize_display(&fail.title, 200),
            limit: self.translate(&phrases::limit(fail)),
            value: self.value(&fail.metric, fail.value),
            failed: fail.failed,
        }
    }

    fn stages(&self) -> Vec<ReviewStage> {
        let line = |stage: &typodont_report::StageResultFile| ReviewStage {
            title: sanitize_display(if stage.title.is_empty() { &stage.id } else { &stage.title }, 200),
            took: display_format::duration(stage.ended_s - stage.started_s),
            ended_by: sanitize_display(&self.translate(&phrases::ended_by(&stage.ended_by)), 200),
            guided: stage.guided,
            led: stage.led_s.map(display_format::duration),
            adjusted: (!stage.adjusted.is_empty()).then(|| sanitize_display(&stage.adjusted.join(", "), LONG_MAX)),
            answers: stage.answers.iter().map(|answer| self.answer(answer)).collect(),
        };
        self.session.stages.iter().map(line).collect()
    }

    /// Returns question, answer, and whether the answer is correct.
    fn answer(&self, answer: &typodont_report::AnswerResultFile) -> (String, String, String) {
        let question = if answer.text.is_empty() { &answer.question } else { &answer.text };
        let judgement = phrases::correctness(answer).map_or_else(String::new, |said| self.translate(&said));
        let given = self.translate(&phrases::answer(&answer.value));
        (
            sanitize_display(question, LONG_MAX),
            sanitize_display(&given, LONG_MAX),
            sanitize_display(&judgement, LONG_MAX),
        )
    }

    fn measures(&self) -> Vec<ReviewMeasure> {
        let line = |(name, value): (&String, &Option<f64>)| ReviewMeasure {
            title: sanitize_display(&self.translate(&measure_title(name)), 200),
            formula: self.translate(&phrases::formula(name)),
            value: self.value(name, *value),
            place: self.place(name),
        };
        self.session.metrics.iter().map(line).collect()
    }
}
