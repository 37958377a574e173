//! The kernel: radiance of one block of pixels, specialised by the effects that run.
//!
//! A block is 8 x 8 pixels at a fixed place of the image. Every batch of rays is made of one
//! block's rays only, so that a pixel's bytes depend neither on the crop nor on the threads.
//! Per block: camera rays in packets, specular rays in packets branch by branch until none is left,
//! then shadow rays light by light. All buffers live in [`Scratch`]; nothing is allocated per pixel.

use super::adaptive::Until;
use super::backdrop::Escaped;
use super::cone::RayCone;
use super::direct::{ShadowScratch, ShadowStarts};
use super::fog::{self, FogSegment};
use super::highlight::GlossyPoint;
use super::lobe::{self, Layers, Lobe, Scattered};
use super::medium_stack::{self, Body, MediumStack};
use super::pixels::BlockPixels;
use super::point::{SamplePlace, ShadingPoint};
use super::{FrameInput, Left, Renderer, dimensions, medium, normal_map, optics, texture};
use crate::film::GPixel;
use crate::intersect::{Hit, Ray, SurfaceInteraction};
use crate::math::{DVec3, Rgb};
use crate::scene::{MaterialId, NormalMap};
use crate::stats::{RayCounts, RayKind};

/// Boundaries of ranked glass that a ray passes without another medium behind them.
const MOST_PASSED: usize = 1024;

/// A ray's place in its camera sample's tree.
#[derive(Debug, Clone, Copy)]
struct PathState {
    /// Product of weights so far.
    throughput: Rgb,
    /// Index of the pixel in the block.
    pixel: u32,
    /// Camera sample.
    sample: u32,
    /// The glass without a priority that the ray is in.
    medium: Option<MaterialId>,
    /// Density of the ray's direction among those of the lobe that sent it, per steradian; 0 of camera
    /// rays and of delta lobes.
    pdf: f32,
    /// Which branch of the tree ([`dimensions::branch`]).
    branch: u32,
    /// The cell of lights of the point that a lobe with an extent sent the ray from.
    cell: u32,
    /// What the ray stands for, where it starts or, once that is known, ends; of no width where no material shows an image.
    cone: RayCone,
}

/// Buffers of one worker thread.
#[derive(Default)]
pub(super) struct Scratch {
    rays: Vec<Ray>,
    states: Vec<PathState>,
    /// Bodies of ranked glass around each ray's start; empty in kernels without.
    interiors: Vec<MediumStack>,
    /// Bodies on the way out of the glass around a ray's start.
    met: Vec<Body>,
    hits: Vec<Option<Hit>>,
    next_rays: Vec<Ray>,
    next_states: Vec<PathState>,
    next_interiors: Vec<MediumStack>,
    /// Branch of each next ray, and which it is.
    order: Vec<(u32, u32)>,
    lit: Vec<ShadingPoint>,
    glossy: Vec<GlossyPoint>,
    foggy: Vec<FogSegment>,
    shadow: ShadowScratch,
}

impl Scratch {
    /// Notes the bodies of ranked glass around each camera ray's start.
    fn start_interiors(&mut self, renderer: &Renderer, input: &FrameInput, counts: &mut RayCounts) {
        let Self { rays, interiors, met, .. } = self;
        interiors.clear();
        if input.camera.lens.is_sampled() && input.has_ranked_glass {
            // A boundary may lie across the lens.
            interiors.extend(rays.iter().map(|ray| MediumStack::at(renderer, ray, met, counts)));
        } else {
            interiors.resize(rays.len(), input.around_eye);
        }
    }

    /// Makes the next generation of rays the present one, branch by branch: what neighbouring pixels
    /// reflect is coherent, what one of them reflects and refracts is not.
    fn advance(&mut self) {
        self.order.clear();
        self.order.extend(self.next_states.iter().zip(0..).map(|(state, i)| (state.branch, i)));
        self.order.sort_unstable();
        gather(&self.order, &self.next_rays, &mut self.rays);
        gather(&self.order, &self.next_states, &mut self.states);
        gather(&self.order, &self.next_interiors, &mut self.interiors);
        self.next_rays.clear();
        self.next_states.clear();
        self.next_interiors.clear();
    }
}

/// Puts what `from` holds, if anything, into `to`, in `order`.
fn gather<T: Copy>(order: &[(u32, u32)], from: &[T], to: &mut Vec<T>) {
    to.clear();
    if !from.is_empty() {
        to.extend(order.iter().map(|(_, i)| from[*i as usize]));
    }
}

