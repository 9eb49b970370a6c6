//! Limits of the volumes and meshes that are read from files or made, in one place.

/// Maximum number of voxels along one axis of a volume in a file: a scan of a whole head at 0.08 mm has 3000; a larger claim
/// is damaged or unsuitable.
pub const AXIS_MAX: u32 = 4096;

/// Maximum total number of voxels of a volume in a file, or of a surface that is filled: three times the largest ordinary
/// scan (512×512×322), and small enough that the indices and byte counts derived from it fit everywhere.
pub const VOXELS_MAX: u64 = 1 << 28;

/// Maximum number of voxels of a workpiece: one and a half times 512×512×322, about 1 GiB of memory in use.
pub const WORKPIECE_VOXELS_MAX: u64 = 130_000_000;

/// Maximum number of triangles of a mesh that is drawn or touched: an instrument, gingiva, a neighbouring tooth. More
/// triangles cost memory without a visible or tactile difference.
pub const DISPLAY_TRIANGLES_MAX: usize = 300_000;

/// Maximum number of triangles: a scanned arch has half a million; ten times that is a mistake or needs no more
/// detail.
pub const SCAN_TRIANGLES_MAX: usize = 5_000_000;
