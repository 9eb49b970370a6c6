//! Motion of the instrument, packed for the page of a session.
//!
//! Takes the recorded ticks. Gives a header and one packed text: key poses, between which the page interpolates, and
//! the force on the instrument. At every tick, the page's pose is as near to the recorded one as the header says.
//! `reports/README.md` describes the format.

use super::instrument_shape::{InstrumentPart, instrument_parts};
use super::voxels::compress;
use serde::Serialize;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::tick::TICK_S;
use typodont_exercise::record::{Recording, TickRecord};
use typodont_exercise::score::{Scored, Trace};

/// Number of steps of a position in a millimetre. A step of 2 µm is a fifth of the tolerance.
const POSITION_STEPS: f64 = 512.0;

/// Number of steps of a quaternion's component in 1: 0.03° at most.
const ORIENTATION_STEPS: f64 = 8192.0;

/// Number of steps of a force in a newton.
const FORCE_STEPS: f64 = 128.0;

/// Greatest difference between the page's pose and the recorded one, if it fits: 0.01 mm and 0.1°.
const TOLERANCE: MotionTolerance = MotionTolerance { mm: 0.01, degrees: 0.1 };

/// Most characters of the packed text in a minute, and altogether: the voxels and the pictures take up to 5.5 MB, and a
/// page is to stay below 7 MB. Scripted hands take 90 000 a minute. Where more would be needed, the tolerance is doubled
/// until the text fits.
const CHARACTERS_PER_MINUTE: f64 = 400_000.0;
const CHARACTERS_MAX: f64 = 1_000_000.0;

/// Most characters of a session of a few ticks.
const CHARACTERS_MIN: f64 = 2_000.0;

/// Largest tolerance, as a multiple of the smallest: 41 mm, at which no text is too long.
const TOLERANCE_FACTOR_MAX: f64 = 4096.0;

/// Most ticks between two key poses, so that the work per key is bounded.
const SPAN_MAX: usize = 4096;

/// Description of the motion in a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionHeader {
    /// Number of key poses.
    pub keys: usize,
    /// Number of mean forces.
    pub forces: usize,
    /// Ticks over which each force is averaged.
    pub force_ticks: u64,
    /// Steps in a millimetre, in 1 and in a newton.
    pub position_steps: f64,
    pub orientation_steps: f64,
    pub force_steps: f64,
    /// Greatest difference from the recorded pose at any tick.
    pub tolerance_mm: f64,
    pub tolerance_deg: f64,
    /// Changes of instrument: the tick, and the index in the tray of the instrument that is held from then on.
    pub held: Vec<(u64, u8)>,
    /// Shapes of the instruments of the tray; empty of those that were not held.
    pub shapes: Vec<Vec<InstrumentPart>>,
}

/// The motion of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMotion {
    pub header: MotionHeader,
    /// All numbers, compressed (zlib, RFC 1950), in base64.
    pub packed: String,
}

/// Difference between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MotionTolerance {
    mm: f64,
    degrees: f64,
}

/// Packs the motion of a session; `None` of a session without a tick.
pub fn pack(recording: &Recording, scored: &Scored) -> Option<PackedMotion> {
    let forces = &scored.trace.forces;
    let poses = poses(recording, &scored.trace, &scored.replay.workpiece.world_from_tooth.inverse());
    let FittedMotion { keys, tolerance, packed } = fit(&poses, forces);
    let held = held(recording);
    let shape = |(index, entry)| match held.iter().any(|(_, tool)| usize::from(*tool) == index) {
        true => instrument_parts(entry),
        false => Vec::new(),
    };
    let header = MotionHeader {
        keys,
        forces: forces.len(),
        force_ticks: Trace::FORCE_TICKS,
        position_steps: POSITION_STEPS,
        orientation_steps: ORIENTATION_STEPS,
        force_steps: FORCE_STEPS,
        tolerance_mm: tolerance.mm,
        tolerance_deg: tolerance.degrees,
        shapes: recording.scenario.instruments.iter().enumerate().map(shape).collect(),
        held,
    };
    (!poses.is_empty()).then_some(PackedMotion { header, packed })
}

/// A packed text with the number of its keys and the tolerance that it keeps.
struct FittedMotion {
    keys: usize,
    tolerance: MotionTolerance,
    packed: String,
}

