//! A second device in a lesson, operated by an instructor or by an assistant who holds the suction.

use super::LessonError;
use super::device_selection::open_device;
use std::net::SocketAddr;
use typodont_core::device::DeviceSpec;
use typodont_devices::HandLink;
use typodont_devices::servo::{SecondHandLink, SecondHandRole, SecondHandServo};

/// Connection of the second device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SecondHandSource {
    /// Another device at this machine, as `NAME[:WHICH]`.
    Device(String),
    /// A device at another machine that has the key. `at` is the local address on which the lesson listens.
    Network { at: String, key: String },
}

/// A second device that may join, until the lesson begins.
pub struct PendingSecondHand {
    pub(super) servo_hand: SecondHandLink,
    /// Its own servo, if the device is connected to this machine.
    pub(super) assist: Option<SecondHandServo>,
    address: Option<SocketAddr>,
}

impl PendingSecondHand {
    /// Opens the second device, or listens on its address. `first` is the name and the specification of the first
    /// device.
    ///
    /// # Errors
    ///
    /// When the device is the first one, cannot be opened, or the address cannot be used.
    pub fn join(
        source: &SecondHandSource,
        role: SecondHandRole,
        first: (&str, &DeviceSpec),
    ) -> Result<PendingSecondHand, LessonError> {
        let (name_of_first, spec) = first;
        let (link, assist, address) = match source {
            SecondHandSource::Device(name) if name == name_of_first => {
                return Err(LessonError::SameDevice { name: name.clone() });
            }
            SecondHandSource::Device(name) => {
                let (ours, theirs) = HandLink::pair();
                let started = SecondHandServo::start(open_device(name)?.device, theirs);
                let assist = started.map_err(|why| LessonError::NoDevice { name: name.clone(), why })?;
                (ours, Some(assist), None)
            }
            SecondHandSource::Network { at, key } => {
                let listens = HandLink::listen(at.as_str(), key);
                let (link, address) =
                    listens.map_err(|error| LessonError::NoListener { at: at.clone(), why: error.to_string() })?;
                (link, None, Some(address))
            }
        };
        Ok(PendingSecondHand { servo_hand: SecondHandLink::new(link, spec.max_damping, role), assist, address })
    }

    /// Address on which the lesson waits for the other machine; `None` if the second device is connected to this
    /// machine.
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }
}
