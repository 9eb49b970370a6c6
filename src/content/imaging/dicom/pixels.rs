//! The stored numbers of one slice: plain, run-length coded, or losslessly compressed as JPEG.

use super::super::unread::{Unread, plain as harmless};
use super::elements::{Elements, wrong};
use super::slice::Shape;
use jpeg_decoder::{Decoder, PixelFormat};

/// Transfer syntaxes whose pixels are as they are: little endian with and without kinds, big endian.
const PLAIN: [&str; 3] = ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"];

/// JPEG lossless, any predictor and the first; baseline, in 8 bits; run lengths.
const JPEG: [&str; 3] = ["1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.50"];
const RUNS: &str = "1.2.840.10008.1.2.5";

/// The names of others, for complaints.
const OTHERS: [(&str, &str); 12] = [
    ("1.2.840.10008.1.2.4.51", "JPEG Extended"),
    ("1.2.840.10008.1.2.4.80", "JPEG-LS Lossless"),
    ("1.2.840.10008.1.2.4.81", "JPEG-LS Near-lossless"),
    ("1.2.840.10008.1.2.4.90", "JPEG 2000 Lossless"),
    ("1.2.840.10008.1.2.4.91", "JPEG 2000"),
    ("1.2.840.10008.1.2.4.110", "JPEG XL Lossless"),
    ("1.2.840.10008.1.2.4.111", "JPEG XL Recompression"),
    ("1.2.840.10008.1.2.4.112", "JPEG XL"),
    ("1.2.840.10008.1.2.4.201", "High-Throughput JPEG 2000 Lossless"),
    ("1.2.840.10008.1.2.4.202", "High-Throughput JPEG 2000 RPCL Lossless"),
    ("1.2.840.10008.1.2.4.203", "High-Throughput JPEG 2000"),
    ("1.2.840.10008.1.2.4.100", "MPEG-2 video"),
];

/// Why a slice's pixels are not read, before any of them is.
pub(super) fn check_syntax(syntax: &str) -> Result<(), Unread> {
    if PLAIN.contains(&syntax) || JPEG.contains(&syntax) || syntax == RUNS {
        return Ok(());
    }
    let name = OTHERS.iter().find(|(uid, _)| *uid == syntax).map_or("one that is not known here", |(_, name)| name);
    Err(wrong(
        format!("its transfer syntax is {name} ({}), which is not read", harmless(syntax)),
        "export the series uncompressed (Explicit VR Little Endian) or as JPEG Lossless",
    ))
}

/// The numbers as they were stored, row by row, before any rescaling.
pub(super) fn stored(elements: &Elements, shape: &Shape) -> Result<Vec<i32>, Unread> {
    check_syntax(&elements.syntax)?;
    let wanted = shape.rows as usize * shape.columns as usize;
    let wide: Vec<u16> = match elements.syntax.as_str() {
        RUNS => runs(&elements.fragments, shape, wanted)?,
        syntax if JPEG.contains(&syntax) => jpeg(&elements.fragments, shape, wanted)?,
        _ => plain(elements, shape, wanted)?,
    };
    let (low, high) = (u32::from(shape.high_bit + 1 - shape.bits), u32::from(shape.bits));
    let number = |raw: u16| {
        // Above the number's own bits old files keep overlays.
        let value = (u32::from(raw) >> low) & ((1 << high) - 1);
        match shape.is_signed {
            true => ((value << (32 - high)) as i32) >> (32 - high),
            false => value as i32,
        }
    };
    Ok(wide.into_iter().map(number).collect())
}

/// Whether a slice has the pixels that its head promises, as far as that can be seen without decompressing them.
pub(super) fn check_size(elements: &Elements, shape: &Shape) -> Result<(), Unread> {
    if !PLAIN.contains(&elements.syntax.as_str()) {
        return match elements.fragments.is_empty() {
            true => Err(wrong("there are no compressed pixels in it", "copy or export the file again")),
            false => Ok(()),
        };
    }
    let found = elements.pixels().map_or(0, <[u8]>::len);
    let wanted = shape.rows as usize * shape.columns as usize;
    let width = usize::from(shape.allocated / 8);
    match found < wanted * width {
        true => {
            let what = format!("it has {found} bytes of pixels, and {wanted} pixels need {}", wanted * width);
            Err(wrong(what, "copy or export the file again"))
        }
        false => Ok(()),
    }
}

