//! Teeth, arches and decay, measured.

#[path = "../support/mod.rs"]
mod support;
mod age;
mod arches;
mod caries;
mod dental_arch;
mod other_teeth;
mod teeth;
