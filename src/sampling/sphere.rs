//! Uniform directions towards a sphere.

use super::disk::{concentric_disk, to_world};
use crate::math::{DVec3, orthonormal_basis};

/// The cone of directions under which a sphere is seen from a point outside it.
///
/// Directions are uniform by solid angle (Wang, "Physically correct direct lighting for
/// distribution ray tracing", 1992), through the concentric disk. All is computed from
/// `1 − cos θ = sin² θ / (1 + cos θ)`, so a cone of 1e-9 radians is as exact as a wide one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereCone {
    axis: DVec3,
    basis: (DVec3, DVec3),
    /// Distance from the point to the centre.
    distance: f64,
    /// `1 − cos` of the half angle, in (0, 1).
    one_minus_cos: f64,
}

impl SphereCone {
    /// The cone from `point` to the sphere; any one unit of length. `None` where `point` lies in
    /// the sphere or on it, or the sphere is too small to be seen in f64 (`radius² / distance²`
    /// underflows).
    pub fn new(centre: DVec3, radius: f64, point: DVec3) -> Option<Self> {
        let to = centre - point;
        let distance = to.length();
        let sin = radius / distance;
        if !(sin > 0.0 && sin < 1.0 && distance.is_finite()) {
            return None;
        }
        let axis = to / distance;
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        let one_minus_cos = sin * sin / (1.0 + cos);
        (one_minus_cos > 0.0).then(|| Self {
            axis,
            basis: orthonormal_basis(axis),
            distance,
            one_minus_cos,
        })
    }

    /// Solid angle of the cone, steradians; directions have the density 1 / solid angle.
    pub fn solid_angle(&self) -> f64 {
        std::f64::consts::TAU * self.one_minus_cos
    }

    /// A unit direction in the cone whose height above the horizon of the unit normal `n` is half
    /// of the highest one's, and the distance along it to the sphere; `None` where the cone lies
    /// below the horizon.
    pub fn above(&self, n: DVec3) -> Option<(DVec3, f64)> {
        let sin = self.axis.dot(n);
        let level = self.axis - n * sin;
        let half_angle = 2.0 * libm::asin((0.5 * self.one_minus_cos).sqrt());
        let axis_height = libm::atan2(sin, level.length());
        let height = 0.5 * (axis_height + half_angle);
        if height.is_nan() || height <= 0.0 {
            return None;
        }
        let away = height - axis_height;
        // Straight above, every level direction is as good.
        let level = level.try_normalize().unwrap_or(self.basis.0);
        let dir = level * libm::cos(height) + n * libm::sin(height);
        let versine = 2.0 * libm::sin(0.5 * away).powi(2);
        let k = self.one_minus_cos;
        let margin = (k * (2.0 - k) - versine * (2.0 - versine)).max(0.0);
        let tangent2 = (1.0 - k) * (1.0 - k);
        Some((dir, self.distance * tangent2 / (1.0 - versine + margin.sqrt())))
    }

    /// For `u` in (0, 1)²: a unit direction in the cone, and the distance along it to the
    /// sphere's surface (never NaN; at the rim the tangent's length).
    pub fn direction(&self, u: [f64; 2]) -> (DVec3, f64) {
        let (x, y, r2) = concentric_disk(u);
        let k = self.one_minus_cos;
        // Height above the cone's base plane is uniform: 1 − cos θ = r² k.
        let versine = r2 * k;
        let sin_over_r = (k * (2.0 - versine)).sqrt();
        let local = DVec3::new(x * sin_over_r, y * sin_over_r, 1.0 - versine);
        // sin² of the half angle less sin² θ, without cancellation.
        let margin = k * (1.0 - r2).max(0.0) * (2.0 - k * (1.0 + r2));
        let tangent2 = (1.0 - k) * (1.0 - k);
        let t = self.distance * tangent2 / (1.0 - versine + margin.max(0.0).sqrt());
        (to_world(local, self.basis, self.axis), t)
    }
}

#[cfg(test)]
mod tests {
    use super::super::PixelSampler;
    use super::*;

    fn pairs(n: u32) -> impl Iterator<Item = [f64; 2]> {
        let sampler = PixelSampler::new(5, 1, 2, 3);
        (0..n).map(move |i| sampler.get2(i, 0).map(f64::from))
    }

