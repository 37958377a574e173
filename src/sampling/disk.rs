//! The unit disk and the hemisphere over it.

use crate::math::DVec3;

/// Maps `u` in (0, 1)² to the unit disk, uniformly by area, squares to rings (Shirley and Chiu,
/// 1997). Gives `(x, y, r²)`; `r²` is exact at the rim, where `x² + y²` would round.
pub fn concentric_disk(u: [f64; 2]) -> (f64, f64, f64) {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    let wide = a.abs() > b.abs();
    let (r, other) = if wide { (a, b) } else { (b, a) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (sin, cos) = sin_cos_quarter_pi(ratio);
    let (x, y) = if wide { (r * cos, r * sin) } else { (r * sin, r * cos) };
    (x, y, r * r)
}

/// Maps `u` in (0, 1)² to a unit vector about +z with density `z/π` (Malley's method).
pub fn cosine_hemisphere(u: [f64; 2]) -> DVec3 {
    let (x, y, r2) = concentric_disk(u);
    DVec3::new(x, y, (1.0 - r2).max(0.0).sqrt())
}

/// A vector given about +z, turned into the frame whose +z is the unit vector `axis` and whose
/// other axes are `basis` ([`crate::math::orthonormal_basis`]).
pub fn to_world(local: DVec3, basis: (DVec3, DVec3), axis: DVec3) -> DVec3 {
    basis.0 * local.x + basis.1 * local.y + axis * local.z
}

/// `(sin, cos)` of `ratio · π/4` for `ratio` in [-1, 1], within 2 ulp: plain polynomials without
/// a range reduction (coefficients of fdlibm's kernels, Sun Microsystems, 1993).
fn sin_cos_quarter_pi(ratio: f64) -> (f64, f64) {
    const S: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_4e-8,
        1.589_690_995_211_55e-10,
    ];
    const C: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let x = ratio * std::f64::consts::FRAC_PI_4;
    let z = x * x;
    let poly = |c: [f64; 6]| c.into_iter().rev().fold(0.0, |sum, c| sum * z + c);
    (x + x * z * poly(S), 1.0 - 0.5 * z + z * z * poly(C))
}

#[cfg(test)]
mod tests {
    use super::super::PixelSampler;
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_libm() {
        for i in -1000..=1000 {
            let ratio = f64::from(i) / 1000.0;
            let (sin, cos) = sin_cos_quarter_pi(ratio);
            let x = ratio * std::f64::consts::FRAC_PI_4;
            assert!((sin - libm::sin(x)).abs() < 2.3e-16 && (cos - libm::cos(x)).abs() < 2.3e-16);
        }
    }

    fn pairs(n: u32) -> impl Iterator<Item = [f64; 2]> {
        let sampler = PixelSampler::new(5, 1, 2, 3);
        (0..n).map(move |i| sampler.get2(i, 0).map(f64::from))
    }

    #[test]
    fn the_disk_is_covered_uniformly() {
        // 8 rings of equal area by 16 sectors.
        let mut counts = [0u32; 128];
        for u in pairs(1 << 16) {
            let (x, y, r2) = concentric_disk(u);
            assert!((x * x + y * y - r2).abs() < 1e-15 && r2 < 1.0);
            let sector = (libm::atan2(y, x) / std::f64::consts::TAU + 0.5) * 16.0;
            counts[(r2 * 8.0) as usize * 16 + (sector as usize).min(15)] += 1;
        }
        for c in counts {
            assert!((f64::from(c) / 512.0 - 1.0).abs() < 0.06, "{c}");
        }
    }

    #[test]
    fn the_disk_holds_its_corners_and_centre() {
        assert_eq!(concentric_disk([0.5, 0.5]), (0.0, 0.0, 0.0));
        for u in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.5], [0.5, 1.0]] {
            let (x, y, r2) = concentric_disk(u);
            assert!(r2 == 1.0 && (x * x + y * y - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_hemisphere_has_the_moments_of_its_density() {
        let n = 1 << 16;
        let mut sums = [0f64; 5];
        for u in pairs(n) {
            let d = cosine_hemisphere(u);
            assert!((d.length() - 1.0).abs() < 1e-15 && d.z > 0.0);
            for (sum, v) in sums.iter_mut().zip([d.x, d.y, d.z, d.z * d.z, d.x * d.y]) {
                *sum += v / f64::from(n);
            }
        }
        // E z = 2/3, E z² = 1/2.
        for (sum, exact) in sums.into_iter().zip([0.0, 0.0, 2.0 / 3.0, 0.5, 0.0]) {
            assert!((sum - exact).abs() < 2e-5, "{sum} for {exact}");
        }
    }
}