/// Renders one block into `pixels`, which holds its radiance sums and records, `until` its pixels have their samples.
///
/// `NESTED` is glass with priorities, on top of `GLASS`.
pub(super) fn block<const MIRROR: bool, const GLASS: bool, const NESTED: bool>(
    renderer: &Renderer,
    input: &FrameInput,
    until: &Until,
    pixels: &mut BlockPixels,
    scratch: &mut Scratch,
    left: &mut Left,
) -> RayCounts {
    let mut counts = RayCounts::default();
    scratch.shadow.start_block();
    let most = renderer.settings.most_camera_samples();
    while let Some(samples) = pixels.start_samples(input, until, most) {
        camera_rays(input, pixels, samples, scratch);
        counts[RayKind::Camera] += scratch.rays.len() as u64;
        if NESTED {
            scratch.start_interiors(renderer, input, &mut counts);
        }
        trace_paths::<MIRROR, GLASS, NESTED>(renderer, input, pixels, scratch, &mut counts);
        let Scratch { lit, glossy, foggy, shadow, .. } = scratch;
        renderer.light_points(input, lit, pixels, shadow, &mut counts);
        if MIRROR && !glossy.is_empty() {
            renderer.light_highlights(input, glossy, pixels, shadow, &mut counts);
        }
        if !foggy.is_empty() {
            renderer.light_fog(input, foggy, pixels, shadow, &mut counts);
        }
        if let Some(reuse) = &input.reuse {
            shadow.groups.finish(reuse, pixels, &mut left.sources, &mut left.reuse);
        }
        pixels.end_samples();
    }
    counts
}

fn camera_rays(
    input: &FrameInput,
    pixels: &mut BlockPixels,
    samples: std::ops::Range<u32>,
    scratch: &mut Scratch,
) {
    scratch.rays.clear();
    scratch.states.clear();
    let is_sampled = input.camera.lens.is_sampled();
    for sample in samples {
        let spread = input.spread(sample);
        for pixel in pixels.active() {
            let (x, y) = pixels.sample_position(pixel as usize, sample);
            let lens = match is_sampled {
                true => pixels.lens_position(pixel as usize, sample),
                false => [0.5; 2],
            };
            let ray = input.camera.generate_ray(x, y, lens);
            let (throughput, branch) = (Rgb::ONE, dimensions::ROOT);
            let (medium, pdf, cell, cone) =
                (None, 0.0, 0, RayCone::of_camera(spread, ray.dir.dot(input.camera.forward)));
            scratch.rays.push(ray);
            let state = PathState { throughput, pixel, sample, medium, pdf, branch, cell, cone };
            scratch.states.push(state);
        }
    }
}

fn trace_paths<const MIRROR: bool, const GLASS: bool, const NESTED: bool>(
    renderer: &Renderer,
    input: &FrameInput,
    pixels: &mut BlockPixels,
    scratch: &mut Scratch,
    counts: &mut RayCounts,
) {
    scratch.lit.clear();
    scratch.glossy.clear();
    scratch.foggy.clear();
    for depth in 0..=renderer.settings.bounces {
        let Scratch { rays, states, interiors, hits, lit, glossy, foggy, .. } = scratch;
        let Scratch { next_rays, next_states, next_interiors, .. } = scratch;
        hits.clear();
        hits.resize(rays.len(), None);
        renderer.intersector.intersect_batch(rays, hits, counts);
        if renderer.plan.textures {
            let ends = rays.iter().zip(hits.iter()).zip(states.iter_mut());
            ends.for_each(|((ray, hit), state)| state.cone = state.cone.at_end(ray, hit.as_ref()));
        }
        if depth == 0 && pixels.wants_records() {
            record(renderer, input, pixels, rays, hits, states);
        }
        if let (Some(fog), false) = (renderer.fog(), NESTED) {
            let ends = rays.iter().zip(hits.iter()).zip(states.iter_mut());
            for ((ray, hit), state) in ends.filter(|(_, state)| state.medium.is_none()) {
                let place = state.place();
                fog::enter(fog, (ray, hit.as_ref()), &mut state.throughput, place, foggy);
            }
        }
        let mut vertex = Vertex {
            renderer,
            input,
            pixels,
            lit,
            glossy,
            foggy,
            next_rays,
            next_states,
            next_interiors,
            counts,
        };
        let may_bounce = depth < renderer.settings.bounces;
        for (i, ((ray, hit), state)) in rays.iter().zip(hits.iter()).zip(states.iter()).enumerate()
        {
            if NESTED {
                vertex.pass::<MIRROR>(*ray, *hit, state, interiors[i], may_bounce);
                continue;
            }
            let absorbed;
            let mut state = state;
            if GLASS && renderer.plan.absorption {
                absorbed = vertex.travel(ray, hit.as_ref(), state, state.medium);
                state = &absorbed;
            }
            match hit {
                None => vertex.escape(ray, state),
                Some(hit) => {
                    let no = MediumStack::default();
                    vertex.meet::<MIRROR, GLASS, NESTED>(ray, hit, state, &no, may_bounce);
                }
            }
        }
        if !(MIRROR || GLASS) || scratch.next_rays.is_empty() {
            break;
        }
        scratch.advance();
    }
}

