//! Pictures by the adapter and by the processor.

#[path = "../support/mod.rs"]
mod support;
mod fixed_scenes;
mod mouth_options;
mod radiograph;
mod render;
mod scene;
mod scenes;
mod shadows;
mod tissues;
