//! The browser in which pages are opened.

use std::io::Write;

/// What is needed from outside; without it the test says loudly that it did nothing.
pub fn browser() -> Option<[String; 2]> {
    let found = ["TYPODONT_PLAYWRIGHT", "TYPODONT_CHROMIUM"].map(std::env::var);
    let [Ok(playwright), Ok(chromium)] = found else {
        // Straight to the terminal: the test harness would keep what a passing test prints to itself.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no browser opens our pages; set TYPODONT_PLAYWRIGHT and TYPODONT_CHROMIUM (see scripts/test)"
        );
        return None;
    };
    Some([playwright, chromium])
}
