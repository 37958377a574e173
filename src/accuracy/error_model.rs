//! How a traced frame's squared error falls with its samples.
//!
//! Squared errors of independent sources add. With n camera samples, s shadow and k sky samples of each, a
//! frame's squared error is taken to be, in squares of a display step,
//!
//! ```text
//! camera · n^-1.3  +  n^-1.1 · (shadow · s^-1.4 + sky · k^-1.4)  +  bias · s^-2
//! ```
//!
//! The amplitudes are fitted to measurements; the last is that of the bias of a ratio of two averages. The
//! powers are typical of points of a Sobol sequence: another scene's differ somewhat, so a setting is traced
//! before it is chosen. They hold for powers of two, since Sobol points are even in whole blocks of so many
//! (Owen, 1997): other numbers of samples are several blocks, each with an error of its own.

use super::fit::fit;
use serde::{Deserialize, Serialize};

/// Powers of the camera samples: of the error at edges, and of that of light.
const CAMERA: (f64, f64) = (1.3, 1.1);
/// Power of the shadow or sky samples.
const LIGHT: f64 = 1.4;

/// Samples of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleCounts {
    /// Camera samples.
    pub spp: u32,
    /// Shadow samples of each camera sample, per light.
    pub shadow: u32,
    /// Sky samples of each camera sample.
    pub sky: u32,
}

/// Amplitudes of camera, shadow, sky and bias: squared errors with one sample of everything, in squares of
/// a display step.
type Amplitudes = [f64; 4];

/// Which sources of noise a scene has beside its edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct NoiseSources {
    /// Area lights.
    pub shadow: bool,
    /// Light of the sky.
    pub sky: bool,
}

/// The error model of some traced frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorModel {
    sources: NoiseSources,
    frames: Vec<Amplitudes>,
}

/// Errors that were measured with some number of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleErrors {
    /// The samples.
    pub samples: SampleCounts,
    /// Samples of the reference that the frames were compared with.
    pub reference: SampleCounts,
    /// The mean squared difference of each frame from the reference, in squares of a display step.
    pub errors: Vec<f64>,
}

/// The share of a squared error that is left with `count` samples, where it falls by `power` from one power
/// of two to the next. The mean over 6 samples is that of a block of 4 and a block of 2.
fn falls(count: u32, power: f64) -> f64 {
    let count = count.max(1);
    let blocks = (0..u32::BITS).map(|bit| count & (1 << bit)).filter(|block| *block > 0);
    // (block / count)² · block^-power.
    let sum: f64 = blocks.map(|block| f64::from(block).powf(2.0 - power)).sum();
    sum / (f64::from(count) * f64::from(count))
}

/// What each amplitude is multiplied with.
fn regressors(sources: NoiseSources, s: SampleCounts) -> Amplitudes {
    let light = |is_there: bool, count: u32| match is_there {
        true => falls(s.spp, CAMERA.1) * falls(count, LIGHT),
        false => 0.0,
    };
    let bias = f64::from(u8::from(sources.shadow)) / f64::from(s.shadow.max(1)).powi(2);
    [falls(s.spp, CAMERA.0), light(sources.shadow, s.shadow), light(sources.sky, s.sky), bias]
}

impl ErrorModel {
    /// The model nearest to `points`, by the differences as shares of what was measured.
    pub fn of(sources: NoiseSources, points: &[SampleErrors]) -> Self {
        let row = |point: &SampleErrors| {
            let mut row = regressors(sources, point.samples);
            let [camera, shadow, sky, _] = regressors(sources, point.reference);
            // The reference has an error of its own, and the same bias.
            row.iter_mut().zip([camera, shadow, sky]).for_each(|(x, own)| *x += own);
            row
        };
        let rows: Vec<Amplitudes> = points.iter().map(row).collect();
        let frame = |frame: usize| {
            let measured: Vec<f64> = points.iter().map(|point| point.errors[frame]).collect();
            fit(&rows, &measured)
        };
        let count = points.first().map_or(0, |point| point.errors.len());
        Self { sources, frames: (0..count).map(frame).collect() }
    }

