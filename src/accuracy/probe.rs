//! A probe: the few measurements of a scene that its settings are chosen by.
//!
//! Errors are estimated from some pixels of some frames at the full size, traced with a short sweep of
//! samples and compared with a reference of more samples. Times come from whole frames of a small size.

use super::choice::Goal;
use super::context::TrialContext;
use super::effort::Effort;
use super::error_model::{NoiseSources, SampleCounts};
use super::patches::{Patches, one_sample};
use super::reference::truth_settings;
use crate::effects::EffectPlan;
use crate::error::Result;
use crate::film::Image;
use crate::scene::limits::{MAX_SAMPLES, MAX_SEED};
use crate::scene::{FrameRange, Settings};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Number of frames for figures that need neighbouring pixels (SSIM, FLIP).
const WIDE_FRAMES: u32 = 4;
/// Edge of the patches for these figures.
const WIDE_EDGE: u32 = 48;
/// Pixels of a frame in all of its patches.
const WIDE_PIXELS: u32 = 9_300;
/// Pixels of the picture that is traced to measure how fast tracing is.
const PILOT: f64 = 12_000.0;
/// Numbers of camera samples to choose from. Sobol points are laid out best in powers of two; between them a quarter
/// more and half as many more are tried, since a target that is missed by a hair should not take twice the time.
const CAMERA_SAMPLES: [u32; 28] = [
    1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 160, 192, 256, 320, 384,
    512, 640, 768, 1024,
];
/// Numbers of shadow or sky samples to choose from.
const LIGHT_SAMPLES: [u32; 9] = [1, 2, 4, 8, 16, 24, 32, 48, 64];
/// Seed of the places of the probe's patches.
pub const DRAW_OF_PROBE: u64 = 1;
/// Seed of the places of the check's patches.
pub const DRAW_OF_CHECK: u64 = 2;

/// Which settings the user gave: these are not chosen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FixedSettings {
    /// Camera samples.
    pub spp: bool,
    /// Shadow samples.
    pub shadow: bool,
    /// Sky samples.
    pub sky: bool,
    /// Bounces.
    pub bounces: bool,
    /// Policy.
    pub policy: bool,
}

/// A scene and what is wanted of it.
pub struct SettingsProbe<'a> {
    /// The scene and everything needed to render it.
    pub context: &'a TrialContext<'a>,
    /// The frames of the job.
    pub frames: FrameRange,
    /// The error to be reached; `None` for a budget of time.
    pub goal: Option<Goal>,
    /// The settings that are not chosen.
    pub given: FixedSettings,
    /// Whether frames are rounded to 8 bits.
    pub rounds: bool,
    /// Seconds that the probe may take; `None` where that goes by the size of the job.
    pub seconds: Option<f64>,
    /// How many ranks share the job.
    pub ranks: u32,
}

