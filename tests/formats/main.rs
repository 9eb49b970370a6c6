//! Files that others wrote, and ours as others read them.

#[path = "../support/mod.rs"]
mod support;
mod broken_imports;
mod broken_volumes;
mod fuzz_imports;
mod fuzz_nrrd;
mod good_volumes;
mod imports;
mod imports_python;
mod nrrd_python;
mod nrrd_speed;
mod real_volumes;
mod segmentations;
