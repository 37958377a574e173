//! A quick look at a scene: what there has to be known to choose its settings.
//!
//! Errors are told from patches of some frames at the full size, traced at a short sweep of samples and
//! held against many samples. Times, and how much better or worse frames between are, come from whole
//! frames of a small size, where the audit says how far they are off.

use super::choice::Goal;
use super::figures::{doubt, figure, mean, squares};
use super::foretell::{Foretelling, Foretold, Line, Range};
use super::frames::chosen_frames;
use super::law::{Law, Point, Samples};
use super::patches::{Patches, Seen};
use super::reference::truth_settings;
use super::stage::Stage;
use super::trial::{self, Trial};
use crate::effects::EffectPlan;
use crate::error::Result;
use crate::scene::limits::{MAX_SAMPLES, MAX_SEED};
use crate::scene::{Policy, Settings};

/// Samples of the probe's reference.
const REFERENCE: Samples = Samples { spp: 128, shadow: 8, sky: 8 };
/// Frames, and pixels of each, that errors are told from.
const FRAMES: u32 = 4;
const PIXELS: u32 = 2500;
/// Edge and pixels of patches in which neighbours count (SSIM, FLIP).
const WIDE: (u32, u32) = (48, 12_000);
/// Pixels of the small frames that are timed.
const SMALL: f64 = 7_000.0;
/// How often the likely choices are timed in turns; the shortest time counts.
const TURNS: u32 = 2;
/// Share of what the goal allows that bounces and cut-off may take.
const BIAS: f64 = 0.1;
/// Draws the patches: of the probe, and of the check.
pub const PROBE: u64 = 1;
/// See [`PROBE`].
pub const CHECK: u64 = 2;

/// What the user set already, which is not chosen.
#[derive(Debug, Clone, Copy, Default)]
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
    /// Tolerance.
    pub tolerance: bool,
}

