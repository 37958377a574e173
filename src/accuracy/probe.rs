//! A quick look at a scene: what there has to be known to choose its settings.
//!
//! Errors are told from some pixels of some frames at the full size, traced at a short sweep of samples
//! and held against more of them; what the sweep leads to is traced there as well before it is chosen.
//! Times come from whole frames of a small size.

use super::choice::Goal;
use super::foretell::{Foretelling, Foretold, Range};
use super::frames::{Cut, chosen_frames};
use super::law::{Causes, Samples};
use super::patches::Patches;
use super::reference::truth_settings;
use super::search::Search;
use super::stage::Stage;
use super::trial::{self, Trial};
use crate::effects::EffectPlan;
use crate::error::Result;
use crate::film::Image;
use crate::reuse;
use crate::scene::limits::{MAX_SAMPLES, MAX_SEED};
use crate::scene::{FrameRange, Settings};
use serde::{Deserialize, Serialize};

/// Frames, and pixels of each, that errors are told from.
const FRAMES: u32 = 8;
const PIXELS: u32 = 1200;
/// Frames, edge and pixels of patches in which neighbours count (SSIM, FLIP).
const WIDE: (u32, u32, u32) = (4, 48, 9_300);
/// Pixels of the small frames that are timed.
pub(super) const SMALL: f64 = 7_000.0;
/// How many times as many pixels the likely choices are timed with as well: the larger a frame, the less
/// of it is edges, where light is not known from other frames.
const LARGER: f64 = 3.0;
/// Ways to take over light foretold to take so many times as long as the fastest are not tried.
const SLOWER: f64 = 2.5;
/// Draws the patches: of the probe, and of the check.
pub const PROBE: u64 = 1;
/// See [`PROBE`].
pub const CHECK: u64 = 2;

/// What the user set already, which is not chosen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
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

/// The scene and what is wanted of it.
pub struct Probe<'a> {
    /// What all trials share.
    pub stage: &'a Stage<'a>,
    /// The frames of the job.
    pub frames: FrameRange,
    /// What is to be reached; `None` where a time is to be kept.
    pub goal: Option<Goal>,
    /// What is not chosen.
    pub given: Given,
    /// Whether frames are rounded to 8 bits.
    pub rounds: bool,
}

