//! A plane through ratios: what samples tell of a point where light changes steadily from one to the
//! next, as across a wide shadow's rim.

use super::taps::Tap;
use crate::math::{Vec3, orthonormal_basis};

/// Ratios as a linear function of the place on the surface, by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    /// Its value at the point.
    pub value: f32,
    /// Variance of the ratios about it, by the degrees of freedom that they have left.
    pub residual: f32,
    /// Variance of `value`, in that of one sample.
    pub leverage: f32,
}

/// Sums over samples: of places `u`, `v` on the surface, ratios `r`, and their products.
#[derive(Default)]
struct Sums {
    n: f32,
    u: f32,
    v: f32,
    r: f32,
    uu: f32,
    uv: f32,
    vv: f32,
    ur: f32,
    vr: f32,
    rr: f32,
}

impl Plane {
    /// Fits the ratios of samples about a point with the normal `n`. `None` if these are fewer than
    /// four, or nearly on a line.
    pub fn fit(n: Vec3, samples: impl Iterator<Item = (Tap, f32)>) -> Option<Self> {
        let (tangent, bitangent) = orthonormal_basis(n.as_dvec3());
        let (tangent, bitangent) = (tangent.as_vec3(), bitangent.as_vec3());
        let mut sums = Sums::default();
        for (tap, ratio) in samples {
            sums.add(tap.apart.dot(tangent), tap.apart.dot(bitangent), ratio);
        }
        sums.plane()
    }
}

impl Sums {
    fn add(&mut self, u: f32, v: f32, r: f32) {
        self.n += 1.0;
        self.u += u;
        self.v += v;
        self.r += r;
        self.uu += u * u;
        self.uv += u * v;
        self.vv += v * v;
        self.ur += u * r;
        self.vr += v * r;
        self.rr += r * r;
    }

    fn plane(&self) -> Option<Plane> {
        if self.n < 4.0 {
            return None;
        }
        let mean = |sum: f32| sum / self.n;
        let (u, v, r) = (mean(self.u), mean(self.v), mean(self.r));
        let about = |product: f32, a: f32, b: f32| mean(product) - a * b;
        let (uu, uv, vv) = (about(self.uu, u, u), about(self.uv, u, v), about(self.vv, v, v));
        let (ur, vr, rr) = (about(self.ur, u, r), about(self.vr, v, r), about(self.rr, r, r));
        let det = uu * vv - uv * uv;
        let wide = 0.01 * (uu + vv) * (uu + vv);
        // NaN is none either.
        if det.is_nan() || det <= wide {
            return None;
        }
        let (a, b) = ((ur * vv - vr * uv) / det, (vr * uu - ur * uv) / det);
        let apart = (u * u * vv - 2.0 * u * v * uv + v * v * uu) / det;
        Some(Plane {
            value: r - a * u - b * v,
            residual: (rr - a * ur - b * vr).max(0.0) * self.n / (self.n - 3.0).max(1.0),
            leverage: (1.0 + apart) / self.n,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tap(x: f32, z: f32) -> Tap {
        Tap { reference: 0, sample: 0, apart: Vec3::new(x, 0.0, z) }
    }

    fn fit(samples: &[(f32, f32, f32)]) -> Option<Plane> {
        let taps: Vec<Tap> = samples.iter().map(|(x, z, _)| tap(*x, *z)).collect();
        Plane::fit(Vec3::Y, taps.into_iter().zip(samples.iter().map(|s| s.2)))
    }

    #[test]
    fn what_is_linear_is_found_without_residual() {
        let at = |x: f32, z: f32| (x, z, 0.4 + 0.3 * x - 0.4 * z);
        let places = [(0.3, 0.2), (-0.7, 0.3), (0.4, -0.8), (-0.6, -0.7), (1.0, 1.5)];
        let plane = fit(&places.map(|(x, z)| at(x, z))).expect("a plane");
        assert!((plane.value - 0.4).abs() < 1e-5, "{plane:?}");
        assert!(plane.residual < 1e-6, "{plane:?}");
        assert!(plane.leverage > 1.0 / 5.0 && plane.leverage < 0.5, "{plane:?}");
    }

    #[test]
    fn a_step_leaves_a_residual_and_a_far_point_is_doubtful() {
        let square = [(-1.0, -1.0), (-0.3, -1.0), (0.3, -1.0), (1.0, -1.0)];
        let both = square.into_iter().flat_map(|(x, z)| [(x, z), (x, -z)]);
        let step: Vec<_> = both.map(|(x, z)| (x, z, f32::from(x > 0.0))).collect();
        assert!(fit(&step).expect("a plane").residual > 0.03);
        let moved: Vec<_> = step.iter().map(|(x, z, r)| (x + 3.0, *z, *r)).collect();
        assert!(fit(&moved).expect("a plane").leverage > 1.5);
    }

    #[test]
    fn three_samples_and_samples_on_a_line_are_no_plane() {
        assert_eq!(fit(&[(0.0, 0.0, 0.1), (1.0, 0.0, 0.2), (0.0, 1.0, 0.3)]), None);
        assert_eq!(fit(&[0.0, 1.0, 2.0, 3.0, 4.0].map(|k| (k, 0.5 * k, 0.2))), None);
    }
}
