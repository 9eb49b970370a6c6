//! Portable core of the simulator: time, geometry, voxel volumes, haptic contact and the simulation step.
//!
//! Takes plain values. Gives plain values. Never touches a file, clock, socket or device driver. Only [`parallel`]
//! starts threads; where none are available it does the same work on one.
//!
//! The modules are listed in reading order, lowest first: each may use only those above it.
//!
//! A volume is made from a signed distance, sampled and turned into a mesh:
//!
//! ```
//! use typodont_core::frame::Vec3;
//! use typodont_core::volume::{Grid, Label, Volume, surface};
//!
//! // A ball of 1 mm radius on voxels of 0.1 mm; its density rises from 0 to 1 over ±0.15 mm.
//! let grid = Grid::centred([40; 3], Vec3::splat(0.1));
//! let ball = Volume::from_distance(grid, 0.15, |point| (point.length() - 1.0, Label(1)));
//! assert!(ball.density_at(Vec3::ZERO) > 0.99);
//! assert_eq!(ball.density_at(Vec3::X * 1.5), 0.0);
//!
//! let mesh = surface::extract(&ball);
//! assert!((mesh.volume_mm3() - 4.19).abs() < 0.1);
//! ```

pub mod tick;
pub mod frame;
pub mod aabb;
pub mod mesh;
pub mod image;
pub mod mailbox;
pub mod readable_key;
pub mod parallel;
pub mod statistics;
pub mod volume;
pub mod touch;
pub mod device;
pub mod sim;
