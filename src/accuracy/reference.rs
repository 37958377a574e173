//! The reference that candidates are compared with: traced frames, whose most camera samples of a pixel double until
//! the frames no longer change. The samples are adaptive, as those of candidates.

use super::context::TrialContext;
use super::errors::{Frames, rms_between};
use crate::error::Result;
use crate::scene::limits::MAX_SEED;
use crate::scene::{Policy, Settings};

/// The reference's frames.
pub struct Truth {
    /// The frames as displayed.
    pub frames: Frames,
    /// Root mean square by which the last doubling of the samples changed the frames, in display steps. The
    /// error that is left is less.
    pub change: f64,
    /// The value that `change` was to fall below, in display steps.
    pub wanted: f64,
    /// The settings of the last doubling.
    pub settings: Settings,
}

/// Camera samples of the first, coarsest reference, at least.
const FIRST: u32 = 32;
/// The most camera samples of a pixel over the least, at most. With 8 the references measured are no less accurate than
/// those with half as many as the most in every pixel (`tests/adaptive.rs`).
const RANGE: u32 = 8;

/// The settings of the first, coarsest reference: every frame traced, with at least as many bounces and as
/// low a cut-off as any candidate, and as many shadow samples as the candidate with the most, since the bias
/// of their ratio falls with these alone (`docs/accuracy.md`).
pub fn truth_settings(base: &Settings, candidates: &[&Settings]) -> Settings {
    let most = |of: fn(&Settings) -> u32, least: u32| {
        candidates.iter().map(|s| of(s)).max().unwrap_or(0).max(of(base)).max(least)
    };
    let cutoff = candidates.iter().map(|s| s.cutoff).fold(base.cutoff, f32::min);
    let mut settings = base.clone();
    settings.spp = most(Settings::most_camera_samples, FIRST);
    (settings.most_spp, settings.least_shadow_samples) = (None, None);
    settings.least_sky_samples = None;
    settings.shadow_samples = most(|s| s.shadow_samples, 16);
    settings.sky_samples = most(|s| s.sky_samples, 16);
    settings.bounces = most(|s| s.bounces, 16);
    settings.cutoff = cutoff.min(1e-5);
    settings.reuse.policy = Policy::Off;
    settings
}

/// The least and the most camera samples of a pixel after some doublings of the most, of which there are `first`
/// before any.
fn samples_of(first: u32, doublings: u32) -> (u32, u32) {
    let most = first << doublings;
    (first.max(most / RANGE), most)
}

/// The seed of a doubling: half of all seeds away from those of candidates, which are the base's and the next
/// few.
fn seed_of_doubling(base: u64, doubling: u32) -> u64 {
    (base + MAX_SEED / 2 + 1 + u64::from(doubling)) % (MAX_SEED + 1)
}

/// The seed of all candidates in a turn.
pub fn seed_of_turn(base: u64, turn: u32) -> u64 {
    (base + u64::from(turn)) % (MAX_SEED + 1)
}

/// The reference after some doublings of its samples.
#[derive(Debug, Clone)]
pub struct Doubling {
    /// Number of doublings.
    pub number: u32,
    /// The most camera samples of a pixel.
    pub spp: u32,
    /// Root mean square by which the last doubling changed the frames, in display steps; `None` before any.
    pub change: Option<f64>,
    /// The frames as displayed.
    pub frames: Frames,
}

/// A step in the making of a reference.
pub enum Step<'a> {
    /// A frame is about to be rendered.
    Frame {
        /// The settings of its doubling.
        settings: &'a Settings,
        /// Position of the frame among the reference's, from 0.
        k: usize,
        /// Number of frames of the reference.
        of: usize,
    },
    /// All frames of a doubling are rendered.
    Doubled(&'a Doubling),
}

/// How a reference is made: its frames are rendered with twice the most camera samples of a pixel each time, until a
/// doubling changes them by less than `wanted`, or the next would take more than `most` samples.
pub struct Convergence<'a> {
    /// The scene and everything needed to render it.
    pub context: &'a TrialContext<'a>,
    /// Settings of the first, coarsest reference ([`truth_settings`]).
    pub settings: Settings,
    /// Numbers of the frames.
    pub frames: &'a [u32],
    /// Largest root mean square change, in display steps.
    pub wanted: f64,
    /// Largest number of camera samples a pixel; no doubling exceeds it.
    pub most: u32,
}

impl Convergence<'_> {
    /// Makes the reference, from the doubling `last` on if there is one; `report` is called before each frame
    /// and after each doubling. Each doubling has new samples: one that kept the old ones would seem to change
    /// less. Nor are doublings averaged: samples of one sequence are worth more than as many of several.
    ///
    /// # Errors
    /// As [`TrialContext::trace`], and any that `report` gives.
    pub fn run(
        &self,
        mut last: Option<Doubling>,
        report: &mut dyn FnMut(Step) -> Result<()>,
    ) -> Result<Truth> {
        loop {
            match last {
                Some(last) if self.is_done(&last) => return Ok(self.truth(last)),
                _ => last = Some(self.double(last, report)?),
            }
        }
    }

    /// Whether `last` is the last doubling.
    pub fn is_done(&self, last: &Doubling) -> bool {
        let is_near = last.change.is_some_and(|change| change <= self.wanted);
        is_near || last.spp.saturating_mul(2) > self.most
    }

    /// The settings of a doubling. Only the first has as many camera samples in every pixel.
    pub fn settings_of(&self, number: u32) -> Settings {
        let (least, most) = samples_of(self.settings.spp, number);
        let seed = seed_of_doubling(self.context.base.seed, number);
        let most_spp = (most > least).then_some(most);
        Settings { spp: least, most_spp, seed, ..self.settings.clone() }
    }

    fn double(
        &self,
        last: Option<Doubling>,
        report: &mut dyn FnMut(Step) -> Result<()>,
    ) -> Result<Doubling> {
        let number = last.as_ref().map_or(0, |last| last.number + 1);
        let settings = self.settings_of(number);
        let (spp, of) = (settings.most_camera_samples(), self.frames.len());
        let mut frames = Frames::new();
        for (k, frame) in self.frames.iter().enumerate() {
            report(Step::Frame { settings: &settings, k, of })?;
            let (image, _) = self.context.trace(&settings, self.context.intersector, *frame)?;
            frames.insert(*frame, image);
        }
        let change = last.map(|last| rms_between(&frames, &last.frames));
        let doubling = Doubling { number, spp, change, frames };
        report(Step::Doubled(&doubling))?;
        Ok(doubling)
    }

    fn truth(&self, last: Doubling) -> Truth {
        let settings = self.settings_of(last.number);
        let change = last.change.unwrap_or(f64::INFINITY);
        Truth { frames: last.frames, change, wanted: self.wanted, settings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_most_samples_double_at_first() {
        let of = |first| [0, 1, 3, 4, 5].map(|doublings| samples_of(first, doublings));
        assert_eq!(of(32), [(32, 32), (32, 64), (32, 256), (64, 512), (128, 1024)]);
        assert_eq!(of(64), [(64, 64), (64, 128), (64, 512), (128, 1024), (256, 2048)]);
    }

    #[test]
    fn seeds_of_the_truth_are_no_candidates() {
        for base in [0, 7, 1 << 40, MAX_SEED / 2, MAX_SEED] {
            let candidates: Vec<u64> = (0..100).map(|turn| seed_of_turn(base, turn)).collect();
            for doubling in 0..64 {
                let seed = seed_of_doubling(base, doubling);
                assert!(seed <= MAX_SEED && !candidates.contains(&seed), "{base} {doubling}");
            }
        }
    }
}
