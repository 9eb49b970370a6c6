//! Another hand that joins a lesson: an instructor's, or one that holds the suction.

use super::{Failed, open};
use crate::device::{Link, Spec};
use crate::sim::{Assist, Role, Second};
use std::net::SocketAddr;

/// Where a second hand comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum From {
    /// Another device at this machine, as `NAME[:WHICH]`.
    Device(String),
    /// Another machine that has the key; the address is ours.
    Network { at: String, key: String },
}

/// A second hand that may join, until the lesson begins.
pub struct SecondHand {
    pub(super) end: Second,
    /// Its own servo, if its device is plugged in here.
    pub(super) assist: Option<Assist>,
    address: Option<SocketAddr>,
}

impl SecondHand {
    /// Opens its device, or the address where it may join. `first`: name and spec of what is in the first hand.
    pub fn join(from: &From, role: Role, first: (&str, &Spec)) -> Result<SecondHand, Failed> {
        let (name_of_first, spec) = first;
        let (link, assist, address) = match from {
            From::Device(name) if name == name_of_first => return Err(Failed::SameDevice { name: name.clone() }),
            From::Device(name) => {
                let (ours, theirs) = Link::pair();
                let started = Assist::start(open(name)?.device, theirs);
                let assist = started.map_err(|why| Failed::NoDevice { name: name.clone(), why })?;
                (ours, Some(assist), None)
            }
            From::Network { at, key } => {
                let listens = Link::listen(at.as_str(), key);
                let (link, address) =
                    listens.map_err(|error| Failed::CannotListen { at: at.clone(), why: error.to_string() })?;
                (link, None, Some(address))
            }
        };
        Ok(SecondHand { end: Second::new(link, spec.max_damping, role), assist, address })
    }

    /// Where a machine with the key is waited for; `None` where its device is plugged in here.
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }
}
