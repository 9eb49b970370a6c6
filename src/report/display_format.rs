//! Numbers, durations and texts formatted for display.

use typodont_exercise::scenario::Metric;

/// A duration as minutes and seconds, `4:14.4`; under a minute as seconds, `9.5 s`; under one, `0.05 s`.
pub fn duration(seconds: f64) -> String {
    let tenths = (seconds.max(0.0) * 10.0).round() as u64;
    match tenths {
        0..10 if seconds > 0.0 => format!("{seconds:.2} s"),
        0..600 => format!("{}.{} s", tenths / 10, tenths % 10),
        _ => format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10),
    }
}

/// A number with one decimal from 100, two from 1, and three below.
pub fn number(value: f64) -> String {
    let decimals = match value.abs() {
        v if v >= 100.0 => 1,
        v if v >= 1.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.decimals$}");
    // A number that rounds to zero is shown as 0, without a sign.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".into() } else { text }
}

/// A number with a number of significant digits, and no zeros behind the point: 43.01 is 43, 2.917 is 2.9, 0.2243 is 0.22.
/// Whole parts keep all their digits.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return number(value);
    }
    let decimals_of = |v: f64| (digits as i32 - 1 - v.abs().log10().floor() as i32).max(0) as usize;
    // 9.96 with two digits is 10, not 10.0.
    let decimals = decimals_of(value);
    let rounded: f64 = format!("{value:.decimals$}").parse().unwrap_or(value);
    let decimals = if rounded == 0.0 { decimals } else { decimals.min(decimals_of(rounded)) };
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.into() }
}

/// Points as a reader meets them: whole, or with as many decimals as it takes to show on which side of the pass mark they
/// are.
pub fn points(points: f64, pass_points: f64) -> String {
    let text = |decimals: usize| format!("{points:.decimals$}");
    let is_told =
        |text: &String| text.parse::<f64>().is_ok_and(|shown| (shown < pass_points) == (points < pass_points));
    let told = (0..6).map(text).find(is_told).unwrap_or_else(|| plain_number(points));
    if told == "-0" { "0".into() } else { told }
}

/// Points of one criterion: two digits, or as many as it takes that lost points are not shown as none, nor few as none.
pub fn item_points(points: f64, max_points: f64) -> String {
    let is_told = |text: &String| {
        text.parse::<f64>()
            .is_ok_and(|shown| (shown < max_points) == (points < max_points) && (shown > 0.0) == (points > 0.0))
    };
    (2..8).map(|digits| significant(points, digits)).find(is_told).unwrap_or_else(|| plain_number(points))
}

/// Significant digits of a measure: lengths, forces, volumes and times carry two, since a voxel is a tenth of a
/// millimetre and a device a hundredth of its force; percentages carry three, so that 99.6 % is not 100 %.
fn digits_of(unit: &str) -> usize {
    if unit == "%" { 3 } else { 2 }
}

/// A measured value with its unit, in no more digits than the measure has; "—" where there is none.
pub fn measured(name: &str, value: Option<f64>) -> String {
    let unit = Metric::parse(name).map_or("", |m| m.info.unit);
    match (name, unit, value) {
        ("pulp_exposed" | "detect_tooth" | "detect_quadrant", _, _) | (_, "s", _) | (_, _, None) => {
            measure(name, value)
        }
        (_, unit, Some(value)) => with_unit(significant(value, digits_of(unit)), unit),
    }
}

/// A value that an author wrote, with the unit of its measure and all its digits.
pub fn written(name: &str, value: f64) -> String {
    let unit = Metric::parse(name).map_or("", |m| m.info.unit);
    match (name, unit) {
        ("pulp_exposed" | "detect_tooth" | "detect_quadrant", _) => measure(name, Some(value)),
        (_, "s") if value >= 60.0 => duration(value),
        (_, unit) => with_unit(plain_number(value), unit),
    }
}

fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// A measure's value with its unit; "—" where there is none.
pub fn measure(name: &str, value: Option<f64>) -> String {
    let Some(value) = value else { return "—".into() };
    let info = Metric::parse(name).map(|m| m.info);
    let unit = info.map_or("", |a| a.unit);
    match (name, unit) {
        ("pulp_exposed", _) => yes_no(value != 0.0).into(),
        ("detect_tooth" | "detect_quadrant", _) => (if value != 0.0 { "right" } else { "wrong" }).into(),
        ("detect_trials_right", _) => plain_number(value),
        (_, "s") => duration(value),
        (_, "") => number(value),
        (_, "%") => format!("{} %", number(value)),
        (_, unit) => format!("{} {unit}", number(value)),
    }
}

