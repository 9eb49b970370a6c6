//! What a page says, in every language it holds.
//!
//! A language is a file of texts by key: English and Turkish ship, a school's folder of templates may hold others or its
//! own. A page holds them all; which one is seen is the reader's choice and changes no byte.

use minijinja::value::Value;
use std::collections::BTreeMap;

/// A language's texts by key.
pub type Texts = BTreeMap<String, String>;

/// The key of a language's own name.
const NAME: &str = "language.name";

/// Every language of a page, English first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Languages {
    all: Vec<(String, Texts)>,
}

/// What fills a text's braces, by name.
pub type With = Vec<(String, Said)>;

/// Something to be said in any language.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// The same in all: a number, a name, what an author wrote.
    Plain(String),
    /// A text of the languages, or the English that stands here where none has it.
    Text { key: String, otherwise: String, with: With },
    /// A text by language, English where one is missing.
    Each { texts: Texts, with: With },
}

impl Said {
    pub fn plain(text: impl Into<String>) -> Said {
        Said::Plain(text.into())
    }

    pub fn text(key: impl Into<String>, with: &[(&str, Said)]) -> Said {
        let with = with.iter().map(|(name, said)| (name.to_string(), said.clone())).collect();
        Said::Text { key: key.into(), otherwise: String::new(), with }
    }

    /// A word that stands in the program; other languages may have their own.
    pub fn word(key: impl Into<String>, otherwise: impl Into<String>) -> Said {
        Said::Text { key: key.into(), otherwise: otherwise.into(), with: Vec::new() }
    }
}

impl Languages {
    /// English and others, by code.
    ///
    /// `Err` for a text that is no file of texts by key.
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

    /// Codes, each with what its language calls itself.
    pub fn names(&self) -> Vec<(&str, &str)> {
        self.all.iter().map(|(code, texts)| (code.as_str(), texts.get(NAME).unwrap_or(code).as_str())).collect()
    }

    /// What a page's own program says, by language and key: all keys that begin so.
    pub fn beginning(&self, prefix: &str) -> BTreeMap<&str, BTreeMap<&str, &str>> {
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

    /// Something in each language, by code.
    pub fn each(&self, said: &Said) -> BTreeMap<String, String> {
        (0..self.all.len()).map(|i| (self.all[i].0.clone(), self.say(i, said))).collect()
    }

    /// These and more texts on top of them, by code: what a page of its own says beside what all say.
    ///
    /// `Err` for a text that is no file of texts by key.
    pub fn with(&self, files: &BTreeMap<String, String>) -> Result<Languages, String> {
        let mut all = self.all.clone();
        for (code, texts) in Languages::read(files)?.all {
            match all.iter_mut().find(|(known, _)| *known == code) {
                Some((_, known)) => known.extend(texts),
                None => all.push((code, texts)),
            }
        }
        Ok(Languages { all })
    }

    /// Something in one language, as plain text; in English where there is none of that code.
    pub fn in_one(&self, code: &str, said: &Said) -> String {
        let place = self.all.iter().position(|(own, _)| own == code).unwrap_or(0);
        self.say(place, said)
    }

    /// Something in every language, ready for a page: each is marked with its code, and what all say alike stands once.
    pub fn html(&self, said: &Said) -> Value {
        Value::from_safe_string(self.marked(said, "span"))
    }

    /// The same for a text within a drawing.
    pub fn svg(&self, said: &Said) -> String {
        self.marked(said, "tspan")
    }

    fn marked(&self, said: &Said, element: &str) -> String {
        let texts: Vec<String> = (0..self.all.len()).map(|i| escaped(&self.say(i, said))).collect();
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

    fn say(&self, language: usize, said: &Said) -> String {
        let english = &self.all[0].1;
        let (code, own) = &self.all[language];
        let (text, with) = match said {
            Said::Plain(text) => return text.clone(),
            Said::Text { key, otherwise, with } => {
                let standing = if otherwise.is_empty() { key } else { otherwise };
                (own.get(key).or(english.get(key)).unwrap_or(standing), with)
            }
            Said::Each { texts, with } => match texts.get(code).or(texts.get("en")) {
                Some(text) => (text, with),
                None => return String::new(),
            },
        };
        filled(text, |name| with.iter().find(|(n, _)| *n == name).map(|(_, said)| self.say(language, said)))
    }
}

/// A text with its `{names}` replaced; a name that nobody knows stays as it is.
fn filled(text: &str, value: impl Fn(&str) -> Option<String>) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        out += before;
        let found = after.split_once('}').and_then(|(name, after)| Some((value(name)?, after)));
        match found {
            Some((value, after)) => {
                out += &value;
                rest = after;
            }
            None => {
                out.push('{');
                rest = after;
            }
        }
    }
    out + rest
}

/// The names in a text's braces.
pub fn names_in(text: &str) -> impl Iterator<Item = &str> {
    text.split('{').skip(1).filter_map(|part| part.split_once('}').map(|(name, _)| name))
}

/// A text as it stands in a page, between tags or within quotes.
pub fn escaped(text: &str) -> String {
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
        let check = |said: &Said, expected: &str| assert_eq!(two().marked(said, "i"), expected);
        let three = [("n", Said::plain("3"))];
        check(&Said::text("a", &three), "<i lang=\"en\">3 teeth</i><i lang=\"tr\">3 diş</i>");
        check(&Said::text("c", &[]), "only");
        check(&Said::word("b", "bold"), "<i lang=\"en\">bold</i><i lang=\"tr\">&lt;b&gt;</i>");
        check(&Said::plain("<script>"), "&lt;script&gt;");
    }

    #[test]
    fn a_name_that_nobody_knows_stays() {
        let value = |name: &str| (name == "n").then(|| "{n}".to_string());
        assert_eq!(filled("{n} {m} {n", value), "{n} {m} {n");
        assert_eq!(names_in("{a} b {c} {").collect::<Vec<_>>(), ["a", "c"]);
    }
}
