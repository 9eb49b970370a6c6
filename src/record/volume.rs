//! The volume at the start of a session, as two NRRDs within the recording.

use crate::content::nrrd::{self, Encoding, Geometry, Image, Samples, Space};
use crate::volume::{Density, Label, Volume};

/// Names of the attachments.
pub const DENSITY: &str = "initial.density.nrrd";
pub const LABEL: &str = "initial.label.nrrd";

/// The same of the tooth before its cavity was cut, where there is one.
pub const ORIGINAL_DENSITY: &str = "original.density.nrrd";
pub const ORIGINAL_LABEL: &str = "original.label.nrrd";

/// Key under which the width of the density ramp is kept, mm.
const BAND_KEY: &str = "typodont_band_mm";

/// A volume as the bytes of two files: density and label.
pub fn bytes(volume: &Volume) -> Result<(Vec<u8>, Vec<u8>), nrrd::Error> {
    let geometry = Geometry::of(volume.grid(), Space::LeftPosteriorSuperior);
    let image = |samples: Vec<u8>, keys| Image { geometry: geometry.clone(), samples: Samples::U8(samples), keys };
    // Bits as a whole number: the ramp must come back exactly.
    let band = vec![(BAND_KEY.to_string(), volume.band().to_bits().to_string())];
    let density = image(volume.densities().iter().map(|d| d.bits()).collect(), band);
    let label = image(volume.labels().iter().map(|l| l.0).collect(), Vec::new());
    Ok((nrrd::bytes(&density, Encoding::Gzip)?, nrrd::bytes(&label, Encoding::Gzip)?))
}

/// A volume from those bytes, to the last bit.
pub fn parse(density: &[u8], label: &[u8]) -> Result<Volume, String> {
    let density = nrrd::parse(density).map_err(|e| format!("{DENSITY}: {e}"))?;
    let label = nrrd::parse(label).map_err(|e| format!("{LABEL}: {e}"))?;
    let band = density.key(BAND_KEY).and_then(|bits| bits.parse().ok()).map(f32::from_bits);
    let band = band.filter(|b| b.is_finite() && *b > 0.0).ok_or(format!("{DENSITY}: no usable {BAND_KEY}"))?;
    let grid = density.geometry.grid().ok_or(format!("{DENSITY}: its axes are not upright"))?;
    if label.geometry != density.geometry {
        return Err(format!("{LABEL}: its grid differs from that of {DENSITY}"));
    }
    let (Samples::U8(density), Samples::U8(label)) = (density.samples, label.samples) else {
        return Err(format!("{DENSITY}, {LABEL}: not 8 bits per voxel"));
    };
    let density = density.into_iter().map(Density::from_bits).collect();
    Volume::restored(grid, band, density, label.into_iter().map(Label).collect())
        .ok_or(format!("{LABEL}: voxels with density lack a label"))
}
