//! Parquet tables of sessions, metrics and events, for pandas, DuckDB and R.

use super::identity::session_id;
use parquet::basic::Encoding;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use std::sync::Arc;
use typodont_core::tick::TICK_S;
use typodont_exercise::scenario::Metric;
use typodont_report::SessionFile;
use typodont_report::cohort::Cohort;

/// File names of the tables, which are joined by the column `session_id`.
pub const SESSIONS: &str = "sessions.parquet";
pub const METRICS: &str = "metrics.parquet";
pub const EVENTS: &str = "events.parquet";

/// Encodes the three tables of a cohort, as file name and contents: one row per session; one per session and metric;
/// one per event, in chronological order.
///
/// # Errors
///
/// Returns a message when the Parquet writer fails.
pub fn all_tables(cohort: &Cohort) -> Result<[(&'static str, Vec<u8>); 3], String> {
    let to_message = |error: ParquetError| error.to_string();
    Ok([
        (SESSIONS, sessions(cohort).map_err(to_message)?),
        (METRICS, metrics(cohort).map_err(to_message)?),
        (EVENTS, events(cohort).map_err(to_message)?),
    ])
}

/// Values of one column; `None` is null.
enum ParquetColumn {
    Text(Vec<Option<String>>),
    Number(Vec<Option<f64>>),
    Integer(Vec<Option<i64>>),
    Boolean(Vec<Option<bool>>),
    /// Microseconds since 1970-01-01, UTC.
    Timestamp(Vec<Option<i64>>),
}

fn sessions(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let all: Vec<(String, &SessionFile)> = cohort
        .sessions
        .iter()
        .map(|(path, s)| (path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()), s))
        .collect();
    let statuses = cohort.sessions.iter().map(|(path, _)| cohort.status(path));
    let text = |of: &dyn Fn(&SessionFile) -> Option<String>| {
        ParquetColumn::Text(all.iter().map(|(_, s)| of(s).filter(|t| !t.is_empty())).collect())
    };
    let grade = |of: &dyn Fn(&typodont_report::GradeFile) -> f64| {
        ParquetColumn::Number(all.iter().map(|(_, s)| s.grade.as_ref().map(of)).collect())
    };
    let moment = |s: &SessionFile| s.started.parse::<jiff::Timestamp>().ok().map(|t| t.as_microsecond());
    encode_table(vec![
        ("session_id", text(&|s| Some(session_id(s)))),
        ("bundle", ParquetColumn::Text(all.iter().map(|(name, _)| Some(name.clone())).collect())),
        ("scenario_id", text(&|s| Some(s.scenario.id.clone()))),
        ("scenario_title", text(&|s| Some(s.scenario.title.clone()))),
        ("scenario_sha256", text(&|s| Some(s.scenario.sha256.clone()))),
        ("participant", text(&|s| Some(s.participant.clone()))),
        ("started_at", ParquetColumn::Timestamp(all.iter().map(|(_, s)| moment(s)).collect())),
        ("ended_because", text(&|s| Some(s.ended_because.clone()))),
        ("length_s", ParquetColumn::Number(all.iter().map(|(_, s)| Some(s.servo.ticks as f64 * TICK_S)).collect())),
        ("operator", text(&|s| s.operator.clone())),
        ("device", text(&|s| s.device.as_ref().map(|d| d.name.clone()))),
        ("typodont_version", text(&|s| Some(s.typodont_version.clone()))),
        (
            "scorer_version",
            ParquetColumn::Integer(all.iter().map(|(_, s)| Some(i64::from(s.scorer_version))).collect()),
        ),
        ("points", grade(&|g| g.points)),
        ("max_points", grade(&|g| g.max_points)),
        ("pass_points", grade(&|g| g.pass_points)),
        ("passed", ParquetColumn::Boolean(all.iter().map(|(_, s)| s.grade.as_ref().map(|g| g.passed)).collect())),
        ("hard_fails", text(&|s| s.grade.as_ref().map(|g| g.hard_fails.join("; ")))),
        ("verification", ParquetColumn::Text(statuses.clone().map(|s| Some(s.name().to_string())).collect())),
        (
            "verification_note",
            ParquetColumn::Text(statuses.map(|s| Some(s.note()).filter(|note| !note.is_empty())).collect()),
        ),
    ])
}

fn metrics(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let (mut ids, mut names, mut units, mut values) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (_, session) in &cohort.sessions {
        let id = session_id(session);
        for (name, value) in &session.metrics {
            ids.push(Some(id.clone()));
            names.push(Some(name.clone()));
            units.push(Metric::parse(name).ok().map(|m| m.info.unit.to_string()));
            values.push(*value);
        }
    }
    encode_table(vec![
        ("session_id", ParquetColumn::Text(ids)),
        ("metric", ParquetColumn::Text(names)),
        ("unit", ParquetColumn::Text(units)),
        ("value", ParquetColumn::Number(values)),
    ])
}

