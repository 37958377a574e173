//! What came out: some pixels of finished frames against many samples.

use super::choice::Goal;
use super::effort::Effort;
use super::error_model::Samples;
use super::figures::{doubts, figure, squares};
use super::predictor::{Prediction, Predictor};
use super::probe::{Probe, checked_pixels, reference, samples_of_reference};
use crate::error::Result;
use crate::film::Image;
use crate::measure::psnr;
use serde::{Deserialize, Serialize};

/// What was found in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedFrame {
    /// The frame.
    pub frame: u32,
    /// Its mean squared error, the reference's own left aside, display steps.
    pub squared_error: f64,
    /// By how much that may be off, a share.
    pub doubt: f64,
}

/// What was found in all that were looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Frame by frame.
    pub frames: Vec<CheckedFrame>,
    /// The goal's figure of the worst of them: SSIM less than 1 by how much, FLIP, share.
    pub figure: f64,
}

/// What a check says of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// Every frame looked at came to it.
    Reached,
    /// Some did not, but by no more than what so few pixels leave open.
    Open,
    /// Some surely did not.
    Missed,
}

impl Check {
    /// Looks at some finished frames, rendered as `predicted`, at other pixels than the probe did, as
    /// many as `effort` says; `image` gives a frame as displayed.
    ///
    /// # Errors
    /// As [`TrialContext::trace`](super::stage::TrialContext::trace), and any that `image` gives.
    pub fn of(
        probe: &Probe,
        predictor: &Predictor,
        prediction: &Prediction,
        effort: Effort,
        image: &dyn Fn(u32) -> Result<Image>,
    ) -> Result<Self> {
        let (chosen, patches) = probe.check_patches(effort, image)?;
        let seen = patches.of_images(image)?;
        let samples = samples_of_reference(prediction.samples);
        let mut reference = reference(probe.context.base, samples);
        reference.bounces = reference.bounces.max(prediction.bounces);
        let truth = patches.trace(probe.context, &reference)?;
        let own = predictor.own_part(prediction.samples, samples);
        // Rounding is all the frame's; of the rest a part is the reference's.
        let of_frame = |error: f64| {
            let rounding = error.min(predictor.rounding);
            rounding + own * (error - rounding)
        };
        let found = squares(&patches, &truth, &seen).into_iter().map(of_frame);
        let found = found.zip(doubts(&patches, &truth, &seen));
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

    /// Wall seconds that a whole check of frames of `samples` is predicted to take.
    pub fn seconds(predictor: &Predictor, samples: Samples) -> f64 {
        let whole = Effort::WHOLE;
        let pixels = f64::from(whole.frames) * f64::from(checked_pixels(whole));
        pixels * predictor.patch_seconds(samples_of_reference(samples))
    }

    /// The mean of the frames' squared errors.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.frames.iter().map(|f| f.squared_error).sum();
        sum / self.frames.len().max(1) as f64
    }

    /// The worst frame.
    pub fn worst(&self) -> Option<CheckedFrame> {
        self.frames.iter().copied().max_by(|a, b| a.squared_error.total_cmp(&b.squared_error))
    }

    /// What came of `goal`, of which `allowed` is the squared error.
    pub fn verdict(&self, goal: Goal, allowed: f64) -> Verdict {
        let is_reached = match goal {
            Goal::Psnr(_) => self.worst().is_none_or(|worst| worst.squared_error <= allowed),
            _ => self.excess(goal, allowed) <= 1.0,
        };
        match () {
            () if is_reached => Verdict::Reached,
            () if self.excess(goal, allowed) <= 1.0 => Verdict::Open,
            () => Verdict::Missed,
        }
    }

    /// By which factor squared errors are surely too large for `goal`, of which `allowed` is the squared
    /// error; 1 and less where it is not surely missed. Half of what so few pixels leave open is to the
    /// good of a frame.
    pub fn excess(&self, goal: Goal, allowed: f64) -> f64 {
        let sure = |f: &CheckedFrame| f.squared_error / (1.0 + 0.5 * f.doubt);
        match goal {
            Goal::Psnr(_) => self.frames.iter().map(sure).fold(0.0, f64::max) / allowed,
            // The figure itself decides; it rises no faster than the squared error.
            Goal::Ssim(least) => self.figure / (1.0 - least),
            Goal::Flip(most) | Goal::MaxShare(most) => self.figure / most,
        }
    }

    /// PSNR of the mean and of the worst frame, dB.
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
        let check = |errors: &[f64]| Check {
            frames: errors
                .iter()
                .map(|e| CheckedFrame { frame: 1, squared_error: *e, doubt: 0.2 })
                .collect(),
            figure: 0.03,
        };
        let goal = Goal::Psnr(45.0);
        let verdict = |errors: &[f64]| check(errors).verdict(goal, 2.0);
        assert_eq!(verdict(&[1.9, 2.0, 2.0]), Verdict::Reached);
        // Only where more than the figure that is printed is too large.
        assert_eq!(verdict(&[1.9, 2.0, 2.1]), Verdict::Open);
        assert_eq!(verdict(&[1.9, 2.0, 2.3]), Verdict::Missed);
        assert!(check(&[1.9, 2.0, 2.1]).excess(goal, 2.0) <= 1.0);
        assert!(check(&[1.9, 2.0, 2.3]).excess(goal, 2.0) > 1.0);
        assert_eq!(check(&[9.0]).verdict(Goal::Flip(0.03), 2.0), Verdict::Reached);
        assert_eq!(check(&[1.0]).verdict(Goal::Flip(0.02), 2.0), Verdict::Missed);
        assert!((check(&[9.0]).excess(Goal::Flip(0.02), 2.0) - 1.5).abs() < 1e-9);
        assert!((check(&[1.0]).excess(Goal::Ssim(0.97), 2.0) - 1.0).abs() < 1e-9);
    }
}
