//! LDR-FLIP: how different two pictures look when flipped between on a screen (Andersson,
//! Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, 2020).
//!
//! Colour: sRGB → YCxCz, low-passed with the eye's contrast sensitivity, clamped to the RGB cube,
//! to L*a*b* with Hunt's adjustment; HyAB distance, raised to 0.7 and mapped to [0, 1].
//! Features: edges and points of the unfiltered luminance. Both make one error per pixel:
//! `colour^(1 - feature)`.
//!
//! The filters are separated as in the authors' own C++, against which (crate `nv-flip`) the
//! tests hold this room.

mod colour;
mod features;

use super::error_metrics::assert_same_size;
use super::filter::Plane;
use crate::film::Image;
use colour::{colour_difference, ycxcz};
use features::feature_difference;
use rayon::prelude::*;

/// Pixels per degree of the paper's viewer: a 3840-pixel screen 0.7 m wide seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// The mean FLIP error of `test` against `reference`, in [0, 1], for the paper's viewer.
///
/// Values are expected in [0, 1], sRGB-encoded.
///
/// # Panics
/// When the sizes differ.
pub fn flip(reference: &Image, test: &Image) -> f64 {
    let map = flip_map(reference, test, PIXELS_PER_DEGREE);
    let rows = map.par_chunks(reference.width as usize);
    let sums: Vec<f64> = rows.map(|row| row.iter().map(|v| f64::from(*v)).sum()).collect();
    sums.iter().sum::<f64>() / map.len() as f64
}

/// The FLIP error of every pixel, in [0, 1], row by row from the top.
///
/// # Panics
/// When the sizes differ, or `pixels_per_degree` is not a positive number.
pub fn flip_map(reference: &Image, test: &Image, pixels_per_degree: f32) -> Vec<f32> {
    assert_same_size(reference, test);
    assert!(pixels_per_degree > 0.0 && pixels_per_degree.is_finite(), "pixels per degree");
    let ppd = f64::from(pixels_per_degree);
    let (reference, test) = (ycxcz(reference), ycxcz(test));
    let colour = colour_difference(&reference, &test, ppd);
    let feature = feature_difference(&reference[0], &test[0], ppd);
    let pixels = colour.par_iter().zip(&feature);
    pixels.map(|(colour, feature)| libm::powf(*colour, 1.0 - feature)).collect()
}

/// A kernel of `2 · radius + 1` weights from a function of the distance to the middle, in pixels.
fn kernel(radius: usize, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * radius).map(|k| weight(k as f64 - radius as f64)).collect()
}

fn to_f32(kernel: &[f64], scale: f64) -> Vec<f32> {
    kernel.iter().map(|w| (w * scale) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_images::{constant, from_fn, pairs, to_8_bit};
    use super::*;
    use crate::math::Rgb;

    fn oracle(a: &Image, b: &Image, ppd: f32) -> Vec<f32> {
        let load = |image: &Image| {
            nv_flip::FlipImageRgb8::with_data(image.width, image.height, &to_8_bit(image).1)
        };
        nv_flip::flip(load(a), load(b), ppd).to_vec()
    }

    #[test]
    fn agrees_with_the_authors_code() {
        for (name, a, b) in pairs() {
            let (a, b) = (to_8_bit(&a).0, to_8_bit(&b).0);
            for ppd in [PIXELS_PER_DEGREE, 30.0] {
                let (got, expected) = (flip_map(&a, &b, ppd), oracle(&a, &b, ppd));
                let mean =
                    |map: &[f32]| map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64;
                let (g, e) = (mean(&got), mean(&expected));
                assert!((g - e).abs() < 2e-5, "{name} at {ppd}: {g} against {e}");
                let furthest = got.iter().zip(&expected).map(|(g, e)| (g - e).abs());
                let furthest = furthest.fold(0.0, f32::max);
                assert!(furthest < 5e-3, "{name} at {ppd}: a pixel is {furthest} off");
            }
        }
    }

    #[test]
    fn extremes() {
        let (black, white) = (constant(64, 64, 0.0), constant(64, 64, 1.0));
        assert_eq!(flip(&white, &white), 0.0);
        // The paper's largest colour difference is that of green and blue.
        let green = from_fn(64, 64, |_, _| Rgb::Y);
        let blue = from_fn(64, 64, |_, _| Rgb::Z);
        assert!((flip(&green, &blue) - 1.0).abs() < 1e-3);
        let contrast = flip(&black, &white);
        assert!(contrast > 0.9 && contrast < 1.0, "{contrast}");
    }

    #[test]
    fn flip_does_not_depend_on_the_number_of_threads() {
        let (_, a, b) = pairs().swap_remove(0);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool").install(|| flip(&a, &b))
        };
        assert_eq!(with(1), with(3));
    }
}
