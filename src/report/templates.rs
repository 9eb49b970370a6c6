//! HTML pages from templates that a school may edit.
//!
//! Takes values that are already formatted as text. Gives one self-contained page, in which everything a person wrote
//! is escaped.

use super::feedback::FeedbackRules;
use super::language::{COUNT, Languages, Message, escape_html};
use minijinja::value::{Kwargs, Serde, Value};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::LazyLock;

/// Files from which the pages of a cohort are made, by name: that of the teacher, those of the trainees, and their style
/// sheet.
const COHORT_FILES: [(&str, &str); 3] = [
    (COHORT, include_str!("../../reports/templates/cohort.html")),
    (TRAINEE, include_str!("../../reports/templates/trainee.html")),
    (COHORT_STYLE, include_str!("../../reports/templates/cohort.css")),
];

const COHORT: &str = "cohort.html";
const TRAINEE: &str = "trainee.html";
const COHORT_STYLE: &str = "cohort.css";

/// Files from which a session's page is made, by name: the page, its style sheet, its scripts and shader, and the rules
/// of the feedback.
const SESSION_FILES: [(&str, &str); 12] = [
    (REPORT, include_str!("../../reports/templates/report.html")),
    ("report.css", include_str!("../../reports/templates/report.css")),
    ("voxels.js", include_str!("../../reports/templates/voxels.js")),
    ("deviation.js", include_str!("../../reports/templates/deviation.js")),
    ("motion.js", include_str!("../../reports/templates/motion.js")),
    ("solid.js", include_str!("../../reports/templates/solid.js")),
    ("instrument.js", include_str!("../../reports/templates/instrument.js")),
    ("solid.glsl", include_str!("../../reports/templates/solid.glsl")),
    ("cuts.js", include_str!("../../reports/templates/cuts.js")),
    ("player.js", include_str!("../../reports/templates/player.js")),
    ("report.js", include_str!("../../reports/templates/report.js")),
    (FEEDBACK, include_str!("../../reports/templates/feedback.json")),
];
/// Parts of the page's script, in the order in which they are joined.
const SCRIPTS: [&str; 8] =
    ["voxels.js", "motion.js", "deviation.js", "solid.js", "instrument.js", "cuts.js", "player.js", "report.js"];

const REPORT: &str = "report.html";
const FEEDBACK: &str = "feedback.json";

/// Languages of the pages, by code.
const LANGUAGES: [(&str, &str); 2] = [
    ("en", include_str!("../../reports/templates/languages/en.json")),
    ("tr", include_str!("../../reports/templates/languages/tr.json")),
];

static SHIPPED_LANGUAGES: LazyLock<Languages> =
    LazyLock::new(|| Languages::read(&by_name(&LANGUAGES)).expect("what ships is sound"));

/// Languages that ship with the program, without a school's changes.
pub fn shipped_languages() -> &'static Languages {
    &SHIPPED_LANGUAGES
}

/// Templates, style sheets, scripts, language files and feedback rules from which pages are made.
#[derive(Clone, Debug)]
pub struct Templates {
    /// Files of a cohort's pages, by name.
    cohort_files: BTreeMap<String, String>,
    /// Files of a session's page, by name.
    session_files: BTreeMap<String, String>,
    /// Texts of every language, by code.
    languages: Languages,
    rules: FeedbackRules,
    /// Names, lengths and texts of all files from which a session's page is made.
    session_source_text: String,
}

impl Templates {
    /// Templates that ship with the program.
    pub fn shipped() -> Templates {
        Templates::assemble(by_name(&COHORT_FILES), by_name(&SESSION_FILES), by_name(&LANGUAGES))
            .expect("what ships is sound")
    }

    /// Templates of a folder. A file that the folder lacks is replaced by the one that ships with the program.
    ///
    /// # Errors
    ///
    /// When a file exists but cannot be read, or is not a valid template, language file or set of rules.
    pub fn in_folder(folder: &Path) -> Result<Templates, String> {
        let read = |name: &str, shipped: &str| {
            let path = folder.join(name);
            match fs::read_to_string(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => Ok(shipped.to_string()),
                Err(error) => Err(format!("{}: unreadable-file: {error}", path.display())),
                Ok(text) => Ok(text),
            }
        };
        let mut session = BTreeMap::new();
        for (name, otherwise) in SESSION_FILES {
            session.insert(name.to_string(), read(name, otherwise)?);
        }
        let mut cohort = BTreeMap::new();
        for (name, otherwise) in COHORT_FILES {
            cohort.insert(name.to_string(), read(name, otherwise)?);
        }
        let mut languages = by_name(&LANGUAGES);
        let mut files: Vec<_> =
            fs::read_dir(folder.join("languages")).into_iter().flatten().flatten().map(|e| e.path()).collect();
        files.retain(|p| p.extension().is_some_and(|e| e == "json"));
        for path in files {
            let code = path.file_stem().unwrap_or_default().to_string_lossy().to_string();
            if !is_language_code(&code) {
                let help = "use the language code as the file name, as in de.json or pt-BR.json";
                return Err(format!("{}: wrong-language: {help}", path.display()));
            }
            let text = fs::read_to_string(&path).map_err(|e| format!("{}: unreadable-file: {e}", path.display()))?;
            languages.insert(code, text);
        }
        Templates::assemble(cohort, session, languages).map_err(|e| format!("{}/{e}", folder.display()))
    }

