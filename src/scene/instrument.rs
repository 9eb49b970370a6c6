//! Meshes of the instruments.

use super::bur_head::cutting_head;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::mesh::Mesh;
use typodont_exercise::catalog::{BentExplorerEntry, InstrumentEntry, MirrorEntry, ProbeEntry, WorkingEndEntry};
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::{Library, visual_mesh};
use typodont_render::{Appearance, MeshInstance, PlaneMirror, Rgb, VertexTint};

/// Polished steel: it mirrors two thirds of the light, and scatters little.
pub(super) const STEEL: Appearance = Appearance { colour: [0.52, 0.53, 0.55], gloss: 0.8 };

/// Tints of steel: as it is, in a groove, and of the ring of a fast contra-angle.
const PLAIN: Rgb = [1.0; 3];
const GROOVE: Rgb = [0.3; 3];
const RED: Rgb = [1.5, 0.22, 0.2];

/// An instrument with its tip at the origin and +z along the shaft toward the handle: the mesh that its entry names, or
/// else [`procedural_instrument`].
///
/// If the named mesh cannot be used, the diagnostic says why, and the procedural mesh is returned.
pub fn instrument_solid(entry: &InstrumentEntry, library: &Library) -> (MeshInstance, Option<Diagnostic>) {
    match entry.mesh.as_ref().map(|name| visual_mesh::read(library, name)) {
        Some(Ok(mesh)) => (MeshInstance::plain(Arc::new(mesh), Pose::IDENTITY, STEEL), None),
        Some(Err(complaint)) => (procedural_instrument(entry), Some(complaint)),
        None => (procedural_instrument(entry), None),
    }
}

/// An instrument made from the dimensions of its working end, with its tip at the origin and +z along the shaft toward
/// the handle; mm.
pub fn procedural_instrument(entry: &InstrumentEntry) -> MeshInstance {
    match &entry.end {
        WorkingEndEntry::Probe(probe) => probe_solid(probe),
        end if entry.is_bur() && !bur_profile(end).is_empty() => tinted(bur(entry, &holder(end))),
        end => MeshInstance::plain(Arc::new(end_mesh(end)), Pose::IDENTITY, STEEL),
    }
}

/// A bur in a contra-angle handpiece, in two parts: the bur with its shank, and the handpiece.
pub struct ContraAngle {
    pub bur: MeshInstance,
    /// The handpiece in a right hand, and in a left one.
    handpieces: [MeshInstance; 2],
}

impl ContraAngle {
    /// The handpiece as a right-handed or a left-handed operator holds it.
    pub fn handpiece(&self, is_left_handed: bool) -> &MeshInstance {
        &self.handpieces[usize::from(is_left_handed)]
    }
}

/// Direction of a contra-angle's handle from its head in a right hand: toward the operator, who sits in front of the
/// picture, and upward by 20°. Handle space; unit vector.
const HANDLE_DIRECTION: Vec3 = Vec3::new(0.423, -0.840, 0.342);