/// A number as it was written: 70, not 70.00.
pub fn plain_number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    rounded.to_string()
}

/// A text that a person wrote, made safe for one line of a terminal or a table: at most `max_letters` characters,
/// without control characters and characters that change the direction of reading.
pub fn sanitize_display(text: &str, max_letters: usize) -> String {
    let is_bidi_control =
        |c: char| matches!(c, '\u{061c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let safe = text.chars().map(|c| {
        if c.is_control() || is_bidi_control(c) || c == '\u{2028}' || c == '\u{2029}' { '\u{fffd}' } else { c }
    });
    let mut safe: Vec<char> = safe.take(max_letters + 1).collect();
    if safe.len() > max_letters {
        safe.truncate(max_letters.saturating_sub(1));
        safe.push('…');
    }
    safe.into_iter().collect()
}

pub fn yes_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// English title of a measure; for an unknown measure, its name.
pub fn measure_title(name: &str) -> String {
    match Metric::parse(name) {
        Ok(Metric { info: about, argument: None }) => about.title.into(),
        Ok(Metric { info: about, argument: Some(argument) }) => match argument {
            typodont_exercise::scenario::metric::MetricArgument::Zone(zone) => format!("{}: {zone}", about.title),
            typodont_exercise::scenario::metric::MetricArgument::ToleranceMm(mm) => {
                format!("{} within {mm} mm", about.title)
            }
        },
        Err(_) => name.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_were_lost_are_never_shown_as_full() {
        for (value, of, text) in [(9.96, 10.0, "9.96"), (99.7, 100.0, "99.7"), (10.0, 10.0, "10"), (69.6, 100.0, "70")]
        {
            assert_eq!(item_points(value, of), text, "{value} of {of}");
        }
        assert_eq!([item_points(0.0, 10.0), item_points(0.0004, 10.0)], ["0", "0.0004"]);
    }

    #[test]
    fn no_more_digits_are_shown_than_a_measure_has() {
        for (value, text) in [
            (43.01, "43"),
            (2.917, "2.9"),
            (0.2243, "0.22"),
            (9.96, "10"),
            (1234.5, "1234"),
            (0.0, "0"),
            (2.0, "2"),
            (0.996, "1"),
            (-0.004, "-0.004"),
        ] {
            assert_eq!(significant(value, 2), text, "{value}");
        }
        for (name, value, text) in [
            ("force_max_n", 3.317, "3.3 N"),
            ("decay_cleared_pct", 99.168, "99.2 %"),
            ("dice", 0.8731, "0.87"),
            ("pulp_exposed", 1.0, "yes"),
            ("session_time_s", 15.93, "15.9 s"),
        ] {
            assert_eq!(measured(name, Some(value)), text);
        }
        assert_eq!(measured("dice", None), "—");
        assert_eq!([written("force_max_n", 1.8), written("decay_cleared_pct", 97.25)], ["1.8 N", "97.25 %"]);
    }

    #[test]
    fn points_stay_on_their_side_of_the_pass_mark() {
        for (value, text) in
            [(43.01, "43"), (69.96, "69.96"), (69.9, "69.9"), (70.0, "70"), (70.4, "70"), (100.0, "100")]
        {
            assert_eq!(points(value, 70.0), text);
        }
    }

    #[test]
    fn durations_read_as_the_thesis_writes_them() {
        for (seconds, text) in
            [(0.0, "0.0 s"), (59.94, "59.9 s"), (59.96, "1:00.0"), (254.4, "4:14.4"), (300.0, "5:00.0")]
        {
            assert_eq!(duration(seconds), text);
        }
    }

    #[test]
    fn what_is_written_moves_no_cursor() {
        assert_eq!(sanitize_display("a\x1b[2Jb\nc\u{202e}d", 60), "a\u{fffd}[2Jb\u{fffd}c\u{fffd}d");
        assert_eq!(sanitize_display("مرحبا", 60), "مرحبا");
        assert_eq!(sanitize_display(&"x".repeat(10_000), 20), "x".repeat(19) + "…");
    }

    #[test]
    fn numbers_keep_what_matters() {
        for (value, text) in [(95.194, "95.19"), (1234.5, "1234.5"), (0.0123, "0.012"), (-0.0001, "0"), (0.0, "0")] {
            assert_eq!(number(value), text);
        }
    }
}
