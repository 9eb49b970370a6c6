//! The table of instruments.

use super::Library;
use super::hand_ends::{BladeEntry, CleoidEntry, PluggerEntry, SpoonEntry};
use super::json;
use crate::diagnostic::Diagnostic;
use crate::frame::{Pose, Quat, Vec3};
use crate::touch::{Body, EDGE, Instrument, Packs, Profile, Shank, WorkingEnd};
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
    /// Whether it takes matter away: a bur, or a blade such as a carver.
    pub cuts: bool,
    /// Of what kind it is: how tissues feel through it (`content/touch.json`); without it as the table of tissues says.
    #[serde(default)]
    pub kind: Option<ToolKind>,
    /// How many times more it takes than a medium diamond by the rate law of carving, 0.05 to 10; without it 1.
    #[serde(default)]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub grit: Option<f32>,
    /// What it does with a filling, for carriers, condensers and plastic instruments.
    #[serde(default)]
    pub packs: Option<PacksEntry>,
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
    /// Cuts soft decay by hand.
    SpoonExcavator,
    /// Cuts what has not set, by hand: enamel stops it, and so it follows the tooth's contour.
    Carver,
    /// Lays down a filling.
    Carrier,
    /// Presses a filling together.
    Condenser,
    /// Lays down paste and presses it together.
    PlasticInstrument,
}

impl ToolKind {
    /// True for what cuts without turning; it cuts only tissues that `content/touch.json` names for it.
    pub fn is_blade(self) -> bool {
        matches!(self, ToolKind::SpoonExcavator | ToolKind::Carver)
    }

    /// True for what turns.
    fn is_bur(self) -> bool {
        matches!(self, ToolKind::SteelBur | ToolKind::CarbideBur | ToolKind::DiamondBur)
    }
}

/// What an instrument does with the filling that a stage gives.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PacksEntry {
    /// What it lays down while it is pressed, mm³/s: 0 (nothing) to 20.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub mm3_per_s: f32,
    /// Whether it closes voids in what was laid.
    #[serde(default)]
    pub condenses: bool,
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
    /// A flat round face on a slender neck, of a condenser or a carrier.
    Plugger(PluggerEntry),
    /// A shallow bowl with an edge all round, tilted against its shaft: a spoon excavator, or the discoid end of a carver.
    Spoon(SpoonEntry),
    /// A blade that narrows to a rounded point: the cleoid end of a carver.
    Cleoid(CleoidEntry),
    /// A thin blade with rounded edges, of a plastic filling instrument.
    Blade(BladeEntry),
    /// A mouth mirror; the middle of its face is where the hand's tip is.
    Mirror(MirrorEntry),
    /// A periodontal probe: a slim rod with a round end and marks to read depths by.
    Probe(ProbeEntry),
    /// An explorer whose fine end is bent.
    Bent(BentEntry),
}

/// A periodontal probe.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeEntry {
    /// Of its end, mm: 0.3 to 0.7.
    #[schemars(range(min = 0.3, max = 0.7))]
    pub diameter_mm: f32,
    /// True when the end is a ball that is wider than the rod behind it.
    #[serde(default)]
    pub ball: bool,
    /// Lines across the rod, by their distance from the end, mm: 0.5 to 20, rising.
    #[serde(default)]
    #[schemars(length(max = 40))]
    pub marks_mm: Vec<MarkEntry>,
    /// Dark bands, from and to, mm: 0.5 to 20.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub bands_mm: Vec<[MarkEntry; 2]>,
}

/// mm, 0.5 to 20.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct MarkEntry(#[schemars(range(min = 0.5, max = 20.0))] pub f32);

impl ProbeEntry {
    /// What is read off at a depth, whole mm: to the nearest, as between two marks one estimates; not beyond the last mark.
    pub fn read(&self, depth: f32) -> u8 {
        let marks = self.marks_mm.iter().map(|m| m.0).chain(self.bands_mm.iter().map(|[_, to]| to.0));
        let last = marks.fold(0.0, f32::max);
        depth.clamp(0.0, last).round() as u8
    }
}

/// An explorer's end as a line through the middle of its wire.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BentEntry {
    /// From the tip at [0, 0, 0] toward the handle, mm; z along the handle, which begins behind the last point.
    #[schemars(length(min = 2, max = 40))]
    pub wire_mm: Vec<[BendEntry; 3]>,
}

