//! Texts of a page in every language that it contains.
//!
//! A language is a file of texts by key. English and Turkish ship with the program; a school's folder of templates may
//! add others or replace them. A session's page contains all languages; the reader chooses one in the browser, which
//! changes no byte of the file. A cohort's page and a gradebook are written in one language.

use super::display_format::sanitize_display;
use minijinja::value::Value;
use std::collections::BTreeMap;
use typodont_exercise::local_text::LocalTexts;

/// A language's texts by key.
pub type Texts = BTreeMap<String, String>;

/// The key of a language's own name.
const NAME: &str = "language.name";

/// Placeholder whose value 1 selects the singular of a text.
pub const COUNT: &str = "count";

/// Suffix of the key of a text's singular; the key without it is the plural. A language without the difference may
/// leave the singular out.
const SINGULAR: &str = ".one";

/// Every language of a page, English first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Languages {
    all: Vec<(String, Texts)>,
}

/// One of the languages, for a page or a file that is written in one language only.
#[derive(Clone, Copy, Debug)]
pub struct Translator<'a> {
    languages: &'a Languages,
    /// Index into the languages.
    language: usize,
}

/// Values of a text's placeholders, by name.
pub type MessageArgs = Vec<(String, Message)>;

/// A text that can be rendered in every language.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// The same in all languages: a number, a name, or a text that an author wrote.
    Plain(String),
    /// A text of the language files by key, or the English fallback if no file has the key.
    Keyed { key: String, fallback: String, args: MessageArgs },
    /// A text by language; English where a language is missing.
    PerLanguage { texts: Texts, args: MessageArgs },
}

impl Message {
    pub fn plain(text: impl Into<String>) -> Message {
        Message::Plain(text.into())
    }

    /// A text of an exercise, in the languages in which its author wrote it.
    pub fn authored(texts: &LocalTexts, text: &str) -> Message {
        match texts.translations(text) {
            Some(texts) => Message::PerLanguage { texts, args: Vec::new() },
            None => Message::plain(text),
        }
    }

    pub fn text(key: impl Into<String>, args: &[(&str, Message)]) -> Message {
        let args = args.iter().map(|(name, said)| (name.to_string(), said.clone())).collect();
        Message::Keyed { key: key.into(), fallback: String::new(), args }
    }

    /// A text with an English fallback in the program; language files may translate it.
    pub fn text_or(key: impl Into<String>, fallback: impl Into<String>) -> Message {
        Message::Keyed { key: key.into(), fallback: fallback.into(), args: Vec::new() }
    }
}

impl Languages {
    /// Reads language files by code; English comes first.
    ///
    /// # Errors
    ///
    /// When a file is not a JSON object of texts by key.
    pub fn read(files: &BTreeMap<String, String>) -> Result<Languages, String> {
        let mut all = Vec::new();
        for (code, text) in files {
            let texts: Texts = serde_json::from_str(text)
                .map_err(|e| format!("{code}.json: wrong-language: {e}; write {{\"key\": \"text\"}} pairs"))?;
            all.push((code.clone(), texts));
        }
        all.sort_by_key(|(code, _)| (code != "en", code.clone()));
        Ok(Languages { all })
    }

    pub fn codes(&self) -> impl Iterator<Item = &str> {
        self.all.iter().map(|(code, _)| code.as_str())
    }

    /// Codes, each with the name of its language in that language.
    pub fn names(&self) -> Vec<(&str, &str)> {
        self.all.iter().map(|(code, texts)| (code.as_str(), texts.get(NAME).unwrap_or(code).as_str())).collect()
    }

    /// Texts for a page's script, by language and key: all keys that begin with `prefix`.
    pub fn with_prefix(&self, prefix: &str) -> BTreeMap<&str, BTreeMap<&str, &str>> {
        let english = self.all.first().map(|(_, texts)| texts);
        self.all
            .iter()
            .map(|(code, texts)| {
                let keys = english.into_iter().flat_map(|e| e.iter()).filter(|(key, _)| key.starts_with(prefix));
                let own = keys.map(|(key, text)| (key.as_str(), texts.get(key).unwrap_or(text).as_str()));
                (code.as_str(), own.collect())
            })
            .collect()
    }

