//! Estimation of the grey values of background, dentine and enamel from the values alone.
//!
//! Method: Otsu, *A Threshold Selection Method from Gray-Level Histograms* (1979), applied first to all voxels, then
//! to those so deep inside that none is only partly filled.

use crate::import::ENAMEL_GREY;
use crate::import::segment::SegmentationError;
use typodont_core::volume::{Grid, distance};

/// Number of histogram bins; an 8-bit scan has 256 values.
const BINS: usize = 1024;

/// Fraction of the values at either end that may be scanner artefacts and must not stretch the histogram.
const TAIL: f64 = 1e-4;

/// Depth beyond which blur from outside does not reach, voxels.
const DEEP: f32 = 2.0;

/// Minimum rise from dentine to enamel as a fraction of the rise from background to dentine. In scans of teeth the
/// fraction is 0.4 to 0.9; two halves of the noise around a single level differ by less than 0.1.
const ENAMEL_RISE: f32 = 0.15;

/// Minimum fraction of enamel in the deep hard tissue: a worn molar has five times that.
const ENAMEL_SHARE: f64 = 0.01;

/// Maximum brightness of pulp, as a fraction of the range from background to dentine. In HU, pulp lies at 0.4 to 0.5.
const HOLLOW: f32 = 0.65;

/// Grey values of the pure materials.
#[derive(Clone, Copy, Debug)]
pub(super) struct GreyLevels {
    pub background: f32,
    pub dentine: f32,
    pub enamel: f32,
}

impl GreyLevels {
    pub(super) fn of(
        grid: &Grid,
        values: &[f32],
        background: f32,
        solid_threshold: f32,
    ) -> Result<GreyLevels, SegmentationError> {
        let depth = distance::to_set(grid, |i| values[i] < solid_threshold);
        let deep = DEEP * grid.spacing.max_element();
        let core = || values.iter().zip(&depth).filter(|&(_, &depth)| depth > deep).map(|(&value, _)| value);
        let histogram = ValueHistogram::of(core).ok_or(SegmentationError::OneLevel)?;
        let split = histogram.otsu_threshold_bin();
        let (below, above) = (histogram.median(0..split), histogram.median(split..BINS));
        let share = histogram.count(split..BINS) as f64 / histogram.count(0..BINS) as f64;
        match below > background && above - below >= ENAMEL_RISE * (below - background) && share >= ENAMEL_SHARE {
            true => Ok(GreyLevels { background, dentine: below, enamel: above }),
            false => Err(SegmentationError::OneLevel),
        }
    }

    /// Returns a value of the scan on the scale of [`ENAMEL_GREY`].
    pub(super) fn grey_value(&self, value: f32) -> u8 {
        let share_of_enamel = (value - self.background) / (self.enamel - self.background);
        (share_of_enamel * f32::from(ENAMEL_GREY) + 0.5).clamp(0.0, 255.0) as u8
    }

    /// Value from which on a voxel holds more dentine than background.
    pub(super) fn dentine_threshold(&self) -> f32 {
        0.5 * (self.background + self.dentine)
    }

    /// Value below which voxels deep inside are hollow or soft tissue.
    pub(super) fn hollow_threshold(&self) -> f32 {
        self.background + HOLLOW * (self.dentine - self.background)
    }

    /// Value from which on a full voxel holds more enamel than dentine.
    pub(super) fn enamel_threshold(&self) -> f32 {
        0.5 * (self.dentine + self.enamel)
    }
}

/// Estimates the value from which on a voxel is solid.
pub(super) fn solid_threshold(values: &[f32]) -> Result<f32, SegmentationError> {
    let histogram = ValueHistogram::of(|| values.iter().copied()).ok_or(SegmentationError::Flat)?;
    Ok(histogram.value(histogram.otsu_threshold_bin()))
}

/// Returns the median of the values that are not solid; the lowest of them if no histogram can be made.
pub(super) fn background_level(values: &[f32], solid_threshold: f32) -> f32 {
    let around = || values.iter().copied().filter(|&value| value < solid_threshold);
    let lowest = || around().fold(solid_threshold, f32::min);
    ValueHistogram::of(around).map_or_else(lowest, |histogram| histogram.median(0..BINS))
}

