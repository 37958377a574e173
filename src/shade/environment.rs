//! The light of an environment at diffuse and glossy points.
//!
//! At a diffuse point the estimate is `ratio · unshadowed`, as for other lights, but with a ratio for each primary colour: where
//! a yellow sun is hidden the rest is as blue as the sky. All primaries have the same rays. The ratios are kept for other
//! frames, one where the environment has one colour. At a glossy point samples by importance are joined with
//! the lobe's own rays (multiple importance sampling).
//!
//! Not done: pilot rays. Hardly any point sees all of a sky or nothing of it.

use super::backdrop::{Backdrop, environment_light};
use super::direct::{BATCH, ShadowScratch};
use super::fog::phase;
use super::highlight::GlossyPoint;
use super::light::{EnvironmentLight, ShadowTarget};
use super::pixels::BlockPixels;
use super::point::ShadingPoint;
use super::sky_samples::FoundSky;
use super::{Renderer, Reuse, normal_map};
use crate::math::{DVec3, Rgb, luminance};
use crate::scene::{part, tints};
use crate::stats::{RayCounts, RayKind};
use std::ops::Range;

/// An environment that shines in this frame.
pub(super) struct EnvironmentSource<'a> {
    light: EnvironmentLight<'a>,
    /// Its number among the scene's lights: the sky's, after the last.
    number: u32,
    /// Shadow rays of one camera sample.
    samples: u32,
    /// The channels of its ratios, if they are kept.
    channels: Range<usize>,
    /// Channels of a point.
    all_channels: usize,
}

impl EnvironmentSource<'_> {
    /// A direction from which fog of anisotropy `g` scatters light to a ray along `dir`, and the light from there times
    /// phase function over density: half of the directions go by the phase function, half by importance (balance
    /// heuristic).
    pub fn scattered(&self, (g, dir): (f64, DVec3), strategy: f64, u: [f64; 2]) -> (DVec3, Rgb) {
        let by_importance = match strategy < 0.5 {
            true => self.light.sample_li(u).map(|sample| sample.wi),
            false => None,
        };
        let wi = by_importance.unwrap_or_else(|| phase::sample(g, dir, u));
        let (radiance, importance) = self.light.towards(wi);
        let phase = phase::density(g, wi.dot(dir));
        // A sky that is the same all round has no importance.
        let density = importance.map_or(phase, |density| 0.5 * (density + phase));
        (wi, radiance * (phase / density) as f32)
    }

    /// The part of what a lobe's ray of density `lobe` sees along `dir` that light samples do not.
    pub fn share_of_lobe(&self, dir: DVec3, lobe: f64) -> f32 {
        (lobe / (lobe + f64::from(self.samples) * self.light.pdf_li(dir))) as f32
    }

    /// The colours that its ratios are kept of; none where none is kept.
    fn tints(&self) -> &[Rgb] {
        tints(self.light.tints(), self.channels.len())
    }

    /// What arrives at a point where nothing is in the way.
    fn unshadowed(&self, point: &ShadingPoint) -> Rgb {
        match point.is_mapped() {
            false => self.light.unshadowed(point.n),
            true => {
                let cos = point.n.dot(point.mapped);
                let [own, tilted] = [point.n, point.mapped].map(|n| self.light.unshadowed(n));
                normal_map::unshadowed_colour(own, tilted, cos)
            }
        }
    }

    /// The channels of shading point `i`: their places among those of all points, and their colours.
    fn places(&self, i: usize) -> impl Iterator<Item = (usize, Rgb)> {
        let first = i * self.all_channels + self.channels.start;
        (first..).zip(self.tints()).map(|(at, tint)| (at, *tint))
    }

    /// What arrives at shading point `i` if that is known, as it is where nothing can arrive; `None` where nothing is kept.
    fn known(&self, s: &ShadowScratch, lit: &[ShadingPoint], i: usize) -> Option<Rgb> {
        let is_kept = !self.channels.is_empty();
        is_kept.then(|| s.known_parts((lit, i), self.channels.clone(), self.tints())).flatten()
    }
}

