//! The light of a cell's tail: lights that send little each, of which samples choose some.
//!
//! A sample chooses a light in proportion to what it sends to the point ([`super::far_lights`]), and a point of that
//! light. What arrives from there over the probability is on average what arrives from the whole tail. Its ratio to what
//! would arrive without shadows is kept for other frames as that of a light is, in each of a few colours.

use super::direct::{BATCH, ShadowScratch, ShadowStarts};
use super::far_lights::Chosen;
use super::light::{LightSample, SampleSink};
use super::pixels::BlockPixels;
use super::point::{SamplePlace, ShadingPoint};
use super::selection::{FoundLight, LightSelection, TailSamples};
use super::source::LightSource;
use super::{FrameInput, Renderer, Reuse, dimensions};
use crate::math::{Rgb, luminance};
use crate::scene::{Tail, part, tints};
use crate::stats::RayCounts;
use std::ops::Range;

/// The shadow ray of one sample.
struct TailRay<'s> {
    point: &'s ShadingPoint,
    source: &'s LightSource,
    starts: ShadowStarts,
    /// Irradiance without shadows, which a delta light sends from its one direction; of other lights not known.
    exact: f64,
    count: f64,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for TailRay<'_> {
    fn push(&mut self, sample: LightSample) {
        let irradiance = sample.pdf.per_steradian().map_or(self.exact, |density| {
            sample.radiance * sample.wi.dot(self.point.mapped).max(0.0) / density
        });
        let light = self.source.sampler.emission * (irradiance / self.count) as f32;
        if light != Rgb::ZERO {
            self.scratch.push_highlight(self.starts.ray_to(&sample.target), light);
        }
    }
}

/// The channels of the tail's ratios, and the colours that these are of.
#[derive(Clone, Copy)]
struct TailChannels<'a> {
    first: usize,
    tints: &'a [Rgb],
    /// Channels of a point.
    all: usize,
}

impl<'a> TailChannels<'a> {
    /// `None` where no ratio of the tail is kept.
    fn of(reuse: &Reuse, selection: &'a LightSelection) -> Option<Self> {
        let Range { start: first, end } = reuse.channels.tail();
        let tints = tints(selection.tints(), end - first);
        (!tints.is_empty()).then_some(Self { first, tints, all: reuse.channels.len() })
    }

    fn range(&self) -> Range<usize> {
        self.first..self.first + self.tints.len()
    }

    /// What arrives at shading point `i` if that is known, as it is where nothing can arrive.
    fn known(self, s: &ShadowScratch, lit: &[ShadingPoint], i: usize) -> Option<Rgb> {
        let is_kept = !lit[i].is_mapped();
        is_kept.then(|| s.known_parts((lit, i), self.range(), self.tints)).flatten()
    }

