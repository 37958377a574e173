//! A sun: a disk at infinity.

use super::{LightSample, Pdf, ShadowTarget, irradiance};
use crate::math::DVec3;
use crate::sampling::SphereCone;
use crate::scene::SunLight;

/// A disk of the sky, seen alike from everywhere.
pub(super) struct Sun {
    to_light: DVec3,
    sin: f64,
    /// `None` of a disk too small or too wide to be sampled.
    cone: Option<SphereCone>,
}

impl Sun {
    pub fn new(light: &SunLight) -> Self {
        let (to_light, sin) = (light.to_light, light.sin());
        Self { to_light, sin, cone: SphereCone::new(to_light, sin, DVec3::ZERO) }
    }

    /// As that of a sphere at distance 1 that is seen under the same angle.
    pub fn unshadowed(&self, n: DVec3) -> f64 {
        irradiance::sphere(DVec3::ZERO, n, self.to_light, self.sin)
    }

    pub fn seen(&self) -> Option<&SphereCone> {
        self.cone.as_ref()
    }
}

/// Uniform over the solid angle.
#[inline(always)] // Once for each shadow ray.
pub(super) fn sample_li(cone: &SphereCone, u: [f64; 2]) -> LightSample {
    let (wi, _) = cone.direction(u);
    let (target, pdf) =
        (ShadowTarget::Direction(wi), Pdf::SolidAngle { density: pdf_li(cone), drawn: wi });
    LightSample { target, wi, radiance: 1.0, pdf }
}

pub(super) fn pdf_li(cone: &SphereCone) -> f64 {
    1.0 / cone.solid_angle()
}

pub(super) fn above(cone: &SphereCone, n: DVec3) -> Option<ShadowTarget> {
    cone.above(n).map(|(wi, _)| ShadowTarget::Direction(wi))
}
