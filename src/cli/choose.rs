//! `render --target` and `--budget`: settings that the program chooses for a scene.

mod budget;
mod choice;
mod folder;
mod judge;

pub use choice::{Choice, asks_for_choice};

use super::args::SettingArgs;
use super::request::Request;
use super::{say, spelled, values};
use crate::accuracy::{
    FixedSettings, Goal, Prediction, Predictor, SettingsProbe, Timer, TrialContext,
};
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::output::Format;
use crate::output::manifest::Header;
use crate::page::words::seconds;
use crate::scene::Policy;
use budget::Budget;
use clap::Args;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// The choice aims at this share of the squared error that the target allows: some frames may be worse than
/// those that the probe measured, and after a miss the job is rendered once more.
const AIM: f64 = 0.9;

/// Settings that the program chooses.
#[derive(Debug, Default, Clone, Args)]
#[command(next_help_heading = "Choice")]
pub struct ChoiceArgs {
    /// Choose the fastest samples, bounces and reuse predicted to make every frame this good: psnr=DB,
    /// ssim=S, flip=F or max-share=P% (pixels off by more than 2/255); options that are given stay
    #[arg(long, value_name = "FIGURE=VALUE", value_parser = values::goal, conflicts_with = "budget")]
    pub target: Option<Goal>,
    /// Choose the most accurate ones predicted to fit this time: 90s, 10m, 1h30m
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = values::budget)]
    pub budget: Option<Duration>,
}

/// What to do after a check of the finished frames.
#[derive(Serialize, Deserialize)]
pub enum Judgement {
    /// Render all frames again with this tighter choice.
    Again(Choice),
    /// Nothing: the choice with the check's result.
    Done(Choice),
}

/// Everything that a choice of settings needs.
pub struct Chooser<'a> {
    /// The target or budget.
    pub args: &'a ChoiceArgs,
    /// The options that the user gave.
    pub options: &'a SettingArgs,
    /// The scene and everything needed to render it.
    pub context: &'a TrialContext<'a>,
    /// The job.
    pub request: &'a Request,
    /// Description of the intersector, as far as frames depend on it.
    pub tracer: &'a str,
    /// When the program started: a budget counts from then.
    pub started: Instant,
    /// Number of ranks that share the job.
    pub ranks: u32,
    /// Whether messages are suppressed.
    pub quiet: bool,
}

impl ChoiceArgs {
    /// Whether the program is to choose settings.
    pub fn is_any(&self) -> bool {
        self.target.is_some() || self.budget.is_some()
    }

    /// Refuses options whose effect cannot be predicted.
    pub fn check(&self, request: &Request) -> Result<()> {
        let settings = &request.settings;
        let obstacle = match () {
            () if !self.is_any() => None,
            () if settings.crop.is_some() => Some("--crop"),
            () if settings.most_spp.is_some() => Some("--spp MIN..MAX"),
            () if settings.least_shadow_samples.is_some() => Some("--shadow-samples MIN..MAX"),
            () if settings.least_sky_samples.is_some() => Some("--sky-samples MIN..MAX"),
            () if settings.reuse.policy == Policy::Colour => Some("--policy colour"),
            () if !request.references.is_empty() => Some("--references"),
            () if request.options.maps && settings.reuse.policy == Policy::Off => {
                Some("--policy off")
            }
            () => None,
        };
        if let Some(goal) = self.target.filter(|goal| goal.is_beyond_8_bits() && rounds(request)) {
            let most = Goal::most_of_8_bits();
            return Err(Error::Usage(format!(
                "{goal} cannot be reached by frames of 8 bits, whose rounding limits them to {most:.1} dB\n  \
                 help: ask for less, or for png files of 16 bits (--png-bits 16) or exr"
            )));
        }
        obstacle.map_or(Ok(()), |option| {
            Err(Error::Usage(format!(
                "the effect of {option} is not predicted, so it cannot be used with --target or --budget"
            )))
        })
    }

    fn words(&self) -> String {
        match (self.target, self.budget) {
            (Some(goal), _) => goal.to_string(),
            (_, Some(budget)) => values::time_in_words(budget),
            _ => String::new(),
        }
    }
}

/// Whether frames are rounded to 8 bits.
fn rounds(request: &Request) -> bool {
    request.pattern.format() != Format::Exr && request.settings.png_bits == 8
}

/// `41.3 dB`
fn decibels(psnr: f64) -> String {
    if psnr.is_finite() { format!("{psnr:.1} dB") } else { "∞ dB".into() }
}

