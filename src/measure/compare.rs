//! Every figure about a pair of images, and about a sequence of pairs.

use super::error_metrics::{LargestError, largest_error, mse, psnr, share_exceeding};
use super::{flip, ssim, ssim_blocks};
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use serde::Serialize;

/// The values in which MSE, RMSE, PSNR and the largest error are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// Linear radiance clipped to [0, 1].
    Linear,
    /// sRGB code values in [0, 1].
    Srgb,
}

/// How far two images are apart. JSON has no infinity: an infinite PSNR is written as `null`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Columns of both.
    pub width: u32,
    /// Rows of both.
    pub height: u32,
    /// In which values `mse`, `rmse`, `psnr` and `largest` are taken.
    pub space: Space,
    /// Mean squared error over pixels and channels.
    pub mse: f64,
    /// Its root.
    pub rmse: f64,
    /// Peak signal-to-noise ratio for a peak of 1, dB; infinite when identical.
    pub psnr: f64,
    /// The largest absolute difference, and where.
    pub largest: LargestError,
    /// SSIM with the paper's Gaussian window (see [`ssim()`](super::ssim())); sRGB.
    pub ssim: f64,
    /// SSIM as the crate `image-compare` has it (see [`ssim_blocks`]); sRGB.
    pub ssim_blocks: f64,
    /// Mean LDR-FLIP; sRGB. The first image is the reference.
    pub flip: f64,
    /// Shares of pixels off by more than 0, 1, 2, 4, 8 and 16 display steps; sRGB.
    pub exceeding: Vec<Exceeding>,
    /// Pixels with a NaN or an infinity in either image. They are clipped like any other value (a
    /// NaN to 0), so only this figure tells of them.
    pub not_finite: usize,
}

/// A share of pixels that are off by more than some display steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Exceeding {
    /// The bound, in 1/255 of full scale, sRGB.
    pub steps: u32,
    /// Share of pixels beyond it in some channel, in [0, 1].
    pub share: f64,
}

/// Compares `image` with `reference` as the head of [`measure`](super) tells.
///
/// ```
/// use tweenray::film::{Encoding, Image};
/// use tweenray::math::Rgb;
/// use tweenray::measure::compare;
///
/// let grey = |value| Image::new(16, 16, vec![Rgb::splat(value); 256], Encoding::Linear);
/// let found = compare(&grey(0.5)?, &grey(0.25)?)?;
/// assert_eq!((found.mse, found.rmse), (0.0625, 0.25));
/// assert!(compare(&grey(0.5)?, &grey(0.5)?)?.psnr.is_infinite());
/// # Ok::<(), tweenray::error::Error>(())
/// ```
///
/// # Errors
/// [`Error::Usage`] when the sizes differ.
pub fn compare(reference: &Image, image: &Image) -> Result<Comparison> {
    let (width, height) = (reference.width, reference.height);
    if (width, height) != (image.width, image.height) {
        let (w, h) = (image.width, image.height);
        return Err(Error::Usage(format!(
            "the images differ in size: {width}x{height} and {w}x{h}"
        )));
    }
    let display = (reference.clipped(Encoding::Srgb), image.clipped(Encoding::Srgb));
    let (space, distances) = match (reference.encoding, image.encoding) {
        (Encoding::Linear, Encoding::Linear) => {
            let (a, b) = (reference.clipped(Encoding::Linear), image.clipped(Encoding::Linear));
            (Space::Linear, (mse(&a, &b), largest_error(&a, &b)))
        }
        _ => (Space::Srgb, (mse(&display.0, &display.1), largest_error(&display.0, &display.1))),
    };
    let (a, b) = display;
    let exceeding = |steps| Exceeding { steps, share: share_exceeding(&a, &b, steps) };
    Ok(Comparison {
        width,
        height,
        space,
        mse: distances.0,
        rmse: distances.0.sqrt(),
        psnr: psnr(distances.0),
        largest: distances.1,
        ssim: ssim(&a, &b),
        ssim_blocks: ssim_blocks(&a, &b),
        flip: flip(&a, &b),
        exceeding: [0, 1, 2, 4, 8, 16].map(exceeding).to_vec(),
        not_finite: reference.count_not_finite() + image.count_not_finite(),
    })
}

