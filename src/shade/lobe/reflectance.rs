//! Reflectance that depends on the angle.

use crate::math::Rgb;

/// The reflectance of a smooth surface by angle (Schlick, 1994).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shade) struct Reflectance {
    /// At normal incidence.
    pub normal: Rgb,
    /// By how much it is larger at grazing angles.
    pub rise: Rgb,
}

impl Reflectance {
    /// The same at every angle.
    #[inline(always)]
    pub fn constant(reflectance: Rgb) -> Self {
        Self { normal: reflectance, rise: Rgb::ZERO }
    }

    pub fn growing(normal: Rgb, grazing: Rgb) -> Self {
        Self { normal, rise: grazing - normal }
    }

    /// At the angle of this cosine to the normal.
    #[inline(always)]
    pub fn at(&self, cos: f64) -> Rgb {
        self.normal + self.rise * schlick(cos) as f32
    }

    /// Times `factor`, at every angle.
    pub fn scaled(self, factor: Rgb) -> Self {
        Self { normal: self.normal * factor, rise: self.rise * factor }
    }
}

/// How far the reflectance has grown from that at normal incidence, 0, to that at grazing angles, 1.
pub(super) fn schlick(cos: f64) -> f64 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}
