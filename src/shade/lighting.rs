//! Direct light at diffuse points: shadow rays in batches, light by light.
//!
//! For an area light the estimate is `ratio · exact`: the samples' ratio of shadowed to
//! unshadowed irradiance times the unshadowed irradiance in closed form. Where nothing is in the
//! way there is no noise at all, and the ratio is what later frames can reuse.

use super::groups::{CheckRays, Groups};
use super::light::{self, AreaLight, LightSample, SeenLight, ShadowTarget};
use super::pixels::BlockPixels;
use super::{FrameInput, Renderer, Reuse};
use crate::inference::{Channel, Channels};
use crate::intersect::{Facet, Hit, Ray, SpawnPoint, SurfaceInteraction, Target, lift_to_smooth};
use crate::math::{DVec3, Rgb, luminance, orthonormal_basis};
use crate::sampling::{cosine_hemisphere, to_world};
use crate::scene::{Light, Scene, Settings};
use crate::stats::RayCounts;
use std::f32::consts::FRAC_1_PI;

/// Shadow rays traced together.
const BATCH: usize = 256;

/// Which camera sample and which branch of its tree a point belongs to.
#[derive(Debug, Clone, Copy)]
pub(super) struct SamplePlace {
    pub pixel: u32,
    pub sample: u32,
    pub branch: u32,
}

/// A diffuse point that waits for light.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShadingPoint {
    pub si: SurfaceInteraction,
    /// What hit it.
    pub ray: Ray,
    hit: Hit,
    /// Geometric normal on the viewer's side.
    ng: DVec3,
    /// Shading normal on the viewer's side.
    pub n: DVec3,
    /// Radiance towards the camera per unit of irradiance.
    weight: Rgb,
    pub place: SamplePlace,
}

impl ShadingPoint {
    /// The point `si` where `ray` hit, seen from `wo`, whose reflected light reaches the camera
    /// times `reflectance`.
    pub fn new(
        (si, ray, hit): (&SurfaceInteraction, &Ray, &Hit),
        wo: DVec3,
        reflectance: Rgb,
        place: SamplePlace,
    ) -> Self {
        let (n, ng) = if si.is_outside(wo) { (si.ns, si.ng) } else { (-si.ns, -si.ng) };
        Self { si: *si, ray: *ray, hit: *hit, ng, n, weight: reflectance * FRAC_1_PI, place }
    }
}

/// Where shadow rays leave a shading point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadowStarts {
    /// Those to the sky: the facet.
    pub facet: SpawnPoint,
    /// Those to lights: the smooth surface that the facet stands for.
    pub smooth: SpawnPoint,
}

impl ShadowStarts {
    /// Those of the point `si` where `ray` hit, on the side of the unit geometric normal `ng`.
    pub fn of(
        scene: &Scene,
        settings: &Settings,
        (si, ray, hit): (&SurfaceInteraction, &Ray, &Hit),
        ng: DVec3,
    ) -> Self {
        let offset = settings.rules.spawn_offset;
        let facet = si.shadow_start(ng, DVec3::ZERO, offset);
        let smooth = if settings.smooth_terminator {
            let outside = ng.dot(si.ng) > 0.0;
            si.shadow_start(ng, lift_to_smooth(scene, ray, hit, si, outside), offset)
        } else {
            facet
        };
        Self { facet, smooth }
    }

    /// The ray from the point `p` to a delta light.
    pub fn ray_to_delta(&self, p: DVec3, target: ShadowTarget) -> Ray {
        match target {
            // No surface to stop short of: the normal along the ray costs a few ulp.
            ShadowTarget::Point(q) => self.smooth.to(&Target {
                point: q,
                normal: (p - q).normalize(),
                facet: Facet::EXACT,
            }),
            ShadowTarget::Direction(d) => self.smooth.along(d),
        }
    }
}

