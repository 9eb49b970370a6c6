//! Force, speed and progress over time, as one SVG.

use super::display_format;
use super::language::{Languages, Message, escape_html};
use std::fmt::Write;
use typodont_exercise::score::{Trace, TraceSample};

/// A stage's name and its start and end, s.
pub struct StageSpan<'a> {
    pub title: &'a str,
    pub from: f64,
    pub to: f64,
}

/// A moment that cost points: its number, when it was worst, and from when to when it lasted, s.
pub struct EventFlag {
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

/// Position of the flags; number of rows, so that neighbouring flags do not hide each other; and width of a flag. In
/// units of the SVG.
const FLAGS_TOP: f64 = 27.0;
const FLAG_ROWS: usize = 2;
const FLAG_WIDTH: f64 = 19.0;

/// One curve: its title, unit and values.
struct PlottedCurve<'a> {
    /// Language key of its title.
    key: &'a str,
    unit: &'a str,
    values: Vec<f64>,
    /// Top of the scale.
    scale_max: f64,
    color: &'a str,
}

/// The curves of a session, with its stages and flags; empty for a session without a tick.
///
/// Without decay, the curve of cleared decay is left out.
///
/// The attributes `data-seconds`, `data-left` and `data-right` give the time scale to the page's script.
pub fn svg(trace: &Trace, has_decay: bool, stages: &[StageSpan], flags: &[EventFlag], languages: &Languages) -> String {
    let Some(last) = trace.samples.last() else { return String::new() };
    let seconds = last.at.seconds();
    let curves = plotted_curves(trace, has_decay);
    let height = TOP + curves.len() as f64 * (BAND_HEIGHT + BAND_GAP) + 14.0;
    let x = |s: f64| LEFT + (WIDTH - LEFT - RIGHT) * s / seconds.max(1e-9);
    let mut svg = format!(
        "<svg id=\"curves\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"group\" aria-labelledby=\"curves-title\" \
         data-seconds=\"{seconds:.3}\" data-left=\"{LEFT}\" data-right=\"{:.0}\" \
         font-family=\"sans-serif\" font-size=\"12\">",
        WIDTH - RIGHT
    );
    let bottom = height - 34.0;
    draw_stages(&mut svg, stages, bottom, &x);
    for (index, curve) in curves.iter().enumerate() {
        let top = TOP + index as f64 * (BAND_HEIGHT + BAND_GAP);
        draw_curve(&mut svg, curve, top, &|i| x(trace.samples[i].at.seconds()), languages);
    }
    draw_flags(&mut svg, flags, bottom, &x);
    draw_time_axis(&mut svg, seconds, height - 8.0, &x);
    svg + "</svg>"
}

/// The curves of a session, from top to bottom.
fn plotted_curves(trace: &Trace, has_decay: bool) -> Vec<PlottedCurve<'static>> {
    let value = |f: fn(&TraceSample) -> f32| trace.samples.iter().map(|s| f64::from(f(s))).collect::<Vec<_>>();
    let highest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let (force, speed) = (value(|s| s.force), value(|s| if s.touched { s.speed } else { 0.0 }));
    let mut curves = vec![
        PlottedCurve {
            key: "curve.force",
            unit: "N",
            scale_max: nice_ceiling(highest(&force)),
            values: force,
            color: "#b04a00",
        },
        PlottedCurve {
            key: "curve.speed",
            unit: "mm/s",
            scale_max: nice_ceiling(highest(&speed)),
            values: speed,
            color: "#0b6ea8",
        },
    ];
    if has_decay {
        let values = value(|s| s.cleared);
        curves.push(PlottedCurve { key: "curve.cleared", unit: "%", scale_max: 100.0, values, color: "#22794f" });
    }
    curves
}

/// A dashed line at the beginning of each stage, with its title if there is room.
fn draw_stages(svg: &mut String, stages: &[StageSpan], bottom: f64, x: &dyn Fn(f64) -> f64) {
    for stage in stages {
        let (from, to) = (x(stage.from), x(stage.to));
        let _ = write!(
            svg,
            "<line x1=\"{from:.1}\" x2=\"{from:.1}\" y1=\"14\" y2=\"{bottom:.1}\" stroke=\"#999\" stroke-dasharray=\"3 3\"/>"
        );
        if to - from > 60.0 {
            let title = escape_html(&truncate(stage.title, ((to - from) / 6.5) as usize));
            let _ = write!(svg, "<text x=\"{:.1}\" y=\"11\" fill=\"#444\">{title}</text>", from + 4.0);
        }
    }
}

