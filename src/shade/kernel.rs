//! The kernel: radiance of one block of pixels, specialised by the effects that run.
//!
//! A block is 8 x 8 pixels at a fixed place of the image. Every batch of rays is made of one
//! block's rays only, so that a pixel's bytes depend neither on the crop nor on the threads.
//! Per block: camera rays in packets, specular rays one by one until none is left, then shadow
//! rays light by light. All buffers live in [`Scratch`]; nothing is allocated per pixel.

use super::lighting::{LitPoint, ShadowScratch};
use super::optics;
use super::pixels::BlockPixels;
use super::surface::{albedo, emitted};
use super::{FrameInput, Renderer};
use crate::film::GPixel;
use crate::intersect::{Hit, Ray, SurfaceInteraction};
use crate::math::{DVec3, Rgb};
use crate::scene::{Glass, Material};
use crate::stats::RayCounts;

/// Camera rays traced together: enough for packets, few enough to stay in the L1 cache.
const CHUNK: usize = 256;

/// A ray's place in its camera sample's tree.
#[derive(Debug, Clone, Copy)]
struct PathState {
    /// Product of weights so far.
    throughput: Rgb,
    /// Index of the pixel in the block.
    pixel: u32,
    /// Camera sample.
    sample: u32,
    /// Which branch of the tree: 1 at the root, then 2b (reflected) and 2b + 1 (refracted).
    branch: u32,
}

/// Buffers of one worker thread.
#[derive(Default)]
pub(super) struct Scratch {
    rays: Vec<Ray>,
    states: Vec<PathState>,
    hits: Vec<Option<Hit>>,
    next_rays: Vec<Ray>,
    next_states: Vec<PathState>,
    lit: Vec<LitPoint>,
    shadow: ShadowScratch,
}

/// Renders one block into `pixels`, which holds its radiance sums and records.
pub(super) fn block<const MIRROR: bool, const GLASS: bool, const AREA: bool, const SKY: bool>(
    renderer: &Renderer,
    input: &FrameInput,
    pixels: &mut BlockPixels,
    scratch: &mut Scratch,
) -> RayCounts {
    let mut counts = RayCounts::default();
    let samples_per_chunk = (CHUNK / pixels.len().max(1)).max(1) as u32;
    let mut first = 0;
    while first < renderer.settings.spp {
        let last = (first + samples_per_chunk).min(renderer.settings.spp);
        camera_rays(renderer, input, pixels, first..last, scratch);
        counts.camera += scratch.rays.len() as u64;
        trace_paths::<MIRROR, GLASS>(renderer, input, pixels, scratch, &mut counts);
        let Scratch { lit, shadow, .. } = scratch;
        renderer.light_points::<AREA, SKY>(input, lit, pixels, shadow, &mut counts);
        first = last;
    }
    counts
}

fn camera_rays(
    renderer: &Renderer,
    input: &FrameInput,
    pixels: &mut BlockPixels,
    samples: std::ops::Range<u32>,
    scratch: &mut Scratch,
) {
    scratch.rays.clear();
    scratch.states.clear();
    for sample in samples {
        for pixel in 0..pixels.len() {
            let (x, y) = pixels.sample_position(renderer, input, pixel, sample);
            scratch.rays.push(Ray::new(input.camera.eye, input.camera.direction(x, y)));
            let throughput = Rgb::ONE;
            scratch.states.push(PathState { throughput, pixel: pixel as u32, sample, branch: 1 });
        }
    }
}

fn trace_paths<const MIRROR: bool, const GLASS: bool>(
    renderer: &Renderer,
    input: &FrameInput,
    pixels: &mut BlockPixels,
    scratch: &mut Scratch,
    counts: &mut RayCounts,
) {
    let Scratch { rays, states, hits, next_rays, next_states, lit, .. } = scratch;
    lit.clear();
    for depth in 0..=renderer.settings.bounces {
        hits.clear();
        hits.resize(rays.len(), None);
        if depth == 0 {
            renderer.intersector.intersect_batch(rays, hits, counts);
            if pixels.wants_records() {
                record(renderer, input, pixels, rays, hits, states);
            }
        } else {
            for (ray, hit) in rays.iter().zip(hits.iter_mut()) {
                *hit = renderer.intersector.intersect(ray, counts);
            }
        }
        next_rays.clear();
        next_states.clear();
        let mut vertex = Vertex { renderer, pixels, lit, next_rays, next_states, counts };
        let may_bounce = depth < renderer.settings.bounces;
        for ((ray, hit), state) in rays.iter().zip(hits.iter()).zip(states.iter()) {
            match hit {
                None => vertex.escape(state),
                Some(hit) => vertex.meet::<MIRROR, GLASS>(ray, hit, state, may_bounce),
            }
        }
        if !(MIRROR || GLASS) || next_rays.is_empty() {
            break;
        }
        std::mem::swap(rays, next_rays);
        std::mem::swap(states, next_states);
    }
}

