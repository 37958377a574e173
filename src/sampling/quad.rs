//! Uniform points on a flat convex quad.

use crate::math::DVec3;

/// An area-preserving map from the unit square to a flat convex quad.
///
/// The bilinear map of a flat quad stretches area by a factor that is linear in both coordinates;
/// drawing the coordinates with that density (Pharr, Jakob and Humphreys, 2023, bilinear
/// sampling) makes points uniform. For a parallelogram that is the identity; two corners may
/// coincide (a triangle). Square corners go to the quad's corners in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadWarp {
    origin: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    twist: DVec3,
    /// Stretch at the corners (0,0), (1,0) and (0,1), relative to the mean; `None` for a
    /// parallelogram.
    stretch: Option<[f64; 3]>,
}

impl QuadWarp {
    /// The map to the quad with these corners in order, flat and convex; any unit of length.
    ///
    /// A quad that is neither still gets points of its bilinear patch, but not uniform ones; one
    /// without area gets them with uniform coordinates.
    pub fn new(corners: [DVec3; 4]) -> Self {
        let [a, b, c, d] = corners;
        let twist = (a - b) + (c - d);
        let normal = (c - a).cross(d - b);
        let at = |p: DVec3, q: DVec3| (p.cross(q).dot(normal) / normal.length_squared()).max(0.0);
        // Twice the triangle at each corner over twice the area of the quad.
        let [s00, s10, s01] =
            [at(b - a, d - a), at(c - b, a - b), at(a - d, c - d)].map(|s| 2.0 * s);
        // Below 1e-6 the corners were rounded to f32: uniform to as much.
        let even = [s00, s10, s01].iter().all(|s| (s - 1.0).abs() < 1e-6);
        let flat = !normal.length_squared().is_normal();
        let stretch = (!even && !flat).then_some([s00, s10, s01]);
        Self { origin: a, edge_u: b - a, edge_v: d - a, twist, stretch }
    }

    /// The quad's corners in order, to rounding.
    pub fn corners(&self) -> [DVec3; 4] {
        let (b, d) = (self.origin + self.edge_u, self.origin + self.edge_v);
        [self.origin, b, b + self.edge_v + self.twist, d]
    }

    /// The point for `u` in (0, 1)²; density 1/area.
    #[inline]
    pub fn point(&self, u: [f64; 2]) -> DVec3 {
        let [u, v] = match self.stretch {
            None => u,
            Some(stretch) => even_out(u, stretch),
        };
        self.origin + self.edge_u * u + (self.edge_v + self.twist * u) * v
    }
}

/// Bilinear coordinates with a density proportional to the stretch.
fn even_out(u: [f64; 2], [s00, s10, s01]: [f64; 3]) -> [f64; 2] {
    let s11 = (s10 + s01 - s00).max(0.0);
    let v = sample_linear(u[1], s00 + s10, s01 + s11);
    let low = s00 + (s01 - s00) * v;
    let high = s10 + (s11 - s10) * v;
    [sample_linear(u[0], low, high), v]
}

/// Inverse of the distribution whose density on [0, 1] runs linearly from `a` to `b`, not both 0.
fn sample_linear(u: f64, a: f64, b: f64) -> f64 {
    let x = u * (a + b) / (a + (a * a + (b * b - a * a) * u).max(0.0).sqrt());
    if x < 1.0 { x } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::PixelSampler;
    use super::*;

    fn pairs(n: u32) -> impl Iterator<Item = [f64; 2]> {
        let sampler = PixelSampler::new(5, 1, 2, 3);
        (0..n).map(move |i| sampler.get2(i, 0).map(f64::from))
    }

    fn quads() -> [[DVec3; 4]; 4] {
        let p = DVec3::new;
        [
            [p(0.0, 0.0, 1.0), p(4.0, 0.0, 1.0), p(3.0, 2.0, 1.0), p(1.0, 3.0, 1.0)],
            [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(10.0, 10.0, 0.0), p(0.0, 1.0, 0.0)],
            // Two corners coincide.
            [p(0.0, 0.0, 0.0), p(2.0, 0.0, 2.0), p(2.0, 0.0, 2.0), p(0.0, 3.0, 0.0)],
            // Three on a line.
            [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(2.0, 0.0, 0.0), p(0.0, 2.0, 0.0)],
        ]
    }

    /// Area and moments by splitting along a diagonal.
    fn moments(q: [DVec3; 4]) -> (DVec3, DVec3) {
        let triangle = |a: DVec3, b: DVec3, c: DVec3| {
            let area = 0.5 * (b - a).cross(c - a).length();
            let first = (a + b + c) * (area / 3.0);
            let sum = a + b + c;
            let second = (a * a + b * b + c * c + sum * sum) * (area / 12.0);
            (area, first, second)
        };
        let (s, t) = (triangle(q[0], q[1], q[2]), triangle(q[0], q[2], q[3]));
        ((s.1 + t.1) / (s.0 + t.0), (s.2 + t.2) / (s.0 + t.0))
    }

    #[test]
    fn points_have_the_moments_of_a_uniform_density() {
        let n = 1 << 16;
        for quad in quads() {
            let warp = QuadWarp::new(quad);
            let (mut first, mut second) = (DVec3::ZERO, DVec3::ZERO);
            for u in pairs(n) {
                let p = warp.point(u);
                first += p / f64::from(n);
                second += p * p / f64::from(n);
            }
            let (m1, m2) = moments(quad);
            assert!((first - m1).abs().max_element() < 1e-4, "{first} for {m1}");
            assert!((second - m2).abs().max_element() < 1e-3, "{second} for {m2}");
        }
    }

    #[test]
    fn each_triangle_gets_its_share() {
        let n = 1 << 16;
        for quad in quads() {
            let warp = QuadWarp::new(quad);
            let normal = (quad[2] - quad[0]).cross(quad[3] - quad[1]);
            let diagonal = quad[2] - quad[0];
            let left = |p: DVec3| diagonal.cross(p - quad[0]).dot(normal) > 0.0;
            let share = pairs(n).filter(|u| left(warp.point(*u))).count() as f64 / f64::from(n);
            let area = 0.5 * normal.length();
            let exact = 0.5 * diagonal.cross(quad[3] - quad[0]).length() / area;
            assert!((share - exact).abs() < 2e-3, "{share} for {exact}");
        }
    }

    #[test]
    fn a_parallelogram_is_mapped_straight() {
        let (o, u, v) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 0.0, 1.0), DVec3::Y * 3.0);
        let warp = QuadWarp::new([o, o + u, o + u + v, o + v]);
        assert_eq!(warp.point([0.25, 0.5]), o + u * 0.25 + v * 0.5);
        let rounded = [o, o + u, o + u + v, o + v].map(|c| (c * 0.1).as_vec3().as_dvec3());
        assert_eq!(QuadWarp::new(rounded).stretch, None);
    }

    #[test]
    fn corners_go_to_corners_and_a_quad_without_area_stays_finite() {
        for quad in quads() {
            let warp = QuadWarp::new(quad);
            for (u, c) in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].into_iter().zip(quad) {
                assert!(warp.point(u).is_finite() && warp.point(u).distance(c) < 1e-12);
            }
        }
        let none = QuadWarp::new([DVec3::ONE; 4]);
        assert_eq!(none.point([0.3, 0.7]), DVec3::ONE);
    }
}
