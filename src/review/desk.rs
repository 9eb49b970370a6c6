//! The desk itself: a question comes in, is let in or not, and goes to the page it asks for.

use super::bundle;
use super::codes::Codes;
use super::door::{Door, Guest, Lock, Opened, Tried};
use super::exchange::{BODY_MAX, Request, Response, value};
use super::index::{Index, Listed};
use super::look::Look;
use super::origin::{Foreign, Names};
use super::overrides::{Log, Told, Trouble};
use super::route::Route;
use super::{compare, export, history, judging, list, sitting};
use crate::report::{Said, SessionFile, harmless};
use jiff::Timestamp;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the desk is set up with.
pub struct Options {
    /// Folder that holds bundles, at any depth.
    pub folder: PathBuf,
    pub lock: Lock,
    /// Names by which this machine is reached beside its addresses.
    pub names: Vec<String>,
    /// Participants are shown as codes.
    pub anonymous: bool,
    pub look: Look,
}

pub struct Desk {
    /// Canonical.
    pub(super) folder: PathBuf,
    pub(super) look: Look,
    pub(super) anonymous: bool,
    names: Names,
    state: Mutex<State>,
}

/// What changes.
pub(super) struct State {
    pub index: Index,
    pub log: Log,
    pub door: Door,
    /// What was wrong with the log at the last look, and what is still to be told of it.
    troubles: Vec<Trouble>,
    untold: Vec<String>,
}

/// Somebody who is in, and how they are spoken to.
pub(super) struct Visit<'a> {
    pub request: &'a Request,
    pub language: String,
    pub guest: Guest,
    cookie: String,
}

/// A session as its bundle holds it now, with the log.
pub(super) struct Case {
    pub told: Told,
    pub listed: Listed,
    pub session: SessionFile,
}

/// What stands around every page.
#[derive(Serialize)]
pub(super) struct Frame {
    language: String,
    /// Code, name, and the address of this page in it.
    languages: Vec<(String, String, String)>,
    /// What a form shows to be one of ours; empty at the door.
    form: String,
    is_in: bool,
    anonymous: bool,
    troubles: Vec<String>,
    /// Lines of the log, and the last one's digest.
    lines: u64,
    head: String,
}

/// A page's own content within its frame.
#[derive(Serialize)]
pub(super) struct Framed<T> {
    #[serde(flatten)]
    frame: Frame,
    #[serde(flatten)]
    body: T,
}

#[derive(Serialize)]
struct Complaint {
    /// Sentences.
    said: Vec<String>,
}

#[derive(Serialize)]
struct DoorPage {
    state: &'static str,
    /// Seconds to wait, where the door asks for it.
    wait: i64,
}

/// A cookie for the language alone: it says nothing about who.
const LANGUAGE: &str = "typodont_language";

impl Desk {
    /// Sets the desk up, and gives what opens its door the first time.
    ///
    /// `Err` when the folder is none, or its secret, its cache or the system's chance fails.
    pub fn set_up(options: Options) -> Result<(Desk, String), String> {
        let Options { folder, lock, names, anonymous, look } = options;
        let canonical =
            std::fs::canonicalize(&folder).map_err(|e| format!("{}: missing-folder: {e}", folder.display()))?;
        if !canonical.is_dir() {
            return Err(format!("{}: missing-folder: it is no folder", folder.display()));
        }
        let codes = match anonymous {
            true => Some(Codes::of_or_new(&canonical)?),
            false => Codes::of(&canonical)?,
        };
        let index = Index::open(&canonical, codes)?;
        let (door, opens) = Door::new(&lock)?;
        let state = State { index, log: Log::of(&canonical), door, troubles: Vec::new(), untold: Vec::new() };
        let desk = Desk { folder: canonical, look, anonymous, names: Names(names), state: Mutex::new(state) };
        Ok((desk, opens))
    }

