//! Diagnostics about a file that a person wrote: the problem, its place, and the remedy.
//!
//! Takes a source text and spans in it. Gives lines that a person or a program can read. Never prints.

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A text that was read, with the name under which the reader knows it.
#[derive(Debug, PartialEq, Eq)]
pub struct SourceText {
    /// Path as given by the user.
    pub name: String,
    /// Content; empty for a file that is not text.
    pub text: String,
}

impl SourceText {
    /// Creates a shared source text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Arc<SourceText> {
        Arc::new(SourceText { name: name.into(), text: text.into() })
    }

    /// Returns the line and column of a byte offset, both counted from 1; columns count characters.
    pub fn line_and_column(&self, offset: usize) -> (usize, usize) {
        let before = &self.text[..self.text.floor_char_boundary(offset)];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }
}

/// One complaint about a source text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable name of the violated rule, in kebab case.
    pub code: &'static str,
    pub source: Arc<SourceText>,
    /// Byte range of the source that the complaint is about; `None` when it is about the file as a whole.
    pub span: Option<Range<usize>>,
    /// JSON pointer to the value, such as `/stages/0/title`; empty for the file as a whole.
    pub path: String,
    /// Problem, as a lower-case phrase.
    pub message: String,
    /// Remedy.
    pub help: Option<String>,
}

impl Diagnostic {
    /// Creates a complaint about a whole file, for readers of files that are not text.
    pub fn about_file(name: &str, code: &'static str, message: impl fmt::Display, help: Option<String>) -> Diagnostic {
        let message = message.to_string();
        Diagnostic { code, source: SourceText::new(name, ""), span: None, path: String::new(), message, help }
    }

    /// Returns the line and column, counted from 1; `None` for a complaint about a whole file.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        self.span.as_ref().map(|span| self.source.line_and_column(span.start))
    }

    /// Returns the complaint in one line: `file:line:column: code: path: message`.
    pub fn headline(&self) -> String {
        let mut line = self.source.name.clone();
        if let Some((row, column)) = self.line_and_column() {
            line += &format!(":{row}:{column}");
        }
        line += &format!(": {}: ", self.code);
        if !self.path.is_empty() {
            line += &format!("{}: ", self.path);
        }
        // The name of the file, the path and the message may quote the author's text, which must not break the line.
        one_line(&(line + &self.message))
    }
}

/// Writes the headline, the marked excerpt of the source, and the help.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.headline())?;
        if let Some(span) = self.span.clone().filter(|s| s.end <= self.source.text.len()) {
            let (text, first_line, span) = excerpt(&self.source, span);
            let snippet = Snippet::source(text).line_start(first_line).annotation(AnnotationKind::Primary.span(span));
            let rendered = Renderer::plain().render(&[Level::ERROR.primary_title("").element(snippet)]);
            // The first line repeats the headline.
            for line in rendered.lines().skip(1) {
                writeln!(f, "{}", line.trim_end())?;
            }
        }
        if let Some(help) = &self.help {
            writeln!(f, "  = help: {}", one_line(help))?;
        }
        Ok(())
    }
}

/// Returns the line of a span, its line number, and the span within it.
///
/// A span over several lines is cut to its first line, and a very long line to the text around the span.
fn excerpt(source: &SourceText, span: Range<usize>) -> (String, usize, Range<usize>) {
    const AROUND: usize = 160;
    let text = &source.text;
    let line_start = text[..span.start].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[span.start..].find('\n').map_or(text.len(), |i| span.start + i);
    let start = text.floor_char_boundary(line_start.max(span.start.saturating_sub(AROUND)));
    let end = text.floor_char_boundary(line_end.min(span.start + AROUND));
    let (line, _) = source.line_and_column(span.start);
    (text[start..end].to_string(), line, span.start - start..span.end.min(end).max(span.start) - start)
}

fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Returns the known word most similar to `written`, if it is similar enough to have been meant.
pub fn nearest<'a>(written: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let written = written.to_lowercase();
    known
        .into_iter()
        .map(|word| (strsim::damerau_levenshtein(&written, &word.to_lowercase()), word))
        .filter(|(distance, word)| *distance <= 1 + word.len().max(written.len()) / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, word)| word)
}

/// Returns "did you mean …? known: …" for a word that is not among the known ones. If there are many known words,
/// only the most similar are listed.
pub fn did_you_mean<'a>(written: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    /// Number of known words beyond which a reader would not look through them, and the number that is then listed.
    const MANY: usize = 20;
    const NAMED: usize = 6;
    let mut all: Vec<&str> = known.clone().into_iter().collect();
    match nearest(written, known) {
        Some(word) if all.len() > MANY => {
            let count = all.len();
            let written = written.to_lowercase();
            all.sort_by_key(|other| strsim::damerau_levenshtein(&written, &other.to_lowercase()));
            let named: Vec<&str> = all.into_iter().filter(|other| *other != word).take(NAMED).collect();
            format!("did you mean \"{word}\"? the closest of {count} known words are {}", named.join(", "))
        }
        Some(word) => format!("did you mean \"{word}\"? known: {}", all.join(", ")),
        None => format!("known: {}", all.join(", ")),
    }
}

/// Joins the headlines of several complaints, one per line.
pub fn headlines(found: &[Diagnostic]) -> String {
    found.iter().map(Diagnostic::headline).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(text: &str, span: Range<usize>) -> Diagnostic {
        Diagnostic {
            code: "unknown-tissue",
            source: SourceText::new("a.json", text),
            span: Some(span),
            path: "/target/tissue".into(),
            message: "no tissue is named \"dentin\"".into(),
            help: Some(did_you_mean("dentin", ["enamel", "dentine", "pulp"])),
        }
    }

    #[test]
    fn a_complaint_points_at_the_place() {
        let text = "{\n  \"tissue\": \"dentin\"\n}";
        let start = text.find("\"dentin\"").unwrap();
        let shown = complaint(text, start..start + 8).to_string();
        assert_eq!(
            shown,
            "a.json:2:13: unknown-tissue: /target/tissue: no tissue is named \"dentin\"\n  |\n2 |   \"tissue\": \"dentin\"\n  \
             |             ^^^^^^^^\n  = help: did you mean \"dentine\"? known: enamel, dentine, pulp\n"
        );
    }

    #[test]
    fn long_lines_and_odd_characters_do_no_harm() {
        let text = format!("[\"{}\", \"ü\u{202e}\u{0}\"]", "x".repeat(100_000));
        let start = text.find('ü').unwrap();
        let shown = complaint(&text, start..start + 2).to_string();
        assert!(shown.len() < 2000, "{}", shown.len());
        assert!(!complaint("a", 0..1).to_string().contains('\u{0}'));
        let broken_key = Diagnostic { path: "/stages/0/time\nlimit".into(), ..complaint("a", 0..1) };
        assert_eq!(broken_key.headline().lines().count(), 1);
    }

    #[test]
    fn only_near_words_are_suggested() {
        assert_eq!(nearest("Dentin", ["enamel", "dentine"]), Some("dentine"));
        assert_eq!(nearest("amalgam", ["enamel", "dentine"]), None);
        assert_eq!(nearest("x", []), None);
    }
}