/// Frequencies of values in equal bins from the lowest to the highest value.
struct ValueHistogram {
    low: f32,
    step: f32,
    bins: Vec<u64>,
}

impl ValueHistogram {
    /// Returns `None` unless there are two different finite values.
    fn of<I: Iterator<Item = f32>>(values: impl Fn() -> I) -> Option<ValueHistogram> {
        let finite = || values().filter(|value| value.is_finite());
        let [low, high] = finite().fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let whole = ValueHistogram::between(low, high, finite())?;
        let [low, high] = whole.without_tails();
        ValueHistogram::between(low, high, finite())
    }

    fn between(low: f32, high: f32, values: impl Iterator<Item = f32>) -> Option<ValueHistogram> {
        let step = (high - low) / BINS as f32;
        // Written so that NaN is rejected.
        if !(step > 0.0 && step.is_finite()) {
            return None;
        }
        let mut bins = vec![0; BINS];
        for value in values {
            bins[(((value - low) / step) as usize).min(BINS - 1)] += 1;
        }
        Some(ValueHistogram { low, step, bins })
    }

    /// Returns the lower bound of a bin.
    fn value(&self, bin: usize) -> f32 {
        self.low + bin as f32 * self.step
    }

    fn count(&self, bins: std::ops::Range<usize>) -> u64 {
        self.bins[bins].iter().sum()
    }

    fn without_tails(&self) -> [f32; 2] {
        let allowed = (TAIL * self.count(0..BINS) as f64) as u64;
        let beyond = |mut bins: Box<dyn Iterator<Item = &u64> + '_>| {
            let mut passed = 0;
            bins.position(|count| {
                passed += count;
                passed > allowed
            })
        };
        let low = beyond(Box::new(self.bins.iter())).unwrap_or(0);
        let high = beyond(Box::new(self.bins.iter().rev())).unwrap_or(0);
        [self.value(low), self.value(BINS - high)]
    }

    /// Returns the median of the values in a range of bins.
    fn median(&self, bins: std::ops::Range<usize>) -> f32 {
        let half = self.count(bins.clone()).div_ceil(2);
        let mut passed = 0;
        let middle = bins.clone().find(|&bin| {
            passed += self.bins[bin];
            passed >= half
        });
        self.value(middle.unwrap_or(bins.start)) + 0.5 * self.step
    }

    /// Returns the bin that best separates the values into two classes (Otsu's criterion).
    fn otsu_threshold_bin(&self) -> usize {
        let total = self.count(0..BINS) as f64;
        let sum: f64 = self.bins.iter().enumerate().map(|(bin, &count)| bin as f64 * count as f64).sum();
        let (mut below, mut sum_below) = (0.0, 0.0);
        let (mut most, mut first, mut last) = (-1.0, 0, 0);
        for bin in 1..BINS {
            below += self.bins[bin - 1] as f64;
            sum_below += (bin - 1) as f64 * self.bins[bin - 1] as f64;
            let apart = total * sum_below - below * sum;
            let between = apart * apart / (below * (total - below)).max(1.0);
            if between > most {
                (most, first, last) = (between, bin, bin);
            } else if between == most {
                last = bin;
            }
        }
        // All bins of an empty stretch separate equally well; its middle is farthest from both classes.
        (first + last) / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_lies_between_two_clusters() {
        let values = || (0..1000).map(|i| if i % 10 == 0 { 200.0 } else { 100.0 + (i % 7) as f32 });
        let histogram = ValueHistogram::of(values).unwrap();
        let split = histogram.otsu_threshold_bin();
        assert!((130.0..170.0).contains(&histogram.value(split)), "{}", histogram.value(split));
        assert!((histogram.median(0..split) - 103.0).abs() < 0.2);
        assert!((histogram.median(split..BINS) - 200.0).abs() < 0.2);
    }

    #[test]
    fn one_value_or_none_makes_no_histogram() {
        for values in [vec![], vec![7.0; 5], vec![f32::NAN, f32::INFINITY]] {
            assert_eq!(solid_threshold(&values), Err(SegmentationError::Flat));
        }
    }
}
