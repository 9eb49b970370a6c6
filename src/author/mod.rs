//! An exercise while its author works on it: the file's text, and nothing beside it.
//!
//! Takes a scenario's text and one change at a time, named by JSON pointer. Gives the text with only that changed, what the schema
//! says of each place, and the file kept whole on disk. Never knows a window or a clock; never repairs what a person wrote.

mod beginning;
mod draft;
mod edit;
mod form;
mod keep;
mod layout;
mod spot;

pub use beginning::{beginning, new_exercise, shape};
pub use draft::Draft;
pub use edit::{Unfit, pointer_to};
pub use form::{Field, Form, Kind, Variant};
pub use keep::{Kept, Stand, Unkept, drafts, read, save};
pub use spot::{Spot, met, spot_of};
