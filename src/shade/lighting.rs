//! Direct light at diffuse points: shadow rays in batches, light by light.
//!
//! For an area light the estimate is `ratio · exact`: the samples' ratio of shadowed to
//! unshadowed irradiance times the unshadowed irradiance in closed form. Where nothing is in the
//! way there is no noise at all, and the ratio is what later frames can reuse.

use super::light::{self, AreaLight, LightSample, ShadowTarget};
use super::pixels::BlockPixels;
use super::{FrameInput, Renderer};
use crate::intersect::{Facet, Hit, Ray, SpawnPoint, SurfaceInteraction, Target, lift_to_smooth};
use crate::math::{DVec3, Rgb, orthonormal_basis};
use crate::sampling::{cosine_hemisphere, to_world};
use crate::scene::Light;
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
pub(super) struct LitPoint {
    p: DVec3,
    /// Geometric normal on the viewer's side.
    ng: DVec3,
    /// Shading normal on the viewer's side.
    n: DVec3,
    /// Where rays to the sky start: from the facet.
    facet: SpawnPoint,
    /// Where rays to lights start: from the smooth surface that the facet stands for.
    smooth: SpawnPoint,
    /// Radiance towards the camera per unit of irradiance.
    weight: Rgb,
    place: SamplePlace,
}

impl LitPoint {
    /// The point `si` where `ray` hit, seen from `wo`, whose reflected light reaches the camera
    /// times `reflectance`.
    pub fn new(
        renderer: &Renderer,
        (si, ray, hit): (&SurfaceInteraction, &Ray, &Hit),
        wo: DVec3,
        reflectance: Rgb,
        place: SamplePlace,
    ) -> Self {
        let outside = si.is_outside(wo);
        let (n, ng) = if outside { (si.ns, si.ng) } else { (-si.ns, -si.ng) };
        let settings = renderer.settings;
        let offset = settings.rules.spawn_offset;
        let facet = si.shadow_start(ng, DVec3::ZERO, offset);
        let smooth = if settings.smooth_terminator {
            si.shadow_start(ng, lift_to_smooth(renderer.scene, ray, hit, si, outside), offset)
        } else {
            facet
        };
        Self { p: si.p, ng, n, facet, smooth, weight: reflectance * FRAC_1_PI, place }
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
    fn push_sample(&mut self, point: &LitPoint, sample: &LightSample) {
        if sample.weight > 0.0 {
            self.push(point.smooth.to(&sample.target), sample.weight);
        }
    }

    /// Whether the present point has no ray yet.
    fn is_open(&self) -> bool {
        self.rays.len() == self.spans.last().map_or(0, |span| span.end)
    }

    /// Ends a point's rays.
    fn close(&mut self, unshadowed: Rgb) {
        self.spans.push(Span { end: self.rays.len(), unshadowed });
    }
}

/// An area light with its place in the scene.
struct AreaSource<'a> {
    index: u32,
    light: &'a Light,
    area: &'a AreaLight,
}