    /// `Err` names the first invalid file and its fault.
    fn assemble(
        cohort: BTreeMap<String, String>,
        session: BTreeMap<String, String>,
        languages: BTreeMap<String, String>,
    ) -> Result<Templates, String> {
        // A browser reads line ends as `\n` before it takes a script's digest.
        let session: BTreeMap<String, String> =
            session.into_iter().map(|(name, text)| (name, text.replace("\r\n", "\n"))).collect();
        for (name, text) in [(REPORT, &session[REPORT]), (COHORT, &cohort[COHORT]), (TRAINEE, &cohort[TRAINEE])] {
            let parsed = Environment::new().add_template("page", text).map(drop);
            parsed.map_err(|e| format!("{name}: wrong-template: {e}"))?;
        }
        let is_inlined = |name: &str| [".js", ".css", ".glsl"].iter().any(|end| name.ends_with(end));
        for (name, text) in session.iter().chain(&cohort).filter(|(name, _)| is_inlined(name)) {
            // Such a text would end the element into which it is written.
            if text.to_ascii_lowercase().contains("</s") {
                return Err(format!("{name}: wrong-template: it has \"</s\", which would end it within the page"));
            }
        }
        let rules = FeedbackRules::read(FEEDBACK, &session[FEEDBACK])?;
        let parsed_languages = Languages::read(&languages).map_err(|e| format!("languages/{e}"))?;
        let all = session.iter().chain(&languages);
        let session_source_text = all.map(|(name, text)| format!("{name} {}\n{text}", text.len())).collect();
        Ok(Templates {
            cohort_files: cohort,
            session_files: session,
            languages: parsed_languages,
            rules,
            session_source_text,
        })
    }

    /// The script of a session's page.
    pub fn script(&self) -> String {
        SCRIPTS.map(|name| self.session_file(name)).concat()
    }

    /// All files from which a session's page is made, as one text. A bundle records the SHA-256 of this text.
    pub fn session_source_text(&self) -> &str {
        &self.session_source_text
    }

    pub fn languages(&self) -> &Languages {
        &self.languages
    }

    pub fn rules(&self) -> &FeedbackRules {
        &self.rules
    }

    /// Text of a session's file by name; empty for an unknown name.
    pub fn session_file(&self, name: &str) -> &str {
        self.session_files.get(name).map_or("", String::as_str)
    }

    /// Renders a session's page with the values of `page`.
    ///
    /// # Errors
    ///
    /// When the template fails; the text names the template and the place.
    pub fn render_session(&self, page: &impl Serialize) -> Result<String, String> {
        let languages = self.languages.clone();
        let to_html = move |message: &Message| languages.html(message).to_string();
        render(REPORT, self.session_file(REPORT), page, to_html)
    }

    /// Style sheet of a cohort's pages.
    pub fn cohort_style(&self) -> &str {
        &self.cohort_files[COHORT_STYLE]
    }

    /// Renders a cohort's page in one language with the values of `page`.
    ///
    /// # Errors
    ///
    /// When the template fails; the text names the template and the place.
    pub fn render_cohort(&self, page: &impl Serialize, language: &str) -> Result<String, String> {
        self.render_in(COHORT, page, language)
    }

    /// Renders the page of one participant of a cohort in one language with the values of `page`.
    ///
    /// # Errors
    ///
    /// When the template fails; the text names the template and the place.
    pub fn render_trainee(&self, page: &impl Serialize, language: &str) -> Result<String, String> {
        self.render_in(TRAINEE, page, language)
    }

    fn render_in(&self, template: &str, page: &impl Serialize, language: &str) -> Result<String, String> {
        let (languages, code) = (self.languages.clone(), language.to_string());
        let to_html = move |message: &Message| escape_html(&languages.text_in(&code, message));
        render(template, &self.cohort_files[template], page, to_html)
    }
}

/// Renders a template; `to_html` translates the messages of its function `t`.
fn render(
    name: &str,
    template: &str,
    page: &impl Serialize,
    to_html: impl Fn(&Message) -> String + Send + Sync + 'static,
) -> Result<String, String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_function("t", move |key: String, with: Kwargs| translate(&to_html, &key, &with));
    environment.add_template("page", template).map_err(|e| format!("template {name} — {e}"))?;
    let values = Value::from(Serde(page));
    let text = environment.get_template("page").and_then(|t| t.render(values));
    text.map_err(|e| format!("template {name} — {e}"))
}

fn by_name(shipped: &[(&str, &str)]) -> BTreeMap<String, String> {
    shipped.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect()
}

/// True for codes such as `en` and `pt-BR`. The code is written into the page, so no other characters are allowed.
fn is_language_code(text: &str) -> bool {
    (2..=12).contains(&text.len()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-')
}

/// `t("key", name=value)` in a template: the text in the languages of the page with each `{name}` replaced. `otherwise`
/// is used if no language has the key.
fn translate(to_html: impl Fn(&Message) -> String, key: &str, arguments: &Kwargs) -> Result<Value, minijinja::Error> {
    let otherwise: Option<String> = arguments.get("otherwise")?;
    let mut filled = Vec::new();
    let mut marked = Vec::new();
    for name in arguments.args().filter(|n| *n != "otherwise") {
        let value: Value = arguments.get(name)?;
        if name == COUNT {
            // A number; it selects the singular or the plural.
            filled.push((name.to_string(), Message::plain(value.to_string())));
            continue;
        }
        // A value that is already safe HTML is inserted unchanged, after the rest has been escaped.
        let text = if value.is_safe() { value.to_string() } else { escape_html(&value.to_string()) };
        let stand_in = format!("\u{1}{}\u{2}", marked.len());
        filled.push((name.to_string(), Message::plain(stand_in.clone())));
        marked.push((stand_in, text));
    }
    let said = Message::Keyed { key: key.to_string(), fallback: otherwise.unwrap_or_default(), args: filled };
    let mut html = to_html(&said);
    for (stand_in, text) in marked {
        html = html.replace(&stand_in, &text);
    }
    Ok(Value::from_safe_string(html))
}
