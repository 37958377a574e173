//! Estimates of each light from the samples about a point: weighted means, lane by lane, and their
//! risk.

use super::{LEAST_WEIGHT, Lookup};
use crate::inference::{Estimate, SurfacePoint, most_ratio};
use crate::reuse::risk::Features;
use crate::reuse::taps::{ENOUGH_WEIGHT, Taps, sum};
use wide::{CmpEq, CmpGt, f32x4};

/// Weighted sums over the taps that know a light, and the largest contrasts, lane by lane.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f32x4,
    share: f32x4,
    mean: f32x4,
    spread: f32x4,
    bend: Largest,
    wide: Largest,
    far: Largest,
}

/// The largest of non-negative numbers; NaN if any of them is NaN.
#[derive(Clone, Copy, Default)]
struct Largest {
    most: f32x4,
    /// Sum of the numbers: NaN if any of them is.
    sum: f32x4,
}

impl Largest {
    fn note(&mut self, other: f32x4) {
        self.most = other.cmp_gt(self.most).blend(other, self.most);
        self.sum += other;
    }

    fn get(self) -> f32 {
        let [a, b, c, d] = self.most.to_array();
        if sum(self.sum).is_nan() { f32::NAN } else { a.max(b).max(c.max(d)) }
    }
}

/// The estimate of one light from the taps.
#[derive(Clone, Copy)]
pub(super) struct Mean {
    /// Weighted mean of the ratios of the taps that know the light.
    ratio: f32,
    /// The largest `bend` of the taps, see [`Contrast`](crate::reuse::reference::Contrast); likewise `wide` and
    /// `far`.
    bend: f32,
    wide: f32,
    far: f32,
    /// Variance of a trace of as many camera samples, if its rays were independent.
    variance: f32,
    /// Sum of the weights of the taps that know the light.
    weight: f32,
}

impl Lookup<'_> {
    /// Estimates each light at `point`; `shown` are the contributions of the lights to the pixel without
    /// shadows, `lights` their numbers, if lights are selected. `means` is a buffer to reuse.
    pub(super) fn estimate_all(
        &self,
        taps: &Taps,
        point: &SurfacePoint,
        (shown, lights): (&[f32], &[u32]),
        means: &mut Vec<Option<Mean>>,
        estimates: &mut [Estimate],
    ) {
        means.clear();
        let mean = |channel| {
            // A free channel, or a light that does not shine here.
            let is_asked = lights.is_empty() || shown[channel] != 0.0;
            is_asked.then(|| self.mean(taps, (channel, lights), point.samples)).flatten()
        };
        means.extend((0..shown.len()).map(mean));
        let seen = means.iter().zip(shown).map(|(mean, s)| mean.map_or(0.0, |m| s * m.ratio));
        let steps = steps_per_radiance(seen.sum());
        // Lights err together: what is beside a shadow's edge is beside that of the next lamp too.
        let (bend, wide, far, noise, unshadowed) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let (is_whole, is_direct) = (true, point.direct);
        let mut features = Features { bend, wide, far, noise, unshadowed, is_whole, is_direct };
        let mut variance = 0.0;
        for (mean, shown) in means.iter().zip(shown).filter(|(_, shown)| **shown != 0.0) {
            let Some(mean) = mean else { continue };
            let by = steps * shown;
            features.bend += by * mean.bend;
            features.wide += by * mean.wide;
            features.far += by * mean.far;
            variance += by * by * mean.variance;
            features.unshadowed += shown;
            features.is_whole &= f64::from(mean.weight) >= ENOUGH_WEIGHT;
        }
        features.noise = variance.sqrt();
        let level = features.level();
        for (estimate, mean) in estimates.iter_mut().zip(&*means) {
            *estimate = mean.map_or(Estimate::UNKNOWN, |m| Estimate { ratio: m.ratio, level });
        }
    }

    /// The mean for a point of `samples` camera samples; `None` where the taps that know the light have too little
    /// weight.
    fn mean(&self, taps: &Taps, (channel, lights): (usize, &[u32]), samples: u32) -> Option<Mean> {
        let rays = samples as f32 * self.rays[channel] as f32;
        let (one, per_ray) = (f32x4::splat(1.0), f32x4::splat(1.0 / (rays + 2.0)));
        let mut first = f32::NAN;
        let mut sums = Sums::default();
        for four in taps.fours() {
            let own =
                self.references[four.reference as usize].known(&four.samples, channel, lights);
            let known = own.ratio.cmp_eq(own.ratio);
            let weight = four.weight & known;
            if first.is_nan() {
                let lane = weight.cmp_gt(f32x4::ZERO).move_mask().trailing_zeros() as usize;
                first = own.ratio.to_array().get(lane).copied().unwrap_or(first);
            }
            // From the first, so that equal ones give just that.
            let further = (own.ratio - f32x4::splat(first)) & known;
            let share = four.share & known;
            sums.weight += weight;
            sums.share += share;
            sums.mean += share * further;
            // Laplace's rule of succession: where all rays were open the next need not be.
            let open = (own.ratio & known) * f32x4::splat(rays / (rays + 2.0)) + per_ray;
            // A tail's ratio may be above 1.
            sums.spread += share * open * (one - open).fast_max(f32x4::ZERO);
            sums.bend.note(own.bend);
            sums.wide.note(own.wide);
            sums.far.note(own.far);
        }
        let weight = sum(sums.weight);
        if f64::from(weight) < LEAST_WEIGHT {
            return None;
        }
        let share = 1.0 / sum(sums.share);
        let mean = sum(sums.mean) * share;
        Some(Mean {
            // Rounding may leave it a little outside.
            ratio: (first + mean).clamp(0.0, most_ratio(lights.get(channel))),
            bend: sums.bend.get(),
            wide: sums.wide.get(),
            far: sums.far.get(),
            variance: sum(sums.spread) * share / rays,
            weight,
        })
    }
}

/// Display steps of 1/255 per unit of radiance at `radiance`: the slope of
/// the sRGB curve, taken as a power of 1/2.4.
pub(in crate::reuse) fn steps_per_radiance(radiance: f32) -> f32 {
    let shown = f64::from(radiance).clamp(0.003, 1.0);
    // Nearly x^(-7/12), by square roots, which are the same on every machine.
    let root = shown.sqrt();
    (255.0 * 1.055 / 2.4 / (root * root.sqrt().sqrt().sqrt())) as f32
}
