//! The load on the working end, as far as it can be heard.
//!
//! Takes plain numbers and flags from the program. Gives them to the synthesiser, limited to their ranges. Never fails.

/// Kind of tool in the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tool {
    /// A handpiece driven by air: very fast, and slower under any load.
    #[default]
    AirTurbine,
    /// A speed-increasing contra-angle (1:5) on an electric motor, which keeps its speed.
    Electric,
    /// A contra-angle (1:1) for round burs in dentine.
    LowSpeed,
    /// A probe or an excavator: nothing rotates.
    Hand,
}

/// Momentary load on the working end. The newest one counts.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct DrillLoad {
    pub tool: Tool,
    pub is_running: bool,
    /// Speed of the bur without load, rpm, 0 to 500 000. The loss under load is computed here.
    pub speed: f32,
    pub is_touching: bool,
    /// True while tissue is removed; a bur that only rubs is quieter.
    pub is_cutting: bool,
    /// Force on the working end, N, 0 to 20.
    pub force: f32,
    /// Speed of the working end's surface relative to the tissue, mm/s, 0 to 60 000: at the circumference of a bur
    /// without load, at the tip of a hand instrument along the surface.
    pub surface_speed: f32,
    /// Vickers hardness of the touched tissue, HV, 0 to 1000: enamel about 300, dentine 60, decay 15; 0 for soft
    /// tissue.
    pub hardness: f32,
    pub is_suction_on: bool,
    /// Water spray, which requires a running handpiece.
    pub is_spray_on: bool,
}

/// Number of words of a load in a mailbox.
pub const LOAD_WORDS: usize = 5;

/// Bits of the flags in the first word; its lowest two bits are the tool.
const IS_RUNNING: u32 = 1 << 2;
const IS_TOUCHING: u32 = 1 << 3;
const IS_CUTTING: u32 = 1 << 4;
const IS_SUCTION_ON: u32 = 1 << 5;
const IS_SPRAY_ON: u32 = 1 << 6;

impl DrillLoad {
    pub const SPEED_MAX: f32 = 500_000.0;
    pub const FORCE_MAX: f32 = 20.0;
    pub const SURFACE_SPEED_MAX: f32 = 60_000.0;
    pub const HARDNESS_MAX: f32 = 1000.0;

    /// Returns the load with each number limited to its range, and NaN as zero: invalid numbers are no error for a
    /// sound.
    pub(super) fn clamped(self) -> DrillLoad {
        let within = |value: f32, most: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, most) };
        DrillLoad {
            speed: within(self.speed, Self::SPEED_MAX),
            force: within(self.force, Self::FORCE_MAX),
            surface_speed: within(self.surface_speed, Self::SURFACE_SPEED_MAX),
            hardness: within(self.hardness, Self::HARDNESS_MAX),
            ..self
        }
    }

    /// The load as words, of which [`DrillLoad::decode`] makes the same load.
    pub fn encode(self) -> [u32; LOAD_WORDS] {
        let flags = [
            (self.is_running, IS_RUNNING),
            (self.is_touching, IS_TOUCHING),
            (self.is_cutting, IS_CUTTING),
            (self.is_suction_on, IS_SUCTION_ON),
            (self.is_spray_on, IS_SPRAY_ON),
        ];
        let first = flags.iter().filter(|(is_set, _)| *is_set).fold(self.tool as u32, |word, (_, flag)| word | flag);
        let numbers = [self.speed, self.force, self.surface_speed, self.hardness].map(f32::to_bits);
        [first, numbers[0], numbers[1], numbers[2], numbers[3]]
    }

    pub fn decode(words: [u32; LOAD_WORDS]) -> DrillLoad {
        let [first, numbers @ ..] = words;
        let [speed, force, surface_speed, hardness] = numbers.map(f32::from_bits);
        let tool = [Tool::AirTurbine, Tool::Electric, Tool::LowSpeed, Tool::Hand][(first & 0b11) as usize];
        DrillLoad {
            tool,
            is_running: first & IS_RUNNING != 0,
            speed,
            is_touching: first & IS_TOUCHING != 0,
            is_cutting: first & IS_CUTTING != 0,
            force,
            surface_speed,
            hardness,
            is_suction_on: first & IS_SUCTION_ON != 0,
            is_spray_on: first & IS_SPRAY_ON != 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_decoded_as_it_was_encoded() {
        // Aim: no field is lost or swapped. Method: every tool, every flag alone, and numbers that all differ.
        let numbers = DrillLoad { speed: 1.0, force: 2.0, surface_speed: 3.0, hardness: 4.0, ..DrillLoad::default() };
        for tool in [Tool::AirTurbine, Tool::Electric, Tool::LowSpeed, Tool::Hand] {
            for flag in 0..5 {
                let load = DrillLoad {
                    tool,
                    is_running: flag == 0,
                    is_touching: flag == 1,
                    is_cutting: flag == 2,
                    is_suction_on: flag == 3,
                    is_spray_on: flag == 4,
                    ..numbers
                };
                assert_eq!(DrillLoad::decode(load.encode()), load);
            }
        }
    }

    #[test]
    fn numbers_out_of_range_are_limited() {
        let invalid = DrillLoad { speed: f32::NAN, force: f32::INFINITY, surface_speed: -1.0, ..DrillLoad::default() };
        let clamped = invalid.clamped();
        assert_eq!((clamped.speed, clamped.force, clamped.surface_speed), (0.0, DrillLoad::FORCE_MAX, 0.0));
    }
}
