//! What a setting is predicted to come to, and the choice among all of them.

mod power_law;
mod tried;

use super::choice::Goal;
use super::error_model::{ErrorModel, Samples};
use super::worst::worst;
use crate::measure::psnr;
use crate::scene::limits::MAX_BOUNCES;
use crate::scene::{Policy, ReuseSettings, Settings};
use serde::{Deserialize, Serialize};

pub use power_law::PowerLaw;

/// What rounding to 8 bits adds to a squared error, display steps.
pub const ROUNDING: f64 = 1.0 / 12.0;

/// Times are not known to a tenth; so much longer may be taken by what is more accurate.
const ALIKE: f64 = 1.1;

/// A way to take over light from other frames, as it came out on a few small frames.
///
/// Errors are those of traced frames in every mode: key frames are traced, and must reach a target like
/// any other; frames between are mostly nearer to the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReuseMode {
    /// What is taken over, and with how much care.
    pub reuse: ReuseSettings,
    /// Seconds per frame of the full size: of each frame, and by n, n·s, n·k.
    pub seconds: [f64; 4],
}

/// What some samples came to, in each frame looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasuredSamples {
    /// The samples.
    pub samples: Samples,
    /// Squared errors, the reference's own left aside.
    pub errors: Vec<f64>,
    /// How far each may be off, a share: the standard error of pixels drawn.
    pub doubts: Vec<f64>,
    /// The goal's figure as it was found, unless the goal is the squared error.
    pub figure: Option<Figure>,
}

/// A figure that rises with the error, as it was found: less than 1 by how much (SSIM), FLIP, a share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Of the worst frame.
    pub figure: f64,
    /// Squared error of the worst frame, the reference's own and rounding in it, display steps.
    pub squared_error: f64,
}

/// What patches took to trace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PatchSpeed {
    /// The samples.
    pub samples: Samples,
    /// Wall seconds a pixel.
    pub seconds: f64,
}

/// All that the probe found out. Squared errors are in squares of a display step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Predictor {
    /// Of samples that were not tried.
    pub model: ErrorModel,
    /// Samples that were tried.
    pub measured: Vec<MeasuredSamples>,
    /// What the probe's frames are off by for their bounces and cut-off.
    pub bias: Vec<f64>,
    /// What rounding to the file's bits adds.
    pub rounding: f64,
    /// The bounces that go with it.
    pub bounces: u32,
    /// Ways to take over light.
    pub modes: Vec<ReuseMode>,
    /// How the goal's figure goes with the squared error, unless it is that.
    pub line: Option<PowerLaw>,
    /// The largest figure that reaches the goal, unless that is the squared error.
    pub most: Option<f64>,
    /// How far each frame's squared error may be off where samples were not tried, a share.
    pub doubts: Vec<f64>,
    /// How fast patches are traced.
    pub pace: Option<PatchSpeed>,
    /// How much larger errors came out than predicted.
    pub excess: f64,
}

/// A setting with what is predicted of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Samples.
    pub samples: Samples,
    /// Bounces.
    pub bounces: u32,
    /// What is taken over.
    pub reuse: ReuseSettings,
    /// Squared error of the worst frame looked at, display steps.
    pub squared_error: f64,
    /// Wall seconds a frame.
    pub seconds: f64,
}

impl Prediction {
    /// PSNR of the worst frame, dB.
    pub fn psnr(&self) -> f64 {
        psnr(self.squared_error / (255.0 * 255.0))
    }

    /// `base` so set.
    pub fn settings(&self, base: &Settings) -> Settings {
        let Samples { spp, shadow, sky } = self.samples;
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

/// Which numbers of samples are thought of.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleRange {
    /// Camera samples.
    pub spp: Vec<u32>,
    /// Shadow samples.
    pub shadow: Vec<u32>,
    /// Sky samples.
    pub sky: Vec<u32>,
}

impl Predictor {
    /// The squared error that `goal` allows.
    pub fn allowed(&self, goal: Goal) -> f64 {
        match (goal, self.line, goal.most()) {
            (Goal::Psnr(least), ..) => 255.0 * 255.0 * 10f64.powf(-least / 10.0),
            (_, Some(line), Some(most)) => line.squared_error(most),
            // Nothing but what was tried tells.
            _ => self.most_that_reached(),
        }
    }

