//! Lights as glossy surfaces reflect them.
//!
//! What a lobe with an extent reflects of a light is estimated twice: by shadow rays to points of the light,
//! here, and by the rays that follow the lobe's directions and may end on the light. Multiple importance
//! sampling with the balance heuristic joins the two (Veach and Guibas, 1995). It depends on the view, so that nothing
//! is kept for other frames.

use super::direct::{BATCH, LightSource, ShadowScratch, ShadowStarts};
use super::light::{LightSample, LightView, SampleSink, ShadowTarget};
use super::lobe::Lobe;
use super::pixels::BlockPixels;
use super::point::SamplePlace;
use super::{FrameInput, Renderer};
use crate::math::{DVec3, Rgb};
use crate::stats::RayCounts;

/// A point of a surface with a lobe that lights are reflected by.
pub(super) struct GlossyPoint {
    pub lobe: Lobe,
    /// Scene space.
    pub p: DVec3,
    /// The lobe's normal, unit.
    pub n: DVec3,
    /// Unit geometric normal on the viewer's side.
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
    view: &'s LightView<'s>,
    source: &'s LightSource,
    /// Unshadowed irradiance, which a delta light sends from its one direction.
    exact: f64,
    scratch: &'s mut ShadowScratch,
}

impl SampleSink for HighlightRays<'_> {
    fn push(&mut self, sample: LightSample) {
        let GlossyPoint { lobe, p, n, ng, wo, starts, .. } = self.point;
        let (wi, density) = match sample.target {
            ShadowTarget::Point(end) => {
                ((end.point - *p).normalize(), self.view.pdf_li(*p, end.point))
            }
            ShadowTarget::Direction(wi) | ShadowTarget::Sky(wi) => (wi, None),
        };
        // The lobe's rays below the facet are mirrored and count whole.
        if wi.dot(*ng) <= 0.0 {
            return;
        }
        let count = f64::from(self.source.samples);
        let irradiance = density.map_or(self.exact, |density| {
            let share = self.source.share(density, lobe.pdf(*wo, wi));
            let radiance = self.source.sampler.radiance_at(*p);
            radiance * wi.dot(*n).max(0.0) / (density * count) * share
        });
        let seen = lobe.f(*wo, wi) * irradiance as f32;
        if seen != Rgb::ZERO {
            self.scratch.push_highlight(starts.ray_to(&sample.target), seen);
        }
    }
}

impl LightSource {
    /// The part of a light that its own samples, of density `light`, see, where rays of density `lobe` may end
    /// on it too.
    fn share(&self, light: f64, lobe: f64) -> f64 {
        if !self.sampler.is_seen() {
            return 1.0;
        }
        // In this form for a light seen in its own plane, whose density is infinite.
        1.0 / (1.0 + lobe / (light * f64::from(self.samples)))
    }
}

impl Renderer<'_> {
    /// The part of the emission at the point `p` of the light with number `light` that a ray counts which was
    /// sent from `org` by a lobe with density `lobe`.
    pub(super) fn share_of_lobe(
        &self,
        input: &FrameInput,
        light: Option<u32>,
        (org, p): (DVec3, DVec3),
        lobe: f64,
    ) -> f32 {
        let source = input.lights.iter().find(|source| Some(source.number) == light);
        let density = source.and_then(|source| {
            let view = source.sampler.seen_from(org, DVec3::Z)?;
            Some(source.share(view.pdf_li(org, p)?, lobe))
        });
        (1.0 - density.unwrap_or(0.0)) as f32
    }

    /// Adds the lights that glossy `points` reflect to their pixels. The sky is seen by the lobes' own rays.
    pub(super) fn light_highlights(
        &self,
        input: &FrameInput,
        points: &[GlossyPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let lights = input.lights.iter().filter(|source| !source.is_sky());
        for source in lights {
            let n = source.samples as usize;
            let mut u = s.samples(n);
            for group in points.chunks((BATCH / n).max(1)) {
                s.clear();
                for point in group {
                    let exact = source.sampler.unshadowed(point.p, point.n);
                    let seen = match exact {
                        0.0 => None,
                        _ => source.sampler.seen_from(point.p, point.n),
                    };
                    if let Some(view) = &seen {
                        let first = point.place.sample.wrapping_mul(source.samples);
                        self.fill(&point.place, source, first, pixels, &mut u);
                        let scratch = &mut *s;
                        let mut rays = HighlightRays { point, view, source, exact, scratch };
                        view.sample_li(point.p, point.n, &u, &mut rays);
                    }
                    s.close();
                }
                self.trace_shadow_rays(source, s, counts);
                for (point, seen) in group.iter().zip(s.highlights()) {
                    let light = point.throughput * source.sampler.emission * seen;
                    pixels.add(point.place.pixel, point.place.sample, light);
                }
            }
            s.give_back(u);
        }
    }
}
