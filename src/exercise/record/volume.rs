//! The initial volume of a session, stored as two NRRD attachments of the recording.

use crate::scenario::{INITIAL_DENSITY_PART, INITIAL_LABEL_PART};
use typodont_core::volume::{Density, Label, Volume};
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};

/// NRRD key of the half-width of the density ramp, mm, stored as the bits of an `f32`.
const BAND_KEY: &str = "typodont_band_mm";

/// Returns a volume as the bytes of two files: densities and labels.
///
/// # Errors
/// Returns an error if the volume cannot be encoded as NRRD.
pub fn bytes(volume: &Volume) -> Result<(Vec<u8>, Vec<u8>), nrrd::NrrdError> {
    let geometry = Geometry::of(volume.grid(), CoordinateSystem::LeftPosteriorSuperior);
    let image = |samples: Vec<u8>, keys| VoxelImage { geometry: geometry.clone(), samples: Samples::U8(samples), keys };
    // The bits of the number are stored, since the ramp must be restored exactly.
    let band = vec![(BAND_KEY.to_string(), volume.half_band().to_bits().to_string())];
    let density = image(volume.densities().iter().map(|d| d.bits()).collect(), band);
    let label = image(volume.labels().iter().map(|l| l.0).collect(), Vec::new());
    Ok((nrrd::bytes(&density, Encoding::Gzip)?, nrrd::bytes(&label, Encoding::Gzip)?))
}

/// Parses a volume from the bytes of its two files; identical to the original to the last bit.
///
/// # Errors
/// Returns a description of the first part that is missing, damaged or inconsistent.
pub fn parse(density: &[u8], label: &[u8]) -> Result<Volume, String> {
    let density = nrrd::parse(density).map_err(|e| format!("{INITIAL_DENSITY_PART}: {e}"))?;
    let label = nrrd::parse(label).map_err(|e| format!("{INITIAL_LABEL_PART}: {e}"))?;
    let band = density.key(BAND_KEY).and_then(|bits| bits.parse().ok()).map(f32::from_bits);
    let band = band
        .filter(|b| b.is_finite() && *b > 0.0)
        .ok_or(format!("{INITIAL_DENSITY_PART}: {BAND_KEY} is missing or invalid"))?;
    let grid = density.geometry.grid().ok_or(format!("{INITIAL_DENSITY_PART}: the grid is not axis-aligned"))?;
    if label.geometry != density.geometry {
        return Err(format!("{INITIAL_LABEL_PART}: the grid differs from that of {INITIAL_DENSITY_PART}"));
    }
    let (Samples::U8(density), Samples::U8(label)) = (density.samples, label.samples) else {
        return Err(format!("{INITIAL_DENSITY_PART}, {INITIAL_LABEL_PART}: not 8 bits per voxel"));
    };
    let density = density.into_iter().map(Density::from_bits).collect();
    Volume::from_parts(grid, band, density, label.into_iter().map(Label).collect())
        .ok_or(format!("{INITIAL_LABEL_PART}: some voxels with density have no label"))
}
