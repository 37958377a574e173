//! How good finished frames came out: some of their pixels compared with a reference of many samples.

use super::choice::Goal;
use super::effort::Effort;
use super::figures::{figure, squared_errors};
use super::predictor::{Prediction, Predictor};
use super::probe::{SettingsProbe, samples_of_reference};
use super::search::converged;
use super::worst::estimates;
use crate::error::Result;
use crate::film::Image;
use crate::measure::psnr;
use serde::{Deserialize, Serialize};

/// The error that was found in one finished frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedFrame {
    /// Number of the frame.
    pub frame: u32,
    /// Mean squared error in squares of a display step, without that of the reference.
    pub squared_error: f64,
    /// Standard error of `squared_error`, as a share of it.
    pub doubt: f64,
}

/// The errors that were found in all frames looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckOutcome {
    /// One for each frame looked at.
    pub frames: Vec<CheckedFrame>,
    /// The goal's figure of the worst frame, as [`Goal::largest`] has it.
    pub figure: f64,
}

/// Whether a goal was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// Every frame looked at reached it.
    Reached,
    /// Some frame missed it, by less than so few pixels can tell.
    Open,
    /// Some frame missed it by more than that.
    Missed,
}

impl CheckOutcome {
    /// Compares some finished frames, rendered with the settings of `prediction`, with a reference, at
    /// other pixels than the probe's and as many as `effort` says; `image` gives a frame as displayed.
    ///
    /// # Errors
    /// As [`TrialContext::trace`](super::context::TrialContext::trace), and any that `image` gives.
    pub fn of(
        probe: &SettingsProbe,
        predictor: &Predictor,
        prediction: &Prediction,
        effort: Effort,
        image: &dyn Fn(u32) -> Result<Image>,
    ) -> Result<Self> {
        let (chosen, patches) = probe.check_patches(effort, image)?;
        let seen = patches.of_images(image)?;
        let samples = samples_of_reference(prediction.samples);
        let mut reference = converged(probe.context.base, samples);
        reference.bounces = reference.bounces.max(prediction.bounces);
        let truth = patches.trace(probe.context, &reference)?;
        let own = predictor.model.own_part(prediction.samples, samples);
        // Rounding is all the frame's; of the rest a part is the reference's.
        let of_frame = |error: f64| {
            let rounding = error.min(predictor.rounding);
            rounding + own * (error - rounding)
        };
        let (errors, doubts) = squared_errors(&patches, &truth, &seen);
        let found = errors.into_iter().map(of_frame).zip(doubts);
        let checked = |(frame, (squared_error, doubt)): (u32, (f64, f64))| CheckedFrame {
            frame,
            squared_error,
            doubt,
        };
        Ok(Self {
            frames: chosen.into_iter().zip(found).map(checked).collect(),
            figure: probe.goal.map_or(Ok(0.0), |goal| figure(goal, &patches, &truth, &seen))?,
        })
    }

    /// The mean of the frames' squared errors.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.frames.iter().map(|f| f.squared_error).sum();
        sum / self.frames.len().max(1) as f64
    }

    /// The frame with the largest squared error.
    pub fn worst(&self) -> Option<CheckedFrame> {
        self.frames.iter().copied().max_by(|a, b| a.squared_error.total_cmp(&b.squared_error))
    }

    /// Whether `goal` was reached.
    pub fn verdict(&self, goal: Goal) -> Verdict {
        let is_reached = match goal {
            Goal::Psnr(_) => self.worst().is_none_or(|w| w.squared_error <= goal.largest()),
            _ => self.excess(goal) <= 1.0,
        };
        match () {
            () if is_reached => Verdict::Reached,
            () if self.excess(goal) <= 1.0 => Verdict::Open,
            () => Verdict::Missed,
        }
    }

    /// The figure over the largest that `goal` allows; above 1 the goal is missed. For PSNR each frame's error is first
    /// moved towards the others' (`estimates`) and half of its standard error is taken off, so that more than 1 is
    /// no chance; the figures of other goals have no such allowance.
    pub fn excess(&self, goal: Goal) -> f64 {
        let figure = match goal {
            Goal::Psnr(_) => {
                let found: Vec<f64> = self.frames.iter().map(|f| f.squared_error).collect();
                let doubts: Vec<f64> = self.frames.iter().map(|f| f.doubt).collect();
                let sure = estimates(&found, &doubts).into_iter().map(|(x, error)| x - 0.5 * error);
                sure.fold(0.0, f64::max)
            }
            _ => self.figure,
        };
        figure / goal.largest()
    }

    /// PSNR of the mean squared error and of the worst frame, dB.
    pub fn psnr(&self) -> [f64; 2] {
        let of = |squared_error: f64| psnr(squared_error / (255.0 * 255.0));
        [of(self.mean()), of(self.worst().map_or(0.0, |worst| worst.squared_error))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_missed_by_a_frame_beyond_doubt() {
        let check = |errors: &[f64]| CheckOutcome {
            frames: errors
                .iter()
                .map(|e| CheckedFrame { frame: 1, squared_error: *e, doubt: 0.2 })
                .collect(),
            figure: 0.03,
        };
        let goal = Goal::Psnr(psnr(2.0 / (255.0 * 255.0)));
        let verdict = |errors: &[f64]| check(errors).verdict(goal);
        assert_eq!(verdict(&[1.9, 1.99, 1.99]), Verdict::Reached);
        // Only where more than the figure that is printed is too large.
        assert_eq!(verdict(&[1.9, 2.0, 2.1]), Verdict::Open);
        // Of frames that are alike one comes out worse by chance.
        assert_eq!(verdict(&[1.9, 2.0, 2.3]), Verdict::Open);
        assert_eq!(verdict(&[2.4, 2.5, 2.7]), Verdict::Missed);
        assert_eq!(verdict(&[1.0, 1.1, 4.0]), Verdict::Missed);
        assert_eq!(verdict(&[2.1]), Verdict::Open);
        assert_eq!(verdict(&[2.3]), Verdict::Missed);
        assert!(check(&[1.9, 2.0, 2.1]).excess(goal) <= 1.0);
        assert!(check(&[2.4, 2.5, 2.7]).excess(goal) > 1.0);
        assert_eq!(check(&[9.0]).verdict(Goal::Flip(0.03)), Verdict::Reached);
        assert_eq!(check(&[1.0]).verdict(Goal::Flip(0.02)), Verdict::Missed);
        assert!((check(&[9.0]).excess(Goal::Flip(0.02)) - 1.5).abs() < 1e-9);
        assert!((check(&[1.0]).excess(Goal::Ssim(0.97)) - 1.0).abs() < 1e-9);
    }
}
