//! Web application in which examiners list, compare and override graded sessions.
//!
//! Takes a folder of bundles and HTTP requests as plain values. Gives responses as plain values (pages, tables, files
//! of a bundle) and appends examiners' overrides and ratings to append-only logs. Never opens a socket or reads a clock (the
//! command line does), and never changes a bundle.
//!
//! ```
//! use typodont_review::{OverrideSnapshot, route_name};
//!
//! // Requests are logged by route name, never by address, which may contain what a person wrote.
//! assert_eq!(route_name("/session/2ed6657d-e927-568b-95e1-2665a8aea6a2/report"), "report");
//! assert_eq!(route_name("/../etc/passwd"), "nothing");
//! // An empty log overrides nothing.
//! assert_eq!(OverrideSnapshot::default().valid_entries().count(), 0);
//! ```

mod http;
mod request_handler;
mod router;
mod origin;
mod auth;
mod crypto;
mod bundle;
mod pseudonyms;
mod query;
mod index;
mod chained_log;
mod overrides;
mod ratings;
mod effective_grade;
mod page_renderer;
mod app;
mod list;
mod session_page;
mod compare;
mod export;
mod verification;
mod override_form;
mod rating_form;
mod blind_page;
mod history;
mod agreement_page;

pub use app::{ReviewApp, ReviewOptions};
pub use auth::{AuthMode, PASSWORD_MIN};
pub use chained_log::{AppendError, ChainedLog, IntegrityIssue, LogEntry, LogSnapshot, LoggedDraft};
pub use effective_grade::{EffectiveGrade, EffectiveItem, effective_grade, with_overrides};
pub use http::{BODY_MAX, Request, Response};
pub use overrides::{GivenPoints, OverrideDraft, OverrideEntry, OverrideLog, OverrideSnapshot};
pub use page_renderer::PageRenderer;
pub use ratings::{ItemRating, RatingDraft, RatingEntry, RatingLog, RatingSnapshot, SCALE_MAX, SCALE_MIN};

/// File names of the logs, in the folder of the bundles.
pub const OVERRIDES: &str = <overrides::OverrideDraft as chained_log::LoggedDraft>::FILE_NAME;
pub const RATINGS: &str = <ratings::RatingDraft as chained_log::LoggedDraft>::FILE_NAME;

/// Returns the name under which a request's path is logged: the name of its route, or `nothing` for an unknown path.
/// The name contains no part of the path.
pub fn route_name(path: &str) -> &'static str {
    router::Route::parse(path).map_or("nothing", |route| route.name())
}
