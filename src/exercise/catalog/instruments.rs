//! The table of instruments.

use crate::catalog::hand_instruments::{BladeEntry, CleoidEntry, PluggerEntry, SpoonEntry};
use crate::catalog::shape::ShapeEntry;
use crate::local_text::LocalText;
use schemars::JsonSchema;
use serde::Deserialize;
use std::f32::consts::FRAC_PI_4;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{Body, EDGE_RADIUS, Instrument, PackingTip, Profile, Shank, WorkingEnd};
use typodont_core::volume::{Grid, Label, Volume};
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json;

/// An instrument of `content/instruments.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstrumentEntry {
    /// Name by which scenarios refer to the instrument: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Name shown to users.
    #[schemars(length(min = 1, max = 80))]
    pub title: LocalText,
    /// Working end: the part that touches.
    pub end: WorkingEndEntry,
    /// True for an instrument that removes material: a bur, or a blade such as a carver.
    pub cuts: bool,
    /// Kind of instrument, which determines the tactile properties of tissues (`content/touch.json`). If omitted,
    /// tissues have the properties given in their table.
    #[serde(default)]
    pub kind: Option<ToolKind>,
    /// Factor by which the instrument removes more than a medium-grit diamond under the rate law of cutting, 0.05 to
    /// 10; 1 if omitted.
    #[serde(default)]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub grit: Option<f32>,
    /// Action on filling material, for carriers, condensers and plastic instruments.
    #[serde(default)]
    pub packs: Option<PackingActionEntry>,
    /// ISO 6360 number: material, shank, shape, grit, and greatest diameter in tenths of a millimetre.
    #[serde(default)]
    pub iso_6360: Option<String>,
    /// US number of the bur.
    #[serde(default)]
    pub us_number: Option<String>,
    /// Picture of the instrument: an .obj, .glb or .gltf file in millimetres, with the tip of the working end at the
    /// origin and +z along the shaft toward the handle. It is for display only; touch uses `end`. If it is omitted or
    /// cannot be read, the outline of the working end is drawn. An instrument with a `shape` must not have it.
    #[serde(default)]
    #[schemars(length(min = 1, max = 200))]
    pub mesh: Option<String>,
}

/// Kinds of instruments, which differ in tactile properties and cutting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolKind {
    SteelExplorer,
    SteelBur,
    CarbideBur,
    DiamondBur,
    /// Hand instrument that cuts soft decay.
    SpoonExcavator,
    /// Hand instrument that cuts filling material before it has set. Enamel stops it, so that it follows the tooth's
    /// contour.
    Carver,
    /// Instrument that places filling material.
    Carrier,
    /// Instrument that condenses filling material.
    Condenser,
    /// Instrument that places and condenses a paste.
    PlasticInstrument,
}

impl ToolKind {
    /// Returns true for an instrument that cuts without rotating. It cuts only tissues that `content/touch.json` lists
    /// for it.
    pub fn is_blade(self) -> bool {
        matches!(self, ToolKind::SpoonExcavator | ToolKind::Carver)
    }

    /// Returns true for an instrument that rotates.
    fn is_bur(self) -> bool {
        matches!(self, ToolKind::SteelBur | ToolKind::CarbideBur | ToolKind::DiamondBur)
    }
}

/// Action of an instrument on the filling material of a stage.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PackingActionEntry {
    /// Rate at which material is placed while the instrument is pressed, mm³/s: 0 (none) to 20.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub mm3_per_s: f32,
    /// True for an instrument that closes voids in the placed material.
    #[serde(default)]
    pub condenses: bool,
}

/// Shape of a working end.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WorkingEndEntry {
    /// A tip without measurable width.
    Point,
    Ball(BallEntry),
    /// A ball followed by a cone that narrows toward the neck.
    Pear(PearEntry),
    /// A straight fissure bur.
    Cylinder(CylinderEntry),
    /// A fissure bur that tapers toward its tip.
    Tapered(TaperedEntry),
    /// A cone that is widest at its flat tip.
    InvertedCone(InvertedConeEntry),
    /// A flame shape: slender at the tip and the neck, widest in the middle.
    Flame(FlameEntry),
    /// A flat round face on a slender neck: a condenser or a carrier.
    Plugger(PluggerEntry),
    /// A shallow bowl with an edge all around, tilted against its shaft: a spoon excavator, or the discoid end of a
    /// carver.
    Spoon(SpoonEntry),
    /// A blade that narrows to a rounded point: the cleoid end of a carver.
    Cleoid(CleoidEntry),
    /// A thin blade with rounded edges: a plastic filling instrument.
    Blade(BladeEntry),
    /// A mouth mirror. The centre of its face is at the device's tip.
    Mirror(MirrorEntry),
    /// A periodontal probe: a slender rod with a rounded end and marks for reading depths.
    Probe(ProbeEntry),
    /// An explorer with a bent fine end.
    Bent(BentExplorerEntry),
    /// Any shape, from a file: a hook, a ring, a scanned instrument.
    Shape(ShapeEntry),
}

