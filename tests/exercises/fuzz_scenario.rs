//! The scenario reader against anything at all. Runs as a test with a modest number of inputs, and as a fuzzer with
//! `cargo bolero test --test fuzz_scenario any_text_is_resolved_or_refused_in_words`.

use typodont_exercise::scenario;
use typodont_exercise::scenario::ResolveMode;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

const SHIPPED: [&str; 5] = [
    include_str!("../../scenarios/1-introduction.json"),
    include_str!("../../scenarios/2-decay.json"),
    include_str!("../../scenarios/3-detection.json"),
    include_str!("../../scenarios/4-diagnosis.json"),
    include_str!("../../scenarios/5-grinding.json"),
];

/// Fragments that stand for an author's typing errors in numbers, words and brackets.
const PIECES: [&str; 16] = [
    "null",
    "-1",
    "1e999",
    "0.0000001",
    "\"\"",
    "[]",
    "{}",
    "true",
    "\"enamel\"",
    "1e-400",
    "18446744073709551616",
    "\"\\u0000\"",
    "[[",
    "}",
    ",",
    "\"a\":",
];

#[test]
fn any_text_is_resolved_or_refused_in_words() {
    let library = Library::shipped();
    let iterations = if std::env::var_os("TYPODONT_LONG").is_some() { 3000 } else { 200 };
    bolero::check!().with_iterations(iterations).with_max_len(256).for_each(|input: &[u8]| {
        let Some((way, input)) = input.split_first() else { return };
        let text = match way % 7 {
            6 => String::from_utf8_lossy(input).into_owned(),
            n => mutated(SHIPPED[usize::from(n) % 5], input),
        };
        if let Err(found) = scenario::resolve(SourceText::new("fuzz.json", text), &library, ResolveMode::MakeWorkpiece)
        {
            assert!(!found.is_empty());
            for diagnostic in found {
                let line = diagnostic.headline();
                assert!(line.starts_with("fuzz.json:") && line.lines().count() == 1, "{line:?}");
            }
        }
    });
}

/// A text with tokens replaced, doubled or cut, as the input says: which (two bytes), how (one byte), again and again.
fn mutated(text: &str, input: &[u8]) -> String {
    let mut tokens: Vec<String> = Vec::new();
    let mut last = ' ';
    for c in text.chars() {
        let is_word = |c: char| c.is_alphanumeric() || "_-.$".contains(c);
        match tokens.last_mut() {
            Some(token) if is_word(c) && is_word(last) => token.push(c),
            _ => tokens.push(c.to_string()),
        }
        last = c;
    }
    for edit in input.chunks_exact(3) {
        let at = usize::from(u16::from_le_bytes([edit[0], edit[1]])) % tokens.len();
        match edit[2] % 20 {
            n @ 0..16 => tokens[at] = PIECES[usize::from(n)].to_string(),
            16 => tokens.truncate(at + 1),
            17 => tokens[at] = tokens[at].repeat(2),
            18 => tokens[at].clear(),
            _ => tokens.swap(at, 0),
        }
    }
    tokens.concat()
}
