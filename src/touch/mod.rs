//! What a hand feels: where an instrument may be, how matter pushes back, what a bur takes away.
//!
//! Takes matter, an instrument and how the hand holds it. Gives where the tip may be, the pull on the hand and the voxels
//! that fell. Never reads a clock, a file or a device; never allocates once made.

mod matter;
mod field;
mod obstacle;
mod profile;
mod body;
mod instrument;
mod material;
mod planes;
mod walls;
mod shell;
mod proxy;
mod law;
mod rate;
mod carve;
mod pack;
mod vibration;
mod guidance;
mod gate;

pub use body::{Body, Node, Region, Shank};
pub use carve::{Carver, Carving, CuttingLaw, Press};
pub use field::{Field, Yield};
pub use gate::{ForceLimit, Gate};
pub use guidance::{
    DAMPING_TIME, EASE_S, Fixture, ForceRow, Forces, Guidance, Guide, Kind, POINT_DISTANCE, Path, Space,
};
pub use instrument::{Instrument, WorkingEnd};
pub use law::{Law, Pull, SpringLimit};
pub use material::{Coefficient, Factor, Factors, Material, Materials};
pub use matter::{Form, Matter, Shape};
pub use obstacle::Obstacle;
pub use pack::{Filling, Packer, Packs, VOIDS_MOST};
pub use profile::{EDGE, Nearest, Place, Profile};
pub use proxy::{Contact, Proxy};
pub use rate::Rate;
pub use vibration::Vibration;