/// A periodontal probe.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeEntry {
    /// Diameter of the end, mm: 0.3 to 0.7.
    #[schemars(range(min = 0.3, max = 0.7))]
    pub diameter_mm: f32,
    /// True for an end with a ball that is wider than the rod behind it.
    #[serde(default)]
    pub ball: bool,
    /// Marks across the rod, by their distances from the end, mm: 0.5 to 20, in ascending order.
    #[serde(default)]
    #[schemars(length(max = 40))]
    pub marks_mm: Vec<MarkEntry>,
    /// Dark bands, each by the distances of its two borders from the end, mm: 0.5 to 20.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub bands_mm: Vec<[MarkEntry; 2]>,
}

/// Distance from the end, mm: 0.5 to 20.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct MarkEntry(#[schemars(range(min = 0.5, max = 20.0))] pub f32);

impl ProbeEntry {
    /// Returns the reading at a depth (mm), rounded to whole mm, as estimated between two marks; at most the depth of
    /// the last mark.
    pub fn reading_at(&self, depth: f32) -> u8 {
        let marks = self.marks_mm.iter().map(|m| m.0).chain(self.bands_mm.iter().map(|[_, to]| to.0));
        let last = marks.fold(0.0, f32::max);
        depth.clamp(0.0, last).round() as u8
    }
}

/// The end of an explorer, as the centre line of its wire.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BentExplorerEntry {
    /// Points from the tip at [0, 0, 0] toward the handle, mm. The z axis points along the handle, which begins behind
    /// the last point.
    #[schemars(length(min = 2, max = 40))]
    pub wire_mm: Vec<[WireCoordinateEntry; 3]>,
}

impl BentExplorerEntry {
    /// Returns the wire for display as points of its centre line with the radius there, mm: its bends rounded (Catmull
    /// and Rom's spline), from the fine tip to the end of the shank, where the handle begins.
    pub fn rings(&self) -> Vec<(Vec3, f32)> {
        /// Radius at the tip, radius of the shank, and length over which one becomes the other, mm.
        const FINE: f32 = 0.07;
        const GROWS: f32 = 16.0;
        /// Distance between two rings, mm.
        const STEP: f32 = 0.4;
        let corners: Vec<Vec3> = self.wire_mm.iter().map(|p| Vec3::from(p.map(|c| c.0))).collect();
        let line = catmull_rom(&corners, STEP);
        let mut length = 0.0;
        let mut before = line.first().copied().unwrap_or_default();
        let ring = |at: Vec3| {
            length += before.distance(at);
            before = at;
            (at, FINE + (Self::SHANK_RADIUS - FINE) * (length / GROWS).clamp(0.0, 1.0))
        };
        line.into_iter().map(ring).collect()
    }

    /// Radius of an explorer's shank, mm.
    pub const SHANK_RADIUS: f32 = 0.75;
}