    /// How many sessions there are, how many files are left out, and what is wrong with the log: the first look.
    pub fn look_over(&self) -> Result<(usize, usize, Vec<String>), String> {
        let mut state = self.state();
        state.look_again(&self.folder)?;
        let lost = |e: rusqlite::Error| format!("{}: unusable-cache: {e}", super::index::FILE_NAME);
        let (_, count) = state.index.page(&super::query::Query::of(&[]), self.anonymous).map_err(lost)?;
        let left_out = state.index.left_out().map_err(lost)?.len();
        let mut troubles = std::mem::take(&mut state.untold);
        troubles.extend(state.index.homeless.as_ref().map(|why| {
            format!("{}: unusable-cache: {why}; every start reads all bundles anew", super::index::FILE_NAME)
        }));
        Ok((count, left_out, troubles))
    }

    /// The state, also after a thread that held it failed: what is on disk is whole, and the rest is read anew.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers a question.
    pub fn answer(&self, request: &Request) -> Response {
        let mut response = self.answered(request);
        response.told.append(&mut self.state().untold);
        response
    }

    fn answered(&self, request: &Request) -> Response {
        if let Err(foreign) = self.names.check(request) {
            let status = if foreign == Foreign::Host { 421 } else { 403 };
            return Response::refusal(status, foreign.why()).telling(foreign.why());
        }
        let is_form = match request.method.as_str() {
            "GET" | "HEAD" => false,
            "POST" => true,
            _ => {
                return Response::refusal(405, "wrong-method: pages are got and forms are posted")
                    .with("allow", "GET, HEAD, POST");
            }
        };
        let Some(route) = Route::of(&request.path) else {
            return Response::refusal(404, "no-page: there is nothing at this address");
        };
        if is_form != route.is_written() && !(is_form && route == Route::Door) {
            let allowed = if route.is_written() { "POST" } else { "GET, HEAD" };
            return Response::refusal(405, "wrong-method: pages are got and forms are posted").with("allow", allowed);
        }
        if request.body.len() > BODY_MAX {
            return Response::refusal(413, "long-form: nobody writes that much");
        }
        let kind = request.header("content-type").unwrap_or_default();
        if is_form && kind.split(';').next().map(str::trim) != Some("application/x-www-form-urlencoded") {
            return Response::refusal(415, "wrong-form: forms are sent as application/x-www-form-urlencoded");
        }
        let language = self.look.language(request.cookie(LANGUAGE), request.header("accept-language"));
        match route {
            Route::Enter => self.enter(request, &language),
            Route::Door => self.at_the_door(request, &language),
            Route::Language => self.other_language(request),
            route => match self.visit(request, &language) {
                Some(visit) => self.answer_guest(&visit, &route),
                None => self.outside(request, &language),
            },
        }
    }

    fn answer_guest(&self, visit: &Visit, route: &Route) -> Response {
        if route.is_written() {
            let form = visit.request.form();
            if !self.state().door.is_own_form(&visit.guest, value(&form, "form")) {
                let response = self.complain(visit, 403, &[Said::text("complaint.foreign_form", &[])]);
                return response.telling("foreign-form: a form without its own value was refused");
            }
        }
        match route {
            Route::List => list::page(self, visit),
            Route::Session(id) => sitting::page(self, visit, id),
            Route::Report(id) => self.report(visit, id),
            Route::Picture(id, stem) => self.picture(id, stem),
            Route::Override(id) => judging::judge(self, visit, id),
            Route::Withdraw(id) => judging::withdraw(self, visit, id),
            Route::Compare => compare::page(self, visit),
            Route::History => history::page(self, visit),
            Route::LeftOut => list::left_out(self, visit),
            Route::Csv => export::csv(self, visit),
            Route::Json => export::json(self, visit),
            Route::Leave => {
                self.state().door.leave(&visit.cookie);
                let gone = format!("{}; Max-Age=0", set_cookie(visit.request, ""));
                self.door_page(&visit.language, visit.request, 200, "left", 0).with("set-cookie", gone)
            }
            Route::Enter | Route::Door | Route::Language => Response::see("/"),
        }
    }

