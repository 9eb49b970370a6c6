//! Rendering of pages from templates and language files, which a school may edit.

use super::http::Response;
use base64::Engine;
use minijinja::value::{Kwargs, Serde, Value};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;
use typodont_report::cohort::{AgreementTables, Cohort};
use typodont_report::{Languages, Message, Templates};

/// Shipped templates, by their names in the folder `review` of the templates.
const PAGES: [(&str, &str); 13] = [
    ("layout.html", include_str!("../../reports/templates/review/layout.html")),
    ("list.html", include_str!("../../reports/templates/review/list.html")),
    ("session.html", include_str!("../../reports/templates/review/session.html")),
    ("blind.html", include_str!("../../reports/templates/review/blind.html")),
    ("rating.html", include_str!("../../reports/templates/review/rating.html")),
    ("name.html", include_str!("../../reports/templates/review/name.html")),
    ("compare.html", include_str!("../../reports/templates/review/compare.html")),
    ("agreement.html", include_str!("../../reports/templates/review/agreement.html")),
    ("history.html", include_str!("../../reports/templates/review/history.html")),
    ("left_out.html", include_str!("../../reports/templates/review/left_out.html")),
    ("door.html", include_str!("../../reports/templates/review/door.html")),
    ("complaint.html", include_str!("../../reports/templates/review/complaint.html")),
    (STYLE, include_str!("../../reports/templates/review/review.css")),
];
const STYLE: &str = "review.css";

const LANGUAGES: [(&str, &str); 2] = [
    ("en", include_str!("../../reports/templates/review/languages/en.json")),
    ("tr", include_str!("../../reports/templates/review/languages/tr.json")),
];

/// Templates, texts, and the content security policy of the pages.
#[derive(Clone, Debug)]
pub struct PageRenderer {
    pages: BTreeMap<String, String>,
    languages: Arc<Languages>,
    content_security_policy: String,
}

impl PageRenderer {
    #[cfg(test)]
    pub fn shipped() -> PageRenderer {
        PageRenderer::in_folder(Path::new(""), &Templates::shipped()).expect("the shipped templates are valid")
    }

