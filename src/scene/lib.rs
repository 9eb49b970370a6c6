//! The operating field as plain geometry: jaws, neighbouring teeth, instruments, dust and water, and views of them.
//!
//! Takes a workpiece and the tables of tissues and instruments. Gives solids, particles, palettes and viewpoints for
//! [`typodont_render`]; world space, mm. Never knows a window, a clock or a session, and never draws.
//!
//! ```
//! use typodont_exercise::catalog::{InstrumentTable, TissueTable};
//! use typodont_formats::Library;
//! use typodont_scene::{procedural_instrument, tissue_palette};
//!
//! let instruments = InstrumentTable::read(&Library::shipped()).unwrap();
//! let bur = procedural_instrument(instruments.by_id("round_bur_014").unwrap());
//! assert!(!bur.mesh.is_empty());
//!
//! // Decay has the colour of enamel unless the exercise shows it.
//! let tissues = TissueTable::read(&Library::shipped()).unwrap();
//! let palette = tissue_palette(&tissues, false);
//! let colour = |name: &str| palette.appearance(tissues.label_of(name).unwrap()).colour;
//! assert_eq!(colour("caries"), colour("enamel"));
//! ```

mod bur_head;
mod grey_volume;
mod surroundings;
pub mod particles;
mod instrument;
mod jaw;
mod lips;
mod oral_cavity;
mod palette;
mod soft_tissue;
pub mod pointing;
mod views;

pub use grey_volume::GreyVolume;
pub use instrument::{ContraAngle, contra_angle, instrument_solid, mirror_face, procedural_instrument};
pub use jaw::{Mouth, StandaloneJaw};
pub use palette::{relief_seed, tissue_palette, unworked_tooth, x_ray_attenuation};
pub use surroundings::{mouth_and_solids, surrounding_solids};
pub use typodont_anatomy::jaw::WORKING_OPENING_DEG;
pub use views::{ToothSide, camera_lens, shadow_region, tooth_view, work_view};
