//! Reprojection: estimates of a surface point's ratios from other frames.
//!
//! A point is projected into each reference. Of the four samples around it, those count that lie on
//! the same surface: same mesh, compatible normal, within the pixel's footprint on the surface, and
//! sampled not much more coarsely than the point itself. Their weighted mean is the estimate, in each
//! channel on its own. [`Evidence`] decides whether it may be used.

mod estimate;

use estimate::Buffers;
pub(super) use estimate::steps_per_radiance;

use super::check::agrees;
use super::cost::{is_worth_in_part, rays_of};
use super::evidence::Evidence;
use super::reference::{NONE, Reference};
use super::risk::is_part;
use super::taps::{ALWAYS, References, TOGETHER, Taps, Taps4, sum};
use crate::film::{Provenance, ProvenanceKind};
use crate::inference::{Channel, Channels, Estimate, Inference, LookupBatch};
use crate::scene::Settings;

/// Least sum of weights for an estimate; a reference that surrounds the point gives 1.
pub(super) const LEAST_WEIGHT: f64 = 0.1;

/// Estimates ratios from reference frames.
pub struct Lookup<'a> {
    /// The frame that is inferred.
    pub frame: u32,
    /// The references in the order of lookup: the first two always, the others where these give too little weight.
    pub references: &'a [&'a Reference],
    /// The channels of ratios, those of one light in a row.
    pub channels: &'a [LookupChannel],
    /// Whether points in mirrors and through glass are looked up too.
    pub specular: bool,
}

/// A channel of ratios.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LookupChannel {
    /// Shadow rays that tracing casts from a camera sample to its light.
    pub rays: u32,
    /// Whether it is the first one of its light: the ratios of a light are used together.
    pub is_first: bool,
}

impl LookupChannel {
    /// All `channels`.
    pub fn all(channels: &Channels, settings: &Settings) -> Vec<Self> {
        let of = |channel: Channel| Self {
            rays: rays_of(channel, settings),
            is_first: channel.part() == 0,
        };
        channels.iter().map(of).collect()
    }
}

/// Answers with those estimates of a lookup that the evidence allows.
pub struct Judged<'a> {
    /// The source of estimates.
    pub lookup: &'a Lookup<'a>,
    /// The evidence that judges the estimates of a pixel (column, row).
    pub evidence: &'a (dyn Fn([u32; 2]) -> &'a Evidence + Sync),
    /// Error that counts as invisible, display steps.
    pub tolerance: f32,
}

impl Inference for Judged<'_> {
    fn infer(&self, batch: &mut LookupBatch) {
        self.lookup.estimate(batch);
        let LookupBatch { points, pixels, ratios, estimates, provenance, checks, .. } = batch;
        let channels = self.lookup.channels.len();
        let answers = ratios.chunks_exact_mut(channels).zip(estimates.chunks_exact(channels));
        for (i, (ratios, estimates)) in answers.enumerate() {
            if provenance[i] == Provenance::default() {
                continue;
            }
            let evidence = (self.evidence)(pixels[i]);
            let known = || estimates.iter().enumerate().filter(|(_, e)| !e.ratio.is_nan());
            let is_worth = |(channel, e): &(usize, &Estimate)| {
                let rays = self.lookup.channels[*channel].rays.saturating_mul(points[i].samples);
                !is_part(e.level) || is_worth_in_part(rays)
            };
            let allowed = known().filter(is_worth);
            let allowed = allowed.filter(|(_, e)| evidence.may_use(e.level, batch.refinement));
            // The brighter lights are traced.
            let Some(most) = allowed.map(|(_, e)| e.order).max() else { continue };
            checks.resize(points.len() * channels, false);
            let checks = &mut checks[i * channels..][..channels];
            for (channel, estimate) in known().filter(|(_, e)| e.order <= most) {
                (ratios[channel], checks[channel]) = (estimate.ratio, true);
            }
        }
    }

    fn check(&self, batch: &mut LookupBatch) {
        let channels = self.lookup.channels.len();
        for at in 0..batch.points.len() {
            let own = at * channels..(at + 1) * channels;
            let is_checked = batch.checks[own.clone()].contains(&true);
            if is_checked && !agrees(batch, (at, channels), u32::MAX, self.tolerance) {
                batch.ratios[own].fill(f32::NAN);
            }
        }
    }
}

impl Lookup<'_> {
    /// Fills estimates and provenance for all points.
    pub fn estimate(&self, batch: &mut LookupBatch) {
        let LookupBatch { points, unshadowed, lights, estimates, provenance, .. } = batch;
        let channels = self.channels.len();
        estimates.clear();
        estimates.resize(points.len() * channels, Estimate::UNKNOWN);
        let each = points
            .chunks(TOGETHER)
            .zip(unshadowed.chunks(TOGETHER * channels))
            .zip(estimates.chunks_mut(TOGETHER * channels))
            .zip(provenance.chunks_mut(TOGETHER));
        let references = References(self.references);
        let mut taps = Taps::new();
        let mut buffers = Buffers::default();
        for (chunk, (((points, unshadowed), estimates), provenance)) in each.enumerate() {
            let lights = |i: usize| {
                let own = lights.get((chunk * TOGETHER + i) * channels..);
                own.and_then(|own| own.get(..channels)).unwrap_or_default()
            };
            let shown = |i: usize| &unshadowed[i * channels..][..channels];
            let is_asked = |i: usize| {
                (self.specular || points[i].direct) && shown(i).iter().any(|s| *s != 0.0)
            };
            let mut found: [[Option<Taps4>; ALWAYS]; TOGETHER] = [[None; ALWAYS]; TOGETHER];
            references.find(points, is_asked, &mut found);
            for (i, point) in points.iter().enumerate().filter(|(i, _)| is_asked(*i)) {
                references.gather(point, &found[i], &mut taps);
                if taps.weight >= LEAST_WEIGHT {
                    let own = &mut estimates[i * channels..][..channels];
                    let shown = (shown(i), lights(i));
                    self.estimate_all(&taps, point, shown, &mut buffers, own);
                    provenance[i] = self.provenance(&taps);
                }
            }
        }
    }

    fn provenance(&self, taps: &Taps) -> Provenance {
        let (mut earlier, mut later) = (false, false);
        let mut main = 0;
        let mut most = 0.0;
        let mut distance = 0.0;
        let mut by_reference = 0.0;
        let mut last = NONE;
        for four in taps.fours() {
            let frame = self.references[four.reference as usize].frame;
            earlier |= frame < self.frame;
            later |= frame > self.frame;
            distance += sum(four.weight * four.distance);
            let weight = sum(four.weight);
            by_reference = if last == four.reference { by_reference + weight } else { weight };
            last = four.reference;
            if by_reference > most {
                most = by_reference;
                main = frame;
            }
        }
        let kind = match (earlier, later) {
            (true, true) => ProvenanceKind::Both,
            (false, true) => ProvenanceKind::Later,
            _ => ProvenanceKind::Earlier,
        };
        Provenance { kind, frame: main, distance: distance / taps.weight as f32 }
    }
}

#[cfg(test)]
mod tests;
