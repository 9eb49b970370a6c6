//! What the hand holds, drawn.

use crate::content::{BentEntry, EndEntry, InstrumentEntry, Library, MirrorEntry, ProbeEntry, picture_mesh};
use crate::diagnostic::Diagnostic;
use crate::frame::{Pose, Vec3};
use crate::mesh::Mesh;
use crate::render::{Finish, Mirror, Rgb, Solid};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

const STEEL: Finish = Finish { colour: [0.72, 0.74, 0.77], gloss: 0.6 };

/// An instrument about its own tip, +z along the shaft toward the hand: the mesh that its entry names, or else its outline.
///
/// A mesh that cannot be used is complained about, and the outline is drawn.
pub fn instrument(entry: &InstrumentEntry, library: &Library) -> (Solid, Option<Diagnostic>) {
    match entry.mesh.as_ref().map(|name| picture_mesh::read(library, name)) {
        Some(Ok(mesh)) => (Solid::plain(Arc::new(mesh), Pose::IDENTITY, STEEL), None),
        Some(Err(complaint)) => (outlined(entry), Some(complaint)),
        None => (outlined(entry), None),
    }
}

/// An instrument by the outline of its end, about its own tip, +z along the shaft toward the hand.
pub fn outlined(entry: &InstrumentEntry) -> Solid {
    match &entry.end {
        EndEntry::Probe(probe) => probe_solid(probe),
        end => Solid::plain(Arc::new(drawing(end)), Pose::IDENTITY, STEEL),
    }
}

/// A periodontal probe with its marks and bands, so that a depth can be read; the middle of its end at the origin.
fn probe_solid(probe: &ProbeEntry) -> Solid {
    /// A line is so broad, mm, and paint so dark.
    const LINE: f32 = 0.12;
    const PAINT: Rgb = [0.10; 3];
    /// From its end a probe is slim for so long, mm.
    const SLIM: f32 = 16.0;
    let end = 0.5 * probe.diameter_mm;
    let neck = if probe.ball { 0.6 * end } else { 0.9 * end };
    let thick = |height: f32| neck + (0.42 - neck).max(0.0) * (height / SLIM).clamp(0.0, 1.0);
    let lines = probe.marks_mm.iter().map(|m| [m.0 - 0.5 * LINE, m.0 + 0.5 * LINE]);
    let dark: Vec<[f32; 2]> = lines.chain(probe.bands_mm.iter().map(|b| b.map(|m| m.0))).collect();
    let mut heights: Vec<f32> = dark.iter().flatten().copied().chain([SLIM]).filter(|h| *h <= SLIM).collect();
    heights.sort_by(f32::total_cmp);
    heights.dedup();
    // Heights count from the end's lowest place, which lies its radius below the origin.
    let rod = heights.iter().map(|h| [thick(*h), h - end]);
    let tip = arc(end, -1.0, if probe.ball { 0.8 } else { 0.0 });
    let behind = [[0.9, SLIM + 5.0], [1.1, SLIM + 9.0], [3.0, SLIM + 14.0], [3.0, SLIM + 110.0], [0.0, SLIM + 111.0]];
    let outline: Vec<[f32; 2]> = tip.into_iter().chain(rod).chain(behind).collect();
    let is_dark = |pair: &[[f32; 2]]| {
        let middle = 0.5 * (pair[0][1] + pair[1][1]) + end;
        dark.iter().any(|[from, to]| (*from..=*to).contains(&middle))
    };
    let tint = |pair: &[[f32; 2]]| [if is_dark(pair) { PAINT } else { [1.0; 3] }; 2 * (SIDES + 1)];
    let tints = outline.windows(2).flat_map(tint).collect();
    Solid { tints: Arc::new(tints), ..Solid::plain(Arc::new(turned(&outline)), Pose::IDENTITY, STEEL) }
}

