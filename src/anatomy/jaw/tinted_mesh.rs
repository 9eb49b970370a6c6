//! A surface with a tint at each corner, by which the colour of its tissue is multiplied.

use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;

/// Difference of a place from the rest of its tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tint {
    /// Factors of the tissue's red, green and blue, 0 to 1.
    pub colour: [f32; 3],
    /// Share of the stippling of attached gingiva, 0 to 1.
    pub stippling: f32,
}

impl Tint {
    pub(super) const fn smooth(colour: [f32; 3]) -> Tint {
        Tint { colour, stippling: 0.0 }
    }

    pub(super) const fn stippled(colour: [f32; 3], stippling: f32) -> Tint {
        Tint { colour, stippling }
    }
}

/// Tint between two others; a share above 1 counts as 1, below 0 as 0.
pub(super) fn mixed_tint(a: Tint, b: Tint, share: f32) -> Tint {
    let share = share.clamp(0.0, 1.0);
    let mix = |a: f32, b: f32| a + (b - a) * share;
    Tint { colour: std::array::from_fn(|c| mix(a.colour[c], b.colour[c])), stippling: mix(a.stippling, b.stippling) }
}

#[derive(Clone, Debug, Default)]
pub struct TintedMesh {
    /// mm
    pub mesh: Mesh,
    /// One for each position of the mesh.
    pub tints: Vec<Tint>,
}

impl TintedMesh {
    /// Adds another surface, its corners and normals carried over by a map.
    pub(super) fn append(
        &mut self,
        other: &TintedMesh,
        point: impl Fn(Vec3) -> Vec3,
        direction: impl Fn(Vec3) -> Vec3,
        is_mirrored: bool,
    ) {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(other.mesh.positions.iter().map(|p| point(*p)));
        self.mesh.normals.extend(other.mesh.normals.iter().map(|n| direction(*n)));
        let corners = |[a, b, c]: [u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
        self.mesh.triangles.extend(other.mesh.triangles.iter().map(|t| corners(t.map(|i| first + i))));
        self.tints.extend(&other.tints);
    }
}
