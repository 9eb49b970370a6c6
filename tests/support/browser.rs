//! The browser in which pages are opened.

use super::tools;

/// The folder of playwright-core and Chromium's program; without them the test is skipped.
pub fn browser() -> Option<[String; 2]> {
    let text = |variable, what| tools::named_by(variable, what).map(|v| v.to_string_lossy().into_owned());
    let playwright = text("TYPODONT_PLAYWRIGHT", "the folder of playwright-core")?;
    Some([playwright, text("TYPODONT_CHROMIUM", "Chromium")?])
}
