//! Small drawings for the cohort's page, as SVG.

use super::progress::LearningCurves;
use super::summary::SpreadFile;
use crate::display_format;
use std::collections::BTreeMap;
use std::fmt::{Display, Write};

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
    let mut svg = open_svg("strip", STRIP, alt);
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

/// Size of a histogram of points, and the room around its bars. In units of the SVG.
const HISTOGRAM: (f64, f64) = (620.0, 220.0);
const HISTOGRAM_LEFT: f64 = 44.0;
const HISTOGRAM_RIGHT: f64 = 14.0;
const HISTOGRAM_TOP: f64 = 40.0;

/// Height at which the bars stand.
const HISTOGRAM_BASE: f64 = HISTOGRAM.1 - 40.0;

/// Number of classes of points.
const CLASSES: usize = 20;

/// Number of sessions by points in twenty equal classes, each from its lower bound to below the next, the last with its
/// upper bound; a line at the pass mark.
pub fn points_histogram(data: &PointsHistogram, labels: &HistogramLabels) -> String {
    let PointsHistogram { points, most, mark, own } = *data;
    let most = if most > 0.0 { most } else { 1.0 };
    let mut counts = [0u32; CLASSES];
    for value in points {
        counts[((value / most * CLASSES as f64) as usize).min(CLASSES - 1)] += 1;
    }
    let scale = HistogramScale { most, tallest: counts.iter().copied().max().unwrap_or(0).max(1) };
    let mut svg = open_svg("histogram", HISTOGRAM, &labels.alt);
    draw_classes(&mut svg, &counts, &scale);
    draw_histogram_axes(&mut svg, &scale, labels);
    if let (Some(mark), Some(text)) = (mark, &labels.mark) {
        draw_flag(&mut svg, (scale.x(mark), HISTOGRAM_TOP - 6.0, HISTOGRAM_BASE), "mark", text, HISTOGRAM.0);
    }
    if let Some(own) = own {
        draw_flag(&mut svg, (scale.x(own), HISTOGRAM_TOP - 22.0, HISTOGRAM_BASE), "own", &labels.own, HISTOGRAM.0);
    }
    svg + "</svg>"
}

/// Scale of a histogram of points: points to the right, numbers of sessions upwards.
struct HistogramScale {
    /// Most points that can be had; above 0.
    most: f64,
    /// Number of sessions in the fullest class; at least 1.
    tallest: u32,
}

impl HistogramScale {
    fn x(&self, points: f64) -> f64 {
        HISTOGRAM_LEFT + (HISTOGRAM.0 - HISTOGRAM_LEFT - HISTOGRAM_RIGHT) * (points / self.most).clamp(0.0, 1.0)
    }

    fn y(&self, count: u32) -> f64 {
        HISTOGRAM_BASE - (HISTOGRAM_BASE - HISTOGRAM_TOP) * f64::from(count) / f64::from(self.tallest)
    }
}

fn draw_classes(svg: &mut String, counts: &[u32; CLASSES], scale: &HistogramScale) {
    let bound = |class: usize| scale.x(scale.most * class as f64 / CLASSES as f64);
    for (class, &count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
        let (from, to, top) = (bound(class), bound(class + 1), scale.y(count));
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" class=\"dot\" fill-opacity=\".75\"/>",
            from + 1.0,
            to - from - 2.0,
            HISTOGRAM_BASE - top,
        );
    }
}

