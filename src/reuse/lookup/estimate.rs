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
struct Mean {
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

/// A light of a point, to be put in order.
struct OrderedLight {
    /// Those of its estimate.
    features: Features,
    /// Its first channel.
    channel: usize,
}

/// Room for the lights of a point.
#[derive(Default)]
pub(super) struct Buffers {
    means: Vec<Option<Mean>>,
    ordered: Vec<OrderedLight>,
}

impl Mean {
    /// The features of this estimate alone, of a light that contributes `unshadowed` without shadows, which are `by` display
    /// steps.
    fn features(&self, by: f32, unshadowed: f32, none: Features) -> Features {
        Features {
            bend: by * self.bend,
            wide: by * self.wide,
            far: by * self.far,
            variance: by * by * self.variance,
            unshadowed,
            is_whole: f64::from(self.weight) >= ENOUGH_WEIGHT,
            ..none
        }
    }
}

impl Lookup<'_> {
    /// Estimates each light at `point`; `shown` are the contributions of the lights to the pixel without
    /// shadows, `lights` their numbers, if lights are selected. `buffers` are used again.
    pub(super) fn estimate_all(
        &self,
        taps: &Taps,
        point: &SurfacePoint,
        (shown, lights): (&[f32], &[u32]),
        Buffers { means, ordered }: &mut Buffers,
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
        let none = Features::none(point.direct);
        ordered.clear();
        for (channel, (mean, shown)) in means.iter().zip(shown).enumerate() {
            let features = |mean: &Mean| mean.features(steps * shown, *shown, none);
            let own = mean.as_ref().filter(|_| *shown != 0.0).map_or(none, features);
            match ordered.last_mut() {
                Some(light) if !self.channels[channel].is_first => light.features.add(&own),
                _ => ordered.push(OrderedLight { features: own, channel }),
            }
        }
        // Lights err together: what is beside a shadow's edge is beside that of the next lamp too. So no light is judged
        // without those that send less: its error could be larger than theirs.
        let sent = |light: &OrderedLight| light.features.unshadowed;
        ordered.sort_by(|a, b| sent(a).total_cmp(&sent(b)));
        let (count, mut all) = (ordered.len() as u32, none);
        for (order, light) in (0..).zip(&*ordered) {
            all.add(&light.features);
            all.is_part = order + 1 < count;
            let level = all.level();
            for channel in light.channel..means.len() {
                if channel != light.channel && self.channels[channel].is_first {
                    break;
                }
                if let Some(Mean { ratio, .. }) = means[channel] {
                    estimates[channel] = Estimate { ratio, level, order };
                }
            }
        }
    }

    /// The mean for a point of `samples` camera samples; `None` where the taps that know the light have too little
    /// weight.
    fn mean(&self, taps: &Taps, (channel, lights): (usize, &[u32]), samples: u32) -> Option<Mean> {
        let rays = samples as f32 * self.channels[channel].rays as f32;
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
