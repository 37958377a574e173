//! `render --target` and `--budget`: settings that the program chooses for a scene, and what came of
//! them.

use super::args::SettingArgs;
use super::progress::duration;
use super::request::Request;
use super::{say, values};
use crate::accuracy::{Check, Foretelling, Foretold, Given, Goal, Probe, Stage};
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::output::manifest::{AuditRow, Header};
use crate::output::{Display, Format, read_image};
use crate::scene::{Policy, Settings};
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::time::{Duration, Instant};

/// How often a target that was missed is tightened.
const ROUNDS: u32 = 2;
/// Kept back of a budget: for writing frames and the check, and for what is foretold too short.
const RESERVE: f64 = 0.08;

/// Settings that the program chooses.
#[derive(Debug, Default, Clone, Args)]
#[command(next_help_heading = "Choice")]
pub struct ChoiceArgs {
    /// Choose the fastest samples, bounces and reuse foretold to make every frame this good: psnr=DB,
    /// ssim=S, flip=F or max-share=P% (pixels off by more than 2/255); options that are given stay
    #[arg(long, value_name = "FIGURE=VALUE", value_parser = values::goal, conflicts_with = "budget")]
    pub target: Option<Goal>,
    /// Choose the most accurate ones foretold to fit this time: 90s, 10m, 1h30m
    #[arg(long, value_name = "TIME", value_parser = values::time)]
    pub budget: Option<Duration>,
}

/// What was chosen and why; the manifest keeps it, so that a job that goes on chooses nothing anew.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Choice {
    /// What was wanted, in words.
    pub wanted: String,
    /// The settings before, and which of them the user gave.
    base: Value,
    given: Given,
    /// The squared error that the target allows, display steps.
    allowed: Option<f64>,
    /// What is foretold of the choice.
    pub foretold: Foretold,
    /// All that the probe found out.
    foretelling: Foretelling,
    /// How often it was tightened.
    pub tightened: u32,
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
            () if request.maps && settings.reuse.policy == Policy::Off => Some("--policy off"),
            () => None,
        };
        obstacle.map_or(Ok(()), |option| {
            Err(Error::Usage(format!(
                "what {option} does is not foretold, so --target and --budget cannot go with it"
            )))
        })
    }

    fn words(&self) -> String {
        match (self.target, self.budget) {
            (Some(goal), _) => goal.to_string(),
            (_, Some(budget)) => format!("{} s", budget.as_secs()),
            _ => String::new(),
        }
    }
}

impl Choice {
    /// The settings that were chosen over `base`.
    pub fn settings(&self, base: &Settings) -> Settings {
        self.foretold.settings(base)
    }

    /// As the manifest keeps it.
    pub fn value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    fn options(&self) -> String {
        options(&self.foretold)
    }
}

/// The options that stand for a choice.
fn options(foretold: &Foretold) -> String {
    let Foretold { samples, bounces, reuse, .. } = foretold;
    let reuse = match reuse.policy {
        Policy::Off => "--policy off".into(),
        _ => format!("--policy surface --tolerance {}", reuse.tolerance),
    };
    format!(
        "--spp {} --shadow-samples {} --sky-samples {} --bounces {bounces} {reuse}",
        samples.spp, samples.shadow, samples.sky
    )
}