/// An explorer's bent wire with its handle.
fn bent(wire: &BentEntry) -> Mesh {
    /// Radius at the tip, of the shank and over which way it grows, mm.
    const FINE: f32 = 0.07;
    const SHANK: f32 = 0.75;
    const GROWS: f32 = 16.0;
    /// Between two rings, mm.
    const STEP: f32 = 0.4;
    let corners: Vec<Vec3> = wire.wire_mm.iter().map(|p| Vec3::from(p.map(|c| c.0))).collect();
    let line = rounded(&corners, STEP);
    let mut way = 0.0;
    let mut rings = Vec::new();
    for (i, at) in line.iter().enumerate() {
        let (before, after) = (line[i.saturating_sub(1)], line[(i + 1).min(line.len() - 1)]);
        way += before.distance(*at);
        let radius = FINE + (SHANK - FINE) * (way / GROWS).clamp(0.0, 1.0);
        rings.push((*at, (after - before).normalize_or(Vec3::Z), radius));
    }
    let mut mesh = tube(&rings);
    let end = *line.last().unwrap_or(&Vec3::ZERO);
    let handle = [[0.0, -0.2], [SHANK, 0.0], [2.8, 5.0], [2.8, 95.0], [0.0, 97.0]];
    let handle = placed(turned(&handle), Pose::at(end));
    mesh.join(handle);
    mesh
}

/// A line through corners with its bends rounded (Catmull and Rom's spline), in steps.
fn rounded(corners: &[Vec3], step: f32) -> Vec<Vec3> {
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

/// A tube along rings: middle, way, radius.
fn tube(rings: &[(Vec3, Vec3, f32)]) -> Mesh {
    let mut mesh = Mesh::default();
    for (at, way, radius) in rings {
        let side = way.cross(Vec3::Y).normalize_or(Vec3::X);
        let up = way.cross(side);
        for i in 0..=SIDES {
            let angle = TAU * i as f32 / SIDES as f32;
            let out = side * libm::cosf(angle) + up * libm::sinf(angle);
            mesh.positions.push(*at + out * *radius);
            mesh.normals.push(out);
        }
    }
    let round = SIDES as u32 + 1;
    for ring in 0..rings.len().saturating_sub(1) as u32 {
        for i in 0..SIDES as u32 {
            let (a, b) = (ring * round + i, (ring + 1) * round + i);
            mesh.triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
        }
    }
    mesh
}

/// The reflecting face of a mouth mirror held in a place; `None` for every other instrument.
pub fn mirror(entry: &InstrumentEntry, world_from_tip: Pose) -> Option<Mirror> {
    /// A little within the rim, mm; rhodium on the front of the glass.
    const RIM: f32 = 0.4;
    const SHINE: f32 = 0.8;
    let EndEntry::Mirror(mirror) = &entry.end else { return None };
    let radius = 0.5 * mirror.diameter_mm - RIM;
    Some(Mirror { world_from_mirror: world_from_tip * mirror.handle_from_face(), radius, shine: SHINE })
}

/// A mouth mirror's head, shaft and handle, without its face.
fn mirror_body(mirror: &MirrorEntry) -> Mesh {
    let (radius, back) = (0.5 * mirror.diameter_mm, -MirrorEntry::THICKNESS);
    // The face lies a twentieth of a millimetre over the glass, within the rim.
    let head = [[0.0, back], [radius - 0.8, back], [radius, back + 0.5], [radius, 0.0], [radius - 0.4, 0.0]];
    let glass = [[radius - 0.4, -0.05], [0.0, -0.05]];
    let shaft =
        [[0.0, -0.6], [1.0, -0.4], [1.1, 12.0], [1.1, 32.0], [2.8, 38.0], [2.8, 115.0], [2.0, 117.0], [0.0, 117.0]];
    let mut mesh = placed(turned(&[&head[..], &glass].concat()), mirror.handle_from_face());
    let shaft = placed(turned(&shaft), Pose::at(mirror.foot()));
    mesh.join(shaft);
    mesh
}

/// An end with the neck, shaft and handle of a hand instrument behind it.
fn hand_instrument(mut end: Mesh, neck: f32, top: f32) -> Mesh {
    let handle = [[0.0, top], [neck, top], [1.2, top + 9.0], [1.2, top + 28.0], [3.2, top + 34.0], [3.2, top + 120.0]];
    let behind = turned(&[&handle[..], &[[0.0, top + 122.0]]].concat());
    end.join(behind);
    end
}

fn placed(mut mesh: Mesh, pose: Pose) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = pose * *p);
    mesh.normals.iter_mut().for_each(|n| *n = pose.turn(*n));
    mesh
}

