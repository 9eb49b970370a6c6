//! x
use super::Failure;
use clap::Args;
#[derive(Args)]
pub struct Arguments {}
pub fn run(_a: &Arguments) -> Result<(), Failure> {
    Ok(())
}
