//! Shape of an instrument as a page draws it.
//!
//! Takes an entry of the catalogue. Gives few numbers, of which the page's script makes meshes: outlines that are
//! turned about an axis, wires, and the simplified surface of a shape from a file. Never used for touch.

use serde::Serialize;
use std::collections::BTreeMap;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Profile, ProfilePoint, Shank};
use typodont_exercise::catalog::{
    BentExplorerEntry, BladeEntry, InstrumentEntry, MirrorEntry, ProbeEntry, SampledEnd, SpoonEntry, ToolKind,
    WorkingEndEntry,
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
    Mesh(TriangleMeshPart),
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

/// Triangles that face outward.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TriangleMeshPart {
    pub surface: PartSurface,
    pub corners: Vec<[f32; 3]>,
    /// Indices into `corners`.
    pub triangles: Vec<[u32; 3]>,
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
        WorkingEndEntry::Shape(shape) => {
            shape.sampled.as_ref().map_or_else(Vec::new, |end| sampled_parts(end, end_surface(entry)))
        }
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

/// Maximum number of triangles of a shape in a page: some 100 kB of text.
const PAGE_TRIANGLES_MAX: usize = 4000;

/// Distance from the cutting part up to which a triangle is drawn as its surface, mm.
const CUTTING_WITHIN: f32 = 0.1;

/// The surface of a shape from a file, its cutting part and the rest.
fn sampled_parts(end: &SampledEnd, surface: PartSurface) -> Vec<InstrumentPart> {
    let (corners, triangles) = simplified(&end.surface);
    let middle = |t: &[u32; 3]| t.iter().map(|&i| corners[i as usize]).sum::<Vec3>() / 3.0;
    let (cutting, rest): (Vec<_>, Vec<_>) =
        triangles.into_iter().partition(|t| end.body.head_distance(middle(t)) < CUTTING_WITHIN);
    let part = |surface, triangles: Vec<[u32; 3]>| {
        // Each part holds only the corners that it needs, in the order of their first use.
        let mut numbers = BTreeMap::new();
        let mut own = Vec::new();
        let triangles = triangles.iter().map(|t| {
            t.map(|corner| {
                *numbers.entry(corner).or_insert_with(|| {
                    own.push(corners[corner as usize].to_array().map(rounded));
                    own.len() as u32 - 1
                })
            })
        });
        let triangles = triangles.collect();
        InstrumentPart::Mesh(TriangleMeshPart { surface, triangles, corners: own })
    };
    let parts = [(surface, cutting), (PartSurface::Steel, rest)].into_iter();
    parts.filter(|(_, triangles)| !triangles.is_empty()).map(|(surface, triangles)| part(surface, triangles)).collect()
}

/// Joins the corners of a mesh in the cells of a lattice, which is made coarser until at most [`PAGE_TRIANGLES_MAX`]
/// triangles are left; a corner is the mean of those in its cell.
fn simplified(mesh: &Mesh) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    /// Size of the first cells, mm, and the factor from one size to the next.
    const CELL: f32 = 0.02;
    const COARSER: f32 = 1.5;
    let mut cell = CELL;
    loop {
        let found = joined(mesh, cell);
        if found.1.len() <= PAGE_TRIANGLES_MAX {
            return found;
        }
        cell *= COARSER;
    }
}

fn joined(mesh: &Mesh, cell: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // From a corner of the mesh, so that cells of its size hold all of it.
    let low = Aabb::around(mesh.positions.iter().copied()).low;
    let mut numbers: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut sums: Vec<(Vec3, f32)> = Vec::new();
    let mut number = |at: Vec3| {
        let key = ((at - low) / cell).floor().to_array().map(|v| v as i32);
        let number = *numbers.entry(key).or_insert(sums.len() as u32);
        if number as usize == sums.len() {
            sums.push((Vec3::ZERO, 0.0));
        }
        let (sum, count) = &mut sums[number as usize];
        *sum += at;
        *count += 1.0;
        number
    };
    let corners: Vec<u32> = mesh.positions.iter().map(|&at| number(at)).collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|i| corners[i as usize]));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    (sums.into_iter().map(|(sum, count)| sum / count).collect(), triangles)
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
    use std::sync::Arc;
    use typodont_core::touch::{Body, SampledShape};
    use typodont_core::volume::{Grid, Label, Volume, surface};
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

    #[test]
    fn a_shape_from_a_file_is_drawn_where_it_is_felt() {
        // Aim: the page's triangles lie on the surface that is felt, few enough for a page, and the cutting part is told
        // apart. Method: a ball of which the lower part cuts.
        let ball =
            Volume::from_distance(Grid::centred([70; 3], Vec3::splat(0.05)), 0.075, |p| (p.length() - 1.5, Label(1)));
        let mesh = surface::extract(&ball);
        let triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])).collect();
        let shape = SampledShape::of_triangles(*ball.grid(), &triangles).unwrap();
        let cutting = shape.clone().below(-0.5).cropped(0.4);
        let body = Arc::new(Body::sampled(shape.clone(), cutting));
        assert!(mesh.triangles.len() > PAGE_TRIANGLES_MAX);
        let parts = sampled_parts(&SampledEnd { body, surface: Arc::new(mesh) }, PartSurface::Edge);
        let meshes: Vec<&TriangleMeshPart> =
            parts.iter().filter_map(|p| if let InstrumentPart::Mesh(mesh) = p { Some(mesh) } else { None }).collect();
        assert_eq!([meshes[0].surface, meshes[1].surface], [PartSurface::Edge, PartSurface::Steel]);
        let count: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        assert!((1000..=PAGE_TRIANGLES_MAX).contains(&count), "{count} triangles");
        for (mesh, side) in meshes.iter().zip([-1.0, 1.0]) {
            for corner in mesh.corners.iter().map(|&corner| Vec3::from(corner)) {
                assert!(shape.distance(corner).abs() < 0.02, "{corner}");
                assert!(side * (corner.z + 0.5) > -0.3, "{:?} at {corner}", mesh.surface);
            }
        }
    }
}