/// Returns a bur in a contra-angle handpiece, as a pointer holds it; `None` for other instruments and for those with a
/// mesh of their own.
pub fn contra_angle(entry: &InstrumentEntry) -> Option<ContraAngle> {
    /// Height of the head, mm.
    const HEAD_HEIGHT: f32 = 12.5;
    /// Outline of the head, radius and height, mm: chuck, rounded rim, wall with a groove, and push button.
    const HEAD: [[f32; 2]; 20] = [
        [0.0, 0.3],
        [1.3, 0.3],
        [1.3, 0.0],
        [2.6, 0.05],
        [3.4, 0.35],
        [4.0, 0.9],
        [4.3, 1.6],
        [4.4, 2.4],
        [4.4, 8.0],
        [4.15, 8.1],
        [4.15, 8.4],
        [4.4, 8.5],
        [4.4, 10.2],
        [4.25, 10.8],
        [3.8, 11.2],
        [3.5, 11.2],
        [3.5, 11.9],
        [3.1, 12.3],
        [1.8, 12.5],
        [0.0, HEAD_HEIGHT],
    ];
    /// Stretches of it that lie in the dark: the hole around the shank, the groove, and the gap around the button.
    const DARK: [usize; 5] = [0, 1, 9, 10, 14];
    /// Neck and handle: distance along the handle from the middle of the head, mm, radius there, and tint. The red ring marks a
    /// contra-angle that increases the speed.
    const STATIONS: [(f32, f32, Rgb); 14] = [
        (0.0, 3.4, PLAIN),
        (7.0, 3.3, PLAIN),
        (16.0, 3.7, PLAIN),
        (20.0, 3.9, PLAIN),
        (26.0, 5.6, PLAIN),
        (29.0, 5.85, PLAIN),
        (29.0, 5.95, RED),
        (30.6, 6.05, RED),
        (30.6, 5.95, PLAIN),
        (40.0, 6.6, PLAIN),
        (42.0, 6.7, PLAIN),
        (42.0, 6.5, GROOVE),
        (42.5, 6.5, GROOVE),
        (95.0, 7.4, PLAIN),
    ];
    if !entry.is_bur() || entry.mesh.is_some() || bur_profile(&entry.end).is_empty() {
        return None;
    }
    let head = head_height(&entry.end);
    let head_mesh = transformed(revolve(&HEAD), Pose::at(Vec3::Z * head));
    let head_tints: Vec<Rgb> = (0..HEAD.len() - 1)
        .flat_map(|stretch| [if DARK.contains(&stretch) { GROOVE } else { PLAIN }; 2 * (SIDES + 1)])
        .collect();
    let middle = Vec3::Z * (head + 0.5 * HEAD_HEIGHT);
    let handpieces = [1.0, -1.0].map(|side| {
        let direction = HANDLE_DIRECTION * Vec3::new(side, 1.0, 1.0);
        let (mut mesh, mut tints) = (head_mesh.clone(), head_tints.clone());
        mesh.append(tube(&STATIONS.map(|(along, radius, _)| (middle + direction * along, direction, radius))));
        tints.extend(STATIONS.iter().flat_map(|(_, _, tint)| [*tint; SIDES + 1]));
        tinted((mesh, tints))
    });
    Some(ContraAngle { bur: tinted(bur(entry, &[])), handpieces })
}

/// A bur: its cutting head, its shank, and what holds it, an outline of radii and heights; with a tint for each vertex.
fn bur(entry: &InstrumentEntry, holder: &[[f32; 2]]) -> (Mesh, Vec<Rgb>) {
    let profile = bur_profile(&entry.end);
    let end = profile.last().copied().unwrap_or_default();
    // Closed above, where the flutes are open.
    let head = [&profile[..], &[[0.0, end[1]]]].concat();
    let (mut mesh, mut tints) = cutting_head(entry, &head);
    mesh.append(revolve(&[&[end][..], &shank(&profile), holder].concat()));
    tints.resize(mesh.positions.len(), PLAIN);
    (mesh, tints)
}

/// A steel instrument with a tint for each vertex.
fn tinted((mesh, tints): (Mesh, Vec<Rgb>)) -> MeshInstance {
    let tints = tints.into_iter().map(VertexTint::smooth).collect();
    MeshInstance { vertex_tints: Arc::new(tints), ..MeshInstance::plain(Arc::new(mesh), Pose::IDENTITY, STEEL) }
}

/// A periodontal probe with its marks and bands, so that a depth can be read; the middle of its end at the origin.
fn probe_solid(probe: &ProbeEntry) -> MeshInstance {
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
    let tip = arc_profile(end, -1.0, if probe.ball { 0.8 } else { 0.0 });
    let behind = [[0.9, SLIM + 5.0], [1.1, SLIM + 9.0], [3.0, SLIM + 14.0], [3.0, SLIM + 110.0], [0.0, SLIM + 111.0]];
    let outline: Vec<[f32; 2]> = tip.into_iter().chain(rod).chain(behind).collect();
    let is_dark = |pair: &[[f32; 2]]| {
        let middle = 0.5 * (pair[0][1] + pair[1][1]) + end;
        dark.iter().any(|[from, to]| (*from..=*to).contains(&middle))
    };
    let tint = |pair: &[[f32; 2]]| [if is_dark(pair) { PAINT } else { [1.0; 3] }; 2 * (SIDES + 1)];
    let tints = outline.windows(2).flat_map(tint).collect();
    tinted((revolve(&outline), tints))
}

