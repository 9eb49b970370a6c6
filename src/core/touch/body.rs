//! Working ends other than a point or a ball: burs of any profile and sampled shapes, with their shank.
//!
//! Takes profiles, volumes or sampled shapes. Gives signed distances of the cutting part, and surface points for contact
//! queries. All coordinates are in handle space: +z along the shaft toward the hand, the origin at the tip of the
//! device.

use super::profile::{Profile, ProfilePoint, ProfileSample, StraightSide};
use super::sampled_shape::SampledShape;
use crate::aabb::Aabb;
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::volume::{Volume, surface};
use std::f32::consts::{PI, TAU};
use std::ops::Range;

/// Working end with its shank.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    head: HeadGeometry,
    /// Makes contact, never cuts.
    shank: Option<ShankGeometry>,
    surface_points: Vec<BodySurfacePoint>,
    chunks: Vec<PointChunk>,
    /// Centre of a sphere around all surface points, handle space.
    centre: Vec3,
    bounding_radius: f32,
}

/// Part that cuts, if the instrument cuts.
#[derive(Clone, Debug, PartialEq)]
enum HeadGeometry {
    Revolved { profile: Profile, table: ProfileTable },
    Sampled(SampledShape),
}

/// Part that makes contact but never cuts.
#[derive(Clone, Debug, PartialEq)]
enum ShankGeometry {
    Revolved(Profile),
    /// The whole instrument, of which the head is a part.
    Whole(SampledShape),
}

/// Neck and shank above the head of a bur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shank {
    /// Diameter of the neck at the top of the head, mm.
    pub neck: f32,
    /// Diameter of the shank, mm; 1.6 for friction grip (ISO 1797).
    pub diameter: f32,
    /// Height above the tip at which the taper from the neck reaches the shank diameter, mm.
    pub begins: f32,
    /// Height above the tip at which the handpiece begins, mm; nothing above it makes contact.
    pub ends: f32,
}

impl Shank {
    /// Friction-grip shank behind a head of the given length and diameter at its top, mm: a neck of four fifths of
    /// that diameter, which within 3 mm widens to 1.6 mm (ISO 1797, type 3). Makers' drawings differ by some tenths
    /// of a millimetre; what matters is the height at which the shank gets in the way. Of the usual 19 mm about half
    /// protrudes from the handpiece.
    pub fn friction_grip(top: f32, length: f32) -> Shank {
        let begins = length + 3.0;
        Shank { neck: 0.8 * top, diameter: 1.6, begins, ends: f32::max(begins + 1.0, 9.5) }
    }
}

/// Region of an instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyRegion {
    Head,
    Shank,
}

/// Sample point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySurfacePoint {
    /// Handle space, mm.
    pub position: Vec3,
    /// Unit normal, out of the instrument.
    pub outward: Vec3,
    /// Unit tangent along the profile.
    pub along: Vec3,
    /// Half the extent of the surface patch around the point, along the profile and across it, mm.
    pub half_extent: [f32; 2],
    pub region: BodyRegion,
}

/// Consecutive surface points per [`PointChunk`]. They lie near each other, so that one comparison skips the whole chunk
/// while none of them can be in contact.
pub(super) const CHUNK: usize = 16;

/// Consecutive surface points and a sphere around them; handle space, mm.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PointChunk {
    /// Indices of the points.
    pub points: Range<usize>,
    pub centre: Vec3,
    pub radius: f32,
}

/// Target number of surface points: enough that whatever slips between two of them stays below what a hand can
/// resolve.
const TARGET_POINTS: f32 = 500.0;

/// Smallest and largest spacing of surface points, mm. Between points, `body_contacts` finds the contact; the points
/// must only not miss what lies there.
const POINT_SPACING: [f32; 2] = [0.08, 0.4];

/// Factor by which the shank is sampled more coarsely than the head: it is met rarely, and by large surfaces.
const SHANK_SPACING_FACTOR: f32 = 2.5;

impl Body {
    /// Creates a bur: a body of revolution with its tip at the origin, and its shank.
    pub fn revolved(profile: Profile, shank: Option<Shank>) -> Body {
        let [_, top] = profile.span();
        let spacing = (revolution_area(&profile) / TARGET_POINTS).sqrt().clamp(POINT_SPACING[0], POINT_SPACING[1]);
        let shank = shank.map(|s| {
            let neck = ProfilePoint { r: 0.5 * s.neck, z: top };
            Profile::shank(neck, ProfilePoint { r: 0.5 * s.diameter, z: s.begins }, s.ends)
        });
        let mut points = Vec::new();
        sample_revolution(&profile, BodyRegion::Head, spacing, &mut points);
        if let Some(shank) = &shank {
            sample_revolution(shank, BodyRegion::Shank, SHANK_SPACING_FACTOR * spacing, &mut points);
            // No surface remains inside the other part.
            points.retain(|node| match node.region {
                BodyRegion::Head => shank.distance(ProfilePoint::of(node.position)) > -1e-4,
                BodyRegion::Shank => profile.distance(ProfilePoint::of(node.position)) > 1e-3,
            });
        }
        let table = ProfileTable::of(&profile);
        Body::enclosed(HeadGeometry::Revolved { profile, table }, shank.map(ShankGeometry::Revolved), points)
    }

