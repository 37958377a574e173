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

/// How much more than the largest part that was drawn the largest one of all may be.
///
/// Squared errors of pixels have long tails: a few hold most of the sum, and a sample that missed
/// them looks surer than it is. 1 is Fay and Feuer's own. In 1,200 draws of some 77 pixels from
/// shots of `scenes/demo`, whose squared errors have a kurtosis of 30 to 230, the interval held the
/// truth in 90 % with 1 and in 96 % with 2; in three other scenes in 96 % and more with either.
const TAIL: f64 = 2.0;

/// The total that parts drawn at random estimate, with its 95 % interval: `sum` of the parts, sum
/// of their `squares`, the `largest` of them (Fay and Feuer, "Confidence intervals for directly
/// standardized rates: a method based on the gamma distribution", 1997, with a longer tail).
///
/// The upper end is what the total may be were one more part as large to come. Parts may be
/// negative; a total may not, and one below 0 counts as 0.
pub fn drawn_sum_interval(sum: f64, squares: f64, largest: f64) -> Interval {
    let tail = (1.0 - CONFIDENCE) / 2.0;
    let estimate = sum.max(0.0);
    let low = gamma_quantile(tail, estimate, squares);
    let more = TAIL * largest.max(0.0);
    let high = gamma_quantile(1.0 - tail, estimate + more, squares + more * more);
    Interval { estimate, low: low.min(estimate), high: high.max(estimate) }
}

/// The number that a gamma variable of this mean and variance stays below with probability `p`.
fn gamma_quantile(p: f64, mean: f64, variance: f64) -> f64 {
    if mean <= 0.0 || variance <= 0.0 {
        return mean.max(0.0);
    }
    let (shape, scale) = (mean * mean / variance, variance / mean);
    let (mut low, mut high) = (0.0, shape + 20.0 * shape.sqrt() + 40.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if incomplete_gamma(shape, middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high) * scale
}

/// The regularised lower incomplete gamma function `P(a, x)`: its series (DLMF 8.11.4) left of the
/// mean, the continued fraction of its complement (DLMF 8.9.2) right of it.
fn incomplete_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return front * sum;
    }
    // Modified Lentz, as below; all numerators but the first are negative, no part is zero.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut f = d;
    for k in 1..1_000_000u32 {
        let k = f64::from(k);
        let numerator = k * (a - k);
        b += 2.0;
        d = 1.0 / (b + numerator * d);
        c = b + numerator / c;
        let step = c * d;
        f *= step;
        if (step - 1.0).abs() < 1e-15 {
            break;
        }
    }
    1.0 - front * f
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
    fn gamma_quantiles_are_chi_squares() {
        // Tables of chi-square: half the degrees of freedom are the shape, the scale is 2.
        for (freedom, low, high) in
            [(1.0, 0.000_982_1, 5.0239), (2.0, 0.0506, 7.3778), (10.0, 3.2470, 20.4832)]
        {
            near(gamma_quantile(0.025, freedom, 2.0 * freedom), low, 6e-5);
            near(gamma_quantile(0.975, freedom, 2.0 * freedom), high, 6e-5);
        }
        // Nearly normal.
        let wide = gamma_quantile(0.975, 1e8, 1e8);
        near((wide - 1e8) / 1e4, 1.96, 1e-3);
    }

    #[test]
    fn a_drawn_sum_is_never_below_zero_and_surer_with_more_parts() {
        let none = drawn_sum_interval(0.0, 0.0, 3.0);
        assert_eq!((none.estimate, none.low), (0.0, 0.0));
        assert!(none.high > 6.0 && none.high.is_finite());
        let negative = drawn_sum_interval(-2.0, 5.0, 1.0);
        assert_eq!((negative.estimate, negative.low), (0.0, 0.0));
        assert!(negative.high > 2.0);
        let few = drawn_sum_interval(100.0, 1000.0, 10.0);
        let many = drawn_sum_interval(100.0, 10.0, 0.1);
        assert!(few.low < many.low && many.low < 100.0);
        assert!(few.high > many.high && many.high > 100.0);
        near(many.high - many.low, 2.0 * 1.96 * 10f64.sqrt(), 0.6);
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