/// An explorer's bent wire with its handle.
fn explorer_mesh(wire: &BentExplorerEntry) -> Mesh {
    let line = wire.rings();
    let direction = |i: usize| line[(i + 1).min(line.len() - 1)].0 - line[i.saturating_sub(1)].0;
    let ring = |(i, &(at, radius)): (usize, &(Vec3, f32))| (at, direction(i).normalize_or(Vec3::Z), radius);
    let rings: Vec<_> = line.iter().enumerate().map(ring).collect();
    let mut mesh = tube(&rings);
    let end = line.last().map_or(Vec3::ZERO, |ring| ring.0);
    let handle = [[0.0, -0.2], [BentExplorerEntry::SHANK_RADIUS, 0.0], [2.8, 5.0], [2.8, 95.0], [0.0, 97.0]];
    let handle = transformed(revolve(&handle), Pose::at(end));
    mesh.append(handle);
    mesh
}

/// A tube along rings: middle, way (unit), radius.
pub(super) fn tube(rings: &[(Vec3, Vec3, f32)]) -> Mesh {
    let mut mesh = Mesh::default();
    let mut side = rings.first().map_or(Vec3::X, |(_, direction, _)| direction.cross(Vec3::Y).normalize_or(Vec3::X));
    for (at, direction, radius) in rings {
        // From ring to ring it turns with the way, so that the tube is not twisted.
        side = side.reject_from_normalized(*direction).normalize_or(side);
        let up = direction.cross(side);
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

/// A wire along a line, with round ends.
pub(super) fn wire(line: &[Vec3], radius: f32) -> Mesh {
    let way = |i: usize| (line[(i + 1).min(line.len() - 1)] - line[i.saturating_sub(1)]).normalize_or(Vec3::Z);
    let is_end = |i: usize| i == 0 || i + 1 == line.len();
    let rings: Vec<(Vec3, Vec3, f32)> =
        (0..line.len()).map(|i| (line[i], way(i), if is_end(i) { 0.5 * radius } else { radius })).collect();
    tube(&rings)
}

/// The reflecting face of a mouth mirror held in a place; `None` for every other instrument.
pub fn mirror_face(entry: &InstrumentEntry, world_from_tip: Pose) -> Option<PlaneMirror> {
    /// A little within the rim, mm; rhodium on the front of the glass.
    const RIM: f32 = 0.4;
    const SHINE: f32 = 0.8;
    let WorkingEndEntry::Mirror(mirror) = &entry.end else { return None };
    let radius = 0.5 * mirror.diameter_mm - RIM;
    Some(PlaneMirror { world_from_mirror: world_from_tip * mirror.handle_from_face(), radius, reflectance: SHINE })
}

/// A mouth mirror's head, shaft and handle, without its face.
fn mirror_body(mirror: &MirrorEntry) -> Mesh {
    let (radius, back) = (0.5 * mirror.diameter_mm, -MirrorEntry::THICKNESS);
    // The face lies a twentieth of a millimetre over the glass, within the rim.
    let head = [[0.0, back], [radius - 0.8, back], [radius, back + 0.5], [radius, 0.0], [radius - 0.4, 0.0]];
    let glass = [[radius - 0.4, -0.05], [0.0, -0.05]];
    let shaft =
        [[0.0, -0.6], [1.0, -0.4], [1.1, 12.0], [1.1, 32.0], [2.8, 38.0], [2.8, 115.0], [2.0, 117.0], [0.0, 117.0]];
    let mut mesh = transformed(revolve(&[&head[..], &glass].concat()), mirror.handle_from_face());
    let shaft = transformed(revolve(&shaft), Pose::at(mirror.foot()));
    mesh.append(shaft);
    mesh
}

/// An end with the neck, shaft and handle of a hand instrument behind it.
fn with_handle(mut end: Mesh, neck: f32, top: f32) -> Mesh {
    let handle = [[0.0, top], [neck, top], [1.2, top + 9.0], [1.2, top + 28.0], [3.2, top + 34.0], [3.2, top + 120.0]];
    let behind = revolve(&[&handle[..], &[[0.0, top + 122.0]]].concat());
    end.append(behind);
    end
}

fn transformed(mut mesh: Mesh, pose: Pose) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = pose * *p);
    mesh.normals.iter_mut().for_each(|n| *n = pose.rotate(*n));
    mesh
}

