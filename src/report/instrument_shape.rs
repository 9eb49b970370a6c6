//! Shape of an instrument as a page draws it.
//!
//! Takes an entry of the catalogue. Gives few numbers, of which the page's script makes meshes: outlines that are
//! turned about an axis, and wires. Never used for touch.

use serde::Serialize;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{Profile, ProfilePoint, Shank};
use typodont_exercise::catalog::{
    BentExplorerEntry, BladeEntry, InstrumentEntry, MirrorEntry, ProbeEntry, SpoonEntry, ToolKind, WorkingEndEntry,
};

/// Greatest distance between a profile and its outline, mm. Less than a pixel of a page shows.
const SAG: f32 = 0.008;

/// Length that is drawn of the shaft behind the neck, mm; the page fades its end out, so that no handpiece hides the
/// tooth.
const SHAFT_LENGTH: f32 = 12.0;

/// Radius of the handle of an explorer or a probe, mm.
const HANDLE_RADIUS: f32 = 2.8;

/// Surface of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PartSurface {
    Steel,
    /// The working end, where it does not cut.
    End,
    /// A cutting part without flutes or grit: the edge of a hand instrument.
    Edge,
    /// The fluted head of a carbide or steel bur.
    Flutes,
    /// The head of a diamond bur.
    Grit,
    /// A mark of a probe.
    Mark,
    /// The face of a mirror.
    Glass,
}

/// Part of an instrument; handle space, mm: the device's tip at the origin and z along the shaft toward the hand.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum InstrumentPart {
    Lathe(LathePart),
    Wire(WirePart),
}

/// An outline turned about the z axis of the part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LathePart {
    pub surface: PartSurface,
    /// Radius and height, from the lowest point upward.
    pub outline: Vec<[f32; 2]>,
    /// Corners of a cross-section; 4 makes a box.
    pub sides: u8,
    /// Factors along x, y and z, before the pose.
    pub scale: [f32; 3],
    /// Position of the part.
    pub at: [f32; 3],
    /// Orientation of the part: quaternion x, y, z, w.
    pub turn: [f32; 4],
}

/// A tube along a centre line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WirePart {
    pub surface: PartSurface,
    /// x, y, z and radius of each ring.
    pub rings: Vec<[f32; 4]>,
}

/// Corners of a round cross-section.
const ROUND: u8 = 28;

/// Returns the parts of an instrument.
pub fn instrument_parts(entry: &InstrumentEntry) -> Vec<InstrumentPart> {
    if let Some((profile, shank)) = entry.end.profile() {
        return revolved_parts(&profile, shank, end_surface(entry));
    }
    match &entry.end {
        WorkingEndEntry::Probe(probe) => probe_parts(probe),
        WorkingEndEntry::Mirror(mirror) => mirror_parts(mirror),
        WorkingEndEntry::Bent(wire) => explorer_parts(wire),
        WorkingEndEntry::Spoon(spoon) => spoon_parts(spoon),
        WorkingEndEntry::Blade(blade) => blade_parts(blade),
        // A straight explorer; every other end has a profile.
        _ => lathes([lathe(PartSurface::Steel, &[[0.0, 0.0], [0.12, 0.6], [0.5, 8.0], [1.0, 14.0], [1.0, 24.0]])]),
    }
}

fn lathes(parts: impl IntoIterator<Item = LathePart>) -> Vec<InstrumentPart> {
    parts.into_iter().map(InstrumentPart::Lathe).collect()
}

fn end_surface(entry: &InstrumentEntry) -> PartSurface {
    let is_diamond = entry.kind == Some(ToolKind::DiamondBur);
    match (entry.cuts, entry.is_bur()) {
        (false, _) => PartSurface::End,
        (true, false) => PartSurface::Edge,
        (true, true) if is_diamond => PartSurface::Grit,
        (true, true) => PartSurface::Flutes,
    }
}

/// A head of revolution with its neck and shank.
fn revolved_parts(profile: &Profile, shank: Shank, surface: PartSurface) -> Vec<InstrumentPart> {
    let [_, top] = profile.span();
    let head: Vec<[f32; 2]> = profile.outline(SAG).iter().map(|&ProfilePoint { r, z }| [r, z]).collect();
    // A neck leaves a ball where the ball is as wide as the neck, and a flat top in its middle.
    let neck = 0.5 * shank.neck;
    let leaves = head.iter().rev().find(|[r, _]| *r >= neck).map_or(top, |[_, z]| *z);
    lathes([lathe(surface, &head), shaft(neck, leaves, &shank)])
}

