//! Label maps that other programs open: tissues before and after, and the performance map.

use crate::content::TissueTable;
use crate::content::nrrd;
use crate::content::nrrd::segmentation::{self, Segment, Segmentation};
use crate::content::nrrd::{Encoding, Geometry, Image, Samples, Space};
use crate::score::{Falls, Verdict};
use crate::volume::{Grid, Volume};

/// The tissues of a volume as `.seg.nrrd`.
pub fn tissues(volume: &Volume, table: &TissueTable) -> Result<Vec<u8>, String> {
    let labels: Vec<u8> = volume.tissues().map(|l| l.0).collect();
    let segments = table.entries().iter().map(|e| Segment {
        id: e.name.clone(),
        name: e.title.clone(),
        label_value: e.id,
        color: e.rgb(),
    });
    encode(volume.grid(), labels, segments.collect())
}

/// The verdicts as `.seg.nrrd`.
pub fn performance(grid: &Grid, verdicts: &[Verdict]) -> Result<Vec<u8>, String> {
    let labels = verdicts.iter().map(|v| *v as u8).collect();
    let segments = Verdict::SEEN.iter().chain(&Verdict::OF_FILLINGS).map(|v| Segment {
        id: v.id().into(),
        name: v.title().into(),
        label_value: *v as u8,
        color: v.color(),
    });
    encode(grid, labels, segments.collect())
}

fn encode(grid: &Grid, labels: Vec<u8>, segments: Vec<Segment>) -> Result<Vec<u8>, String> {
    let geometry = Geometry::of(grid, Space::LeftPosteriorSuperior);
    let segments: Vec<Segment> = segments.into_iter().filter(|s| labels.contains(&s.label_value)).collect();
    segmentation::bytes(&Segmentation { geometry, labels, segments }).map_err(|e| e.to_string())
}

/// When each voxel fell, s; NaN for those that never did. The box holds no more than what fell.
pub fn removal_times(grid: &Grid, falls: &Falls) -> Result<Vec<u8>, String> {
    let fallen = || falls.iter().map(|(voxel, _)| grid.cell(voxel));
    let (low, high) = fallen().fold(([u32::MAX; 3], [0; 3]), |(low, high): ([u32; 3], [u32; 3]), cell| {
        (std::array::from_fn(|a| low[a].min(cell[a])), std::array::from_fn(|a| high[a].max(cell[a])))
    });
    // Nothing fell: one voxel says so.
    let (low, high) = if low[0] == u32::MAX { ([0; 3], [0; 3]) } else { (low, high) };
    let dims = std::array::from_fn(|a| high[a] - low[a] + 1);
    let part = Grid { dims, spacing: grid.spacing, origin: grid.centre(low) };
    let mut seconds = vec![f32::NAN; part.len()];
    for (voxel, fall) in falls.iter() {
        let cell = grid.cell(voxel);
        seconds[part.index(std::array::from_fn(|a| cell[a] - low[a]))] = fall.at.seconds() as f32;
    }
    let geometry = Geometry::of(&part, Space::LeftPosteriorSuperior);
    let keys = vec![
        ("typodont_quantity".to_string(), "removal time".to_string()),
        ("typodont_unit".to_string(), "s".to_string()),
        ("typodont_never_removed".to_string(), "NaN".to_string()),
    ];
    nrrd::bytes(&Image { geometry, samples: Samples::F32(seconds), keys }, Encoding::Gzip).map_err(|e| e.to_string())
}
