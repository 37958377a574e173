//! Adaptive camera samples: pixels whose samples differ, or whose neighbours do, take more of them.
//!
//! Every pixel takes the least number of samples first. Then each goes on, a few samples at a time, until it has as
//! many as their differences call for (Neyman, 1934: in proportion to the standard deviation). The standard deviation
//! of four samples is itself noisy, and four samples miss a thin edge more often than not. So those of the neighbours, and
//! differences between neighbouring pixels, count too. All samples are averaged, those by which the choice was made too;
//! `docs/accuracy.md` has the bias.
//!
//! The choice depends on a pixel, its eight neighbours and the settings alone.

use crate::math::{Rgb, Vec3};
use rayon::prelude::*;

/// Pixels whose samples have this standard deviation, of [`SampleSpread`]'s values, take all the samples that they may.
const FULL: f32 = 24.0;
/// Weight of a pixel's own variance beside those of its neighbours.
const OWN: f32 = 4.0;
/// Weight of the variance of a neighbour that shares an edge with it; the others have 1.
const ADJACENT: f32 = 2.0;
/// Share of a pixel's difference from the mean of two opposite neighbours that counts as standard deviation: an edge
/// at the border of two pixels shows in neither's samples.
const BEND: f32 = 0.5;

/// Differences among the camera samples that a pixel has so far.
///
/// They are of 255 times the root of radiance, exposure applied and each channel clipped, without a tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SampleSpread {
    /// How many samples.
    pub count: u32,
    /// The sum of their radiance, before exposure, to which further samples are added.
    pub(super) sum: Rgb,
    /// Mean of their values. NaN once one of them was invalid.
    mean: Vec3,
    /// Sum of the squared distances from the mean, all channels (Welford, 1962: sums of squares themselves would round
    /// away what little thousands of samples differ by).
    squares: f32,
}

impl SampleSpread {
    /// Takes in a sample of this radiance, exposure applied.
    pub fn add(&mut self, radiance: Rgb) {
        self.count += 1;
        let is_valid = radiance.is_finite() && radiance.min_element() >= 0.0;
        let value = match is_valid {
            true => 255.0 * radiance.min(Rgb::ONE).map(f32::sqrt),
            // Nothing is gained by more samples.
            false => Vec3::NAN,
        };
        let before = value - self.mean;
        self.mean += before / self.count as f32;
        self.squares += before.dot(value - self.mean);
    }

    /// Notes that one of the samples was invalid.
    pub fn spoil(&mut self) {
        self.mean = Vec3::NAN;
    }

    /// Standard deviation of one sample, root mean square over the channels; 0 of a single sample, and where one
    /// was invalid.
    fn deviation(&self) -> f32 {
        let others = self.count.max(2) - 1;
        // NaN is not larger.
        (self.squares / (3 * others) as f32).max(0.0).sqrt()
    }

    /// How many samples the pixel should have, at most `most`, where its neighbours suggest a standard deviation of
    /// `beside`.
    pub fn wanted(&self, beside: f32, most: u32) -> u32 {
        let share = self.deviation().max(beside) / FULL;
        if self.mean.is_nan() { 0 } else { (share.min(1.0) * most as f32).ceil() as u32 }
    }
}

/// How many camera samples pixels take in all.
#[derive(Clone, Copy)]
pub(super) enum Until<'p> {
    /// As many in every pixel.
    Count(u32),
    /// As many as differences call for, at most `most`; `beside` has the standard deviation that a pixel's
    /// neighbours suggest, for each pixel of the image.
    Differences { beside: &'p [f32], most: u32 },
    /// As many as is said for each pixel of the image.
    Each(&'p [u32]),
}

impl Until<'_> {
    /// How many samples the pixel at `at` of the image shall have, the differences among whose samples are `spread`.
    #[inline(always)]
    pub fn count(&self, at: usize, spread: Option<&SampleSpread>) -> u32 {
        match self {
            Self::Count(count) => *count,
            Self::Each(counts) => counts[at],
            Self::Differences { beside, most } => {
                spread.map_or(0, |spread| spread.wanted(beside[at], *most))
            }
        }
    }
}

/// For each pixel of an image, row by row, the standard deviation that its neighbours suggest. Those without samples
/// suggest nothing.
pub(super) fn beside(spreads: &[SampleSpread], width: u32) -> Vec<f32> {
    let width = width.max(1) as usize;
    let height = spreads.len() / width;
    let of = |i: usize| {
        let own = &spreads[i];
        if own.count == 0 {
            return 0.0;
        }
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        let at = |dx: isize, dy: isize| {
            let (x, y) = (x + dx, y + dy);
            let is_inside = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
            let found = is_inside.then(|| &spreads[y as usize * width + x as usize]);
            found.filter(|spread| spread.count > 0)
        };
        let (mut squares, mut weights) = (OWN * own.deviation().powi(2), OWN);
        let mut most = 0f32;
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
            let pair = [at(dx, dy), at(-dx, -dy)];
            let weight = if dx == 0 || dy == 0 { ADJACENT } else { 1.0 };
            for spread in pair.into_iter().flatten() {
                // An invalid sample of a neighbour says nothing.
                squares += weight * spread.deviation().powi(2);
                weights += weight;
            }
            if let [Some(a), Some(b)] = pair {
                let bend = own.mean - 0.5 * (a.mean + b.mean);
                most = most.max(BEND * (bend.length_squared() / 3.0).sqrt());
            }
        }
        most.max((squares / weights).sqrt())
    };
    (0..spreads.len()).into_par_iter().with_min_len(1024).map(of).collect()
}
