//! All candidates, in turns.
//!
//! A shared machine changes its speed from minute to minute. So the candidates take turns, every
//! second turn in reverse, and a candidate's time is compared with the default's of the same turn.
//! The first turn warms up: its pictures count, its times do not. Each turn has a seed of its own,
//! the same for all candidates.

use super::errors::{Errors, Frames};
use super::knobs::Candidate;
use super::reference::{Truth, seed_of_turn};
use super::stage::Stage;
use super::table::{Change, Measured, Taken};
use super::trial::{self, Trial};
use crate::error::Result;
use crate::page;
use crate::scene::Settings;

/// What there is to do.
pub struct Sweep<'a> {
    /// What all share.
    pub stage: &'a Stage<'a>,
    /// The default first.
    pub candidates: &'a [Candidate],
    /// The frames that are held against the truth.
    pub frames: &'a [u32],
    /// Turns that are timed; one more comes before them.
    pub turns: u32,
}

/// A candidate is about to be tried.
#[derive(Debug, Clone, Copy)]
pub struct Heard<'a> {
    /// Trials done so far, and all that there will be.
    pub done: usize,
    /// All trials.
    pub of: usize,
    /// Which turn; 0 warms up.
    pub turn: u32,
    /// Whose turn it is.
    pub candidate: &'a Candidate,
}

/// A candidate's picture of the frame that pictures are shown of.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Index of the candidate.
    pub candidate: usize,
    /// The picture.
    pub picture: page::Picture,
}

impl Sweep<'_> {
    /// The frame that pictures are shown of: one that is inferred, if any is.
    pub fn shown_frame(&self) -> u32 {
        self.frames.get(1).or(self.frames.first()).copied().unwrap_or(1)
    }

    /// How many display steps two of the best-sampled frames differ by, over √2: the error that is
    /// due to chance, below which the truth has to be known.
    ///
    /// # Errors
    /// Those of building and rendering.
    pub fn least_noise(&self) -> Result<f64> {
        let samples = |s: &Settings| {
            let lights = u64::from(s.shadow_samples) + u64::from(s.sky_samples) + 1;
            u64::from(s.spp) * lights
        };
        let best = self.candidates.iter().max_by_key(|c| samples(&c.settings));
        let Some(best) = best else { return Ok(0.0) };
        let frame = [self.shown_frame()];
        let mut frames = Vec::new();
        for turn in 0..2 {
            let settings = self.with_seed(best, turn);
            frames.push(self.try_one(&settings, &frame)?.frames);
        }
        Ok(super::errors::rms_between(&frames[0], &frames[1]) / 2f64.sqrt())
    }

    /// Tries every candidate in every turn; gives the figures, and a picture of each candidate.
    ///
    /// # Errors
    /// [`crate::error::Error::Stopped`]; those of building and rendering.
    pub fn run(
        &self,
        truth: &Truth,
        heard: &mut dyn FnMut(Heard),
    ) -> Result<(Measured, Vec<Picture>)> {
        let n = self.candidates.len();
        let mut taken: Vec<Taken> = (0..n).map(|_| Taken::default()).collect();
        let mut pictures = Vec::new();
        let of = n * (self.turns as usize + 1);
        for turn in 0..=self.turns {
            // The default goes first: the others' pixels are compared with its.
            let mut default_frames = Frames::new();
            for (k, index) in order(n, turn).into_iter().enumerate() {
                let candidate = &self.candidates[index];
                heard(Heard { done: turn as usize * n + k, of, turn, candidate });
                let trial = self.try_one(&self.with_seed(candidate, turn), self.frames)?;
                let errors = Errors::of(&truth.frames, &trial.frames, &trial.cut)?;
                if turn == 0 {
                    let image = &trial.frames[&self.shown_frame()];
                    pictures
                        .push(Picture { candidate: index, picture: page::Picture::png(image)? });
                }
                if index == 0 {
                    default_frames.clone_from(&trial.frames);
                } else {
                    taken[index].change += Change::between(&default_frames, &trial.frames);
                }
                taken[index].add(turn, errors, &trial);
            }
        }
        pictures.sort_by_key(|p| p.candidate);
        Ok((Measured::of(self.candidates, &taken), pictures))
    }

    fn with_seed(&self, candidate: &Candidate, turn: u32) -> Settings {
        let seed = seed_of_turn(self.stage.base.seed, turn);
        Settings { seed, ..candidate.settings.clone() }
    }

    fn try_one(&self, settings: &Settings, frames: &[u32]) -> Result<Trial> {
        // Other rules build another tree, one at a time: several would not fit beside a large scene.
        match self.stage.own_intersector(settings)? {
            Some(own) => trial::run(self.stage, settings, &*own, frames),
            None => trial::run(self.stage, settings, self.stage.intersector, frames),
        }
    }
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