fn plain(elements: &Elements, shape: &Shape, wanted: usize) -> Result<Vec<u16>, Unread> {
    check_size(elements, shape)?;
    let bytes = elements.pixels().unwrap_or_default();
    let width = usize::from(shape.allocated / 8);
    Ok(match width {
        1 => bytes[..wanted].iter().map(|&b| b.into()).collect(),
        _ => {
            let (pairs, _) = bytes[..2 * wanted].as_chunks::<2>();
            let word = if elements.is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            pairs.iter().map(|&pair| word(pair)).collect()
        }
    })
}

fn jpeg(fragments: &[&[u8]], shape: &Shape, wanted: usize) -> Result<Vec<u16>, Unread> {
    let broken = |e: &dyn std::fmt::Display| {
        wrong(format!("its pixels cannot be decompressed ({e})"), "export the series uncompressed")
    };
    let stream = fragments.concat();
    let mut decoder = Decoder::new(&stream[..]);
    decoder.read_info().map_err(|e| broken(&e))?;
    let info = decoder.info().ok_or_else(|| broken(&"no head"))?;
    // Before the decoder makes room for what the picture's own head says.
    if [u32::from(info.width), u32::from(info.height)] != [shape.columns, shape.rows] {
        let what = format!(
            "its pixels are {}×{}, and the slice says {}×{}",
            info.width, info.height, shape.columns, shape.rows
        );
        return Err(wrong(what, "export the series again"));
    }
    let bytes = decoder.decode().map_err(|e| broken(&e))?;
    let numbers: Vec<u16> = match info.pixel_format {
        PixelFormat::L8 => bytes.into_iter().map(u16::from).collect(),
        PixelFormat::L16 => bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_ne_bytes(pair)).collect(),
        _ => return Err(wrong("its pixels are coloured", "export the grey series")),
    };
    match numbers.len() == wanted {
        true => Ok(numbers),
        false => Err(broken(&"fewer pixels than promised")),
    }
}

/// PackBits by bytes, the high byte of all numbers first (PS3.5, annex G).
fn runs(fragments: &[&[u8]], shape: &Shape, wanted: usize) -> Result<Vec<u16>, Unread> {
    let broken = || wrong("its run-length coded pixels are broken", "copy the file, or export the series, again");
    let stream = fragments.concat();
    let word = |at: usize| {
        let bytes = *stream.get(4 * at..)?.first_chunk()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let planes = usize::from(shape.allocated / 8);
    if word(0) != Some(planes) {
        return Err(broken());
    }
    let mut numbers = vec![0u16; wanted];
    for plane in 0..planes {
        let start = word(plane + 1).ok_or_else(broken)?;
        let end = if plane + 1 < planes { word(plane + 2).ok_or_else(broken)? } else { stream.len() };
        let mut packed = stream.get(start..end).ok_or_else(broken)?.iter();
        let mut filled = 0;
        let mut put = |byte: u8| {
            if let Some(number) = numbers.get_mut(filled) {
                *number = *number << 8 | u16::from(byte);
            }
            filled += 1;
        };
        while let Some(&control) = packed.next() {
            match control {
                0..=127 => {
                    for _ in 0..=control {
                        let Some(&byte) = packed.next() else { break };
                        put(byte);
                    }
                }
                128 => {}
                129.. => {
                    let Some(&byte) = packed.next() else { break };
                    (0..257 - u32::from(control)).for_each(|_| put(byte));
                }
            }
        }
        // A plane is padded to an even length.
        if filled < wanted {
            return Err(broken());
        }
    }
    Ok(numbers)
}
