//! Per-pixel distances between two images of the same size. Values are taken as they are;
//! [`compare`](super::compare()) decides about encoding and clipping.

use crate::film::Image;
use crate::math::Rgb;
use rayon::prelude::*;
use serde::Serialize;

/// The pixel that is furthest off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LargestError {
    /// Absolute difference, in units of the image's values (1 is full scale).
    pub value: f32,
    /// Column, from 0 at the left.
    pub x: u32,
    /// Row, from 0 at the top.
    pub y: u32,
    /// 0 red, 1 green, 2 blue.
    pub channel: u8,
}

/// Mean squared error over all pixels and the three channels.
///
/// # Panics
/// When the sizes differ, as do all functions here.
pub fn mse(a: &Image, b: &Image) -> f64 {
    let sum = sum_of_rows(a, b, |p, q| {
        let d = (p - q).as_dvec3();
        d.length_squared()
    });
    sum / (3.0 * a.rgb.len() as f64)
}

/// Peak signal-to-noise ratio in dB of a mean squared error, for a peak of 1:
/// `-10 log10(mse)`; infinite when the images are identical.
pub fn psnr(mse: f64) -> f64 {
    if mse == 0.0 { f64::INFINITY } else { -10.0 * libm::log10(mse) }
}

/// The largest absolute difference of any channel; of equals the first, row by row.
pub fn largest_error(a: &Image, b: &Image) -> LargestError {
    assert_same_size(a, b);
    let width = a.width as usize;
    let rows = a.rgb.par_chunks(width).zip(b.rgb.par_chunks(width)).enumerate();
    let worst_of_rows: Vec<LargestError> = rows.map(|(y, (p, q))| worst_in_row(y, p, q)).collect();
    let mut worst = worst_of_rows[0];
    for row in worst_of_rows {
        if row.value > worst.value {
            worst = row;
        }
    }
    worst
}

fn worst_in_row(y: usize, a: &[Rgb], b: &[Rgb]) -> LargestError {
    let mut worst = LargestError { value: 0.0, x: 0, y: y as u32, channel: 0 };
    for (x, (p, q)) in a.iter().zip(b).enumerate() {
        for (channel, value) in (*p - *q).abs().to_array().into_iter().enumerate() {
            if value > worst.value {
                worst = LargestError { value, x: x as u32, y: y as u32, channel: channel as u8 };
            }
        }
    }
    worst
}

/// Share of pixels, in [0, 1], of which some channel is off by more than `steps` / 255.
///
/// A difference of exactly `steps` display steps does not count, although f32 may put it a hair
/// above: the bound is lifted by a thousandth of a step.
pub fn share_exceeding(a: &Image, b: &Image, steps: u32) -> f64 {
    let bound = (steps as f32 + 1e-3) / 255.0;
    let off = sum_of_rows(a, b, |p, q| f64::from((p - q).abs().max_element() > bound));
    off / a.rgb.len() as f64
}

/// Sums `f` over pixel pairs: within a row in f64, then row by row, whatever the threads.
fn sum_of_rows(a: &Image, b: &Image, f: impl Fn(Rgb, Rgb) -> f64 + Sync) -> f64 {
    assert_same_size(a, b);
    let width = a.width as usize;
    let rows = a.rgb.par_chunks(width).zip(b.rgb.par_chunks(width));
    let sums: Vec<f64> = rows.map(|(p, q)| p.iter().zip(q).map(|(p, q)| f(*p, *q)).sum()).collect();
    sums.iter().sum()
}

/// The one precondition of the metrics that take two images.
pub(super) fn assert_same_size(a: &Image, b: &Image) {
    assert_eq!((a.width, a.height), (b.width, b.height), "images of one size");
}

#[cfg(test)]
mod tests {
    use super::super::test_images::{constant, from_fn};
    use super::*;

    #[test]
    fn closed_form_of_a_constant_offset() {
        let (a, b) = (constant(31, 17, 0.25), constant(31, 17, 0.75));
        assert_eq!(mse(&a, &b), 0.25);
        assert!((psnr(0.25) - 6.020_599_913_279_624).abs() < 1e-12);
        assert_eq!(psnr(mse(&a, &a)), f64::INFINITY);
    }

    #[test]
    fn the_largest_error_is_found_with_its_place() {
        let a = constant(40, 30, 0.5);
        let mut b = a.clone();
        b.rgb[7 * 40 + 12].y = 0.2;
        b.rgb[20 * 40 + 3].z = 0.75;
        let worst = largest_error(&a, &b);
        assert_eq!((worst.x, worst.y, worst.channel), (12, 7, 1));
        assert!((worst.value - 0.3).abs() < 1e-6);
        assert_eq!(largest_error(&a, &a).value, 0.0);
    }

    #[test]
    fn exactly_n_steps_are_not_more_than_n() {
        for v in 0..=250u32 {
            let (a, b) = (constant(1, 1, v as f32 / 255.0), constant(1, 1, (v + 4) as f32 / 255.0));
            assert_eq!(share_exceeding(&a, &b, 4), 0.0, "{v}");
            assert_eq!(share_exceeding(&a, &b, 3), 1.0, "{v}");
        }
        let a = constant(10, 10, 0.0);
        let b = from_fn(10, 10, |x, y| Rgb::new(0.0, if x + 10 * y < 13 { 1.0 } else { 0.0 }, 0.0));
        assert_eq!(share_exceeding(&a, &b, 1), 0.13);
    }
}
