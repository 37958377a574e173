//! The check of finished frames, and a tighter choice where a target was missed.

use super::{Choice, Chooser, Judgement, decibels};
use crate::accuracy::{CheckOutcome, Effort, Goal, Prediction, Timer, Verdict, displayed_rgb};
use crate::error::{Result, counted};
use crate::film::{Encoding, Image};
use crate::output::manifest::AuditRow;
use crate::output::read_image;
use crate::page::words::seconds;

/// Most times that a choice is tightened after a miss.
const ROUNDS: u32 = 2;

impl Chooser<'_> {
    /// Checks the finished frames of `choice`, says how good they are, and makes a tighter choice where the target
    /// was missed. `rendered` has the seconds that rendering took, if all frames were rendered now.
    ///
    /// # Errors
    /// A frame that cannot be read or traced.
    pub fn judge(
        &self,
        choice: Choice,
        audit: Option<&AuditRow>,
        rendered: Option<f64>,
        timer: Timer,
    ) -> Result<Judgement> {
        let (frames, settings) = (self.request.frames, self.context.base);
        let effort = Effort::of_check(frames.last - frames.first + 1, settings.pixel_count());
        let (predictor, predicted) = (&choice.predictor, &choice.predicted);
        let image = |frame| self.image(frame);
        let check = CheckOutcome::of(&self.probe(), predictor, predicted, effort, &image)?;
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

    /// `choice` with its verdict, or a tighter one if the target was missed and one is found.
    fn weigh(
        &self,
        choice: Choice,
        check: &CheckOutcome,
        audit: Option<&AuditRow>,
        timer: Timer,
    ) -> Result<Judgement> {
        let Some(goal) = self.args.target else { return Ok(Judgement::Done(choice)) };
        let excess = check.excess(goal).max(audited_excess(audit, goal));
        if excess <= 1.0 {
            let verdict = Some(check.verdict(goal));
            return Ok(Judgement::Done(Choice { verdict, ..choice }));
        }
        let missed = |choice| Judgement::Done(Choice { verdict: Some(Verdict::Missed), ..choice });
        if choice.tightened >= ROUNDS {
            self.warn(format!("{} was missed, and is not tightened again", choice.wanted));
            return Ok(missed(choice));
        }
        Ok(match self.tighter(&choice, excess, timer)? {
            Some(tighter) => Judgement::Again(tighter),
            None => missed(choice),
        })
    }

    /// In words: the time of rendering with its prediction, if `rendered` has it, and the time of the program with
    /// its budget.
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

    /// A choice whose predicted squared error is smaller by the factor `excess`; `None` where there is none.
    fn tighter(&self, choice: &Choice, excess: f64, timer: Timer) -> Result<Option<Choice>> {
        let mut predictor = choice.predictor.clone();
        if !self.given().bounces {
            predictor = predictor.with_more_bounces();
        }
        // A tenth more than measured, so that the next round does not just miss.
        let allowed = choice.predicted.squared_error / (1.1 * excess);
        let range = self.probe().range();
        let of_mode = |mode| predictor.fastest(mode, &range, allowed);
        let found = predictor.modes.iter().filter_map(of_mode).collect();
        let found = self.probe().fastest(found, timer)?;
        let set = |predicted: &Prediction| (predicted.samples, predicted.bounces);
        let Some(predicted) = found.filter(|found| set(found) != set(&choice.predicted)) else {
            self.warn(format!(
                "{} was missed, and no other setting is predicted to be accurate enough",
                choice.wanted
            ));
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

/// By how much `came` exceeds `expected`, in per cent with sign.
fn beyond(came: f64, expected: f64) -> String {
    format!("{:+.0} %", 100.0 * (came / expected.max(1e-9) - 1.0))
}

/// The factor by which the lower end of the audit's interval, squared, exceeds the squared error that a PSNR
/// allows.
fn audited_excess(audit: Option<&AuditRow>, goal: Goal) -> f64 {
    let low = audit.and_then(|audit| audit.rmse).map_or(0.0, |[_, low, _]| low);
    match goal {
        Goal::Psnr(_) => low * low / goal.largest(),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::{audited_excess, beyond};
    use crate::accuracy::Goal;
    use crate::output::manifest::AuditRow;
    use crate::stats::AuditSums;

    #[test]
    fn a_longer_time_has_a_plus_sign() {
        assert_eq!(beyond(0.9, 0.6), "+50 %");
        assert_eq!(beyond(1.2, 1.0), "+20 %");
        assert_eq!(beyond(0.3, 0.6), "-50 %");
    }

    #[test]
    fn an_audit_counts_as_a_miss_only_beyond_its_interval() {
        let audit = |rmse| AuditRow {
            rmse: Some(rmse),
            rmse_inferred_pixels: None,
            rmse_traced: None,
            sums: AuditSums::default(),
        };
        // 48.13 dB allow an RMSE of one display step.
        let goal = Goal::Psnr(48.13);
        assert_eq!(audited_excess(None, goal), 0.0);
        assert!(audited_excess(Some(&audit([1.2, 0.9, 1.5])), goal) < 1.0);
        assert!((audited_excess(Some(&audit([3.0, 2.0, 4.0])), goal) - 4.0).abs() < 0.01);
        assert_eq!(audited_excess(Some(&audit([3.0, 2.0, 4.0])), Goal::Flip(0.1)), 0.0);
    }
}
