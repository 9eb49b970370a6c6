//! Haptic rendering and cutting.

#[path = "../support/mod.rs"]
mod support;
mod adjusting;
mod allocation;
mod carving;
mod soft_neighbours;
mod continuity;
mod feel;
mod force_quality;
mod friction;
mod guidance;
mod obstacles;
mod packing;
mod rate_law;
mod sampled_ends;
mod shell;
