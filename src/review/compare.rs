//! Page that compares two sessions side by side.

use super::app::{LoadedSession, RequestContext, ReviewApp};
use super::bundle::{self, VIEWS};
use super::effective_grade::{EffectiveGrade, EffectiveItem, effective_grade};
use super::http::Response;
use super::router::is_session_id;
use super::session_page::{LegendColour, MapView, SessionFacts, facts, legend, map_view, measure_title};
use serde::Serialize;
use typodont_report::display_format;
use typodont_report::{ItemResultFile, Message, SessionFile, phrases, sanitize_display};

#[derive(Serialize)]
struct ComparePage {
    sides: [ComparedSession; 2],
    items: Vec<ComparedItemRow>,
    stages: Vec<ComparedRow>,
    measures: Vec<ComparedRow>,
    views: Vec<ComparedView>,
    legend: Vec<LegendColour>,
    /// True if the sessions are of different exercises.
    differ: bool,
    /// Warning that the teeth differ; empty if they are the same.
    teeth: String,
    /// Warning that the voxel sizes differ; empty if they are the same.
    voxels: String,
    /// Second less first of the automatic points, and of the effective points if anything is overridden.
    more: String,
    more_judged: String,
}

#[derive(Serialize)]
struct ComparedSession {
    facts: SessionFacts,
    grade: Option<ComparedGrade>,
}

#[derive(Serialize)]
struct ComparedGrade {
    points: String,
    max_points: String,
    passed: bool,
    hard_fails: Vec<String>,
    judged: bool,
    stands: String,
    stands_passed: bool,
}

#[derive(Serialize)]
struct ComparedItemRow {
    title: String,
    cells: [Option<ComparedItemCell>; 2],
    /// Second less first of the effective points; empty if one of the sessions has no such item.
    more: String,
}

#[derive(Serialize)]
struct ComparedItemCell {
    value: String,
    points: String,
    max_points: String,
    /// Examiner's points, if the item is overridden.
    judged: Option<String>,
}

/// Row of values of both sessions, with the second minus the first in `more`.
#[derive(Serialize)]
struct ComparedRow {
    title: String,
    cells: [String; 2],
    more: String,
}

/// View of the tooth, and whether each session has an image of it.
#[derive(Serialize)]
struct ComparedView {
    view: MapView,
    has: [bool; 2],
}

pub fn page(app: &ReviewApp, context: &RequestContext) -> Response {
    let query = context.request.query_pairs();
    let mut ids: Vec<&str> =
        query.iter().filter(|(name, id)| name == "session" && is_session_id(id)).map(|(_, id)| id.as_str()).collect();
    ids.dedup();
    let [first, second] = ids.as_slice() else {
        return app.error_page(context, 422, &[Message::text("complaint.two", &[])]);
    };
    let cases = app.load_session(context, first).and_then(|a| Ok([a, app.load_session(context, second)?]));
    let cases = match cases {
        Ok(cases) => cases,
        Err(response) => return *response,
    };
    if !cases.iter().all(|case| app.may_see_marks(context, &case.ratings, &case.indexed.id)) {
        return app.error_page(context, 403, &[Message::text("complaint.rate_both", &[])]);
    }
    let sessions = [&cases[0].session, &cases[1].session];
    let effective_grades = cases.each_ref().map(|case| {
        let grade = case.session.grade.as_ref()?;
        Some(effective_grade(grade, &case.indexed.id, &case.log))
    });
    let pictures = VIEWS.iter().map(|name| {
        let file = bundle::picture_path(&format!("map-{name}"));
        let has = cases.each_ref().map(|case| bundle::file_within(&app.folder, &case.indexed.path, &file).is_ok());
        ComparedView { view: map_view(app, context, name), has }
    });
    let body = ComparePage {
        sides: [
            side(app, context, &cases[0], &effective_grades[0]),
            side(app, context, &cases[1], &effective_grades[1]),
        ],
        items: items(app, context, sessions, &effective_grades),
        stages: stages(sessions),
        measures: measures(app, context, sessions),
        views: pictures.filter(|pair| pair.has != [false; 2]).collect(),
        legend: legend(app, context),
        differ: sessions[0].scenario.id != sessions[1].scenario.id,
        teeth: teeth(app, context, &cases),
        voxels: voxels(app, context, &cases),
        more: grade_difference(sessions.map(|session| Some(session.grade.as_ref()?.points))),
        more_judged: match effective_grades.iter().flatten().any(|grade| grade.overrides() > 0) {
            true => grade_difference(effective_grades.each_ref().map(|grade| Some(grade.as_ref()?.points))),
            false => String::new(),
        },
    };
    app.page(context, &cases[1].log, "compare.html", body)
}

