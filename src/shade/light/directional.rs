//! A directional light.

use super::{LightSample, ShadowTarget, is_lit};
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
        LightSample::of_delta(ShadowTarget::Direction(self.to_light))
    }
}