/// A sequence of comparisons in one line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Pairs compared.
    pub frames: usize,
    /// Mean of the frames' mean squared errors.
    pub mse: f64,
    /// Root of `mse`.
    pub rmse: f64,
    /// PSNR of `mse` (not the mean of the frames' PSNR, which one identical frame makes infinite).
    pub psnr: f64,
    /// The worst frame's PSNR, and which frame, from 0.
    pub worst_psnr: (f64, usize),
    /// The largest error of any frame, and which frame, from 0.
    pub largest: (LargestError, usize),
    /// Mean SSIM (Gaussian window).
    pub ssim: f64,
    /// Mean SSIM (blocks).
    pub ssim_blocks: f64,
    /// Mean FLIP.
    pub flip: f64,
}

/// Sums up the comparisons of a sequence; `None` for an empty one. Frames count alike, whatever
/// their size.
pub fn summarise(frames: &[Comparison]) -> Option<Summary> {
    let first = frames.first()?;
    let mean =
        |of: fn(&Comparison) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
    let mut worst_psnr = (first.psnr, 0);
    let mut largest = (first.largest, 0);
    for (i, frame) in frames.iter().enumerate() {
        if frame.psnr < worst_psnr.0 {
            worst_psnr = (frame.psnr, i);
        }
        if frame.largest.value > largest.0.value {
            largest = (frame.largest, i);
        }
    }
    let mse = mean(|f| f.mse);
    Some(Summary {
        frames: frames.len(),
        mse,
        rmse: mse.sqrt(),
        psnr: psnr(mse),
        worst_psnr,
        largest,
        ssim: mean(|f| f.ssim),
        ssim_blocks: mean(|f| f.ssim_blocks),
        flip: mean(|f| f.flip),
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_images::{constant, scene};
    use super::*;
    use crate::math::Rgb;

    fn linear(value: f32) -> Image {
        Image { encoding: Encoding::Linear, ..constant(16, 12, value) }
    }

    #[test]
    fn identical_images_have_no_error() {
        let image = scene(33, 20);
        let c = compare(&image, &image).expect("one size");
        assert_eq!((c.mse, c.psnr, c.flip, c.not_finite), (0.0, f64::INFINITY, 0.0, 0));
        assert!(c.exceeding.iter().all(|e| e.share == 0.0));
        let json = serde_json::to_value(&c).expect("plain data");
        assert!(json["psnr"].is_null());
        assert_eq!(json["space"], "srgb");
    }

    #[test]
    fn linear_pairs_are_clipped_and_not_encoded() {
        let c = compare(&linear(0.5), &linear(7.0)).expect("one size");
        assert_eq!((c.space, c.mse), (Space::Linear, 0.25));
    }

    #[test]
    fn of_a_mixed_pair_the_linear_one_is_encoded() {
        let c = compare(&linear(0.5), &constant(16, 12, 0.735_357)).expect("one size");
        assert_eq!(c.space, Space::Srgb);
        assert!(c.rmse < 1e-6, "{}", c.rmse);
    }

    #[test]
    fn other_sizes_are_an_error_and_nan_is_counted() {
        let error = compare(&constant(4, 4, 0.0), &constant(4, 5, 0.0)).expect_err("sizes differ");
        assert_eq!(error.to_string(), "the images differ in size: 4x4 and 4x5");
        let mut bad = linear(0.0);
        bad.rgb[3] = Rgb::splat(f32::NAN);
        assert_eq!(compare(&linear(0.0), &bad).expect("one size").not_finite, 1);
    }

    #[test]
    fn a_sequence_in_one_line() {
        let pair = |v| compare(&linear(0.0), &linear(v)).expect("one size");
        let s = summarise(&[pair(0.0), pair(0.4), pair(0.2)]).expect("three frames");
        assert!((s.mse - 0.2 / 3.0).abs() < 1e-8);
        assert_eq!((s.frames, s.worst_psnr.1, s.largest.1), (3, 1, 1));
        assert!(s.psnr.is_finite());
        assert!(summarise(&[]).is_none());
    }
}
