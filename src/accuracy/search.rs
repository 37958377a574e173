//! The probe's errors: a sweep, a model of it, and what the model leads to, tried.

use super::choice::Goal;
use super::effort::Effort;
use super::error_model::{ErrorModel, SampleErrors, Samples};
use super::figures::{doubts, figure, squares};
use super::patches::{PatchImages, Patches, rounded};
use super::predictor::{Figure, MeasuredSamples, PatchSpeed, PowerLaw, Predictor, ROUNDING};
use super::probe::{Probe, reference, samples_of_reference};
use super::timing::likely as likely_of;
use crate::error::Result;
use std::time::Instant;

/// Share of what the goal allows that bounces and cut-off may take.
const BIAS: f64 = 0.1;
/// What samples may come to, of the least error that the sweep did, where no goal says.
const BEYOND: f64 = 0.25;
/// Numbers of bounces that are thought of.
const BOUNCES: [u32; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
/// How often the likely choices are tried.
const ROUNDS: u32 = 4;
/// The same where the goal's figure only goes somehow with the squared error.
const ROUNDS_BY_FIGURE: u32 = 10;

/// What samples that were traced came to.
struct Found {
    point: SampleErrors,
    /// How far each frame's error may be off, a share.
    doubts: Vec<f64>,
    /// The goal's figure, unless that is the squared error.
    figure: Option<Figure>,
}

/// What is known so far.
pub(super) struct Search<'a> {
    probe: &'a Probe<'a>,
    patches: Patches,
    truth: PatchImages,
    reference: Samples,
    found: Vec<Found>,
    /// What it comes to.
    pub predictor: Predictor,
}

impl<'a> Search<'a> {
    /// Runs the sweep.
    pub fn begin(probe: &'a Probe<'a>, effort: Effort) -> Result<Self> {
        let patches = probe.patches(effort)?;
        let reference = samples_of_reference(Samples { spp: 8, shadow: 2, sky: 2 });
        let begun = Instant::now();
        let truth = patches
            .trace(probe.context, &super::probe::reference(probe.context.base, reference))?;
        let seconds = begun.elapsed().as_secs_f64() / patches.pixels_in_all().max(1) as f64;
        let sources = probe.sources();
        let predictor = Predictor {
            model: ErrorModel::of(sources, &[]),
            measured: Vec::new(),
            bias: Vec::new(),
            rounding: if probe.rounds { ROUNDING } else { 0.0 },
            bounces: probe.context.base.bounces,
            modes: Vec::new(),
            line: None,
            most: probe.goal.and_then(Goal::most),
            doubts: Vec::new(),
            pace: Some(PatchSpeed { samples: reference, seconds }),
            excess: 1.0,
        };
        let mut search = Self { probe, patches, truth, reference, found: Vec::new(), predictor };
        for samples in search.design() {
            search.measure(samples)?;
        }
        search.learn();
        let (bounces, bias) = search.bounces(BIAS * search.in_reach())?;
        (search.predictor.bounces, search.predictor.bias) = (bounces, bias);
        Ok(search)
    }

    /// Tries what would be chosen, until it has been tried.
    pub fn try_likely(&mut self, goal: Goal) -> Result<()> {
        let is_squared = self.predictor.most.is_none();
        for _ in 0..if is_squared { ROUNDS } else { ROUNDS_BY_FIGURE } {
            let mut new = self.untried(self.predictor.to_try(goal));
            if new.is_empty() {
                let between = self.predictor.between();
                new = between.map_or(Vec::new(), |allowed| self.untried(allowed));
            }
            if new.is_empty() {
                break;
            }
            for samples in new {
                self.sharpen(samples)?;
                self.measure(samples)?;
            }
            self.learn();
        }
        Ok(())
    }

    /// The samples that would be chosen if squared errors up to `allowed` were, but for those that were
    /// tried.
    fn untried(&self, allowed: f64) -> Vec<Samples> {
        let mut new: Vec<Samples> = Vec::new();
        for found in likely_of(self.predictor.fastest(&self.probe.range(), allowed)) {
            // Modes may agree on samples, not only neighbours among them.
            if self.predictor.tried(found.samples).is_none() && !new.contains(&found.samples) {
                new.push(found.samples);
            }
        }
        new
    }

    /// Traces the reference again where it is too coarse to hold `samples` against.
    fn sharpen(&mut self, samples: Samples) -> Result<()> {
        if self.reference.spp < 2 * samples.spp || self.reference.shadow < samples.shadow {
            let context = self.probe.context;
            self.reference = samples_of_reference(samples);
            self.truth = self.patches.trace(context, &reference(context.base, self.reference))?;
        }
        Ok(())
    }

    fn measure(&mut self, samples: Samples) -> Result<()> {
        let seen = self.traced(samples)?;
        let errors = squares(&self.patches, &self.truth, &seen);
        let of = |goal| -> Result<Figure> {
            let worst = errors.iter().copied().fold(0.0, f64::max);
            // As the file will have it: FLIP sees steps of 8 bits all over the picture.
            let filed = if self.probe.rounds { rounded(&seen) } else { seen.clone() };
            let figure = figure(goal, &self.patches, &self.truth, &filed)?;
            Ok(Figure { figure, squared_error: worst + self.predictor.rounding })
        };
        let goal = self.probe.goal.filter(|goal| goal.most().is_some());
        let figure = goal.map(of).transpose()?;
        let doubts = doubts(&self.patches, &self.truth, &seen);
        let point = SampleErrors { samples, reference: self.reference, errors };
        self.found.push(Found { point, doubts, figure });
        Ok(())
    }

