//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli, 2004), in two forms.
//!
//! [`ssim`] is the paper's: a Gaussian window of 11 x 11 pixels and standard deviation 1.5,
//! weights summing to 1, constants `(0.01)²` and `(0.03)²` for a range of 1, population variances,
//! averaged over every place where the window lies whole inside the image, and over red, green
//! and blue. scikit-image's `structural_similarity` with `gaussian_weights=True, sigma=1.5,
//! use_sample_covariance=False, data_range=1, channel_axis=-1` is the same figure.
//!
//! [`ssim_blocks`] is what the crate `image-compare` calls SSIM, for figures that must stand
//! beside others made with it: 8 x 8 blocks side by side without overlap (smaller at the right
//! and bottom edges), flat weights, 8-bit values, the mean over blocks by area, and the *least*
//! of red, green and blue. It sums squares where the paper averages them, so that its variances
//! are 64 times as large against the same constants; it is the harsher of the two.

use super::error_metrics::assert_same_size;
use super::filter::Plane;
use crate::film::Image;
use rayon::prelude::*;

const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;

/// SSIM with the paper's Gaussian window, mean over R, G and B; 1 when identical, -1 at least.
///
/// Values are expected in [0, 1], display-encoded. An image narrower or lower than 11 pixels is
/// measured with the largest odd window that fits.
///
/// # Panics
/// When the sizes differ.
pub fn ssim(a: &Image, b: &Image) -> f64 {
    assert_same_size(a, b);
    let of_channel = |c| ssim_channel(&channel(a, c), &channel(b, c));
    (0..3).map(of_channel).sum::<f64>() / 3.0
}

/// One channel less 0.5: variances are unchanged, and f32 squares keep more of them.
fn channel(image: &Image, c: usize) -> Plane {
    let (width, height) = (image.width as usize, image.height as usize);
    Plane::from_fn(width, height, |i| image.rgb[i][c] - 0.5)
}

fn ssim_channel(a: &Plane, b: &Plane) -> f64 {
    let radius = RADIUS.min((a.width.min(a.height) - 1) / 2);
    let kernel = gaussian(radius);
    let window = |f: &(dyn Fn(usize) -> f32 + Sync)| {
        Plane::from_fn(a.width, a.height, f).filtered(&kernel, &kernel).data
    };
    let (mean_a, mean_b) = (window(&|i| a.data[i]), window(&|i| b.data[i]));
    let (aa, bb) = (window(&|i| a.data[i] * a.data[i]), window(&|i| b.data[i] * b.data[i]));
    let ab = window(&|i| a.data[i] * b.data[i]);
    let at = |i: usize| {
        let (ma, mb) = (f64::from(mean_a[i]), f64::from(mean_b[i]));
        let variances = (f64::from(aa[i]) - ma * ma, f64::from(bb[i]) - mb * mb);
        similarity(ma + 0.5, mb + 0.5, variances, f64::from(ab[i]) - ma * mb)
    };
    let rows = (radius..a.height - radius).into_par_iter();
    let sums = rows.map(|y| (radius..a.width - radius).map(|x| at(y * a.width + x)).sum());
    let sums: Vec<f64> = sums.collect();
    let count = (a.height - 2 * radius) * (a.width - 2 * radius);
    sums.iter().sum::<f64>() / count as f64
}

/// The paper's formula (13).
fn similarity(mean_a: f64, mean_b: f64, (var_a, var_b): (f64, f64), covariance: f64) -> f64 {
    let structure = (2.0 * covariance + C2) / (var_a + var_b + C2);
    structure * (2.0 * mean_a * mean_b + C1) / (mean_a * mean_a + mean_b * mean_b + C1)
}

fn gaussian(radius: usize) -> Vec<f32> {
    let weight = |k: usize| {
        let d = k as f64 - radius as f64;
        libm::exp(-d * d / (2.0 * SIGMA * SIGMA))
    };
    let sum: f64 = (0..=2 * radius).map(weight).sum();
    (0..=2 * radius).map(|k| (weight(k) / sum) as f32).collect()
}

const BLOCK: usize = 8;

/// SSIM as the crate `image-compare` defines it (see the module's head); 1 when identical.
///
/// Values are expected in [0, 1], display-encoded, and are rounded to 8 bits.
///
/// # Panics
/// When the sizes differ.
pub fn ssim_blocks(a: &Image, b: &Image) -> f64 {
    assert_same_size(a, b);
    let strips: Vec<[f64; 3]> = (0..a.height as usize)
        .into_par_iter()
        .step_by(BLOCK)
        .map(|y0| [0, 1, 2].map(|c| strip_of_blocks(a, b, y0, c)))
        .collect();
    let pixels = a.rgb.len() as f64;
    let score = |c: usize| strips.iter().map(|s| s[c]).sum::<f64>() / pixels;
    (0..3).map(score).fold(1.0, f64::min)
}

