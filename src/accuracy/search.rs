//! The probe's errors: a short sweep, a model of it, and settings that the model leads to, traced before one
//! is chosen.

use super::choice::Goal;
use super::effort::Effort;
use super::error_model::{ErrorModel, SampleCounts, SampleErrors};
use super::errors::ROUNDING;
use super::figures::{figure, squared_errors};
use super::patches::{PatchImages, Patches, rounded};
use super::predictor::{Prediction, Predictor, ReuseMode};
use super::probe::{SettingsProbe, reference, samples_of_reference};
use super::worst::worst;
use crate::error::Result;
use crate::scene::Settings;
use std::time::Instant;

/// Share of the squared error in reach that bounces and cut-off may leave out.
const BIAS: f64 = 0.1;
/// The squared error in reach as a share of the least in the sweep, where no PSNR is asked for.
const IN_REACH: f64 = 0.25;
/// Numbers of bounces to choose from.
const BOUNCES: [u32; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
/// How many settings of each reuse policy are tried at most.
const TRIALS: u32 = 8;
/// The squared error aimed at changes by this factor at most from one trial to the next.
const STEP: f64 = 4.0;
/// Between squared errors less than this factor apart nothing is tried.
const CLOSE: f64 = 1.2;
/// Share of the job's time that the probe may take.
const SHARE: f64 = 0.2;
/// Seconds that it may take however short the job is.
const LEAST_SECONDS: f64 = 12.0;

/// What a setting was measured to come to.
#[derive(Debug, Clone, Copy)]
struct Measured {
    samples: SampleCounts,
    /// Of the worst frame, in squares of a display step.
    squared_error: f64,
    /// The goal's.
    figure: f64,
}

/// A probe that goes on.
struct Search<'a> {
    probe: &'a SettingsProbe<'a>,
    patches: Patches,
    truth: PatchImages,
    /// Samples of `truth`.
    reference: SampleCounts,
    measured: Vec<Measured>,
    /// What was found so far.
    predictor: Predictor,
    /// When the probe began.
    begun: Instant,
    /// Seconds that the patches took, and the rays of a pixel.
    spent: (f64, f64),
    /// A setting that is predicted to reach the goal, which there was no time to measure.
    unmeasured: Option<Prediction>,
}

impl SettingsProbe<'_> {
    /// Measures the scene. Where there is a goal, it also gives, for each reuse policy, the fastest setting
    /// found whose figure was measured to be at most `aim` times the largest that the goal allows, or the
    /// largest itself where there is no such setting. Where the job is too short to measure any, it gives one that is
    /// predicted to reach the goal. `progress` is called with what is being done.
    ///
    /// # Errors
    /// [`crate::error::Error::Stopped`]; errors of rendering.
    pub fn look(&self, aim: f64, progress: &dyn Fn(&str)) -> Result<(Predictor, Vec<Prediction>)> {
        let begun = Instant::now();
        let effort = self.effort()?;
        progress("errors of a short sweep");
        let mut search = Search::begin(self, effort, begun)?;
        progress("times");
        search.predictor.modes = self.modes(search.predictor.bounces, effort.small)?;
        let mut found = Vec::new();
        if let Some(goal) = self.goal {
            progress("errors of what may be chosen");
            found = search.fastest(goal, aim * goal.largest())?;
            if found.is_empty() {
                found = search.fastest(goal, goal.largest())?;
            }
            if found.is_empty() {
                found.extend(search.unmeasured);
            }
        }
        Ok((search.predictor, found))
    }
}

