//! Support shared by several test suites: bundles, folders, phantoms, servers, and other programs.

#![allow(dead_code, unused_imports)]

pub mod browser;
pub mod bundle;
pub mod cluster;
pub mod coarse_exercise;
pub mod desk;
pub mod folder;
pub mod hearing;
pub mod import_files;
pub mod peace;
pub mod phantom;
pub mod school;
pub mod screen;
pub mod shared_data;
pub mod tools;
pub mod volume_text;
pub mod window_driver;
