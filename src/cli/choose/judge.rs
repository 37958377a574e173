//! What came of the settings that were chosen, and tighter ones where a target was missed.

use super::budget::Budget;
use super::{Choice, Chooser, Judged, decibels};
use crate::accuracy::{Check, Effort, Prediction, Timer, Verdict, displayed_rgb};
use crate::error::{Result, counted};
use crate::film::{Encoding, Image};
use crate::output::manifest::AuditRow;
use crate::output::read_image;
use crate::page::words::seconds;

/// How often a target that was missed is tightened.
const ROUNDS: u32 = 2;

/// Share of the job that a look at what came out takes, where no time is to be kept.
const CHECK_SHARE: f64 = 0.1;

impl Chooser<'_> {
    /// Says what came out of `choice`, and makes a tighter one where the target was missed.
    ///
    /// # Errors
    /// A frame that cannot be read or traced.
    pub fn judge(
        &self,
        choice: Choice,
        audit: Option<&AuditRow>,
        rendered: Option<f64>,
        timer: Timer,
    ) -> Result<Judged> {
        let samples = choice.predicted.samples;
        let budget = Budget::of(self);
        let effort = match budget.map(|budget| budget.effort(&choice.predictor, samples)) {
            None => self.effort_of_check(&choice),
            Some(Ok(effort)) => effort,
            Some(Err(least)) => {
                self.tell_unchecked(&choice, least, rendered);
                return Ok(Judged::Done(choice));
            }
        };
        let (predictor, predicted) = (&choice.predictor, &choice.predicted);
        let image = |frame| self.image(frame);
        let check = Check::of(&self.probe(), predictor, predicted, effort, &image)?;
        let [mean, worst] = check.psnr().map(decibels);
        let looked = counted(check.frames.len(), "frame");
        let psnr = format!(
            "PSNR {mean}, {worst} in the worst of {looked} looked at, predicted {}",
            decibels(predicted.psnr())
        );
        let figure = self.args.target.and_then(|goal| goal.in_words(check.figure));
        let figure = figure.map_or(String::new(), |came| {
            let predicted = choice.figure();
            let predicted = predicted.map_or(String::new(), |words| format!(", predicted {words}"));
            format!("{came} in the worst{predicted}; ")
        });
        let time = self.time(&choice, rendered);
        self.tell(format!("came out: {figure}{psnr}{time}"));
        let came_out = Some(format!("{figure}{psnr}"));
        self.weigh(Choice { came_out, ..choice }, &check, audit, timer)
    }

    /// How much to look at where no time is to be kept: for a small share of the job.
    fn effort_of_check(&self, choice: &Choice) -> Effort {
        let whole = Check::seconds(&choice.predictor, choice.predicted.samples);
        let (frames, settings) = (self.request.frames, self.context.base);
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        let count = frames.last - frames.first + 1;
        let effort = Effort::of_check(CHECK_SHARE * choice.seconds, whole, count, pixels);
        effort.unwrap_or(Effort::LEAST)
    }

    /// `choice` with its verdict, or a tighter one where the target was missed and one may be had.
    fn weigh(
        &self,
        choice: Choice,
        check: &Check,
        audit: Option<&AuditRow>,
        timer: Timer,
    ) -> Result<Judged> {
        let (Some(goal), Some(allowed)) = (self.args.target, choice.allowed) else {
            return Ok(Judged::Done(choice));
        };
        let excess = check.excess(goal, allowed).max(audited_excess(audit, allowed));
        if excess <= 1.0 {
            let verdict = Some(check.verdict(goal, allowed));
            return Ok(Judged::Done(Choice { verdict, ..choice }));
        }
        let missed = |choice| Judged::Done(Choice { verdict: Some(Verdict::Missed), ..choice });
        if choice.tightened >= ROUNDS {
            self.warn(format!("{} was missed, and is not tightened again", choice.wanted));
            return Ok(missed(choice));
        }
        // So much more than predicted.
        let factor = excess * allowed / choice.predicted.squared_error.max(1e-9);
        Ok(match self.tighter(&choice, allowed, factor, timer)? {
            Some(tighter) => Judged::Again(tighter),
            None => missed(choice),
        })
    }

    /// Says that there is no time for a look at what came out, which would take `least` seconds.
    fn tell_unchecked(&self, choice: &Choice, least: f64, rendered: Option<f64>) {
        self.tell(format!(
            "came out: not looked at, which would take {} or more{}",
            seconds(least),
            self.time(choice, rendered)
        ));
    }

    /// What rendering took beside what was predicted, if it was all rendered now, and all beside the
    /// budget.
    fn time(&self, choice: &Choice, rendered: Option<f64>) -> String {
        let predicted = choice.seconds;
        let rendering = rendered.map_or(String::new(), |took| {
            let [came, said] = [took, predicted].map(seconds);
            format!("; rendering took {came}, predicted {said} ({})", beyond(took, predicted))
        });
        let all = self.started.elapsed().as_secs_f64();
        let budget = self.args.budget.map_or(String::new(), |budget| {
            let budget = budget.as_secs_f64();
            let [came, asked] = [all, budget].map(seconds);
            format!("; in all {came} of {asked} ({})", beyond(all, budget))
        });
        rendering + &budget
    }

    /// The choice with errors `factor` times as large as predicted.
    fn tighter(
        &self,
        choice: &Choice,
        allowed: f64,
        factor: f64,
        timer: Timer,
    ) -> Result<Option<Choice>> {
        // A tenth beyond what was seen, lest the next round misses by a hair; and never looser.
        let mut predictor = choice.predictor.worse(1.1 * f64::max(1.0, factor));
        if !self.given().bounces {
            predictor = predictor.with_more_bounces();
        }
        let found = self.probe().fastest(&predictor, allowed, timer)?;
        let set = |predicted: &Prediction| (predicted.samples, predicted.bounces);
        let Some(predicted) = found.filter(|found| set(found) != set(&choice.predicted)) else {
            self.warn(format!("{} was missed, and nothing is tighter", choice.wanted));
            return Ok(None);
        };
        let tightened = choice.tightened + 1;
        let seconds = predicted.seconds * self.probe().frames_each(predicted.reuse);
        let (checked, verdict, came_out) = (None, None, None);
        let before = choice.clone();
        let tighter = Choice {
            predicted,
            predictor,
            seconds,
            tightened,
            checked,
            verdict,
            came_out,
            ..before
        };
        self.warn(format!("{} was missed; rendered again, tightened", choice.wanted));
        self.say_choice(&tighter);
        Ok(Some(tighter))
    }

    /// A finished frame as displayed.
    fn image(&self, frame: u32) -> Result<Image> {
        let mut image = read_image(self.request.pattern.path(frame))?;
        if image.encoding == Encoding::Linear {
            image.rgb = displayed_rgb(&image.rgb, self.context.base);
            image.encoding = Encoding::Srgb;
        }
        Ok(image)
    }
}

/// By how much what came is more than what was predicted or allowed, in words: a plus is too much.
fn beyond(came: f64, expected: f64) -> String {
    format!("{:+.0} %", 100.0 * (came / expected.max(1e-9) - 1.0))
}

/// By which factor the light's noise alone, by the audit's lower end, exceeds what is allowed.
fn audited_excess(audit: Option<&AuditRow>, allowed: f64) -> f64 {
    let low = audit.and_then(|audit| audit.rmse).map_or(0.0, |[_, low, _]| low);
    low * low / allowed
}

#[cfg(test)]
mod tests {
    use super::{audited_excess, beyond};
    use crate::output::manifest::AuditRow;
    use crate::stats::AuditSums;

    #[test]
    fn what_takes_longer_is_a_plus() {
        assert_eq!(beyond(0.9, 0.6), "+50 %");
        assert_eq!(beyond(1.2, 1.0), "+20 %");
        assert_eq!(beyond(0.3, 0.6), "-50 %");
    }

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