fn draw_histogram_axes(svg: &mut String, scale: &HistogramScale, labels: &HistogramLabels) {
    let _ = write!(
        svg,
        "<line x1=\"{HISTOGRAM_LEFT}\" x2=\"{:.1}\" y1=\"{HISTOGRAM_BASE}\" y2=\"{HISTOGRAM_BASE}\" class=\"axis\"/>",
        HISTOGRAM.0 - HISTOGRAM_RIGHT
    );
    for count in [0, scale.tallest] {
        draw_label(svg, (HISTOGRAM_LEFT - 6.0, scale.y(count) + 4.0), "end", count);
    }
    for step in 0..=5 {
        let value = scale.most * f64::from(step) / 5.0;
        let text = display_format::plain_number(value);
        draw_label(svg, (scale.x(value), HISTOGRAM_BASE + 15.0), "middle", text);
    }
    let middle = 0.5 * (HISTOGRAM_LEFT + HISTOGRAM.0 - HISTOGRAM_RIGHT);
    draw_label(svg, (middle, HISTOGRAM.1 - 6.0), "middle", escape(&labels.points));
    let _ = write!(
        svg,
        "<text x=\"12\" y=\"{y:.1}\" text-anchor=\"middle\" class=\"soft\" \
         transform=\"rotate(-90 12 {y:.1})\">{}</text>",
        escape(&labels.sessions),
        y = 0.5 * (HISTOGRAM_TOP + HISTOGRAM_BASE),
    );
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
    let mut svg = open_svg("answers", (WIDE * steps as f64, 40.0), alt);
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

/// Size of a drawing of learning curves, and the room around the curves. In units of the SVG.
const CURVES: (f64, f64) = (440.0, 230.0);
const CURVES_LEFT: f64 = 76.0;
const CURVES_RIGHT: f64 = 16.0;
const CURVES_TOP: f64 = 14.0;

/// Height of the lowest value.
const CURVES_BASE: f64 = CURVES.1 - 34.0;

/// A thin line for each participant over their attempts, the mean of each attempt with its interval in bold.
pub fn learning_curves(progress: &LearningCurves, measure: &str, labels: &CurveLabels) -> String {
    let scale = CurveScale::of(progress);
    let mut svg = open_svg("curves", CURVES, &labels.alt);
    draw_curve_axes(&mut svg, &scale, measure, labels);
    draw_participants(&mut svg, progress, &scale);
    draw_means(&mut svg, progress, &scale);
    svg + "</svg>"
}

/// Scale of learning curves: attempts to the right, values upwards.
struct CurveScale {
    /// Most attempts of a participant.
    longest: usize,
    low: f64,
    high: f64,
}

impl CurveScale {
    fn of(progress: &LearningCurves) -> CurveScale {
        let all = progress.participants.iter().flat_map(|p| p.values.iter().flatten().copied());
        let (low, high) = all.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        let longest = progress.participants.iter().map(|p| p.values.len()).max().unwrap_or(1);
        CurveScale { longest, low, high }
    }

    /// Place of an attempt, counted from 0.
    fn x(&self, attempt: usize) -> f64 {
        CURVES_LEFT + (CURVES.0 - CURVES_LEFT - CURVES_RIGHT) * attempt as f64 / (self.longest - 1).max(1) as f64
    }

    fn y(&self, value: f64) -> f64 {
        let room = if self.high > self.low { self.high - self.low } else { 1.0 };
        CURVES_BASE - (CURVES_BASE - CURVES_TOP) * ((value - self.low) / room).clamp(-0.02, 1.02)
    }
}

fn draw_curve_axes(svg: &mut String, scale: &CurveScale, measure: &str, labels: &CurveLabels) {
    for value in [scale.low, scale.high] {
        let at = scale.y(value);
        let label = escape(&display_format::measure(measure, Some(value)));
        let _ = write!(
            svg,
            "<line x1=\"{CURVES_LEFT}\" x2=\"{:.0}\" y1=\"{at:.1}\" y2=\"{at:.1}\" class=\"axis\"/>\
             <text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\" class=\"soft\">{label}</text>",
            CURVES.0 - 10.0,
            CURVES_LEFT - 6.0,
            at + 4.0
        );
    }
    let every = scale.longest.div_ceil(12);
    for attempt in (0..scale.longest).filter(|attempt| attempt % every == 0) {
        draw_label(svg, (scale.x(attempt), CURVES.1 - 16.0), "middle", attempt + 1);
    }
    draw_label(svg, (0.5 * (CURVES_LEFT + CURVES.0), CURVES.1 - 2.0), "middle", escape(&labels.attempt));
}

fn draw_participants(svg: &mut String, progress: &LearningCurves, scale: &CurveScale) {
    // Many lines stay a veil through which the mean is seen.
    let faint = (15.0 / progress.participants.len() as f64).clamp(0.05, 0.45);
    for person in &progress.participants {
        let values = person.values.iter().enumerate();
        let points = values.filter_map(|(n, v)| Some(format!("{:.1},{:.1}", scale.x(n), scale.y((*v)?))));
        let name = escape(&display_format::sanitize_display(&person.participant, 60));
        let points = points.collect::<Vec<_>>().join(" ");
        let _ = write!(
            svg,
            "<polyline points=\"{points}\" class=\"person\" stroke-opacity=\"{faint:.2}\"><title>{name}</title></polyline>"
        );
    }
}

fn draw_means(svg: &mut String, progress: &LearningCurves, scale: &CurveScale) {
    let means = progress.by_attempt.iter().enumerate();
    let points: Vec<String> = means.clone().map(|(n, s)| format!("{:.1},{:.1}", scale.x(n), scale.y(s.mean))).collect();
    let _ = write!(svg, "<polyline points=\"{}\" class=\"mean line\" stroke-width=\"3\"/>", points.join(" "));
    for (n, spread) in means {
        let (at, mean) = (scale.x(n), scale.y(spread.mean));
        if let Some([low, high]) = spread.mean_interval {
            let _ = write!(
                svg,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" class=\"mean\" stroke-width=\"1.5\"/>",
                scale.y(low),
                scale.y(high)
            );
        }
        let _ = write!(svg, "<circle cx=\"{at:.1}\" cy=\"{mean:.1}\" r=\"4\" class=\"mean\"/>");
    }
}

/// Beginning of a drawing: its class, its size and its description.
fn open_svg(class: &str, (width, height): (f64, f64), alt: &str) -> String {
    let alt = escape(alt);
    format!("<svg class=\"{class}\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{alt}\">")
}

/// A number or a title beside an axis. The text is escaped already.
fn draw_label(svg: &mut String, (x, y): (f64, f64), anchor: &str, text: impl Display) {
    let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" class=\"soft\">{text}</text>");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
