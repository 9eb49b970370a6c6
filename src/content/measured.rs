//! Tables of measured numbers: forces over time, and paths, as comma-separated values.
//!
//! Takes a text. Gives what it says, or all that is wrong with it, line by line. A table has one line of names, then one
//! line of numbers per row; decimals are written with a point.

use crate::diagnostic::{Diagnostic, Source};
use crate::frame::Vec3;
use crate::touch::{ForceRow, POINT_DISTANCE, Path};
use std::ops::Range;
use std::sync::Arc;

/// Longest text that is read, bytes.
pub const TEXT_MAX: usize = 16 << 20;

/// Most rows: five minutes at 1 kHz.
pub const ROWS_MAX: usize = 300_000;

/// Most points of a path that lie [`POINT_DISTANCE`] apart, so that a tick finds the nearest among all in 10 µs, or in 80 µs
/// where all are as near as each other.
pub const POINTS_MAX: usize = 4000;

/// Greatest force of a table, N: what the strongest of the common devices render for moments.
pub const FORCE_MAX: f32 = 5.0;

/// Complaints about one table; who has made one mistake in every row need not hear of each.
const COMPLAINTS_MAX: usize = 20;

/// What stands below a name, and its range.
struct Column {
    name: &'static str,
    least: f64,
    most: f64,
}

/// s: as long as a stage may be.
const TIME: Column = Column { name: "time_s", least: 0.0, most: 7200.0 };

/// N; of the three together see [`FORCE_MAX`].
const FORCES: [Column; 4] = [TIME, force("fx_n"), force("fy_n"), force("fz_n")];

/// mm, as of all coordinates in a scenario.
const TIMED_PATH: [Column; 4] = [TIME, coordinate("x_mm"), coordinate("y_mm"), coordinate("z_mm")];

const PATH: [Column; 3] = [coordinate("x_mm"), coordinate("y_mm"), coordinate("z_mm")];

const fn force(name: &'static str) -> Column {
    Column { name, least: -FORCE_MAX as f64, most: FORCE_MAX as f64 }
}

const fn coordinate(name: &'static str) -> Column {
    Column { name, least: -60.0, most: 60.0 }
}

/// Forces over time: `time_s,fx_n,fy_n,fz_n`.
pub fn forces(source: Arc<Source>) -> Result<Vec<ForceRow>, Vec<Diagnostic>> {
    let rows = read(&source, &[&FORCES])?;
    let mut forces = Vec::with_capacity(rows.len());
    let mut found = Vec::new();
    for Row { numbers, span } in rows {
        let [time, fx, fy, fz] = numbers[..] else { continue };
        let force = Vec3::new(fx as f32, fy as f32, fz as f32);
        if force.length() > FORCE_MAX && found.len() < COMPLAINTS_MAX {
            let message = format!("the force is {:.2} N: expected at most {FORCE_MAX}", force.length());
            found.push(complaint(&source, Some(span), "out-of-range", message, "forces are in newtons"));
        }
        forces.push(ForceRow { time, force });
    }
    if found.is_empty() { Ok(forces) } else { Err(found) }
}

/// A path in tooth space: `x_mm,y_mm,z_mm`, before them `time_s` or not.
pub fn path(source: Arc<Source>) -> Result<Path, Vec<Diagnostic>> {
    let rows = read(&source, &[&PATH, &TIMED_PATH])?;
    let point = |row: &Row| match row.numbers[..] {
        [x, y, z] | [_, x, y, z] => Some(Vec3::new(x as f32, y as f32, z as f32)),
        _ => None,
    };
    let path = Path::through(rows.iter().filter_map(point));
    let problem = match path.points().len() {
        0 | 1 => {
            let help = "two points at least must differ by 0.05 mm; lengths are in millimetres";
            ("empty-path", "the path leads nowhere".to_string(), help)
        }
        points if points > POINTS_MAX => {
            let message = format!("the path has {points} points that lie {POINT_DISTANCE} mm apart or more");
            ("too-long", message, "at most 4000 are followed; take a part of it, or fewer points")
        }
        _ => return Ok(path),
    };
    let (code, message, help) = problem;
    Err(vec![complaint(&source, None, code, message, help)])
}

/// A line of numbers, and where it stands.
struct Row {
    numbers: Vec<f64>,
    span: Range<usize>,
}

fn complaint(
    source: &Arc<Source>,
    span: Option<Range<usize>>,
    code: &'static str,
    message: String,
    help: &str,
) -> Diagnostic {
    let help = (!help.is_empty()).then(|| help.to_string());
    Diagnostic { code, source: source.clone(), span, path: String::new(), message, help }
}

