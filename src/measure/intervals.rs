//! Confidence at 95 %: shares of a whole from a random sample, and means from few values.

use serde::Serialize;

/// The confidence of every interval here.
const CONFIDENCE: f64 = 0.95;

/// A figure with the interval that holds the truth in 95 of 100 repetitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The best estimate.
    pub estimate: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// The share `found / n` with its exact two-sided 95 % interval (Clopper and Pearson, 1934).
///
/// Nothing sampled says nothing: the interval is then [0, 1] around an estimate of NaN.
///
/// # Panics
/// When more were found than sampled.
pub fn proportion_interval(found: u64, n: u64) -> Interval {
    assert!(found <= n, "{found} of {n}");
    let (k, m) = (found as f64, n as f64);
    let tail = (1.0 - CONFIDENCE) / 2.0;
    Interval {
        estimate: k / m,
        low: if found == 0 { 0.0 } else { inverse_beta(tail, k, m - k + 1.0) },
        high: if found == n { 1.0 } else { inverse_beta(1.0 - tail, k + 1.0, m - k) },
    }
}

/// The share that the truth does not exceed, at 95 %, after `found` of `n` were found bad
/// (Clopper and Pearson, 1934, one-sided). With none found it is `1 - 0.05^(1/n)`, nearly the
/// rule of three, `3 / n`. 1 when nothing was sampled.
///
/// # Panics
/// When more were found than sampled.
pub fn proportion_upper_bound(found: u64, n: u64) -> f64 {
    assert!(found <= n, "{found} of {n}");
    if found == n {
        return 1.0;
    }
    inverse_beta(CONFIDENCE, found as f64 + 1.0, (n - found) as f64)
}

/// The mean of independent values with its 95 % interval (Student, 1908). One value alone has an
/// infinite interval; `None` for no value.
pub fn mean_interval(values: &[f64]) -> Option<Interval> {
    let n = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    if values.len() == 1 {
        return Some(Interval { estimate: mean, low: f64::NEG_INFINITY, high: f64::INFINITY });
    }
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    let half = student_t(n - 1.0) * (variance / n).sqrt();
    Some(Interval { estimate: mean, low: mean - half, high: mean + half })
}

/// The number that Student's t of `freedom` degrees exceeds in absolute value in 5 % of cases.
fn student_t(freedom: f64) -> f64 {
    // P(|T| > t) = I_x(ν/2, 1/2) at x = ν / (ν + t²).
    let x = inverse_beta(1.0 - CONFIDENCE, freedom / 2.0, 0.5);
    (freedom * (1.0 - x) / x).sqrt()
}

/// The x at which the regularised incomplete beta function `I_x(a, b)` equals `p`: bisection,
/// since the function only rises.
fn inverse_beta(p: f64, a: f64, b: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if incomplete_beta(middle, a, b) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The regularised incomplete beta function `I_x(a, b)` (DLMF 8.17; continued fraction 8.17.22).
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    // The fraction converges fast only left of the mean; the other side is its mirror.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let log_beta = libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    let front = libm::exp(a * libm::log(x) + b * libm::log1p(-x) - log_beta) / a;
    front / beta_fraction(x, a, b)
}

/// The continued fraction's denominator by the modified Lentz method (Thompson and Barnett, 1986).
fn beta_fraction(x: f64, a: f64, b: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away_from_zero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let (mut f, mut c, mut d) = (1.0, 1.0, 0.0);
    // About the root of the larger parameter suffices: 1e12 samples need 1e6 terms.
    for term in 1..2_000_000u32 {
        let m = f64::from(term / 2);
        let numerator = if term % 2 == 0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        d = 1.0 / away_from_zero(1.0 + numerator * d);
        c = away_from_zero(1.0 + numerator / c);
        let step = c * d;
        f *= step;
        if (step - 1.0).abs() < 1e-15 {
            break;
        }
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64, tolerance: f64) {
        assert!((got - expected).abs() <= tolerance, "{got} against {expected}");
    }

    #[test]
    fn none_found_is_the_rule_of_three() {
        for n in [1u64, 10, 1000, 1_000_000] {
            let exact = 1.0 - libm::pow(0.05, 1.0 / n as f64);
            near(proportion_upper_bound(0, n), exact, 1e-9 * exact);
        }
        near(proportion_upper_bound(0, 1000), 3.0 / 1000.0, 1e-5);
        assert_eq!(proportion_upper_bound(0, 0), 1.0);
        assert_eq!(proportion_upper_bound(7, 7), 1.0);
    }

    /// The bound is where the binomial's lower tail is 5 %: summed here term by term.
    #[test]
    fn some_found_is_the_binomial_tail() {
        for (found, n) in [(1u64, 20u64), (3, 50), (17, 40), (49, 50)] {
            let p = proportion_upper_bound(found, n);
            let mut term = libm::pow(1.0 - p, n as f64);
            let mut tail = term;
            for k in 0..found {
                term *= (n - k) as f64 / (k + 1) as f64 * p / (1.0 - p);
                tail += term;
            }
            near(tail, 0.05, 1e-9);
        }
    }

    #[test]
    fn published_intervals() {
        // 10 of 100: R's binom.test gives 0.04900469 to 0.17622260.
        let i = proportion_interval(10, 100);
        near(i.low, 0.049_004_69, 1e-8);
        near(i.high, 0.176_222_60, 1e-8);
        let none = proportion_interval(0, 20);
        assert_eq!(none.low, 0.0);
        near(none.high, 1.0 - libm::pow(0.025, 1.0 / 20.0), 1e-12);
    }

    #[test]
    fn student_t_table() {
        for (freedom, t) in
            [(1.0, 12.7062), (2.0, 4.3027), (9.0, 2.2622), (30.0, 2.0423), (1e6, 1.96)]
        {
            near(student_t(freedom), t, 6e-5);
        }
    }

    #[test]
    fn mean_of_a_few() {
        let i = mean_interval(&[1.0, 2.0, 3.0]).expect("three values");
        near(i.estimate, 2.0, 1e-15);
        near(i.high - 2.0, 4.302_65 / 3f64.sqrt(), 1e-5);
        assert!(mean_interval(&[]).is_none());
        assert_eq!(mean_interval(&[5.0]).expect("one value").high, f64::INFINITY);
    }
}
