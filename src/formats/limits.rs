//! Limits of the meshes that are read from files (OBJ, STL, PLY, glTF).

/// Maximum number of triangles of a mesh that is drawn or touched: an instrument, gingiva, a neighbouring tooth. More
/// triangles cost memory without a visible or tactile difference.
pub const DISPLAY_TRIANGLES_MAX: usize = 300_000;

/// Maximum number of triangles: a scanned arch has half a million; ten times that is a mistake or needs no more
/// detail.
pub const SCAN_TRIANGLES_MAX: usize = 5_000_000;
