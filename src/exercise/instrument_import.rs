//! The import of instruments whose shape is a file.
//!
//! Takes the entry of an instrument and the files that it names. Gives the shape that is felt and drawn, or one error
//! message for the author.

use crate::catalog::{CuttingPartEntry, SampledEnd, ShapeEntry};
use crate::tooth_import;
use std::sync::Arc;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Body, BodyRegion, SampledShape};
use typodont_core::volume::solid::Triangle;
use typodont_core::volume::{Grid, surface};
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::imaging::nifti;
use typodont_formats::import::voxelize::{VoxelizeError, closed_surface};
use typodont_formats::limits::DISPLAY_TRIANGLES_MAX;
use typodont_formats::{Library, nrrd, surfaces};

/// Distance from the tip along each axis up to which an instrument makes contact, mm: no part farther away reaches a
/// tooth whose surface the tip touches. `ShapeEntry::file` states it.
const REACH: f32 = 20.0;

/// Greatest distance of the surface from [0, 0, 0], where the tip must lie, mm: the radius of the largest burs, whose origin is
/// the middle of the ball, and half of a ring's width.
const TIP_DISTANCE: f32 = 5.0;

/// Plausible length of an instrument or of a file with its working end only, mm. A length outside this range is in
/// another unit.
const LENGTH: std::ops::RangeInclusive<f32> = 1.0..=250.0;

/// Least distance of two sample points, mm: a worn edge has half of it as its radius.
const SPACING_MIN: f32 = 0.05;

/// Maximum number of sample points: 6 MB per instrument, sampled in about a second.
const SAMPLES_MAX: f32 = 1_500_000.0;

/// Maximum number of voxels of a label map: an instrument of 10×10×20 mm at 0.05 mm.
const VOXELS_MAX: u64 = 16_000_000;

/// Maximum of [`rows_behind`]: some 250 MB while a shape is sampled. A shape of 20 mm with plain surfaces has a million.
const ROWS_MAX: f64 = 1e7;

/// Margin of the samples around the shape, mm: as wide as the surface band of coarse volumes.
const MARGIN: f32 = 0.45;

/// Reason why a shape cannot be used.
#[derive(Debug)]
pub(crate) struct ShapeError {
    /// Code of the diagnostic.
    pub code: &'static str,
    pub message: String,
    pub help: String,
}

impl ShapeError {
    fn wrong(message: impl Into<String>, help: impl Into<String>) -> ShapeError {
        ShapeError { code: "wrong-shape", message: message.into(), help: help.into() }
    }

    fn in_file(self, name: &str) -> ShapeError {
        ShapeError { message: format!("\"{name}\": {}", self.message), ..self }
    }
}

/// Reads the shape of an instrument and of its cutting part.
///
/// # Errors
/// Fails when a file is missing or cannot be read, when a surface is open, has too many triangles or an implausible size,
/// or when no part of it lies at the tip.
pub(crate) fn sampled_end(entry: &ShapeEntry, library: &Library) -> Result<SampledEnd, ShapeError> {
    let triangles = placed_triangles(entry, &entry.file, library)?;
    let shape = sampled(&triangles).map_err(|error| error.in_file(&entry.file))?;
    let cutting = entry.cutting.as_ref().map(|part| cutting_part(entry, part, &shape, library)).transpose()?;
    let body = Body::sampled(shape, cutting);
    if !body.surface_points().iter().any(|point| point.region == BodyRegion::Head) {
        let help = "the cutting part must be a part of the instrument, at the same position and in the same unit";
        return Err(ShapeError::wrong("no part of the instrument's surface belongs to its cutting part", help));
    }
    Ok(SampledEnd { body: Arc::new(body), surface: Arc::new(faceted(&triangles)) })
}

/// Checks that the tip of an instrument lies where it must; a recording holds what was felt, wherever it lay.
///
/// # Errors
/// Fails when the surface is more than [`TIP_DISTANCE`] away from the origin.
pub(crate) fn check_tip(entry: &ShapeEntry, end: &SampledEnd) -> Result<(), ShapeError> {
    let points = end.body.surface_points().iter();
    let away = points.map(|point| point.position.length()).fold(f32::INFINITY, f32::min);
    if away <= TIP_DISTANCE {
        return Ok(());
    }
    let message = format!("the surface is {away:.1} mm away from [0, 0, 0], where the tip of the instrument must lie");
    Err(ShapeError::wrong(message, "move it there by \"position_mm\"").in_file(&entry.file))
}

