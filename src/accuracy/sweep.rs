//! All candidates, in turns.
//!
//! A shared machine changes its speed from minute to minute. So the candidates take turns, every
//! second turn in reverse, and a candidate's time is compared with the default's of the same turn.
//! The first turn warms up: its pictures count, its times do not. Each turn has a seed of its own,
//! the same for all candidates.

use super::change::Change;
use super::context::TrialContext;
use super::denoiser::Denoiser;
use super::errors::Errors;
use super::knobs::Candidate;
use super::ledger::{Ledger, TrialRecord};
use super::reference::{Truth, seed_of_turn};
use super::row::Taken;
use super::table::Measured;
use super::trial::{self, Trial};
use crate::error::Result;
use crate::page;
use crate::scene::Settings;
use std::time::Instant;

/// What there is to do.
pub struct Sweep<'a> {
    /// What all share.
    pub context: &'a TrialContext<'a>,
    /// The default first.
    pub candidates: &'a [Candidate],
    /// The frames that are held against the truth.
    pub frames: &'a [u32],
    /// Turns that are timed; one more comes before them.
    pub turns: u32,
    /// What denoises the frames of candidates that ask for it.
    pub denoiser: Option<&'a Denoiser>,
}

/// A candidate is about to be tried.
#[derive(Clone, Copy)]
pub struct SweepProgress<'a> {
    /// What was measured so far.
    pub ledger: &'a Ledger,
    /// Trials done so far.
    pub done: usize,
    /// All trials.
    pub of: usize,
    /// Which turn; 0 warms up.
    pub turn: u32,
    /// Whose turn it is.
    pub candidate: &'a Candidate,
    /// Seconds that are left, if anything is known of it.
    pub left: Option<f64>,
}

/// A candidate's picture of the frame that pictures are shown of.
#[derive(Debug, Clone)]
pub struct CandidatePicture {
    /// Index of its row.
    pub candidate: usize,
    /// The picture.
    pub picture: page::Picture,
}

