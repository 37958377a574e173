//! What adds up to a frame's squared error, and by which powers of the samples it falls.
//!
//! Squared errors of independent sources add. So a traced frame's is predicted, in squares of a display
//! step, by
//!
//! ```text
//! camera · n^-a  +  n^-p · (shadow · s^-q + sky · k^-q)  +  bias · s^-2
//! ```
//!
//! with n camera samples, s shadow and k sky samples each; the bias is that of a ratio of two averages.
//! So it is for powers of two. Samples are points of a Sobol sequence, whose merit is in whole blocks of so
//! many (Owen, 1997): another number is blocks, each with an error of its own.

use super::fit::fit;
use serde::{Deserialize, Serialize};

/// Samples a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Samples {
    /// Camera samples.
    pub spp: u32,
    /// Shadow samples of each, per light.
    pub shadow: u32,
    /// Sky samples of each.
    pub sky: u32,
}

/// The powers that all frames of a move share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Powers {
    camera: f64,
    /// Of the light's part, with the camera samples.
    light: f64,
    /// Of the light's part, with the samples of each.
    samples: f64,
}

/// A frame's amplitudes, of camera, shadow, sky and bias: squared error at one sample of everything,
/// display steps.
type Amplitudes = [f64; 4];

/// Which sources there are at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct NoiseSources {
    /// Area lights.
    pub shadow: bool,
    /// A sky that lights.
    pub sky: bool,
}

/// The model of a move's traced frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorModel {
    sources: NoiseSources,
    powers: Powers,
    frames: Vec<Amplitudes>,
    /// Root mean square of what the model misses the measurements by, as a share of them.
    pub misfit: f64,
}

/// What some samples came to.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleErrors {
    /// The samples.
    pub samples: Samples,
    /// Samples of the reference that they were compared with.
    pub reference: Samples,
    /// For each frame the mean squared difference from it.
    pub errors: Vec<f64>,
}

/// What is left of a squared error with `count` samples, where it falls by `power` from one power of two
/// to the next. The mean over 6 samples is that of a block of 4 and of one of 2.
fn falls(count: u32, power: f64) -> f64 {
    let count = count.max(1);
    let blocks = (0..u32::BITS).map(|bit| count & (1 << bit)).filter(|block| *block > 0);
    // (block / count)² · block^-power.
    let sum: f64 = blocks.map(|block| f64::from(block).powf(2.0 - power)).sum();
    sum / (f64::from(count) * f64::from(count))
}

impl Powers {
    fn regressors(&self, sources: NoiseSources, s: Samples) -> Amplitudes {
        let light = falls(s.spp, self.light);
        let each = |is_there: bool, count: u32| match is_there {
            true => light * falls(count, self.samples),
            false => 0.0,
        };
        let bias = f64::from(u8::from(sources.shadow)) / f64::from(s.shadow.max(1)).powi(2);
        [falls(s.spp, self.camera), each(sources.shadow, s.shadow), each(sources.sky, s.sky), bias]
    }
}

impl ErrorModel {
    /// The model that comes nearest to `points`, as shares of them. `references` are the samples of what
    /// each was held against, whose own error is part of the difference.
    pub fn of(sources: NoiseSources, points: &[&SampleErrors]) -> Self {
        let frames = points.first().map_or(0, |point| point.errors.len());
        let mut best = Self {
            sources,
            powers: Powers { camera: 1.0, light: 1.0, samples: 1.0 },
            frames: vec![[0.0; 4]; frames],
            misfit: f64::INFINITY,
        };
        let lit = sources.shadow || sources.sky;
        for camera in grid(0.9, 1.7) {
            // Without soft light its powers mean nothing.
            for light in grid(1.0, if lit { 1.6 } else { 1.0 }) {
                for samples in grid(0.8, if lit { 1.8 } else { 0.8 }) {
                    let powers = Powers { camera, light, samples };
                    let model = Self::with(sources, powers, points);
                    if model.misfit < best.misfit {
                        best = model;
                    }
                }
            }
        }
        best
    }

    fn with(sources: NoiseSources, powers: Powers, points: &[&SampleErrors]) -> Self {
        let rows = points.iter().map(|point| {
            let mut row = powers.regressors(sources, point.samples);
            let [camera, shadow, sky, _] = powers.regressors(sources, point.reference);
            // Both are biased the same way.
            row.iter_mut().zip([camera, shadow, sky]).for_each(|(x, own)| *x += own);
            row
        });
        let rows: Vec<Amplitudes> = rows.collect();
        let count = points.first().map_or(0, |point| point.errors.len());
        let (mut frames, mut squares) = (Vec::new(), 0.0);
        for frame in 0..count {
            let measured: Vec<f64> = points.iter().map(|point| point.errors[frame]).collect();
            let (amplitudes, misfit) = fit(&rows, &measured);
            frames.push(amplitudes);
            squares += misfit * misfit;
        }
        let misfit = (squares / count.max(1) as f64).sqrt();
        Self { sources, powers, frames, misfit }
    }

