//! Review application: its state, and the parts that all pages share.

use super::auth::{Auth, AuthMode, Login};
use super::bundle;
use super::chained_log::{IntegrityIssue, LogHead};
use super::http::{Request, Response};
use super::index::{IndexedSession, OVERRIDES_HEAD, RATINGS_HEAD, SessionIndex};
use super::origin::AllowedHosts;
use super::overrides::{OverrideLog, OverrideSnapshot};
use super::page_renderer::PageRenderer;
use super::pseudonyms::Pseudonymizer;
use super::query::Query;
use super::ratings::{RatingLog, RatingSnapshot};
use super::router::Route;
use super::verification::{self, VerificationQueue};
use jiff::Timestamp;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
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
    /// Hides marks and other examiners' judgements of a session from an examiner who has not rated it yet. Includes
    /// `anonymous`.
    pub blind: bool,
    /// Highest value of the rating scale, whose lowest is 1.
    pub scale: u8,
    pub renderer: PageRenderer,
}

/// Review application of one folder of bundles.
pub struct ReviewApp {
    /// Canonical path.
    pub(super) folder: PathBuf,
    pub(super) renderer: PageRenderer,
    pub(super) anonymous: bool,
    pub(super) blind: bool,
    pub(super) scale: u8,
    pub(super) allowed_hosts: AllowedHosts,
    state: Mutex<ReviewState>,
    pub(super) verification: Mutex<VerificationQueue>,
}

