//! NIfTI-1 volumes, `.nii` and `.nii.gz`, as neuroimaging tools, ITK-SNAP and machine-learning pipelines write them.
//!
//! Takes a file or bytes. Gives a volume in left-posterior-superior space; NIfTI's own space is
//! right-anterior-superior. Never reads more than one value per voxel. The format:
//! <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>.

use crate::imaging::error::ScanError;
use crate::nrrd::{
    ByteSkip, ByteSource, CoordinateSystem, ErrorLocation, Geometry, NrrdErrorKind, SampleLayout, SampleType, Samples,
    VoxelImage,
};
use crate::nrrd::{check_dims, check_origin, decode};
use flate2::bufread::GzDecoder;
use glam::DVec3;
use std::io::Read;
use std::path::Path;

const DOING: &str = "reading a NIfTI volume";

/// Size of a NIfTI-1 header and of a NIfTI-2 header, bytes.
const HEADER: usize = 348;
const HEADER_2: i32 = 540;

/// Maximum number of bytes between the header and the voxels, where extensions (comments) may be.
const EXTENSIONS_MAX: f32 = (1 << 20) as f32;

/// Reads a volume with one value per voxel from a file.
///
/// # Errors
/// Fails when the file cannot be read, or when its header or data are invalid or not supported.
pub fn read(path: &Path) -> Result<VoxelImage, ScanError> {
    let open = || ByteSource::of_file(path).map_err(from_nrrd_problem);
    load(&open).map_err(|unread| unread.in_file(path))
}

/// Parses a volume in memory.
///
/// # Errors
/// Fails when the header or the data are invalid or not supported.
pub fn parse(bytes: &[u8]) -> Result<VoxelImage, ScanError> {
    load(&|| Ok(ByteSource::of_slice(bytes)))
}

fn from_nrrd_problem(problem: NrrdErrorKind) -> ScanError {
    ScanError::from_nrrd(
        DOING,
        crate::nrrd::NrrdError { doing: DOING, kind: problem, location: ErrorLocation::Whole, path: None },
    )
}

fn wrong(what: impl Into<String>, remedy: &str) -> ScanError {
    ScanError::new(DOING, what, remedy)
}

/// Opens the source twice, for the header and for the voxels, because a compressed stream cannot be rewound.
fn load<'a>(open: &dyn Fn() -> Result<ByteSource<'a>, ScanError>) -> Result<VoxelImage, ScanError> {
    let mut first = Vec::new();
    let mut is_gzip = false;
    let read = |from: &mut dyn Read, to: &mut Vec<u8>| from.take(HEADER as u64).read_to_end(to);
    let broken = |_| wrong("the file cannot be read or inflated", "copy or export the file again");
    read(&mut open()?, &mut first).map_err(broken)?;
    if first.starts_with(&[0x1f, 0x8b]) {
        is_gzip = true;
        first.clear();
        read(&mut GzDecoder::new(open()?), &mut first).map_err(broken)?;
    }
    let header = NiftiHeader::of(&first)?;
    let layout = header.layout(is_gzip)?;
    let samples = decode(&layout, &mut open()?).map_err(|error| ScanError::from_nrrd(DOING, error))?;
    Ok(VoxelImage { geometry: layout.geometry, samples: header.scaled(samples), keys: Vec::new() })
}

struct NiftiHeader<'a> {
    bytes: &'a [u8],
    is_big_endian: bool,
}

