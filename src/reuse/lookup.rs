//! Reprojection with evidence: what a surface point's ratios are, as far as references tell.
//!
//! A point is projected into each reference. Of the four samples around it those count that lie on
//! the same surface: same mesh, compatible normal, within the pixel's footprint on the surface, and
//! sampled no more coarsely than the point itself. Their weights are renormalised; in each channel
//! they must carry enough weight together and agree as well as their sampling noise allows, with one
//! another or with a plane through them.

mod told;

use super::plane::Plane;
use super::reference::{NONE, Reference};
use super::taps::{ALWAYS, Taps, Taps4, sum};
use crate::inference::{Inference, Origin, Questions};
use crate::math::Vec3;
use told::Told;

/// Points that are looked up together: the memory that all of them need is asked for before any of it
/// is waited for.
pub(super) const TOGETHER: usize = 16;
/// Fewer shadow rays do not excuse that samples lie off a plane.
const PLANE_RAYS: f32 = 100.0;
/// A bend, 1 - 2 + 1 ratios, has √6 times the noise of one: this is 1/√6.
const BEND: f32 = 0.408_248_3;

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
    /// Both the same about a plane through the samples, where these do not agree by themselves: the
    /// tolerance a share of the other one.
    pub plane_tolerance: f32,
    /// In the variance of so many independent shadow samples, at least a hundred: noise of fewer hides
    /// whether they are a plane.
    pub plane_noise: f32,
    /// Variance that the plane's value may have, in that of one sample.
    pub plane_leverage: f32,
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
            plane_tolerance: 0.8,
            plane_noise: 1.75,
            plane_leverage: 0.6,
            offset: 1.5,
            offset_steps: 30.0,
            offset_noise: 14.0,
            offset_saturated: 4.0,
            change: 3.0,
            change_noise: 5.0,
        }
    }
}

impl Evidence {
    /// With a `share` of what is allowed: of the deviation, and of the variance for noise.
    pub fn shared(self, share: f32) -> Self {
        Self {
            tolerance: self.tolerance * share,
            noise: self.noise * share,
            plane_noise: self.plane_noise * share,
            change_noise: self.change_noise * share.sqrt(),
            ..self
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
            let mut found: [[Option<Taps4>; ALWAYS]; TOGETHER] = [[None; ALWAYS]; TOGETHER];
            self.find(points, is_lit, &mut found);
            for (i, point) in points.iter().enumerate().filter(|(i, _)| is_lit(*i)) {
                self.gather(point, &found[i], &mut taps);
                if taps.weight >= self.evidence.least_weight {
                    self.answer(point.n, &taps, shown(i), &mut ratios[i * channels..][..channels]);
                    origins[i] = self.origin(&taps);
                }
            }
        }
    }
}

