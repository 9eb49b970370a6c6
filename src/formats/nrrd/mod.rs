//! NRRD volumes and 3D Slicer's `.seg.nrrd` label maps.
//!
//! Takes a file or its bytes. Gives a [`VoxelImage`] or a [`segmentation::Segmentation`], and the bytes of either.
//! Never trusts a header: every declared size is checked against the available data before memory is allocated.
//!
//! The format: <https://teem.sourceforge.net/nrrd/format.html>; where it is silent, the behaviour of ITK's NrrdIO.

mod error;
mod geometry;
mod header;
mod layout;
mod reader;
pub mod segmentation;
mod source;
mod writer;

pub use error::{ErrorLocation, NrrdError, NrrdErrorKind};
pub use geometry::{Axis, CoordinateSystem, Geometry};
pub use reader::{parse, parse_detached, read};
pub use writer::{Encoding, bytes, write};

// Shared by the readers of other formats: byte sources of known length, and the checks of declared sizes.
pub(super) use geometry::{check_dims, check_origin, check_steps};
pub(super) use layout::{ByteSkip, SampleLayout, SampleType};
pub(super) use reader::{decode, decode_zlib};
pub(super) use source::ByteSource;

/// A volume as stored in a file: samples on a regular grid, their geometry, and custom entries.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelImage {
    pub geometry: Geometry,
    /// One sample per voxel; the first axis varies fastest.
    pub samples: Samples,
    /// The file's `key:=value` pairs, in their order.
    pub keys: Vec<(String, String)>,
}

impl VoxelImage {
    /// Returns the value of a key.
    pub fn key(&self, name: &str) -> Option<&str> {
        self.keys.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }
}

/// Samples of a volume. Of the types in a file, int8 is widened to `I16`, and double and the integers of 32 and 64
/// bits are converted to `F32`.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    /// May contain NaN and infinities, if the file does.
    F32(Vec<f32>),
}

impl Samples {
    pub fn len(&self) -> usize {
        match self {
            Samples::U8(samples) => samples.len(),
            Samples::I16(samples) => samples.len(),
            Samples::U16(samples) => samples.len(),
            Samples::F32(samples) => samples.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
