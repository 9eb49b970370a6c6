//! The program as a page: `scripts/web` builds it for a browser, beside the files of `src/web/page`.
//!
//! Takes the page's canvas and address. Gives the exercise list, or the exercise that the address names. Never sends
//! anything to a server: sessions stay in the page until their bundle is downloaded.

#[cfg(target_family = "wasm")]
mod launch;
#[cfg(target_family = "wasm")]
mod page;

/// Opens the page or, in a worker of it, runs a lesson. Elsewhere than in a browser there is neither, and the program ends at
/// once.
fn main() {
    #[cfg(target_family = "wasm")]
    if !typodont_app::serve_lesson() {
        page::open();
    }
}
