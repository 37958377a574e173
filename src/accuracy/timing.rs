//! How long what may be chosen takes: tried on small frames, and the choice by it.

use super::error_model::Samples;
use super::frames::{Cut, timed_frames};
use super::modes::Times;
use super::predictor::{Prediction, Predictor};
use super::probe::Probe;
use super::{effort::Effort, trial};
use crate::error::Result;
use crate::reuse;
use crate::scene::{ReuseSettings, Settings};
use serde::{Deserialize, Serialize};

/// How many times as many pixels the likely choices are timed with as well: the larger a frame, the less
/// of it is edges, where light is not known from other frames.
const LARGER: f64 = 3.0;
/// Ways to take over light predicted to take so many times as long as the fastest are not tried.
const SLOWER: f64 = 2.5;
/// Shares of what is left of a time that the trials of what may fit it take, one after the other.
const SHARES: [f64; 3] = [0.12, 0.06, 0.04];
/// Share of the job that each trial of what may be fastest takes.
const TRIED: f64 = 0.04;
/// Frames of fewer pixels than this are too unlike larger ones to tell what these take.
const LEAST: f64 = 600.0;

/// A setting that is to be timed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The setting.
    pub prediction: Prediction,
    /// Pixels of the smaller frames.
    pub small: f64,
}

/// Who times: alone, or all ranks at once, since they share caches and memory in the job as well. Gives
/// the wall seconds that a frame takes one of them.
pub type Timer<'a> = &'a dyn Fn(&Timing) -> Result<f64>;

impl Probe<'_> {
    /// Of the fastest setting of each mode the one that is fastest when all are tried.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn fastest(
        &self,
        predictor: &Predictor,
        allowed: f64,
        timer: Timer,
    ) -> Result<Option<Prediction>> {
        let mut found = likely(predictor.fastest(&self.range(), allowed));
        for prediction in &mut found {
            let time = TRIED * prediction.seconds * self.frames_each(prediction.reuse);
            let small = self.small_within(time, prediction);
            if small >= LEAST {
                let timing = Timing { prediction: prediction.clone(), small };
                prediction.seconds = timer(&timing)?;
            }
        }
        Ok(found.into_iter().min_by(|a, b| a.seconds.total_cmp(&b.seconds)))
    }

    /// Seconds that all frames are predicted to take this rank by the fastest setting whose squared error is
    /// `allowed`, without trying any; `None` where there is none.
    pub fn fastest_seconds(&self, predictor: &Predictor, allowed: f64) -> Option<f64> {
        let found = likely(predictor.fastest(&self.range(), allowed));
        found.iter().map(|f| f.seconds * self.frames_each(f.reuse)).min_by(f64::total_cmp)
    }

    /// The best setting whose frames are rendered within `left` seconds, which are asked for anew each
    /// time: trying settings on small frames takes of them. The fastest of all where none is.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn best_within(
        &self,
        predictor: &Predictor,
        left: &dyn Fn(Samples) -> f64,
        timer: Timer,
    ) -> Result<Option<Prediction>> {
        let mut predictor = predictor.clone();
        let frames: Vec<(ReuseSettings, f64)> =
            predictor.modes.iter().map(|mode| (mode.reuse, self.frames_each(mode.reuse))).collect();
        let frames = |reuse| frames.iter().find(|(r, _)| *r == reuse).map_or(0.0, |(_, n)| *n);
        let best = |predictor: &Predictor| {
            let fits = |f: &Prediction| f.seconds * frames(f.reuse) <= left(f.samples);
            predictor.best_within(&self.range(), &fits)
        };
        let mut tried: Vec<Prediction> = Vec::new();
        for share in SHARES {
            let Some(likely) = best(&predictor) else { break };
            let time = share * left(likely.samples);
            let small = self.small_within(time, &likely);
            if tried.iter().any(|tried| is_near(tried, &likely)) || small < LEAST {
                break;
            }
            let timing = Timing { prediction: likely, small };
            let taken = timer(&timing)?;
            predictor.correct(&timing.prediction, taken);
            tried.push(timing.prediction);
        }
        Ok(best(&predictor))
    }

    /// Seconds that a frame of the full size takes this rank, from frames of two small ones: what edges
    /// take goes with their length, all else with the area.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn timed(&self, timing: &Timing) -> Result<f64> {
        let settings = timing.prediction.settings(self.context.base);
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let [small, large] = [timing.small, LARGER * timing.small].map(|most| most.min(pixels));
        let by_large = self.small(&settings, large)?;
        if large < 1.5 * small {
            return Ok(by_large.wall / large * pixels);
        }
        let by_small = self.small(&settings, small)?;
        let [of_small, of_large] = [by_small.cpu / small, by_large.cpu / large];
        let edges = (of_small - of_large) / (small.powf(-0.5) - large.powf(-0.5));
        let each = of_large + edges * (pixels.powf(-0.5) - large.powf(-0.5));
        Ok(each.clamp(0.3 * of_large, of_large) * pixels * by_large.pace())
    }

    /// Pixels of the smaller frames that can be tried in `seconds`.
    fn small_within(&self, seconds: f64, prediction: &Prediction) -> f64 {
        let base = self.context.base;
        let pixels = f64::from(base.width) * f64::from(base.height);
        let frames =
            self.cut(prediction.reuse).with_ancestors(&timed_frames(self.context.shot.frames));
        let each = prediction.seconds / pixels * frames.len() as f64;
        (seconds / ((1.0 + LARGER) * each)).min(Effort::WHOLE.small)
    }

    /// Frames that a rank makes, those among them that others are inferred from.
    pub fn frames_each(&self, reuse: ReuseSettings) -> f64 {
        let frames: Vec<u32> = (self.frames.first..=self.frames.last).collect();
        self.cut(reuse).with_ancestors(&frames).len() as f64 / f64::from(self.ranks)
    }

    fn cut(&self, reuse: ReuseSettings) -> Cut {
        let settings = Settings { reuse, ..self.context.base.clone() };
        let looks_up = !reuse::channels(self.context.scene, &self.plan(), &settings).is_empty();
        Cut::of(&settings, self.context.shot.frames, looks_up)
    }

    /// What a frame with about `pixels` pixels takes.
    pub(super) fn small(&self, settings: &Settings, pixels: f64) -> Result<Times> {
        let mut settings = settings.clone();
        (settings.width, settings.height) = self.small_size(pixels);
        let frames = timed_frames(self.context.shot.frames);
        let trial = trial::run(self.context, &settings, self.context.intersector, &frames)?;
        Ok(Times { wall: trial.seconds, cpu: trial.cpu_seconds })
    }
}

/// The predictions that may turn out to be the fastest.
pub(super) fn likely(mut found: Vec<Prediction>) -> Vec<Prediction> {
    let least = found.iter().map(|f| f.seconds).fold(f64::INFINITY, f64::min);
    found.retain(|f| f.seconds <= SLOWER * least);
    found
}

/// Whether what one took tells what the other does.
fn is_near(a: &Prediction, b: &Prediction) -> bool {
    let within = |a: u32, b: u32, factor: f64| {
        let ratio = f64::from(a) / f64::from(b);
        (1.0 / factor..=factor).contains(&ratio)
    };
    let (s, t) = (a.samples, b.samples);
    a.reuse == b.reuse
        && within(s.spp, t.spp, 1.6)
        && within(s.shadow, t.shadow, 1.0)
        && within(s.sky, t.sky, 1.0)
}
