//! A point light.

use super::{LightSample, Pdf, ShadowTarget, is_lit};
use crate::intersect::{PlaneError, RayEnd};
use crate::math::DVec3;
use crate::scene::PointLight;

/// A point that emits alike in all directions.
pub(super) struct Point {
    position: DVec3,
}

impl Point {
    pub fn new(light: &PointLight) -> Self {
        Self { position: light.position }
    }

    /// The inverse square law times the cosine at the surface.
    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        let to_light = self.position - p;
        let d2 = to_light.length_squared();
        let cos = to_light.dot(n) / d2.sqrt();
        if is_lit(cos) { cos / d2 } else { 0.0 }
    }

    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3) -> LightSample {
        let point = self.position;
        let wi = (point - p).normalize();
        // No surface to stop short of: the normal along the ray costs a few ulp.
        let end = RayEnd { point, normal: -wi, plane_error: PlaneError::EXACT };
        LightSample {
            target: ShadowTarget::Point(end),
            wi,
            radiance: f64::INFINITY,
            pdf: Pdf::Delta,
        }
    }
}