    /// Fits the model to all that was measured, and puts it through the last.
    fn learn(&mut self) {
        let points: Vec<&SampleErrors> = self.found.iter().map(|found| &found.point).collect();
        let model = ErrorModel::of(self.probe.sources(), &points);
        let measured = |Found { point, doubts, figure }: &Found| {
            // The model tells the reference's part of the difference.
            let own = model.errors(point.samples).zip(model.errors(point.reference));
            let parts = own.map(|(s, r)| s / (s + r).max(1e-12));
            let errors = point.errors.iter().zip(parts).map(|(error, part)| error * part).collect();
            MeasuredSamples {
                samples: point.samples,
                errors,
                doubts: doubts.clone(),
                figure: *figure,
            }
        };
        self.predictor.measured = self.found.iter().map(measured).collect();
        let last = self.found.last();
        self.predictor.doubts = last.map_or(Vec::new(), |last| last.doubts.clone());
        self.predictor.model = last.map_or(model.clone(), |last| model.through(&last.point));
        self.predictor.line = self.predictor.most.and_then(|most| self.line(most));
    }

    /// The line by what came nearest to the figure `most`, through the nearest of it: a share of pixels,
    /// say, cannot go on rising.
    fn line(&self, most: f64) -> Option<PowerLaw> {
        let all =
            self.found.iter().filter_map(|found| found.figure).filter(|found| found.figure > 0.0);
        let mut nearest: Vec<(f64, f64)> =
            all.map(|found| (found.squared_error, found.figure)).collect();
        let off = |found: &(f64, f64)| (found.1 / most).ln().abs();
        nearest.sort_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.truncate(4);
        let line = PowerLaw::through(&nearest)?;
        nearest.first().map(|found| line.shifted_to(*found))
    }

    fn design(&self) -> Vec<Samples> {
        let (base, sources) = (self.probe.context.base, self.probe.sources());
        let all = [(1, 1, 1), (4, 1, 1), (4, 8, 1), (4, 1, 8), (2, 4, 4), (16, 1, 1), (8, 2, 2)];
        let mut design = Vec::new();
        for (spp, shadow, sky) in all {
            let shadow = if sources.shadow { shadow } else { base.shadow_samples };
            let sky = if sources.sky { sky } else { base.sky_samples };
            let samples = Samples { spp, shadow, sky };
            if !design.contains(&samples) {
                design.push(samples);
            }
        }
        design
    }

    /// The patches with the reference's bounces: what samples alone do.
    fn traced(&self, samples: Samples) -> Result<PatchImages> {
        let context = self.probe.context;
        let mut settings = reference(context.base, samples);
        settings.seed = context.base.seed;
        self.patches.trace(context, &settings)
    }

    /// The squared error that the sweep leaves to hope for: what the goal allows. Where its figure alone
    /// decides, what reached that, if anything did; else no less than a quarter of the least, which
    /// goes for a budget too.
    fn in_reach(&self) -> f64 {
        let predictor = &self.predictor;
        if let Some(goal @ Goal::Psnr(_)) = self.probe.goal {
            return predictor.allowed(goal);
        }
        let worst = |found: &Found| found.point.errors.iter().copied().fold(0.0, f64::max);
        let least = BEYOND * self.found.iter().map(worst).fold(f64::INFINITY, f64::min);
        let Some(most) = predictor.most else { return least };
        let reaches = |found: &&Found| found.figure.is_some_and(|f| f.figure <= most);
        let reached = self.found.iter().filter(reaches).map(worst).fold(0.0, f64::max);
        let line = predictor.line.map(|line| line.squared_error(most));
        match reached > 0.0 {
            true => line.unwrap_or(f64::INFINITY).min(reached),
            false => line.unwrap_or(0.0).max(least),
        }
    }

    /// The fewest bounces that miss at most `allowed`, or no more than that beyond what the most miss; and
    /// what they miss in each frame. The same random numbers with more bounces tell.
    fn bounces(&self, allowed: f64) -> Result<(u32, Vec<f64>)> {
        let (probe, base, plan) = (self.probe, self.probe.context.base, self.probe.plan());
        let mut tried = vec![base.bounces];
        if !probe.given.bounces && (plan.mirror || plan.glass) {
            tried.extend(BOUNCES);
            tried.sort_unstable();
            tried.dedup();
        }
        let mut settings = reference(base, Samples { spp: 4, shadow: 1, sky: 1 });
        settings.seed = base.seed;
        settings.bounces = tried.iter().copied().fold(settings.bounces, u32::max);
        let truth = self.patches.trace(probe.context, &settings)?;
        settings.cutoff = base.cutoff;
        let mut all: Vec<(u32, Vec<f64>)> = Vec::new();
        for bounces in tried {
            settings.bounces = bounces;
            let seen = self.patches.trace(probe.context, &settings)?;
            let bias = squares(&self.patches, &truth, &seen);
            if bias.iter().all(|bias| *bias <= allowed) {
                return Ok((bounces, bias));
            }
            all.push((bounces, bias));
        }
        // What the cut-off leaves out no number of them brings.
        let most = all.last().map_or(Vec::new(), |(_, bias)| bias.clone());
        let is_as_good = |bias: &[f64]| bias.iter().zip(&most).all(|(b, m)| *b <= m + allowed);
        let found = all.into_iter().find(|(_, bias)| is_as_good(bias));
        Ok(found.unwrap_or((base.bounces, most)))
    }
}