/// The neck and the shaft behind a working end, up to where the picture fades out.
fn shaft(neck: f32, from: f32, shank: &Shank) -> LathePart {
    let radius = 0.5 * shank.diameter;
    lathe(PartSurface::Steel, &[[neck, from], [radius, shank.begins], [radius, shank.begins + SHAFT_LENGTH]])
}

/// A rod that is dark where its marks and bands are.
fn probe_parts(probe: &ProbeEntry) -> Vec<InstrumentPart> {
    /// Breadth of a mark, and length over which a probe is slim, mm.
    const LINE: f32 = 0.14;
    const SLIM: f32 = 16.0;
    let end = 0.5 * probe.diameter_mm;
    let neck = if probe.ball { 0.6 * end } else { 0.9 * end };
    let radius_at = |height: f32| neck + (0.42 - neck).max(0.0) * (height / SLIM).clamp(0.0, 1.0);
    let lines = probe.marks_mm.iter().map(|m| [m.0 - 0.5 * LINE, m.0 + 0.5 * LINE]);
    let dark: Vec<[f32; 2]> = lines.chain(probe.bands_mm.iter().map(|b| b.map(|m| m.0))).collect();
    // Heights count from the lowest point of the end, which lies its radius below the origin.
    let tip = Profile::ball(end, -end).outline(SAG);
    let first = tip.iter().rev().find(|p| p.r >= neck).map_or(0.0, |p| p.z) + end;
    let mut heights: Vec<f32> = dark.iter().flatten().copied().chain([first, SLIM]).collect();
    heights.retain(|height| (first..=SLIM).contains(height));
    heights.sort_by(f32::total_cmp);
    heights.dedup();
    let is_dark = |middle: f32| dark.iter().any(|[from, to]| (*from..=*to).contains(&middle));
    let stretch = |pair: &[f32]| {
        let surface = if is_dark(0.5 * (pair[0] + pair[1])) { PartSurface::Mark } else { PartSurface::Steel };
        lathe(surface, &[pair[0], pair[1]].map(|height| [radius_at(height), height - end]))
    };
    let tip: Vec<[f32; 2]> = tip.iter().map(|p| [p.r, p.z]).collect();
    let behind = [[0.42, SLIM - end], [0.9, SLIM + 5.0], [1.1, SLIM + 9.0], [HANDLE_RADIUS, SLIM + 14.0]];
    let mut parts = vec![lathe(PartSurface::Steel, &tip)];
    parts.extend(heights.windows(2).map(stretch));
    parts.push(lathe(PartSurface::Steel, &behind));
    lathes(parts)
}

/// A mouth mirror: rim, glass and shaft.
fn mirror_parts(mirror: &MirrorEntry) -> Vec<InstrumentPart> {
    /// Breadth of the rim, mm.
    const RIM: f32 = 0.4;
    let (radius, back) = (0.5 * mirror.diameter_mm, -MirrorEntry::THICKNESS);
    let head = [[0.0, back], [radius - 0.8, back], [radius, back + 0.5], [radius, 0.0], [radius - RIM, 0.0]];
    let face = mirror.handle_from_face();
    let shaft = lathe(PartSurface::Steel, &[[0.0, -0.6], [1.0, -0.4], [1.1, SHAFT_LENGTH]]);
    lathes([
        lathe(PartSurface::Steel, &head).placed(face),
        lathe(PartSurface::Glass, &[[radius - RIM, -0.02], [0.0, -0.02]]).placed(face),
        shaft.placed(Pose::at(mirror.foot())),
    ])
}

