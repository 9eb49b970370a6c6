//! Bytes into an image: the header first, then exactly the data it declares.

use super::error::{Error, Problem, excerpt};
use super::header::Header;
use super::layout::{Element, Layout, Skip};
use super::source::Source;
use super::{Image, Samples};
use flate2::bufread::{GzDecoder, ZlibDecoder};
use std::io::{self, BufRead, Read};
use std::path::Path;

/// Bytes tolerated after the data: some writers end the file with a line break or pad it to a word.
const TRAILING_MAX: u64 = 8;

/// No deflate stream inflates to more than this many times its size (258 bytes per two bits; zlib's own figure).
const DEFLATE_RATIO_MAX: u64 = 1032;

/// Most members of a gzip stream. The largest volume in blocks of 64 KiB, as bgzip writes them, has a quarter of it; and
/// to begin a member takes time whether anything is in it or not.
const MEMBERS_MAX: u32 = 1 << 16;

/// Room made before anything has come out of a compressed stream; from there it doubles as data really come.
const ROOM: u64 = 1 << 20;

/// Reads a volume, and the data file beside it if the header names one.
pub fn read(path: &Path) -> Result<Image, Error> {
    let in_file = |error: Error| error.in_file(path);
    let source = Source::of_file(path).map_err(|problem| in_file(problem.in_whole()))?;
    load(source, &mut |name| Source::beside(path, name)).map_err(in_file)
}

/// Reads a volume from memory. One whose header names a data file is refused.
pub fn parse(bytes: &[u8]) -> Result<Image, Error> {
    load(Source::of_slice(bytes), &mut |name| {
        Err(Problem::DataFile { name: excerpt(name), why: "cannot be read here: only whole volumes can" })
    })
}

/// Reads a volume from memory, its data from `open` if the header names a data file.
///
/// The name is relative and never leads upward; what `open` makes of links is its own affair.
pub fn parse_detached(bytes: &[u8], open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>) -> Result<Image, Error> {
    load(Source::of_slice(bytes), &mut |name| match open(name) {
        Ok(bytes) => Ok(Source::of_vec(bytes, name)),
        Err(error) => Err(Problem::DataFileUnreadable { name: excerpt(name), error }),
    })
}

type Open<'a, 'b> = &'a mut dyn FnMut(&str) -> Result<Source<'b>, Problem>;

fn load<'a>(mut source: Source<'a>, open: Open<'_, 'a>) -> Result<Image, Error> {
    let header = Header::read(&mut source)?;
    let layout = Layout::of(&header)?;
    if let Some(file) = &layout.data_file {
        source = open(&file.name).map_err(|problem| problem.on(file.line))?;
    }
    let samples = decode(&layout, &mut source).map_err(|error| match &source.path {
        Some(path) => error.in_file(path),
        None => error,
    })?;
    Ok(Image { geometry: layout.geometry, samples, keys: header.keys })
}

/// The samples that a layout declares, from where the source stands to its end.
pub(in crate::content) fn decode(layout: &Layout, source: &mut Source) -> Result<Samples, Error> {
    skip_lines(source, layout.line_skip)?;
    let samples = match layout.is_gzip {
        false => decode_raw(layout, source)?,
        true => decode_gzip(layout, source)?,
    };
    match source.left() {
        0..=TRAILING_MAX => Ok(samples),
        extra => Err(Problem::TooMuch { wanted: layout.bytes(), extra: Some(extra) }.at_byte(source.at())),
    }
}

fn decode_raw(layout: &Layout, source: &mut Source) -> Result<Samples, Error> {
    let wanted = layout.bytes();
    let skip = match layout.byte_skip {
        Skip::Bytes(skip) => skip,
        Skip::ToEnd => source.left().saturating_sub(wanted),
    };
    let left = source.left();
    let found = left.saturating_sub(skip);
    if found < wanted {
        return Err(Problem::Truncated { found, wanted }.at_byte(source.at() + left));
    }
    if found - wanted > TRAILING_MAX {
        let extra = Some(found - wanted);
        return Err(Problem::TooMuch { wanted, extra }.at_byte(source.at() + skip + wanted));
    }
    skip_bytes(source, skip).map_err(|error| Problem::Unreadable(error).at_byte(source.at()))?;
    match fill(layout, source, wanted) {
        Ok(samples) if samples.len() == layout.geometry.len() => Ok(samples),
        // The file shrank while it was read.
        Ok(samples) => {
            let found = samples.len() as u64 * layout.element.width();
            Err(Problem::Truncated { found, wanted }.at_byte(source.at()))
        }
        Err(error) => Err(Problem::Unreadable(error).at_byte(source.at())),
    }
}

