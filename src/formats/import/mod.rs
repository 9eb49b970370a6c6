//! Import of teeth: CT values, label maps and closed surfaces become volumes of enamel, dentine and pulp.
//!
//! Takes images and triangles. Gives volumes, crown up. Never reads a file; never knows the name of a label.

mod grey_values;
mod orientation;
pub mod segment;
pub mod voxelize;
mod label_map;

pub use grey_values::{ENAMEL_GREY, GreyValues};
pub use label_map::volume_from_label_map;
pub use orientation::set_upright;
use typodont_core::volume::Volume;

/// A tooth that was made of an image.
#[derive(Clone, Debug)]
pub struct ImportedTooth {
    pub volume: Volume,
    /// Grey values of the CT scan, one per voxel of the volume; `None` for a label map without its scan, or where nobody asked
    /// for them.
    pub grey_values: Option<GreyValues>,
}