    /// Creates a working end from the solid part of a volume, whose coordinates become handle space. The shape may be
    /// concave.
    pub fn of_volume(volume: &Volume) -> Body {
        let mesh = surface::extract(volume);
        let field = SampledShape::of_volume(volume);
        let area = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        });
        let spacing = (area.sum::<f32>() / TARGET_POINTS).sqrt().max(0.5 * volume.grid().spacing.min_element());
        let points = spread_over(&mesh, |_| spacing, |_, _| true, |_| BodyRegion::Head);
        Body::enclosed(HeadGeometry::Sampled(field), None, points)
    }

    /// Creates an instrument of any shape in handle space. `cutting` is the part of it that cuts, if not the whole.
    pub fn sampled(shape: SampledShape, cutting: Option<SampledShape>) -> Body {
        let mesh = shape.surface();
        let spacing = graded_spacing(&mesh, shape.grid().spacing.min_element());
        let edge = 0.5 * shape.grid().spacing.max_element();
        let is_beside = |at: Vec3| cutting.as_ref().is_some_and(|part| part.distance(at) > edge);
        let region = |at: Vec3| if is_beside(at) { BodyRegion::Shank } else { BodyRegion::Head };
        // A thin part keeps points on both of its faces.
        let is_same_face = |node: &BodySurfacePoint, outward: Vec3| node.outward.dot(outward) > 0.0;
        let points = spread_over(&mesh, spacing, is_same_face, region);
        match cutting {
            None => Body::enclosed(HeadGeometry::Sampled(shape), None, points),
            Some(part) => Body::enclosed(HeadGeometry::Sampled(part), Some(ShankGeometry::Whole(shape)), points),
        }
    }

    /// Creates a hand instrument: the solid part of a volume cuts or presses; the shaft on the axis behind it only
    /// makes contact.
    pub fn with_shaft(volume: &Volume, shank: Shank) -> Body {
        let Body { head, surface_points: mut shell, .. } = Body::of_volume(volume);
        let Aabb { low, high } = volume.grid().extent();
        let foot = ProfilePoint { r: 0.5 * shank.neck, z: 0.5 * (low.z + high.z) };
        let shaft = Profile::shank(foot, ProfilePoint { r: 0.5 * shank.diameter, z: shank.begins }, shank.ends);
        let spacing = SHANK_SPACING_FACTOR
            * (revolution_area(&shaft) / TARGET_POINTS).sqrt().clamp(POINT_SPACING[0], POINT_SPACING[1]);
        let inside =
            |at: Vec3| if let HeadGeometry::Sampled(field) = &head { field.distance(at) } else { f32::INFINITY };
        shell.retain(|node| shaft.distance(ProfilePoint::of(node.position)) > -1e-4);
        let mut shaft_points = Vec::new();
        sample_revolution(&shaft, BodyRegion::Shank, spacing, &mut shaft_points);
        shell.extend(shaft_points.into_iter().filter(|node| inside(node.position) > 1e-3));
        Body::enclosed(head, Some(ShankGeometry::Revolved(shaft)), shell)
    }

    fn enclosed(head: HeadGeometry, shank: Option<ShankGeometry>, surface_points: Vec<BodySurfacePoint>) -> Body {
        let (centre, bounding_radius) = enclosing_sphere(&surface_points);
        let chunks = surface_points.chunks(CHUNK).enumerate().map(|(index, points)| {
            let (centre, radius) = enclosing_sphere(points);
            PointChunk { points: index * CHUNK..index * CHUNK + points.len(), centre, radius }
        });
        Body { head, shank, chunks: chunks.collect(), surface_points, centre, bounding_radius }
    }

    /// Sample points of the surface, for contact queries.
    pub fn surface_points(&self) -> &[BodySurfacePoint] {
        &self.surface_points
    }

    /// Surface points in chunks of [`CHUNK`].
    pub(super) fn chunks(&self) -> &[PointChunk] {
        &self.chunks
    }

    /// Centre (handle space) and radius of a sphere that contains all surface points, mm.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        (self.centre, self.bounding_radius)
    }

    /// Signed distance in mm (negative inside) of a point in handle space from the cutting part.
    ///
    /// Accurate to 1–2 µm within half a millimetre of the surface of a bur.
    #[inline]
    pub fn head_distance(&self, point_in_handle: Vec3) -> f32 {
        match &self.head {
            HeadGeometry::Revolved { profile, table } => {
                let at = ProfilePoint::of(point_in_handle);
                table.distance(at).unwrap_or_else(|| profile.distance(at))
            }
            HeadGeometry::Sampled(field) => field.distance(point_in_handle),
        }
    }

    /// Cylinder about the shaft that contains the cutting part: radius, lowest and highest z; mm.
    pub fn head_cylinder(&self) -> (f32, [f32; 2]) {
        match &self.head {
            HeadGeometry::Revolved { profile, .. } => (profile.radius(), profile.span()),
            HeadGeometry::Sampled(field) => {
                let Aabb { low, high } = field.grid().extent();
                let aside = low.abs().max(high.abs());
                (ProfilePoint::of(aside).r, [low.z, high.z])
            }
        }
    }

    /// Straight part of the side of the cutting part, if it is a body of revolution that has one.
    pub(super) fn straight_side(&self) -> Option<StraightSide> {
        match &self.head {
            HeadGeometry::Revolved { profile, .. } => {
                let side = profile.straight_side()?;
                // The table mixes what is on both sides of a border within one step.
                let z = [side.z[0] + TABLE_STEP, side.z[1] - TABLE_STEP];
                (z[0] < z[1]).then_some(StraightSide { z, ..side })
            }
            HeadGeometry::Sampled(_) => None,
        }
    }

    /// Radius of the face that presses along the shaft, mm.
    pub(super) fn face_radius(&self) -> f32 {
        match &self.head {
            HeadGeometry::Revolved { profile, .. } => profile.radius(),
            HeadGeometry::Sampled(field) => {
                // Narrowest half-width of the grid, less the margin by which the grid exceeds the shape.
                let Aabb { low, high } = field.grid().extent();
                let margin = 4.0 * field.grid().spacing.max_element();
                (high.x.min(high.y).min(-low.x).min(-low.y) - margin).max(0.0)
            }
        }
    }

    /// Greatest distance of the cutting part from the axis, mm; 0 for a sampled shape.
    pub fn head_radius(&self) -> f32 {
        match &self.head {
            HeadGeometry::Revolved { profile, .. } => profile.radius(),
            HeadGeometry::Sampled(_) => 0.0,
        }
    }

    /// Returns the point on a region's surface nearest to a point in handle space, and the outward normal there.
    pub(super) fn project_to_surface(&self, point_in_handle: Vec3, region: BodyRegion) -> (Vec3, Vec3) {
        let on_profile = |profile: &Profile| {
            let (on, normal) = profile.closest(ProfilePoint::of(point_in_handle));
            (on.lift_beside(point_in_handle), normal.lift_beside(point_in_handle))
        };
        match (region, &self.head, &self.shank) {
            // The head has no surface of its own where it ends within the whole.
            (_, _, Some(ShankGeometry::Whole(whole))) => whole.project_to_surface(point_in_handle),
            (BodyRegion::Shank, _, Some(ShankGeometry::Revolved(shank))) => on_profile(shank),
            (_, HeadGeometry::Revolved { profile, .. }, _) => on_profile(profile),
            (_, HeadGeometry::Sampled(field), _) => field.project_to_surface(point_in_handle),
        }
    }
}

