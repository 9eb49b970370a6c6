//! Limits of force and speed in contact, with the response to a value above them.

use typodont_core::volume::Label;

/// A limit of force or speed while the instrument touches tissue.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLimit {
    pub place: LimitPlace,
    pub quantity: LimitedQuantity,
    /// Greatest value that has no consequence: N or mm/s.
    pub most: f32,
    /// True if a warning is shown above the limit.
    pub warns: bool,
    /// True if the patient cries above the limit.
    pub cries: bool,
}

/// Place at which a limit holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitPlace {
    Anywhere,
    /// Near a zone, by its index in the scenario.
    Zone(usize),
    /// Near a tissue, or in contact with it.
    Tissue(Label),
}

/// Quantity that a limit concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedQuantity {
    /// Force without guidance, as `force_max_n` measures it, N.
    Force,
    /// Speed of the tip in contact, as `speed_max_mm_s` measures it, mm/s.
    Speed,
}

impl ContactLimit {
    /// Force in contact above which an exercise without limits of its own shows a warning, N. The dentists of the study on
    /// which the program is based cut with less. Sensible from 0.5 to 5.
    pub const WARNING_FORCE: f32 = 2.0;

    /// Force in contact above which the patient of an exercise without limits of its own cries, N. The study names the cry
    /// but no number: it is above the warning, so that the trainee is warned first. Sensible from 0.5 to 5.
    pub const CRY_FORCE: f32 = 2.5;
}
