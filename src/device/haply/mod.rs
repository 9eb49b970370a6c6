//! Haply's Inverse3, Inverse3x and Minverse with a VerseGrip, through the vendor's Inverse Service.
//!
//! Takes the service's address. Gives a device behind a relay. Never speaks to the hardware itself, whose bytes are not
//! public. Facts: docs.haply.co 3.0–3.5 and the vendor's crate `haply`; none of it was tried on a device.

mod protocol;
mod service;
mod wire;

use self::protocol::{Arm, Frame, Kind};
use self::service::Service;
use super::{Device, Driver, Found, Relay, Spec, Trouble};
use crate::frame::Vec3;
use std::thread;
use std::time::Duration;

pub struct Haply;

const ADDRESS: &str = "localhost:10001";

impl Driver for Haply {
    fn name(&self) -> &'static str {
        "haply"
    }

    fn about(&self) -> &'static str {
        "Haply Inverse3, Inverse3x or Minverse through the Inverse Service; the argument is host:port of the service \
         (localhost:10001 unless told), with /ID for one of several devices"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        let (_, snapshot) = Service::connect(ADDRESS)?;
        let found = snapshot.arms.iter().map(|arm| Found {
            title: format!("{} {}", spec(arm.kind).name, arm.id),
            argument: format!("{ADDRESS}/{}", arm.id),
        });
        Ok(found.collect())
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let argument = argument.filter(|a| !a.is_empty()).unwrap_or(ADDRESS);
        let (address, id) = match argument.split_once('/') {
            Some((address, id)) => (address, Some(id).filter(|id| !id.is_empty())),
            None => (argument, None),
        };
        let (mut service, snapshot) = Service::connect(address)?;
        let arm = choose(&mut service, snapshot, id)?;
        let spec = spec(arm.kind);
        Ok(Box::new(Relay::start(wire::Haply::new(service, arm, spec))))
    }
}

/// Full states asked for until the device is there with its config: two seconds, as long as the service takes to find one.
const ASKED_MAX: u32 = 20;
const ASK_EVERY: Duration = Duration::from_millis(100);

fn choose(service: &mut Service, snapshot: Frame, id: Option<&str>) -> Result<Arm, Trouble> {
    let wanted = |frame: Frame| frame.arms.into_iter().find(|arm| id.is_none_or(|id| arm.id == id));
    let mut best = wanted(snapshot);
    for _ in 0..ASKED_MAX {
        if best.as_ref().is_some_and(|arm| arm.kind.is_some()) {
            break;
        }
        thread::sleep(ASK_EVERY);
        best = wanted(service.full_state()?).or(best);
    }
    best.ok_or_else(|| {
        let which = id.map_or("no Inverse3 or Minverse".to_string(), |id| format!("no device {id}"));
        Trouble::new(
            format!("the Inverse Service runs but knows {which}"),
            "plug in the device and its power supply; `typodont devices` lists what the service knows",
        )
    })
}

/// What CHAI3D's fork for the Inverse3 renders (1 N/mm, 6 N·s/m), with the 5 N that SOFA's plugin holds to in place of the
/// fork's 10 N: the vendor's own limits could not be read. Workspace: 80 mm radius, 40 for the Minverse, as in the vendor's
/// samples.
fn spec(kind: Option<Kind>) -> Spec {
    let (name, radius) = match kind {
        Some(Kind::Inverse3) | None => ("Haply Inverse3", 80.0),
        Some(Kind::Inverse3x) => ("Haply Inverse3x", 80.0),
        Some(Kind::Minverse) => ("Haply Minverse", 40.0),
    };
    Spec {
        name: name.into(),
        max_force: 5.0,
        // Half of the most: unpublished, and what motors of this size bear.
        continuous_force: 2.5,
        max_torque: 0.0,
        max_stiffness: 1.0,
        max_damping: 0.006,
        // Unpublished; positions arrive with at least five decimals of a metre.
        resolution: 0.01,
        workspace_half: Vec3::splat(radius),
        // Unpublished; the Omni's order of magnitude, doubled for its longer arms.
        apparent_mass: 0.1,
    }
}
