//! Direct light at diffuse points: shadow rays in batches, light by light.
//!
//! For a light with an extent the estimate is `ratio · unshadowed`: the samples' ratio of shadowed to
//! unshadowed irradiance times the unshadowed irradiance in closed form. Where nothing is in the
//! way there is no noise at all, and the ratio is what later frames can reuse. A delta light has one sample.

use super::fog::{self, FogSamples};
use super::groups::{CheckRays, Groups};
use super::light::{LightSample, LightSampler, LightView, SampleSink, ShadowTarget};
use super::pilots::Run;
use super::pixels::BlockPixels;
use super::point::{SamplePlace, ShadingPoint};
use super::selection::{LightUser, LightUsers, Reached, TailSamples};
use super::sky_samples::EnvironmentScratch;
use super::source::LightSource;
use super::{FrameInput, Renderer, Reuse, dimensions, optics};
use crate::intersect::{Hit, Ray, SpawnPoint, SurfaceInteraction, lift_to_smooth};
use crate::math::{DVec3, Rgb, luminance};
use crate::scene::{Scene, Settings, tints};
use crate::stats::{RayCounts, RayKind};
use std::ops::Range;

/// Shadow rays traced together.
pub(super) const BATCH: usize = 256;

/// Where shadow rays leave a shading point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadowStarts {
    /// Where rays to the sky start: the facet.
    facet: SpawnPoint,
    /// Where rays to lights start: the smooth surface that the facet stands for.
    smooth: SpawnPoint,
    /// Unit geometric normal on the side that the rays leave.
    ng: DVec3,
}

impl ShadowStarts {
    /// The starts at the point `si` where `ray` hit, on the side of the unit geometric normal `ng`.
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
        Self { facet, smooth, ng }
    }

    /// The shadow ray to `target`.
    #[inline(always)]
    pub fn ray_to(&self, target: &ShadowTarget) -> Ray {
        match target {
            ShadowTarget::Point(target) => self.smooth.to(target),
            ShadowTarget::Direction(direction) => self.smooth.along(*direction),
            // Below the facet but above the smooth surface that it stands for: the facet's own plane is
            // no occluder.
            ShadowTarget::Sky(direction) => {
                self.facet.along(optics::keep_side(*direction, self.ng, true))
            }
        }
    }
}

/// Shadow rays of one shading point: to each sample that lies above the horizon.
struct ShadowRays<'s> {
    starts: ShadowStarts,
    /// The point's unit normal.
    n: DVec3,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for ShadowRays<'_> {
    #[inline(always)] // So that the kind of target is known.
    fn push(&mut self, sample: LightSample) {
        let weight = sample.pdf.weight(self.n);
        if weight > 0.0 {
            self.scratch.push(self.starts.ray_to(&sample.target), weight);
        }
    }
}

/// Buffers of shadow batches.
#[derive(Default)]
pub(super) struct ShadowScratch {
    rays: Vec<Ray>,
    weights: Vec<f64>,
    /// In place of weights what a glossy point reflects along each ray, per unit of emission.
    seen: Vec<Rgb>,
    occluded: Vec<bool>,
    /// The part of light that glass lets through along each ray; empty where none was found behind glass.
    tints: Vec<Rgb>,
    /// The part of light that fog leaves along each ray; empty without fog.
    left: Vec<f64>,
    /// Where the rays of each point of the batch end.
    ends: Vec<usize>,
    u: Vec<[f32; 2]>,
    runs: Runs,
    /// Shading points that the present light must be traced for.
    wanted: Vec<LightUser>,
    /// For each of these what its rays have found.
    gathered: Vec<Gathered>,
    /// Which of these cast rays now.
    going: Vec<u32>,
    /// Channels of a shading point.
    channels: usize,
    /// Channels of a light, one after another: one, or one for each primary colour.
    colours: usize,
    /// Where each light is traced, if lights are selected.
    pub users: LightUsers,
    /// Samples of the tail.
    pub tail: TailSamples,
    /// Rays to lights without a surface.
    pub unseen: Vec<usize>,
    /// Samples of an environment.
    pub environment: EnvironmentScratch,
    /// Samples in fog.
    pub fog: FogSamples,
    /// Irradiance without shadows, per unit of emission, for each shading point and kept channel.
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

/// What the shadow rays of one point to one light have found.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    /// Irradiance without shadows, per unit of emission.
    exact: f64,
    /// Weights of the rays that reached the light, and of all.
    open: f64,
    all: f64,
    rays: u32,
    /// In colours the weights of the rays that reached the light; 0 where none went through glass.
    tinted: Rgb,
}

