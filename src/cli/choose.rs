//! `render --target` and `--budget`: settings that the program chooses for a scene.

mod budget;
mod choice;
mod folder;
mod judge;

use super::args::SettingArgs;
use super::request::Request;
use super::{say, spelled, values};
use crate::accuracy::{FixedSettings, Goal, Prediction, Predictor, SettingsProbe, Stage, Timer};
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

pub use choice::{Choice, asks_for_choice};

/// Share of the job that a probe for a target takes: what it saves is to be more.
const PROBE_SHARE: f64 = 0.1;
/// Shares of the allowed squared error that a choice aims at after a brief and after a longer look: what some
/// frames showed is off in others, and a miss costs the job once more.
const BRIEFLY: f64 = 0.7;
/// See [`BRIEFLY`].
const LONGER: f64 = 0.85;

/// Settings that the program chooses.
#[derive(Debug, Default, Clone, Args)]
#[command(next_help_heading = "Choice")]
pub struct ChoiceArgs {
    /// Choose the fastest samples, bounces and reuse foretold to make every frame this good: psnr=DB,
    /// ssim=S, flip=F or max-share=P% (pixels off by more than 2/255); options that are given stay
    #[arg(long, value_name = "FIGURE=VALUE", value_parser = values::goal, conflicts_with = "budget")]
    pub target: Option<Goal>,
    /// Choose the most accurate ones foretold to fit this time: 90s, 10m, 1h30m
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = values::budget)]
    pub budget: Option<Duration>,
}

/// What is to be done once frames were held against what was wanted.
#[derive(Serialize, Deserialize)]
pub enum Judgement {
    /// All frames are rendered again, under a tighter choice.
    Again(Choice),
    /// Nothing: the choice with what came of it.
    Done(Choice),
}

/// Who chooses.
pub struct Chooser<'a> {
    /// What is wanted.
    pub args: &'a ChoiceArgs,
    /// What the user set already.
    pub options: &'a SettingArgs,
    /// The scene and all that renders it.
    pub stage: &'a Stage<'a>,
    /// The job.
    pub request: &'a Request,
    /// What traces, as far as frames differ by it.
    pub tracer: &'a str,
    /// When the program started: a budget counts from then.
    pub started: Instant,
    /// How many ranks share it.
    pub ranks: u32,
    /// Whether nothing is said.
    pub quiet: bool,
}

impl ChoiceArgs {
    /// Whether anything is to be chosen.
    pub fn is_any(&self) -> bool {
        self.target.is_some() || self.budget.is_some()
    }