/// Distance from the tip, mm, at which surface points of a sampled shape are twice as far apart as at the tip: what is
/// far from the tip is met rarely.
const GRADING: f32 = 4.0;

/// Spacing of surface points by their position, mm, that gives [`TARGET_POINTS`] points on a surface with a given voxel
/// size.
fn graded_spacing(mesh: &Mesh, voxel: f32) -> impl Fn(Vec3) -> f32 + use<> {
    let grade = |at: Vec3| 1.0 + at.length() / GRADING;
    let patch = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length() / grade((a + b + c) / 3.0).powi(2)
    };
    let at_tip = (mesh.triangles.iter().map(patch).sum::<f32>() / TARGET_POINTS).sqrt();
    let at_tip = at_tip.max(POINT_SPACING[0]).max(0.5 * voxel);
    move |at| at_tip * grade(at)
}

/// Spreads surface points over a fine mesh at a spacing, mm. A point stands for the surface around it where `covers` holds
/// for it and the outward normal there.
fn spread_over(
    mesh: &Mesh,
    spacing: impl Fn(Vec3) -> f32,
    covers: impl Fn(&BodySurfacePoint, Vec3) -> bool,
    region: impl Fn(Vec3) -> BodyRegion,
) -> Vec<BodySurfacePoint> {
    let mut points: Vec<BodySurfacePoint> = Vec::new();
    for (&at, &outward) in mesh.positions.iter().zip(&mesh.normals) {
        let spacing = spacing(at);
        let is_covered = |node: &BodySurfacePoint| {
            node.position.distance_squared(at) <= 0.7 * spacing * spacing && covers(node, outward)
        };
        if !points.iter().any(is_covered) {
            let along = outward.any_orthonormal_vector();
            let half_extent = [0.6 * spacing; 2];
            points.push(BodySurfacePoint { position: at, outward, along, half_extent, region: region(at) });
        }
    }
    points
}

