//! Reprojection with evidence: what a surface point's ratios are, as far as references tell.
//!
//! A point is projected into each reference. Of the four samples around it those count that lie on
//! the same surface: same mesh, compatible normal, within the pixel's footprint on the surface, and
//! sampled no more coarsely than the point itself. Their weights are renormalised; in each channel
//! they must carry enough weight together and agree as well as their sampling noise allows.

use super::reference::{NONE, Reference};
use super::taps::{ALWAYS, Images, Taps};
use crate::inference::{Inference, Origin, Questions};
use crate::math::Vec3;

/// Points that are looked up together: the memory that all of them need is asked for before any of it
/// is waited for.
const TOGETHER: usize = 16;

/// What counts as evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Least sum of weights, of 1 that a whole reference gives.
    pub least_weight: f64,
    /// With this sum of weights no further reference is asked.
    pub enough_weight: f64,
    /// Least cosine between normals; samples count by the square of what is above it.
    pub least_cos: f32,
    /// Height above the tangent plane, footprints.
    pub height: f32,
    /// Further height, of the distance along the plane.
    pub slope: f32,
    /// By how much a sample's area on the surface may exceed the point's.
    pub coarser: f64,
    /// Samples lie within two footprints, and further where the reference looks along the surface: as
    /// far as at this cosine.
    pub grazing: f64,
    /// Deviation of samples that is always allowed, display steps of 1/255.
    pub tolerance: f32,
    /// Variance allowed on top, in that of independent shadow samples.
    pub noise: f32,
    /// Where no slope is known, behind mirrors and glass: how far the samples' weighted mean may lie from
    /// the point, footprints. Beside it they tell about another place, however well they agree.
    pub offset: f32,
    /// A light that makes as many display steps may lie an `offset` further off; dimmer ones more.
    pub offset_steps: f32,
    /// Where tracing's noise (standard deviation of a ratio) times this exceeds 1, by so much
    /// further.
    pub offset_noise: f32,
    /// The same as `offset` where all samples see the whole light, or none of it.
    pub offset_saturated: f32,
    /// How much the ratio may change, by the samples' slopes, over the way from the point to their mean:
    /// allowed deviations.
    pub change: f32,
    /// And standard deviations of tracing on top.
    pub change_noise: f32,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            least_weight: 0.1,
            enough_weight: 0.6,
            least_cos: 0.8,
            height: 0.7,
            slope: 0.35,
            coarser: 6.0,
            grazing: 0.3,
            tolerance: 1.0,
            noise: 2.0,
            offset: 1.0,
            offset_steps: 30.0,
            offset_noise: 14.0,
            offset_saturated: 4.0,
            change: 3.0,
            change_noise: 5.0,
        }
    }
}

/// Answers from reference frames, asked in their order.
pub struct Lookup<'a> {
    /// The frame that is inferred.
    pub frame: u32,
    /// The first two are asked always, the others where those do not tell enough.
    pub references: &'a [&'a Reference],
    /// Shadow rays of one camera sample, by channel.
    pub rays: &'a [u32],
    /// What counts.
    pub evidence: Evidence,
}

impl Inference for Lookup<'_> {
    fn infer(&self, questions: &mut Questions) {
        let Questions { points, unshadowed, ratios, origins } = questions;
        let channels = self.rays.len();
        let each = points
            .chunks(TOGETHER)
            .zip(unshadowed.chunks(TOGETHER * channels))
            .zip(ratios.chunks_mut(TOGETHER * channels))
            .zip(origins.chunks_mut(TOGETHER));
        let mut taps = Taps::new();
        for (((points, unshadowed), ratios), origins) in each {
            let shown = |i: usize| &unshadowed[i * channels..][..channels];
            let is_lit = |i: usize| shown(i).iter().any(|s| *s != 0.0);
            let mut images: [Images; TOGETHER] = [[None; ALWAYS]; TOGETHER];
            self.find_images(points, is_lit, &mut images);
            for (i, point) in points.iter().enumerate().filter(|(i, _)| is_lit(*i)) {
                self.gather(point, &images[i], &mut taps);
                if taps.weight >= self.evidence.least_weight {
                    self.answer(&taps, shown(i), &mut ratios[i * channels..][..channels]);
                    origins[i] = self.origin(&taps);
                }
            }
        }
    }
}

/// What the taps tell of one light.
#[derive(Clone, Copy, Default)]
struct Told {
    /// Sum of the weights of the taps that know it.
    weight: f32,
    /// Weighted mean of their ratios.
    mean: f32,
    /// Weighted mean of the squared distances from that.
    variance: f32,
    /// Weighted mean of their camera samples.
    samples: f32,
    /// How far their weighted mean lies from the point, footprints.
    offset: f32,
    /// Largest slope of them, per footprint; NaN where none is known.
    slope: f32,
}

