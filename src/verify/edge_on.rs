//! Triangles that a ray sees edge on, but for the rounding of Embree's edge functions.

use crate::math::DVec3;

/// Bound of the rounding of Embree's edge functions, as a distance across the ray: ulp (2⁻²³) of the way from the
/// scene's middle to the ray's start and from there to the hit. The recheck takes the same bound.
const EDGE_NOISE: f64 = 8.0;

/// Bound of the rounding of Embree's edge functions, scene space, for a ray that starts at `start`, near a hit at `at`.
pub(super) fn edge_noise(start: DVec3, at: DVec3) -> f64 {
    EDGE_NOISE * f64::from(f32::EPSILON) * (start.length() + (at - start).length())
}

/// Whether a ray along the unit `dir` sees the triangle edge on: narrower than `noise` on either side.
pub(super) fn is_narrow(corners: &[DVec3; 3], dir: DVec3, noise: f64) -> bool {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a);
    let sides = [b - a, c - b, a - c];
    let widest = sides.map(|side| side.cross(dir).length()).into_iter().fold(0.0, f64::max);
    normal.dot(dir).abs() <= 2.0 * noise * widest
}