    /// `share` of the squared error that `goal` allows, to be on the safe side; all of it where nothing but
    /// what was tried tells whether a setting reaches the goal.
    pub fn aim(&self, goal: Goal, share: f64) -> f64 {
        let is_predicted = goal.most().is_none() || self.line.is_some();
        self.allowed(goal) * if is_predicted { share } else { 1.0 }
    }

    /// Which part of the squared difference between frames of `samples` and of `reference` is the former's
    /// own error.
    pub fn own_part(&self, samples: Samples, reference: Samples) -> f64 {
        let sum = |samples| self.model.errors(samples).sum::<f64>();
        let (own, of_reference) = (sum(samples), sum(reference));
        if own > 0.0 { own / (own + of_reference) } else { 1.0 }
    }

    /// What is predicted of `samples` in `mode`, of the worst frame.
    pub fn of(&self, mode: &ReuseMode, samples: Samples) -> Prediction {
        let (errors, doubts) = match self.tried(samples) {
            Some(measured) => (measured.errors.clone(), &measured.doubts),
            None => (self.model.errors(samples).collect::<Vec<_>>(), &self.doubts),
        };
        let each = errors.iter().zip(&self.bias).map(|(error, bias)| self.excess * error + bias);
        let each: Vec<f64> = each.collect();
        let n = f64::from(samples.spp);
        let by = [1.0, n, n * f64::from(samples.shadow), n * f64::from(samples.sky)];
        Prediction {
            samples,
            bounces: self.bounces,
            reuse: mode.reuse,
            squared_error: worst(&each, doubts) + self.rounding,
            seconds: by.iter().zip(mode.seconds).map(|(x, seconds)| x * seconds).sum(),
        }
    }

    /// For each mode the fastest setting that is predicted to be off by at most `allowed`, or the nearest to
    /// the truth of those that are hardly slower. Where the goal's figure was found of a setting, that
    /// alone decides.
    pub fn fastest(&self, range: &SampleRange, allowed: f64) -> Vec<Prediction> {
        let will_do = |f: &Prediction| {
            self.reached(f.samples) || (f.squared_error <= allowed && !self.missed(f.samples))
        };
        let best = |mode| {
            let found = || self.all(mode, range).filter(will_do);
            let least = found().map(|f| f.seconds).fold(f64::INFINITY, f64::min);
            let alike = found().filter(|f| f.seconds <= ALIKE * least);
            alike.min_by(|a, b| a.squared_error.total_cmp(&b.squared_error))
        };
        self.modes.iter().filter_map(best).collect()
    }

    /// The setting nearest to the truth, of those that `fits` lets through; the fastest of all where it
    /// lets none.
    pub fn best_within(
        &self,
        range: &SampleRange,
        fits: &dyn Fn(&Prediction) -> bool,
    ) -> Option<Prediction> {
        let all = || self.modes.iter().flat_map(|mode| self.all(mode, range));
        let within = all().filter(fits);
        let best = within.min_by(|a, b| a.squared_error.total_cmp(&b.squared_error));
        best.or_else(|| all().min_by(|a, b| a.seconds.total_cmp(&b.seconds)))
    }

    /// Puts the times of a mode through what a setting of it `took`, seconds a frame.
    pub fn correct(&mut self, prediction: &Prediction, took: f64) {
        let factor = took / prediction.seconds.max(1e-12);
        let same = self.modes.iter_mut().filter(|mode| mode.reuse == prediction.reuse);
        same.flat_map(|mode| &mut mode.seconds).for_each(|seconds| *seconds *= factor);
    }

    /// The same with all errors of samples `factor` times as large.
    pub fn worse(&self, factor: f64) -> Self {
        Self { excess: self.excess * factor, ..self.clone() }
    }

    /// The same with twice the bounces, where rays ended for too few of them.
    pub fn with_more_bounces(self) -> Self {
        let is_cut = self.bias.iter().any(|bias| *bias > 0.0);
        let bounces = if is_cut { (2 * self.bounces).min(MAX_BOUNCES) } else { self.bounces };
        Self { bounces, ..self }
    }

    /// The setting with the least error predicted.
    pub fn best(&self, range: &SampleRange) -> Option<Prediction> {
        self.best_within(range, &|_| true)
    }

