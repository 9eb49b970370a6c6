//! Small drawings for the cohort's page, as SVG.

use super::progress::LearningCurves;
use super::summary::SpreadFile;
use crate::display_format;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Above this many, sessions are drawn as columns and no longer one by one.
const DOTS_MAX: usize = 150;

const COLUMNS: usize = 30;

/// Size of a strip, and how far its ends stand from the edge.
const STRIP: (f64, f64) = (260.0, 36.0);
const EDGE: f64 = 6.0;

/// Every session as a dot (or columns, of many), the quartiles as a box, the mean with its interval as a diamond and a line.
pub fn strip_plot(values: &[f64], spread: &SpreadFile, alt: &str) -> String {
    let (width, height) = STRIP;
    let room = (spread.max - spread.min).max(1e-12);
    let x = |v: f64| EDGE + (width - 2.0 * EDGE) * ((v - spread.min) / room).clamp(0.0, 1.0);
    let middle = height - 9.0;
    let mut svg =
        format!("<svg class=\"strip\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">", escape(alt));
    let [q1, q3] = spread.quartiles.map(x);
    let _ = write!(
        svg,
        "<rect x=\"{q1:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"12\" class=\"box\"/>\
         <line x1=\"{m:.1}\" x2=\"{m:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" class=\"median\"/>",
        middle - 6.0,
        (q3 - q1).max(1.0),
        middle - 6.0,
        middle + 6.0,
        m = x(spread.median),
    );
    match values.len() > DOTS_MAX {
        true => draw_histogram(&mut svg, values, spread),
        false => draw_dots(&mut svg, values, &x),
    }
    let mean = x(spread.mean);
    if let Some([low, high]) = spread.mean_interval.map(|i| i.map(x)) {
        let _ = write!(
            svg,
            "<line x1=\"{low:.1}\" x2=\"{high:.1}\" y1=\"{middle}\" y2=\"{middle}\" class=\"mean\" stroke-width=\"2\"/>"
        );
    }
    let _ = write!(svg, "<path d=\"M{mean:.1} {:.1}l4 4l-4 4l-4 -4z\" class=\"mean\"/></svg>", middle - 4.0);
    svg
}

/// Points of sessions, and what they are compared with.
pub struct PointsHistogram<'a> {
    pub points: &'a [f64],
    /// Most points that can be had.
    pub most: f64,
    pub mark: Option<f64>,
    /// Points of the session that is pointed out.
    pub own: Option<f64>,
}

/// Texts of a histogram of points.
pub struct HistogramLabels {
    /// Description for readers who cannot see the drawing.
    pub alt: String,
    /// Text at the pass mark; `None` without one.
    pub mark: Option<String>,
    /// Text at the points of the session that is pointed out.
    pub own: String,
    /// Titles of the axes.
    pub points: String,
    pub sessions: String,
}

