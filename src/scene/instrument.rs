//! What the hand holds, drawn.

use crate::content::{EndEntry, InstrumentEntry, Library, MirrorEntry, picture_mesh};
use crate::diagnostic::Diagnostic;
use crate::frame::{Pose, Vec3};
use crate::mesh::Mesh;
use crate::render::{Finish, Mirror, Solid};
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
    Solid::plain(Arc::new(drawing(&entry.end)), Pose::IDENTITY, STEEL)
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
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(shaft.positions);
    mesh.normals.extend(shaft.normals);
    mesh.triangles.extend(shaft.triangles.iter().map(|t| t.map(|i| first + i)));
    mesh
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
        EndEntry::Point | EndEntry::Mirror(_) => Vec::new(),
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
    const SIDES: usize = 32;
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
