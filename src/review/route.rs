//! Which page an address means. Whatever is not in the list means none.

use super::bundle::is_picture;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Route {
    List,
    /// In by the address that was printed.
    Enter,
    /// In by password.
    Door,
    Leave,
    Language,
    Session(String),
    /// A bundle's own page.
    Report(String),
    /// One of a bundle's pictures, by the stem of its name.
    Picture(String, String),
    Override(String),
    Withdraw(String),
    Compare,
    History,
    LeftOut,
    Csv,
    Json,
}

impl Route {
    /// Addresses are compared as they were sent: nothing is decoded, so nothing can be hidden in one.
    pub fn of(path: &str) -> Option<Route> {
        let parts: Vec<&str> = path.strip_prefix('/')?.split('/').collect();
        Some(match parts.as_slice() {
            [""] => Route::List,
            ["enter"] => Route::Enter,
            ["door"] => Route::Door,
            ["leave"] => Route::Leave,
            ["language"] => Route::Language,
            ["compare"] => Route::Compare,
            ["history"] => Route::History,
            ["left-out"] => Route::LeftOut,
            ["sessions.csv"] => Route::Csv,
            ["sessions.json"] => Route::Json,
            ["session", id, rest @ ..] if is_id(id) => {
                let id = id.to_string();
                match rest {
                    [] => Route::Session(id),
                    ["report"] => Route::Report(id),
                    ["override"] => Route::Override(id),
                    ["withdraw"] => Route::Withdraw(id),
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

    /// Whether it is asked or told: a form is sent to it, and nothing else.
    pub fn is_written(&self) -> bool {
        matches!(self, Route::Override(_) | Route::Withdraw(_) | Route::Leave)
    }

    /// What it is called in a log: no address stands there, because addresses hold what people wrote.
    pub fn name(&self) -> &'static str {
        match self {
            Route::List => "list",
            Route::Enter => "enter",
            Route::Door => "door",
            Route::Leave => "leave",
            Route::Language => "language",
            Route::Session(_) => "session",
            Route::Report(_) => "report",
            Route::Picture(..) => "picture",
            Route::Override(_) => "override",
            Route::Withdraw(_) => "withdraw",
            Route::Compare => "compare",
            Route::History => "history",
            Route::LeftOut => "left-out",
            Route::Csv => "csv",
            Route::Json => "json",
        }
    }
}

/// A UUID as `handover` writes it.
pub fn is_id(text: &str) -> bool {
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
    fn only_what_is_listed_has_an_address() {
        let id = "2ed6657d-e927-568b-95e1-2665a8aea6a2";
        let check = |path: &str, expected: Option<Route>| assert_eq!(Route::of(path), expected, "{path}");
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
