//! A sphere light.

use super::{LightSample, Pdf, ShadowTarget, irradiance};
use crate::intersect::{PlaneError, RayEnd};
use crate::math::DVec3;
use crate::sampling::SphereCone;
use crate::scene::SphereLight;

/// A sphere that emits outwards.
pub(super) struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl Sphere {
    pub fn new(light: &SphereLight) -> Self {
        Self { centre: light.centre, radius: light.radius }
    }

    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        irradiance::sphere(p, n, self.centre, self.radius)
    }

    /// `None` from within. It sends `radiance` towards `p`, per unit of emission.
    pub fn seen_from(&self, p: DVec3, radiance: f64) -> Option<SphereView> {
        let cone = SphereCone::new(self.centre, self.radius, p)?;
        Some(SphereView { cone, centre: self.centre, radiance })
    }
}

/// A sphere as seen from one point.
pub(super) struct SphereView {
    cone: SphereCone,
    centre: DVec3,
    /// Per unit of emission.
    radiance: f64,
}

impl SphereView {
    /// Uniform over the solid angle (Shirley, Wang and Zimmerman, 1996).
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, u: [f64; 2]) -> LightSample {
        let (drawn, distance) = self.cone.direction(u);
        let point = p + drawn * distance;
        LightSample {
            target: self.target(point),
            wi: (point - p).normalize(),
            radiance: self.radiance,
            pdf: Pdf::SolidAngle { density: self.pdf_li(), drawn },
        }
    }

    pub fn pdf_li(&self) -> f64 {
        1.0 / self.cone.solid_angle()
    }

    pub fn above(&self, p: DVec3, n: DVec3) -> Option<ShadowTarget> {
        let (dir, distance) = self.cone.above(n)?;
        Some(self.target(p + dir * distance))
    }

    fn target(&self, point: DVec3) -> ShadowTarget {
        let normal = (point - self.centre).normalize();
        ShadowTarget::Point(RayEnd { point, normal, plane_error: PlaneError::EXACT })
    }
}
