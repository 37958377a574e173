//! A quad light.

use super::flat::Flat;
use super::{LightSample, ShadowTarget, irradiance};
use crate::intersect::PlaneError;
use crate::math::DVec3;
use crate::sampling::QuadWarp;
use crate::scene::QuadLight;

/// A flat convex quad.
pub(super) struct Quad {
    warp: QuadWarp,
    corners: [DVec3; 4],
    plane: Flat,
    two_sided: bool,
}

impl Quad {
    pub fn new(light: &QuadLight) -> Self {
        let plane_error = PlaneError::of_quad(light);
        Self {
            warp: QuadWarp::new(light.corners),
            corners: light.corners,
            plane: Flat { normal: light.normal(), plane_error, area: light.area() },
            two_sided: light.two_sided,
        }
    }

    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        if !self.reaches(p) {
            return 0.0;
        }
        irradiance::polygon(p, n, &self.corners)
    }

    /// Whether it emits towards `p`.
    pub fn reaches(&self, p: DVec3) -> bool {
        self.two_sided || self.plane.normal.dot(p - self.corners[0]) > 0.0
    }

    /// Uniform over the area.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, u: [f64; 2]) -> LightSample {
        self.plane.sample_li(p, self.warp.point(u))
    }

    pub fn pdf_li(&self, p: DVec3, point: DVec3) -> f64 {
        self.plane.pdf(p, point).per_steradian()
    }

    pub fn above(&self, p: DVec3, n: DVec3) -> Option<ShadowTarget> {
        let point = irradiance::middle_above(p, n, &self.warp.corners())?;
        Some(self.plane.target(point))
    }
}
