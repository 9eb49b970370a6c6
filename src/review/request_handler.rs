//! Handling of requests: checks the origin and login of each, and dispatches it to its page.

use super::app::{PageWithLayout, RequestContext, ReviewApp, safe_redirect_target};
use super::auth::{PasswordLogin, TokenLogin};
use super::bundle;
use super::http::{BODY_MAX, Request, Response, first_value};
use super::origin::OriginError;
use super::router::Route;
use super::{agreement_page, compare, export, history, list, override_form, rating_form, session_page};
use serde::Serialize;
use std::sync::Arc;
use typodont_report::Message;

/// The name page has no values of its own.
#[derive(Serialize)]
struct NamePage {}

#[derive(Serialize)]
struct LoginPage {
    state: &'static str,
    /// Seconds until the next login attempt is accepted, where attempts are rate-limited.
    wait: i64,
}

/// Cookie that holds only the chosen language and does not identify anybody.
const LANGUAGE_COOKIE: &str = "typodont_language";

impl ReviewApp {
    /// Handles a request.
    pub fn handle(&self, request: &Request) -> Response {
        let mut response = self.route(request);
        response.log_lines.append(&mut self.state().unreported);
        response
    }

    fn route(&self, request: &Request) -> Response {
        if let Err(error) = self.allowed_hosts.check(request) {
            let status = if error == OriginError::Host { 421 } else { 403 };
            return Response::plain_error(status, error.message()).with_log(error.message());
        }
        let is_post = match request.method.as_str() {
            "GET" | "HEAD" => false,
            "POST" => true,
            _ => {
                return Response::plain_error(405, "wrong-method: this address does not accept the request's method")
                    .with_header("allow", "GET, HEAD, POST");
            }
        };
        let Some(route) = Route::parse(&request.path) else {
            return Response::plain_error(404, "no-page: there is no page at this address");
        };
        if is_post != route.is_post() && !(is_post && route.is_form_page()) {
            let allowed = if route.is_post() { "POST" } else { "GET, HEAD" };
            return Response::plain_error(405, "wrong-method: this address does not accept the request's method")
                .with_header("allow", allowed);
        }
        // A preview of a link asks by HEAD, and must not use up a login link.
        if route == Route::LoginLink && request.method != "GET" {
            return Response::plain_error(405, "wrong-method: this address does not accept the request's method")
                .with_header("allow", "GET");
        }
        if request.body.len() > BODY_MAX {
            return Response::plain_error(413, "long-form: the form is too long");
        }
        let content_type = request.header("content-type").unwrap_or_default();
        if is_post && content_type.split(';').next().map(str::trim) != Some("application/x-www-form-urlencoded") {
            return Response::plain_error(415, "wrong-form: forms must be sent as application/x-www-form-urlencoded");
        }
        let language =
            self.renderer.choose_language(request.cookie(LANGUAGE_COOKIE), request.header("accept-language"));
        match route {
            Route::LoginLink => self.log_in_with_link(request, &language),
            Route::Login => self.log_in_with_password(request, &language),
            Route::Language => self.set_language(request),
            route => match self.authenticate(request, &language) {
                Some(context) => self.route_logged_in(&context, &route),
                None => self.login_required(request, &language),
            },
        }
    }

    fn route_logged_in(&self, context: &RequestContext, route: &Route) -> Response {
        let is_post = context.request.method == "POST";
        if is_post {
            let form = context.request.form_pairs();
            if !self.state().auth.verify_csrf(&context.login, first_value(&form, "form")) {
                let response = self.error_page(context, 403, &[Message::text("complaint.foreign_form", &[])]);
                return response.with_log("foreign-form: a form without a valid CSRF token was refused");
            }
        }
        // What may be shown depends on who asks.
        if self.blind && context.login.display_name.is_empty() && !matches!(route, Route::Name | Route::Logout) {
            return if is_post { self.name_page(context, 403) } else { Response::redirect("/name") };
        }
        match route {
            Route::Name if is_post => self.set_name(context),
            Route::Name => self.name_page(context, 200),
            Route::Rate(id) => rating_form::rate(self, context, id),
            Route::RatingsCsv => export::ratings_csv(self, context),
            Route::RatingsJson => export::ratings_json(self, context),
            Route::List => list::page(self, context),
            Route::Session(id) => session_page::page(self, context, id),
            Route::Report(id) => self.report(context, id),
            Route::Picture(id, stem) => self.picture(context, id, stem),
            Route::Override(id) => override_form::override_points(self, context, id),
            Route::Withdraw(id) => override_form::withdraw(self, context, id),
            Route::Compare => compare::page(self, context),
            Route::Agreement => agreement_page::page(self, context),
            Route::History => history::page(self, context),
            Route::LeftOut => list::left_out(self, context),
            Route::Csv => export::csv(self, context),
            Route::Json => export::json(self, context),
            Route::Logout => {
                self.state().auth.log_out(&context.cookie);
                let expired_cookie = format!("{}; Max-Age=0", session_cookie(context.request, ""));
                self.login_page(&context.language, context.request, 200, "left", 0)
                    .with_header("set-cookie", expired_cookie)
            }
            Route::LoginLink | Route::Login | Route::Language => Response::redirect("/"),
        }
    }

