//! MetaImage volumes, `.mha` and `.mhd` with its data file, as ITK's tools write them.
//!
//! The format: <https://itk.org/Wiki/ITK/MetaIO/Documentation>. Its space is ITK's: left, posterior, superior.

use super::unread::{Unread, plain};
use crate::content::nrrd::{Element, Error, Geometry, Image, Layout, Place, Problem, Samples, Skip, Source, Space};
use crate::content::nrrd::{check_dims, check_origin, decode, decode_zlib};
use glam::DVec3;
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use std::path::{Component, Path};

const DOING: &str = "reading a MetaImage volume";

/// Most bytes of a line, and most lines, of a header: ITK writes about fifteen short ones.
const LINE_MAX: u64 = 4096;
const LINES_MAX: usize = 1000;

/// Reads a volume, and the data file beside it if the header names one.
pub fn read(path: &Path) -> Result<Image, Unread> {
    let source = Source::of_file(path).map_err(|problem| shared(problem).in_file(path))?;
    load(source, &|name| Source::beside(path, name).map_err(shared)).map_err(|unread| unread.in_file(path))
}

/// Reads a volume from memory. One whose header names a data file is refused.
pub fn parse(bytes: &[u8]) -> Result<Image, Unread> {
    load(Source::of_slice(bytes), &|name| {
        Err(wrong(format!("its voxels are in \"{}\"", plain(name)), "give the whole volume as one .mha file"))
    })
}

fn shared(problem: Problem) -> Unread {
    Unread::of(DOING, Error { doing: DOING, problem, place: Place::Whole, path: None })
}

fn wrong(what: impl Into<String>, remedy: &str) -> Unread {
    Unread::new(DOING, what, remedy)
}

fn load<'a>(mut source: Source<'a>, open: &dyn Fn(&str) -> Result<Source<'a>, Unread>) -> Result<Image, Unread> {
    let header = Header::read(&mut source)?;
    let layout = header.layout()?;
    let name = header.need("ElementDataFile")?;
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
        let unread = Unread::of(DOING, error);
        path.iter().fold(unread, |unread, path| unread.in_file(path))
    })?;
    Ok(Image { geometry: layout.geometry, samples, keys: Vec::new() })
}

/// One data file in the header's own folder, or below it.
fn check_name(name: &str) -> Result<(), Unread> {
    let said = plain(name);
    if name.split_whitespace().next() == Some("LIST") || name.contains('%') {
        let what = format!("its voxels are in many files (\"{said}\")");
        return Err(wrong(what, "save the volume as one .mha file"));
    }
    let is_below = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    match is_below && !name.is_empty() && !name.contains(['\\', '\0']) {
        true => Ok(()),
        false => Err(wrong(
            format!("the data file \"{said}\" is not in the header's folder"),
            "put the data file beside the header and name it without any folder above",
        )),
    }
}

struct Header(BTreeMap<String, String>);

