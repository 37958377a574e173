//! The recheck's f64 ray–triangle test (Möller and Trumbore, 1997), one at a time or many.

use super::Ray;
use crate::math::DVec3;

/// A fault that no build has but one by which `./x faults` shows that `tweenray verify` sees it: a
/// comparison the wrong way round.
const PLANTED_FLIP: bool = cfg!(feature = "planted-flip");

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
    /// Whether the plane point lies on the triangle, edges included.
    #[inline(always)]
    pub fn is_inside(&self) -> bool {
        // All of it is false for NaN.
        let right_of_edge = if PLANTED_FLIP { self.u <= 0.0 } else { self.u >= 0.0 };
        right_of_edge && self.v >= 0.0 && self.u + self.v <= 1.0 && self.t.is_finite()
    }
}

/// The point of the triangle's outline that is nearest to the line of `ray`, and how far from it
/// the line passes. `None` where no corner is a number away.
pub(super) fn nearest_on_outline(ray: &Ray, corners: &[DVec3; 3]) -> Option<(PlaneHit, f64)> {
    // Seen along the ray: the line is the origin of a plane.
    let dir = ray.dir / ray.dir.length();
    let flat = corners.map(|c| {
        let from = c - ray.org;
        from - dir * from.dot(dir)
    });
    let mut best: Option<(PlaneHit, f64)> = None;
    for k in 0..3 {
        let (a, b) = (k, (k + 1) % 3);
        let edge = flat[b] - flat[a];
        let along = (-flat[a].dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        // An edge seen end on, or without length: its first point will do.
        let along = if along.is_nan() { 0.0 } else { along };
        let distance = (flat[a] + edge * along).length();
        let mut weights = [0.0; 3];
        (weights[a], weights[b]) = (1.0 - along, along);
        let point = corners[a] + (corners[b] - corners[a]) * along;
        let t = (point - ray.org).dot(dir) / ray.dir.length();
        if distance.is_finite() && best.is_none_or(|(_, least)| distance < least) {
            best = Some((PlaneHit { t, u: weights[1], v: weights[2] }, distance));
        }
    }
    best
}

/// Where `ray` meets the triangle, or the point of its outline that is nearest to the line. `None` where no
/// corner is a number away. A function of the ray's line and of the corners alone.
pub(super) fn meet_or_nearest(ray: &Ray, corners: &[DVec3; 3]) -> Option<PlaneHit> {
    let met = meet_plane(ray, corners).filter(PlaneHit::is_inside);
    met.or_else(|| nearest_on_outline(ray, corners).map(|(nearest, _)| nearest))
}

/// Intersects `ray`'s line with the plane of the triangle `corners`.
///
/// `None` for a ray in the plane (convention: it hits nothing) and for a degenerate triangle.
/// Neither `tnear`, `tfar` nor the triangle's edges are looked at.
pub(super) fn meet_plane(ray: &Ray, corners: &[DVec3; 3]) -> Option<PlaneHit> {
    let [a, b, c] = corners.map(|c| c.to_array());
    let [t, u, v] = meet(ray.org.to_array(), ray.dir.to_array(), a, b, c);
    (t.is_finite() && u.is_finite() && v.is_finite()).then_some(PlaneHit { t, u, v })
}

/// `[t, u, v]`, not finite where the determinant is zero or the triangle a line, but for rounding: then the determinant is
/// noise. The one formula of this file, so that one ray and many give the same bits.
#[inline(always)]
fn meet(org: [f64; 3], dir: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [f64; 3] {
    let sub = |x: [f64; 3], y: [f64; 3]| [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let cross = |x: [f64; 3], y: [f64; 3]| {
        [x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]]
    };
    let (e1, e2) = (sub(b, a), sub(c, a));
    let p = cross(dir, e2);
    let inv = if is_line(e1, e2) { f64::NAN } else { 1.0 / dot(e1, p) };
    let s = sub(org, a);
    let q = cross(s, e1);
    [dot(e2, q) * inv, dot(s, p) * inv, dot(dir, q) * inv]
}

/// Whether the normal of a triangle of these edges is no more than the rounding of its own terms.
#[inline(always)]
fn is_line(e1: [f64; 3], e2: [f64; 3]) -> bool {
    let vanishes = |i: usize, j: usize| {
        let (one, other) = (e1[i] * e2[j], e1[j] * e2[i]);
        (one - other).abs() <= f64::EPSILON * (one.abs() + other.abs())
    };
    // Without branches, so that lanes are computed together.
    vanishes(1, 2) & vanishes(2, 0) & vanishes(0, 1)
}

/// Pairs that are computed together: two SSE2 registers, one of AVX.
pub(super) const STEP: usize = 4;

/// One component of some pairs.
type Lane = [f64; STEP];

/// A few rays, each with one triangle, computed together: structure of arrays.
pub(super) struct Pairs {
    count: usize,
    /// Origin, direction, corners.
    inputs: [[Lane; 3]; 5],
    /// `t`, `u`, `v`.
    outputs: [Lane; 3],
}

impl Pairs {
    pub fn new() -> Self {
        Self { count: 0, inputs: [[[0.0; STEP]; 3]; 5], outputs: [[0.0; STEP]; 3] }
    }

    /// Adds a pair; there is room for [`STEP`].
    #[inline(always)]
    pub fn push(&mut self, ray: &Ray, corners: &[DVec3; 3]) {
        let k = self.count;
        let [a, b, c] = corners;
        for (slot, value) in self.inputs.iter_mut().zip([&ray.org, &ray.dir, a, b, c]) {
            slot[0][k] = value.x;
            slot[1][k] = value.y;
            slot[2][k] = value.z;
        }
        self.count += 1;
    }

    /// Computes all pairs.
    #[inline(always)]
    pub fn compute(&mut self) {
        let mut out = [[0.0; STEP]; 3];
        for k in 0..STEP {
            let [org, dir, a, b, c] = self.inputs.map(|value| value.map(|axis| axis[k]));
            let [t, u, v] = meet(org, dir, a, b, c);
            (out[0][k], out[1][k], out[2][k]) = (t, u, v);
        }
        self.outputs = out;
    }

    /// Pair `k`'s plane point; weights that are not finite where there is none.
    #[inline(always)]
    pub fn get(&self, k: usize) -> PlaneHit {
        let [t, u, v] = self.outputs.map(|lane| lane[k]);
        PlaneHit { t, u, v }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    /// Whatever is left of its normal is rounding, by which a ray would hit it anywhere.
    #[test]
    fn a_triangle_that_is_a_line_hits_nothing() {
        let a = DVec3::new(0.125, 0.25, -0.375);
        let b = a + DVec3::new(3.0, -2.5, 4.0) / 4.0;
        for k in 1..64 {
            let c = a + (b - a) * (f64::from(k) / 64.0);
            let ray = Ray::new(DVec3::new(0.4, f64::from(k) * 0.01, -1.0), c - DVec3::Z);
            assert_eq!(meet_plane(&ray, &[a, b, c]), None, "{k}");
            // A thousandth of an ulp of f32 beside the line.
            let sliver = [a, b, c + DVec3::new(6e-11, 6e-11, 0.0)];
            assert!(meet_plane(&ray, &sliver).is_some(), "{k}");
        }
    }

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
    fn distance_of_a_line_is_to_the_nearest_corner_or_edge() {
        let beside = |x: f64, y: f64| {
            let ray = Ray::new(DVec3::new(x, y, 2.0), DVec3::new(0.0, 0.0, -2.0));
            nearest_on_outline(&ray, &UNIT).unwrap()
        };
        let (met, distance) = beside(-3.0, -4.0);
        assert_eq!((met.t, met.u, met.v, distance), (1.0, 0.0, 0.0, 5.0));
        let (met, distance) = beside(0.25, -0.5);
        assert_eq!((met.u, met.v, distance), (0.25, 0.0, 0.5));
        let (met, distance) = beside(1.0, 1.0);
        assert!(
            (met.u - 0.5).abs() + (met.v - 0.5).abs() + (distance - 0.5f64.sqrt()).abs() < 1e-12
        );
        // A needle: the weights of the plane point say nothing about the distance.
        let needle = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1e-9, 0.0)];
        let ray = Ray::new(DVec3::new(0.5, -1e-6, 1.0), DVec3::NEG_Z);
        let (met, distance) = nearest_on_outline(&ray, &needle).unwrap();
        assert!((distance - 1e-6).abs() < 1e-12 && (met.u - 0.5).abs() < 1e-3);
    }

    #[test]
    fn a_hit_that_is_not_finite_is_not_inside() {
        let nan = PlaneHit { t: f64::INFINITY, u: f64::NAN, v: f64::INFINITY };
        assert!(!nan.is_inside());
        assert!(!PlaneHit { t: f64::INFINITY, u: 0.5, v: 0.25 }.is_inside());
        assert!(PlaneHit { t: 1.0, u: 0.5, v: 0.5 }.is_inside());
    }

    #[test]
    fn batches_give_the_bits_of_single_tests() {
        let rays: Vec<Ray> = (0..64)
            .map(|k| {
                let k = f64::from(k);
                Ray::new(DVec3::new(0.01 * k, 0.3, 2.0), DVec3::new(0.003 * k, 0.1, -1.0))
            })
            .collect();
        for rays in rays.chunks(STEP) {
            let mut pairs = Pairs::new();
            rays.iter().for_each(|ray| pairs.push(ray, &UNIT));
            pairs.compute();
            for (k, ray) in rays.iter().enumerate() {
                assert_eq!(meet_plane(ray, &UNIT), Some(pairs.get(k)), "{k}");
            }
        }
    }
}
