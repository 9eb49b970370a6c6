//! Which grey values are background, dentine and enamel: from the values alone.
//!
//! Method: Otsu, *A Threshold Selection Method from Gray-Level Histograms* (1979), first on everything, then on what is
//! so deep inside that no voxel is only partly filled.

use super::Unclear;
use crate::volume::{Grid, distance};

/// Steps between the lowest and the highest value: an 8-bit scan has 256.
const BINS: usize = 1024;

/// Share of the values at either end that may be dirt of the scanner and stretch no histogram.
const TAIL: f64 = 1e-4;

/// Deeper than this, voxels, blur from outside does not reach.
const DEEP: f32 = 2.0;

/// Least rise from dentine to enamel as a share of the rise from background to dentine. In scans of teeth it is 0.4 to
/// 0.9; the halves of noise around one level differ by less than 0.1.
const ENAMEL_RISE: f32 = 0.15;

/// Least share of enamel in the deep hard matter: a worn molar has five times that.
const ENAMEL_SHARE: f64 = 0.01;

/// How bright pulp can be, as a share of the way from background to dentine: in HU it is at 0.4 to 0.5 of it.
const HOLLOW: f32 = 0.65;

/// The values of pure matter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    pub background: f32,
    pub dentine: f32,
    pub enamel: f32,
}

impl Levels {
    pub(super) fn of(grid: &Grid, values: &[f32], background: f32, solid_from: f32) -> Result<Levels, Unclear> {
        let depth = distance::to_set(grid, |i| values[i] < solid_from);
        let deep = DEEP * grid.spacing.max_element();
        let core = || values.iter().zip(&depth).filter(|&(_, &depth)| depth > deep).map(|(&value, _)| value);
        let histogram = Histogram::of(core).ok_or(Unclear::OneLevel)?;
        let split = histogram.split();
        let (below, above) = (histogram.middle(0..split), histogram.middle(split..BINS));
        let share = histogram.count(split..BINS) as f64 / histogram.count(0..BINS) as f64;
        match below > background && above - below >= ENAMEL_RISE * (below - background) && share >= ENAMEL_SHARE {
            true => Ok(Levels { background, dentine: below, enamel: above }),
            false => Err(Unclear::OneLevel),
        }
    }

    /// From here on a voxel holds more dentine than background.
    pub(super) fn dentine_from(&self) -> f32 {
        0.5 * (self.background + self.dentine)
    }

    /// Deep inside, what is darker than this is hollow or soft.
    pub(super) fn hollow_below(&self) -> f32 {
        self.background + HOLLOW * (self.dentine - self.background)
    }

    /// From here on a full voxel holds more enamel than dentine.
    pub(super) fn enamel_from(&self) -> f32 {
        0.5 * (self.dentine + self.enamel)
    }
}

/// Roughly the value from which on something is solid.
pub(super) fn solid_from(values: &[f32]) -> Result<f32, Unclear> {
    let histogram = Histogram::of(|| values.iter().copied()).ok_or(Unclear::Flat)?;
    Ok(histogram.value(histogram.split()))
}

/// The value of most of what is not solid; the lowest if nothing is.
pub(super) fn background(values: &[f32], solid_from: f32) -> f32 {
    let around = || values.iter().copied().filter(|&value| value < solid_from);
    let lowest = || around().fold(solid_from, f32::min);
    Histogram::of(around).map_or_else(lowest, |histogram| histogram.middle(0..BINS))
}

/// How often values occur, in equal steps from the lowest to the highest.
struct Histogram {
    low: f32,
    step: f32,
    bins: Vec<u64>,
}

impl Histogram {
    /// `None` where there are no two different values.
    fn of<I: Iterator<Item = f32>>(values: impl Fn() -> I) -> Option<Histogram> {
        let finite = || values().filter(|value| value.is_finite());
        let [low, high] = finite().fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let whole = Histogram::between(low, high, finite())?;
        let [low, high] = whole.without_tails();
        Histogram::between(low, high, finite())
    }

    fn between(low: f32, high: f32, values: impl Iterator<Item = f32>) -> Option<Histogram> {
        let step = (high - low) / BINS as f32;
        // Written so that a NaN does not pass.
        if !(step > 0.0 && step.is_finite()) {
            return None;
        }
        let mut bins = vec![0; BINS];
        for value in values {
            bins[(((value - low) / step) as usize).min(BINS - 1)] += 1;
        }
        Some(Histogram { low, step, bins })
    }

    /// Where a bin begins.
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

    /// The median of some bins' values.
    fn middle(&self, bins: std::ops::Range<usize>) -> f32 {
        let half = self.count(bins.clone()).div_ceil(2);
        let mut passed = 0;
        let middle = bins.clone().find(|&bin| {
            passed += self.bins[bin];
            passed >= half
        });
        self.value(middle.unwrap_or(bins.start)) + 0.5 * self.step
    }

    /// The bin at which two classes begin to differ most from each other.
    fn split(&self) -> usize {
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
        // All bins of an empty stretch divide equally well: its middle is farthest from both classes.
        (first + last) / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_heaps_are_parted_between_them() {
        let values = || (0..1000).map(|i| if i % 10 == 0 { 200.0 } else { 100.0 + (i % 7) as f32 });
        let histogram = Histogram::of(values).unwrap();
        let split = histogram.split();
        assert!((130.0..170.0).contains(&histogram.value(split)), "{}", histogram.value(split));
        assert!((histogram.middle(0..split) - 103.0).abs() < 0.2);
        assert!((histogram.middle(split..BINS) - 200.0).abs() < 0.2);
    }

    #[test]
    fn one_value_or_none_makes_no_histogram() {
        for values in [vec![], vec![7.0; 5], vec![f32::NAN, f32::INFINITY]] {
            assert_eq!(solid_from(&values), Err(Unclear::Flat));
        }
    }
}
