//! The middle of a few measurements, and how sure it is, whatever they are distributed like.

use super::Interval;
use serde::Serialize;

/// A median with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Median {
    /// The middle value, with the ends of the interval.
    #[serde(flatten)]
    pub interval: Interval,
    /// In which share of repetitions the interval holds the true median: at least 0.95 from six
    /// values on, less with fewer, 0 with one.
    pub confidence: f64,
}

impl Median {
    /// Whether there are values enough to say anything: an interval of 90 % takes five.
    pub fn is_sure(&self) -> bool {
        self.confidence >= 0.9
    }

    /// Whether it has an interval at all: one value gives none.
    pub fn has_interval(&self) -> bool {
        self.confidence > 0.0
    }

    /// Whether the interval, if it is a sure one, leaves `value` out.
    pub fn differs_from(&self, value: f64) -> bool {
        self.is_sure() && !(self.interval.low..=self.interval.high).contains(&value)
    }
}

/// The median of `values` with the exact interval of order statistics (Thompson, "On confidence
/// ranges for the median", 1936): of those that hold it in 95 % of repetitions the narrowest, or
/// least and largest value where no interval does. `None` without a value.
pub fn median(values: &[f64]) -> Option<Median> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let (&least, &largest) = (sorted.first()?, sorted.last()?);
    let estimate = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
    // Chance that the k-th lowest lies above the median: fewer than k of n fall below it.
    let mut chance = libm::pow(0.5, n as f64);
    let mut tail = chance;
    let mut best = (least, largest, 1.0 - 2.0 * tail);
    for k in 1..n / 2 {
        chance *= (n + 1 - k) as f64 / k as f64;
        tail += chance;
        if 1.0 - 2.0 * tail < 0.95 {
            break;
        }
        best = (sorted[k], sorted[n - 1 - k], 1.0 - 2.0 * tail);
    }
    let (low, high, confidence) = best;
    Some(Median { interval: Interval { estimate, low, high }, confidence: confidence.max(0.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_give_their_ends_and_say_how_sure_that_is() {
        let m = median(&[3.0, 1.0, 2.0]).expect("values");
        assert_eq!((m.interval.estimate, m.interval.low, m.interval.high), (2.0, 1.0, 3.0));
        assert_eq!(m.confidence, 0.75);
        let one = median(&[4.0]).expect("a value");
        assert_eq!((one.interval.estimate, one.confidence), (4.0, 0.0));
        assert!(!one.differs_from(9.0), "one value says nothing");
        assert!(median(&[]).is_none());
        assert_eq!(median(&[1.0, 2.0]).map(|m| m.interval.estimate), Some(1.5));
    }

    /// The table of the sign test: with 6 values the ends, with 9 the second, with 20 the sixth.
    #[test]
    fn published_ranks() {
        for (n, rank, confidence) in
            [(6, 1, 0.96875), (9, 2, 0.9609), (12, 3, 0.9614), (20, 6, 0.9586)]
        {
            let values: Vec<f64> = (1..=n).map(f64::from).collect();
            let m = median(&values).expect("values");
            assert_eq!(m.interval.low, f64::from(rank), "{n}");
            assert_eq!(m.interval.high, f64::from(n + 1 - rank), "{n}");
            assert!((m.confidence - confidence).abs() < 1e-4, "{n}: {}", m.confidence);
        }
    }

    #[test]
    fn a_difference_within_the_noise_is_none() {
        let m = median(&[0.97, 1.02, 1.01, 0.99, 1.03, 0.98]).expect("values");
        assert!(!m.differs_from(1.0) && m.differs_from(1.1));
        let few = median(&[2.0, 2.1, 2.2, 2.3]).expect("values");
        assert!(!few.is_sure() && !few.differs_from(1.0), "four values are too few");
    }
}