/// Similarity times area, summed over the blocks whose first row is `y0`.
fn strip_of_blocks(a: &Image, b: &Image, y0: usize, channel: usize) -> f64 {
    let (width, height) = (a.width as usize, a.height as usize);
    let y1 = (y0 + BLOCK).min(height);
    let block = |x0: usize| {
        let x1 = (x0 + BLOCK).min(width);
        let pixels = || (y0..y1).flat_map(|y| (x0..x1).map(move |x| y * width + x));
        let level = |image: &Image, i: usize| {
            f64::from((image.rgb[i][channel] * 255.0).round().clamp(0.0, 255.0)) / 255.0
        };
        let area = ((y1 - y0) * (x1 - x0)) as f64;
        let mean_a = pixels().map(|i| level(a, i)).sum::<f64>() / area;
        let mean_b = pixels().map(|i| level(b, i)).sum::<f64>() / area;
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for i in pixels() {
            let (da, db) = (level(a, i) - mean_a, level(b, i) - mean_b);
            aa += da * da;
            bb += db * db;
            ab += da * db;
        }
        area * similarity(mean_a, mean_b, (aa, bb), ab)
    };
    (0..width).step_by(BLOCK).map(block).sum()
}

#[cfg(test)]
mod tests {
    use super::super::test_images::{constant, from_fn, pairs, to_8_bit};
    use super::*;
    use crate::math::Rgb;
    use image_compare::Algorithm;

    #[test]
    fn closed_form_of_constant_images() {
        let (p, q) = (0.25, 0.75);
        let expected = (2.0 * p * q + C1) / (p * p + q * q + C1);
        let (a, b) = (constant(30, 20, 0.25), constant(30, 20, 0.75));
        assert!((ssim(&a, &b) - expected).abs() < 1e-4, "{}", ssim(&a, &b));
        let (a, b) = (constant(30, 20, 51.0 / 255.0), constant(30, 20, 204.0 / 255.0));
        let expected = (2.0 * 0.2 * 0.8 + C1) / (0.04 + 0.64 + C1);
        assert!((ssim_blocks(&a, &b) - expected).abs() < 1e-7);
    }

    #[test]
    fn identical_images_score_one() {
        for (name, a, _) in pairs() {
            assert!((ssim(&a, &a) - 1.0).abs() < 1e-12, "{name}");
            assert!((ssim_blocks(&a, &a) - 1.0).abs() < 1e-12, "{name}");
        }
    }

    /// The paper's sums written out in f64, window by window.
    fn by_definition(a: &Image, b: &Image, radius: usize) -> f64 {
        let (width, height) = (a.width as usize, a.height as usize);
        let kernel = gaussian(radius);
        let mut total = 0.0;
        let mut count = 0;
        for (c, y0, x0) in (0..3).flat_map(|c| {
            (0..height - 2 * radius)
                .flat_map(move |y| (0..width - 2 * radius).map(move |x| (c, y, x)))
        }) {
            let expect = |f: &dyn Fn(f64, f64) -> f64| {
                let mut sum = 0.0;
                for (j, wy) in kernel.iter().enumerate() {
                    for (i, wx) in kernel.iter().enumerate() {
                        let k = (y0 + j) * width + x0 + i;
                        let (p, q) = (f64::from(a.rgb[k][c]), f64::from(b.rgb[k][c]));
                        sum += f64::from(wx * wy) * f(p, q);
                    }
                }
                sum
            };
            let (ma, mb) = (expect(&|p, _| p), expect(&|_, q| q));
            let va = expect(&|p, _| (p - ma).powi(2));
            let vb = expect(&|_, q| (q - mb).powi(2));
            let cov = expect(&|p, q| (p - ma) * (q - mb));
            total += similarity(ma, mb, (va, vb), cov);
            count += 1;
        }
        total / f64::from(count)
    }

    #[test]
    fn agrees_with_the_definition_written_out() {
        for (name, a, b) in pairs() {
            let radius = if a.height < 11 { 2 } else { 5 };
            let (got, expected) = (ssim(&a, &b), by_definition(&a, &b, radius));
            assert!((got - expected).abs() < 2e-5, "{name}: {got} against {expected}");
        }
    }

    /// The figure is scikit-image 0.26's, called as the module's head says.
    #[test]
    fn agrees_with_scikit_image() {
        let level = |v: u32| v as f32 / 255.0;
        let a = from_fn(60, 48, |x, y| {
            Rgb::from_array([0, 1, 2].map(|c| level((x * 7 + y * 13 + c * 29) % 64 + 3 * x)))
        });
        let b = from_fn(60, 48, |x, y| {
            let base = 3 * x + y / 8 * 4;
            Rgb::from_array([0, 1, 2].map(|c| level((x * 7 + y * 11 + c * 31) % 64 + base)))
        });
        assert!((ssim(&a, &b) - 0.136_864_738_850).abs() < 1e-6, "{}", ssim(&a, &b));
    }

    #[test]
    fn blocks_agree_with_image_compare() {
        for (name, a, b) in pairs() {
            let ((_, a8), (_, b8)) = (to_8_bit(&a), to_8_bit(&b));
            let oracle = |bytes| image::RgbImage::from_raw(a.width, a.height, bytes).expect("size");
            let algorithm = Algorithm::MSSIMSimple;
            let expected =
                image_compare::rgb_similarity_structure(&algorithm, &oracle(a8), &oracle(b8));
            let (expected, got) = (expected.expect("one size").score, ssim_blocks(&a, &b));
            assert!((got - expected).abs() < 1e-6, "{name}: {got} against {expected}");
        }
    }
}
