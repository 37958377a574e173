//! The constant sky as a light.

use super::{LightSample, Pdf, ShadowTarget};
use crate::math::{DVec3, orthonormal_basis};
use crate::sampling::{cosine_hemisphere, to_world};

/// The sky over any surface.
pub(super) struct SkyDome;

impl SkyDome {
    /// A constant sky of radiance L sends the irradiance πL to an open surface.
    pub fn unshadowed(&self) -> f64 {
        std::f64::consts::PI
    }
}

/// The hemisphere over one surface point.
pub(super) struct SkyView {
    n: DVec3,
    basis: (DVec3, DVec3),
}

impl SkyView {
    pub fn above(n: DVec3) -> Self {
        Self { n, basis: orthonormal_basis(n) }
    }

    /// By the cosine, so that all samples count alike.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, u: [f64; 2]) -> LightSample {
        let local = cosine_hemisphere(u);
        let wi = to_world(local, self.basis, self.n);
        let (target, pdf) = (ShadowTarget::Sky(wi), Pdf::Cosine(local.z));
        LightSample { target, wi, radiance: 1.0, pdf }
    }
}
