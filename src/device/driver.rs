//! Ways to reach a kind of device, by the name that `--device` takes.
//!
//! Takes a name and perhaps an argument after a colon. Gives an open device, or one complaint that says what to do.
//! Never prints, never waits for a person: what needs one is a [`super::State`] of the open device.

use super::Device;
use std::fmt;

/// A way to reach a kind of device.
pub trait Driver: Sync {
    /// What `--device` calls it.
    fn name(&self) -> &'static str;

    /// One line on what it reaches, and what the argument after the colon means.
    fn about(&self) -> &'static str;

    /// What is plugged in now. Opens nothing that moves.
    fn find(&self) -> Result<Vec<Found>, Trouble>;

    /// Opens a device: the one that `argument` names, else the first found.
    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble>;
}

/// A device that could be opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// As people know it, with a serial number where it has one.
    pub title: String,
    /// What to write after the colon to get this one; empty for the driver's only one.
    pub argument: String,
}

/// Why a device cannot be opened or looked for: what happened, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trouble {
    pub what: String,
    pub help: String,
}

impl Trouble {
    pub fn new(what: impl Into<String>, help: impl Into<String>) -> Trouble {
        Trouble { what: what.into(), help: help.into() }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}\n    help: {}", self.what, self.help)
    }
}

/// Every driver, in the order in which `typodont devices` lists them.
pub static DRIVERS: &[&dyn Driver] = &[
    &super::mouse::MouseDriver,
    &super::spacemouse::SpaceMouseDriver,
    &super::openhaptics::OpenHaptics,
    &super::forcedimension::ForceDimension,
    &super::haply::Haply,
    &super::polhem::Polhem,
    &super::open_handle::OpenHandleDriver,
    &super::stream::Stream,
];

/// The driver of a name.
pub fn driver(name: &str) -> Option<&'static dyn Driver> {
    DRIVERS.iter().copied().find(|d| d.name() == name)
}
