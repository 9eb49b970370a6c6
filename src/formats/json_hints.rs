//! Probable causes of JSON syntax errors, for authors who do not program.

/// Returns the remedy for a syntax error at or before a byte of a text.
pub(super) fn likely_fix(text: &str, at: usize) -> &'static str {
    let at = (0..=at.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
    let line_start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[at..].find('\n').map_or(text.len(), |i| at + i);
    let before = text[line_start..at].trim_end();
    let here = &text[at..line_end];
    let line = &text[line_start..line_end];
    let last = before.chars().next_back();
    let opened = text.matches('{').count() + text.matches('[').count();
    let closed = text.matches('}').count() + text.matches(']').count();
    if line.contains(['\u{201c}', '\u{201d}', '\u{201e}', '\u{2018}', '\u{2019}']) {
        "use straight quotes: \"like this\""
    } else if here.starts_with('%') {
        "a number has no percent sign: write 98, because the key states the meaning"
    } else if ["True", "False", "None", "yes", "no"].iter().any(|w| here.starts_with(w)) {
        "write true, false or null"
    } else if here.contains(|c: char| c.is_control() && c != '\t' && c != '\r') {
        "there is an invisible character; delete it and type the text again"
    } else if is_decimal_comma(before, here) {
        "use a decimal point: 1.6"
    } else if last.is_some_and(|c| c.is_ascii_digit()) && here.starts_with(|c: char| c.is_alphabetic() || c == ' ') {
        "a number has no unit: the key names it, as in radius_mm"
    } else if here.starts_with('\'') {
        "use double quotes: \"like this\""
    } else if here.starts_with("//") || here.starts_with("/*") {
        "JSON has no comments; move the comment to \"summary\", or remove it"
    } else if before.ends_with(',') && here.starts_with(['}', ']']) || here.starts_with(",}") || here.starts_with(",]")
    {
        "remove the comma before the closing bracket"
    } else if opened > closed {
        "a } or ] is missing: every bracket that is opened must be closed, here or further up"
    } else if closed > opened {
        "there is one } or ] too many, here or further up"
    } else {
        "look for a missing comma, quote or bracket here or on the line before"
    }
}

/// Returns true at a place like `1,6`: digits, a comma, digits.
fn is_decimal_comma(before: &str, here: &str) -> bool {
    let digit_at_end = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
    let digit_at_start = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    match before.strip_suffix(',') {
        Some(number) => digit_at_end(number) && digit_at_start(here),
        None => digit_at_end(before) && here.strip_prefix(',').is_some_and(digit_at_start),
    }
}

/// Returns the byte offset of a line and column, both from 1; columns count bytes.
pub(super) fn offset(text: &str, line: usize, column: usize) -> usize {
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1));
    let start = starts.into_iter().nth(line.saturating_sub(1)).unwrap_or(text.len());
    let at = (start + column.saturating_sub(1)).min(text.len());
    (0..=at).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_common_mistake_gets_its_own_remedy() {
        for (text, place, expected) in [
            ("{ \"radius_mm\": 1,6 }", "6 }", "decimal point"),
            ("{ \"full_at\": 98% }", "%", "percent"),
            ("{ \"radius_mm\": 1.6 mm }", "mm }", "unit"),
            ("{ \"cutting\": True }", "True", "true"),
            ("{ \u{201c}id\u{201d}: 1 }", "id", "straight"),
            ("{ \"a\": { \"b\": 1 }", "{", "missing"),
            ("{ \"a\": 1 } }", "} }", "too many"),
            ("{ \"a\": [1, 2,] }", "]", "remove the comma before"),
            ("{ 'a': 1 }", "'a", "double quotes"),
        ] {
            let remedy = likely_fix(text, text.find(place).unwrap());
            assert!(remedy.contains(expected), "{text}: {remedy}");
        }
    }

    #[test]
    fn offsets_are_within_the_text() {
        assert_eq!(offset("ab\ncd", 2, 2), 4);
        assert_eq!(offset("ab", 9, 9), 2);
    }
}
