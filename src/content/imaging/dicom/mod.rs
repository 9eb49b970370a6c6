//! DICOM series of single slices, CT and CBCT: a folder of files becomes a volume.
//!
//! Slices are put in order by where they lie, whatever their files are called and however they are numbered. A folder that
//! is not one whole, even series is refused: what is missing cannot be seen in a volume any more. The standard: DICOM PS3.3,
//! image plane module (C.7.6.2).

mod elements;
mod pixels;
mod slice;

use super::Scan;
use super::unread::{Unread, plain};
use crate::content::nrrd::{Error, Geometry, Image, Place, Problem, Samples, Space, check_dims, check_origin};
use glam::DVec3;
use slice::{Series, Slice};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

const DOING: &str = "reading a DICOM series";

/// Largest file that is taken for a slice, bytes: 4096×4096 pixels in 16 bits and a head.
const FILE_MAX: u64 = 40 << 20;

/// Most files in a folder that are looked at.
const FILES_MAX: usize = 20_000;

/// Directions and spacings agree within this share: archives round to four digits and more.
const AGREE: f64 = 1e-3;

/// How far the distance between two slices may differ from that of the others, as a share: positions are rounded.
const UNEVEN: f64 = 0.02;

/// Tangent of the largest tilt that is taken for rounding: 0.5°.
const TILT_MAX: f64 = 0.0087;

fn wrong(what: impl Into<String>, remedy: impl Into<String>) -> Unread {
    Unread::new(DOING, what, remedy)
}

fn shared(problem: Problem) -> Unread {
    Unread::of(DOING, Error { doing: DOING, problem, place: Place::Whole, path: None })
}

/// Reads the one series of a folder, or the one that `wanted` names by its number or the end of its UID.
pub fn series(folder: &Path, wanted: Option<&str>) -> Result<Scan, Unread> {
    read_series(folder, wanted).map_err(|unread| unread.in_file(folder))
}

fn read_series(folder: &Path, wanted: Option<&str>) -> Result<Scan, Unread> {
    let mut notes = Vec::new();
    let slices = chosen(heads(folder, &mut notes)?, wanted)?;
    check_alike(&slices)?;
    let stack = Stack::of(slices)?;
    if let Some(other) = stack.slices.iter().find(|s| !["CT", ""].contains(&s.modality.as_str())) {
        notes.push(format!("the series is of modality {}: only in CT is enamel the brightest", other.modality));
    }
    Ok(Scan { image: stack.image()?, notes })
}

/// The heads of all slices in a folder. Files that are no DICOM are passed over, with a note.
fn heads(folder: &Path, notes: &mut Vec<String>) -> Result<Vec<Slice>, Unread> {
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
        return Err(wrong(format!("the folder holds {} files", paths.len()), "name a folder with one series"));
    }
    // Whichever order the disk has them in, complaints name the same file.
    paths.sort();
    let mut slices = Vec::new();
    let mut other: Vec<PathBuf> = Vec::new();
    for path in paths {
        let bytes = bytes_of(&path)?;
        let is_dicom = bytes.get(128..132) == Some(b"DICM");
        match slice::head(&bytes) {
            Ok(Some(head)) => slices.push(Slice { path, ..head }),
            Ok(None) => {}
            Err(unread) if is_dicom || has_name_of_a_slice(&path) => return Err(unread.in_file(&path)),
            Err(_) => other.push(path),
        }
    }
    if let Some(first) = other.first().filter(|_| !slices.is_empty()) {
        let name = plain(&first.file_name().unwrap_or_default().to_string_lossy());
        notes.push(match other.len() {
            1 => format!("{name} is no DICOM and was passed over"),
            n => format!("{name} and {} other files are no DICOM and were passed over", n - 1),
        });
    }
    match (slices.len(), folders) {
        (0, 0) => Err(wrong("there is no DICOM slice in this folder", "name the folder that holds the slices")),
        (0, n) => Err(wrong(
            format!("there is no DICOM slice in this folder itself, but there are {n} folders in it"),
            "name the one that holds the slices",
        )),
        _ => Ok(slices),
    }
}

fn has_name_of_a_slice(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["dcm", "dicom", "ima"].iter().any(|known| e.eq_ignore_ascii_case(known)))
}

