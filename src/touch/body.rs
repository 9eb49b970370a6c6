//! Working ends that are more than a point or a ball: any bur, any voxelised shape, with the shank behind it.
//!
//! Takes outlines or voxels. Gives signed distances, what cuts, and the shell of points by which touch feels it. Everything
//! is in handle space: +z along the shaft toward the hand, the origin where the device's tip is.

use super::profile::{Place, Profile, Station};
use crate::frame::Vec3;
use crate::volume::{Grid, ISO, Volume, distance, surface};
use std::f32::consts::{PI, TAU};

/// A working end with its shank.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    head: Head,
    /// Touches, never cuts.
    shank: Option<Profile>,
    shell: Vec<Node>,
    /// A ball about all of the shell.
    middle: Vec3,
    reach: f32,
}

/// The part that cuts, if the instrument does.
#[derive(Clone, Debug, PartialEq)]
enum Head {
    Turned { profile: Profile, table: Table },
    Voxels(Field),
}

/// Neck and shank above a bur's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shank {
    /// Diameter of the neck where it leaves the head, mm.
    pub neck: f32,
    /// Diameter of the shank, mm; ISO 1797: 1.6 for friction grip.
    pub diameter: f32,
    /// Height above the tip where the neck has become the shank, mm.
    pub begins: f32,
    /// Height above the tip up to which it can touch, mm: above is the handpiece.
    pub ends: f32,
}

impl Shank {
    /// Behind a head of a length and a diameter at its top: a neck of four fifths of that, which within 3 mm becomes a
    /// friction grip shank of 1.6 mm (ISO 1797, type 3). Makers' drawings differ by some tenths of a millimetre; what
    /// counts is where it begins to be in the way. Of the usual 19 mm about half stands out of the handpiece.
    pub fn friction_grip(top: f32, length: f32) -> Shank {
        let begins = length + 3.0;
        Shank { neck: 0.8 * top, diameter: 1.6, begins, ends: f32::max(begins + 1.0, 9.5) }
    }
}

/// Which part of an instrument a place belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    Head,
    Shank,
}

/// A point of the shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Handle space, mm.
    pub at: Vec3,
    /// Unit, out of the instrument.
    pub outward: Vec3,
    /// Unit, on the surface: along the outline.
    pub along: Vec3,
    /// Half of what the point stands for, along the outline and across it, mm.
    pub half: [f32; 2],
    pub region: Region,
}

/// Points that a shell should have: enough that what slips between two of them stays below what a hand resolves.
const POINTS: f32 = 500.0;

/// Widest and narrowest spacing of a shell, mm. Between points the surface is found by [`super::shell`]; it must only not
/// miss what lies there.
const APART: [f32; 2] = [0.08, 0.4];

/// How much coarser the shank is watched than the head: it is met rarely, and by large surfaces.
const SHANK_APART: f32 = 2.5;

impl Body {
    /// A bur: a body of revolution with its tip at the origin, and its shank.
    pub fn turned(profile: Profile, shank: Option<Shank>) -> Body {
        let [_, top] = profile.span();
        let apart = (surface_of(&profile) / POINTS).sqrt().clamp(APART[0], APART[1]);
        let shank = shank.map(|s| {
            let neck = Place { r: 0.5 * s.neck, z: top };
            Profile::shank(neck, Place { r: 0.5 * s.diameter, z: s.begins }, s.ends)
        });
        let mut shell = Vec::new();
        turn(&profile, Region::Head, apart, &mut shell);
        if let Some(shank) = &shank {
            turn(shank, Region::Shank, SHANK_APART * apart, &mut shell);
            // Where one part covers the other there is no surface.
            shell.retain(|node| match node.region {
                Region::Head => shank.distance(Place::of(node.at)) > -1e-4,
                Region::Shank => profile.distance(Place::of(node.at)) > 1e-3,
            });
        }
        let table = Table::of(&profile);
        Body::enclosed(Head::Turned { profile, table }, shank, shell)
    }