/// Number of sessions by points in twenty equal classes, each from its lower bound to below the next, the last with its
/// upper bound; a line at the pass mark.
pub fn points_histogram(data: &PointsHistogram, labels: &HistogramLabels) -> String {
    const SIZE: (f64, f64) = (620.0, 220.0);
    const LEFT: f64 = 44.0;
    const RIGHT: f64 = 14.0;
    const TOP: f64 = 40.0;
    const BOTTOM: f64 = 40.0;
    const CLASSES: usize = 20;
    let PointsHistogram { points, most, mark, own } = *data;
    let most = if most > 0.0 { most } else { 1.0 };
    let mut counts = [0u32; CLASSES];
    for value in points {
        counts[((value / most * CLASSES as f64) as usize).min(CLASSES - 1)] += 1;
    }
    let tallest = counts.iter().copied().max().unwrap_or(0).max(1);
    let x = |value: f64| LEFT + (SIZE.0 - LEFT - RIGHT) * (value / most).clamp(0.0, 1.0);
    let y = |count: f64| SIZE.1 - BOTTOM - (SIZE.1 - BOTTOM - TOP) * count / f64::from(tallest);
    let mut svg = format!(
        "<svg class=\"histogram\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
        SIZE.0,
        SIZE.1,
        escape(&labels.alt)
    );
    for (class, &count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
        let (from, to) = (x(most * class as f64 / CLASSES as f64), x(most * (class + 1) as f64 / CLASSES as f64));
        let top = y(f64::from(count));
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" class=\"dot\" fill-opacity=\".75\"/>",
            from + 1.0,
            to - from - 2.0,
            SIZE.1 - BOTTOM - top,
        );
    }
    let base = SIZE.1 - BOTTOM;
    let _ =
        write!(svg, "<line x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{base}\" y2=\"{base}\" class=\"axis\"/>", SIZE.0 - RIGHT);
    for count in [0, tallest] {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" class=\"soft\">{count}</text>",
            LEFT - 6.0,
            y(f64::from(count)) + 4.0
        );
    }
    for step in 0..=5 {
        let value = most * f64::from(step) / 5.0;
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" class=\"soft\">{}</text>",
            x(value),
            base + 15.0,
            display_format::plain_number(value)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" class=\"soft\">{}</text>\
         <text x=\"12\" y=\"{:.1}\" text-anchor=\"middle\" class=\"soft\" transform=\"rotate(-90 12 {:.1})\">{}</text>",
        0.5 * (LEFT + SIZE.0 - RIGHT),
        SIZE.1 - 6.0,
        escape(&labels.points),
        0.5 * (TOP + base),
        0.5 * (TOP + base),
        escape(&labels.sessions)
    );
    if let (Some(mark), Some(text)) = (mark, &labels.mark) {
        draw_flag(&mut svg, (x(mark), TOP - 6.0, base), "mark", text, SIZE.0);
    }
    if let Some(own) = own {
        draw_flag(&mut svg, (x(own), TOP - 22.0, base), "own", &labels.own, SIZE.0);
    }
    svg + "</svg>"
}

/// A vertical line with a text at its upper end, to the left of it in the right half of the drawing.
fn draw_flag(svg: &mut String, (x, top, base): (f64, f64, f64), class: &str, text: &str, width: f64) {
    let (at, anchor) = if x > 0.5 * width { (x - 4.0, "end") } else { (x + 4.0, "start") };
    let _ = write!(
        svg,
        "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{:.1}\" y2=\"{base}\" class=\"{class}\"/>\
         <text x=\"{at:.1}\" y=\"{top:.1}\" text-anchor=\"{anchor}\" class=\"{class}\">{}</text>",
        top - 8.0,
        escape(text)
    );
}

/// Dots that would cover each other are stacked.
fn draw_dots(svg: &mut String, values: &[f64], x: &dyn Fn(f64) -> f64) {
    const APART: f64 = 5.0;
    let mut stacked: BTreeMap<i64, u32> = BTreeMap::new();
    for &value in values {
        let place = stacked.entry((x(value) / APART).round() as i64).or_insert(0);
        let y = 14.0 - 4.0 * f64::from((*place).min(3));
        *place += 1;
        let _ =
            write!(svg, "<circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"2.2\" class=\"dot\" fill-opacity=\".6\"/>", x(value));
    }
}

fn draw_histogram(svg: &mut String, values: &[f64], spread: &SpreadFile) {
    let room = (spread.max - spread.min).max(1e-12);
    let mut counts = [0u32; COLUMNS];
    for value in values {
        let place = (value - spread.min) / room * COLUMNS as f64;
        counts[(place as usize).min(COLUMNS - 1)] += 1;
    }
    let most = f64::from(counts.iter().copied().max().unwrap_or(1).max(1));
    let wide = (STRIP.0 - 2.0 * EDGE) / COLUMNS as f64;
    for (column, &count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
        let tall = (17.0 * f64::from(count) / most).max(0.8);
        let x = EDGE + wide * column as f64;
        let _ = write!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{tall:.1}\" class=\"dot\" fill-opacity=\".7\"/>",
            19.0 - tall,
            wide - 0.6
        );
    }
}

