//! Texts of the window, in the user's language.
//!
//! A language is a file of texts by key. English and Turkish ship; a file in the settings folder's `languages` adds another.

use crate::platform;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use typodont_exercise::local_text::LocalTexts;

const SHIPPED: [(&str, &str); 2] =
    [("en", include_str!("../../content/languages/en.json")), ("tr", include_str!("../../content/languages/tr.json"))];

/// The language whose texts are used where another language lacks one.
const BASE: &str = "en";

/// The key of a language's own name.
const NAME: &str = "language.name";

/// Texts by key.
#[derive(Clone, Debug, Default)]
pub struct Translations {
    pub code: String,
    texts: BTreeMap<String, String>,
}

impl Translations {
    /// The text of a key; the key itself if it has no text.
    pub fn get<'a>(&'a self, key: &'a str) -> &'a str {
        self.texts.get(key).map_or(key, String::as_str)
    }

    /// A text with its `{}` replaced.
    pub fn format(&self, key: &str, value: impl ToString) -> String {
        self.format_all(key, &[&value.to_string()])
    }

    /// A text with each `{}` replaced by the next value. What stands in a value stays as it is: authors write titles.
    pub fn format_all(&self, key: &str, values: &[&str]) -> String {
        let mut pieces = self.get(key).split("{}");
        let mut text = pieces.next().unwrap_or_default().to_string();
        let mut values = values.iter().fuse();
        for piece in pieces {
            text.push_str(values.next().unwrap_or(&"{}"));
            text.push_str(piece);
        }
        text
    }

    /// A text of an exercise in this language; the base text if its author wrote no other.
    pub fn own<'a>(&self, texts: &'a LocalTexts, text: &'a str) -> &'a str {
        texts.get(text, &self.code)
    }

    pub fn name(&self) -> &str {
        self.get(NAME)
    }
}

/// All languages, English first, with a complaint for each file that is not a valid language file.
pub fn load_all(folder: Option<&Path>) -> (Vec<Translations>, Vec<String>) {
    let base = texts(SHIPPED[0].1).unwrap_or_default();
    let mut found = Vec::new();
    let mut complaints = Vec::new();
    let mut add = |code: &str, text: &str, from: &str| match texts(text) {
        Ok(own) => {
            let texts = base.iter().map(|(k, v)| (k.clone(), own.get(k).unwrap_or(v).clone())).collect();
            found.retain(|words: &Translations| words.code != code);
            found.push(Translations { code: code.to_string(), texts });
        }
        Err(error) => complaints.push(format!("{from}: wrong-language: {error}; write {{\"key\": \"text\"}} pairs")),
    };
    for (code, text) in SHIPPED {
        add(code, text, code);
    }
    let mut files: Vec<_> = folder.into_iter().flat_map(|f| fs::read_dir(f).into_iter().flatten().flatten()).collect();
    files.sort_by_key(fs::DirEntry::path);
    for path in files.iter().map(fs::DirEntry::path).filter(|p| p.extension().is_some_and(|e| e == "json")) {
        let code = path.file_stem().unwrap_or_default().to_string_lossy().to_string();
        let text = fs::read_to_string(&path).unwrap_or_default();
        add(&code, &text, &path.display().to_string());
    }
    (found, complaints)
}

/// The language with this code; English if there is none.
pub fn select_language(all: &[Translations], code: &str) -> Translations {
    let wanted = all.iter().find(|w| w.code == code).or_else(|| all.iter().find(|w| w.code == BASE));
    wanted.cloned().unwrap_or_default()
}

/// Language code of the user's locale.
pub fn system_language() -> String {
    let locale = platform::locale();
    // "C.UTF-8" and "POSIX" name no language.
    let is_code = |code: &&str| code.bytes().all(|letter| letter.is_ascii_lowercase());
    let code = locale.as_deref().and_then(|locale| locale.get(..2)).filter(is_code);
    code.unwrap_or(BASE).to_string()
}

fn texts(text: &str) -> Result<BTreeMap<String, String>, serde_json::Error> {
    serde_json::from_str(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui;
    use regex_lite::Regex;
    use std::collections::BTreeSet;

    #[test]
    fn a_value_that_looks_like_a_place_for_a_value_stays_as_it_is() {
        let texts = [("two".to_string(), "Near “{}”. {}".to_string())].into();
        let words = Translations { code: "en".into(), texts };
        assert_eq!(words.format_all("two", &["a {} b", "Press less."]), "Near “a {} b”. Press less.");
        assert_eq!(words.format("two", "pulp"), "Near “pulp”. {}");
    }

    #[test]
    fn the_windows_fonts_have_every_character() {
        // Aim: no text shows an empty box. Regression: the ticks of the introduction and of the list were one.
        let context = egui::Context::default();
        // The fonts are loaded with the first frame.
        let _ = context.run_ui(egui::RawInput::default(), |_| ());
        let font = egui::FontId::proportional(14.0);
        for (code, text) in SHIPPED {
            for (key, text) in texts(text).unwrap() {
                let lacks: String = text
                    .chars()
                    .filter(|c| !context.fonts_mut(|fonts| fonts.has_glyphs(&font, &c.to_string())))
                    .collect();
                assert!(lacks.is_empty(), "{code}: {key}: {lacks:?}");
            }
        }
        assert!(!context.fonts_mut(|fonts| fonts.has_glyphs(&font, "\u{2714}")), "the test notices nothing");
    }

    #[test]
    fn every_language_has_every_key_that_the_window_uses_and_no_other() {
        // Aim: nobody meets a bare key, and no text is translated for nothing. Method: the files beside each other, and
        // every key in the window's sources.
        let all: Vec<BTreeSet<String>> =
            SHIPPED.map(|(_, text)| texts(text).unwrap().into_keys().collect()).into_iter().collect();
        assert_eq!(all[0], all[1], "English and Turkish have the same keys");
        let used = Regex::new(r#""([a-z]+\.[a-z0-9_]+)""#).unwrap();
        let mut keys = BTreeSet::new();
        let mut files = Vec::new();
        let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()];
        while let Some(folder) = folders.pop() {
            let (inner, found): (Vec<_>, Vec<_>) =
                fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).partition(|path| path.is_dir());
            folders.extend(inner);
            files.extend(found.into_iter().filter(|path| path.extension().is_some_and(|e| e == "rs")));
        }
        for path in files {
            let text = fs::read_to_string(path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap();
            keys.extend(
                used.captures_iter(code)
                    .map(|c| c[1].to_string())
                    .filter(|k| !k.ends_with(".json") && !k.starts_with("typodont.")),
            );
        }
        let none = BTreeSet::new();
        assert_eq!(keys.difference(&all[0]).collect::<BTreeSet<_>>(), none.iter().collect(), "used and not written");
        assert_eq!(all[0].difference(&keys).collect::<BTreeSet<_>>(), none.iter().collect(), "written and not used");
    }

    #[test]
    fn a_language_that_lacks_a_text_says_it_in_english() {
        let (all, complaints) = load_all(None);
        assert!(complaints.is_empty());
        assert_eq!(select_language(&all, "tr").code, "tr");
        assert_eq!(select_language(&all, "xx").code, "en");
        assert_ne!(select_language(&all, "tr").name(), select_language(&all, "en").name());
    }
}
