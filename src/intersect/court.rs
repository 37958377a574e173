//! The exact court: whether a ray meets a triangle, decided without rounding error.
//!
//! A ray is judged as the [`Line`] through two points of it, each rounded to f64 once. On which side
//! of the line an edge runs is the sign of a determinant of the line's two points and the edge's two
//! ends, settled by Shewchuk's adaptive predicate (1997; crate `robust`) where f64 does not suffice.
//! Both triangles at an edge get exactly opposite signs, so no ray passes between them, and none meets
//! both except exactly through the edge.
//!
//! Conventions: a ray exactly through an edge or a vertex meets every triangle there; a ray in a
//! triangle's plane meets it nowhere; a degenerate triangle is never met. Shares no code with
//! the recheck of Embree's hits, which it judges. Not done: spheres.

use super::Ray;
use crate::math::{DVec3, DoubleDouble, DoubleDouble3};
use robust::{Coord3D, orient3d};

/// A ray as the court sees it. Scene space, f64.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Its first point: the ray's origin, or where a far ray comes near the scene.
    pub start: DVec3,
    /// Its second point, beyond the scene.
    pub end: DVec3,
    /// Ray parameters of the two.
    t: [f64; 2],
    /// Largest coordinate of the scene that it was made for.
    reach: f64,
}

/// Where a line passes a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Strictly inside.
    Inside,
    /// Exactly through an edge or a vertex; this counts as met.
    Edge,
    /// Beside the triangle, in its plane, or the triangle is degenerate.
    Outside,
}

/// Where a line meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Ray parameter, computed with twice f64's precision and rounded once.
    pub t: f64,
    /// Weight of vertex 1, likewise.
    pub u: f64,
    /// Weight of vertex 2, likewise.
    pub v: f64,
    /// `Inside` or `Edge`.
    pub place: Place,
}

impl Line {
    /// The line of `ray` (valid) for a scene of coordinates up to `reach`.
    pub fn new(ray: &Ray, reach: f64) -> Self {
        let length = ray.dir.length();
        // The smallest normal number stands for a scene without extent.
        let reach = reach.max(f64::MIN_POSITIVE.sqrt());
        let far = ray.org.abs().max_element() > 8.0 * reach;
        let t0 = if far {
            // From outside, the scene's sphere of radius √3·reach begins after this.
            -ray.org.dot(ray.dir / length) / length - 2.0 * reach / length
        } else {
            0.0
        };
        // A power of two: the second point is then rounded only where it is added to the first.
        let span = if far { 4.0 } else { 32.0 } * reach / length;
        let t1 = t0 + libm::scalbn(1.0, libm::ilogb(span) + 1);
        let at = |t| DoubleDouble3::along(ray.org, ray.dir, t).round();
        // At t = 0 the point is the origin itself.
        Self { start: at(t0), end: at(t1), t: [t0, t1], reach }
    }

    /// Where it passes the triangle `corners`.
    pub fn place(&self, corners: &[DVec3; 3]) -> Place {
        let [a, b, c] = corners;
        let (mut positive, mut negative, mut zero) = (0, 0, 0);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            match self.side(*from, *to) {
                side if side > 0.0 => positive += 1,
                side if side < 0.0 => negative += 1,
                _ => zero += 1,
            }
        }
        match (positive, negative, zero) {
            (3, 0, _) | (0, 3, _) => Place::Inside,
            // All three zero: the line lies in the plane, or there is no plane.
            (0, 0, _) => Place::Outside,
            (_, 0, _) | (0, _, _) => Place::Edge,
            _ => Place::Outside,
        }
    }

    /// Where it meets the triangle `corners`; neither end of the ray is looked at.
    pub fn meet(&self, corners: &[DVec3; 3]) -> Option<Meeting> {
        let place = self.place(corners);
        (place != Place::Outside).then(|| self.meet_plane(corners, place)).flatten()
    }

    /// Ray parameter where it meets the plane of `corners`; `None` where the two are parallel.
    pub fn plane_t(&self, corners: &[DVec3; 3]) -> Option<f64> {
        self.meet_plane(corners, Place::Outside).map(|m| m.t)
    }

    fn meet_plane(&self, corners: &[DVec3; 3], place: Place) -> Option<Meeting> {
        let along = DoubleDouble3::difference(self.end, self.start);
        let e1 = DoubleDouble3::difference(corners[1], corners[0]);
        let e2 = DoubleDouble3::difference(corners[2], corners[0]);
        let from = DoubleDouble3::difference(self.start, corners[0]);
        let p = along.cross(e2);
        let det = e1.dot(p);
        if det.round() == 0.0 {
            return None;
        }
        let q = from.cross(e1);
        let share = e2.dot(q) / det;
        let [t0, t1] = self.t;
        let t = DoubleDouble::from(t0) + share * DoubleDouble::difference(t1, t0);
        let weight = |x: DoubleDouble| (x / det).round().clamp(0.0, 1.0);
        let (u, v) = (weight(from.dot(p)), weight(along.dot(q)));
        Some(Meeting { t: t.round(), u, v, place })
    }

    /// On which side of the line the edge runs; the sign is exact, the size is not.
    fn side(&self, from: DVec3, to: DVec3) -> f64 {
        let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
        orient3d(coord(self.start), coord(self.end), coord(from), coord(to))
    }

    /// Distance from the triangle's nearest edge, scene space, accurate to f64 rounding.
    pub fn edge_distance(&self, corners: &[DVec3; 3]) -> f64 {
        let [a, b, c] = *corners;
        [(a, b), (b, c), (c, a)]
            .map(|(from, to)| self.segment_distance(from, to))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// Distance from the triangle: zero where the line meets it.
    pub fn distance(&self, corners: &[DVec3; 3]) -> f64 {
        if self.place(corners) == Place::Outside { self.edge_distance(corners) } else { 0.0 }
    }

    /// The f32 ulp (2⁻²³) of the largest coordinate that the pair involves: of the triangle and
    /// of the line's start.
    pub fn ulp(&self, corners: &[DVec3; 3]) -> f64 {
        let largest = corners.iter().fold(self.start.abs(), |m, c| m.max(c.abs()));
        largest.max_element() * f64::from(f32::EPSILON)
    }

    /// [`Self::edge_distance`] in [`Self::ulp`]s.
    pub fn edge_ulps(&self, corners: &[DVec3; 3]) -> f64 {
        self.edge_distance(corners) / self.ulp(corners)
    }

    /// [`Self::distance`] in [`Self::ulp`]s.
    pub fn ulps(&self, corners: &[DVec3; 3]) -> f64 {
        self.distance(corners) / self.ulp(corners)
    }

    /// The same line moved by `by`, rounded once; ray parameters stay where they were.
    pub fn moved(&self, by: DVec3) -> Self {
        Self { start: self.start + by, end: self.end + by, ..*self }
    }

    /// Distance between the line and a segment.
    pub fn segment_distance(&self, from: DVec3, to: DVec3) -> f64 {
        let along = (self.end - self.start).normalize();
        // Across the line, so that only the plane perpendicular to it is left.
        let across = |p: DVec3| {
            let r = p - self.start;
            r - along * r.dot(along)
        };
        let (p, q) = (across(from), across(to));
        let edge = q - p;
        let share = -p.dot(edge) / edge.length_squared();
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        (p + edge * share).length()
    }

    /// Largest coordinates: of the scene, and of the line's start.
    pub(super) fn sizes(&self) -> (f64, f64) {
        (self.reach, self.start.abs().max_element())
    }
}

#[cfg(test)]
mod tests;
