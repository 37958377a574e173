//! Irradiance from unoccluded area lights in closed form, per unit of radiance.

use crate::math::DVec3;
use std::f64::consts::PI;

/// Irradiance at `p` with unit normal `n` from a flat polygon of radiance 1, occlusion ignored.
///
/// Lambert's formula (Lambert, 1760; Arvo, 1994) over the part of the polygon above the horizon
/// of `n`. The polygon's own side is not looked at. Zero when it lies wholly below.
pub fn polygon(p: DVec3, n: DVec3, corners: &[DVec3; 4]) -> f64 {
    let mut above = [DVec3::ZERO; 8];
    let count = clip_to_horizon(p, n, corners, &mut above);
    if count < 3 {
        return 0.0;
    }
    let directions = &mut above[..count];
    directions.iter_mut().for_each(|d| *d = d.normalize_or_zero());
    let mut sum = 0.0;
    for i in 0..count {
        let (a, b) = (directions[i], directions[(i + 1) % count]);
        let cross = a.cross(b);
        let sin = cross.length();
        if sin > 0.0 {
            // atan2 keeps its accuracy for small lights, where acos(dot) loses half its digits.
            sum += libm::atan2(sin, a.dot(b)) * cross.dot(n) / sin;
        }
    }
    0.5 * sum.abs()
}

/// The mean of the corners of what of a flat convex polygon lies above the horizon of `n` at `p`.
pub fn middle_above(p: DVec3, n: DVec3, corners: &[DVec3; 4]) -> Option<DVec3> {
    let mut above = [DVec3::ZERO; 8];
    let count = clip_to_horizon(p, n, corners, &mut above);
    let middle = above[..count].iter().sum::<DVec3>() / count as f64;
    (count > 0 && middle.dot(n) > 0.0).then(|| p + middle)
}

/// Sutherland–Hodgman clipping by the plane through `p` with normal `n`; corners relative to `p`.
fn clip_to_horizon(p: DVec3, n: DVec3, corners: &[DVec3; 4], out: &mut [DVec3; 8]) -> usize {
    let mut count = 0;
    let mut push = |v: DVec3| {
        out[count] = v;
        count += 1;
    };
    for i in 0..4 {
        let (a, b) = (corners[i] - p, corners[(i + 1) % 4] - p);
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha > 0.0 {
            push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    count
}

/// Irradiance at `p` with unit normal `n` from a sphere of radiance 1, occlusion ignored.
///
/// Closed form with the horizon (Lagarde and de Rousiers, 2014, after Snyder, 1996).
/// π for a point inside the sphere.
pub fn sphere(p: DVec3, n: DVec3, centre: DVec3, radius: f64) -> f64 {
    let to_centre = centre - p;
    let distance = to_centre.length();
    if distance <= radius {
        return PI;
    }
    let h = distance / radius;
    let cos = (to_centre.dot(n) / distance).clamp(-1.0, 1.0);
    if h * cos >= 1.0 {
        return PI * cos / (h * h);
    }
    if h * cos <= -1.0 {
        return 0.0;
    }
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let x = (h * h - 1.0).sqrt();
    let y = (-x * cos / sin).clamp(-1.0, 1.0);
    let root = sin * (1.0 - y * y).sqrt();
    let disc = (cos * libm::acos(y) - x * root) / (h * h);
    (disc + libm::atan(root / x)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint rule over the hemisphere: what the closed forms must equal.
    fn by_quadrature(n: DVec3, sees: impl Fn(DVec3) -> bool) -> f64 {
        let (s, t) = crate::math::orthonormal_basis(n);
        let steps = 1500;
        let mut sum = 0.0;
        for i in 0..steps {
            // Equal steps in sin² make equal shares of cosine-weighted solid angle.
            let sin2 = (i as f64 + 0.5) / steps as f64;
            for j in 0..steps {
                let phi = 2.0 * PI * (j as f64 + 0.5) / steps as f64;
                let d = (s * phi.cos() + t * phi.sin()) * sin2.sqrt() + n * (1.0 - sin2).sqrt();
                sum += f64::from(u8::from(sees(d)));
            }
        }
        PI * sum / (steps * steps) as f64
    }

    #[test]
    fn sphere_matches_quadrature_above_across_and_below_the_horizon() {
        let (centre, radius) = (DVec3::new(0.0, 0.0, 3.0), 1.0);
        for tilt in [0.0f64, 0.5, 1.3, 1.5, 1.7, 1.9, 2.5] {
            let n = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            let expected = by_quadrature(n, |d| {
                let along = d.dot(centre);
                along > 0.0 && (centre - d * along).length() < radius
            });
            let got = sphere(DVec3::ZERO, n, centre, radius);
            assert!((got - expected).abs() < 2e-3, "tilt {tilt}: {got} against {expected}");
        }
    }

    #[test]
    fn polygon_matches_quadrature_also_across_the_horizon() {
        let corners = [(-1.0, -1.0), (1.5, -1.0), (1.0, 2.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::new(x, y, 1.5));
        let inside = |x: f64, y: f64| {
            (0..4).all(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) >= 0.0
            })
        };
        for tilt in [0.0f64, 0.7, 1.4, 1.7, 2.4] {
            let n = DVec3::new(tilt.sin(), 0.0, tilt.cos());
            let expected =
                by_quadrature(n, |d| d.z > 0.0 && inside(d.x / d.z * 1.5, d.y / d.z * 1.5));
            let got = polygon(DVec3::ZERO, n, &corners);
            assert!((got - expected).abs() < 2e-3, "tilt {tilt}: {got} against {expected}");
        }
    }

    #[test]
    fn polygon_matches_the_known_form_factor_of_a_parallel_square() {
        // A 2a x 2a square at height h above its middle, by integrating Lambert's formula:
        // E/L = 4·(a/√(a²+h²))·atan(a/√(a²+h²)).
        let (a, h) = (1.0f64, 2.0f64);
        let corners = [(-a, -a), (a, -a), (a, a), (-a, a)].map(|(x, y)| DVec3::new(x, y, h));
        let s = a / (a * a + h * h).sqrt();
        let expected = 4.0 * s * s.atan();
        assert!((polygon(DVec3::ZERO, DVec3::Z, &corners) - expected).abs() < 1e-14);
    }
}
