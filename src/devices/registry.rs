//! The registry of drivers, by the name that `--device` takes.

use super::driver::Driver;

/// All drivers, in the order in which `typodont devices` lists them.
pub static DRIVERS: &[&dyn Driver] = &[
    &crate::mouse::MouseDriver,
    &crate::spacemouse::SpaceMouseDriver,
    &crate::openhaptics::OpenHapticsDriver,
    &crate::forcedimension::ForceDimensionDriver,
    &crate::haply::HaplyDriver,
    &crate::polhem::PolhemDriver,
    &crate::open_handle::OpenHandleDriver,
    &crate::stream::StreamDriver,
];

/// Returns the driver with this name.
pub fn driver_by_name(name: &str) -> Option<&'static dyn Driver> {
    DRIVERS.iter().copied().find(|d| d.name() == name)
}
