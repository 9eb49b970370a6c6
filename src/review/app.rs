//! Review application: its state, and the parts that all pages share.

use super::auth::{Auth, AuthMode, Login};
use super::bundle;
use super::http::{Request, Response};
use super::index::{IndexedSession, SessionIndex};
use super::origin::AllowedHosts;
use super::overrides::{IntegrityIssue, LogSnapshot, OverrideLog};
use super::page_renderer::PageRenderer;
use super::pseudonyms::Pseudonymizer;
use super::router::Route;
use super::verification::{self, VerificationQueue};
use jiff::Timestamp;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use typodont_report::{Message, SessionFile, sanitize_display};

/// Configuration of the application.
pub struct ReviewOptions {
    /// Folder that holds bundles, at any depth.
    pub folder: PathBuf,
    pub auth_mode: AuthMode,
    /// Host names under which this machine is reached, in addition to its IP addresses.
    pub host_names: Vec<String>,
    /// Shows participants as pseudonymous codes.
    pub anonymous: bool,
    pub renderer: PageRenderer,
}

/// Review application of one folder of bundles.
pub struct ReviewApp {
    /// Canonical path.
    pub(super) folder: PathBuf,
    pub(super) renderer: PageRenderer,
    pub(super) anonymous: bool,
    pub(super) allowed_hosts: AllowedHosts,
    state: Mutex<ReviewState>,
    pub(super) verification: Mutex<VerificationQueue>,
}

/// Mutable state, behind a mutex.
pub(super) struct ReviewState {
    pub index: SessionIndex,
    pub log: OverrideLog,
    pub auth: Auth,
    /// Issues of the log at the last refresh, and messages about them that have not been logged yet.
    known_issues: Vec<IntegrityIssue>,
    pub unreported: Vec<String>,
}

/// Request of a logged-in browser, with its language.
pub(super) struct RequestContext<'a> {
    pub request: &'a Request,
    pub language: String,
    pub login: Login,
    pub cookie: String,
}

/// Session read from its bundle, with a snapshot of the override log.
pub(super) struct LoadedSession {
    pub log: LogSnapshot,
    pub indexed: IndexedSession,
    pub session: SessionFile,
}

/// Template values common to all pages.
#[derive(Serialize)]
pub(super) struct PageLayout {
    language: String,
    /// Language code, language name, and address of this page in that language.
    languages: Vec<(String, String, String)>,
    /// CSRF token for forms; empty before login.
    form: String,
    is_in: bool,
    anonymous: bool,
    troubles: Vec<String>,
    /// Number of lines in the log, and SHA-256 of the last one.
    lines: u64,
    head: String,
}

/// Page content together with the common template values.
#[derive(Serialize)]
pub(super) struct PageWithLayout<T> {
    #[serde(flatten)]
    pub frame: PageLayout,
    #[serde(flatten)]
    pub body: T,
}

#[derive(Serialize)]
struct ErrorPage {
    /// Error messages, one sentence each.
    said: Vec<String>,
}

impl ReviewApp {
    /// Creates the application and returns it with the first one-time login token.
    ///
    /// # Errors
    ///
    /// Returns a message when the folder does not exist, its secret or its index cannot be used, or the system's
    /// random number generator fails.
    pub fn new(options: ReviewOptions) -> Result<(ReviewApp, String), String> {
        let ReviewOptions { folder, auth_mode, host_names, anonymous, renderer } = options;
        let canonical =
            std::fs::canonicalize(&folder).map_err(|e| format!("{}: missing-folder: {e}", folder.display()))?;
        if !canonical.is_dir() {
            return Err(format!("{}: missing-folder: this is not a folder", folder.display()));
        }
        let pseudonymizer = match anonymous {
            true => Some(Pseudonymizer::load_or_create(&canonical)?),
            false => Pseudonymizer::load(&canonical)?,
        };
        let index = SessionIndex::open(&canonical, pseudonymizer)?;
        let (auth, first_token) = Auth::new(&auth_mode)?;
        let state = ReviewState {
            index,
            log: OverrideLog::of(&canonical),
            auth,
            known_issues: Vec::new(),
            unreported: Vec::new(),
        };
        let app = ReviewApp {
            folder: canonical,
            renderer,
            anonymous,
            allowed_hosts: AllowedHosts(host_names),
            state: Mutex::new(state),
            verification: verification::new_queue(),
        };
        Ok((app, first_token))
    }

