//! Haply's Inverse3, Inverse3x and Minverse with a VerseGrip, through the vendor's Inverse Service.
//!
//! Takes the service's address. Gives a device behind a relay. Never communicates with the hardware directly, whose
//! protocol is not public. Facts: docs.haply.co 3.0–3.5 and the vendor's crate `haply`; nothing here has been tried
//! on a device.

mod messages;
mod service;
mod protocol;

use self::messages::{ArmReport, HaplyModel, StateFrame};
use self::service::InverseService;
use crate::{Driver, FoundDevice, OpenError, Relay};
use std::thread;
use std::time::Duration;
use typodont_core::device::{Device, DeviceSpec};
use typodont_core::frame::Vec3;

/// Driver of Haply devices.
pub struct HaplyDriver;

const ADDRESS: &str = "localhost:10001";

impl Driver for HaplyDriver {
    fn name(&self) -> &'static str {
        "haply"
    }

    fn description(&self) -> &'static str {
        "Haply Inverse3, Inverse3x or Minverse through the Inverse Service; the argument is host:port of the service \
         (localhost:10001 by default), with /ID for one of several devices"
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        let (_, snapshot) = InverseService::connect(ADDRESS)?;
        let found = snapshot.arms.iter().map(|arm| FoundDevice {
            title: format!("{} {}", spec(arm.model).name, arm.id),
            argument: format!("{ADDRESS}/{}", arm.id),
        });
        Ok(found.collect())
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let argument = argument.filter(|a| !a.is_empty()).unwrap_or(ADDRESS);
        let (address, id) = match argument.split_once('/') {
            Some((address, id)) => (address, Some(id).filter(|id| !id.is_empty())),
            None => (argument, None),
        };
        let (mut service, snapshot) = InverseService::connect(address)?;
        let arm = find_arm(&mut service, snapshot, id)?;
        let spec = spec(arm.model);
        Ok(Box::new(Relay::start(protocol::HaplyProtocol::new(service, arm, spec))))
    }
}

/// Requests for a full state until the device is listed with its configuration: two seconds in all, as long as the
/// service takes to find a device.
const MAX_QUERIES: u32 = 20;
const QUERY_INTERVAL: Duration = Duration::from_millis(100);

fn find_arm(service: &mut InverseService, snapshot: StateFrame, id: Option<&str>) -> Result<ArmReport, OpenError> {
    let wanted = |frame: StateFrame| frame.arms.into_iter().find(|arm| id.is_none_or(|id| arm.id == id));
    let mut best = wanted(snapshot);
    for _ in 0..MAX_QUERIES {
        if best.as_ref().is_some_and(|arm| arm.model.is_some()) {
            break;
        }
        thread::sleep(QUERY_INTERVAL);
        best = wanted(service.full_state()?).or(best);
    }
    best.ok_or_else(|| {
        let which = id.map_or("no Inverse3 or Minverse".to_string(), |id| format!("no device {id}"));
        OpenError::new(
            format!("the Inverse Service is running but lists {which}"),
            "plug in the device and its power supply; `typodont devices` lists the devices of the service",
        )
    })
}

/// Returns the specification of a model: the limits that CHAI3D's fork renders on the Inverse3 (1 N/mm, 6 N·s/m),
/// with the 5 N of SOFA's plugin instead of the fork's 10 N, since the vendor's own limits were not accessible.
/// Workspace: 80 mm radius, 40 for the Minverse, as in the vendor's samples.
fn spec(model: Option<HaplyModel>) -> DeviceSpec {
    let (name, radius) = match model {
        Some(HaplyModel::Inverse3) | None => ("Haply Inverse3", 80.0),
        Some(HaplyModel::Inverse3x) => ("Haply Inverse3x", 80.0),
        Some(HaplyModel::Minverse) => ("Haply Minverse", 40.0),
    };
    DeviceSpec {
        name: name.into(),
        max_force: 5.0,
        // Half of the maximum: not published, but usual for motors of this size.
        continuous_force: 2.5,
        max_torque: 0.0,
        max_stiffness: 1.0,
        max_damping: 0.006,
        // Not published; positions arrive with at least five decimals of a metre.
        resolution: 0.01,
        workspace_half: Vec3::splat(radius),
        // Not published; the order of magnitude of the Omni, doubled for the longer arms.
        apparent_mass: 0.1,
        page_force: None,
    }
}