/// Buffers of shadow batches.
#[derive(Default)]
pub(super) struct ShadowScratch {
    rays: Vec<Ray>,
    weights: Vec<f64>,
    occluded: Vec<bool>,
    spans: Vec<Span>,
    u: Vec<[f32; 2]>,
    runs: Runs,
    /// Shading points that the present light must be traced for.
    wanted: Vec<u32>,
    /// Irradiance without shadows, per unit of radiance, for each shading point and kept channel.
    exact: Vec<f64>,
    /// What of it the pixel would show.
    shown: Vec<f32>,
    /// Where the rays of each shading point start, once one has cast any.
    starts: Vec<Option<ShadowStarts>>,
    /// What is known already; unused where nothing is reused.
    pub groups: Groups,
}

/// Samples of one light for the check rays of each surface point.
#[derive(Default)]
struct Runs {
    /// Where each surface point's run starts, once one of its shading points has asked for it.
    starts: Vec<Option<usize>>,
    u: Vec<[f32; 2]>,
}

impl Runs {
    fn start(&mut self, points: usize) {
        self.starts.clear();
        self.starts.resize(points, None);
        self.u.clear();
    }

    /// The samples of a shading point, of its surface point's run, which `fill` makes once.
    fn own(&mut self, wanted: &CheckRays, fill: impl FnOnce(&mut [[f32; 2]])) -> &[[f32; 2]] {
        let start = *self.starts[wanted.point].get_or_insert_with(|| {
            let start = self.u.len();
            self.u.resize(start + wanted.all, [0.0; 2]);
            fill(&mut self.u[start..]);
            start
        });
        &self.u[start..][wanted.own.clone()]
    }
}

/// The shadow rays of one point, and the irradiance they decide on.
struct Span {
    end: usize,
    unshadowed: Rgb,
}

impl ShadowScratch {
    fn clear(&mut self) {
        self.rays.clear();
        self.weights.clear();
        self.spans.clear();
    }

    fn push(&mut self, ray: Ray, weight: f64) {
        self.rays.push(ray);
        self.weights.push(weight);
    }

    /// A shadow ray to the sample, where it lies above the horizon.
    fn push_sample(&mut self, starts: &ShadowStarts, sample: &LightSample) {
        if sample.weight > 0.0 {
            self.push(starts.smooth.to(&sample.target), sample.weight);
        }
    }

    /// Room for `n` samples of a light, to be given back.
    fn samples(&mut self, n: usize) -> Vec<[f32; 2]> {
        let mut u = std::mem::take(&mut self.u);
        u.resize(n, [0.0; 2]);
        u
    }

    /// Whether the present point has no ray yet.
    fn is_open(&self) -> bool {
        self.rays.len() == self.spans.last().map_or(0, |span| span.end)
    }

    /// Ends a point's rays.
    fn close(&mut self, unshadowed: Rgb) {
        self.spans.push(Span { end: self.rays.len(), unshadowed });
    }

    fn starts(&mut self, renderer: &Renderer, lit: &[ShadingPoint], i: u32) -> ShadowStarts {
        let point = &lit[i as usize];
        *self.starts[i as usize].get_or_insert_with(|| {
            let seen = (&point.si, &point.ray, &point.hit);
            ShadowStarts::of(renderer.scene, renderer.settings, seen, point.ng)
        })
    }
}

/// An area light with its place in the scene.
struct AreaSource<'a> {
    index: u32,
    light: &'a Light,
    area: &'a AreaLight,
}