impl<'a> Search<'a> {
    /// Traces the sweep, fits the model to it, and chooses the bounces.
    fn begin(probe: &'a SettingsProbe<'a>, effort: Effort, begun: Instant) -> Result<Self> {
        let (context, patches) = (probe.context, probe.patches(effort)?);
        let reference = samples_of_reference(SampleCounts { spp: 8, shadow: 2, sky: 2 });
        let (traced, mut rays) = (Instant::now(), rays_of(reference));
        let truth = patches.trace(context, &converged(context.base, reference))?;
        let (mut points, mut doubts) = (Vec::new(), Vec::new());
        for samples in design(probe) {
            let seen = patches.trace(context, &sampled(context.base, samples))?;
            rays += rays_of(samples);
            let (errors, doubt) = squared_errors(&patches, &truth, &seen);
            points.push(SampleErrors { samples, reference, errors });
            doubts = doubt;
        }
        let predictor = Predictor {
            model: ErrorModel::of(probe.sources(), &points),
            doubts,
            bias: 0.0,
            rounding: if probe.rounds { ROUNDING } else { 0.0 },
            bounces: context.base.bounces,
            modes: Vec::new(),
            excess: 1.0,
        };
        let in_reach = match probe.goal {
            Some(goal @ Goal::Psnr(_)) => goal.largest(),
            _ => IN_REACH * points.iter().map(|p| largest(&p.errors)).fold(f64::INFINITY, f64::min),
        };
        let spent = (traced.elapsed().as_secs_f64(), rays);
        let mut search = Self {
            probe,
            patches,
            truth,
            reference,
            measured: Vec::new(),
            predictor,
            begun,
            spent,
            unmeasured: None,
        };
        let (bounces, bias) = search.bounces(BIAS * in_reach)?;
        (search.predictor.bounces, search.predictor.bias) = (bounces, bias);
        Ok(search)
    }

    /// For each reuse policy the fastest setting found whose figure was measured to be at most `allowed`.
    fn fastest(&mut self, goal: Goal, allowed: f64) -> Result<Vec<Prediction>> {
        let modes = self.predictor.modes.clone();
        let found = modes.iter().map(|mode| self.fastest_of(mode, goal, allowed));
        found.filter_map(Result::transpose).collect()
    }

    fn fastest_of(
        &mut self,
        mode: &ReuseMode,
        goal: Goal,
        allowed: f64,
    ) -> Result<Option<Prediction>> {
        let (range, is_psnr) = (self.probe.range(), matches!(goal, Goal::Psnr(_)));
        let start = match is_psnr {
            true => allowed,
            false => {
                let usual = SampleCounts { spp: 4, shadow: 4, sky: 4 };
                let predicted = |samples| self.predictor.squared_error(samples);
                let least = range.iter().copied().map(predicted).fold(f64::INFINITY, f64::min);
                // Samples that are given may leave nothing as good to choose from.
                predicted(usual).max(least)
            }
        };
        let (mut bracket, mut aim, mut best) = (Bracket::OPEN, Some(start), None);
        for _ in 0..TRIALS {
            let guess = aim.and_then(|aim| self.predictor.fastest(mode, &range, aim));
            let (Some(guess), Some(tried)) = (guess, aim) else { break };
            if !self.has_time_for(&guess) {
                self.unmeasured.get_or_insert(guess);
                break;
            }
            let Measured { squared_error, figure, .. } = self.measure(goal, guess.samples)?;
            let ratio = figure / allowed;
            // Other figures rise about as the root of the squared error.
            let wanted = guess.squared_error * ratio.powf(if is_psnr { -1.0 } else { -1.5 });
            aim = bracket.next(tried, wanted, ratio <= 1.0);
            if ratio <= 1.0 {
                let figure = (!is_psnr).then_some(figure);
                best = Some(Prediction { squared_error, figure, ..guess });
            }
        }
        Ok(best)
    }

    /// Whether it can be measured what `guess` comes to before the probe has taken its share of the job's time.
    fn has_time_for(&self, guess: &Prediction) -> bool {
        let Prediction { samples, reuse, seconds, .. } = *guess;
        let (spent, rays) = self.spent;
        let trial = self.rays_to_measure(samples) * spent / rays;
        let job = seconds * self.probe.frames_each(reuse);
        self.known(samples).is_some() || may_take(self.begun.elapsed().as_secs_f64() + trial, job)
    }

    /// What `samples` were measured to come to.
    fn known(&self, samples: SampleCounts) -> Option<Measured> {
        self.measured.iter().copied().find(|known| known.samples == samples)
    }

    /// Rays of a pixel that measuring `samples` takes, with those of a finer reference where it is needed.
    fn rays_to_measure(&self, samples: SampleCounts) -> f64 {
        let finer = self.is_coarse_for(samples).then(|| samples_of_reference(samples));
        rays_of(samples) + finer.map_or(0.0, rays_of)
    }

