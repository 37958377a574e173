//! A sweep: all candidates are rendered and timed, in turns.
//!
//! A shared machine changes its speed from minute to minute. So the candidates take turns, every
//! second turn in reverse, and a candidate's time is compared with the default's of the same turn.
//! The first turn warms up: its pictures count, its times do not. Each turn has a seed of its own,
//! the same for all candidates.

use super::context::TrialContext;
use super::errors::Errors;
use super::knobs::Candidate;
use super::ledger::{Ledger, TrialRecord};
use super::reference::{Truth, seed_of_turn};
use super::table::{Change, Measured, Taken};
use super::trial::{self, Trial};
use crate::error::Result;
use crate::page;
use crate::scene::Settings;
use std::time::Instant;

/// The candidates and frames of a sweep.
pub struct Sweep<'a> {
    /// The scene and everything needed to render it.
    pub context: &'a TrialContext<'a>,
    /// The candidates, the default first.
    pub candidates: &'a [Candidate],
    /// Numbers of the frames that are compared with the reference.
    pub frames: &'a [u32],
    /// Number of timed turns; the turn that warms up comes before them.
    pub turns: u32,
}

/// How far a sweep has come when a candidate is about to be tried.
#[derive(Clone, Copy)]
pub struct SweepProgress<'a> {
    /// The trials so far.
    pub ledger: &'a Ledger,
    /// Number of trials so far.
    pub done: usize,
    /// Number of trials of the whole sweep.
    pub of: usize,
    /// Number of the turn; 0 warms up.
    pub turn: u32,
    /// The candidate to be tried.
    pub candidate: &'a Candidate,
    /// Seconds that the sweep still takes; `None` before any trial.
    pub left: Option<f64>,
}

/// A candidate's picture of the frame shown on the page.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Index of the candidate's row.
    pub candidate: usize,
    /// The picture.
    pub picture: page::Picture,
}