impl SettingsProbe<'_> {
    /// How much to look at: for a budget by the time that there is, for a target by the size of the job.
    pub(super) fn effort(&self) -> Result<Effort> {
        let FrameRange { first, last } = self.frames;
        let Settings { width, height, .. } = *self.context.base;
        let Some(seconds) = self.seconds else {
            return Ok(Effort::of_job(last - first + 1, u64::from(width) * u64::from(height)));
        };
        let mut settings = one_sample(self.context.base);
        (settings.width, settings.height) = self.small_size(PILOT);
        let begun = Instant::now();
        self.context.trace(&settings, self.context.intersector, u32::midpoint(first, last))?;
        let samples = f64::from(settings.width) * f64::from(settings.height);
        let spent = begun.elapsed().as_secs_f64();
        Ok(Effort::within(seconds - spent, spent / samples).of_frames(last - first + 1))
    }

    /// The numbers of samples to choose from.
    pub fn range(&self) -> Vec<SampleCounts> {
        let (base, plan) = (self.context.base, self.plan());
        let among = |is_free: bool, all: &[u32], given: u32| match is_free {
            true => all.to_vec(),
            false => vec![given],
        };
        let spp = among(!self.given.spp, &CAMERA_SAMPLES, base.spp);
        // A time is to be used, not kept by half of it.
        let spp = if self.goal.is_none() && spp.len() > 1 { between(&spp) } else { spp };
        let is_free = (plan.area_lights && !self.given.shadow, plan.sky_light && !self.given.sky);
        let skies = among(is_free.1, &LIGHT_SAMPLES, base.sky_samples);
        let mut all = Vec::new();
        for shadow in among(is_free.0, &LIGHT_SAMPLES, base.shadow_samples) {
            for &sky in &skies {
                all.extend(spp.iter().map(|&spp| SampleCounts { spp, shadow, sky }));
            }
        }
        all
    }

    /// Patches of the job's frames from which the goal's figure can be estimated.
    ///
    /// # Errors
    /// As [`Patches::by_contrast`].
    pub(super) fn patches(&self, effort: Effort) -> Result<Patches> {
        let frames = self.frames_looked_at(effort, 0.5);
        match self.is_wide() {
            true => Ok(self.wide_patches(&frames, DRAW_OF_PROBE)),
            false => Patches::by_contrast(self.context, &frames, effort, DRAW_OF_PROBE),
        }
    }

    /// The numbers of the finished frames that a check looks at, and patches of these; `image` gives a frame as
    /// displayed.
    ///
    /// # Errors
    /// Any that `image` gives.
    pub(super) fn check_patches(
        &self,
        effort: Effort,
        image: &dyn Fn(u32) -> Result<Image>,
    ) -> Result<(Vec<u32>, Patches)> {
        let (base, frames) = (self.context.base, self.frames_looked_at(effort, 0.1));
        let patches = match self.is_wide() {
            true => self.wide_patches(&frames, DRAW_OF_CHECK),
            false => {
                // More than a probe, which traces each several times.
                let count = effort.pixels + effort.pixels / 2;
                Patches::by_contrast_of(base, &frames, image, count, DRAW_OF_CHECK)?
            }
        };
        Ok((frames, patches))
    }

    /// Whether the goal's figure needs neighbouring pixels.
    fn is_wide(&self) -> bool {
        matches!(self.goal, Some(Goal::Ssim(_) | Goal::Flip(_)))
    }

    fn wide_patches(&self, frames: &[u32], seed: u64) -> Patches {
        Patches::grid(self.context.base, frames, WIDE_EDGE, WIDE_PIXELS, seed)
    }

    fn frames_looked_at(&self, effort: Effort, offset: f64) -> Vec<u32> {
        let count = if self.is_wide() { WIDE_FRAMES } else { effort.frames };
        spread(self.frames, count, offset)
    }

    pub(super) fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.context.scene, self.context.base)
    }

    pub(super) fn sources(&self) -> NoiseSources {
        let plan = self.plan();
        NoiseSources { shadow: plan.area_lights, sky: plan.sky_light }
    }

    pub(super) fn small_size(&self, pixels: f64) -> (u32, u32) {
        let Settings { width, height, .. } = *self.context.base;
        let scale = (pixels / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
        let edge = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
        (edge(width), edge(height))
    }
}

/// `numbers` and up to three numbers between each and the next.
fn between(numbers: &[u32]) -> Vec<u32> {
    let steps = |pair: &[u32]| {
        let (from, to) = (pair[0], pair[1]);
        let step = ((to - from) / 4).max(from / 8).max(1);
        (from..to).step_by(step as usize).collect::<Vec<_>>()
    };
    let mut all: Vec<u32> = numbers.windows(2).flat_map(steps).collect();
    all.extend(numbers.last());
    all
}

/// `count` of `frames`, evenly spread; `offset` in [0, 1) shifts them.
pub fn spread(frames: FrameRange, count: u32, offset: f64) -> Vec<u32> {
    let FrameRange { first, last } = frames;
    let step = f64::from(last - first + 1) / f64::from(count);
    let mut all: Vec<u32> = (0..count)
        .map(|k| first + ((f64::from(k) + offset) * step).floor() as u32)
        .map(|frame| frame.clamp(first, last))
        .collect();
    all.dedup();
    all
}

/// Samples of a reference that frames of `samples` are compared with.
pub fn samples_of_reference(samples: SampleCounts) -> SampleCounts {
    SampleCounts {
        spp: (4 * samples.spp).clamp(32, MAX_SAMPLES),
        shadow: samples.shadow.max(4),
        sky: samples.sky.max(2),
    }
}

/// Settings of a reference with `samples`: its seed is neither the job's nor one of a sweep.
pub fn reference(base: &Settings, samples: SampleCounts) -> Settings {
    let mut settings = truth_settings(base, &[]);
    (settings.spp, settings.shadow_samples) = (samples.spp, samples.shadow);
    settings.sky_samples = samples.sky;
    settings.seed = (base.seed + MAX_SEED / 4) % (MAX_SEED + 1);
    settings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_spread_and_stay_in_the_job() {
        let spread = |first, last, offset| spread(FrameRange { first, last }, 4, offset);
        assert_eq!(spread(1, 16, 0.5), [3, 7, 11, 15]);
        assert_eq!(spread(9, 24, 0.0), [9, 13, 17, 21]);
        assert_eq!(spread(1, 2, 0.5), [1, 2]);
        assert_eq!(spread(5, 5, 0.9), [5]);
    }
}
