//! One tick as bytes: a ROS 2 message in CDR, so that other programs read the recording too.

use crate::device::Reading;
use crate::frame::{Pose, Quat, Vec3};
use crate::sim::Step;
use crate::tick::Tick;

/// Name of the message type.
pub const SCHEMA_NAME: &str = "typodont_msgs/msg/Haptic";

/// The message's definition, `ros2msg` encoding.
pub const SCHEMA: &str = "\
# One tick of the haptic loop. World space: x right, y up, z toward the user; mm, N.
uint64 tick
# What the device reported.
float32[3] position_mm
float32[4] orientation_xyzw
uint32 buttons
# What it was told to render.
float32[3] force_n
# Where the working end was allowed to be.
float32[3] tip_mm
# The spring's part of the force.
float32 spring_n
# Voxels that became air in this tick.
uint32 removed
# Number of the tissue that was touched; 0 for none.
uint8 touched
# Instrument of the scenario's tray, from 0.
uint8 instrument
# True while matter was being cut.
bool cutting
";

/// Little-endian CDR without options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Bytes of a message: encapsulation, 8 for the tick, 16 words of 4, 3 single bytes.
pub const LENGTH: usize = 4 + 8 + 16 * 4 + 3;

/// One tick as recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Haptic {
    pub tick: Tick,
    pub reading: Reading,
    pub force: Vec3,
    pub tip: Vec3,
    pub spring: f32,
    pub removed: u32,
    pub touched: u8,
    pub instrument: u8,
    pub cutting: bool,
}

impl Haptic {
    pub fn of(reading: &Reading, step: &Step) -> Haptic {
        Haptic {
            tick: step.tick,
            reading: *reading,
            force: step.force,
            tip: step.tip,
            spring: step.touch.map_or(0.0, |t| t.spring),
            removed: step.removed,
            touched: step.touch.map_or(0, |t| t.label.0),
            instrument: step.instrument as u8,
            cutting: step.cutting,
        }
    }

    pub fn bytes(&self) -> [u8; LENGTH] {
        let Pose { position: p, orientation: q } = self.reading.pose;
        let floats = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
        let (f, t) = (self.force, self.tip);
        let rest = [f.x, f.y, f.z, t.x, t.y, t.z, self.spring].map(f32::to_bits);
        let words = floats.into_iter().chain([self.reading.buttons]).chain(rest).chain([self.removed]);
        let mut bytes = [0; LENGTH];
        bytes[..4].copy_from_slice(&ENCAPSULATION);
        bytes[4..12].copy_from_slice(&self.tick.0.to_le_bytes());
        for (to, word) in bytes[12..].chunks_exact_mut(4).zip(words) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes[LENGTH - 3..].copy_from_slice(&[self.touched, self.instrument, u8::from(self.cutting)]);
        bytes
    }

    /// `None` for bytes that are not such a message.
    pub fn parse(bytes: &[u8]) -> Option<Haptic> {
        let bytes: &[u8; LENGTH] = bytes.try_into().ok()?;
        if bytes[..4] != ENCAPSULATION {
            return None;
        }
        let word = |i: usize| u32::from_le_bytes(std::array::from_fn(|b| bytes[12 + 4 * i + b]));
        let float = |i: usize| f32::from_bits(word(i));
        let vector = |i: usize| Vec3::new(float(i), float(i + 1), float(i + 2));
        let orientation = Quat::from_xyzw(float(3), float(4), float(5), float(6));
        Some(Haptic {
            tick: Tick(u64::from_le_bytes(std::array::from_fn(|b| bytes[4 + b]))),
            reading: Reading { pose: Pose { position: vector(0), orientation }, buttons: word(7) },
            force: vector(8),
            tip: vector(11),
            spring: float(14),
            removed: word(15),
            touched: bytes[LENGTH - 3],
            instrument: bytes[LENGTH - 2],
            cutting: bytes[LENGTH - 1] != 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_round_trips_to_the_last_bit() {
        let pose = Pose { position: Vec3::new(1.5, -2.25, f32::NAN), orientation: Quat::from_xyzw(0.1, 0.2, 0.3, 0.9) };
        let haptic = Haptic {
            tick: Tick(123_456_789_012),
            reading: Reading { pose, buttons: 5 },
            force: Vec3::new(0.1, 0.2, -0.0),
            tip: Vec3::splat(7.0),
            spring: 1.25,
            removed: 77,
            touched: 4,
            instrument: 2,
            cutting: true,
        };
        let bytes = haptic.bytes();
        assert_eq!(Haptic::parse(&bytes).map(|h| h.bytes()), Some(bytes));
        assert_eq!(Haptic::parse(&bytes[1..]), None);
    }
}
