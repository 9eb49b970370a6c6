//! Routing of request paths. Paths that are not listed here have no page.

use super::bundle::is_picture;

/// Page or action of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Route {
    List,
    /// Login with the printed one-time link.
    LoginLink,
    /// Login with the password.
    Login,
    Logout,
    Language,
    Session(String),
    /// A bundle's own report.
    Report(String),
    /// Image of a bundle, by session id and file stem.
    Picture(String, String),
    Override(String),
    Withdraw(String),
    /// Form that rates a session.
    Rate(String),
    /// Examiner's name for this login.
    Name,
    Compare,
    Agreement,
    History,
    LeftOut,
    Csv,
    Json,
    RatingsCsv,
    RatingsJson,
}

impl Route {
    /// Parses a path as sent. Nothing is percent-decoded, so a path cannot hide other segments.
    pub fn parse(path: &str) -> Option<Route> {
        let parts: Vec<&str> = path.strip_prefix('/')?.split('/').collect();
        Some(match parts.as_slice() {
            [""] => Route::List,
            ["enter"] => Route::LoginLink,
            ["door"] => Route::Login,
            ["leave"] => Route::Logout,
            ["language"] => Route::Language,
            ["compare"] => Route::Compare,
            ["agreement"] => Route::Agreement,
            ["history"] => Route::History,
            ["left-out"] => Route::LeftOut,
            ["sessions.csv"] => Route::Csv,
            ["sessions.json"] => Route::Json,
            ["ratings.csv"] => Route::RatingsCsv,
            ["ratings.json"] => Route::RatingsJson,
            ["name"] => Route::Name,
            ["session", id, rest @ ..] if is_session_id(id) => {
                let id = id.to_string();
                match rest {
                    [] => Route::Session(id),
                    ["report"] => Route::Report(id),
                    ["override"] => Route::Override(id),
                    ["withdraw"] => Route::Withdraw(id),
                    ["rate"] => Route::Rate(id),
                    ["view", file] => {
                        let stem = file.strip_suffix(".png").filter(|stem| is_picture(stem))?;
                        Route::Picture(id, stem.to_string())
                    }
                    _ => return None,
                }
            }
            _ => return None,
        })
    }

    /// Returns true if the route accepts only POST requests.
    pub fn is_post(&self) -> bool {
        matches!(self, Route::Override(_) | Route::Withdraw(_) | Route::Rate(_) | Route::Logout)
    }

    /// Returns true if the route accepts GET and POST requests: a page with a form of its own.
    pub fn is_form_page(&self) -> bool {
        matches!(self, Route::Login | Route::Name)
    }

    /// Returns the name used in the log, in place of the address, which may contain user-written text.
    pub fn name(&self) -> &'static str {
        match self {
            Route::List => "list",
            Route::LoginLink => "enter",
            Route::Login => "door",
            Route::Logout => "leave",
            Route::Language => "language",
            Route::Session(_) => "session",
            Route::Report(_) => "report",
            Route::Picture(..) => "picture",
            Route::Override(_) => "override",
            Route::Withdraw(_) => "withdraw",
            Route::Rate(_) => "rate",
            Route::Name => "name",
            Route::Compare => "compare",
            Route::Agreement => "agreement",
            Route::History => "history",
            Route::LeftOut => "left-out",
            Route::Csv => "csv",
            Route::Json => "json",
            Route::RatingsCsv => "ratings-csv",
            Route::RatingsJson => "ratings-json",
        }
    }
}

/// Returns true for a UUID in the form of [`typodont_integrations::session_id`].
pub fn is_session_id(text: &str) -> bool {
    let hyphen = |place: usize| [8, 13, 18, 23].contains(&place);
    text.len() == 36
        && text.bytes().enumerate().all(|(place, b)| match hyphen(place) {
            true => b == b'-',
            false => b.is_ascii_digit() || (b'a'..=b'f').contains(&b),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_listed_paths_have_a_route() {
        let id = "2ed6657d-e927-568b-95e1-2665a8aea6a2";
        let check = |path: &str, expected: Option<Route>| assert_eq!(Route::parse(path), expected, "{path}");
        check("/", Some(Route::List));
        check(&format!("/session/{id}"), Some(Route::Session(id.into())));
        check(&format!("/session/{id}/view/map-occlusal.png"), Some(Route::Picture(id.into(), "map-occlusal".into())));
        for path in [
            "",
            "//",
            "/..",
            "/session/..",
            "/session/../../etc/passwd",
            "/session/%2e%2e%2fetc",
            "/session/2ED6657D-E927-568B-95E1-2665A8AEA6A2",
        ] {
            check(path, None);
        }
        for file in ["../session.json", "..%2fsession.json", "map-occlusal.png/..", "x.png", "map-occlusal.PNG", ".png"]
        {
            check(&format!("/session/{id}/view/{file}"), None);
        }
    }
}