fn cutting_part(
    entry: &ShapeEntry,
    part: &CuttingPartEntry,
    whole: &SampledShape,
    library: &Library,
) -> Result<SampledShape, ShapeError> {
    match part {
        CuttingPartEntry::LengthMm(length) => whole.clone().below(length.0).cropped(MARGIN).ok_or_else(|| {
            let message = format!("no part of the instrument lies within {} mm of its tip along the shaft", length.0);
            ShapeError::wrong(message, "check \"position_mm\" and \"length_mm\": the tip must be at z = 0")
        }),
        CuttingPartEntry::File(name) => {
            let part = sampled(&placed_triangles(entry, name, library)?).map_err(|error| error.in_file(name))?;
            // What is not a part of the instrument is neither seen nor felt, and cuts nothing.
            part.within(whole).cropped(MARGIN).ok_or_else(|| {
                let help = "it must be a part of the instrument, at the same position and in the same unit";
                ShapeError::wrong("no part of the instrument is within this cutting part", help).in_file(name)
            })
        }
    }
}

/// Reads the surface of a file; handle space, mm, closed and facing outward.
fn placed_triangles(entry: &ShapeEntry, name: &str, library: &Library) -> Result<Vec<Triangle>, ShapeError> {
    let bytes = library.bytes(name).map_err(|found| ShapeError {
        code: found.code,
        message: found.message,
        help: found.help.unwrap_or_default(),
    });
    let placed = bytes.and_then(|bytes| {
        let mut triangles = file_triangles(&bytes, name)?;
        if triangles.len() > DISPLAY_TRIANGLES_MAX {
            let message = format!("the surface has {} triangles", triangles.len());
            let help = format!("reduce it to at most {DISPLAY_TRIANGLES_MAX} triangles, or use larger voxels");
            return Err(ShapeError::wrong(message, help));
        }
        triangles.iter_mut().flatten().for_each(|corner| *corner *= entry.unit.mm());
        check_length(&triangles)?;
        let handle_from_file = entry.handle_from_file();
        triangles.iter_mut().flatten().for_each(|corner| *corner = handle_from_file * *corner);
        closed_surface(&triangles).map_err(mesh_error)
    });
    placed.map_err(|error| error.in_file(name))
}

/// Returns the triangles of a surface, or of the surface of voxels, in the unit of the file.
fn file_triangles(bytes: &[u8], name: &str) -> Result<Vec<Triangle>, ShapeError> {
    let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let image = match ending.as_str() {
        "stl" | "ply" | "obj" => {
            let none_beside =
                |other: &str| Err(Diagnostic::about_file(other, "missing-file", "only one file is read", None));
            return surfaces::parse(bytes, &ending, none_beside).map_err(|e| ShapeError::wrong(e.what, e.remedy));
        }
        "nrrd" => nrrd::parse(bytes).map_err(|e| ShapeError::wrong(e.kind.to_string(), e.kind.remedy()))?,
        "nii" | "gz" => nifti::parse(bytes).map_err(|e| ShapeError::wrong(e.what, e.remedy))?,
        other => {
            let message = format!("the shape of an instrument cannot be read from \".{other}\"");
            return Err(ShapeError::wrong(message, "give an .stl, .ply, .obj, .nrrd, .nii or .nii.gz file"));
        }
    };
    let voxels: u64 = image.geometry.dims.iter().map(|&n| u64::from(n)).product();
    if voxels > VOXELS_MAX {
        let message = format!("the label map has {voxels} voxels");
        let help = format!("crop it around the working end, or use larger voxels: at most {VOXELS_MAX}");
        return Err(ShapeError::wrong(message, help));
    }
    let help = "draw the instrument in the label map with any number but 0, and state the voxel spacing in the file";
    let volume = tooth_import::solid_volume(&image).map_err(|message| ShapeError::wrong(message, help))?;
    let mesh = surface::extract(&volume);
    Ok(mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize])).collect())
}

