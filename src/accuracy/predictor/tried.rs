//! What the figures of settings that were tried tell of these, and of others.

use super::super::choice::Goal;
use super::super::error_model::Samples;
use super::{MeasuredSamples, Prediction, Predictor};

/// Where nothing that was tried reaches the goal, the squared error is to come down by so much at a time.
const STEP: f64 = 4.0;
/// Between squared errors less than so many times apart there is nothing to try.
const CLOSE: f64 = 1.5;

impl Goal {
    /// The largest figure that reaches it, as figures rise with the error; `None` for the squared error.
    pub(in super::super) fn most(self) -> Option<f64> {
        match self {
            Self::Psnr(_) => None,
            Self::Ssim(least) => Some(1.0 - least),
            Self::Flip(most) | Self::MaxShare(most) => Some(most),
        }
    }
}

impl Predictor {
    /// The goal's figure of `samples` if they were tried: as it was found, and the larger for all that is
    /// added to the squared error.
    pub fn figure(&self, samples: Samples) -> Option<f64> {
        self.figure_of(self.tried(samples)?)
    }

    /// The goal's figure that is predicted: as it was found if the samples were tried, else by the line.
    pub fn predicted_figure(&self, prediction: &Prediction) -> Option<f64> {
        let by_line = || self.line.map(|line| line.figure(prediction.squared_error));
        self.figure(prediction.samples).or_else(by_line)
    }

    /// What `samples` came to, if they were tried, which nothing is twice.
    pub(in super::super) fn tried(&self, samples: Samples) -> Option<&MeasuredSamples> {
        self.measured.iter().find(|measured| measured.samples == samples)
    }

