//! Ray and triangle in double-double arithmetic, by a formula that shares nothing with the product;
//! distances in f64.

use tweenray::intersect::Ray;
use tweenray::math::{DVec3, DoubleDouble, DoubleDouble3};

/// Where a ray's line meets a triangle's plane.
#[derive(Debug, Clone, Copy)]
pub struct Met {
    pub t: f64,
    pub u: f64,
    pub v: f64,
    /// The smallest of the three weights: its sign tells inside from outside.
    pub least: f64,
}

/// The plane point, to all digits of f64; `None` for a ray in the plane.
pub fn meet(ray: &Ray, [a, b, c]: &[DVec3; 3]) -> Option<Met> {
    let apart = DoubleDouble3::difference;
    let (e1, e2, dir) = (apart(*b, *a), apart(*c, *a), apart(ray.dir, DVec3::ZERO));
    let p = dir.cross(e2);
    let det = e1.dot(p);
    if det.round() == 0.0 {
        return None;
    }
    let s = apart(ray.org, *a);
    let q = s.cross(e1);
    let (u, v) = (s.dot(p) / det, dir.dot(q) / det);
    let least = [u, v, DoubleDouble::from(1.0) - u - v].map(DoubleDouble::round);
    let [u, v] = [u, v].map(DoubleDouble::round);
    let least = least.into_iter().fold(f64::INFINITY, f64::min);
    Some(Met { t: (e2.dot(q) / det).round(), u, v, least })
}

/// Distance between `ray`'s line and the segment from `a` to `b`.
pub fn line_to_segment(ray: &Ray, a: DVec3, b: DVec3) -> f64 {
    let dir = ray.dir.normalize();
    let (along, start) = ((b - a).cross(dir), (a - ray.org).cross(dir));
    let square = along.length_squared();
    let s = if square > 0.0 { (-along.dot(start) / square).clamp(0.0, 1.0) } else { 0.0 };
    (start + along * s).length()
}

/// Distance between `ray`'s line and the edges of a triangle.
pub fn line_to_edges(ray: &Ray, [a, b, c]: &[DVec3; 3]) -> f64 {
    let edges = [(*a, *b), (*b, *c), (*c, *a)];
    edges.iter().map(|(p, q)| line_to_segment(ray, *p, *q)).fold(f64::INFINITY, f64::min)
}

/// Distance between `ray`'s line and a triangle.
pub fn line_to_triangle(ray: &Ray, corners: &[DVec3; 3]) -> f64 {
    let inside = meet(ray, corners).is_some_and(|met| met.least >= 0.0);
    if inside { 0.0 } else { line_to_edges(ray, corners) }
}

/// Distance of a point from a triangle.
pub fn point_to_triangle(p: DVec3, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let beside = |(from, to): (DVec3, DVec3)| {
        let edge = to - from;
        let s = ((p - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        // The nearest point of the edge, and whether `p` lies on the inner side of it.
        ((p - from - edge * s).length(), normal.cross(edge).dot(p - from) >= 0.0)
    };
    let sides = [(a, b), (b, c), (c, a)].map(beside);
    if normal != DVec3::ZERO && sides.iter().all(|side| side.1) {
        return normal.dot(p - a).abs();
    }
    sides.iter().map(|side| side.0).fold(f64::INFINITY, f64::min)
}

/// The longest edge.
pub fn longest_edge([a, b, c]: &[DVec3; 3]) -> f64 {
    a.distance(*b).max(b.distance(*c)).max(c.distance(*a))
}

#[cfg(test)]
mod tests {
    #[test]
    fn double_double_tells_weights_that_f64_rounds_away() {
        use super::{DVec3, Ray, meet};
        // A weight of 2^-60: 1 + 2^-60 rounds to 1 in f64.
        let tiny = 1.0 / (1u64 << 60) as f64;
        let corners = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
        let at = |x: f64| Ray::new(DVec3::new(x, 0.5, 1.0), DVec3::NEG_Z);
        assert!(meet(&at(tiny), &corners).is_some_and(|m| m.least == tiny && m.t == 1.0));
        assert!(meet(&at(-tiny), &corners).is_some_and(|m| m.least == -tiny));
        let slanted = Ray::new(DVec3::new(0.25, 0.25, 1.0), DVec3::new(1.0 / 3.0, 0.0, -3.0));
        assert!(meet(&slanted, &corners).is_some_and(|m| m.t == 1.0 / 3.0));
    }

    #[test]
    fn distances_to_a_triangle_are_to_its_nearest_corner_edge_or_face() {
        use super::{DVec3, Ray, line_to_triangle, point_to_triangle};
        let corners = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        for (point, distance) in [
            ((0.5, 0.5, 3.0), 3.0),
            ((1.0, -1.0, 0.0), 1.0),
            ((-3.0, -4.0, 0.0), 5.0),
            ((2.0, 2.0, 0.0), 2f64.sqrt()),
        ] {
            let point = DVec3::from(point);
            assert!((point_to_triangle(point, &corners) - distance).abs() < 1e-12, "{point}");
        }
        let past = Ray::new(DVec3::new(-1.0, 1.0, 5.0), DVec3::NEG_Z);
        assert!((line_to_triangle(&past, &corners) - 1.0).abs() < 1e-12);
        let through = Ray::new(DVec3::new(0.5, 0.5, 5.0), DVec3::NEG_Z);
        assert_eq!(line_to_triangle(&through, &corners), 0.0);
    }
}