    /// Refuses what cannot be foretold.
    pub fn check(&self, request: &Request) -> Result<()> {
        let settings = &request.settings;
        let obstacle = match () {
            () if !self.is_any() => None,
            () if settings.crop.is_some() => Some("--crop"),
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
                "{goal} is out of reach of frames of 8 bits, which hold {most:.1} dB at most\n  \
                 help: ask for less, or for png files of 16 bits (--png-bits 16) or exr"
            )));
        }
        obstacle.map_or(Ok(()), |option| {
            Err(Error::Usage(format!(
                "what {option} does is not foretold, so --target and --budget cannot go with it"
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
    /// The choice that the manifest holds, if it answers the same question; else a new one.
    ///
    /// # Errors
    /// Any of the probe's; a target that no setting is predicted to reach.
    pub fn choose(&self, timer: Timer) -> Result<Choice> {
        if let Some(before) = self.before() {
            let options = self.options(&before.foretold);
            self.tell(format!("for {}, as chosen before: {options}", before.wanted));
            self.warn_if_long(&before);
            return Ok(before);
        }
        self.check_folder()?;
        let start = Instant::now();
        let budget = Budget::of(self);
        let probe =
            SettingsProbe { seconds: budget.as_ref().map(Budget::probe_seconds), ..self.probe() };
        let (foretelling, aim) = match self.args.target {
            Some(goal) => self.look(goal).map(|(found, aim)| (found, Some(aim)))?,
            None => (probe.look(&|what| self.tell(format!("probe: {what}")))?, None),
        };
        let allowed = self.args.target.map(|goal| foretelling.allowed(goal));
        let aimed = |aim| probe.fastest(&foretelling, aim, timer);
        let found = match (aim, &budget) {
            // What is just within reach leaves no room to aim at more.
            (Some(aim), _) => match aimed(aim)? {
                None => allowed.map_or(Ok(None), aimed)?,
                found => found,
            },
            (_, Some(budget)) => {
                let left = |samples| budget.left(&foretelling, samples);
                probe.best_within(&foretelling, &left, timer)?
            }
            _ => None,
        };
        let foretold = found.ok_or_else(|| self.out_of_reach(&foretelling))?;
        let writing = budget.as_ref().map_or(0.0, |budget| budget.writing);
        let all = foretold.seconds * probe.frames_each(foretold.reuse) + writing;
        let left = budget.as_ref().map(|b| b.left(&foretelling, foretold.samples) + writing);
        let choice = Choice {
            wanted: self.args.words(),
            base: Header::settings(self.stage.base),
            given: self.given(),
            allowed,
            foretold,
            foretelling,
            seconds: all,
            tightened: 0,
            checked: None,
            came_out: None,
            verdict: None,
        };
        self.say_choice(&choice);
        self.tell(format!("the probe took {}", seconds(start.elapsed().as_secs_f64())));
        if left.is_some_and(|left| all > left) {
            self.warn("no setting is foretold to fit this time; the fastest is taken".into());
        }
        Ok(choice)
    }

    /// Looks at the scene for about as long as `PROBE_SHARE` of the job that `goal` makes: briefly at first, and
    /// again where that leaves time for much more. With the squared error to aim at.
    fn look(&self, goal: Goal) -> Result<(Predictor, f64)> {
        let begun = Instant::now();
        let told = |what: &str| self.tell(format!("probe: {what}"));
        let brief = SettingsProbe { seconds: Some(0.0), ..self.probe() };
        let first = brief.look(&told)?;
        let (aim, spent) = (first.aim(goal, BRIEFLY), begun.elapsed().as_secs_f64());
        let within = |error| brief.fastest_seconds(&first, error);
        let job = within(aim).or_else(|| within(first.allowed(goal)));
        let left = job.map(|job| PROBE_SHARE * job - spent);
        if left.is_some_and(|left| left < spent) {
            return Ok((first, aim));
        }
        self.tell("there is time for a longer look".into());
        let foretelling = SettingsProbe { seconds: left, ..self.probe() }.look(&told)?;
        let aim = foretelling.aim(goal, LONGER);
        Ok((foretelling, aim))
    }

    /// What to say where no setting will do.
    fn out_of_reach(&self, foretelling: &Predictor) -> Error {
        let best = foretelling.best(&self.probe().range()).map(|best| {
            let took = seconds(best.seconds * self.probe().frames_each(best.reuse));
            let psnr = decibels(best.psnr());
            format!("; {} would come to {psnr}, in {took}", self.options(&best))
        });
        // A figure that goes with no error for sure: what was seen of it.
        let seen = foretelling.nearest().map(|(tried, figure)| {
            let in_words = |goal: Goal| goal.in_words(figure);
            let figure = self.args.target.and_then(in_words).unwrap_or_default();
            let tried = spelled::samples(tried.spp, tried.shadow, tried.sky, &self.plan());
            format!("; of what was tried, {tried} came nearest, to {figure}")
        });
        let nearest = seen.or(best).unwrap_or_default();
        let fewer = match self.given() == FixedSettings::default() {
            true => "",
            false => ", or give fewer options",
        };
        Error::Usage(format!(
            "no setting is foretold to reach {}{nearest}\n  help: ask for less{fewer}",
            self.args.words()
        ))
    }

    fn before(&self) -> Option<Choice> {
        let before = Choice::of(&self.request.header_before(self.tracer)?)?;
        let is_same = before.wanted == self.args.words()
            && before.base == Header::settings(self.stage.base)
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
            policy: s.reuse.policy.is_some() || self.request.options.maps,
        }
    }

    fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.stage.scene, self.stage.base)
    }

    /// The options that stand for what was chosen, as far as they have a part in the scene.
    fn options(&self, foretold: &Prediction) -> String {
        spelled::options(&foretold.settings(self.stage.base), &self.plan())
    }

    /// Who looks at the scene for this job.
    pub fn probe(&self) -> SettingsProbe<'_> {
        SettingsProbe {
            stage: self.stage,
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
            "for {}: {}\nforetold: {}",
            choice.wanted,
            self.options(&choice.foretold),
            choice.foretold_in_words()
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
