//! Pictures by the adapter and by the processor.

#[path = "../support/mod.rs"]
mod support;
mod render;
mod scene;
mod scenes;
