//! Pages from templates that a school may edit.
//!
//! Takes what is known as plain texts and numbers in words. Gives one self-contained page; everything a person wrote is
//! escaped.

use super::feedback::Rules;
use super::language::{Languages, Said, escaped};
use minijinja::value::{Kwargs, Serde, Value};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

const COHORT: &str = include_str!("../../reports/templates/cohort.html");

/// What a session's page is made from, by name: the page itself, how it looks, what it does, what it says.
const SESSION: [(&str, &str); 8] = [
    (REPORT, include_str!("../../reports/templates/report.html")),
    ("report.css", include_str!("../../reports/templates/report.css")),
    ("voxels.js", include_str!("../../reports/templates/voxels.js")),
    ("solid.js", include_str!("../../reports/templates/solid.js")),
    ("solid.glsl", include_str!("../../reports/templates/solid.glsl")),
    ("cuts.js", include_str!("../../reports/templates/cuts.js")),
    ("report.js", include_str!("../../reports/templates/report.js")),
    (FEEDBACK, include_str!("../../reports/templates/feedback.json")),
];
/// The parts of its script, in their order.
const SCRIPTS: [&str; 4] = ["voxels.js", "solid.js", "cuts.js", "report.js"];

const REPORT: &str = "report.html";
const FEEDBACK: &str = "feedback.json";

/// Its languages, by code.
const LANGUAGES: [(&str, &str); 2] = [
    ("en", include_str!("../../reports/templates/languages/en.json")),
    ("tr", include_str!("../../reports/templates/languages/tr.json")),
];

/// The texts that pages are made from.
#[derive(Clone, Debug)]
pub struct Templates {
    /// Of a cohort's page.
    cohort: String,
    /// Of a session's page, by name.
    session: BTreeMap<String, String>,
    /// By code.
    languages: Languages,
    rules: Rules,
    /// Names and bytes of all that a session's page is made from.
    whole: String,
}

impl Templates {
    /// Those that ship with the program.
    pub fn shipped() -> Templates {
        Templates::put_together(COHORT.into(), texts(&SESSION), texts(&LANGUAGES)).expect("what ships is sound")
    }

    /// Those of a folder; what it lacks ships with the program.
    ///
    /// `Err` when one of them cannot be read or is no template.
    pub fn in_folder(folder: &Path) -> Result<Templates, String> {
        let read = |name: &str, otherwise: &str| {
            let path = folder.join(name);
            match fs::read_to_string(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(otherwise.to_string()),
                Err(error) => Err(format!("{}: unreadable-file: {error}", path.display())),
                Ok(text) => Ok(text),
            }
        };
        let mut session = BTreeMap::new();
        for (name, otherwise) in SESSION {
            session.insert(name.to_string(), read(name, otherwise)?);
        }
        let mut languages = texts(&LANGUAGES);
        let mut files: Vec<_> =
            fs::read_dir(folder.join("languages")).into_iter().flatten().flatten().map(|e| e.path()).collect();
        files.retain(|p| p.extension().is_some_and(|e| e == "json"));
        for path in files {
            let code = path.file_stem().unwrap_or_default().to_string_lossy().to_string();
            if !is_code(&code) {
                let help = "name it by a language's code: de.json, pt-BR.json";
                return Err(format!("{}: wrong-language: {help}", path.display()));
            }
            let text = fs::read_to_string(&path).map_err(|e| format!("{}: unreadable-file: {e}", path.display()))?;
            languages.insert(code, text);
        }
        Templates::put_together(read("cohort.html", COHORT)?, session, languages)
            .map_err(|e| format!("{}/{e}", folder.display()))
    }

