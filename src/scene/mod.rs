//! What stands before the trainee: the tooth as it is now, what is around it, the instrument in the hand, and what flies and
//! lies about it.
//!
//! Takes a workpiece and the tables of tissues and instruments. Gives plain solids, palettes and viewpoints for
//! [`render`](crate::render); mm, world space. Never knows a window, a clock or a session, and draws nothing itself.

mod around;
pub mod field;
mod instrument;
mod jaw;
mod palette;
mod views;

pub use around::around;
pub use instrument::{instrument, mirror, outlined};
pub use jaw::{Jaw, JawAlone, Mouth, OPEN};
pub use palette::palette;
pub use views::{ToothSide, tooth_view, work_view};