/// Where one generation of rays ends and the next begins.
struct Vertex<'v, 'r> {
    renderer: &'v Renderer<'r>,
    input: &'v FrameInput<'r>,
    pixels: &'v mut BlockPixels,
    lit: &'v mut Vec<ShadingPoint>,
    glossy: &'v mut Vec<GlossyPoint>,
    foggy: &'v mut Vec<FogSegment>,
    next_rays: &'v mut Vec<Ray>,
    next_states: &'v mut Vec<PathState>,
    next_interiors: &'v mut Vec<MediumStack>,
    counts: &'v mut RayCounts,
}

impl Vertex<'_, '_> {
    fn escape(&mut self, ray: &Ray, state: &PathState) {
        let sky = match &self.input.backdrop {
            // A ray that nobody could trace has not seen the sky.
            _ if !ray.is_valid() => Rgb::NAN,
            None => self.renderer.scene.sky.radiance,
            Some(backdrop) => {
                let PathState { pdf, cell, cone, .. } = *state;
                let escaped = Escaped { ray, spread: cone.spread, pdf, cell };
                self.renderer.seen_outside(self.input, backdrop, &escaped)
            }
        };
        self.add(state, state.throughput * sky);
    }

    fn add(&mut self, state: &PathState, radiance: Rgb) {
        self.pixels.add(state.pixel, state.sample, radiance);
    }

    /// The path where `ray` meets `hit` or nothing, after the glass `medium` has taken its share of light.
    fn travel(
        &self,
        ray: &Ray,
        hit: Option<&Hit>,
        state: &PathState,
        medium: Option<MaterialId>,
    ) -> PathState {
        let scene = self.renderer.scene;
        let glass = medium.and_then(|id| scene.materials[id as usize].glass.as_ref());
        let left = glass.map_or(Rgb::ONE, |glass| {
            let way = hit.map_or(f64::INFINITY, |hit| hit.t * ray.dir.length());
            medium::transmittance(glass, scene.recentring.length_to_world(way))
        });
        PathState { throughput: state.throughput * left, ..*state }
    }

    /// Follows the ray through boundaries of ranked glass that lead to no other medium, then to
    /// what it meets.
    fn pass<const MIRROR: bool>(
        &mut self,
        mut ray: Ray,
        mut hit: Option<Hit>,
        state: &PathState,
        mut inside: MediumStack,
        may_bounce: bool,
    ) {
        let renderer = self.renderer;
        let mut state = *state;
        for _ in 0..MOST_PASSED {
            if renderer.plan.absorption {
                let medium = inside.material().or(state.medium);
                state = self.travel(&ray, hit.as_ref(), &state, medium);
            }
            if let (Some(fog), None) = (renderer.fog(), inside.material().or(state.medium)) {
                let place = state.place();
                fog::enter(fog, (&ray, hit.as_ref()), &mut state.throughput, place, self.foggy);
            }
            let Some(met) = &hit else { return self.escape(&ray, &state) };
            let si = SurfaceInteraction::new(renderer.scene, &ray, met);
            let material = &renderer.scene.materials[si.surface.material as usize];
            if !material.glass.as_ref().is_some_and(medium_stack::is_ranked) {
                return self.meet::<MIRROR, true, true>(&ray, met, &state, &inside, may_bounce);
            }
            let crossing = medium_stack::cross(renderer, &ray, &si, &inside, self.counts);
            if let Some(boundary) = crossing.boundary {
                if may_bounce {
                    let starts = Starts {
                        reflected: (&si, &inside),
                        transmitted: (&crossing.last, &crossing.after),
                        behind: state.medium,
                    };
                    let wo = -ray.dir.normalize();
                    let lobe = Lobe::Dielectric(boundary.lobe);
                    self.scatter::<true>((&lobe, 0), &boundary.surface, wo, &starts, &state);
                }
                return;
            }
            inside = crossing.after;
            // Light samples do not reach through glass: a lamp behind it is seen by this ray alone.
            state.pdf = 0.0;
            ray = crossing.last.spawn(ray.dir, renderer.settings.rules.spawn_offset);
            self.counts[RayKind::Glass] += 1;
            hit = renderer.intersector.intersect(&ray, self.counts);
            if renderer.plan.textures {
                state.cone = state.cone.at_end(&ray, hit.as_ref());
            }
        }
        // Given up, and not silently.
        self.add(&state, Rgb::NAN);
    }

