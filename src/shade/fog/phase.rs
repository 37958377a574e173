//! The phase function: in which directions fog scatters.

use crate::math::{DVec3, orthonormal_basis};
use crate::sampling::to_world;
use std::f64::consts::{PI, TAU};

/// Density, per steradian, of light that is scattered by an angle of cosine `cos`, where the mean cosine is `g`
/// (Henyey and Greenstein, 1941).
pub fn density(g: f64, cos: f64) -> f64 {
    let squared = 1.0 + g * g - 2.0 * g * cos;
    (1.0 - g * g) / (4.0 * PI * squared * squared.sqrt())
}

/// A unit direction at that density about the unit direction `dir`, for `u` in the unit square.
pub fn sample(g: f64, dir: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let even = 1.0 - 2.0 * u;
    // Near 0 the closed form is all rounding.
    let cos = if g.abs() < 1e-3 {
        even + 1.5 * g * (1.0 - even * even)
    } else {
        let root = (1.0 - g * g) / (1.0 + g * even);
        (1.0 + g * g - root * root) / (2.0 * g)
    };
    let cos = cos.clamp(-1.0, 1.0);
    let sin = (1.0 - cos * cos).sqrt();
    let (sin_phi, cos_phi) = libm::sincos(TAU * v);
    to_world(DVec3::new(sin * cos_phi, sin * sin_phi, cos), orthonormal_basis(dir), dir)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_is_one_on_the_whole_and_has_its_mean() {
        for g in [-0.8, -0.3, 0.0, 5e-4, 0.5, 0.9] {
            let n = 200_000;
            let (mut whole, mut mean, mut drawn) = (0.0, 0.0, 0.0);
            for k in 0..n {
                let u = (f64::from(k) + 0.5) / f64::from(n);
                let cos = 1.0 - 2.0 * u;
                whole += density(g, cos) * 4.0 * PI;
                mean += density(g, cos) * 4.0 * PI * cos;
                drawn += sample(g, DVec3::Z, [u, 0.3]).z;
            }
            let [whole, mean, drawn] = [whole, mean, drawn].map(|sum| sum / f64::from(n));
            assert!((whole - 1.0).abs() < 1e-5 && (mean - g).abs() < 1e-5, "{g}: {whole} {mean}");
            assert!((drawn - g).abs() < 1e-5, "{g}: {drawn}");
        }
    }

    #[test]
    fn samples_follow_the_density() {
        // The part of samples within a cone is the integral of the density over it.
        let (g, limit, n) = (0.6, 0.7, 100_000);
        let u = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
        let inside = (0..n).filter(|k| sample(g, DVec3::Y, [u(*k), 0.1]).y > limit).count();
        let cos = |k: i32| limit + (1.0 - limit) * u(k);
        let integral: f64 = (0..n).map(|k| density(g, cos(k))).sum::<f64>() * TAU * (1.0 - limit);
        let (part, expected) = (inside as f64 / f64::from(n), integral / f64::from(n));
        assert!((part - expected).abs() < 1e-4, "{part} for {expected}");
    }
}
