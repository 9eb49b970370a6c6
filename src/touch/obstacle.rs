//! A closed mesh that can be touched but never carved: gum, a jaw, a clamp.
//!
//! Takes triangles once. Gives how far a point is from them, and every place where a ball about it would meet them. The only
//! file that knows the collision library. The same bits on every machine; a query never allocates.

use crate::frame::Vec3;
use crate::mesh::Mesh;
use parry3d::math::Vector;
use parry3d::query::{PointQuery, PointQueryWithLocation};
use parry3d::shape::{TriMesh, TriMeshFlags, TrianglePointLocation};

/// Places of one mesh that a ball may meet at once. A fissure gives two, a corner three; noise some more.
pub(super) const MEETINGS_MAX: usize = 8;

/// A surface is still met from outside when a point has sunk into it by less than this, mm: what tolerances add up to.
/// Far below the thinnest gum, so that a sheet's other side is not mistaken for this one.
const SKIN: f32 = 0.02;

/// Nearer than this, mm, the direction to a surface is noise and the surface's own normal is taken.
const CLOSE: f32 = 1e-3;

/// Cosine up to which two directions count as square to each other. Flat neighbours must not hide their common edge.
const SQUARE: f32 = 1e-3;

/// A closed surface facing outward, mm, about its own origin.
#[derive(Clone)]
pub struct Obstacle {
    surface: TriMesh,
    /// For each triangle, the corner that lies beyond its edges 01, 12 and 20.
    beyond: Vec<[u32; 3]>,
    /// The corners joined to corner `v` by an edge: `spokes[first[v]..first[v + 1]]`.
    spokes: Vec<u32>,
    first: Vec<u32>,
}

impl std::fmt::Debug for Obstacle {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Obstacle of {} triangles", self.beyond.len())
    }
}

/// Where a surface is met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meeting {
    /// Signed, mm, from the point to the surface; negative inside.
    pub distance: f32,
    /// Unit, out of the matter.
    pub normal: Vec3,
}

