//! FLIP's feature pipeline: edges and points that one picture has and the other has not.

use super::{Plane, kernel, to_f32};
use rayon::prelude::*;

/// Width of the feature detector, degrees.
const WIDTH: f64 = 0.082;

/// The feature difference of every pixel, in [0, 1], from the Y planes of YCxCz.
pub fn feature_difference(reference: &Plane, test: &Plane, ppd: f64) -> Vec<f32> {
    let detector = Detector::new(ppd);
    let (reference, test) = (detector.features(reference), detector.features(test));
    let difference = |(p, q): (&[f32; 2], &[f32; 2])| {
        let largest = (p[0] - q[0]).abs().max((p[1] - q[1]).abs());
        // The exponent is the paper's q_f = 0.5.
        (largest * std::f32::consts::FRAC_1_SQRT_2).sqrt()
    };
    reference.par_iter().zip(&test).map(difference).collect()
}

/// A Gaussian and its first two derivatives, in pixels.
struct Detector {
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Detector {
    fn new(ppd: f64) -> Self {
        let sigma = 0.5 * WIDTH * ppd;
        let radius = libm::ceil(3.0 * sigma) as usize;
        let gauss = |d: f64| libm::exp(-d * d / (2.0 * sigma * sigma));
        let smooth = kernel(radius, gauss);
        let sum: f64 = smooth.iter().sum();
        Self {
            smooth: to_f32(&smooth, 1.0 / sum),
            edge: balanced(&kernel(radius, |d| -d * gauss(d))),
            point: balanced(&kernel(radius, |d| (d * d / (sigma * sigma) - 1.0) * gauss(d))),
        }
    }

    /// Length of the first and of the second derivatives, per pixel.
    fn features(&self, y: &Plane) -> Vec<[f32; 2]> {
        let lightness = Plane::from_fn(y.width, y.height, |i| (y.data[i] + 16.0) / 116.0);
        let smooth_x = lightness.filtered_x(&self.smooth);
        let dx = lightness.filtered(&self.edge, &self.smooth).data;
        let dy = smooth_x.filtered_y(&self.edge).data;
        let ddx = lightness.filtered(&self.point, &self.smooth).data;
        let ddy = smooth_x.filtered_y(&self.point).data;
        let length = |a: f32, b: f32| (a * a + b * b).sqrt();
        let pixel = |i| [length(dx[i], dy[i]), length(ddx[i], ddy[i])];
        (0..dx.len()).into_par_iter().map(pixel).collect()
    }
}

/// Scales positive weights to sum to 1 and negative ones to -1.
fn balanced(kernel: &[f64]) -> Vec<f32> {
    let positive: f64 = kernel.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = kernel.iter().filter(|w| **w < 0.0).sum();
    let scale = |w: f64| match w {
        0.0 => 0.0,
        w if w > 0.0 => w / positive,
        w => w / -negative,
    };
    kernel.iter().map(|w| scale(*w) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_step_is_an_edge_of_length_one() {
        // Y of 100 is lightness 1, Y of -16 is lightness 0.
        let step = Plane::from_fn(41, 9, |i| if i % 41 < 20 { -16.0 } else { 100.0 });
        let features = Detector::new(67.0).features(&step);
        let best = features[4 * 41..5 * 41].iter().map(|f| f[0]).fold(0.0, f32::max);
        // The middle weight is 0, so the step gathers one whole side of the kernel.
        assert!((best - 1.0).abs() < 1e-5, "{best}");
    }

    #[test]
    fn a_ppd_so_low_that_the_kernel_is_one_pixel_stays_finite() {
        let plane = Plane::from_fn(5, 5, |i| i as f32);
        for f in Detector::new(1e-3).features(&plane) {
            assert!(f[0].is_finite() && f[1].is_finite());
        }
    }
}