/// Returns a line through corners with its bends rounded (Catmull and Rom's spline), in steps of at most `step` mm.
pub fn catmull_rom(corners: &[Vec3], step: f32) -> Vec<Vec3> {
    let at = |i: isize| corners[i.clamp(0, corners.len() as isize - 1) as usize];
    let mut line = Vec::new();
    for i in 0..corners.len() as isize - 1 {
        let [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
        let steps = (b.distance(c) / step).ceil().max(1.0) as usize;
        line.extend((0..steps).map(|s| {
            let t = s as f32 / steps as f32;
            let slope = (c - a) * t + (a * 2.0 - b * 5.0 + c * 4.0 - d) * (t * t);
            b + (slope + (b * 3.0 - a - c * 3.0 + d) * (t * t * t)) * 0.5
        }));
    }
    line.extend(corners.last());
    line
}

/// Coordinate, mm: -20 to 40.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct WireCoordinateEntry(#[schemars(range(min = -20.0, max = 40.0))] pub f32);

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorEntry {
    /// Diameter of the face, mm: 14 to 30. A no. 4 mirror has 22, a no. 5 mirror 24.
    #[schemars(range(min = 14.0, max = 30.0))]
    pub diameter_mm: f32,
}

impl MirrorEntry {
    /// Thickness of a mirror behind its face, mm.
    pub const THICKNESS: f32 = 1.6;

    /// Returns the pose of the face in handle space. The face reflects toward its own +z, which is inclined by 45° to
    /// the shaft's direction toward the handle.
    pub fn handle_from_face(&self) -> Pose {
        Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_y(FRAC_PI_4) }
    }

    /// Returns the point at which the shaft joins the rim, handle space, mm.
    pub fn foot(&self) -> Vec3 {
        self.handle_from_face() * Vec3::new(-0.5 * self.diameter_mm, 0.0, -0.5 * Self::THICKNESS)
    }

    /// Returns the shape used for touch: the head, and the part of the shaft that enters a mouth.
    fn body(&self) -> Body {
        /// Length and radius of the shaft, radius of the rim's rounding, and voxel size, mm.
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

/// Tip of a fissure bur.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum TipEntry {
    /// A flat tip with an edge.
    #[default]
    Flat,
    /// A hemispherical tip.
    Round,
}

/// Radius of a flame's tip, mm. A sharper tip would catch in every irregularity of a voxel surface.
const FLAME_TIP: f32 = 0.1;

impl InstrumentEntry {
    /// Returns true for an instrument that cuts by rotation.
    pub fn is_bur(&self) -> bool {
        self.cuts && !self.kind.is_some_and(ToolKind::is_blade)
    }

    /// Returns the names of the files that the entry names: its picture, or its shape.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let shape = if let WorkingEndEntry::Shape(shape) = &self.end { Some(shape) } else { None };
        self.mesh.as_deref().into_iter().chain(shape.into_iter().flat_map(ShapeEntry::files))
    }

    /// Returns the instrument in the form used by the simulation of touch. A shape from a file that has not been read is
    /// a point.
    pub fn to_instrument(&self) -> Instrument {
        let made = self.with_working_end();
        let made = if self.is_bur() { made } else { made.non_rotary() };
        match self.packs {
            Some(PackingActionEntry { mm3_per_s: rate, condenses }) => {
                made.with_packing_tip(PackingTip { rate, condenses })
            }
            None => made,
        }
    }

    fn with_working_end(&self) -> Instrument {
        let revolved =
            |(profile, shank): (Profile, Shank)| Instrument::with_body(Body::revolved(profile, Some(shank)), self.cuts);
        match &self.end {
            WorkingEndEntry::Point | WorkingEndEntry::Bent(_) => Instrument::new(WorkingEnd::Point, self.cuts),
            // The rod behind the end of a probe is not simulated: it passes freely between gingiva and tooth, since a
            // device without orientation could not tilt it.
            WorkingEndEntry::Probe(probe) => {
                Instrument::new(WorkingEnd::Ball { radius: 0.5 * probe.diameter_mm }, self.cuts)
            }
            WorkingEndEntry::Ball(ball) => {
                Instrument::new(WorkingEnd::Ball { radius: 0.5 * ball.diameter_mm }, self.cuts)
            }
            WorkingEndEntry::Pear(e) => revolved(e.profile()),
            WorkingEndEntry::Cylinder(e) => revolved(e.profile()),
            WorkingEndEntry::Tapered(e) => revolved(e.profile()),
            WorkingEndEntry::InvertedCone(e) => revolved(e.profile()),
            WorkingEndEntry::Flame(e) => revolved(e.profile()),
            WorkingEndEntry::Mirror(mirror) => Instrument::with_body(mirror.body(), self.cuts),
            WorkingEndEntry::Plugger(e) => revolved(e.profile()),
            WorkingEndEntry::Spoon(e) => Instrument::with_body(e.body(), self.cuts),
            WorkingEndEntry::Cleoid(e) => revolved(e.profile()),
            WorkingEndEntry::Blade(e) => Instrument::with_body(e.body(), self.cuts),
            WorkingEndEntry::Shape(shape) => {
                let body = shape.sampled.as_ref().map(|end| WorkingEnd::Body(end.body.clone()));
                Instrument::new(body.unwrap_or(WorkingEnd::Point), self.cuts)
            }
        }
    }
}