/// From a working end's tip to the head of the handpiece that turns it, mm; 0 for what no handpiece turns.
pub(super) fn head_height(end: &WorkingEndEntry) -> f32 {
    bur_profile(end).last().map_or(0.0, |[_, top]| top + NECK)
}

/// Corners of a round cross-section.
const SIDES: usize = 32;

/// From the top of a bur to the handpiece's head, mm.
const NECK: f32 = 9.5;

/// Mesh of a working end with its shank, about the device's tip, mm. It is only drawn: contact uses the instrument's
/// own shape.
fn end_mesh(end: &WorkingEndEntry) -> Mesh {
    match end {
        WorkingEndEntry::Point => {
            let needle = [[0.0, 0.0], [0.12, 0.6], [0.5, 8.0], [1.0, 14.0]];
            return revolve(&[&needle[..], &[[2.6, 20.0], [2.6, 90.0], [0.0, 90.0]]].concat());
        }
        WorkingEndEntry::Mirror(mirror) => return mirror_body(mirror),
        WorkingEndEntry::Plugger(e) => {
            let radius = 0.5 * e.diameter_mm;
            return with_handle(revolve(&[[0.0, 0.0], [radius, 0.0], [0.9 * radius, 2.0]]), 0.8 * radius, 2.0);
        }
        WorkingEndEntry::Cleoid(e) => {
            let (point, wide) = (0.5 * e.point_mm, 0.5 * e.width_mm);
            let cone = [offset_profile(arc_profile(point, -1.0, 0.0), point), vec![[wide, e.length_mm]]].concat();
            return with_handle(revolve(&cone), 0.4, e.length_mm);
        }
        WorkingEndEntry::Spoon(e) => return with_handle(e.visual_mesh(), 0.4, 0.3 * e.diameter_mm),
        WorkingEndEntry::Blade(e) => return with_handle(e.visual_mesh(), 0.45, 0.5 * e.thickness_mm),
        WorkingEndEntry::Bent(wire) => return explorer_mesh(wire),
        WorkingEndEntry::Shape(shape) => {
            return shape.sampled.as_ref().map_or_else(Mesh::default, |end| Mesh::clone(&end.surface));
        }
        _ => {}
    }
    let tip = bur_profile(end);
    revolve(&[&tip[..], &shank(&tip), &holder(end)].concat())
}

/// Outline of a straight holder behind the shank of what an arm holds.
fn holder(end: &WorkingEndEntry) -> [[f32; 2]; 4] {
    let head = head_height(end);
    [[4.5, head], [5.2, head + 2.5], [5.2, head + 12.5], [0.0, head + 12.5]]
}

/// Neck and friction grip shank (ISO 1797: 1.6 mm) behind a bur's outline, up to the handpiece's head.
fn shank(profile: &[[f32; 2]]) -> [[f32; 2]; 3] {
    let [radius, top] = profile.last().copied().unwrap_or_default();
    [[0.8 * radius, top + 0.2], [0.8, top + 3.0], [0.8, top + NECK]]
}