impl Renderer<'_> {
    /// The environment that shines under the plan.
    pub(super) fn environment_source(&self, reuse: Option<Reuse>) -> Option<EnvironmentSource<'_>> {
        let light = environment_light(self.scene).filter(|_| self.plan.sky_light)?;
        Some(EnvironmentSource {
            light,
            number: self.scene.lights.len() as u32,
            samples: self.settings.sky_samples,
            channels: reuse.map_or(0..0, |reuse| reuse.channels.sky()),
            all_channels: reuse.map_or(0, |reuse| reuse.channels.len()),
        })
    }

    /// Notes what of the environment would arrive at all `lit` points if nothing were in the way.
    pub(super) fn environment_without_shadows(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        s: &mut ShadowScratch,
    ) {
        if source.channels.is_empty() {
            return;
        }
        for (i, point) in lit.iter().enumerate() {
            let sent = source.unshadowed(point);
            for (at, tint) in source.places(i) {
                let exact = part(sent, tint);
                let shown = luminance(point.weight * tint) * exact as f32;
                s.note_exact(at, exact, shown * self.settings.exposure);
            }
        }
    }

    /// Casts the check rays to the environment that the inference wants.
    pub(super) fn check_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        if source.channels.is_empty() {
            return;
        }
        let (channels, all_channels) = (source.channels.clone(), source.all_channels);
        // Samples that tracing does not use.
        let samples = source.samples.next_power_of_two();
        let traced = self.settings.most_camera_samples().wrapping_mul(samples);
        let wanted = |s: &ShadowScratch, i: usize| {
            let wanted = s.groups.check_rays(i, channels.clone(), all_channels, source.samples)?;
            let is_sent = source.places(i).any(|(at, _)| s.exact(at) != 0.0);
            let first = traced.wrapping_add(wanted.first).wrapping_add(wanted.own.start as u32);
            is_sent.then_some((first, wanted.own.len()))
        };
        self.cast_to_environment(source, lit, pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.environment.found);
        for FoundSky { point: i, rays, open, all } in &found {
            let i = *i as usize;
            for (channel, (at, tint)) in channels.clone().zip(source.places(i)) {
                let (open, all) = (part(*open, tint), part(*all, tint));
                if s.exact(at) != 0.0 && all > 0.0 {
                    let at = (channel, all_channels);
                    s.groups.note_checked(i, at, (open, all), *rays as usize);
                }
            }
        }
        s.environment.found = found;
    }

    /// Adds the environment's light at all `lit` points, known or traced.
    pub(super) fn light_from_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        for (i, point) in lit.iter().enumerate() {
            if let Some(light) = source.known(s, lit, i) {
                if source.places(i).any(|(at, _)| s.exact(at) != 0.0) {
                    s.groups.note_lit(i);
                }
                pixels.add(point.place.pixel, point.place.sample, point.weight * light);
            }
        }
        let wanted = |s: &ShadowScratch, i: usize| {
            let first = lit[i].place.sample.wrapping_mul(source.samples);
            source.known(s, lit, i).is_none().then_some((first, source.samples as usize))
        };
        self.cast_to_environment(source, lit, pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.environment.found);
        for found in &found {
            let i = found.point as usize;
            let point = &lit[i];
            let light = point.weight * source.unshadowed(point) * found.ratio();
            pixels.add(point.place.pixel, point.place.sample, light);
            for (channel, (at, tint)) in source.channels.clone().zip(source.places(i)) {
                let (open, all) = (part(found.open, tint), part(found.all, tint));
                if s.exact(at) != 0.0 && all > 0.0 {
                    s.groups.note_lit(i);
                    s.groups.add(i, channel, source.all_channels, open, all);
                }
            }
        }
        s.environment.found = found;
    }

    /// Casts rays to the environment: from each of the `lit` points the samples from the first number that `wanted` says on, and as
    /// many. Leaves what they found, of points that cast any.
    fn cast_to_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
        wanted: impl Fn(&ShadowScratch, usize) -> Option<(u32, usize)>,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let mut own = std::mem::take(&mut s.environment);
        own.found.clear();
        let mut traced = 0;
        s.clear();
        for (i, point) in lit.iter().enumerate() {
            let wanted = wanted(s, i).filter(|(_, count)| *count > 0);
            let is_lit = || source.light.unshadowed(point.n) != Rgb::ZERO;
            if let Some((first, count)) = wanted.filter(|_| is_lit()) {
                own.u.resize(count, [0.0; 2]);
                self.fill(&point.place, source.number, first, pixels, &mut own.u);
                let before = s.ray_count();
                let all = self.rays_to_environment(source, (lit, i), &own.u, s);
                let rays = (s.ray_count() - before) as u32;
                own.found.push(FoundSky { point: i as u32, rays, open: Rgb::ZERO, all });
                s.close();
            }
            if s.ray_count() >= BATCH || i + 1 == lit.len() {
                counts[RayKind::ShadowSky] += s.ray_count() as u64;
                self.trace_through(s, counts);
                let found = own.found[traced..].iter_mut().zip(s.highlights());
                found.for_each(|(found, open)| found.open = open);
                traced = own.found.len();
                s.clear();
            }
        }
        own.found.retain(|found| found.all != Rgb::ZERO);
        s.environment = own;
    }

    /// Pushes the rays of the samples `u` at shading point `i`; what they would find if nothing were in the way.
    fn rays_to_environment(
        &self,
        source: &EnvironmentSource,
        (lit, i): (&[ShadingPoint], usize),
        u: &[[f32; 2]],
        s: &mut ShadowScratch,
    ) -> Rgb {
        let starts = s.starts(self, lit, i as u32);
        let n = lit[i].n;
        let view = source.light.seen_from(n);
        let mut all = Rgb::ZERO;
        let mut push = |sample: super::light::EnvironmentSample| {
            let weight = sample.radiance * (sample.wi.dot(n) / sample.density) as f32;
            all += weight;
            s.push_highlight(starts.ray_to(&ShadowTarget::Sky(sample.wi)), weight);
        };
        let mut is_above = false;
        for u in u.iter().map(|u| u.map(f64::from)) {
            let sample = view.sample_li(u);
            if sample.wi.dot(n) > 0.0 {
                is_above = true;
                push(sample);
            }
        }
        // All samples went to what is bright below the horizon.
        if let (false, Some(first)) = (is_above, u.first()) {
            push(view.by_cosine(first.map(f64::from)));
        }
        all
    }

    /// Adds what glossy `points` reflect of the environment along samples by importance. The rest is seen by the lobes' rays.
    pub(super) fn highlight_environment(
        &self,
        (source, backdrop): (&EnvironmentSource, &Backdrop),
        points: &[GlossyPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = source.samples as usize;
        let mut u = s.samples(n);
        for group in points.chunks((BATCH / n.max(1)).max(1)) {
            s.clear();
            for point in group {
                let first = point.place.sample.wrapping_mul(source.samples);
                self.fill(&point.place, source.number, first, pixels, &mut u);
                for u in u.iter().map(|u| u.map(f64::from)) {
                    let Some(sample) = source.light.sample_li(u) else { break };
                    let GlossyPoint { lobe, n, ng, wo, starts, .. } = point;
                    // The lobe's rays below the facet are mirrored and count whole.
                    if sample.wi.dot(*ng) <= 0.0 {
                        continue;
                    }
                    let density = sample.density * f64::from(source.samples);
                    // The balance heuristic, by which the lobe's rays count the rest.
                    let joined = density + lobe.pdf(*wo, sample.wi);
                    let weight = sample.wi.dot(*n).max(0.0) / joined;
                    let light = backdrop.radiance(sample.wi, 0.0);
                    let seen = lobe.f(*wo, sample.wi) * light * weight as f32;
                    if seen != Rgb::ZERO {
                        let target = ShadowTarget::Sky(sample.wi);
                        s.push_highlight(starts.ray_to(&target), seen);
                    }
                }
                s.close();
            }
            counts[RayKind::ShadowSky] += s.ray_count() as u64;
            self.trace_rays(s, counts);
            for (point, seen) in group.iter().zip(s.highlights()) {
                pixels.add(point.place.pixel, point.place.sample, point.throughput * seen);
            }
        }
        s.give_back(u);
    }
}

#[cfg(test)]
mod tests;