/// The same of one zlib stream, as MetaImage files hold.
pub(in crate::content) fn decode_zlib(layout: &Layout, source: &mut Source) -> Result<Samples, Error> {
    let wanted = layout.bytes();
    let compressed = source.left();
    if compressed.saturating_mul(DEFLATE_RATIO_MAX) < wanted {
        return Err(Problem::TooSmallForGzip { compressed, wanted }.at_byte(source.at()));
    }
    let mut stream = ZlibDecoder::new(&mut *source);
    let outcome = fill(layout, &mut stream, ROOM).and_then(|samples| Ok((samples, read_full(&mut stream, &mut [0])?)));
    let found = stream.total_out();
    let at = source.at();
    match outcome {
        Ok((_, 1..)) => Err(Problem::TooMuch { wanted, extra: None }.at_byte(at)),
        Ok(_) if found < wanted => Err(Problem::Truncated { found, wanted }.at_byte(at)),
        Ok((samples, _)) => Ok(samples),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof && found < wanted => {
            Err(Problem::Truncated { found, wanted }.at_byte(at))
        }
        Err(error) => Err(Problem::Gzip(error.to_string()).at_byte(at)),
    }
}

fn decode_gzip(layout: &Layout, source: &mut Source) -> Result<Samples, Error> {
    let wanted = layout.bytes();
    let skip = match layout.byte_skip {
        Skip::Bytes(skip) => skip,
        Skip::ToEnd => 0,
    };
    let compressed = source.left();
    if compressed.saturating_mul(DEFLATE_RATIO_MAX) < wanted {
        return Err(Problem::TooSmallForGzip { compressed, wanted }.at_byte(source.at()));
    }
    let mut stream = Stream { member: Some(GzDecoder::new(&mut *source)), begun: 1, inflated: 0 };
    let outcome = inflate(layout, &mut stream, skip);
    let found = stream.inflated.saturating_sub(skip);
    let at = source.at();
    match outcome {
        Ok(samples) if found == wanted => Ok(samples),
        Ok(_) if found > wanted => Err(Problem::TooMuch { wanted, extra: None }.at_byte(at)),
        Ok(_) => Err(Problem::Truncated { found, wanted }.at_byte(at)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => match found < wanted {
            true => Err(Problem::Truncated { found, wanted }.at_byte(at)),
            false => Err(Problem::Gzip("their checksum is cut off".to_string()).at_byte(at)),
        },
        Err(error) => Err(Problem::Gzip(error.to_string()).at_byte(at)),
    }
}

fn inflate(layout: &Layout, stream: &mut Stream, skip: u64) -> io::Result<Samples> {
    skip_bytes(stream, skip)?;
    let samples = fill(layout, stream, ROOM)?;
    // One byte more than wanted should not come, but asking for it makes the checksum be compared.
    read_full(stream, &mut [0])?;
    Ok(samples)
}

/// A gzip stream, which may consist of several members (pigz and bgzip write such), and a count of what came out.
struct Stream<'a, 'b> {
    /// `None` only while one member gives way to the next.
    member: Option<GzDecoder<&'a mut Source<'b>>>,
    /// Members so far.
    begun: u32,
    inflated: u64,
}

impl Read for Stream<'_, '_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        /// What every member begins with, and trailing line breaks do not.
        const MAGIC: &[u8] = &[0x1f];
        while let Some(member) = &mut self.member {
            let count = member.read(buffer)?;
            self.inflated += count as u64;
            if count > 0 || buffer.is_empty() || !member.get_mut().fill_buf()?.starts_with(MAGIC) {
                return Ok(count);
            }
            if self.begun == MEMBERS_MAX {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "a stream of too many pieces"));
            }
            self.begun += 1;
            self.member = self.member.take().map(|ended| GzDecoder::new(ended.into_inner()));
        }
        Ok(0)
    }
}