    /// The squared error of each frame with `samples`, in squares of a display step.
    pub fn errors(&self, samples: SampleCounts) -> impl Iterator<Item = f64> + '_ {
        let row = regressors(self.sources, samples);
        self.frames.iter().map(move |frame| frame.iter().zip(row).map(|(a, x)| a * x).sum())
    }

    /// Which share of the squared difference between frames of `samples` and of `reference` is the error of
    /// the former.
    pub fn own_part(&self, samples: SampleCounts, reference: SampleCounts) -> f64 {
        let own: f64 = self.errors(samples).sum();
        // Both have the same bias.
        let [camera, shadow, sky, _] = regressors(self.sources, reference);
        let noise = |frame: &Amplitudes| {
            frame.iter().zip([camera, shadow, sky]).map(|(a, x)| a * x).sum::<f64>()
        };
        let of_reference: f64 = self.frames.iter().map(noise).sum();
        if own > 0.0 { own / (own + of_reference) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: SampleCounts = SampleCounts { spp: 128, shadow: 16, sky: 16 };
    const LIT: NoiseSources = NoiseSources { shadow: true, sky: true };

    fn truth(s: SampleCounts, scale: f64) -> f64 {
        let (n, m, k) = (f64::from(s.spp), f64::from(s.shadow), f64::from(s.sky));
        let light = n.powf(-1.0) * (7.0 * m.powf(-1.5) + 3.0 * k.powf(-1.3));
        scale * (20.0 * n.powf(-1.4) + light)
    }

    /// From errors of up to 16 samples, each off by up to 5 %, those of up to 64 are predicted, although the
    /// powers are others.
    #[test]
    fn a_short_sweep_predicts_settings_that_were_not_in_it() {
        let point = |(i, (spp, shadow, sky)): (usize, (u32, u32, u32))| {
            let s = SampleCounts { spp, shadow, sky };
            let off = 1.0 + 0.05 * [1.0, -1.0, 0.3, -0.6][i % 4];
            let error = |scale: f64| (truth(s, scale) + truth(REFERENCE, scale)) * off;
            SampleErrors { samples: s, reference: REFERENCE, errors: vec![error(1.0), error(2.0)] }
        };
        let design =
            [(1, 1, 1), (4, 1, 1), (16, 1, 1), (4, 16, 1), (4, 1, 16), (4, 4, 4), (16, 16, 16)];
        let points: Vec<SampleErrors> = design.into_iter().enumerate().map(point).collect();
        let model = ErrorModel::of(LIT, &points);
        for (spp, shadow, sky) in [(2, 2, 8), (8, 32, 4), (32, 4, 4), (64, 64, 64)] {
            let s = SampleCounts { spp, shadow, sky };
            for (error, scale) in model.errors(s).zip([1.0, 2.0]) {
                let ratio = error / truth(s, scale);
                assert!((0.6..1.6).contains(&ratio), "{s:?}: {ratio}");
            }
        }
        let part = model.own_part(SampleCounts { spp: 16, ..REFERENCE }, REFERENCE);
        assert!((0.85..0.98).contains(&part), "{part}");
    }

    /// As `reflective_spheres` came out: with 5 samples as with 4, with 12 by 1.5 dB nearer than with 8.
    #[test]
    fn samples_between_powers_of_two_are_blocks() {
        for count in [1, 2, 64] {
            assert!((falls(count, 1.3) - f64::from(count).powf(-1.3)).abs() < 1e-12);
        }
        let decibels = |more: u32, less: u32, power: f64| {
            10.0 * (falls(less, power) / falls(more, power)).log10()
        };
        assert!(decibels(5, 4, 1.57).abs() < 0.1, "{}", decibels(5, 4, 1.57));
        assert!((decibels(12, 8, 1.27) - 1.5).abs() < 0.1, "{}", decibels(12, 8, 1.27));
        assert!(decibels(16, 14, 1.27) > 1.0);
    }

    #[test]
    fn a_source_that_is_not_there_has_no_part() {
        let point = |spp: u32| {
            let s = SampleCounts { spp, shadow: 16, sky: 16 };
            let falls = |spp: u32| f64::from(spp).powf(-1.3);
            let errors = vec![9.0 * (falls(spp) + falls(128))];
            SampleErrors { samples: s, reference: REFERENCE, errors }
        };
        let dark = NoiseSources { shadow: false, sky: false };
        let model = ErrorModel::of(dark, &[point(1), point(4), point(16)]);
        let error =
            |shadow| model.errors(SampleCounts { spp: 8, shadow, sky: 1 }).next().expect("a frame");
        assert!((error(1) - 9.0 * 8f64.powf(-1.3)).abs() < 0.02, "{model:?}");
        assert_eq!(error(1), error(64));
    }
}