/// Row of the event table. `at_s` is the time since the start of the session, s.
struct EventRow {
    at_s: Option<f64>,
    what: &'static str,
    name: String,
    text: Option<String>,
    number: Option<f64>,
    right: Option<bool>,
}

fn events(cohort: &Cohort) -> Result<Vec<u8>, ParquetError> {
    let all: Vec<(String, EventRow)> = cohort
        .sessions
        .iter()
        .flat_map(|(_, session)| {
            let id = session_id(session);
            events_of(session).into_iter().map(move |e| (id.clone(), e))
        })
        .collect();
    let text = |of: &dyn Fn(&EventRow) -> Option<String>| ParquetColumn::Text(all.iter().map(|(_, e)| of(e)).collect());
    encode_table(vec![
        ("session_id", ParquetColumn::Text(all.iter().map(|(id, _)| Some(id.clone())).collect())),
        ("at_s", ParquetColumn::Number(all.iter().map(|(_, e)| e.at_s).collect())),
        ("event", text(&|e| Some(e.what.to_string()))),
        ("name", text(&|e| Some(e.name.clone()))),
        ("text", text(&|e| e.text.clone())),
        ("number", ParquetColumn::Number(all.iter().map(|(_, e)| e.number).collect())),
        ("right", ParquetColumn::Boolean(all.iter().map(|(_, e)| e.right).collect())),
    ])
}

/// Lists the events of a session: stages begun and ended, answers, the evidence of each metric, and the
/// questionnaire's ratings last.
fn events_of(session: &SessionFile) -> Vec<EventRow> {
    let plain =
        |at_s, what, name: &str| EventRow { at_s, what, name: name.into(), text: None, number: None, right: None };
    let mut events = Vec::new();
    for stage in &session.stages {
        events.push(plain(Some(stage.started_s), "stage_began", &stage.id));
        for answer in &stage.answers {
            let text = match &answer.value {
                serde_json::Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            let number = answer.value.as_f64();
            events.push(EventRow {
                text: Some(text),
                number,
                right: answer.right,
                ..plain(Some(answer.at_s), "answered", &answer.question)
            });
        }
        events.push(EventRow {
            text: Some(stage.ended_by.clone()),
            ..plain(Some(stage.ended_s), "stage_ended", &stage.id)
        });
    }
    for (metric, evidence) in &session.evidence {
        events.push(EventRow { number: session.metric(metric), ..plain(evidence.at_s, "measured", metric) });
    }
    events.sort_by(|a, b| a.at_s.unwrap_or(f64::INFINITY).total_cmp(&b.at_s.unwrap_or(f64::INFINITY)));
    for item in session.questionnaire.iter().flat_map(|q| &q.items).filter(|i| i.value.is_some()) {
        events.push(EventRow { number: item.value, ..plain(None, "rated", &item.id) });
    }
    events
}

/// Encodes columns of equal length, all nullable, as one Parquet file with a single row group.
fn encode_table(columns: Vec<(&str, ParquetColumn)>) -> Result<Vec<u8>, ParquetError> {
    let kind = |column: &ParquetColumn| match column {
        ParquetColumn::Text(_) => ("BYTE_ARRAY", " (STRING)"),
        ParquetColumn::Number(_) => ("DOUBLE", ""),
        ParquetColumn::Integer(_) => ("INT64", ""),
        ParquetColumn::Boolean(_) => ("BOOLEAN", ""),
        ParquetColumn::Timestamp(_) => ("INT64", " (TIMESTAMP(MICROS,true))"),
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
            ParquetColumn::Text(values) => {
                let values = values.into_iter().map(|v| v.map(|text| ByteArray::from(text.into_bytes())));
                write_column::<ByteArrayType>(&mut group, values.collect())?;
            }
            ParquetColumn::Number(values) => write_column::<DoubleType>(&mut group, values)?,
            ParquetColumn::Integer(values) | ParquetColumn::Timestamp(values) => {
                write_column::<Int64Type>(&mut group, values)?
            }
            ParquetColumn::Boolean(values) => write_column::<BoolType>(&mut group, values)?,
        }
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn write_column<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>,
    values: Vec<Option<T::T>>,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let present: Vec<T::T> = values.into_iter().flatten().collect();
    let mut column =
        group.next_column()?.ok_or_else(|| ParquetError::General("more columns than the schema defines".into()))?;
    column.typed::<T>().write_batch(&present, Some(&levels), None)?;
    column.close()
}
