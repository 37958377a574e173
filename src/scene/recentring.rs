//! Between world space (f64, the user's units) and scene space (f32, about unit size).

use crate::math::{Bounds3, DVec3, Rgb};
use serde::{Deserialize, Serialize};

/// `scene = (world − centre) · 2^log2_scale`. A power of two, so scaling rounds nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Recentring {
    /// World point that becomes the scene's origin.
    pub centre: DVec3,
    /// Exponent of the scale.
    pub log2_scale: i32,
}

impl Recentring {
    /// World and scene space are the same.
    pub const IDENTITY: Self = Self { centre: DVec3::ZERO, log2_scale: 0 };

    /// The recentring that brings `bounds` (world) to the origin and its longest half edge
    /// into `(0.5, 1]`.
    pub fn of(bounds: &Bounds3) -> Self {
        let half = 0.5 * bounds.extent().max_element();
        // Exact, unlike a logarithm: a scene twice as large gets a scale half as large, always.
        let (mantissa, exponent) = libm::frexp(half);
        let log2_scale = match half {
            half if half <= 0.0 => 0,
            _ if mantissa == 0.5 => 1 - exponent,
            _ => -exponent,
        };
        Self { centre: bounds.centre(), log2_scale }
    }

    /// Scene units in a world unit: a power of two.
    pub fn scale(&self) -> f64 {
        libm::ldexp(1.0, self.log2_scale)
    }

    /// A world point in scene space.
    pub fn point_to_scene(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale()
    }

    /// A scene point in world space.
    pub fn point_to_world(&self, p: DVec3) -> DVec3 {
        p / self.scale() + self.centre
    }

    /// Radiant intensity in scene units, so that the irradiance intensity/d² stays what it was in world units.
    pub fn intensity_to_scene(&self, intensity: Rgb) -> Rgb {
        let scale = self.scale();
        (intensity.as_dvec3() * scale * scale).as_vec3()
    }

    /// A scene length in world units.
    pub fn length_to_world(&self, length: f64) -> f64 {
        length / self.scale()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale_of(half: f64) -> f64 {
        let bounds = Bounds3 { min: DVec3::splat(-half), max: DVec3::splat(half) };
        Recentring::of(&bounds).scale()
    }

    #[test]
    fn the_scale_follows_the_size_exactly() {
        // Just above a power of two: a logarithm rounds to the power itself, but not near 1.
        for half in [1.0, 1.0 + f64::EPSILON, 1.5, 2.0 - f64::EPSILON] {
            assert!((0.5..=1.0).contains(&(half * scale_of(half))) && half * scale_of(half) > 0.5);
            for k in -90..=90 {
                let power = libm::ldexp(1.0, k);
                assert_eq!(scale_of(half * power) * power, scale_of(half), "{half} times 2^{k}");
            }
        }
        assert_eq!(scale_of(0.0), 1.0);
    }
}