fn side(
    app: &ReviewApp,
    context: &RequestContext,
    case: &LoadedSession,
    effective: &Option<EffectiveGrade>,
) -> ComparedSession {
    let grade = case.session.grade.as_ref().zip(effective.as_ref()).map(|(grade, now)| ComparedGrade {
        points: display_format::number(grade.points),
        max_points: display_format::plain_number(grade.max_points),
        passed: grade.passed,
        hard_fails: grade.hard_fails.iter().map(|title| sanitize_display(title, 200)).collect(),
        judged: now.overrides() > 0,
        stands: display_format::number(now.points),
        stands_passed: now.passed,
    });
    ComparedSession { facts: facts(app, context, &case.indexed, &case.session), grade }
}

/// Builds the rows of rubric items: those of the first session in its order, matched to the second's by metric and
/// title, then the second's unmatched items.
fn items(
    app: &ReviewApp,
    context: &RequestContext,
    sessions: [&SessionFile; 2],
    effective_grades: &[Option<EffectiveGrade>; 2],
) -> Vec<ComparedItemRow> {
    let of = |side: usize| sessions[side].grade.as_ref().map_or(&[][..], |grade| grade.items.as_slice());
    let cell = |side: usize, index: usize| {
        let item = &of(side)[index];
        let now = effective_grades[side].as_ref().map(|now| now.items[index]);
        let is_judged = |now: &EffectiveItem| now.judged.is_some() || now.followed_share.is_some();
        ComparedItemCell {
            value: app.translate(context, &phrases::value(&item.metric, item.value)),
            points: display_format::item_points(item.points, item.max_points),
            max_points: display_format::plain_number(item.max_points),
            judged: now.filter(is_judged).map(|now| display_format::number(now.points)),
        }
    };
    let points = |side: usize, index: usize| {
        effective_grades[side].as_ref().map_or(of(side)[index].points, |now| now.items[index].points)
    };
    let is_like = |a: &ItemResultFile, b: &ItemResultFile| a.metric == b.metric && a.title == b.title;
    let mut unmatched: Vec<usize> = (0..of(1).len()).collect();
    let mut rows = Vec::new();
    for (index, item) in of(0).iter().enumerate() {
        let match_index =
            unmatched.iter().position(|other| is_like(item, &of(1)[*other])).map(|place| unmatched.remove(place));
        let cells = [Some(cell(0, index)), match_index.map(|other| cell(1, other))];
        let more = match_index
            .map_or_else(String::new, |other| grade_difference([Some(points(0, index)), Some(points(1, other))]));
        rows.push(ComparedItemRow { title: sanitize_display(&item.title, 200), cells, more });
    }
    rows.extend(unmatched.into_iter().map(|other| {
        let title = sanitize_display(&of(1)[other].title, 200);
        ComparedItemRow { title, cells: [None, Some(cell(1, other))], more: String::new() }
    }));
    rows
}

/// Formats the difference of two numbers of points; empty if one is missing.
fn grade_difference(points: [Option<f64>; 2]) -> String {
    match points {
        [Some(first), Some(second)] => signed(second - first, &display_format::number((second - first).abs())),
        _ => String::new(),
    }
}