    /// The squared error of each frame looked at.
    pub fn errors(&self, samples: Samples) -> impl Iterator<Item = f64> + '_ {
        let row = self.powers.regressors(self.sources, samples);
        self.frames.iter().map(move |frame| frame.iter().zip(row).map(|(a, x)| a * x).sum())
    }

    /// The model under which `point` comes to what it did, frame by frame.
    pub fn through(&self, point: &SampleErrors) -> Self {
        let own: Vec<f64> = self.errors(point.reference).collect();
        let mut model = self.clone();
        let told = self.errors(point.samples).zip(own).zip(&point.errors);
        for (frame, ((prediction, own), measured)) in model.frames.iter_mut().zip(told) {
            let factor = measured / f64::max(prediction + own, 1e-12);
            frame.iter_mut().for_each(|amplitude| *amplitude *= factor);
        }
        model
    }

    /// The model of frames whose errors are all `factor` times as large.
    pub fn times(&self, factor: f64) -> Self {
        let mut model = self.clone();
        model.frames.iter_mut().flatten().for_each(|amplitude| *amplitude *= factor);
        model
    }
}

fn grid(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let steps = ((to - from) / 0.1_f64).round() as u32;
    (0..=steps).map(move |k| from + 0.1 * f64::from(k))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: Samples = Samples { spp: 128, shadow: 16, sky: 16 };
    const LIT: NoiseSources = NoiseSources { shadow: true, sky: true };

    fn truth(s: Samples, scale: f64) -> f64 {
        let (n, m, k) = (f64::from(s.spp), f64::from(s.shadow), f64::from(s.sky));
        let light = n.powf(-1.1) * (7.0 * m.powf(-1.4) + 3.0 * k.powf(-1.4));
        scale * (20.0 * n.powf(-1.3) + light)
    }

    /// From errors of up to 16 samples, each off by up to 5 %, those of up to 64 are predicted.
    #[test]
    fn a_short_sweep_predicts_settings_that_were_not_in_it() {
        let point = |(i, (spp, shadow, sky)): (usize, (u32, u32, u32))| {
            let s = Samples { spp, shadow, sky };
            let off = 1.0 + 0.05 * [1.0, -1.0, 0.3, -0.6][i % 4];
            let error = |scale: f64| (truth(s, scale) + truth(REFERENCE, scale)) * off;
            SampleErrors { samples: s, reference: REFERENCE, errors: vec![error(1.0), error(2.0)] }
        };
        let design =
            [(1, 1, 1), (4, 1, 1), (16, 1, 1), (4, 16, 1), (4, 1, 16), (4, 4, 4), (16, 16, 16)];
        let points: Vec<SampleErrors> = design.into_iter().enumerate().map(point).collect();
        let model = ErrorModel::of(LIT, &points.iter().collect::<Vec<_>>());
        assert!(model.misfit < 0.05, "{model:?}");
        for (spp, shadow, sky) in [(2, 2, 8), (8, 32, 4), (32, 4, 4), (64, 64, 64)] {
            let s = Samples { spp, shadow, sky };
            for (error, scale) in model.errors(s).zip([1.0, 2.0]) {
                let ratio = error / truth(s, scale);
                assert!((0.75..1.33).contains(&ratio), "{s:?}: {ratio}");
            }
        }
        let twice: Vec<f64> = model.times(2.0).errors(REFERENCE).collect();
        let once: Vec<f64> = model.errors(REFERENCE).collect();
        assert!((twice[0] / once[0] - 2.0).abs() < 1e-12);
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
    fn an_effect_that_is_not_there_has_no_part() {
        let point = |spp: u32| {
            let s = Samples { spp, shadow: 16, sky: 16 };
            let errors = vec![9.0 / f64::from(spp) + 9.0 / 128.0];
            SampleErrors { samples: s, reference: REFERENCE, errors }
        };
        let points = [point(1), point(4), point(16)];
        let model = ErrorModel::of(NoiseSources { shadow: false, sky: false }, &points.each_ref());
        let error =
            |shadow| model.errors(Samples { spp: 8, shadow, sky: 1 }).next().expect("a frame");
        assert!((error(1) - 9.0 / 8.0).abs() < 0.02, "{model:?}");
        assert_eq!(error(1), error(64));
    }

    #[test]
    fn a_law_is_put_through_what_was_measured() {
        let s = Samples { spp: 8, shadow: 2, sky: 1 };
        let points = [1, 4, 16].map(|spp| {
            let s = Samples { spp, ..s };
            let errors = vec![truth(s, 1.0), truth(s, 2.0)];
            SampleErrors { samples: s, reference: REFERENCE, errors }
        });
        let point = SampleErrors { samples: s, reference: REFERENCE, errors: vec![3.0, 7.0] };
        let model = ErrorModel::of(LIT, &points.each_ref()).through(&point);
        let [own, _] = [0, 1].map(|i| model.errors(REFERENCE).nth(i).expect("a frame"));
        let now: Vec<f64> = model.errors(s).collect();
        assert!((now[0] + own - 3.0).abs() < 1e-9 && now[1] > 6.0, "{now:?}");
    }
}
