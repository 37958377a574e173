//! Cells of a grid by their weights.

use crate::math::bulk;
use serde::{Deserialize, Serialize};

/// A distribution that is constant in each cell of a grid: a row by the sums of the rows' weights, then a cell of that
/// row (marginal and conditional tables of cumulative probabilities).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridDistribution {
    width: usize,
    /// Probability of each row and those before it.
    #[serde(with = "bulk")]
    marginal: Vec<f64>,
    /// In each row the probability of each cell and those before it, row by row.
    #[serde(with = "bulk")]
    conditional: Vec<f64>,
}

impl GridDistribution {
    /// The distribution of cells with these `weights`, row by row of `width` cells. `None` where their sum is not above
    /// 0 or not finite.
    pub fn new(width: usize, weights: &[f64]) -> Option<Self> {
        let (mut marginal, mut conditional) = (Vec::new(), Vec::with_capacity(weights.len()));
        let mut all = 0.0;
        for row in weights.chunks_exact(width.max(1)) {
            let start = conditional.len();
            let mut sum = 0.0;
            for weight in row {
                sum += weight;
                conditional.push(sum);
            }
            if sum > 0.0 {
                conditional[start..].iter_mut().for_each(|upto| *upto /= sum);
            }
            all += sum;
            marginal.push(all);
        }
        marginal.iter_mut().for_each(|upto| *upto /= all);
        (all > 0.0 && all.is_finite()).then_some(Self { width, marginal, conditional })
    }

    /// The cell for `u` in the unit square, and the place in it, in the unit square too: columns first.
    pub fn sample(&self, [u, v]: [f64; 2]) -> (usize, [f64; 2]) {
        let (row, y) = inverted(&self.marginal, v);
        let (column, x) = inverted(&self.conditional[row * self.width..][..self.width], u);
        (row * self.width + column, [x, y])
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.marginal[..]) as u64 + size_of_val(&self.conditional[..]) as u64
    }
}

/// The first entry of the `cumulative` probabilities above `u`, and the place of `u` between it and the one before.
fn inverted(cumulative: &[f64], u: f64) -> (usize, f64) {
    let u = u.clamp(0.0, 1.0 - f64::EPSILON / 2.0);
    let at = cumulative.partition_point(|upto| *upto <= u).min(cumulative.len() - 1);
    let before = if at == 0 { 0.0 } else { cumulative[at - 1] };
    (at, ((u - before) / (cumulative[at] - before)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_chosen_as_often_as_they_weigh() {
        let weights = [0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let grid = GridDistribution::new(3, &weights).expect("a distribution");
        let mut found = [0.0; 12];
        for i in 0..64 {
            for j in 0..64 {
                let (cell, [x, y]) =
                    grid.sample([(f64::from(i) + 0.5) / 64.0, (f64::from(j) + 0.5) / 64.0]);
                found[cell] += 8.0 / 4096.0;
                assert!((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y));
            }
        }
        assert_eq!(found, weights);
        // The ends of the square lie in cells with a weight too.
        for u in [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]] {
            assert!(weights[grid.sample(u).0] > 0.0, "{u:?}");
        }
    }

    #[test]
    fn there_is_none_without_weights() {
        for weights in [[0.0; 4], [f64::NAN; 4], [f64::INFINITY; 4]] {
            assert!(GridDistribution::new(2, &weights).is_none());
        }
    }
}