fn explorer_parts(wire: &BentExplorerEntry) -> Vec<InstrumentPart> {
    const SHANK: f32 = BentExplorerEntry::SHANK_RADIUS;
    let rings = wire.rings();
    let end = rings.last().map_or(Vec3::ZERO, |ring| ring.0);
    let rings = rings.iter().map(|(at, radius)| [at.x, at.y, at.z, *radius].map(rounded)).collect();
    let handle = lathe(
        PartSurface::Steel,
        &[[0.0, -0.3], [1.1 * SHANK, 0.0], [HANDLE_RADIUS, 5.0], [HANDLE_RADIUS, SHAFT_LENGTH]],
    );
    let wire = WirePart { surface: PartSurface::Steel, rings };
    vec![InstrumentPart::Wire(wire), InstrumentPart::Lathe(handle.placed(Pose::at(end)))]
}

/// A bowl, which is an ellipsoid, with its shaft.
fn spoon_parts(spoon: &SpoonEntry) -> Vec<InstrumentPart> {
    let pose = spoon.handle_from_bowl();
    let ball: Vec<[f32; 2]> = Profile::ball(1.0, -1.0).outline(SAG).iter().map(|p| [p.r, p.z]).collect();
    let bowl = lathe(PartSurface::Edge, &ball).scaled(spoon.half_axes()).placed(pose);
    let shank = spoon.shank();
    lathes([bowl, shaft(0.5 * shank.neck, pose.position.z, &shank)])
}

/// A flat blade, lying across the shaft.
fn blade_parts(blade: &BladeEntry) -> Vec<InstrumentPart> {
    /// Share of the half width that the rounded edges take.
    const ROUNDING: f32 = 0.12;
    let half = blade.half_extent();
    // A box is a lathe of four sides, whose corners are √2 from the axis.
    let corner = |share: f32| core::f32::consts::SQRT_2 * share;
    let outline = [
        [0.0, 0.0],
        [corner(1.0 - ROUNDING), 0.0],
        [corner(1.0), 0.6 * half.z],
        [corner(1.0), 1.4 * half.z],
        [corner(1.0 - ROUNDING), 2.0 * half.z],
        [0.0, 2.0 * half.z],
    ];
    let plate = LathePart { sides: 4, ..lathe(PartSurface::End, &outline).scaled(half.with_z(1.0)) };
    let shank = blade.shank();
    lathes([plate, shaft(0.5 * shank.neck, half.z, &shank)])
}

fn lathe(surface: PartSurface, outline: &[[f32; 2]]) -> LathePart {
    LathePart {
        surface,
        outline: outline.iter().map(|point| point.map(rounded)).collect(),
        sides: ROUND,
        scale: [1.0; 3],
        at: [0.0; 3],
        turn: Quat::IDENTITY.to_array(),
    }
}

impl LathePart {
    fn placed(self, pose: Pose) -> LathePart {
        LathePart { at: pose.position.to_array().map(rounded), turn: pose.orientation.to_array(), ..self }
    }

    fn scaled(self, by: Vec3) -> LathePart {
        LathePart { scale: by.to_array().map(rounded), ..self }
    }
}

/// A length to a tenth of a micrometre, which is written with fewer digits.
fn rounded(mm: f32) -> f32 {
    (mm * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_exercise::catalog::InstrumentTable;
    use typodont_formats::Library;

    #[test]
    fn every_shipped_instrument_is_drawn_as_wide_as_it_is_felt_and_its_cutting_part_is_told_apart() {
        // Aim: the picture shows the working end that touched. Method: the widest place of each end of revolution against
        // the instrument of the simulation, and the surface of the end against the table.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        for entry in table.entries() {
            let parts = instrument_parts(entry);
            assert!(!parts.is_empty(), "{}", entry.id);
            let InstrumentPart::Lathe(end) = &parts[0] else { continue };
            let is_cutting = matches!(end.surface, PartSurface::Edge | PartSurface::Flutes | PartSurface::Grit);
            assert_eq!(is_cutting, entry.cuts, "{}", entry.id);
            let is_diamond = entry.kind == Some(ToolKind::DiamondBur);
            assert_eq!(end.surface == PartSurface::Grit, is_diamond, "{}", entry.id);
            if entry.end.profile().is_some() {
                let widest = end.outline.iter().map(|[r, _]| *r).fold(0.0, f32::max);
                let felt = entry.to_instrument().head_radius();
                assert!((widest - felt).abs() < 0.02, "{}: {widest} and {felt} mm", entry.id);
            }
        }
    }
}