impl Obstacle {
    /// `None` for a surface without triangles, or one that is not closed: every edge needs exactly two triangles that run
    /// along it in opposite directions.
    pub fn new(mesh: &Mesh) -> Option<Obstacle> {
        let corners = mesh.positions.iter().map(|p| to_library(*p)).collect::<Vec<_>>();
        // Every directed edge with the corner that its triangle has beside it.
        let mut edges: Vec<([u32; 2], u32)> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [([a, b], c), ([b, c], a), ([c, a], b)]).collect();
        edges.sort_unstable();
        if edges.windows(2).any(|w| w[0].0 == w[1].0) {
            return None;
        }
        let across = |from: u32, to: u32| {
            edges.binary_search_by(|(edge, _)| edge.cmp(&[to, from])).ok().map(|place| edges[place].1)
        };
        let beyond = mesh.triangles.iter().map(|&[a, b, c]| Some([across(a, b)?, across(b, c)?, across(c, a)?]));
        let beyond = beyond.collect::<Option<Vec<_>>>()?;
        let spokes = edges.iter().map(|([_, to], _)| *to).collect();
        let first =
            (0..=corners.len() as u32).map(|v| edges.partition_point(|([from, _], _)| *from < v) as u32).collect();
        let surface = TriMesh::with_flags(corners, mesh.triangles.clone(), TriMeshFlags::ORIENTED).ok()?;
        Some(Obstacle { surface, beyond, spokes, first })
    }

    /// Its triangles, without normals.
    pub fn mesh(&self) -> Mesh {
        let positions = self.surface.vertices().iter().map(|v| from_library(*v)).collect();
        Mesh { positions, normals: Vec::new(), triangles: self.surface.indices().to_vec() }
    }

    /// Signed distance of a point from the surface, mm; negative inside.
    pub fn distance(&self, point: Vec3) -> f32 {
        let (place, triangle, location) = self.nearest_place(point);
        let out = point - place;
        if out.dot(self.facing(triangle, location)) < 0.0 { -out.length() } else { out.length() }
    }

    /// The nearest place of the surface.
    pub(super) fn nearest(&self, point: Vec3) -> Meeting {
        let (place, triangle, location) = self.nearest_place(point);
        self.meeting(point, place, triangle, location)
    }

    fn nearest_place(&self, point: Vec3) -> (Vec3, u32, TrianglePointLocation) {
        let (projection, (triangle, location)) =
            self.surface.project_local_point_and_get_location(to_library(point), false);
        (from_library(projection.point), triangle, location)
    }

    /// Every place of the surface that is nearer than all its surroundings, up to a distance, the nearest
    /// [`MEETINGS_MAX`] of them: where a ball about the point would meet it.
    pub(super) fn meet(&self, point: Vec3, within: f32, mut each: impl FnMut(Meeting)) {
        let (way_out, triangle, location) = self.nearest_place(point);
        let nearest = self.meeting(point, way_out, triangle, location);
        let is_inside = nearest.distance < -SKIN;
        let mut found = [Meeting { distance: f32::INFINITY, normal: Vec3::ZERO }; MEETINGS_MAX];
        let mut count = 0;
        let at = to_library(point);
        for triangle in self.surface.bvh().leaves(|node| node.aabb().distance_to_local_point(at, true) < within) {
            let (projection, location) =
                self.surface.triangle(triangle).project_local_point_and_get_location(at, false);
            let place = from_library(projection.point);
            if point.distance_squared(place) >= within * within
                || !self.is_nearest_around(point, place, triangle, location)
            {
                continue;
            }
            let meeting = self.meeting(point, place, triangle, location);
            // Neighbours tell of the same edge or corner; a surface that faces away lies behind matter. Inside, the nearest place is the way out, and every other would hold the point in.
            let is_hidden = if is_inside { place.distance(way_out) > CLOSE } else { meeting.distance < -SKIN };
            if is_hidden || found[..count].iter().any(|m| is_same(m, &meeting)) {
                continue;
            }
            match found[..count].iter().enumerate().max_by(|a, b| a.1.distance.total_cmp(&b.1.distance)) {
                Some((farthest, m)) if count == MEETINGS_MAX => {
                    if meeting.distance < m.distance {
                        found[farthest] = meeting;
                    }
                }
                _ => {
                    found[count] = meeting;
                    count += 1;
                }
            }
        }
        if count == 0 && nearest.distance < within {
            (found[0], count) = (nearest, 1);
        }
        found[..count].iter().for_each(|m| each(*m));
    }

    /// True when the surface leads nowhere nearer to the point from a triangle's nearest place.
    fn is_nearest_around(&self, point: Vec3, place: Vec3, triangle: u32, location: TrianglePointLocation) -> bool {
        let out = point - place;
        if out.length() < CLOSE {
            return true;
        }
        let leads_nearer = |corner: u32| {
            let way = from_library(self.surface.vertices()[corner as usize]) - place;
            out.dot(way) > SQUARE * out.length() * way.length()
        };
        match location {
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => true,
            TrianglePointLocation::OnEdge(edge, _) => !leads_nearer(self.beyond[triangle as usize][edge as usize]),
            TrianglePointLocation::OnVertex(corner) => {
                let corner = self.surface.indices()[triangle as usize][corner as usize] as usize;
                let spokes = self.first[corner] as usize..self.first[corner + 1] as usize;
                !self.spokes[spokes].iter().any(|&to| leads_nearer(to))
            }
        }
    }

    fn meeting(&self, point: Vec3, place: Vec3, triangle: u32, location: TrianglePointLocation) -> Meeting {
        let out = point - place;
        let facing = self.facing(triangle, location);
        let length = out.length();
        let is_on_face = matches!(location, TrianglePointLocation::OnFace(..));
        if is_on_face || length < CLOSE || out.dot(facing) < 0.0 {
            // From inside, an edge is met only where the surface is hollow: there each of its faces holds for itself.
            let normal = self.normal(triangle);
            return Meeting { distance: out.dot(normal), normal };
        }
        Meeting { distance: length, normal: out / length }
    }

    fn normal(&self, triangle: u32) -> Vec3 {
        from_library(self.surface.triangle(triangle).scaled_normal()).try_normalize().unwrap_or(Vec3::Z)
    }

    /// The surface's outward normal at a place: on an edge or a corner the mean of its faces' (Bærentzen & Aanæs 2005).
    fn facing(&self, triangle: u32, location: TrianglePointLocation) -> Vec3 {
        let index = triangle as usize;
        let means = self.surface.pseudo_normals();
        let mean = match (location, means) {
            (TrianglePointLocation::OnEdge(edge, _), Some(means)) => means.edges_pseudo_normal[index][edge as usize],
            (TrianglePointLocation::OnVertex(corner), Some(means)) => {
                means.vertices_pseudo_normal[self.surface.indices()[index][corner as usize] as usize]
            }
            _ => return self.normal(triangle),
        };
        from_library(mean).try_normalize().unwrap_or(Vec3::Z)
    }
}

/// Two meetings that hold a ball alike.
fn is_same(a: &Meeting, b: &Meeting) -> bool {
    (a.distance - b.distance).abs() < 1e-5 && a.normal.dot(b.normal) > 1.0 - 1e-6
}

fn to_library(point: Vec3) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

fn from_library(point: Vector) -> Vec3 {
    Vec3::new(point.x, point.y, point.z)
}