/// All rows under one of several possible lines of names.
fn read(source: &Arc<Source>, possible: &[&'static [Column]]) -> Result<Vec<Row>, Vec<Diagnostic>> {
    let whole = |code, message, help: &str| vec![complaint(source, None, code, message, help)];
    if source.text.len() > TEXT_MAX {
        return Err(whole("too-large", format!("the file has {} bytes", source.text.len()), "at most 16 MiB are read"));
    }
    let mut lines = lines(&source.text).filter(|(line, _)| !line.trim().is_empty());
    let headers = possible.iter().map(|columns| header(columns)).collect::<Vec<_>>().join(" or ");
    let Some((first, span)) = lines.next() else {
        return Err(whole("wrong-header", "the file is empty".into(), &format!("it begins with {headers}")));
    };
    let names: Vec<&str> = first.split(',').map(str::trim).collect();
    let Some(columns) = possible.iter().find(|columns| columns.iter().map(|c| c.name).eq(names.iter().copied())) else {
        let message = format!("the columns are \"{}\"", abridged(first));
        let help = format!("expected {headers}, separated by commas");
        return Err(vec![complaint(source, Some(span), "wrong-header", message, &help)]);
    };
    let mut found = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    for (line, span) in lines {
        match row(source, columns, line, span.clone(), rows.last()) {
            Ok(row) => rows.push(row),
            Err(complaints) => found.extend(complaints),
        }
        if found.len() >= COMPLAINTS_MAX {
            let message = format!("reading stopped here, after {} complaints", found.len());
            found.push(complaint(source, Some(span), "too-many", message, ""));
            break;
        }
        if rows.len() > ROWS_MAX {
            let message = format!("there are more than {ROWS_MAX} rows");
            found.push(complaint(source, Some(span), "too-long", message, "give a part of the table, or fewer rows"));
            break;
        }
    }
    if found.is_empty() && rows.len() < 2 {
        let message = format!("the table has {} rows of numbers", rows.len());
        found.push(complaint(source, None, "too-short", message, "at least two are needed"));
    }
    if found.is_empty() { Ok(rows) } else { Err(found) }
}

/// Every line without its end, and where it stands.
fn lines(text: &str) -> impl Iterator<Item = (&str, Range<usize>)> {
    let mut start = 0;
    text.split_inclusive('\n').map(move |whole| {
        let line = whole.trim_end_matches(['\n', '\r']);
        let span = start..start + line.len();
        start += whole.len();
        (line, span)
    })
}

fn header(columns: &[Column]) -> String {
    columns.iter().map(|c| c.name).collect::<Vec<_>>().join(",")
}

/// One row; times come after those of the row before.
fn row(
    source: &Arc<Source>,
    columns: &[Column],
    line: &str,
    span: Range<usize>,
    before: Option<&Row>,
) -> Result<Row, Vec<Diagnostic>> {
    let cells: Vec<&str> = line.split(',').collect();
    if cells.len() != columns.len() {
        let message = format!("{} numbers in a row, expected {}", cells.len(), columns.len());
        let help = format!("{}: separate numbers by commas, write decimals with a point", header(columns));
        return Err(vec![complaint(source, Some(span), "wrong-count", message, &help)]);
    }
    let mut found = Vec::new();
    let mut numbers = Vec::with_capacity(columns.len());
    let mut start = span.start;
    for (Column { name, least, most }, cell) in columns.iter().zip(&cells) {
        let written = cell.trim();
        let at = start + (cell.len() - cell.trim_start().len());
        let place = Some(at..at + written.len());
        start += cell.len() + 1;
        match written.parse::<f64>().ok().filter(|number| number.is_finite()) {
            Some(number) if (*least..=*most).contains(&number) => numbers.push(number),
            Some(number) => {
                let message = format!("{name} is {number}: expected {least} to {most}");
                found.push(complaint(
                    source,
                    place,
                    "out-of-range",
                    message,
                    "units are millimetres, newtons and seconds",
                ));
            }
            None => {
                let message = format!("\"{}\" is not a number", abridged(written));
                found.push(complaint(source, place, "wrong-number", message, "write numbers like -0.25 or 1.5e-3"));
            }
        }
    }
    let is_timed = columns.first().is_some_and(|c| c.name == TIME.name);
    let times = before.and_then(|row| row.numbers.first()).zip(numbers.first());
    if let Some((earlier, time)) = times.filter(|(earlier, time)| found.is_empty() && is_timed && time <= earlier) {
        let message = format!("time_s is {time} after {earlier}");
        let help = "every row is later than the one before";
        found.push(complaint(source, Some(span.clone()), "wrong-order", message, help));
    }
    if found.is_empty() { Ok(Row { numbers, span }) } else { Err(found) }
}

/// What was written, short enough for a line.
fn abridged(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST { text.to_string() } else { text.chars().take(MOST).chain(['…']).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines, columns and rules of all complaints.
    fn complaints<T>(read: Result<T, Vec<Diagnostic>>) -> Vec<(usize, usize, &'static str)> {
        let found = read.err().unwrap_or_default();
        found
            .iter()
            .map(|d| d.line_and_column().map_or((0, 0, d.code), |(line, column)| (line, column, d.code)))
            .collect()
    }

    fn check_forces(text: &str, expected: &[(usize, usize, &str)]) {
        assert_eq!(complaints(forces(Source::new("felt.csv", text))), expected, "{text}");
    }

    fn check_path(text: &str, expected: &[(usize, usize, &str)]) {
        assert_eq!(complaints(path(Source::new("path.csv", text))), expected, "{text}");
    }

    #[test]
    fn tables_are_read_as_people_write_them() {
        // Aim: Windows line ends, spaces, blank lines at the end, exponents; nothing else is bent.
        let text = "time_s, fx_n ,fy_n,fz_n\r\n0.5,1,-2, 3e0\r\n1.5,0,0,-0.25\r\n\r\n";
        let rows = forces(Source::new("felt.csv", text)).unwrap();
        let row = |time, force: [f32; 3]| ForceRow { time, force: Vec3::from(force) };
        assert_eq!(rows, [row(0.5, [1.0, -2.0, 3.0]), row(1.5, [0.0, 0.0, -0.25])]);
        for text in ["x_mm,y_mm,z_mm\n1,2,3\n1,2,4", "time_s,x_mm,y_mm,z_mm\n0,1,2,3\n0.1,1,2,4\n"] {
            let path = path(Source::new("path.csv", text)).unwrap();
            assert_eq!(
                (path.points(), path.length()),
                (&[Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 4.0)][..], 1.0)
            );
        }
    }

    #[test]
    fn every_mistake_has_its_line() {
        let head = "time_s,fx_n,fy_n,fz_n\n";
        check_forces("", &[(0, 0, "wrong-header")]);
        check_forces("0,0,0,0\n1,0,0,0", &[(1, 1, "wrong-header")]);
        check_forces("time_s;fx_n;fy_n;fz_n\n0;0;0;0", &[(1, 1, "wrong-header")]);
        check_forces("time_s,fx_n,fz_n,fy_n\n0,0,0,0", &[(1, 1, "wrong-header")]);
        check_forces(head, &[(0, 0, "too-short")]);
        check_forces(&format!("{head}0,0,0,0"), &[(0, 0, "too-short")]);
        check_forces(&format!("{head}0,0,0\n1,0,0,0,0\n"), &[(2, 1, "wrong-count"), (3, 1, "wrong-count")]);
        check_forces(&format!("{head}0,0,x,\n"), &[(2, 5, "wrong-number"), (2, 7, "wrong-number")]);
        check_forces(&format!("{head}0,NaN,0,inf\n"), &[(2, 3, "wrong-number"), (2, 9, "wrong-number")]);
        check_forces(&format!("{head}0,0,0,0\n-1,0,0,0\n"), &[(3, 1, "out-of-range")]);
        check_forces(&format!("{head}0,0,0,0\n1,0, 5.5,0\n"), &[(3, 6, "out-of-range")]);
        check_forces(&format!("{head}0,0,0,0\n1,4,4,0\n"), &[(3, 1, "out-of-range")]);
        check_forces(
            &format!("{head}0,0,0,0\n1,0,0,0\n1,0,0,0\n0.5,0,0,0\n"),
            &[(4, 1, "wrong-order"), (5, 1, "wrong-order")],
        );
        let many = format!("{head}{}", "a,0,0,0\n".repeat(100));
        assert_eq!(complaints(forces(Source::new("felt.csv", many))).len(), COMPLAINTS_MAX + 1);
        let rows: String = (0..ROWS_MAX + 1).map(|i| format!("{},0,0,0\n", i as f64 * 1e-3)).collect();
        check_forces(&format!("{head}{rows}"), &[(ROWS_MAX + 2, 1, "too-long")]);
        check_path("x_mm,y_mm\n0,0\n", &[(1, 1, "wrong-header")]);
        check_path("x_mm,y_mm,z_mm\n0,0,0\n0,0,61\n", &[(3, 5, "out-of-range")]);
        check_path("x_mm,y_mm,z_mm\n0,0,0\n0,0,0.01\n", &[(0, 0, "empty-path")]);
        let points: String = (0..POINTS_MAX + 1).map(|i| format!("{},{},0\n", i % 2, i as f64 * 0.01)).collect();
        check_path(&format!("x_mm,y_mm,z_mm\n{points}"), &[(0, 0, "too-long")]);
    }
}
