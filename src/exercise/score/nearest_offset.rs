//! Distance and anatomical direction of voxels from the nearest voxel of a set.

use crate::scenario::Workpiece;
use typodont_core::frame::Vec3;
use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{Grid, distance};

/// Direction from the tissue to be removed, or from the cavity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AnatomicalDirection {
    Buccal,
    Lingual,
    Mesial,
    Distal,
    Occlusal,
    Apical,
}

impl AnatomicalDirection {
    /// Returns the name in files and in the keys of language files.
    pub fn id(self) -> &'static str {
        match self {
            AnatomicalDirection::Buccal => "buccal",
            AnatomicalDirection::Lingual => "lingual",
            AnatomicalDirection::Mesial => "mesial",
            AnatomicalDirection::Distal => "distal",
            AnatomicalDirection::Occlusal => "occlusal",
            AnatomicalDirection::Apical => "apical",
        }
    }

    /// Returns the direction nearest to a vector in tooth space; `distal` is the unit vector toward distal.
    pub fn of(vector: Vec3, distal: Vec3) -> AnatomicalDirection {
        let Vec3 { x, y, z } = vector;
        let [along_x, along_y, along_z] = [x, y, z].map(f32::abs);
        let either = |is_first: bool, first, second| if is_first { first } else { second };
        if along_z >= along_x && along_z >= along_y {
            either(z > 0.0, AnatomicalDirection::Occlusal, AnatomicalDirection::Apical)
        } else if along_x >= along_y {
            either(x > 0.0, AnatomicalDirection::Buccal, AnatomicalDirection::Lingual)
        } else {
            either(y * distal.y > 0.0, AnatomicalDirection::Distal, AnatomicalDirection::Mesial)
        }
    }
}

/// The nearest voxel of a set, for the voxels within a box around all voxels in question.
pub struct NearestOffsets<'a> {
    near: Option<(SubGrid, Vec<f32>, Vec<u32>)>,
    /// Names the directions: by the own axes of the tooth at which a voxel lies.
    workpiece: &'a Workpiece,
}

impl<'a> NearestOffsets<'a> {
    /// `is_in` is true for the voxels of the set, `is_asked` for those whose offsets will be asked for.
    pub fn new(
        grid: &Grid,
        workpiece: &'a Workpiece,
        is_in: impl Fn(usize) -> bool,
        is_asked: impl Fn(usize) -> bool,
    ) -> NearestOffsets<'a> {
        let crop = SubGrid::around(grid, 1, (0..grid.len()).filter(|&v| is_in(v) || is_asked(v)));
        let near = crop.map(|crop| {
            let (distances, nearest) = distance::to_nearest(&crop.grid, |i| is_in(crop.whole_index(i)));
            (crop, distances, nearest)
        });
        NearestOffsets { near, workpiece }
    }

    /// Returns the distance (mm) and direction of a voxel from the nearest voxel of the set; `None` for an empty set or
    /// outside the box.
    pub fn of(&self, voxel: usize) -> Option<(f32, AnatomicalDirection)> {
        let (crop, distances, nearest) = self.near.as_ref()?;
        let place = crop.index_of(voxel).filter(|&i| distances[i].is_finite())?;
        let centre = |i: usize| crop.grid.centre(crop.grid.cell(i));
        let offset = centre(place) - centre(nearest[place] as usize);
        let (offset, distal) = self.workpiece.along_own_axes(centre(place), offset);
        Some((distances[place], AnatomicalDirection::of(offset, Vec3::Y * distal)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_the_axis_that_a_vector_follows_most() {
        for (vector, expected) in [
            (Vec3::new(0.9, 0.3, 0.2), AnatomicalDirection::Buccal),
            (Vec3::new(-0.9, 0.3, 0.2), AnatomicalDirection::Lingual),
            (Vec3::new(0.2, -0.7, 0.2), AnatomicalDirection::Mesial),
            (Vec3::new(0.2, 0.7, -0.2), AnatomicalDirection::Distal),
            (Vec3::new(0.5, 0.1, -0.6), AnatomicalDirection::Apical),
            (Vec3::Z, AnatomicalDirection::Occlusal),
        ] {
            assert_eq!(AnatomicalDirection::of(vector, Vec3::Y), expected, "{vector}");
        }
        assert_eq!(AnatomicalDirection::of(Vec3::Y, -Vec3::Y), AnatomicalDirection::Mesial);
    }
}
