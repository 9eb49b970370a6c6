//! Teeth: grown from tables of measurements, or won from scans and surfaces.
//!
//! Takes forms in mm, CT values, label maps or closed surfaces, and a grid. Gives volumes of enamel, dentine and pulp, crown up.
//! Never reads a file, never knows a label's name, never rolls dice.

mod track;
mod blend;
pub mod form;
mod section;
mod relief;
mod pulp;
mod shape;
mod grow;
pub mod molar;
mod incisors;
mod canines;
mod premolars;
mod upper_molars;
mod lower_molars;
pub mod teeth;
pub mod age;
mod pieces;
pub mod caliper;
mod window;
mod slope;
mod turn;
pub mod segment;
pub mod shells;
mod charted;
pub mod caries;
pub mod periodontium;
pub mod girth;

pub use charted::charted;
pub use form::Form;
pub use grow::{grid_fitting, grid_of_spacing, grow};
pub use turn::set_upright;

use crate::volume::Label;

/// The labels that a tooth's three tissues have in the caller's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tissues {
    pub enamel: Label,
    pub dentine: Label,
    pub pulp: Label,
}
