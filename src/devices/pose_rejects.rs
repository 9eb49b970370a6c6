//! Plausibility of the poses that come from a vendor's library, which checks everything else itself.

use crate::DeviceReport;
use typodont_core::device::{DeviceError, DeviceSpec, DeviceState, Reading};
use typodont_core::frame::Pose;

/// Consecutive implausible poses after which a device counts as faulty: about 0.5 s.
const IMPLAUSIBLE_POSES_MAX: u32 = 500;

/// Multiple of the half workspace that an arm may still reach: the usable workspace is a box within a larger shape.
const WORKSPACE_FACTOR: f32 = 10.0;

/// Returns the pose if a device with this specification can be there.
pub fn plausible(pose: Pose, spec: &DeviceSpec) -> Option<Pose> {
    let is_reachable = pose.position.abs().cmple(spec.workspace_half * WORKSPACE_FACTOR).all();
    (is_reachable && pose.is_valid()).then_some(pose)
}

/// Count of consecutive implausible poses from a vendor's library that checks everything else.
#[derive(Clone, Debug, Default)]
pub struct PoseRejects {
    consecutive: u32,
}

impl PoseRejects {
    /// Returns the report that stands in for an implausible pose.
    ///
    /// # Errors
    ///
    /// Returns [`DeviceError::Lost`] after too many in a row.
    pub fn reject(&mut self) -> Result<DeviceReport, DeviceError> {
        self.consecutive += 1;
        if self.consecutive > IMPLAUSIBLE_POSES_MAX {
            return Err(DeviceError::Lost {
                why: "its positions are implausible; switch it off and on again",
                code: 0,
            });
        }
        let state = DeviceState::ForceOff { why: "its positions are implausible" };
        Ok(DeviceReport { reading: Reading::ABSENT, state })
    }

    /// Resets the count after a plausible pose.
    pub fn reset(&mut self) {
        self.consecutive = 0;
    }
}
