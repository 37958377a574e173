//! Samples on area lights, and what delta lights send: before any shadow ray.

use super::irradiance;
use crate::math::{DVec3, Rgb, orthonormal_basis};
use crate::scene::{Light, QuadLight};
use std::f64::consts::{PI, TAU};

/// A point on an area light as seen from a surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// The point, scene space.
    pub point: DVec3,
    /// Unit normal of the light there.
    pub normal: DVec3,
    /// Unshadowed irradiance that the sample stands for, up to a factor that all samples of one
    /// surface point share; 0 where the light does not shine.
    pub weight: f64,
}

/// An area light as seen from one surface point: what does not change from sample to sample.
pub enum AreaLight<'a> {
    /// A flat quad.
    Quad(&'a QuadLight, DVec3),
    /// A sphere: axis towards its centre, distance, radius, frame about the axis.
    Sphere { centre: DVec3, axis: DVec3, s: DVec3, t: DVec3, distance: f64, radius: f64 },
}

impl<'a> AreaLight<'a> {
    /// The light as seen from `p` with its unshadowed irradiance per unit radiance for the unit
    /// normal `n`; `None` for delta lights and where no light can arrive.
    pub fn seen_from(light: &'a Light, p: DVec3, n: DVec3) -> Option<(Self, f64)> {
        let (this, irradiance) = match light {
            Light::Quad(q) => {
                let normal = q.normal();
                let front = normal.dot(p - q.corners[0]) > 0.0;
                if !front && !q.two_sided {
                    return None;
                }
                (Self::Quad(q, normal), irradiance::polygon(p, n, &q.corners))
            }
            Light::Sphere { centre, radius, .. } => {
                let to_centre = *centre - p;
                let distance = to_centre.length();
                if distance <= *radius {
                    return None;
                }
                let axis = to_centre / distance;
                let (s, t) = orthonormal_basis(axis);
                let seen =
                    Self::Sphere { centre: *centre, axis, s, t, distance, radius: *radius };
                (seen, irradiance::sphere(p, n, *centre, *radius))
            }
            Light::Point { .. } | Light::Directional { .. } => return None,
        };
        (irradiance > 0.0).then_some((this, irradiance))
    }

    /// The light's point for `u` in the unit square, uniform over area (quad) or over solid angle
    /// (sphere; Shirley, Wang and Zimmerman, 1996).
    pub fn sample(&self, p: DVec3, n: DVec3, u: [f64; 2]) -> LightSample {
        match self {
            Self::Quad(q, normal) => {
                let point = quad_point(q, u);
                let to_light = point - p;
                let d2 = to_light.length_squared();
                let cos_light = to_light.dot(*normal).abs();
                let weight = (to_light.dot(n) * cos_light / (d2 * d2)).max(0.0);
                LightSample { point, normal: *normal, weight }
            }
            Self::Sphere { centre, axis, s, t, distance, radius } => {
                let sin2_max = (radius / distance) * (radius / distance);
                let cos_max = (1.0 - sin2_max).sqrt();
                // 1 − cos without cancellation for small lights.
                let one_minus = u[0] * sin2_max / (1.0 + cos_max);
                let cos = 1.0 - one_minus;
                let sin = (one_minus * (1.0 + cos)).sqrt();
                let (sin_phi, cos_phi) = libm::sincos(TAU * u[1]);
                let dir = *axis * cos + (*s * cos_phi + *t * sin_phi) * sin;
                let along = distance * cos;
                let half_chord = (radius * radius - distance * distance * sin * sin).max(0.0);
                let point = p + dir * (along - half_chord.sqrt());
                let normal = (point - *centre).normalize();
                LightSample { point, normal, weight: dir.dot(n).max(0.0) }
            }
        }
    }
}

/// Uniform by area over a flat convex quad.
fn quad_point(q: &QuadLight, u: [f64; 2]) -> DVec3 {
    let [a, b, c, d] = q.corners;
    let twist = (a - b) + (c - d);
    if twist.abs().max_element() <= 1e-6 * (c - a).abs().max_element() {
        return a + (b - a) * u[0] + (d - a) * u[1];
    }
    let first = (b - a).cross(c - a).length();
    let second = (c - a).cross(d - a).length();
    let share = first / (first + second);
    let (p1, p2, x) = if u[0] < share {
        (b, c, u[0] / share)
    } else {
        (c, d, (u[0] - share) / (1.0 - share))
    };
    let root = x.sqrt();
    a * (1.0 - root) + p1 * (root * (1.0 - u[1])) + p2 * (root * u[1])
}

/// Radiance of an area light; zero for delta lights.
pub fn radiance(light: &Light) -> Rgb {
    match light {
        Light::Quad(q) => q.radiance,
        Light::Sphere { radiance, .. } => *radiance,
        Light::Point { .. } | Light::Directional { .. } => Rgb::ZERO,
    }
}

/// What a delta light sends to `p` with unit normal `n`: irradiance, unshadowed, and where the
/// shadow ray goes. `None` where it does not shine or for area lights.
pub fn delta(light: &Light, p: DVec3, n: DVec3) -> Option<(Rgb, ShadowTarget)> {
    match light {
        Light::Point { position, intensity } => {
            let to_light = *position - p;
            let d2 = to_light.length_squared();
            let cos = to_light.dot(n) / d2.sqrt();
            (cos > 0.0)
                .then(|| (*intensity * (cos / d2) as f32, ShadowTarget::Point(*position)))
        }
        Light::Directional { to_light, irradiance } => {
            let cos = to_light.dot(n);
            (cos > 0.0).then(|| (*irradiance * cos as f32, ShadowTarget::Direction(*to_light)))
        }
        Light::Quad(_) | Light::Sphere { .. } => None,
    }
}

/// Where a shadow ray to a delta light goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowTarget {
    /// To a point.
    Point(DVec3),
    /// Without end.
    Direction(DVec3),
}

/// Cosine-weighted direction about the unit normal `n` (Malley's method on the concentric map of
/// Shirley and Chiu, 1997).
pub fn cosine_direction(n: DVec3, u: [f64; 2]) -> DVec3 {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return n;
    }
    let (r, phi) = if x.abs() > y.abs() {
        (x, 0.25 * PI * (y / x))
    } else {
        (y, 0.5 * PI - 0.25 * PI * (x / y))
    };
    let (sin, cos) = libm::sincos(phi);
    let (s, t) = orthonormal_basis(n);
    s * (r * cos) + t * (r * sin) + n * (1.0 - r * r).max(0.0).sqrt()
}
