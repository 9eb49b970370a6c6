//! Force, speed and progress over time, as one SVG.

use super::language::{Languages, Said, escaped};
use super::words;
use crate::score::Trace;
use std::fmt::Write;

/// A stage's name and its start and end, s.
pub struct Span<'a> {
    pub title: &'a str,
    pub from: f64,
    pub to: f64,
}

/// A moment that cost points: its number, when it was worst, and from when to when it lasted, s.
pub struct Mark {
    pub number: usize,
    pub at: f64,
    pub span: Option<[f64; 2]>,
}

const WIDTH: f64 = 960.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 16.0;
const BAND_HEIGHT: f64 = 90.0;
const BAND_GAP: f64 = 26.0;
const TOP: f64 = 66.0;

/// Where marks stand, in how many rows so that near ones do not hide each other, and how wide one is.
const MARKS_TOP: f64 = 27.0;
const MARK_ROWS: usize = 2;
const MARK_WIDTH: f64 = 19.0;

/// One curve: what it is called, its unit, and its values.
struct Curve<'a> {
    /// Its key among the languages' texts.
    key: &'a str,
    unit: &'a str,
    values: Vec<f64>,
    /// Top of the scale.
    full: f64,
    color: &'a str,
}

/// The curves of a session, with its stages and marks; empty for a session without a tick.
///
/// Without decay there is none to clear.
///
/// `data-seconds`, `data-left` and `data-right` say which second stands where, for the page's script.
pub fn svg(trace: &Trace, has_decay: bool, stages: &[Span], marks: &[Mark], languages: &Languages) -> String {
    let Some(last) = trace.samples.last() else { return String::new() };
    let seconds = last.at.seconds();
    let value = |f: fn(&crate::score::Sample) -> f32| trace.samples.iter().map(|s| f64::from(f(s))).collect::<Vec<_>>();
    let highest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let (force, speed) = (value(|s| s.force), value(|s| if s.touched { s.speed } else { 0.0 }));
    let mut curves = vec![
        Curve { key: "curve.force", unit: "N", full: nice(highest(&force)), values: force, color: "#b04a00" },
        Curve { key: "curve.speed", unit: "mm/s", full: nice(highest(&speed)), values: speed, color: "#0b6ea8" },
    ];
    if has_decay {
        let values = value(|s| s.cleared);
        curves.push(Curve { key: "curve.cleared", unit: "%", full: 100.0, values, color: "#22794f" });
    }
    let height = TOP + curves.len() as f64 * (BAND_HEIGHT + BAND_GAP) + 14.0;
    let x = |s: f64| LEFT + (WIDTH - LEFT - RIGHT) * s / seconds.max(1e-9);
    let mut svg = format!(
        "<svg id=\"curves\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"group\" aria-labelledby=\"curves-title\" \
         data-seconds=\"{seconds:.3}\" data-left=\"{LEFT}\" data-right=\"{:.0}\" \
         font-family=\"sans-serif\" font-size=\"12\">",
        WIDTH - RIGHT
    );
    let bottom = height - 34.0;
    for stage in stages {
        let (from, to) = (x(stage.from), x(stage.to));
        let _ = write!(
            svg,
            "<line x1=\"{from:.1}\" x2=\"{from:.1}\" y1=\"14\" y2=\"{bottom:.1}\" stroke=\"#999\" stroke-dasharray=\"3 3\"/>"
        );
        if to - from > 60.0 {
            let title = escaped(&shortened(stage.title, ((to - from) / 6.5) as usize));
            let _ = write!(svg, "<text x=\"{:.1}\" y=\"11\" fill=\"#444\">{title}</text>", from + 4.0);
        }
    }
    for (index, curve) in curves.iter().enumerate() {
        let top = TOP + index as f64 * (BAND_HEIGHT + BAND_GAP);
        draw(&mut svg, curve, top, &|i| x(trace.samples[i].at.seconds()), languages);
    }
    draw_marks(&mut svg, marks, bottom, &x);
    for moment in round_moments(seconds) {
        let at = x(moment);
        let label = if seconds < 60.0 {
            format!("{moment:.0} s")
        } else {
            format!("{}:{:02}", moment as u64 / 60, moment as u64 % 60)
        };
        let _ = write!(
            svg,
            "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444\">{label}</text>",
            height - 8.0
        );
    }
    svg + "</svg>"
}