/// The colour, of mean 1, of light of which these weights arrive, by [`ShadowScratch::tinted`].
fn mean_colour(tinted: Rgb) -> Rgb {
    let sum = tinted.element_sum();
    if sum > 0.0 { tinted * (3.0 / sum) } else { Rgb::ONE }
}

impl ShadowScratch {
    /// Starts another block of pixels.
    pub fn start_block(&mut self) {
        self.groups.start_block();
    }

    pub fn clear(&mut self) {
        self.rays.clear();
        self.weights.clear();
        self.seen.clear();
        self.left.clear();
        self.tints.clear();
        self.ends.clear();
    }

    /// Room for `n` samples of a light, to be given back.
    pub fn samples(&mut self, n: usize) -> Vec<[f32; 2]> {
        let mut u = std::mem::take(&mut self.u);
        u.resize(n, [0.0; 2]);
        u
    }

    /// Takes the room back.
    pub fn give_back(&mut self, u: Vec<[f32; 2]>) {
        self.u = u;
    }

    /// Adds a ray of a diffuse point, with the weight of its sample.
    #[inline(always)] // Once for each shadow ray.
    fn push(&mut self, ray: Ray, weight: f64) {
        self.rays.push(ray);
        self.weights.push(weight);
    }

    /// Irradiance without shadows in a channel of a shading point, by the place of both.
    pub fn exact(&self, at: usize) -> f64 {
        self.exact[at]
    }

    /// The ratio that is known of the light whose channels start at `channel`, for shading point `i`, where `sent` would arrive
    /// per unit of irradiance; NaN where any colour of that is unknown.
    fn known(&self, i: usize, channel: usize, sent: Rgb) -> Rgb {
        let of = |k: usize| self.groups.known(i, channel + k, self.channels);
        match self.colours {
            1 => Rgb::splat(of(0)),
            // Nobody is asked for what adds nothing.
            _ => Rgb::from_array([0, 1, 2].map(|k| if sent[k] == 0.0 { 0.0 } else { of(k) })),
        }
    }

    /// What is known to arrive at shading point `i` of light that is kept in parts, which have these `channels` and `tints`;
    /// `None` where a part that the surface reflects is unknown.
    pub fn known_parts(
        &self,
        (lit, i): (&[ShadingPoint], usize),
        channels: Range<usize>,
        tints: &[Rgb],
    ) -> Option<Rgb> {
        let mut light = Rgb::ZERO;
        for (channel, tint) in channels.zip(tints) {
            let exact = self.exact[i * self.channels + channel];
            if exact == 0.0 || lit[i].weight * *tint == Rgb::ZERO {
                continue;
            }
            let ratio = self.groups.known(i, channel, self.channels);
            if ratio.is_nan() {
                return None;
            }
            light += *tint * (exact as f32 * ratio);
        }
        Some(light)
    }

    /// Notes it, and what of it the pixel would show.
    pub fn note_exact(&mut self, at: usize, exact: f64, shown: f32) {
        self.exact[at] = exact;
        self.shown[at] = shown;
    }

    /// Adds a ray of a glossy point, which reflects `seen` of the light along it.
    pub fn push_highlight(&mut self, ray: Ray, seen: Rgb) {
        self.rays.push(ray);
        self.seen.push(seen);
    }

    /// Number of the batch's rays.
    pub fn ray_count(&self) -> usize {
        self.rays.len()
    }

    /// Multiplies what is seen along the rays from number `first` on by `light`.
    pub fn tint_from(&mut self, first: usize, light: Rgb) {
        self.seen[first..].iter_mut().for_each(|seen| *seen *= light);
    }

    /// What each of the batch's glossy points reflects along its rays that are not occluded.
    pub fn highlights(&self) -> impl Iterator<Item = Rgb> {
        let mut start = 0;
        self.ends.iter().map(move |end| {
            let rays = std::mem::replace(&mut start, *end)..*end;
            rays.filter(|k| !self.occluded[*k]).map(|k| self.seen[k]).sum()
        })
    }