    fn meet<const MIRROR: bool, const GLASS: bool, const NESTED: bool>(
        &mut self,
        ray: &Ray,
        hit: &Hit,
        state: &PathState,
        inside: &MediumStack,
        may_bounce: bool,
    ) {
        let scene = self.renderer.scene;
        let si = SurfaceInteraction::new(scene, ray, hit);
        let material = &scene.materials[si.surface.material as usize];
        let wo = -ray.dir.normalize();
        let mut le = material.emitted(si.is_outside(wo));
        if le != Rgb::ZERO {
            if let Some(map) = &material.emission_map {
                le *= texture::shown(scene, map, (&si, wo, state.cone));
            }
            if MIRROR && state.pdf > 0.0 {
                let ends = (ray.org, si.p);
                let lobe = (f64::from(state.pdf), state.cell);
                let light = scene.light_at((hit.prim.geom_id, hit.prim.prim_id), (hit.u, hit.v));
                le *= self.renderer.share_of_lobe(self.input, light, ends, lobe);
            }
            self.add(state, state.throughput * le);
        }
        let mapped = |map: &NormalMap| {
            let ns = normal_map::normal(scene, map, &si, wo, state.cone);
            SurfaceInteraction { ns, ..si }
        };
        let tilted = material.normal_map.as_ref().map(mapped);
        let shaped = tilted.as_ref().unwrap_or(&si);
        let seen = (shaped, wo, state.cone);
        let is_layered = material.shows_layers(si.is_outside(wo));
        let fresnel = material.fresnel.as_ref().filter(|_| is_layered);
        let tilted_coat =
            fresnel.and_then(|fresnel| fresnel.clearcoat_normal_map.as_ref()).map(mapped);
        let coat = tilted_coat.as_ref().unwrap_or(&si);
        let layers = fresnel.map(|fresnel| Layers::at(scene, (material, fresnel), seen, coat));
        if material.is_diffuse() && (is_layered || material.fresnel.is_none()) {
            let albedo = match &layers {
                None => lobe::albedo(scene, material, &si, wo, state.cone),
                Some(layers) => layers.albedo,
            };
            let reflectance = state.throughput * albedo;
            let (met, place) = ((&si, ray, hit), state.place());
            self.lit.push(ShadingPoint::new(met, shaped.ns, wo, reflectance, place));
        }
        if !may_bounce {
            return;
        }
        let what = (material, layers.as_ref());
        lobe::for_each_directional::<MIRROR, GLASS>(scene, what, seen, |lobe, first, si| {
            let start = (si, inside);
            let behind = match lobe.is_pane() {
                true => state.medium,
                false => si.is_outside(wo).then_some(si.surface.material),
            };
            let starts = Starts { reflected: start, transmitted: start, behind };
            self.scatter::<NESTED>((&lobe, first), si, wo, &starts, state);
            if MIRROR && !lobe.is_delta() {
                self.glossy.push(self.glossy_point(lobe, (si, ray, hit), wo, state));
            }
        });
    }

    fn glossy_point(
        &self,
        lobe: Lobe,
        (si, ray, hit): (&SurfaceInteraction, &Ray, &Hit),
        wo: DVec3,
        state: &PathState,
    ) -> GlossyPoint {
        let Renderer { scene, settings, .. } = self.renderer;
        // Light comes from this side.
        let side = if lobe.is_transmission() { -1.0 } else { 1.0 };
        let ng = si.ng * if si.is_outside(wo) { side } else { -side };
        let starts = ShadowStarts::of(scene, settings, (si, ray, hit), ng);
        let (p, n, place) = (si.p, lobe::facing_normal(si, wo) * side, state.place());
        GlossyPoint { lobe, p, n, ng, wo, starts, throughput: state.throughput, place }
    }