impl NiftiHeader<'_> {
    fn of(bytes: &[u8]) -> Result<NiftiHeader<'_>, ScanError> {
        if bytes.is_empty() {
            return Err(wrong("the file is empty", "copy or export the file again"));
        }
        if bytes.len() < HEADER {
            return Err(wrong("the file ends within its header of 348 bytes", "copy or export the file again"));
        }
        let size = [i32::from_le_bytes, i32::from_be_bytes].map(|word| word([bytes[0], bytes[1], bytes[2], bytes[3]]));
        let header = match size {
            [348, _] => NiftiHeader { bytes, is_big_endian: false },
            [_, 348] => NiftiHeader { bytes, is_big_endian: true },
            [HEADER_2, _] | [_, HEADER_2] => {
                return Err(wrong("this is NIfTI-2, which is not supported", "save it as NIfTI-1 (.nii or .nii.gz)"));
            }
            _ => {
                return Err(wrong("the file does not begin like a NIfTI file", "export the volume as .nii or .nii.gz"));
            }
        };
        match &bytes[344..348] {
            b"n+1\0" => Ok(header),
            b"ni1\0" => {
                Err(wrong("header and voxels are in two files (.hdr and .img)", "save it as one .nii or .nii.gz file"))
            }
            _ => Err(wrong(
                "the header has no NIfTI-1 magic string (an Analyze 7.5 file?)",
                "export the volume as .nii or .nii.gz",
            )),
        }
    }

    fn short(&self, at: usize) -> i16 {
        let bytes = [self.bytes[at], self.bytes[at + 1]];
        if self.is_big_endian { i16::from_be_bytes(bytes) } else { i16::from_le_bytes(bytes) }
    }

    fn float(&self, at: usize) -> f64 {
        let bytes = [self.bytes[at], self.bytes[at + 1], self.bytes[at + 2], self.bytes[at + 3]];
        f64::from(if self.is_big_endian { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) })
    }

    fn layout(&self, is_gzip: bool) -> Result<SampleLayout, ScanError> {
        let sample_type = self.sample_type()?;
        let geometry = self.geometry()?;
        let offset = self.float(108) as f32;
        if !(352.0..=EXTENSIONS_MAX).contains(&offset) || offset.fract() != 0.0 {
            let what = format!("the voxels cannot begin at byte {offset} (vox_offset)");
            return Err(wrong(what, "export the volume again: a single file has them at byte 352 or a little later"));
        }
        Ok(SampleLayout {
            geometry,
            sample_type,
            is_big_endian: self.is_big_endian,
            is_gzip,
            line_skip: 0,
            byte_skip: ByteSkip::Bytes(offset as u64),
            data_file: None,
        })
    }

    fn sample_type(&self) -> Result<SampleType, ScanError> {
        Ok(match self.short(70) {
            2 => SampleType::U8,
            256 => SampleType::I8,
            4 => SampleType::I16,
            512 => SampleType::U16,
            8 => SampleType::I32,
            768 => SampleType::U32,
            1024 => SampleType::I64,
            1280 => SampleType::U64,
            16 => SampleType::F32,
            64 => SampleType::F64,
            other => {
                let name = match other {
                    1 => "single bits",
                    32 | 1792 | 2048 => "complex numbers",
                    128 | 2304 => "colour values",
                    1536 => "floats of 128 bits",
                    _ => "an unknown type",
                };
                let what = format!("its voxels are {name} (datatype {other})");
                return Err(wrong(what, "save it with one whole or floating-point number per voxel"));
            }
        })
    }

    fn geometry(&self) -> Result<Geometry, ScanError> {
        let count = self.short(40);
        let dim = |axis: usize| self.short(40 + 2 * axis);
        if !(1..=7).contains(&count) {
            return Err(wrong(format!("it has {count} axes (dim[0])"), "export the volume again"));
        }
        if count < 3 {
            return Err(wrong(
                format!("it has {count} axes"),
                "a flat image is not a volume: stack its slices into one file",
            ));
        }
        if let Some(axis) = (4..=count as usize).find(|&axis| dim(axis) > 1) {
            let what = format!("it contains {} volumes or values per voxel (dim[{axis}])", dim(axis));
            return Err(wrong(what, "export a single volume of three axes"));
        }
        let dims = [dim(1), dim(2), dim(3)];
        if let Some(axis) = (0..3).find(|&axis| dims[axis] < 1) {
            let what = format!("it has {} voxels along axis {}", dims[axis], axis + 1);
            return Err(wrong(what, "export the volume again"));
        }
        let dims = check_dims(dims.map(|n| n as u64)).map_err(from_nrrd_problem)?;
        let unit = self.unit()?;
        let (steps, origin, space) = self.axes_and_origin();
        let flip = DVec3::new(-unit, -unit, unit);
        // Adding zero turns −0 into +0.
        let steps = steps.map(|step| step * flip + DVec3::ZERO);
        let origin = origin * flip + DVec3::ZERO;
        check_origin(origin).map_err(from_nrrd_problem)?;
        Ok(Geometry { dims, steps, origin, space })
    }

    /// Length of the file's unit, mm.
    fn unit(&self) -> Result<f64, ScanError> {
        match self.bytes[123] & 7 {
            // Most writers that do not declare a unit mean millimetres.
            0 | 2 => Ok(1.0),
            1 => Ok(1000.0),
            3 => Ok(0.001),
            other => Err(wrong(format!("its unit of length has the unknown code {other}"), "save it in mm")),
        }
    }

    /// Returns the steps between voxels and the position of the first voxel, in right-anterior-superior space: by
    /// `sform`, else by `qform`, else by the spacings alone, as the format prescribes.
    fn axes_and_origin(&self) -> ([DVec3; 3], DVec3, CoordinateSystem) {
        let row = |at: usize| [0, 4, 8, 12].map(|n| self.float(at + n));
        if self.short(254) > 0 {
            let [x, y, z] = [280, 296, 312].map(row);
            let column = |c: usize| DVec3::new(x[c], y[c], z[c]);
            return ([column(0), column(1), column(2)], column(3), CoordinateSystem::LeftPosteriorSuperior);
        }
        let spacing = [80, 84, 88].map(|at| self.float(at).abs());
        if self.short(252) > 0 {
            let [b, c, d] = [256, 260, 264].map(|at| self.float(at));
            let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
            let rotation = [
                DVec3::new(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)),
                DVec3::new(2.0 * (b * c - a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d + a * b)),
                DVec3::new(2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - b * b - c * c),
            ];
            let handedness = if self.float(76) < 0.0 { -1.0 } else { 1.0 };
            let steps = [rotation[0] * spacing[0], rotation[1] * spacing[1], rotation[2] * spacing[2] * handedness];
            return (
                steps,
                DVec3::from([268, 272, 276].map(|at| self.float(at))),
                CoordinateSystem::LeftPosteriorSuperior,
            );
        }
        // In left-posterior-superior axes: the caller negates x and y again.
        let steps = [DVec3::NEG_X * spacing[0], DVec3::NEG_Y * spacing[1], DVec3::Z * spacing[2]];
        (steps, DVec3::ZERO, CoordinateSystem::Unspecified)
    }

    /// Rescales the samples by the header's slope and intercept.
    fn scaled(&self, samples: Samples) -> Samples {
        let (slope, intercept) = (self.float(112) as f32, self.float(116) as f32);
        // A slope of zero means no rescaling.
        if slope == 0.0 || !slope.is_finite() || !intercept.is_finite() || (slope == 1.0 && intercept == 0.0) {
            return samples;
        }
        crate::imaging::crop::map_values(samples, |value| value * slope + intercept)
    }
}
