//! The f64 ray–triangle test (Möller and Trumbore, 1997): the oracle's, and the recheck's.

use super::Ray;
use crate::math::DVec3;

/// Where a ray meets a triangle's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlaneHit {
    /// Ray parameter.
    pub t: f64,
    /// Weight of vertex 1, outside `[0, 1]` beside the triangle.
    pub u: f64,
    /// Weight of vertex 2.
    pub v: f64,
}

impl PlaneHit {
    /// The smallest of the three weights: negative outside the triangle.
    pub fn least_weight(&self) -> f64 {
        self.u.min(self.v).min(1.0 - self.u - self.v)
    }

    /// The same plane point moved onto the triangle, where rounding left it just beside.
    pub fn clamped(self) -> Self {
        let (u, v) = (self.u.max(0.0), self.v.max(0.0));
        let sum = (u + v).max(1.0);
        Self { t: self.t, u: u / sum, v: v / sum }
    }
}

/// Intersects `ray`'s line with the plane of the triangle `corners`.
///
/// `None` for a ray in the plane (convention: it hits nothing) and for a degenerate triangle.
/// Neither `tnear`, `tfar` nor the triangle's edges are looked at.
pub(super) fn meet_plane(ray: &Ray, corners: &[DVec3; 3]) -> Option<PlaneHit> {
    let e1 = corners[1] - corners[0];
    let e2 = corners[2] - corners[0];
    let p = ray.dir.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let inv = 1.0 / det;
    let s = ray.org - corners[0];
    let q = s.cross(e1);
    let hit = PlaneHit { t: e2.dot(q) * inv, u: s.dot(p) * inv, v: ray.dir.dot(q) * inv };
    (hit.t.is_finite() && hit.u.is_finite() && hit.v.is_finite()).then_some(hit)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn meets_the_known_point() {
        let ray = Ray::new(DVec3::new(0.25, 0.5, 2.0), DVec3::NEG_Z);
        assert_eq!(meet_plane(&ray, &UNIT), Some(PlaneHit { t: 2.0, u: 0.25, v: 0.5 }));
    }

    #[test]
    fn a_ray_in_the_plane_hits_nothing() {
        let ray = Ray::new(DVec3::new(-1.0, 0.2, 0.0), DVec3::X);
        assert_eq!(meet_plane(&ray, &UNIT), None);
    }

    #[test]
    fn clamping_lands_on_the_triangle() {
        for (u, v) in [(-1e-9, 0.5), (0.5, -1e-9), (0.6, 0.4 + 1e-9), (-1.0, -1.0), (3.0, 3.0)] {
            let c = PlaneHit { t: 1.0, u, v }.clamped();
            assert!(c.least_weight() >= -f64::EPSILON, "{c:?}");
        }
    }
}
