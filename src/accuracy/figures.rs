//! Errors of frames, estimated from their patches.

use super::choice::Goal;
use super::patches::{PatchImages, Patches};
use crate::error::Result;
use crate::film::Image;
use crate::measure::{compare, mse, share_exceeding};

/// The mean squared error of each frame in squares of a display step, and its standard error as a share of
/// it.
pub fn squared_errors(
    patches: &Patches,
    truth: &PatchImages,
    seen: &PatchImages,
) -> (Vec<f64>, Vec<f64>) {
    let share = |mean: f64, error: f64| if mean > 0.0 { error / mean } else { 0.0 };
    let means = patches.means(&each(truth, seen, mse)).into_iter();
    means.map(|(mean, error)| (255.0 * 255.0 * mean, share(mean, error))).unzip()
}

/// The figure of `goal` in the worst frame, as [`Goal::largest`] has it: it rises with the error.
///
/// # Errors
/// As [`compare`].
pub fn figure(
    goal: Goal,
    patches: &Patches,
    truth: &PatchImages,
    seen: &PatchImages,
) -> Result<f64> {
    let mut frames = Vec::new();
    for (truth, seen) in truth.iter().zip(seen) {
        let all = truth.iter().zip(seen).map(|(a, b)| {
            Ok(match goal {
                Goal::Psnr(_) => 255.0 * 255.0 * mse(a, b),
                Goal::MaxShare(_) => share_exceeding(a, b, 2),
                Goal::Ssim(_) => 1.0 - compare(a, b)?.ssim,
                Goal::Flip(_) => compare(a, b)?.flip,
            })
        });
        frames.push(all.collect::<Result<Vec<f64>>>()?);
    }
    Ok(patches.means(&frames).into_iter().map(|(mean, _)| mean).fold(0.0, f64::max))
}

fn each(truth: &PatchImages, seen: &PatchImages, of: fn(&Image, &Image) -> f64) -> Vec<Vec<f64>> {
    let frame = |(truth, seen): (&Vec<Image>, &Vec<Image>)| {
        truth.iter().zip(seen).map(|(a, b)| of(a, b)).collect()
    };
    truth.iter().zip(seen).map(frame).collect()
}
