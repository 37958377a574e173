//! A quad light.

use super::{LightSample, ShadowTarget, irradiance};
use crate::intersect::{Facet, Target};
use crate::math::DVec3;
use crate::sampling::QuadWarp;
use crate::scene::QuadLight;

/// A flat convex quad.
pub(super) struct Quad {
    warp: QuadWarp,
    corners: [DVec3; 4],
    /// Unit normal of the emitting side.
    normal: DVec3,
    two_sided: bool,
    /// What f32 may make of its two triangles.
    facet: Facet,
}

impl Quad {
    pub fn new(light: &QuadLight) -> Self {
        Self {
            warp: QuadWarp::new(light.corners),
            corners: light.corners,
            normal: light.normal(),
            two_sided: light.two_sided,
            facet: Facet::of_quad(&light.corners),
        }
    }

    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        if !self.two_sided && self.normal.dot(p - self.corners[0]) <= 0.0 {
            return 0.0;
        }
        irradiance::polygon(p, n, &self.corners)
    }

    pub fn seen(&self) -> QuadView<'_> {
        QuadView { warp: &self.warp, normal: self.normal, facet: self.facet }
    }
}

/// A quad as seen from any point.
pub(super) struct QuadView<'a> {
    warp: &'a QuadWarp,
    normal: DVec3,
    facet: Facet,
}

impl QuadView<'_> {
    /// Uniform over the area.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, n: DVec3, u: [f64; 2]) -> LightSample {
        let point = self.warp.point(u);
        let to_light = point - p;
        let d2 = to_light.length_squared();
        let cos_light = to_light.dot(self.normal).abs();
        let weight = (to_light.dot(n) * cos_light / (d2 * d2)).max(0.0);
        LightSample { target: self.target(point), weight }
    }

    pub fn above(&self, p: DVec3, n: DVec3) -> Option<LightSample> {
        let point = irradiance::middle_above(p, n, &self.warp.corners())?;
        Some(LightSample { target: self.target(point), weight: 1.0 })
    }

    fn target(&self, point: DVec3) -> ShadowTarget {
        ShadowTarget::Point(Target { point, normal: self.normal, facet: self.facet })
    }
}