    fn visit<'a>(&self, request: &'a Request, language: &str) -> Option<Visit<'a>> {
        let cookie = request.cookie(&cookie_name(request))?.to_string();
        let guest = self.state().door.guest(&cookie, request.now.as_second())?;
        Some(Visit { request, language: language.to_string(), guest, cookie })
    }

    fn enter(&self, request: &Request, language: &str) -> Response {
        if self.visit(request, language).is_some() {
            return Response::see("/");
        }
        let asked = request.asked();
        let opened = self.state().door.open(value(&asked, "token"), request.now.as_second());
        match opened {
            // By a page and not by a redirect: the browser then comes from here, and shows its cookie wherever it came from.
            Ok(Opened::In(cookie)) => self
                .door_page(language, request, 200, "in", 0)
                .with("set-cookie", set_cookie(request, &cookie))
                .with("refresh", "0; url=/"),
            Ok(Opened::Spent(next)) => {
                let mut response = self.door_page(language, request, 403, "spent", 0);
                response.opens = Some(next);
                response.telling("spent-address: it was opened before; a new one is printed")
            }
            Ok(Opened::No) => self.outside(request, language),
            Err(why) => Response::refusal(500, &why).telling(why.clone()),
        }
    }

    fn at_the_door(&self, request: &Request, language: &str) -> Response {
        if self.visit(request, language).is_some() {
            return Response::see("/");
        }
        if !self.state().door.has_password() {
            return self.door_page(language, request, 403, "closed", 0);
        }
        if request.method != "POST" {
            return self.door_page(language, request, 200, "password", 0);
        }
        let form = request.form();
        let tried = self.state().door.try_password(value(&form, "password"), request.peer, request.now.as_second());
        match tried {
            Ok(Tried::In(cookie)) => Response::see("/").with("set-cookie", set_cookie(request, &cookie)),
            Ok(Tried::Wrong) => {
                self.door_page(language, request, 403, "wrong", 0).telling("wrong-password: somebody did not know it")
            }
            Ok(Tried::Wait(seconds)) => {
                self.door_page(language, request, 429, "wait", seconds).with("retry-after", seconds.to_string())
            }
            Err(why) => Response::refusal(500, &why).telling(why.clone()),
        }
    }

    fn outside(&self, request: &Request, language: &str) -> Response {
        match self.state().door.has_password() {
            true if request.method == "GET" => return Response::see("/door"),
            _ => {}
        }
        self.door_page(language, request, 403, "closed", 0)
    }

    fn door_page(&self, language: &str, request: &Request, status: u16, state: &'static str, wait: i64) -> Response {
        let frame = self.frame(language, request, "", None);
        self.look.page(status, "door.html", language, &Framed { frame, body: DoorPage { state, wait } })
    }

    fn other_language(&self, request: &Request) -> Response {
        let asked = request.asked();
        let code = self.look.language(Some(value(&asked, "to")), None);
        let cookie = format!("{LANGUAGE}={code}; Path=/; Max-Age=31536000; HttpOnly; SameSite=Strict");
        Response::see(&own_place(value(&asked, "back"))).with("set-cookie", cookie)
    }

    /// A bundle's own page, in a room of its own: a bundle may come from anybody, and what runs in its page must not be able to
    /// judge in the examiner's name. Without the sandbox's `allow-same-origin` it has no cookie of ours.
    fn report(&self, visit: &Visit, id: &str) -> Response {
        const POLICY: &str = "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
                              script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
        if self.anonymous {
            return self.complain(visit, 403, &[Said::text("complaint.anonymous_report", &[])]);
        }
        let case = match self.case(visit, id) {
            Ok(case) => case,
            Err(response) => return *response,
        };
        match bundle::read_named(&self.folder, &case.listed.path, bundle::REPORT, &case.session) {
            Ok(bytes) => Response::new(200, "text/html; charset=utf-8", POLICY, bytes),
            Err(why) => self.complain(visit, 409, &[Said::text("complaint.no_report", &[("why", Said::plain(why))])]),
        }
    }

    fn picture(&self, id: &str, stem: &str) -> Response {
        let listed = self.state().index.session(id);
        let bytes = match listed {
            Ok(Some(listed)) => bundle::session(&self.folder, &listed.path)
                .and_then(|session| bundle::read_named(&self.folder, &listed.path, &bundle::picture(stem), &session)),
            _ => Err(String::new()),
        };
        match bytes {
            Ok(bytes) => Response::new(200, "image/png", super::exchange::NOTHING, bytes),
            Err(_) => Response::refusal(404, "no-picture: the bundle has no such picture"),
        }
    }

    /// Looks at folder and log again, and gives what they say now.
    pub(super) fn look_again(&self, visit: &Visit) -> Result<(MutexGuard<'_, State>, Told), Box<Response>> {
        let mut state = self.state();
        match state.look_again(&self.folder) {
            Ok(told) => Ok((state, told)),
            Err(why) => {
                drop(state);
                let said = Said::text("complaint.unreadable", &[("why", Said::plain(harmless(&why, 300)))]);
                Err(Box::new(self.complain(visit, 500, &[said]).telling(why)))
            }
        }
    }

    /// A session as its bundle holds it now, with the log.
    pub(super) fn case(&self, visit: &Visit, id: &str) -> Result<Case, Box<Response>> {
        let (state, told) = self.look_again(visit)?;
        let listed = state.index.session(id);
        drop(state);
        let missing = || Box::new(self.complain(visit, 404, &[Said::text("complaint.no_session", &[])]));
        let listed = listed.ok().flatten().ok_or_else(missing)?;
        match bundle::session(&self.folder, &listed.path) {
            Ok(session) if crate::handover::session_id(&session) == id => Ok(Case { told, listed, session }),
            _ => Err(missing()),
        }
    }

    /// The cache failed between two questions to it.
    pub(super) fn lost(&self, visit: &Visit) -> Response {
        let why = Said::plain(format!("{}: unusable-cache", super::index::FILE_NAME));
        self.complain(visit, 500, &[Said::text("complaint.unreadable", &[("why", why)])])
    }

    pub(super) fn name_guest(&self, visit: &Visit, name: &str) {
        self.state().door.call(&visit.cookie, name);
    }

    /// Appends to the log, by `decide`; which sees what stands there when nobody else can write.
    pub(super) fn append<E>(
        &self,
        now: Timestamp,
        decide: impl FnOnce(&Told) -> Result<super::overrides::Draft, E>,
    ) -> Result<super::overrides::Entry, super::overrides::Unwritten<E>> {
        let mut state = self.state();
        let known = state.index.known_head();
        state.log.append(&now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(), known.as_ref(), decide)
    }

    /// A page within its frame.
    pub(super) fn page(&self, visit: &Visit, told: &Told, name: &str, body: impl Serialize) -> Response {
        let frame = self.frame(&visit.language, visit.request, &visit.guest.form, Some(told));
        self.look.page(200, name, &visit.language, &Framed { frame, body })
    }

    /// A page that says what is wrong, or what is missing, completely.
    pub(super) fn complain(&self, visit: &Visit, status: u16, what: &[Said]) -> Response {
        let said = what.iter().map(|said| self.look.say(&visit.language, said)).collect();
        let frame = self.frame(&visit.language, visit.request, &visit.guest.form, None);
        self.look.page(status, "complaint.html", &visit.language, &Framed { frame, body: Complaint { said } })
    }

    fn frame(&self, language: &str, request: &Request, form: &str, told: Option<&Told>) -> Frame {
        let say = |said: &Said| self.look.say(language, said);
        let trouble = |trouble: &Trouble| {
            let (name, numbers) = trouble.words();
            let numbers: Vec<(&str, Said)> = numbers.iter().map(|(n, v)| (*n, Said::plain(v.to_string()))).collect();
            say(&Said::text(format!("trouble.{name}"), &numbers))
        };
        let query = if request.query.is_empty() { String::new() } else { format!("?{}", request.query) };
        let back = if request.method == "POST" { "/".into() } else { own_place(&format!("{}{query}", request.path)) };
        let link = |code: &str| {
            let mut out = url::form_urlencoded::Serializer::new(String::new());
            format!("/language?{}", out.append_pair("to", code).append_pair("back", &back).finish())
        };
        Frame {
            language: language.to_string(),
            languages: self.look.languages().iter().map(|(c, n)| (c.to_string(), n.to_string(), link(c))).collect(),
            form: form.to_string(),
            is_in: !form.is_empty(),
            anonymous: self.anonymous,
            troubles: told.map(|told| told.troubles.iter().map(trouble).collect()).unwrap_or_default(),
            lines: told.map_or(0, |told| told.head.lines),
            head: told.map(|told| told.head.sha256.clone()).unwrap_or_default(),
        }
    }

    pub(super) fn say(&self, visit: &Visit, said: &Said) -> String {
        self.look.say(&visit.language, said)
    }

    /// What a participant is called here.
    pub(super) fn called(&self, listed: &Listed) -> String {
        let name = if self.anonymous { &listed.code } else { &listed.participant };
        harmless(name, SHOWN_MAX)
    }

    /// When a session began; of whom nobody is to know, only the day.
    pub(super) fn began(&self, listed: &Listed) -> String {
        let most = if self.anonymous { 10 } else { 19 };
        let text: String = listed.began.chars().take(most).collect();
        harmless(&text.replace('T', " "), SHOWN_MAX)
    }
}

