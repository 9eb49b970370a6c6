//! Label maps that other programs open: tissues before and after, and the performance map.

use typodont_core::volume::{CellBox, Grid, Volume};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::score::{Verdict, VoxelRemovals};
use typodont_formats::import::GreyValues;
use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation;
use typodont_formats::nrrd::segmentation::{NamedSegment, Segmentation};
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};

/// Encodes the tissues of a volume as `.seg.nrrd`.
///
/// # Errors
///
/// When the file cannot be encoded.
pub fn tissues(volume: &Volume, table: &TissueTable) -> Result<Vec<u8>, String> {
    let labels: Vec<u8> = volume.tissues().map(|l| l.0).collect();
    let segments = table.entries().iter().map(|e| NamedSegment {
        id: e.name.clone(),
        name: e.title.to_string(),
        label_value: e.id,
        color: e.rgb(),
    });
    encode(volume.grid(), labels, segments.collect())
}

/// Encodes the grey values of a volume as NRRD, on the grid of [`tissues`].
///
/// # Errors
///
/// When the file cannot be encoded.
pub fn grey_values(volume: &Volume, values: &GreyValues) -> Result<Vec<u8>, String> {
    let samples = (0..volume.grid().len()).map(|index| values.of_voxel(index, volume.voxel(index))).collect();
    let geometry = Geometry::of(volume.grid(), CoordinateSystem::LeftPosteriorSuperior);
    let image = VoxelImage { geometry, samples: Samples::U8(samples), keys: Vec::new() };
    nrrd::bytes(&image, Encoding::Gzip).map_err(|e| e.to_string())
}

/// Encodes the verdicts, one per voxel of the grid, as `.seg.nrrd`.
///
/// # Errors
///
/// When the file cannot be encoded.
pub fn performance(grid: &Grid, verdicts: &[Verdict]) -> Result<Vec<u8>, String> {
    let labels = verdicts.iter().map(|v| *v as u8).collect();
    let segments = Verdict::VISIBLE.iter().chain(&Verdict::OF_FILLINGS).map(|v| NamedSegment {
        id: v.id().into(),
        name: v.title().into(),
        label_value: *v as u8,
        color: v.color(),
    });
    encode(grid, labels, segments.collect())
}

fn encode(grid: &Grid, labels: Vec<u8>, segments: Vec<NamedSegment>) -> Result<Vec<u8>, String> {
    let geometry = Geometry::of(grid, CoordinateSystem::LeftPosteriorSuperior);
    let segments: Vec<NamedSegment> = segments.into_iter().filter(|s| labels.contains(&s.label_value)).collect();
    segmentation::bytes(&Segmentation { geometry, labels, segments }).map_err(|e| e.to_string())
}

/// Encodes the time of removal of each voxel, s, as NRRD; NaN for voxels that were not removed. The image is cropped to
/// the removed voxels.
///
/// # Errors
///
/// When the file cannot be encoded.
pub fn removal_times(grid: &Grid, falls: &VoxelRemovals) -> Result<Vec<u8>, String> {
    let removed_cells = || falls.iter().map(|(voxel, _)| grid.cell(voxel));
    // If no voxel was removed, the image has one voxel with NaN.
    let cells = CellBox::around(removed_cells()).unwrap_or_default();
    let part = grid.part(&cells);
    let mut seconds = vec![f32::NAN; part.len()];
    for (voxel, fall) in falls.iter() {
        let cell = grid.cell(voxel);
        seconds[part.index(std::array::from_fn(|a| cell[a] - cells.low[a]))] = fall.at.seconds() as f32;
    }
    let geometry = Geometry::of(&part, CoordinateSystem::LeftPosteriorSuperior);
    let keys = vec![
        ("typodont_quantity".to_string(), "removal time".to_string()),
        ("typodont_unit".to_string(), "s".to_string()),
        ("typodont_never_removed".to_string(), "NaN".to_string()),
    ];
    nrrd::bytes(&VoxelImage { geometry, samples: Samples::F32(seconds), keys }, Encoding::Gzip)
        .map_err(|e| e.to_string())
}