    #[test]
    fn distances_end_on_the_sphere() {
        let centre = DVec3::new(1.0, -2.0, 3.0);
        for (radius, point) in [
            (1.0, DVec3::new(5.0, 5.0, 5.0)),
            (1.0, centre + DVec3::X * 1.000_001),
            (1e-6, DVec3::ZERO),
            (3.7, DVec3::ZERO),
        ] {
            let cone = SphereCone::new(centre, radius, point).expect("outside");
            for u in pairs(256).chain([[0.0, 0.0], [1.0, 0.5], [0.5, 0.5]]) {
                let (d, t) = cone.direction(u);
                assert!((d.length() - 1.0).abs() < 1e-15);
                let miss = ((point + d * t).distance(centre) / radius - 1.0).abs();
                let scale = 1e-15 * (1.0 + centre.length() / radius) * 8.0;
                // At the rim the radius depends on the root of the rounding error.
                assert!(miss < scale, "{miss:e} of {radius} at {u:?}");
                assert!(t > 0.0);
            }
        }
    }

    #[test]
    fn solid_angle_is_exact_for_tiny_and_wide_cones() {
        let far = SphereCone::new(DVec3::Z * 1e9, 1.0, DVec3::ZERO).expect("outside");
        let exact = std::f64::consts::PI * 1e-18;
        assert!((far.solid_angle() / exact - 1.0).abs() < 1e-15);
        let near = SphereCone::new(DVec3::Z, 1.0 - 1e-12, DVec3::ZERO).expect("outside");
        let cos = ((1.0 - near.one_minus_cos).powi(2) / 2e-12).sqrt();
        assert!((cos - 1.0).abs() < 1e-3, "nearly a hemisphere: {cos}");
    }

    #[test]
    fn directions_are_uniform_by_solid_angle() {
        for radius in [0.01, 0.5, 0.99] {
            let cone = SphereCone::new(DVec3::X, radius, DVec3::ZERO).expect("outside");
            let n = 1 << 14;
            let mut heights = [0u32; 16];
            let mut sum = DVec3::ZERO;
            for u in pairs(n) {
                let (d, _) = cone.direction(u);
                // 1 − cos θ from the chord, which is exact for small angles too.
                let share = 0.5 * (d - DVec3::X).length_squared() / cone.one_minus_cos;
                assert!(share < 1.0 + 1e-9);
                heights[((share * 16.0) as usize).min(15)] += 1;
                sum += d / f64::from(n);
            }
            for h in heights {
                assert!((f64::from(h) / 1024.0 - 1.0).abs() < 0.02, "{h}");
            }
            assert!(sum.y.abs() < 2e-4 * radius && sum.z.abs() < 2e-4 * radius);
            assert!((sum.x - (1.0 - 0.5 * cone.one_minus_cos)).abs() < 1e-5);
        }
    }

    #[test]
    fn slivers_above_the_horizon_are_met() {
        for height in [-0.999_999, -0.9, -0.3, 0.0, 0.4, 2.0] {
            let centre = DVec3::new(3.0, height, 0.5);
            let cone = SphereCone::new(centre, 1.0, DVec3::ZERO).expect("outside");
            let (d, t) = cone.above(DVec3::Y).expect("some of it is above");
            assert!(d.y > 0.0 && (d.length() - 1.0).abs() < 1e-12);
            let miss = ((d * t).distance(centre) - 1.0).abs();
            assert!(miss < 1e-6, "{height}: {miss:e}");
        }
        let below = SphereCone::new(DVec3::new(3.0, -1.000_001, 0.0), 1.0, DVec3::ZERO);
        assert!(below.expect("outside").above(DVec3::Y).is_none());
    }

    #[test]
    fn inside_and_degenerate_spheres_have_no_cone() {
        assert!(SphereCone::new(DVec3::ZERO, 1.0, DVec3::X).is_none());
        assert!(SphereCone::new(DVec3::ZERO, 1.0, DVec3::X * 0.5).is_none());
        assert!(SphereCone::new(DVec3::ZERO, 1.0, DVec3::ZERO).is_none());
        assert!(SphereCone::new(DVec3::ZERO, 0.0, DVec3::X).is_none());
        assert!(SphereCone::new(DVec3::ZERO, 1.0, DVec3::X * f64::NAN).is_none());
    }
}