/// Centre and radius of a sphere around surface points, mm.
fn enclosing_sphere(points: &[BodySurfacePoint]) -> (Vec3, f32) {
    let low = points.iter().map(|n| n.position).fold(Vec3::splat(f32::INFINITY), Vec3::min);
    let high = points.iter().map(|n| n.position).fold(Vec3::splat(f32::NEG_INFINITY), Vec3::max);
    let centre = if points.is_empty() { Vec3::ZERO } else { 0.5 * (low + high) };
    (centre, points.iter().map(|n| n.position.distance(centre)).fold(0.0, f32::max))
}

/// Area of a body of revolution, mm², summed over the samples of its profile.
fn revolution_area(profile: &Profile) -> f32 {
    profile.samples(0.1).iter().map(|s| TAU * s.point.r * s.spacing).sum()
}

/// Adds surface points by rotating the samples of a profile about the axis.
fn sample_revolution(profile: &Profile, region: BodyRegion, apart: f32, points: &mut Vec<BodySurfacePoint>) {
    for (ring, ProfileSample { point: on, normal, spacing }) in profile.samples(apart).into_iter().enumerate() {
        // On a wide ring the chord between two points must not dip below the surface; on a narrow one six points
        // suffice.
        let count = (TAU * on.r / apart).ceil().max(if on.r < 0.02 { 1.0 } else { 6.0 }) as usize;
        for i in 0..count {
            // Alternate rings are rotated by half a step.
            let angle = TAU * (i as f32 + 0.5 * (ring % 2) as f32) / count as f32;
            let beside = Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0);
            let lift = |p: ProfilePoint| beside * p.r + Vec3::Z * p.z;
            points.push(BodySurfacePoint {
                position: lift(on),
                outward: lift(normal),
                along: lift(ProfilePoint { r: -normal.z, z: normal.r }),
                half_extent: [0.6 * spacing, 0.6 * (TAU * on.r / count as f32).min(PI * on.r).max(0.02)],
                region,
            });
        }
    }
}

/// Distances around a profile, tabulated so that cutting a voxel costs one look-up.
#[derive(Clone, Debug, PartialEq)]
struct ProfileTable {
    low_z: f32,
    count_r: u32,
    count_z: u32,
    distances: Vec<f32>,
}

/// Step of the table, mm: at an edge of 0.05 mm radius the distances are accurate to 1 µm.
const TABLE_STEP: f32 = 0.02;

/// Margin of the table around the profile, mm: as wide as the surface band of coarse volumes.
const TABLE_MARGIN: f32 = 0.45;

impl ProfileTable {
    fn of(profile: &Profile) -> ProfileTable {
        let [low, high] = profile.span();
        let low_z = low - TABLE_MARGIN;
        let count_r = ((profile.radius() + TABLE_MARGIN) / TABLE_STEP).ceil() as u32 + 2;
        let count_z = ((high - low + 2.0 * TABLE_MARGIN) / TABLE_STEP).ceil() as u32 + 2;
        let place = |i: u32, j: u32| ProfilePoint { r: i as f32 * TABLE_STEP, z: low_z + j as f32 * TABLE_STEP };
        let distances = (0..count_z).flat_map(|j| (0..count_r).map(move |i| profile.distance(place(i, j)))).collect();
        ProfileTable { low_z, count_r, count_z, distances }
    }

    /// Distance from the table, mm; `None` beyond the table.
    #[inline]
    fn distance(&self, at: ProfilePoint) -> Option<f32> {
        let (r, z) = (at.r * (1.0 / TABLE_STEP), (at.z - self.low_z) * (1.0 / TABLE_STEP));
        if !(z >= 0.0 && z < (self.count_z - 1) as f32 && r < (self.count_r - 1) as f32) {
            return None;
        }
        // Converting by way of `i32` takes one instruction each way.
        let (i, j) = (r as i32, z as i32);
        let (fr, fz) = (r - i as f32, z - j as f32);
        let row = self.count_r as usize;
        let corner = j as usize * row + i as usize;
        let low = self.distances.get(corner..corner + 2)?;
        let high = self.distances.get(corner + row..corner + row + 2)?;
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        Some(mix(mix(low[0], low[1], fr), mix(high[0], high[1], fr), fz))
    }
}
