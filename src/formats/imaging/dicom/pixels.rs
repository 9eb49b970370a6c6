//! The stored numbers of one slice: uncompressed, run-length coded, or compressed as JPEG.

use crate::imaging::dicom::elements::{DicomElements, wrong};
use crate::imaging::dicom::slice::PixelLayout;
use crate::imaging::error::{ScanError, sanitized_excerpt};
use jpeg_decoder::{Decoder, PixelFormat};

/// Transfer syntaxes of uncompressed pixels: implicit VR little endian, explicit VR little endian, explicit VR big
/// endian.
const UNCOMPRESSED: [&str; 3] = ["1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"];

/// JPEG Lossless with any predictor, JPEG Lossless with the first predictor, and JPEG Baseline (8 bits); RLE
/// Lossless.
const JPEG: [&str; 3] = ["1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.50"];
const RLE: &str = "1.2.840.10008.1.2.5";

/// Names of unsupported transfer syntaxes, for complaints.
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

/// Returns an error if the pixels of a transfer syntax are not supported, before any of them is read.
pub(super) fn check_syntax(syntax: &str) -> Result<(), ScanError> {
    if UNCOMPRESSED.contains(&syntax) || JPEG.contains(&syntax) || syntax == RLE {
        return Ok(());
    }
    let name = OTHERS.iter().find(|(uid, _)| *uid == syntax).map_or("unknown", |(_, name)| name);
    Err(wrong(
        format!("its transfer syntax is {name} ({}), which is not supported", sanitized_excerpt(syntax)),
        "export the series uncompressed (Explicit VR Little Endian) or as JPEG Lossless",
    ))
}

/// Returns the numbers as stored, row by row, without rescaling.
pub(super) fn stored(elements: &DicomElements, shape: &PixelLayout) -> Result<Vec<i32>, ScanError> {
    check_syntax(&elements.syntax)?;
    let wanted = shape.rows as usize * shape.columns as usize;
    let wide: Vec<u16> = match elements.syntax.as_str() {
        RLE => run_length_decoded(&elements.fragments, shape, wanted)?,
        syntax if JPEG.contains(&syntax) => jpeg(&elements.fragments, shape, wanted)?,
        _ => uncompressed(elements, shape, wanted)?,
    };
    let (low, high) = (u32::from(shape.high_bit + 1 - shape.bits), u32::from(shape.bits));
    let number = |raw: u16| {
        // Old files keep overlays in the bits above the stored ones.
        let value = (u32::from(raw) >> low) & ((1 << high) - 1);
        match shape.is_signed {
            true => ((value << (32 - high)) as i32) >> (32 - high),
            false => value as i32,
        }
    };
    Ok(wide.into_iter().map(number).collect())
}

/// Checks that a slice has the pixels that its header promises, as far as this is possible without decompression.
pub(super) fn check_size(elements: &DicomElements, shape: &PixelLayout) -> Result<(), ScanError> {
    if !UNCOMPRESSED.contains(&elements.syntax.as_str()) {
        return match elements.fragments.is_empty() {
            true => Err(wrong("the file contains no compressed pixel data", "copy or export the file again")),
            false => Ok(()),
        };
    }
    let found = elements.pixels().map_or(0, <[u8]>::len);
    let wanted = shape.rows as usize * shape.columns as usize;
    let width = usize::from(shape.allocated / 8);
    match found < wanted * width {
        true => {
            let what = format!("it has {found} bytes of pixel data, and {wanted} pixels need {}", wanted * width);
            Err(wrong(what, "copy or export the file again"))
        }
        false => Ok(()),
    }
}

fn uncompressed(elements: &DicomElements, shape: &PixelLayout, wanted: usize) -> Result<Vec<u16>, ScanError> {
    check_size(elements, shape)?;
    let bytes = elements.pixels().unwrap_or_default();
    let width = usize::from(shape.allocated / 8);
    Ok(match width {
        1 => bytes[..wanted].iter().map(|&b| u16::from(b)).collect(),
        _ => {
            let (pairs, _) = bytes[..2 * wanted].as_chunks::<2>();
            let word = if elements.is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
            pairs.iter().map(|&pair| word(pair)).collect()
        }
    })
}

fn jpeg(fragments: &[&[u8]], shape: &PixelLayout, wanted: usize) -> Result<Vec<u16>, ScanError> {
    let broken = |e: &dyn std::fmt::Display| {
        wrong(format!("its pixels cannot be decompressed ({e})"), "export the series uncompressed")
    };
    let stream = fragments.concat();
    let mut decoder = Decoder::new(&stream[..]);
    decoder.read_info().map_err(|e| broken(&e))?;
    let info = decoder.info().ok_or_else(|| broken(&"no header"))?;
    // Checked before the decoder allocates memory for the size in the picture's own header.
    if [u32::from(info.width), u32::from(info.height)] != [shape.columns, shape.rows] {
        let what = format!(
            "its compressed image has {}×{} pixels, and the slice declares {}×{}",
            info.width, info.height, shape.columns, shape.rows
        );
        return Err(wrong(what, "export the series again"));
    }
    let bytes = decoder.decode().map_err(|e| broken(&e))?;
    let numbers: Vec<u16> = match info.pixel_format {
        PixelFormat::L8 => bytes.into_iter().map(u16::from).collect(),
        PixelFormat::L16 => bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_ne_bytes(pair)).collect(),
        _ => return Err(wrong("its pixels are in colour", "export the greyscale series")),
    };
    match numbers.len() == wanted {
        true => Ok(numbers),
        false => Err(broken(&"fewer pixels than promised")),
    }
}

/// Decodes PackBits, byte plane by byte plane, the high bytes of all numbers first (PS3.5, annex G).
fn run_length_decoded(fragments: &[&[u8]], shape: &PixelLayout, wanted: usize) -> Result<Vec<u16>, ScanError> {
    let broken = || wrong("its run-length coded pixels are damaged", "copy the file, or export the series, again");
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
        // A plane may be longer: it is padded to an even length.
        if filled < wanted {
            return Err(broken());
        }
    }
    Ok(numbers)
}
