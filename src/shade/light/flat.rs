//! What flat lights have in common.

use super::{LightSample, ShadowTarget};
use crate::intersect::{PlaneError, RayEnd};
use crate::math::DVec3;

/// The plane of a flat light.
pub(super) struct Flat {
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// What f32 may make of the triangles that show it.
    pub plane_error: PlaneError,
}

impl Flat {
    /// `point` of the light, one of many that are uniform over its area, as seen from `p` with unit normal `n`.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, n: DVec3, point: DVec3) -> LightSample {
        let to_light = point - p;
        let d2 = to_light.length_squared();
        let cos_light = to_light.dot(self.normal).abs();
        let weight = (to_light.dot(n) * cos_light / (d2 * d2)).max(0.0);
        LightSample { weight, ..self.alone(point) }
    }

    /// Density per steradian at `point`, seen from `p`, of points that are uniform over `area`.
    pub fn pdf_li(&self, p: DVec3, point: DVec3, area: f64) -> f64 {
        let to_light = point - p;
        let d2 = to_light.length_squared();
        d2 * d2.sqrt() / (to_light.dot(self.normal).abs() * area)
    }

    /// `point` of the light where it stands for all of it.
    #[inline(always)]
    pub fn alone(&self, point: DVec3) -> LightSample {
        let target = RayEnd { point, normal: self.normal, plane_error: self.plane_error };
        LightSample { target: ShadowTarget::Point(target), weight: 1.0 }
    }
}
