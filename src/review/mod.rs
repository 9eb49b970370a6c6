//! An examiner's desk: sessions listed, compared and judged in a browser.
//!
//! Takes a folder of bundles and plain requests. Gives plain responses: pages, tables, a bundle's own files; and writes what an
//! examiner judged into a log that only grows. Never opens a socket or looks at a clock (that is the command line's), and never
//! changes a bundle.

mod exchange;
mod route;
mod origin;
mod door;
mod chance;
mod bundle;
mod codes;
mod query;
mod index;
mod overrides;
mod standing;
mod look;
mod desk;
mod list;
mod sitting;
mod compare;
mod export;
mod judging;
mod history;

pub use desk::{Desk, Options};
pub use door::{Lock, PASSWORD_MIN};
pub use exchange::{BODY_MAX, Request, Response};
pub use look::Look;
pub use overrides::{Entry, FILE_NAME as OVERRIDES, Judged, Log, Told, Trouble, Unwritten};
pub use standing::{Standing, applied};

/// What an address asks for, as it may stand in a log; no part of the address itself.
pub fn name_of(path: &str) -> &'static str {
    route::Route::of(path).map_or("nothing", |route| route.name())
}