/// A file's bytes; none of what is no file. What is too large for a slice is refused if it looks like one.
fn bytes_of(path: &Path) -> Result<Vec<u8>, Unread> {
    let unreadable =
        |e: std::io::Error| wrong(format!("the file cannot be read ({e})"), "check that you may read it").in_file(path);
    let told = fs::metadata(path).map_err(unreadable)?;
    if !told.is_file() {
        return Ok(Vec::new());
    }
    if told.len() <= FILE_MAX {
        return fs::read(path).map_err(unreadable);
    }
    let mut head = Vec::new();
    File::open(path).map_err(unreadable)?.take(132).read_to_end(&mut head).map_err(unreadable)?;
    match head.ends_with(b"DICM") || has_name_of_a_slice(path) {
        true => {
            let what = format!("it has {} MiB, and a slice has at most {}", told.len() >> 20, FILE_MAX >> 20);
            Err(wrong(what, "export the volume as a series of single slices").in_file(path))
        }
        false => Ok(Vec::new()),
    }
}

/// The slices of one series.
fn chosen(slices: Vec<Slice>, wanted: Option<&str>) -> Result<Vec<Slice>, Unread> {
    let mut all: Vec<Series> = slices.iter().map(|s| s.series.clone()).collect();
    all.sort();
    all.dedup_by(|a, b| a.uid == b.uid);
    let list = || {
        let line = |series: &Series| {
            let count = slices.iter().filter(|s| s.series.uid == series.uid).count();
            let uid: String = series.uid.chars().rev().take(12).collect::<Vec<_>>().into_iter().rev().collect();
            format!("number {} \"{}\" of {count} slices (…{})", series.number, series.description, plain(&uid))
        };
        all.iter().map(line).collect::<Vec<_>>().join(", ")
    };
    let fits = |s: &Series, name: &str| s.number == name || (!name.is_empty() && s.uid.ends_with(name));
    let fitting: Vec<&Series> = all.iter().filter(|s| wanted.is_none_or(|name| fits(s, name))).collect();
    match fitting[..] {
        [one] => {
            let uid = one.uid.clone();
            Ok(slices.into_iter().filter(|s| s.series.uid == uid).collect())
        }
        [] => Err(wrong(
            format!(
                "there is no series \"{}\" in this folder, which holds {}",
                plain(wanted.unwrap_or_default()),
                list()
            ),
            "give --series with one of these numbers, or the end of its UID",
        )),
        _ => Err(wrong(
            format!("the folder holds {} series: {}", all.len(), list()),
            "give --series with the number of one, or the end of its UID, or keep one series per folder",
        )),
    }
}

/// All slices are as large, as fine, as turned and as written as the first.
fn check_alike(slices: &[Slice]) -> Result<(), Unread> {
    let Some((first, others)) = slices.split_first() else { return Ok(()) };
    let is_near = |a: f64, b: f64| (a - b).abs() <= AGREE * a.abs();
    for slice in others {
        let differ = |what: String, remedy: &str| Err(wrong(what, remedy).in_file(&slice.path));
        let than = plain(&first.path.file_name().unwrap_or_default().to_string_lossy());
        if [slice.shape.columns, slice.shape.rows] != [first.shape.columns, first.shape.rows] {
            let [a, b] = [slice, first].map(|s| format!("{}×{}", s.shape.columns, s.shape.rows));
            return differ(
                format!("this slice has {a} pixels, {than} has {b}"),
                "take it out of the folder, or export the series again with slices of one size",
            );
        }
        if !(0..2).all(|i| is_near(first.spacing[i], slice.spacing[i])) {
            let [a, b] = [slice, first].map(|s| format!("{}×{} mm", s.spacing[0], s.spacing[1]));
            return differ(
                format!("this slice's pixels are {a} apart, those of {than} {b}"),
                "take it out of the folder, or export the series again with one pixel spacing",
            );
        }
        if !(0..2).all(|i| first.along[i].distance(slice.along[i]) < 10.0 * AGREE) {
            return differ(
                format!("this slice is turned another way than {than}"),
                "take it out of the folder: a scout view (localizer) is no part of the volume",
            );
        }
    }
    Ok(())
}

/// Slices in the order in which they lie, evenly.
#[derive(Debug)]
struct Stack {
    slices: Vec<Slice>,
    /// From one slice to the next, mm.
    step: DVec3,
}

