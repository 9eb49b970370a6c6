//! NRRD volumes and 3D Slicer's `.seg.nrrd` label maps.
//!
//! Takes a file or its bytes. Gives an [`Image`] or a [`segmentation::Segmentation`], and the bytes of either.
//! Never trusts a header: what it declares is held against what is there before any memory is taken.
//!
//! The format: <https://teem.sourceforge.net/nrrd/format.html>; where it is silent, what ITK's NrrdIO does.

mod error;
mod geometry;
mod header;
mod layout;
mod reader;
pub mod segmentation;
mod source;
mod writer;

pub use error::{Error, Place, Problem};
pub use geometry::{Axis, Geometry, Space};
pub use reader::{parse, parse_detached, read};
pub use writer::{Encoding, bytes, write};

// What readers of other formats share: bytes that know how many they are, and sizes held against them.
pub(super) use geometry::{check_dims, check_origin, check_steps};
pub(super) use layout::{Element, Layout, Skip};
pub(super) use reader::{decode, decode_zlib};
pub(super) use source::Source;

/// Most voxels along one axis: a scan of a whole head at 0.08 mm has 3000; what claims more is broken or not for us.
pub const AXIS_MAX: u32 = 4096;

/// Most voxels in all: three times the largest ordinary scan (512×512×322), and small enough that the indices and byte
/// counts made from it fit everywhere.
pub const VOXELS_MAX: u64 = 1 << 28;

/// A volume as a file holds it: numbers on a regular grid, where they lie, and remarks.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub geometry: Geometry,
    /// One sample per voxel, the first axis fastest.
    pub samples: Samples,
    /// The file's `key:=value` pairs in their order.
    pub keys: Vec<(String, String)>,
}

impl Image {
    /// The value of a key.
    pub fn key(&self, name: &str) -> Option<&str> {
        self.keys.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }
}

/// The numbers of a volume. Of the types a file may have, int8 is widened to `I16` and double rounded to `F32`.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    /// May hold NaN and infinities, if the file does.
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
