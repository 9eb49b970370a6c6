//! Values that measures and points can have, for intervals that stay within them.

use super::{Cohort, POINTS};
use typodont_core::statistics::ValueRange;
use typodont_exercise::scenario::Metric;

/// Measures of yes or no.
pub const FLAGS: [&str; 3] = ["detect_tooth", "detect_quadrant", "pulp_exposed"];

/// Shares and coefficients from 0 to 1 that have no unit.
const SHARES: [&str; 6] = ["dice", "jaccard", "precision", "recall", "detect_level", "surface_within_tol"];

/// Whole numbers of events.
const COUNTS: [&str; 3] = ["detect_trials_right", "probing_force_high", "calculus_false_alarms"];

/// Percentages of something else than the whole, which may exceed 100.
const RATIOS: [&str; 1] = ["healthy_per_decay_pct"];

/// Measures that may be negative.
const SIGNED: [&str; 6] = [
    "probing_bias_mm",
    "jerk",
    "detect_corrected_pct",
    "detect_corrected_low_pct",
    "detect_corrected_high_pct",
    "detect_level_corrected",
];

/// Range of a measure's values; unbounded for a measure that is not known.
fn range_of_measure(name: &str) -> ValueRange {
    let Ok(Metric { info, .. }) = Metric::parse(name) else { return ValueRange::Unbounded };
    match (info.name, info.unit) {
        (name, _) if FLAGS.contains(&name) => ValueRange::Binary,
        (name, _) if SIGNED.contains(&name) => ValueRange::Unbounded,
        (name, _) if SHARES.contains(&name) => ValueRange::Within(0.0, 1.0),
        (name, _) if COUNTS.contains(&name) => ValueRange::NonNegative,
        (name, "%") if !RATIOS.contains(&name) => ValueRange::Within(0.0, 100.0),
        (_, "%" | "s" | "mm" | "mm³" | "mm/s" | "N" | "%/s") => ValueRange::NonNegative,
        _ => ValueRange::Unbounded,
    }
}

impl Cohort {
    /// Range of a measure, or of [`POINTS`]: from 0 to the most points that the sessions could have.
    pub(super) fn range_of(&self, measure: &str, sessions: &[usize]) -> ValueRange {
        if measure != POINTS {
            return range_of_measure(measure);
        }
        let most = sessions.iter().filter_map(|&i| Some(self.sessions[i].1.grade.as_ref()?.max_points));
        match most.fold(0.0, f64::max) {
            most if most > 0.0 => ValueRange::Within(0.0, most),
            _ => ValueRange::NonNegative,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_exercise::scenario::metric;

    #[test]
    fn the_ranges_name_measures_that_exist() {
        for name in FLAGS.iter().chain(&SHARES).chain(&COUNTS).chain(&RATIOS).chain(&SIGNED) {
            assert!(metric::all().any(|info| info.name == *name), "{name}");
        }
        assert_eq!(range_of_measure("time_to_clear_s"), ValueRange::NonNegative);
        assert_eq!(range_of_measure("healthy_per_decay_pct"), ValueRange::NonNegative);
        assert_eq!(range_of_measure("decay_cleared_pct"), ValueRange::Within(0.0, 100.0));
        assert_eq!(range_of_measure("pulp_exposed"), ValueRange::Binary);
        assert_eq!(range_of_measure("jerk"), ValueRange::Unbounded);
        assert_eq!(range_of_measure("surface_within_tol(0.3)"), ValueRange::Within(0.0, 1.0));
        assert_eq!(range_of_measure("unheard_of"), ValueRange::Unbounded);
    }

    #[test]
    fn every_measure_without_a_unit_has_a_range() {
        // Aim: a new measure without a unit is not left unbounded by mistake, as `surface_within_tol` was.
        for info in metric::all().filter(|info| info.unit.is_empty()) {
            let listed = FLAGS.iter().chain(&SHARES).chain(&COUNTS).chain(&SIGNED).any(|name| *name == info.name);
            assert!(listed, "{}: in which of the lists of this file?", info.name);
        }
    }
}
