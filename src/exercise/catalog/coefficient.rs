//! The names of a tissue's coefficients in `content/tissues.json` and in recordings.

use core::fmt;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use typodont_core::touch::Coefficient;

/// Coefficient of a tissue, by its name in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CoefficientName {
    Stiffness,
    Damping,
    StaticFriction,
    DynamicFriction,
    CutForceN,
}

impl From<Coefficient> for CoefficientName {
    fn from(coefficient: Coefficient) -> CoefficientName {
        match coefficient {
            Coefficient::Stiffness => CoefficientName::Stiffness,
            Coefficient::Damping => CoefficientName::Damping,
            Coefficient::StaticFriction => CoefficientName::StaticFriction,
            Coefficient::DynamicFriction => CoefficientName::DynamicFriction,
            Coefficient::CutForce => CoefficientName::CutForceN,
        }
    }
}

impl From<CoefficientName> for Coefficient {
    fn from(name: CoefficientName) -> Coefficient {
        match name {
            CoefficientName::Stiffness => Coefficient::Stiffness,
            CoefficientName::Damping => Coefficient::Damping,
            CoefficientName::StaticFriction => Coefficient::StaticFriction,
            CoefficientName::DynamicFriction => Coefficient::DynamicFriction,
            CoefficientName::CutForceN => Coefficient::CutForce,
        }
    }
}

impl fmt::Display for CoefficientName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            CoefficientName::Stiffness => "stiffness",
            CoefficientName::Damping => "damping",
            CoefficientName::StaticFriction => "static_friction",
            CoefficientName::DynamicFriction => "dynamic_friction",
            CoefficientName::CutForceN => "cut_force_n",
        })
    }
}
