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
        "<rect x=\"{q1:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"12\" fill=\"#dbe7f0\" stroke=\"#7a98ad\"/>\
         <line x1=\"{m:.1}\" x2=\"{m:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" stroke=\"#345\" stroke-width=\"1.5\"/>",
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
            "<line x1=\"{low:.1}\" x2=\"{high:.1}\" y1=\"{middle}\" y2=\"{middle}\" stroke=\"#a03c00\" stroke-width=\"2\"/>"
        );
    }
    let _ = write!(svg, "<path d=\"M{mean:.1} {:.1}l4 4l-4 4l-4 -4z\" fill=\"#a03c00\"/></svg>", middle - 4.0);
    svg
}

/// Dots that would cover each other are stacked.
fn draw_dots(svg: &mut String, values: &[f64], x: &dyn Fn(f64) -> f64) {
    const APART: f64 = 5.0;
    let mut stacked: BTreeMap<i64, u32> = BTreeMap::new();
    for &value in values {
        let place = stacked.entry((x(value) / APART).round() as i64).or_insert(0);
        let y = 14.0 - 4.0 * f64::from((*place).min(3));
        *place += 1;
        let _ = write!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"2.2\" fill=\"#0b6ea8\" fill-opacity=\".6\"/>",
            x(value)
        );
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
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{tall:.1}\" fill=\"#0b6ea8\" fill-opacity=\".7\"/>",
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
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#0b6ea8\" fill-opacity=\".7\"/>\
             <text x=\"{m:.1}\" y=\"39\" text-anchor=\"middle\" fill=\"#57606a\">{step}</text>",
            x + 2.0,
            27.0 - tall,
            WIDE - 4.0,
            tall.max(0.6),
            m = x + 0.5 * WIDE,
        );
        if count > 0 {
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#222\">{count}</text>",
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
            "<line x1=\"{LEFT}\" x2=\"{:.0}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#d5dae0\"/>\
             <text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#57606a\">{label}</text>",
            SIZE.0 - 10.0,
            LEFT - 6.0,
            at + 4.0
        );
    }
    let every = longest.div_ceil(12);
    for n in (0..longest).filter(|n| n % every == 0) {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#57606a\">{}</text>",
            x(n),
            SIZE.1 - 16.0,
            n + 1
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#57606a\">{}</text>",
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
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"#0b6ea8\" stroke-opacity=\"{faint:.2}\"><title>{name}</title></polyline>"
        );
    }
    let means: Vec<String> =
        progress.by_attempt.iter().enumerate().map(|(n, s)| format!("{:.1},{:.1}", x(n), y(s.mean))).collect();
    let _ =
        write!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"#a03c00\" stroke-width=\"3\"/>", means.join(" "));
    for (n, spread) in progress.by_attempt.iter().enumerate() {
        let (at, mean) = (x(n), y(spread.mean));
        if let Some([low, high]) = spread.mean_interval {
            let _ = write!(
                svg,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" stroke=\"#a03c00\" stroke-width=\"1.5\"/>",
                y(low),
                y(high)
            );
        }
        let _ = write!(svg, "<circle cx=\"{at:.1}\" cy=\"{mean:.1}\" r=\"4\" fill=\"#a03c00\"/>");
    }
    svg + "</svg>"
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
