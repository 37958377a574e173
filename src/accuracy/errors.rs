//! How far frames are off, in figures.

use super::frames::Cut;
use crate::error::Result;
use crate::film::{Encoding, Film, Image};
use crate::math::Rgb;
use crate::measure::{compare, psnr};
use crate::output::Display;
use crate::scene::Settings;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Frames by number, as displayed: sRGB code values, not rounded.
pub type Frames = BTreeMap<u32, Image>;

/// What rounding to 8 bits adds to a squared error, display steps.
pub const ROUNDING: f64 = 1.0 / 12.0;

/// The film as it is displayed.
pub fn displayed(film: &Film, settings: &Settings) -> Image {
    let rgb = displayed_rgb(&film.rgb, settings);
    Image { width: film.width, height: film.height, rgb, encoding: Encoding::Srgb }
}

/// Radiance as it is displayed.
pub fn displayed_rgb(rgb: &[Rgb], settings: &Settings) -> Vec<Rgb> {
    let display = Display { exposure: settings.exposure, tone: settings.tone };
    let code = |c: &Rgb| Rgb::from_array(display.code(*c).map(|v| v as f32));
    rgb.par_iter().map(code).collect()
}

/// How far the frames of a setting are off from the reference; means over the move.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Mean squared error of display values in [0, 1].
    pub mse: f64,
    /// Its root in display steps of 1/255.
    pub rmse_steps: f64,
    /// Peak signal-to-noise ratio of `mse`, dB.
    pub psnr: f64,
    /// SSIM (Gaussian window).
    pub ssim: f64,
    /// LDR-FLIP.
    pub flip: f64,
    /// Share of pixels that some channel is off by more than 2 display steps.
    pub share_over_2: f64,
    /// Root mean square of how the error changes from a frame to the next, display steps: what
    /// flickers. `None` where no two frames that follow one another were looked at.
    pub flicker: Option<f64>,
}

impl Errors {
    /// Of `frames` against `truth`, which has them all; weighed as `cut` says.
    ///
    /// # Errors
    /// As [`compare`]: sizes that differ.
    pub fn of(truth: &Frames, frames: &Frames, cut: &Cut) -> Result<Self> {
        let mut figures = Vec::new();
        for (frame, image) in frames {
            figures.push((*frame, compare(&truth[frame], image)?));
        }
        let mean = |of: fn(&crate::measure::Comparison) -> f64| {
            cut.mean(figures.iter().map(|(frame, c)| (*frame, of(c))))
        };
        let over_2 = |c: &crate::measure::Comparison| {
            c.exceeding.iter().find(|e| e.steps == 2).map_or(0.0, |e| e.share)
        };
        let mse = mean(|c| c.mse);
        Ok(Self {
            mse,
            rmse_steps: mse.sqrt() * 255.0,
            psnr: psnr(mse),
            ssim: mean(|c| c.ssim),
            flip: mean(|c| c.flip),
            share_over_2: mean(over_2),
            flicker: flicker(truth, frames),
        })
    }

    /// The mean of several; squared errors are averaged, roots taken of them.
    pub fn mean(all: &[Self]) -> Self {
        let n = all.len().max(1) as f64;
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / n;
        let mse = mean(|e| e.mse);
        let squares: Option<Vec<f64>> = all.iter().map(|e| e.flicker.map(|f| f * f)).collect();
        Self {
            mse,
            rmse_steps: mse.sqrt() * 255.0,
            psnr: psnr(mse),
            ssim: mean(|e| e.ssim),
            flip: mean(|e| e.flip),
            share_over_2: mean(|e| e.share_over_2),
            flicker: squares.map(|s| (s.iter().sum::<f64>() / n).sqrt()),
        }
    }
}

/// Over all pairs of frames that follow one another: how much the error changes.
fn flicker(truth: &Frames, frames: &Frames) -> Option<f64> {
    let mut squares = Vec::new();
    for (frame, image) in frames {
        let Some(next) = frames.get(&(frame + 1)) else { continue };
        let (true_now, true_next) = (&truth[frame].rgb, &truth[&(frame + 1)].rgb);
        let pixels = image.rgb.iter().zip(&next.rgb).zip(true_now.iter().zip(true_next));
        let change = pixels.map(|((now, next), (true_now, true_next))| {
            ((*next - *true_next) - (*now - *true_now)).as_dvec3().length_squared()
        });
        squares.push(change.sum::<f64>() / (3.0 * image.rgb.len() as f64));
    }
    let n = squares.len() as f64;
    (!squares.is_empty()).then(|| 255.0 * (squares.iter().sum::<f64>() / n).sqrt())
}

/// Root mean squared difference of two sets of the same frames, display steps.
pub fn rms_between(a: &Frames, b: &Frames) -> f64 {
    let mse = |(frame, image): (&u32, &Image)| crate::measure::mse(image, &b[frame]);
    let sum: f64 = a.iter().map(mse).sum();
    255.0 * (sum / a.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Image {
        Image { width: 16, height: 12, rgb: vec![Rgb::splat(value); 192], encoding: Encoding::Srgb }
    }

    #[test]
    fn an_error_that_stays_does_not_flicker_and_one_that_changes_does() {
        let truth = Frames::from([(1, flat(0.2)), (2, flat(0.3)), (5, flat(0.5))]);
        let steps = |n: f32| n / 255.0;
        let cut = Cut::of(&Settings::default(), 9, false);
        let still = Frames::from([
            (1, flat(0.2 + steps(4.0))),
            (2, flat(0.3 + steps(4.0))),
            (5, flat(0.5)),
        ]);
        let e = Errors::of(&truth, &still, &cut).expect("one size");
        assert!(e.flicker.expect("neighbours") < 1e-3, "{e:?}");
        // Frame 1 stands for two frames of nine, the others for seven.
        let share = (2.0 + 7.0 * 0.5) / 9.0;
        assert!((e.rmse_steps - 4.0 * f64::sqrt(share)).abs() < 1e-3, "{e:?}");
        assert!((e.share_over_2 - share).abs() < 1e-9);
        let changing = Frames::from([
            (1, flat(0.2 + steps(1.0))),
            (2, flat(0.3 - steps(2.0))),
            (5, flat(0.5)),
        ]);
        let e = Errors::of(&truth, &changing, &cut).expect("one size");
        assert!((e.flicker.expect("neighbours") - 3.0).abs() < 1e-3, "{e:?}");
        let alone = Frames::from([(5, flat(0.5))]);
        let e = Errors::of(&truth, &alone, &cut).expect("one size");
        assert_eq!((e.flicker, e.mse, e.psnr), (None, 0.0, f64::INFINITY));
    }
}
