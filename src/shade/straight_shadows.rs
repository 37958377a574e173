//! Light that shadow rays find behind glass: straight through, less what the glass reflects, tints and absorbs.
//!
//! Real glass bends light, and gathers it in caustics; this is a stand-in that a scene may choose
//! ([`GlassShadows::Straight`](crate::scene::GlassShadows)). Diffuse surfaces and fog see light so. Glossy ones see lights without a surface
//! so behind polished glass; they see lamps and skies, and all that lies behind rough glass, by the rays of their lobes. What glass reflects depends on the angle on its outer side at both crossings, as in a pane. Rough
//! glass counts as polished. Where bodies overlap, each takes its share.

use super::cone::RayCone;
use super::lobe::glass_at;
use super::{Renderer, medium, optics};
use crate::intersect::{Ray, SurfaceInteraction};
use crate::math::Rgb;
use crate::scene::Glass;
use crate::stats::{RayCounts, RayKind};

/// Surfaces of glass that a shadow ray passes at most.
const MOST_PASSED: usize = 64;

impl Renderer<'_> {
    /// The part of light that arrives along a shadow ray that meets something: none if that is no glass, or `if_polished` and it is
    /// rough.
    pub(super) fn through_glass(
        &self,
        ray: &Ray,
        if_polished: bool,
        counts: &mut RayCounts,
    ) -> Rgb {
        let scene = self.scene;
        let (mut ray, mut left) = (*ray, Rgb::ONE);
        let unit = scene.recentring.length_to_world(ray.dir.length());
        // The way from the last surface to the light's own, and the body that it lies in.
        let (mut rest, mut body): (f64, Option<Glass>) = (1.0, None);
        for _ in 0..MOST_PASSED {
            counts[RayKind::ThroughGlass] += 1;
            let Some(hit) = self.intersector.intersect(&ray, counts) else {
                // Without an end, it leaves a body that is open.
                let body = body.filter(|_| ray.tfar.is_finite());
                let rest = rest.max(0.0) * unit;
                return left * body.map_or(Rgb::ONE, |body| medium::transmittance(&body, rest));
            };
            rest -= hit.t;
            let si = SurfaceInteraction::new(scene, &ray, &hit);
            let material = &scene.materials[si.surface.material as usize];
            let wo = -ray.dir.normalize();
            let seen = (&si, wo, RayCone { width: 0.0, spread: 0.0 });
            let Some(part) = glass_at(scene, material, seen) else { return Rgb::ZERO };
            let glass = &part.glass;
            if if_polished && glass.is_rough() {
                return Rgb::ZERO;
            }
            left *= part.share;
            let is_inner = !glass.thin && !si.is_outside(wo);
            if let Some(body) = body.or(is_inner.then_some(*glass)) {
                left *= medium::transmittance(&body, hit.t * unit);
            }
            let cos = wo.dot(si.ns);
            if glass.thin {
                left *= glass.tint * (1.0 - optics::pane_reflectance(cos, glass.ior)) as f32;
            } else {
                left *= glass.tint * (1.0 - optics::reflectance(cos.abs(), glass.ior)) as f32;
                // Where a ray leaves one body the next surface says whether it lies in another.
                body = (!is_inner).then_some(*glass);
            }
            if left.max_element() < self.settings.cutoff {
                return Rgb::ZERO;
            }
            let next = si.spawn(ray.dir, self.settings.rules.spawn_offset);
            ray = Ray { tfar: ray.tfar - hit.t, ..next };
        }
        Rgb::ZERO
    }
}
