//! `typodont devices`: what can be held.

use super::{Failure, say};
use crate::device::Spec;

pub fn run() -> Result<(), Failure> {
    let spec = Spec::phantom_omni();
    say(format!(
        "scripted   a scripted hand on a simulated {}: {} N, {} mm steps",
        spec.name, spec.max_force, spec.resolution
    ))
}
