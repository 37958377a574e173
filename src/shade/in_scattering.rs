//! What fog scatters towards the camera: light that is scattered once.
//!
//! Along each stretch of a path in fog, points are drawn for each light (`fog/distance.rs`), and a sample of the light from
//! there. In a scene whose lights are selected, samples choose groups of lights by what each would scatter if nothing
//! were in the way and fog took nothing, and lights within them by power (`fog/light_tree.rs`).

use super::direct::{BATCH, ShadowScratch};
use super::fog::{Distances, FarLight, FogSamples, FogSegment, LightTree, phase};
use super::light::{LightSample, SampleSink, ShadowTarget};
use super::pixels::BlockPixels;
use super::source::LightSource;
use super::{FrameInput, Renderer};
use crate::intersect::SpawnPoint;
use crate::math::{DVec3, Rgb};
use crate::scene::{FEW_LIGHTS, Fog, Scene};
use crate::stats::{RayCounts, RayKind};

/// The fog of a frame.
pub(super) struct FogInput<'a> {
    fog: &'a Fog,
    /// The frame's lights as they are seen from afar, without the sky.
    lights: Vec<FarLight>,
    tree: LightTree,
}

impl<'a> FogInput<'a> {
    pub fn of(fog: &'a Fog, scene: &Scene, sources: &[LightSource]) -> Self {
        let far = |source: &LightSource| {
            let mean = f64::from(source.sampler.emission.abs().element_sum()) / 3.0;
            FarLight::new(scene.lights[source.number as usize].far_field(), mean)
        };
        let sources = sources.iter().filter(|source| !source.is_sky());
        let lights: Vec<FarLight> = sources.map(far).collect();
        Self { fog, tree: LightTree::new(&lights), lights }
    }
}

/// The ray of one sample.
struct ScatterRay<'s> {
    renderer: &'s Renderer<'s>,
    fog: &'s FogInput<'s>,
    source: &'s LightSource,
    segment: &'s FogSegment,
    p: DVec3,
    /// Part of the radiance at `p` that reaches the start of the segment for each unit of length, over the sample's density.
    weight: f64,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for ScatterRay<'_> {
    fn push(&mut self, sample: LightSample) {
        let sampler = &self.source.sampler;
        let arriving = match sample.pdf.per_steradian() {
            // Towards the light.
            None => sampler.unshadowed(self.p, sample.wi),
            Some(density) => sample.radiance / density,
        };
        let cos = sample.wi.dot(self.segment.dir);
        let scattered = arriving * phase::density(self.fog.fog.anisotropy, cos) * self.weight;
        let seen = self.fog.fog.albedo * sampler.emission * scattered as f32;
        self.renderer.push_scattered(self.p, &sample.target, seen, self.scratch);
    }
}