    /// Whether the present point has no ray yet.
    fn is_open(&self) -> bool {
        self.rays.len() == self.ends.last().copied().unwrap_or(0)
    }

    /// Ends a point's rays.
    pub fn close(&mut self) {
        self.ends.push(self.rays.len());
    }

    /// The weights of those of `rays` that reached the light, in colours; 0 if none of the batch went through glass.
    fn tinted(&self, rays: Range<usize>) -> Rgb {
        if self.tints.is_empty() {
            return Rgb::ZERO;
        }
        let left = |k: usize| self.left.get(k).map_or(1.0, |left| *left as f32);
        let reached = rays.filter(|k| !self.occluded[*k]);
        reached.map(|k| self.tints[k] * (self.weights[k] as f32 * left(k))).sum()
    }

    pub fn starts(&mut self, renderer: &Renderer, lit: &[ShadingPoint], i: u32) -> ShadowStarts {
        let point = &lit[i as usize];
        *self.starts[i as usize].get_or_insert_with(|| {
            let seen = (&point.si, &point.ray, &point.hit);
            ShadowStarts::of(renderer.scene, renderer.settings, seen, point.ng)
        })
    }
}

impl Renderer<'_> {
    /// The lights that shine under the plan, in the scene's order, then a sky of one colour.
    /// Without `stops_early` every point takes all samples.
    pub(super) fn light_sources(
        &self,
        reuse: Option<Reuse>,
        stops_early: bool,
    ) -> Vec<LightSource> {
        let channels = reuse.map(|reuse| reuse.channels);
        let selects = channels.is_some_and(|channels| channels.slots() > 0);
        let narrow = |channel: usize| u16::try_from(channel).ok();
        let Self { plan, settings, .. } = self;
        let pilots = |least: Option<u32>, all: u32| match least {
            Some(least) if stops_early => least.min(all),
            _ => all,
        };
        let mut sources = Vec::new();
        for (number, light) in (0..).zip(&self.scene.lights) {
            let (runs, rays, samples, least) = match light.is_area() {
                true => {
                    let (samples, least) = (settings.shadow_samples, settings.least_shadow_samples);
                    (plan.area_lights, RayKind::ShadowArea, samples, least)
                }
                false => (plan.delta_lights, RayKind::ShadowDelta, 1, None),
            };
            if runs {
                let sampler = LightSampler::new(light);
                let channel =
                    channels.and_then(|channels| channels.of_light(number)).and_then(narrow);
                let is_kept = channel.is_some() || (selects && light.is_area());
                let pilots = pilots(least, samples);
                sources.push(LightSource {
                    sampler,
                    number,
                    samples,
                    pilots,
                    rays,
                    channel,
                    is_kept,
                });
            }
        }
        if plan.sky_light && self.scene.environment.is_none() {
            let channel = channels.and_then(|channels| channels.sky().next()).and_then(narrow);
            sources.push(LightSource {
                sampler: LightSampler::of_sky(&self.scene.sky),
                number: self.scene.lights.len() as u32,
                samples: settings.sky_samples,
                pilots: pilots(settings.least_sky_samples, settings.sky_samples),
                rays: RayKind::ShadowSky,
                channel,
                is_kept: channel.is_some(),
            });
        }
        sources
    }

    /// Adds the direct light of all `lit` points to their pixels. What is known about a point is
    /// used; the rest is traced.
    pub(super) fn light_points(
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
            scratch.channels = reuse.channels.len();
            scratch.colours = reuse.channels.colours();
            scratch.groups.gather_points(input, reuse.channels, lit);
        }
        let mut users = std::mem::take(&mut scratch.users);
        if let Some(selection) = &input.selection {
            let points = lit.iter().map(|point| point.si.p);
            let groups = &mut scratch.groups;
            let slot = |point, source: &LightSource| {
                source.is_kept.then(|| groups.slot(point, source.number)).flatten()
            };
            users.find(selection, &input.lights, points, |c| selection.of_diffuse(c), slot);
            self.look_at_tails(selection, (lit, &users.cells), scratch);
        }
        if let Some(reuse) = &input.reuse {
            self.light_without_shadows(input, lit, &users, scratch);
            if let Some(selection) = &input.selection {
                let points = (lit, &users.cells[..]);
                self.tails_without_shadows((selection, reuse), points, scratch);
            }
            if let Some(source) = &input.environment {
                self.environment_without_shadows(source, lit, scratch);
            }
            let asked = (self.scene, reuse);
            scratch.groups.ask(input, asked, lit, &scratch.shown, pixels);
            if scratch.groups.wants_checks() {
                self.check_answers(input, reuse, (lit, &users), pixels, scratch, counts);
            }
        }
        if self.plan.ambient {
            let ambient = self.scene.sky.ambient * std::f32::consts::PI;
            lit.iter().for_each(|p| pixels.add(p.place.pixel, p.place.sample, p.weight * ambient));
        }
        for at in 0..input.lights.len() {
            self.light_from(input, at, (lit, &users), pixels, scratch, counts);
        }
        if let Some(source) = &input.environment {
            self.light_from_environment(source, lit, pixels, scratch, counts);
        }
        if let Some(selection) = &input.selection {
            let lit = (lit, &users.cells[..]);
            self.light_tails((input, selection), lit, pixels, scratch, counts);
        }
        scratch.users = users;
    }

    /// What of the kept lights would arrive if nothing were in the way.
    fn light_without_shadows(
        &self,
        input: &FrameInput,
        lit: &[ShadingPoint],
        users: &LightUsers,
        s: &mut ShadowScratch,
    ) {
        let channels = s.channels;
        s.exact.clear();
        s.exact.resize(lit.len() * channels, 0.0);
        s.shown.clear();
        s.shown.resize(lit.len() * channels, 0.0);
        for (at, source) in input.lights.iter().enumerate().filter(|(_, source)| source.is_kept) {
            for LightUser { point: i, slot } in input.reached(at, lit.len(), users).iter() {
                let Some(slot) = slot else { continue };
                let point = &lit[i as usize];
                let exact = point.unshadowed(&source.sampler);
                let sent = point.weight * source.sampler.emission;
                let own = i as usize * channels + usize::from(slot);
                for (k, tint) in ratio_colours(s.colours).iter().enumerate() {
                    s.exact[own + k] = exact;
                    let shown = luminance(sent * *tint) * exact as f32;
                    s.shown[own + k] = shown * self.settings.exposure;
                }
            }
            if let Some(fog) = self.fog().filter(|_| !source.is_sky()) {
                for LightUser { point: i, slot } in input.reached(at, lit.len(), users).iter() {
                    let Some(slot) = slot else { continue };
                    let own = i as usize * channels + usize::from(slot);
                    if s.exact[own] != 0.0 {
                        let left = fog::dimmed(fog, source, &lit[i as usize]);
                        for at in own..own + s.colours {
                            s.exact[at] *= left;
                            s.shown[at] *= left as f32;
                        }
                    }
                }
            }
        }
    }

    /// Adds the light of source number `at`, known or traced.
    fn light_from(
        &self,
        input: &FrameInput,
        at: usize,
        (lit, users): (&[ShadingPoint], &LightUsers),
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let source = &input.lights[at];
        let reached = input.reached(at, lit.len(), users);
        let wanted = self.use_known((at, source), reached, lit, pixels, s);
        s.gathered.clear();
        s.gathered.extend(wanted.iter().map(|&LightUser { point: i, slot }| {
            let point = &lit[i as usize];
            let exact = match slot {
                Some(slot) => s.exact[i as usize * s.channels + usize::from(slot)],
                None => point.unshadowed(&source.sampler),
            };
            Gathered { exact, ..Gathered::default() }
        }));
        if let Some(fog) = self.fog().filter(|_| !source.is_sky()) {
            let unknown =
                wanted.iter().zip(&mut s.gathered).filter(|(user, _)| user.slot.is_none());
            for (user, gathered) in unknown.filter(|(_, gathered)| gathered.exact != 0.0) {
                gathered.exact *= fog::dimmed(fog, source, &lit[user.point as usize]);
            }
        }
        let mut going = std::mem::take(&mut s.going);
        going.clear();
        going.extend(0..wanted.len() as u32);
        if let Some(pilots) = Run::pilots(source, self.settings.most_camera_samples()) {
            self.cast((source, &pilots), (lit, &wanted, &going), pixels, s, counts);
            let pixel_of = |user: &LightUser| lit[user.point as usize].place.pixel;
            for (user, gathered) in wanted.iter().zip(&s.gathered) {
                // Where all pilots lay below the horizon, nothing is known.
                let is_unknown = gathered.rays == 0;
                let open = is_unknown || gathered.open > 0.0;
                let shut = is_unknown || gathered.open < gathered.all;
                if gathered.exact != 0.0 {
                    pixels.note_pilots(at, pixel_of(user), open, shut);
                }
            }
            let disputed = pixels.disputed(at);
            going.retain(|k| disputed.has(pixels.place_in_block(pixel_of(&wanted[*k as usize]))));
            for k in &going {
                let gathered = &mut s.gathered[*k as usize];
                *gathered = Gathered { exact: gathered.exact, ..Gathered::default() };
            }
        }
        self.cast((source, &Run::whole(source)), (lit, &wanted, &going), pixels, s, counts);
        for (&LightUser { point: i, slot }, gathered) in wanted.iter().zip(&s.gathered) {
            let point = &lit[i as usize];
            let Gathered { exact, open, all, rays, tinted } = *gathered;
            let tint = mean_colour(tinted);
            if let (Some(slot), true) = (slot, rays > 0) {
                for (channel, open) in
                    (usize::from(slot)..).zip(parts((open, all), tint, s.colours))
                {
                    s.groups.add(i as usize, channel, s.channels, open, all);
                }
            }
            if open > 0.0 {
                let unshadowed = source.sampler.emission * exact as f32;
                let light = point.weight * unshadowed * tint * (open / all) as f32;
                pixels.add(point.place.pixel, point.place.sample, light);
            }
        }
        (s.wanted, s.going) = (wanted, going);
    }

    /// Casts a run of shadow rays from each of those of the `wanted` points that are `going`, and gathers what they
    /// find.
    fn cast(
        &self,
        (source, run): (&LightSource, &Run),
        (lit, wanted, going): (&[ShadingPoint], &[LightUser], &[u32]),
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = run.count as usize;
        let mut u = s.samples(n);
        for group in going.chunks((BATCH / n.max(1)).max(1)) {
            s.clear();
            for &at in group {
                let i = wanted[at as usize].point;
                let point = &lit[i as usize];
                let gathered = s.gathered[at as usize];
                // What is NaN goes on, to be counted at its pixel.
                let seen = match gathered.exact {
                    0.0 => None,
                    _ => source.sampler.seen_from(point.si.p, point.n),
                };
                if let Some(seen) = &seen {
                    if source.is_sampled() {
                        let first = run.first(point.place.sample);
                        self.fill(&point.place, source.number, first, pixels, &mut u);
                    }
                    self.rays_to(seen, (lit, i), &u, s);
                    if s.is_open() && n == source.samples as usize {
                        // All below the horizon, but some of the light is above: a point of that
                        // decides, or the horizon's own shadow would be counted twice.
                        if let Some(target) = seen.above(point.si.p, point.n) {
                            let ray = s.starts(self, lit, i).ray_to(&target);
                            s.push(ray, 1.0);
                        }
                    }
                }
                s.close();
            }
            self.trace_light(source, s, counts);
            let mut start = 0;
            for (&at, &end) in group.iter().zip(&s.ends) {
                let (open, all) = opened(source, s, start..end);
                let tinted = s.tinted(start..end);
                let gathered = &mut s.gathered[at as usize];
                gathered.tinted += tinted;
                gathered.open += open;
                gathered.all += all;
                gathered.rays += (end - start) as u32;
                start = end;
            }
        }
        s.give_back(u);
    }

    /// Pushes a shadow ray from shading point `i` to each of the samples `u` of a light, but for those below
    /// the horizon.
    fn rays_to(
        &self,
        seen: &LightView,
        (lit, i): (&[ShadingPoint], u32),
        u: &[[f32; 2]],
        s: &mut ShadowScratch,
    ) {
        let point = &lit[i as usize];
        let starts = s.starts(self, lit, i);
        let mut rays = ShadowRays { starts, n: point.n, scratch: s };
        seen.sample_li(point.si.p, u, &mut rays);
    }

    /// Casts the check rays that the inference wants, and tells it what they found.
    fn check_answers(
        &self,
        input: &FrameInput,
        reuse: &Reuse,
        (lit, users): (&[ShadingPoint], &LightUsers),
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let channels = s.channels;
        for (at, source) in input.lights.iter().enumerate().filter(|(_, source)| source.is_kept) {
            let reached = input.reached(at, lit.len(), users);
            if reached.len() == 0 {
                continue;
            }
            s.clear();
            let mut runs = std::mem::take(&mut s.runs);
            runs.start(s.groups.len());
            for LightUser { point: i, slot } in reached.iter() {
                let point = &lit[i as usize];
                let wanted = slot.map(usize::from).and_then(|slot| {
                    let own = slot..slot + s.colours;
                    let wanted = s.groups.check_rays(i as usize, own, channels, source.samples);
                    wanted.filter(|_| s.exact[i as usize * channels + slot] != 0.0)
                });
                if let Some(wanted) = wanted {
                    let own = runs.own(&wanted, |u| {
                        // Samples that tracing does not use: had it any of these, what is traced
                        // because of them would be darker or brighter than what is.
                        let samples = source.samples.next_power_of_two();
                        let traced = self.settings.most_camera_samples().wrapping_mul(samples);
                        let first = wanted.first.wrapping_add(traced);
                        self.fill(&point.place, source.number, first, pixels, u);
                    });
                    if let Some(seen) = source.sampler.seen_from(point.si.p, point.n) {
                        self.rays_to(&seen, (lit, i), own, s);
                    }
                }
                s.close();
            }
            s.runs = runs;
            self.trace_light(source, s, counts);
            let mut start = 0;
            for (LightUser { point: i, slot }, &end) in reached.iter().zip(&s.ends) {
                let (open, weight) = opened(source, s, start..end);
                let tint = mean_colour(s.tinted(start..end));
                let rays = end - start;
                start = end;
                if let (Some(slot), true) = (slot, rays > 0) {
                    for (channel, open) in
                        (usize::from(slot)..).zip(parts((open, weight), tint, s.colours))
                    {
                        s.groups.note_checked(
                            i as usize,
                            (channel, channels),
                            (open, weight),
                            rays,
                        );
                    }
                }
            }
        }
        if let Some(selection) = &input.selection {
            self.check_tails((input, selection, reuse), (lit, &users.cells), pixels, s, counts);
        }
        if let Some(source) = &input.environment {
            self.check_environment(source, lit, pixels, s, counts);
        }
        s.groups.conclude_checks(reuse);
    }

    /// Adds the light of `source` where its ratio is known. Returns those of the points that it reaches where it must
    /// be traced: all of them where no ratio is kept.
    fn use_known(
        &self,
        (at, source): (usize, &LightSource),
        reached: Reached,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
    ) -> Vec<LightUser> {
        let mut wanted = std::mem::take(&mut s.wanted);
        wanted.clear();
        if !source.is_kept {
            wanted.extend(reached.iter());
            return wanted;
        }
        let channels = s.channels;
        for user in reached.iter() {
            let Some(channel) = user.slot.map(usize::from) else {
                wanted.push(user);
                continue;
            };
            let i = user.point as usize;
            let point = &lit[i];
            let exact = s.exact[i * channels + channel];
            if exact == 0.0 {
                continue;
            }
            s.groups.note_lit(i);
            let sent = point.weight * source.sampler.emission;
            let ratio = s.known(i, channel, sent);
            if ratio.is_nan() {
                wanted.push(user);
            } else {
                pixels.note_ratio(at, point.place.pixel, ratio.element_sum() / 3.0);
                let light = sent * (exact as f32 * ratio);
                pixels.add(point.place.pixel, point.place.sample, light);
            }
        }
        wanted
    }

    /// Stratified points of the light of this number and one place, from sample number `first` on.
    pub(super) fn fill(
        &self,
        place: &SamplePlace,
        light: u32,
        first: u32,
        pixels: &BlockPixels,
        u: &mut [[f32; 2]],
    ) {
        let dimension = dimensions::of_light(place.branch, light, self.light_dimensions());
        pixels.sampler(place.pixel).fill2(first, dimension, u);
    }

    /// Random dimensions of a branch's lights.
    pub(super) fn light_dimensions(&self) -> usize {
        let lights = self.scene.lights.len();
        let tail = self.scene.selected_lights(self.settings).map_or(0, |_| dimensions::TAIL);
        lights + tail + self.fog().map_or(0, |_| dimensions::of_fog(lights))
    }

    /// Traces the batch's rays, to a light.
    pub(super) fn trace_shadow_rays(
        &self,
        source: &LightSource,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        counts[source.rays] += s.rays.len() as u64;
        self.trace_rays(s, counts);
    }

    /// Traces the batch's rays, to a light that may lie behind glass.
    fn trace_light(&self, source: &LightSource, s: &mut ShadowScratch, counts: &mut RayCounts) {
        counts[source.rays] += s.rays.len() as u64;
        self.trace_through(s, counts);
    }

    /// Traces the batch's rays, which are counted already, straight through glass where the scene wants that.
    pub(super) fn trace_through(&self, s: &mut ShadowScratch, counts: &mut RayCounts) {
        self.trace_rays(s, counts);
        if self.plan.glass_shadows {
            (0..s.rays.len()).for_each(|k| self.follow(k, false, s, counts));
        }
    }

    /// Follows the batch's ray number `k`, if it is occluded, straight through glass; `if_polished`, through no other.
    pub(super) fn follow(
        &self,
        k: usize,
        if_polished: bool,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        if !s.occluded[k] {
            return;
        }
        let left = self.through_glass(&s.rays[k], if_polished, counts);
        if left == Rgb::ZERO {
            return;
        }
        s.occluded[k] = false;
        match s.seen.get_mut(k) {
            Some(seen) => *seen *= left,
            None => {
                s.tints.resize(s.rays.len(), Rgb::ONE);
                s.tints[k] = left;
            }
        }
    }

    /// Traces the batch's rays, which are counted already.
    pub(super) fn trace_rays(&self, s: &mut ShadowScratch, counts: &mut RayCounts) {
        s.occluded.clear();
        s.occluded.resize(s.rays.len(), false);
        self.intersector.occluded_batch(&s.rays, &mut s.occluded, counts);
        if let Some(fog) = self.fog() {
            s.left.extend(s.rays.iter().map(|ray| fog.transmittance(ray)));
            for (left, seen) in s.left.iter().zip(&mut s.seen) {
                *seen *= *left as f32;
            }
        }
    }
}