/// Reads the samples, or as many as there are. Room for `room` bytes of them is made at once, more as they come.
fn fill(layout: &Layout, from: &mut dyn Read, room: u64) -> io::Result<Samples> {
    let count = layout.geometry.len();
    let room = count.min((room / layout.element.width()) as usize);
    Ok(match (layout.element, layout.is_big_endian) {
        (Element::U8, _) => Samples::U8(collect(from, count, room, |[byte]| byte)?),
        (Element::I8, _) => Samples::I16(collect(from, count, room, |bytes| i8::from_le_bytes(bytes).into())?),
        (Element::I16, false) => Samples::I16(collect(from, count, room, i16::from_le_bytes)?),
        (Element::I16, true) => Samples::I16(collect(from, count, room, i16::from_be_bytes)?),
        (Element::U16, false) => Samples::U16(collect(from, count, room, u16::from_le_bytes)?),
        (Element::U16, true) => Samples::U16(collect(from, count, room, u16::from_be_bytes)?),
        (Element::I32, false) => Samples::F32(collect(from, count, room, |bytes| i32::from_le_bytes(bytes) as f32)?),
        (Element::I32, true) => Samples::F32(collect(from, count, room, |bytes| i32::from_be_bytes(bytes) as f32)?),
        (Element::U32, false) => Samples::F32(collect(from, count, room, |bytes| u32::from_le_bytes(bytes) as f32)?),
        (Element::U32, true) => Samples::F32(collect(from, count, room, |bytes| u32::from_be_bytes(bytes) as f32)?),
        (Element::I64, false) => Samples::F32(collect(from, count, room, |bytes| i64::from_le_bytes(bytes) as f32)?),
        (Element::I64, true) => Samples::F32(collect(from, count, room, |bytes| i64::from_be_bytes(bytes) as f32)?),
        (Element::U64, false) => Samples::F32(collect(from, count, room, |bytes| u64::from_le_bytes(bytes) as f32)?),
        (Element::U64, true) => Samples::F32(collect(from, count, room, |bytes| u64::from_be_bytes(bytes) as f32)?),
        (Element::F32, false) => Samples::F32(collect(from, count, room, f32::from_le_bytes)?),
        (Element::F32, true) => Samples::F32(collect(from, count, room, f32::from_be_bytes)?),
        (Element::F64, false) => Samples::F32(collect(from, count, room, |bytes| f64::from_le_bytes(bytes) as f32)?),
        (Element::F64, true) => Samples::F32(collect(from, count, room, |bytes| f64::from_be_bytes(bytes) as f32)?),
    })
}

fn collect<const WIDTH: usize, T>(
    from: &mut dyn Read,
    count: usize,
    room: usize,
    decode: impl Fn([u8; WIDTH]) -> T,
) -> io::Result<Vec<T>> {
    /// Bytes decoded at a time: they stay in the nearest cache, so that this copy costs next to nothing.
    const CHUNK: usize = 1 << 15;
    let mut chunk = [0; CHUNK];
    let mut samples = Vec::new();
    samples.try_reserve_exact(room)?;
    while samples.len() < count {
        let next = (CHUNK / WIDTH).min(count - samples.len());
        if samples.capacity() - samples.len() < next {
            let doubled = samples.len().max(next).min(count - samples.len());
            samples.try_reserve_exact(doubled)?;
        }
        let wanted = &mut chunk[..next * WIDTH];
        let found = read_full(from, wanted)?;
        let (values, _) = wanted[..found].as_chunks::<WIDTH>();
        samples.extend(values.iter().map(|&bytes| decode(bytes)));
        if found < wanted.len() {
            break;
        }
    }
    Ok(samples)
}

/// Fills the buffer as far as there is something to fill it with.
fn read_full(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut found = 0;
    while found < buffer.len() {
        match from.read(&mut buffer[found..]) {
            Ok(0) => break,
            Ok(count) => found += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

fn skip_lines(source: &mut Source, lines: u64) -> Result<(), Error> {
    for _ in 0..lines {
        match source.skip_until(b'\n') {
            Ok(0) => break,
            Ok(_) => {}
            Err(error) => return Err(Problem::Unreadable(error).at_byte(source.at())),
        }
    }
    Ok(())
}

fn skip_bytes(from: &mut dyn Read, bytes: u64) -> io::Result<()> {
    io::copy(&mut from.take(bytes), &mut io::sink()).map(|_| ())
}
