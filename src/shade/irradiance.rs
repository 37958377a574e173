//! Irradiance from unoccluded area lights in closed form, per unit of radiance.

use crate::math::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use wide::{CmpGt, CmpLt, f64x4};

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
    let mut sum = 0.0;
    for first in (0..count).step_by(4) {
        // Edges beyond the last have no length.
        let (mut from, mut to) = ([DVec3::ZERO; 4], [DVec3::ZERO; 4]);
        for (k, i) in (first..count.min(first + 4)).enumerate() {
            (from[k], to[k]) = (above[i], above[if i + 1 == count { 0 } else { i + 1 }]);
        }
        sum += edges(n, lanes(&from), lanes(&to));
    }
    0.5 * sum.abs()
}

/// Coordinates of four vectors.
fn lanes(v: &[DVec3; 4]) -> [f64x4; 3] {
    [v.map(|v| v.x).into(), v.map(|v| v.y).into(), v.map(|v| v.z).into()]
}

/// What four edges `from`..`to`, as seen from a point, add to twice its irradiance: each edge's angle
/// times the cosine between `n` and the normal of its plane with the point.
fn edges(n: DVec3, from: [f64x4; 3], to: [f64x4; 3]) -> f64 {
    let [(ax, ay, az), (bx, by, bz)] = [from, to].map(|[x, y, z]| (x, y, z));
    let (x, y, z) = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx);
    let sin = (x * x + y * y + z * z).sqrt();
    let cos = ax * bx + ay * by + az * bz;
    let along = x * f64x4::splat(n.x) + y * f64x4::splat(n.y) + z * f64x4::splat(n.z);
    // An arc tangent of both keeps its accuracy for small lights, where acos(cos) loses half its
    // digits. Where there is no angle, there is no direction either.
    let each = angle(sin, cos) * (along / sin);
    let [a, b, c, d] = sin.cmp_gt(f64x4::ZERO).blend(each, f64x4::ZERO).to_array();
    (a + b) + (c + d)
}

/// The angles in 0..=π whose tangents are `sin / cos`, `sin` not negative: to 5e-16 relative (Moshier,
/// Cephes 2.2, 1992). Four at once, from operations that are the same on every machine.
fn angle(sin: f64x4, cos: f64x4) -> f64x4 {
    /// Tangent of 3π/8.
    const STEEP: f64 = 2.414_213_562_373_095;
    const P: [f64; 5] = [
        -8.750_608_600_031_904e-1,
        -1.615_753_718_733_365e1,
        -7.500_855_792_314_705e1,
        -1.228_866_684_490_136_2e2,
        -6.485_021_904_942_025e1,
    ];
    const Q: [f64; 5] = [
        2.485_846_490_142_306_3e1,
        1.650_270_098_316_988_6e2,
        4.328_810_604_912_903e2,
        4.853_903_996_359_137e2,
        1.945_506_571_482_614e2,
    ];
    let across = cos.abs();
    let (steep, middling) =
        (sin.cmp_gt(across * f64x4::splat(STEEP)), sin.cmp_gt(across * f64x4::splat(0.66)));
    let over = steep.blend(-across, middling.blend(sin - across, sin));
    let under = steep.blend(sin, middling.blend(sin + across, across));
    let base =
        steep.blend(f64x4::splat(FRAC_PI_2), middling.blend(f64x4::splat(FRAC_PI_4), f64x4::ZERO));
    let x = over / under;
    let xx = x * x;
    let powers = |first: f64x4, rest: &[f64]| {
        rest.iter().fold(first, |sum, factor| sum * xx + f64x4::splat(*factor))
    };
    let ratio = powers(f64x4::splat(P[0]), &P[1..]) / powers(f64x4::ONE, &Q);
    let acute = base + (x * (xx * ratio) + x);
    cos.cmp_lt(f64x4::ZERO).blend(f64x4::splat(PI) - acute, acute)
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
    fn angles_are_right_to_the_last_digits() {
        for k in 0..100_000 {
            let exact = PI * f64::from(k) / 99_999.0;
            let length = 10f64.powi(k % 41 - 20);
            let (sin, cos) = (length * exact.sin(), length * exact.cos());
            let expected = libm::atan2(sin.abs(), cos);
            let [got, ..] = angle(sin.abs().into(), cos.into()).to_array();
            assert!((got - expected).abs() <= 6e-16 * expected, "{got} against {expected}");
        }
    }

    #[test]
    fn a_polygon_with_a_corner_at_the_point_or_without_area_sends_nothing_absurd() {
        let p = DVec3::ZERO;
        let seen_from_its_plane =
            [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)].map(|(x, z)| DVec3::new(x, 0.0, z));
        assert!(polygon(p, DVec3::Y, &seen_from_its_plane).abs() < 1e-15);
        assert_eq!(polygon(p, DVec3::Z, &[DVec3::Z; 4]), 0.0);
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
