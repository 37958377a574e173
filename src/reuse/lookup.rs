//! Reprojection: estimates of a surface point's ratios from other frames.
//!
//! A point is projected into each reference. Of the four samples around it, those count that lie on
//! the same surface: same mesh, compatible normal, within the pixel's footprint on the surface, and
//! sampled not much more coarsely than the point itself. Their weighted mean is the estimate, in each
//! channel on its own. [`Evidence`] decides whether it may be used.

mod estimate;

pub(super) use estimate::steps_per_radiance;

use super::check::agrees;
use super::evidence::Evidence;
use super::reference::{NONE, Reference};
use super::taps::{ALWAYS, References, TOGETHER, Taps, Taps4, sum};
use crate::film::{Provenance, ProvenanceKind};
use crate::inference::{Estimate, Inference, LookupBatch};

/// Least sum of weights for an estimate; a reference that surrounds the point gives 1.
pub(super) const LEAST_WEIGHT: f64 = 0.1;

/// Estimates ratios from reference frames.
pub struct Lookup<'a> {
    /// The frame that is inferred.
    pub frame: u32,
    /// The references in the order of lookup: the first two always, the others where these give too little weight.
    pub references: &'a [&'a Reference],
    /// Shadow rays that tracing casts from a camera sample to each light whose ratios are kept.
    pub rays: &'a [u32],
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
        let channels = self.lookup.rays.len();
        let answers = ratios.chunks_exact_mut(channels).zip(estimates.chunks_exact(channels));
        for (i, (ratios, estimates)) in answers.enumerate() {
            if provenance[i] == Provenance::default() {
                continue;
            }
            // One level for all lights of a point.
            let known = estimates.iter().find(|estimate| !estimate.ratio.is_nan());
            let Some(known) = known else { continue };
            if !(self.evidence)(pixels[i]).may_use(known.level, batch.refinement) {
                continue;
            }
            ratios.iter_mut().zip(estimates).for_each(|(ratio, e)| *ratio = e.ratio);
            checks.resize(points.len() * channels, false);
            let own = &mut checks[i * channels..][..channels];
            own.iter_mut().zip(estimates).for_each(|(check, e)| *check = !e.ratio.is_nan());
        }
    }

    fn check(&self, batch: &mut LookupBatch) {
        let channels = self.lookup.rays.len();
        for at in 0..batch.points.len() {
            let own = at * channels..(at + 1) * channels;
            let is_checked = batch.checks[own.clone()].contains(&true);
            if is_checked && !agrees(batch, at, channels, self.tolerance) {
                batch.ratios[own].fill(f32::NAN);
            }
        }
    }
}

impl Lookup<'_> {
    /// Fills estimates and provenance for all points.
    pub fn estimate(&self, batch: &mut LookupBatch) {
        let LookupBatch { points, unshadowed, lights, estimates, provenance, .. } = batch;
        let channels = self.rays.len();
        estimates.clear();
        estimates.resize(points.len() * channels, Estimate::UNKNOWN);
        let each = points
            .chunks(TOGETHER)
            .zip(unshadowed.chunks(TOGETHER * channels))
            .zip(estimates.chunks_mut(TOGETHER * channels))
            .zip(provenance.chunks_mut(TOGETHER));
        let references = References(self.references);
        let mut taps = Taps::new();
        let mut means = Vec::with_capacity(channels);
        for (chunk, (((points, unshadowed), estimates), provenance)) in each.enumerate() {
            let lights = |i: usize| {
                let own = lights.get((chunk * TOGETHER + i) * channels..);
                own.and_then(|own| own.get(..channels)).unwrap_or_default()
            };
            let shown = |i: usize| &unshadowed[i * channels..][..channels];
            let is_lit = |i: usize| shown(i).iter().any(|s| *s != 0.0);
            let mut found: [[Option<Taps4>; ALWAYS]; TOGETHER] = [[None; ALWAYS]; TOGETHER];
            references.find(points, is_lit, &mut found);
            for (i, point) in points.iter().enumerate().filter(|(i, _)| is_lit(*i)) {
                references.gather(point, &found[i], &mut taps);
                if taps.weight >= LEAST_WEIGHT {
                    let own = &mut estimates[i * channels..][..channels];
                    let shown = (shown(i), lights(i));
                    self.estimate_all(&taps, point, shown, &mut means, own);
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