impl BallEntry {
    /// Returns the outline of the ball, whose centre is at the device's tip, and the shank behind it, which is only
    /// drawn.
    fn profile(&self) -> (Profile, Shank) {
        /// Diameter of the neck at the ball, as a share of the ball's.
        const NECK_SHARE: f32 = 0.6;
        let radius = 0.5 * self.diameter_mm;
        (Profile::ball(radius, -radius), Shank::friction_grip(NECK_SHARE * self.diameter_mm, radius))
    }
}

impl PearEntry {
    fn profile(&self) -> (Profile, Shank) {
        let profile = Profile::round_ended(0.5 * self.diameter_mm, 0.5 * self.top_diameter_mm, self.length_mm);
        behind(profile, self.top_diameter_mm)
    }
}

impl CylinderEntry {
    fn profile(&self) -> (Profile, Shank) {
        behind(fissure(self.diameter_mm, self.diameter_mm, self.length_mm, self.tip), self.diameter_mm)
    }
}

impl TaperedEntry {
    fn profile(&self) -> (Profile, Shank) {
        behind(fissure(self.tip_diameter_mm, self.diameter_mm, self.length_mm, self.tip), self.diameter_mm)
    }
}

impl InvertedConeEntry {
    fn profile(&self) -> (Profile, Shank) {
        let profile = fissure(self.diameter_mm, self.top_diameter_mm, self.length_mm, TipEntry::Flat);
        behind(profile, self.top_diameter_mm)
    }
}

impl FlameEntry {
    fn profile(&self) -> (Profile, Shank) {
        behind(Profile::flame(0.5 * self.diameter_mm, self.length_mm, FLAME_TIP), 2.0 * FLAME_TIP)
    }
}

/// Returns a bur's profile with the shank behind it; `top` is the diameter at the top of the cutting part, mm.
fn behind(profile: Profile, top: f32) -> (Profile, Shank) {
    let [_, length] = profile.span();
    (profile, Shank::friction_grip(top, length))
}

fn fissure(tip_diameter: f32, top_diameter: f32, length: f32, tip: TipEntry) -> Profile {
    let (low, high) = (0.5 * tip_diameter, 0.5 * top_diameter);
    match tip {
        TipEntry::Flat => Profile::frustum(low, high, length, [EDGE_RADIUS; 2]),
        TipEntry::Round => Profile::round_ended(low, high, length),
    }
}

impl WorkingEndEntry {
    /// Returns the profile of a working end and the shank behind it, in handle space with its z along the shaft; `None`
    /// for an end that is not a body of revolution, for a point and for a probe.
    pub fn profile(&self) -> Option<(Profile, Shank)> {
        match self {
            WorkingEndEntry::Ball(e) => Some(e.profile()),
            WorkingEndEntry::Pear(e) => Some(e.profile()),
            WorkingEndEntry::Cylinder(e) => Some(e.profile()),
            WorkingEndEntry::Tapered(e) => Some(e.profile()),
            WorkingEndEntry::InvertedCone(e) => Some(e.profile()),
            WorkingEndEntry::Flame(e) => Some(e.profile()),
            WorkingEndEntry::Plugger(e) => Some(e.profile()),
            WorkingEndEntry::Cleoid(e) => Some(e.profile()),
            WorkingEndEntry::Point
            | WorkingEndEntry::Spoon(_)
            | WorkingEndEntry::Blade(_)
            | WorkingEndEntry::Mirror(_)
            | WorkingEndEntry::Probe(_)
            | WorkingEndEntry::Bent(_)
            | WorkingEndEntry::Shape(_) => None,
        }
    }

