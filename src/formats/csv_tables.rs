//! Comma-separated tables of measured numbers: forces over time, and paths.
//!
//! Takes the text of a table. Gives the values, or every complaint with its line. Never reads a file. A table
//! consists of one line of column names, then one line of numbers per row; decimals are written with a point.

use crate::diagnostic::{Diagnostic, SourceText};
use std::ops::Range;
use std::sync::Arc;
use typodont_core::frame::Vec3;
use typodont_core::touch::{ForceRow, POINT_DISTANCE, Polyline};

/// Maximum text length, bytes.
pub const TEXT_MAX: usize = 16 << 20;

/// Maximum number of rows: five minutes at 1 kHz.
pub const ROWS_MAX: usize = 300_000;

/// Maximum number of path points that lie [`POINT_DISTANCE`] apart. With this many, one tick finds the nearest point
/// in 10 µs, or in 80 µs when all points are equally near.
pub const POINTS_MAX: usize = 4000;

/// Maximum force of a table, N: the peak force that the strongest common devices can render momentarily.
pub const FORCE_MAX: f32 = 5.0;

/// Maximum number of complaints about one table: the same mistake in every row need not be listed for each.
const COMPLAINTS_MAX: usize = 20;

/// A column: its name and the range of its numbers.
struct CsvColumn {
    name: &'static str,
    least: f64,
    most: f64,
}

/// Seconds, up to the maximum duration of a stage.
const TIME: CsvColumn = CsvColumn { name: "time_s", least: 0.0, most: 7200.0 };

/// Newtons, per component. [`FORCE_MAX`] limits the magnitude of the three together.
const FORCES: [CsvColumn; 4] = [TIME, force("fx_n"), force("fy_n"), force("fz_n")];

/// Millimetres, with the same limits as every coordinate in a scenario.
const TIMED_PATH: [CsvColumn; 4] = [TIME, coordinate("x_mm"), coordinate("y_mm"), coordinate("z_mm")];

const PATH: [CsvColumn; 3] = [coordinate("x_mm"), coordinate("y_mm"), coordinate("z_mm")];

const fn force(name: &'static str) -> CsvColumn {
    CsvColumn { name, least: -FORCE_MAX as f64, most: FORCE_MAX as f64 }
}

const fn coordinate(name: &'static str) -> CsvColumn {
    CsvColumn { name, least: -60.0, most: 60.0 }
}