    /// Wall seconds that it takes to trace a pixel of a patch with `samples`.
    pub fn patch_seconds(&self, samples: Samples) -> f64 {
        // Patches are traced, whatever the mode.
        let traced = |mode: &&ReuseMode| mode.reuse.policy == Policy::Off;
        let mode = self.modes.iter().find(traced).or(self.modes.first());
        let (Some(mode), Some(pace)) = (mode, self.pace) else { return 0.0 };
        let of = |s: Samples| {
            let [_, camera, shadow, sky] = mode.seconds;
            f64::from(s.spp) * (camera + f64::from(s.shadow) * shadow + f64::from(s.sky) * sky)
        };
        pace.seconds * of(samples) / of(pace.samples).max(1e-12)
    }

    fn all<'s>(
        &'s self,
        mode: &'s ReuseMode,
        range: &'s SampleRange,
    ) -> impl Iterator<Item = Prediction> + 's {
        let lights = move |spp: u32| {
            let skies = move |shadow: u32| {
                range.sky.iter().map(move |sky| Samples { spp, shadow, sky: *sky })
            };
            range.shadow.iter().flat_map(move |shadow| skies(*shadow))
        };
        let samples = range.spp.iter().flat_map(move |spp| lights(*spp));
        samples.map(move |samples| self.of(mode, samples))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::error_model::{NoiseSources, SampleErrors};
    use super::*;

    pub(super) fn predictor() -> Predictor {
        let samples = |spp: u32, shadow: u32| Samples { spp, shadow, sky: 1 };
        let error =
            |s: Samples| 40.0 / f64::from(s.spp) + 20.0 / (f64::from(s.spp) * f64::from(s.shadow));
        let points = [(1, 1), (4, 1), (16, 1), (4, 16), (16, 16)].map(|(n, m)| {
            let (samples, reference) = (samples(n, m), samples(4096, 16));
            SampleErrors { samples, reference, errors: vec![error(samples) + error(reference)] }
        });
        let off = ReuseSettings { policy: Policy::Off, ..ReuseSettings::default() };
        let surface = ReuseSettings::default();
        Predictor {
            model: ErrorModel::of(NoiseSources { shadow: true, sky: false }, &points.each_ref()),
            measured: Vec::new(),
            bias: vec![0.5],
            rounding: 1.0 / 12.0,
            bounces: 4,
            modes: vec![
                ReuseMode { reuse: off, seconds: [0.0, 1.0, 1.0, 0.0] },
                ReuseMode { reuse: surface, seconds: [0.0, 2.0, 0.1, 0.0] },
            ],
            line: PowerLaw::through(&[(1.0, 0.01), (4.0, 0.02), (16.0, 0.04)]),
            most: None,
            doubts: vec![0.0],
            pace: None,
            excess: 1.0,
        }
    }

    pub(super) fn range() -> SampleRange {
        SampleRange { spp: vec![1, 2, 4, 8, 16, 32, 64], shadow: vec![1, 4, 16], sky: vec![1] }
    }

    #[test]
    fn the_fastest_of_each_mode_reaches_the_goal_and_nothing_cheaper_would() {
        let predictor = predictor();
        let allowed = predictor.allowed(Goal::Psnr(psnr(8.0 / (255.0 * 255.0))));
        assert!((allowed - 8.0).abs() < 1e-9);
        let found = predictor.fastest(&range(), allowed);
        // 40/8 + 20/8 + 0.58 is 8.1: one shadow sample is not enough with 8 camera samples.
        let samples = |f: &Prediction| (f.samples.spp, f.samples.shadow);
        assert_eq!(found.iter().map(samples).collect::<Vec<_>>(), [(16, 1), (8, 4)]);
        assert!(found.iter().all(|f| f.squared_error <= allowed));
        // Shadow samples that hardly cost anything are taken.
        let cheap = ReuseMode { seconds: [0.0, 2.0, 0.01, 0.0], ..predictor.modes[1].clone() };
        let cheap = Predictor { modes: vec![cheap], ..predictor.clone() };
        assert_eq!(
            cheap.fastest(&range(), allowed).iter().map(samples).collect::<Vec<_>>(),
            [(8, 16)]
        );
        assert!(predictor.fastest(&range(), 0.1).is_empty());
        // A figure that rises as the root of the squared error.
        assert!((predictor.allowed(Goal::Flip(0.02)) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn bounces_are_more_where_rays_ended_for_too_few() {
        let some = predictor().with_more_bounces();
        assert_eq!((some.bounces, some.clone().with_more_bounces().bounces), (8, 16));
        let none = Predictor { bias: vec![0.0], ..predictor() };
        assert_eq!(none.with_more_bounces().bounces, 4);
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
        assert_eq!(predictor.best(&range()).expect("one").samples.spp, 64);
    }
}
