//! Tests of recordings: bit-exact replay, detection of changes, damaged and interrupted files.

#[path = "../support/mod.rs"]
mod support;
mod damaged_recordings;
mod example;
mod compatibility;
mod golden;
mod killed;
#[cfg(target_os = "linux")]
mod power_cut;
mod proof;
#[cfg(target_os = "linux")]
mod volatile_disk;
