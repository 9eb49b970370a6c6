//! DICOM series of single slices, CT and CBCT: a folder of files becomes a volume.
//!
//! Takes a folder. Gives one volume of evenly spaced slices. Never fills in a missing slice. Slices are ordered by
//! their positions, whatever their file names and instance numbers. A folder that does not hold one complete, even
//! series is refused, because a gap is no longer visible in a volume. The standard: DICOM PS3.3, image plane module
//! (C.7.6.2).

mod elements;
mod pixels;
mod slice;

use crate::imaging::ImportedScan;
use crate::imaging::error::{ScanError, sanitized_excerpt};
use crate::nrrd::{
    CoordinateSystem, ErrorLocation, Geometry, NrrdError, NrrdErrorKind, Samples, VoxelImage, check_dims, check_origin,
};
use glam::DVec3;
use slice::{DicomSeries, DicomSlice};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

const DOING: &str = "reading a DICOM series";

/// Maximum size of a file that is taken for a slice, bytes: 4096×4096 pixels of 16 bits and a header.
const FILE_MAX: u64 = 40 << 20;

/// Maximum number of files in a folder.
const FILES_MAX: usize = 20_000;

/// Relative tolerance for directions and spacings: archives round to four digits or more.
const AGREE: f64 = 1e-3;

/// Maximum relative deviation of one slice distance from the usual one: positions are rounded.
const UNEVEN: f64 = 0.02;

/// Tangent of the largest tilt that is attributed to rounding: 0.5°.
const TILT_MAX: f64 = 0.0087;

fn wrong(what: impl Into<String>, remedy: impl Into<String>) -> ScanError {
    ScanError::new(DOING, what, remedy)
}

fn from_nrrd_problem(problem: NrrdErrorKind) -> ScanError {
    ScanError::from_nrrd(DOING, NrrdError { doing: DOING, kind: problem, location: ErrorLocation::Whole, path: None })
}

/// Reads the only series of a folder, or the one that `wanted` names by its number or by the end of its UID.
///
/// # Errors
/// Fails when the folder or a slice cannot be read, when the series is not unambiguous, or when its slices do not
/// form an even volume.
pub fn series(folder: &Path, wanted: Option<&str>) -> Result<ImportedScan, ScanError> {
    read_series(folder, wanted).map_err(|unread| unread.in_file(folder))
}

fn read_series(folder: &Path, wanted: Option<&str>) -> Result<ImportedScan, ScanError> {
    let mut notes = Vec::new();
    let slices = select_series(slice_headers(folder, &mut notes)?, wanted)?;
    check_consistent(&slices)?;
    let stack = SliceStack::of(slices)?;
    if let Some(other) = stack.slices.iter().find(|s| !["CT", ""].contains(&s.modality.as_str())) {
        notes.push(format!("the series is of modality {}: enamel is the brightest tissue only in CT", other.modality));
    }
    Ok(ImportedScan { image: stack.image()?, notes })
}

/// Reads the headers of all slices in a folder. Files that are not DICOM are skipped, with a note.
fn slice_headers(folder: &Path, notes: &mut Vec<String>) -> Result<Vec<DicomSlice>, ScanError> {
    let unreadable =
        |e: std::io::Error| wrong(format!("the folder cannot be read ({e})"), "check that you may read it");
    let mut paths = Vec::new();
    let mut folders = 0;
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        match path.is_dir() {
            true => folders += 1,
            false => paths.push(path),
        }
    }
    if paths.len() > FILES_MAX {
        return Err(wrong(format!("the folder contains {} files", paths.len()), "name a folder with one series"));
    }
    // Sorted, so that a complaint names the same file whatever the order of the directory entries.
    paths.sort();
    let mut slices = Vec::new();
    let mut other: Vec<PathBuf> = Vec::new();
    for path in paths {
        let bytes = bytes_of(&path)?;
        let is_dicom = bytes.get(128..132) == Some(b"DICM");
        match slice::read_header(&bytes) {
            Ok(Some(head)) => slices.push(DicomSlice { path, ..head }),
            Ok(None) => {}
            Err(unread) if is_dicom || has_name_of_a_slice(&path) => return Err(unread.in_file(&path)),
            Err(_) => other.push(path),
        }
    }
    if let Some(first) = other.first().filter(|_| !slices.is_empty()) {
        let name = sanitized_excerpt(&first.file_name().unwrap_or_default().to_string_lossy());
        notes.push(match other.len() {
            1 => format!("{name} is not a DICOM file and was skipped"),
            n => format!("{name} and {} other files are not DICOM files and were skipped", n - 1),
        });
    }
    match (slices.len(), folders) {
        (0, 0) => Err(wrong("there is no DICOM slice in this folder", "name the folder that holds the slices")),
        (0, n) => Err(wrong(
            format!("there is no DICOM slice in this folder itself, but it contains {n} folders"),
            "name the one that holds the slices",
        )),
        _ => Ok(slices),
    }
}

