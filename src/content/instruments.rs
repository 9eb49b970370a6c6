//! The table of instruments.

use super::Library;
use super::json;
use crate::diagnostic::Diagnostic;
use crate::frame::{Pose, Quat, Vec3};
use crate::touch::{Body, EDGE, Instrument, Profile, Shank, WorkingEnd};
use crate::volume::{Grid, Label, Volume};
use schemars::JsonSchema;
use serde::Deserialize;
use std::f32::consts::FRAC_PI_4;

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
    /// How it looks: an .obj, .glb or .gltf file in millimetres, the working end's tip at the origin, +z along the shaft
    /// toward the hand. Only a picture: what touches is `end`. Without it, or where it cannot be read, the end's outline is
    /// drawn.
    #[serde(default)]
    #[schemars(length(min = 1, max = 200))]
    pub mesh: Option<String>,
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
    /// A ball with a cone behind it that narrows toward the neck.
    Pear(PearEntry),
    /// A straight fissure bur.
    Cylinder(CylinderEntry),
    /// A fissure bur that is more slender at its tip.
    Tapered(TaperedEntry),
    /// A cone that is widest at its flat tip.
    InvertedCone(InvertedConeEntry),
    /// Slender at tip and neck, widest in the middle.
    Flame(FlameEntry),
    /// A mouth mirror; the middle of its face is where the hand's tip is.
    Mirror(MirrorEntry),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorEntry {
    /// Diameter of the face, mm: 14 to 30. No. 4 has 22, no. 5 has 24.
    #[schemars(range(min = 14.0, max = 30.0))]
    pub diameter_mm: f32,
}

impl MirrorEntry {
    /// Behind its face a mirror is so thick, mm.
    pub const THICKNESS: f32 = 1.6;