impl Probe<'_> {
    /// Looks at the scene. `heard` hears what is being done.
    ///
    /// # Errors
    /// [`crate::error::Error::Stopped`]; those of rendering.
    pub fn look(&self, heard: &dyn Fn(&str)) -> Result<Foretelling> {
        heard("errors of a short sweep");
        let mut search = Search::begin(self)?;
        heard("times");
        search.foretelling.modes = self.modes(search.foretelling.bounces)?;
        if let Some(goal) = self.goal {
            heard("errors of what may be chosen");
            search.try_likely(goal)?;
        }
        Ok(search.foretelling)
    }

    /// Of the fastest setting of each mode the one that is fastest when all are tried.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn fastest(&self, foretelling: &Foretelling, allowed: f64) -> Result<Option<Foretold>> {
        let mut found = likely(foretelling.fastest(&self.range(), allowed));
        for foretold in &mut found {
            foretold.seconds = self.tried_seconds(foretold)?;
        }
        Ok(found.into_iter().min_by(|a, b| a.seconds.total_cmp(&b.seconds)))
    }

    /// The best setting that takes at most `seconds` a frame, tried on small frames.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn best_within(&self, foretelling: &Foretelling, seconds: f64) -> Result<Option<Foretold>> {
        let mut foretelling = foretelling.clone();
        let mut found = None;
        for _ in 0..3 {
            let Some(best) = foretelling.best_within(&self.range(), seconds) else { break };
            let taken = self.tried_seconds(&best)?;
            foretelling = foretelling.slower(taken / best.seconds);
            found = Some(Foretold { seconds: taken, ..best });
            if taken <= 1.02 * seconds {
                break;
            }
        }
        Ok(found)
    }

    /// Seconds of a frame of the full size, from frames of two small ones: what edges take goes with
    /// their length, all else with the area.
    fn tried_seconds(&self, foretold: &Foretold) -> Result<f64> {
        let settings = foretold.settings(self.stage.base);
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let [small, large] = [SMALL, LARGER * SMALL].map(|most| most.min(pixels));
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

    /// What may be chosen.
    pub fn range(&self) -> Range {
        let (base, plan) = (self.stage.base, self.plan());
        // Sobol points are laid out best in powers of two; half way between them is tried where a
        // step is dear.
        let numbers = [1, 2, 4, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256, 512, 1024];
        let among = |is_free: bool, most: u32, given: u32| match is_free {
            true => numbers.into_iter().filter(|n| *n <= most).collect(),
            false => vec![given],
        };
        Range {
            spp: among(!self.given.spp, 1024, base.spp),
            shadow: among(plan.area_lights && !self.given.shadow, 64, base.shadow_samples),
            sky: among(plan.sky_light && !self.given.sky, 64, base.sky_samples),
        }
    }

    /// Patches of the job's frames in which the goal's figure can be taken.
    ///
    /// # Errors
    /// Those of [`Patches::by_contrast`].
    pub(super) fn patches(&self) -> Result<Patches> {
        match self.is_wide() {
            true => {
                let (frames, edge, pixels) = WIDE;
                let frames = spread(self.frames, frames, 0.5);
                Ok(Patches::grid(self.stage.base, &frames, edge, pixels, PROBE))
            }
            false => {
                let frames = spread(self.frames, FRAMES, 0.5);
                Patches::by_contrast(self.stage, &frames, PIXELS, PROBE)
            }
        }
    }

    /// Patches of finished frames that a check looks at, whose pictures `image` gives; and which frames.
    ///
    /// # Errors
    /// Those of `image`.
    pub(super) fn check_patches(
        &self,
        image: &dyn Fn(u32) -> Result<Image>,
    ) -> Result<(Vec<u32>, Patches)> {
        let base = self.stage.base;
        Ok(match self.is_wide() {
            true => {
                let (frames, edge, pixels) = WIDE;
                let frames = spread(self.frames, frames, 0.1);
                let patches = Patches::grid(base, &frames, edge, pixels, CHECK);
                (frames, patches)
            }
            false => {
                let frames = spread(self.frames, 2 * FRAMES, 0.1);
                let patches = Patches::by_contrast_of(base, &frames, image, PIXELS, CHECK)?;
                (frames, patches)
            }
        })
    }

    /// How many frames are made: those of the job, and all that they are inferred from.
    pub fn made_frames(&self) -> u32 {
        let plan = self.plan();
        let looks_up = !reuse::channels(self.stage.scene, &plan, self.stage.base).is_empty();
        let cut = Cut::of(self.stage.base, self.stage.shot.frames, looks_up);
        let frames: Vec<u32> = (self.frames.first..=self.frames.last).collect();
        cut.with_ancestors(&frames).len() as u32
    }

    fn is_wide(&self) -> bool {
        matches!(self.goal, Some(Goal::Ssim(_) | Goal::Flip(_)))
    }

    pub(super) fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.stage.scene, self.stage.base)
    }

    pub(super) fn causes(&self) -> Causes {
        let plan = self.plan();
        Causes { shadow: plan.area_lights, sky: plan.sky_light }
    }

    /// Frames with about `pixels` pixels, and all that they are inferred from.
    pub(super) fn small_trial(&self, settings: &Settings, pixels: f64) -> Result<Trial> {
        let mut settings = settings.clone();
        (settings.width, settings.height) = self.small_size(pixels);
        let frames = chosen_frames(self.stage.shot.frames);
        trial::run(self.stage, &settings, self.stage.intersector, &frames)
    }

    fn small_size(&self, pixels: f64) -> (u32, u32) {
        let Settings { width, height, .. } = *self.stage.base;
        let scale = (pixels / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
        let edge = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
        (edge(width), edge(height))
    }

    /// Pixels of a frame over those of a small one.
    pub(super) fn enlargement(&self) -> f64 {
        let (width, height) = self.small_size(SMALL);
        let base = self.stage.base;
        f64::from(base.width) * f64::from(base.height) / (f64::from(width) * f64::from(height))
    }
}

/// Those of `found` that may turn out to be the fastest.
pub(super) fn likely(mut found: Vec<Foretold>) -> Vec<Foretold> {
    let least = found.iter().map(|f| f.seconds).fold(f64::INFINITY, f64::min);
    found.retain(|f| f.seconds <= SLOWER * least);
    found
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

/// Samples enough to hold `samples` against.
pub fn samples_of_reference(samples: Samples) -> Samples {
    Samples {
        spp: (4 * samples.spp).clamp(32, MAX_SAMPLES),
        shadow: samples.shadow.max(4),
        sky: samples.sky.max(2),
    }
}

/// Settings of a reference of so many samples: its seed is none of a job's or of a sweep's.
pub fn reference(base: &Settings, samples: Samples) -> Settings {
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