    /// Indexes the folder for the first time. Returns the number of sessions, the number of files left out, and
    /// messages about the log and the index.
    ///
    /// # Errors
    ///
    /// Returns a message when the log or the index cannot be read.
    pub fn startup_summary(&self) -> Result<(usize, usize, Vec<String>), String> {
        let mut state = self.state();
        state.refresh(&self.folder)?;
        let lost = |e: rusqlite::Error| format!("{}: unusable-cache: {e}", super::index::FILE_NAME);
        let (_, count) = state.index.query_sessions(&super::query::Query::parse(&[]), self.anonymous).map_err(lost)?;
        let left_out = state.index.left_out().map_err(lost)?.len();
        let mut issues = std::mem::take(&mut state.unreported);
        issues.extend(state.index.fallback_reason.as_ref().map(|why| {
            format!("{}: unusable-cache: {why}; all bundles are read again at every start", super::index::FILE_NAME)
        }));
        Ok((count, left_out, issues))
    }

    /// Locks the state. A poisoned mutex is used nevertheless: files on disk are complete, and everything else is
    /// refreshed from them.
    pub(super) fn state(&self) -> MutexGuard<'_, ReviewState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Updates the index from the folder and returns the locked state with the current log.
    ///
    /// # Errors
    ///
    /// Returns an error page when the log or the index cannot be read.
    pub(super) fn refresh(
        &self,
        context: &RequestContext,
    ) -> Result<(MutexGuard<'_, ReviewState>, LogSnapshot), Box<Response>> {
        let mut state = self.state();
        match state.refresh(&self.folder) {
            Ok(log) => Ok((state, log)),
            Err(why) => {
                drop(state);
                let said =
                    Message::text("complaint.unreadable", &[("why", Message::plain(sanitize_display(&why, 300)))]);
                Err(Box::new(self.error_page(context, 500, &[said]).with_log(why)))
            }
        }
    }

    /// Reads a session from its bundle, with the current log.
    ///
    /// # Errors
    ///
    /// Returns an error page when there is no such session, or its bundle cannot be read.
    pub(super) fn load_session(&self, context: &RequestContext, id: &str) -> Result<LoadedSession, Box<Response>> {
        let (state, log) = self.refresh(context)?;
        let listed = state.index.session(id);
        drop(state);
        let missing = || Box::new(self.error_page(context, 404, &[Message::text("complaint.no_session", &[])]));
        let listed = listed.ok().flatten().ok_or_else(missing)?;
        match bundle::read_bundle_session(&self.folder, &listed.path) {
            Ok(session) if typodont_integrations::session_id(&session) == id => {
                Ok(LoadedSession { log, indexed: listed, session })
            }
            _ => Err(missing()),
        }
    }

    /// Builds the error page for a failed query of the index.
    pub(super) fn index_failure(&self, context: &RequestContext) -> Response {
        let why = Message::plain(format!("{}: unusable-cache", super::index::FILE_NAME));
        self.error_page(context, 500, &[Message::text("complaint.unreadable", &[("why", why)])])
    }

    pub(super) fn set_display_name(&self, context: &RequestContext, name: &str) {
        self.state().auth.set_display_name(&context.cookie, name);
    }

    /// Appends the draft that `decide` returns to the log. `decide` sees the log while no other program can write to
    /// it.
    ///
    /// # Errors
    ///
    /// Returns an error when the log cannot be written or `decide` rejects.
    pub(super) fn append_override<E>(
        &self,
        now: Timestamp,
        decide: impl FnOnce(&LogSnapshot) -> Result<super::overrides::OverrideDraft, E>,
    ) -> Result<super::overrides::OverrideEntry, super::overrides::AppendError<E>> {
        let mut state = self.state();
        let known = state.index.known_head();
        state.log.append(&now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(), known.as_ref(), decide)
    }

    /// Renders a page with the common layout.
    pub(super) fn page(
        &self,
        context: &RequestContext,
        log: &LogSnapshot,
        name: &str,
        body: impl Serialize,
    ) -> Response {
        let frame = self.layout(&context.language, context.request, &context.login.csrf_token, Some(log));
        self.renderer.page(200, name, &context.language, &PageWithLayout { frame, body })
    }

    /// Renders an error page that lists all messages.
    pub(super) fn error_page(&self, context: &RequestContext, status: u16, messages: &[Message]) -> Response {
        let said = messages.iter().map(|said| self.renderer.translate(&context.language, said)).collect();
        let frame = self.layout(&context.language, context.request, &context.login.csrf_token, None);
        self.renderer.page(
            status,
            "complaint.html",
            &context.language,
            &PageWithLayout { frame, body: ErrorPage { said } },
        )
    }

