//! Scans in the formats of hospitals, laboratories and researchers: NRRD, NIfTI, MetaImage, DICOM series, raw voxels.
//!
//! Takes a file or a folder. Gives a [`VoxelImage`] in millimetres (left, posterior, superior), or the first error.
//! Never trusts a header: every declared size is checked against the available data before memory is allocated.

mod error;
pub mod nifti;
pub mod metaimage;
pub mod raw;
pub mod dicom;
mod crop;

pub use crop::{CropOptions, crop_and_resample, extent};
pub use error::ScanError;

use crate::nrrd;
use crate::nrrd::{ErrorLocation, NrrdError, VoxelImage};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Information about a scan that is not in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Layout of a file of raw voxels; `None` for every other format.
    pub raw: Option<raw::RawLayout>,
    /// Series to read from a folder with several: its number or the end of its UID.
    pub series: Option<String>,
}

/// A scan, with notes for its owner.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedScan {
    pub image: VoxelImage,
    pub notes: Vec<String>,
}

impl ImportedScan {
    fn without_notes(image: VoxelImage) -> ImportedScan {
        ImportedScan { image, notes: Vec::new() }
    }
}

/// List of the supported formats, for complaints.
const SUPPORTED_FORMATS: &str = "give NRRD (.nrrd, .nhdr), NIfTI (.nii, .nii.gz), MetaImage (.mha, .mhd), a folder of DICOM slices, \
                    or raw voxels with --size, --type and --spacing-mm";

/// Reads a scan of any supported format. Its axes may be oblique; see [`require_axis_aligned`].
///
/// # Errors
/// Fails when the file or folder cannot be read, is not a known format, or is invalid.
pub fn read(path: &Path, options: &ReadOptions) -> Result<ImportedScan, ScanError> {
    if path.is_dir() {
        return dicom::series(path, options.series.as_deref());
    }
    if let Some(raw) = &options.raw {
        return raw::read(path, raw).map(ImportedScan::without_notes);
    }
    match detect_format(path)? {
        ScanFormat::Nrrd => nrrd::read(path).map_err(|error| ScanError {
            doing: error.doing,
            what: match error.location {
                ErrorLocation::Whole => error.kind.to_string(),
                ErrorLocation::Line(line) => format!("line {line}: {}", error.kind),
                ErrorLocation::Byte(byte) => format!("byte {byte}: {}", error.kind),
            },
            remedy: error.kind.remedy(),
            path: error.path,
        }),
        ScanFormat::Nifti => nifti::read(path),
        ScanFormat::MetaImage => metaimage::read(path),
        ScanFormat::Dicom => Err(ScanError::new(
            "reading a DICOM series",
            "this is a single DICOM file, and a volume is a series of slices",
            "put the slices of the series into a separate folder and name the folder",
        )
        .in_file(path)),
        ScanFormat::Unknown => {
            Err(ScanError::new("reading a scan", "this is not a scan in a known format", SUPPORTED_FORMATS)
                .in_file(path))
        }
    }
    .map(ImportedScan::without_notes)
}

/// Returns the scan if its axes are parallel to those of space.
///
/// # Errors
/// Fails when an axis is oblique or two axes are parallel.
pub fn require_axis_aligned(image: VoxelImage) -> Result<VoxelImage, ScanError> {
    const DOING: &str = "checking a scan's axes";
    let problem = nrrd::check_steps(image.geometry.steps);
    problem.map_err(|problem| {
        ScanError::from_nrrd(
            DOING,
            NrrdError { doing: DOING, kind: problem, location: ErrorLocation::Whole, path: None },
        )
    })?;
    Ok(image)
}

enum ScanFormat {
    Nrrd,
    Nifti,
    MetaImage,
    Dicom,
    Unknown,
}

/// Determines the format from the first bytes, and from the file name where these are not conclusive.
fn detect_format(path: &Path) -> Result<ScanFormat, ScanError> {
    let refused = |what: String, remedy: &str| ScanError::new("reading a scan", what, remedy).in_file(path);
    let cannot = |e: std::io::Error| {
        refused(format!("the file cannot be read ({e})"), "check that the file is there and that you may read it")
    };
    let metadata = std::fs::metadata(path).map_err(cannot)?;
    if !metadata.is_file() {
        return Err(refused("this is a device, not a file".to_string(), "name the file itself"));
    }
    let mut first = Vec::new();
    File::open(path).map_err(cannot)?.take(352).read_to_end(&mut first).map_err(cannot)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    Ok(match &first[..] {
        [] => return Err(refused("the file is empty".to_string(), "copy or export the file again")),
        [b'N', b'R', b'R', b'D', ..] => ScanFormat::Nrrd,
        bytes if bytes.get(128..132) == Some(b"DICM") => ScanFormat::Dicom,
        _ if ends(&[".nrrd", ".nhdr"]) => ScanFormat::Nrrd,
        _ if ends(&[".nii", ".nii.gz", ".hdr", ".img"]) => ScanFormat::Nifti,
        _ if ends(&[".mha", ".mhd"]) => ScanFormat::MetaImage,
        _ if ends(&[".dcm", ".dicom", ".ima"]) => ScanFormat::Dicom,
        bytes if [&[92, 1, 0, 0], &[0, 0, 1, 92]].iter().any(|size| bytes.starts_with(*size)) => ScanFormat::Nifti,
        _ => ScanFormat::Unknown,
    })
}