impl Chooser<'_> {
    /// The choice that the manifest holds, if it answers the same question; else a new one.
    ///
    /// # Errors
    /// Those of the probe; a target that nothing is foretold to reach.
    pub fn choose(&self, started: Instant, tracer: &str) -> Result<Choice> {
        if let Some(before) = self.before(tracer) {
            self.tell(format!("for {}, as chosen before: {}", before.wanted, before.options()));
            return Ok(before);
        }
        let start = Instant::now();
        let probe = self.probe();
        let foretelling = probe.look(&|what| self.tell(format!("probe: {what}")))?;
        let allowed = self.args.target.map(|goal| foretelling.allowed(goal));
        let foretold = match allowed {
            Some(allowed) => {
                let found = probe.fastest(&foretelling, allowed)?;
                found.ok_or_else(|| self.out_of_reach(&foretelling))?
            }
            None => {
                let left = self.budget() - started.elapsed().as_secs_f64();
                let each = (1.0 - RESERVE) * left.max(0.0) / self.frames();
                let found = probe.best_within(&foretelling, each)?;
                found.ok_or_else(|| self.out_of_reach(&foretelling))?
            }
        };
        let choice = Choice {
            wanted: self.args.words(),
            base: Header::settings(self.stage.base),
            given: self.given(),
            allowed,
            foretold,
            foretelling,
            tightened: 0,
        };
        self.say_choice(&choice);
        self.tell(format!("the probe took {}", duration(start.elapsed().as_secs_f64())));
        if self.args.budget.is_some() && choice.foretold.seconds * self.frames() > self.budget() {
            self.warn("no setting is foretold to fit this time; the fastest is taken".into());
        }
        Ok(choice)
    }

    /// What to say where no setting will do.
    fn out_of_reach(&self, foretelling: &Foretelling) -> Error {
        let best = foretelling.best(&self.probe().range());
        let nearest = best.map_or(String::new(), |best| {
            let seconds = duration(best.seconds * self.frames());
            format!("; {} would come to {:.1} dB, in {seconds}", options(&best), best.psnr())
        });
        let bits = match self.rounds() {
            true => ", --png-bits 16 (8 bits hold 58.9 dB at most)",
            false => "",
        };
        Error::Usage(format!(
            "no setting is foretold to reach {}{nearest}\n  \
             help: ask for less, or give fewer options{bits}",
            self.args.words()
        ))
    }

    /// Says what came out; a tighter choice where the target was missed.
    ///
    /// # Errors
    /// Those of reading frames and tracing.
    pub fn judge(
        &self,
        choice: &Choice,
        audit: Option<&AuditRow>,
        rendered: Option<f64>,
    ) -> Result<Option<Choice>> {
        let samples = choice.foretold.samples;
        let check = Check::of(&self.probe(), samples, &|frame| self.image(frame))?;
        let [mean, worst] = check.psnr();
        let looked = check.frames.len();
        let figure = match self.args.target {
            Some(Goal::Ssim(_)) => format!(", SSIM {:.4} in the worst", 1.0 - check.figure),
            Some(Goal::Flip(_)) => format!(", FLIP {:.4} in the worst", check.figure),
            Some(Goal::MaxShare(_)) => {
                format!(", share {:.3} % in the worst", 100.0 * check.figure)
            }
            _ => String::new(),
        };
        let time = rendered.map_or(String::new(), |seconds| {
            let foretold = choice.foretold.seconds * self.frames();
            let off = 100.0 * (foretold / seconds - 1.0);
            format!("; {}, foretold {} ({off:+.0} %)", duration(seconds), duration(foretold))
        });
        self.tell(format!(
            "came out: PSNR {mean:.1} dB, {worst:.1} in the worst of {looked} frames looked \
             at{figure}; foretold {:.1} at worst{time}",
            choice.foretold.psnr()
        ));
        let (Some(goal), Some(allowed)) = (self.args.target, choice.allowed) else {
            return Ok(None);
        };
        let excess = check.excess(goal, allowed).max(audited_excess(audit, allowed));
        if excess <= 1.0 {
            return Ok(None);
        }
        if choice.tightened >= ROUNDS {
            self.warn(format!("{} was missed, and is not tightened again", choice.wanted));
            return Ok(None);
        }
        // So much more than foretold.
        self.tighter(choice, allowed, excess * allowed / choice.foretold.squared_error.max(1e-9))
    }

    /// The choice with errors `factor` times as large as foretold.
    fn tighter(&self, choice: &Choice, allowed: f64, factor: f64) -> Result<Option<Choice>> {
        // A tenth beyond what was seen, lest the next round misses by a hair; and never looser.
        let foretelling = choice.foretelling.worse(1.1 * f64::max(1.0, factor));
        let found = self.probe().fastest(&foretelling, allowed)?;
        let foretold = match found {
            Some(foretold) if foretold.samples != choice.foretold.samples => foretold,
            _ => {
                self.warn(format!("{} was missed, and nothing is tighter", choice.wanted));
                return Ok(None);
            }
        };
        let tightened = choice.tightened + 1;
        let tighter = Choice { foretold, foretelling, tightened, ..choice.clone() };
        self.warn(format!("{} was missed; rendered again, tightened", choice.wanted));
        self.say_choice(&tighter);
        Ok(Some(tighter))
    }

    fn before(&self, tracer: &str) -> Option<Choice> {
        let value = self.request.header_before(tracer)?.chosen?;
        let before: Choice = serde_json::from_value(value).ok()?;
        let is_same = before.wanted == self.args.words()
            && before.base == Header::settings(self.stage.base)
            && before.given == self.given();
        is_same.then_some(before)
    }

    fn given(&self) -> Given {
        let s = self.options;
        Given {
            spp: s.spp.is_some(),
            shadow: s.shadow_samples.is_some(),
            sky: s.sky_samples.is_some(),
            bounces: s.bounces.is_some(),
            policy: s.reuse.policy.is_some() || self.request.maps,
        }
    }

    /// Whether frames are rounded to 8 bits.
    fn rounds(&self) -> bool {
        self.request.pattern.format() != Format::Exr && self.stage.base.png_bits == 8
    }

    fn probe(&self) -> Probe<'_> {
        Probe {
            stage: self.stage,
            frames: self.request.frames,
            goal: self.args.target,
            given: self.given(),
            rounds: self.rounds(),
        }
    }

    /// Seconds.
    fn budget(&self) -> f64 {
        self.args.budget.unwrap_or_default().as_secs_f64()
    }

    /// A finished frame as displayed.
    fn image(&self, frame: u32) -> Result<Image> {
        let mut image = read_image(self.request.pattern.path(frame))?;
        if image.encoding == Encoding::Linear {
            let Settings { exposure, tone, .. } = *self.stage.base;
            let display = Display { exposure, tone };
            for rgb in &mut image.rgb {
                *rgb = crate::math::Rgb::from_array(display.code(*rgb).map(|v| v as f32));
            }
            image.encoding = Encoding::Srgb;
        }
        Ok(image)
    }

    /// Frames that one rank renders, those among them that others are inferred from.
    fn frames(&self) -> f64 {
        f64::from(self.probe().made_frames().div_ceil(self.ranks))
    }

    fn say_choice(&self, choice: &Choice) {
        let seconds = choice.foretold.seconds;
        self.tell(format!(
            "for {}: {}\nforetold: PSNR {:.1} dB in the worst frame, {} a frame, {} in all",
            choice.wanted,
            choice.options(),
            choice.foretold.psnr(),
            duration(seconds),
            duration(seconds * self.frames())
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

/// By which factor the light's noise alone, by the audit's lower end, exceeds what is allowed.
fn audited_excess(audit: Option<&AuditRow>, allowed: f64) -> f64 {
    let low = audit.and_then(|audit| audit.rmse).map_or(0.0, |[_, low, _]| low);
    low * low / allowed
}

#[cfg(test)]
mod tests {
    use super::audited_excess;
    use crate::output::manifest::AuditRow;
    use crate::stats::AuditSums;

    #[test]
    fn an_audit_misses_only_what_it_is_sure_of() {
        let audit = |rmse| AuditRow {
            rmse: Some(rmse),
            rmse_inferred_pixels: None,
            rmse_traced: None,
            sums: AuditSums::default(),
        };
        assert_eq!(audited_excess(None, 1.0), 0.0);
        assert!(audited_excess(Some(&audit([1.2, 0.9, 1.5])), 1.0) < 1.0);
        assert_eq!(audited_excess(Some(&audit([3.0, 2.0, 4.0])), 2.0), 2.0);
    }
}
