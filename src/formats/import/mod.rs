//! Import of teeth: CT values, label maps and closed surfaces become volumes of enamel, dentine and pulp.
//!
//! Takes images and triangles. Gives volumes, crown up. Never reads a file; never knows the name of a label.

mod orientation;
pub mod segment;
pub mod voxelize;
mod label_map;

pub use label_map::volume_from_label_map;
pub use orientation::set_upright;