    /// A message in each language, by code.
    pub fn in_each_language(&self, message: &Message) -> BTreeMap<String, String> {
        (0..self.all.len()).map(|i| (self.all[i].0.clone(), self.resolve(i, message))).collect()
    }

    /// These languages with further texts added by code, for a page that needs its own texts as well.
    ///
    /// # Errors
    ///
    /// When a file is not a JSON object of texts by key.
    pub fn extended_with(&self, files: &BTreeMap<String, String>) -> Result<Languages, String> {
        let mut all = self.all.clone();
        for (code, texts) in Languages::read(files)?.all {
            match all.iter_mut().find(|(known, _)| *known == code) {
                Some((_, known)) => known.extend(texts),
                None => all.push((code, texts)),
            }
        }
        Ok(Languages { all })
    }

    /// A message in one language, as plain text; in English if there is no language of that code.
    pub fn text_in(&self, code: &str, message: &Message) -> String {
        let index = self.all.iter().position(|(own, _)| own == code).unwrap_or(0);
        self.resolve(index, message)
    }

    /// Translator into the language of a code.
    ///
    /// # Errors
    ///
    /// When there is no language of that code; the text names those known.
    pub fn translator(&self, code: &str) -> Result<Translator<'_>, String> {
        match self.all.iter().position(|(own, _)| own == code) {
            Some(language) => Ok(Translator { languages: self, language }),
            None => {
                let known: Vec<&str> = self.codes().collect();
                let code = sanitize_display(code, 40);
                Err(format!("unknown-language: there is no language \"{code}\"; known: {}", known.join(", ")))
            }
        }
    }

    /// A message in every language as HTML: each text is marked with its code; a text that is the same in all appears
    /// once.
    pub fn html(&self, message: &Message) -> Value {
        Value::from_safe_string(self.tagged(message, "span"))
    }

    /// The same for a text within an SVG drawing.
    pub fn svg(&self, message: &Message) -> String {
        self.tagged(message, "tspan")
    }

    fn tagged(&self, message: &Message, element: &str) -> String {
        let texts: Vec<String> = (0..self.all.len()).map(|i| escape_html(&self.resolve(i, message))).collect();
        match texts.first() {
            None => String::new(),
            Some(first) if texts.iter().all(|t| t == first) => first.clone(),
            Some(_) => {
                let codes = self.all.iter().map(|(code, _)| code);
                let mark = |(code, text): (&String, &String)| format!("<{element} lang=\"{code}\">{text}</{element}>");
                codes.zip(&texts).map(mark).collect()
            }
        }
    }

    fn resolve(&self, language: usize, message: &Message) -> String {
        let english = &self.all[0].1;
        let (code, own) = &self.all[language];
        let (text, with) = match message {
            Message::Plain(text) => return text.clone(),
            Message::Keyed { key, fallback: otherwise, args: with } => {
                let default_text = if otherwise.is_empty() { key } else { otherwise };
                (keyed_text(own, key, with).or(keyed_text(english, key, with)).unwrap_or(default_text), with)
            }
            Message::PerLanguage { texts, args: with } => match texts.get(code).or(texts.get("en")) {
                Some(text) => (text, with),
                None => return String::new(),
            },
        };
        interpolate(text, |name| with.iter().find(|(n, _)| *n == name).map(|(_, said)| self.resolve(language, said)))
    }
}

impl<'a> Translator<'a> {
    /// Code of the language.
    pub fn code(self) -> &'a str {
        &self.languages.all[self.language].0
    }

    /// A message as plain text.
    pub fn translate(self, message: &Message) -> String {
        self.languages.resolve(self.language, message)
    }

    /// The text of a key as plain text, with its placeholders filled.
    pub fn text(self, key: &str, values: &[(&str, String)]) -> String {
        let args = values.iter().map(|(name, value)| (name.to_string(), Message::plain(value))).collect();
        self.translate(&Message::Keyed { key: key.into(), fallback: String::new(), args })
    }
}

