//! Haptic contact: allowed tip positions, contact forces, cutting and packing.
//!
//! Takes volumes and colliders, an instrument and the hand pose. Gives the tip position, the contact force and the
//! changed voxels. Never reads a clock, a file or a device; never allocates after construction.

mod collision_scene;
mod sdf_grid;
mod closed_mesh;
mod profile;
mod sampled_shape;
mod body;
mod collider_bounds;
mod instrument;
mod material;
mod active_set;
mod ball_contacts;
mod body_contacts;
mod proxy;
mod contact_spring;
mod wear;
mod carve;
mod pack;
mod vibration;
mod guidance;
mod gate;

pub use body::{Body, BodyRegion, BodySurfacePoint, Shank};
pub use carve::{Carver, CarvingParameters, CuttingLaw, ToolLoad};
pub use closed_mesh::ClosedMesh;
pub use collision_scene::{Collider, ColliderGeometry, CollisionScene};
pub use contact_spring::{ContactForce, ContactSpring, SpringLimit};
pub use gate::{ForceLimit, Gate};
pub use guidance::{
    AnchorMode, DAMPING_TIME, FADE_S, Fixture, ForceRow, ForceSpace, ForceTable, Guidance, GuidanceController,
    POINT_DISTANCE, Polyline,
};
pub use instrument::{Instrument, PackingTip, WorkingEnd};
pub use material::{Coefficient, Material, MaterialScale, MaterialScales, Materials};
pub use pack::{FillingMaterial, MAX_VOID_SHARE, Packer};
pub use profile::{EDGE_RADIUS, NearestProfilePoint, Profile, ProfilePoint};
pub use proxy::{Contact, Proxy};
pub use sampled_shape::SampledShape;
pub use sdf_grid::{Compliance, SdfGrid};
pub use vibration::Vibration;
pub use wear::WearRate;
