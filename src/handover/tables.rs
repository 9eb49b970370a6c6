//! Sessions, measures and events as Parquet: for pandas, DuckDB, R.

use super::identity::session_id;
use crate::report::SessionFile;
use crate::report::cohort::Cohort;
use crate::scenario::Metric;
use crate::tick::TICK_S;
use parquet::basic::Encoding;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;

/// Names of the files. `session_id` joins them.
pub const SESSIONS: &str = "sessions.parquet";
pub const METRICS: &str = "metrics.parquet";
pub const EVENTS: &str = "events.parquet";

/// One line per session; one per session and measure; one per thing that happened, in the order of time.
pub fn all(cohort: &Cohort) -> Result<[(&'static str, Vec<u8>); 3], String> {
    let told = |error: ParquetError| error.to_string();
    Ok([
        (SESSIONS, sessions(cohort).map_err(told)?),
        (METRICS, metrics(cohort).map_err(told)?),
        (EVENTS, events(cohort).map_err(told)?),
    ])
}

/// A column's values; `None` is null.
enum Column {
    Text(Vec<Option<String>>),
    Number(Vec<Option<f64>>),
    Whole(Vec<Option<i64>>),
    Flag(Vec<Option<bool>>),
    /// Microseconds since 1970, UTC.
    Moment(Vec<Option<i64>>),
}

fn sessions(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let all: Vec<(String, &SessionFile)> = cohort
        .sessions
        .iter()
        .map(|(path, s)| (path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()), s))
        .collect();
    let text = |of: &dyn Fn(&SessionFile) -> Option<String>| {
        Column::Text(all.iter().map(|(_, s)| of(s).filter(|t| !t.is_empty())).collect())
    };
    let grade = |of: &dyn Fn(&crate::report::GradeFile) -> f64| {
        Column::Number(all.iter().map(|(_, s)| s.grade.as_ref().map(of)).collect())
    };
    let moment = |s: &SessionFile| s.started.parse::<jiff::Timestamp>().ok().map(|t| t.as_microsecond());
    table(vec![
        ("session_id", text(&|s| Some(session_id(s)))),
        ("bundle", Column::Text(all.iter().map(|(name, _)| Some(name.clone())).collect())),
        ("scenario_id", text(&|s| Some(s.scenario.id.clone()))),
        ("scenario_title", text(&|s| Some(s.scenario.title.clone()))),
        ("scenario_sha256", text(&|s| Some(s.scenario.sha256.clone()))),
        ("participant", text(&|s| Some(s.participant.clone()))),
        ("started_at", Column::Moment(all.iter().map(|(_, s)| moment(s)).collect())),
        ("ended_because", text(&|s| Some(s.ended_because.clone()))),
        ("length_s", Column::Number(all.iter().map(|(_, s)| Some(s.servo.ticks as f64 * TICK_S)).collect())),
        ("operator", text(&|s| s.operator.clone())),
        ("device", text(&|s| s.device.as_ref().map(|d| d.name.clone()))),
        ("typodont_version", text(&|s| Some(s.typodont_version.clone()))),
        ("scorer_version", Column::Whole(all.iter().map(|(_, s)| Some(i64::from(s.scorer_version))).collect())),
        ("points", grade(&|g| g.points)),
        ("max_points", grade(&|g| g.max_points)),
        ("pass_points", grade(&|g| g.pass_points)),
        ("passed", Column::Flag(all.iter().map(|(_, s)| s.grade.as_ref().map(|g| g.passed)).collect())),
        ("hard_fails", text(&|s| s.grade.as_ref().map(|g| g.hard_fails.join("; ")))),
    ])
}

fn metrics(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let (mut ids, mut names, mut units, mut values) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (_, session) in &cohort.sessions {
        let id = session_id(session);
        for (name, value) in &session.metrics {
            ids.push(Some(id.clone()));
            names.push(Some(name.clone()));
            units.push(Metric::parse(name).ok().map(|m| m.about.unit.to_string()));
            values.push(*value);
        }
    }
    table(vec![
        ("session_id", Column::Text(ids)),
        ("metric", Column::Text(names)),
        ("unit", Column::Text(units)),
        ("value", Column::Number(values)),
    ])
}

