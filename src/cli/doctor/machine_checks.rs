//! Checks of the machine: processors and clock.

use super::finding::{Finding, FindingStatus};
use super::remedies::StationFault;
use jiff::Timestamp;
use jiff::tz::TimeZone;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// Year in which this version was released: no correct clock shows an earlier one.
const RELEASE_YEAR: i16 = 2026;

/// Years after the release beyond which a clock is wrong rather than this program old.
const YEARS_OF_USE: i16 = 30;

/// Time by which the newest session may lie in the future: sessions may come from a machine in another time zone whose
/// clock was set as local time.
const CLOCK_TOLERANCE: Duration = Duration::from_secs(26 * 3600);

/// The servo keeps one processor busy; the window needs another.
pub fn processors() -> Finding {
    match std::thread::available_parallelism().map_or(1, usize::from) {
        1 => Finding::fault(
            "processors",
            FindingStatus::Warning,
            "only 1 processor: the picture and the force disturb each other",
            StationFault::OneProcessor,
        ),
        count => Finding::ok("processors", count),
    }
}

/// The clock names and dates sessions: compares it with the release and with the sessions of `folder`.
pub fn clock(folder: &Path) -> Finding {
    let now = Timestamp::now();
    let shown = now.strftime("%Y-%m-%d %H:%M UTC");
    let year = now.to_zoned(TimeZone::UTC).year();
    let wrong = |what: String| Finding::fault("clock", FindingStatus::Missing, what, StationFault::WrongClock);
    if !(RELEASE_YEAR..=RELEASE_YEAR + YEARS_OF_USE).contains(&year) {
        return wrong(format!("the clock shows {shown}, and this version was released in {RELEASE_YEAR}"));
    }
    match newest_session(folder) {
        Some((name, at)) if at > SystemTime::now() + CLOCK_TOLERANCE => {
            wrong(format!("the clock shows {shown}, and the session {name} is later"))
        }
        _ => Finding::ok("clock", shown),
    }
}

/// The session of a folder that was changed last.
fn newest_session(folder: &Path) -> Option<(String, SystemTime)> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let sessions = entries.filter_map(|entry| {
        let file = entry.path().join("session.json");
        Some((entry.file_name().display().to_string(), file.metadata().ok()?.modified().ok()?))
    });
    sessions.max_by_key(|(_, at)| *at)
}