    /// Renders the page on which an examiner gives a name.
    fn name_page(&self, context: &RequestContext, status: u16) -> Response {
        let frame = self.layout(&context.language, context.request, Some(&context.login), None);
        self.renderer.page(status, "name.html", &context.language, &PageWithLayout { frame, body: NamePage {} })
    }

    fn set_name(&self, context: &RequestContext) -> Response {
        let form = context.request.form_pairs();
        let mut errors = Vec::new();
        let name = override_form::parse_name(&form, &mut errors);
        if !errors.is_empty() {
            return self.error_page(context, 422, &errors);
        }
        self.set_display_name(context, &name);
        Response::redirect("/")
    }

    fn authenticate<'a>(&self, request: &'a Request, language: &str) -> Option<RequestContext<'a>> {
        let cookie = request.cookie(&cookie_name(request))?.to_string();
        let login = self.state().auth.authenticate(&cookie, request.now.as_second())?;
        Some(RequestContext { request, language: language.to_string(), login, cookie })
    }

    fn log_in_with_link(&self, request: &Request, language: &str) -> Response {
        if self.authenticate(request, language).is_some() {
            return Response::redirect("/");
        }
        let query = request.query_pairs();
        let outcome = self.state().auth.log_in_with_token(first_value(&query, "token"), request.now.as_second());
        match outcome {
            // A page with a refresh header instead of a redirect: the next request then originates from this site, so
            // the browser sends the SameSite cookie even if the link was opened from another site.
            Ok(TokenLogin::LoggedIn(cookie)) => self
                .login_page(language, request, 200, "in", 0)
                .with_header("set-cookie", session_cookie(request, &cookie))
                .with_header("refresh", "0; url=/"),
            Ok(TokenLogin::Spent(next)) => {
                let mut response = self.login_page(language, request, 403, "spent", 0);
                response.new_login_token = Some(next);
                response.with_log("spent-address: the address was already used; a new one is printed")
            }
            Ok(TokenLogin::Rejected) => self.login_required(request, language),
            Err(why) => Response::plain_error(500, &why).with_log(why.clone()),
        }
    }

    fn log_in_with_password(&self, request: &Request, language: &str) -> Response {
        if self.authenticate(request, language).is_some() {
            return Response::redirect("/");
        }
        if !self.state().auth.has_password() {
            return self.login_page(language, request, 403, "closed", 0);
        }
        if request.method != "POST" {
            return self.login_page(language, request, 200, "password", 0);
        }
        let form = request.form_pairs();
        let outcome = self.state().auth.log_in_with_password(
            first_value(&form, "password"),
            request.peer,
            request.cookie(&device_cookie_name(request)),
            request.now.as_second(),
        );
        match outcome {
            Ok(PasswordLogin::LoggedIn { cookie, device_cookie }) => {
                let name = override_form::parse_name(&form, &mut Vec::new());
                self.state().auth.set_display_name(&cookie, &name);
                Response::redirect("/")
                    .with_header("set-cookie", session_cookie(request, &cookie))
                    .with_header("set-cookie", device_cookie_header(request, &device_cookie))
            }
            Ok(PasswordLogin::WrongPassword) => {
                self.login_page(language, request, 403, "wrong", 0).with_log("wrong-password: a login was refused")
            }
            Ok(PasswordLogin::RateLimited(seconds)) => {
                self.login_page(language, request, 429, "wait", seconds).with_header("retry-after", seconds.to_string())
            }
            Err(why) => Response::plain_error(500, &why).with_log(why.clone()),
        }
    }

    fn login_required(&self, request: &Request, language: &str) -> Response {
        match self.state().auth.has_password() {
            true if request.method == "GET" => return Response::redirect("/door"),
            _ => {}
        }
        self.login_page(language, request, 403, "closed", 0)
    }

    fn login_page(&self, language: &str, request: &Request, status: u16, state: &'static str, wait: i64) -> Response {
        let frame = self.layout(language, request, None, None);
        self.renderer.page(status, "door.html", language, &PageWithLayout { frame, body: LoginPage { state, wait } })
    }

    fn set_language(&self, request: &Request) -> Response {
        let query = request.query_pairs();
        let code = self.renderer.choose_language(Some(first_value(&query, "to")), None);
        let cookie = format!("{LANGUAGE_COOKIE}={code}; Path=/; Max-Age=31536000; HttpOnly; SameSite=Strict");
        Response::redirect(&safe_redirect_target(first_value(&query, "back"))).with_header("set-cookie", cookie)
    }

    /// Serves a bundle's own report in a sandbox. A bundle may come from anybody, and scripts in its report must not
    /// be able to write overrides in the examiner's name: without the sandbox flag `allow-same-origin` they have no
    /// access to this site's cookies.
    fn report(&self, context: &RequestContext, id: &str) -> Response {
        const POLICY: &str = "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
                              script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
        if self.anonymous {
            return self.error_page(context, 403, &[Message::text("complaint.anonymous_report", &[])]);
        }
        let case = match self.load_session(context, id) {
            Ok(case) => case,
            Err(response) => return *response,
        };
        match bundle::read_verified(&self.folder, &case.indexed.path, bundle::REPORT, &case.session) {
            Ok(bytes) => Response::new(200, "text/html; charset=utf-8", POLICY, bytes),
            Err(why) => {
                self.error_page(context, 409, &[Message::text("complaint.no_report", &[("why", Message::plain(why))])])
            }
        }
    }

    fn picture(&self, context: &RequestContext, id: &str, stem: &str) -> Response {
        let state = self.state();
        let (listed, ratings) = (state.index.session(id), Arc::clone(&state.ratings));
        drop(state);
        // A map shows the verdict on every voxel.
        let is_hidden = bundle::is_map(stem) && !self.may_see_marks(context, &ratings, id);
        let bytes = match listed {
            Ok(Some(listed)) if !is_hidden => {
                bundle::read_bundle_session(&self.folder, &listed.path).and_then(|session| {
                    bundle::read_verified(&self.folder, &listed.path, &bundle::picture_path(stem), &session)
                })
            }
            _ => Err(String::new()),
        };
        match bytes {
            Ok(bytes) => Response::new(200, "image/png", super::http::CSP_NONE, bytes),
            Err(_) => Response::plain_error(404, "no-picture: the bundle has no such image"),
        }
    }
}

/// Name of the session cookie. Cookies are shared by all ports of a host, so the name contains the port.
fn cookie_name(request: &Request) -> String {
    format!("typodont_review_{}", request.local_addr.port())
}

/// Name of the cookie of a browser that has logged in before.
fn device_cookie_name(request: &Request) -> String {
    format!("typodont_device_{}", request.local_addr.port())
}

fn session_cookie(request: &Request, cookie: &str) -> String {
    secured(request, cookie_name(request), cookie)
}

fn device_cookie_header(request: &Request, cookie: &str) -> String {
    const MONTH_S: u32 = 30 * 24 * 3600;
    format!("{}; Max-Age={MONTH_S}", secured(request, device_cookie_name(request), cookie))
}

/// A cookie that scripts cannot read and other sites cannot make a browser send.
fn secured(request: &Request, name: String, value: &str) -> String {
    // A browser that uses HTTPS, through a proxy, must never send the cookie over plain HTTP.
    let secure = request.header("origin").is_some_and(|origin| origin.starts_with("https://"));
    let more = if secure { "; Secure" } else { "" };
    format!("{name}={value}; Path=/; HttpOnly; SameSite=Strict{more}")
}
