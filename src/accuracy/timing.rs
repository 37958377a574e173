//! How long settings take: the likely ones are tried on small frames, and the choice goes by that.

use super::frames::{Cut, timed_frames};
use super::modes::Times;
use super::predictor::{Prediction, Predictor, ReuseMode};
use super::probe::SettingsProbe;
use super::{effort::Effort, trial};
use crate::error::Result;
use crate::reuse;
use crate::scene::{ReuseSettings, Settings};
use serde::{Deserialize, Serialize};

/// How many times as many pixels as [`Effort::small`] the frames have at most that are tried.
const LARGER: f64 = 3.0;
/// Settings predicted to take so many times as long as the fastest are not tried.
const SLOWER: f64 = 2.5;
/// Shares of what is left of a budget that the trials take, one after the other.
const SHARES: [f64; 2] = [0.15, 0.07];
/// Share of the job that each trial takes where a target is to be reached.
const TRIED: f64 = 0.03;
/// Frames of fewer pixels than this are too unlike larger ones to tell what these take.
const LEAST: f64 = 1_800.0;

/// A setting that is to be timed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The setting.
    pub prediction: Prediction,
    /// Pixels of the frames that are tried.
    pub pixels: f64,
}

/// Times a setting: alone, or on all ranks at once, since they share caches and memory in the job as well.
/// Gives the wall seconds that a rank takes for a frame.
pub type Timer<'a> = &'a dyn Fn(&Timing) -> Result<f64>;

impl SettingsProbe<'_> {
    /// Of `found` the setting that is fastest when the likely ones are tried, with the seconds that it took.
    ///
    /// # Errors
    /// As `timer`.
    pub fn fastest(&self, mut found: Vec<Prediction>, timer: Timer) -> Result<Option<Prediction>> {
        let least = found.iter().map(|f| f.seconds).fold(f64::INFINITY, f64::min);
        found.retain(|f| f.seconds <= SLOWER * least);
        for prediction in &mut found {
            let time = TRIED * prediction.seconds * self.frames_each(prediction.reuse);
            if let Some(timing) = self.timing(time, prediction) {
                prediction.seconds = timer(&timing)?;
            }
        }
        Ok(found.into_iter().min_by(|a, b| a.seconds.total_cmp(&b.seconds)))
    }

    /// The most accurate setting whose frames are rendered within `left` seconds; the fastest where none is.
    /// `left` is asked anew after each trial, since that takes of it.
    ///
    /// # Errors
    /// As `timer`.
    pub fn best_within(
        &self,
        predictor: &Predictor,
        left: &dyn Fn() -> f64,
        timer: Timer,
    ) -> Result<Option<Prediction>> {
        let mut predictor = predictor.clone();
        let of = |mode: &ReuseMode| (mode.reuse, self.frames_each(mode.reuse));
        let frames: Vec<(ReuseSettings, f64)> = predictor.modes.iter().map(of).collect();
        let frames = |reuse| frames.iter().find(|(r, _)| *r == reuse).map_or(0.0, |(_, n)| *n);
        let best = |predictor: &Predictor| {
            let fits = |f: &Prediction| f.seconds * frames(f.reuse) <= left();
            predictor.best_within(&self.range(), &fits)
        };
        for share in SHARES {
            let Some(likely) = best(&predictor) else { break };
            let time = share * left();
            let Some(timing) = self.timing(time, &likely) else { break };
            predictor.correct_time(&likely, timer(&timing)?);
        }
        Ok(best(&predictor))
    }

    /// Seconds that a rank takes for a frame of the full size, from smaller ones.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn timed(&self, timing: &Timing) -> Result<f64> {
        let settings = timing.prediction.settings(self.context.base);
        Ok(self.small(&settings, timing.pixels)?.wall * self.enlargement(timing.pixels))
    }

    /// How to time `prediction` in about `seconds`; `None` where that is too short to tell anything.
    fn timing(&self, seconds: f64, prediction: &Prediction) -> Option<Timing> {
        let base = self.context.base;
        let full = f64::from(base.width) * f64::from(base.height);
        let frames =
            self.cut(prediction.reuse).with_ancestors(&timed_frames(self.context.shot.frames));
        let each = prediction.seconds / full * frames.len() as f64;
        let pixels = (seconds / each).min(LARGER * Effort::WHOLE.small).min(full);
        (pixels >= LEAST).then(|| Timing { prediction: prediction.clone(), pixels })
    }

    /// Pixels of a frame over those of one of about `pixels`.
    pub(super) fn enlargement(&self, pixels: f64) -> f64 {
        let (width, height) = self.small_size(pixels);
        let base = self.context.base;
        f64::from(base.width) * f64::from(base.height) / (f64::from(width) * f64::from(height))
    }

    /// Frames that a rank makes, with those outside the job that its frames are inferred from.
    pub fn frames_each(&self, reuse: ReuseSettings) -> f64 {
        let frames: Vec<u32> = (self.frames.first..=self.frames.last).collect();
        self.cut(reuse).with_ancestors(&frames).len() as f64 / f64::from(self.ranks)
    }

    fn cut(&self, reuse: ReuseSettings) -> Cut {
        let settings = Settings { reuse, ..self.context.base.clone() };
        let looks_up = !reuse::channels(self.context.scene, &settings).is_empty();
        Cut::of(&settings, self.context.shot.frames, looks_up)
    }

    /// What a frame of about `pixels` pixels takes.
    pub(super) fn small(&self, settings: &Settings, pixels: f64) -> Result<Times> {
        let mut settings = settings.clone();
        (settings.width, settings.height) = self.small_size(pixels);
        let frames = timed_frames(self.context.shot.frames);
        let trial = trial::run(self.context, &settings, self.context.intersector, None, &frames)?;
        Ok(Times { wall: trial.seconds, cpu: trial.cpu_seconds })
    }
}
