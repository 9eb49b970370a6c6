//! A straight line through points, by least squares.

use super::distribution::t_quantile;
use super::{CONFIDENCE, Interval, mean, squares};

/// y = `at_zero` + `slope`·x, with what is needed to say how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub n: usize,
    pub slope: f64,
    pub at_zero: f64,
    /// Share of the variance of y that the line explains: R².
    pub explained: f64,
    mean_x: f64,
    squares_x: f64,
    /// Standard deviation of the points about the line, by n − 2.
    residual_sd: f64,
}

/// The line through points (x, y): three at least, not all at one x, not all at one y.
pub fn line(points: &[(f64, f64)]) -> Option<Line> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let n = points.len();
    if n < 3 || squares(&x) <= 0.0 || squares(&y) <= 0.0 {
        return None;
    }
    let (mean_x, mean_y, squares_x) = (mean(&x), mean(&y), squares(&x));
    let products: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = products / squares_x;
    let at_zero = mean_y - slope * mean_x;
    let off = |(x, y): &(f64, f64)| (y - at_zero - slope * x) * (y - at_zero - slope * x);
    let residual: f64 = points.iter().map(off).sum();
    let explained = 1.0 - residual / squares(&y);
    Some(Line { n, slope, at_zero, explained, mean_x, squares_x, residual_sd: (residual / (n as f64 - 2.0)).sqrt() })
}

impl Line {
    /// The line's height at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.at_zero + self.slope * x
    }

    /// Of the line's height at `x` (not of a single y there): ± t·s·√(1/n + (x − x̄)²/Σ(x − x̄)²), n − 2 degrees of freedom.
    pub fn interval_at(&self, x: f64) -> Interval {
        let leverage = 1.0 / self.n as f64 + (x - self.mean_x) * (x - self.mean_x) / self.squares_x;
        let half = self.t() * self.residual_sd * leverage.sqrt();
        [self.at(x) - half, self.at(x) + half]
    }

    /// Of the slope: ± t·s/√Σ(x − x̄)².
    pub fn slope_interval(&self) -> Interval {
        let half = self.t() * self.residual_sd / self.squares_x.sqrt();
        [self.slope - half, self.slope + half]
    }

    fn t(&self) -> f64 {
        t_quantile(0.5 + 0.5 * CONFIDENCE, self.n as f64 - 2.0)
    }
}