    /// Any shape: what is solid in a volume, whose own space becomes handle space. It may have hollows.
    pub fn of_volume(volume: &Volume) -> Body {
        let mesh = surface::extract(volume);
        let field = Field::of(volume);
        let area = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            0.5 * (b - a).cross(c - a).length()
        });
        let apart = (area.sum::<f32>() / POINTS).sqrt().max(0.5 * volume.grid().spacing.min_element());
        let mut shell: Vec<Node> = Vec::new();
        for (&at, &outward) in mesh.positions.iter().zip(&mesh.normals) {
            if shell.iter().all(|node| node.at.distance_squared(at) > 0.7 * apart * apart) {
                let along = outward.any_orthonormal_vector();
                shell.push(Node { at, outward, along, half: [0.6 * apart; 2], region: Region::Head });
            }
        }
        Body::enclosed(Head::Voxels(field), None, shell)
    }

    /// A hand instrument: what is solid in a volume cuts or presses, the shaft on the axis behind it only touches.
    pub fn of_end(volume: &Volume, shank: Shank) -> Body {
        let Body { head, mut shell, .. } = Body::of_volume(volume);
        let [low, high] = volume.grid().extent();
        let foot = Place { r: 0.5 * shank.neck, z: 0.5 * (low.z + high.z) };
        let shaft = Profile::shank(foot, Place { r: 0.5 * shank.diameter, z: shank.begins }, shank.ends);
        let apart = SHANK_APART * (surface_of(&shaft) / POINTS).sqrt().clamp(APART[0], APART[1]);
        let inside = |at: Vec3| if let Head::Voxels(field) = &head { field.distance(at) } else { f32::INFINITY };
        shell.retain(|node| shaft.distance(Place::of(node.at)) > -1e-4);
        let mut behind = Vec::new();
        turn(&shaft, Region::Shank, apart, &mut behind);
        shell.extend(behind.into_iter().filter(|node| inside(node.at) > 1e-3));
        Body::enclosed(head, Some(shaft), shell)
    }

    fn enclosed(head: Head, shank: Option<Profile>, shell: Vec<Node>) -> Body {
        let low = shell.iter().map(|n| n.at).fold(Vec3::splat(f32::INFINITY), Vec3::min);
        let high = shell.iter().map(|n| n.at).fold(Vec3::splat(f32::NEG_INFINITY), Vec3::max);
        let middle = if shell.is_empty() { Vec3::ZERO } else { 0.5 * (low + high) };
        let reach = shell.iter().map(|n| n.at.distance(middle)).fold(0.0, f32::max);
        Body { head, shank, shell, middle, reach }
    }

    /// The points by which it is felt.
    pub fn shell(&self) -> &[Node] {
        &self.shell
    }

    /// Middle (handle space) and radius of a ball that holds the shell, mm.
    pub fn enclosing_ball(&self) -> (Vec3, f32) {
        (self.middle, self.reach)
    }

    /// Signed distance in mm (negative inside) of a point of handle space from the part that cuts.
    ///
    /// Good to a micrometre or two within half a millimetre of its surface.
    #[inline]
    pub fn head_distance(&self, point_in_handle: Vec3) -> f32 {
        match &self.head {
            Head::Turned { profile, table } => {
                let at = Place::of(point_in_handle);
                table.distance(at).unwrap_or_else(|| profile.distance(at))
            }
            Head::Voxels(field) => field.distance(point_in_handle),
        }
    }

    /// The cylinder about the shaft that holds the part that cuts: radius, lowest and highest z; mm.
    pub fn head_cylinder(&self) -> (f32, [f32; 2]) {
        match &self.head {
            Head::Turned { profile, .. } => (profile.radius(), profile.span()),
            Head::Voxels(field) => {
                let [low, high] = field.grid.extent();
                let aside = low.abs().max(high.abs());
                (Place::of(aside).r, [low.z, high.z])
            }
        }
    }

    /// Radius of the face that presses along the shaft, mm.
    pub(super) fn face_radius(&self) -> f32 {
        match &self.head {
            Head::Turned { profile, .. } => profile.radius(),
            Head::Voxels(field) => {
                // The face is what is narrowest; the grid is a little larger than its end.
                let [low, high] = field.grid.extent();
                let margin = 4.0 * field.grid.spacing.max_element();
                (high.x.min(high.y).min(-low.x).min(-low.y) - margin).max(0.0)
            }
        }
    }

    /// Greatest distance of the cutting part from its shaft, mm; 0 where it has none.
    pub fn head_radius(&self) -> f32 {
        match &self.head {
            Head::Turned { profile, .. } => profile.radius(),
            Head::Voxels(_) => 0.0,
        }
    }

    /// The place on a region's surface nearest to a point of handle space, and the outward normal there.
    pub(super) fn on_surface(&self, point_in_handle: Vec3, region: Region) -> (Vec3, Vec3) {
        let turned = |profile: &Profile| {
            let (on, normal) = profile.onto(Place::of(point_in_handle));
            (on.beside(point_in_handle), normal.beside(point_in_handle))
        };
        match (region, &self.head, &self.shank) {
            (Region::Shank, _, Some(shank)) => turned(shank),
            (_, Head::Turned { profile, .. }, _) => turned(profile),
            (_, Head::Voxels(field), _) => field.on_surface(point_in_handle),
        }
    }
}

