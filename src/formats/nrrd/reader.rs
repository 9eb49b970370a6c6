//! Reading of an image: the header first, then exactly the data that it declares.

use crate::nrrd::error::{NrrdError, NrrdErrorKind, excerpt};
use crate::nrrd::header::NrrdHeader;
use crate::nrrd::layout::{ByteSkip, SampleLayout, SampleType};
use crate::nrrd::source::ByteSource;
use crate::nrrd::{Samples, VoxelImage};
use flate2::bufread::{GzDecoder, ZlibDecoder};
use std::io::{self, BufRead, Read};
use std::path::Path;

/// Maximum number of bytes after the data: some writers end the file with a line break or pad it to a word.
const TRAILING_MAX: u64 = 8;

/// Maximum inflation ratio of a deflate stream (258 bytes per two bits; zlib's own figure).
const DEFLATE_RATIO_MAX: u64 = 1032;

/// Maximum number of members of a gzip stream. The largest volume in blocks of 64 KiB, as written by bgzip, has a
/// quarter of that; and starting a member takes time even if it is empty.
const MEMBERS_MAX: u32 = 1 << 16;

/// Memory reserved before any inflated data arrive, bytes; from there the buffer doubles with the data.
const ROOM: u64 = 1 << 20;

/// Reads a volume from a file, and from the data file beside it if the header names one.
///
/// # Errors
/// Fails when a file cannot be read, or when the header or the data are invalid or not supported.
pub fn read(path: &Path) -> Result<VoxelImage, NrrdError> {
    let in_file = |error: NrrdError| error.in_file(path);
    let source = ByteSource::of_file(path).map_err(|problem| in_file(problem.in_whole()))?;
    read_image(source, &mut |name| ByteSource::open_beside(path, name)).map_err(in_file)
}

/// Parses a volume in memory.
///
/// # Errors
/// Fails when the header or the data are invalid or not supported, or when the header names a data file.
pub fn parse(bytes: &[u8]) -> Result<VoxelImage, NrrdError> {
    read_image(ByteSource::of_slice(bytes), &mut |name| {
        Err(NrrdErrorKind::DataFile { name: excerpt(name), why: "cannot be read with a volume in memory" })
    })
}

/// Parses a volume in memory; its data come from `open` if the header names a data file.
///
/// The name passed to `open` is relative and never leads to a parent folder; `open` must handle symbolic links
/// itself.
///
/// # Errors
/// Fails when the header or the data are invalid or not supported, or when `open` fails.
pub fn parse_detached(
    bytes: &[u8],
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<VoxelImage, NrrdError> {
    read_image(ByteSource::of_slice(bytes), &mut |name| match open(name) {
        Ok(bytes) => Ok(ByteSource::of_vec(bytes, name)),
        Err(error) => Err(NrrdErrorKind::DataFileUnreadable { name: excerpt(name), error }),
    })
}

type OpenDataFile<'a, 'b> = &'a mut dyn FnMut(&str) -> Result<ByteSource<'b>, NrrdErrorKind>;

fn read_image<'a>(mut source: ByteSource<'a>, open: OpenDataFile<'_, 'a>) -> Result<VoxelImage, NrrdError> {
    let header = NrrdHeader::read(&mut source)?;
    let layout = SampleLayout::of(&header)?;
    if let Some(file) = &layout.data_file {
        source = open(&file.name).map_err(|problem| problem.on(file.line))?;
    }
    let samples = decode(&layout, &mut source).map_err(|error| match &source.path {
        Some(path) => error.in_file(path),
        None => error,
    })?;
    Ok(VoxelImage { geometry: layout.geometry, samples, keys: header.keys })
}

/// Decodes the samples that a layout declares, from the current position to the end of the source.
pub(crate) fn decode(layout: &SampleLayout, source: &mut ByteSource) -> Result<Samples, NrrdError> {
    skip_lines(source, layout.line_skip)?;
    let samples = match layout.is_gzip {
        false => decode_raw(layout, source)?,
        true => decode_gzip(layout, source)?,
    };
    match source.remaining() {
        0..=TRAILING_MAX => Ok(samples),
        extra => Err(NrrdErrorKind::TooMuch { wanted: layout.bytes(), extra: Some(extra) }.at_byte(source.position())),
    }
}