/// Mutable state, behind a mutex.
pub(super) struct ReviewState {
    pub index: SessionIndex,
    pub log: OverrideLog,
    pub rating_log: RatingLog,
    /// Ratings at the last refresh.
    pub ratings: Arc<RatingSnapshot>,
    pub auth: Auth,
    /// Issues of both logs at the last refresh, and messages about them that have not been logged yet.
    known_issues: [Vec<IntegrityIssue>; 2],
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
    pub log: OverrideSnapshot,
    pub ratings: Arc<RatingSnapshot>,
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
    blind: bool,
    /// Examiner's name; empty before it is given.
    examiner: String,
    troubles: Vec<String>,
    /// Number of lines in the log of overrides, and SHA-256 of the last one.
    lines: u64,
    head: String,
    /// The same of the log of ratings.
    rating_lines: u64,
    rating_head: String,
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
        let ReviewOptions { folder, auth_mode, host_names, anonymous, blind, scale, renderer } = options;
        let anonymous = anonymous || blind;
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
            rating_log: RatingLog::of(&canonical),
            ratings: Arc::default(),
            auth,
            known_issues: [Vec::new(), Vec::new()],
            unreported: Vec::new(),
        };
        let app = ReviewApp {
            folder: canonical,
            renderer,
            anonymous,
            blind,
            scale,
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
        let (_, count) = state.index.query_sessions(&Query::parse(&[]), self.anonymous, None).map_err(lost)?;
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
    ) -> Result<(MutexGuard<'_, ReviewState>, OverrideSnapshot), Box<Response>> {
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
        let ratings = Arc::clone(&state.ratings);
        drop(state);
        let missing = || Box::new(self.error_page(context, 404, &[Message::text("complaint.no_session", &[])]));
        let listed = listed.ok().flatten().ok_or_else(missing)?;
        match bundle::read_bundle_session(&self.folder, &listed.path) {
            Ok(session) if typodont_integrations::session_id(&session) == id => {
                Ok(LoadedSession { log, ratings, indexed: listed, session })
            }
            _ => Err(missing()),
        }
    }

    /// Builds the error page for a failed query of the index.
    pub(super) fn index_failure(&self, context: &RequestContext) -> Response {
        let why = Message::plain(format!("{}: unusable-cache", super::index::FILE_NAME));
        self.error_page(context, 500, &[Message::text("complaint.unreadable", &[("why", why)])])
    }

    /// Sets the examiner's name for this login. In blind mode the first name stays, because what an examiner may see
    /// depends on it.
    pub(super) fn set_display_name(&self, context: &RequestContext, name: &str) {
        if !self.blind || context.login.display_name.is_empty() {
            self.state().auth.set_display_name(&context.cookie, name);
        }
    }

    /// Returns true if the examiner may see the marks of a session and other examiners' judgements of it: always, but
    /// in blind mode only after an own overall rating.
    pub(super) fn may_see_marks(&self, context: &RequestContext, ratings: &RatingSnapshot, id: &str) -> bool {
        !self.blind || ratings.has_overall(&context.login.display_name, id)
    }

    /// Returns the query of a request. In blind mode neither filter nor order depends on marks, from which they could
    /// be inferred.
    pub(super) fn list_query(&self, context: &RequestContext) -> Query {
        let query = Query::parse(&context.request.query_pairs());
        if self.blind { query.without_marks() } else { query }
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
        decide: impl FnOnce(&OverrideSnapshot) -> Result<super::overrides::OverrideDraft, E>,
    ) -> Result<super::overrides::OverrideEntry, super::chained_log::AppendError<E>> {
        let mut state = self.state();
        let known = state.index.known_head(OVERRIDES_HEAD);
        state.log.append(&now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(), known.as_ref(), decide)
    }

    /// Appends a rating to its log, as [`ReviewApp::append_override`] does for an override.
    ///
    /// # Errors
    ///
    /// Returns an error when the log cannot be written or `decide` rejects.
    pub(super) fn append_rating<E>(
        &self,
        now: Timestamp,
        decide: impl FnOnce(&RatingSnapshot) -> Result<super::ratings::RatingDraft, E>,
    ) -> Result<super::ratings::RatingEntry, super::chained_log::AppendError<E>> {
        let mut state = self.state();
        let known = state.index.known_head(RATINGS_HEAD);
        state.rating_log.append(&now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(), known.as_ref(), decide)
    }

    /// Renders a page with the common layout.
    pub(super) fn page(
        &self,
        context: &RequestContext,
        log: &OverrideSnapshot,
        name: &str,
        body: impl Serialize,
    ) -> Response {
        let frame = self.layout(&context.language, context.request, Some(&context.login), Some(log));
        self.renderer.page(200, name, &context.language, &PageWithLayout { frame, body })
    }

    /// Renders an error page that lists all messages.
    pub(super) fn error_page(&self, context: &RequestContext, status: u16, messages: &[Message]) -> Response {
        let said = messages.iter().map(|said| self.renderer.translate(&context.language, said)).collect();
        let frame = self.layout(&context.language, context.request, Some(&context.login), None);
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
        login: Option<&Login>,
        log: Option<&OverrideSnapshot>,
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
        let ratings = log.map_or_else(Arc::default, |_| Arc::clone(&self.state().ratings));
        let of_ratings = |issue| format!("{}: {}", super::RATINGS, issue_text(issue));
        let troubles = log.iter().flat_map(|log| log.issues.iter().map(issue_text));
        PageLayout {
            language: language.to_string(),
            languages: self
                .renderer
                .languages()
                .iter()
                .map(|(c, n)| (c.to_string(), n.to_string(), language_link(c)))
                .collect(),
            form: login.map(|login| login.csrf_token.clone()).unwrap_or_default(),
            is_in: login.is_some(),
            anonymous: self.anonymous,
            blind: self.blind,
            examiner: login.map_or_else(String::new, |login| sanitize_display(&login.display_name, 120)),
            troubles: troubles.chain(ratings.issues.iter().map(of_ratings)).collect(),
            lines: log.map_or(0, |log| log.head.lines),
            head: log.map(|log| log.head.sha256.clone()).unwrap_or_default(),
            rating_lines: ratings.head.lines,
            rating_head: ratings.head.sha256.clone(),
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
    /// Updates the index from the folder and the logs, and returns the log of overrides.
    pub(super) fn refresh(&mut self, folder: &Path) -> Result<OverrideSnapshot, String> {
        let known = self.index.known_head(OVERRIDES_HEAD);
        let unreadable = |name: &str, e: std::io::Error| format!("{name}: unreadable-file: {e}");
        let log = self.log.read(known.as_ref()).map_err(|e| unreadable(super::OVERRIDES, e))?;
        let known = self.index.known_head(RATINGS_HEAD);
        let ratings = self.rating_log.read(known.as_ref()).map_err(|e| unreadable(super::RATINGS, e))?;
        self.report_issues([&log.issues, &ratings.issues]);
        self.index.refresh(folder, &log)?;
        self.remember_head(OVERRIDES_HEAD, &log.issues, &log.head);
        self.remember_head(RATINGS_HEAD, &ratings.issues, &ratings.head);
        self.ratings = Arc::new(ratings);
        Ok(log)
    }

    fn report_issues(&mut self, issues: [&Vec<IntegrityIssue>; 2]) {
        for ((known, found), name) in self.known_issues.iter_mut().zip(issues).zip([super::OVERRIDES, super::RATINGS]) {
            if known != found {
                self.unreported.extend(found.iter().map(|issue| format!("{name}: {issue}")));
                known.clone_from(found);
            }
        }
    }

    /// Remembers the state of an intact log, so that lines that disappear from its end are noticed.
    fn remember_head(&self, name: &str, issues: &[IntegrityIssue], head: &LogHead) {
        let is_intact = issues.iter().all(IntegrityIssue::is_accident);
        if is_intact && self.index.known_head(name).as_ref() != Some(head) && head.lines > 0 {
            self.index.remember_head(name, head);
        }
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
