//! Smooth boundaries of clear media.

use super::Scattered;
use crate::math::{DVec3, Rgb};
use crate::scene::Glass;
use crate::shade::optics;

/// A smooth boundary between two clear media.
pub(in crate::shade) struct Dielectric {
    /// Index of refraction behind the boundary over that before it.
    pub eta: f64,
    /// Share of light that it lets through.
    pub tint: Rgb,
}

impl Dielectric {
    /// The boundary of a body of `glass`, seen from `outside` it or from inside.
    #[inline(always)]
    pub fn new(glass: &Glass, outside: bool) -> Self {
        Self { eta: if outside { glass.ior } else { 1.0 / glass.ior }, tint: glass.tint }
    }

    /// What is reflected and, but for total reflection, what is refracted.
    #[inline(always)]
    pub fn sample(&self, wo: DVec3, n: DVec3) -> [Option<Scattered>; 2] {
        let split = optics::split(wo, n, self.eta);
        let reflected = Scattered {
            wi: optics::reflect(wo, n),
            share: split.reflectance as f32,
            tint: Rgb::ONE,
            transmitted: None,
            pdf: 0.0,
        };
        let refracted = split.refracted.map(|wi| Scattered {
            wi,
            share: (1.0 - split.reflectance) as f32,
            tint: self.tint,
            transmitted: Some(self.eta),
            pdf: 0.0,
        });
        [Some(reflected), refracted]
    }
}