fn has_name_of_a_slice(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["dcm", "dicom", "ima"].iter().any(|known| e.eq_ignore_ascii_case(known)))
}

/// Returns the bytes of a file, or none for anything that is not a regular file. A file too large for a slice is
/// refused if it looks like one.
fn bytes_of(path: &Path) -> Result<Vec<u8>, ScanError> {
    let unreadable =
        |e: std::io::Error| wrong(format!("the file cannot be read ({e})"), "check that you may read it").in_file(path);
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Ok(Vec::new());
    }
    if metadata.len() <= FILE_MAX {
        return fs::read(path).map_err(unreadable);
    }
    let mut head = Vec::new();
    File::open(path).map_err(unreadable)?.take(132).read_to_end(&mut head).map_err(unreadable)?;
    match head.ends_with(b"DICM") || has_name_of_a_slice(path) {
        true => {
            let what = format!("the file has {} MiB, and a slice has at most {}", metadata.len() >> 20, FILE_MAX >> 20);
            Err(wrong(what, "export the volume as a series of single slices").in_file(path))
        }
        false => Ok(Vec::new()),
    }
}

/// Selects the slices of one series.
fn select_series(slices: Vec<DicomSlice>, wanted: Option<&str>) -> Result<Vec<DicomSlice>, ScanError> {
    let mut all: Vec<DicomSeries> = slices.iter().map(|s| s.series.clone()).collect();
    all.sort();
    all.dedup_by(|a, b| a.uid == b.uid);
    let list = || {
        let line = |series: &DicomSeries| {
            let count = slices.iter().filter(|s| s.series.uid == series.uid).count();
            let uid: String = series.uid.chars().rev().take(12).collect::<Vec<_>>().into_iter().rev().collect();
            format!(
                "number {} \"{}\" of {count} slices (…{})",
                series.number,
                series.description,
                sanitized_excerpt(&uid)
            )
        };
        all.iter().map(line).collect::<Vec<_>>().join(", ")
    };
    let fits = |s: &DicomSeries, name: &str| s.number == name || (!name.is_empty() && s.uid.ends_with(name));
    let fitting: Vec<&DicomSeries> = all.iter().filter(|s| wanted.is_none_or(|name| fits(s, name))).collect();
    match fitting[..] {
        [one] => {
            let uid = one.uid.clone();
            Ok(slices.into_iter().filter(|s| s.series.uid == uid).collect())
        }
        [] => Err(wrong(
            format!(
                "there is no series \"{}\" in this folder, which contains {}",
                sanitized_excerpt(wanted.unwrap_or_default()),
                list()
            ),
            "give --series with one of these numbers, or the end of its UID",
        )),
        _ => Err(wrong(
            format!("the folder contains {} series: {}", all.len(), list()),
            "give --series with the number of one, or the end of its UID, or keep one series per folder",
        )),
    }
}

/// Checks that all slices have the size, pixel spacing and orientation of the first.
fn check_consistent(slices: &[DicomSlice]) -> Result<(), ScanError> {
    let Some((first, others)) = slices.split_first() else { return Ok(()) };
    let is_near = |a: f64, b: f64| (a - b).abs() <= AGREE * a.abs();
    for slice in others {
        let differ = |what: String, remedy: &str| Err(wrong(what, remedy).in_file(&slice.path));
        let than = sanitized_excerpt(&first.path.file_name().unwrap_or_default().to_string_lossy());
        if [slice.pixel_layout.columns, slice.pixel_layout.rows]
            != [first.pixel_layout.columns, first.pixel_layout.rows]
        {
            let [a, b] = [slice, first].map(|s| format!("{}×{}", s.pixel_layout.columns, s.pixel_layout.rows));
            return differ(
                format!("this slice has {a} pixels, {than} has {b}"),
                "remove it from the folder, or export the series again with slices of one size",
            );
        }
        if !(0..2).all(|i| is_near(first.spacing[i], slice.spacing[i])) {
            let [a, b] = [slice, first].map(|s| format!("{}×{} mm", s.spacing[0], s.spacing[1]));
            return differ(
                format!("this slice's pixels are {a} apart, those of {than} {b}"),
                "remove it from the folder, or export the series again with one pixel spacing",
            );
        }
        if !(0..2).all(|i| first.orientation[i].distance(slice.orientation[i]) < 10.0 * AGREE) {
            return differ(
                format!("the orientation of this slice differs from that of {than}"),
                "remove it from the folder: a scout view (localizer) is not part of the volume",
            );
        }
    }
    Ok(())
}

/// Slices in spatial order, at even distances.
#[derive(Debug)]
struct SliceStack {
    slices: Vec<DicomSlice>,
    /// Step from one slice to the next, mm.
    step: DVec3,
}