impl Renderer<'_> {
    /// Adds the direct light of all `lit` points to their pixels.
    pub(super) fn light_points<const AREA: bool, const SKY: bool>(
        &self,
        input: &FrameInput,
        lit: &[LitPoint],
        pixels: &mut BlockPixels,
        scratch: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
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
                    self.area_light(&source, lit, pixels, scratch, counts);
                }
                Light::Point { .. } | Light::Directional { .. } if self.plan.delta_lights => {
                    self.delta_light(light, lit, pixels, scratch, counts);
                }
                _ => {}
            }
        }
        if SKY {
            self.sky_light(lit, pixels, scratch, counts);
        }
    }

    fn area_light(
        &self,
        source: &AreaSource,
        lit: &[LitPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = self.settings.shadow_samples as usize;
        let radiance = light::radiance(source.light);
        for group in lit.chunks((BATCH / n).max(1)) {
            s.clear();
            for point in group {
                if let Some((seen, exact)) = source.area.seen_from(point.p, point.n) {
                    self.fill(&point.place, source.index, n, pixels, &mut s.u);
                    for k in 0..n {
                        let sample = seen.sample(point.p, point.n, s.u[k].map(f64::from));
                        s.push_sample(point, &sample);
                    }
                    if s.is_open() {
                        // All below the horizon, but some of the light is above: a point of that
                        // decides, or the horizon's own shadow would be counted twice.
                        if let Some(sample) = seen.above(point.p, point.n) {
                            s.push_sample(point, &sample);
                        }
                    }
                    s.close(radiance * exact as f32);
                } else {
                    s.close(Rgb::ZERO);
                }
            }
            counts.shadow_area += s.rays.len() as u64;
            self.settle(group, pixels, s, counts);
        }
    }

    fn delta_light(
        &self,
        light: &Light,
        lit: &[LitPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        for group in lit.chunks(BATCH) {
            s.clear();
            for point in group {
                let sent = light::delta(light, point.p, point.n);
                if let Some((_, target)) = sent {
                    let ray = match target {
                        // No surface to stop short of: the normal along the ray costs a few ulp.
                        ShadowTarget::Point(q) => point.smooth.to(&Target {
                            point: q,
                            normal: (point.p - q).normalize(),
                            facet: Facet::EXACT,
                        }),
                        ShadowTarget::Direction(d) => point.smooth.along(d),
                    };
                    s.push(ray, 1.0);
                }
                s.close(sent.map_or(Rgb::ZERO, |(irradiance, _)| irradiance));
            }
            counts.shadow_delta += s.rays.len() as u64;
            self.settle(group, pixels, s, counts);
        }
    }

    fn sky_light(
        &self,
        lit: &[LitPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = self.settings.sky_samples as usize;
        // A constant sky of radiance L sends the irradiance πL to an open surface.
        let irradiance = self.scene.sky.radiance * std::f32::consts::PI;
        for group in lit.chunks((BATCH / n).max(1)) {
            s.clear();
            for point in group {
                let dimension = self.scene.lights.len() as u32;
                self.fill(&point.place, dimension, n, pixels, &mut s.u);
                let (ng, basis) = (point.ng, orthonormal_basis(point.n));
                for k in 0..n {
                    let local = cosine_hemisphere(s.u[k].map(f64::from));
                    let dir = to_world(local, basis, point.n);
                    // Below the facet but above the smooth surface that it stands for: the
                    // facet's own plane is no occluder.
                    let dir = super::optics::keep_side(dir, ng, true);
                    s.push(point.facet.along(dir), 1.0);
                }
                s.close(irradiance);
            }
            counts.shadow_sky += s.rays.len() as u64;
            self.settle(group, pixels, s, counts);
        }
    }

    /// Stratified points of one light and one place.
    fn fill(
        &self,
        place: &SamplePlace,
        light: u32,
        n: usize,
        pixels: &BlockPixels,
        u: &mut Vec<[f32; 2]>,
    ) {
        u.resize(n, [0.0; 2]);
        let dimension = self.dimension(place, light);
        let first = place.sample.wrapping_mul(n as u32);
        pixels.sampler(place.pixel).fill2(first, dimension, &mut u[..n]);
    }

    fn dimension(&self, place: &SamplePlace, light: u32) -> u32 {
        let lights = self.scene.lights.len() as u32 + 1;
        place.branch.wrapping_mul(lights).wrapping_add(light)
    }

    /// Traces the batch and adds `weight · unshadowed · ratio` to each point's pixel.
    fn settle(
        &self,
        group: &[LitPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        s.occluded.clear();
        s.occluded.resize(s.rays.len(), false);
        self.intersector.occluded_batch(&s.rays, &mut s.occluded, counts);
        let mut start = 0;
        for (point, span) in group.iter().zip(&s.spans) {
            let (mut open, mut all) = (0.0, 0.0);
            for k in start..span.end {
                all += s.weights[k];
                open += if s.occluded[k] { 0.0 } else { s.weights[k] };
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
