//! Recordings of sessions, on disk or in memory, and their replay.
//!
//! Takes a session's readings, inputs and forces while it runs. Gives them back in order, and verifies that a replay
//! produces the same forces and the same volume. Never scores: that is the task of `score`.
//!
//! A recording is an MCAP file (<https://mcap.dev>): the scenario's text, the tables it used and the initial volume
//! as attachments; one `/haptic` message per tick; inputs, commands and stages as JSON on `/event`; once a second, on
//! `/digest`, a digest of everything so far. The file is appended to while the session runs, so that a killed session
//! loses only its last moments. Whoever creates a [`Recorder`] also has the file synced to the disk (`lesson`), which
//! limits the loss of a power cut.

mod tick_record;
mod file;
mod mcap_walk;
mod reader;
mod replay;
mod seal;
mod volume;
mod writer;

pub use file::{
    CommandFile, DeviceSpecFile, InputFile, RecordingEndFile, RecordingHeadFile, ResumptionFile, SeedOriginFile,
    ServoStatsFile, VERSION, ended_by_name,
};
pub use reader::{Recording, RecordingError, RecordingLoss};
pub use replay::{Continuation, ContinuationError, Difference, Replay, ReplayCheck, go_on, replay};
pub use seal::{CODE_MIN, reveal, sealed_seed};
pub use tick_record::TickRecord;
pub use writer::{Recorder, RecorderError, RecordingSink};

/// Name of the recording within a bundle.
pub const FILE_NAME: &str = "recording.mcap";