    /// The places of a shading point's channels among those of all, with their colours.
    fn places(self, i: usize) -> impl Iterator<Item = (usize, Rgb)> + 'a {
        let first = i * self.all + self.first;
        (first..).zip(self.tints.iter().copied())
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
        let first = place.sample.wrapping_mul(samples_apart(selection));
        self.draw_tail_from(place, (first, count), pixels, samples);
    }

    fn draw_tail_from(
        &self,
        place: &SamplePlace,
        (first, count): (u32, usize),
        pixels: &BlockPixels,
        samples: &mut TailSamples,
    ) {
        let sampler = pixels.sampler(place.pixel);
        let of = dimensions::of_tail(place.branch, self.light_dimensions());
        for (out, dimension) in [&mut samples.choices, &mut samples.places].into_iter().zip(of) {
            out.resize(count, [0.0; 2]);
            sampler.fill2(first, dimension, out);
        }
    }

    /// Looks at the tails of all `lit` points, which lie in these `cells`.
    pub(super) fn look_at_tails(
        &self,
        selection: &LightSelection,
        (lit, cells): (&[ShadingPoint], &[u32]),
        s: &mut ShadowScratch,
    ) {
        s.tail.seen.clear();
        for (point, cell) in lit.iter().zip(cells) {
            let tail = selection.of_diffuse(*cell).tail();
            s.tail.seen.look(&tail, &selection.far, (point.si.p, point.mapped));
        }
    }

    /// Notes what of the tails, which were looked at, would arrive at all `lit` points if nothing were in the way.
    pub(super) fn tails_without_shadows(
        &self,
        (selection, reuse): (&LightSelection, &Reuse),
        (lit, cells): (&[ShadingPoint], &[u32]),
        s: &mut ShadowScratch,
    ) {
        let Some(channels) = TailChannels::of(reuse, selection) else { return };
        for (i, (point, cell)) in lit.iter().zip(cells).enumerate() {
            s.groups.note_tail(i, selection.tail_set(*cell), channels.range());
            // The part that arrives of the tail's lights depends on which of them the normal favours, so that of one mapped
            // normal says nothing of another one.
            if point.is_mapped() {
                continue;
            }
            let sent = s.tail.seen.of(i).sent();
            for (at, tint) in channels.places(i) {
                let exact = part(sent, tint);
                let shown = luminance(point.weight * tint) * exact as f32;
                s.note_exact(at, exact, shown * self.settings.exposure);
            }
        }
    }

    /// Casts the check rays of the tails that the inference wants.
    pub(super) fn check_tails(
        &self,
        (input, selection, reuse): (&FrameInput, &LightSelection, &Reuse),
        (lit, cells): (&[ShadingPoint], &[u32]),
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let Some(channels) = TailChannels::of(reuse, selection) else { return };
        // Samples that tracing does not use.
        let traced = self.settings.most_camera_samples().wrapping_mul(samples_apart(selection));
        let wanted = |s: &ShadowScratch, i: usize, tail: &Tail| {
            let rays = tail.samples(selection.samples);
            let wanted = s.groups.check_rays(i, channels.range(), channels.all, rays)?;
            let is_sent = channels.places(i).any(|(at, _)| s.exact(at) != 0.0);
            let first = traced.wrapping_add(wanted.first).wrapping_add(wanted.own.start as u32);
            is_sent.then_some((first, wanted.own.len()))
        };
        self.cast_tails((input, selection), (lit, cells), pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.tail.found);
        for &FoundLight { point: i, rays, irradiance } in &found {
            let weight = f64::from(rays);
            for (k, (at, tint)) in channels.places(i as usize).enumerate() {
                let exact = s.exact(at);
                let of_light = (weight * part(irradiance, tint), weight * exact);
                if exact != 0.0 {
                    let channel = (channels.first + k, channels.all);
                    s.groups.note_checked(i as usize, channel, of_light, rays as usize);
                }
            }
        }
        s.tail.found = found;
    }

    /// Adds the light of the tails of all `lit` points, which lie in these `cells`: known or traced.
    pub(super) fn light_tails(
        &self,
        (input, selection): (&FrameInput, &LightSelection),
        (lit, cells): (&[ShadingPoint], &[u32]),
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let channels = input.reuse.as_ref().and_then(|reuse| TailChannels::of(reuse, selection));
        if let Some(channels) = channels {
            for (i, point) in lit.iter().enumerate() {
                if let Some(light) = channels.known(s, lit, i) {
                    if channels.places(i).any(|(at, _)| s.exact(at) != 0.0) {
                        s.groups.note_lit(i);
                    }
                    pixels.add(point.place.pixel, point.place.sample, point.weight * light);
                }
            }
        }
        let wanted = |s: &ShadowScratch, i: usize, tail: &Tail| {
            let is_known = channels.is_some_and(|channels| channels.known(s, lit, i).is_some());
            let first = lit[i].place.sample.wrapping_mul(samples_apart(selection));
            (!is_known).then(|| (first, tail.samples(selection.samples) as usize))
        };
        self.cast_tails((input, selection), (lit, cells), pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.tail.found);
        for &FoundLight { point: i, irradiance, .. } in &found {
            let ShadingPoint { place, weight, .. } = &lit[i as usize];
            pixels.add(place.pixel, place.sample, *weight * irradiance);
            let Some(channels) = channels else { continue };
            for (k, (at, tint)) in channels.places(i as usize).enumerate() {
                let (open, all) = (part(irradiance, tint), s.exact(at));
                if all != 0.0 {
                    s.groups.note_lit(i as usize);
                    s.groups.add(i as usize, channels.first + k, channels.all, open, all);
                }
            }
        }
        s.tail.found = found;
    }

    /// Casts samples of the tails: of each of the `lit` points, which lie in these `cells`, from the first number that
    /// `wanted` says on, and as many. Leaves what they found.
    fn cast_tails(
        &self,
        (input, selection): (&FrameInput, &LightSelection),
        (lit, cells): (&[ShadingPoint], &[u32]),
        pixels: &BlockPixels,
        wanted: impl Fn(&ShadowScratch, usize, &Tail) -> Option<(u32, usize)>,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let mut samples = std::mem::take(&mut s.tail);
        samples.found.clear();
        let mut first = 0;
        s.clear();
        for (i, (point, cell)) in lit.iter().zip(cells).enumerate() {
            let tail = selection.of_diffuse(*cell).tail();
            let is_dark = tail.is_empty() || samples.seen.of(i).is_dark();
            let wanted = if is_dark { None } else { wanted(s, i, &tail) };
            if let Some(run) = wanted.filter(|(_, count)| *count > 0) {
                self.draw_tail_from(&point.place, run, pixels, &mut samples);
                self.tail_rays((input, selection), (lit, i as u32), (&tail, &samples), s, counts);
                let (point, rays) = (i as u32, run.1 as u32);
                samples.found.push(FoundLight { point, rays, irradiance: Rgb::ZERO });
                s.close();
            }
            if s.ray_count() >= BATCH || i + 1 == lit.len() {
                self.trace_through(s, counts);
                let found = samples.found[first..].iter_mut().zip(s.highlights());
                found.for_each(|(found, irradiance)| found.irradiance = irradiance);
                first = samples.found.len();
                s.clear();
            }
        }
        s.tail = samples;
    }

    /// Pushes the rays of the samples that were drawn at shading point `i`, whose `tail` was looked at.
    fn tail_rays(
        &self,
        (input, selection): (&FrameInput, &LightSelection),
        (lit, i): (&[ShadingPoint], u32),
        (tail, samples): (&Tail, &TailSamples),
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let point = &lit[i as usize];
        let starts = s.starts(self, lit, i);
        let (all, seen) = (samples.choices.len() as f64, samples.seen.of(i as usize));
        for (choice, place) in samples.choices.iter().zip(&samples.places) {
            let Chosen { light, probability, is_looked_at } =
                seen.choose(tail, f64::from(choice[0]));
            let Some(source) = selection.source(light).map(|at| &input.lights[at]) else {
                continue;
            };
            // A light that was not looked at may show its back.
            let exact = match is_looked_at && source.is_sampled() {
                true => f64::NAN,
                false => point.unshadowed(&source.sampler),
            };
            if exact == 0.0 {
                continue;
            }
            let Some(view) = source.sampler.seen_from(point.si.p, point.n) else { continue };
            let (before, count) = (s.ray_count(), all * probability);
            let mut ray = TailRay { point, source, starts, exact, count, scratch: s };
            view.sample_li(point.si.p, &[*place], &mut ray);
            counts[source.rays] += (s.ray_count() - before) as u64;
        }
    }
}

/// Numbers between the first samples of successive camera samples.
fn samples_apart(selection: &LightSelection) -> u32 {
    Tail::most_samples(selection.samples).next_power_of_two()
}
