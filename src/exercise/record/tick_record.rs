//! The binary form of a tick: a ROS 2 message in CDR, which other programs can read too.

use typodont_core::device::Reading;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::sim::Step;
use typodont_core::tick::Tick;

/// Name of the message type.
pub const SCHEMA_NAME: &str = "typodont_msgs/msg/Haptic";

/// Definition of the message, `ros2msg` encoding. Messages of version 1 end before `torque_nmm`.
pub const SCHEMA: &str = "\
# One tick of the haptic loop. World space: x right, y up, z toward the user; mm, N.
uint64 tick
# What the device reported, in its own space; that is world space unless a command has placed the hand.
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
# What it was told to render about the tip.
float32[3] torque_nmm
# How another hand led this one, part of the force.
float32[3] lead_n
";

/// CDR encapsulation header: little-endian, without options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Length of a message of version 1, bytes: encapsulation, 8 for the tick, 16 words of 4, 3 single bytes.
const LENGTH_1: usize = 4 + 8 + 16 * 4 + 3;

/// Length of a message, bytes: that of version 1, one byte for alignment and 6 words of 4.
const LENGTH: usize = LENGTH_1 + 1 + 6 * 4;

/// Layout of the tick messages of one recording version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickLayout {
    length: usize,
}

impl TickLayout {
    pub const NEWEST: TickLayout = TickLayout { length: LENGTH };

    /// Returns the layout used by recordings of a version.
    pub fn of(version: u32) -> TickLayout {
        if version < 2 { TickLayout { length: LENGTH_1 } } else { TickLayout::NEWEST }
    }
}

/// Bytes of a tick message as stored in a recording.
#[derive(Clone, Copy, Debug)]
pub struct TickBytes {
    bytes: [u8; LENGTH],
    layout: TickLayout,
}

impl std::ops::Deref for TickBytes {
    type Target = [u8];
    fn deref(&self) -> &[u8] {
        &self.bytes[..self.layout.length]
    }
}

/// One recorded tick; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickRecord {
    pub tick: Tick,
    pub reading: Reading,
    /// Force rendered by the device, N.
    pub force: Vec3,
    /// Torque rendered about the tip, N·mm; zero in recordings of version 1.
    pub torque: Vec3,
    /// Coupling force of another hand, part of `force`, N; zero in recordings of version 1.
    pub lead: Vec3,
    /// Position of the working end, mm.
    pub tip: Vec3,
    /// Spring part of the force, N.
    pub spring: f32,
    /// Number of voxels that became air in this tick.
    pub removed: u32,
    /// Label of the touched tissue; 0 without contact.
    pub touched: u8,
    /// Index of the instrument in the scenario's tray.
    pub instrument: u8,
    /// True while matter is being cut.
    pub cutting: bool,
}

impl TickRecord {
    /// Returns the record of a completed step.
    pub fn of(reading: &Reading, step: &Step) -> TickRecord {
        TickRecord {
            tick: step.tick,
            reading: *reading,
            force: step.force,
            torque: step.torque,
            lead: step.coupling_force,
            tip: step.tip,
            spring: step.touch.map_or(0.0, |t| t.spring),
            removed: step.removed,
            touched: step.touch.map_or(0, |t| t.label.0),
            instrument: step.instrument as u8,
            cutting: step.cutting,
        }
    }

    /// Encodes the record as a message.
    pub fn bytes(&self, layout: TickLayout) -> TickBytes {
        let Pose { position: p, orientation: q } = self.reading.pose;
        let floats = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
        let (f, t) = (self.force, self.tip);
        let forces = [f.x, f.y, f.z, t.x, t.y, t.z, self.spring].map(f32::to_bits);
        let words = floats.into_iter().chain([self.reading.buttons]).chain(forces).chain([self.removed]);
        let mut bytes = [0; LENGTH];
        bytes[..4].copy_from_slice(&ENCAPSULATION);
        bytes[4..12].copy_from_slice(&self.tick.0.to_le_bytes());
        for (to, word) in bytes[12..LENGTH_1 - 3].chunks_exact_mut(4).zip(words) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes[LENGTH_1 - 3..LENGTH_1].copy_from_slice(&[self.touched, self.instrument, u8::from(self.cutting)]);
        let added = self.torque.to_array().into_iter().chain(self.lead.to_array());
        for (to, number) in bytes[LENGTH_1 + 1..].chunks_exact_mut(4).zip(added) {
            to.copy_from_slice(&number.to_le_bytes());
        }
        TickBytes { bytes, layout }
    }

    /// Decodes a message; `None` if the bytes are not a message of this layout.
    pub fn parse(bytes: &[u8], layout: TickLayout) -> Option<TickRecord> {
        if bytes.len() != layout.length || bytes[..4] != ENCAPSULATION {
            return None;
        }
        let word_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|b| bytes[at + b]));
        let word = |i: usize| word_at(12 + 4 * i);
        let float = |i: usize| f32::from_bits(word(i));
        let added = |first: usize| match layout.length == LENGTH {
            true => Vec3::from_array(std::array::from_fn(|i| f32::from_bits(word_at(LENGTH_1 + 1 + 4 * (first + i))))),
            false => Vec3::ZERO,
        };
        let vector = |i: usize| Vec3::new(float(i), float(i + 1), float(i + 2));
        let orientation = Quat::from_xyzw(float(3), float(4), float(5), float(6));
        Some(TickRecord {
            tick: Tick(u64::from_le_bytes(std::array::from_fn(|b| bytes[4 + b]))),
            reading: Reading { pose: Pose { position: vector(0), orientation }, buttons: word(7) },
            force: vector(8),
            torque: added(0),
            lead: added(3),
            tip: vector(11),
            spring: float(14),
            removed: word(15),
            touched: bytes[LENGTH_1 - 3],
            instrument: bytes[LENGTH_1 - 2],
            cutting: bytes[LENGTH_1 - 1] != 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_round_trips_to_the_last_bit() {
        let pose = Pose { position: Vec3::new(1.5, -2.25, f32::NAN), orientation: Quat::from_xyzw(0.1, 0.2, 0.3, 0.9) };
        let haptic = TickRecord {
            tick: Tick(123_456_789_012),
            reading: Reading { pose, buttons: 5 },
            force: Vec3::new(0.1, 0.2, -0.0),
            torque: Vec3::new(1.0, -2.0, 3.5),
            lead: Vec3::new(0.0, -0.5, 0.25),
            tip: Vec3::splat(7.0),
            spring: 1.25,
            removed: 77,
            touched: 4,
            instrument: 2,
            cutting: true,
        };
        let check = |layout, torque, lead| {
            let bytes = haptic.bytes(layout);
            let again = TickRecord::parse(&bytes, layout).unwrap();
            assert_eq!((&*again.bytes(layout), again.torque, again.lead), (&*bytes, torque, lead));
            assert_eq!(TickRecord::parse(&bytes[1..], layout), None);
        };
        check(TickLayout::NEWEST, haptic.torque, haptic.lead);
        check(TickLayout::of(1), Vec3::ZERO, Vec3::ZERO);
        assert_eq!(TickRecord::parse(&haptic.bytes(TickLayout::of(1)), TickLayout::NEWEST), None);
    }
}