    /// Whether the reference has too few samples to measure what `samples` come to.
    fn is_coarse_for(&self, samples: SampleCounts) -> bool {
        self.reference.spp < 2 * samples.spp
            || self.reference.shadow < samples.shadow
            || self.reference.sky < samples.sky
    }

    /// What `samples` come to at the patches, with the bounces chosen; nothing is traced twice.
    fn measure(&mut self, goal: Goal, samples: SampleCounts) -> Result<Measured> {
        if let Some(known) = self.known(samples) {
            return Ok(known);
        }
        let context = self.probe.context;
        let (traced, rays) = (Instant::now(), self.rays_to_measure(samples));
        if self.is_coarse_for(samples) {
            self.reference = samples_of_reference(samples);
            self.truth = self.patches.trace(context, &converged(context.base, self.reference))?;
        }
        let (bounces, cutoff) = (self.predictor.bounces, context.base.cutoff);
        let settings = Settings { bounces, cutoff, ..sampled(context.base, samples) };
        let seen = self.patches.trace(context, &settings)?;
        self.spent.0 += traced.elapsed().as_secs_f64();
        self.spent.1 += rays;
        let (mut errors, doubts) = squared_errors(&self.patches, &self.truth, &seen);
        let own = self.predictor.model.own_part(samples, self.reference);
        errors.iter_mut().for_each(|error| *error *= own);
        let squared_error = worst(&errors, &doubts) + self.predictor.rounding;
        let figure = match goal {
            Goal::Psnr(_) => squared_error,
            // As the file will have it: FLIP sees steps of 8 bits all over the picture.
            _ if self.probe.rounds => figure(goal, &self.patches, &self.truth, &rounded(&seen))?,
            _ => figure(goal, &self.patches, &self.truth, &seen)?,
        };
        let measured = Measured { samples, squared_error, figure };
        self.measured.push(measured);
        Ok(measured)
    }

    /// The fewest bounces that leave out at most `allowed` more of the squared error than the most bounces
    /// do, and what they leave out in the worst frame. All are traced with the same random numbers.
    fn bounces(&self, allowed: f64) -> Result<(u32, f64)> {
        let (probe, base, plan) = (self.probe, self.probe.context.base, self.probe.plan());
        if !plan.mirror && !plan.glass {
            return Ok((base.bounces, 0.0));
        }
        let numbers = if probe.given.bounces { &[base.bounces] } else { &BOUNCES[..] };
        let most = *numbers.last().unwrap_or(&base.bounces);
        let mut settings = sampled(base, SampleCounts { spp: 4, shadow: 1, sky: 1 });
        let truth = self.patches.trace(probe.context, &settings)?;
        settings.cutoff = base.cutoff;
        let mut left_out = |bounces: u32| -> Result<f64> {
            settings.bounces = bounces;
            let seen = self.patches.trace(probe.context, &settings)?;
            let (errors, _) = squared_errors(&self.patches, &truth, &seen);
            Ok(largest(&errors))
        };
        let least = left_out(most)?;
        for bounces in numbers {
            let bias = left_out(*bounces)?;
            if bias <= least + allowed {
                return Ok((*bounces, bias));
            }
        }
        Ok((most, least))
    }
}

/// The squared errors, as the model has them, between which that lies with which a goal is just reached.
struct Bracket {
    /// The largest that reached the goal; 0 where none did.
    reached: f64,
    /// The smallest that missed it.
    missed: f64,
}

impl Bracket {
    /// Before anything is tried.
    const OPEN: Self = Self { reached: 0.0, missed: f64::INFINITY };