/// What happened at a moment of a session.
struct Event {
    at_s: Option<f64>,
    what: &'static str,
    name: String,
    text: Option<String>,
    number: Option<f64>,
    right: Option<bool>,
}

fn events(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let all: Vec<(String, Event)> = cohort
        .sessions
        .iter()
        .flat_map(|(_, session)| {
            let id = session_id(session);
            events_of(session).into_iter().map(move |e| (id.clone(), e))
        })
        .collect();
    let text = |of: &dyn Fn(&Event) -> Option<String>| Column::Text(all.iter().map(|(_, e)| of(e)).collect());
    table(vec![
        ("session_id", Column::Text(all.iter().map(|(id, _)| Some(id.clone())).collect())),
        ("at_s", Column::Number(all.iter().map(|(_, e)| e.at_s).collect())),
        ("event", text(&|e| Some(e.what.to_string()))),
        ("name", text(&|e| Some(e.name.clone()))),
        ("text", text(&|e| e.text.clone())),
        ("number", Column::Number(all.iter().map(|(_, e)| e.number).collect())),
        ("right", Column::Flag(all.iter().map(|(_, e)| e.right).collect())),
    ])
}

/// Stages that began and ended, answers, moments that made a measure, and what was rated in the end.
fn events_of(session: &SessionFile) -> Vec<Event> {
    let plain = |at_s, what, name: &str| Event { at_s, what, name: name.into(), text: None, number: None, right: None };
    let mut events = Vec::new();
    for stage in &session.stages {
        events.push(plain(Some(stage.started_s), "stage_began", &stage.id));
        for answer in &stage.answers {
            let text = match &answer.value {
                serde_json::Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            let number = answer.value.as_f64();
            events.push(Event {
                text: Some(text),
                number,
                right: answer.right,
                ..plain(Some(answer.at_s), "answered", &answer.question)
            });
        }
        events
            .push(Event { text: Some(stage.ended_by.clone()), ..plain(Some(stage.ended_s), "stage_ended", &stage.id) });
    }
    for (metric, evidence) in &session.evidence {
        events.push(Event { number: session.metric(metric), ..plain(evidence.at_s, "measured", metric) });
    }
    events.sort_by(|a, b| a.at_s.unwrap_or(f64::INFINITY).total_cmp(&b.at_s.unwrap_or(f64::INFINITY)));
    for item in session.questionnaire.iter().flat_map(|q| &q.items).filter(|i| i.value.is_some()) {
        events.push(Event { number: item.value, ..plain(None, "rated", &item.id) });
    }
    events
}

/// A file of equally long columns, every one of which may hold null.
fn table(columns: Vec<(&str, Column)>) -> Result<Vec<u8>, ParquetError> {
    let kind = |column: &Column| match column {
        Column::Text(_) => ("BYTE_ARRAY", " (STRING)"),
        Column::Number(_) => ("DOUBLE", ""),
        Column::Whole(_) => ("INT64", ""),
        Column::Flag(_) => ("BOOLEAN", ""),
        Column::Moment(_) => ("INT64", " (TIMESTAMP(MICROS,true))"),
    };
    let fields = columns.iter().map(|(name, column)| {
        let (physical, logical) = kind(column);
        format!("OPTIONAL {physical} {name}{logical};")
    });
    let schema = parse_message_type(&format!("message typodont {{ {} }}", fields.collect::<String>()))?;
    let properties = WriterProperties::builder().set_encoding(Encoding::PLAIN).build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, column) in columns {
        match column {
            Column::Text(values) => {
                let values = values.into_iter().map(|v| v.map(|text| ByteArray::from(text.into_bytes())));
                write::<ByteArrayType>(&mut group, values.collect())?;
            }
            Column::Number(values) => write::<DoubleType>(&mut group, values)?,
            Column::Whole(values) | Column::Moment(values) => write::<Int64Type>(&mut group, values)?,
            Column::Flag(values) => write::<BoolType>(&mut group, values)?,
        }
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn write<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>,
    values: Vec<Option<T::T>>,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let present: Vec<T::T> = values.into_iter().flatten().collect();
    let mut column =
        group.next_column()?.ok_or_else(|| ParquetError::General("more columns than the schema has".into()))?;
    column.typed::<T>().write_batch(&present, Some(&levels), None)?;
    column.close()
}
