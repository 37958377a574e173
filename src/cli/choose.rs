//! `render --target` and `--budget`: settings that the program chooses for a scene.

mod budget;
mod folder;
mod judge;

use super::args::SettingArgs;
use super::request::Request;
use super::{say, spelled, values};
use crate::accuracy::{
    GivenOptions, Goal, Prediction, Predictor, Probe, Timer, TrialContext, Verdict,
};
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::output::Format;
use crate::output::manifest::Header;
use crate::page::words::seconds;
use crate::scene::{FrameRange, Policy, Settings};
use budget::Budget;
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::time::{Duration, Instant};

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
    /// Choose the fastest samples, bounces and reuse predicted to make every frame this good: psnr=DB,
    /// ssim=S, flip=F or max-share=P% (pixels off by more than 2/255); options that are given stay
    #[arg(long, value_name = "FIGURE=VALUE", value_parser = values::goal, conflicts_with = "budget")]
    pub target: Option<Goal>,
    /// Choose the most accurate ones predicted to fit this time: 90s, 10m, 1h30m
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = values::budget)]
    pub budget: Option<Duration>,
}

/// What was chosen and why; the manifest keeps it, so that a job that goes on chooses nothing anew.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Choice {
    /// What was wanted, in words.
    pub wanted: String,
    /// The settings before, and which of them the user gave.
    base: Value,
    given: GivenOptions,
    /// The squared error that the target allows, display steps.
    allowed: Option<f64>,
    /// What is predicted of the choice.
    pub predicted: Prediction,
    /// All that the probe found out.
    predictor: Predictor,
    /// Wall seconds that rendering and writing all frames is predicted to take.
    seconds: f64,
    /// How often it was tightened.
    pub tightened: u32,
    /// What was held against what came out: the shot's hash, and frames of it.
    checked: Option<(String, FrameRange)>,
    /// How good these came out, in words, if they were looked at.
    #[serde(default)]
    pub came_out: Option<String>,
    /// What came of the target then.
    #[serde(default)]
    verdict: Option<Verdict>,
}

/// What is to be done once frames were held against what was wanted.
#[derive(Serialize, Deserialize)]
pub enum Judged {
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
    pub context: &'a TrialContext<'a>,
    /// The job.
    pub request: &'a Request,
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