/// A numbered flag over each moment that cost points, and a bar as long as it lasted.
fn draw_marks(svg: &mut String, marks: &[Mark], bottom: f64, x: &dyn Fn(f64) -> f64) {
    let mut taken = [f64::NEG_INFINITY; MARK_ROWS];
    let mut in_time: Vec<&Mark> = marks.iter().collect();
    in_time.sort_by(|a, b| a.at.total_cmp(&b.at));
    for Mark { number, at, span } in in_time {
        let middle = x(*at);
        let row = (0..MARK_ROWS).find(|&row| middle - taken[row] >= MARK_WIDTH).unwrap_or(0);
        taken[row] = middle;
        let y = MARKS_TOP + row as f64 * MARK_WIDTH * 0.95;
        let _ = write!(
            svg,
            "<g class=\"mark\" role=\"button\" tabindex=\"0\" data-mark=\"{number}\" aria-label=\"{number}: {}\">",
            words::duration(*at)
        );
        if let Some([from, to]) = span {
            let (from, to) = (x(*from), x(*to));
            let _ = write!(
                svg,
                "<rect class=\"lasted\" x=\"{from:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"3\"/>",
                y + 7.5,
                (to - from).max(1.0)
            );
        }
        let _ = write!(
            svg,
            "<line x1=\"{middle:.1}\" x2=\"{middle:.1}\" y1=\"{:.1}\" y2=\"{bottom:.1}\"/>\
             <circle cx=\"{middle:.1}\" cy=\"{y:.1}\" r=\"9\"/>\
             <text x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{number}</text></g>",
            y + 9.0,
            y + 4.0
        );
    }
}

fn draw(svg: &mut String, curve: &Curve, top: f64, x: &dyn Fn(usize) -> f64, languages: &Languages) {
    let bottom = top + BAND_HEIGHT;
    let y = |v: f64| bottom - BAND_HEIGHT * (v / curve.full).clamp(0.0, 1.0);
    let full = words::number(curve.full).trim_end_matches('0').trim_end_matches('.').to_string();
    let _ = write!(
        svg,
        "<text x=\"4\" y=\"{:.1}\" fill=\"#222\" font-weight=\"bold\">{}</text>",
        top - 9.0,
        languages.svg(&Said::text(curve.key, &[]))
    );
    for (value, label) in [(0.0, "0".to_string()), (curve.full, format!("{full} {}", curve.unit))] {
        let at = y(value);
        let _ = write!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ccc\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444\">{label}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        );
    }
    let points = thin(&curve.values).into_iter().map(|(i, v)| format!("{:.1},{:.1}", x(i), y(v)));
    let points = points.collect::<Vec<_>>().join(" ");
    let _ =
        write!(svg, "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" points=\"{points}\"/>", curve.color);
}

/// At most 800 points: of each group its highest, so that no peak is lost.
fn thin(values: &[f64]) -> Vec<(usize, f64)> {
    let group = values.len().div_ceil(800).max(1);
    let highest = |(g, chunk): (usize, &[f64])| {
        let (i, v) =
            chunk.iter().enumerate().fold((0, f64::MIN), |best, (i, &v)| if v > best.1 { (i, v) } else { best });
        (g * group + i, v)
    };
    values.chunks(group).enumerate().map(highest).collect()
}

/// The next of 1, 2, 5, 10 … above a value.
fn nice(value: f64) -> f64 {
    if value <= 0.0 {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::log10(value).floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|&n| n >= value * 0.9999).unwrap_or(10.0 * power)
}

/// Five to ten round moments.
fn round_moments(seconds: f64) -> Vec<f64> {
    let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0];
    let step = steps.into_iter().find(|s| seconds / s <= 10.0).unwrap_or(3600.0);
    (0..=(seconds / step) as u32).map(|i| f64::from(i) * step).collect()
}

fn shortened(text: &str, most: usize) -> String {
    match text.chars().count() > most {
        true => text.chars().take(most.saturating_sub(1)).chain(['…']).collect(),
        false => text.to_string(),
    }
}
