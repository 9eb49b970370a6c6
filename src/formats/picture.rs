//! Photographs and radiographs of a case: PNG, JPEG and TIFF.
//!
//! Takes the bytes of a file. Gives its pixels, upright. Never reads more than [`BYTES_MAX`] or [`SIDE_MAX`] allow.

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::fmt;
use std::io::Cursor;
use typodont_core::image::RgbaImage;

/// Greatest size of a file, bytes: a photograph of a camera, as it is.
pub const BYTES_MAX: usize = 12 << 20;

/// Greatest width and height, pixels.
pub const SIDE_MAX: u32 = 8192;

/// Reason why a file is not used as a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PictureError {
    TooManyBytes(usize),
    UnknownFormat,
    Damaged(String),
}

impl PictureError {
    /// Stable code for a complaint.
    pub fn code(&self) -> &'static str {
        match self {
            PictureError::TooManyBytes(_) => "too-large",
            PictureError::UnknownFormat => "unknown-format",
            PictureError::Damaged(_) => "damaged-picture",
        }
    }

    /// Remedy, for a complaint.
    pub fn help(&self) -> &'static str {
        match self {
            PictureError::TooManyBytes(_) => "save it with fewer pixels or as JPEG",
            PictureError::UnknownFormat => "save it as PNG, JPEG or TIFF",
            PictureError::Damaged(_) => {
                "open it in another program and save it again, at most 8192 pixels wide and high"
            }
        }
    }
}

impl fmt::Display for PictureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PictureError::TooManyBytes(count) => {
                write!(f, "the picture has {} MB; at most {} MB are read", count.div_ceil(1 << 20), BYTES_MAX >> 20)
            }
            PictureError::UnknownFormat => write!(f, "the file is not a picture in PNG, JPEG or TIFF"),
            PictureError::Damaged(why) => write!(f, "the picture cannot be read: {why}"),
        }
    }
}

impl std::error::Error for PictureError {}

/// Checks that a file has the size and the first bytes of a picture, and nothing more of it: a list of exercises is read at once.
///
/// # Errors
/// If the file is too large or of another format.
pub fn recognise(bytes: &[u8]) -> Result<(), PictureError> {
    format(bytes).map(|_| ())
}

/// Checks that a file is a picture, by reading all of it. A build without the feature `pictures` takes JPEG and TIFF by their first bytes.
///
/// # Errors
/// If the file is too large, of another format, or damaged.
pub fn check(bytes: &[u8]) -> Result<(), PictureError> {
    match format(bytes)? {
        ImageFormat::Png => decode(bytes).map(|_| ()),
        _ if cfg!(feature = "pictures") => decode(bytes).map(|_| ()),
        _ => Ok(()),
    }
}

/// Returns the pixels of a picture, turned upright as its camera has noted.
///
/// # Errors
/// As for [`check`]; also for JPEG and TIFF in a build without the feature `pictures`.
pub fn decode(bytes: &[u8]) -> Result<RgbaImage, PictureError> {
    let damaged = |error: image::ImageError| PictureError::Damaged(error.to_string());
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format(bytes)?);
    let mut limits = Limits::default();
    limits.max_image_width = Some(SIDE_MAX);
    limits.max_image_height = Some(SIDE_MAX);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(damaged)?;
    let orientation = decoder.orientation().map_err(damaged)?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    picture.apply_orientation(orientation);
    let rgba = picture.into_rgba8();
    Ok(RgbaImage { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
}

fn format(bytes: &[u8]) -> Result<ImageFormat, PictureError> {
    if bytes.len() > BYTES_MAX {
        return Err(PictureError::TooManyBytes(bytes.len()));
    }
    match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Tiff)) => Ok(format),
        _ => Err(PictureError::UnknownFormat),
    }
}

#[cfg(all(test, feature = "pictures"))]
mod tests {
    use super::*;
    use image::{GrayImage, ImageBuffer, Luma, RgbImage};

    fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    /// A ramp from black at the left to white at the right.
    fn ramp() -> DynamicImage {
        RgbImage::from_fn(64, 16, |x, _| image::Rgb([(x * 4) as u8; 3])).into()
    }

    #[test]
    fn png_jpeg_and_tiff_give_their_pixels() {
        for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff] {
            let bytes = encoded(&ramp(), format);
            assert_eq!(check(&bytes), Ok(()), "{format:?}");
            let read = decode(&bytes).unwrap();
            assert_eq!([read.width, read.height], [64, 16], "{format:?}");
            for x in [0, 20, 63] {
                let [red, _, _, alpha] = read.pixel(x, 8);
                assert!(red.abs_diff((x * 4) as u8) < 6 && alpha == 255, "{format:?} at {x}: {red}");
            }
        }
    }

    #[test]
    fn a_radiograph_of_16_bits_is_read() {
        let grey: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_fn(8, 8, |x, _| Luma([x as u16 * 8192]));
        let read = decode(&encoded(&grey.into(), ImageFormat::Tiff)).unwrap();
        assert_eq!(read.pixel(4, 0), [128, 128, 128, 255]);
    }

    #[test]
    fn other_files_large_ones_and_damaged_ones_are_told_apart() {
        assert_eq!(check(b"BM not a picture that is read"), Err(PictureError::UnknownFormat));
        assert_eq!(check(&vec![0; BYTES_MAX + 1]), Err(PictureError::TooManyBytes(BYTES_MAX + 1)));
        for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff] {
            let mut bytes = encoded(&ramp(), format);
            bytes.truncate(bytes.len() / 3);
            assert!(matches!(check(&bytes), Err(PictureError::Damaged(_))), "{format:?}");
        }
        let wide = encoded(&GrayImage::new(SIDE_MAX + 1, 1).into(), ImageFormat::Png);
        assert!(matches!(check(&wide), Err(PictureError::Damaged(_))));
    }
}