impl Chooser<'_> {
    /// The manifest's choice, if it was made for the same target or budget and settings; else a new one.
    ///
    /// # Errors
    /// Errors of the probe; a target that no setting is predicted to reach.
    pub fn choose(&self, timer: Timer) -> Result<Choice> {
        if let Some(before) = self.before() {
            let options = self.options(&before.predicted);
            self.tell(format!("for {}, as chosen before: {options}", before.wanted));
            self.warn_if_long(&before);
            return Ok(before);
        }
        self.check_folder()?;
        let start = Instant::now();
        let budget = Budget::of(self);
        let probe =
            SettingsProbe { seconds: budget.as_ref().map(Budget::probe_seconds), ..self.probe() };
        let (mut predictor, found) =
            probe.look(AIM, &|what| self.tell(format!("probe: {what}")))?;
        let found = match &budget {
            None => probe.fastest(found, timer)?,
            Some(budget) => probe.best_within(&predictor, &|| budget.left(), timer)?,
        };
        let predicted = found.ok_or_else(|| self.out_of_reach(&predictor))?;
        if budget.is_none() {
            predictor.correct_error(&predicted);
        }
        let writing = budget.as_ref().map_or(0.0, |budget| budget.writing);
        let all = predicted.seconds * probe.frames_each(predicted.reuse) + writing;
        let left = budget.as_ref().map(|b| b.left() + writing);
        let choice = Choice {
            wanted: self.args.words(),
            base: Header::settings(self.context.base),
            given: self.given(),
            predicted,
            predictor,
            seconds: all,
            tightened: 0,
            checked: None,
            came_out: None,
            verdict: None,
        };
        self.say_choice(&choice);
        self.tell(format!("the probe took {}", seconds(start.elapsed().as_secs_f64())));
        if left.is_some_and(|left| all > left) {
            self.warn("no setting is predicted to fit this time; the fastest is taken".into());
        }
        Ok(choice)
    }

    /// The error where no setting is found that reaches the target.
    fn out_of_reach(&self, predictor: &Predictor) -> Error {
        let best = predictor.best_within(&self.probe().range(), &|_| true).map(|best| {
            let took = seconds(best.seconds * self.probe().frames_each(best.reuse));
            let psnr = decibels(best.psnr());
            format!(
                "; the nearest, {}, is predicted to reach {psnr} in {took}",
                self.options(&best)
            )
        });
        let nearest = best.unwrap_or_default();
        let fewer = match self.given() == FixedSettings::default() {
            true => "",
            false => ", or give fewer options",
        };
        Error::Usage(format!(
            "no setting is predicted to reach {}{nearest}\n  help: ask for less{fewer}",
            self.args.words()
        ))
    }

    fn before(&self) -> Option<Choice> {
        let before = Choice::of(&self.request.header_before(self.tracer)?)?;
        let is_same = before.wanted == self.args.words()
            && before.base == Header::settings(self.context.base)
            && before.given == self.given();
        is_same.then_some(before)
    }

    fn given(&self) -> FixedSettings {
        let s = self.options;
        FixedSettings {
            spp: s.spp.is_some(),
            shadow: s.shadow_samples.is_some(),
            sky: s.sky_samples.is_some(),
            bounces: s.bounces.is_some(),
            policy: s.reuse.policy.is_some() || self.request.needs_reuse(),
        }
    }

    fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.context.scene, self.context.base)
    }

    /// Command-line options of `predicted` that have an effect in the scene.
    fn options(&self, predicted: &Prediction) -> String {
        spelled::options(&predicted.settings(self.context.base), &self.plan())
    }

    /// A probe for this job.
    pub fn probe(&self) -> SettingsProbe<'_> {
        SettingsProbe {
            context: self.context,
            frames: self.request.frames,
            goal: self.args.target,
            given: self.given(),
            rounds: rounds(self.request),
            seconds: None,
            ranks: self.ranks,
        }
    }

    fn say_choice(&self, choice: &Choice) {
        self.tell(format!(
            "for {}: {}\npredicted: {}",
            choice.wanted,
            self.options(&choice.predicted),
            choice.prediction_in_words()
        ));
    }

    fn tell(&self, text: String) {
        if !self.quiet {
            say::aside(text);
        }
    }

    fn warn(&self, text: String) {
        if !self.quiet {
            say::warning(text);
        }
    }
}
