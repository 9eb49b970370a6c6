//! What stands before the trainee: the tooth as it is now, what is around it, and the instrument in the hand.
//!
//! Takes a workpiece and the tables of tissues and instruments. Gives plain solids, palettes and viewpoints for
//! [`render`](crate::render); mm, world space. Never knows a window, a clock or a session, and draws nothing itself.

mod around;
mod instrument;
mod jaw;
mod palette;
mod views;

pub use around::around;
pub use instrument::{instrument, mirror, outlined};
pub use jaw::{Mouth, OPEN};
pub use palette::palette;
pub use views::{ToothSide, tooth_view, work_view};
