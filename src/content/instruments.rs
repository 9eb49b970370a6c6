//! The table of instruments.

use super::Library;
use super::json;
use crate::diagnostic::Diagnostic;
use crate::touch::{Instrument, WorkingEnd};
use schemars::JsonSchema;
use serde::Deserialize;

/// One line of `content/instruments.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstrumentEntry {
    /// Name by which scenarios refer to it.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Name shown to people.
    #[schemars(length(min = 1, max = 80))]
    pub title: String,
    /// The part that touches.
    pub end: EndEntry,
    /// True for a rotating bur.
    pub cuts: bool,
    /// Of what kind it is: how tissues feel through it (`content/touch.json`); without it as the table of tissues says.
    #[serde(default)]
    pub kind: Option<ToolKind>,
    /// How many times more it takes than a medium diamond by the rate law of carving, 0.05 to 10; without it 1.
    #[serde(default)]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub grit: Option<f32>,
    /// ISO 6360 number: material, shank, shape, grit, greatest diameter in tenths of a millimetre.
    #[serde(default)]
    pub iso_6360: Option<String>,
    /// US number of the same bur.
    #[serde(default)]
    pub us_number: Option<String>,
}

/// Kinds of tool that feel and cut differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolKind {
    SteelExplorer,
    SteelBur,
    CarbideBur,
    DiamondBur,
}

/// The shape of a working end.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndEntry {
    /// A tip finer than anything felt.
    Point,
    Ball(BallEntry),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallEntry {
    /// Diameter, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
}

impl InstrumentEntry {
    /// The instrument as touch knows it.
    pub fn make(&self) -> Instrument {
        let end = match &self.end {
            EndEntry::Point => WorkingEnd::Point,
            EndEntry::Ball(ball) => WorkingEnd::Ball { radius: 0.5 * ball.diameter_mm },
        };
        Instrument::new(end, self.cuts)
    }
}

/// `content/instruments.json` as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct InstrumentFile {
    #[schemars(length(min = 1, max = 500))]
    instruments: Vec<InstrumentEntry>,
}

/// Every instrument a session can offer.
#[derive(Clone, Debug)]
pub struct InstrumentTable {
    entries: Vec<InstrumentEntry>,
}

impl InstrumentTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/instruments.json";

    pub fn read(library: &Library) -> Result<InstrumentTable, Vec<Diagnostic>> {
        let source = library.text(Self::NAME).map_err(|e| vec![e])?;
        let read = json::read::<InstrumentFile>(source)?;
        let entries = read.value.instruments;
        let mut found = Vec::new();
        for (index, entry) in entries.iter().enumerate() {
            if entries[..index].iter().any(|e| e.id == entry.id) {
                let message = format!("there is already an instrument \"{}\"", entry.id);
                found.push(read.places.complain(&format!("/instruments/{index}/id"), "duplicate-id", message, None));
            }
            if entry.kind.is_some_and(|kind| (kind == ToolKind::SteelExplorer) == entry.cuts) {
                let message = format!("\"{}\" does not cut as its kind does", entry.id);
                let help = Some("an explorer never cuts, a bur always does".to_string());
                found.push(read.places.complain(&format!("/instruments/{index}/kind"), "wrong-kind", message, help));
            }
            if matches!(entry.end, EndEntry::Point) && entry.cuts {
                let message = format!("\"{}\" cuts with a point", entry.id);
                let help = Some("a bur has a width: give its end as { \"ball\": { \"diameter_mm\": … } }".to_string());
                found.push(read.places.complain(&format!("/instruments/{index}/cuts"), "cutting-point", message, help));
            }
        }
        if found.is_empty() { Ok(InstrumentTable { entries }) } else { Err(found) }
    }

    pub fn ids(&self) -> impl Iterator<Item = &str> + Clone {
        self.entries.iter().map(|e| e.id.as_str())
    }

    pub fn by_id(&self, id: &str) -> Option<&InstrumentEntry> {
        self.entries.iter().find(|e| e.id == id)
    }
}