    /// `Err` with what is wrong with one of them, its name first.
    fn put_together(
        cohort: String,
        session: BTreeMap<String, String>,
        languages: BTreeMap<String, String>,
    ) -> Result<Templates, String> {
        // A browser reads line ends as `\n` before it takes a script's digest.
        let session: BTreeMap<String, String> =
            session.into_iter().map(|(name, text)| (name, text.replace("\r\n", "\n"))).collect();
        for (name, text) in [(REPORT, &session[REPORT]), ("cohort.html", &cohort)] {
            let parsed = Environment::new().add_template("page", text).map(drop);
            parsed.map_err(|e| format!("{name}: wrong-template: {e}"))?;
        }
        let is_inlined = |name: &str| [".js", ".css", ".glsl"].iter().any(|end| name.ends_with(end));
        for (name, text) in session.iter().filter(|(name, _)| is_inlined(name)) {
            // It would end the element in which the text stands.
            if text.to_ascii_lowercase().contains("</s") {
                return Err(format!("{name}: wrong-template: it has \"</s\", which would end it within the page"));
            }
        }
        let rules = Rules::read(FEEDBACK, &session[FEEDBACK])?;
        let said = Languages::read(&languages).map_err(|e| format!("languages/{e}"))?;
        let all = session.iter().chain(&languages);
        let whole = all.map(|(name, text)| format!("{name} {}\n{text}", text.len())).collect();
        Ok(Templates { cohort, session, languages: said, rules, whole })
    }

    /// The script of a session's page.
    pub fn script(&self) -> String {
        SCRIPTS.map(|name| self.part(name)).concat()
    }

    /// All that a session's page is made from, as one text: what a bundle names the digest of.
    pub fn of_session(&self) -> &str {
        &self.whole
    }

    pub fn languages(&self) -> &Languages {
        &self.languages
    }

    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// A text that goes into a session's page as it is; empty for none of that name.
    pub fn part(&self, name: &str) -> &str {
        self.session.get(name).map_or("", String::as_str)
    }

    pub fn render_session(&self, page: &impl Serialize) -> Result<String, String> {
        self.render(REPORT, self.part(REPORT), page)
    }

    pub fn render_cohort(&self, page: &impl Serialize) -> Result<String, String> {
        self.render("cohort.html", &self.cohort, page)
    }

    fn render(&self, name: &str, template: &str, page: &impl Serialize) -> Result<String, String> {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        let languages = Arc::new(self.languages.clone());
        environment.add_function("t", move |key: String, with: Kwargs| translated(&languages, &key, &with));
        environment.add_template("page", template).map_err(|e| format!("template {name} — {e}"))?;
        let values = Value::from(Serde(page));
        let text = environment.get_template("page").and_then(|t| t.render(values));
        text.map_err(|e| format!("template {name} — {e}"))
    }
}

fn texts(shipped: &[(&str, &str)]) -> BTreeMap<String, String> {
    shipped.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect()
}

/// True for `en`, `pt-BR` and the like: it stands in a page.
fn is_code(text: &str) -> bool {
    (2..=12).contains(&text.len()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-')
}

/// `t("key", name=value)` in a template: a text in every language, its `{name}` filled; `otherwise` stands where none has it.
fn translated(languages: &Languages, key: &str, with: &Kwargs) -> Result<Value, minijinja::Error> {
    let otherwise: Option<String> = with.get("otherwise")?;
    let mut filled = Vec::new();
    let mut marked = Vec::new();
    for name in with.args().filter(|n| *n != "otherwise") {
        let value: Value = with.get(name)?;
        // What is marked already goes in as it is, after the rest is escaped.
        let text = if value.is_safe() { value.to_string() } else { escaped(&value.to_string()) };
        let stand_in = format!("\u{1}{}\u{2}", marked.len());
        filled.push((name.to_string(), Said::plain(stand_in.clone())));
        marked.push((stand_in, text));
    }
    let said = Said::Text { key: key.to_string(), otherwise: otherwise.unwrap_or_default(), with: filled };
    let mut html = languages.html(&said).to_string();
    for (stand_in, text) in marked {
        html = html.replace(&stand_in, &text);
    }
    Ok(Value::from_safe_string(html))
}
