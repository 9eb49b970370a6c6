//! Closed mesh as a collider that is never cut: gum, a jaw, a clamp.
//!
//! Takes triangles once. Gives the signed distance of a point, and every contact of a ball around it. Only this file
//! uses the collision library. Gives the same bits on every machine; a query never allocates.

use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::volume::solid::Triangle;
use parry3d::math::Vector;
use parry3d::query::{PointQuery, PointQueryWithLocation};
use parry3d::shape::{TriMesh, TriMeshFlags, TrianglePointLocation};

/// Maximum number of contacts of one ball with one mesh. A fissure gives two, a corner three, a noisy surface some
/// more.
pub(super) const MESH_CONTACTS_MAX: usize = 8;

/// Depth below the surface up to which a point still counts as outside, mm: the sum of all tolerances. Far below the
/// thickness of the thinnest gum, so that the far side of a sheet is not mistaken for the near one.
const SKIN: f32 = 0.02;

/// Distance below which the direction to the surface is unreliable, mm; the normal of the surface is used instead.
const COINCIDENT: f32 = 1e-3;

/// Cosine below which two directions count as perpendicular. Coplanar neighbours must not hide their common edge.
const PERPENDICULAR_COSINE: f32 = 1e-3;

/// Closed surface facing outward, mm, in its own coordinates.
#[derive(Clone)]
pub struct ClosedMesh {
    surface: TriMesh,
    /// For each triangle, the vertices of its neighbours opposite to its edges 01, 12 and 20.
    opposite_vertices: Vec<[u32; 3]>,
    /// Vertices joined to vertex `v` by an edge: `vertex_neighbours[neighbour_offsets[v]..neighbour_offsets[v + 1]]`.
    vertex_neighbours: Vec<u32>,
    neighbour_offsets: Vec<u32>,
}

impl std::fmt::Debug for ClosedMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "ClosedMesh of {} triangles", self.opposite_vertices.len())
    }
}

/// Contact of a point with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshContact {
    /// Signed distance from the point to the surface, mm; negative inside.
    pub distance: f32,
    /// Unit, out of the matter.
    pub normal: Vec3,
}

