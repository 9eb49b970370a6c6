//! MetaImage volumes: `.mha`, and `.mhd` with its data file, as ITK's tools write them.
//!
//! Takes a file or bytes. Gives a volume in ITK's space: left, posterior, superior. Never opens a data file outside
//! the header's folder. The format: <https://itk.org/Wiki/ITK/MetaIO/Documentation>.

use crate::imaging::error::{ScanError, sanitized_excerpt};
use crate::nrrd::{
    ByteSkip, ByteSource, CoordinateSystem, ErrorLocation, Geometry, NrrdError, NrrdErrorKind, SampleLayout,
    SampleType, Samples, VoxelImage,
};
use crate::nrrd::{check_dims, check_origin, decode, decode_zlib};
use glam::DVec3;
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::path::{Component, Path};

const DOING: &str = "reading a MetaImage volume";

/// Maximum length of a header line, bytes, and maximum number of lines: ITK writes about fifteen short ones.
const LINE_MAX: u64 = 4096;
const LINES_MAX: usize = 1000;

/// Reads a volume from a file, and from the data file beside it if the header names one.
///
/// # Errors
/// Fails when a file cannot be read, or when the header or the data are invalid or not supported.
pub fn read(path: &Path) -> Result<VoxelImage, ScanError> {
    let source = ByteSource::of_file(path).map_err(|problem| from_nrrd_problem(problem).in_file(path))?;
    load(source, &|name| ByteSource::open_beside(path, name).map_err(from_nrrd_problem))
        .map_err(|unread| unread.in_file(path))
}

/// Parses a volume in memory.
///
/// # Errors
/// Fails when the header or the data are invalid or not supported, or when the header names a data file.
pub fn parse(bytes: &[u8]) -> Result<VoxelImage, ScanError> {
    load(ByteSource::of_slice(bytes), &|name| {
        Err(wrong(
            format!("its voxels are in \"{}\"", sanitized_excerpt(name)),
            "give the whole volume as one .mha file",
        ))
    })
}

fn from_nrrd_problem(problem: NrrdErrorKind) -> ScanError {
    ScanError::from_nrrd(DOING, NrrdError { doing: DOING, kind: problem, location: ErrorLocation::Whole, path: None })
}

fn wrong(what: impl Into<String>, remedy: &str) -> ScanError {
    ScanError::new(DOING, what, remedy)
}

fn load<'a>(
    mut source: ByteSource<'a>,
    open: &dyn Fn(&str) -> Result<ByteSource<'a>, ScanError>,
) -> Result<VoxelImage, ScanError> {
    let header = MetaImageHeader::read(&mut source)?;
    let layout = header.layout()?;
    let name = header.required("ElementDataFile")?;
    if name != "LOCAL" {
        check_name(name)?;
        source = open(name)?;
    }
    let path = source.path.clone();
    let samples = match header.is_true(&["CompressedData"])? {
        true => decode_zlib(&layout, &mut source),
        false => decode(&layout, &mut source),
    };
    let samples: Samples = samples.map_err(|error| {
        let unread = ScanError::from_nrrd(DOING, error);
        path.iter().fold(unread, |unread, path| unread.in_file(path))
    })?;
    Ok(VoxelImage { geometry: layout.geometry, samples, keys: Vec::new() })
}

/// Accepts a single data file in the header's own folder or below it.
fn check_name(name: &str) -> Result<(), ScanError> {
    let said = sanitized_excerpt(name);
    if name.split_whitespace().next() == Some("LIST") || name.contains('%') {
        let what = format!("its voxels are in several files (\"{said}\")");
        return Err(wrong(what, "save the volume as one .mha file"));
    }
    let is_below = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    match is_below && !name.is_empty() && !name.contains(['\\', '\0']) {
        true => Ok(()),
        false => Err(wrong(
            format!("the data file \"{said}\" is not in the header's folder"),
            "put the data file beside the header and name it without a parent folder",
        )),
    }
}

struct MetaImageHeader(BTreeMap<String, String>);

impl MetaImageHeader {
    /// Reads the lines up to and including `ElementDataFile`, which is the last.
    fn read(source: &mut ByteSource) -> Result<MetaImageHeader, ScanError> {
        let again = "copy or export the file again";
        let mut header = MetaImageHeader(BTreeMap::new());
        for number in 1..=LINES_MAX {
            let mut line = Vec::new();
            let read = source.by_ref().take(LINE_MAX).read_until(b'\n', &mut line);
            read.map_err(|error| wrong(format!("the file cannot be read ({error})"), again))?;
            if number == 1 && line.is_empty() {
                return Err(wrong("the file is empty", again));
            }
            let text = String::from_utf8_lossy(&line);
            let pair = text.split_once('=').filter(|_| line.len() < LINE_MAX as usize);
            let Some((key, value)) = pair else {
                return Err(match (number, line.last()) {
                    (1, _) => wrong("the file does not begin like a MetaImage file", "export the volume as .mha"),
                    (_, Some(b'\n')) => wrong(
                        format!("line {number}: \"{}\" is not `Key = value`", sanitized_excerpt(text.trim_end())),
                        "correct the line, or export the volume again",
                    ),
                    _ => wrong("the file ends before `ElementDataFile`, the header's last line", again),
                });
            };
            let (key, value) = (key.trim().to_string(), value.trim().to_string());
            let is_last = key == "ElementDataFile";
            if header.0.insert(key.clone(), value).is_some() {
                let what = format!("line {number}: `{}` is present twice", sanitized_excerpt(&key));
                return Err(wrong(what, "keep only the correct one"));
            }
            if is_last {
                return Ok(header);
            }
        }
        Err(wrong(format!("the header has more than {LINES_MAX} lines"), "export the volume again"))
    }