fn check_length(triangles: &[Triangle]) -> Result<(), ShapeError> {
    let length = Aabb::around(triangles.iter().flatten().copied()).size().max_element();
    // A coordinate that is not finite is reported with the other faults of a mesh.
    if LENGTH.contains(&length) || !length.is_finite() {
        return Ok(());
    }
    let (least, most) = (LENGTH.start(), LENGTH.end());
    let message = format!("its longest side is {length} mm, and an instrument is {least} to {most} mm long");
    Err(ShapeError::wrong(message, "give the \"unit\" in which the file was made: mm, cm, m, um or in"))
}

fn mesh_error(error: VoxelizeError) -> ShapeError {
    let text = error.to_string();
    // The text states the problem and then the remedy.
    let (message, help) = text.split_once(" — ").unwrap_or((&text, "repair the surface in a mesh program"));
    let code = if matches!(error, VoxelizeError::Open { .. }) { "open-mesh" } else { "wrong-shape" };
    ShapeError { code, message: message.to_string(), help: help.to_string() }
}

/// Samples the part of a closed surface that can touch a tooth.
fn sampled(triangles: &[Triangle]) -> Result<SampledShape, ShapeError> {
    let Aabb { low, high } = Aabb::around(triangles.iter().flatten().copied());
    let reach = Vec3::splat(REACH);
    let (low, high) = (low.max(-reach), high.min(reach));
    if low.cmpge(high).any() {
        let message = format!("no part of the instrument lies within {REACH} mm of its tip");
        return Err(ShapeError::wrong(message, "move its tip to [0, 0, 0] by \"position_mm\""));
    }
    let spacing = libm::cbrtf((high - low + 2.0 * MARGIN).element_product() / SAMPLES_MAX).max(SPACING_MIN);
    let grid = Grid::covering(low, high, Vec3::splat(spacing), (MARGIN / spacing).ceil() as u32);
    let rows = rows_behind(&grid, triangles);
    if rows > ROWS_MAX {
        let message = "too many triangles lie behind one another";
        return Err(ShapeError::wrong(message, "leave out what is inside the instrument, and reduce its surface"));
    }
    SampledShape::of_triangles(grid, triangles).ok_or_else(|| {
        let message = format!("the instrument is nowhere as thick as {spacing:.2} mm, the distance of its samples");
        ShapeError::wrong(message, "make it thicker, or leave out what is far from the tip")
    })
}

/// Returns at most how often rows of a grid along x cross triangles: the memory that the sampling of a shape needs.
fn rows_behind(grid: &Grid, triangles: &[Triangle]) -> f64 {
    let Aabb { low, high } = grid.extent();
    let rows = |triangle: &Triangle| {
        let box_of = Aabb::around(triangle.iter().copied());
        let size = (box_of.high.min(high) - box_of.low.max(low)) / grid.spacing;
        if size.y < 0.0 || size.z < 0.0 { 0.0 } else { f64::from(size.y + 1.0) * f64::from(size.z + 1.0) }
    };
    triangles.iter().map(rows).sum()
}

/// A mesh in which each triangle has its own corners and normal.
fn faceted(triangles: &[Triangle]) -> Mesh {
    let normal = |[a, b, c]: Triangle| (b - a).cross(c - a).normalize_or(Vec3::Z);
    Mesh {
        positions: triangles.iter().flatten().copied().collect(),
        normals: triangles.iter().flat_map(|t| [normal(*t); 3]).collect(),
        triangles: (0..triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_one_behind_another_are_refused_before_they_take_memory() {
        // Method: plates of 40 mm in a row, few triangles each; one of them is a shape.
        let plates = |count: usize| -> Vec<Triangle> {
            let plate = |n: usize| {
                let corner = move |i: usize| {
                    let side = |bit: usize| if i >> bit & 1 == 1 { 20.0 } else { -20.0 };
                    Vec3::new(n as f32 * 0.4 + if i & 1 == 1 { 0.2 } else { 0.0 }, side(1), side(2))
                };
                let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
                quads.into_iter().flat_map(move |[a, b, c, d]| [[a, b, c], [a, c, d]].map(|t| t.map(corner)))
            };
            (0..count).flat_map(plate).collect()
        };
        assert!(sampled(&plates(1)).is_ok());
        let error = sampled(&plates(400)).unwrap_err();
        assert!(error.message.contains("behind one another"), "{}", error.message);
    }
}