    /// Returns the rule that a shape violates although each of its lengths is in range; `None` for a possible shape.
    fn contradiction(&self) -> Option<&'static str> {
        let (is_wrong, what) = match self {
            WorkingEndEntry::Point
            | WorkingEndEntry::Ball(_)
            | WorkingEndEntry::Mirror(_)
            | WorkingEndEntry::Plugger(_)
            | WorkingEndEntry::Shape(_) => return None,
            WorkingEndEntry::Spoon(e) => {
                (2.0 * e.thickness_mm > e.diameter_mm, "a spoon must be at least twice as wide as it is thick")
            }
            WorkingEndEntry::Cleoid(e) => (
                e.point_mm >= e.width_mm || e.length_mm <= 0.5 * e.width_mm,
                "a cleoid must be narrower at its point than at its widest part, and longer than half its width",
            ),
            WorkingEndEntry::Blade(e) => (e.thickness_mm >= e.width_mm, "a blade must be wider than it is thick"),
            WorkingEndEntry::Probe(probe) => (
                probe.marks_mm.is_empty() && probe.bands_mm.is_empty()
                    || probe.marks_mm.windows(2).any(|pair| pair[0].0 >= pair[1].0)
                    || probe.bands_mm.iter().any(|[from, to]| from.0 >= to.0),
                "a probe must have marks or bands, each farther from its end than the previous one",
            ),
            WorkingEndEntry::Bent(bent) => {
                (bent.wire_mm[0].iter().any(|c| c.0 != 0.0), "the first point of a wire must be its tip at [0, 0, 0]")
            }
            WorkingEndEntry::Pear(e) => (
                e.length_mm <= e.diameter_mm || e.top_diameter_mm >= e.diameter_mm,
                "a pear must be longer than it is wide, and wider at its tip than at its top",
            ),
            WorkingEndEntry::Cylinder(e) => (
                e.tip == TipEntry::Round && e.length_mm <= e.diameter_mm,
                "a round-ended cylinder must be longer than it is wide",
            ),
            WorkingEndEntry::Tapered(e) => {
                let is_short = e.tip == TipEntry::Round && e.length_mm <= e.diameter_mm;
                (
                    is_short || e.tip_diameter_mm >= e.diameter_mm,
                    "a tapered bur must be narrower at its tip and, if the tip is round, longer than it is wide",
                )
            }
            WorkingEndEntry::InvertedCone(e) => {
                (e.top_diameter_mm >= e.diameter_mm, "an inverted cone must be widest at its tip")
            }
            WorkingEndEntry::Flame(e) => (e.length_mm <= e.diameter_mm, "a flame must be longer than it is wide"),
        };
        is_wrong.then_some(what)
    }
}

/// File form of `content/instruments.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct InstrumentFile {
    #[schemars(length(min = 1, max = 500))]
    instruments: Vec<InstrumentEntry>,
}

/// Rule for the keys of an instrument that the schema cannot express.
struct EntryRule {
    is_broken_by: fn(&InstrumentEntry) -> bool,
    /// Key of the entry at which the diagnostic is placed.
    key: &'static str,
    /// Code of the diagnostic.
    code: &'static str,
    /// Message of the diagnostic, with the instrument's id in place of `{id}`.
    message: &'static str,
    help: &'static str,
}

/// Rules for every instrument, in the order of their diagnostics.
const ENTRY_RULES: [EntryRule; 7] = [
    EntryRule {
        is_broken_by: |entry| entry.kind.is_some_and(|kind| (kind.is_bur() || kind.is_blade()) != entry.cuts),
        key: "kind",
        code: "wrong-kind",
        message: "\"cuts\" of \"{id}\" does not agree with its kind",
        help: "burs, spoon excavators and carvers cut; explorers, carriers, condensers and plastic instruments do not",
    },
    EntryRule {
        is_broken_by: |entry| entry.kind.is_some_and(is_packer) != entry.packs.is_some(),
        key: "packs",
        code: "wrong-kind",
        message: "\"packs\" of \"{id}\" does not agree with its kind",
        help: "carriers, condensers and plastic instruments require \"packs\"; other instruments must not have it",
    },
    EntryRule {
        is_broken_by: |entry| entry.packs.is_some_and(|p| p.mm3_per_s == 0.0 && !p.condenses),
        key: "packs",
        code: "idle-packs",
        message: "\"{id}\" neither places nor condenses material",
        help: "give \"mm3_per_s\", or \"condenses\": true",
    },
    EntryRule {
        is_broken_by: |entry| {
            entry.packs.is_some() && !matches!(entry.end, WorkingEndEntry::Plugger(_) | WorkingEndEntry::Blade(_))
        },
        key: "end",
        code: "no-face",
        message: "\"{id}\" has no face to press material with",
        help: "give its end as { \"plugger\": { \"diameter_mm\": … } } or as a blade",
    },
    EntryRule {
        is_broken_by: |entry| entry.cuts && is_blunt(&entry.end),
        key: "cuts",
        code: "cutting-point",
        message: "\"{id}\" cuts, but its end is a point, a probe or a mirror",
        help: "give the end of a bur with its width, as in { \"ball\": { \"diameter_mm\": … } }",
    },
    EntryRule {
        is_broken_by: |entry| {
            !entry.cuts && matches!(&entry.end, WorkingEndEntry::Shape(ShapeEntry { cutting: Some(_), .. }))
        },
        key: "end",
        code: "idle-cutting",
        message: "\"{id}\" has a cutting part, but does not cut",
        help: "remove \"cutting\" from its shape, or set \"cuts\": true",
    },
    EntryRule {
        is_broken_by: |entry| entry.mesh.is_some() && matches!(entry.end, WorkingEndEntry::Shape(_)),
        key: "mesh",
        code: "two-pictures",
        message: "\"{id}\" has a picture in addition to its shape",
        help: "remove \"mesh\": an instrument with a shape is drawn as it is felt",
    },
];

