//! The program as a page: `scripts/web` builds it for a browser, beside the files of `src/web/page`.
//!
//! Takes the page's canvas. Gives the exercise list in it. Never talks to a server: sessions stay in the page until their
//! bundle is downloaded.

#[cfg(target_family = "wasm")]
mod page;

/// Opens the page. Elsewhere than in a browser there is none, and the program ends at once.
fn main() {
    #[cfg(target_family = "wasm")]
    page::open();
}