/// The scene and what is wanted of it.
pub struct Probe<'a> {
    /// What all trials share.
    pub stage: &'a Stage<'a>,
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
        let patches = self.patches(PROBE, &spread(self.stage.shot.frames, FRAMES, 0.5))?;
        heard("a reference for some pixels");
        let truth = patches.trace(self.stage, &reference(self.stage.base))?;
        heard("errors of a short sweep");
        let mut sweep = Vec::new();
        for samples in self.design() {
            sweep.push((samples, self.traced(&patches, samples)?));
        }
        let mut points: Vec<Point> = sweep
            .iter()
            .map(|(samples, seen)| (*samples, squares(&patches, &truth, seen)))
            .collect();
        let figures = sweep.iter().zip(&points).map(|((_, seen), (_, errors))| {
            Ok((
                mean(errors),
                self.goal.map_or(Ok(0.0), |goal| figure(goal, &patches, &truth, seen))?,
            ))
        });
        let figures = figures.collect::<Result<Vec<_>>>()?;
        let mut foretelling = Foretelling {
            law: Law::of(&points, REFERENCE),
            bias: Vec::new(),
            rounding: if self.rounds { 1.0 / 12.0 } else { 0.0 },
            bounces: self.stage.base.bounces,
            modes: Vec::new(),
            line: Line::through(&figures),
            doubt: sweep.last().map_or(0.0, |(_, seen)| doubt(&patches, &truth, seen)),
        };
        let most = self.goal.map_or(f64::INFINITY, |goal| foretelling.allowed(goal));
        (foretelling.bounces, foretelling.bias) = self.bounces(&patches, BIAS * most)?;
        heard("times, and errors of frames between");
        foretelling.modes = self.modes(foretelling.bounces)?;
        // The law is fitted once more with what it led to: there it has to be right.
        for _ in 0..2 {
            let Some(likely) = self.likely(&foretelling) else { break };
            if points.iter().any(|(samples, _)| *samples == likely.samples) {
                break;
            }
            let seen = self.traced(&patches, likely.samples)?;
            points.push((likely.samples, squares(&patches, &truth, &seen)));
            foretelling.law = Law::of(&points, REFERENCE);
        }
        Ok(foretelling)
    }

    /// Of the fastest setting of each mode the one that is fastest when all are tried.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn fastest(&self, foretelling: &Foretelling, allowed: f64) -> Result<Option<Foretold>> {
        let mut found = foretelling.fastest(&self.range(), allowed);
        let mut seconds = vec![f64::INFINITY; found.len()];
        for _ in 0..TURNS {
            for (foretold, seconds) in found.iter().zip(&mut seconds) {
                let trial = self.small_trial(&foretold.settings(self.stage.base))?;
                *seconds = seconds.min(trial.seconds * self.enlargement());
            }
        }
        found.iter_mut().zip(seconds).for_each(|(foretold, seconds)| foretold.seconds = seconds);
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
            let trial = self.small_trial(&best.settings(self.stage.base))?;
            let taken = trial.seconds * self.enlargement();
            foretelling = foretelling.slower(taken / best.seconds);
            found = Some(Foretold { seconds: taken, ..best });
            if taken <= 1.05 * seconds {
                break;
            }
        }
        Ok(found)
    }

    /// What may be chosen.
    pub fn range(&self) -> Range {
        let (base, plan) = (self.stage.base, self.plan());
        let numbers =
            [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024];
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

    /// Patches of `frames` in which the goal's figure can be taken.
    ///
    /// # Errors
    /// Those of [`Patches::by_contrast`].
    pub(super) fn patches(&self, lot: u64, frames: &[u32]) -> Result<Patches> {
        match self.goal {
            Some(Goal::Ssim(_) | Goal::Flip(_)) => {
                Ok(Patches::grid(self.stage.base, frames, WIDE.0, WIDE.1, lot))
            }
            _ => Patches::by_contrast(self.stage, frames, PIXELS, lot),
        }
    }

    fn likely(&self, foretelling: &Foretelling) -> Option<Foretold> {
        let range = self.range();
        let goal = self.goal?;
        let found = foretelling.fastest(&range, foretelling.allowed(goal));
        found.into_iter().min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    }

    fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.stage.scene, self.stage.base)
    }

    fn design(&self) -> Vec<Samples> {
        let (base, plan) = (self.stage.base, self.plan());
        let all = [
            (1, 1, 1),
            (4, 1, 1),
            (16, 1, 1),
            (4, 16, 1),
            (4, 1, 16),
            (4, 4, 4),
            (1, 16, 16),
            (16, 4, 4),
            (16, 16, 16),
        ];
        let mut design = Vec::new();
        for (spp, shadow, sky) in all {
            let shadow = if plan.area_lights { shadow } else { base.shadow_samples };
            let sky = if plan.sky_light { sky } else { base.sky_samples };
            let samples = Samples { spp, shadow, sky };
            if !design.contains(&samples) {
                design.push(samples);
            }
        }
        design
    }

    /// The patches with the reference's bounces: what samples alone do.
    fn traced(&self, patches: &Patches, samples: Samples) -> Result<Seen> {
        let Samples { spp, shadow, sky } = samples;
        let mut settings = reference(self.stage.base);
        (settings.spp, settings.shadow_samples, settings.sky_samples) = (spp, shadow, sky);
        settings.seed = self.stage.base.seed;
        patches.trace(self.stage, &settings)
    }

    /// The fewest bounces that miss at most `allowed`, the most there are otherwise; and what they
    /// miss in each frame. The same random numbers with more bounces tell.
    fn bounces(&self, patches: &Patches, allowed: f64) -> Result<(u32, Vec<f64>)> {
        let base = self.stage.base;
        let plan = self.plan();
        let few = Samples { spp: 4, shadow: 1, sky: 1 };
        let truth = self.traced(patches, few)?;
        let mut settings = base.clone();
        (settings.spp, settings.shadow_samples, settings.sky_samples) = (4, 1, 1);
        settings.reuse.policy = Policy::Off;
        let is_free = allowed.is_finite() && !self.given.bounces && (plan.mirror || plan.glass);
        let mut tried = vec![base.bounces];
        if is_free {
            tried = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32].to_vec();
            tried.push(base.bounces);
            tried.sort_unstable();
            tried.dedup();
        }
        let mut last = (base.bounces, Vec::new());
        for bounces in tried {
            settings.bounces = bounces;
            let bias = squares(patches, &truth, &patches.trace(self.stage, &settings)?);
            let is_enough = bias.iter().all(|bias| *bias <= allowed);
            last = (bounces, bias);
            if is_enough {
                break;
            }
        }
        Ok(last)
    }

    pub(super) fn small_trial(&self, settings: &Settings) -> Result<Trial> {
        let mut settings = settings.clone();
        (settings.width, settings.height) = self.small_size();
        let frames = chosen_frames(self.stage.shot.frames);
        trial::run(self.stage, &settings, self.stage.intersector, &frames)
    }

    fn small_size(&self) -> (u32, u32) {
        let Settings { width, height, .. } = *self.stage.base;
        let scale = (SMALL / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
        let edge = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
        (edge(width), edge(height))
    }

    /// Pixels of a frame over those of a small one.
    pub(super) fn enlargement(&self) -> f64 {
        let (width, height) = self.small_size();
        let base = self.stage.base;
        f64::from(base.width) * f64::from(base.height) / (f64::from(width) * f64::from(height))
    }
}

/// `count` frames of a move of `frames`, evenly spread; `offset` in [0, 1) shifts them.
pub fn spread(frames: u32, count: u32, offset: f64) -> Vec<u32> {
    let step = f64::from(frames) / f64::from(count);
    let mut all: Vec<u32> = (0..count)
        .map(|k| (1.0 + (f64::from(k) + offset) * step).floor() as u32)
        .map(|frame| frame.clamp(1, frames))
        .collect();
    all.dedup();
    all
}

/// Settings of a reference: its seed is none of a job's or of a sweep's.
pub fn reference(base: &Settings) -> Settings {
    let mut settings = truth_settings(base, &[]);
    settings.spp = REFERENCE.spp;
    settings.shadow_samples = REFERENCE.shadow.min(MAX_SAMPLES);
    settings.sky_samples = REFERENCE.sky;
    settings.seed = (base.seed + MAX_SEED / 4) % (MAX_SEED + 1);
    settings
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn frames_are_spread_and_stay_in_the_move() {
        assert_eq!(spread(16, 4, 0.5), [3, 7, 11, 15]);
        assert_eq!(spread(16, 4, 0.0), [1, 5, 9, 13]);
        assert_eq!(spread(2, 4, 0.5), [1, 2]);
        assert_eq!(spread(1, 4, 0.0), [1]);
    }
}