fn decode_raw(layout: &SampleLayout, source: &mut ByteSource) -> Result<Samples, NrrdError> {
    let wanted = layout.bytes();
    let skip = match layout.byte_skip {
        ByteSkip::Bytes(skip) => skip,
        ByteSkip::ToEnd => source.remaining().saturating_sub(wanted),
    };
    let left = source.remaining();
    let found = left.saturating_sub(skip);
    if found < wanted {
        return Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(source.position() + left));
    }
    if found - wanted > TRAILING_MAX {
        let extra = Some(found - wanted);
        return Err(NrrdErrorKind::TooMuch { wanted, extra }.at_byte(source.position() + skip + wanted));
    }
    skip_bytes(source, skip).map_err(|error| NrrdErrorKind::Unreadable(error).at_byte(source.position()))?;
    match fill(layout, source, wanted) {
        Ok(samples) if samples.len() == layout.geometry.len() => Ok(samples),
        // The file was truncated while it was read.
        Ok(samples) => {
            let found = samples.len() as u64 * layout.sample_type.width();
            Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(source.position()))
        }
        Err(error) => Err(NrrdErrorKind::Unreadable(error).at_byte(source.position())),
    }
}

/// Decodes the samples from one zlib stream, as in MetaImage files.
pub(crate) fn decode_zlib(layout: &SampleLayout, source: &mut ByteSource) -> Result<Samples, NrrdError> {
    let wanted = layout.bytes();
    let compressed = source.remaining();
    if compressed.saturating_mul(DEFLATE_RATIO_MAX) < wanted {
        return Err(NrrdErrorKind::TooSmallForGzip { compressed, wanted }.at_byte(source.position()));
    }
    let mut stream = ZlibDecoder::new(&mut *source);
    let outcome = fill(layout, &mut stream, ROOM).and_then(|samples| Ok((samples, read_full(&mut stream, &mut [0])?)));
    let found = stream.total_out();
    let at = source.position();
    match outcome {
        Ok((_, 1..)) => Err(NrrdErrorKind::TooMuch { wanted, extra: None }.at_byte(at)),
        Ok(_) if found < wanted => Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(at)),
        Ok((samples, _)) => Ok(samples),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof && found < wanted => {
            Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(at))
        }
        Err(error) => Err(NrrdErrorKind::Gzip(error.to_string()).at_byte(at)),
    }
}

fn decode_gzip(layout: &SampleLayout, source: &mut ByteSource) -> Result<Samples, NrrdError> {
    let wanted = layout.bytes();
    let skip = match layout.byte_skip {
        ByteSkip::Bytes(skip) => skip,
        ByteSkip::ToEnd => 0,
    };
    let compressed = source.remaining();
    if compressed.saturating_mul(DEFLATE_RATIO_MAX) < wanted {
        return Err(NrrdErrorKind::TooSmallForGzip { compressed, wanted }.at_byte(source.position()));
    }
    let mut stream = GzipStream { member: Some(GzDecoder::new(&mut *source)), begun: 1, inflated: 0 };
    let outcome = inflate(layout, &mut stream, skip);
    let found = stream.inflated.saturating_sub(skip);
    let at = source.position();
    match outcome {
        Ok(samples) if found == wanted => Ok(samples),
        Ok(_) if found > wanted => Err(NrrdErrorKind::TooMuch { wanted, extra: None }.at_byte(at)),
        Ok(_) => Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(at)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => match found < wanted {
            true => Err(NrrdErrorKind::Truncated { found, wanted }.at_byte(at)),
            false => Err(NrrdErrorKind::Gzip("the checksum is truncated".to_string()).at_byte(at)),
        },
        Err(error) => Err(NrrdErrorKind::Gzip(error.to_string()).at_byte(at)),
    }
}

fn inflate(layout: &SampleLayout, stream: &mut GzipStream, skip: u64) -> io::Result<Samples> {
    skip_bytes(stream, skip)?;
    let samples = fill(layout, stream, ROOM)?;
    // Requesting one byte more than wanted, which should not arrive, makes the decoder verify the checksum.
    read_full(stream, &mut [0])?;
    Ok(samples)
}

/// A gzip stream of one or several members (pigz and bgzip write several), with a count of the inflated bytes.
struct GzipStream<'a, 'b> {
    /// `None` only during the transition from one member to the next.
    member: Option<GzDecoder<&'a mut ByteSource<'b>>>,
    /// Number of members so far.
    begun: u32,
    inflated: u64,
}