/// From a working end's tip to the head of the handpiece that turns it, mm; 0 for what no handpiece turns.
pub(super) fn head_height(end: &EndEntry) -> f32 {
    bur(end).last().map_or(0.0, |[_, top]| top + NECK)
}

/// Corners of what is round.
const SIDES: usize = 32;

/// From the top of a bur to the handpiece's head, mm.
const NECK: f32 = 9.5;

/// An end with what is behind it, about the device's tip, mm. A drawing: what touches is the instrument's own shape.
fn drawing(end: &EndEntry) -> Mesh {
    match end {
        EndEntry::Point => {
            let needle = [[0.0, 0.0], [0.12, 0.6], [0.5, 8.0], [1.0, 14.0]];
            return turned(&[&needle[..], &[[2.6, 20.0], [2.6, 90.0], [0.0, 90.0]]].concat());
        }
        EndEntry::Mirror(mirror) => return mirror_body(mirror),
        EndEntry::Plugger(e) => {
            let radius = 0.5 * e.diameter_mm;
            return hand_instrument(turned(&[[0.0, 0.0], [radius, 0.0], [0.9 * radius, 2.0]]), 0.8 * radius, 2.0);
        }
        EndEntry::Cleoid(e) => {
            let (point, wide) = (0.5 * e.point_mm, 0.5 * e.width_mm);
            let cone = [lifted(arc(point, -1.0, 0.0), point), vec![[wide, e.length_mm]]].concat();
            return hand_instrument(turned(&cone), 0.4, e.length_mm);
        }
        EndEntry::Spoon(e) => return hand_instrument(e.drawing(), 0.4, 0.3 * e.diameter_mm),
        EndEntry::Blade(e) => return hand_instrument(e.drawing(), 0.45, 0.5 * e.thickness_mm),
        EndEntry::Bent(wire) => return bent(wire),
        _ => {}
    }
    let tip = bur(end);
    let [radius, top] = tip.last().copied().unwrap_or_default();
    // Neck, friction grip shank (ISO 1797: 1.6 mm) and the handpiece's head.
    let behind = [[0.8 * radius, top + 0.2], [0.8, top + 3.0], [0.8, top + NECK], [4.5, top + NECK], [5.2, top + 12.0]];
    let head = [[5.2, top + 22.0], [0.0, top + 22.0]];
    turned(&[&tip[..], &behind, &head].concat())
}

/// A bur's outline: radius and height, from the tip upward, mm. None for what does not turn.
fn bur(end: &EndEntry) -> Vec<[f32; 2]> {
    match end {
        EndEntry::Point
        | EndEntry::Mirror(_)
        | EndEntry::Probe(_)
        | EndEntry::Bent(_)
        | EndEntry::Plugger(_)
        | EndEntry::Spoon(_)
        | EndEntry::Cleoid(_)
        | EndEntry::Blade(_) => Vec::new(),
        EndEntry::Ball(e) => arc(0.5 * e.diameter_mm, -1.0, 0.8),
        EndEntry::Pear(e) => {
            let radius = 0.5 * e.diameter_mm;
            [lifted(arc(radius, -1.0, 0.2), radius), vec![[0.5 * e.top_diameter_mm, e.length_mm]]].concat()
        }
        EndEntry::Cylinder(e) => straight(e.diameter_mm, e.diameter_mm, e.length_mm),
        EndEntry::Tapered(e) => straight(e.tip_diameter_mm, e.diameter_mm, e.length_mm),
        EndEntry::InvertedCone(e) => straight(e.diameter_mm, e.top_diameter_mm, e.length_mm),
        EndEntry::Flame(e) => {
            let at = |share: f32| [0.5 * e.diameter_mm * libm::sinf(PI * share), e.length_mm * share];
            (0..10).map(|i| at(i as f32 / 10.0)).collect()
        }
    }
}

