//! Two sessions side by side.

use super::bundle::{self, VIEWS};
use super::desk::{Case, Desk, Visit};
use super::exchange::Response;
use super::route::is_id;
use super::sitting::{Colour, Facts, View, facts, legend, measure_title, view};
use super::standing::{Standing, standing};
use crate::report::words;
use crate::report::{ItemFile, Said, SessionFile, harmless, said};
use serde::Serialize;

#[derive(Serialize)]
struct Comparison {
    sides: [Side; 2],
    items: Vec<ItemRow>,
    stages: Vec<Row>,
    measures: Vec<Row>,
    views: Vec<Pair>,
    legend: Vec<Colour>,
    /// They are not of the same exercise.
    differ: bool,
}

#[derive(Serialize)]
struct Side {
    facts: Facts,
    grade: Option<GradeCell>,
}

#[derive(Serialize)]
struct GradeCell {
    points: String,
    max_points: String,
    passed: bool,
    hard_fails: Vec<String>,
    judged: bool,
    stands: String,
    stands_passed: bool,
}

#[derive(Serialize)]
struct ItemRow {
    title: String,
    cells: [Option<ItemCell>; 2],
}

#[derive(Serialize)]
struct ItemCell {
    value: String,
    points: String,
    max_points: String,
    /// The examiner's, where one stands.
    judged: Option<String>,
}

/// What is measured in both, and the second less the first.
#[derive(Serialize)]
struct Row {
    title: String,
    cells: [String; 2],
    more: String,
}

/// A picture of both; whether each has it.
#[derive(Serialize)]
struct Pair {
    view: View,
    has: [bool; 2],
}

pub fn page(desk: &Desk, visit: &Visit) -> Response {
    let asked = visit.request.asked();
    let mut ids: Vec<&str> =
        asked.iter().filter(|(name, id)| name == "session" && is_id(id)).map(|(_, id)| id.as_str()).collect();
    ids.dedup();
    let [first, second] = ids.as_slice() else {
        return desk.complain(visit, 422, &[Said::text("complaint.two", &[])]);
    };
    let cases = desk.case(visit, first).and_then(|a| Ok([a, desk.case(visit, second)?]));
    let cases = match cases {
        Ok(cases) => cases,
        Err(response) => return *response,
    };
    let sessions = [&cases[0].session, &cases[1].session];
    let standings = cases.each_ref().map(|case| {
        let grade = case.session.grade.as_ref()?;
        Some(standing(grade, &case.listed.id, &case.told))
    });
    let pictures = VIEWS.iter().map(|name| {
        let file = bundle::picture(&format!("map-{name}"));
        let has = cases.each_ref().map(|case| bundle::file_within(&desk.folder, &case.listed.path, &file).is_ok());
        Pair { view: view(desk, visit, name), has }
    });
    let body = Comparison {
        sides: [side(desk, visit, &cases[0], &standings[0]), side(desk, visit, &cases[1], &standings[1])],
        items: items(desk, visit, sessions, &standings),
        stages: stages(sessions),
        measures: measures(desk, visit, sessions),
        views: pictures.filter(|pair| pair.has != [false; 2]).collect(),
        legend: legend(desk, visit),
        differ: sessions[0].scenario.id != sessions[1].scenario.id,
    };
    desk.page(visit, &cases[1].told, "compare.html", body)
}

fn side(desk: &Desk, visit: &Visit, case: &Case, now: &Option<Standing>) -> Side {
    let grade = case.session.grade.as_ref().zip(now.as_ref()).map(|(grade, now)| GradeCell {
        points: words::number(grade.points),
        max_points: words::plain(grade.max_points),
        passed: grade.passed,
        hard_fails: grade.hard_fails.iter().map(|title| harmless(title, 200)).collect(),
        judged: now.overrides() > 0,
        stands: words::number(now.points),
        stands_passed: now.passed,
    });
    Side { facts: facts(desk, visit, &case.listed, &case.session), grade }
}

/// Items of both in the first one's order, matched by measure and title; each of a twin pair stands once.
fn items(desk: &Desk, visit: &Visit, sessions: [&SessionFile; 2], standings: &[Option<Standing>; 2]) -> Vec<ItemRow> {
    let of = |side: usize| sessions[side].grade.as_ref().map_or(&[][..], |grade| grade.items.as_slice());
    let cell = |side: usize, index: usize| {
        let item = &of(side)[index];
        let entry = standings[side].as_ref().and_then(|now| now.items[index]);
        ItemCell {
            value: desk.say(visit, &said::value(&item.metric, item.value)),
            points: words::number(item.points),
            max_points: words::plain(item.max_points),
            judged: entry.and_then(|e| e.draft.examiner).map(|judged| words::number(judged.points)),
        }
    };
    let is_like = |a: &ItemFile, b: &ItemFile| a.metric == b.metric && a.title == b.title;
    let mut left: Vec<usize> = (0..of(1).len()).collect();
    let mut rows = Vec::new();
    for (index, item) in of(0).iter().enumerate() {
        let twin = left.iter().position(|other| is_like(item, &of(1)[*other])).map(|place| left.remove(place));
        let cells = [Some(cell(0, index)), twin.map(|other| cell(1, other))];
        rows.push(ItemRow { title: harmless(&item.title, 200), cells });
    }
    rows.extend(left.into_iter().map(|other| {
        let title = harmless(&of(1)[other].title, 200);
        ItemRow { title, cells: [None, Some(cell(1, other))] }
    }));
    rows
}

fn stages(sessions: [&SessionFile; 2]) -> Vec<Row> {
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
        let shown = both.map(|time| time.map_or_else(|| "—".to_string(), words::duration));
        let more = match both {
            [Some(a), Some(b)] => signed(b - a, &words::duration((b - a).abs())),
            _ => String::new(),
        };
        Row { title: harmless(title, 200), cells: shown, more }
    };
    ids.into_iter().map(row).collect()
}

fn measures(desk: &Desk, visit: &Visit, sessions: [&SessionFile; 2]) -> Vec<Row> {
    let mut names: Vec<&String> = sessions.iter().flat_map(|s| s.metrics.keys()).collect();
    names.sort();
    names.dedup();
    let row = |name: &String| {
        let both = sessions.map(|session| session.metric(name));
        let said = both.map(|value| desk.say(visit, &said::value(name, value)));
        // What is right or wrong, yes or no, has no difference.
        let is_word = matches!(name.as_str(), "pulp_exposed" | "detect_tooth" | "detect_quadrant");
        let more = match both {
            [Some(a), Some(b)] if !is_word => signed(b - a, &words::measure(name, Some((b - a).abs()))),
            _ => String::new(),
        };
        Row { title: harmless(&desk.say(visit, &measure_title(name)), 200), cells: said, more }
    };
    // What neither session has is no difference between them.
    names.into_iter().filter(|name| sessions.iter().any(|s| s.metric(name).is_some())).map(row).collect()
}

fn signed(difference: f64, size: &str) -> String {
    match difference {
        d if d > 0.0 => format!("+{size}"),
        d if d < 0.0 => format!("−{size}"),
        _ => "0".into(),
    }
}
