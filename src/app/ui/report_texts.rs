//! The texts of a screen that shows measures: those of the window, and those of reports in the window's language.

use crate::i18n::Translations;
use typodont_report::{Languages, Message};

/// Texts of the window, and those of reports.
pub struct ReportTexts<'a> {
    pub words: &'a Translations,
    pub languages: &'a Languages,
}

impl ReportTexts<'_> {
    /// Returns a message of a report in the window's language.
    pub fn text(&self, message: &Message) -> String {
        self.languages.text_in(&self.words.code, message)
    }
}