impl Sweep<'_> {
    /// The frame shown on the page: the one in the middle, which by default is inferred.
    pub fn shown_frame(&self) -> u32 {
        self.frames.get(self.frames.len() / 2).copied().unwrap_or(1)
    }

    /// The noise of the candidate with the most samples: root mean square difference of two of its frames
    /// with different seeds, over √2, in display steps. The reference's error has to be smaller.
    ///
    /// # Errors
    /// As [`TrialContext::trace`].
    pub fn least_noise(&self) -> Result<f64> {
        let best = self.candidates.iter().max_by_key(|c| samples(&c.settings));
        let Some(best) = best else { return Ok(0.0) };
        let frame = [self.shown_frame()];
        let mut frames = Vec::new();
        for turn in 0..2 {
            let settings = self.with_seed(best, turn);
            frames.push(self.try_one(&settings, &frame)?.trial.frames);
        }
        Ok(super::errors::rms_between(&frames[0], &frames[1]) / 2f64.sqrt())
    }

    /// Tries every candidate in every turn, unless `ledger` has its trial; `report` is called after each.
    ///
    /// # Errors
    /// [`crate::error::Error::Stopped`]; errors of building, rendering and writing, and of `report`. The
    /// ledger keeps the trials before.
    pub fn run(
        &self,
        truth: &Truth,
        ledger: &mut Ledger,
        report: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        let mut is_warm = false;
        for turn in 0..=self.turns {
            let mut open = order(self.candidates.len(), turn);
            open.retain(|candidate| !ledger.has(turn, *candidate));
            if open.is_empty() {
                continue;
            }
            if turn > 0 && !is_warm {
                self.progress(ledger, turn, 0, report)?;
                self.try_one(&self.with_seed(&self.candidates[0], turn), self.frames)?;
            }
            is_warm = true;
            self.turn(truth, ledger, turn, &open, report)?;
        }
        Ok(())
    }

    /// Tries the candidates `open` in a turn.
    fn turn(
        &self,
        truth: &Truth,
        ledger: &mut Ledger,
        turn: u32,
        open: &[usize],
        report: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        // The default goes first, also where an earlier run has had its turn: the others' pixels and
        // times are compared with its.
        self.progress(ledger, turn, 0, report)?;
        let default = self.try_one(&self.with_seed(&self.candidates[0], turn), self.frames)?;
        for candidate in open {
            let own = match *candidate {
                0 => None,
                k => {
                    self.progress(ledger, turn, k, report)?;
                    Some(self.try_one(&self.with_seed(&self.candidates[k], turn), self.frames)?)
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

    fn progress(
        &self,
        ledger: &Ledger,
        turn: u32,
        candidate: usize,
        report: &mut dyn FnMut(SweepProgress) -> Result<()>,
    ) -> Result<()> {
        let left = self.seconds_left(ledger.entries());
        let candidate = &self.candidates[candidate];
        report(SweepProgress {
            ledger,
            done: self.done(ledger),
            of: self.trials(),
            turn,
            candidate,
            left,
        })
    }

    /// Number of trials of the whole sweep.
    pub fn trials(&self) -> usize {
        self.candidates.len() * (self.turns as usize + 1)
    }

    /// Number of this sweep's trials in `ledger`.
    pub fn done(&self, ledger: &Ledger) -> usize {
        ledger.entries().iter().filter(|entry| entry.turn <= self.turns).count()
    }

    /// Seconds that the missing trials take. A candidate takes as long as in its last trial; one without a
    /// trial as long as the others do for as many samples. `None` before any trial.
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

    /// The table of `ledger`, with a row for every candidate that was timed at least once, and the
    /// candidates' pictures; `None` before the default was timed.
    pub fn measured(&self, ledger: &Ledger) -> Option<(Measured, Vec<Picture>)> {
        let taken = |k: &usize| Taken::of(ledger.entries(), *k);
        let all: Vec<usize> = (0..self.candidates.len()).filter(|k| taken(k).is_timed()).collect();
        if all.first() != Some(&0) {
            return None;
        }
        let candidates: Vec<Candidate> = all.iter().map(|k| self.candidates[*k].clone()).collect();
        let measured = Measured::of(&candidates, &all.iter().map(taken).collect::<Vec<_>>());
        let picture = |(candidate, k): (usize, &usize)| {
            ledger.picture(*k).map(|picture| Picture { candidate, picture })
        };
        let pictures = all.iter().enumerate().filter_map(picture).collect();
        Some((measured, pictures))
    }

    fn with_seed(&self, candidate: &Candidate, turn: u32) -> Settings {
        let seed = seed_of_turn(self.context.base.seed, turn);
        Settings { seed, ..candidate.settings.clone() }
    }

    fn try_one(&self, settings: &Settings, frames: &[u32]) -> Result<Tried> {
        let start = Instant::now();
        // Other rules build another tree, one at a time: several would not fit beside a large scene.
        let own = self.context.own_intersector(settings)?;
        let build_seconds = match own {
            Some(_) => start.elapsed().as_secs_f64(),
            None => self.context.build_seconds,
        };
        let intersector = own.as_deref().map_or(self.context.intersector, |own| own as _);
        let trial = trial::run(self.context, settings, intersector, frames)?;
        let entry = TrialRecord {
            seconds: trial.seconds,
            cpu_seconds: trial.cpu_seconds,
            build_seconds,
            took: start.elapsed().as_secs_f64(),
            rays: trial.rays,
            rays_per_frame: trial.rays_per_frame,
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

/// Camera and light samples of a pixel: roughly what a setting costs.
fn samples(s: &Settings) -> u64 {
    let lights = u64::from(s.shadow_samples) + u64::from(s.sky_samples) + 1;
    u64::from(s.spp) * lights
}

/// The order of candidates in a turn: the default, then the others, in every second turn in reverse.
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