/// The colours that the ratios of a light are of, if there are `colours`.
fn ratio_colours(colours: usize) -> &'static [Rgb] {
    tints(&[Rgb::ONE], colours)
}

/// The parts of the weights `open` of `all` in each of so many `colours`, if they have the colour `tint`, of mean 1.
fn parts((open, all): (f64, f64), tint: Rgb, colours: usize) -> impl Iterator<Item = f64> {
    // Rounding must not make it more than all. NaN stays what it is.
    let at_most = move |open: f64| if open > all { all } else { open };
    let part = move |own: f32| if colours == 1 { open } else { at_most(open * f64::from(own)) };
    tint.to_array().into_iter().take(colours).map(part)
}

/// Sums of the weights of those of the batch's `rays` to `source` that are not occluded, and of all.
fn opened(source: &LightSource, s: &ShadowScratch, rays: Range<usize>) -> (f64, f64) {
    let (mut open, mut all) = (0.0, 0.0);
    for k in rays.clone() {
        all += s.weights[k];
        open += if s.occluded[k] { 0.0 } else { s.weights[k] };
    }
    if s.left.is_empty() && s.tints.is_empty() {
        return (open, all);
    }
    let left = |k: usize| s.weights[k] * s.left.get(k).copied().unwrap_or(1.0);
    let tint = |k: usize| s.tints.get(k).map_or(1.0, |tint| f64::from(tint.element_sum()) / 3.0);
    let reached = rays.clone().filter(|k| !s.occluded[*k]);
    let through = reached.map(|k| left(k) * tint(k)).sum();
    // What fog lets through of a light where nothing is in the way is part of its irradiance without shadows; of a sky,
    // whose light goes very different ways, it is part of the ratio.
    match source.is_sky() {
        true => (through, all),
        // The same to the last bit where all of them reach the light.
        false => (through, rays.map(left).sum()),
    }
}