impl Header {
    /// Reads the lines up to `ElementDataFile`, which is the last.
    fn read(source: &mut Source) -> Result<Header, Unread> {
        let again = "copy or export the file again";
        let mut header = Header(BTreeMap::new());
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
                    (1, _) => wrong("the file does not begin as MetaImage files do", "export the volume as .mha"),
                    (_, Some(b'\n')) => wrong(
                        format!("line {number}: \"{}\" is not `Key = value`", plain(text.trim_end())),
                        "correct the line, or export the volume again",
                    ),
                    _ => wrong("the file ends before `ElementDataFile`, the header's last line", again),
                });
            };
            let (key, value) = (key.trim().to_string(), value.trim().to_string());
            let is_last = key == "ElementDataFile";
            if header.0.insert(key.clone(), value).is_some() {
                let what = format!("line {number}: `{}` stands twice", plain(&key));
                return Err(wrong(what, "leave the one that is right"));
            }
            if is_last {
                return Ok(header);
            }
        }
        Err(wrong(format!("the header has more than {LINES_MAX} lines"), "export the volume again"))
    }

    /// The first of some names of the same key that is there.
    fn get(&self, names: &[&str]) -> Option<&str> {
        names.iter().find_map(|name| self.0.get(*name)).map(String::as_str)
    }

    fn need(&self, name: &str) -> Result<&str, Unread> {
        self.get(&[name]).ok_or_else(|| wrong(format!("the header has no `{name}`"), "export the volume again"))
    }

    fn is_true(&self, names: &[&str]) -> Result<bool, Unread> {
        match self.get(names).map(str::to_ascii_lowercase).as_deref() {
            None | Some("false" | "0" | "no") => Ok(false),
            Some("true" | "1" | "yes") => Ok(true),
            Some(other) => {
                let what = format!("`{}` cannot be \"{}\"", names[0], plain(other));
                Err(wrong(what, "it takes True or False"))
            }
        }
    }

    fn numbers<const N: usize>(&self, names: &[&str]) -> Result<Option<[f64; N]>, Unread> {
        let Some(text) = self.get(names) else { return Ok(None) };
        let found: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = found.and_then(|found| <[f64; N]>::try_from(found).ok());
        numbers.map(Some).ok_or_else(|| {
            let what = format!("`{}` cannot be \"{}\"", names[0], plain(text));
            Unread::new(DOING, what, format!("it takes {N} numbers"))
        })
    }

    fn layout(&self) -> Result<Layout, Unread> {
        if let Some(other) = self.get(&["ObjectType"]).filter(|kind| *kind != "Image") {
            return Err(wrong(format!("it holds a \"{}\"", plain(other)), "give an image"));
        }
        if let Some(axes) = self.get(&["NDims"]).filter(|axes| *axes != "3") {
            return Err(wrong(format!("it has {} axes", plain(axes)), "export a single volume of three axes"));
        }
        if let Some(channels) = self.get(&["ElementNumberOfChannels"]).filter(|channels| *channels != "1") {
            let what = format!("it holds {} values per voxel", plain(channels));
            return Err(wrong(what, "export a single value per voxel"));
        }
        if self.get(&["BinaryData"]).is_some() && !self.is_true(&["BinaryData"])? {
            return Err(wrong("its voxels are written as text", "save it with binary data"));
        }
        Ok(Layout {
            geometry: self.geometry()?,
            element: self.element()?,
            is_big_endian: self.is_true(&["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])?,
            is_gzip: false,
            line_skip: 0,
            byte_skip: self.skip()?,
            data_file: None,
        })
    }

    fn element(&self) -> Result<Element, Unread> {
        Ok(match self.need("ElementType")? {
            "MET_UCHAR" => Element::U8,
            "MET_CHAR" => Element::I8,
            "MET_USHORT" => Element::U16,
            "MET_SHORT" => Element::I16,
            "MET_UINT" => Element::U32,
            "MET_INT" => Element::I32,
            "MET_ULONG_LONG" => Element::U64,
            "MET_LONG_LONG" => Element::I64,
            "MET_FLOAT" => Element::F32,
            "MET_DOUBLE" => Element::F64,
            other => {
                let what = format!("`ElementType = {}` is not read here", plain(other));
                return Err(wrong(what, "save it as MET_UCHAR, MET_SHORT, MET_USHORT or MET_FLOAT"));
            }
        })
    }

    fn geometry(&self) -> Result<Geometry, Unread> {
        let text = self.need("DimSize")?;
        let sizes = text.split_whitespace().map(|word| word.parse().ok().filter(|&n: &u64| n > 0));
        let sizes: Option<[u64; 3]> = sizes.collect::<Option<Vec<u64>>>().and_then(|sizes| sizes.try_into().ok());
        let sizes = sizes.ok_or_else(|| {
            wrong(format!("`DimSize` cannot be \"{}\"", plain(text)), "it takes three whole numbers above 0")
        })?;
        let dims = check_dims(sizes).map_err(shared)?;
        let spacing: [f64; 3] = self.numbers(&["ElementSpacing", "ElementSize"])?.ok_or_else(|| {
            wrong(
                "the header has no `ElementSpacing`",
                "add the line that is true, as in `ElementSpacing = 0.2 0.2 0.2`",
            )
        })?;
        let turn: [f64; 9] = self
            .numbers(&["TransformMatrix", "Orientation", "Rotation"])?
            .unwrap_or([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let origin = DVec3::from(self.numbers(&["Offset", "Position", "Origin"])?.unwrap_or([0.0; 3]));
        check_origin(origin).map_err(shared)?;
        // Each three numbers are the direction of one axis of the array. Adding zero makes +0 of -0.
        let step = |axis: usize| DVec3::from_slice(&turn[3 * axis..]) * spacing[axis] + DVec3::ZERO;
        Ok(Geometry { dims, steps: [0, 1, 2].map(step), origin, space: Space::LeftPosteriorSuperior })
    }

    fn skip(&self) -> Result<Skip, Unread> {
        match self.get(&["HeaderSize"]).map(str::parse::<i64>) {
            None => Ok(Skip::Bytes(0)),
            Some(Ok(-1)) => Ok(Skip::ToEnd),
            Some(Ok(bytes @ 0..)) => Ok(Skip::Bytes(bytes as u64)),
            Some(_) => Err(wrong("`HeaderSize` is no number of bytes", "give a number of bytes, or -1")),
        }
    }
}