/// Round moments below the curves.
fn draw_time_axis(svg: &mut String, seconds: f64, y: f64, x: &dyn Fn(f64) -> f64) {
    for moment in time_ticks(seconds) {
        let at = x(moment);
        let label = if seconds < 60.0 {
            format!("{moment:.0} s")
        } else {
            format!("{}:{:02}", moment as u64 / 60, moment as u64 % 60)
        };
        let _ = write!(svg, "<text x=\"{at:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"#444\">{label}</text>");
    }
}

/// A numbered flag over each moment that cost points, and a bar as long as it lasted.
fn draw_flags(svg: &mut String, flags: &[EventFlag], bottom: f64, x: &dyn Fn(f64) -> f64) {
    let mut taken = [f64::NEG_INFINITY; FLAG_ROWS];
    let mut in_time: Vec<&EventFlag> = flags.iter().collect();
    in_time.sort_by(|a, b| a.at.total_cmp(&b.at));
    for EventFlag { number, at, span } in in_time {
        let middle = x(*at);
        let is_free = |row: &usize| middle - taken[*row] >= FLAG_WIDTH;
        let most_room = || (0..FLAG_ROWS).min_by(|a, b| taken[*a].total_cmp(&taken[*b])).unwrap_or(0);
        let row = (0..FLAG_ROWS).find(is_free).unwrap_or_else(most_room);
        // Moved aside where every row is taken, so that each flag can be clicked.
        let flag = middle.max(taken[row] + FLAG_WIDTH);
        taken[row] = flag;
        let y = FLAGS_TOP + row as f64 * FLAG_WIDTH * 0.95;
        let _ = write!(
            svg,
            "<g class=\"mark\" role=\"button\" tabindex=\"0\" data-mark=\"{number}\" aria-label=\"{number}: {}\">",
            display_format::duration(*at)
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
            "<line x1=\"{flag:.1}\" x2=\"{middle:.1}\" y1=\"{:.1}\" y2=\"{bottom:.1}\"/>\
             <circle cx=\"{flag:.1}\" cy=\"{y:.1}\" r=\"9\"/>\
             <text x=\"{flag:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{number}</text></g>",
            y + 9.0,
            y + 4.0
        );
    }
}

fn draw_curve(svg: &mut String, curve: &PlottedCurve, top: f64, x: &dyn Fn(usize) -> f64, languages: &Languages) {
    let bottom = top + BAND_HEIGHT;
    let y = |v: f64| bottom - BAND_HEIGHT * (v / curve.scale_max).clamp(0.0, 1.0);
    let full = display_format::number(curve.scale_max).trim_end_matches('0').trim_end_matches('.').to_string();
    let _ = write!(
        svg,
        "<text x=\"4\" y=\"{:.1}\" fill=\"#222\" font-weight=\"bold\">{}</text>",
        top - 9.0,
        languages.svg(&Message::text(curve.key, &[]))
    );
    for (value, label) in [(0.0, "0".to_string()), (curve.scale_max, format!("{full} {}", curve.unit))] {
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
    let points = downsample_max(&curve.values).into_iter().map(|(i, v)| format!("{:.1},{:.1}", x(i), y(v)));
    let points = points.collect::<Vec<_>>().join(" ");
    let _ =
        write!(svg, "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\" points=\"{points}\"/>", curve.color);
}

/// At most 800 points: of each group its highest, so that no peak is lost.
fn downsample_max(values: &[f64]) -> Vec<(usize, f64)> {
    let group = values.len().div_ceil(800).max(1);
    let highest = |(g, chunk): (usize, &[f64])| {
        let (i, v) =
            chunk.iter().enumerate().fold((0, f64::MIN), |best, (i, &v)| if v > best.1 { (i, v) } else { best });
        (g * group + i, v)
    };
    values.chunks(group).enumerate().map(highest).collect()
}

/// The next of 1, 2, 5, 10 … above a value.
fn nice_ceiling(value: f64) -> f64 {
    if value <= 0.0 {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::log10(value).floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|&n| n >= value * 0.9999).unwrap_or(10.0 * power)
}

/// Five to ten round moments.
fn time_ticks(seconds: f64) -> Vec<f64> {
    let steps = [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0];
    let step = steps.into_iter().find(|s| seconds / s <= 10.0).unwrap_or(3600.0);
    (0..=(seconds / step) as u32).map(|i| f64::from(i) * step).collect()
}

fn truncate(text: &str, most: usize) -> String {
    match text.chars().count() > most {
        true => text.chars().take(most.saturating_sub(1)).chain(['…']).collect(),
        false => text.to_string(),
    }
}
