//! Linear regression by least squares.

use super::distribution::t_quantile;
use super::{CONFIDENCE, Interval, mean, sum_of_squares};

/// Regression line y = `intercept` + `slope`·x, with the quantities needed for its confidence intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFit {
    pub n: usize,
    pub slope: f64,
    pub intercept: f64,
    /// R²: fraction of the variance of y explained by the line.
    pub r_squared: f64,
    mean_x: f64,
    sum_of_squares_x: f64,
    /// Standard deviation of the residuals, with denominator n − 2.
    residual_sd: f64,
}

/// Fits a line to points (x, y); `None` with fewer than three points, or if all x or all y are equal.
pub fn linear_fit(points: &[(f64, f64)]) -> Option<LinearFit> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let n = points.len();
    if n < 3 || sum_of_squares(&x) <= 0.0 || sum_of_squares(&y) <= 0.0 {
        return None;
    }
    let (mean_x, mean_y, squares_x) = (mean(&x), mean(&y), sum_of_squares(&x));
    let products: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = products / squares_x;
    let at_zero = mean_y - slope * mean_x;
    let off = |(x, y): &(f64, f64)| (y - at_zero - slope * x) * (y - at_zero - slope * x);
    let residual: f64 = points.iter().map(off).sum();
    let explained = 1.0 - residual / sum_of_squares(&y);
    Some(LinearFit {
        n,
        slope,
        intercept: at_zero,
        r_squared: explained,
        mean_x,
        sum_of_squares_x: squares_x,
        residual_sd: (residual / (n as f64 - 2.0)).sqrt(),
    })
}

impl LinearFit {
    /// Returns y of the line at `x`.
    pub fn predict(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }

    /// Interval of the line at `x` (not of a single y there): ± t·s·√(1/n + (x − x̄)²/Σ(x − x̄)²), n − 2 degrees of
    /// freedom.
    pub fn interval_at(&self, x: f64) -> Interval {
        let leverage = 1.0 / self.n as f64 + (x - self.mean_x) * (x - self.mean_x) / self.sum_of_squares_x;
        let half = self.t() * self.residual_sd * leverage.sqrt();
        [self.predict(x) - half, self.predict(x) + half]
    }

    /// Interval of the slope: ± t·s/√Σ(x − x̄)².
    pub fn slope_interval(&self) -> Interval {
        let half = self.t() * self.residual_sd / self.sum_of_squares_x.sqrt();
        [self.slope - half, self.slope + half]
    }

    fn t(&self) -> f64 {
        t_quantile(0.5 + 0.5 * CONFIDENCE, self.n as f64 - 2.0)
    }
}