/// Part of a circle about the origin, from one share of its radius in height to another.
fn arc(radius: f32, from: f32, to: f32) -> Vec<[f32; 2]> {
    let at = |i: usize| {
        let (low, high) = (libm::asinf(from), libm::asinf(to));
        let angle = low + (high - low) * i as f32 / 12.0;
        [radius * libm::cosf(angle), radius * libm::sinf(angle)]
    };
    (0..=12).map(at).collect()
}

fn lifted(outline: Vec<[f32; 2]>, by: f32) -> Vec<[f32; 2]> {
    outline.into_iter().map(|[radius, height]| [radius, height + by]).collect()
}

fn straight(low: f32, high: f32, length: f32) -> Vec<[f32; 2]> {
    vec![[0.0, 0.0], [0.5 * low, 0.0], [0.5 * high, length]]
}

/// An outline turned about z; each stretch has its own normals, so that edges stay edges.
pub(super) fn turned(outline: &[[f32; 2]]) -> Mesh {
    let mut mesh = Mesh::default();
    for pair in outline.windows(2) {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        let out = Vec3::new(z1 - z0, 0.0, r0 - r1).normalize_or(Vec3::Z);
        let first = mesh.positions.len() as u32;
        for i in 0..=SIDES {
            let angle = TAU * i as f32 / SIDES as f32;
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            mesh.positions.extend([Vec3::new(r0 * cos, r0 * sin, z0), Vec3::new(r1 * cos, r1 * sin, z1)]);
            mesh.normals.extend([Vec3::new(out.x * cos, out.x * sin, out.z); 2]);
        }
        for i in 0..SIDES as u32 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|n| first + 2 * i + n);
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::content::InstrumentTable;

    #[test]
    fn an_instrument_is_drawn_from_its_mesh_or_else_by_its_outline() {
        // Aim: a broken file costs the picture, not the lesson, and is named.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        let mut entry = table.by_id("round_bur_018").unwrap().clone();
        let plain = outlined(&entry);
        entry.mesh = Some("bur.obj".into());
        let mut library = Library::empty();
        let (missing, complaint) = instrument(&entry, &library);
        assert_eq!((missing.mesh, complaint.unwrap().code), (plain.mesh.clone(), "missing-file"));
        library.hold("bur.obj", b"v 0 0 0\nv 1 0 9\nv 0 1 9\nf 1 2 3\n".as_slice());
        let (drawn, complaint) = instrument(&entry, &library);
        assert!(complaint.is_none() && drawn.mesh.triangles.len() == 1);
        library.hold("bur.obj", b"v 0 0".as_slice());
        let (broken, complaint) = instrument(&entry, &library);
        assert_eq!(broken.mesh, plain.mesh);
        assert!(complaint.unwrap().headline().contains("bur.obj"));
    }

    #[test]
    fn an_instruments_surface_faces_outward() {
        // Aim: lamps light the instrument, not its inside. Method: a closed surface that faces outward encloses a positive
        // volume; a straight one encloses that of a cylinder.
        let mesh = turned(&[[0.0, 0.0], [1.0, 0.0], [1.0, 5.0], [0.0, 5.0]]);
        let expected = f64::from(PI) * 5.0;
        assert!((mesh.volume_mm3() / expected - 1.0).abs() < 0.01, "{}", mesh.volume_mm3());
        for (triangle, normal) in mesh.triangles.iter().map(|t| (t, mesh.normals[t[0] as usize])) {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(normal) >= 0.0);
        }
    }
}
