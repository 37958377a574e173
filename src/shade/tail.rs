//! The light of a cell's tail: lights that send little each, of which samples choose some.
//!
//! A sample chooses a light with the probability that the cell gives it, and a point of that light. What arrives
//! from there over the probability is on average what arrives from the whole tail. No ratio of it is kept for other
//! frames: every point traces its own.

use super::direct::{BATCH, ShadowScratch, ShadowStarts};
use super::light::{LightSample, SampleSink};
use super::pixels::BlockPixels;
use super::point::{SamplePlace, ShadingPoint};
use super::selection::{Choice, LightSelection, TailSamples};
use super::source::LightSource;
use super::{FrameInput, Renderer, dimensions};
use crate::math::Rgb;
use crate::scene::Tail;
use crate::stats::RayCounts;

/// The shadow ray of one sample.
struct TailRay<'s> {
    point: &'s ShadingPoint,
    source: &'s LightSource,
    starts: ShadowStarts,
    /// Irradiance without shadows, which a delta light sends from its one direction.
    exact: f64,
    count: f64,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for TailRay<'_> {
    fn push(&mut self, sample: LightSample) {
        let irradiance = sample.pdf.per_steradian().map_or(self.exact, |density| {
            sample.radiance * sample.wi.dot(self.point.n).max(0.0) / density
        });
        let light = self.source.sampler.emission * (irradiance / self.count) as f32;
        let seen = self.point.weight * light;
        if seen != Rgb::ZERO {
            self.scratch.push_highlight(self.starts.ray_to(&sample.target), seen);
        }
    }
}

impl Renderer<'_> {
    /// Draws the random numbers of `tail` at a point.
    pub(super) fn draw_tail(
        &self,
        place: &SamplePlace,
        (tail, selection): (&Tail, &LightSelection),
        pixels: &BlockPixels,
        samples: &mut TailSamples,
    ) {
        let count = tail.samples(selection.samples) as usize;
        let stride = Tail::most_samples(selection.samples).next_power_of_two();
        let first = place.sample.wrapping_mul(stride);
        let sampler = pixels.sampler(place.pixel);
        let of = dimensions::of_tail(place.branch, self.light_dimensions());
        for (out, dimension) in [&mut samples.choices, &mut samples.places].into_iter().zip(of) {
            out.resize(count, [0.0; 2]);
            sampler.fill2(first, dimension, out);
        }
    }

    /// Adds the light of the tails of all `lit` points, which lie in these `cells`.
    pub(super) fn light_tails(
        &self,
        (input, selection): (&FrameInput, &LightSelection),
        (lit, cells): (&[ShadingPoint], &[u32]),
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let mut samples = std::mem::take(&mut s.tail);
        let mut first = 0;
        s.clear();
        for (i, (point, cell)) in (0..).zip(lit.iter().zip(cells)) {
            let tail = selection.of_diffuse(*cell).tail();
            if !tail.is_empty() {
                self.draw_tail(&point.place, (&tail, selection), pixels, &mut samples);
                for choice in samples.choices(tail, selection) {
                    let chosen = choice.source.map(|at| &input.lights[at]);
                    chosen
                        .iter()
                        .for_each(|source| self.tail_ray(source, (lit, i), &choice, s, counts));
                }
            }
            s.close();
            if s.ray_count() >= BATCH || i as usize + 1 == lit.len() {
                self.trace_rays(s, counts);
                for (point, seen) in lit[first..].iter().zip(s.highlights()) {
                    pixels.add(point.place.pixel, point.place.sample, seen);
                }
                first = i as usize + 1;
                s.clear();
            }
        }
        s.tail = samples;
    }

    /// Pushes the ray of a sample at shading point `i` that has chosen `source`.
    fn tail_ray(
        &self,
        source: &LightSource,
        (lit, i): (&[ShadingPoint], u32),
        choice: &Choice,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let point = &lit[i as usize];
        let exact = source.sampler.unshadowed(point.si.p, point.n);
        if exact == 0.0 {
            return;
        }
        let Some(view) = source.sampler.seen_from(point.si.p, point.n) else { return };
        let (before, starts) = (s.ray_count(), s.starts(self, lit, i));
        let count = choice.count;
        let mut ray = TailRay { point, source, starts, exact, count, scratch: s };
        view.sample_li(point.si.p, &[choice.place], &mut ray);
        counts[source.rays] += (s.ray_count() - before) as u64;
    }
}