/// Returns a warning if the sessions began with different teeth: other numbers, or other volumes.
fn teeth(app: &ReviewApp, context: &RequestContext, cases: &[LoadedSession; 2]) -> String {
    let numbers = cases.each_ref().map(|case| case.session.tooth_fdi);
    let volumes = cases.each_ref().map(|case| case.session.digests.get(bundle::INITIAL_VOLUME));
    match (numbers, volumes) {
        ([Some(first), Some(second)], _) if first != second => {
            let numbers = [("first", first), ("second", second)].map(|(name, n)| (name, Message::plain(n.to_string())));
            app.translate(context, &Message::text("compare.teeth", &numbers))
        }
        (_, [Some(first), Some(second)]) if first != second => {
            app.translate(context, &Message::text("compare.volumes", &[]))
        }
        _ => String::new(),
    }
}

/// Returns a warning if the voxels of the sessions differ in size.
fn voxels(app: &ReviewApp, context: &RequestContext, cases: &[LoadedSession; 2]) -> String {
    match cases.each_ref().map(|case| bundle::voxel_size(&app.folder, &case.indexed.path)) {
        [Some(first), Some(second)] if (first - second).abs() > 1e-6 => {
            let sizes = [("first", first), ("second", second)]
                .map(|(name, size)| (name, Message::plain(display_format::plain_number(size))));
            app.translate(context, &Message::text("compare.voxels", &sizes))
        }
        _ => String::new(),
    }
}

fn stages(sessions: [&SessionFile; 2]) -> Vec<ComparedRow> {
    let took = |session: &SessionFile, id: &str| {
        session.stages.iter().find(|stage| stage.id == id).map(|stage| stage.ended_s - stage.started_s)
    };
    let mut ids: Vec<(&str, &str)> = Vec::new();
    for stage in sessions.iter().flat_map(|s| &s.stages) {
        if ids.iter().all(|(id, _)| *id != stage.id) {
            let title = if stage.title.is_empty() { &stage.id } else { &stage.title };
            ids.push((stage.id.as_str(), title.as_str()));
        }
    }
    let row = |(id, title): (&str, &str)| {
        let both = sessions.map(|session| took(session, id));
        let shown = both.map(|time| time.map_or_else(|| "—".to_string(), display_format::duration));
        let more = match both {
            [Some(a), Some(b)] => signed(b - a, &display_format::duration((b - a).abs())),
            _ => String::new(),
        };
        ComparedRow { title: sanitize_display(title, 200), cells: shown, more }
    };
    ids.into_iter().map(row).collect()
}

fn measures(app: &ReviewApp, context: &RequestContext, sessions: [&SessionFile; 2]) -> Vec<ComparedRow> {
    let mut names: Vec<&String> = sessions.iter().flat_map(|s| s.metrics.keys()).collect();
    names.sort();
    names.dedup();
    let row = |name: &String| {
        let both = sessions.map(|session| session.metric(name));
        let texts = both.map(|value| app.translate(context, &phrases::value(name, value)));
        // Metrics with a yes/no value have no difference.
        let is_word = matches!(name.as_str(), "pulp_exposed" | "detect_tooth" | "detect_quadrant");
        let more = match both {
            [Some(a), Some(b)] if !is_word => signed(b - a, &display_format::measure(name, Some((b - a).abs()))),
            _ => String::new(),
        };
        ComparedRow { title: sanitize_display(&app.translate(context, &measure_title(name)), 200), cells: texts, more }
    };
    // Metrics that neither session has are omitted.
    names.into_iter().filter(|name| sessions.iter().any(|s| s.metric(name).is_some())).map(row).collect()
}

/// Puts the sign of a difference before its formatted magnitude.
fn signed(difference: f64, size: &str) -> String {
    match difference {
        d if d > 0.0 => format!("+{size}"),
        d if d < 0.0 => format!("−{size}"),
        _ => "0".into(),
    }
}