impl ClosedMesh {
    /// Builds the collider. `None` if the mesh has no triangles or is not closed: every edge needs exactly two
    /// triangles, which run along it in opposite directions.
    pub fn new(mesh: &Mesh) -> Option<ClosedMesh> {
        let corners = mesh.positions.iter().map(|p| to_library(*p)).collect::<Vec<_>>();
        // Every directed edge with the third vertex of its triangle.
        let mut edges: Vec<([u32; 2], u32)> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [([a, b], c), ([b, c], a), ([c, a], b)]).collect();
        edges.sort_unstable();
        if edges.windows(2).any(|w| w[0].0 == w[1].0) {
            return None;
        }
        let across = |from: u32, to: u32| {
            edges.binary_search_by(|(edge, _)| edge.cmp(&[to, from])).ok().map(|place| edges[place].1)
        };
        let opposites = mesh.triangles.iter().map(|&[a, b, c]| Some([across(a, b)?, across(b, c)?, across(c, a)?]));
        let opposite_vertices = opposites.collect::<Option<Vec<_>>>()?;
        let vertex_neighbours = edges.iter().map(|([_, to], _)| *to).collect();
        let neighbour_offsets =
            (0..=corners.len() as u32).map(|v| edges.partition_point(|([from, _], _)| *from < v) as u32).collect();
        let surface = TriMesh::with_flags(corners, mesh.triangles.clone(), TriMeshFlags::ORIENTED).ok()?;
        Some(ClosedMesh { surface, opposite_vertices, vertex_neighbours, neighbour_offsets })
    }

    /// Returns the triangles, without normals.
    pub fn mesh(&self) -> Mesh {
        let positions = self.surface.vertices().iter().map(|v| from_library(*v)).collect();
        Mesh { positions, normals: Vec::new(), triangles: self.surface.indices().to_vec() }
    }

    /// Signed distance of a point from the surface, mm; negative inside.
    pub fn distance(&self, point: Vec3) -> f32 {
        let (place, triangle, location) = self.nearest_place(point);
        let out = point - place;
        if out.dot(self.pseudo_normal(triangle, location)) < 0.0 { -out.length() } else { out.length() }
    }

    /// Contact with the nearest point of the surface.
    pub(super) fn nearest_contact(&self, point: Vec3) -> MeshContact {
        let (place, triangle, location) = self.nearest_place(point);
        self.contact_at(point, place, triangle, location)
    }

    fn nearest_place(&self, point: Vec3) -> (Vec3, u32, TrianglePointLocation) {
        let (projection, (triangle, location)) =
            self.surface.project_local_point_and_get_location(to_library(point), false);
        (from_library(projection.point), triangle, location)
    }

    /// Visits every local minimum of the distance to the surface within a distance, at most the nearest
    /// [`MESH_CONTACTS_MAX`]: the points at which a growing ball around `point` would touch the surface.
    ///
    /// Returns the signed distance of the point, or a lower bound of it.
    pub(super) fn for_each_contact(&self, point: Vec3, within: f32, mut visit: impl FnMut(MeshContact)) -> f32 {
        let (way_out, triangle, location) = self.nearest_place(point);
        let nearest = self.contact_at(point, way_out, triangle, location);
        let is_inside = nearest.distance < -SKIN;
        let mut found = [MeshContact { distance: f32::INFINITY, normal: Vec3::ZERO }; MESH_CONTACTS_MAX];
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
            let contact = self.contact_at(point, place, triangle, location);
            // Skips duplicates reported by adjacent triangles and back-facing triangles. Inside the mesh only the
            // nearest point may push the tip out.
            let is_hidden = if is_inside { place.distance(way_out) > COINCIDENT } else { contact.distance < -SKIN };
            if is_hidden || found[..count].iter().any(|m| is_same(m, &contact)) {
                continue;
            }
            match found[..count].iter().enumerate().max_by(|a, b| a.1.distance.total_cmp(&b.1.distance)) {
                Some((farthest, m)) if count == MESH_CONTACTS_MAX => {
                    if contact.distance < m.distance {
                        found[farthest] = contact;
                    }
                }
                _ => {
                    found[count] = contact;
                    count += 1;
                }
            }
        }
        if count == 0 && nearest.distance < within {
            (found[0], count) = (nearest, 1);
        }
        found[..count].iter().for_each(|m| visit(*m));
        nearest.distance
    }

    /// Returns true if no direction along the surface leads from the nearest point of a triangle closer to `point`.
    fn is_nearest_around(&self, point: Vec3, place: Vec3, triangle: u32, location: TrianglePointLocation) -> bool {
        let out = point - place;
        if out.length() < COINCIDENT {
            return true;
        }
        let leads_nearer = |corner: u32| {
            let toward = from_library(self.surface.vertices()[corner as usize]) - place;
            out.dot(toward) > PERPENDICULAR_COSINE * out.length() * toward.length()
        };
        match location {
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => true,
            TrianglePointLocation::OnEdge(edge, _) => {
                !leads_nearer(self.opposite_vertices[triangle as usize][edge as usize])
            }
            TrianglePointLocation::OnVertex(corner) => {
                let corner = self.surface.indices()[triangle as usize][corner as usize] as usize;
                let spokes = self.neighbour_offsets[corner] as usize..self.neighbour_offsets[corner + 1] as usize;
                !self.vertex_neighbours[spokes].iter().any(|&to| leads_nearer(to))
            }
        }
    }

    fn contact_at(&self, point: Vec3, place: Vec3, triangle: u32, location: TrianglePointLocation) -> MeshContact {
        let out = point - place;
        let pseudo_normal = self.pseudo_normal(triangle, location);
        let length = out.length();
        let is_on_face = matches!(location, TrianglePointLocation::OnFace(..));
        if is_on_face || length < COINCIDENT || out.dot(pseudo_normal) < 0.0 {
            // From inside, an edge is met only where the surface is concave: there each face acts on its own.
            let normal = self.normal(triangle);
            return MeshContact { distance: out.dot(normal), normal };
        }
        MeshContact { distance: length, normal: out / length }
    }

    fn normal(&self, triangle: u32) -> Vec3 {
        from_library(self.surface.triangle(triangle).scaled_normal()).try_normalize().unwrap_or(Vec3::Z)
    }

    /// Outward normal at a point of the surface; on an edge or a vertex the weighted mean of its faces (Bærentzen &
    /// Aanæs 2005).
    fn pseudo_normal(&self, triangle: u32, location: TrianglePointLocation) -> Vec3 {
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

/// Triangles, closed or not, that can be asked for their distance from a point.
pub(super) struct TriangleTree(TriMesh);

impl TriangleTree {
    /// Arranges triangles for queries; `None` if there are none.
    pub fn new(triangles: &[Triangle]) -> Option<TriangleTree> {
        let corners = triangles.iter().flatten().map(|p| to_library(*p)).collect();
        let indices = (0..triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        TriMesh::new(corners, indices).ok().map(TriangleTree)
    }

    /// Index of the triangle nearest to a point.
    pub fn nearest(&self, point: Vec3) -> u32 {
        self.0.project_local_point_and_get_location(to_library(point), false).1.0
    }

    /// Distance of a point from one of the triangles, mm; never negative.
    pub fn distance_from(&self, triangle: u32, point: Vec3) -> f32 {
        self.0.triangle(triangle).distance_to_local_point(to_library(point), false).abs()
    }
}

/// Returns true if two contacts constrain a ball alike.
fn is_same(a: &MeshContact, b: &MeshContact) -> bool {
    (a.distance - b.distance).abs() < 1e-5 && a.normal.dot(b.normal) > 1.0 - 1e-6
}

fn to_library(point: Vec3) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

fn from_library(point: Vector) -> Vec3 {
    Vec3::new(point.x, point.y, point.z)
}
