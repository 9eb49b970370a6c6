//! The state of the author's screen: an exercise while it is edited, checked and shown.
//!
//! Takes the commands of the screen's fields. Every field shows a value of the file's text and requests a change of that
//! text; there is no second copy.

mod build_worker;
mod editor_command;
mod editor_section;
mod editor_state;
mod preview;

pub use editor_command::EditorCommand;
pub use editor_section::EditorSection;
pub use editor_state::{ARCH_TEETH, Dialog, EditorState, OpenMode};
pub use preview::PreviewMode;
