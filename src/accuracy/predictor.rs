//! What each setting is predicted to come to, and the choice among all of them.

use super::error_model::{ErrorModel, SampleCounts};
use super::worst::worst;
use crate::measure::psnr;
use crate::scene::limits::MAX_BOUNCES;
use crate::scene::{ReuseSettings, Settings};
use serde::{Deserialize, Serialize};

/// Times are known to about a tenth: of settings that differ by less the most accurate is taken.
const ALIKE: f64 = 1.1;

/// What a frame takes under one reuse policy.
///
/// Errors are those of traced frames under every policy: key frames are traced, and must reach a target
/// like any other; in-between frames are mostly nearer to the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReuseMode {
    /// The policy and its settings.
    pub reuse: ReuseSettings,
    /// Wall seconds of a frame at its full size: in any case, then for each camera, shadow and sky sample
    /// of a pixel.
    pub seconds: [f64; 4],
}

/// All that a probe found out. Squared errors are in squares of a display step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Predictor {
    /// How errors fall with the samples.
    pub model: ErrorModel,
    /// How far each frame's error in `model` may be off, as a share: standard errors.
    pub doubts: Vec<f64>,
    /// Squared error of the worst frame for what `bounces` and the cut-off leave out.
    pub bias: f64,
    /// Squared error that rounding to the file's bits adds.
    pub rounding: f64,
    /// The number of bounces that is chosen.
    pub bounces: u32,
    /// The reuse policies to choose from.
    pub modes: Vec<ReuseMode>,
    /// How many times as large errors came out as the model has them.
    pub excess: f64,
}

/// A setting and what is predicted of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Samples of a pixel.
    pub samples: SampleCounts,
    /// Number of bounces.
    pub bounces: u32,
    /// Reuse policy and its settings.
    pub reuse: ReuseSettings,
    /// Squared error of the worst frame, in squares of a display step.
    pub squared_error: f64,
    /// The target's figure ([`Goal::largest`](super::Goal::largest)), where it was measured.
    pub figure: Option<f64>,
    /// Wall seconds of a frame.
    pub seconds: f64,
}

impl Prediction {
    /// PSNR of the worst frame, dB.
    pub fn psnr(&self) -> f64 {
        psnr(self.squared_error / (255.0 * 255.0))
    }

    /// `base` with what was chosen.
    pub fn settings(&self, base: &Settings) -> Settings {
        let SampleCounts { spp, shadow, sky } = self.samples;
        Settings {
            spp,
            shadow_samples: shadow,
            sky_samples: sky,
            bounces: self.bounces,
            reuse: self.reuse,
            ..base.clone()
        }
    }
}

impl Predictor {
    /// The squared error that is predicted of `samples`, under any policy.
    pub fn squared_error(&self, samples: SampleCounts) -> f64 {
        let errors: Vec<f64> = self.model.errors(samples).collect();
        self.excess * worst(&errors, &self.doubts) + self.bias + self.rounding
    }

    /// What is predicted of `samples` under the policy of `mode`.
    pub fn of(&self, mode: &ReuseMode, samples: SampleCounts) -> Prediction {
        let n = f64::from(samples.spp);
        let by = [1.0, n, n * f64::from(samples.shadow), n * f64::from(samples.sky)];
        Prediction {
            samples,
            bounces: self.bounces,
            reuse: mode.reuse,
            squared_error: self.squared_error(samples),
            figure: None,
            seconds: by.iter().zip(mode.seconds).map(|(x, seconds)| x * seconds).sum(),
        }
    }

    /// The fastest setting of `mode`, with samples among `range`, whose squared error is predicted to be at most
    /// `allowed`; of those that are hardly slower the one with the least error.
    pub fn fastest(
        &self,
        mode: &ReuseMode,
        range: &[SampleCounts],
        allowed: f64,
    ) -> Option<Prediction> {
        let all = range.iter().map(|samples| self.of(mode, *samples));
        let found: Vec<Prediction> = all.filter(|p| p.squared_error <= allowed).collect();
        let least = found.iter().map(|p| p.seconds).fold(f64::INFINITY, f64::min);
        let alike = found.into_iter().filter(|p| p.seconds <= ALIKE * least);
        alike.min_by(|a, b| a.squared_error.total_cmp(&b.squared_error))
    }

    /// The setting with the least error predicted, of those that `fits` lets through; the fastest of all
    /// where it lets none through.
    pub fn best_within(
        &self,
        range: &[SampleCounts],
        fits: &dyn Fn(&Prediction) -> bool,
    ) -> Option<Prediction> {
        let of_mode = |mode| range.iter().map(move |samples| self.of(mode, *samples));
        let all = || self.modes.iter().flat_map(of_mode);
        let best = all().filter(fits).min_by(|a, b| a.squared_error.total_cmp(&b.squared_error));
        best.or_else(|| all().min_by(|a, b| a.seconds.total_cmp(&b.seconds)))
    }

    /// Scales the times of a mode so that the setting of `prediction` takes `took` seconds a frame.
    pub fn correct_time(&mut self, prediction: &Prediction, took: f64) {
        let factor = took / prediction.seconds.max(1e-12);
        let same = self.modes.iter_mut().filter(|mode| mode.reuse == prediction.reuse);
        same.flat_map(|mode| &mut mode.seconds).for_each(|seconds| *seconds *= factor);
    }

