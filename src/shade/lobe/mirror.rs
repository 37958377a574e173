//! Perfect mirrors.

use super::Scattered;
use crate::math::{DVec3, Rgb};
use crate::shade::optics;

/// A perfect mirror, both sides.
pub(in crate::shade) struct Mirror {
    reflectance: Rgb,
}

impl Mirror {
    /// A mirror of this reflectance.
    #[inline(always)]
    pub fn new(reflectance: Rgb) -> Self {
        Self { reflectance }
    }

    /// The one direction that is seen along `wo`.
    #[inline(always)]
    pub fn sample(&self, wo: DVec3, n: DVec3) -> Scattered {
        let (wi, tint) = (optics::reflect(wo, n), self.reflectance);
        Scattered { wi, share: 1.0, tint, transmitted: None, pdf: 0.0 }
    }
}
