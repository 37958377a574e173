//! A directional light.

use super::{LightSample, Pdf, ShadowTarget, is_lit};
use crate::math::DVec3;
use crate::scene::DirectionalLight;

/// Parallel light from infinitely far.
pub(super) struct Directional {
    to_light: DVec3,
}

impl Directional {
    pub fn new(light: &DirectionalLight) -> Self {
        Self { to_light: light.to_light }
    }

    /// The cosine at the surface.
    pub fn unshadowed(&self, n: DVec3) -> f64 {
        let cos = self.to_light.dot(n);
        if is_lit(cos) { cos } else { 0.0 }
    }

    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self) -> LightSample {
        let wi = self.to_light;
        let (target, pdf) = (ShadowTarget::Direction(wi), Pdf::Delta);
        LightSample { target, wi, radiance: f64::INFINITY, pdf }
    }
}
