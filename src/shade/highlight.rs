//! Lights as glossy surfaces reflect them.
//!
//! What a lobe with an extent reflects of a light is estimated twice: by shadow rays to points of the light,
//! here, and by the rays that follow the lobe's directions and may end on the light. Multiple importance
//! sampling with the balance heuristic joins the two (Veach and Guibas, 1995). It depends on the view, so that nothing
//! is kept for other frames. Where lights are selected, the heuristic counts the mean number of samples that choose a
//! light.

use super::direct::{BATCH, ShadowScratch, ShadowStarts};
use super::light::{LightSample, SampleSink};
use super::lobe::Lobe;
use super::pixels::BlockPixels;
use super::point::SamplePlace;
use super::selection::{Choice, LightSelection, LightUser};
use super::source::LightSource;
use super::{FrameInput, Renderer};
use crate::math::{DVec3, Rgb};
use crate::stats::RayCounts;

/// A point of a surface with a lobe that lights are reflected by.
pub(super) struct GlossyPoint {
    pub lobe: Lobe,
    /// Scene space.
    pub p: DVec3,
    /// The lobe's normal, unit, on the side that light comes from: the viewer's, but for light through the surface.
    pub n: DVec3,
    /// Unit geometric normal on the same side.
    pub ng: DVec3,
    /// Unit direction to the viewer.
    pub wo: DVec3,
    pub starts: ShadowStarts,
    /// Radiance that reaches the camera per unit that leaves towards the viewer.
    pub throughput: Rgb,
    pub place: SamplePlace,
}

/// Shadow rays of one glossy point to one light.
struct HighlightRays<'s> {
    point: &'s GlossyPoint,
    source: &'s LightSource,
    /// Unshadowed irradiance, which a delta light sends from its one direction.
    exact: f64,
    /// Samples of the light: where samples choose lights, the mean number that choose this one.
    count: f64,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for HighlightRays<'_> {
    fn push(&mut self, sample: LightSample) {
        let GlossyPoint { lobe, n, ng, wo, starts, .. } = self.point;
        let wi = sample.wi;
        // The lobe's rays below the facet are mirrored and count whole.
        if wi.dot(*ng) <= 0.0 {
            return;
        }
        let count = self.count;
        let irradiance = sample.pdf.per_steradian().map_or(self.exact / count, |density| {
            let share = self.source.share(density, count, lobe.pdf(*wo, wi));
            sample.radiance * wi.dot(*n).max(0.0) / (density * count) * share
        });
        let seen = lobe.f(*wo, wi) * irradiance as f32;
        if seen != Rgb::ZERO {
            self.scratch.push_highlight(starts.ray_to(&sample.target), seen);
        }
    }
}

impl LightSource {
    /// The part of a light that its own samples, `count` of density `light`, see, where rays of density `lobe` may
    /// end on it too.
    fn share(&self, light: f64, count: f64, lobe: f64) -> f64 {
        if !self.sampler.is_seen() {
            return 1.0;
        }
        // A face that sends the light of others counts as if its samples lay on all of them, lest narrow lobes show it alone.
        let light = light / self.sampler.stands_for();
        // In this form for a light seen in its own plane, whose density is infinite.
        1.0 / (1.0 + lobe / (light * count))
    }
}