/// Parses a table of forces over time: `time_s,fx_n,fy_n,fz_n`; seconds and newtons.
///
/// # Errors
/// Returns every complaint, at most 20 and a closing note, when the header, a number, a range or the order of times
/// is wrong.
pub fn parse_forces(source: Arc<SourceText>) -> Result<Vec<ForceRow>, Vec<Diagnostic>> {
    let rows = read(&source, &[&FORCES])?;
    let mut forces = Vec::with_capacity(rows.len());
    let mut found = Vec::new();
    for CsvRow { numbers, span } in rows {
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

/// Parses a path in tooth space, mm: `x_mm,y_mm,z_mm`, optionally preceded by `time_s`.
///
/// # Errors
/// Returns every complaint when the header, a number or a range is wrong, or when the path has too few or too many
/// points.
pub fn parse_path(source: Arc<SourceText>) -> Result<Polyline, Vec<Diagnostic>> {
    let rows = read(&source, &[&PATH, &TIMED_PATH])?;
    let point = |row: &CsvRow| match row.numbers[..] {
        [x, y, z] | [_, x, y, z] => Some(Vec3::new(x as f32, y as f32, z as f32)),
        _ => None,
    };
    let path = Polyline::through(rows.iter().filter_map(point));
    let problem = match path.points().len() {
        0 | 1 => {
            let help = "at least two points must be 0.05 mm apart; lengths are in millimetres";
            ("empty-path", "the path has no length".to_string(), help)
        }
        points if points > POINTS_MAX => {
            let message = format!("the path has {points} points that lie {POINT_DISTANCE} mm apart or more");
            ("too-long", message, "at most 4000 points are allowed; use a part of the path, or fewer points")
        }
        _ => return Ok(path),
    };
    let (code, message, help) = problem;
    Err(vec![complaint(&source, None, code, message, help)])
}

/// A row of numbers and its span in the text.
struct CsvRow {
    numbers: Vec<f64>,
    span: Range<usize>,
}

fn complaint(
    source: &Arc<SourceText>,
    span: Option<Range<usize>>,
    code: &'static str,
    message: String,
    help: &str,
) -> Diagnostic {
    let help = (!help.is_empty()).then(|| help.to_string());
    Diagnostic { code, source: source.clone(), span, path: String::new(), message, help }
}

/// Reads all rows, provided that the header is one of the `possible` ones.
fn read(source: &Arc<SourceText>, possible: &[&'static [CsvColumn]]) -> Result<Vec<CsvRow>, Vec<Diagnostic>> {
    let whole = |code, message, help: &str| vec![complaint(source, None, code, message, help)];
    if source.text.len() > TEXT_MAX {
        return Err(whole("too-large", format!("the file has {} bytes", source.text.len()), "the maximum is 16 MiB"));
    }
    let mut lines = lines(&source.text).filter(|(line, _)| !line.trim().is_empty());
    let headers = possible.iter().map(|columns| header(columns)).collect::<Vec<_>>().join(" or ");
    let Some((first, span)) = lines.next() else {
        return Err(whole("wrong-header", "the file is empty".into(), &format!("the first line must be {headers}")));
    };
    let names: Vec<&str> = first.split(',').map(str::trim).collect();
    let Some(columns) = possible.iter().find(|columns| columns.iter().map(|c| c.name).eq(names.iter().copied())) else {
        let message = format!("the columns are \"{}\"", abridged(first));
        let help = format!("expected {headers}, separated by commas");
        return Err(vec![complaint(source, Some(span), "wrong-header", message, &help)]);
    };
    let mut found = Vec::new();
    let mut rows: Vec<CsvRow> = Vec::new();
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
            found.push(complaint(source, Some(span), "too-long", message, "use a part of the table, or fewer rows"));
            break;
        }
    }
    if found.is_empty() && rows.len() < 2 {
        let message = format!("the table has {} rows of numbers", rows.len());
        found.push(complaint(source, None, "too-short", message, "at least two rows are needed"));
    }
    if found.is_empty() { Ok(rows) } else { Err(found) }
}

/// Splits a text into lines without their line ends, each with its span.
fn lines(text: &str) -> impl Iterator<Item = (&str, Range<usize>)> {
    let mut start = 0;
    text.split_inclusive('\n').map(move |whole| {
        let line = whole.trim_end_matches(['\n', '\r']);
        let span = start..start + line.len();
        start += whole.len();
        (line, span)
    })
}

fn header(columns: &[CsvColumn]) -> String {
    columns.iter().map(|c| c.name).collect::<Vec<_>>().join(",")
}

/// Parses one row; times must increase from row to row.
fn row(
    source: &Arc<SourceText>,
    columns: &[CsvColumn],
    line: &str,
    span: Range<usize>,
    before: Option<&CsvRow>,
) -> Result<CsvRow, Vec<Diagnostic>> {
    let cells: Vec<&str> = line.split(',').collect();
    if cells.len() != columns.len() {
        let message = format!("{} numbers in a row, expected {}", cells.len(), columns.len());
        let help = format!("{}: separate numbers by commas, write decimals with a point", header(columns));
        return Err(vec![complaint(source, Some(span), "wrong-count", message, &help)]);
    }
    let mut found = Vec::new();
    let mut numbers = Vec::with_capacity(columns.len());
    let mut start = span.start;
    for (CsvColumn { name, least, most }, cell) in columns.iter().zip(&cells) {
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
        let help = "every row must be later than the one before";
        found.push(complaint(source, Some(span.clone()), "wrong-order", message, help));
    }
    if found.is_empty() { Ok(CsvRow { numbers, span }) } else { Err(found) }
}

/// Shortens a quoted text to fit on one line.
fn abridged(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST { text.to_string() } else { text.chars().take(MOST).chain(['…']).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line, column and rule of every complaint.
    fn complaints<T>(read: Result<T, Vec<Diagnostic>>) -> Vec<(usize, usize, &'static str)> {
        let found = read.err().unwrap_or_default();
        found
            .iter()
            .map(|d| d.line_and_column().map_or((0, 0, d.code), |(line, column)| (line, column, d.code)))
            .collect()
    }

    fn check_forces(text: &str, expected: &[(usize, usize, &str)]) {
        assert_eq!(complaints(parse_forces(SourceText::new("felt.csv", text))), expected, "{text}");
    }

    fn check_path(text: &str, expected: &[(usize, usize, &str)]) {
        assert_eq!(complaints(parse_path(SourceText::new("path.csv", text))), expected, "{text}");
    }

    #[test]
    fn tables_are_read_as_people_write_them() {
        // Aim: Windows line ends, spaces, blank lines at the end and exponents are accepted, and nothing else is.
        let text = "time_s, fx_n ,fy_n,fz_n\r\n0.5,1,-2, 3e0\r\n1.5,0,0,-0.25\r\n\r\n";
        let rows = parse_forces(SourceText::new("felt.csv", text)).unwrap();
        let row = |time, force: [f32; 3]| ForceRow { time, force: Vec3::from(force) };
        assert_eq!(rows, [row(0.5, [1.0, -2.0, 3.0]), row(1.5, [0.0, 0.0, -0.25])]);
        for text in ["x_mm,y_mm,z_mm\n1,2,3\n1,2,4", "time_s,x_mm,y_mm,z_mm\n0,1,2,3\n0.1,1,2,4\n"] {
            let path = parse_path(SourceText::new("path.csv", text)).unwrap();
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
        assert_eq!(complaints(parse_forces(SourceText::new("felt.csv", many))).len(), COMPLAINTS_MAX + 1);
        let rows: String = (0..ROWS_MAX + 1).map(|i| format!("{},0,0,0\n", i as f64 * 1e-3)).collect();
        check_forces(&format!("{head}{rows}"), &[(ROWS_MAX + 2, 1, "too-long")]);
        check_path("x_mm,y_mm\n0,0\n", &[(1, 1, "wrong-header")]);
        check_path("x_mm,y_mm,z_mm\n0,0,0\n0,0,61\n", &[(3, 5, "out-of-range")]);
        check_path("x_mm,y_mm,z_mm\n0,0,0\n0,0,0.01\n", &[(0, 0, "empty-path")]);
        let points: String = (0..POINTS_MAX + 1).map(|i| format!("{},{},0\n", i % 2, i as f64 * 0.01)).collect();
        check_path(&format!("x_mm,y_mm,z_mm\n{points}"), &[(0, 0, "too-long")]);
    }
}