/// A bur's outline: radius and height, from the tip upward, mm. None for what does not turn.
fn bur_profile(end: &WorkingEndEntry) -> Vec<[f32; 2]> {
    match end {
        WorkingEndEntry::Point
        | WorkingEndEntry::Mirror(_)
        | WorkingEndEntry::Probe(_)
        | WorkingEndEntry::Bent(_)
        | WorkingEndEntry::Plugger(_)
        | WorkingEndEntry::Spoon(_)
        | WorkingEndEntry::Cleoid(_)
        | WorkingEndEntry::Blade(_)
        | WorkingEndEntry::Shape(_) => Vec::new(),
        WorkingEndEntry::Ball(e) => arc_profile(0.5 * e.diameter_mm, -1.0, 0.8),
        WorkingEndEntry::Pear(e) => {
            let radius = 0.5 * e.diameter_mm;
            [offset_profile(arc_profile(radius, -1.0, 0.2), radius), vec![[0.5 * e.top_diameter_mm, e.length_mm]]]
                .concat()
        }
        WorkingEndEntry::Cylinder(e) => straight_profile(e.diameter_mm, e.diameter_mm, e.length_mm),
        WorkingEndEntry::Tapered(e) => straight_profile(e.tip_diameter_mm, e.diameter_mm, e.length_mm),
        WorkingEndEntry::InvertedCone(e) => straight_profile(e.diameter_mm, e.top_diameter_mm, e.length_mm),
        WorkingEndEntry::Flame(e) => {
            let at = |share: f32| [0.5 * e.diameter_mm * libm::sinf(PI * share), e.length_mm * share];
            (0..10).map(|i| at(i as f32 / 10.0)).collect()
        }
    }
}

/// Part of a circle about the origin, from one share of its radius in height to another.
fn arc_profile(radius: f32, from: f32, to: f32) -> Vec<[f32; 2]> {
    let at = |i: usize| {
        let (low, high) = (libm::asinf(from), libm::asinf(to));
        let angle = low + (high - low) * i as f32 / 12.0;
        [radius * libm::cosf(angle), radius * libm::sinf(angle)]
    };
    (0..=12).map(at).collect()
}

fn offset_profile(outline: Vec<[f32; 2]>, by: f32) -> Vec<[f32; 2]> {
    outline.into_iter().map(|[radius, height]| [radius, height + by]).collect()
}

fn straight_profile(low: f32, high: f32, length: f32) -> Vec<[f32; 2]> {
    vec![[0.0, 0.0], [0.5 * low, 0.0], [0.5 * high, length]]
}