impl Renderer<'_> {
    /// The part of the emission at the point `p` of the light with number `light` that a ray counts which was
    /// sent from `org`, of a surface point in `cell`, by a lobe with density `lobe`.
    pub(super) fn share_of_lobe(
        &self,
        input: &FrameInput,
        light: Option<u32>,
        (org, p): (DVec3, DVec3),
        (lobe, cell): (f64, u32),
    ) -> f32 {
        let source = match &input.selection {
            Some(selection) => {
                light.and_then(|light| selection.source(light)).map(|at| &input.lights[at])
            }
            None => input.lights.iter().find(|source| Some(source.number) == light),
        };
        let density = source.and_then(|source| {
            let view = source.sampler.seen_from(org, DVec3::Z)?;
            let count = input.selection.as_ref().map_or(f64::from(source.samples), |selection| {
                selection.samples_of(cell, source.number, source.samples)
            });
            // Where no sample chooses it, the lobe's rays see all of it.
            (count > 0.0).then_some(())?;
            Some(source.share(view.pdf_li(org, p)?, count, lobe))
        });
        (1.0 - density.unwrap_or(0.0)) as f32
    }

    /// Adds the lights that glossy `points` reflect to their pixels. A sky of one colour is seen by the lobes' own rays.
    pub(super) fn light_highlights(
        &self,
        input: &FrameInput,
        points: &[GlossyPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        if let (Some(source), Some(backdrop)) = (&input.environment, &input.backdrop) {
            self.highlight_environment((source, backdrop), points, pixels, s, counts);
        }
        let mut users = std::mem::take(&mut s.users);
        if let Some(selection) = &input.selection {
            let places = points.iter().map(|point| point.p);
            users.find(selection, &input.lights, places, |c| selection.of_glossy(c), |_, _| None);
        }
        let lights = input.lights.iter().enumerate().filter(|(_, source)| !source.is_sky());
        for (at, source) in lights {
            let reached = input.reached(at, points.len(), &users);
            let n = source.samples as usize;
            let mut u = s.samples(n);
            let together = (BATCH / n).max(1);
            for first in (0..reached.len()).step_by(together) {
                s.clear();
                let group = || {
                    let users =
                        (first..reached.len().min(first + together)).map(|k| reached.get(k));
                    users.map(|LightUser { point, .. }| &points[point as usize])
                };
                for point in group() {
                    let draw = |u: &mut [[f32; 2]]| {
                        let first = point.place.sample.wrapping_mul(source.samples);
                        self.fill(&point.place, source.number, first, pixels, u);
                    };
                    self.highlight_rays(source, point, n as f64, &mut u, draw, s);
                    s.close();
                }
                self.trace_shadow_rays(source, s, counts);
                // All else that lies behind glass the lobe's rays see, lit by the lobes of rough glass too.
                if self.plan.glass_shadows && !source.sampler.is_seen() {
                    (0..s.ray_count()).for_each(|k| self.follow(k, true, s, counts));
                }
                for (point, seen) in group().zip(s.highlights()) {
                    let light = point.throughput * source.sampler.emission * seen;
                    pixels.add(point.place.pixel, point.place.sample, light);
                }
            }
            s.give_back(u);
        }
        if let Some(selection) = &input.selection {
            let glossy = (points, &users.cells[..]);
            self.highlight_tails((input, selection), glossy, pixels, s, counts);
        }
        s.users = users;
    }

    /// Pushes the rays of the samples `u`, which `draw` draws, of a light, `count` of which are expected, at a glossy
    /// point.
    fn highlight_rays(
        &self,
        source: &LightSource,
        point: &GlossyPoint,
        count: f64,
        u: &mut [[f32; 2]],
        draw: impl FnOnce(&mut [[f32; 2]]),
        scratch: &mut ShadowScratch,
    ) {
        let exact = source.sampler.unshadowed(point.p, point.n);
        let seen = match exact {
            0.0 => None,
            _ => source.sampler.seen_from(point.p, point.n),
        };
        if let Some(view) = &seen {
            draw(u);
            let mut rays = HighlightRays { point, source, exact, count, scratch };
            view.sample_li(point.p, u, &mut rays);
        }
    }

    /// Adds what glossy `points`, which lie in these `cells`, reflect of the lights of their tails.
    fn highlight_tails(
        &self,
        (input, selection): (&FrameInput, &LightSelection),
        (points, cells): (&[GlossyPoint], &[u32]),
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let mut samples = std::mem::take(&mut s.tail);
        let mut unseen = std::mem::take(&mut s.unseen);
        for (point, cell) in points.iter().zip(cells) {
            let tail = selection.of_glossy(*cell).tail();
            if tail.is_empty() {
                continue;
            }
            self.draw_tail(&point.place, (&tail, selection), pixels, &mut samples);
            s.clear();
            unseen.clear();
            for Choice { source, count, place } in samples.choices(tail, selection) {
                let Some(source) = source.map(|at| &input.lights[at]) else { continue };
                let before = s.ray_count();
                self.highlight_rays(source, point, count, &mut [place], |_| (), s);
                s.tint_from(before, source.sampler.emission);
                counts[source.rays] += (s.ray_count() - before) as u64;
                if self.plan.glass_shadows && !source.sampler.is_seen() {
                    unseen.extend(before..s.ray_count());
                }
            }
            s.close();
            self.trace_rays(s, counts);
            unseen.iter().for_each(|k| self.follow(*k, true, s, counts));
            let seen: Rgb = s.highlights().sum();
            pixels.add(point.place.pixel, point.place.sample, point.throughput * seen);
        }
        s.tail = samples;
        s.unseen = unseen;
    }
}