/// Packs poses, one per tick, with the smallest tolerance at which the text is short enough.
fn fit(poses: &[Pose], forces: &[Vec3]) -> FittedMotion {
    let minutes = poses.len() as f64 * TICK_S / 60.0;
    let characters_max = (CHARACTERS_PER_MINUTE * minutes).clamp(CHARACTERS_MIN, CHARACTERS_MAX) as usize;
    let key_poses: Vec<KeyPose> = poses.iter().map(KeyPose::nearest).collect();
    let mut factor = 1.0;
    loop {
        let tolerance = MotionTolerance { mm: factor * TOLERANCE.mm, degrees: factor * TOLERANCE.degrees };
        let keys = key_ticks(poses, &key_poses, tolerance);
        let packed = packed(&keys, &key_poses, forces);
        if packed.len() <= characters_max || factor >= TOLERANCE_FACTOR_MAX {
            return FittedMotion { keys: keys.len(), tolerance, packed };
        }
        factor *= 2.0;
    }
}

/// Poses of the instrument as the trainee saw it, at each tick; tooth space.
///
/// The position is that of the working end, which the tooth stops; the orientation is that of the hand, and the last
/// valid one where the device reported none.
fn poses(recording: &Recording, trace: &Trace, tooth_from_world: &Pose) -> Vec<Pose> {
    let mut device_orientations = trace.device_orientations.iter().peekable();
    let (mut world_from_device, mut in_device) = (Quat::IDENTITY, Quat::IDENTITY);
    let pose = |tick: &TickRecord| {
        while let Some((_, orientation)) = device_orientations.next_if(|(from, _)| *from <= tick.tick) {
            world_from_device = *orientation;
        }
        if tick.reading.pose.is_valid() {
            in_device = tick.reading.pose.orientation.normalize();
        }
        *tooth_from_world * Pose { position: tick.tip, orientation: world_from_device * in_device }
    };
    recording.ticks.iter().map(pose).collect()
}

/// Changes of the instrument, with the first one at tick 0.
fn held(recording: &Recording) -> Vec<(u64, u8)> {
    let mut held: Vec<(u64, u8)> = recording.ticks.iter().map(|tick| (tick.tick.0, tick.instrument)).collect();
    held.dedup_by_key(|change| change.1);
    held
}

/// A pose in whole steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct KeyPose {
    position: [i32; 3],
    /// x, y, z, w
    orientation: [i32; 4],
}

impl KeyPose {
    fn nearest(pose: &Pose) -> KeyPose {
        let steps = |value: f32, per: f64| (f64::from(value) * per).round() as i32;
        KeyPose {
            position: pose.position.to_array().map(|mm| steps(mm, POSITION_STEPS)),
            orientation: pose.orientation.to_array().map(|part| steps(part, ORIENTATION_STEPS)),
        }
    }

    /// The same orientation as a quaternion on the side of another: between both lies the short way.
    fn on_the_side_of(self, other: &KeyPose) -> KeyPose {
        let along: i64 =
            self.orientation.iter().zip(other.orientation).map(|(a, b)| i64::from(*a) * i64::from(b)).sum();
        if along < 0 { KeyPose { orientation: self.orientation.map(|part| -part), ..self } } else { self }
    }
}

/// A pose between two key poses, as the page computes it: millimetres, and a quaternion of unit length.
fn between(from: &KeyPose, to: &KeyPose, share: f64) -> ([f64; 3], [f64; 4]) {
    let mix = |a: i32, b: i32| f64::from(a) + (f64::from(b) - f64::from(a)) * share;
    let to = to.on_the_side_of(from);
    let position = std::array::from_fn(|axis| mix(from.position[axis], to.position[axis]) / POSITION_STEPS);
    let turn: [f64; 4] = std::array::from_fn(|part| mix(from.orientation[part], to.orientation[part]));
    let length = turn.iter().map(|part| part * part).sum::<f64>().sqrt().max(1e-9);
    (position, turn.map(|part| part / length))
}

/// Distance and angle between a recorded pose and one of the page.
fn difference(pose: &Pose, (position, turn): ([f64; 3], [f64; 4])) -> MotionTolerance {
    let squared = |a: &[f32], b: &[f64], sign: f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| (f64::from(*a) - sign * b) * (f64::from(*a) - sign * b)).sum()
    };
    let given = pose.orientation.to_array();
    // The chord between two unit quaternions is 2 sin(angle/4).
    let chord = squared(&given, &turn, 1.0).min(squared(&given, &turn, -1.0)).sqrt();
    MotionTolerance {
        mm: squared(&pose.position.to_array(), &position, 1.0).sqrt(),
        degrees: (4.0 * libm::asin(0.5 * chord.min(2.0))).to_degrees(),
    }
}