impl Lookup<'_> {
    /// Weighted means of the ratios that agree. `shown` is what the pixel would show of each light
    /// without shadows.
    fn answer(&self, taps: &Taps, shown: &[f32], ratios: &mut [f32]) {
        // Of many lights the last are told twice.
        let mut told = [Told::default(); 8];
        let mut seen = 0.0;
        for (channel, shown) in shown.iter().enumerate() {
            let own = self.told(taps, channel);
            if f64::from(own.weight) >= self.evidence.least_weight {
                seen += shown * own.mean;
            }
            if let Some(kept) = told.get_mut(channel) {
                *kept = own;
            }
        }
        let steps = steps_per_radiance(seen);
        for (channel, (out, shown)) in ratios.iter_mut().zip(shown).enumerate() {
            let kept = told.get(channel).copied();
            let own = kept.unwrap_or_else(|| self.told(taps, channel));
            let allowed = self.evidence.tolerance / (steps * shown).max(1e-6);
            if self.agrees(&own, channel, allowed) {
                *out = own.mean;
            }
        }
    }

    fn told(&self, taps: &Taps, channel: usize) -> Told {
        let mut first = f32::NAN;
        let (mut weight, mut sum, mut squares, mut samples) = (0.0, 0.0, 0.0, 0.0);
        let mut apart = Vec3::ZERO;
        let mut slope = f32::NAN;
        for tap in taps.iter() {
            let reference = self.references[tap.reference as usize];
            let ratio = reference.ratio(tap.sample, channel);
            if ratio.is_nan() {
                continue;
            }
            if first.is_nan() {
                first = ratio;
            }
            // From the first, so that equal ones give just that, and no variance.
            let further = ratio - first;
            weight += tap.weight;
            sum += tap.weight * further;
            squares += tap.weight * further * further;
            samples += tap.weight * reference.samples[tap.sample as usize].samples as f32;
            apart += tap.apart * tap.weight;
            slope = slope.max(reference.slope(tap.sample, channel));
        }
        if weight == 0.0 {
            return Told::default();
        }
        let (share, mean) = (1.0 / weight, sum / weight);
        Told {
            weight,
            mean: first + mean,
            variance: (squares * share - mean * mean).max(0.0),
            samples: samples * share,
            offset: apart.length() * share,
            slope,
        }
    }

    /// Whether the ratios of a channel lie no further from their mean than their sampling noise and
    /// an `allowed` deviation explain, and are enough.
    fn agrees(&self, told: &Told, channel: usize, allowed: f32) -> bool {
        let Told { weight, mean, variance, samples, offset, slope } = *told;
        if f64::from(weight) < self.evidence.least_weight {
            return false;
        }
        let rays = samples * self.rays[channel] as f32;
        let noise = self.evidence.noise * (mean * (1.0 - mean)).max(0.0) / rays;
        if variance > allowed * allowed + noise {
            return false;
        }
        if slope.is_nan() {
            return offset <= self.most_offset(mean, allowed, noise);
        }
        // Stratified: a shadow's edge crosses the cells of about the root of n of n samples.
        let traced = (mean * (1.0 - mean)).max(0.0) / (rays * rays.sqrt());
        let Evidence { change, change_noise, .. } = self.evidence;
        slope * offset <= change * allowed + change_noise * traced.sqrt()
    }

    /// How far the samples' mean may lie from the point, footprints: the further, the less of an
    /// error there shows. `allowed` is the deviation of a ratio that makes the tolerated display
    /// steps, `noise` the variance that tracing has.
    fn most_offset(&self, mean: f32, allowed: f32, noise: f32) -> f32 {
        let Evidence { tolerance, offset, offset_steps, offset_noise, .. } = self.evidence;
        if mean == 0.0 || mean == 1.0 {
            return self.evidence.offset_saturated;
        }
        let dim = offset_steps * allowed / tolerance;
        let noisy = offset_noise * noise.sqrt();
        offset * dim.max(noisy).max(1.0)
    }

    fn origin(&self, taps: &Taps) -> Origin {
        let mut origin = Origin::default();
        let mut most = 0.0;
        let mut distance = 0.0;
        let mut by_reference = 0.0;
        let mut last = NONE;
        for tap in taps.iter() {
            let frame = self.references[tap.reference as usize].frame;
            origin.earlier |= frame < self.frame;
            origin.later |= frame > self.frame;
            distance += tap.weight * tap.apart.length();
            by_reference =
                if last == tap.reference { by_reference + tap.weight } else { tap.weight };
            last = tap.reference;
            if by_reference > most {
                most = by_reference;
                origin.frame = frame;
            }
        }
        origin.distance = distance / taps.weight as f32;
        origin
    }
}

/// How many display steps of 1/255 a unit of radiance makes where `radiance` is shown: the slope of
/// the sRGB curve, as a power of 1/2.4.
fn steps_per_radiance(radiance: f32) -> f32 {
    let shown = f64::from(radiance).clamp(0.003, 1.0);
    // Nearly x^(-7/12), by square roots, which are the same on every machine.
    let root = shown.sqrt();
    (255.0 * 1.055 / 2.4 / (root * root.sqrt().sqrt().sqrt())) as f32
}

#[cfg(test)]
mod tests;