    /// Sends the rays that `lobe` scatters at the surface `si`, of which the first has the number `first` among all.
    fn scatter<const NESTED: bool>(
        &mut self,
        (lobe, first): (&Lobe, u32),
        si: &SurfaceInteraction,
        wo: DVec3,
        starts: &Starts,
        state: &PathState,
    ) {
        let outside = si.is_outside(wo);
        let sampler = self.pixels.path_sampler(state.pixel);
        let u = || sampler.get2(state.sample, dimensions::of_lobe(state.branch, first));
        let selection = self.input.selection.as_ref().filter(|_| !lobe.is_delta());
        let cell = selection.map_or(0, |selection| selection.cell(si.p));
        for (child, scattered) in (first..).zip(lobe.sample(wo, si.ns, u)) {
            let Some(Scattered { wi: sent, share, tint, transmitted, pdf }) = scattered else {
                continue;
            };
            let wi = optics::keep_side(sent, si.ng, outside != transmitted.is_some());
            // Light samples do not stand for directions that were mirrored.
            let pdf = if wi == sent { pdf as f32 } else { 0.0 };
            let (start, medium) = match transmitted {
                Some(_) => (starts.transmitted, starts.behind),
                None => (starts.reflected, state.medium),
            };
            let cone = match self.renderer.plan.textures {
                true => state.cone.scattered(self.renderer.scene, si, outside, transmitted),
                false => state.cone,
            };
            let throughput = state.throughput * share * tint;
            let branch = dimensions::branch(state.branch, child);
            let next = PathState { throughput, medium, pdf, branch, cell, cone, ..*state };
            let sent = self.push::<NESTED>(start, wi, next);
            self.counts[lobe.ray_kind()] += u64::from(sent);
        }
    }

    /// Queues a ray unless its weight is below the cut-off; says whether it did.
    fn push<const NESTED: bool>(
        &mut self,
        (si, inside): (&SurfaceInteraction, &MediumStack),
        dir: DVec3,
        next: PathState,
    ) -> bool {
        let settings = self.renderer.settings;
        // Without a sign, and so that a NaN is not below: neither is dropped unseen.
        let [r, g, b] = next.throughput.to_array().map(f32::abs);
        let least = settings.cutoff.max(f32::MIN_POSITIVE);
        if r < least && g < least && b < least {
            return false;
        }
        // Two negative weights would make light that looks right.
        self.pixels.check(next.pixel, next.sample, next.throughput);
        self.next_rays.push(si.spawn(dir, settings.rules.spawn_offset));
        if NESTED {
            self.next_interiors.push(*inside);
        }
        self.next_states.push(next);
        true
    }
}

/// Where scattered rays start, and the ranked glass around them.
struct Starts<'w> {
    reflected: (&'w SurfaceInteraction, &'w MediumStack),
    transmitted: (&'w SurfaceInteraction, &'w MediumStack),
    /// The glass without a priority that transmitted rays are in.
    behind: Option<MaterialId>,
}

impl PathState {
    fn place(&self) -> SamplePlace {
        SamplePlace { pixel: self.pixel, sample: self.sample, branch: self.branch }
    }
}

/// Keeps, per pixel, the first hit of the camera sample nearest the pixel's middle.
fn record(
    renderer: &Renderer,
    input: &FrameInput,
    pixels: &mut BlockPixels,
    rays: &[Ray],
    hits: &[Option<Hit>],
    states: &[PathState],
) {
    let scene = renderer.scene;
    for ((ray, hit), state) in rays.iter().zip(hits).zip(states) {
        if !pixels.is_nearest(state.pixel as usize, state.sample) {
            continue;
        }
        let record = hit.map_or(GPixel::EMPTY, |hit| {
            let si = SurfaceInteraction::new(scene, ray, &hit);
            let material = &scene.materials[si.surface.material as usize];
            let wo = -ray.dir.normalize();
            let ns = material
                .normal_map
                .as_ref()
                .map_or(si.ns, |map| normal_map::normal(scene, map, &si, wo, state.cone));
            let normal = if si.is_outside(ray.dir) { -ns } else { ns };
            let along = (si.p - input.camera.eye).dot(input.camera.forward);
            let spheres = hit.prim.geom_id == scene.sphere_geom_id();
            let index = hit.prim.geom_id + if spheres { hit.prim.prim_id } else { 0 };
            GPixel {
                depth: scene.recentring.length_to_world(along) as f32,
                position: scene.recentring.point_to_world(si.p).as_vec3(),
                normal: normal.as_vec3(),
                albedo: lobe::albedo(scene, material, &si, -ray.dir, state.cone),
                mesh_id: index + 1,
            }
        });
        pixels.set_record(state.pixel as usize, record);
    }
}