    pub(super) fn layout(
        &self,
        language: &str,
        request: &Request,
        csrf_token: &str,
        log: Option<&LogSnapshot>,
    ) -> PageLayout {
        let say = |said: &Message| self.renderer.translate(language, said);
        let issue_text = |issue: &IntegrityIssue| {
            let (name, numbers) = issue.message_key();
            let numbers: Vec<(&str, Message)> =
                numbers.iter().map(|(n, v)| (*n, Message::plain(v.to_string()))).collect();
            say(&Message::text(format!("trouble.{name}"), &numbers))
        };
        let query = if request.query.is_empty() { String::new() } else { format!("?{}", request.query) };
        let back = if request.method == "POST" {
            "/".into()
        } else {
            safe_redirect_target(&format!("{}{query}", request.path))
        };
        let language_link = |code: &str| {
            let mut out = url::form_urlencoded::Serializer::new(String::new());
            format!("/language?{}", out.append_pair("to", code).append_pair("back", &back).finish())
        };
        PageLayout {
            language: language.to_string(),
            languages: self
                .renderer
                .languages()
                .iter()
                .map(|(c, n)| (c.to_string(), n.to_string(), language_link(c)))
                .collect(),
            form: csrf_token.to_string(),
            is_in: !csrf_token.is_empty(),
            anonymous: self.anonymous,
            troubles: log.map(|log| log.issues.iter().map(issue_text).collect()).unwrap_or_default(),
            lines: log.map_or(0, |log| log.head.lines),
            head: log.map(|log| log.head.sha256.clone()).unwrap_or_default(),
        }
    }

    pub(super) fn translate(&self, context: &RequestContext, message: &Message) -> String {
        self.renderer.translate(&context.language, message)
    }

    /// Returns the participant's displayed name: the pseudonymous code in anonymous mode.
    pub(super) fn display_name(&self, indexed: &IndexedSession) -> String {
        let name = if self.anonymous { &indexed.code } else { &indexed.participant };
        sanitize_display(name, SHOWN_MAX)
    }

    /// Returns the displayed start time of a session: only the date in anonymous mode, because the time could
    /// identify the participant.
    pub(super) fn display_start(&self, indexed: &IndexedSession) -> String {
        let most = if self.anonymous { 10 } else { 19 };
        let text: String = indexed.began.chars().take(most).collect();
        sanitize_display(&text.replace('T', " "), SHOWN_MAX)
    }
}

/// Maximum displayed length, characters, of a code, a title or a reason in a list.
pub(super) const SHOWN_MAX: usize = 80;

impl ReviewState {
    fn refresh(&mut self, folder: &Path) -> Result<LogSnapshot, String> {
        let known = self.index.known_head();
        let unreadable = |e: std::io::Error| format!("{}: unreadable-file: {e}", super::OVERRIDES);
        let log = self.log.read(known.as_ref()).map_err(unreadable)?;
        if log.issues != self.known_issues {
            self.unreported.extend(log.issues.iter().map(|issue| format!("{}: {issue}", super::OVERRIDES)));
            self.known_issues.clone_from(&log.issues);
        }
        self.index.refresh(folder, &log)?;
        let is_intact = log.issues.iter().all(IntegrityIssue::is_accident);
        if is_intact && self.index.known_head().as_ref() != Some(&log.head) && log.head.lines > 0 {
            self.index.remember_head(&log.head);
        }
        Ok(log)
    }
}

/// Maximum length of a query string that a return address keeps, bytes. The application's own queries have some
/// hundred.
const RETURN_QUERY_MAX: usize = 2000;

/// Returns `target` as a header-safe address if it is one of the application's pages, and `/` for any other.
pub(super) fn safe_redirect_target(target: &str) -> String {
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    match Route::parse(path).filter(|route| !route.is_post()) {
        None | Some(Route::LoginLink | Route::Language) => "/".into(),
        Some(_) if query.is_empty() || query.len() > RETURN_QUERY_MAX => path.to_string(),
        Some(_) => {
            let mut out = url::form_urlencoded::Serializer::new(String::new());
            out.extend_pairs(url::form_urlencoded::parse(query.as_bytes()));
            format!("{path}?{}", out.finish())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_return_address_never_leaves_the_application() {
        for (target, expected) in [
            ("/", "/"),
            ("/?text=a%20b", "/?text=a+b"),
            ("/compare?session=x\r\nset-cookie: a", "/compare?session=x%0D%0Aset-cookie%3A+a"),
            ("//evil.example", "/"),
            ("/\\evil.example", "/"),
            ("https://evil.example", "/"),
            ("/enter?token=x", "/"),
            ("", "/"),
        ] {
            assert_eq!(safe_redirect_target(target), expected);
        }
    }
}