impl Read for GzipStream<'_, '_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        /// First byte of every member, and not of trailing line breaks.
        const MAGIC: &[u8] = &[0x1f];
        while let Some(member) = &mut self.member {
            let count = member.read(buffer)?;
            self.inflated += count as u64;
            if count > 0 || buffer.is_empty() || !member.get_mut().fill_buf()?.starts_with(MAGIC) {
                return Ok(count);
            }
            if self.begun == MEMBERS_MAX {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "the stream has too many members"));
            }
            self.begun += 1;
            self.member = self.member.take().map(|ended| GzDecoder::new(ended.into_inner()));
        }
        Ok(0)
    }
}

/// Reads the samples, or as many as there are. Reserves memory for `room` bytes at first and more as data arrive.
fn fill(layout: &SampleLayout, from: &mut dyn Read, room: u64) -> io::Result<Samples> {
    let count = layout.geometry.len();
    let room = count.min((room / layout.sample_type.width()) as usize);
    Ok(match (layout.sample_type, layout.is_big_endian) {
        (SampleType::U8, _) => Samples::U8(collect(from, count, room, |[byte]| byte)?),
        (SampleType::I8, _) => Samples::I16(collect(from, count, room, |bytes| i8::from_le_bytes(bytes).into())?),
        (SampleType::I16, false) => Samples::I16(collect(from, count, room, i16::from_le_bytes)?),
        (SampleType::I16, true) => Samples::I16(collect(from, count, room, i16::from_be_bytes)?),
        (SampleType::U16, false) => Samples::U16(collect(from, count, room, u16::from_le_bytes)?),
        (SampleType::U16, true) => Samples::U16(collect(from, count, room, u16::from_be_bytes)?),
        (SampleType::I32, false) => Samples::F32(collect(from, count, room, |bytes| i32::from_le_bytes(bytes) as f32)?),
        (SampleType::I32, true) => Samples::F32(collect(from, count, room, |bytes| i32::from_be_bytes(bytes) as f32)?),
        (SampleType::U32, false) => Samples::F32(collect(from, count, room, |bytes| u32::from_le_bytes(bytes) as f32)?),
        (SampleType::U32, true) => Samples::F32(collect(from, count, room, |bytes| u32::from_be_bytes(bytes) as f32)?),
        (SampleType::I64, false) => Samples::F32(collect(from, count, room, |bytes| i64::from_le_bytes(bytes) as f32)?),
        (SampleType::I64, true) => Samples::F32(collect(from, count, room, |bytes| i64::from_be_bytes(bytes) as f32)?),
        (SampleType::U64, false) => Samples::F32(collect(from, count, room, |bytes| u64::from_le_bytes(bytes) as f32)?),
        (SampleType::U64, true) => Samples::F32(collect(from, count, room, |bytes| u64::from_be_bytes(bytes) as f32)?),
        (SampleType::F32, false) => Samples::F32(collect(from, count, room, f32::from_le_bytes)?),
        (SampleType::F32, true) => Samples::F32(collect(from, count, room, f32::from_be_bytes)?),
        (SampleType::F64, false) => Samples::F32(collect(from, count, room, |bytes| f64::from_le_bytes(bytes) as f32)?),
        (SampleType::F64, true) => Samples::F32(collect(from, count, room, |bytes| f64::from_be_bytes(bytes) as f32)?),
    })
}

fn collect<const WIDTH: usize, T>(
    from: &mut dyn Read,
    count: usize,
    room: usize,
    decode: impl Fn([u8; WIDTH]) -> T,
) -> io::Result<Vec<T>> {
    /// Bytes decoded at a time: they stay in the first-level cache, so that this copy costs almost nothing.
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

/// Fills the buffer as far as data are available.
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

fn skip_lines(source: &mut ByteSource, lines: u64) -> Result<(), NrrdError> {
    for _ in 0..lines {
        match source.skip_until(b'\n') {
            Ok(0) => break,
            Ok(_) => {}
            Err(error) => return Err(NrrdErrorKind::Unreadable(error).at_byte(source.position())),
        }
    }
    Ok(())
}

fn skip_bytes(from: &mut dyn Read, bytes: u64) -> io::Result<()> {
    io::copy(&mut from.take(bytes), &mut io::sink()).map(|_| ())
}