    /// What came nearest to the goal of all that was tried, and its figure as [`Self::figure`].
    pub fn nearest(&self) -> Option<(Samples, f64)> {
        let all = self.measured.iter().filter_map(|m| Some((m.samples, self.figure_of(m)?)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether `samples` were tried and reached the goal's figure.
    pub(super) fn reached(&self, samples: Samples) -> bool {
        let figure = self.figure(samples).zip(self.most);
        figure.is_some_and(|(figure, most)| figure <= most)
    }

    /// Whether `samples` were tried and missed the goal's figure; or, untried, are no more in any respect
    /// than some that did.
    pub(super) fn missed(&self, samples: Samples) -> bool {
        let Some(most) = self.most else { return false };
        if let Some(figure) = self.figure(samples) {
            return figure > most;
        }
        let holds =
            |s: Samples| samples.spp <= s.spp && samples.shadow <= s.shadow && samples.sky <= s.sky;
        let misses = |m: &MeasuredSamples| self.figure_of(m).is_some_and(|figure| figure > most);
        self.measured.iter().any(|m| holds(m.samples) && misses(m))
    }

    /// The largest squared error that is predicted of what reached the goal's figure; none is 0.
    pub(super) fn most_that_reached(&self) -> f64 {
        let reached = |samples: &Samples| self.reached(*samples);
        self.errors_tried().filter(|(samples, _)| reached(samples)).fold(0.0, |m, (_, e)| m.max(e))
    }

    /// A squared error to try. Where nothing reached the goal yet it is no less than a quarter of what was
    /// tried: the line is only sure near to what it was put through, and what is far too good is expensive
    /// to try.
    pub(in super::super) fn to_try(&self, goal: Goal) -> f64 {
        let allowed = self.allowed(goal);
        match self.most {
            Some(_) if self.most_that_reached() <= 0.0 => allowed.max(self.next_step()),
            _ => allowed,
        }
    }

    /// A squared error half way, by factors, from the largest that reached the goal to the next larger one
    /// that did not, unless they are close; `None` where there are not both.
    pub(in super::super) fn between(&self) -> Option<f64> {
        let low = self.most_that_reached();
        let missed = self.errors_tried().filter(|(s, e)| *e > low && !self.reached(*s));
        let high = missed.map(|(_, e)| e).fold(f64::INFINITY, f64::min);
        (low > 0.0 && high.is_finite() && high > CLOSE * low).then(|| (low * high).sqrt())
    }

    /// A squared error well below all that was tried.
    fn next_step(&self) -> f64 {
        self.errors_tried().fold(f64::INFINITY, |least, (_, e)| least.min(e)) / STEP
    }

    fn errors_tried(&self) -> impl Iterator<Item = (Samples, f64)> + '_ {
        let of = |m: &MeasuredSamples| {
            let prediction = self.of(self.modes.first()?, m.samples);
            Some((m.samples, prediction.squared_error))
        };
        self.measured.iter().filter_map(of)
    }

    fn figure_of(&self, tried: &MeasuredSamples) -> Option<f64> {
        let found = tried.figure?;
        let bias = self.bias.iter().copied().fold(0.0, f64::max);
        let all = self.excess * found.squared_error + bias;
        // Without a line: no figure rises faster than the squared error.
        let rise = self.line.map_or(1.0, |line| line.rise.min(1.0));
        Some(found.figure * (all / found.squared_error.max(1e-12)).powf(rise))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{predictor, range};
    use super::super::{Figure, PowerLaw, Predictor};
    use super::*;

    fn tried(all: &[(u32, u32, f64)]) -> Predictor {
        let mut predictor = predictor();
        (predictor.most, predictor.rounding, predictor.bias) = (Some(0.02), 0.0, vec![0.0]);
        let measured = |&(spp, shadow, figure): &(u32, u32, f64)| {
            let samples = Samples { spp, shadow, sky: 1 };
            let errors: Vec<f64> = predictor.model.errors(samples).collect();
            let figure = Some(Figure { figure, squared_error: errors[0] });
            MeasuredSamples { samples, errors, doubts: vec![0.0], figure }
        };
        predictor.measured = all.iter().map(measured).collect();
        predictor
    }

    fn first(predictor: &Predictor) -> Option<(u32, u32)> {
        let allowed = predictor.allowed(Goal::Flip(0.02));
        let found = predictor.fastest(&range(), allowed);
        found.first().map(|f| (f.samples.spp, f.samples.shadow))
    }

    #[test]
    fn what_was_seen_to_miss_is_not_chosen_whatever_the_line_says() {
        // The line allows a squared error of 4: 16 camera samples with one shadow sample.
        assert_eq!(first(&tried(&[])), Some((16, 1)));
        assert_eq!(first(&tried(&[(16, 1, 0.019)])), Some((16, 1)));
        let missed = first(&tried(&[(16, 1, 0.021)])).expect("another");
        assert!(missed.0 > 16 || missed.1 > 1, "{missed:?}");
        // Nor what is less in every respect than something that missed.
        let less = first(&tried(&[(32, 1, 0.021)])).expect("another");
        assert!(less.0 > 32 || less.1 > 1, "{less:?}");
        // Errors that came out larger than predicted make figures larger too.
        let worse = tried(&[(16, 1, 0.019)]).worse(1.3);
        assert!(!worse.reached(Samples { spp: 16, shadow: 1, sky: 1 }), "{worse:?}");
    }

    #[test]
    fn without_a_line_what_was_seen_decides() {
        let without = |all: &[(u32, u32, f64)]| Predictor { line: None, ..tried(all) };
        let none = without(&[(4, 1, 0.5), (16, 1, 0.5)]);
        assert_eq!((none.allowed(Goal::Flip(0.02)), first(&none)), (0.0, None));
        let (samples, figure) = none.nearest().expect("one");
        assert!(samples.spp > 1 && (figure - 0.5).abs() < 1e-9);
        // There is something further to try.
        assert!(!none.fastest(&range(), none.to_try(Goal::Flip(0.02))).is_empty());
        let one = without(&[(4, 1, 0.5), (16, 1, 0.5), (64, 4, 0.002)]);
        assert_eq!(first(&one), Some((64, 4)));
        // To aim at less would lead to what nothing is known of.
        let goal = Goal::Flip(0.02);
        assert_eq!(one.aim(goal, 0.5), one.allowed(goal));
        let with = tried(&[(4, 1, 0.5), (16, 1, 0.5), (64, 4, 0.002)]);
        assert!((with.aim(goal, 0.5) - 0.5 * with.allowed(goal)).abs() < 1e-9);
    }

    /// As `cornell` at `max-share=5%`: the line told so little that 96 camera samples were tried, and then
    /// taken, where 32 do.
    #[test]
    fn what_is_tried_is_not_far_beyond_what_missed_nor_is_the_first_that_reaches_taken() {
        let goal = Goal::Flip(0.02);
        let flat = PowerLaw { at_one: 0.022f64.ln(), rise: 0.11 };
        let missed = |all: &[(u32, u32, f64)]| Predictor { line: Some(flat), ..tried(all) };
        let error = |f: &Predictor, spp| f.of(&f.modes[0], Samples { spp, shadow: 1, sky: 1 });
        let none = missed(&[(4, 1, 0.03), (16, 1, 0.025)]);
        let least = error(&none, 16).squared_error / STEP;
        assert!(none.allowed(goal) < least && near(none.to_try(goal), least), "{none:?}");
        assert_eq!(none.between(), None);
        let some = missed(&[(4, 1, 0.03), (64, 1, 0.001)]);
        let [high, low] = [4, 64].map(|spp| error(&some, spp).squared_error);
        assert!(near(some.to_try(goal), some.allowed(goal)));
        assert!(near(some.between().expect("between"), (low * high).sqrt()));
        assert_eq!(missed(&[(32, 1, 0.03), (32, 4, 0.001)]).between(), None, "they are close");
        // What reached is taken, although the line allows less.
        let fewer = missed(&[(4, 1, 0.03), (64, 1, 0.001), (16, 1, 0.019)]);
        assert!(error(&fewer, 16).squared_error > fewer.allowed(goal));
        assert_eq!(first(&fewer), Some((16, 1)));
    }

    fn near(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-9
    }

    #[test]
    fn a_figure_is_predicted_of_what_was_tried_and_of_what_was_not() {
        let predictor = tried(&[(16, 1, 0.019)]);
        let of = |spp| {
            let prediction = predictor.of(&predictor.modes[0], Samples { spp, shadow: 1, sky: 1 });
            predictor.predicted_figure(&prediction).expect("a figure")
        };
        assert!((of(16) - 0.019).abs() < 1e-9);
        // By the line, which is 0.02 at 4: 60/32 at 32 camera samples.
        assert!((of(32) - 0.02 * (60f64 / 32.0 / 4.0).sqrt()).abs() < 1e-3, "{}", of(32));
        let none = Predictor { line: None, ..predictor.clone() };
        let prediction = none.of(&none.modes[0], Samples { spp: 32, shadow: 1, sky: 1 });
        assert_eq!(none.predicted_figure(&prediction), None);
    }

    #[test]
    fn a_line_that_hardly_rises_tells_nothing() {
        assert!(PowerLaw::through(&[(1.0, 0.500), (4.0, 0.501), (16.0, 0.502)]).is_none());
        assert!(PowerLaw::through(&[(1.0, 0.1), (4.0, 0.2), (16.0, 0.4)]).is_some());
    }
}