/// Chooses the key ticks, the first and the last tick among them: from each the farthest one up to which interpolation
/// stays within the tolerance, by doubling and bisection.
fn key_ticks(poses: &[Pose], key_poses: &[KeyPose], tolerance: MotionTolerance) -> Vec<usize> {
    let Some(last) = poses.len().checked_sub(1) else { return Vec::new() };
    let is_kept = |from: usize, to: usize| {
        (from + 1..to).all(|tick| {
            let share = (tick - from) as f64 / (to - from) as f64;
            let off = difference(&poses[tick], between(&key_poses[from], &key_poses[to], share));
            off.mm <= tolerance.mm && off.degrees <= tolerance.degrees
        })
    };
    let mut keys = vec![0];
    let mut from = 0;
    while from < last {
        let farthest = (last - from).min(SPAN_MAX);
        let (mut kept, mut lost) = (1, 2);
        while lost <= farthest && is_kept(from, from + lost) {
            (kept, lost) = (lost, 2 * lost);
        }
        lost = lost.min(farthest + 1);
        while lost - kept > 1 {
            let middle = kept.midpoint(lost);
            if is_kept(from, from + middle) { kept = middle } else { lost = middle }
        }
        from += kept;
        keys.push(from);
    }
    keys
}

/// All numbers of the motion as differences from the number before, column by column.
fn packed(keys: &[usize], key_poses: &[KeyPose], forces: &[Vec3]) -> String {
    let mut bytes = Vec::new();
    let mut chosen: Vec<KeyPose> = Vec::new();
    for key in keys {
        let pose = key_poses[*key];
        chosen.push(chosen.last().map_or(pose, |before| pose.on_the_side_of(before)));
    }
    write_column(&mut bytes, keys.iter().map(|key| *key as i32));
    for axis in 0..3 {
        write_column(&mut bytes, chosen.iter().map(|pose| pose.position[axis]));
    }
    for part in 0..4 {
        write_column(&mut bytes, chosen.iter().map(|pose| pose.orientation[part]));
    }
    for axis in 0..3 {
        write_column(&mut bytes, forces.iter().map(|force| (f64::from(force[axis]) * FORCE_STEPS).round() as i32));
    }
    compress([bytes.as_slice()].into_iter())
}