impl Renderer<'_> {
    /// Adds the direct light of all `lit` points to their pixels. What is known about a point is
    /// used; the rest is traced.
    pub(super) fn light_points<const AREA: bool, const SKY: bool>(
        &self,
        input: &FrameInput,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        scratch: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        scratch.starts.clear();
        scratch.starts.resize(lit.len(), None);
        if let Some(reuse) = &input.reuse {
            self.light_without_shadows(input, reuse.channels, lit, scratch);
            let asked = (self.scene, reuse);
            scratch.groups.ask(input, asked, lit, &scratch.shown, pixels);
            if scratch.groups.wants_checks() {
                self.check_answers(input, reuse, lit, pixels, scratch, counts);
            }
        }
        if self.plan.ambient {
            let ambient = self.scene.sky.ambient * std::f32::consts::PI;
            lit.iter().for_each(|p| pixels.add(p.place.pixel, p.place.sample, p.weight * ambient));
        }
        for (index, light) in self.scene.lights.iter().enumerate() {
            match light {
                Light::Quad(_) | Light::Sphere { .. } if AREA => {
                    let area = input.area_lights[index].as_ref();
                    let Some(area) = area else { continue };
                    let source = AreaSource { index: index as u32, light, area };
                    self.area_light(input, &source, lit, pixels, scratch, counts);
                }
                Light::Point { .. } | Light::Directional { .. } if self.plan.delta_lights => {
                    self.delta_light(light, lit, pixels, scratch, counts);
                }
                _ => {}
            }
        }
        if SKY {
            self.sky_light(input, lit, pixels, scratch, counts);
        }
    }

    /// What of the kept lights would arrive if nothing were in the way.
    fn light_without_shadows(
        &self,
        input: &FrameInput,
        channels: &Channels,
        lit: &[ShadingPoint],
        s: &mut ShadowScratch,
    ) {
        s.exact.clear();
        s.shown.clear();
        for point in lit {
            for channel in channels.iter() {
                let (exact, radiance) = match channel {
                    Channel::Area(index) => {
                        let area = input.area_lights[index as usize].as_ref();
                        let exact = area.map_or(0.0, |a| a.irradiance(point.si.p, point.n));
                        (exact, light::radiance(&self.scene.lights[index as usize]))
                    }
                    Channel::Sky => (std::f64::consts::PI, self.scene.sky.radiance),
                };
                s.exact.push(exact);
                let shown = luminance(point.weight * radiance) * exact as f32;
                s.shown.push(shown * self.settings.exposure);
            }
        }
    }

    fn area_light(
        &self,
        input: &FrameInput,
        source: &AreaSource,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = self.settings.shadow_samples as usize;
        let radiance = light::radiance(source.light);
        let channel = input.channel_of(source.index);
        let wanted = self.use_known(lit, channel, radiance, pixels, s);
        let mut u = s.samples(n);
        for group in wanted.chunks((BATCH / n).max(1)) {
            s.clear();
            for &i in group {
                let first = lit[i as usize].place.sample.wrapping_mul(n as u32);
                let exact = match channel {
                    Some((channel, channels)) => s.exact[i as usize * channels + channel],
                    None => source.area.irradiance(lit[i as usize].si.p, lit[i as usize].n),
                };
                let point = &lit[i as usize];
                // What is NaN goes on, to be counted at its pixel.
                let seen = source.area.seen_from(point.si.p).filter(|_| exact != 0.0);
                if let Some(seen) = &seen {
                    self.fill(&point.place, source.index, first, pixels, &mut u);
                    self.rays_to_area(seen, (lit, i), &u, s);
                    if s.is_open() {
                        // All below the horizon, but some of the light is above: a point of that
                        // decides, or the horizon's own shadow would be counted twice.
                        if let Some(sample) = seen.above(point.si.p, point.n) {
                            let starts = s.starts(self, lit, i);
                            s.push_sample(&starts, &sample);
                        }
                    }
                }
                s.close(seen.map_or(Rgb::ZERO, |_| radiance * exact as f32));
            }
            counts.shadow_area += s.rays.len() as u64;
            self.settle(lit, group, channel, pixels, s, counts);
        }
        s.u = u;
        s.wanted = wanted;
    }

    fn delta_light(
        &self,
        light: &Light,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let wanted = all_of(lit, s);
        for group in wanted.chunks(BATCH) {
            s.clear();
            for &i in group {
                let point = &lit[i as usize];
                let sent = light::delta(light, point.si.p, point.n);
                if let Some((_, target)) = sent {
                    let ray = s.starts(self, lit, i).ray_to_delta(point.si.p, target);
                    s.push(ray, 1.0);
                }
                s.close(sent.map_or(Rgb::ZERO, |(irradiance, _)| irradiance));
            }
            counts.shadow_delta += s.rays.len() as u64;
            self.settle(lit, group, None, pixels, s, counts);
        }
        s.wanted = wanted;
    }

    fn sky_light(
        &self,
        input: &FrameInput,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = self.settings.sky_samples as usize;
        // A constant sky of radiance L sends the irradiance πL to an open surface.
        let irradiance = self.scene.sky.radiance * std::f32::consts::PI;
        let channel = input.sky_channel();
        let wanted = self.use_known(lit, channel, self.scene.sky.radiance, pixels, s);
        let light = self.number_of(Channel::Sky);
        let mut u = s.samples(n);
        for group in wanted.chunks((BATCH / n).max(1)) {
            s.clear();
            for &i in group {
                let first = lit[i as usize].place.sample.wrapping_mul(n as u32);
                self.fill(&lit[i as usize].place, light, first, pixels, &mut u);
                self.rays_to_sky((lit, i), &u, s);
                s.close(irradiance);
            }
            counts.shadow_sky += s.rays.len() as u64;
            self.settle(lit, group, channel, pixels, s, counts);
        }
        s.u = u;
        s.wanted = wanted;
    }

    /// Pushes a shadow ray from shading point `i` to each of the samples `u` of an area light, but for those below
    /// the horizon.
    fn rays_to_area(
        &self,
        seen: &SeenLight,
        (lit, i): (&[ShadingPoint], u32),
        u: &[[f32; 2]],
        s: &mut ShadowScratch,
    ) {
        let point = &lit[i as usize];
        let starts = s.starts(self, lit, i);
        for u in u {
            let sample = seen.sample(point.si.p, point.n, u.map(f64::from));
            s.push_sample(&starts, &sample);
        }
    }

    /// Pushes a shadow ray from shading point `i` to each of the samples `u` of the sky.
    fn rays_to_sky(&self, (lit, i): (&[ShadingPoint], u32), u: &[[f32; 2]], s: &mut ShadowScratch) {
        let point = &lit[i as usize];
        let facet = s.starts(self, lit, i).facet;
        let (ng, basis) = (point.ng, orthonormal_basis(point.n));
        for u in u {
            let local = cosine_hemisphere(u.map(f64::from));
            let dir = to_world(local, basis, point.n);
            // Below the facet but above the smooth surface that it stands for: the facet's own plane is
            // no occluder.
            let dir = super::optics::keep_side(dir, ng, true);
            s.push(facet.along(dir), 1.0);
        }
    }

    /// Casts the check rays that the inference wants, and tells it what they found.
    fn check_answers(
        &self,
        input: &FrameInput,
        reuse: &Reuse,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let channels = reuse.channels.len();
        for (at, channel) in reuse.channels.iter().enumerate() {
            let (n, count) = match channel {
                Channel::Area(_) => (self.settings.shadow_samples, &mut counts.shadow_area),
                Channel::Sky => (self.settings.sky_samples, &mut counts.shadow_sky),
            };
            s.clear();
            let mut runs = std::mem::take(&mut s.runs);
            runs.start(s.groups.len());
            for i in 0..lit.len() as u32 {
                let wanted = s.groups.check_rays(i as usize, at, channels, n);
                let wanted = wanted.filter(|_| s.exact[i as usize * channels + at] != 0.0);
                if let Some(wanted) = wanted {
                    let own = runs.own(&wanted, |u| {
                        // Samples that tracing does not use: had it any of these, what is traced
                        // because of them would be darker or brighter than what is.
                        let traced = self.settings.spp.wrapping_mul(n.next_power_of_two());
                        let first = wanted.first.wrapping_add(traced);
                        let place = &lit[i as usize].place;
                        self.fill(place, self.number_of(channel), first, pixels, u);
                    });
                    match channel {
                        Channel::Area(index) => {
                            let area = input.area_lights[index as usize].as_ref();
                            let p = lit[i as usize].si.p;
                            if let Some(seen) = area.and_then(|area| area.seen_from(p)) {
                                self.rays_to_area(&seen, (lit, i), own, s);
                            }
                        }
                        Channel::Sky => self.rays_to_sky((lit, i), own, s),
                    }
                }
                s.close(Rgb::ZERO);
            }
            s.runs = runs;
            *count += s.rays.len() as u64;
            s.occluded.clear();
            s.occluded.resize(s.rays.len(), false);
            self.intersector.occluded_batch(&s.rays, &mut s.occluded, counts);
            let mut start = 0;
            for (i, span) in s.spans.iter().enumerate() {
                let (open, weight) = opened(&s.weights, &s.occluded, start..span.end);
                let rays = span.end - start;
                start = span.end;
                if rays > 0 {
                    s.groups.note_checked(i, (at, channels), (open, weight), rays);
                }
            }
        }
        s.groups.conclude_checks(reuse);
    }

    /// Adds the light of `channel`, of a light with this `radiance`, where its ratio is known. Returns
    /// the points where it must be traced: all of them without a channel.
    fn use_known(
        &self,
        lit: &[ShadingPoint],
        channel: Option<(usize, usize)>,
        radiance: Rgb,
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
    ) -> Vec<u32> {
        let Some((channel, channels)) = channel else { return all_of(lit, s) };
        let mut wanted = std::mem::take(&mut s.wanted);
        wanted.clear();
        for (i, point) in lit.iter().enumerate() {
            let exact = s.exact[i * channels + channel];
            if exact == 0.0 {
                continue;
            }
            s.groups.note_lit(i);
            let ratio = s.groups.known(i, channel, channels);
            if ratio.is_nan() {
                wanted.push(i as u32);
            } else {
                let light = point.weight * radiance * (exact as f32 * ratio);
                pixels.add(point.place.pixel, point.place.sample, light);
            }
        }
        wanted
    }

    /// The number by which samples of a channel's light are drawn.
    fn number_of(&self, channel: Channel) -> u32 {
        match channel {
            Channel::Area(index) => index,
            Channel::Sky => self.scene.lights.len() as u32,
        }
    }

    /// Stratified points of one light and one place, from sample number `first` on.
    fn fill(
        &self,
        place: &SamplePlace,
        light: u32,
        first: u32,
        pixels: &BlockPixels,
        u: &mut [[f32; 2]],
    ) {
        pixels.sampler(place.pixel).fill2(first, self.dimension(place, light), u);
    }

    fn dimension(&self, place: &SamplePlace, light: u32) -> u32 {
        let lights = self.scene.lights.len() as u32 + 1;
        place.branch.wrapping_mul(lights).wrapping_add(light)
    }

    /// Traces the batch of points `group` and adds `weight · unshadowed · ratio` to each one's pixel;
    /// in a channel that is kept, also to its surface point.
    fn settle(
        &self,
        lit: &[ShadingPoint],
        group: &[u32],
        channel: Option<(usize, usize)>,
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        s.occluded.clear();
        s.occluded.resize(s.rays.len(), false);
        self.intersector.occluded_batch(&s.rays, &mut s.occluded, counts);
        let mut start = 0;
        for (&i, span) in group.iter().zip(&s.spans) {
            let point = &lit[i as usize];
            let (open, all) = opened(&s.weights, &s.occluded, start..span.end);
            if let (Some((channel, channels)), true) = (channel, span.end > start) {
                s.groups.add(i as usize, channel, channels, open, all);
            }
            start = span.end;
            if open > 0.0 {
                let ratio = (open / all) as f32;
                let light = point.weight * span.unshadowed * ratio;
                pixels.add(point.place.pixel, point.place.sample, light);
            }
        }
    }
}

/// Sums of the weights of those of `rays` that are not occluded, and of all.
fn opened(weights: &[f64], occluded: &[bool], rays: std::ops::Range<usize>) -> (f64, f64) {
    let (mut open, mut all) = (0.0, 0.0);
    for k in rays {
        all += weights[k];
        open += if occluded[k] { 0.0 } else { weights[k] };
    }
    (open, all)
}

/// All points, in order.
fn all_of(lit: &[ShadingPoint], s: &mut ShadowScratch) -> Vec<u32> {
    let mut wanted = std::mem::take(&mut s.wanted);
    wanted.clear();
    wanted.extend(0..lit.len() as u32);
    wanted
}
