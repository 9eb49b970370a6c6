//! Grey values of a CT scan beside the tissues that were segmented from it.

use typodont_core::volume::{Density, Label, Volume, Voxel};

/// Grey value of a scan's enamel. Lower and higher values are in proportion to the scan's own above its background, which
/// is 0; the highest is 255, 1.6 times enamel.
pub const ENAMEL_GREY: u8 = 160;

/// Grey value of the matter in each voxel of a volume, as a CT scan measured it.
///
/// In a voxel that is only partly filled, the scan measured matter and background together; the value here is that of the
/// matter alone, at least 1. What is left after carving is thus measured by value times density ([`GreyValues::of_voxel`]). 0
/// stands for what the scanner has not measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyValues(Vec<u8>);

impl GreyValues {
    /// `measured`: the values of the scan on the scale of [`ENAMEL_GREY`]; `density`: the volume that was made of it. Both in
    /// the same order.
    pub fn of_matter(measured: &[u8], density: &[Density]) -> GreyValues {
        let of_matter = |(&value, &density): (&u8, &Density)| match density {
            Density::EMPTY => 0,
            _ => (f32::from(value) / density.unit() + 0.5).clamp(1.0, 255.0) as u8,
        };
        GreyValues(measured.iter().zip(density).map(of_matter).collect())
    }

    /// `scanned`: the values of a scan on which the tissues of a volume were drawn, in any scale; NaN where it has none.
    /// Enamel is the median of its full voxels. The background is darker than most empty voxels: in a mouth, soft tissue and bone
    /// surround a tooth as well as air. Returns `None` unless enamel is brighter.
    ///
    /// # Panics
    /// If there is not one value per voxel.
    pub fn of_labelled(scanned: &[f32], volume: &Volume, enamel: Label) -> Option<GreyValues> {
        assert_eq!(scanned.len(), volume.grid().len(), "one value per voxel");
        /// Share of the empty voxels that are darker than what counts as background.
        const DARKEST: f32 = 0.05;
        let level_of = |density: Density, label: Label, share: f32| {
            let is_meant =
                |index: &usize| volume.voxel(*index) == Voxel { density, label } && !scanned[*index].is_nan();
            let mut values: Vec<f32> = (0..scanned.len()).filter(is_meant).map(|index| scanned[index]).collect();
            let place = (values.len() as f32 * share) as usize;
            (!values.is_empty()).then(|| *values.select_nth_unstable_by(place, f32::total_cmp).1)
        };
        let background = level_of(Density::EMPTY, Label::AIR, DARKEST)?;
        let scale = f32::from(ENAMEL_GREY) / (level_of(Density::FULL, enamel, 0.5)? - background);
        // Written so that infinity is rejected.
        if !(scale > 0.0 && scale < f32::INFINITY) {
            return None;
        }
        // The conversion makes 0 of NaN.
        let measured: Vec<u8> = scanned.iter().map(|value| ((value - background) * scale + 0.5) as u8).collect();
        Some(GreyValues::of_matter(&measured, volume.densities()))
    }

    /// Keeps values of full voxels, 0 to 255, in the order of a volume's voxels.
    pub fn from_values(values: Vec<u8>) -> GreyValues {
        GreyValues(values)
    }

    /// The same without the voxels whose tissue has been changed since the import, as where decay was placed.
    ///
    /// # Panics
    /// If one of the volumes has fewer voxels.
    pub fn only_where(&self, imported: &Volume, now: &Volume) -> GreyValues {
        let (imported, now) = (imported.labels(), now.labels());
        let kept = |(index, &value): (usize, &u8)| if imported[index] == now[index] { value } else { 0 };
        GreyValues(self.0.iter().enumerate().map(kept).collect())
    }

    /// Values of full voxels, 0 to 255, in the order of the volume's voxels.
    pub fn values(&self) -> &[u8] {
        &self.0
    }

    /// The same as [`values`](GreyValues::values), without a copy.
    pub fn into_values(self) -> Vec<u8> {
        self.0
    }

    /// Grey value of a voxel with the matter that it holds now: of its own value the share that it is filled.
    ///
    /// # Panics
    /// If there is no voxel with this array index.
    pub fn of_voxel(&self, index: usize, voxel: Voxel) -> u8 {
        (f32::from(self.0[index]) * voxel.density.unit() + 0.5) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partly_filled_voxel_has_the_value_of_its_matter_and_shows_its_share() {
        // Aim: untouched voxels show what was measured, also at the surface; half of what is left shows half. Method: a full
        // voxel, one filled by a third, an empty one, and one that is too bright for its density.
        let density = [1.0, 0.333, 0.0, 0.05].map(Density::from_unit);
        let measured = [120, 40, 9, 200];
        let grey = GreyValues::of_matter(&measured, &density);
        assert_eq!(grey.values()[..3], [120, 120, 0]);
        let shown = |index: usize, density| grey.of_voxel(index, Voxel { density, label: Label(1) });
        assert_eq!([0, 1, 2].map(|i| shown(i, density[i])), [120, 40, 0]);
        assert_eq!(shown(0, Density::from_unit(0.5)), 60);
        assert_eq!(grey.values()[3], 255);
    }
}
