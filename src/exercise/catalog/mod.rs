//! The catalogue: tables of tissues, instruments and touch factors, as a school can edit them.
//!
//! Takes JSON texts. Gives checked tables, or every diagnostic.

mod coefficient;
mod tissues;
mod tooth_shade;
mod hand_instruments;
mod shape;
mod instruments;
mod touch_factors;

pub use coefficient::CoefficientName;
pub use hand_instruments::{BladeEntry, CleoidEntry, PluggerEntry, SpoonEntry};
pub use instruments::{
    BentExplorerEntry, InstrumentEntry, InstrumentTable, MirrorEntry, PackingActionEntry, ProbeEntry, ToolKind,
    WorkingEndEntry, catmull_rom,
};
pub use shape::{CuttingPartEntry, LengthUnitEntry, SampledEnd, ShapeEntry};
pub use tissues::{PackingEntry, TissueEntry, TissueRole, TissueTable, parse_color};
pub use tooth_shade::{ShadeColours, ToothShade};
pub use touch_factors::{AgeBand, TouchFactorTable};