impl Sweep<'_> {
    /// The frame that pictures are shown of: the one in the middle, which by default is inferred.
    pub fn shown_frame(&self) -> u32 {
        self.frames.get(self.frames.len() / 2).copied().unwrap_or(1)
    }

    /// How many display steps two of the best-sampled frames differ by, over √2: the error that is
    /// due to chance, below which the truth has to be known.
    ///
    /// # Errors
    /// As [`TrialContext::trace`].
    pub fn least_noise(&self) -> Result<f64> {
        let most = |c: &&Candidate| {
            let s = &c.settings;
            // A range comes near to the error of its upper end.
            samples(&Settings { spp: s.most_camera_samples(), most_spp: None, ..s.clone() })
        };
        let noisy = self.candidates.iter().filter(|c| !c.knob.is_denoised());
        let best = noisy.max_by_key(most);
        let Some(best) = best else { return Ok(0.0) };
        let frame = [self.shown_frame()];
        let mut frames = Vec::new();
        for turn in 0..2 {
            frames.push(self.try_one(best, turn, &frame)?.trial.frames);
        }
        Ok(super::errors::rms_between(&frames[0], &frames[1]) / 2f64.sqrt())
    }

    /// Tries every candidate in every turn, as far as `ledger` has not heard of it, and tells it.
    ///
    /// # Errors
    /// [`crate::error::Error::Stopped`]; those of building, rendering and writing, and of `hear`. What
    /// the ledger has by then stays there.
    pub fn run(
        &self,
        truth: &Truth,
        ledger: &mut Ledger,
        hear: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        let mut is_warm = false;
        for turn in 0..=self.turns {
            let mut open = order(self.candidates.len(), turn);
            open.retain(|candidate| !ledger.has(turn, *candidate));
            if open.is_empty() {
                continue;
            }
            if turn > 0 && !is_warm {
                self.heard(ledger, turn, 0, hear)?;
                self.try_one(&self.candidates[0], turn, self.frames)?;
            }
            is_warm = true;
            self.turn(truth, ledger, turn, &open, hear)?;
        }
        Ok(())
    }

    /// The `open` candidates of a turn.
    fn turn(
        &self,
        truth: &Truth,
        ledger: &mut Ledger,
        turn: u32,
        open: &[usize],
        hear: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        // The default goes first, also where an earlier run has had its turn: the others' pixels and
        // times are compared with its.
        self.heard(ledger, turn, 0, hear)?;
        let default = self.try_one(&self.candidates[0], turn, self.frames)?;
        for candidate in open {
            let own = match *candidate {
                0 => None,
                k => {
                    self.heard(ledger, turn, k, hear)?;
                    Some(self.try_one(&self.candidates[k], turn, self.frames)?)
                }
            };
            let tried = own.as_ref().unwrap_or(&default);
            let errors = Errors::of(&truth.frames, &tried.trial.frames, &tried.trial.cut)?;
            if turn == 0 {
                let image = &tried.trial.frames[&self.shown_frame()];
                ledger.keep_picture(*candidate, &page::Picture::png(image)?)?;
            }
            ledger.append(TrialRecord {
                turn,
                candidate: *candidate,
                errors: errors.into(),
                default_seconds: default.entry.seconds,
                change: Change::between(&default.trial.frames, &tried.trial.frames),
                ..tried.entry.clone()
            })?;
        }
        Ok(())
    }

    fn heard(
        &self,
        ledger: &Ledger,
        turn: u32,
        candidate: usize,
        hear: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        let left = self.seconds_left(ledger.entries());
        let candidate = &self.candidates[candidate];
        hear(SweepProgress {
            ledger,
            done: self.done(ledger),
            of: self.trials(),
            turn,
            candidate,
            left,
        })
    }

    /// Trials that there are in all.
    pub fn trials(&self) -> usize {
        self.candidates.len() * (self.turns as usize + 1)
    }

    /// Trials that `ledger` has.
    pub fn done(&self, ledger: &Ledger) -> usize {
        ledger.entries().iter().filter(|entry| entry.turn <= self.turns).count()
    }

    /// How long the trials take that are missing: a setting's last one tells of its next one, and by
    /// how many samples they take those that were tried tell of others. `None` before any was tried.
    fn seconds_left(&self, entries: &[TrialRecord]) -> Option<f64> {
        let work = |candidate: usize| samples(&self.candidates[candidate].settings) as f64;
        let all: f64 = entries.iter().map(|entry| entry.took).sum();
        let pace = all / entries.iter().map(|entry| work(entry.candidate)).sum::<f64>();
        let missing = |candidate: usize| {
            let own = || entries.iter().filter(move |entry| entry.candidate == candidate);
            let each = own().next_back().map_or(pace * work(candidate), |entry| entry.took);
            let turns = self.turns as usize + 1;
            turns.saturating_sub(own().filter(|entry| entry.turn <= self.turns).count()) as f64
                * each
        };
        let left: f64 = (0..self.candidates.len()).map(missing).sum();
        (!entries.is_empty() && left.is_finite()).then_some(left)
    }

    /// What `ledger` tells: a row for every candidate that was timed at least once, and their pictures;
    /// `None` before the default was.
    pub fn measured(&self, ledger: &Ledger) -> Option<(Measured, Vec<CandidatePicture>)> {
        let taken = |k: &usize| Taken::of(ledger.entries(), *k);
        let all: Vec<usize> = (0..self.candidates.len()).filter(|k| taken(k).is_timed()).collect();
        if all.first() != Some(&0) {
            return None;
        }
        let candidates: Vec<Candidate> = all.iter().map(|k| self.candidates[*k].clone()).collect();
        let measured = Measured::of(&candidates, &all.iter().map(taken).collect::<Vec<_>>());
        let picture = |(candidate, k): (usize, &usize)| {
            ledger.picture(*k).map(|picture| CandidatePicture { candidate, picture })
        };
        let pictures = all.iter().enumerate().filter_map(picture).collect();
        Some((measured, pictures))
    }

    fn try_one(&self, candidate: &Candidate, turn: u32, frames: &[u32]) -> Result<Tried> {
        let start = Instant::now();
        let seed = seed_of_turn(self.context.base.seed, turn);
        let settings = &Settings { seed, ..candidate.settings.clone() };
        let denoiser = self.denoiser.filter(|_| candidate.knob.is_denoised());
        // Other rules build another tree, one at a time: several would not fit beside a large scene.
        let own = self.context.own_intersector(settings)?;
        let build_seconds = match own {
            Some(_) => start.elapsed().as_secs_f64(),
            None => self.context.build_seconds,
        };
        let intersector = own.as_deref().map_or(self.context.intersector, |own| own as _);
        let trial = trial::run(self.context, settings, intersector, denoiser, frames)?;
        let entry = TrialRecord {
            seconds: trial.seconds,
            cpu_seconds: trial.cpu_seconds,
            build_seconds,
            took: start.elapsed().as_secs_f64(),
            rays: trial.rays,
            rays_per_frame: trial.rays_per_frame,
            camera_samples: trial.camera_samples,
            memory: trial.memory,
            ..TrialRecord::default()
        };
        Ok(Tried { trial, entry })
    }
}

/// A trial, and its figures.
struct Tried {
    trial: Trial,
    entry: TrialRecord,
}

/// Samples a pixel, of the camera and of the lights; roughly what a setting costs. A range counts as the geometric
/// mean of its ends.
fn samples(s: &Settings) -> u64 {
    let lights = u64::from(s.shadow_samples) + u64::from(s.sky_samples) + 1;
    let [least, most] = [s.spp, s.most_camera_samples()].map(u64::from);
    (least * most).isqrt() * lights
}

/// The default, then the others, in every second turn in reverse.
fn order(n: usize, turn: u32) -> Vec<usize> {
    let others: Vec<usize> = match turn % 2 {
        0 => (1..n).collect(),
        _ => (1..n).rev().collect(),
    };
    std::iter::once(0).chain(others).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_default_goes_first_and_every_candidate_once() {
        assert_eq!(super::order(4, 0), [0, 1, 2, 3]);
        assert_eq!(super::order(4, 1), [0, 3, 2, 1]);
        assert_eq!(super::order(1, 1), [0]);
    }
}
