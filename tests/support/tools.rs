//! Programs that tests need from outside. `scripts/test` installs them.

use std::ffi::OsString;
use std::io::Write;

/// Set to 1 where every test must run, as in continuous integration: what is missing is a failure there.
const REQUIRE: &str = "TYPODONT_REQUIRE";

/// Says that a test is not run for want of something; a failure where everything is required.
pub fn skip(why: &str) {
    assert!(std::env::var_os(REQUIRE).is_none_or(|v| v != "1"), "{REQUIRE}=1, and {why} (see scripts/test)");
    // Straight to the terminal: the test harness would keep what a passing test prints to itself.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why} (see scripts/test)");
}

/// Value of an environment variable; without it the test is skipped by [`skip`].
pub fn named_by(variable: &str, what: &str) -> Option<OsString> {
    let found = std::env::var_os(variable);
    if found.is_none() {
        skip(&format!("{variable} does not name {what}"));
    }
    found
}