/// Returns true for a kind of instrument that places or condenses a filling material.
fn is_packer(kind: ToolKind) -> bool {
    matches!(kind, ToolKind::Carrier | ToolKind::Condenser | ToolKind::PlasticInstrument)
}

/// Returns true for a working end without a cutting edge.
fn is_blunt(end: &WorkingEndEntry) -> bool {
    matches!(
        end,
        WorkingEndEntry::Mirror(_) | WorkingEndEntry::Probe(_) | WorkingEndEntry::Point | WorkingEndEntry::Bent(_)
    )
}

/// All instruments available to a session.
#[derive(Clone, Debug)]
pub struct InstrumentTable {
    entries: Vec<InstrumentEntry>,
}

impl InstrumentTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/instruments.json";

    /// Reads the table of `content/instruments.json`.
    ///
    /// # Errors
    /// Returns diagnostics if the file is missing or invalid, or if entries contradict each other or themselves.
    pub fn read(library: &Library) -> Result<InstrumentTable, Vec<Diagnostic>> {
        InstrumentTable { entries: Vec::new() }.extended_with(library, Self::NAME)
    }

    /// Returns the table extended by the instruments of another file, such as a school's own.
    ///
    /// # Errors
    /// Returns diagnostics if the file is missing or invalid, if an id is already in use, or if an entry contradicts
    /// itself.
    pub fn extended_with(self, library: &Library, name: &str) -> Result<InstrumentTable, Vec<Diagnostic>> {
        let source = library.text(name).map_err(|e| vec![e])?;
        let read = json::read::<InstrumentFile>(source)?;
        let known = self.entries;
        let entries = read.value.instruments;
        let mut found = Vec::new();
        for (index, entry) in entries.iter().enumerate() {
            if known.iter().chain(&entries[..index]).any(|e| e.id == entry.id) {
                let message = format!("the id \"{}\" belongs to another instrument already", entry.id);
                found.push(read.source_map.complain(
                    &format!("/instruments/{index}/id"),
                    "duplicate-id",
                    message,
                    None,
                ));
            }
            let broken = ENTRY_RULES.iter().filter(|rule| (rule.is_broken_by)(entry));
            found.extend(broken.map(|rule| {
                let message = rule.message.replace("{id}", &entry.id);
                let place = format!("/instruments/{index}/{}", rule.key);
                read.source_map.complain(&place, rule.code, message, Some(rule.help.to_string()))
            }));
        }
        for (index, entry) in entries.iter().enumerate() {
            if let Some(what) = entry.end.contradiction() {
                let message = format!("the shape of \"{}\" is not possible", entry.id);
                let place = format!("/instruments/{index}/end");
                found.push(read.source_map.complain(&place, "impossible-shape", message, Some(what.to_string())));
            }
        }
        let entries = known.into_iter().chain(entries).collect();
        if found.is_empty() { Ok(InstrumentTable { entries }) } else { Err(found) }
    }

    /// Returns the entries in the order of the table.
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
    use typodont_core::touch::BodyRegion;

    fn end(json: &str) -> WorkingEndEntry {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn every_shipped_instrument_can_be_made() {
        // Aim: what the table offers has a shape, and burs that are no balls have a shank behind it.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        let mut bodies = 0;
        for id in table.ids() {
            let entry = table.by_id(id).unwrap();
            if let WorkingEnd::Body(body) = entry.to_instrument().end {
                let shank = body.surface_points().iter().filter(|n| n.region == BodyRegion::Shank).count();
                let head = body.surface_points().len() - shank;
                let has_shank = shank > 50 || matches!(entry.end, WorkingEndEntry::Mirror(_));
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
