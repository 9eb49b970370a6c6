//! Texts that an author writes in one or several languages.
//!
//! In a file such a text is a string, or an object of strings by language: `"title": { "en": "…", "tr": "…" }`.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Deref;

/// Language that is used where another has no text.
const BASE: &str = "en";

/// A text in one or several languages. It dereferences to its base text: the English one, or the only one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LocalText {
    base: String,
    /// Texts by language code; empty for a text without a language.
    by_language: BTreeMap<String, String>,
}

impl LocalText {
    /// The text in a language; the base text if there is none.
    pub fn in_language(&self, code: &str) -> &str {
        self.by_language.get(code).unwrap_or(&self.base)
    }

    /// Texts by language code; empty for a text without a language.
    pub fn by_language(&self) -> &BTreeMap<String, String> {
        &self.by_language
    }

    /// The text changed in the same way in every language.
    pub fn map(&self, change: impl Fn(&str) -> String) -> LocalText {
        let by_language = self.by_language.iter().map(|(code, text)| (code.clone(), change(text))).collect();
        LocalText { base: change(&self.base), by_language }
    }

    fn of_languages(by_language: BTreeMap<String, String>) -> Option<LocalText> {
        let base = by_language.get(BASE).or(by_language.values().next())?.clone();
        Some(LocalText { base, by_language })
    }
}

impl From<&str> for LocalText {
    fn from(text: &str) -> LocalText {
        LocalText { base: text.to_string(), by_language: BTreeMap::new() }
    }
}

impl Deref for LocalText {
    type Target = str;

    fn deref(&self) -> &str {
        &self.base
    }
}

impl fmt::Display for LocalText {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.base)
    }
}

impl Serialize for LocalText {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.by_language.is_empty() {
            true => self.base.serialize(serializer),
            false => self.by_language.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for LocalText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<LocalText, D::Error> {
        deserializer.deserialize_any(LocalTextVisitor)
    }
}

struct LocalTextVisitor;

impl<'de> Visitor<'de> for LocalTextVisitor {
    type Value = LocalText;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text, or an object of texts by language")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<LocalText, E> {
        Ok(LocalText::from(text))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<LocalText, A::Error> {
        let mut by_language = BTreeMap::new();
        while let Some((code, text)) = map.next_entry::<String, String>()? {
            by_language.insert(code, text);
        }
        LocalText::of_languages(by_language).ok_or_else(|| A::Error::custom("a text in no language"))
    }
}

impl JsonSchema for LocalText {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "LocalText".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": ["string", "object"],
            "minProperties": 1,
            "propertyNames": {
                "pattern": "^[a-z]{2,3}$",
                "description": "write the language as a code of ISO 639, such as \"en\" or \"tr\""
            },
            "additionalProperties": { "type": "string" }
        })
    }
}

/// The texts of an exercise in the languages in which its author wrote them, by their base texts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LocalTexts {
    by_base: BTreeMap<String, BTreeMap<String, String>>,
    /// The first text of the exercise that lacks a language in which its others are written.
    pub gap: Option<LanguageGap>,
}

/// A text that lacks a language.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LanguageGap {
    /// JSON pointer of the text.
    pub path: String,
    /// Code of the language.
    pub code: String,
}

impl LanguageGap {
    /// Returns the first of some texts, each with its place, that lacks a language in which others are written.
    pub fn find(texts: &[(String, LocalText)]) -> Option<LanguageGap> {
        let codes: BTreeSet<&String> = texts.iter().flat_map(|(_, text)| text.by_language.keys()).collect();
        // A text without a language is taken for one in the base language.
        let has = |text: &LocalText, code: &str| {
            text.is_empty() || text.by_language.contains_key(code) || (text.by_language.is_empty() && code == BASE)
        };
        texts.iter().find_map(|(path, text)| {
            let code = codes.iter().find(|code| !has(text, code))?;
            Some(LanguageGap { path: path.clone(), code: code.to_string() })
        })
    }
}

impl LocalTexts {
    /// Adds a text. Returns a language in which the same base text has another translation already, if there is one.
    pub fn add(&mut self, text: &LocalText) -> Option<String> {
        if text.by_language().is_empty() {
            return None;
        }
        let known = self.by_base.entry(text.base.clone()).or_default();
        let mut conflict = None;
        for (code, translation) in text.by_language() {
            let own = known.entry(code.clone()).or_insert_with(|| translation.clone());
            if own != translation {
                conflict = Some(code.clone());
            }
        }
        conflict
    }

    /// The translation of a base text; the base text itself if there is none in this language.
    pub fn get<'a>(&'a self, text: &'a str, code: &str) -> &'a str {
        self.by_base.get(text).and_then(|known| known.get(code)).map_or(text, String::as_str)
    }

    /// Translations of a base text by language code, with the base text where English is missing; `None` if the author
    /// wrote no other language.
    pub fn translations(&self, text: &str) -> Option<BTreeMap<String, String>> {
        let mut known = self.by_base.get(text)?.clone();
        known.entry(BASE.to_string()).or_insert_with(|| text.to_string());
        Some(known)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_read_with_and_without_languages() {
        let check = |json: &str, code: &str, expected: &str| {
            let text: LocalText = serde_json::from_str(json).unwrap();
            assert_eq!(text.in_language(code), expected, "{json}");
        };
        check(r#""Caries""#, "tr", "Caries");
        check(r#"{ "en": "Caries", "tr": "Çürük" }"#, "tr", "Çürük");
        check(r#"{ "en": "Caries", "tr": "Çürük" }"#, "de", "Caries");
        check(r#"{ "tr": "Çürük" }"#, "en", "Çürük");
        assert!(serde_json::from_str::<LocalText>("{}").is_err());
    }

    #[test]
    fn the_texts_of_an_exercise_are_found_by_their_base_texts() {
        let text = |json: &str| serde_json::from_str::<LocalText>(json).unwrap();
        let mut texts = LocalTexts::default();
        assert_eq!(texts.add(&text(r#"{ "en": "Explorer", "tr": "Sond" }"#)), None);
        assert_eq!(texts.add(&text(r#"{ "en": "Bur", "tr": "Frez" }"#)), None);
        assert_eq!(texts.get("Explorer", "tr"), "Sond");
        assert_eq!(texts.get("Mirror", "tr"), "Mirror");
        assert_eq!(texts.add(&text(r#"{ "en": "Bur", "tr": "Matkap" }"#)), Some("tr".to_string()));
    }

    #[test]
    fn a_text_that_lacks_a_language_of_the_others_is_found() {
        let check = |second: &str, expected: Option<&str>| {
            let text = |json: &str| serde_json::from_str::<LocalText>(json).unwrap();
            let texts =
                [("/a".to_string(), text(r#"{ "en": "Bur", "tr": "Frez" }"#)), ("/b".to_string(), text(second))];
            let gap = LanguageGap::find(&texts);
            let expected = expected.map(|code| LanguageGap { path: "/b".into(), code: code.into() });
            assert_eq!(gap, expected, "{second}");
        };
        check(r#"{ "en": "Mirror", "tr": "Ayna" }"#, None);
        check(r#""""#, None);
        check(r#""Mirror""#, Some("tr"));
        check(r#"{ "tr": "Ayna" }"#, Some("en"));
        assert_eq!(LanguageGap::find(&[("/a".into(), "Bur".into()), ("/b".into(), "Mirror".into())]), None);
    }
}