impl Stack {
    fn of(mut slices: Vec<Slice>) -> Result<Stack, Unread> {
        let normal = slices[0].along[0].cross(slices[0].along[1]);
        let height = |slice: &Slice| slice.position.dot(normal);
        slices.sort_by(|a, b| height(a).total_cmp(&height(b)).then_with(|| a.path.cmp(&b.path)));
        let count = slices.len();
        if count < 2 {
            let what = "there is one slice, and a volume needs many";
            return Err(wrong(what, "export the whole series into the folder"));
        }
        let gaps: Vec<f64> = slices.windows(2).map(|pair| height(&pair[1]) - height(&pair[0])).collect();
        let usual = *gaps.clone().select_nth_unstable_by((count - 1) / 2, f64::total_cmp).1;
        let name = |n: usize| plain(&slices[n].path.file_name().unwrap_or_default().to_string_lossy());
        for (n, gap) in gaps.into_iter().enumerate() {
            let off = gap / usual;
            let (a, b) = (name(n), name(n + 1));
            // NaN where numbers of a damaged file are beyond all measure.
            if gap.is_nan() || gap <= 0.5 * usual.max(1e-3) {
                return Err(wrong(
                    format!("{a} and {b} lie in the same place"),
                    "take one of them out of the folder: a slice is there twice, or two series are mixed",
                )
                .in_file(&slices[n + 1].path));
            }
            if (off - 1.0).abs() > UNEVEN {
                let missing = (off - off.round()).abs() < 0.1 && off > 1.5;
                let what = match missing {
                    true => format!("between {a} and {b} {} slices are missing", off.round() - 1.0),
                    false => format!("{a} and {b} lie {gap:.3} mm apart, the others {usual:.3} mm"),
                };
                let remedy = match missing {
                    true => "export the series again, or copy what was left behind",
                    false => "have the series reconstructed with even slices: what lies between is not known",
                };
                return Err(wrong(what, remedy).in_file(&slices[n + 1].path));
            }
        }
        let whole = slices[count - 1].position - slices[0].position;
        let aside = (whole - normal * whole.dot(normal)).length();
        if aside > TILT_MAX * whole.dot(normal) {
            let degrees = (aside / whole.dot(normal)).atan().to_degrees();
            return Err(wrong(
                format!("the slices lean by {degrees:.1}° (gantry tilt): each is shifted against the one before"),
                "have the series reconstructed without tilt, or resample it in a viewer (3D Slicer: acquisition transform)",
            ));
        }
        let step = normal * (whole.dot(normal) / (count - 1) as f64);
        Ok(Stack { slices, step })
    }

    fn image(&self) -> Result<Image, Unread> {
        let first = &self.slices[0];
        let dims = [first.shape.columns.into(), first.shape.rows.into(), self.slices.len() as u64];
        let dims = check_dims(dims).map_err(shared)?;
        check_origin(first.position).map_err(shared)?;
        let steps = [first.along[0] * first.spacing[0], first.along[1] * first.spacing[1], self.step];
        // Adding zero makes +0 of -0.
        let steps = steps.map(|step| step + DVec3::ZERO);
        let geometry = Geometry { dims, steps, origin: first.position, space: Space::LeftPosteriorSuperior };
        let samples = match self.slices.iter().all(fits_in_16_bits) {
            true => Samples::I16(self.values(geometry.len(), |value| value as i16)?),
            false => Samples::F32(self.values(geometry.len(), |value| value)?),
        };
        Ok(Image { geometry, samples, keys: Vec::new() })
    }

    /// The numbers of all slices. Their heads have been held against their files' sizes.
    fn values<T>(&self, count: usize, narrow: impl Fn(f32) -> T) -> Result<Vec<T>, Unread> {
        let mut all = Vec::new();
        for slice in &self.slices {
            let in_file = |unread: Unread| unread.in_file(&slice.path);
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

/// Whether every number that a slice can hold is a whole one of 16 bits with sign, as Hounsfield units are.
fn fits_in_16_bits(slice: &Slice) -> bool {
    let bits = i32::from(slice.shape.bits);
    let most = f64::from(1 << (bits - i32::from(slice.shape.is_signed))) - 1.0;
    let least = if slice.shape.is_signed { -most - 1.0 } else { 0.0 };
    let is_whole = slice.slope == 1.0 && slice.intercept.fract() == 0.0;
    is_whole && least + slice.intercept >= f64::from(i16::MIN) && most + slice.intercept <= f64::from(i16::MAX)
}