/// An outline turned about z. Two stretches that meet nearly straight have one normal there, so that round forms are smooth and
/// edges stay edges.
pub(super) fn revolve(outline: &[[f32; 2]]) -> Mesh {
    /// Cosine of the bend up to which a form is round.
    const ROUND: f32 = 0.8;
    let mut mesh = Mesh::default();
    let normal = |pair: &[[f32; 2]]| {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        Vec3::new(z1 - z0, 0.0, r0 - r1).normalize_or(Vec3::Z)
    };
    let outs: Vec<Vec3> = outline.windows(2).map(normal).collect();
    let at_end = |stretch: usize, beside: Option<&Vec3>| match beside {
        Some(beside) if beside.dot(outs[stretch]) > ROUND => (outs[stretch] + *beside).normalize(),
        _ => outs[stretch],
    };
    for (stretch, pair) in outline.windows(2).enumerate() {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        let before = stretch.checked_sub(1).and_then(|before| outs.get(before));
        let ends = [at_end(stretch, before), at_end(stretch, outs.get(stretch + 1))];
        let first = mesh.positions.len() as u32;
        for i in 0..=SIDES {
            let angle = TAU * i as f32 / SIDES as f32;
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            mesh.positions.extend([Vec3::new(r0 * cos, r0 * sin, z0), Vec3::new(r1 * cos, r1 * sin, z1)]);
            mesh.normals.extend(ends.map(|out| Vec3::new(out.x * cos, out.x * sin, out.z)));
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
    use typodont_core::touch::Body;
    use typodont_core::volume::{Grid, Label, Volume, surface};
    use typodont_exercise::catalog::{InstrumentTable, LengthUnitEntry, SampledEnd, ShapeEntry};

    #[test]
    fn an_instrument_is_drawn_from_its_mesh_or_else_by_its_outline() {
        // Aim: a broken file costs the picture, not the lesson, and is named.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        let mut entry = table.by_id("round_bur_018").unwrap().clone();
        let plain = procedural_instrument(&entry);
        entry.mesh = Some("bur.obj".into());
        let mut library = Library::empty();
        let (missing, complaint) = instrument_solid(&entry, &library);
        assert_eq!((missing.mesh, complaint.unwrap().code), (plain.mesh.clone(), "missing-file"));
        library.insert("bur.obj", b"v 0 0 0\nv 1 0 9\nv 0 1 9\nf 1 2 3\n".as_slice());
        let (drawn, complaint) = instrument_solid(&entry, &library);
        assert!(complaint.is_none() && drawn.mesh.triangles.len() == 1);
        library.insert("bur.obj", b"v 0 0".as_slice());
        let (broken, complaint) = instrument_solid(&entry, &library);
        assert_eq!(broken.mesh, plain.mesh);
        assert!(complaint.unwrap().headline().contains("bur.obj"));
    }

    #[test]
    fn a_shape_from_a_file_is_drawn_as_it_is_felt() {
        // Method: the surface of a ball is the picture; before it has been read there is none.
        let ball =
            Volume::from_distance(Grid::centred([40; 3], Vec3::splat(0.1)), 0.15, |p| (p.length() - 1.5, Label(1)));
        let surface = Arc::new(surface::extract(&ball));
        let mut shape = ShapeEntry {
            file: "ball.stl".into(),
            unit: LengthUnitEntry::Mm,
            position_mm: Default::default(),
            orientation_deg: Default::default(),
            cutting: None,
            sampled: None,
        };
        let mut entry = InstrumentTable::read(&Library::shipped()).unwrap().by_id("explorer").unwrap().clone();
        entry.end = WorkingEndEntry::Shape(shape.clone());
        assert!(procedural_instrument(&entry).mesh.is_empty());
        shape.sampled = Some(Arc::new(SampledEnd { body: Arc::new(Body::of_volume(&ball)), surface: surface.clone() }));
        entry.end = WorkingEndEntry::Shape(shape);
        assert_eq!(procedural_instrument(&entry).mesh, surface);
    }

    #[test]
    fn a_contra_angle_leads_to_the_operator_and_leaves_the_bur_free() {
        // Aim: handle and head are away from the work. Method: handle space of an upright handpiece has the operator at -y.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        assert!(contra_angle(table.by_id("explorer").unwrap()).is_none());
        let held = contra_angle(table.by_id("round_bur_014").unwrap()).unwrap();
        let mut lowest = f32::INFINITY;
        for (is_left_handed, side) in [(false, 1.0), (true, -1.0)] {
            let positions = &held.handpiece(is_left_handed).mesh.positions;
            lowest = positions.iter().map(|p| p.z).fold(lowest, f32::min);
            let end = positions.iter().copied().min_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
            assert!(end.y < -80.0 && end.z > 30.0 && side * end.x > 30.0, "left {is_left_handed}: {end}");
        }
        assert!(lowest > 8.0, "{lowest}");
        assert!(held.bur.mesh.positions.iter().all(|p| p.truncate().length() < 1.0 && p.z < lowest + 0.1));
    }

    #[test]
    fn a_burs_head_is_closed_above_its_flutes() {
        // Aim: nobody looks into a bur from below. Method: at the top of its head there is a corner on the axis.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        for name in ["pear_bur_330", "tapered_bur_169", "diamond_round_014", "flame_012"] {
            let entry = table.by_id(name).unwrap();
            let top = bur_profile(&entry.end).last().unwrap()[1];
            let held = contra_angle(entry).unwrap();
            let is_closed = |p: &Vec3| (p.z - top).abs() < 1e-4 && p.truncate().length() < 1e-4;
            assert!(held.bur.mesh.positions.iter().any(is_closed), "{name}");
        }
    }

    #[test]
    fn an_instruments_surface_faces_outward() {
        // Aim: lamps light the instrument, not its inside. Method: a closed surface that faces outward encloses a positive
        // volume; a straight one encloses that of a cylinder.
        let mesh = revolve(&[[0.0, 0.0], [1.0, 0.0], [1.0, 5.0], [0.0, 5.0]]);
        let expected = f64::from(PI) * 5.0;
        assert!((mesh.volume_mm3() / expected - 1.0).abs() < 0.01, "{}", mesh.volume_mm3());
        for (triangle, normal) in mesh.triangles.iter().map(|t| (t, mesh.normals[t[0] as usize])) {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(normal) >= 0.0);
        }
    }
}