/// The text of a key in one language: the singular if the placeholder `count` is 1 and the language has one.
fn keyed_text<'a>(texts: &'a Texts, key: &str, args: &[(String, Message)]) -> Option<&'a String> {
    let is_one = args.iter().any(|(name, value)| name == COUNT && *value == Message::plain("1"));
    let singular = is_one.then(|| texts.get(&format!("{key}{SINGULAR}"))).flatten();
    singular.or_else(|| texts.get(key))
}

/// A text with its `{names}` replaced; an unknown name stays unchanged.
fn interpolate(text: &str, value: impl Fn(&str) -> Option<String>) -> String {
    let mut out = String::new();
    let mut remaining = text;
    while let Some((before, after)) = remaining.split_once('{') {
        out += before;
        let found = after.split_once('}').and_then(|(name, after)| Some((value(name)?, after)));
        match found {
            Some((value, after)) => {
                out += &value;
                remaining = after;
            }
            None => {
                out.push('{');
                remaining = after;
            }
        }
    }
    out + remaining
}

/// The names in a text's braces.
pub fn placeholders(text: &str) -> impl Iterator<Item = &str> {
    text.split('{').skip(1).filter_map(|part| part.split_once('}').map(|(name, _)| name))
}

/// A text escaped for HTML, between tags or within quotes.
pub fn escape_html(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Languages {
        let files = [("tr", r#"{"a": "{n} diş", "b": "<b>"}"#), ("en", r#"{"a": "{n} teeth", "c": "only"}"#)];
        Languages::read(&files.map(|(code, text)| (code.to_string(), text.to_string())).into()).unwrap()
    }

    #[test]
    fn what_differs_is_said_in_every_language_and_what_does_not_once() {
        let check = |said: &Message, expected: &str| assert_eq!(two().tagged(said, "i"), expected);
        let three = [("n", Message::plain("3"))];
        check(&Message::text("a", &three), "<i lang=\"en\">3 teeth</i><i lang=\"tr\">3 diş</i>");
        check(&Message::text("c", &[]), "only");
        check(&Message::text_or("b", "bold"), "<i lang=\"en\">bold</i><i lang=\"tr\">&lt;b&gt;</i>");
        check(&Message::plain("<script>"), "&lt;script&gt;");
    }

    #[test]
    fn a_count_of_one_takes_the_singular() {
        // Aim: "1 tooth", "2 teeth". Method: a language with a singular, one without the difference, and one without the
        // text, which takes the English text with the English singular.
        let files = [
            ("en", r#"{"teeth": "{count} teeth", "teeth.one": "{count} tooth"}"#),
            ("tr", r#"{"teeth": "{count} diş"}"#),
            ("de", "{}"),
        ];
        let files = files.map(|(code, text)| (code.to_string(), text.to_string())).into();
        let languages = Languages::read(&files).unwrap();
        for (code, count, expected) in [
            ("en", "1", "1 tooth"),
            ("en", "0", "0 teeth"),
            ("en", "11", "11 teeth"),
            ("tr", "1", "1 diş"),
            ("de", "1", "1 tooth"),
            ("de", "2", "2 teeth"),
        ] {
            let translator = languages.translator(code).unwrap();
            assert_eq!(translator.text("teeth", &[(COUNT, count.to_string())]), expected);
            assert_eq!(translator.code(), code);
        }
        assert!(languages.translator("fr").unwrap_err().ends_with("known: en, de, tr"));
    }

    #[test]
    fn a_name_that_nobody_knows_stays() {
        let value = |name: &str| (name == "n").then(|| "{n}".to_string());
        assert_eq!(interpolate("{n} {m} {n", value), "{n} {m} {n");
        assert_eq!(placeholders("{a} b {c} {").collect::<Vec<_>>(), ["a", "c"]);
    }
}