    /// The squared error to try after `tried`, by which the goal `is_reached` or not: `wanted`, if that lies
    /// between the bounds; else their geometric mean. `None` where the bounds are close, or where nothing much
    /// larger than what reached the goal is wanted.
    fn next(&mut self, tried: f64, wanted: f64, is_reached: bool) -> Option<f64> {
        match is_reached {
            true => self.reached = self.reached.max(tried),
            false => self.missed = self.missed.min(tried),
        }
        let step = CLOSE.sqrt();
        let is_close = is_reached && wanted < step * self.reached;
        if is_close || self.missed < CLOSE * self.reached {
            return None;
        }
        // What missed by a hair is not approached by hairs.
        let most = if is_reached { tried * STEP } else { tried / step };
        let wanted = wanted.clamp(tried / STEP, most);
        let is_between = self.reached < wanted && wanted < self.missed;
        Some(if is_between { wanted } else { (self.reached * self.missed).sqrt() })
    }
}

/// Whether a probe may take `seconds`, if the job takes `job`.
fn may_take(seconds: f64, job: f64) -> bool {
    seconds <= (SHARE * job).max(LEAST_SECONDS)
}

/// Rays of a pixel of so many samples, one light and sky each.
fn rays_of(SampleCounts { spp, shadow, sky }: SampleCounts) -> f64 {
    f64::from(spp) * f64::from(1 + shadow + sky)
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// The settings of the sweep.
fn design(probe: &SettingsProbe) -> Vec<SampleCounts> {
    let (base, sources) = (probe.context.base, probe.sources());
    let all = [(1, 1, 1), (4, 1, 1), (4, 8, 1), (4, 1, 8), (2, 4, 4), (16, 1, 1), (8, 2, 2)];
    let mut design = Vec::new();
    for (spp, shadow, sky) in all {
        let shadow = if sources.shadow { shadow } else { base.shadow_samples };
        let sky = if sources.sky { sky } else { base.sky_samples };
        let samples = SampleCounts { spp, shadow, sky };
        if !design.contains(&samples) {
            design.push(samples);
        }
    }
    design
}

/// The settings of a reference with `samples`, and with as many bounces as may be chosen.
pub(super) fn converged(base: &Settings, samples: SampleCounts) -> Settings {
    let settings = reference(base, samples);
    let bounces = BOUNCES.into_iter().fold(settings.bounces, u32::max);
    Settings { bounces, ..settings }
}

/// The same with the job's seed: frames with these settings differ from the reference for their samples
/// alone.
fn sampled(base: &Settings, samples: SampleCounts) -> Settings {
    Settings { seed: base.seed, ..converged(base, samples) }
}

#[cfg(test)]
mod tests {
    use super::{Bracket, may_take};

    /// The squared errors tried where the goal is reached up to `limit`, and the figure rises by `power`.
    fn tried(start: f64, limit: f64, power: f64) -> Vec<f64> {
        let (mut bracket, mut aim, mut all) = (Bracket::OPEN, Some(start), Vec::new());
        while let Some(tried) = aim.filter(|_| all.len() < 20) {
            all.push(tried);
            let ratio = (tried / limit).powf(power);
            aim = bracket.next(tried, tried * ratio.powf(-1.5), ratio <= 1.0);
        }
        all
    }

    #[test]
    fn a_goal_is_found_from_either_side_whatever_the_power() {
        for power in [0.3, 0.67, 1.0, 2.0] {
            for start in [0.01, 0.9, 1.1, 90.0] {
                let all = tried(start, 1.0, power);
                let best = all.iter().copied().filter(|x| *x <= 1.0).fold(0.0, f64::max);
                assert!(best > 0.6 && all.len() < 12, "{power} {start}: {all:?}");
                // Hardly any trial is of a squared error far below, which is expensive.
                assert!(all.iter().all(|x| *x >= start.min(0.2)), "{power} {start}: {all:?}");
            }
        }
    }

    #[test]
    fn a_probe_takes_a_fifth_of_a_job_of_a_minute_or_more() {
        assert!(may_take(12.0, 0.1) && !may_take(12.1, 60.0));
        assert!(may_take(120.0, 600.0) && !may_take(121.0, 600.0));
    }

    #[test]
    fn nothing_more_is_tried_where_a_cheaper_setting_would_miss() {
        let mut bracket = Bracket::OPEN;
        // 4 was allowed, 2.5 predicted of what was tried, and 1.2 times that came out of 4.
        assert_eq!(bracket.next(4.0, 2.5 / 0.75, true), None);
    }
}
