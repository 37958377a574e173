//! Diffuse points that wait for light, with the paths that lead to them.

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
    /// Shading normal on the viewer's side.
    pub n: DVec3,
    /// Radiance towards the camera per unit of irradiance.
    pub weight: Rgb,
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
