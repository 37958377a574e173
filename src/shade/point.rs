//! Diffuse points that wait for light, with the paths that lead to them.

use super::light::LightSampler;
use super::normal_map;
use crate::intersect::{Hit, Ray, SurfaceInteraction};
use crate::math::{DVec3, Rgb};
use std::f32::consts::FRAC_1_PI;

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
    pub hit: Hit,
    /// Geometric normal on the viewer's side.
    pub ng: DVec3,
    /// Shading normal on the viewer's side, without what a normal map adds: shadows and reuse know it alone.
    pub n: DVec3,
    /// The normal map's on the viewer's side; `n` without one.
    pub mapped: DVec3,
    /// Radiance towards the camera per unit of irradiance.
    pub weight: Rgb,
    pub place: SamplePlace,
}

impl ShadingPoint {
    /// The point `si` where `ray` hit, seen from `wo`, whose reflected light reaches the camera
    /// times `reflectance`. Its normal by a map is `mapped`.
    pub fn new(
        (si, ray, hit): (&SurfaceInteraction, &Ray, &Hit),
        mapped: DVec3,
        wo: DVec3,
        reflectance: Rgb,
        place: SamplePlace,
    ) -> Self {
        let side = if si.is_outside(wo) { 1.0 } else { -1.0 };
        let [n, ng, mapped] = [si.ns, si.ng, mapped].map(|n| n * side);
        let weight = reflectance * FRAC_1_PI;
        Self { si: *si, ray: *ray, hit: *hit, ng, n, mapped, weight, place }
    }

    /// Whether a normal map turns the normal.
    #[inline(always)]
    pub fn is_mapped(&self) -> bool {
        self.mapped != self.n
    }

    /// Irradiance from a light that nothing is in the way of, per unit of emission.
    #[inline(always)]
    pub fn unshadowed(&self, light: &LightSampler) -> f64 {
        match self.is_mapped() {
            false => light.unshadowed(self.si.p, self.n),
            true => normal_map::unshadowed(light, self.si.p, self.n, self.mapped),
        }
    }
}
