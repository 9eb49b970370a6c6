//! Rules that the workspace keeps: the crate graph, what portable crates may not use, where network and unsafe code
//! stand, import circles, names and docs.

mod architecture;
mod circles;
mod dependencies;
mod names;
mod parts;
mod sources;
mod thesis_table;
// Without the rest of the tests' support, which the workspace's rules do not need.
#[allow(dead_code)]
#[path = "../support/tools.rs"]
mod tools;
