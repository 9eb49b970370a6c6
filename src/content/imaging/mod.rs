//! Scans as hospitals, laboratories and researchers keep them: NRRD, NIfTI, MetaImage, DICOM series, plain voxels.
//!
//! Takes a file or a folder. Gives an [`Image`] in millimetres, left, posterior, superior, or the first thing that is wrong
//! with it. Never trusts a header: what it declares is held against what is there before any memory is taken.

mod unread;
pub mod nifti;
pub mod metaimage;
pub mod raw;
pub mod dicom;
mod cut;

pub use cut::{Cut, cut, extent};
pub use unread::Unread;

use super::nrrd::{self, Error, Image, Place};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What a person says about a scan that its file does not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// Of plain voxels, everything.
    pub raw: Option<raw::Told>,
    /// Which series of a folder of several: its number or the end of its UID.
    pub series: Option<String>,
}

/// A scan, and what its owner should know about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    pub image: Image,
    pub notes: Vec<String>,
}

impl Scan {
    fn without_notes(image: Image) -> Scan {
        Scan { image, notes: Vec::new() }
    }
}

/// What is read, for complaints.
const READ: &str = "give NRRD (.nrrd, .nhdr), NIfTI (.nii, .nii.gz), MetaImage (.mha, .mhd), a folder of DICOM slices, \
                    or plain voxels with --size, --type and --spacing-mm";

/// Reads a scan of any kind. Its axes may lean; [`checked`] says whether they may stay so.
pub fn read(path: &Path, told: &Told) -> Result<Scan, Unread> {
    if path.is_dir() {
        return dicom::series(path, told.series.as_deref());
    }
    if let Some(raw) = &told.raw {
        return raw::read(path, raw).map(Scan::without_notes);
    }
    match kind(path)? {
        Kind::Nrrd => nrrd::read(path).map_err(|error| Unread {
            doing: error.doing,
            what: match error.place {
                Place::Whole => error.problem.to_string(),
                Place::Line(line) => format!("line {line}: {}", error.problem),
                Place::Byte(byte) => format!("byte {byte}: {}", error.problem),
            },
            remedy: error.problem.remedy(),
            path: error.path,
        }),
        Kind::Nifti => nifti::read(path),
        Kind::MetaImage => metaimage::read(path),
        Kind::Dicom => Err(Unread::new(
            "reading a DICOM series",
            "this is one DICOM file, and a volume is a series of slices",
            "put the slices of the series into a folder of their own and name the folder",
        )
        .in_file(path)),
        Kind::Unknown => Err(Unread::new("reading a scan", "this is no scan that is known here", READ).in_file(path)),
    }
    .map(Scan::without_notes)
}

/// The scan, if its axes run along those of space.
pub fn checked(image: Image) -> Result<Image, Unread> {
    const DOING: &str = "laying a scan upright";
    let problem = nrrd::check_steps(image.geometry.steps);
    problem.map_err(|problem| Unread::of(DOING, Error { doing: DOING, problem, place: Place::Whole, path: None }))?;
    Ok(image)
}

enum Kind {
    Nrrd,
    Nifti,
    MetaImage,
    Dicom,
    Unknown,
}

/// What a file is, by its first bytes; where those say nothing, by its name.
fn kind(path: &Path) -> Result<Kind, Unread> {
    let refused = |what: String, remedy: &str| Unread::new("reading a scan", what, remedy).in_file(path);
    let cannot = |e: std::io::Error| {
        refused(format!("the file cannot be read ({e})"), "check that the file is there and that you may read it")
    };
    let told = std::fs::metadata(path).map_err(cannot)?;
    if !told.is_file() {
        return Err(refused("this is a device, not a file".to_string(), "name the file itself"));
    }
    let mut first = Vec::new();
    File::open(path).map_err(cannot)?.take(352).read_to_end(&mut first).map_err(cannot)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    Ok(match &first[..] {
        [] => return Err(refused("the file is empty".to_string(), "copy or export the file again")),
        [b'N', b'R', b'R', b'D', ..] => Kind::Nrrd,
        bytes if bytes.get(128..132) == Some(b"DICM") => Kind::Dicom,
        _ if ends(&[".nrrd", ".nhdr"]) => Kind::Nrrd,
        _ if ends(&[".nii", ".nii.gz", ".hdr", ".img"]) => Kind::Nifti,
        _ if ends(&[".mha", ".mhd"]) => Kind::MetaImage,
        _ if ends(&[".dcm", ".dicom", ".ima"]) => Kind::Dicom,
        bytes if [&[92, 1, 0, 0], &[0, 0, 1, 92]].iter().any(|size| bytes.starts_with(*size)) => Kind::Nifti,
        _ => Kind::Unknown,
    })
}
