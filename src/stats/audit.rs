//! The sums of an audit of inferred frames: enough to pool frames of all ranks.

use super::RayCounts;
use serde::{Deserialize, Serialize};
use std::iter::Sum;
use std::ops::AddAssign;

/// The total of a figure over many pixels, estimated from those that were drawn with known
/// probabilities (Horvitz and Thompson, 1952). A drawn pixel's figure over its probability is its
/// *part*.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawnSum {
    /// The parts' sum: the estimate.
    pub sum: f64,
    /// The sum of the parts' squares: how sure it is.
    pub squares: f64,
    /// The largest part that was drawn or, unseen, might have been.
    pub largest: f64,
    /// How much of the sum corrects for the curve between what was measured and the figure. As much may be wrong with
    /// the correction itself.
    #[serde(default)]
    pub correction: f64,
}

impl DrawnSum {
    /// Takes in a drawn pixel: its figure, and one over the probability with which it was drawn.
    /// `unseen` is a figure that could have gone unnoticed.
    pub fn add(&mut self, figure: f64, weight: f64, unseen: f64) {
        let part = figure * weight;
        self.sum += part;
        self.squares += part * part;
        self.largest = self.largest.max(part).max(unseen * weight);
    }
}

impl AddAssign for DrawnSum {
    fn add_assign(&mut self, o: Self) {
        self.sum += o.sum;
        self.squares += o.squares;
        self.largest = self.largest.max(o.largest);
        self.correction += o.correction;
    }
}

/// The audit of one or many frames. Squared errors are in squares of a display step of 1/255, means over
/// the channels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct AuditSums {
    /// Pixels of the frames.
    pub pixels: u64,
    /// Estimated number of inferred pixels: the drawn ones, times their weights.
    pub inferred_pixels: u64,
    /// Pixels that were drawn and traced twice.
    pub drawn: u64,
    /// Squared error of the inferred pixels.
    pub inferred: DrawnSum,
    /// Squared error of all pixels, some of which were traced.
    pub shown: DrawnSum,
    /// Squared error that the same pixels would have if all had been traced.
    pub traced: DrawnSum,
    /// Rays cast for the audit alone, not for the picture.
    pub rays: RayCounts,
}

impl AddAssign for AuditSums {
    fn add_assign(&mut self, o: Self) {
        self.pixels += o.pixels;
        self.inferred_pixels += o.inferred_pixels;
        self.drawn += o.drawn;
        self.inferred += o.inferred;
        self.shown += o.shown;
        self.traced += o.traced;
        self.rays += o.rays;
    }
}

impl Sum for AuditSums {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |mut sum, one| {
            sum += one;
            sum
        })
    }
}
