//! Lessons: from an exercise and a device to a finished bundle.
//!
//! Takes an exercise, a participant code, the time of the start, and a device or a script. Gives a [`Lesson`] to poll
//! for events, and in the end its bundle. Never reads the wall clock, prints, or decides what a person is asked.
//!
//! ```no_run
//! use std::{collections::BTreeMap, path::Path, sync::Arc};
//! use typodont_exercise::scenario::ResolveMode;
//! use typodont_lesson::{SessionConfig, SessionSeed, open_device, read_scenario};
//! use typodont_report::Templates;
//!
//! let opened = open_device("haply")?;
//! let scenario = read_scenario(Path::new("scenarios/10-class-one.json"), ResolveMode::ReadScans).unwrap();
//! let config = SessionConfig {
//!     scenario: Arc::new(scenario),
//!     seed: SessionSeed::drawn()?,
//!     participant: "trainee-7",
//!     out: Some(Path::new("sessions")),
//!     digests: BTreeMap::new(),
//!     templates: Templates::shipped(),
//!     started: jiff::Timestamp::now(),
//! };
//! let workpiece = config.make_workpiece()?;
//! let prepared = config.prepare(workpiece, opened.device.spec().clone(), None)?;
//! let (mut lesson, _first_events) = prepared.begin(opened.device, None)?;
//! while !lesson.session().is_complete() {
//!     let _events = lesson.poll()?; // Each frame of a window.
//! }
//! let bundle = lesson.end()?.complete(&mut |_step| ())?;
//! assert!(bundle.contains("session.json"));
//! # Ok::<(), typodont_lesson::LessonError>(())
//! ```

mod disk_sync;
mod error;
mod exercise_warnings;
mod inputs;
mod preparation;
mod seed;
mod session_folder;
mod tooth_scan;
#[cfg(feature = "devices")]
mod continuation;
#[cfg(feature = "devices")]
mod device_selection;
#[cfg(feature = "devices")]
pub mod live;
#[cfg(feature = "devices")]
mod live_lesson;
#[cfg(feature = "devices")]
pub mod second_hand;

pub use error::LessonError;
pub use exercise_warnings::{ExerciseWarning, IDLE_POINTS_MAX, caries_warnings, exercise_warnings};
pub use inputs::{is_valid_participant_code, library_for, read_scenario, scenario_files};
pub use preparation::{PreparedSession, RecordedSession, SessionConfig};
pub use seed::{SessionSeed, is_long_enough, is_sealable, new_examiner_code};
pub use session_folder::{Attempt, InterruptedSession, SessionFolder};
pub use tooth_scan::ToothScan;

#[cfg(feature = "devices")]
pub use continuation::ReopenedSession;
#[cfg(feature = "devices")]
pub use device_selection::{OpenDevice, open_device};
#[cfg(feature = "devices")]
pub use live_lesson::Lesson;
#[cfg(feature = "devices")]
pub use second_hand::PendingSecondHand;