    /// Loads the templates and texts in the subfolder `review` of a folder. Files that are missing there are replaced
    /// by the shipped ones. Texts that are shared with the session report come from `templates`.
    ///
    /// # Errors
    ///
    /// Returns a message when a file cannot be read or is not a valid template or language file.
    pub fn in_folder(folder: &Path, templates: &Templates) -> Result<PageRenderer, String> {
        let folder = folder.join("review");
        let read = |name: &str, shipped: &str| {
            let path = folder.join(name);
            match fs::read_to_string(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(shipped.replace("\r\n", "\n")),
                Err(error) => Err(format!("{}: unreadable-file: {error}", path.display())),
                Ok(text) => Ok(text.replace("\r\n", "\n")),
            }
        };
        let wrong = |what: String| format!("{}/{what}", folder.display());
        let mut pages = BTreeMap::new();
        for (name, otherwise) in PAGES {
            pages.insert(name.to_string(), read(name, otherwise)?);
        }
        for (name, text) in pages.iter().filter(|(name, _)| *name != STYLE) {
            let parsed = Environment::new().add_template("page", text).map(drop);
            parsed.map_err(|e| wrong(format!("{name}: wrong-template: {e}")))?;
        }
        if pages[STYLE].to_ascii_lowercase().contains("</s") {
            return Err(wrong(format!(
                "{STYLE}: wrong-template: the style sheet contains \"</s\", which would end it within the page"
            )));
        }
        let mut texts = BTreeMap::new();
        for (code, otherwise) in LANGUAGES {
            texts.insert(code.to_string(), read(&format!("languages/{code}.json"), otherwise)?);
        }
        // Languages that the school's reports have in addition to the shipped ones.
        for code in templates.languages().codes().filter(|code| LANGUAGES.iter().all(|(own, _)| own != code)) {
            texts.insert(code.to_string(), read(&format!("languages/{code}.json"), "{}")?);
        }
        let languages = templates.languages().extended_with(&texts).map_err(|e| wrong(format!("languages/{e}")))?;
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(&pages[STYLE]));
        let policy = format!(
            "default-src 'none'; style-src 'sha256-{digest}'; img-src 'self' data:; form-action 'self'; base-uri 'none'; \
             frame-ancestors 'none'"
        );
        Ok(PageRenderer { pages, languages: Arc::new(languages), content_security_policy: policy })
    }

    /// Selects an available language: the chosen one, else the first one that the browser accepts, else English.
    pub fn choose_language(&self, chosen: Option<&str>, accept_language: Option<&str>) -> String {
        let known = |code: &str| self.languages.codes().find(|own| own.eq_ignore_ascii_case(code)).map(String::from);
        let liked = accept_language.unwrap_or_default().split(',').filter_map(|one| one.split([';', '-']).next());
        chosen.and_then(known).or_else(|| liked.map(str::trim).find_map(known)).unwrap_or_else(|| "en".into())
    }

    /// Returns code and name of every language.
    pub fn languages(&self) -> Vec<(&str, &str)> {
        self.languages.names()
    }

    /// Agreement of the examiners of a cohort, as text in a language.
    ///
    /// # Errors
    ///
    /// Returns a message when there is no such language.
    pub fn agreement_tables(&self, language: &str, cohort: &Cohort) -> Result<Vec<AgreementTables>, String> {
        Ok(cohort.agreement_tables(self.languages.translator(language)?))
    }

    /// Translates a message.
    pub fn translate(&self, language: &str, message: &Message) -> String {
        self.languages.text_in(language, message)
    }

    /// Renders a page as a response. In its template, `{{ t("key") }}` inserts the translated text of a key.
    pub fn page(&self, status: u16, name: &str, language: &str, page: &impl Serialize) -> Response {
        match self.render(name, language, page) {
            Ok(html) => Response::new(status, "text/html; charset=utf-8", &self.content_security_policy, html),
            Err(why) => {
                Response::plain_error(500, "wrong-template: this page cannot be rendered; see the program's log")
                    .with_log(why)
            }
        }
    }

    fn render(&self, name: &str, language: &str, page: &impl Serialize) -> Result<String, String> {
        let wrong = |e: minijinja::Error| format!("template review/{name}: {e}");
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        let (languages, code) = (Arc::clone(&self.languages), language.to_string());
        environment.add_function("t", move |key: String, with: Kwargs| -> Result<String, minijinja::Error> {
            let mut filled = Vec::new();
            for name in with.args() {
                let value: Value = with.get(name)?;
                filled.push((name.to_string(), Message::plain(value.to_string())));
            }
            Ok(languages.text_in(&code, &Message::Keyed { key, fallback: String::new(), args: filled }))
        });
        environment.add_global("style", Value::from_safe_string(self.pages[STYLE].clone()));
        for part in ["layout.html", "rating.html", name] {
            environment.add_template(part, &self.pages[part]).map_err(wrong)?;
        }
        environment.get_template(name).and_then(|t| t.render(Value::from(Serde(page)))).map_err(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_language_has_every_text_of_the_pages() {
        // Aim: no page shows a bare key. Method: compare the shipped languages with each other, and look up every key
        // that a template uses.
        let own: Vec<BTreeMap<String, String>> =
            LANGUAGES.iter().map(|(_, text)| serde_json::from_str(text).unwrap()).collect();
        let keys = |texts: &BTreeMap<String, String>| texts.keys().cloned().collect::<BTreeSet<_>>();
        assert_eq!(keys(&own[0]), keys(&own[1]));
        let renderer = PageRenderer::shipped();
        for (name, text) in PAGES {
            for part in text.split("t(\"").skip(1) {
                let key = part.split('"').next().unwrap();
                // Keys that a template composes are checked only if they are complete.
                let is_whole = !part[key.len() + 1..].trim_start().starts_with('~');
                let is_known = |code: &str| renderer.translate(code, &Message::text(key, &[])) != key;
                assert!(!is_whole || is_known("en") && is_known("tr"), "{name}: {key}");
            }
        }
    }

    #[test]
    fn a_page_is_rendered_in_the_browsers_language() {
        let renderer = PageRenderer::shipped();
        for (chosen, liked, expected) in [
            (None, None, "en"),
            (None, Some("tr-TR,tr;q=0.9,en;q=0.8"), "tr"),
            (None, Some("fr,tr;q=0.5"), "tr"),
            (Some("en"), Some("tr"), "en"),
            (Some("../x"), Some("xx"), "en"),
        ] {
            assert_eq!(renderer.choose_language(chosen, liked), expected);
        }
    }
}