/// Writes the differences of a column of numbers: signs in the lowest bit (zigzag), seven bits in a byte, the lowest
/// first, with the eighth bit set where more follow (LEB128).
fn write_column(bytes: &mut Vec<u8>, numbers: impl Iterator<Item = i32>) {
    let mut before = 0;
    for number in numbers {
        let change = number.wrapping_sub(before);
        before = number;
        let mut rest = ((change << 1) ^ (change >> 31)) as u32;
        while rest >= 0x80 {
            bytes.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use std::io::Read;
    use typodont_core::tick::Tick;
    use typodont_exercise::record::ReplayCheck;

    /// Columns of a packed motion, read by the description in `reports/README.md`.
    struct ReadMotion {
        header: MotionHeader,
        ticks: Vec<i64>,
        positions: [Vec<i64>; 3],
        orientations: [Vec<i64>; 4],
        forces: [Vec<i64>; 3],
    }

    fn read(motion: &PackedMotion) -> ReadMotion {
        let zlib = base64::engine::general_purpose::STANDARD.decode(&motion.packed).unwrap();
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(zlib.as_slice()).read_to_end(&mut bytes).unwrap();
        let mut rest = bytes.into_iter();
        let mut column = |count: usize| {
            let mut value = 0;
            let number = |_| {
                let (mut zigzag, mut shift) = (0u64, 0);
                loop {
                    let byte = rest.next().unwrap();
                    zigzag |= u64::from(byte & 0x7f) << shift;
                    shift += 7;
                    if byte < 0x80 {
                        break;
                    }
                }
                value += (zigzag >> 1) as i64 * if zigzag & 1 == 1 { -1 } else { 1 } - (zigzag & 1) as i64;
                value
            };
            (0..count).map(number).collect::<Vec<i64>>()
        };
        let header = motion.header.clone();
        let read = ReadMotion {
            ticks: column(header.keys),
            positions: std::array::from_fn(|_| column(header.keys)),
            orientations: std::array::from_fn(|_| column(header.keys)),
            forces: std::array::from_fn(|_| column(header.forces)),
            header,
        };
        assert!(rest.next().is_none(), "bytes are left");
        read
    }

    impl ReadMotion {
        /// Pose at a tick: between the keys around it, with a slow and independent formula.
        fn at(&self, tick: u64) -> ([f64; 3], [f64; 4]) {
            let next = self.ticks.partition_point(|key| *key < tick as i64);
            let from = next.saturating_sub(1);
            let span = (self.ticks[next] - self.ticks[from]) as f64;
            let share = if span == 0.0 { 0.0 } else { (tick as i64 - self.ticks[from]) as f64 / span };
            let mix = |column: &Vec<i64>| column[from] as f64 * (1.0 - share) + column[next] as f64 * share;
            let turn = self.orientations.each_ref().map(mix);
            let length = turn.iter().map(|v| v * v).sum::<f64>().sqrt();
            let position = self.positions.each_ref().map(|column| mix(column) / self.header.position_steps);
            (position, turn.map(|v| v / length))
        }

        /// Greatest distance, mm, and angle, degrees, from poses at all their ticks.
        fn worst(&self, poses: &[Pose]) -> [f64; 2] {
            let mut worst = [0.0f64; 2];
            for (tick, pose) in poses.iter().enumerate() {
                let (position, turn) = self.at(tick as u64);
                let given = pose.position.to_array().map(f64::from);
                let mm = (0..3).map(|a| (given[a] - position[a]).powi(2)).sum::<f64>().sqrt();
                // The angle by the vector part of the rotation from one to the other: exact for small angles, too.
                let [x, y, z, w] = turn;
                let other = glam::DQuat::from_xyzw(x, y, z, w);
                let way = pose.orientation.as_dquat().normalize() * other.conjugate();
                let degrees = (2.0 * way.xyz().length().min(1.0).asin()).to_degrees();
                worst = [worst[0].max(mm), worst[1].max(degrees)];
            }
            worst
        }
    }

    fn golden(name: &str) -> (Recording, Scored) {
        let path = format!("{}/../../tests/golden/{name}.mcap", env!("CARGO_MANIFEST_DIR"));
        let recording = Recording::read(std::path::Path::new(&path)).unwrap();
        let scored = typodont_exercise::score::score(&recording, ReplayCheck::Skip).unwrap();
        (recording, scored)
    }

    #[test]
    fn a_placed_hand_turns_the_instrument_from_its_tick_on() {
        // Aim: the player shows the instrument as the trainee saw it. Method: a recorded session, and the same as if the
        // hand had been placed at its tick 100.
        let (recording, _) = golden("version-3");
        let turn = Quat::from_rotation_y(1.0);
        let placed = Trace { device_orientations: vec![(Tick(100), turn)], ..Trace::default() };
        let [before, after] = [Trace::default(), placed].map(|trace| poses(&recording, &trace, &Pose::IDENTITY));
        for (tick, (before, after)) in before.iter().zip(&after).enumerate() {
            let expected = if tick < 100 { before.orientation } else { turn * before.orientation };
            assert!(after.orientation.angle_between(expected) < 2e-3, "tick {tick}");
            assert_eq!(after.position, before.position);
        }
    }

    #[test]
    fn a_page_holds_every_recorded_pose_within_its_tolerance_in_little_space() {
        // Aim: what is played back is what was seen, with every instrument, and costs less than 0.4 MB a minute. Method:
        // read the packed text by its description and compare every tick of recorded sessions.
        for (recording, scored) in [crate::example(), golden("version-1"), golden("version-2"), golden("version-3")] {
            let motion = pack(&recording, &scored).unwrap();
            let poses = poses(&recording, &scored.trace, &scored.replay.workpiece.world_from_tooth.inverse());
            let [mm, degrees] = read(&motion).worst(&poses);
            let header = &motion.header;
            assert_eq!((header.tolerance_mm, header.tolerance_deg), (0.01, 0.1));
            assert!(mm <= 0.01 + 1e-9 && degrees <= 0.1 + 1e-9, "{mm} mm, {degrees}°");
            let per_minute = motion.packed.len() as f64 / (poses.len() as f64 / 60_000.0);
            println!("{} keys of {} ticks, {per_minute:.0} characters per minute", header.keys, poses.len());
            assert!(per_minute < 400_000.0, "{per_minute} characters per minute");
            for record in &recording.ticks {
                let held = header.held.iter().rev().find(|change| change.0 <= record.tick.0).unwrap();
                assert_eq!(held.1, record.instrument);
                assert!(!header.shapes[usize::from(held.1)].is_empty());
            }
        }
    }

    #[test]
    fn the_force_of_a_page_is_the_mean_of_the_recorded_ones() {
        // Aim: the arrow is as long as the force was. Method: means of the recording itself, of a session without guidance.
        let (recording, scored) = crate::example();
        let page = read(&pack(&recording, &scored).unwrap());
        let tooth_from_world = scored.replay.workpiece.world_from_tooth.inverse();
        assert_eq!(page.header.forces, recording.ticks.len() / 20);
        let mut most: f64 = 0.0;
        for (number, ticks) in recording.ticks.chunks_exact(20).enumerate() {
            let mean = ticks.iter().map(|tick| tooth_from_world.rotate(tick.force)).sum::<Vec3>() / 20.0;
            for axis in 0..3 {
                let given = page.forces[axis][number] as f64 / page.header.force_steps;
                assert!((given - f64::from(mean[axis])).abs() < 0.5 / FORCE_STEPS + 1e-4, "{number}: {given} {mean}");
            }
            most = most.max(f64::from(mean.length()));
        }
        assert!(most > 0.5, "something was pressed: {most}");
    }

    /// A hand that draws circles and trembles, at each tick; `noise` in mm.
    fn trembling(ticks: usize, noise: f32) -> Vec<Pose> {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let pose = |tick: usize| {
            let s = tick as f32 * 1e-3;
            let tremor = 0.05 * (s * 60.0).sin();
            let jitter = Vec3::new(random(), random(), random()) * noise;
            Pose {
                position: Vec3::new(3.0 * s.cos() + tremor, 3.0 * s.sin(), 0.5 * (3.0 * s).sin()) + jitter,
                // It passes the orientation at which a quaternion changes its sign.
                orientation: Quat::from_rotation_z(0.8 * s) * Quat::from_rotation_x(0.01 * (s * 55.0).sin()),
            }
        };
        (0..ticks).map(pose).collect()
    }

    fn packed_alone(poses: &[Pose]) -> PackedMotion {
        let FittedMotion { keys, tolerance, packed } = fit(poses, &[]);
        let header = MotionHeader {
            keys,
            forces: 0,
            force_ticks: 20,
            position_steps: POSITION_STEPS,
            orientation_steps: ORIENTATION_STEPS,
            force_steps: FORCE_STEPS,
            tolerance_mm: tolerance.mm,
            tolerance_deg: tolerance.degrees,
            held: Vec::new(),
            shapes: Vec::new(),
        };
        PackedMotion { header, packed }
    }

    #[test]
    fn a_trembling_hand_keeps_the_tolerance_and_a_noisy_one_states_its_own() {
        // Aim: the page never holds less than it says, and never grows beyond its limit. Method: two minutes of tremor,
        // one minute of white noise, and a hand that jumps.
        let tremor = trembling(120_000, 0.0);
        let motion = packed_alone(&tremor);
        let [mm, degrees] = read(&motion).worst(&tremor);
        assert!(motion.header.tolerance_mm == 0.01 && mm <= 0.01 + 1e-9 && degrees <= 0.1 + 1e-9, "{mm} {degrees}");
        println!("tremor: {} characters per minute", motion.packed.len() / 2);
        assert!(motion.packed.len() / 2 < 100_000, "{}", motion.packed.len());
        let noise = trembling(60_000, 1.0);
        let motion = packed_alone(&noise);
        let [mm, degrees] = read(&motion).worst(&noise);
        let MotionHeader { tolerance_mm, tolerance_deg, .. } = motion.header;
        println!("noise: {} characters, {tolerance_mm} mm", motion.packed.len());
        assert!(tolerance_mm > 0.01 && motion.packed.len() <= 400_000, "{tolerance_mm}: {}", motion.packed.len());
        assert!(mm <= tolerance_mm + 1e-9 && degrees <= tolerance_deg + 1e-9, "{mm} {degrees}");
        let mut jumping = trembling(3_000, 0.0);
        jumping[1_500..].iter_mut().for_each(|pose| pose.position.x += 40.0);
        let [mm, _] = read(&packed_alone(&jumping)).worst(&jumping);
        assert!(mm <= 0.01 + 1e-9, "{mm}");
        assert_eq!(read(&packed_alone(&jumping[..1])).ticks, [0]);
    }

    #[test]
    fn the_same_motion_gives_the_same_bytes() {
        let (recording, scored) = crate::example();
        assert_eq!(pack(&recording, &scored), pack(&recording, &scored));
    }
}
