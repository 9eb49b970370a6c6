//! Procedural teeth: forms of all 32 permanent teeth, their volumes, caries, periodontium and dental arches.
//!
//! Takes forms (lengths in mm) and a grid. Gives volumes of enamel, dentine and pulp in tooth space, crown up. Never
//! reads a file, knows the name of a label, or uses random numbers.
//!
//! A tooth is made from its FDI number:
//!
//! ```
//! use typodont_anatomy::{TissueLabels, grid_of_spacing, grow, teeth};
//! use typodont_core::volume::Label;
//!
//! let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
//! let form = teeth::tooth(36).unwrap();
//! let tooth = grow(&form, grid_of_spacing(&form, 0.4), &tissues);
//! assert!(tooth.count(tissues.dentine) > tooth.count(tissues.enamel));
//! assert!(tooth.count(tissues.enamel) > tooth.count(tissues.pulp));
//! assert!(teeth::tooth(39).is_none());
//! ```

mod monotone_spline;
mod blend;
pub mod form;
mod loft;
mod occlusal_surface;
mod pulp;
mod tooth_sdf;
mod grow;
pub mod lower_first_molar;
mod incisors;
mod canines;
mod premolars;
mod upper_molars;
mod lower_molars;
pub mod teeth;
pub mod age;
pub mod caliper;
pub mod caries;
pub mod periodontium;
pub mod crown_contour;
pub mod cheek_and_tongue;
pub mod jaw;

pub use form::ToothForm;
pub use grow::{grid_fitting, grid_of_spacing, grow};

use typodont_core::volume::Label;

/// Labels of a tooth's three tissues in the caller's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TissueLabels {
    pub enamel: Label,
    pub dentine: Label,
    pub pulp: Label,
}