impl SliceStack {
    fn of(mut slices: Vec<DicomSlice>) -> Result<SliceStack, ScanError> {
        let normal = slices[0].orientation[0].cross(slices[0].orientation[1]);
        let height = |slice: &DicomSlice| slice.position.dot(normal);
        slices.sort_by(|a, b| height(a).total_cmp(&height(b)).then_with(|| a.path.cmp(&b.path)));
        let count = slices.len();
        if count < 2 {
            let what = "there is one slice, and a volume needs many";
            return Err(wrong(what, "export the whole series into the folder"));
        }
        let gaps: Vec<f64> = slices.windows(2).map(|pair| height(&pair[1]) - height(&pair[0])).collect();
        let usual = *gaps.clone().select_nth_unstable_by((count - 1) / 2, f64::total_cmp).1;
        let name = |n: usize| sanitized_excerpt(&slices[n].path.file_name().unwrap_or_default().to_string_lossy());
        for (n, gap) in gaps.into_iter().enumerate() {
            let off = gap / usual;
            let (a, b) = (name(n), name(n + 1));
            // The gap is NaN where the numbers of a damaged file overflow.
            if gap.is_nan() || gap <= 0.5 * usual.max(1e-3) {
                return Err(wrong(
                    format!("{a} and {b} are at the same position"),
                    "remove one of them from the folder: a slice is present twice, or two series are mixed",
                )
                .in_file(&slices[n + 1].path));
            }
            if (off - 1.0).abs() > UNEVEN {
                let missing = (off - off.round()).abs() < 0.1 && off > 1.5;
                let what = match missing {
                    true => format!("between {a} and {b} {} slices are missing", off.round() - 1.0),
                    false => format!("{a} and {b} are {gap:.3} mm apart, the others {usual:.3} mm"),
                };
                let remedy = match missing {
                    true => "export the series again, or copy the missing slices",
                    false => "have the series reconstructed with even slices: the tissue in between is not known",
                };
                return Err(wrong(what, remedy).in_file(&slices[n + 1].path));
            }
        }
        let whole = slices[count - 1].position - slices[0].position;
        let aside = (whole - normal * whole.dot(normal)).length();
        if aside > TILT_MAX * whole.dot(normal) {
            let degrees = (aside / whole.dot(normal)).atan().to_degrees();
            return Err(wrong(
                format!("the slices are tilted by {degrees:.1}° (gantry tilt): each is shifted against the one before"),
                "have the series reconstructed without tilt, or resample it in a viewer (3D Slicer: acquisition transform)",
            ));
        }
        let step = normal * (whole.dot(normal) / (count - 1) as f64);
        Ok(SliceStack { slices, step })
    }

    fn image(&self) -> Result<VoxelImage, ScanError> {
        let first = &self.slices[0];
        let dims = [first.pixel_layout.columns.into(), first.pixel_layout.rows.into(), self.slices.len() as u64];
        let dims = check_dims(dims).map_err(from_nrrd_problem)?;
        check_origin(first.position).map_err(from_nrrd_problem)?;
        let steps = [first.orientation[0] * first.spacing[0], first.orientation[1] * first.spacing[1], self.step];
        // Adding zero turns −0 into +0.
        let steps = steps.map(|step| step + DVec3::ZERO);
        let geometry = Geometry { dims, steps, origin: first.position, space: CoordinateSystem::LeftPosteriorSuperior };
        let samples = match self.slices.iter().all(fits_in_16_bits) {
            true => Samples::I16(self.values(geometry.len(), |value| value as i16)?),
            false => Samples::F32(self.values(geometry.len(), |value| value)?),
        };
        Ok(VoxelImage { geometry, samples, keys: Vec::new() })
    }

    /// Reads the values of all slices. Their headers have already been checked against the file sizes.
    fn values<T>(&self, count: usize, narrow: impl Fn(f32) -> T) -> Result<Vec<T>, ScanError> {
        let mut all = Vec::new();
        for slice in &self.slices {
            let in_file = |unread: ScanError| unread.in_file(&slice.path);
            let bytes = bytes_of(&slice.path)?;
            let values = slice::values(&bytes, slice).map_err(in_file)?;
            if all.is_empty() {
                all.reserve_exact(count);
            }
            all.extend(values.map(&narrow));
        }
        match all.len() == count {
            true => Ok(all),
            false => Err(wrong("the files changed while they were read", "try again")),
        }
    }
}

/// Returns true if every value that a slice can hold is a signed 16-bit whole number, as Hounsfield units are.
fn fits_in_16_bits(slice: &DicomSlice) -> bool {
    let bits = i32::from(slice.pixel_layout.bits);
    let most = f64::from(1 << (bits - i32::from(slice.pixel_layout.is_signed))) - 1.0;
    let least = if slice.pixel_layout.is_signed { -most - 1.0 } else { 0.0 };
    let is_whole = slice.slope == 1.0 && slice.intercept.fract() == 0.0;
    is_whole && least + slice.intercept >= f64::from(i16::MIN) && most + slice.intercept <= f64::from(i16::MAX)
}