impl Renderer<'_> {
    /// Adds what fog scatters along `segments` to their pixels.
    pub(super) fn light_fog(
        &self,
        input: &FrameInput,
        segments: &[FogSegment],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let Some(fog) = &input.fog else { return };
        if self.plan.ambient {
            let ambient = self.scene.sky.ambient * fog.fog.albedo;
            for FogSegment { throughput, length, place, .. } in segments {
                let lost = 1.0 - fog.fog.after(*length);
                pixels.add(place.pixel, place.sample, *throughput * ambient * lost as f32);
            }
        }
        if self.settings.fog_samples == 0 {
            return;
        }
        let mut own = std::mem::take(&mut s.fog);
        let mut traced = 0;
        s.clear();
        for (i, segment) in segments.iter().enumerate() {
            match &input.selection {
                None => self.scatter_all((input, fog), segment, pixels, &mut own, s),
                Some(_) => self.scatter_chosen((input, fog), segment, pixels, &mut own, s),
            }
            self.scatter_sky((input, fog), segment, pixels, &mut own, s);
            s.close();
            if s.ray_count() >= BATCH || i + 1 == segments.len() {
                counts[RayKind::ShadowFog] += s.ray_count() as u64;
                self.trace_through(s, counts);
                let found = segments[traced..=i].iter().zip(s.highlights());
                for (FogSegment { throughput, place, .. }, seen) in found {
                    pixels.add(place.pixel, place.sample, *throughput * seen);
                }
                traced = i + 1;
                s.clear();
            }
        }
        s.fog = own;
    }

    /// Samples of every light but the sky.
    fn scatter_all(
        &self,
        (input, fog): (&FrameInput, &FogInput),
        segment: &FogSegment,
        pixels: &BlockPixels,
        own: &mut FogSamples,
        s: &mut ShadowScratch,
    ) {
        let n = self.settings.fog_samples;
        let arrives = |far: &FarLight| fog.fog.bounds.is_some() || far.is_near();
        let lights = input.lights.iter().zip(&fog.lights);
        for (source, far) in lights.filter(|(_, far)| arrives(far)) {
            let distances = far.distances(fog.fog.extinction, segment);
            self.fill_pairs(segment, source.number, n, pixels, own);
            for (u, place) in own.distances.iter().zip(&own.places) {
                let sample = (u.map(f64::from), *place, f64::from(n));
                self.scatter((fog, source), segment, &distances, sample, s);
            }
        }
    }

    /// Samples that choose lights.
    fn scatter_chosen(
        &self,
        (input, fog): (&FrameInput, &FogInput),
        segment: &FogSegment,
        pixels: &BlockPixels,
        own: &mut FogSamples,
        s: &mut ShadowScratch,
    ) {
        fog.tree.look(fog.fog.extinction, segment, &mut own.balls);
        let n = self.settings.fog_samples * FEW_LIGHTS as u32;
        self.fill_pairs(segment, 0, n, pixels, own);
        own.choices.resize(n as usize, [0.0; 2]);
        let first = segment.place.sample.wrapping_mul(n);
        let number = self.fog_dimension(1);
        self.fill(&segment.place, number, first, pixels, &mut own.choices);
        for ((u, place), choice) in own.distances.iter().zip(&own.places).zip(&own.choices) {
            let Some((at, share)) = fog.tree.choose(&own.balls, choice.map(f64::from)) else {
                continue;
            };
            let distances = fog.lights[at].distances(fog.fog.extinction, segment);
            let sample = (u.map(f64::from), *place, f64::from(n) * share);
            self.scatter((fog, &input.lights[at]), segment, &distances, sample, s);
        }
    }

    /// Samples of the sky: of one colour along the directions in which fog scatters, else along those and by importance.
    fn scatter_sky(
        &self,
        (input, fog): (&FrameInput, &FogInput),
        segment: &FogSegment,
        pixels: &BlockPixels,
        own: &mut FogSamples,
        s: &mut ShadowScratch,
    ) {
        let sky = input.lights.iter().find(|source| source.is_sky());
        if fog.fog.bounds.is_none() || (sky.is_none() && input.environment.is_none()) {
            return;
        }
        let n = self.settings.fog_samples;
        self.fill_pairs(segment, self.scene.lights.len() as u32, n, pixels, own);
        let distances = Distances::new(fog.fog.extinction, segment.length);
        let part = (1.0 - fog.fog.after(segment.length)) / f64::from(n);
        for (u, place) in own.distances.iter().zip(&own.places) {
            let ([u, strategy], place) = (u.map(f64::from), place.map(f64::from));
            let p = segment.at(distances.sample(u, 1.0).0);
            let (wi, light) = match (sky, &input.environment) {
                (Some(sky), _) => {
                    (phase::sample(fog.fog.anisotropy, segment.dir, place), sky.sampler.emission)
                }
                (None, Some(environment)) => {
                    environment.scattered((fog.fog.anisotropy, segment.dir), strategy, place)
                }
                (None, None) => return,
            };
            let seen = fog.fog.albedo * light * part as f32;
            self.push_scattered(p, &ShadowTarget::Sky(wi), seen, s);
        }
    }

    /// Pushes the ray of one sample of a light: where on the stretch, where on the light, and how many of these are expected.
    fn scatter(
        &self,
        (fog, source): (&FogInput, &LightSource),
        segment: &FogSegment,
        distances: &Distances,
        ([u, strategy], place, count): ([f64; 2], [f32; 2], f64),
        scratch: &mut ShadowScratch,
    ) {
        let (distance, pdf) = distances.sample(u, strategy);
        let p = segment.at(distance);
        let weight = fog.fog.extinction * fog.fog.after(distance) / (pdf * count);
        if weight.is_finite() && weight > 0.0 && source.sampler.reaches(p) {
            if let Some(view) = source.sampler.seen_from(p, DVec3::Z) {
                let renderer = self;
                let mut ray = ScatterRay { renderer, fog, source, segment, p, weight, scratch };
                view.sample_li(p, &[place], &mut ray);
            }
        }
    }

    fn push_scattered(
        &self,
        p: DVec3,
        target: &ShadowTarget,
        seen: Rgb,
        scratch: &mut ShadowScratch,
    ) {
        if seen == Rgb::ZERO {
            return;
        }
        let start = SpawnPoint::in_space(p, self.settings.rules.spawn_offset);
        let ray = match target {
            ShadowTarget::Point(end) => start.to(end),
            ShadowTarget::Direction(dir) | ShadowTarget::Sky(dir) => start.along(*dir),
        };
        scratch.push_highlight(ray, seen);
    }

    /// Draws where on the stretch, and where on the light of this number, `n` samples lie.
    fn fill_pairs(
        &self,
        segment: &FogSegment,
        light: u32,
        n: u32,
        pixels: &BlockPixels,
        own: &mut FogSamples,
    ) {
        let first = segment.place.sample.wrapping_mul(n);
        for (out, which) in [(&mut own.distances, 2 * light), (&mut own.places, 2 * light + 1)] {
            out.resize(n as usize, [0.0; 2]);
            self.fill(&segment.place, self.fog_dimension(which), first, pixels, out);
        }
    }

    /// The number, beside those of lights, that stands for samples in fog number `which`.
    fn fog_dimension(&self, which: u32) -> u32 {
        self.scene.lights.len() as u32 + 1 + which
    }
}
