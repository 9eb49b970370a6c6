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

/// A number with as many decimals as its size deserves.
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
