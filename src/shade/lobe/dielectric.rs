//! Smooth boundaries of clear media, and thin panes.

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

/// A pane of glass without thickness, with the same medium on both sides.
pub(in crate::shade) struct Pane {
    /// Index of refraction of the glass over that of the medium around it.
    ior: f64,
    /// Share of the light that is not reflected which it lets through.
    tint: Rgb,
}

impl Pane {
    /// A pane of `glass`.
    pub fn new(glass: &Glass) -> Self {
        Self { ior: glass.ior, tint: glass.tint }
    }

    /// What is reflected at a surface with the unit normal `n` on either side, and what goes straight through.
    pub fn sample(&self, wo: DVec3, n: DVec3) -> [Option<Scattered>; 2] {
        let reflectance = optics::pane_reflectance(wo.dot(n), self.ior);
        let delta = |wi, share: f64, tint, transmitted| {
            Some(Scattered { wi, share: share as f32, tint, transmitted, pdf: 0.0 })
        };
        let reflected = delta(optics::reflect(wo, n), reflectance, Rgb::ONE, None);
        // An index of 1: rays are not bent.
        [reflected, delta(-wo, 1.0 - reflectance, self.tint, Some(1.0))]
    }
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