/// Area of a body of revolution, mm², summed over its stations.
fn surface_of(profile: &Profile) -> f32 {
    profile.stations(0.1).iter().map(|s| TAU * s.on.r * s.spacing).sum()
}

/// Turns an outline's stations about the axis.
fn turn(profile: &Profile, region: Region, apart: f32, shell: &mut Vec<Node>) {
    for (ring, Station { on, normal, spacing }) in profile.stations(apart).into_iter().enumerate() {
        // Where a ring is wide a chord between its points dips below the surface; where it is narrow six points suffice.
        let count = (TAU * on.r / apart).ceil().max(if on.r < 0.02 { 1.0 } else { 6.0 }) as usize;
        for i in 0..count {
            // Every other ring is turned by half a step.
            let angle = TAU * (i as f32 + 0.5 * (ring % 2) as f32) / count as f32;
            let beside = Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0);
            let lift = |p: Place| beside * p.r + Vec3::Z * p.z;
            shell.push(Node {
                at: lift(on),
                outward: lift(normal),
                along: lift(Place { r: -normal.z, z: normal.r }),
                half: [0.6 * spacing, 0.6 * (TAU * on.r / count as f32).min(PI * on.r).max(0.02)],
                region,
            });
        }
    }
}

/// Distances around an outline, so that cutting a voxel costs one look-up.
#[derive(Clone, Debug, PartialEq)]
struct Table {
    low_z: f32,
    count_r: u32,
    count_z: u32,
    distances: Vec<f32>,
}

/// Distance between a table's entries, mm: at an edge of 0.05 mm they are right to 1 µm.
const STEP: f32 = 0.02;

/// How far around the outline a table reaches, mm: as far as the surfaces of coarse volumes are wide.
const MARGIN: f32 = 0.45;

impl Table {
    fn of(profile: &Profile) -> Table {
        let [low, high] = profile.span();
        let low_z = low - MARGIN;
        let count_r = ((profile.radius() + MARGIN) / STEP).ceil() as u32 + 2;
        let count_z = ((high - low + 2.0 * MARGIN) / STEP).ceil() as u32 + 2;
        let place = |i: u32, j: u32| Place { r: i as f32 * STEP, z: low_z + j as f32 * STEP };
        let distances = (0..count_z).flat_map(|j| (0..count_r).map(move |i| profile.distance(place(i, j)))).collect();
        Table { low_z, count_r, count_z, distances }
    }

    /// `None` beyond the table.
    #[inline]
    fn distance(&self, at: Place) -> Option<f32> {
        let (r, z) = (at.r * (1.0 / STEP), (at.z - self.low_z) * (1.0 / STEP));
        if !(z >= 0.0 && z < (self.count_z - 1) as f32 && r < (self.count_r - 1) as f32) {
            return None;
        }
        // By way of `i32`: one instruction there and one back.
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

/// Signed distances on a grid in handle space.
#[derive(Clone, Debug, PartialEq)]
struct Field {
    grid: Grid,
    distances: Vec<f32>,
}

impl Field {
    fn of(volume: &Volume) -> Field {
        let grid = *volume.grid();
        let far = distance::signed(&grid, |i| volume.densities()[i].is_solid());
        // Near the surface the density ramp tells the distance better than whole voxels do.
        let near = |i: usize| (ISO - volume.densities()[i].unit()) * 2.0 * volume.band();
        let is_told = |i: usize| (0.02..0.98).contains(&volume.densities()[i].unit());
        let distances = far.iter().enumerate().map(|(i, &far)| if is_told(i) { near(i) } else { far }).collect();
        Field { grid, distances }
    }

    /// Trilinear; beyond the grid the distance to it is added.
    fn distance(&self, point_in_handle: Vec3) -> f32 {
        let [low, high] = self.grid.extent();
        let inside = point_in_handle.clamp(low, high);
        self.grid.mixed(&self.distances, inside) + inside.distance(point_in_handle)
    }

    fn slope(&self, point_in_handle: Vec3) -> Vec3 {
        let step = 0.5 * self.grid.spacing.min_element();
        let along =
            |axis: Vec3| self.distance(point_in_handle + axis * step) - self.distance(point_in_handle - axis * step);
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)).normalize_or_zero()
    }

    fn on_surface(&self, point_in_handle: Vec3) -> (Vec3, Vec3) {
        let mut on = point_in_handle;
        for _ in 0..2 {
            on -= self.slope(on) * self.distance(on);
        }
        (on, self.slope(on))
    }
}