/// Bar chart of the frequency of each answer from 1 to `steps`.
pub fn answer_histogram(counts: &BTreeMap<String, usize>, steps: usize, alt: &str) -> String {
    const WIDE: f64 = 18.0;
    let most = counts.values().copied().max().unwrap_or(1).max(1) as f64;
    let width = WIDE * steps as f64;
    let mut svg =
        format!("<svg class=\"answers\" viewBox=\"0 0 {width} 40\" role=\"img\" aria-label=\"{}\">", escape(alt));
    for step in 1..=steps {
        let count = counts.get(&step.to_string()).copied().unwrap_or(0);
        let (x, tall) = (WIDE * (step - 1) as f64, 14.0 * count as f64 / most);
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" class=\"dot\" fill-opacity=\".7\"/>\
             <text x=\"{m:.1}\" y=\"39\" text-anchor=\"middle\" class=\"soft\">{step}</text>",
            x + 2.0,
            27.0 - tall,
            WIDE - 4.0,
            tall.max(0.6),
            m = x + 0.5 * WIDE,
        );
        if count > 0 {
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" class=\"ink\">{count}</text>",
                x + 0.5 * WIDE,
                25.0 - tall
            );
        }
    }
    svg + "</svg>"
}

/// Texts of a drawing of learning curves.
pub struct CurveLabels {
    /// Description for readers who cannot see the drawing.
    pub alt: String,
    /// Title of the horizontal axis.
    pub attempt: String,
}

/// A thin line for each participant over their attempts, the mean of each attempt with its interval in bold.
pub fn learning_curves(progress: &LearningCurves, measure: &str, labels: &CurveLabels) -> String {
    const SIZE: (f64, f64) = (440.0, 230.0);
    const LEFT: f64 = 76.0;
    const BOTTOM: f64 = 34.0;
    const TOP: f64 = 14.0;
    let all = || progress.participants.iter().flat_map(|p| p.values.iter().flatten().copied());
    let (low, high) = all().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let longest = progress.participants.iter().map(|p| p.values.len()).max().unwrap_or(1);
    let room = if high > low { high - low } else { 1.0 };
    let x = |n: usize| LEFT + (SIZE.0 - LEFT - 16.0) * n as f64 / (longest - 1).max(1) as f64;
    let y = |v: f64| SIZE.1 - BOTTOM - (SIZE.1 - BOTTOM - TOP) * ((v - low) / room).clamp(-0.02, 1.02);
    let mut svg = format!(
        "<svg class=\"curves\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
        SIZE.0,
        SIZE.1,
        escape(&labels.alt)
    );
    for value in [low, high] {
        let at = y(value);
        let label = escape(&display_format::measure(measure, Some(value)));
        let _ = write!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{:.0}\" y1=\"{at:.1}\" y2=\"{at:.1}\" class=\"axis\"/>\
             <text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\" class=\"soft\">{label}</text>",
            SIZE.0 - 10.0,
            LEFT - 6.0,
            at + 4.0
        );
    }
    let every = longest.div_ceil(12);
    for n in (0..longest).filter(|n| n % every == 0) {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" class=\"soft\">{}</text>",
            x(n),
            SIZE.1 - 16.0,
            n + 1
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" class=\"soft\">{}</text>",
        0.5 * (LEFT + SIZE.0),
        SIZE.1 - 2.0,
        escape(&labels.attempt)
    );
    // Many lines stay a veil through which the mean is seen.
    let faint = (15.0 / progress.participants.len() as f64).clamp(0.05, 0.45);
    for person in &progress.participants {
        let points = person.values.iter().enumerate().filter_map(|(n, v)| Some(format!("{:.1},{:.1}", x(n), y((*v)?))));
        let name = escape(&display_format::sanitize_display(&person.participant, 60));
        let points = points.collect::<Vec<_>>().join(" ");
        let _ = write!(
            svg,
            "<polyline points=\"{points}\" class=\"person\" stroke-opacity=\"{faint:.2}\"><title>{name}</title></polyline>"
        );
    }
    let means: Vec<String> =
        progress.by_attempt.iter().enumerate().map(|(n, s)| format!("{:.1},{:.1}", x(n), y(s.mean))).collect();
    let _ = write!(svg, "<polyline points=\"{}\" class=\"mean line\" stroke-width=\"3\"/>", means.join(" "));
    for (n, spread) in progress.by_attempt.iter().enumerate() {
        let (at, mean) = (x(n), y(spread.mean));
        if let Some([low, high]) = spread.mean_interval {
            let _ = write!(
                svg,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" class=\"mean\" stroke-width=\"1.5\"/>",
                y(low),
                y(high)
            );
        }
        let _ = write!(svg, "<circle cx=\"{at:.1}\" cy=\"{mean:.1}\" r=\"4\" class=\"mean\"/>");
    }
    svg + "</svg>"
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
