//! The constant sky as a light.

use super::{LightSample, ShadowTarget};
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
    basis: (DVec3, DVec3),
}

impl SkyView {
    pub fn above(n: DVec3) -> Self {
        Self { basis: orthonormal_basis(n) }
    }

    /// Weighted by the cosine, so that all samples count alike.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, n: DVec3, u: [f64; 2]) -> LightSample {
        let direction = to_world(cosine_hemisphere(u), self.basis, n);
        LightSample { target: ShadowTarget::Sky(direction), weight: 1.0 }
    }
}
