//! How a candidate's pixels differ from the default's.

use super::errors::Frames;
use crate::measure::{largest_error, share_exceeding};
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// How pixels differ from the default's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels that differ at all.
    pub differing: u64,
    /// Pixels of which some channel differs by more than 2 display steps.
    pub over_2: u64,
    /// The largest difference, display steps.
    pub largest: f64,
}

impl Change {
    /// Between the same frames of two candidates.
    pub fn between(default: &Frames, other: &Frames) -> Self {
        let mut change = Self::default();
        for (frame, image) in other {
            let reference = &default[frame];
            let pixels = image.rgb.len() as f64;
            let differing = image.rgb.iter().zip(&reference.rgb).filter(|(a, b)| a != b).count();
            change += Self {
                pixels: pixels as u64,
                differing: differing as u64,
                over_2: (share_exceeding(reference, image, 2) * pixels).round() as u64,
                largest: 255.0 * f64::from(largest_error(reference, image).value),
            };
        }
        change
    }
}

impl AddAssign for Change {
    fn add_assign(&mut self, o: Self) {
        self.pixels += o.pixels;
        self.differing += o.differing;
        self.over_2 += o.over_2;
        self.largest = self.largest.max(o.largest);
    }
}
