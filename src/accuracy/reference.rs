//! The truth that candidates are held against: traced frames, with twice the samples until they no
//! longer change.

use super::context::TrialContext;
use super::errors::{Frames, rms_between};
use crate::error::Result;
use crate::scene::limits::MAX_SEED;
use crate::scene::{Policy, Settings};

/// The converged frames.
pub struct Truth {
    /// As displayed.
    pub frames: Frames,
    /// By how much the last doubling of the samples changed them: root mean square, display steps.
    /// More than the error that is left.
    pub change: f64,
    /// What the change was to fall below, display steps.
    pub wanted: f64,
    /// The settings of the last doubling.
    pub settings: Settings,
}

/// Camera samples to begin with.
const FIRST: u32 = 32;

/// The settings of the truth but for its camera samples: everything traced. More bounces and a lower
/// cut-off than any candidate has; as many shadow samples as the candidate with the most, since the
/// bias of their ratio falls with these alone (`docs/accuracy.md`).
pub fn truth_settings(base: &Settings, candidates: &[&Settings]) -> Settings {
    let most = |of: fn(&Settings) -> u32, least: u32| {
        candidates.iter().map(|s| of(s)).max().unwrap_or(0).max(of(base)).max(least)
    };
    let cutoff = candidates.iter().map(|s| s.cutoff).fold(base.cutoff, f32::min);
    let mut settings = base.clone();
    settings.spp = most(|s| s.spp, FIRST);
    settings.shadow_samples = most(|s| s.shadow_samples, 16);
    settings.sky_samples = most(|s| s.sky_samples, 16);
    settings.bounces = most(|s| s.bounces, 16);
    settings.cutoff = cutoff.min(1e-5);
    settings.reuse.policy = Policy::Off;
    settings
}

/// The seed of a doubling: half of all seeds away from the candidates', which are the base's and the
/// next few.
fn seed_of_doubling(base: u64, doubling: u32) -> u64 {
    (base + MAX_SEED / 2 + 1 + u64::from(doubling)) % (MAX_SEED + 1)
}

/// The seed of a turn of any candidate.
pub fn seed_of_turn(base: u64, turn: u32) -> u64 {
    (base + u64::from(turn)) % (MAX_SEED + 1)
}

/// The reference so far.
#[derive(Debug, Clone)]
pub struct Doubling {
    /// How often the samples were doubled.
    pub number: u32,
    /// Camera samples.
    pub spp: u32,
    /// By how much the last doubling changed the frames, display steps.
    pub change: Option<f64>,
    /// As displayed.
    pub frames: Frames,
}

/// What is progress of a reference in the making.
pub enum Step<'a> {
    /// A frame of so many camera samples is about to be rendered: number `k` of `of`.
    Frame {
        /// Camera samples.
        spp: u32,
        /// Which frame, from 0.
        k: usize,
        /// How many.
        of: usize,
    },
    /// All frames have twice the samples.
    Doubled(&'a Doubling),
}

/// How the reference is made: its frames with twice as many camera samples each time, until a doubling
/// changes them by less than `wanted` display steps, or more than `most` samples would be needed.
pub struct Convergence<'a> {
    /// The scene.
    pub context: &'a TrialContext<'a>,
    /// Settings of the first, coarsest reference ([`truth_settings`]).
    pub settings: Settings,
    /// Which frames.
    pub frames: &'a [u32],
    /// Display steps.
    pub wanted: f64,
    /// Camera samples.
    pub most: u32,
}

impl Convergence<'_> {
    /// Goes on from `last`, if there is one. Each time all samples are new: a doubling that only added
    /// to the ones before would seem to change less. Their mean is no better: many samples that were
    /// laid out together are worth more than as many that were not.
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

    /// Whether no doubling comes after this one.
    pub fn is_done(&self, last: &Doubling) -> bool {
        let is_near = last.change.is_some_and(|change| change <= self.wanted);
        is_near || last.spp.saturating_mul(2) > self.most
    }

    fn settings_of(&self, number: u32) -> Settings {
        let spp = self.settings.spp << number;
        let seed = seed_of_doubling(self.context.base.seed, number);
        Settings { spp, seed, ..self.settings.clone() }
    }

    fn double(
        &self,
        last: Option<Doubling>,
        report: &mut dyn FnMut(Step) -> Result<()>,
    ) -> Result<Doubling> {
        let number = last.as_ref().map_or(0, |last| last.number + 1);
        let settings = self.settings_of(number);
        let (spp, of) = (settings.spp, self.frames.len());
        let mut frames = Frames::new();
        for (k, frame) in self.frames.iter().enumerate() {
            report(Step::Frame { spp, k, of })?;
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
