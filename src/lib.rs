//! Typodont: an open haptic simulator and assessment platform for dental training.
//!
//! What the author **wrote** is in [`scenario`]; what the hand **felt** is in [`touch`] and [`sim`]; what
//! **happened** is in [`session`] and [`record`]; what it **means** is in [`score`]; how it **looks** is in
//! [`report`], [`scene`] and [`render`]. Millimetres, newtons and seconds everywhere.
//!
//! The modules stand in reading order, lowest first: each may use only those above it
//! (`ARCHITECTURE.md` has the table, `tests/architecture.rs` holds it).

// Allowed only where C is called: device libraries and thread priority (`tests/architecture.rs` names the files).
#![deny(unsafe_code)]

pub mod tick;
pub mod frame;
pub mod mesh;
pub mod mailbox;
pub mod diagnostic;
pub mod statistics;
pub mod volume;
pub mod anatomy;
pub mod touch;
pub mod device;
pub mod audio;
pub mod content;
pub mod sim;
pub mod scenario;
pub mod session;
pub mod record;
pub mod score;
pub mod render;
pub mod scene;
pub mod report;
pub mod handover;
pub mod review;
pub mod author;
pub mod school;
pub mod lesson;
pub mod app;
pub mod cli;