    /// The middle of the face and how it is turned in handle space: it reflects toward its own +z, which leans by 45° from
    /// the shaft's way to the hand.
    pub fn handle_from_face(&self) -> Pose {
        Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_y(FRAC_PI_4) }
    }

    /// Where the shaft joins the rim, handle space, mm.
    pub fn foot(&self) -> Vec3 {
        self.handle_from_face() * Vec3::new(-0.5 * self.diameter_mm, 0.0, -0.5 * Self::THICKNESS)
    }

    /// What touches: the head, and the shaft as far as it reaches into a mouth.
    fn body(&self) -> Body {
        /// Length and radius of the shaft, rounding of the rim, and voxels, mm.
        const SHAFT: f32 = 25.0;
        const SLENDER: f32 = 1.1;
        const ROUNDING: f32 = 0.4;
        const SPACING: f32 = 0.4;
        let (radius, half) = (0.5 * self.diameter_mm, 0.5 * Self::THICKNESS);
        let (face_from_handle, foot) = (self.handle_from_face().inverse(), self.foot());
        let distance = |p: Vec3| {
            let at = face_from_handle * p;
            let beyond = Vec3::new(at.truncate().length() - radius, (at.z + half).abs() - half, 0.0) + ROUNDING;
            let outside = beyond.max(Vec3::ZERO).truncate().length() + beyond.truncate().max_element().min(0.0);
            let shaft = p - foot - Vec3::Z * (p.z - foot.z).clamp(0.0, SHAFT);
            (outside - ROUNDING).min(shaft.length() - SLENDER)
        };
        let reach = Vec3::splat(radius + 2.0);
        let grid = Grid::covering(-reach, reach.max(foot + Vec3::Z * (SHAFT + 2.0)), Vec3::splat(SPACING), 3);
        Body::of_volume(&Volume::from_distance(grid, 1.5 * SPACING, |p| (distance(p), Label(1))))
    }
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallEntry {
    /// Diameter, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PearEntry {
    /// Diameter of the ball at the tip, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
    /// Length of the cutting part, mm: 0.5 to 12, and longer than it is wide.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub length_mm: f32,
    /// Diameter at the top of the cutting part, mm: 0.2 to 5.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub top_diameter_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderEntry {
    /// Diameter, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
    /// Length of the cutting part, mm: 0.5 to 12, and longer than it is wide if its tip is round.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub length_mm: f32,
    #[serde(default)]
    pub tip: TipEntry,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaperedEntry {
    /// Greatest diameter, at the top of the cutting part, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
    /// Diameter at the tip, mm: 0.2 to 5.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub tip_diameter_mm: f32,
    /// Length of the cutting part, mm: 0.5 to 12, and longer than it is wide if its tip is round.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub length_mm: f32,
    #[serde(default)]
    pub tip: TipEntry,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InvertedConeEntry {
    /// Diameter at the flat tip, mm: 0.3 to 5.
    #[schemars(range(min = 0.3, max = 5.0))]
    pub diameter_mm: f32,
    /// Diameter at the top, mm: 0.2 to 5.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub top_diameter_mm: f32,
    /// Length of the cutting part, mm: 0.3 to 12.
    #[schemars(range(min = 0.3, max = 12.0))]
    pub length_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlameEntry {
    /// Greatest diameter, mm: 0.5 to 5.
    #[schemars(range(min = 0.5, max = 5.0))]
    pub diameter_mm: f32,
    /// Length of the cutting part, mm: 0.5 to 12, and longer than it is wide.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub length_mm: f32,
}

/// How a fissure bur ends.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum TipEntry {
    /// With an edge.
    #[default]
    Flat,
    /// With half a ball.
    Round,
}

/// Radius of a flame's tip, mm: a needle's would find every pore of a voxel surface.
const FLAME_TIP: f32 = 0.1;

impl InstrumentEntry {
    /// The instrument as touch knows it.
    pub fn make(&self) -> Instrument {
        let bur = |profile: Profile, top: f32| {
            let [_, length] = profile.span();
            Instrument::shaped(Body::turned(profile, Some(Shank::friction_grip(top, length))), self.cuts)
        };
        match &self.end {
            EndEntry::Point => Instrument::new(WorkingEnd::Point, self.cuts),
            EndEntry::Ball(ball) => Instrument::new(WorkingEnd::Ball { radius: 0.5 * ball.diameter_mm }, self.cuts),
            EndEntry::Pear(e) => {
                let profile = Profile::round_ended(0.5 * e.diameter_mm, 0.5 * e.top_diameter_mm, e.length_mm);
                bur(profile, e.top_diameter_mm)
            }
            EndEntry::Cylinder(e) => bur(fissure(e.diameter_mm, e.diameter_mm, e.length_mm, e.tip), e.diameter_mm),
            EndEntry::Tapered(e) => bur(fissure(e.tip_diameter_mm, e.diameter_mm, e.length_mm, e.tip), e.diameter_mm),
            EndEntry::InvertedCone(e) => {
                bur(fissure(e.diameter_mm, e.top_diameter_mm, e.length_mm, TipEntry::Flat), e.top_diameter_mm)
            }
            EndEntry::Mirror(mirror) => Instrument::shaped(mirror.body(), self.cuts),
            EndEntry::Flame(e) => bur(Profile::flame(0.5 * e.diameter_mm, e.length_mm, FLAME_TIP), 2.0 * FLAME_TIP),
        }
    }
}

fn fissure(tip_diameter: f32, top_diameter: f32, length: f32, tip: TipEntry) -> Profile {
    let (low, high) = (0.5 * tip_diameter, 0.5 * top_diameter);
    match tip {
        TipEntry::Flat => Profile::frustum(low, high, length, [EDGE; 2]),
        TipEntry::Round => Profile::round_ended(low, high, length),
    }
}

impl EndEntry {
    /// What is wrong with a shape whose lengths are each in range.
    fn contradiction(&self) -> Option<&'static str> {
        let (is_wrong, what) = match self {
            EndEntry::Point | EndEntry::Ball(_) | EndEntry::Mirror(_) => return None,
            EndEntry::Pear(e) => (
                e.length_mm <= e.diameter_mm || e.top_diameter_mm >= e.diameter_mm,
                "a pear is longer than it is wide, and wider at its tip than at its top",
            ),
            EndEntry::Cylinder(e) => (
                e.tip == TipEntry::Round && e.length_mm <= e.diameter_mm,
                "a round-ended cylinder is longer than it is wide",
            ),
            EndEntry::Tapered(e) => {
                let is_short = e.tip == TipEntry::Round && e.length_mm <= e.diameter_mm;
                (
                    is_short || e.tip_diameter_mm >= e.diameter_mm,
                    "a tapered bur is more slender at its tip, and longer than it is wide if its tip is round",
                )
            }
            EndEntry::InvertedCone(e) => (e.top_diameter_mm >= e.diameter_mm, "an inverted cone is widest at its tip"),
            EndEntry::Flame(e) => (e.length_mm <= e.diameter_mm, "a flame is longer than it is wide"),
        };
        is_wrong.then_some(what)
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
            if matches!(entry.end, EndEntry::Point | EndEntry::Mirror(_)) && entry.cuts {
                let message = format!("\"{}\" cuts with a point or a mirror", entry.id);
                let help = Some("a bur has a width: give its end as { \"ball\": { \"diameter_mm\": … } }".to_string());
                found.push(read.places.complain(&format!("/instruments/{index}/cuts"), "cutting-point", message, help));
            }
        }
        for (index, entry) in entries.iter().enumerate() {
            if let Some(what) = entry.end.contradiction() {
                let message = format!("\"{}\" has no such shape", entry.id);
                let place = format!("/instruments/{index}/end");
                found.push(read.places.complain(&place, "impossible-shape", message, Some(what.to_string())));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::Region;

    fn end(json: &str) -> EndEntry {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn every_shipped_instrument_can_be_made() {
        // Aim: what the table offers has a shape, and burs that are no balls have a shank behind it.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        let mut bodies = 0;
        for id in table.ids() {
            let entry = table.by_id(id).unwrap();
            if let WorkingEnd::Shaped(body) = entry.make().end {
                let shank = body.shell().iter().filter(|n| n.region == Region::Shank).count();
                let head = body.shell().len() - shank;
                let has_shank = shank > 50 || matches!(entry.end, EndEntry::Mirror(_));
                assert!((200..1000).contains(&head) && has_shank, "{id}: {head} and {shank} points");
                bodies += 1;
            }
        }
        assert!(bodies >= 6);
    }

    #[test]
    fn shapes_that_cannot_be_are_seen() {
        let pear =
            |top: f32| end(&format!(r#"{{"pear":{{"diameter_mm":0.8,"length_mm":1.8,"top_diameter_mm":{top}}}}}"#));
        assert!(pear(0.6).contradiction().is_none());
        assert!(pear(0.9).contradiction().is_some());
        assert!(end(r#"{"flame":{"diameter_mm":1.2,"length_mm":1.0}}"#).contradiction().is_some());
        let round = r#"{"cylinder":{"diameter_mm":1.0,"length_mm":0.9,"tip":"round"}}"#;
        assert!(end(round).contradiction().is_some());
    }
}