    /// Refuses what cannot be predicted.
    pub fn check(&self, request: &Request) -> Result<()> {
        let settings = &request.settings;
        let obstacle = match () {
            () if !self.is_any() => None,
            () if settings.crop.is_some() => Some("--crop"),
            () if settings.reuse.policy == Policy::Colour => Some("--policy colour"),
            () if !request.references.is_empty() => Some("--references"),
            () if request.maps && settings.reuse.policy == Policy::Off => Some("--policy off"),
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
                "what {option} does is not predicted, so --target and --budget cannot go with it"
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

impl Choice {
    /// The settings that were chosen over `base`.
    pub fn settings(&self, base: &Settings) -> Settings {
        self.predicted.settings(base)
    }

    /// As the manifest keeps it.
    pub fn value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// Whether `frames` of the shot of this hash were held against what came out.
    pub fn is_checked(&self, shot: &str, frames: FrameRange) -> bool {
        let holds = |seen: &FrameRange| seen.first <= frames.first && frames.last <= seen.last;
        self.checked.as_ref().is_some_and(|(hash, seen)| hash == shot && holds(seen))
    }

    /// The choice whose `frames` were.
    pub fn checked(self, shot: &str, frames: FrameRange) -> Self {
        Self { checked: Some((shot.into(), frames)), ..self }
    }

    /// The choice that a manifest's header holds, if this version can read it.
    pub fn of(header: &Header) -> Option<Self> {
        serde_json::from_value(header.chosen.clone()?).ok()
    }

    /// What came of the target, if there was one and it was looked at.
    pub fn verdict(&self) -> Option<String> {
        let came = match self.verdict? {
            Verdict::Reached => "reached",
            Verdict::Open => "not told apart from the target by so few pixels",
            Verdict::Missed => "missed",
        };
        Some(format!("{}: {came}", self.wanted))
    }

    /// All options that stand for it, whether they have a part in the scene or not.
    pub fn options(&self) -> String {
        spelled::options(&self.predicted.settings(&Settings::default()), &EffectPlan::EVERYTHING)
    }

    /// The command that gives the same frames whatever the clock says: what was chosen in place of the
    /// wish. Options that are given stay.
    pub fn spelled_out(&self, command: &[String]) -> Vec<String> {
        let options = self.options();
        let options: Vec<&str> = options.split(' ').collect();
        let is_given = |name: &str| command.iter().any(|word| is_option(word, name));
        let chosen = options.chunks(2).filter(|pair| !is_given(pair[0])).flatten();
        let mut words = Vec::new();
        let mut left = command.iter();
        while let Some(word) = left.next() {
            if !is_wish(word) {
                words.push(word.clone());
                continue;
            }
            words.extend(chosen.clone().map(ToString::to_string));
            if !word.contains('=') {
                left.next();
            }
        }
        words
    }

    /// What is predicted of it, in words.
    pub fn prediction_in_words(&self) -> String {
        format!(
            "{}PSNR {} in the worst frame, {} a frame, {} in all",
            self.figure().map_or(String::new(), |figure| format!("{figure}, ")),
            decibels(self.predicted.psnr()),
            seconds(self.predicted.seconds),
            seconds(self.seconds)
        )
    }

    /// What is predicted of it in the target's own unit, unless that is PSNR.
    fn figure(&self) -> Option<String> {
        let figure = self.predictor.predicted_figure(&self.predicted)?;
        values::goal(&self.wanted).ok()?.in_words(figure)
    }
}

/// Whether a command leaves settings to the program.
pub fn asks_for_choice(command: &[String]) -> bool {
    command.iter().any(|word| is_wish(word))
}

fn is_wish(word: &str) -> bool {
    is_option(word, "--target") || is_option(word, "--budget")
}

/// Whether a word of a command is the option `name`, with its value or before it.
fn is_option(word: &str, name: &str) -> bool {
    word.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('='))
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
    pub fn choose(&self, tracer: &str, timer: Timer) -> Result<Choice> {
        if let Some(before) = self.before(tracer) {
            let options = self.options(&before.predicted);
            self.tell(format!("for {}, as chosen before: {options}", before.wanted));
            self.warn_if_long(&before);
            return Ok(before);
        }
        self.check_folder(tracer)?;
        let start = Instant::now();
        let budget = Budget::of(self);
        let probe = Probe { seconds: budget.as_ref().map(Budget::probe_seconds), ..self.probe() };
        let (predictor, aim) = match self.args.target {
            Some(goal) => self.look(goal).map(|(found, aim)| (found, Some(aim)))?,
            None => (probe.look(&|what| self.tell(format!("probe: {what}")))?, None),
        };
        let allowed = self.args.target.map(|goal| predictor.allowed(goal));
        let aimed = |aim| probe.fastest(&predictor, aim, timer);
        let found = match (aim, &budget) {
            // What is just within reach leaves no room to aim at more.
            (Some(aim), _) => match aimed(aim)? {
                None => allowed.map_or(Ok(None), aimed)?,
                found => found,
            },
            (_, Some(budget)) => {
                let left = |samples| budget.left(&predictor, samples);
                probe.best_within(&predictor, &left, timer)?
            }
            _ => None,
        };
        let predicted = found.ok_or_else(|| self.out_of_reach(&predictor))?;
        let writing = budget.as_ref().map_or(0.0, |budget| budget.writing);
        let all = predicted.seconds * probe.frames_each(predicted.reuse) + writing;
        let left = budget.as_ref().map(|b| b.left(&predictor, predicted.samples) + writing);
        let choice = Choice {
            wanted: self.args.words(),
            base: Header::settings(self.context.base),
            given: self.given(),
            allowed,
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

    /// Looks at the scene for about as long as `PROBE_SHARE` of the job that `goal` makes: briefly at first, and
    /// again where that leaves time for much more. With the squared error to aim at.
    fn look(&self, goal: Goal) -> Result<(Predictor, f64)> {
        let begun = Instant::now();
        let told = |what: &str| self.tell(format!("probe: {what}"));
        let brief = Probe { seconds: Some(0.0), ..self.probe() };
        let first = brief.look(&told)?;
        let (aim, spent) = (first.aim(goal, BRIEFLY), begun.elapsed().as_secs_f64());
        let within = |error| brief.fastest_seconds(&first, error);
        let job = within(aim).or_else(|| within(first.allowed(goal)));
        let left = job.map(|job| PROBE_SHARE * job - spent);
        if left.is_some_and(|left| left < spent) {
            return Ok((first, aim));
        }
        self.tell("there is time for a longer look".into());
        let predictor = Probe { seconds: left, ..self.probe() }.look(&told)?;
        let aim = predictor.aim(goal, LONGER);
        Ok((predictor, aim))
    }

    /// What to say where no setting will do.
    fn out_of_reach(&self, predictor: &Predictor) -> Error {
        let best = predictor.best(&self.probe().range()).map(|best| {
            let took = seconds(best.seconds * self.probe().frames_each(best.reuse));
            let psnr = decibels(best.psnr());
            format!("; {} would come to {psnr}, in {took}", self.options(&best))
        });
        // A figure that goes with no error for sure: what was seen of it.
        let seen = predictor.nearest().map(|(tried, figure)| {
            let in_words = |goal: Goal| goal.in_words(figure);
            let figure = self.args.target.and_then(in_words).unwrap_or_default();
            let tried = spelled::samples(tried.spp, tried.shadow, tried.sky, &self.plan());
            format!("; of what was tried, {tried} came nearest, to {figure}")
        });
        let nearest = seen.or(best).unwrap_or_default();
        let fewer = match self.given() == GivenOptions::default() {
            true => "",
            false => ", or give fewer options",
        };
        Error::Usage(format!(
            "no setting is predicted to reach {}{nearest}\n  help: ask for less{fewer}",
            self.args.words()
        ))
    }

    fn before(&self, tracer: &str) -> Option<Choice> {
        let before = Choice::of(&self.request.header_before(tracer)?)?;
        let is_same = before.wanted == self.args.words()
            && before.base == Header::settings(self.context.base)
            && before.given == self.given();
        is_same.then_some(before)
    }

    fn given(&self) -> GivenOptions {
        let s = self.options;
        GivenOptions {
            spp: s.spp.is_some(),
            shadow: s.shadow_samples.is_some(),
            sky: s.sky_samples.is_some(),
            bounces: s.bounces.is_some(),
            policy: s.reuse.policy.is_some() || self.request.maps,
        }
    }

    fn plan(&self) -> EffectPlan {
        EffectPlan::of(self.context.scene, self.context.base)
    }

    /// The options that stand for what was chosen, as far as they have a part in the scene.
    fn options(&self, predicted: &Prediction) -> String {
        spelled::options(&predicted.settings(self.context.base), &self.plan())
    }

    /// Who looks at the scene for this job.
    pub fn probe(&self) -> Probe<'_> {
        Probe {
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
