//! Tail probabilities and quantiles of Student's t, of F and of the normal distribution.
//!
//! Computed from the regularised incomplete beta function I_x(a, b): its continued fraction, NIST DLMF 8.17.22,
//! evaluated by Lentz's method. Degrees of freedom need not be integers. Quantiles are found by bisection down to
//! neighbouring floats.

/// Maximum number of terms of the continued fraction. About √max(a, b) terms are needed, so this serves up to 10⁸
/// degrees of freedom.
const TERMS_MAX: u32 = 20_000;

/// Probability of a value above `t` ≥ 0 under Student's t.
pub fn t_upper_tail(t: f64, freedom: f64) -> f64 {
    0.5 * incomplete_beta(freedom / (freedom + t * t), 0.5 * freedom, 0.5)
}

/// Quantile of Student's t; `share` is the probability of a smaller value, from 0.5 to below 1.
pub fn t_quantile(share: f64, freedom: f64) -> f64 {
    smallest_where(|t| t_upper_tail(t, freedom) <= 1.0 - share)
}

/// Probability of a value below `f` ≥ 0 under F; degrees of freedom of the numerator, then of the denominator.
pub fn f_cdf(f: f64, [over, under]: [f64; 2]) -> f64 {
    incomplete_beta(over * f / (over * f + under), 0.5 * over, 0.5 * under)
}

/// Quantile of F; `share` is the probability of a smaller value, between 0 and 1.
pub fn f_quantile(share: f64, freedom: [f64; 2]) -> f64 {
    smallest_where(|f| f_cdf(f, freedom) >= share)
}

/// Quantile of the normal distribution; `share` is the probability of a smaller value, from 0.5 to below 1.
pub fn normal_quantile(share: f64) -> f64 {
    smallest_where(|z| 0.5 * libm::erfc(z / std::f64::consts::SQRT_2) <= 1.0 - share)
}

/// Smallest positive number from which on a monotonic condition holds.
fn smallest_where(holds: impl Fn(f64) -> bool) -> f64 {
    // Positive floats have the order of their bits.
    let (mut low, mut high) = (0, f64::MAX.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(f64::from_bits(middle)) { high = middle } else { low = middle }
    }
    f64::from_bits(high)
}

/// I_x(a, b), for x from 0 to 1.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    // The fraction converges quickly on this side of its middle; on the other side that of the complement does.
    match x < (a + 1.0) / (a + b + 2.0) {
        true => prefactor(x, a, b) * continued_fraction(x, a, b) / a,
        false => 1.0 - prefactor(x, a, b) * continued_fraction(1.0 - x, b, a) / b,
    }
}

/// xᵃ (1 − x)ᵇ / B(a, b).
fn prefactor(x: f64, a: f64, b: f64) -> f64 {
    libm::exp(libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * libm::log(x) + b * libm::log1p(-x))
}

fn continued_fraction(x: f64, a: f64, b: f64) -> f64 {
    /// Replaces a denominator of zero.
    const TINY: f64 = 1e-300;
    let safe = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / safe(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    for term in 1..TERMS_MAX {
        let m = f64::from(term);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = value;
        for step in [even, odd] {
            d = 1.0 / safe(1.0 + step * d);
            c = safe(1.0 + step / c);
            value *= c * d;
        }
        if (value - before).abs() <= f64::EPSILON * value.abs() {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_printed_tables() {
        // Aim: no error in a formula. Method: values of printed statistical tables, to their last digit; t with one
        // degree of freedom is the Cauchy distribution, whose quantile is tan(π(p − ½)).
        for (freedom, expected) in [(2.0, 4.303), (9.0, 2.262), (30.0, 2.042), (120.0, 1.980), (1e7, 1.960)] {
            assert!((t_quantile(0.975, freedom) - expected).abs() < 5e-4, "{freedom}");
        }
        assert!((t_quantile(0.975, 1.0) - libm::tan(0.475 * std::f64::consts::PI)).abs() < 1e-12);
        for (freedom, expected) in [([4.0, 10.0], 3.478), ([9.0, 36.0], 2.153), ([1.0, 1.0], 161.448)] {
            assert!((f_quantile(0.95, freedom) / expected - 1.0).abs() < 3e-4, "{freedom:?}");
        }
        assert!((normal_quantile(0.975) - 1.959_963_984_540_054).abs() < 1e-14);
    }

    #[test]
    fn a_lower_tail_of_f_is_an_upper_tail_turned_over() {
        for freedom in [[3.0, 7.5], [40.0, 2.0], [9.0, 400.0]] {
            let [over, under] = freedom;
            let (low, high) = (f_quantile(0.025, freedom), f_quantile(0.975, [under, over]));
            assert!((low * high - 1.0).abs() < 1e-12, "{low} {high}");
        }
    }
}