/// Where one generation of rays ends and the next begins.
struct Vertex<'v, 'r> {
    renderer: &'v Renderer<'r>,
    pixels: &'v mut BlockPixels,
    lit: &'v mut Vec<LitPoint>,
    next_rays: &'v mut Vec<Ray>,
    next_states: &'v mut Vec<PathState>,
    counts: &'v mut RayCounts,
}

impl Vertex<'_, '_> {
    fn escape(&mut self, state: &PathState) {
        let sky = self.renderer.scene.sky.radiance;
        self.pixels.add(state.pixel, state.throughput * sky);
    }

    fn meet<const MIRROR: bool, const GLASS: bool>(
        &mut self,
        ray: &Ray,
        hit: &Hit,
        state: &PathState,
        may_bounce: bool,
    ) {
        let scene = self.renderer.scene;
        let si = SurfaceInteraction::new(scene, ray, hit);
        let material = &scene.materials[si.surface.material as usize];
        let wo = -ray.dir.normalize();
        let le = emitted(material, si.is_outside(wo));
        if le != Rgb::ZERO {
            self.pixels.add(state.pixel, state.throughput * le);
        }
        if material.diffuse != Rgb::ZERO {
            let albedo = albedo(scene, material, &si);
            let reflectance = state.throughput * albedo;
            let lit = LitPoint::new(self.renderer, (&si, ray, hit), wo, reflectance, state.place());
            self.lit.push(lit);
        }
        if MIRROR && may_bounce && material.mirror != Rgb::ZERO {
            self.mirror(&si, wo, material, state);
        }
        if GLASS && may_bounce {
            if let Some(glass) = &material.glass {
                self.glass(&si, wo, glass, state);
            }
        }
    }

    fn mirror(
        &mut self,
        si: &SurfaceInteraction,
        wo: DVec3,
        material: &Material,
        state: &PathState,
    ) {
        let dir = optics::keep_side(optics::reflect(wo, si.ns), si.ng, si.is_outside(wo));
        if self.push(si, dir, state, state.throughput * material.mirror, 2) {
            self.counts.mirror += 1;
        }
    }

    fn glass(&mut self, si: &SurfaceInteraction, wo: DVec3, glass: &Glass, state: &PathState) {
        let outside = si.is_outside(wo);
        let eta = if outside { glass.ior } else { 1.0 / glass.ior };
        let split = optics::split(wo, si.ns, eta);
        let reflected = optics::keep_side(optics::reflect(wo, si.ns), si.ng, outside);
        let weight = state.throughput * split.reflectance as f32;
        self.counts.glass += u64::from(self.push(si, reflected, state, weight, 2));
        if let Some(refracted) = split.refracted {
            let refracted = optics::keep_side(refracted, si.ng, !outside);
            let weight = state.throughput * (1.0 - split.reflectance) as f32 * glass.tint;
            self.counts.glass += u64::from(self.push(si, refracted, state, weight, 3));
        }
    }

    /// Queues a ray unless its weight is below the cut-off; says whether it did.
    fn push(
        &mut self,
        si: &SurfaceInteraction,
        dir: DVec3,
        from: &PathState,
        throughput: Rgb,
        child: u32,
    ) -> bool {
        let settings = self.renderer.settings;
        if throughput.max_element() < settings.cutoff.max(f32::MIN_POSITIVE) {
            return false;
        }
        self.next_rays.push(si.spawn(dir, settings.rules.spawn_offset));
        // 2b and 2b + 1; the tree is at most 31 deep before branches share dimensions.
        let branch = from.branch.wrapping_mul(2) + (child - 2);
        self.next_states.push(PathState { throughput, branch, ..*from });
        true
    }
}

impl PathState {
    fn place(&self) -> super::lighting::SamplePlace {
        super::lighting::SamplePlace { pixel: self.pixel, sample: self.sample, branch: self.branch }
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
        if !pixels.is_nearest(renderer, input, state.pixel as usize, state.sample) {
            continue;
        }
        let record = hit.map_or(GPixel::EMPTY, |hit| {
            let si = SurfaceInteraction::new(scene, ray, &hit);
            let material = &scene.materials[si.surface.material as usize];
            let normal = if si.is_outside(ray.dir) { -si.ns } else { si.ns };
            let along = (si.p - input.camera.eye).dot(input.camera.forward);
            let spheres = hit.prim.geom_id == scene.sphere_geom_id();
            let index = hit.prim.geom_id + if spheres { hit.prim.prim_id } else { 0 };
            GPixel {
                depth: scene.recentring.length_to_world(along) as f32,
                position: scene.recentring.point_to_world(si.p).as_vec3(),
                normal: normal.as_vec3(),
                albedo: albedo(scene, material, &si),
                mesh_id: index + 1,
            }
        });
        pixels.set_record(state.pixel as usize, record);
    }
}