/// Letters of a code, a title or a reason in a list: what is longer was not written to be read.
pub(super) const SHOWN_MAX: usize = 80;

impl State {
    fn look_again(&mut self, folder: &Path) -> Result<Told, String> {
        let known = self.index.known_head();
        let unread = |e: std::io::Error| format!("{}: unreadable-file: {e}", super::OVERRIDES);
        let told = self.log.told(known.as_ref()).map_err(unread)?;
        if told.troubles != self.troubles {
            self.untold.extend(told.troubles.iter().map(|trouble| format!("{}: {trouble}", super::OVERRIDES)));
            self.troubles.clone_from(&told.troubles);
        }
        self.index.refresh(folder, &told)?;
        let is_sound = told.troubles.iter().all(Trouble::is_accident);
        if is_sound && self.index.known_head().as_ref() != Some(&told.head) && told.head.lines > 0 {
            self.index.know_head(&told.head);
        }
        Ok(told)
    }
}

/// Cookies do not know ports: each desk on a machine has its own.
fn cookie_name(request: &Request) -> String {
    format!("typodont_review_{}", request.at.port())
}

fn set_cookie(request: &Request, cookie: &str) -> String {
    // Whoever came by HTTPS, through a proxy, never shows it without.
    let secure = request.header("origin").is_some_and(|origin| origin.starts_with("https://"));
    let more = if secure { "; Secure" } else { "" };
    format!("{}={cookie}; Path=/; HttpOnly; SameSite=Strict{more}", cookie_name(request))
}

/// Letters of a query that a way back keeps; ours have some hundred.
const QUERY_MAX: usize = 2000;

/// An address of ours, as it may stand in a header; the list for any other.
fn own_place(place: &str) -> String {
    let (path, query) = place.split_once('?').unwrap_or((place, ""));
    match Route::of(path).filter(|route| !route.is_written()) {
        None | Some(Route::Enter | Route::Language) => "/".into(),
        Some(_) if query.is_empty() || query.len() > QUERY_MAX => path.to_string(),
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
    fn a_way_back_leads_nowhere_else() {
        for (place, expected) in [
            ("/", "/"),
            ("/?text=a%20b", "/?text=a+b"),
            ("/compare?session=x\r\nset-cookie: a", "/compare?session=x%0D%0Aset-cookie%3A+a"),
            ("//evil.example", "/"),
            ("/\\evil.example", "/"),
            ("https://evil.example", "/"),
            ("/enter?token=x", "/"),
            ("", "/"),
        ] {
            assert_eq!(own_place(place), expected);
        }
    }
}