impl Lookup<'_> {
    /// Means of the ratios that agree, about a point with the normal `n`. `shown` is what the pixel
    /// would show of each light without shadows.
    fn answer(&self, n: Vec3, taps: &Taps, shown: &[f32], ratios: &mut [f32]) {
        // Of many lights the last are told twice.
        let mut told = [None; 8];
        let mut seen = 0.0;
        for (channel, shown) in shown.iter().enumerate() {
            let own = self.told(taps, channel);
            seen += own.map_or(0.0, |own| shown * own.mean);
            if let Some(kept) = told.get_mut(channel) {
                *kept = own;
            }
        }
        let steps = steps_per_radiance(seen);
        for (channel, (out, shown)) in ratios.iter_mut().zip(shown).enumerate() {
            let kept = told.get(channel).copied();
            let Some(own) = kept.unwrap_or_else(|| self.told(taps, channel)) else { continue };
            let allowed = self.evidence.tolerance / (steps * shown).max(1e-6);
            let rays = own.samples * self.rays[channel] as f32;
            if self.agrees(&own, rays, allowed) {
                *out = own.mean;
            } else if let Some(ratio) = self.by_plane(n, taps, channel, (&own, rays, allowed)) {
                *out = ratio;
            }
        }
    }

    /// Whether ratios of `rays` shadow rays each lie no further from their mean than their sampling noise
    /// and an `allowed` deviation explain, and about the point.
    fn agrees(&self, told: &Told, rays: f32, allowed: f32) -> bool {
        let Told { mean, variance, offset, change, .. } = *told;
        let noise = self.evidence.noise * variance_of_one(mean) / rays;
        if variance > allowed * allowed + noise {
            return false;
        }
        if change.slope.is_nan() {
            return offset <= self.most_offset(mean, allowed, noise);
        }
        change.slope * offset <= self.most_change(mean, rays, allowed)
    }

    /// The ratio at the point where the taps lie on a plane, and so do the samples beside them: three in a
    /// row tell a slope from a step, which four about a point cannot.
    fn by_plane(
        &self,
        n: Vec3,
        taps: &Taps,
        channel: usize,
        (told, rays, allowed): (&Told, f32, f32),
    ) -> Option<f32> {
        let Evidence { plane_tolerance, plane_noise, plane_leverage, .. } = self.evidence;
        let known = taps.iter().filter_map(|tap| {
            let reference = self.references[tap.reference as usize];
            let ratio = reference.ratio(tap.sample, channel);
            (!ratio.is_nan()).then_some((tap, ratio))
        });
        let plane = Plane::fit(n, known)?;
        let ratio = plane.value.clamp(0.0, 1.0);
        let allowed = plane_tolerance * allowed;
        let noise = plane_noise * variance_of_one(ratio) / rays.max(PLANE_RAYS);
        let is_plane = plane.residual <= allowed * allowed + noise
            && plane.leverage <= plane_leverage
            && match (told.change.slope.is_nan(), told.change.bend.is_nan()) {
                (true, _) => told.offset <= self.most_offset(ratio, allowed, noise),
                (false, true) => false,
                _ => told.change.bend * BEND <= self.most_change(ratio, rays, allowed),
            };
        is_plane.then_some(ratio)
    }

    /// By how much a ratio may change unseen.
    fn most_change(&self, mean: f32, rays: f32, allowed: f32) -> f32 {
        let traced = stratified_variance(mean, rays);
        self.evidence.change * allowed + self.evidence.change_noise * traced.sqrt()
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
        for four in taps.fours() {
            let frame = self.references[four.reference as usize].frame;
            origin.earlier |= frame < self.frame;
            origin.later |= frame > self.frame;
            distance += sum(four.weight * four.distance);
            let weight = sum(four.weight);
            by_reference = if last == four.reference { by_reference + weight } else { weight };
            last = four.reference;
            if by_reference > most {
                most = by_reference;
                origin.frame = frame;
            }
        }
        origin.distance = distance / taps.weight as f32;
        origin
    }
}

/// Variance of a single shadow ray where the ratio is `mean`.
fn variance_of_one(mean: f32) -> f32 {
    (mean * (1.0 - mean)).max(0.0)
}

/// Variance of `rays` of them, stratified: a shadow's edge crosses the cells of about the root of n of n.
pub(super) fn stratified_variance(mean: f32, rays: f32) -> f32 {
    variance_of_one(mean) / (rays * rays.sqrt())
}

/// How many display steps of 1/255 a unit of radiance makes where `radiance` is shown: the slope of
/// the sRGB curve, as a power of 1/2.4.
pub(super) fn steps_per_radiance(radiance: f32) -> f32 {
    let shown = f64::from(radiance).clamp(0.003, 1.0);
    // Nearly x^(-7/12), by square roots, which are the same on every machine.
    let root = shown.sqrt();
    (255.0 * 1.055 / 2.4 / (root * root.sqrt().sqrt().sqrt())) as f32
}

#[cfg(test)]
mod tests;