/// mm, -20 to 40.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct BendEntry(#[schemars(range(min = -20.0, max = 40.0))] pub f32);

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
    /// True for what takes matter away by turning.
    pub fn is_bur(&self) -> bool {
        self.cuts && !self.kind.is_some_and(ToolKind::is_blade)
    }

    /// The instrument as touch knows it.
    pub fn make(&self) -> Instrument {
        let made = self.shaped();
        let made = if self.is_bur() { made } else { made.by_hand() };
        match self.packs {
            Some(PacksEntry { mm3_per_s: rate, condenses }) => made.packing(Packs { rate, condenses }),
            None => made,
        }
    }

    fn shaped(&self) -> Instrument {
        let bur = |profile: Profile, top: f32| {
            let [_, length] = profile.span();
            Instrument::shaped(Body::turned(profile, Some(Shank::friction_grip(top, length))), self.cuts)
        };
        match &self.end {
            EndEntry::Point | EndEntry::Bent(_) => Instrument::new(WorkingEnd::Point, self.cuts),
            // What is behind a probe's end slips between gum and tooth as it likes: a hand's tip without a direction could not lean it.
            EndEntry::Probe(probe) => Instrument::new(WorkingEnd::Ball { radius: 0.5 * probe.diameter_mm }, self.cuts),
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
            EndEntry::Plugger(e) => Instrument::shaped(e.body(), self.cuts),
            EndEntry::Spoon(e) => Instrument::shaped(e.body(), self.cuts),
            EndEntry::Cleoid(e) => Instrument::shaped(e.body(), self.cuts),
            EndEntry::Blade(e) => Instrument::shaped(e.body(), self.cuts),
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
            EndEntry::Point | EndEntry::Ball(_) | EndEntry::Mirror(_) | EndEntry::Plugger(_) => return None,
            EndEntry::Spoon(e) => (2.0 * e.thickness_mm > e.diameter_mm, "a spoon is at least twice as wide as thick"),
            EndEntry::Cleoid(e) => (
                e.point_mm >= e.width_mm || e.length_mm <= 0.5 * e.width_mm,
                "a cleoid is narrower at its point than at its widest, and longer than half its width",
            ),
            EndEntry::Blade(e) => (e.thickness_mm >= e.width_mm, "a blade is wider than thick"),
            EndEntry::Probe(probe) => (
                probe.marks_mm.is_empty() && probe.bands_mm.is_empty()
                    || probe.marks_mm.windows(2).any(|pair| pair[0].0 >= pair[1].0)
                    || probe.bands_mm.iter().any(|[from, to]| from.0 >= to.0),
                "a probe has marks or bands, each farther from its end than the one before",
            ),
            EndEntry::Bent(bent) => {
                (bent.wire_mm[0].iter().any(|c| c.0 != 0.0), "a wire begins with its tip at [0, 0, 0]")
            }
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
        InstrumentTable { entries: Vec::new() }.and_of(library, Self::NAME)
    }

    /// The table with the instruments of a further file, such as a school's own.
    pub fn and_of(self, library: &Library, name: &str) -> Result<InstrumentTable, Vec<Diagnostic>> {
        let source = library.text(name).map_err(|e| vec![e])?;
        let read = json::read::<InstrumentFile>(source)?;
        let known = self.entries;
        let entries = read.value.instruments;
        let mut found = Vec::new();
        for (index, entry) in entries.iter().enumerate() {
            if known.iter().chain(&entries[..index]).any(|e| e.id == entry.id) {
                let message = format!("there is already an instrument \"{}\"", entry.id);
                found.push(read.places.complain(&format!("/instruments/{index}/id"), "duplicate-id", message, None));
            }
            if entry.kind.is_some_and(|kind| (kind.is_bur() || kind.is_blade()) != entry.cuts) {
                let message = format!("\"{}\" does not cut as its kind does", entry.id);
                let help = "burs, spoon excavators and carvers cut; explorers, carriers, condensers and plastic instruments do not";
                let help = Some(help.to_string());
                found.push(read.places.complain(&format!("/instruments/{index}/kind"), "wrong-kind", message, help));
            }
            let is_packer =
                |kind| matches!(kind, ToolKind::Carrier | ToolKind::Condenser | ToolKind::PlasticInstrument);
            if entry.kind.is_some_and(is_packer) != entry.packs.is_some() {
                let message = format!("\"{}\" does not pack as its kind does", entry.id);
                let help = "carriers, condensers and plastic instruments have \"packs\", and nothing else has";
                let place = format!("/instruments/{index}/packs");
                found.push(read.places.complain(&place, "wrong-kind", message, Some(help.to_string())));
            }
            if entry.packs.is_some_and(|p| p.mm3_per_s == 0.0 && !p.condenses) {
                let message = format!("\"{}\" neither lays nor condenses", entry.id);
                let help = "give \"mm3_per_s\", or \"condenses\": true".to_string();
                found.push(read.places.complain(
                    &format!("/instruments/{index}/packs"),
                    "idle-packs",
                    message,
                    Some(help),
                ));
            }
            if entry.packs.is_some() && !matches!(entry.end, EndEntry::Plugger(_) | EndEntry::Blade(_)) {
                let message = format!("\"{}\" has no face to press with", entry.id);
                let help = "give its end as { \"plugger\": { \"diameter_mm\": … } } or as a blade".to_string();
                found.push(read.places.complain(&format!("/instruments/{index}/end"), "no-face", message, Some(help)));
            }
            let is_blunt = matches!(entry.end, EndEntry::Mirror(_) | EndEntry::Probe(_));
            if (is_blunt || matches!(entry.end, EndEntry::Point | EndEntry::Bent(_))) && entry.cuts {
                let message = format!("\"{}\" cuts with a point, a probe or a mirror", entry.id);
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
        let entries = known.into_iter().chain(entries).collect();
        if found.is_empty() { Ok(InstrumentTable { entries }) } else { Err(found) }
    }

    /// In the order of the table.
    pub fn entries(&self) -> &[InstrumentEntry] {
        &self.entries
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