    /// Scales errors so that the setting of `measured` has the one measured.
    pub fn correct_error(&mut self, measured: &Prediction) {
        let fixed = self.bias + self.rounding;
        let sampling = self.squared_error(measured.samples) - fixed;
        let was = (measured.squared_error - fixed).max(0.1 * measured.squared_error);
        self.excess *= was / sampling.max(1e-12);
    }

    /// The same with twice the bounces, where rays ended for too few of them.
    pub fn with_more_bounces(self) -> Self {
        let is_cut = self.bias > 0.0;
        let bounces = if is_cut { (2 * self.bounces).min(MAX_BOUNCES) } else { self.bounces };
        Self { bounces, ..self }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::error_model::{NoiseSources, SampleErrors};
    use super::super::errors::ROUNDING;
    use super::*;
    use crate::scene::Policy;

    fn predictor() -> Predictor {
        let samples = |spp: u32, shadow: u32| SampleCounts { spp, shadow, sky: 1 };
        let error = |s: SampleCounts| {
            let [n, m] = [s.spp, s.shadow].map(f64::from);
            40.0 * n.powf(-1.3) + 20.0 * n.powf(-1.1) * m.powf(-1.4)
        };
        let points = [(1, 1), (4, 1), (16, 1), (4, 16), (16, 16)].map(|(n, m)| {
            let (samples, reference) = (samples(n, m), samples(4096, 16));
            let errors = vec![error(samples) + error(reference)];
            SampleErrors { samples, reference, errors }
        });
        let off = ReuseSettings { policy: Policy::Off, ..ReuseSettings::default() };
        Predictor {
            model: ErrorModel::of(NoiseSources { shadow: true, sky: false }, &points),
            doubts: vec![0.0],
            bias: 0.5,
            rounding: ROUNDING,
            bounces: 4,
            modes: vec![
                ReuseMode { reuse: off, seconds: [0.0, 1.0, 1.0, 0.0] },
                ReuseMode { reuse: ReuseSettings::default(), seconds: [0.0, 2.0, 0.1, 0.0] },
            ],
            excess: 1.0,
        }
    }

    fn range() -> Vec<SampleCounts> {
        let spp = |shadow| [1, 2, 4, 8, 16, 32, 64].map(|spp| SampleCounts { spp, shadow, sky: 1 });
        [1, 4, 16].map(spp).concat()
    }

    #[test]
    fn the_fastest_of_a_mode_reaches_the_goal_and_nothing_cheaper_would() {
        let predictor = predictor();
        let fastest = |mode: usize, allowed: f64| {
            let found = predictor.fastest(&predictor.modes[mode], &range(), allowed);
            found.map(|f| (f.samples.spp, f.samples.shadow))
        };
        // With 8 camera samples and one shadow sample 2.7 + 2.0 + 0.6.
        assert_eq!((fastest(0, 5.5), fastest(0, 5.2)), (Some((8, 1)), Some((16, 1))));
        // Where shadow samples cost little more of them are taken.
        assert_eq!(fastest(1, 5.2), Some((8, 4)));
        assert_eq!(fastest(0, 0.5), None);
    }

    #[test]
    fn predictions_go_through_what_was_measured() {
        let mut predictor = predictor();
        let at = |p: &Predictor, spp| p.of(&p.modes[1], SampleCounts { spp, shadow: 4, sky: 1 });
        let [few, many] = [8, 32].map(|spp| at(&predictor, spp));
        predictor.correct_time(&few, 3.0 * few.seconds);
        assert!((at(&predictor, 32).seconds / many.seconds - 3.0).abs() < 1e-9);
        let measured = Prediction { squared_error: 2.0 * few.squared_error, ..few.clone() };
        predictor.correct_error(&measured);
        assert!((at(&predictor, 8).squared_error / measured.squared_error - 1.0).abs() < 1e-9);
        assert!(at(&predictor, 32).squared_error > many.squared_error);
    }

    #[test]
    fn bounces_are_more_where_rays_ended_for_too_few() {
        let some = predictor().with_more_bounces();
        assert_eq!((some.bounces, some.clone().with_more_bounces().bounces), (8, 16));
        assert_eq!(Predictor { bias: 0.0, ..predictor() }.with_more_bounces().bounces, 4);
        let most = Predictor { bounces: MAX_BOUNCES - 1, ..predictor() };
        assert_eq!(most.with_more_bounces().bounces, MAX_BOUNCES);
    }

    #[test]
    fn the_best_within_a_time_takes_no_longer_and_a_longer_time_is_never_worse() {
        let predictor = predictor();
        let mut last = f64::INFINITY;
        for seconds in [3.0, 10.0, 30.0, 100.0] {
            let best = predictor.best_within(&range(), &|f| f.seconds <= seconds).expect("one");
            assert!(best.seconds <= seconds && best.squared_error <= last, "{best:?}");
            last = best.squared_error;
        }
        let fastest = predictor.best_within(&range(), &|_| false).expect("the fastest");
        assert_eq!(fastest.samples.spp, 1);
        let best = predictor.best_within(&range(), &|_| true).expect("one");
        assert_eq!(best.samples.spp, 64);
    }
}