    /// Returns the value of the first key that is present, out of several names of the same key.
    fn get(&self, names: &[&str]) -> Option<&str> {
        names.iter().find_map(|name| self.0.get(*name)).map(String::as_str)
    }

    fn required(&self, name: &str) -> Result<&str, ScanError> {
        self.get(&[name]).ok_or_else(|| wrong(format!("the header has no `{name}`"), "export the volume again"))
    }

    fn is_true(&self, names: &[&str]) -> Result<bool, ScanError> {
        match self.get(names).map(str::to_ascii_lowercase).as_deref() {
            None | Some("false" | "0" | "no") => Ok(false),
            Some("true" | "1" | "yes") => Ok(true),
            Some(other) => {
                let what = format!("`{}` cannot be \"{}\"", names[0], sanitized_excerpt(other));
                Err(wrong(what, "expected True or False"))
            }
        }
    }

    fn numbers<const N: usize>(&self, names: &[&str]) -> Result<Option<[f64; N]>, ScanError> {
        let Some(text) = self.get(names) else { return Ok(None) };
        let found: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = found.and_then(|found| <[f64; N]>::try_from(found).ok());
        numbers.map(Some).ok_or_else(|| {
            let what = format!("`{}` cannot be \"{}\"", names[0], sanitized_excerpt(text));
            ScanError::new(DOING, what, format!("expected {N} numbers"))
        })
    }

    fn layout(&self) -> Result<SampleLayout, ScanError> {
        if let Some(other) = self.get(&["ObjectType"]).filter(|kind| *kind != "Image") {
            return Err(wrong(format!("it contains a \"{}\"", sanitized_excerpt(other)), "give an image"));
        }
        if let Some(axes) = self.get(&["NDims"]).filter(|axes| *axes != "3") {
            return Err(wrong(
                format!("it has {} axes", sanitized_excerpt(axes)),
                "export a single volume of three axes",
            ));
        }
        if let Some(channels) = self.get(&["ElementNumberOfChannels"]).filter(|channels| *channels != "1") {
            let what = format!("it contains {} values per voxel", sanitized_excerpt(channels));
            return Err(wrong(what, "export a single value per voxel"));
        }
        if self.get(&["BinaryData"]).is_some() && !self.is_true(&["BinaryData"])? {
            return Err(wrong("its voxels are written as text", "save it with binary data"));
        }
        Ok(SampleLayout {
            geometry: self.geometry()?,
            sample_type: self.sample_type()?,
            is_big_endian: self.is_true(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])?,
            is_gzip: false,
            line_skip: 0,
            byte_skip: self.skip()?,
            data_file: None,
        })
    }

    fn sample_type(&self) -> Result<SampleType, ScanError> {
        Ok(match self.required("ElementType")? {
            "MET_UCHAR" => SampleType::U8,
            "MET_CHAR" => SampleType::I8,
            "MET_USHORT" => SampleType::U16,
            "MET_SHORT" => SampleType::I16,
            "MET_UINT" => SampleType::U32,
            "MET_INT" => SampleType::I32,
            "MET_ULONG_LONG" => SampleType::U64,
            "MET_LONG_LONG" => SampleType::I64,
            "MET_FLOAT" => SampleType::F32,
            "MET_DOUBLE" => SampleType::F64,
            other => {
                let what = format!("`ElementType = {}` is not supported", sanitized_excerpt(other));
                return Err(wrong(what, "save it as MET_UCHAR, MET_SHORT, MET_USHORT or MET_FLOAT"));
            }
        })
    }

    fn geometry(&self) -> Result<Geometry, ScanError> {
        let text = self.required("DimSize")?;
        let sizes = text.split_whitespace().map(|word| word.parse().ok().filter(|&n: &u64| n > 0));
        let sizes: Option<[u64; 3]> = sizes.collect::<Option<Vec<u64>>>().and_then(|sizes| sizes.try_into().ok());
        let sizes = sizes.ok_or_else(|| {
            wrong(
                format!("`DimSize` cannot be \"{}\"", sanitized_excerpt(text)),
                "expected three whole numbers above 0",
            )
        })?;
        let dims = check_dims(sizes).map_err(from_nrrd_problem)?;
        let spacing: [f64; 3] = self.numbers(&["ElementSpacing", "ElementSize"])?.ok_or_else(|| {
            wrong(
                "the header has no `ElementSpacing`",
                "add the line with the true spacing, as in `ElementSpacing = 0.2 0.2 0.2`",
            )
        })?;
        let directions: [f64; 9] = self
            .numbers(&["TransformMatrix", "Orientation", "Rotation"])?
            .unwrap_or([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let origin = DVec3::from(self.numbers(&["Offset", "Position", "Origin"])?.unwrap_or([0.0; 3]));
        check_origin(origin).map_err(from_nrrd_problem)?;
        // Each three numbers are the direction of one axis of the array. Adding zero turns −0 into +0.
        let step = |axis: usize| DVec3::from_slice(&directions[3 * axis..]) * spacing[axis] + DVec3::ZERO;
        Ok(Geometry { dims, steps: [0, 1, 2].map(step), origin, space: CoordinateSystem::LeftPosteriorSuperior })
    }

    fn skip(&self) -> Result<ByteSkip, ScanError> {
        match self.get(&["HeaderSize"]).map(str::parse::<i64>) {
            None => Ok(ByteSkip::Bytes(0)),
            Some(Ok(-1)) => Ok(ByteSkip::ToEnd),
            Some(Ok(bytes @ 0..)) => Ok(ByteSkip::Bytes(bytes as u64)),
            Some(_) => Err(wrong("`HeaderSize` is not a number of bytes", "give a number of bytes, or -1")),
        }
    }
}
