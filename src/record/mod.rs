//! What happened, on disk: a recording that can be turned again.
//!
//! Takes a session's readings, inputs and forces while it runs. Gives them back in order, and says whether turning them
//! again gives the same forces and the same matter. Never judges: that is `score`.
//!
//! A recording is an MCAP file (<https://mcap.dev>): the scenario's text, the tables it used and the volume at the start
//! as attachments; one `/haptic` message a tick; inputs, commands and stages as JSON on `/event`; a digest of everything
//! so far once a second on `/digest`. It is appended to while the session runs, so that a killed session leaves all but
//! its last moments.

mod haptic;
mod file;
mod records;
mod reader;
mod replay;
mod volume;
mod writer;

pub use file::{EndFile, HeadFile, ServoFile, SpecFile, VERSION, ended_by_name};
pub use haptic::Haptic;
pub use reader::{Recording, Unreadable};
pub use replay::{Difference, Replay, Watch, replay};
pub use writer::{Recorder, Unwritable};

/// Name of the recording within a bundle.
pub const FILE_NAME: &str = "recording.mcap";
