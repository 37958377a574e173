//! Confidence at 95 %: shares of a whole and totals, from a random sample.

use serde::Serialize;
use statrs::function::beta::beta_reg;
use statrs::function::gamma::checked_gamma_lr;

/// The confidence of the intervals that a page or a manifest tells.
pub const CONFIDENCE: f64 = 0.95;

/// A figure with the interval that holds the truth, at [`CONFIDENCE`] unless another was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The best estimate.
    pub estimate: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
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

/// The number of independent rare events that is exceeded with a probability of at most `chance`, where `mean` are expected
/// (Poisson).
pub fn most_by_chance(mean: f64, chance: f64) -> u64 {
    let exceeds = |most: u64| {
        mean > 0.0 && checked_gamma_lr(most as f64 + 1.0, mean).is_ok_and(|p| p > chance)
    };
    let mut most = mean as u64;
    while exceeds(most) {
        most += 1;
    }
    most
}

/// How much more than the largest part that was drawn the largest one of all may be.
///
/// Squared errors of pixels have long tails: a few hold most of the sum, and a sample that missed
/// them looks surer than it is. 1 is Fay and Feuer's own. In 1,200 draws of some 77 pixels from
/// shots of `scenes/demo`, whose squared errors have a kurtosis of 30 to 230, the interval held the
/// truth in 90 % with 1 and in 96 % with 2; in three other scenes in 96 % and more with either.
const TAIL: f64 = 2.0;

/// The total that parts drawn at random estimate, with the interval that contains it with this `confidence`: `sum` of the
/// parts, sum of their `squares`, the `largest` of them (Fay and Feuer, "Confidence intervals for directly
/// standardized rates: a method based on the gamma distribution", 1997, with a longer tail).
///
/// The upper end is what the total may be were one more part as large to come. Parts may be
/// negative; a total may not, and one below 0 counts as 0.
pub fn drawn_sum_interval(sum: f64, squares: f64, largest: f64, confidence: f64) -> Interval {
    let tail = (1.0 - confidence) / 2.0;
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
    let most = shape + 20.0 * shape.sqrt() + 40.0;
    let below = |x| checked_gamma_lr(shape, x).is_ok_and(|share| share < p);
    bisected(most, below) * scale
}

/// The x at which the regularised incomplete beta function `I_x(a, b)` equals `p`.
fn inverse_beta(p: f64, a: f64, b: f64) -> f64 {
    // (`inv_beta_reg` of the same crate is off by 1e-4, or never ends, where one parameter is large.)
    bisected(1.0, |x| beta_reg(a, b, x) < p)
}

/// The x in [0, `high`] up to which `is_below` holds.
fn bisected(high: f64, is_below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, high);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if is_below(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64, tolerance: f64) {
        assert!((got - expected).abs() <= tolerance, "{got} against {expected}");
    }

    /// Sums of the Poisson distribution's terms.
    #[test]
    fn events_exceed_their_bound_by_chance_alone() {
        for mean in [0.0f64, 0.1, 1.0, 7.5, 52.0] {
            let above = |most: u64| {
                let mut term = libm::exp(-mean);
                let mut sum = term;
                (1..=most).for_each(|k| {
                    term *= mean / k as f64;
                    sum += term;
                });
                1.0 - sum
            };
            let most = most_by_chance(mean, 1e-3);
            assert!(above(most) <= 1e-3, "{mean}: {most}");
            assert!(most == 0 || above(most - 1) > 1e-3, "{mean}: {most}");
        }
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
        near(inverse_beta(0.025, 10.0, 91.0), 0.049_004_69, 1e-8);
        near(inverse_beta(0.975, 11.0, 90.0), 0.176_222_60, 1e-8);
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
        let none = drawn_sum_interval(0.0, 0.0, 3.0, CONFIDENCE);
        assert_eq!((none.estimate, none.low), (0.0, 0.0));
        assert!(none.high > 6.0 && none.high.is_finite());
        let negative = drawn_sum_interval(-2.0, 5.0, 1.0, CONFIDENCE);
        assert_eq!((negative.estimate, negative.low), (0.0, 0.0));
        assert!(negative.high > 2.0);
        let few = drawn_sum_interval(100.0, 1000.0, 10.0, CONFIDENCE);
        let many = drawn_sum_interval(100.0, 10.0, 0.1, CONFIDENCE);
        assert!(few.low < many.low && many.low < 100.0);
        assert!(few.high > many.high && many.high > 100.0);
        near(many.high - many.low, 2.0 * 1.96 * 10f64.sqrt(), 0.6);
        let surer = drawn_sum_interval(100.0, 10.0, 0.1, 0.999);
        near(surer.high - surer.low, 2.0 * 3.29 * 10f64.sqrt(), 1.0);
    }
}
