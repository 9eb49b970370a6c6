//! Ratings: examiners' own judgements of a session on a scale, by which their agreement is measured.
//!
//! A rating is blind if it was entered before its examiner could see the computed marks. It stays in the log and
//! counts, whatever the same examiner enters later.

use super::chained_log::{ChainedLog, LogEntry, LogSnapshot, LoggedDraft};
use super::overrides::RubricItemRef;
use serde::{Deserialize, Serialize};
use typodont_report::name_folding::examiner_key;

/// Range of the highest value of a scale: at least fail, borderline and pass; at most what fits a row of choices.
pub const SCALE_MIN: u8 = 3;
pub const SCALE_MAX: u8 = 10;

/// One examiner's rating of one session, as written to the log.
pub type RatingEntry = LogEntry<RatingDraft>;

/// Log of ratings of a folder.
pub type RatingLog = ChainedLog<RatingDraft>;

/// Content of a log of ratings, with the issues found in it.
pub type RatingSnapshot = LogSnapshot<RatingDraft>;

/// Content of a rating, before it has a line number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RatingDraft {
    /// Id of the session.
    pub session: String,
    /// SHA-256 of the session's recording as stated in `session.json`; empty for a session entered by hand.
    #[serde(default)]
    pub recording: String,
    /// Highest value of the scale: 1 is a fail, 2 borderline, 3 a pass, and higher values are better.
    pub scale: u8,
    /// Rating of the work as a whole.
    #[serde(default)]
    pub overall: Option<u8>,
    /// Ratings of items of the rubric; items that were not rated are left out.
    #[serde(default)]
    pub items: Vec<ItemRating>,
    /// True if the marks were hidden when the rating was entered.
    pub blind: bool,
    #[serde(default)]
    pub note: String,
    pub name: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ItemRating {
    #[serde(flatten)]
    pub item: RubricItemRef,
    pub rating: u8,
}

impl LoggedDraft for RatingDraft {
    const FILE_NAME: &'static str = "ratings.jsonl";

    fn session(&self) -> &str {
        &self.session
    }
}

impl RatingSnapshot {
    /// Returns true if the examiner of this name has rated the session as a whole.
    pub fn has_overall(&self, name: &str, session: &str) -> bool {
        let key = examiner_key(name);
        let mut own = self.valid_entries().filter(|entry| entry.draft.session == session);
        !key.is_empty() && own.any(|entry| entry.draft.overall.is_some() && examiner_key(&entry.draft.name) == key)
    }

    /// Returns the entry that counts of each examiner who rated the session, in the order of their first entries: the
    /// blind one, or the latest if none was blind.
    pub fn counting(&self, session: &str) -> Vec<&RatingEntry> {
        let mut counting: Vec<(String, &RatingEntry)> = Vec::new();
        for entry in self.valid_entries().filter(|entry| entry.draft.session == session) {
            let key = examiner_key(&entry.draft.name);
            match counting.iter_mut().find(|(own, _)| *own == key) {
                Some((_, counted)) if !counted.draft.blind => *counted = entry,
                Some(_) => {}
                None => counting.push((key, entry)),
            }
        }
        counting.into_iter().map(|(_, entry)| entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, overall: u8, blind: bool) -> RatingEntry {
        let (session, recording, note) = ("s".to_string(), String::new(), String::new());
        let draft = RatingDraft {
            session,
            recording,
            scale: 5,
            overall: Some(overall),
            items: Vec::new(),
            blind,
            note,
            name: name.into(),
        };
        LogEntry { version: 1, number: 1, previous: String::new(), at: String::new(), draft }
    }

    #[test]
    fn the_blind_rating_counts_whatever_comes_later() {
        let log = RatingSnapshot::from_entries(vec![
            entry("Dr. Öz", 2, true),
            entry("dr.  öz", 5, false),
            entry("Lee", 3, false),
            entry("Lee", 4, false),
        ]);
        let counting: Vec<Option<u8>> = log.counting("s").iter().map(|entry| entry.draft.overall).collect();
        assert_eq!(counting, [Some(2), Some(4)]);
        assert!(log.has_overall(" DR. ÖZ ", "s") && !log.has_overall("Dr. O", "s") && !log.has_overall("", "s"));
        assert!(!log.has_overall("Lee", "another"));
    }
}
