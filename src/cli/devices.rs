//! `typodont devices`: what can be held.

use super::Failure;
use crate::device::Spec;

pub fn run() -> Result<(), Failure> {
    let spec = Spec::phantom_omni();
    println!(
        "scripted   a scripted hand on a simulated {}: {} N, {} mm steps",
        spec.name, spec.max_force, spec.resolution
    );
    Ok(())
}
