//! Microfacets with the distribution GGX and Smith's masking (Walter, Marschner, Li and Torrance, 2007; Heitz, 2014).

use crate::math::DVec3;
use std::f64::consts::{PI, TAU};

/// A smoother surface counts as one of this roughness: its peak would be narrower than f64 can tell of cosines.
const LEAST_ROUGHNESS: f64 = 3e-3;

/// The roughness that it counts as.
pub(super) fn at_least(roughness: f64) -> f64 {
    // Not `max`, which would hide what is NaN.
    if roughness < LEAST_ROUGHNESS { LEAST_ROUGHNESS } else { roughness }
}

/// Density of microfacet normals at the cosine `cos` to the surface's, per steradian.
pub(super) fn density(alpha: f64, cos: f64) -> f64 {
    // 1 − (1 − α²) cos², which would lose its digits near the peak of a smooth surface.
    let a2 = alpha * alpha;
    let scaled = (1.0 - cos) * (1.0 + cos) + a2 * cos * cos;
    a2 / (PI * scaled * scaled)
}

/// Smith's function: hidden over visible area of the microfacets along a direction of cosine `cos`.
pub(super) fn lambda(alpha: f64, cos: f64) -> f64 {
    let slope2 = (1.0 - cos) * (1.0 + cos) / (cos * cos);
    0.5 * ((1.0 + alpha * alpha * slope2.max(0.0)).sqrt() - 1.0)
}

/// The share of the microfacets towards a direction of cosine `cos` that others do not hide.
pub(super) fn unmasked(alpha: f64, cos: f64) -> f64 {
    1.0 / (1.0 + lambda(alpha, cos))
}

/// The share of light from microfacets seen along `cos_o` that leaves along `cos_i`.
pub(super) fn shadowed(alpha: f64, cos_o: f64, cos_i: f64) -> f64 {
    let seen = 1.0 + lambda(alpha, cos_o);
    seen / (seen + lambda(alpha, cos_i))
}

/// The normal of a microfacet seen along `wo`, in the surface's frame.
pub(super) fn visible_normal(alpha: f64, wo: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    // As of a half sphere, stretched.
    let stretched = DVec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
    let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let angle = TAU * u;
    let cap = DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z);
    let half = cap + stretched;
    DVec3::new(alpha * half.x, alpha * half.y, half.z.max(0.0)).normalize()
}

/// The unit direction at the cosine `cos` to +z, turned by `angle` about it.
#[cfg(test)]
pub(super) fn direction(cos: f64, angle: f64) -> DVec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    DVec3::new(sin * libm::cos(angle), sin * libm::sin(angle), cos)
}
